// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays of a batch as a structure of arrays, with the codes of their states.
//!
//! Codes, flags and counts are small whole numbers kept as reals behind types of their own: a loop
//! over them and the coordinates then needs one kind of register and of comparison. With 64-bit
//! integers in their place staircases take a tenth longer.

#![expect(clippy::inline_always, reason = "compiled into the wide loops over all rays")]

use bsdf::Side;
use bsdf::order_table::Flag;

use crate::random::PathStream;
use crate::ray::Ray;

/// Rays of a batch.
pub(super) const LANES: usize = 64;

/// One real for each ray.
pub(super) type Lane = [f64; LANES];

/// Rays and their next interaction, lane by lane.
pub(super) struct Lanes {
    pub origin: [Lane; 3],
    pub direction: [Lane; 3],
    /// 1 over z of the direction.
    pub per_dz: Lane,
    /// Set inside of the body, not in the world.
    pub inside: [Flag; LANES],
    /// Random streams.
    pub state: [[u64; LANES]; 2],
    /// Distance to the nearest of bottom, side and box, infinite where there is none, and its code.
    pub flat: Lane,
    pub flat_code: [FlatCode; LANES],
    /// Entry and exit of the ray through a ball about the shell of a relief: the inner one for
    /// light inside of the body, the outer one for light outside.
    pub ends: [Lane; 2],
    /// The dome: distance to it, infinite if it is not met, its primitive, and n_r, n_z, k of n_r r
    /// + n_z z = k there, if it is not round.
    pub dome: Lane,
    pub dome_primitive: [i64; LANES],
    pub dome_line: [Lane; 3],
    /// Set where the ray meets the dome.
    pub on_dome: [Flag; LANES],
    /// The primitive that the ray meets.
    pub primitive: [i64; LANES],
    /// Surfaces met so far.
    pub bounces: [Count; LANES],
    /// Not set for a reflection at an interface within the body: there is nothing to book.
    pub event: [Flag; LANES],
    /// The surface ahead: its distance, and n = (r̂ n_r + axis_x, r̂ n_r + axis_y, n_z) with n·p =
    /// k.
    pub distance: Lane,
    pub radial: Lane,
    pub axis: [Lane; 3],
    pub k: Lane,
    /// Set if it is the round dome.
    pub ball: [Flag; LANES],
    /// Sign that makes n point to where the ray came from.
    pub facing: Lane,
    pub mode: [Mode; LANES],
    /// For surfaces with tables of orders: two numbers from 0 to 1, the tangential wavevector of
    /// the light before and after, the meridional and the level tangent, and the sign of z of the
    /// side on which the light goes on, 0 if it is drawn elsewhere.
    pub chance: [Lane; 2],
    pub wave: [Lane; 2],
    pub along: [Lane; 3],
    pub across: [Lane; 2],
    pub to: Lane,
    /// Height where it was met.
    pub height: Lane,
    /// x and y there.
    pub point: [Lane; 2],
    /// n there.
    pub normal: [Lane; 3],
    pub course: [Course; LANES],
    /// Factors of its direction and of n in the direction in which it goes on.
    pub factors: [Lane; 2],
}

/// Mode of the surface ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode(f64);

impl Mode {
    pub const INTERFACE: Self = Self(0.0);
    pub const MIRROR: Self = Self(1.0);
    /// A table of orders.
    pub const ORDERS: Self = Self(2.0);
    /// Any other surface: sampled ray by ray.
    pub const OTHER: Self = Self(3.0);
    /// There is no surface ahead.
    pub const NOTHING: Self = Self(4.0);
    /// The medium has taken the light, or has scattered it, before it reached a surface.
    pub const TAKEN: Self = Self(5.0);

    /// True for interfaces and mirrors.
    #[inline(always)]
    pub fn is_specular(self) -> bool {
        self.0 <= Self::MIRROR.0
    }

    /// True of a flight that its medium has not ended.
    #[inline(always)]
    pub fn is_ahead(self) -> bool {
        self.0 < Self::TAKEN.0
    }

    /// True where there is a surface ahead.
    #[inline(always)]
    pub fn is_met(self) -> bool {
        self.0 < Self::NOTHING.0
    }
}

/// Course of light from a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Course(f64);

impl Course {
    /// The table of orders absorbs it.
    pub const ABSORBED: Self = Self(-1.0);
    /// On the other side.
    pub const THROUGH: Self = Self(0.0);
    /// On the side from which it came.
    pub const BACK: Self = Self(1.0);
}

/// Number of a surface that is not the dome: none, bottom, side, then the faces of the box.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(super) struct FlatCode(pub f64);

impl FlatCode {
    pub const DOME: Self = Self(-1.0);
    pub const NONE: Self = Self(0.0);
    pub const BOTTOM: Self = Self(1.0);
    pub const SIDE: Self = Self(2.0);
    /// Number of codes from none on.
    pub const COUNT: usize = 9;

    /// Face `number` of the box, from 0.
    #[inline(always)]
    pub fn face(number: f64) -> Self {
        Self(3.0 + number)
    }
}

/// Number of surfaces.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(super) struct Count(f64);

impl Count {
    /// One more if `met`.
    #[inline(always)]
    #[must_use]
    pub fn plus(self, met: bool) -> Self {
        Self(self.0 + if met { 1.0 } else { 0.0 })
    }

    #[inline(always)]
    pub fn get(self) -> u32 {
        self.0 as u32
    }
}

impl From<u32> for Count {
    #[inline(always)]
    fn from(count: u32) -> Self {
        Self(count.into())
    }
}

impl Lanes {
    pub fn new() -> Self {
        let (zero, no) = ([0.0; LANES], [Flag::NO; LANES]);
        Self {
            origin: [zero; 3],
            direction: [zero, zero, [1.0; LANES]],
            per_dz: [1.0; LANES],
            inside: no,
            state: [[1; LANES]; 2],
            flat: zero,
            flat_code: [FlatCode::NONE; LANES],
            dome: [f64::INFINITY; LANES],
            dome_primitive: [0; LANES],
            dome_line: [zero; 3],
            on_dome: no,
            primitive: [0; LANES],
            bounces: [Count(0.0); LANES],
            event: no,
            ends: [zero; 2],
            distance: zero,
            radial: zero,
            axis: [zero; 3],
            k: zero,
            ball: no,
            facing: zero,
            mode: [Mode::NOTHING; LANES],
            chance: [zero; 2],
            wave: [zero; 2],
            along: [zero; 3],
            across: [zero; 2],
            to: zero,
            height: zero,
            point: [zero; 2],
            normal: [zero; 3],
            course: [Course::THROUGH; LANES],
            factors: [zero; 2],
        }
    }

    #[inline]
    pub fn put(&mut self, lane: usize, ray: &Ray) {
        ray.into_lane(&mut self.origin, &mut self.direction, lane);
    }

    #[inline]
    pub fn ray(&self, lane: usize) -> Ray {
        Ray::from_lane(&self.origin, &self.direction, lane)
    }

    #[inline]
    pub fn stream(&self, lane: usize) -> PathStream {
        PathStream { state: [self.state[0][lane], self.state[1][lane]] }
    }

    #[inline]
    pub fn keep(&mut self, lane: usize, stream: PathStream) {
        [self.state[0][lane], self.state[1][lane]] = stream.state;
    }

    /// The side from which the ray meets the surface.
    #[inline]
    pub fn side(&self, lane: usize) -> Side {
        if self.facing[lane] < 0.0 { Side::Inner } else { Side::Outer }
    }
}
