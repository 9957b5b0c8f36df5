// SPDX-License-Identifier: MIT OR Apache-2.0
//! Native table of diffraction orders.

use arrays::order_tables::{EXTENSION, read_table};

use super::sniff::Sniff;
use super::{Reader, Reads};

/// Reads the format.
pub static READER: Reader = Reader {
    name: "a native table of orders",
    endings: &[EXTENSION],
    sniff: Sniff::Mark(|start| start.starts_with(b"BWORDERS")),
    reads: Reads::OrdersOfFile(read_table),
};
