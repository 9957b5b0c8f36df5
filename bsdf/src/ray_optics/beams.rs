// SPDX-License-Identifier: MIT OR Apache-2.0
//! Beam tracing: all directions that one incidence reaches, without random numbers.
//!
//! In: the incident ray. Out: outgoing directions with their powers. A beam of parallel rays stays
//! parallel at straight facets. Seen along its direction, the corners of the facets cut it into
//! strips that meet one facet each, so the entry position is integrated exactly. Every strip splits
//! into a reflected and a refracted beam until its power falls below the cutoff. Then its middle
//! ray continues unsplit, so no power is dropped; a fixed sequence of numbers chooses its branch at
//! each facet in proportion to the reflectance. The stronger branch every time would favour
//! directions and can loop for ever.

use super::UnitCell;
use super::outline::Facet;
use super::ray::{Ray, Step};
use crate::direction::Side;
use glam::{DVec2, DVec3};

/// Directions closer than this, in units of the vacuum wavenumber, are equal.
const SAME_DIRECTION: f64 = 1e-9;

/// Parallel rays that start from a chord. `ray` holds the direction and the medium; its position is
/// unused.
#[derive(Clone, Copy, Debug)]
struct Beam {
    ray: Ray,
    chord: [DVec2; 2],
    power: f64,
}

impl Beam {
    /// The ray that starts at parameter `s` (0 to 1) of the chord.
    fn ray_at(&self, s: f64) -> Ray {
        let [a, b] = self.chord;
        Ray { x: a.x + s * (b.x - a.x), z: a.y + s * (b.y - a.y), ..self.ray }
    }

    /// Parameters of the chord, ascending from 0 to 1, at which corners lie, seen along the beam.
    fn cuts(&self, cell: &UnitCell) -> Vec<f64> {
        let start = self.ray_at(0.0);
        let width = start.cross(self.chord[1]);
        let mut cuts: Vec<f64> = cell
            .corners
            .iter()
            .map(|corner| start.cross(*corner) / width)
            .filter(|s| (1e-12..1.0 - 1e-12).contains(s))
            .collect();
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|b, a| *b - *a < 1e-12);
        cuts.insert(0, 0.0);
        cuts.push(1.0);
        cuts
    }
}

/// Points that split a beam: ends of facets within the period, and intersections of facets and
/// limits with its border.
pub(super) fn corners(facets: &[Facet], period: f64, limits: [f64; 2]) -> Vec<DVec2> {
    let borders = [0.0, period];
    let mut corners: Vec<DVec2> =
        borders.iter().flat_map(|x| limits.map(|z| DVec2::new(*x, z))).collect();
    for facet in facets {
        let (a, b) = (facet.a, facet.b);
        corners.extend([a, b].into_iter().filter(|p| (0.0..=period).contains(&p.x)));
        for x in borders {
            if (a.x < x) != (b.x < x) {
                corners.push(DVec2::new(x, a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y)));
            }
        }
    }
    corners.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    corners.dedup();
    corners
}

/// Outgoing directions with powers, inner side first, by kx.
pub(super) fn lobes(cell: &UnitCell, start: Ray) -> Vec<(DVec3, f64)> {
    let mut out: Vec<(Ray, f64)> = Vec::new();
    let mut sequence = SplitMix64(0);
    let chord = [0.0, cell.period].map(|x| DVec2::new(x, start.z));
    let mut beams = vec![Beam { ray: start, chord, power: 1.0 }];
    while let Some(beam) = beams.pop() {
        let cuts = beam.cuts(cell);
        for pair in cuts.windows(2) {
            let power = beam.power * (pair[1] - pair[0]);
            let middle = beam.ray_at(0.5 * (pair[0] + pair[1]));
            if power < cell.power_cutoff {
                let left = cell.traced(middle, |_, hit| sequence.next() < hit.reflectance);
                out.extend(left.map(|ray| (ray, power)));
                continue;
            }
            let step = cell.step(&middle);
            let ends = |kx: f64, kz: f64, at: DVec2| {
                // Intersections of the strip's border rays with the straight line through `at`
                // along (kx, kz).
                pair.iter().map(move |s| {
                    let ray = beam.ray_at(*s);
                    let t =
                        ((at.x - ray.x) * kz - (at.y - ray.z) * kx) / (ray.kx * kz - ray.kz * kx);
                    ray.at(t)
                })
            };
            match step {
                Step::Leave => out.push((middle, power)),
                Step::Lost => cell.lose(),
                Step::Wrap { t } => {
                    let mut ray = middle;
                    let wall = if ray.kx > 0.0 { cell.period } else { 0.0 };
                    cell.wrap(&mut ray, t);
                    let chord =
                        ends(0.0, 1.0, DVec2::new(wall, 0.0)).map(|p| DVec2::new(ray.x, p.y));
                    beams.extend(collected(chord).map(|chord| Beam { ray, chord, power }));
                }
                Step::Hit { facet, t } => {
                    let hit = cell.interact(&middle, facet, t);
                    let facet = &cell.facets[facet];
                    let along = facet.b - facet.a;
                    let Some(chord) = collected(ends(along.x, along.y, facet.a)) else {
                        continue;
                    };
                    let reflected = power * hit.reflectance;
                    beams.push(Beam { ray: hit.reflected, chord, power: reflected });
                    if hit.reflectance < 1.0 {
                        beams.push(Beam { ray: hit.refracted, chord, power: power - reflected });
                    }
                }
            }
        }
    }
    group(out)
}

/// The two ends of a chord.
fn collected(mut ends: impl Iterator<Item = DVec2>) -> Option<[DVec2; 2]> {
    Some([ends.next()?, ends.next()?])
}

/// SplitMix64: a fixed sequence of uniform numbers in 0..1 (Steele, Lea, Flood, OOPSLA 2014).
pub(super) struct SplitMix64(pub u64);

impl SplitMix64 {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Sums the powers of equal directions.
fn group(mut out: Vec<(Ray, f64)>) -> Vec<(DVec3, f64)> {
    let side = |ray: &Ray| {
        if ray.kz < 0.0 { Side::Inner } else { Side::Outer }
    };
    out.sort_by(|(a, _), (b, _)| side(a).cmp(&side(b)).then(a.kx.total_cmp(&b.kx)));
    let mut groups: Vec<(Ray, f64)> = Vec::new();
    for (ray, power) in out {
        match groups.last_mut() {
            Some((last, sum)) if side(last) == side(&ray) && ray.kx - last.kx < SAME_DIRECTION => {
                *sum += power;
            }
            _ => groups.push((ray, power)),
        }
    }
    groups.into_iter().map(|(ray, power)| (ray.direction(), power)).collect()
}
