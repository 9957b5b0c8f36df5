// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays that have left the scene, gathered until there are enough to be sorted into bins together, which the processor does faster.

use glam::DVec3;

use super::Receiver;
use crate::ray::Ray;

/// Rays that are gathered.
pub const FLOCK: usize = 64;

/// Up to [`FLOCK`] rays with their weights, coordinate by coordinate.
#[derive(Debug, Clone)]
pub struct Flock {
    /// Where they start, mm.
    pub origin: [[f64; FLOCK]; 3],
    /// Where they go.
    pub direction: [[f64; FLOCK]; 3],
    /// Their weights.
    pub weight: [f64; FLOCK],
    /// How many there are; entries from there on are of no meaning, but finite.
    pub count: usize,
}

impl Default for Flock {
    fn default() -> Self {
        Self {
            origin: [[0.0; FLOCK]; 3],
            direction: [[0.0; FLOCK], [0.0; FLOCK], [1.0; FLOCK]],
            weight: [0.0; FLOCK],
            count: 0,
        }
    }
}

impl Flock {
    /// One of the rays.
    #[inline]
    pub fn ray(&self, number: usize) -> Ray {
        let at = |list: &[[f64; FLOCK]; 3]| {
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
        self.count == FLOCK
    }

    /// Adds the weights to the bins that `receivers` name, ray after ray, and forgets the rays.
    pub(crate) fn settle(
        &mut self,
        receivers: &[(usize, &dyn Receiver)],
        readings: &mut [Vec<f64>],
    ) {
        let mut bins = [None; FLOCK];
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
