// SPDX-License-Identifier: MIT OR Apache-2.0
//! Experiments.

pub mod design_file;
pub mod optimise;
pub mod ring_slopes;
pub mod study;
pub mod tolerance;
