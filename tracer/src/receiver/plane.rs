// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance on a horizontal plane above the packages: transparent, counts what passes upwards.

use glam::DVec3;

use super::{Bins, DetectorRectangle, Facing, RayBuffer, Receiver, Sense};
use crate::error::{Error, check, finite, positive};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::shape::Bounds;

/// A rectangle of square bins at one height. Bin number = row along y · number of columns + column
/// along x. Light that starts on the plane counts, light that ends on it does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneMap {
    rectangle: DetectorRectangle,
    height: f64,
    bin: f64,
}

impl PlaneMap {
    /// `columns` × `rows` square bins of width `bin_mm`, centred on the axis x = y = 0, at z =
    /// `height_mm`.
    pub fn centred(
        height_mm: f64,
        bin_mm: f64,
        columns: usize,
        rows: usize,
    ) -> Result<Self, Error> {
        finite("height of the plane receiver, mm", height_mm)?;
        positive("bin width of the plane receiver, mm", bin_mm)?;
        for count in [columns, rows] {
            check(
                "bins of the plane receiver along one axis",
                count as f64,
                "1 to 20000",
                (1..=20_000).contains(&count),
            )?;
        }
        Ok(Self {
            rectangle: DetectorRectangle::new(
                Facing::Z(Sense::Plus),
                DVec3::new(0.0, 0.0, height_mm),
                [columns, rows].map(|count| bin_mm * count as f64),
                [columns, rows],
            )?,
            height: height_mm,
            bin: bin_mm,
        })
    }

    /// Bins along x.
    pub fn columns(&self) -> usize {
        self.rectangle.bins()[0]
    }

    /// Bins along y.
    pub fn rows(&self) -> usize {
        self.rectangle.bins()[1]
    }

    /// x of the middle of a column, mm.
    pub fn x_mm(&self, column: usize) -> f64 {
        self.rectangle.ends_mm()[0][0] + (column as f64 + 0.5) * self.bin
    }

    /// y of the middle of a row, mm.
    pub fn y_mm(&self, row: usize) -> f64 {
        self.rectangle.ends_mm()[1][0] + (row as f64 + 0.5) * self.bin
    }

    /// True if it passes through a box.
    fn cuts(&self, &Bounds { low, high }: &Bounds) -> bool {
        let own = self.rectangle.bounds();
        let beside = |axis: usize| high[axis] > own.low[axis] && low[axis] < own.high[axis];
        low.z <= self.height && high.z >= self.height && beside(0) && beside(1)
    }

    /// True if it lies above bodies that reach up to this height.
    fn clears(&self, top_mm: f64) -> Result<(), Error> {
        if self.height > top_mm {
            Ok(())
        } else {
            Err(Error::ReceiverTooLow { height_mm: self.height, top_mm })
        }
    }
}

impl Receiver for PlaneMap {
    fn bins(&self) -> usize {
        self.columns() * self.rows()
    }

    #[inline]
    fn bin(&self, ray: &Ray, length: f64) -> Option<usize> {
        Some(self.rectangle.crossing(ray, length)?.bin)
    }

    fn bin_many(&self, rays: &RayBuffer, bins: &mut Bins) {
        self.rectangle.bin_many(rays, bins);
    }

    /// # Errors
    /// A plane that is not above the packages, or that cuts the array solids.
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        self.clears(scene.top_mm())?;
        for around in scene.array_solids().into_iter().flat_map(|body| &body.boxes) {
            if self.cuts(around) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn only_upward_crossings_within_the_flight_count() {
        let plane = PlaneMap::centred(3.0, 0.5, 4, 2).unwrap();
        let up = Ray { origin: DVec3::new(0.6, -0.1, 0.0), direction: DVec3::Z };
        assert_eq!(plane.bin(&up, f64::INFINITY), Some(3));
        assert_eq!(plane.bin(&up, 2.9), None);
        assert_eq!(plane.bin(&up, 3.0), None);
        let from_plane = Ray { origin: DVec3::new(0.6, -0.1, 3.0), direction: DVec3::Z };
        assert_eq!(plane.bin(&from_plane, f64::INFINITY), Some(3));
        let down = Ray { origin: DVec3::new(0.6, -0.1, 5.0), direction: -DVec3::Z };
        assert_eq!(plane.bin(&down, f64::INFINITY), None);
        let outside = Ray { origin: DVec3::new(1.1, 0.0, 0.0), direction: DVec3::Z };
        assert_eq!(plane.bin(&outside, f64::INFINITY), None);
        assert_eq!((plane.x_mm(3), plane.y_mm(0)), (0.75, -0.25));
        assert!(plane.clears(3.0).is_err() && plane.clears(1.0).is_ok());
    }
}
