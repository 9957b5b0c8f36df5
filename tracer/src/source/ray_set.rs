// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sets of rays as sources: rays of a ray file, sampled in proportion to their flux.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use rand::Rng;

use crate::error::Error;
use crate::random;
use crate::ray::Ray;
use crate::shape::Bounds;

/// One ray of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayRecord {
    /// Start point, mm.
    pub position: [f32; 3],
    /// Direction, a unit vector.
    pub direction: [f32; 3],
    /// Flux, in the unit of the file (W or lm).
    pub flux: f32,
    /// Wavelength, nm; NaN where the file has none for each ray.
    pub wavelength: f32,
}

/// Rays with their running flux; 32 bytes a ray, however often the set is turned and scaled.
#[derive(Debug, Clone, PartialEq)]
pub struct RaySet {
    records: Arc<Records>,
    /// From the frame of the records to that of the source: a rotation times a factor.
    placement: DMat3,
    /// The box around all starts.
    starts: Bounds,
}

/// Rays as they were given.
#[derive(Debug, PartialEq)]
struct Records {
    rays: Vec<[f32; 6]>,
    /// Numbers, from 0, of the records that were left out.
    left_out: Vec<u64>,
    /// Running sums of the flux.
    flux: Vec<f64>,
}

/// Start point of a ray.
fn start([x, y, z, ..]: &[f32; 6]) -> DVec3 {
    DVec3::new((*x).into(), (*y).into(), (*z).into())
}

impl RaySet {
    /// A set of rays; positions are relative to the source that emits them. Rays without flux are
    /// left out.
    pub fn new(records: impl IntoIterator<Item = RayRecord>) -> Result<Self, Error> {
        let (mut rays, mut flux, mut sum) = (Vec::new(), Vec::new(), 0.0);
        let mut left_out = Vec::new();
        for (number, record) in (0..).zip(records) {
            if record.flux > 0.0 {
                let ([x, y, z], [a, b, c]) = (record.position, record.direction);
                rays.push([x, y, z, a, b, c]);
                sum += f64::from(record.flux);
                flux.push(sum);
            } else {
                left_out.push(number);
            }
        }
        if rays.is_empty() {
            return Err(Error::TooFew { what: "rays with flux", expected: 1, got: 0 });
        }
        let starts = Bounds::of_points(rays.iter().map(start));
        let records = Arc::new(Records { rays, left_out, flux });
        Ok(Self { records, placement: DMat3::IDENTITY, starts })
    }

    /// The same rays, turned about the position of the source that emits them.
    #[must_use]
    pub fn turned(&self, rotation: &DMat3) -> Self {
        let placement = *rotation * self.placement;
        let starts = self.records.rays.iter().map(|ray| placement * start(ray));
        Self { starts: Bounds::of_points(starts), placement, records: self.records.clone() }
    }

    /// The same rays, turned and scaled as those of `other`.
    #[must_use]
    pub fn placed_as(&self, other: &Self) -> Self {
        self.turned(&other.placement)
    }

    /// The same rays, which start `factor` times as far from the position of the source.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let Bounds { low, high } = self.starts;
        Self {
            records: self.records.clone(),
            placement: self.placement * factor,
            starts: Bounds { low: factor * low, high: factor * high },
        }
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.records.rays.len()
    }

    /// True if there are none; never true.
    pub fn is_empty(&self) -> bool {
        self.records.rays.is_empty()
    }

    /// Flux of all rays, in the unit of the file.
    pub fn flux(&self) -> f64 {
        self.records.flux[self.len() - 1]
    }

    /// Draws a ray in proportion to its flux.
    #[inline]
    pub fn sample(&self, rng: &mut (impl Rng + ?Sized)) -> Ray {
        let level = random::unit(rng) * self.flux();
        let number = self.records.flux.partition_point(|f| *f <= level).min(self.len() - 1);
        self.ray(number)
    }

    /// Ray `number`, from 0, of those that carry flux.
    #[inline]
    pub(crate) fn ray(&self, number: usize) -> Ray {
        let ray = &self.records.rays[number];
        let [.., a, b, c] = ray.map(f64::from);
        Ray {
            origin: self.placement * start(ray),
            direction: (self.placement * DVec3::new(a, b, c)).normalize(),
        }
    }

    /// The place, from 1, of ray `number` among the records that the set was made of.
    pub(crate) fn record(&self, number: usize) -> usize {
        let mut record = number as u64;
        for left_out in &self.records.left_out {
            if *left_out > record {
                break;
            }
            record += 1;
        }
        record as usize + 1
    }

    /// The box around all starts.
    pub(crate) fn starts(&self) -> Bounds {
        self.starts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turned and scaled sets share their rays, which start and go where the turn and the factor take
    /// them.
    #[test]
    fn a_placed_set_shares_its_rays() {
        let record = |position: [f32; 3], flux: f32| RayRecord {
            position,
            direction: [0.6, 0.0, 0.8],
            flux,
            wavelength: f32::NAN,
        };
        let records = [record([0.5, -0.25, 1.0], 1.0), record([-1.5, 0.75, 0.125], 3.0)];
        let set = RaySet::new(records).expect("two rays");
        let rotation = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let placed = [set.turned(&rotation).scaled(1.6), set.scaled(1.6).turned(&rotation)];
        let alike = set.placed_as(&placed[0]);
        assert_eq!(alike.placement, placed[0].placement);
        assert!((alike.starts().low - placed[0].starts().low).length() < 1e-12);
        for placed in &placed {
            assert!(Arc::ptr_eq(&placed.records, &set.records));
            for number in 0..2 {
                let [plain, there] = [set.ray(number), placed.ray(number)];
                let DVec3 { x, y, z } = plain.origin;
                assert!((there.origin - 1.6 * DVec3::new(-y, x, z)).length() < 1e-15);
                assert!((there.direction - DVec3::new(0.0, 0.6, 0.8)).length() < 1e-7);
                assert!((there.direction.length() - 1.0).abs() < 1e-15);
                assert!((there.origin - plain.origin).length() > 0.5);
            }
            let Bounds { low, high } = placed.starts();
            assert!((low - 1.6 * DVec3::new(-0.75, -1.5, 0.125)).length() < 1e-15, "{low}");
            assert!((high - 1.6 * DVec3::new(0.25, 0.5, 1.0)).length() < 1e-15, "{high}");
        }
    }
}
