// SPDX-License-Identifier: MIT OR Apache-2.0
//! File formats: one file a format, reading and writing and nothing else. Opening files is the caller's business.

pub mod lighttools;
pub mod native;
pub mod order_json;
pub mod text;
pub mod window;
pub mod zemax;
