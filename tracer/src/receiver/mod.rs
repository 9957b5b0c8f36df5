// SPDX-License-Identifier: MIT OR Apache-2.0
//! Receivers: which bin a ray belongs to. They know geometry and nothing of what is derived from the bins.
//!
//! A receiver is asked about every free flight through the world and every escape; the run adds the power of the ray to
//! the bin it names. The sums come back, in watts for each bin, in [`crate::Totals::readings`], one set for each group of paths.

mod far_field;
mod plane;

pub use far_field::FarField;
pub use plane::PlaneMap;

use crate::error::Error;
use crate::ray::Ray;

/// Sorts rays into bins.
pub trait Receiver: Sync {
    /// Number of bins.
    fn bins(&self) -> usize;

    /// The bin for a ray that leaves the scene for good.
    fn escaped(&self, _ray: &Ray) -> Option<usize> {
        None
    }

    /// The bin for a ray that flies `length` mm through the world (infinite if it meets nothing more).
    fn crossed(&self, _ray: &Ray, _length: f64) -> Option<usize> {
        None
    }

    /// Whether the receiver fits a scene whose bodies reach up to `top_mm` (-∞ if there are none).
    fn check(&self, _top_mm: f64) -> Result<(), Error> {
        Ok(())
    }
}
