// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures that an engineer reads at a glance.
//!
//! In: plain data with standard errors. Out: a [`Picture`], an SVG image from which its PNG is
//! made. Every axis has a unit, every picture its design and model in the heading, every
//! statistical curve a band of two standard errors. Letters are compiled in and nothing else is
//! read, so that the same data give the same bytes on every machine.
//!
//! In the SVG image groups of a curve carry its name (`data-curve`), axes their place and range
//! (`data-panel`, `data-x`, `data-y`), and marks a tooltip: the page of `batwing report` needs no
//! other drawing.

mod bars;
mod colours;
mod convergence;
mod dots;
pub(super) mod draw;
mod far_field;
mod film;
mod map;
mod near_field;
mod orders;
mod pareto;
mod sample_distribution;
mod search_convergence;
mod section;
mod seen;

pub use bars::{ShareBar, share_bars};
pub use colours::{colour_map, colour_over_angle};
pub use convergence::{ErrorCurve, Refinement, convergence};
pub use dots::{MarkedLine, marked_lines, published_vs_computed};
pub use draw::canvas::Picture;
pub use draw::colour::{Colour, glow};
pub use draw::line_colours::LineColours;
pub use draw::palette;
pub use draw::panel::{Mark, MarkKind};
pub use far_field::{FarField, element_far_fields, far_field_cartesian, far_field_polar};
pub use film::film;
pub use map::{
    BinImage, IlluminanceMap, LEVELS, LedOutline, MapScale, illuminance_map, map_on_scale,
    map_range,
};
pub use near_field::{NearFieldMap, near_field_map};
pub use orders::grating_lobes;
pub use pareto::pareto_front;
pub use sample_distribution::{MarkedValue, sample_distribution};
pub use search_convergence::search_convergence;
pub use section::{Section, cross_section};
pub use seen::{SeenPicture, seen};

/// Title of a picture of a receiver: `luminance of plate`, or the quantity alone of a receiver that
/// is called after it.
pub fn receiver_title(quantity: &str, name: &str) -> String {
    if name.eq_ignore_ascii_case(quantity) {
        return quantity.to_owned();
    }
    format!("{quantity} of {name}")
}

/// Title lines of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// Content: `Far field`.
    pub title: String,
    /// Design, model and what else tells this picture from its neighbours: `D1, hybrid, 10 µm`.
    pub subtitle: String,
}

impl Heading {
    /// A heading of two lines.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>) -> Self {
        Self { title: title.into(), subtitle: subtitle.into() }
    }
}
