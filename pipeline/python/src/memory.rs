// SPDX-License-Identifier: MIT OR Apache-2.0
//! Memory that a computation may take.

pub use rcwa::guard::free_bytes;
