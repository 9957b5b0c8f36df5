// SPDX-License-Identifier: MIT OR Apache-2.0
//! A rectangle in the air, at right angles to an axis, cut into bins: transparent, sees what passes it in the direction of its normal.

use glam::DVec3;

use crate::error::{Error, check, finite, positive};
use crate::ray::Ray;
use crate::shape::Bounds;

/// Along which axis of the world a rectangle looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Facing {
    /// Normal along ±x; u is y, v is z.
    X(Sense),
    /// Normal along ±y; u is x, v is z.
    Y(Sense),
    /// Normal along ±z; u is x, v is y.
    Z(Sense),
}

/// One of the two directions of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// That of the axis.
    Plus,
    /// The opposite one.
    Minus,
}

impl Facing {
    /// Numbers of the axes of u, v and the normal, and the sign of the normal.
    #[inline]
    fn axes(self) -> ([usize; 3], f64) {
        let (axes, sense) = match self {
            Self::X(sense) => ([1, 2, 0], sense),
            Self::Y(sense) => ([0, 2, 1], sense),
            Self::Z(sense) => ([0, 1, 2], sense),
        };
        (axes, if sense == Sense::Plus { 1.0 } else { -1.0 })
    }
}

/// The rectangle. Bin number = row along v · number of columns + column along u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectorRectangle {
    facing: Facing,
    centre: DVec3,
    size: [f64; 2],
    bins: [usize; 2],
}

/// Where a ray passes a rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passage {
    pub bin: usize,
    /// Components of the direction along u, v and the normal.
    pub direction: [f64; 3],
}

impl DetectorRectangle {
    /// The rectangle of `size` (mm, along u and v) about `centre` (mm) in `bins` along u and v, each from 1 to 20 000.
    pub fn new(
        facing: Facing,
        centre: DVec3,
        size: [f64; 2],
        bins: [usize; 2],
    ) -> Result<Self, Error> {
        for value in centre.to_array() {
            finite("position of a receiver, mm", value)?;
        }
        for value in size {
            positive("size of a receiver, mm", value)?;
        }
        for count in bins {
            check(
                "bins of a receiver along one axis",
                count as f64,
                "1 to 20000",
                (1..=20_000).contains(&count),
            )?;
        }
        Ok(Self {
            facing,
            centre,
            size,
            bins,
        })
    }

    /// Bins along u and v.
    pub fn bins(&self) -> [usize; 2] {
        self.bins
    }

    /// Ends along u and v in the world, mm: [[low, high] along u, [low, high] along v].
    pub fn ends_mm(&self) -> [[f64; 2]; 2] {
        let ([u, v, _], _) = self.facing.axes();
        [(u, 0), (v, 1)].map(|(axis, k)| {
            let (at, half) = (self.centre[axis], 0.5 * self.size[k]);
            [at - half, at + half]
        })
    }

    /// Area of a bin, mm².
    pub fn bin_mm2(&self) -> f64 {
        self.size[0] * self.size[1] / (self.bins[0] * self.bins[1]) as f64
    }

    /// Unit vectors along u, v and the normal.
    pub(super) fn axes(&self) -> [DVec3; 3] {
        let (axes, sign) = self.facing.axes();
        let [u, v, n] = axes.map(|axis| DVec3::AXES[axis]);
        [u, v, n * sign]
    }

    /// Number of the axis of the normal.
    pub(super) fn normal_axis(&self) -> usize {
        let ([_, _, n], _) = self.facing.axes();
        n
    }

    /// Corners of the rectangle as a box without height.
    pub(super) fn bounds(&self) -> Bounds {
        let ([u, v, _], _) = self.facing.axes();
        let mut half = DVec3::ZERO;
        (half[u], half[v]) = (0.5 * self.size[0], 0.5 * self.size[1]);
        Bounds {
            low: self.centre - half,
            high: self.centre + half,
        }
    }

    /// Where a ray that flies `length` mm passes it.
    #[inline]
    pub(super) fn passed(&self, ray: &Ray, length: f64) -> Option<Passage> {
        let ([u, v, n], sign) = self.facing.axes();
        let rate = ray.direction[n];
        if rate * sign <= 0.0 {
            return None;
        }
        let distance = (self.centre[n] - ray.origin[n]) / rate;
        if distance < 0.0 || distance >= length {
            return None;
        }
        let place = |axis: usize, k: usize| {
            let from_low = ray.origin[axis] + distance * ray.direction[axis] - self.centre[axis];
            let bin = (from_low / self.size[k] + 0.5) * self.bins[k] as f64;
            (bin >= 0.0 && bin < self.bins[k] as f64).then_some(bin as usize)
        };
        let (column, row) = (place(u, 0)?, place(v, 1)?);
        Some(Passage {
            bin: row * self.bins[0] + column,
            direction: [ray.direction[u], ray.direction[v], rate * sign],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passages_along_the_normal_fall_into_their_bins() {
        let centre = DVec3::new(1.0, 2.0, 3.0);
        let rectangle =
            |facing| DetectorRectangle::new(facing, centre, [4.0, 2.0], [4, 2]).unwrap();
        let ray = |from: [f64; 3], along: [f64; 3]| Ray {
            origin: DVec3::from_array(from),
            direction: DVec3::from_array(along),
        };
        let bin = |facing, from, along, length| {
            let passage = rectangle(facing).passed(&ray(from, along), length);
            passage.map(|p| p.bin)
        };
        let up = Facing::Z(Sense::Plus);
        // Second column, second row.
        assert_eq!(
            bin(up, [0.5, 2.5, 0.0], [0.0, 0.0, 1.0], f64::INFINITY),
            Some(5)
        );
        assert_eq!(bin(up, [0.5, 2.5, 0.0], [0.0, 0.0, 1.0], 2.9), None);
        assert_eq!(
            bin(up, [0.5, 2.5, 4.0], [0.0, 0.0, -1.0], f64::INFINITY),
            None
        );
        assert_eq!(
            bin(up, [-1.1, 2.5, 0.0], [0.0, 0.0, 1.0], f64::INFINITY),
            None
        );
        let down = Facing::Z(Sense::Minus);
        assert_eq!(bin(down, [0.5, 2.5, 4.0], [0.0, 0.0, -1.0], 2.0), Some(5));
        // u is y from 0 to 4, v is z from 2 to 4.
        let along_x = Facing::X(Sense::Plus);
        assert_eq!(bin(along_x, [0.0, 3.5, 2.5], [1.0, 0.0, 0.0], 9.0), Some(3));
        let along_y = Facing::Y(Sense::Minus);
        assert_eq!(
            bin(along_y, [-0.5, 9.0, 3.5], [0.0, -1.0, 0.0], 9.0),
            Some(4)
        );
        assert_eq!(rectangle(along_x).ends_mm(), [[0.0, 4.0], [2.0, 4.0]]);
        assert!((rectangle(up).bin_mm2() - 1.0).abs() < 1e-15);
        assert!(DetectorRectangle::new(up, centre, [0.0, 1.0], [1, 1]).is_err());
        assert!(DetectorRectangle::new(up, centre, [1.0, 1.0], [0, 1]).is_err());
    }
}
