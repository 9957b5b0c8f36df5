// SPDX-License-Identifier: MIT OR Apache-2.0
//! The registry of figures of merit: key, names, unit, sums that a figure is read from, and how it
//! is compared.
//!
//! Results, targets of studies, objectives, stopping rules, terminal and page take all of this from
//! here. A form of uniformity over a region is a line of [`FORMS`] beside its formula, and is
//! registered by that line.

use super::quantity::Unit;
use super::uniformity_forms::{FORMS, RegionForm};

/// Sums that a figure is read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Far field.
    FarField,
    /// Illuminance map between neighbours.
    Map,
    /// Flows through the surfaces of the domes.
    Domes,
    /// Tristimulus values at points of the cell.
    Colours,
}

/// Definition of a figure of merit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Definition {
    /// Key in `results.json`.
    pub key: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// Heading in the page's table of the paper's figures; `None` of a figure that is not there.
    pub heading: Option<&'static str>,
    /// Unit of the stored value.
    pub unit: Unit,
    /// Sums that it is read from.
    pub source: Source,
    /// Default scale of its misses in studies; `None` of a figure that is no target.
    pub scale: Option<f64>,
    /// True if its change decides whether wavelengths are added.
    pub adds_wavelengths: bool,
}

impl Definition {
    /// True where the larger of two values is better, false where the smaller is; `None` where
    /// neither is.
    pub fn larger_is_better(&self) -> Option<bool> {
        match self.source {
            Source::Domes => Some(true),
            Source::Map => Some(!self.key.ends_with("_variation")),
            Source::Colours => Some(false),
            Source::FarField => None,
        }
    }

    /// Largest value that a target may have, and the words for its unit.
    pub fn largest_target(&self) -> (f64, &'static str) {
        match self.unit {
            Unit::Degree => (180.0, "degrees"),
            _ => (1.0, "a fraction"),
        }
    }
}

/// Scale of the forms of uniformity: that of valley/peak.
const FORM_SCALE: f64 = 0.03;

/// A figure of the paper's tables; scales are about the precision of the published figures.
const fn papers(
    key: &'static str,
    [label, heading]: [&'static str; 2],
    unit: Unit,
    source: Source,
    scale: f64,
) -> Definition {
    let heading = Some(heading);
    Definition { key, label, heading, unit, source, scale: Some(scale), adds_wavelengths: true }
}

/// Polar angle of the largest intensity.
pub const PEAK_ANGLE: Definition =
    papers("peak_angle_deg", ["peak angle"; 2], Unit::Degree, Source::FarField, 5.0);
/// Intensity on the axis over the largest.
pub const CENTRE_TO_PEAK: Definition = papers(
    "centre_to_peak",
    ["centre/peak", "centre / peak"],
    Unit::Fraction,
    Source::FarField,
    0.06,
);
/// Peak angle between bins, of designs that read it as the middle of a bin.
pub const PARABOLA: Definition = Definition {
    key: "peak_angle_parabola_deg",
    label: "peak angle, parabola",
    heading: None,
    unit: Unit::Degree,
    source: Source::FarField,
    scale: None,
    adds_wavelengths: false,
};
/// The paper's uniformity, along rows and columns.
pub const UNIFORMITY: Definition =
    papers("uniformity", ["uniformity"; 2], Unit::Fraction, Source::Map, 0.02);
/// The paper's uniformity, across the diagonal of four LEDs.
pub const UNIFORMITY_DIAGONAL: Definition = Definition {
    adds_wavelengths: false,
    ..papers("uniformity_diagonal", ["uniformity, diagonal"; 2], Unit::Fraction, Source::Map, 0.02)
};
/// Darkest place between neighbours over the largest illuminance.
pub const VALLEY_TO_PEAK: Definition = Definition {
    adds_wavelengths: false,
    ..papers(
        "illuminance_valley_to_peak",
        ["illuminance valley/peak", "illuminance valley / peak"],
        Unit::Fraction,
        Source::Map,
        FORM_SCALE,
    )
};
/// Power that leaves the silicone for good, per power emitted.
pub const EXTRACTION: Definition =
    papers("extraction_efficiency", ["extraction"; 2], Unit::Fraction, Source::Domes, 0.01);

/// Largest distance between the chromaticities of two of the nine points of the cell.
pub const COLOUR_DIFFERENCE: Definition = Definition {
    key: "cell_colour_difference",
    label: "colour difference \u{394}u'v', cell",
    heading: None,
    unit: Unit::Relative,
    source: Source::Colours,
    scale: None,
    adds_wavelengths: false,
};

/// Figures of a far field, in the order in which they are read.
pub const FAR_FIELD: [Definition; 3] = [PEAK_ANGLE, CENTRE_TO_PEAK, PARABOLA];
/// The paper's figures of a map, in the order in which they are read.
pub const PAPERS_MAP: [Definition; 3] = [UNIFORMITY, UNIFORMITY_DIAGONAL, VALLEY_TO_PEAK];

/// The figure of a form of uniformity.
pub fn of_form(form: RegionForm) -> Definition {
    Definition {
        key: form.key,
        label: form.label,
        heading: None,
        unit: Unit::Fraction,
        source: Source::Map,
        scale: Some(FORM_SCALE),
        adds_wavelengths: false,
    }
}

/// All figures: those of the paper's tables in their order, the other forms of uniformity, the
/// colour difference.
pub fn all() -> impl Iterator<Item = Definition> {
    let forms = FORMS.into_iter().map(of_form);
    let papers = FAR_FIELD.into_iter().chain(PAPERS_MAP).chain([EXTRACTION]);
    papers.chain(forms).chain([COLOUR_DIFFERENCE])
}

/// The figure under `key`.
pub fn find(key: &str) -> Option<Definition> {
    all().find(|figure| figure.key == key)
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::collections::BTreeSet;

    #[test]
    fn keys_are_unique() {
        let keys: BTreeSet<&str> = all().map(|figure| figure.key).collect();
        assert_eq!(keys.len(), all().count());
    }

    #[test]
    fn the_reference_names_every_figure() {
        let text = include_str!("../../../docs/reference/results-schema.md");
        let rows = text.lines().filter_map(|line| line.strip_prefix("| "));
        let first_cells: Vec<&str> = rows.filter_map(|row| row.split(" | ").next()).collect();
        let named = |word: &str| {
            let quoted = format!("`{word}`");
            first_cells.iter().any(|cell| cell.contains(&quoted))
        };
        for figure in all() {
            // Forms of uniformity stand there as `<region>_<form>`.
            let parts = figure.key.split_once('_').map(|(region, form)| [region, form]);
            let by_parts = parts.is_some_and(|parts| parts.into_iter().all(named));
            assert!(named(figure.key) || by_parts, "{}", figure.key);
        }
    }
}
