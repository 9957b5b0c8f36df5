// SPDX-License-Identifier: MIT OR Apache-2.0
//! Table of diffraction orders as JSON.

pub mod layout;

use crate::text::utf8;

use super::sniff::Sniff;
use super::{Reader, Reads, Writer, Writes};

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a table of orders as JSON",
    endings: &["json"],
    sniff: Sniff::Markup(|text| text.starts_with('{') && text.contains(layout::NAME)),
    reads: Reads::Orders(|bytes| layout::read(utf8(bytes)?)),
};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "json",
    help: "Table of orders: JSON, .json",
    endings: &["json"],
    writes: Writes::Orders(|table, file| Ok(layout::write(table, file)?)),
};
