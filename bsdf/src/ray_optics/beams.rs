// SPDX-License-Identifier: MIT OR Apache-2.0
//! Beam tracing: all directions that one incidence reaches, without random numbers.
//!
//! In: the incident ray. Out: outgoing directions with their powers. A beam of parallel rays stays
//! parallel at straight facets. Seen along its direction, the corners of the facets cut it into strips
//! that meet one facet each, so the entry position is integrated exactly. Every strip splits into a
//! reflected and a refracted beam until its power falls below the cutoff. Then its middle ray continues
//! unsplit, so no power is dropped; a fixed sequence of numbers chooses its branch at each facet in
//! proportion to the reflectance. The stronger branch every time would favour directions and can loop
//! for ever.

use super::UnitCell;
use super::outline::Facet;
use super::ray::{MOST_STEPS, Ray, Step};
use crate::direction::Side;
use glam::DVec3;

/// Directions closer than this, in units of the vacuum wavenumber, are equal.
const SAME_DIRECTION: f64 = 1e-9;

/// Parallel rays that start from a chord. `ray` holds the direction and the medium; its position is
/// unused.
#[derive(Clone, Copy, Debug)]
struct Beam {
    ray: Ray,
    chord: [[f64; 2]; 2],
    power: f64,
}

impl Beam {
    /// The ray that starts at parameter `s` (0 to 1) of the chord.
    fn ray_at(&self, s: f64) -> Ray {
        let [a, b] = self.chord;
        Ray {
            x: a[0] + s * (b[0] - a[0]),
            z: a[1] + s * (b[1] - a[1]),
            ..self.ray
        }
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
pub(super) fn corners(facets: &[Facet], period: f64, limits: [f64; 2]) -> Vec<[f64; 2]> {
    let borders = [0.0, period];
    let mut corners: Vec<[f64; 2]> = borders
        .iter()
        .flat_map(|x| limits.map(|z| [*x, z]))
        .collect();
    for facet in facets {
        let (a, b) = (facet.a, facet.b);
        corners.extend(
            [a, b]
                .into_iter()
                .filter(|p| (0.0..=period).contains(&p[0])),
        );
        for x in borders {
            if (a[0] < x) != (b[0] < x) {
                corners.push([x, a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1])]);
            }
        }
    }
    corners.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    corners.dedup();
    corners
}

/// Outgoing directions with powers, inner side first, by kx.
pub(super) fn lobes(cell: &UnitCell, start: Ray) -> Vec<(DVec3, f64)> {
    let mut out: Vec<(Ray, f64)> = Vec::new();
    let mut sequence = SplitMix64(0);
    let chord = [[0.0, start.z], [cell.period, start.z]];
    let mut beams = vec![Beam {
        ray: start,
        chord,
        power: 1.0,
    }];
    while let Some(beam) = beams.pop() {
        let cuts = beam.cuts(cell);
        for pair in cuts.windows(2) {
            let power = beam.power * (pair[1] - pair[0]);
            let middle = beam.ray_at(0.5 * (pair[0] + pair[1]));
            if power < cell.power_cutoff {
                out.extend(trace(cell, middle, &mut sequence).map(|ray| (ray, power)));
                continue;
            }
            let step = cell.step(&middle);
            let ends = |kx: f64, kz: f64, at: [f64; 2]| {
                // Intersections of the strip's border rays with the straight line through `at`
                // along (kx, kz).
                pair.iter().map(move |s| {
                    let ray = beam.ray_at(*s);
                    let t =
                        ((at[0] - ray.x) * kz - (at[1] - ray.z) * kx) / (ray.kx * kz - ray.kz * kx);
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
                    let chord = ends(0.0, 1.0, [wall, 0.0]).map(|p| [ray.x, p[1]]);
                    beams.extend(collected(chord).map(|chord| Beam { ray, chord, power }));
                }
                Step::Hit { facet, t } => {
                    let hit = cell.interact(&middle, facet, t);
                    let facet = &cell.facets[facet];
                    let (ex, ez) = (facet.b[0] - facet.a[0], facet.b[1] - facet.a[1]);
                    let Some(chord) = collected(ends(ex, ez, facet.a)) else {
                        continue;
                    };
                    let reflected = power * hit.reflectance;
                    beams.push(Beam {
                        ray: hit.reflected,
                        chord,
                        power: reflected,
                    });
                    if hit.reflectance < 1.0 {
                        beams.push(Beam {
                            ray: hit.refracted,
                            chord,
                            power: power - reflected,
                        });
                    }
                }
            }
        }
    }
    group(out)
}

/// The two ends of a chord.
fn collected(mut ends: impl Iterator<Item = [f64; 2]>) -> Option<[[f64; 2]; 2]> {
    Some([ends.next()?, ends.next()?])
}

/// Traces one ray until it leaves, one branch at each facet.
fn trace(cell: &UnitCell, mut ray: Ray, sequence: &mut SplitMix64) -> Option<Ray> {
    for _ in 0..MOST_STEPS {
        match cell.step(&ray) {
            Step::Hit { facet, t } => {
                let hit = cell.interact(&ray, facet, t);
                let reflect = sequence.next() < hit.reflectance;
                ray = if reflect {
                    hit.reflected
                } else {
                    hit.refracted
                };
            }
            Step::Wrap { t } => cell.wrap(&mut ray, t),
            Step::Leave => return Some(ray),
            Step::Lost => break,
        }
    }
    cell.lose();
    None
}

/// SplitMix64: a fixed sequence of uniform numbers in 0..1 (Steele, Lea, Flood, OOPSLA 2014).
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Sums the powers of equal directions.
fn group(mut out: Vec<(Ray, f64)>) -> Vec<(DVec3, f64)> {
    let side = |ray: &Ray| {
        if ray.kz < 0.0 {
            Side::Inner
        } else {
            Side::Outer
        }
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
    groups
        .into_iter()
        .map(|(ray, power)| (ray.direction(), power))
        .collect()
}
