// SPDX-License-Identifier: MIT OR Apache-2.0
//! Branch-free kernels of the batch: distances to flat and round surfaces, reflection and
//! refraction.
//!
//! The walker and the batch share [`Fresnel`], [`quadratic_root`], [`chord`] and [`box_passage`].
//! The bottom is a [`crate::shape::Frustum`] whose distance is a product with 1/d_z in place of a
//! quotient.
//!
//! Both values of a choice are computed or read before it. Work within an arm of a choice becomes a
//! masked store, which takes some processors as long as a root.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "codes are small whole numbers kept beside the rest; a branch or a call within a \
        loop would keep it from being compiled to wide instructions"
)]

use bsdf::order_table::Flag;
use pulp::{Simd, WithSimd};

use super::lanes::{Count, Course, FlatCode, LANES, Lanes, Mode};
use crate::optics::fresnel::Fresnel;
use crate::random::{self, PathStream};
use crate::shape::{Shell, box_passage, chord, quadratic_root};

/// Dimensions, indices and modes of a package.
#[derive(Debug, Clone, Copy)]
pub(super) struct PackageGeometry {
    pub offset: f64,
    pub inner: f64,
    pub outer: f64,
    /// Height of the bottom and its squared radius.
    pub level: f64,
    pub rim2: f64,
    /// Squared radius of the side, and its heights; empty if it has none.
    pub side2: f64,
    pub side: [f64; 2],
    /// Corners of the box; the lower one infinite if there is none.
    pub low: [f64; 3],
    pub high: [f64; 3],
    /// Centre of the round dome, its radius and heights.
    pub centre: f64,
    pub radius: f64,
    pub zone: [f64; 2],
    pub shell: Shell,
    /// Radius of the side.
    pub side_radius: f64,
    /// Modes of the dome, if it has one all over, and by flat code.
    pub dome_mode: Mode,
    pub flat_mode: [Mode; FlatCode::COUNT],
    /// Surfaces that a path may meet.
    pub max_bounces: Count,
    /// Indices of refraction on both sides of tables of orders.
    pub orders: [f64; 2],
}

/// 0 in place of a negative number.
#[inline(always)]
pub(super) fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

impl PackageGeometry {
    /// Distances to everything but a relief.
    #[inline(always)]
    fn distances<const ROUND: bool>(&self, lanes: &mut Lanes, lane: usize) {
        let from = -4.0 * self.offset;
        let o = [0, 1, 2].map(|axis| lanes.origin[axis][lane]);
        let d = [0, 1, 2].map(|axis| lanes.direction[axis][lane]);
        let inside = lanes.inside[lane].is_set();
        let (a, b) = (d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1]);
        let c = o[0] * o[0] + o[1] * o[1];

        // The bottom, from above.
        let per_dz = 1.0 / d[2];
        lanes.per_dz[lane] = per_dz;
        let t = (self.level - o[2]) * per_dz;
        let met = inside & (d[2] < 0.0) & (t > from) & ((a * t + 2.0 * b) * t + c <= self.rim2);
        let mut flat = if met { t } else { f64::INFINITY };
        let mut code = if met { FlatCode::BOTTOM } else { FlatCode::NONE };

        // The side: its far root from inside, its near one from outside.
        let c_side = c - self.side2;
        let discriminant = b * b - a * c_side;
        let root = positive(discriminant).sqrt();
        let s = if inside { root } else { -root };
        let t = quadratic_root([a, b, c_side], s);
        let z = o[2] + t * d[2];
        let met = (discriminant > 0.0)
            & (t > from)
            & (t < flat)
            & (z >= self.side[0])
            & (z <= self.side[1]);
        flat = if met { t } else { flat };
        code = if met { FlatCode::SIDE } else { code };

        // The box, from outside of it: the latest entry, if it comes before the first exit.
        let inverse = [1.0 / d[0], 1.0 / d[1], per_dz];
        let [(enter, face), (leave, _)] = box_passage([self.low, self.high], o, inverse);
        let face = FlatCode::face(face);
        let met = inside & (enter <= leave) & (enter > from) & (enter < flat);
        lanes.flat[lane] = if met { enter } else { flat };
        lanes.flat_code[lane] = if met { face } else { code };

        if ROUND {
            let cz = o[2] - self.centre;
            let (nearest, half2) = chord([o[0], o[1], cz], d, self.radius);
            let half = positive(half2).sqrt();
            let t = if inside { nearest + half } else { nearest - half };
            let z = o[2] + t * d[2];
            let met = (half2 >= 0.0)
                & (t > from)
                & (inside | (nearest > from))
                & (z >= self.zone[0])
                & (z <= self.zone[1]);
            lanes.dome[lane] = if met { t } else { f64::INFINITY };
        } else {
            let shell = &self.shell;
            let radius = if inside { shell.inner } else { shell.outer };
            let ends = shell.line(o, d).within(radius);
            for (all, end) in lanes.ends.iter_mut().zip(ends) {
                all[lane] = end;
            }
        }
    }

    /// Chooses between dome and flat surfaces.
    #[inline(always)]
    fn nearest<const ROUND: bool>(&self, lanes: &mut Lanes, lane: usize) {
        let (dome, flat) = (lanes.dome[lane], lanes.flat[lane]);
        let on_dome = dome < flat;
        let distance = if on_dome { dome } else { flat };
        let met = distance < f64::INFINITY;
        let code = if on_dome { FlatCode::DOME } else { lanes.flat_code[lane] };
        let is = |wanted: FlatCode| code == wanted;
        let pick = |met: bool, value: f64| if met { value } else { 0.0 };
        let line = [0, 1, 2].map(|number| lanes.dome_line[number][lane]);
        let [radial, axis_z, k] = line.map(|x| if on_dome & !ROUND { x } else { 0.0 });
        let face = |number: usize| is(FlatCode::face(number as f64));
        lanes.radial[lane] = radial + pick(is(FlatCode::SIDE), 1.0);
        lanes.axis[0][lane] = pick(face(1), 1.0) - pick(face(0), 1.0);
        lanes.axis[1][lane] = pick(face(3), 1.0) - pick(face(2), 1.0);
        lanes.axis[2][lane] =
            axis_z + pick(is(FlatCode::BOTTOM) | face(5), 1.0) - pick(face(4), 1.0);
        let mut level =
            k + pick(is(FlatCode::BOTTOM), self.level) + pick(is(FlatCode::SIDE), self.side_radius);
        for axis in 0..3 {
            level = if face(2 * axis) { -self.low[axis] } else { level };
            level = if face(2 * axis + 1) { self.high[axis] } else { level };
        }
        lanes.k[lane] = level;
        let mut mode = if on_dome { self.dome_mode } else { Mode::NOTHING };
        for number in 1..FlatCode::COUNT {
            mode = if is(FlatCode(number as f64)) { self.flat_mode[number] } else { mode };
        }
        lanes.mode[lane] = mode;
        lanes.distance[lane] = if met { distance } else { 0.0 };
        lanes.height[lane] = lanes.origin[2][lane] + distance * lanes.direction[2][lane];
        lanes.on_dome[lane] = Flag::new(on_dome);
        lanes.ball[lane] = Flag::new(on_dome & ROUND);
        // Opaque parts are met from their outer side.
        let inner = (on_dome | is(FlatCode::SIDE)) & lanes.inside[lane].is_set();
        lanes.facing[lane] = if inner { -1.0 } else { 1.0 };
    }

    /// Notes the tangential wavevector of light along `d` in the meridional frame of `n`: b is
    /// level, t = b × n.
    #[inline(always)]
    fn note(&self, lanes: &mut Lanes, lane: usize, (d, n): ([f64; 3], [f64; 3])) {
        let b = [lanes.across[0][lane], lanes.across[1][lane]];
        let t = [b[1] * n[2], -b[0] * n[2], b[0] * n[1] - b[1] * n[0]];
        let inside = lanes.inside[lane].is_set();
        let index = if inside { self.orders[0] } else { self.orders[1] };
        lanes.wave[0][lane] = index * (d[0] * t[0] + d[1] * t[1] + d[2] * t[2]);
        lanes.wave[1][lane] = index * (d[0] * b[0] + d[1] * b[1]);
        for (all, value) in lanes.along.iter_mut().zip(t) {
            all[lane] = value;
        }
    }

    /// Settles the ray on the surface: puts its origin there, and notes n and the level tangent.
    #[inline(always)]
    fn settle<const ROUND: bool, const ORDERS: bool>(&self, lanes: &mut Lanes, lane: usize) {
        let d = [0, 1, 2].map(|axis| lanes.direction[axis][lane]);
        let t = lanes.distance[lane];
        let [px, py, pz] = [0, 1, 2].map(|axis| lanes.origin[axis][lane] + t * d[axis]);

        // The point settled on the surface, and n there.
        let r = (px * px + py * py).sqrt();
        let per_r = 1.0 / r;
        let radial = lanes.radial[lane];
        let (cos_phi, sin_phi) = (px * per_r, py * per_r);
        let cos_phi = if r > 0.0 { cos_phi } else { 1.0 };
        let sin_phi = if r > 0.0 { sin_phi } else { 0.0 };
        let (nx, ny, nz) = (
            radial * cos_phi + lanes.axis[0][lane],
            radial * sin_phi + lanes.axis[1][lane],
            lanes.axis[2][lane],
        );
        let off = nx * px + ny * py + nz * pz - lanes.k[lane];
        let (qx, qy, qz) = (px - nx * off, py - ny * off, pz - nz * off);
        let (n, p) = if ROUND {
            let per_radius = 1.0 / self.radius;
            let v = [px * per_radius, py * per_radius, (pz - self.centre) * per_radius];
            let unit = 1.5 - 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            let [vx, vy, vz] = v.map(|v| v * unit);
            let round = [vx * self.radius, vy * self.radius, vz * self.radius + self.centre];
            let ball = lanes.ball[lane].is_set();
            (
                [
                    if ball { vx } else { nx },
                    if ball { vy } else { ny },
                    if ball { vz } else { nz },
                ],
                [
                    if ball { round[0] } else { qx },
                    if ball { round[1] } else { qy },
                    if ball { round[2] } else { qz },
                ],
            )
        } else {
            ([nx, ny, nz], [qx, qy, qz])
        };
        for axis in 0..3 {
            lanes.origin[axis][lane] = p[axis];
            lanes.normal[axis][lane] = n[axis];
        }
        for (all, p) in lanes.point.iter_mut().zip(p) {
            all[lane] = p;
        }
        if ORDERS {
            lanes.across[0][lane] = -sin_phi;
            lanes.across[1][lane] = cos_phi;
        }
    }

    /// Draws whether the ray is reflected or refracted.
    #[inline(always)]
    fn decide<const ORDERS: bool>(&self, lanes: &mut Lanes, lane: usize) {
        let d = [0, 1, 2].map(|axis| lanes.direction[axis][lane]);
        let n = [0, 1, 2].map(|axis| lanes.normal[axis][lane]);
        let inside = lanes.inside[lane].is_set();
        let mode = lanes.mode[lane];
        let facing = lanes.facing[lane];
        let f = n.map(|n| n * facing);

        // Fresnel for unpolarised light.
        let (n1, n2) = if inside { (self.inner, self.outer) } else { (self.outer, self.inner) };
        let cos_i = -(d[0] * f[0] + d[1] * f[1] + d[2] * f[2]);
        let fresnel = Fresnel::new(cos_i, n1, n2);
        let interface = mode == Mode::INTERFACE;
        let draws = interface & !fresnel.total;
        let before = [lanes.state[0][lane], lanes.state[1][lane]];
        let (word, after) = PathStream::step(before);
        let mut state = [0, 1].map(|k| if draws { after[k] } else { before[k] });
        if ORDERS {
            let orders = mode == Mode::ORDERS;
            let (second, after) = PathStream::step(after);
            state = [0, 1].map(|k| if orders { after[k] } else { state[k] });
            lanes.chance[0][lane] = random::unit_from_word(word);
            lanes.chance[1][lane] = random::unit_from_word(second);
            self.note(lanes, lane, (d, n));
        }
        for (all, state) in lanes.state.iter_mut().zip(state) {
            all[lane] = state;
        }
        let chance = random::unit_from_word(word);
        let back = !draws | fresnel.reflects(chance);

        let [along, aside] = fresnel.factors(back);
        lanes.factors[0][lane] = along;
        lanes.factors[1][lane] = facing * aside;
        lanes.course[lane] = if back { Course::BACK } else { Course::THROUGH };
        let bounces = lanes.bounces[lane].plus(mode.is_met());
        lanes.bounces[lane] = bounces;
        let plain = interface & back & inside & (bounces < self.max_bounces);
        lanes.event[lane] = Flag::new(!plain);
    }

    /// Turns mirrored and refracted light into its new direction and starts it off the surface.
    #[inline(always)]
    fn turn(&self, lanes: &mut Lanes, lane: usize) {
        let d = [0, 1, 2].map(|axis| lanes.direction[axis][lane]);
        let n = [0, 1, 2].map(|axis| lanes.normal[axis][lane]);
        let p = [0, 1, 2].map(|axis| lanes.origin[axis][lane]);
        let [along, aside] = [lanes.factors[0][lane], lanes.factors[1][lane]];
        let back = lanes.course[lane] == Course::BACK;
        let turned = lanes.mode[lane].is_specular();
        let w = [0, 1, 2].map(|axis| d[axis] * along + n[axis] * aside);
        let unit = 1.5 - 0.5 * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
        let w = w.map(|w| w * unit);
        let off = if back { self.offset } else { -self.offset };
        let off = off * lanes.facing[lane];
        let off = if turned { off } else { 0.0 };
        for axis in 0..3 {
            lanes.direction[axis][lane] = if turned { w[axis] } else { d[axis] };
            lanes.origin[axis][lane] = p[axis] + n[axis] * off;
        }
    }
}

impl PackageGeometry {
    /// Sends light on in its sampled order.
    #[inline(always)]
    fn diffract(&self, lanes: &mut Lanes, lane: usize) {
        let to = lanes.to[lane];
        let drawn = to != 0.0;
        let index = if to < 0.0 { self.orders[0] } else { self.orders[1] };
        let (kx, ky) = (lanes.wave[0][lane], lanes.wave[1][lane]);
        let kz = positive(index * index - kx * kx - ky * ky).sqrt() * to;
        let per_index = 1.0 / index;
        let (t, n) = (&lanes.along, &lanes.normal);
        let wx = (t[0][lane] * kx + lanes.across[0][lane] * ky + n[0][lane] * kz) * per_index;
        let wy = (t[1][lane] * kx + lanes.across[1][lane] * ky + n[1][lane] * kz) * per_index;
        let wz = (t[2][lane] * kx + n[2][lane] * kz) * per_index;
        let unit = 1.5 - 0.5 * (wx * wx + wy * wy + wz * wz);
        let w = [wx * unit, wy * unit, wz * unit];
        let d = [0, 1, 2].map(|axis| lanes.direction[axis][lane]);
        let off = to * self.offset;
        let off = if drawn { off } else { 0.0 };
        for axis in 0..3 {
            lanes.direction[axis][lane] = if drawn { w[axis] } else { d[axis] };
        }
        lanes.origin[0][lane] += lanes.normal[0][lane] * off;
        lanes.origin[1][lane] += lanes.normal[1][lane] * off;
        lanes.origin[2][lane] += lanes.normal[2][lane] * off;
    }
}

/// Sends all rays on in their sampled orders.
pub(super) struct Diffract<'a>(pub &'a PackageGeometry, pub &'a mut Lanes);

impl WithSimd for Diffract<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let geometry = *self.0;
        for lane in 0..LANES {
            geometry.diffract(self.1, lane);
        }
    }
}

/// Finds the distances of all rays.
pub(super) struct Distances<'a, const ROUND: bool>(pub &'a PackageGeometry, pub &'a mut Lanes);

impl<const ROUND: bool> WithSimd for Distances<'_, ROUND> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let geometry = *self.0;
        for lane in 0..LANES {
            geometry.distances::<ROUND>(self.1, lane);
        }
    }
}

/// Chooses the nearest surface for all rays; gives the lanes that meet one from outside, as bits.
pub(super) struct Nearest<'a, const ROUND: bool>(pub &'a PackageGeometry, pub &'a mut Lanes);

impl<const ROUND: bool> WithSimd for Nearest<'_, ROUND> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> u64 {
        let (geometry, lanes) = (*self.0, self.1);
        for lane in 0..LANES {
            geometry.nearest::<ROUND>(lanes, lane);
        }
        let mut outside = 0;
        for lane in 0..LANES {
            let met = !lanes.inside[lane].is_set() & (lanes.mode[lane].is_met());
            outside |= u64::from(met) << lane;
        }
        outside
    }
}

/// Reflects or refracts all rays, in three loops: the processor then overlaps several rays, where
/// one chain of roots and quotients would keep it waiting.
pub(super) struct Interact<'a, const ROUND: bool, const ORDERS: bool>(
    pub &'a PackageGeometry,
    pub &'a mut Lanes,
);

impl<const ROUND: bool, const ORDERS: bool> WithSimd for Interact<'_, ROUND, ORDERS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let geometry = *self.0;
        for lane in 0..LANES {
            geometry.settle::<ROUND, ORDERS>(self.1, lane);
        }
        for lane in 0..LANES {
            geometry.decide::<ORDERS>(self.1, lane);
        }
        for lane in 0..LANES {
            geometry.turn(self.1, lane);
        }
    }
}
