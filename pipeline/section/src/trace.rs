// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays in the plane of the section: isotropic sources, Fresnel's shares or tables of orders at the
//! surfaces, a perfect mirror below. Where light divides, one way is chosen by its share.

use crate::dome::Surface;
use crate::sets::Sets;
use crate::tables::Tables;
use bsdf::analytic::fresnel;
use bsdf::{Bsdf, OrderTable, Transport};
use full_wave::Polarisation;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Paths with more events are given up and counted.
const MAX_EVENTS: usize = 10_000;
/// Parts of a set of sources that are traced at once.
const PARTS: usize = 5;

/// What rays meet.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// Surfaces of the dome.
    pub surfaces: &'a [Surface],
    /// Tables of the rings; without them all surfaces are smooth.
    pub tables: Option<&'a Tables>,
    /// Index inside and outside.
    pub index: [f64; 2],
    /// Polarisation.
    pub polarisation: Polarisation,
}

/// Far field of rays.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// Shares of the emitted power.
    pub shares: Sets,
    /// Share of the paths that are given up, or that slip through a corner.
    pub lost: f64,
}

/// Traces `paths` rays, in equal numbers from all sources, into bins between the `edges` (radians
/// from z towards x, ascending). Sets hold equal numbers of `sources`.
pub fn trace(
    scene: Scene,
    sources: &[Vec<[f64; 2]>],
    edges: &[f64],
    paths: usize,
    seed: u64,
) -> Traced {
    let each = sources[0].len();
    let per_group = paths.div_ceil(PARTS * sources.len() * each) * each;
    let count = edges.len().saturating_sub(1);
    let share = 1.0 / (PARTS * per_group) as f64;
    let groups: Vec<(Vec<f64>, f64)> = (0..PARTS * sources.len())
        .into_par_iter()
        .map(|group| {
            let mut rng = Pcg64Mcg::seed_from_u64(seed ^ (group as u64) << 32);
            let (mut bins, mut lost) = (vec![0.0; count], 0.0);
            for path in 0..per_group {
                match follow(&scene, sources[group / PARTS][path % each], &mut rng) {
                    Some(angle) => {
                        let above = edges.partition_point(|edge| *edge <= angle);
                        if (1..=count).contains(&above) {
                            bins[above - 1] += share;
                        }
                    }
                    None => lost += share / sources.len() as f64,
                }
            }
            (bins, lost)
        })
        .collect();
    let sum = |parts: &[(Vec<f64>, f64)]| {
        (0..count).map(|bin| parts.iter().map(|(bins, _)| bins[bin]).sum()).collect()
    };
    Traced {
        shares: Sets(groups.chunks(PARTS).map(sum).collect()),
        lost: groups.iter().map(|(_, lost)| lost).sum(),
    }
}

/// Angle from z at which a path leaves; none if it is given up.
fn follow(scene: &Scene, source: [f64; 2], rng: &mut Pcg64Mcg) -> Option<f64> {
    let angle = TAU * rng.random::<f64>();
    let (mut at, mut way) = (source, [angle.sin(), angle.cos()]);
    let (mut inside, mut last) = (true, usize::MAX);
    for _ in 0..MAX_EVENTS {
        let hit = nearest(scene.surfaces, at, way, last);
        let floor = if way[1] < 0.0 { -at[1] / way[1] } else { f64::INFINITY };
        let distance = hit.map_or(f64::INFINITY, |(distance, _)| distance);
        if floor.is_infinite() && hit.is_none() {
            return (!inside).then(|| way[0].atan2(way[1]));
        }
        let reached = floor.min(distance);
        at = [at[0] + reached * way[0], at[1] + reached * way[1]];
        if floor < distance {
            (at[1], way[1], last) = (0.0, -way[1], usize::MAX);
            continue;
        }
        let number = hit?.1;
        let surface = &scene.surfaces[number];
        let normal = surface.normal(at);
        let table = scene.tables.and_then(|tables| tables.ring(surface.ring?, scene.polarisation));
        // A ray that comes from the wrong side has slipped through a corner.
        let along = way[0] * normal[0] + way[1] * normal[1];
        if (along > 0.0) != inside {
            return None;
        }
        let crosses;
        (way, crosses) = match table {
            Some(table) => scatter(table, at, normal, way, rng)?,
            None => refract(scene, normal, way, inside, rng),
        };
        inside ^= crosses;
        last = number;
    }
    None
}

/// Direction after a smooth surface, and whether the ray crosses it.
fn refract(
    scene: &Scene,
    normal: [f64; 2],
    way: [f64; 2],
    inside: bool,
    rng: &mut Pcg64Mcg,
) -> ([f64; 2], bool) {
    let [n1, n2] = if inside { scene.index } else { [scene.index[1], scene.index[0]] };
    let along = way[0] * normal[0] + way[1] * normal[1];
    let reflectance = fresnel(n1, n2, along.abs());
    let share = match scene.polarisation {
        Polarisation::Te => reflectance.s,
        Polarisation::Tm => reflectance.p,
    };
    if rng.random::<f64>() < share {
        return ([0, 1].map(|k| way[k] - 2.0 * along * normal[k]), false);
    }
    let across = [0, 1].map(|k| (way[k] - along * normal[k]) * n1 / n2);
    let rest = (1.0 - across[0] * across[0] - across[1] * across[1]).max(0.0).sqrt();
    ([0, 1].map(|k| across[k] + along.signum() * rest * normal[k]), true)
}

/// Direction after a ring's table, and whether the ray crosses the surface: t of the table runs
/// outward and down.
fn scatter(
    table: &OrderTable,
    at: [f64; 2],
    normal: [f64; 2],
    way: [f64; 2],
    rng: &mut Pcg64Mcg,
) -> Option<([f64; 2], bool)> {
    let side = if at[0] < 0.0 { -1.0 } else { 1.0 };
    let t = [side * normal[1], -side * normal[0]];
    let along = |axis: [f64; 2]| -(way[0] * axis[0] + way[1] * axis[1]);
    let sample = table.sample(DVec3::new(along(t), 0.0, along(normal)), rng)?;
    let wo = sample.wo;
    let out = [0, 1].map(|k| wo.x * t[k] + wo.z * normal[k]);
    Some((out, sample.lobe.transport == Transport::Transmission))
}

impl Surface {
    /// Unit normal out of the dome.
    fn normal(&self, at: [f64; 2]) -> [f64; 2] {
        if let Some((centre, radius)) = self.arc {
            return [0, 1].map(|k| (at[k] - centre[k]) / radius);
        }
        let [x, z] = [self.end[0] - self.start[0], self.end[1] - self.start[1]];
        let length = x.hypot(z);
        [z / length, -x / length]
    }

    /// Distance along a ray, beyond `least`.
    fn distance(&self, at: [f64; 2], way: [f64; 2], least: f64) -> Option<f64> {
        let [x, z] = [self.end[0] - self.start[0], self.end[1] - self.start[1]];
        let from = [self.start[0] - at[0], self.start[1] - at[1]];
        let Some((centre, radius)) = self.arc else {
            let denominator = way[0] * z - way[1] * x;
            let distance = (from[0] * z - from[1] * x) / denominator;
            let part = (from[0] * way[1] - from[1] * way[0]) / denominator;
            return (distance > least && (0.0..=1.0).contains(&part)).then_some(distance);
        };
        let c = [at[0] - centre[0], at[1] - centre[1]];
        let half = c[0] * way[0] + c[1] * way[1];
        let discriminant = half * half - (c[0] * c[0] + c[1] * c[1] - radius * radius);
        if discriminant < 0.0 {
            return None;
        }
        // The points of an arc lie on one side of its chord: to the right where the normal points away
        // from the centre.
        let on_arc = |distance: f64| {
            let p = [0, 1].map(|k| at[k] + distance * way[k] - self.start[k]);
            distance > least && (x * p[1] - z * p[0]) * radius <= 0.0
        };
        let root = discriminant.sqrt();
        [-half - root, -half + root].into_iter().find(|distance| on_arc(*distance))
    }
}

/// Nearest surface along a ray; a straight one that it leaves from is left out.
fn nearest(surfaces: &[Surface], at: [f64; 2], way: [f64; 2], last: usize) -> Option<(f64, usize)> {
    let mut found: Option<(f64, usize)> = None;
    for (number, surface) in surfaces.iter().enumerate() {
        if number == last && surface.arc.is_none() {
            continue;
        }
        let least = surface.arc.map_or(0.0, |(_, radius)| 1e-9 * radius.abs());
        if let Some(distance) = surface.distance(at, way, least)
            && found.is_none_or(|(nearest, _)| distance < nearest)
        {
            found = Some((distance, number));
        }
    }
    found
}
