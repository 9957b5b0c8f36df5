// SPDX-License-Identifier: MIT OR Apache-2.0
//! Targets of an objective: what a trace is to come near to, and how far it is from it.

mod far_field;
mod map;
mod rows;

use std::path::Path;

use anyhow::{Context, Result};

use design::Design;
use metrics::{Grouped, JackknifedFigure, without_noise};
use results::figure_entry::FigureEntry;
use results::paired_figure::PairedFigure;
use runtime::bounded_text::{MAX_ROWS, bounded_text};
use runtime::provenance::FileRecord;
use simulate::lit;
use simulate::observation::Observation;

use self::far_field::FarFieldTarget;
use self::map::MapTarget;

/// Figure of the distance to a target far field.
const FAR_FIELD_DISTANCE: &str = "far_field_distance";
/// Figure of the distance to a target map.
const MAP_DISTANCE: &str = "illuminance_distance";
/// Figures that need a file with their target.
pub(super) const DISTANCES: [&str; 2] = [FAR_FIELD_DISTANCE, MAP_DISTANCE];

/// Target that a trace is to come near to.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Target {
    FarField(FarFieldTarget),
    Map(MapTarget),
}

impl Target {
    /// The target of `figure`, one of [`DISTANCES`], and the record of its file.
    ///
    /// # Errors
    /// A file that cannot be read, or has lines of another kind.
    pub fn read(figure: &str, path: &Path) -> Result<(Self, FileRecord)> {
        let file = || format!("`{}`", path.display());
        let text =
            bounded_text(path, MAX_ROWS).with_context(|| format!("{}: cannot be read", file()))?;
        let target = match figure {
            FAR_FIELD_DISTANCE => FarFieldTarget::parse(&text).map(Self::FarField),
            _ => MapTarget::parse(&text).map(Self::Map),
        };
        let record = FileRecord::new(path.display().to_string(), text.as_bytes());
        Ok((target.with_context(file)?, record))
    }

    /// Root mean square difference of what is `seen` from the target, over the root mean square of
    /// the target; both scaled alike.
    ///
    /// # Errors
    /// A map that has no bins where the target has light.
    pub fn distance(&self, design: &Design, seen: &Observation) -> Result<PairedFigure> {
        match self {
            Self::FarField(target) => Ok(target.distance(seen)),
            Self::Map(target) => target.distance(seen, lit::of_plane(design).as_ref()),
        }
    }
}

/// Root mean square difference of `light` from `target` over its bins by `weights`, both scaled to
/// the same sum; 1 is the root mean square of the target. With the scale s of the light L, the
/// square is s² L·L - 2 s L·T + T·T, where L·L is free of the noise of the bins. No light has 1.
fn distance(light: &Grouped, target: &[f64], weights: &[f64]) -> PairedFigure {
    let product = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).zip(weights).map(|((a, b), weight)| weight * a * b).sum()
    };
    let sum = |light: &[f64]| light.iter().zip(weights).map(|(l, weight)| l * weight).sum::<f64>();
    let (total, of_target) = (light.total(), product(target, target));
    let square = |own: f64, squared: f64, mixed: f64| {
        if own <= 0.0 {
            return 1.0;
        }
        let scale = sum(target) / own;
        (scale * scale * squared - 2.0 * scale * mixed) / of_target + 1.0
    };
    let (own, mixed, of_total) = (sum(total), product(total, target), product(total, total));
    let count = light.count();
    let groups: Vec<&[f64]> = (0..count).map(|g| light.group(g)).collect();
    let squares: f64 = groups.iter().map(|group| product(group, group)).sum();
    let without = groups.iter().map(|group| {
        let squared = product(group, group);
        let rest = of_total - 2.0 * product(total, group) + squared;
        let rest = without_noise(rest, squares - squared, count - 1);
        square(own - sum(group), rest, mixed - product(group, target))
    });
    let squared = square(own, without_noise(of_total, squares, count), mixed);
    let squared = JackknifedFigure::new(squared, without.collect());
    let root = |square: f64| square.max(0.0).sqrt();
    PairedFigure {
        entry: FigureEntry::new(squared.estimate().mapped(f64::sqrt)),
        without: squared.without.into_iter().map(root).collect(),
    }
}
