// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths in three dimensions from one package: a few to be drawn, as far as the next package, and
//! by polar angle the ring or surface that the light of all came from last.

use anyhow::Result;
use bsdf::Side;
use tracer::glam::DVec3;
use tracer::ledger::Lines;
use tracer::{Fate, Interaction, Observer, Ray, Sampling, Settings, trace_observed};

use design::Design;
use results::package::{Path3d, Paths3d, RingOutline};
use results::ray_paths::PathEnd;

use super::package_drawing::rounded;
use super::paths::{lit_scene, middle_package, path_end};
use super::scene::{self, DomeSurface, is_skin};

/// Most paths traced.
const TRACED: u64 = 1 << 16;
/// Most surfaces that a path meets before it is given up here.
const MAX_SURFACES: u32 = 1_000;
/// Most surfaces that all paths meet, by the mean of the trace.
const MAX_MET: f64 = 8e6;
/// Paths that are kept to be drawn.
const DRAWN: u64 = 1_500;
/// Width of the polar angles counted, degrees.
const BIN_DEG: f64 = 5.0;
/// Most bends of a path that is drawn.
const MAX_BENDS: usize = 40;

/// The light of one wavelength.
pub struct WavelengthScene<'a> {
    /// Design in that light.
    pub design: &'a Design,
    /// Surface of its dome.
    pub surface: &'a DomeSurface,
    /// Share of all paths.
    pub share: f64,
}

/// Traces as many paths of all `parts` through a dome of `rings` as their design asks for, at most
/// [`TRACED`], and fewer where each meets many surfaces.
///
/// # Errors
/// Scenes that cannot be built.
pub(super) fn paths_3d(
    parts: &[WavelengthScene],
    rings: &[RingOutline],
    surfaces_per_path: f64,
    seed: u64,
) -> Result<Paths3d> {
    let asked = parts.iter().map(|part| part.design.trace.paths).max();
    let most = (MAX_MET / surfaces_per_path.max(1.0)) as u64;
    let traced = asked.unwrap_or_default().min(TRACED).min(most.max(DRAWN));
    traced_paths_3d(parts, rings, traced, seed)
}

/// Traces `traced` paths of all `parts` through a dome of `rings`.
///
/// # Errors
/// Scenes that cannot be built.
pub fn traced_paths_3d(
    parts: &[WavelengthScene],
    rings: &[RingOutline],
    traced: u64,
    seed: u64,
) -> Result<Paths3d> {
    let mut seen = Paths3d {
        traced: 0,
        rings: rings.iter().map(|ring| ring.name.clone()).collect(),
        faces: Vec::new(),
        paths: Vec::new(),
        bin_deg: BIN_DEG,
        by_ring: Vec::new(),
        by_face: Vec::new(),
    };
    let boxed = BoxedRings::new(rings);
    let mut ends = Vec::new();
    let mut begun = 0.0;
    for (place, part) in parts.iter().enumerate() {
        let first = (begun * traced as f64).round() as u64;
        let first_drawn = (begun * DRAWN.min(traced) as f64).round() as u64;
        begun += part.share;
        let count = (begun * traced as f64).round() as u64 - first;
        let drawn = (begun * DRAWN.min(traced) as f64).round() as u64 - first_drawn;
        if count == 0 {
            continue;
        }
        let (scene, axis) = lit_scene(part.design, part.surface)?;
        let settings = Settings {
            sampling: Sampling::Random,
            roulette_below: 1.0,
            max_bounces: part.design.trace.max_interactions.min(MAX_SURFACES),
            ..scene::settings(part.design, count, seed.wrapping_add(place as u64))
        };
        let mut recorder = Recorder {
            lines: scene.lines(),
            axes: part.design.array.axes_mm(),
            own: middle_package(part.design).0,
            axis,
            rings: &boxed,
            drawn,
            faces: &mut seen.faces,
            path: Current::default(),
            paths: Vec::new(),
            ends: Vec::new(),
        };
        trace_observed(&scene, &settings, |ray| ray, &mut recorder)?;
        let Recorder { paths, ends: of_part, .. } = recorder;
        seen.paths.extend(paths);
        ends.extend(of_part);
        seen.traced += count;
    }
    let bins = (180.0 / BIN_DEG).round() as usize;
    seen.by_ring = vec![vec![0; rings.len() + 1]; bins];
    seen.by_face = vec![vec![0; seen.faces.len() + 1]; bins];
    for End { bin, ring, face } in ends {
        seen.by_ring[bin.min(bins - 1)][ring.unwrap_or(rings.len())] += 1;
        let last = seen.faces.len();
        seen.by_face[bin.min(bins - 1)][face.unwrap_or(last)] += 1;
    }
    Ok(seen)
}

/// Direction of an escaped path, and the ring it came from.
struct End {
    bin: usize,
    ring: Option<usize>,
    face: Option<usize>,
}

/// The path that is being traced.
#[derive(Default)]
struct Current {
    points: Vec<[f64; 3]>,
    /// True where it has met another package, beyond which it is not drawn.
    is_elsewhere: bool,
    ring: Option<usize>,
    line: Option<usize>,
}

struct Recorder<'a> {
    lines: &'a Lines,
    /// Axes of all packages, the number of the one that shines, and its axis.
    axes: Vec<[f64; 2]>,
    own: usize,
    axis: DVec3,
    rings: &'a BoxedRings<'a>,
    drawn: u64,
    faces: &'a mut Vec<String>,
    path: Current,
    paths: Vec<Path3d>,
    ends: Vec<End>,
}

impl Recorder<'_> {
    fn bend(&mut self, point: DVec3) {
        if (self.paths.len() as u64) < self.drawn
            && self.path.points.len() < MAX_BENDS
            && !self.path.is_elsewhere
        {
            self.path.points.push((point - self.axis).to_array());
        }
    }

    fn face(&mut self, line: usize) -> usize {
        let name = &self.lines.surfaces[line];
        let known = self.faces.iter().position(|face| face == name);
        known.unwrap_or_else(|| {
            self.faces.push(name.clone());
            self.faces.len() - 1
        })
    }
}

impl Observer for Recorder<'_> {
    fn begins(&mut self, ray: &Ray) {
        self.path = Current::default();
        self.path.points.push((ray.origin - self.axis).to_array());
    }

    fn meets(&mut self, met: &Interaction) {
        let point = met.point;
        let package = met.instance.map(|number| number as usize);
        let package = package.filter(|number| *number < self.axes.len());
        self.bend(point);
        self.path.is_elsewhere |= package.is_some_and(|number| number != self.own);
        self.path.line = Some(met.line);
        let leaves = met.from == Side::Inner && met.to == Side::Outer && met.weight > 0.0;
        if let Some(package) = package
            && leaves
            && is_skin(&self.lines.surfaces[met.line])
        {
            let [x, y] = self.axes[package];
            self.path.ring = self.rings.nearest([(point.x - x).hypot(point.y - y), point.z]);
        }
    }

    fn scatters(&mut self, ray: &Ray, _line: usize) {
        self.bend(ray.origin);
    }

    fn goes_round(&mut self, from: DVec3, _to: DVec3) {
        self.bend(from);
        // In the next cell it is at another package.
        self.path.is_elsewhere = true;
    }

    fn ends(&mut self, ray: &Ray, fate: Fate, _weight: f64) {
        let end = path_end(fate, self.lines);
        let whole = self.path.points.len() < MAX_BENDS && !self.path.is_elsewhere;
        if let Fate::Medium(_, length) = fate
            && whole
        {
            // The middle of the flight stands for the place of absorption.
            let place = ray.at(0.5 * length.min(1e3));
            self.path.points.push((place - self.axis).to_array());
        }
        let flies = matches!(end, PathEnd::EscapedUp | PathEnd::EscapedDown | PathEnd::Lost);
        let face = self.path.line.map(|line| self.face(line));
        if matches!(end, PathEnd::EscapedUp | PathEnd::EscapedDown) {
            let theta = ray.direction.z.clamp(-1.0, 1.0).acos().to_degrees();
            self.ends.push(End { bin: (theta / BIN_DEG) as usize, ring: self.path.ring, face });
        }
        if (self.paths.len() as u64) < self.drawn {
            let points = std::mem::take(&mut self.path.points).into_iter();
            let along = ray.direction.to_array().map(rounded);
            self.paths.push(Path3d {
                fate: end,
                ring: self.path.ring,
                face,
                points_mm: points.map(|point| point.map(rounded)).collect(),
                // The end of a path with more bends, or at another package, is not drawn.
                leaves_along: (flies && whole).then_some(along),
            });
        }
    }
}

/// Rings with the boxes around their parts of the generating curve.
struct BoxedRings<'a> {
    rings: &'a [RingOutline],
    /// Lowest and highest coordinates of each.
    boxes: Vec<[[f64; 2]; 2]>,
}

/// Rounding error of the square of a distance, mm².
const ROUNDING: f64 = 1e-20;

impl<'a> BoxedRings<'a> {
    fn new(rings: &'a [RingOutline]) -> Self {
        let around = |ring: &RingOutline| {
            let ends = |k: usize| {
                let values = ring.points_mm.iter().map(|point| point[k]);
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                    [low.min(v), high.max(v)]
                })
            };
            [ends(0), ends(1)]
        };
        Self { rings, boxes: rings.iter().map(around).collect() }
    }

    /// The ring whose part of the generating curve is nearest to a point of it; of several, the
    /// first.
    fn nearest(&self, point: [f64; 2]) -> Option<usize> {
        let bounds = self.boxes.iter().map(|around| from_box(point, around));
        let (first, _) = bounds.clone().enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut nearest = (self.away(first, point), first);
        for (number, bound) in bounds.enumerate() {
            // No point of a ring is nearer than its box.
            if number != first && bound <= nearest.0 + ROUNDING {
                let away = (self.away(number, point), number);
                if away.0.total_cmp(&nearest.0).then(number.cmp(&nearest.1)).is_lt() {
                    nearest = away;
                }
            }
        }
        Some(nearest.1)
    }

    /// Square of the distance of a point from a ring.
    fn away(&self, number: usize, point: [f64; 2]) -> f64 {
        let pairs = self.rings[number].points_mm.windows(2);
        pairs.map(|pair| distance(point, pair[0], pair[1])).fold(f64::INFINITY, f64::min)
    }
}

/// Square of the distance of `p` from a box.
fn from_box(p: [f64; 2], around: &[[f64; 2]; 2]) -> f64 {
    let away = |k: usize| {
        let [low, high] = around[k];
        (low - p[k]).max(p[k] - high).max(0.0).powi(2)
    };
    away(0) + away(1)
}

/// Square of the distance of `p` from the stretch from `a` to `b`.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let d = [b[0] - a[0], b[1] - a[1]];
    let length = d[0] * d[0] + d[1] * d[1];
    let along = (p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1];
    let share = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
    (0..2).map(|k| (p[k] - a[k] - share * d[k]).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::dome_surface::dome_surface;
    use crate::model::Model;
    use crate::package_drawing::package_drawing;

    #[test]
    fn escaped_paths_are_counted_once_and_come_from_rings() {
        let design = design::embedded("d1.toml").expect("valid");
        let surface = dome_surface(&design, Model::Geometric, None).expect("a dome");
        let rings = package_drawing(&design, surface.meridian()).rings;
        assert_eq!(rings.len(), 18, "17 rings and the side");
        let part = WavelengthScene { design: &design, surface: &surface, share: 1.0 };
        let seen = paths_3d(&[part], &rings, 10.0, 3).expect("traced");
        assert_eq!((seen.traced, seen.paths.len()), (TRACED, DRAWN as usize));
        let sum = |rows: &[Vec<u32>]| rows.iter().flatten().map(|n| u64::from(*n)).sum::<u64>();
        assert_eq!(sum(&seen.by_ring), sum(&seen.by_face));
        // The full trace lets 95 % out.
        let share = sum(&seen.by_ring) as f64 / TRACED as f64;
        assert!((0.92..0.98).contains(&share), "{share}");
        let none: u32 = seen.by_ring.iter().map(|row| row[rings.len()]).sum();
        assert_eq!(none, 0, "all light leaves through the dome");
        for path in &seen.paths {
            let flies = matches!(path.fate, PathEnd::EscapedUp | PathEnd::EscapedDown);
            assert!(!flies || path.ring.is_some());
            assert!(path.points_mm.len() < MAX_BENDS || path.leaves_along.is_none());
        }
    }

    #[test]
    fn points_belong_to_the_nearest_ring() {
        let ring = |name: &str, points_mm| RingOutline { name: name.to_owned(), points_mm };
        let rings = [
            ring("1", vec![[0.0, 1.0], [0.5, 1.0], [0.5, 0.8]]),
            ring("2", vec![[0.5, 0.8], [1.0, 0.8]]),
        ];
        let rings = BoxedRings::new(&rings);
        assert_eq!(rings.nearest([0.5, 0.9]), Some(0));
        assert_eq!(rings.nearest([0.7, 0.8]), Some(1));
        // Where both meet, the first.
        assert_eq!(rings.nearest([0.5, 0.8]), Some(0));
        assert_eq!(BoxedRings::new(&[]).nearest([0.7, 0.8]), None);
    }

    /// The search by boxes against the distances from all rings, on and beside the curve.
    #[test]
    fn boxes_leave_out_no_nearer_ring() {
        let design = design::embedded("d3.toml").expect("valid");
        let surface = dome_surface(&design, Model::Fine, None).expect("a dome");
        let rings = package_drawing(&design, surface.meridian()).rings;
        let boxed = BoxedRings::new(&rings);
        let mut rng = tracer::random::stream(7, 0);
        let mut beside = || 0.02 * (tracer::random::unit(&mut rng) - 0.5);
        for ring in &rings {
            for pair in ring.points_mm.windows(2) {
                for k in 0..=4 {
                    let at =
                        |c: usize| pair[0][c] + 0.25 * f64::from(k) * (pair[1][c] - pair[0][c]);
                    let on = [at(0), at(1)];
                    for point in [on, [on[0] + beside(), on[1] + beside()]] {
                        let all = (0..rings.len())
                            .map(|number| boxed.away(number, point))
                            .enumerate()
                            .min_by(|a, b| a.1.total_cmp(&b.1));
                        assert_eq!(boxed.nearest(point), all.map(|(number, _)| number));
                    }
                }
            }
        }
    }
}
