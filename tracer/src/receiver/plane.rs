// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance on a horizontal plane above the packages: transparent, counts what passes upwards.

use super::{Needs, Receiver};
use crate::error::{Error, check, finite, positive};
use crate::ray::Ray;
use crate::shape::Bounds;

/// A rectangle of bins at one height. Bin number = row along y · number of columns + column along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneMap {
    height: f64,
    low: [f64; 2],
    bin: f64,
    columns: usize,
    rows: usize,
}

impl PlaneMap {
    /// `columns` × `rows` square bins of width `bin_mm`, centred on the axis x = y = 0, at z = `height_mm`.
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
        let half = |count: usize| -0.5 * bin_mm * count as f64;
        Ok(Self {
            height: height_mm,
            low: [half(columns), half(rows)],
            bin: bin_mm,
            columns,
            rows,
        })
    }

    /// Bins along x.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Bins along y.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Height of the plane, mm.
    pub fn height_mm(&self) -> f64 {
        self.height
    }

    /// Width of a bin, mm.
    pub fn bin_mm(&self) -> f64 {
        self.bin
    }

    /// x of the middle of a column, mm.
    pub fn x_mm(&self, column: usize) -> f64 {
        self.low[0] + (column as f64 + 0.5) * self.bin
    }

    /// y of the middle of a row, mm.
    pub fn y_mm(&self, row: usize) -> f64 {
        self.low[1] + (row as f64 + 0.5) * self.bin
    }

    /// Irradiance of every bin in W/mm² from the power in the bins, `watts`.
    pub fn irradiance(&self, watts: &[f64]) -> Vec<f64> {
        watts
            .iter()
            .map(|power| power / (self.bin * self.bin))
            .collect()
    }
}

impl Receiver for PlaneMap {
    fn bins(&self) -> usize {
        self.columns * self.rows
    }

    fn needs(&self) -> Needs {
        Needs {
            flights: true,
            escapes: false,
        }
    }

    #[inline]
    fn crossed(&self, ray: &Ray, length: f64) -> Option<usize> {
        if ray.direction.z <= 0.0 || ray.origin.z >= self.height {
            return None;
        }
        let distance = (self.height - ray.origin.z) / ray.direction.z;
        if distance >= length {
            return None;
        }
        let column = (ray.origin.x + distance * ray.direction.x - self.low[0]) / self.bin;
        let row = (ray.origin.y + distance * ray.direction.y - self.low[1]) / self.bin;
        let inside =
            column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    fn cuts(&self, &Bounds { low, high }: &Bounds) -> bool {
        let size = [self.columns, self.rows].map(|bins| bins as f64 * self.bin);
        let beside =
            |axis: usize| high[axis] > self.low[axis] && low[axis] < self.low[axis] + size[axis];
        low.z <= self.height && high.z >= self.height && beside(0) && beside(1)
    }

    fn check(&self, top_mm: f64) -> Result<(), Error> {
        if self.height > top_mm {
            Ok(())
        } else {
            Err(Error::ReceiverTooLow {
                height_mm: self.height,
                top_mm,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn only_upward_crossings_within_the_flight_count() {
        let plane = PlaneMap::centred(3.0, 0.5, 4, 2).unwrap();
        let up = Ray {
            origin: DVec3::new(0.6, -0.1, 0.0),
            direction: DVec3::Z,
        };
        assert_eq!(plane.crossed(&up, f64::INFINITY), Some(3));
        assert_eq!(plane.crossed(&up, 2.9), None);
        let down = Ray {
            origin: DVec3::new(0.6, -0.1, 5.0),
            direction: -DVec3::Z,
        };
        assert_eq!(plane.crossed(&down, f64::INFINITY), None);
        let outside = Ray {
            origin: DVec3::new(1.1, 0.0, 0.0),
            direction: DVec3::Z,
        };
        assert_eq!(plane.crossed(&outside, f64::INFINITY), None);
        assert_eq!((plane.x_mm(3), plane.y_mm(0)), (0.75, -0.25));
        assert!(plane.check(3.0).is_err() && plane.check(1.0).is_ok());
    }
}
