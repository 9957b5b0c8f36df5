// SPDX-License-Identifier: MIT OR Apache-2.0
//! File formats of BSDFs, one module a format, through `Read`, `Write` and text; the caller opens
//! files.

pub mod lighttools;
pub mod native;
pub mod order_json;
pub mod speos;
pub mod text;
pub mod window;
pub mod zemax;
