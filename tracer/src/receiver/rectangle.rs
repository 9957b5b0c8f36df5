// SPDX-License-Identifier: MIT OR Apache-2.0
//! A rectangle in the air, at right angles to an axis, cut into bins: transparent, sees what passes
//! it in the direction of its normal.

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::{Bins, NO_BIN, RAY_BUFFER, RayBuffer};
use crate::conversion;
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
    /// Side of the axis.
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

/// Point where a ray crosses a rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub bin: usize,
    /// Components of the direction along u, v and the normal.
    pub direction: [f64; 3],
}

impl DetectorRectangle {
    /// The rectangle of `size` (mm, along u and v) about `centre` (mm) in `bins` along u and v,
    /// each from 1 to 20 000.
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
        Ok(Self { facing, centre, size, bins })
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
    pub fn axes(&self) -> [DVec3; 3] {
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
    pub fn bounds(&self) -> Bounds {
        let ([u, v, _], _) = self.facing.axes();
        let mut half = DVec3::ZERO;
        (half[u], half[v]) = (0.5 * self.size[0], 0.5 * self.size[1]);
        Bounds { low: self.centre - half, high: self.centre + half }
    }

    /// Point where a ray that travels `length` mm crosses it along its normal. A start on the
    /// rectangle counts, an end does not: two segments that meet there count once.
    #[inline]
    pub(super) fn crossing(&self, ray: &Ray, length: f64) -> Option<Crossing> {
        let (axes, sign) = self.facing.axes();
        let (o, d) = (axes.map(|axis| ray.origin[axis]), axes.map(|axis| ray.direction[axis]));
        let bin = bin_number(self.grid().crossing(o, d, length));
        (bin != NO_BIN)
            .then_some(Crossing { bin: bin as usize, direction: [d[0], d[1], d[2] * sign] })
    }

    /// The bins where rays cross it along its normal.
    pub(super) fn bin_many(&self, rays: &RayBuffer, bins: &mut Bins) {
        let (axes, _) = self.facing.axes();
        let (o, d) = (axes.map(|axis| &rays.origin[axis]), axes.map(|axis| &rays.direction[axis]));
        let grid = self.grid();
        let length = &rays.length;
        *bins = Arch::new().dispatch(BinMany { grid, o, d, length });
    }

    fn grid(&self) -> Grid {
        let (axes, sign) = self.facing.axes();
        Grid {
            centre: axes.map(|axis| self.centre[axis]),
            size: self.size,
            bins: self.bins.map(|bins| bins as f64),
            sign,
        }
    }
}

/// The numbers of a rectangle, along u, v and the axis of the normal.
#[derive(Clone, Copy)]
struct Grid {
    centre: [f64; 3],
    size: [f64; 2],
    bins: [f64; 2],
    sign: f64,
}

/// [`NO_BIN`] as a real.
const NONE: f64 = 4_294_967_295.0;

/// A bin, or [`NONE`], as an integer.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over many rays")]
#[inline(always)]
fn bin_number(bin: f64) -> u32 {
    conversion::whole(bin) as u32
}

/// Finds the bins of all rays of a buffer.
struct BinMany<'a> {
    grid: Grid,
    o: [&'a Lane; 3],
    d: [&'a Lane; 3],
    length: &'a Lane,
}

/// One number for each ray of a buffer.
type Lane = [f64; RAY_BUFFER];

impl WithSimd for BinMany<'_> {
    type Output = Bins;

    #[expect(
        clippy::inline_always,
        reason = "compiled with the instructions that the dispatch finds"
    )]
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Bins {
        let Self { grid, o, d, length } = self;
        let mut found = [NONE; RAY_BUFFER];
        for k in 0..RAY_BUFFER {
            let (o, d) = ([o[0][k], o[1][k], o[2][k]], [d[0][k], d[1][k], d[2][k]]);
            found[k] = grid.crossing(o, d, length[k]);
        }
        found.map(bin_number)
    }
}

impl Grid {
    /// The bin in which a ray from `o` along `d` crosses it as a real, [`NONE`] if it does not,
    /// without branches.
    #[expect(
        clippy::inline_always,
        clippy::needless_bitwise_bool,
        reason = "compiled into the wide loop over many rays"
    )]
    #[inline(always)]
    fn crossing(&self, o: [f64; 3], d: [f64; 3], length: f64) -> f64 {
        let distance = (self.centre[2] - o[2]) / d[2];
        let crosses = (d[2] * self.sign > 0.0) & (distance >= 0.0) & (distance < length);
        let [u, v] = [0, 1].map(|k| {
            let from_centre = o[k] + distance * d[k] - self.centre[k];
            (from_centre / self.size[k] + 0.5) * self.bins[k]
        });
        let met = crosses & (u >= 0.0) & (v >= 0.0) & (u < self.bins[0]) & (v < self.bins[1]);
        // At most 4 · 10⁸, exact, where it is met.
        let bin = conversion::floor(v) * self.bins[0] + conversion::floor(u);
        if met { bin } else { NONE }
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
            let passage = rectangle(facing).crossing(&ray(from, along), length);
            passage.map(|p| p.bin)
        };
        let up = Facing::Z(Sense::Plus);
        // Second column, second row.
        assert_eq!(bin(up, [0.5, 2.5, 0.0], [0.0, 0.0, 1.0], f64::INFINITY), Some(5));
        assert_eq!(bin(up, [0.5, 2.5, 0.0], [0.0, 0.0, 1.0], 2.9), None);
        // Of the segments that meet on it the one that begins there counts.
        assert_eq!(bin(up, [0.5, 2.5, 0.0], [0.0, 0.0, 1.0], 3.0), None);
        assert_eq!(bin(up, [0.5, 2.5, 3.0], [0.0, 0.0, 1.0], 1.0), Some(5));
        assert_eq!(bin(up, [0.5, 2.5, 4.0], [0.0, 0.0, -1.0], f64::INFINITY), None);
        assert_eq!(bin(up, [-1.1, 2.5, 0.0], [0.0, 0.0, 1.0], f64::INFINITY), None);
        let down = Facing::Z(Sense::Minus);
        assert_eq!(bin(down, [0.5, 2.5, 4.0], [0.0, 0.0, -1.0], 2.0), Some(5));
        // u is y from 0 to 4, v is z from 2 to 4.
        let along_x = Facing::X(Sense::Plus);
        assert_eq!(bin(along_x, [0.0, 3.5, 2.5], [1.0, 0.0, 0.0], 9.0), Some(3));
        let along_y = Facing::Y(Sense::Minus);
        assert_eq!(bin(along_y, [-0.5, 9.0, 3.5], [0.0, -1.0, 0.0], 9.0), Some(4));
        assert_eq!(rectangle(along_x).ends_mm(), [[0.0, 4.0], [2.0, 4.0]]);
        assert!((rectangle(up).bin_mm2() - 1.0).abs() < 1e-15);
        assert!(DetectorRectangle::new(up, centre, [0.0, 1.0], [1, 1]).is_err());
        assert!(DetectorRectangle::new(up, centre, [1.0, 1.0], [0, 1]).is_err());
    }
}
