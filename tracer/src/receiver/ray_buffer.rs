// SPDX-License-Identifier: MIT OR Apache-2.0
//! Segments of paths through the world, gathered until a receiver can sort many of them into bins
//! together.

use super::PathHistory;
use crate::optics::polarisation::Stokes;
use crate::ray::Ray;

/// Rays that are gathered.
pub const RAY_BUFFER: usize = 64;

/// The bin of every ray of a buffer.
pub type Bins = [u32; RAY_BUFFER];

/// No bin of a receiver.
pub const NO_BIN: u32 = u32::MAX;

/// Up to [`RAY_BUFFER`] rays with their lengths and weights, coordinate by coordinate.
#[derive(Debug, Clone)]
pub struct RayBuffer {
    /// Start points, mm.
    pub origin: [[f64; RAY_BUFFER]; 3],
    /// Directions.
    pub direction: [[f64; RAY_BUFFER]; 3],
    /// Lengths, mm; infinite where they leave the scene for good.
    pub length: [f64; RAY_BUFFER],
    /// Their weights.
    pub weight: [f64; RAY_BUFFER],
    /// Number of rays; entries from there on are of no meaning, but finite.
    pub count: usize,
    /// Pasts of their paths, where a filter asks for them.
    pub(super) history: Vec<PathHistory>,
    /// Their polarisation, where a receiver asks for it.
    pub(super) light: Vec<Stokes>,
}

impl Default for RayBuffer {
    fn default() -> Self {
        Self {
            origin: [[0.0; RAY_BUFFER]; 3],
            direction: [[0.0; RAY_BUFFER], [0.0; RAY_BUFFER], [1.0; RAY_BUFFER]],
            length: [0.0; RAY_BUFFER],
            weight: [0.0; RAY_BUFFER],
            count: 0,
            history: Vec::new(),
            light: Vec::new(),
        }
    }
}

impl RayBuffer {
    /// One of the rays.
    #[inline]
    pub fn ray(&self, number: usize) -> Ray {
        Ray::from_lane(&self.origin, &self.direction, number)
    }

    /// Adds a ray.
    #[inline]
    pub(super) fn push(&mut self, ray: &Ray, length: f64, weight: f64) {
        let k = self.count;
        ray.into_lane(&mut self.origin, &mut self.direction, k);
        self.length[k] = length;
        self.weight[k] = weight;
        self.count += 1;
    }

    /// Forgets the rays.
    pub(super) fn clear(&mut self) {
        self.count = 0;
        self.history.clear();
        self.light.clear();
    }
}
