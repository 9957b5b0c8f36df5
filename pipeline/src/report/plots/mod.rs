// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures that an engineer reads at a glance.
//!
//! In: plain data with standard errors. Out: the bytes of a PNG file (write them with
//! [`write_bytes`](crate::atomic_file::write_bytes)). Every axis has a unit, every picture its design and model in the heading, every
//! statistical curve a band of two standard errors. Letters are compiled in and nothing else is read, so that the same data
//! give the same bytes on every machine.

mod comparison;
mod convergence;
mod draw;
mod far_field;
mod map;
mod marked_lines;
mod near_field;
mod orders;
mod section;

pub use comparison::published_vs_computed;
pub use convergence::{ErrorCurve, Refinement, convergence};
pub use draw::colour::LineColours;
pub use far_field::{FarField, element_far_fields, far_field_cartesian, far_field_polar};
pub use map::{IlluminanceMap, Led, MapMark, illuminance_map};
pub use marked_lines::{MarkedLine, marked_lines};
pub use near_field::{NearFieldMap, near_field_map};
pub use orders::{LobeSide, PlaneLobe, grating_lobes};
pub use section::{Mark, MarkKind, Section, cross_section};

/// Title lines of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// What is shown: `Far field`.
    pub title: String,
    /// Design, model and what else tells this picture from its neighbours: `D1, hybrid, 10 µm`.
    pub subtitle: String,
}

impl Heading {
    /// A heading of two lines.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            subtitle: subtitle.into(),
        }
    }
}
