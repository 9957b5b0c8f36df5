// SPDX-License-Identifier: MIT OR Apache-2.0
//! Outline of a body in the plane: a chain of lines and arcs, closed or from mirror to mirror.

use crate::FullWaveError;
use crate::kernel::sinc;
use std::f64::consts::{PI, TAU};

/// Line or arc by its arc length from one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Point at arc length 0.
    pub origin: [f64; 2],
    /// Unit tangent there.
    pub tangent: [f64; 2],
    /// Curvature; positive to the left of the direction of travel.
    pub curvature: f64,
}

impl Curve {
    /// Returns the arc between two different points that turns by `turn` radians on its way, to the
    /// left if positive, and its length.
    pub fn between(from: [f64; 2], to: [f64; 2], turn: f64) -> (Self, f64) {
        let across = [to[0] - from[0], to[1] - from[1]];
        let chord = across[0].hypot(across[1]);
        let length = chord / sinc(0.5 * turn);
        let tangent = turned([across[0] / chord, across[1] / chord], -0.5 * turn);
        (Self { origin: from, tangent, curvature: turn / length }, length)
    }

    /// Returns the point at arc length `s`, which may be negative.
    pub fn point(&self, s: f64) -> [f64; 2] {
        let half = 0.5 * self.curvature * s;
        let chord = s * sinc(half);
        let [x, z] = turned(self.tangent, half);
        [self.origin[0] + chord * x, self.origin[1] + chord * z]
    }

    /// Returns the unit tangent at arc length `s`.
    pub fn tangent(&self, s: f64) -> [f64; 2] {
        turned(self.tangent, self.curvature * s)
    }

    /// Returns the normal to the right of the direction of travel: outward, if the outline runs
    /// counter-clockwise.
    pub fn normal(&self, s: f64) -> [f64; 2] {
        let [x, z] = self.tangent(s);
        [z, -x]
    }
}

fn turned([x, z]: [f64; 2], angle: f64) -> [f64; 2] {
    if angle == 0.0 {
        return [x, z];
    }
    let (sin, cos) = angle.sin_cos();
    [x * cos - z * sin, x * sin + z * cos]
}

/// A piece of the outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    pub curve: Curve,
    pub length: f64,
}

impl Segment {
    pub fn end(&self) -> [f64; 2] {
        self.curve.point(self.length)
    }

    /// Returns the same piece in two halves.
    fn halves(&self) -> [Self; 2] {
        let half = 0.5 * self.length;
        let middle = Curve {
            origin: self.curve.point(half),
            tangent: self.curve.tangent(half),
            curvature: self.curve.curvature,
        };
        [Self { length: half, ..*self }, Self { curve: middle, length: half }]
    }
}

/// Where a body stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Surroundings {
    /// The outline is closed, and the second medium is all around it.
    Free,
    /// A perfect mirror fills z < 0; the outline begins and ends on it.
    Mirror,
}

/// Outline of a body, counter-clockwise: lines and arcs from point to point, lengths in any unit.
///
/// ```
/// use full_wave::Outline;
///
/// // Half a cylinder of radius 2 on a mirror.
/// let half = Outline::on_mirror([2.0, 0.0]).arc_to([-2.0, 0.0], std::f64::consts::PI);
/// assert!((half.length() - std::f64::consts::TAU).abs() < 1e-12);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    pub(crate) surroundings: Surroundings,
    pub(crate) start: [f64; 2],
    pub(crate) segments: Vec<Segment>,
}

impl Outline {
    /// Begins a closed outline at a point (x, z).
    pub fn closed(start: [f64; 2]) -> Self {
        Self { surroundings: Surroundings::Free, start, segments: Vec::new() }
    }

    /// Begins an outline on the mirror z = 0, which ends on the mirror.
    pub fn on_mirror(start: [f64; 2]) -> Self {
        Self { surroundings: Surroundings::Mirror, start, segments: Vec::new() }
    }

    /// Returns the point where the last piece ends.
    pub fn last(&self) -> [f64; 2] {
        self.segments.last().map_or(self.start, Segment::end)
    }

    /// Appends a line. A line of no length is left out.
    #[must_use]
    pub fn line_to(self, to: [f64; 2]) -> Self {
        self.arc_to(to, 0.0)
    }

    /// Appends an arc that turns by `turn` radians on its way, to the left if positive; 0 is a
    /// line.
    #[must_use]
    pub fn arc_to(mut self, to: [f64; 2], turn: f64) -> Self {
        let from = self.last();
        let (curve, length) = Curve::between(from, to, turn);
        if length > 0.0 {
            self.segments.push(Segment { curve, length });
        }
        self
    }

    /// Length of all pieces.
    pub fn length(&self) -> f64 {
        self.segments.iter().map(|segment| segment.length).sum()
    }

    /// Returns the outline with all lengths multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let point = |p: [f64; 2]| [p[0] * factor, p[1] * factor];
        let segment = |s: &Segment| Segment {
            curve: Curve {
                origin: point(s.curve.origin),
                tangent: s.curve.tangent,
                curvature: s.curve.curvature / factor,
            },
            length: s.length * factor,
        };
        Self {
            surroundings: self.surroundings,
            start: point(self.start),
            segments: self.segments.iter().map(segment).collect(),
        }
    }

    /// Returns points along the outline, at most `step` apart.
    pub fn points(&self, step: f64) -> Vec<[f64; 2]> {
        let mut points = vec![self.start];
        for segment in &self.segments {
            let count = (segment.length / step).ceil().max(1.0);
            let curved = segment.curve.curvature * segment.length;
            let count = count.max((curved.abs() / 0.1).ceil()) as usize;
            for i in 1..=count {
                points.push(segment.curve.point(segment.length * i as f64 / count as f64));
            }
        }
        points
    }

    /// True if the reflection x -> -x maps the outline to itself within 1e-9 of its size.
    pub fn is_symmetric(&self) -> bool {
        self.right_half().is_some()
    }

    /// Returns the pieces with x ≥ 0, from the mirror or the lowest point to the highest, if the
    /// outline is symmetric and crosses the axis nowhere else.
    pub(crate) fn right_half(&self) -> Option<Vec<Segment>> {
        let size = self
            .points(self.length() / 64.0)
            .iter()
            .fold(0.0, |size: f64, p| size.max(p[0].abs()).max(p[1].abs()));
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9 * size;
        let mut pieces = Vec::new();
        for segment in &self.segments {
            // A piece that is symmetric itself is cut at the axis.
            let (from, to) = (segment.curve.origin, segment.end());
            if near([-from[0], from[1]], to) && from[0].abs() > 1e-9 * size {
                pieces.extend(segment.halves());
            } else {
                pieces.push(*segment);
            }
        }
        // Begin where the outline crosses the axis upwards, or on the mirror.
        if self.surroundings == Surroundings::Free {
            let first = pieces.iter().position(|piece| {
                piece.curve.origin[0].abs() < 1e-9 * size
                    && piece.curve.point(1e-3 * piece.length)[0] > 0.0
            })?;
            pieces.rotate_left(first);
        }
        let half = pieces.len() / 2;
        if pieces.len() % 2 == 1 {
            return None;
        }
        for (right, left) in pieces[..half].iter().zip(pieces.iter().rev()) {
            let [x, z] = right.curve.origin;
            let mirrored = near([-x, z], left.end())
                && (right.length - left.length).abs() < 1e-9 * size
                && (right.curve.curvature - left.curve.curvature).abs() * size < 1e-6
                && near([-right.end()[0], right.end()[1]], left.curve.origin);
            if !mirrored || x < -1e-9 * size {
                return None;
            }
        }
        let top = pieces[half - 1].end();
        (top[0].abs() < 1e-9 * size).then(|| pieces[..half].to_vec())
    }

    /// Returns a corner where the outline turns back by half a turn.
    fn fold(&self) -> Option<[f64; 2]> {
        let closed = self.surroundings == Surroundings::Free;
        let next = self.segments.iter().skip(1).chain(self.segments.first().filter(|_| closed));
        let turns_back = |(before, after): &(&Segment, &Segment)| {
            let [ax, az] = before.curve.tangent(before.length);
            let [bx, bz] = after.curve.tangent;
            ax * bx + az * bz < -1.0 + 1e-9
        };
        self.segments.iter().zip(next).find(turns_back).map(|(_, after)| after.curve.origin)
    }

    /// Checks that the outline is closed or ends on the mirror, runs counter-clockwise, does not
    /// cross or touch itself, and touches the mirror at its ends alone.
    pub(crate) fn check(&self) -> Result<(), FullWaveError> {
        let refuse = |expected: &str, got: String| {
            Err(FullWaveError::Outline { expected: expected.to_owned(), got })
        };
        let finite = self
            .segments
            .iter()
            .all(|s| s.length.is_finite() && s.curve.curvature.is_finite() && s.length > 0.0);
        if self.segments.is_empty() || !finite {
            return refuse(
                "at least one piece of finite length",
                format!("{}", self.segments.len()),
            );
        }
        if let Some(number) = self
            .segments
            .iter()
            .position(|s| (s.curve.curvature * s.length).abs() > TAU * (1.0 - 1e-6))
        {
            return refuse("arcs of less than a full turn", format!("piece {}", number + 1));
        }
        let size = self.length();
        let [x, z] = self.last();
        match self.surroundings {
            Surroundings::Free => {
                if (x - self.start[0]).hypot(z - self.start[1]) > 1e-9 * size {
                    let [sx, sz] = self.start;
                    return refuse(
                        "an outline that ends where it begins",
                        format!("begin ({sx}, {sz}), end ({x}, {z})"),
                    );
                }
            }
            Surroundings::Mirror => {
                if z.abs() > 1e-9 * size || self.start[1].abs() > 1e-9 * size {
                    let got = format!("z = {} and {z}", self.start[1]);
                    return refuse("begin and end on the mirror, z = 0", got);
                }
            }
        }
        let points = self.points(size / 4096.0);
        if self.surroundings == Surroundings::Mirror {
            let inner = &points[1..points.len() - 1];
            if let Some([x, z]) = inner.iter().find(|p| p[1] < 1e-9 * size) {
                return refuse(
                    "an outline above the mirror between its ends",
                    format!("({x}, {z})"),
                );
            }
        }
        if let Some([x, z]) = self.fold() {
            let expected = "an outline that does not fold back on itself";
            return refuse(expected, format!("at ({x}, {z})"));
        }
        if area(&points) <= 0.0 {
            return refuse("an outline that runs counter-clockwise", "clockwise".to_owned());
        }
        if let Some([x, z]) = crossing(&points) {
            return refuse("an outline that does not cross itself", format!("at ({x}, {z})"));
        }
        Ok(())
    }
}

/// Twice the area of a polygon, positive if it runs counter-clockwise.
fn area(points: &[[f64; 2]]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// Returns a point where a chain of straight pieces crosses itself. Pieces are sorted by x, and
/// only those whose ranges overlap are compared.
fn crossing(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let mut pieces: Vec<usize> = (0..points.len() - 1).collect();
    let low = |i: usize| points[i][0].min(points[i + 1][0]);
    let high = |i: usize| points[i][0].max(points[i + 1][0]);
    pieces.sort_by(|&a, &b| low(a).total_cmp(&low(b)));
    for (rank, &i) in pieces.iter().enumerate() {
        for &j in pieces[rank + 1..].iter().take_while(|&&j| low(j) <= high(i)) {
            let neighbours = i.abs_diff(j) <= 1 || i.abs_diff(j) == points.len() - 2;
            if !neighbours && cross(points[i], points[i + 1], points[j], points[j + 1]) {
                return Some(points[i]);
            }
        }
    }
    None
}

fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let side = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    };
    let overlap = |i: usize| a[i].min(b[i]) <= c[i].max(d[i]) && c[i].min(d[i]) <= a[i].max(b[i]);
    overlap(0)
        && overlap(1)
        && side(a, b, c) * side(a, b, d) <= 0.0
        && side(c, d, a) * side(c, d, b) <= 0.0
}

/// Winding number of a chain of straight pieces about a point, in turns.
pub(crate) fn winding(points: &[[f64; 2]], about: [f64; 2]) -> f64 {
    let angle = |p: &[f64; 2]| (p[1] - about[1]).atan2(p[0] - about[0]);
    let next = points.iter().cycle().skip(1);
    let turn = |(a, b)| {
        let step: f64 = angle(b) - angle(a);
        step - TAU * (step / TAU).round()
    };
    points.iter().zip(next).map(turn).sum::<f64>() / (2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(outline: &Outline) -> String {
        outline.check().unwrap_err().to_string()
    }

    #[test]
    fn an_arc_ends_where_it_is_told_to() {
        let arc = Outline::closed([1.0, 0.0]).arc_to([0.0, 1.0], PI / 2.0);
        assert!((arc.length() - PI / 2.0).abs() < 1e-15);
        let middle = arc.segments[0].curve.point(PI / 4.0);
        assert!((middle[0].hypot(middle[1]) - 1.0).abs() < 1e-15);
        assert!((arc.segments[0].curve.normal(0.0)[0] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_right_half_of_a_symmetric_outline() {
        let dome = Outline::on_mirror([2.0, 0.0]).arc_to([-2.0, 0.0], PI);
        assert_eq!(dome.right_half().unwrap().len(), 1);
        let steps = Outline::on_mirror([2.0, 0.0])
            .line_to([2.0, 1.0])
            .line_to([1.0, 1.0])
            .line_to([1.0, 2.0])
            .line_to([-1.0, 2.0])
            .line_to([-1.0, 1.0])
            .line_to([-2.0, 1.0])
            .line_to([-2.0, 0.0]);
        assert_eq!(steps.right_half().unwrap().len(), 4);
        let skew = Outline::on_mirror([2.0, 0.0]).line_to([0.5, 2.0]).line_to([-2.0, 0.0]);
        assert!(!skew.is_symmetric());
        let circle = Outline::closed([2.0, 0.0]).arc_to([-2.0, 0.0], PI).arc_to([2.0, 0.0], PI);
        assert_eq!(circle.right_half().unwrap().len(), 2);
    }

    #[test]
    fn what_is_no_outline_is_refused() {
        let open = Outline::closed([0.0, 0.0]).line_to([1.0, 0.0]).line_to([1.0, 1.0]);
        assert!(message(&open).contains("ends where it begins"));
        let clockwise = Outline::on_mirror([-1.0, 0.0]).line_to([0.0, 1.0]).line_to([1.0, 0.0]);
        assert!(message(&clockwise).contains("counter-clockwise"));
        let eight = Outline::on_mirror([3.0, 0.0])
            .line_to([3.0, 2.0])
            .line_to([-1.0, 2.0])
            .line_to([2.0, 1.0])
            .line_to([2.0, 3.0])
            .line_to([-3.0, 0.0]);
        assert!(message(&eight).contains("cross"));
        let spike = Outline::on_mirror([3.0, 0.0])
            .line_to([3.0, 2.0])
            .line_to([4.0, 2.0])
            .line_to([-3.0, 2.0])
            .line_to([-3.0, 0.0]);
        assert!(message(&spike).contains("fold back on itself, got at (4, 2)"));
        let touching = Outline::on_mirror([3.0, 0.0])
            .line_to([2.0, 1.0])
            .line_to([0.0, 0.0])
            .line_to([-2.0, 1.0])
            .line_to([-3.0, 0.0]);
        assert!(message(&touching).contains("above the mirror"));
    }
}
