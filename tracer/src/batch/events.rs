// SPDX-License-Identifier: MIT OR Apache-2.0
//! Events of a step, lanes as bits, so that the frequent ones are booked without a
//! loop over the lanes.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "codes are small whole numbers kept beside the rest; a branch or a call within the \
        loop would keep it from being compiled to wide instructions"
)]

use pulp::{Simd, WithSimd};

use super::clearance::Clearance;
use super::kernels::PackageGeometry;
use super::lanes::{Course, FlatCode, LANES, Lanes, Mode};
use crate::conversion::whole;
use crate::ray::first_lanes;

/// When light that leaves a body never meets it again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LeavesPackage {
    Always,
    /// If it rises and moves away from the axis.
    Opening,
    Unknown,
}

/// Conditions under which light that leaves its package leaves the scene.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exit {
    /// True if it may meet its own package again.
    pub leaves_package: LeavesPackage,
    /// True if the scene is one package.
    pub alone: bool,
    /// Obstacle that it must pass over.
    pub clearance: Clearance,
}

impl Exit {
    /// True if light at `o` along `d`, outside of its package, never meets the package again.
    #[inline(always)]
    pub fn is_away(self, o: [f64; 3], d: [f64; 3]) -> bool {
        let opening = (d[2] >= 0.0) & (o[0] * d[0] + o[1] * d[1] >= 0.0);
        (self.leaves_package == LeavesPackage::Always)
            | ((self.leaves_package == LeavesPackage::Opening) & opening)
    }

    /// True if it never meets anything else.
    #[inline(always)]
    pub fn is_free(self, o: [f64; 3], d: [f64; 3]) -> bool {
        self.alone | self.clearance.passed(o[2], d)
    }
}

/// Lanes by event.
#[derive(Debug, Clone, Copy)]
pub(super) struct Events {
    /// Lanes that met a surface.
    pub met: u64,
    /// Lanes that have left for good through an interface or in an order of a table.
    pub left: u64,
    /// Lanes that were outside and met nothing more.
    pub gone: u64,
    /// Lanes in a body that met a mirror and have surfaces left to meet.
    pub mirrored: u64,
    /// Lanes to which anything else happened but a reflection within a body.
    pub other: u64,
}

impl Events {
    /// Events of the first `count` rays.
    pub fn of_first(self, count: usize) -> Self {
        let active = first_lanes(count);
        Self {
            met: self.met & active,
            left: self.left & active,
            gone: self.gone & active,
            mirrored: self.mirrored & active,
            other: self.other & active,
        }
    }
}

/// Classifies what happened to all rays, and notes the primitives that they met.
pub(super) struct Classify<'a> {
    pub geometry: &'a PackageGeometry,
    pub exit: Exit,
    /// Number of a primitive less its flat code, for bottom and side and for the faces of the box.
    pub primitives: [f64; 2],
    pub lanes: &'a mut Lanes,
}

impl WithSimd for Classify<'_> {
    type Output = Events;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Events {
        let (max_bounces, exit, lanes) = (self.geometry.max_bounces, self.exit, self.lanes);
        let [flats, faces] = self.primitives;
        let mut events = Events { met: 0, left: 0, gone: 0, mirrored: 0, other: 0 };
        for lane in 0..LANES {
            let o = [0, 1, 2].map(|axis| lanes.origin[axis][lane]);
            let d = [0, 1, 2].map(|axis| lanes.direction[axis][lane]);
            let mode = lanes.mode[lane];
            let event = lanes.event[lane].is_set();
            let inside = lanes.inside[lane].is_set();
            let sound = event & inside & (lanes.bounces[lane] < max_bounces);
            let passes = (mode == Mode::INTERFACE) | (mode == Mode::ORDERS);
            let through = passes & (lanes.course[lane] == Course::THROUGH);
            let left = sound & through & exit.is_away(o, d) & exit.is_free(o, d);
            let mirrored = sound & (mode == Mode::MIRROR);
            let met = mode.is_met();
            let gone = !met & !inside;
            events.met |= u64::from(met) << lane;
            events.left |= u64::from(left) << lane;
            events.gone |= u64::from(gone) << lane;
            events.mirrored |= u64::from(mirrored) << lane;
            events.other |= u64::from(event & !left & !gone & !mirrored) << lane;

            let code = lanes.flat_code[lane];
            let of_box = code >= FlatCode::face(0.0);
            let primitive = whole(code.0 + if of_box { faces } else { flats });
            let on_dome = lanes.on_dome[lane].is_set();
            lanes.primitive[lane] = if on_dome { lanes.dome_primitive[lane] } else { primitive };
        }
        events
    }
}
