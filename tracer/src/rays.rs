// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sets of rays as sources: those of a ray file, drawn in proportion to their flux.

use glam::DVec3;
use rand::Rng;

use crate::error::Error;
use crate::format::rays::RayRecord;
use crate::random;
use crate::ray::Ray;

/// Rays with their running flux; 36 bytes a ray.
#[derive(Debug, Clone, PartialEq)]
pub struct RaySet {
    rays: Vec<[f32; 6]>,
    /// Running sums of the flux.
    flux: Vec<f64>,
}

impl RaySet {
    /// A set of rays; positions are relative to the source that emits them. Rays without flux are left out.
    pub fn new(records: impl IntoIterator<Item = RayRecord>) -> Result<Self, Error> {
        let (mut rays, mut flux, mut sum) = (Vec::new(), Vec::new(), 0.0);
        for record in records {
            if record.flux > 0.0 {
                let ([x, y, z], [a, b, c]) = (record.position, record.direction);
                rays.push([x, y, z, a, b, c]);
                sum += f64::from(record.flux);
                flux.push(sum);
            }
        }
        if rays.is_empty() {
            return Err(Error::TooFew {
                what: "rays with flux",
                expected: 1,
                got: 0,
            });
        }
        Ok(Self { rays, flux })
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether there are none; never true.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// Flux of all rays, in the unit of the file.
    pub fn flux(&self) -> f64 {
        self.flux[self.flux.len() - 1]
    }

    /// Draws a ray in proportion to its flux.
    #[inline]
    pub fn sample(&self, rng: &mut (impl Rng + ?Sized)) -> Ray {
        let level = random::unit(rng) * self.flux();
        let number = self
            .flux
            .partition_point(|f| *f <= level)
            .min(self.rays.len() - 1);
        let [x, y, z, a, b, c] = self.rays[number].map(f64::from);
        Ray {
            origin: DVec3::new(x, y, z),
            direction: DVec3::new(a, b, c).normalize(),
        }
    }
}
