// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays: a point and a unit direction, in the frame of the region that the ray crosses.

use glam::DVec3;

/// A half-line. Inside a body its coordinates are those of the body's prototype, elsewhere those of
/// the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start point, mm.
    pub origin: DVec3,
    /// Direction, a unit vector.
    pub direction: DVec3,
}

/// A vector that is a unit vector but for rounding, made one: a Newton step for 1/√x at x = 1
/// leaves the square of what it was off by.
#[inline]
pub(crate) fn unit(almost: DVec3) -> DVec3 {
    almost * (1.5 - 0.5 * almost.length_squared())
}

/// The bits of the first `count` lanes, 1 to 64.
#[inline]
pub(crate) fn first_lanes(count: usize) -> u64 {
    u64::MAX >> (64 - count)
}

/// The lanes whose bits are set, from the first one on.
#[inline]
pub(crate) fn lanes(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
}

/// The lanes whose bits are set, from the last one on.
#[inline]
pub(crate) fn lanes_down(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.ilog2() as usize)?;
        bits ^= 1 << lane;
        Some(lane)
    })
}

impl Ray {
    /// The ray of a lane of many that lie coordinate by coordinate.
    #[inline]
    pub(crate) fn from_lane<const N: usize>(
        origin: &[[f64; N]; 3],
        direction: &[[f64; N]; 3],
        lane: usize,
    ) -> Self {
        let at = |list: &[[f64; N]; 3]| DVec3::new(list[0][lane], list[1][lane], list[2][lane]);
        Self { origin: at(origin), direction: at(direction) }
    }

    /// Puts the ray in a lane of many that lie coordinate by coordinate.
    #[inline]
    pub(crate) fn into_lane<const N: usize>(
        self,
        origin: &mut [[f64; N]; 3],
        direction: &mut [[f64; N]; 3],
        lane: usize,
    ) {
        for axis in 0..3 {
            origin[axis][lane] = self.origin[axis];
            direction[axis][lane] = self.direction[axis];
        }
    }

    /// The point at `distance` mm along the ray.
    #[inline]
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}
