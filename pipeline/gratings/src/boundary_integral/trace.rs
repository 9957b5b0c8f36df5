// SPDX-License-Identifier: MIT OR Apache-2.0
//! From a relief to the one surface between its two media.
//!
//! In: polygons that wrap at the period and lie over one another, between two half-spaces. Out: the
//! corners of the surface. All sides of all polygons and the planes z = 0 and z = depth are cut
//! where they meet; a piece belongs to the surface if the media just beside it differ; pieces are
//! then joined end to end.

#[cfg(test)]
mod tests;

use super::error::{IntegralError, outline};
use super::sides::{Piece, Point, SAME, check_media, direction, length, same_medium};
use num_complex::Complex64;
use rcwa::relief::Relief;

/// How far beside a piece its media are read, in periods.
const BESIDE: f64 = 1e-7;

/// Most points of all polygons: all sides are cut with all others.
const MOST_POINTS: usize = 1000;

/// Who fills which place: the relief with its media.
struct Media<'a> {
    relief: &'a Relief,
    top: Complex64,
    bottom: Complex64,
}

/// Corners of the surface along +x; corners at which it does not turn may be among them.
pub(super) fn surface(
    relief: &Relief,
    top: Complex64,
    bottom: Complex64,
) -> Result<Vec<Point>, IntegralError> {
    let points: usize = relief.polygons().iter().map(|polygon| polygon.points.len()).sum();
    if points > MOST_POINTS {
        return Err(outline(format!("expected at most {MOST_POINTS} points, got {points}")));
    }
    let media = Media::new(relief, top, bottom)?;
    let period = relief.period();
    let sides = media.sides();
    let mut pieces: Vec<Piece> = Vec::new();
    for side in &sides {
        for piece in cut(*side, &sides, SAME * period) {
            if let Some(piece) = media.oriented(piece)
                && !pieces.iter().any(|p| same_piece(p, &piece, SAME * period))
            {
                pieces.push(piece);
            }
        }
    }
    join(&pieces, period)
}

impl<'a> Media<'a> {
    fn new(relief: &'a Relief, top: Complex64, bottom: Complex64) -> Result<Self, IntegralError> {
        check_media(top, bottom)?;
        let one_of_both = |what: String, got: Complex64| {
            if same_medium(got, top) || same_medium(got, bottom) {
                Ok(())
            } else {
                Err(IntegralError::ThirdMedium { what, got, top, bottom })
            }
        };
        one_of_both("the background".into(), relief.background())?;
        for (i, polygon) in relief.polygons().iter().enumerate() {
            one_of_both(format!("polygon {i}"), polygon.index)?;
        }
        Ok(Self { relief, top, bottom })
    }

    /// Index at a point, the last polygon that holds it first.
    fn at(&self, [x, z]: Point) -> Complex64 {
        if z < 0.0 {
            return self.top;
        }
        if z > self.relief.depth() {
            return self.bottom;
        }
        let period = self.relief.period();
        let holds = |points: &[Point]| {
            let (left, right) = extent(points);
            let (first, last) =
                (((left - x) / period).ceil() as i32, ((right - x) / period).floor() as i32);
            (first..=last).any(|lap| inside(points, [x + f64::from(lap) * period, z]))
        };
        let polygons = self.relief.polygons().iter().rev();
        polygons
            .into_iter()
            .find(|p| holds(&p.points))
            .map_or(self.relief.background(), |p| p.index)
    }

    /// All sides in three periods around the first, and the two planes.
    fn sides(&self) -> Vec<Piece> {
        let (period, depth) = (self.relief.period(), self.relief.depth());
        let mut all = Vec::new();
        for lap in -2..3 {
            let x = f64::from(lap) * period;
            all.extend([0.0, depth].map(|z| Piece { from: [x, z], to: [x + period, z] }));
        }
        for polygon in self.relief.polygons() {
            let points = &polygon.points;
            let (left, right) = extent(points);
            let first = ((-2.0 * period - right) / period).ceil() as i32;
            let last = ((3.0 * period - left) / period).floor() as i32;
            for lap in first..=last {
                let moved = |i: usize| [points[i][0] + f64::from(lap) * period, points[i][1]];
                all.extend(
                    (0..points.len())
                        .map(|i| Piece { from: moved(i), to: moved((i + 1) % points.len()) }),
                );
            }
        }
        all
    }

    /// The piece with the top medium to one side and the bottom medium to the other, directed along
    /// the surface; `None` if its middle is not in the first period or both sides are the same.
    fn oriented(&self, piece: Piece) -> Option<Piece> {
        let period = self.relief.period();
        let middle = [0.5 * (piece.from[0] + piece.to[0]), 0.5 * (piece.from[1] + piece.to[1])];
        // Half open, and moved off the planes' ends so that rounding cannot take both or none.
        let place = (middle[0] / period + SAME).floor();
        if place != 0.0 {
            return None;
        }
        let [tx, tz] = direction(piece.from, piece.to);
        let beside = |sign: f64| {
            let reach = sign * BESIDE * period;
            self.at([middle[0] - reach * tz, middle[1] + reach * tx])
        };
        let (ahead, behind) = (beside(1.0), beside(-1.0));
        match (same_medium(ahead, self.bottom), same_medium(behind, self.bottom)) {
            (true, false) => Some(piece),
            (false, true) => Some(Piece { from: piece.to, to: piece.from }),
            _ => None,
        }
    }
}

fn extent(points: &[Point]) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, r), p| (l.min(p[0]), r.max(p[0])))
}

/// Whether a ray from the point towards +x meets the outline an odd number of times.
fn inside(points: &[Point], [x, z]: Point) -> bool {
    let mut odd = false;
    for (i, a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        if (a[1] > z) != (b[1] > z) && x < a[0] + (z - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
            odd = !odd;
        }
    }
    odd
}

/// A side in pieces that no other side crosses or ends on.
fn cut(side: Piece, others: &[Piece], same: f64) -> Vec<Piece> {
    let [tx, tz] = direction(side.from, side.to);
    let length = length(side.from, side.to);
    // (along, across) of a point in the frame of the side.
    let frame = |p: Point| {
        let (dx, dz) = (p[0] - side.from[0], p[1] - side.from[1]);
        (dx * tx + dz * tz, dz * tx - dx * tz)
    };
    let mut places = vec![0.0, length];
    for other in others {
        let (a, b) = (frame(other.from), frame(other.to));
        places.extend([a, b].iter().filter(|p| p.1.abs() <= same).map(|p| p.0));
        if (a.1 > 0.0) != (b.1 > 0.0) {
            places.push(a.0 + (b.0 - a.0) * a.1 / (a.1 - b.1));
        }
    }
    places.retain(|&p| (0.0..=length).contains(&p));
    places.sort_by(f64::total_cmp);
    places.dedup_by(|b, a| *b - *a <= same);
    let at = |p: f64| {
        if p <= same {
            side.from
        } else if p >= length - same {
            side.to
        } else {
            [side.from[0] + p * tx, side.from[1] + p * tz]
        }
    };
    places
        .windows(2)
        .filter(|w| w[1] - w[0] > same)
        .map(|w| Piece { from: at(w[0]), to: at(w[1]) })
        .collect()
}

fn near(a: Point, b: Point, same: f64) -> bool {
    // Twice: two cuts of one place may each be off.
    (a[0] - b[0]).abs() <= 4.0 * same && (a[1] - b[1]).abs() <= 4.0 * same
}

fn same_piece(a: &Piece, b: &Piece, same: f64) -> bool {
    near(a.from, b.from, same) && near(a.to, b.to, same)
}

/// Follows the pieces from end to end; exactly one chain must lead into the next period, and none
/// may be left over.
fn join(pieces: &[Piece], period: f64) -> Result<Vec<Point>, IntegralError> {
    let same = SAME * period;
    let mut free = vec![true; pieces.len()];
    let mut line: Option<Vec<Point>> = None;
    let mut closed = 0;
    for start in 0..pieces.len() {
        if !free[start] {
            continue;
        }
        let (mut points, mut shift, mut here) = (Vec::new(), 0.0, start);
        let laps = loop {
            free[here] = false;
            let piece = pieces[here];
            points.push([piece.from[0] + shift, piece.from[1]]);
            let end = [piece.to[0] + shift, piece.to[1]];
            let lap = |p: Point| ((end[0] - p[0]) / period).round();
            let mut next = (0..pieces.len()).filter(|&i| {
                near(
                    [pieces[i].from[0] + lap(pieces[i].from) * period, pieces[i].from[1]],
                    end,
                    same,
                )
            });
            let Some(found) = next.next() else {
                return Err(outline(format!("it ends at [{}, {}]", end[0], end[1])));
            };
            if next.next().is_some() {
                return Err(IntegralError::Touching { at: end });
            }
            shift = lap(pieces[found].from) * period;
            if found == start {
                break (shift / period).round() as i32;
            }
            here = found;
        };
        if laps == 1 && line.is_none() {
            line = Some(points);
        } else {
            closed += 1;
        }
    }
    match line {
        Some(points) if closed == 0 => Ok(points),
        _ => Err(IntegralError::Islands { closed, period }),
    }
}
