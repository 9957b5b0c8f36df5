// SPDX-License-Identifier: MIT OR Apache-2.0
//! Turned arcs: an arc of a meridian turned about the z axis, part of a torus, a spindle torus or a
//! sphere.
//!
//! Let the arc have radius a and its centre distance c from the axis. Along the ray, with u
//! measured from the middle of its flight, r² = A u² + 2 B u + C, and w is the height above the
//! centre. The ray meets the whole circle where
//!
//! h = (r - c)² + w² - a² = 0.
//!
//! F = (r² + w² + c² - a²)² - 4 c² r² is h times the same function of the circle on the other side
//! of the axis. F has degree four. By Rolle's theorem its stationary points, which are roots of v³
//! + p v + q with v = u + b, separate its roots, and so those of h.
//!
//! The sign of h, which loses no digits, is evaluated at these points, at the ends of the flight
//! and at the start of the ray. So a ray that starts inside finds its way out even where two roots
//! nearly coincide. Each change of sign is one crossing, and its sense tells the side. On the axis
//! r has no slope and a cusp has no inside: there an end of the arc on the axis is met as such.

use bsdf::Side;
use glam::{DVec2, DVec3};

use super::{Bounds, Intersection, RELATIVE_PAD, Reach, Sides};
use crate::error::{Error, check, finite};
use crate::ray::Ray;

/// Steps that refine a crossing; Newton's take four to six, bisection 52.
const STEPS: usize = 100;
/// Slack of the box around an arc, as a share of its size: far above rounding, only to save work.
const SLACK: f64 = 1e-6;

/// The sense of an arc about its centre, r to the right and z up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bend {
    /// Outline of a dome from its top outwards; n points away from the centre.
    Clockwise,
    /// Hollow; n points to the centre.
    Counterclockwise,
}

/// A turned arc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torus {
    /// Centre of the arc, [r, z]; r may be negative.
    centre: [f64; 2],
    radius: f64,
    start: [f64; 2],
    end: [f64; 2],
    /// 1 if n points away from the centre, -1 if to it.
    outward: f64,
    /// Unit vector of the chord, its length, and whether the arc is longer than half a circle.
    along: [f64; 2],
    chord: f64,
    major: bool,
    pad: f64,
    low: f64,
    high: f64,
    reach: f64,
}

impl Torus {
    /// The arc from `start` to `end` about `centre`, all [r, z] in mm. n lies to the left of its
    /// way.
    ///
    /// # Errors
    /// Ends that are one point, that are not at the same distance of the centre within 1e-9 of it,
    /// or that lie across the axis; an arc that does.
    pub fn new(
        start: [f64; 2],
        end: [f64; 2],
        centre: [f64; 2],
        bend: Bend,
    ) -> Result<Self, Error> {
        for [r, z] in [start, end] {
            check("radius of a point of an arc, mm", r, "a finite number, 0 or more", r >= 0.0)?;
            finite("height of a point of an arc, mm", z)?;
        }
        finite("radius of the centre of an arc, mm", centre[0])?;
        finite("height of the centre of an arc, mm", centre[1])?;
        let away = |p: [f64; 2]| (p[0] - centre[0]).hypot(p[1] - centre[1]);
        let radius = 0.5 * (away(start) + away(end));
        let size =
            [start, end, centre].iter().flatten().fold(radius, |size: f64, v| size.max(v.abs()));
        let off = away(start) - away(end);
        check(
            "distance of the ends of an arc from its centre, mm",
            off,
            "the same for both",
            off.abs() <= 1e-9 * size,
        )?;
        let step = [end[0] - start[0], end[1] - start[1]];
        let chord = step[0].hypot(step[1]);
        check(
            "distance of the ends of an arc, mm",
            chord,
            "a length above rounding",
            chord > 1e3 * RELATIVE_PAD * size,
        )?;
        let outward = match bend {
            Bend::Clockwise => 1.0,
            Bend::Counterclockwise => -1.0,
        };
        let along = step.map(|d| d / chord);
        let mut arc = Self {
            centre,
            radius,
            start,
            end,
            outward,
            along,
            chord,
            major: outward * cross(along, [centre[0] - start[0], centre[1] - start[1]]) > 0.0,
            pad: RELATIVE_PAD * size,
            low: start[1].min(end[1]),
            high: start[1].max(end[1]),
            reach: start[0].max(end[0]),
        };
        let pole = |r: f64, z: f64| [centre[0] + radius * r, centre[1] + radius * z];
        for p in [pole(1.0, 0.0), pole(0.0, 1.0), pole(-1.0, 0.0), pole(0.0, -1.0)] {
            if arc.holds(p) {
                check(
                    "radius of a point of an arc, mm",
                    p[0],
                    "an arc that stays on one side of the axis",
                    p[0] >= -arc.pad,
                )?;
                arc.low = arc.low.min(p[1]);
                arc.high = arc.high.max(p[1]);
                arc.reach = arc.reach.max(p[0]);
            }
        }
        Ok(arc)
    }

    /// True if a point of the circle belongs to the arc.
    #[inline]
    fn holds(&self, p: [f64; 2]) -> bool {
        if self.major {
            let off = cross(self.along, [p[0] - self.start[0], p[1] - self.start[1]]);
            return self.outward * off >= -self.pad;
        }
        let from_start = [p[0] - self.start[0], p[1] - self.start[1]];
        let along = self.along[0] * from_start[0] + self.along[1] * from_start[1];
        let off = cross(self.along, [p[0] - self.centre[0], p[1] - self.centre[1]]);
        along >= -self.pad && along <= self.chord + self.pad && self.outward * off >= -self.pad
    }

    #[inline]
    pub(super) fn intersect(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        if ray.origin.truncate() == DVec2::ZERO && ray.direction.truncate() == DVec2::ZERO {
            return self.on_axis(ray, reach, sides);
        }
        let [from, to] = self.flight(ray, reach)?;
        // Distances from the middle of the flight: no digits are lost far away.
        let middle = 0.5 * (from + to);
        let track = Track::new(self, ray, middle);
        let mut points = [from - middle; 6];
        let mut count = 1;
        let mut add = |u: f64| {
            if u > points[0] && u < to - middle {
                points[count] = u;
                count += 1;
            }
        };
        if from < 0.0 {
            add(-middle);
        }
        let (stationary, number) = track.stationary();
        for u in &stationary[..number] {
            add(*u);
        }
        points[1..count].sort_unstable_by(f64::total_cmp);
        points[count] = to - middle;

        let mut before = track.level(points[0]);
        for pair in points[..=count].windows(2) {
            let after = track.level(pair[1]);
            let leaves = after >= 0.0;
            if (before >= 0.0) == leaves {
                before = after;
                continue;
            }
            before = after;
            // d·n has the sign with which the ray leaves the circle, or the other one where n
            // points to the centre.
            let side = if leaves == (self.outward > 0.0) { Side::Inner } else { Side::Outer };
            if !sides.admit(side) {
                continue;
            }
            let found = track.crossing(pair[0], pair[1], leaves);
            let Some(u) = track.passing(found, leaves) else {
                continue;
            };
            let distance = middle + u;
            if reach.holds(distance) && self.holds(track.at(u)) {
                return Some(Intersection { distance, primitive: 0, side });
            }
        }
        None
    }

    /// Distance where a ray along the axis meets an end of the arc there. As n lies to the left of
    /// its way, n points up where the arc begins and down where it ends.
    #[cold]
    fn on_axis(&self, ray: &Ray, reach: Reach, sides: Sides) -> Option<Intersection> {
        let rises = ray.direction.z > 0.0;
        let ends = [(self.start, rises), (self.end, !rises)];
        let met = ends.into_iter().filter_map(|([r, z], leaves)| {
            let distance = (z - ray.origin.z) / ray.direction.z;
            let side = if leaves { Side::Inner } else { Side::Outer };
            (r == 0.0 && sides.admit(side) && reach.holds(distance)).then_some(Intersection {
                distance,
                primitive: 0,
                side,
            })
        });
        met.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// The part of the ray within reach and within the cylinder around the arc.
    #[inline]
    fn flight(&self, ray: &Ray, reach: Reach) -> Option<[f64; 2]> {
        let (o, d) = (ray.origin, ray.direction);
        let slack = SLACK * (self.reach + self.high - self.low);
        let (mut from, mut to) = (reach.from, reach.to);
        let inverse = d.z.recip();
        let (a, b) = ((self.low - slack - o.z) * inverse, (self.high + slack - o.z) * inverse);
        // f64::min and max drop the NaN of a level ray at the very height of an end.
        from = from.max(a.min(b));
        to = to.min(a.max(b));
        if from >= to {
            return None;
        }
        let along = d.x * d.x + d.y * d.y;
        let max = self.reach + slack;
        let outside = o.x * o.x + o.y * o.y - max * max;
        if along > 0.0 {
            let half = o.x * d.x + o.y * d.y;
            let square = half * half - along * outside;
            if square <= 0.0 {
                return None;
            }
            let root = square.sqrt();
            from = from.max((-half - root) / along);
            to = to.min((root - half) / along);
        } else if outside > 0.0 {
            return None;
        }
        (from < to && to.is_finite()).then_some([from, to])
    }

    /// Nearest point of the tube to `at`, with the normal there.
    #[inline]
    pub(super) fn settle(&self, at: DVec3) -> (DVec3, DVec3) {
        let radius = (at.x * at.x + at.y * at.y).sqrt();
        let (cos_phi, sin_phi) =
            if radius > 0.0 { (at.x / radius, at.y / radius) } else { (1.0, 0.0) };
        let (dr, dz) = (radius - self.centre[0], at.z - self.centre[1]);
        let per = 1.0 / (dr * dr + dz * dz).sqrt();
        let away = DVec3::new(dr * per * cos_phi, dr * per * sin_phi, dz * per);
        let middle = DVec3::new(self.centre[0] * cos_phi, self.centre[0] * sin_phi, self.centre[1]);
        (middle + away * self.radius, away * self.outward)
    }

    /// The points of the arc of which one lies farthest along a direction of the (r, z) plane.
    pub(super) fn farthest(&self, [r, z]: [f64; 2]) -> Vec<[f64; 2]> {
        let per = self.radius / r.hypot(z);
        let pole = [self.centre[0] + r * per, self.centre[1] + z * per];
        let mut points = self.ends().to_vec();
        if self.holds(pole) {
            points.push(pole);
        }
        points
    }

    /// The same with all coordinates times `factor`.
    pub(super) fn scaled(&self, factor: f64) -> Result<Self, Error> {
        let bend = if self.outward > 0.0 { Bend::Clockwise } else { Bend::Counterclockwise };
        let [start, end, centre] =
            [self.start, self.end, self.centre].map(|at| at.map(|along| factor * along));
        Self::new(start, end, centre, bend)
    }

    /// Both ends of the arc, [r, z].
    pub(super) fn ends(&self) -> [[f64; 2]; 2] {
        [self.start, self.end]
    }

    /// Least distance of a point of the arc from the axis.
    pub(crate) fn min_radius(&self) -> f64 {
        self.farthest([-1.0, 0.0]).into_iter().fold(self.reach, |min, [r, _]| min.min(r))
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds {
            low: DVec3::new(-self.reach, -self.reach, self.low),
            high: DVec3::new(self.reach, self.reach, self.high),
        }
    }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A ray as the circle sees it, from a point in the middle of its flight.
struct Track {
    /// x and y there, and the height above the centre.
    start: DVec3,
    direction: DVec3,
    /// r² = a u² + 2 b u + c.
    a: f64,
    b: f64,
    c: f64,
    centre: f64,
    radius: f64,
    centre_z: f64,
}

impl Track {
    fn new(torus: &Torus, ray: &Ray, middle: f64) -> Self {
        let start = ray.at(middle) - DVec3::Z * torus.centre[1];
        let d = ray.direction;
        Self {
            start,
            direction: d,
            a: d.x * d.x + d.y * d.y,
            b: start.x * d.x + start.y * d.y,
            c: start.x * start.x + start.y * start.y,
            centre: torus.centre[0],
            radius: torus.radius,
            centre_z: torus.centre[1],
        }
    }

    /// (r - c, w).
    #[inline]
    fn apart(&self, u: f64) -> [f64; 2] {
        let at = self.start + self.direction * u;
        [(at.x * at.x + at.y * at.y).sqrt() - self.centre, at.z]
    }

    /// (r, z).
    #[inline]
    fn at(&self, u: f64) -> [f64; 2] {
        let [dr, dz] = self.apart(u);
        [dr + self.centre, dz + self.centre_z]
    }

    /// h: negative inside of the circle.
    #[inline]
    fn level(&self, u: f64) -> f64 {
        let [dr, dz] = self.apart(u);
        dr * dr + dz * dz - self.radius * self.radius
    }

    /// dr/du, at most 1 in size; 0 on the axis, where it is one of two.
    #[inline]
    fn rise(&self, u: f64, dr: f64) -> f64 {
        let rise = (self.a * u + self.b) / (dr + self.centre);
        if rise.abs() <= 2.0 { rise } else { 0.0 }
    }

    /// Points where F is stationary.
    fn stationary(&self) -> ([f64; 3], usize) {
        let (w, dz, c2) = (self.start.z, self.direction.z, self.centre * self.centre);
        // The ray's direction is a unit vector: r² + w² + c² - a² = u² + 2 b u + e.
        let b = self.b + w * dz;
        let e = self.c + w * w + c2 - self.radius * self.radius;
        let p = e - b * b - 2.0 * c2 * self.a;
        let q = 2.0 * c2 * (self.a * b - self.b);
        let (roots, count) = cubic(p, q);
        (roots.map(|v| v - b), count)
    }

    /// The crossing at `u` of a ray that `leaves` or enters. Where it does neither but for
    /// rounding, as it grazes, the place nearby where it runs along the circle; none where rounding
    /// made up the crossing, beside one of the other sense.
    fn passing(&self, mut u: f64, leaves: bool) -> Option<f64> {
        for _ in 0..3 {
            let [dr, dz] = self.apart(u);
            let rise = self.rise(u, dr);
            let rate = dr * rise + dz * self.direction.z;
            if (rate >= 0.0) == leaves {
                break;
            }
            let bend = rise * rise
                + dr * (self.a - rise * rise) / (dr + self.centre)
                + self.direction.z * self.direction.z;
            let step = rate / bend;
            // Rounding moves a grazing crossing by its root only.
            if step.is_nan() || step.abs() > 1e-6 * self.radius {
                return None;
            }
            u -= step;
        }
        Some(u)
    }

    /// The one crossing between two points of different sign, the second one outside if the ray
    /// `leaves`.
    fn crossing(&self, mut low: f64, mut high: f64, leaves: bool) -> f64 {
        let mut u = 0.5 * (low + high);
        for _ in 0..STEPS {
            let [dr, dz] = self.apart(u);
            let level = dr * dr + dz * dz - self.radius * self.radius;
            if level == 0.0 {
                break;
            }
            if (level >= 0.0) == leaves {
                high = u;
            } else {
                low = u;
            }
            let rate =
                2.0 * (dr * (self.a * u + self.b) / (dr + self.centre) + dz * self.direction.z);
            let step = level / rate;
            let mut next = u - step;
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
                if next <= low || next >= high {
                    break;
                }
            } else if step.abs() <= 2.0 * f64::EPSILON * u.abs().max(self.radius) {
                return next;
            }
            u = next;
        }
        u
    }
}

/// The real roots of v³ + p v + q.
fn cubic(p: f64, q: f64) -> ([f64; 3], usize) {
    let (third, half) = (p / 3.0, 0.5 * q);
    let discriminant = half * half + third * third * third;
    let polished = |mut v: f64| {
        for _ in 0..2 {
            let step = ((v * v + p) * v + q) / (3.0 * v * v + p);
            if step.is_finite() && step.abs() < 0.1 * v.abs() {
                v -= step;
            }
        }
        v
    };
    if discriminant > 0.0 {
        // The sum without cancellation, then the other part of Cardano's formula from it.
        let large =
            -(half.abs() + discriminant.sqrt()).cbrt() * if half < 0.0 { -1.0 } else { 1.0 };
        let other = if large == 0.0 { 0.0 } else { -third / large };
        return ([polished(large + other), 0.0, 0.0], 1);
    }
    let scale = 2.0 * (-third).max(0.0).sqrt();
    if scale == 0.0 {
        return ([0.0; 3], 1);
    }
    let cosine = (-4.0 * q / (scale * scale * scale)).clamp(-1.0, 1.0);
    let angle = cosine.acos() / 3.0;
    let root = |k: f64| polished(scale * (angle - std::f64::consts::TAU / 3.0 * k).cos());
    ([root(0.0), root(1.0), root(2.0)], 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_cubics_are_found() {
        for (p, q, roots) in [
            (-7.0, 6.0, vec![-3.0, 1.0, 2.0]),
            (0.0, -8.0, vec![2.0]),
            (3.0, -4.0, vec![1.0]),
            (-3.0, 2.0, vec![-2.0, 1.0, 1.0]),
            (1.0, 0.0, vec![0.0]),
            (-1.0, 0.0, vec![-1.0, 0.0, 1.0]),
        ] {
            let (mut found, count) = cubic(p, q);
            found[..count].sort_unstable_by(f64::total_cmp);
            assert_eq!(count, roots.len(), "{p} {q} {found:?}");
            for (found, root) in found.iter().zip(roots) {
                assert!((found - root).abs() < 1e-7, "{p} {q} {found} {root}");
            }
        }
    }

    #[test]
    fn arcs_hold_their_points_and_no_others() {
        // A quarter, and what is left of its circle.
        let quarter = Torus::new([0.0, 1.0], [1.0, 0.0], [0.0, 0.0], Bend::Clockwise);
        let quarter = quarter.expect("a quarter of a circle");
        let rest = Torus::new([3.0, 1.0], [4.0, 0.0], [3.0, 0.0], Bend::Counterclockwise);
        let rest = rest.expect("three quarters");
        for k in 1..360 {
            let (sin, cos) = (f64::from(k) - 0.5).to_radians().sin_cos();
            assert_eq!(quarter.holds([cos, sin]), k <= 90, "{k}");
            assert_eq!(rest.holds([3.0 + cos, sin]), k > 90, "{k}");
        }
        let Bounds { low, high } = rest.bounds();
        let found = DVec3::new(low.z, high.z, high.x);
        assert_eq!(found, DVec3::new(-1.0, 1.0, 4.0));
        assert_eq!(quarter.bounds().high, DVec3::splat(1.0));
    }

    #[test]
    fn arcs_across_the_axis_and_of_no_circle_are_refused() {
        let across = Torus::new([0.5, 1.0], [0.5, -1.0], [0.5, 0.0], Bend::Counterclockwise);
        assert!(across.is_err());
        assert!(Torus::new([0.5, 1.0], [0.5, -1.0], [0.5, 0.0], Bend::Clockwise).is_ok());
        assert!(Torus::new([0.0, 1.0], [1.0, 0.1], [0.0, 0.0], Bend::Clockwise).is_err());
        assert!(Torus::new([1.0, 1.0], [1.0, 1.0], [0.0, 0.0], Bend::Clockwise).is_err());
    }
}
