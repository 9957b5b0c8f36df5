// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of this program: arrays, tables and images that hold their quantity, unit and axes, and tables
//! of diffraction orders, kept between runs.
//!
//! | module | holds |
//! |---|---|
//! | [`npy`] | arrays of NumPy |
//! | [`csv`] | columns with headings, and arrays beside them |
//! | [`order_tables`], [`cache`] | tables of orders, and those kept under the hash of all they depend on |
//! | [`exr`], [`exr_layers`] | OpenEXR, one channel or layer a quantity |

pub mod cache;
pub mod csv;
pub mod exr;
pub mod exr_layers;
pub mod npy;
pub mod order_tables;
