// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where pieces of generating curves meet, and what else the plane (r, z) knows of a piece: its
//! length, its directions at its ends, how far it reaches.

use std::f64::consts::{PI, TAU};

use super::{Curve, Piece, Role};

/// The circle of an arc: centre, radius, and whether its way is clockwise (r to the right, z up).
#[derive(Debug, Clone, Copy)]
struct Circle {
    centre: [f64; 2],
    radius: f64,
    clockwise: bool,
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Distance of two points.
pub(super) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let d = minus(a, b);
    d[0].hypot(d[1])
}

impl Piece {
    /// A straight piece.
    pub(super) fn line(start: [f64; 2], end: [f64; 2], role: Role) -> Self {
        Self { start, end, curve: Curve::Line, role }
    }

    fn circle(&self) -> Option<Circle> {
        match self.curve {
            Curve::Line => None,
            Curve::Arc { radius_mm, centre_mm } => {
                Some(Circle { centre: [0.0, centre_mm], radius: radius_mm, clockwise: true })
            }
            Curve::Bend { radius_mm, centre_mm, clockwise } => {
                Some(Circle { centre: centre_mm, radius: radius_mm, clockwise })
            }
        }
    }

    /// Whether its way is clockwise about its centre, r to the right and z up; of a line, false.
    pub fn clockwise(&self) -> bool {
        self.circle().is_some_and(|circle| circle.clockwise)
    }

    /// Angle that an arc turns through, radians, above 0; 0 for a line.
    pub fn sweep(&self) -> f64 {
        self.circle().map_or(0.0, |circle| circle.turned(self.start, self.end))
    }

    /// The point (r, z) at the share `part` of its way, mm.
    pub fn along(&self, part: f64) -> [f64; 2] {
        let Some(circle) = self.circle() else {
            let step = minus(self.end, self.start);
            return [0, 1].map(|k| self.start[k] + part * step[k]);
        };
        let turn = part * self.sweep() * if circle.clockwise { -1.0 } else { 1.0 };
        let (sin, cos) = turn.sin_cos();
        let [r, z] = minus(self.start, circle.centre);
        [circle.centre[0] + cos * r - sin * z, circle.centre[1] + sin * r + cos * z]
    }

    /// Length, mm.
    pub fn length_mm(&self) -> f64 {
        match self.circle() {
            None => distance(self.start, self.end),
            Some(circle) => circle.radius * self.sweep(),
        }
    }

    /// Points of an arc at `count` equal angles, the last of them its end; the end alone of a line.
    pub fn points(&self, count: usize) -> Vec<[f64; 2]> {
        let Some(circle) = self.circle() else {
            return vec![self.end];
        };
        let from = circle.angle(self.start);
        let turn = self.sweep() * if circle.clockwise { -1.0 } else { 1.0 };
        let at = |k: usize| {
            let (sin, cos) = (from + turn * k as f64 / count as f64).sin_cos();
            [circle.centre[0] + circle.radius * cos, circle.centre[1] + circle.radius * sin]
        };
        let mut points: Vec<[f64; 2]> = (1..count).map(at).collect();
        points.push(self.end);
        points
    }

    /// Unit vectors along its way at its start and at its end.
    pub(super) fn directions(&self) -> [[f64; 2]; 2] {
        [self.start, self.end].map(|p| self.direction(p))
    }

    /// Unit vector along its way at a point of it.
    pub(super) fn direction(&self, p: [f64; 2]) -> [f64; 2] {
        let Some(circle) = self.circle() else {
            let (step, length) = (minus(self.end, self.start), self.length_mm());
            return step.map(|d| d / length);
        };
        let [r, z] = minus(p, circle.centre).map(|d| d / circle.radius);
        if circle.clockwise { [z, -r] } else { [-z, r] }
    }

    /// The point at this height of a piece that falls or rises all along.
    pub(super) fn at_height(&self, z: f64) -> [f64; 2] {
        let Some(circle) = self.circle() else {
            let [[from, low], [to, high]] = [self.start, self.end];
            return [from + (to - from) * (z - low) / (high - low), z];
        };
        let up = z - circle.centre[1];
        let across = ((circle.radius - up) * (circle.radius + up)).max(0.0).sqrt();
        let side = (self.along(0.5)[0] - circle.centre[0]).signum();
        [circle.centre[0] + side * across, z]
    }

    /// Its parts between the points where an arc is highest or lowest, by more than `slack` mm beyond
    /// its ends.
    pub(super) fn between_heights(&self, slack: f64) -> Vec<Self> {
        let [low, high] = [self.start[1].min(self.end[1]), self.start[1].max(self.end[1])];
        let inside = |p: &[f64; 2]| p[1] > high + slack || p[1] < low - slack;
        let mut points: Vec<[f64; 2]> = self.extremes().into_iter().filter(inside).collect();
        points.sort_by(|a, b| self.position(*a).total_cmp(&self.position(*b)));
        points.insert(0, self.start);
        points.push(self.end);
        points.windows(2).map(|ends| Self { start: ends[0], end: ends[1], ..*self }).collect()
    }

    /// The piece at this distance to its left, mm; none of an arc beyond its centre.
    pub(super) fn moved(&self, to_left_mm: f64) -> Option<Self> {
        let wider = |clockwise: bool| if clockwise { to_left_mm } else { -to_left_mm };
        let mut moved = *self;
        let radius = match &mut moved.curve {
            Curve::Line => None,
            Curve::Arc { radius_mm, .. } => {
                *radius_mm += wider(true);
                Some(*radius_mm)
            }
            Curve::Bend { radius_mm, clockwise, .. } => {
                *radius_mm += wider(*clockwise);
                Some(*radius_mm)
            }
        };
        let [at_start, at_end] = self.directions();
        let aside = |p: [f64; 2], [r, z]: [f64; 2]| [p[0] - to_left_mm * z, p[1] + to_left_mm * r];
        moved.start = aside(self.start, at_start);
        moved.end = aside(self.end, at_end);
        radius.is_none_or(|radius| radius > 0.0).then_some(moved)
    }

    /// The point of its line or circle nearest to `p`, wherever the piece ends.
    pub(super) fn nearest(&self, p: [f64; 2]) -> [f64; 2] {
        match self.circle() {
            None => {
                let [u, _] = self.directions();
                let along = dot(minus(p, self.start), u);
                [0, 1].map(|k| self.start[k] + along * u[k])
            }
            Some(circle) => {
                let off = distance(p, circle.centre);
                let to = minus(p, circle.centre);
                [0, 1].map(|k| circle.centre[k] + circle.radius / off * to[k])
            }
        }
    }

    /// How far along its way a point of its line or circle lies, mm; below 0 before its start.
    pub(super) fn position(&self, p: [f64; 2]) -> f64 {
        match self.circle() {
            None => dot(minus(p, self.start), self.directions()[0]),
            Some(circle) => {
                let turned = circle.turned(self.start, p);
                // Nearer to the start than to the end the other way round.
                let before = TAU - turned < turned - self.sweep();
                circle.radius * if before { turned - TAU } else { turned }
            }
        }
    }

    /// Its ends, and the points where an arc is farthest out, in, up or down.
    pub(super) fn extremes(&self) -> Vec<[f64; 2]> {
        let mut found = vec![self.start, self.end];
        if let Some(circle) = self.circle() {
            let [r, z] = circle.centre;
            let a = circle.radius;
            let poles = [[r + a, z], [r, z + a], [r - a, z], [r, z - a]];
            found.extend(poles.into_iter().filter(|p| self.holds(*p, 0.0)));
        }
        found
    }

    /// Low and high corner of the box around it.
    pub(super) fn extent(&self) -> [[f64; 2]; 2] {
        let start = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        self.extremes().into_iter().fold(start, |[low, high], p| {
            [[0, 1].map(|k| low[k].min(p[k])), [0, 1].map(|k| high[k].max(p[k]))]
        })
    }

    /// Whether a point of its line or circle lies between its ends, or within `slack` mm of them.
    fn holds(&self, p: [f64; 2], slack: f64) -> bool {
        match self.circle() {
            None => {
                let (step, length) = (minus(self.end, self.start), self.length_mm());
                let along = dot(minus(p, self.start), step) / length;
                along >= -slack && along <= length + slack
            }
            Some(circle) => {
                let turned = circle.turned(self.start, p);
                let slack = slack / circle.radius;
                turned <= self.sweep() + slack || turned >= TAU - slack
            }
        }
    }
}

impl Circle {
    fn angle(&self, p: [f64; 2]) -> f64 {
        let [r, z] = minus(p, self.centre);
        z.atan2(r)
    }

    /// Angle from one point to the other along the way, 0 to 2π.
    fn turned(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let turn = self.angle(to) - self.angle(from);
        let turn = if self.clockwise { -turn } else { turn };
        turn.rem_euclid(TAU)
    }
}

/// Points that two pieces have in common, `slack` mm aside; of a stretch that they share, one or
/// two of its points.
pub(super) fn meetings(a: &Piece, b: &Piece, slack: f64) -> Vec<[f64; 2]> {
    let common = |p: &[f64; 2]| a.holds(*p, slack) && b.holds(*p, slack);
    crossings(a, b, slack).into_iter().filter(common).collect()
}

/// Points that the lines or circles of two pieces have in common, wherever the pieces end.
pub(super) fn crossings(a: &Piece, b: &Piece, slack: f64) -> Vec<[f64; 2]> {
    match (a.circle(), b.circle()) {
        (None, None) => of_lines(a, b, slack),
        (None, Some(circle)) => of_line_and_circle(a, circle),
        (Some(circle), None) => of_line_and_circle(b, circle),
        (Some(first), Some(second)) => of_circles([a, b], [first, second], slack),
    }
}

fn of_lines(a: &Piece, b: &Piece, slack: f64) -> Vec<[f64; 2]> {
    let ([u, _], [v, _]) = (a.directions(), b.directions());
    let apart = minus(b.start, a.start);
    let sine = cross(u, v);
    if sine.abs() < 1e-12 {
        // Parallel: the ends of either, where both lie on one line.
        let off = cross(u, apart).abs();
        let ends = [a.start, a.end, b.start, b.end];
        return if off > slack { Vec::new() } else { ends.to_vec() };
    }
    let along = cross(apart, v) / sine;
    vec![[a.start[0] + along * u[0], a.start[1] + along * u[1]]]
}

fn of_line_and_circle(line: &Piece, circle: Circle) -> Vec<[f64; 2]> {
    let [u, _] = line.directions();
    let to_centre = minus(circle.centre, line.start);
    let (nearest, off) = (dot(to_centre, u), cross(u, to_centre));
    let square = circle.radius * circle.radius - off * off;
    // A line that touches meets the circle but for rounding.
    if square < -1e-12 * circle.radius * circle.radius {
        return Vec::new();
    }
    let half = square.max(0.0).sqrt();
    let at = |t: f64| [line.start[0] + t * u[0], line.start[1] + t * u[1]];
    vec![at(nearest - half), at(nearest + half)]
}

fn of_circles(pieces: [&Piece; 2], [a, b]: [Circle; 2], slack: f64) -> Vec<[f64; 2]> {
    let apart = minus(b.centre, a.centre);
    let d = apart[0].hypot(apart[1]);
    if d <= slack {
        // One circle, or two that share no point.
        let ends = pieces.map(|p| [p.start, p.end]).concat();
        let one = (a.radius - b.radius).abs() <= slack;
        return if one { ends } else { Vec::new() };
    }
    let along = 0.5 * (d + (a.radius - b.radius) * (a.radius + b.radius) / d);
    let square = (a.radius - along) * (a.radius + along);
    if square < -1e-12 * a.radius * a.radius {
        return Vec::new();
    }
    let half = square.max(0.0).sqrt();
    let u = apart.map(|c| c / d);
    let at =
        |s: f64| [a.centre[0] + along * u[0] - s * u[1], a.centre[1] + along * u[1] + s * u[0]];
    vec![at(half), at(-half)]
}

/// The circle through two points with the centre at this bulge, tan of a quarter of the angle
/// turned through, above 0 for counterclockwise.
pub(super) fn centre_of_bulge(start: [f64; 2], end: [f64; 2], bulge: f64) -> [f64; 2] {
    // The centre lies (1 - b²) / 4b chords to the left of the middle of the chord.
    let off = (1.0 - bulge * bulge) / (4.0 * bulge);
    let step = minus(end, start);
    [0.5 * (start[0] + end[0]) - off * step[1], 0.5 * (start[1] + end[1]) + off * step[0]]
}

/// Whether the way from `start` to `end` about `centre` is the shorter one clockwise; `None` at
/// half a turn.
pub(super) fn shorter_is_clockwise(
    start: [f64; 2],
    end: [f64; 2],
    centre: [f64; 2],
) -> Option<bool> {
    let (from, to) = (minus(start, centre), minus(end, centre));
    let turn = cross(from, to).atan2(dot(from, to));
    (turn.abs() < PI - 1e-6).then_some(turn < 0.0)
}
