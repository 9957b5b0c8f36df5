// SPDX-License-Identifier: MIT OR Apache-2.0
//! A few paths through one package, in the plane y = 0 through its axis, to look at.
//!
//! The package stands alone at the origin, on its ground. Rays start on the line where the plane
//! cuts the emitting face. They keep the polar angle that the source drew, so every cone holds as
//! many paths as in a full trace. Mirrors, interfaces and gratings keep them in the plane; diffuse
//! surfaces do not. Absorption takes a whole path or nothing.

use anyhow::Result;
use tracer::glam::DVec3;
use tracer::ledger::{Lines, Loss};
use tracer::{Fate, Interaction, Observer, Ray, Sampling, Settings, trace_observed};

use design::Design;
use design::resolved::array::PackagePositions;
use design::schema::solids::Per;
use design::spectrum::Weighting;
use design::spectrum::lights::Lights;
use results::ray_paths::{PathEnd, TracedPath, Vertex};

use super::scene::{self, DomeSurface};

/// Records the paths of a trace.
struct PathRecorder<'a> {
    lines: &'a Lines,
    power_w: f64,
    vertices: Vec<Vertex>,
    paths: Vec<TracedPath>,
}

impl PathRecorder<'_> {
    fn add(&mut self, point: DVec3, at: &str) {
        self.vertices.push(Vertex { point_mm: point.to_array(), at: at.to_owned() });
    }
}

impl Observer for PathRecorder<'_> {
    fn begins(&mut self, ray: &Ray) {
        self.add(ray.origin, "source");
    }

    fn meets(&mut self, meeting: &Interaction) {
        let lines = self.lines;
        self.add(meeting.point, &lines.surfaces[meeting.line]);
    }

    fn ends(&mut self, ray: &Ray, fate: Fate, _weight: f64) {
        let lines = self.lines;
        let end = path_end(fate, lines);
        if let Fate::Medium(line, length) = fate {
            // The middle of the flight stands for the place of absorption.
            self.add(ray.at(0.5 * length.min(1e3)), &lines.media[line]);
        }
        let flies = matches!(end, PathEnd::EscapedUp | PathEnd::EscapedDown | PathEnd::Lost);
        self.paths.push(TracedPath {
            power_w: self.power_w,
            wavelength_nm: None,
            fate: end,
            vertices: std::mem::take(&mut self.vertices),
            leaves_along: flies.then(|| ray.direction.to_array()),
        });
    }
}

/// Fate of a path, by the names of the ledger.
pub(super) fn path_end(fate: Fate, lines: &Lines) -> PathEnd {
    match fate {
        Fate::EscapedUp => PathEnd::EscapedUp,
        Fate::EscapedDown => PathEnd::EscapedDown,
        Fate::Surface(line) => PathEnd::at_surface(&lines.surfaces[line]),
        Fate::Medium(..) => PathEnd::AbsorbedMedium,
        Fate::Lost(Loss::Bounces | Loss::Leak | Loss::Invalid) => PathEnd::Lost,
    }
}

/// The package nearest to the middle of the array, alone at the origin; solids of the array keep
/// their place about it.
pub fn single_package(design: &Design) -> Design {
    let mut alone = design.clone();
    let away = |[x, y]: &[f64; 2]| x * x + y * y;
    let nearest = design
        .array
        .axes_mm()
        .into_iter()
        .enumerate()
        .min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b)));
    if let Some((package, _)) = nearest {
        let place = design.led.place(package);
        (alone.led.offset_mm, alone.led.tilt_deg) = (place.offset_mm, place.tilt_deg);
    }
    (alone.led.offsets_mm, alone.led.tilts_deg) = (Vec::new(), Vec::new());
    for solid in &mut alone.solids {
        if let (Per::Array, Some([x, y])) = (solid.per(), nearest.map(|(_, at)| at)) {
            solid.form.placement.origin -= DVec3::new(x, y, 0.0);
        }
    }
    alone.array.positions = PackagePositions::SINGLE;
    alone
}

/// Traces `count` paths of one package of `design` with `surface` on its dome.
pub fn paths(
    design: &Design,
    surface: &DomeSurface,
    count: u64,
    seed: u64,
) -> Result<Vec<TracedPath>> {
    let alone = single_package(design);
    let scene = scene::build(&alone, surface)?;
    let settings = Settings {
        sampling: Sampling::Random,
        roulette_below: 1.0,
        ..scene::settings(design, count, seed)
    };
    let mut album = PathRecorder {
        lines: scene.lines(),
        power_w: scene.power() / count as f64,
        vertices: Vec::new(),
        paths: Vec::new(),
    };
    let aim: fn(Ray) -> Ray = if design.sources.is_empty() && design.led.is_centred() {
        into_plane
    } else {
        // Sources of `[[sources]]`, and of a box off the axis, keep their place.
        |ray| ray
    };
    trace_observed(&scene, &settings, aim, &mut album)?;
    Ok(album.paths)
}

/// One design for each light and wavelength, with its number of the `count` paths, by power: all
/// lines of a light, or the median of a sampled one.
///
/// # Errors
/// A wavelength without data.
pub fn by_light(design: &Design, lights: &Lights, count: u64) -> Result<Vec<(Design, u64)>> {
    let (mut found, mut power, mut begun) = (Vec::new(), 0.0, 0);
    for light in &lights.lights {
        let nodes: Vec<f64> = light.light.rule(1).into_iter().map(|(nm, _)| nm).collect();
        let weights = light.light.weights(&nodes, Weighting::Radiometric);
        for (node, weight) in weights.into_iter().enumerate() {
            power += light.emitted_w * weight;
            let end = (count as f64 * power).round() as u64;
            if end > begun {
                found.push((design.lit_by(light, &nodes, node)?, end - begun));
                begun = end;
            }
        }
    }
    Ok(found)
}

/// The ray turned about the vertical through its start into the plane y = 0, keeping the sign of x.
fn into_plane(ray: Ray) -> Ray {
    let (origin, d) = (ray.origin, ray.direction);
    Ray {
        origin: DVec3::new(origin.x, 0.0, origin.z),
        direction: DVec3::new(d.x.hypot(d.y).copysign(d.x), 0.0, d.z),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::dome_surface::dome_surface;
    use crate::model::Model;

    #[test]
    fn paths_stay_in_their_plane_and_each_ends_once() {
        for (name, model) in [
            ("d1.toml", Model::Geometric),
            ("d1.toml", Model::Control),
            ("bare-dome.toml", Model::Geometric),
        ] {
            let design = design::embedded(name).expect("valid");
            let surface = dome_surface(&design, model, None).expect("a skin");
            let found = paths(&design, &surface, 300, 5).expect("a trace");
            assert_eq!(found.len(), 300);
            let power: f64 = found.iter().map(|path| path.power_w).sum();
            assert!((power - 1.0).abs() < 1e-12);
            for path in &found {
                assert!(
                    path.vertices
                        .iter()
                        .all(|v| v.point_mm[1].abs() < 1e-9 && v.point_mm[2] > -1e-6)
                );
                let escaped = matches!(path.fate, PathEnd::EscapedUp | PathEnd::EscapedDown);
                assert_eq!(escaped, path.leaves_along.is_some());
                assert_eq!(path.vertices[0].at, "source");
            }
            let up = found.iter().filter(|p| p.fate == PathEnd::EscapedUp).count();
            // The full trace lets 94 % out upwards.
            assert!(up > 250, "{name}: {up}");
            assert_eq!(found, paths(&design, &surface, 300, 5).expect("a trace"));
        }
    }
}
