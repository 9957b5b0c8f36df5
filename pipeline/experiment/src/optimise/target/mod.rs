// SPDX-License-Identifier: MIT OR Apache-2.0
//! Targets of an objective: what a trace is to come near to, and how far it is from it.

mod far_field;
mod map;
mod rows;

use std::path::Path;

use anyhow::{Context, Result};

use files::bounded_text::{MAX_ROWS, bounded_text};
use files::provenance::FileRecord;
use metrics::JackknifedFigure;
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
    pub fn distance(&self, seen: &Observation) -> Result<JackknifedFigure> {
        match self {
            Self::FarField(target) => Ok(target.distance(seen)),
            Self::Map(target) => target.distance(seen),
        }
    }
}
