// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far field in the XML of TM-33 and ATLA S001.

pub mod layout;

use super::sniff::Sniff;
use super::{Reader, Reads, ies};

/// Reads the format.
pub static READER: Reader = Reader {
    name: "TM-33/ATLA XML",
    endings: &["xml"],
    sniff: Sniff::Markup(|text| {
        text.starts_with('<') && layout::ROOTS.iter().any(|root| text.contains(&format!("<{root}")))
    }),
    reads: Reads::FarField(|text| Ok(ies::far_field("TM-33/ATLA XML", layout::read(text)?))),
};
