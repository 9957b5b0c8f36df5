// SPDX-License-Identifier: MIT OR Apache-2.0
//! Receivers: which bin a ray belongs to. They know geometry and nothing of what is derived from the bins.
//!
//! A receiver is asked about every free flight through the world and every escape; the run adds the power of the ray to
//! the bin it names. [`Detector`]s look on at whole paths instead and can filter light by where it came from. The sums come back, in watts for each bin, in [`crate::Totals::readings`], one set for each group of paths.

mod angles;
mod coplanar;
mod detector;
mod detector_tally;
mod far_field;
mod plane;
mod ray_buffer;
mod rectangle;

pub use angles::{Angles, Layout};
pub use detector::{Detector, FLUX_BINS, Filter, Measurement, STOKES};
pub(crate) use detector_tally::DetectorTally;
pub use far_field::FarField;
pub use plane::PlaneMap;
pub use ray_buffer::{RAY_BUFFER, RayBuffer};
pub use rectangle::{DetectorRectangle, Facing, Sense};

use crate::error::Error;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::shape::Bounds;

/// What a receiver is to be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// Free flights through the world, by [`Receiver::crossed`].
    pub flights: bool,
    /// Rays that leave the scene for good, by [`Receiver::escaped`].
    pub escapes: bool,
}

/// Sorts rays into bins.
pub trait Receiver: Sync {
    /// Number of bins.
    fn bins(&self) -> usize;

    /// Whether it asks for free flights, and whether for escapes; what it does not ask for it is not shown.
    fn needs(&self) -> Needs {
        Needs {
            flights: true,
            escapes: true,
        }
    }

    /// The bin for a ray that leaves the scene for good.
    fn escaped(&self, _ray: &Ray) -> Option<usize> {
        None
    }

    /// The bins for rays that leave the scene for good, as [`Receiver::escaped`] names them; entries beyond the number of rays may hold anything.
    fn escaped_many(&self, rays: &RayBuffer, bins: &mut [Option<usize>; RAY_BUFFER]) {
        for (number, bin) in bins.iter_mut().enumerate().take(rays.count) {
            *bin = self.escaped(&rays.ray(number));
        }
    }

    /// The bin for a ray that flies `length` mm through the world (infinite if it meets nothing more).
    fn crossed(&self, _ray: &Ray, _length: f64) -> Option<usize> {
        None
    }

    /// Whether the receiver passes through a box.
    fn cuts(&self, _around: &Bounds) -> bool {
        false
    }

    /// Whether the receiver fits a scene whose bodies reach up to `top_mm` (-∞ if there are none).
    fn check(&self, _top_mm: f64) -> Result<(), Error> {
        Ok(())
    }
}

impl Scene {
    /// Whether a receiver fits the scene.
    ///
    /// # Errors
    /// A plane that is not above the packages, or that cuts the array solids.
    pub fn admits(&self, receiver: &dyn Receiver) -> Result<(), Error> {
        receiver.check(self.top_mm())?;
        for around in self.array_solids().into_iter().flat_map(|body| &body.boxes) {
            if receiver.cuts(around) {
                return Err(Error::ReceiverCuts {
                    receiver: "plane".to_owned(),
                    low_mm: around.low.to_array(),
                    high_mm: around.high.to_array(),
                });
            }
        }
        Ok(())
    }
}
