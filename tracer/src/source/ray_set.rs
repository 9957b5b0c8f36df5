// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sets of rays as sources: rays of a ray file, sampled in proportion to their flux.

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

/// Rays with their running flux; 36 bytes a ray.
#[derive(Debug, Clone, PartialEq)]
pub struct RaySet {
    rays: Vec<[f32; 6]>,
    /// Numbers, from 0, of the records that were left out.
    left_out: Vec<u64>,
    /// Running sums of the flux.
    flux: Vec<f64>,
    /// The box around all starts.
    starts: Bounds,
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
        Ok(Self { rays, left_out, flux, starts })
    }

    /// The same rays, turned about the position of the source that emits them.
    #[must_use]
    pub fn turned(&self, rotation: &DMat3) -> Self {
        let turn = |ray: &[f32; 6]| {
            let at = *rotation * start(ray);
            let [.., a, b, c] = ray.map(f64::from);
            let way = *rotation * DVec3::new(a, b, c);
            let [at, way] = [at, way].map(|v| v.as_vec3().to_array());
            [at[0], at[1], at[2], way[0], way[1], way[2]]
        };
        let rays: Vec<[f32; 6]> = self.rays.iter().map(turn).collect();
        let starts = Bounds::of_points(rays.iter().map(start));
        Self { rays, starts, ..self.clone() }
    }

    /// The same rays, which start `factor` times as far from the position of the source.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        for along in scaled.rays.iter_mut().flat_map(|ray| &mut ray[..3]) {
            *along = (factor * f64::from(*along)) as f32;
        }
        scaled.starts = Bounds::of_points(scaled.rays.iter().map(start));
        scaled
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// True if there are none; never true.
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
        let number = self.flux.partition_point(|f| *f <= level).min(self.rays.len() - 1);
        self.ray(number)
    }

    /// Ray `number`, from 0, of those that carry flux.
    #[inline]
    pub(crate) fn ray(&self, number: usize) -> Ray {
        let [x, y, z, a, b, c] = self.rays[number].map(f64::from);
        Ray { origin: DVec3::new(x, y, z), direction: DVec3::new(a, b, c).normalize() }
    }

    /// The place, from 1, of ray `number` among the records that the set was made of.
    pub(crate) fn record(&self, number: usize) -> usize {
        let mut record = number as u64;
        for left_out in &self.left_out {
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
