// SPDX-License-Identifier: MIT OR Apache-2.0
//! Outline of a unit cell: from polygons to the boundaries between media in one period.
//!
//! In: an outline as plain data. Out: straight facets, each with the media on both sides. The sides
//! of all polygons, their copies in the neighbouring periods and the borders z = 0 and z = depth
//! are cut where they meet. Each piece then separates two media, given by the topmost polygons;
//! pieces with the same medium on both sides are dropped. Points closer than 1e-10 of the cell's
//! size coincide.

use crate::error::Error;
use glam::DVec2;
use std::collections::BTreeMap;

/// Distance in units of the cell's size below which points coincide.
const SAME: f64 = 1e-10;
/// Thickness of the ground under a line, in periods.
const GROUND: f64 = 1e-3;

/// One polygon of an outline.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Polygon {
    /// Refractive index inside.
    pub index: f64,
    /// Stencil [x, z] in either sense, 0 ≤ z ≤ depth, not repeated at the end. Sides meet at
    /// corners only. x may lie outside the period.
    pub points: Vec<[f64; 2]>,
}

/// Outline of one period of a relief. Lengths in one free unit.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outline {
    /// Period along x.
    pub period: f64,
    /// Height of the relief along z.
    pub depth: f64,
    /// Refractive index at z < 0.
    pub index_inner: f64,
    /// Refractive index at z > depth.
    pub index_outer: f64,
    /// Refractive index between, where no polygon lies.
    pub background: f64,
    /// Polygons; a later one lies over an earlier one.
    pub polygons: Vec<Polygon>,
}

/// A straight boundary between two media.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub a: DVec2,
    pub b: DVec2,
    /// Index on the left of a→b, the side of `normal`.
    pub left: f64,
    /// Index on the right.
    pub right: f64,
    /// Facets on one straight line share this number.
    pub line: u32,
    /// Unit normal, to the left of a→b.
    pub normal: DVec2,
}

impl Facet {
    /// True if it lies at one z.
    pub fn is_level(&self) -> bool {
        self.a.y.to_bits() == self.b.y.to_bits()
    }
}

impl Outline {
    /// Relief of the inner medium below one line: points `[x, z]` of one period from end to end,
    /// both ends at one z; `indices` of the inner and the outer medium.
    pub fn below(line: &[[f64; 2]], [inner, outer]: [f64; 2]) -> Self {
        let [low, high] = line.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |ends, [_, z]| {
            [ends[0].min(*z), ends[1].max(*z)]
        });
        let ends = [line.first(), line.last()].map(|end| end.map_or(0.0, |[x, _]| *x));
        let period = ends[1] - ends[0];
        // Ground under the line, which may touch its lowest height anywhere.
        let ground = GROUND * period;
        let on_ground = line.iter().map(|[x, z]| [x - ends[0], z - low + ground]);
        let points = on_ground.chain([[period, 0.0], [0.0, 0.0]]).collect();
        Self {
            period,
            depth: high - low + ground,
            index_inner: inner,
            index_outer: outer,
            background: outer,
            polygons: vec![Polygon { index: inner, points }],
        }
    }

    /// The same relief in air, whose tips stand in the outer medium to `tips`, from above 0 to the
    /// depth.
    #[must_use]
    pub fn standing_in_outer(mut self, tips: f64) -> Self {
        let (low, high) = (self.depth - tips, self.depth);
        let points = vec![[0.0, low], [self.period, low], [self.period, high], [0.0, high]];
        self.polygons.insert(0, Polygon { index: self.index_outer, points });
        self.background = 1.0;
        self
    }

    /// Checks the invariants that the tracing relies on.
    pub(super) fn validate(&self) -> Result<(), Error> {
        Error::check_length("period of a unit cell", self.period)?;
        if !(self.depth.is_finite() && self.depth >= 0.0) {
            return Err(Error::Length { name: "depth of a unit cell", value: self.depth });
        }
        Error::check_index("inner side of a unit cell", self.index_inner)?;
        Error::check_index("outer side of a unit cell", self.index_outer)?;
        Error::check_index("background of a unit cell", self.background)?;
        for (k, polygon) in self.polygons.iter().enumerate() {
            Error::check_index(&format!("polygon {} of a unit cell", k + 1), polygon.index)?;
            self.validate_polygon(&vectors(&polygon.points))
                .map_err(|text| Error::Cell(format!("polygon {}: {text}", k + 1)))?;
        }
        Ok(())
    }

    fn validate_polygon(&self, points: &[DVec2]) -> Result<(), String> {
        let same = self.same();
        if points.len() < 3 {
            return Err(format!("expected at least 3 points, got {}", points.len()));
        }
        for p in points {
            if !p.is_finite() || p.y < -same || p.y > self.depth + same {
                let (depth, p) = (self.depth, p.to_array());
                return Err(format!("expected points with 0 <= z <= {depth}, got {p:?}"));
            }
        }
        let [low, high] = x_range(points);
        if high - low > 2.0 * self.period + same {
            return Err(format!("expected a width of at most two periods, got {}", high - low));
        }
        let sides: Vec<_> = sides(points).collect();
        if let Some((a, _)) = sides.iter().find(|(a, b)| (b - a).length() < same) {
            let a = a.to_array();
            return Err(format!("expected corners apart from each other, got {a:?} twice"));
        }
        for (i, &(a, b)) in sides.iter().enumerate() {
            for (j, &(c, d)) in sides.iter().enumerate().skip(i + 1) {
                let neighbours = j == i + 1 || (i == 0 && j + 1 == sides.len());
                let meet = if neighbours {
                    fold_back(if j == i + 1 { [a, b, d] } else { [c, a, b] })
                } else {
                    touch(a, b, c, d, same)
                };
                if meet {
                    let [a, b, c, d] = [a, b, c, d].map(|p| p.to_array());
                    return Err(format!(
                        "expected sides that do not meet, but {a:?}-{b:?} meets {c:?}-{d:?}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Distance below which points coincide.
    fn same(&self) -> f64 {
        SAME * (self.period + self.depth)
    }

    /// Boundaries between different media, shifted so that no corner lies at the border of
    /// 0..period. Those that cross it extend slightly beyond on both sides, so that a ray hits them
    /// before or after it changes period.
    pub(super) fn facets(&self) -> Vec<Facet> {
        let same = self.same();
        let (shift, margin) = self.border();
        // Polygons in every period that they reach into, counter-clockwise, with their rank.
        let mut copies: Vec<(usize, Vec<DVec2>)> = Vec::new();
        for (rank, polygon) in self.polygons.iter().enumerate() {
            let mut points = vectors(&polygon.points);
            if area(&points) < 0.0 {
                points.reverse();
            }
            let [low, high] = x_range(&points);
            let first = ((shift - margin - high) / self.period).floor() as i64;
            let last = ((shift + margin + self.period - low) / self.period).ceil() as i64;
            for copy in first..=last {
                let offset = copy as f64 * self.period - shift;
                let snap = |z: f64| {
                    let z = if z.abs() < same { 0.0 } else { z };
                    if (z - self.depth).abs() < same { self.depth } else { z }
                };
                copies.push((
                    rank,
                    points.iter().map(|p| DVec2::new(p.x + offset, snap(p.y))).collect(),
                ));
            }
        }
        let across = [-margin, self.period + margin];
        let pieces = Arrangement::cut(&copies, across, self.depth, same);
        self.separate(&copies, &pieces, across)
    }

    /// Border of the period: x in the widest interval without a corner, at an irrational fraction
    /// of it so that reliefs on a lattice have nothing there; and a length small against the
    /// interval.
    fn border(&self) -> (f64, f64) {
        let points = self.polygons.iter().flat_map(|p| &p.points);
        let mut corners: Vec<f64> = points.map(|p| p[0].rem_euclid(self.period)).collect();
        corners.sort_by(f64::total_cmp);
        corners.push(corners.first().unwrap_or(&0.0) + self.period);
        let gaps = corners.windows(2).map(|w| (w[1] - w[0], w[0]));
        let (gap, start) = gaps.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((self.period, 0.0));
        (start + 0.618_033_988_75 * gap, 1e-3 * gap)
    }

    /// Assigns each piece its two media and keeps the boundaries.
    fn separate(
        &self,
        copies: &[(usize, Vec<DVec2>)],
        pieces: &Arrangement,
        across: [f64; 2],
    ) -> Vec<Facet> {
        let mut facets: Vec<Facet> = Vec::new();
        for (&(a, b), owners) in &pieces.pieces {
            let (a, b) = (pieces.points[a], pieces.points[b]);
            let middle = 0.5 * (a + b);
            if middle.x < across[0] || middle.x > across[1] {
                continue;
            }
            // Rank of the topmost polygon on the left and right; none is the background.
            let mut top: [Option<usize>; 2] = [None, None];
            for (copy, (rank, points)) in copies.iter().enumerate() {
                let own: Vec<[bool; 2]> =
                    owners.iter().filter(|o| o.copy == Some(copy)).map(|o| o.inside).collect();
                let inside = if own.is_empty() {
                    [contains(points, middle); 2]
                } else {
                    [0, 1].map(|k| own.iter().any(|o| o[k]))
                };
                for side in [0, 1] {
                    if inside[side] {
                        top[side] = top[side].max(Some(*rank));
                    }
                }
            }
            let mut medium =
                top.map(|rank| rank.map_or(self.background, |rank| self.polygons[rank].index));
            // Beyond the borders of the cell there are no polygons. Left of a→b is up where b lies
            // at larger x.
            let (up, down) = if b.x > a.x { (0, 1) } else { (1, 0) };
            if a.y == 0.0 && b.y == 0.0 {
                medium[down] = self.index_inner;
            }
            if a.y.to_bits() == self.depth.to_bits() && b.y.to_bits() == self.depth.to_bits() {
                medium[up] = self.index_outer;
            }
            let [left, right] = medium;
            if left.to_bits() == right.to_bits() {
                continue;
            }
            let along = b - a;
            let normal = along.perp() / along.x.hypot(along.y);
            let on_line = |f: &&Facet| {
                [a, b].iter().all(|p| {
                    let along = f.b - f.a;
                    along.perp_dot(*p - f.a).abs() < self.same() * along.length()
                })
            };
            let line = facets.iter().find(on_line).map_or(facets.len() as u32, |f| f.line);
            facets.push(Facet { a, b, left, right, line, normal });
        }
        facets
    }
}

/// Polygon copy with the piece as a side, or the border of the cell.
#[derive(Clone, Copy, Debug)]
struct Owner {
    copy: Option<usize>,
    /// True if the polygon's inside lies to the left and to the right of the piece.
    inside: [bool; 2],
}

/// Arrangement of all sides, cut where they meet: pieces between numbered points, each with its
/// polygons.
struct Arrangement {
    points: Vec<DVec2>,
    pieces: BTreeMap<(usize, usize), Vec<Owner>>,
}

impl Arrangement {
    fn cut(copies: &[(usize, Vec<DVec2>)], across: [f64; 2], depth: f64, same: f64) -> Self {
        let mut all: Vec<(Option<usize>, DVec2, DVec2)> = Vec::new();
        for (copy, (_, points)) in copies.iter().enumerate() {
            all.extend(sides(points).map(|(a, b)| (Some(copy), a, b)));
        }
        for z in [0.0, depth] {
            let [left, right] = across.map(|x| DVec2::new(x, z));
            all.push((None, left, right));
        }
        let mut cut = Self { points: Vec::new(), pieces: BTreeMap::new() };
        for &(copy, a, b) in &all {
            let e = b - a;
            let mut stops = vec![0.0, 1.0];
            stops.extend(across.map(|x| (x - a.x) / e.x));
            for &(_, c, d) in all.iter().filter(|(_, c, d)| !are_apart([a, b], [*c, *d], same)) {
                let f = d - c;
                let denominator = e.perp_dot(f);
                if denominator != 0.0 {
                    let (t, u) =
                        ((c - a).perp_dot(f) / denominator, (c - a).perp_dot(e) / denominator);
                    let slack = same / f.length();
                    if (-slack..=1.0 + slack).contains(&u) {
                        stops.push(t);
                    }
                }
                // Stencil on this side, those of sides along it included.
                for p in [c, d] {
                    let t = (p - a).dot(e) / e.dot(e);
                    if (a + t * e - p).length() < same {
                        stops.push(t);
                    }
                }
            }
            stops.retain(|t| (0.0..=1.0).contains(t));
            stops.sort_by(f64::total_cmp);
            let numbers: Vec<usize> =
                stops.iter().map(|&t| cut.number(along(a, b, t), same)).collect();
            for pair in numbers.windows(2).filter(|pair| pair[0] != pair[1]) {
                // The inside of a counter-clockwise polygon is on the left of its sides.
                let (key, inside) = if pair[0] < pair[1] {
                    ((pair[0], pair[1]), [true, false])
                } else {
                    ((pair[1], pair[0]), [false, true])
                };
                cut.pieces.entry(key).or_default().push(Owner { copy, inside });
            }
        }
        cut
    }

    /// Index of the point at `p`, added if new.
    fn number(&mut self, p: DVec2, same: f64) -> usize {
        self.points.iter().position(|q| (p - q).length() < same).unwrap_or_else(|| {
            self.points.push(p);
            self.points.len() - 1
        })
    }
}

/// Point between a and b, exact at both ends and in z if they have one.
fn along(a: DVec2, b: DVec2, t: f64) -> DVec2 {
    if t <= 0.0 {
        return a;
    }
    if t >= 1.0 {
        return b;
    }
    a + t * (b - a)
}

/// Sides of a polygon, closed.
fn sides(points: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
    (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()]))
}

/// True if the boxes around two sides are so far apart that no point of one comes closer than `same` to
/// the other.
fn are_apart(one: [DVec2; 2], other: [DVec2; 2], same: f64) -> bool {
    let beyond = |[a, b]: [DVec2; 2], [c, d]: [DVec2; 2]| a.max(b) + 2.0 * same - c.min(d);
    beyond(one, other).min_element() < 0.0 || beyond(other, one).min_element() < 0.0
}

/// True if the sides a-b and c-d cross or come closer than `same`.
fn touch(a: DVec2, b: DVec2, c: DVec2, d: DVec2, same: f64) -> bool {
    if are_apart([a, b], [c, d], same) {
        return false;
    }
    let turn = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    let near = |p: DVec2, a: DVec2, b: DVec2| {
        let e = b - a;
        let t = ((p - a).dot(e) / e.dot(e)).clamp(0.0, 1.0);
        (p - (a + t * e)).length() < same
    };
    let crosses = turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0;
    crosses || near(a, c, d) || near(b, c, d) || near(c, a, b) || near(d, a, b)
}

/// True if the path a → b → c turns back on itself.
fn fold_back([a, b, c]: [DVec2; 3]) -> bool {
    let (e, f) = (b - a, c - b);
    e.dot(f) < 0.0 && e.perp_dot(f).abs() <= SAME * e.length() * f.length()
}

/// Signed area, positive if counter-clockwise with x to the right and z up.
fn area(points: &[DVec2]) -> f64 {
    0.5 * sides(points).map(|(a, b)| a.perp_dot(b)).sum::<f64>()
}

fn x_range(points: &[DVec2]) -> [f64; 2] {
    points
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p.x), high.max(p.x)])
}

/// True if a point off all sides is inside: an odd number of sides lies to its right.
fn contains(points: &[DVec2], p: DVec2) -> bool {
    let crossings = sides(points).filter(|(a, b)| {
        (a.y > p.y) != (b.y > p.y) && a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) > p.x
    });
    crossings.count() % 2 == 1
}

fn vectors(points: &[[f64; 2]]) -> Vec<DVec2> {
    points.iter().copied().map(DVec2::from).collect()
}
