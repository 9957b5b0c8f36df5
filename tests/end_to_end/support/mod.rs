// SPDX-License-Identifier: MIT OR Apache-2.0
//! Runs of the binary, and what they leave behind.

pub mod binary;
pub mod grating;
pub mod pictures;
pub mod runs;
