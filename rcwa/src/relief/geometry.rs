// SPDX-License-Identifier: MIT OR Apache-2.0
//! Plane geometry of polygons: extent, horizontal cuts, crossings of sides.

type Point = [f64; 2];

/// Orientations below this share of the squared lengths involved are round-off: collinear.
const COLLINEAR: f64 = 1e-13;

/// Smallest and largest value.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
}

/// The sides of a closed polygon, side i from point i to the next.
pub(super) fn sides(points: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    points.iter().copied().zip(points.iter().copied().cycle().skip(1))
}

/// Places where the outline crosses the height z, sorted; an even number, inside between the first and
/// the second, the third and the fourth, and so on. A side owns its upper end, not its lower one.
pub(super) fn crossings(points: &[Point], z: f64) -> Vec<f64> {
    let mut found: Vec<f64> = sides(points)
        .filter(|(a, b)| (a[1] <= z) != (b[1] <= z))
        .map(|(a, b)| x_at(a, b, z))
        .collect();
    found.sort_by(f64::total_cmp);
    found
}

/// x of the side a..b at height z, the same to the last bit whichever end comes first.
fn x_at(a: Point, b: Point, z: f64) -> f64 {
    let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
    let t = (z - a[1]) / (b[1] - a[1]);
    (1.0 - t) * a[0] + t * b[0]
}

/// The first pair of sides of a closed polygon that meet other than in the corner they share.
pub(super) fn self_crossing(points: &[Point]) -> Option<(usize, usize)> {
    let sides: Vec<_> = sides(points).collect();
    let n = sides.len();
    for i in 0..n {
        for j in i + 1..n {
            let (s, t) = (sides[i], sides[j]);
            let meet = if j == i + 1 {
                folds_back(s.0, s.1, t.1)
            } else if i == 0 && j == n - 1 {
                folds_back(t.0, t.1, s.1)
            } else {
                touches(s, t)
            };
            if meet {
                return Some((i, j));
            }
        }
    }
    None
}

/// z at which two sides cross in one point inside both; none for parallel sides.
pub(super) fn crossing_height(s: (Point, Point), t: (Point, Point)) -> Option<f64> {
    let (d, e) = (minus(s.1, s.0), minus(t.1, t.0));
    let turn = cross(d, e);
    if turn.abs() <= COLLINEAR * length(d) * length(e) {
        return None;
    }
    let offset = minus(t.0, s.0);
    let (u, v) = (cross(offset, e) / turn, cross(offset, d) / turn);
    let inside = |w: f64| w > 0.0 && w < 1.0;
    (inside(u) && inside(v)).then(|| s.0[1] + u * d[1])
}

/// True where the corner a, b, c turns back onto itself.
fn folds_back(a: Point, b: Point, c: Point) -> bool {
    let (d, e) = (minus(b, a), minus(c, b));
    cross(d, e).abs() <= COLLINEAR * length(d) * length(e) && dot(d, e) < 0.0
}

/// True where two sides share any point.
fn touches(s: (Point, Point), t: (Point, Point)) -> bool {
    let (a, b) = (turn(t, s.0), turn(t, s.1));
    let (c, d) = (turn(s, t.0), turn(s, t.1));
    if a * b < 0.0 && c * d < 0.0 {
        return true;
    }
    (a == 0.0 && in_box(t, s.0))
        || (b == 0.0 && in_box(t, s.1))
        || (c == 0.0 && in_box(s, t.0))
        || (d == 0.0 && in_box(s, t.1))
}

/// On which side of the line through `s` the point lies: -1, 1, or 0 on it but for round-off.
fn turn(s: (Point, Point), p: Point) -> f64 {
    let (d, e) = (minus(s.1, s.0), minus(p, s.0));
    let area = cross(d, e);
    if area.abs() <= COLLINEAR * length(d) * length(e).max(length(d)) { 0.0 } else { area.signum() }
}

fn in_box(s: (Point, Point), p: Point) -> bool {
    (0..2).all(|i| s.0[i].min(s.1[i]) <= p[i] && p[i] <= s.0[i].max(s.1[i]))
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn length(a: Point) -> f64 {
    a[0].hypot(a[1])
}
