// SPDX-License-Identifier: MIT OR Apache-2.0
//! Receivers: which bin light belongs to. They know geometry and nothing of what is derived from
//! the bins.
//!
//! A run shows every receiver the segments of paths through the world, or the surfaces that they
//! meet. The receiver names a bin, its [`Filter`] decides by the past of the path, and the run adds
//! the power. Filters leave light out and draw nothing, so receivers whose filters divide the light
//! between them add up to the one without. The sums come back in [`crate::Totals::readings`], in
//! watts for each bin, one set for each group of paths.

mod angles;
mod coplanar;
mod detector;
mod far_field;
mod filter;
mod plane;
mod ray_buffer;
mod rectangle;
mod tally;

pub use angles::{Angles, Layout};
pub use detector::{Detector, FLUX_BINS, Measurement, STOKES};
pub use far_field::FarField;
pub(crate) use filter::PathHistory;
pub use filter::{Filter, underscored};
pub use plane::PlaneMap;
pub use ray_buffer::{Bins, NO_BIN, RAY_BUFFER, RayBuffer};
pub use rectangle::{DetectorRectangle, Facing, Sense};
pub(crate) use tally::{Receivers, Tally};

use glam::DVec3;

use crate::error::{Error, check};
use crate::ray::Ray;
use crate::scene::Scene;

/// Light that a receiver reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs<'a> {
    /// Segments of paths through the world, those that leave the scene for good among them.
    Segments,
    /// Segments that leave the scene for good.
    Escapes,
    /// Interactions with the surfaces of this name in the ledger, binned as [`FLUX_BINS`] says.
    Surface(&'a str),
}

/// Sorts light into bins.
pub trait Receiver: Sync {
    /// Number of bins, those of all Stokes parameters together.
    fn bins(&self) -> usize;

    /// Light that it reads.
    fn needs(&self) -> Needs<'_> {
        Needs::Segments
    }

    /// The bin of a ray that travels `length` mm through the world, infinite where it leaves the
    /// scene for good.
    fn bin(&self, ray: &Ray, length: f64) -> Option<usize>;

    /// The bins of many rays, as [`Receiver::bin`] names them; [`NO_BIN`] where it names none.
    fn bin_many(&self, rays: &RayBuffer, bins: &mut Bins) {
        bin_each(self, rays, bins);
    }

    /// Filter of the light that it reads; `None` for all.
    fn filter(&self) -> Option<&Filter> {
        None
    }

    /// The vector a for which a × k is along s, if it reads the Stokes parameters of light along k.
    fn stokes_axis(&self) -> Option<DVec3> {
        None
    }

    /// Checks that it fits the scene.
    ///
    /// # Errors
    /// A receiver that cuts a body, or names what the scene does not have.
    fn check(&self, _scene: &Scene) -> Result<(), Error> {
        Ok(())
    }
}

/// The bins of rays, one ray after the other.
fn bin_each(receiver: &(impl Receiver + ?Sized), rays: &RayBuffer, bins: &mut Bins) {
    for (number, bin) in bins.iter_mut().enumerate().take(rays.count) {
        let found = receiver.bin(&rays.ray(number), rays.length[number]);
        *bin = found.map_or(NO_BIN, |bin| bin as u32);
    }
}

impl Scene {
    /// Checks that a receiver fits the scene.
    ///
    /// # Errors
    /// Same as [`Receiver::check`], and more bins than [`Bins`] can name.
    pub fn admits(&self, receiver: &dyn Receiver) -> Result<(), Error> {
        let bins = receiver.bins();
        check(
            "bins of a receiver",
            bins as f64,
            "at most 4294967295",
            u32::try_from(bins).is_ok(),
        )?;
        receiver.check(self)
    }
}
