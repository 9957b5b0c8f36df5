// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays that have left the scene, gathered until there are enough to be sorted into bins together, which the processor does faster.

use glam::DVec3;

use super::Receiver;
use crate::ray::Ray;

/// Rays that are gathered.
pub const RAY_BUFFER: usize = 64;

/// Up to [`RAY_BUFFER`] rays with their weights, coordinate by coordinate.
#[derive(Debug, Clone)]
pub struct RayBuffer {
    /// Where they start, mm.
    pub origin: [[f64; RAY_BUFFER]; 3],
    /// Where they go.
    pub direction: [[f64; RAY_BUFFER]; 3],
    /// Their weights.
    pub weight: [f64; RAY_BUFFER],
    /// How many there are; entries from there on are of no meaning, but finite.
    pub count: usize,
}

impl Default for RayBuffer {
    fn default() -> Self {
        Self {
            origin: [[0.0; RAY_BUFFER]; 3],
            direction: [[0.0; RAY_BUFFER], [0.0; RAY_BUFFER], [1.0; RAY_BUFFER]],
            weight: [0.0; RAY_BUFFER],
            count: 0,
        }
    }
}

impl RayBuffer {
    /// One of the rays.
    #[inline]
    pub fn ray(&self, number: usize) -> Ray {
        let at = |list: &[[f64; RAY_BUFFER]; 3]| {
            DVec3::new(list[0][number], list[1][number], list[2][number])
        };
        Ray {
            origin: at(&self.origin),
            direction: at(&self.direction),
        }
    }

    /// Adds a ray; whether it is full now.
    #[inline]
    pub(crate) fn push(&mut self, ray: &Ray, weight: f64) -> bool {
        let k = self.count;
        for axis in 0..3 {
            self.origin[axis][k] = ray.origin[axis];
            self.direction[axis][k] = ray.direction[axis];
        }
        self.weight[k] = weight;
        self.count += 1;
        self.count == RAY_BUFFER
    }

    /// Adds the weights to the bins that `receivers` name, ray after ray, and forgets the rays.
    pub(crate) fn settle(
        &mut self,
        receivers: &[(usize, &dyn Receiver)],
        readings: &mut [Vec<f64>],
    ) {
        let mut bins = [None; RAY_BUFFER];
        for (number, receiver) in receivers {
            receiver.escaped_many(self, &mut bins);
            for (bin, weight) in bins.iter().zip(&self.weight).take(self.count) {
                if let Some(bin) = bin {
                    readings[*number][*bin] += weight;
                }
            }
        }
        self.count = 0;
    }
}
