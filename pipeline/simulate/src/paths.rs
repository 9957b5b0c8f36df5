// SPDX-License-Identifier: MIT OR Apache-2.0
//! A few paths from one package, in the plane y = 0 through its axis, to look at.
//!
//! The package stands where it is traced, among all others; it alone shines, and coordinates are
//! counted from its axis. Rays start on the line where the plane
//! cuts the emitting face. They keep the polar angle that the source drew, so every cone holds as
//! many paths as in a full trace. Mirrors, interfaces and gratings keep them in the plane; diffuse
//! surfaces and media that scatter do not. Absorption takes a whole path or nothing.

use anyhow::Result;
use tracer::glam::DVec3;
use tracer::ledger::{Lines, Loss};
use tracer::{Fate, Interaction, Observer, Ray, Sampling, Scene, Settings, trace_observed};

use design::Design;
use design::spectrum::lights::Lights;
use metrics::kinds::Weighting;
use results::ray_paths::{PathEnd, TracedPath, Vertex};

use super::scene::{self, DomeSurface};

/// Name of a face of a cell that repeats.
const WALL: &str = "wall";

/// Records the paths of a trace.
struct PathRecorder<'a> {
    lines: &'a Lines,
    axis: DVec3,
    power_w: f64,
    vertices: Vec<Vertex>,
    /// Parts of the path before it went round in a cell that repeats.
    before: Vec<Vec<Vertex>>,
    paths: Vec<TracedPath>,
}

impl PathRecorder<'_> {
    fn add(&mut self, point: DVec3, at: &str) {
        let point_mm = (point - self.axis).to_array();
        self.vertices.push(Vertex { point_mm, at: at.to_owned() });
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

    fn scatters(&mut self, ray: &Ray, line: usize) {
        let lines = self.lines;
        self.add(ray.origin, &lines.media[line]);
    }

    fn goes_round(&mut self, from: DVec3, to: DVec3) {
        self.add(from, WALL);
        self.before.push(std::mem::take(&mut self.vertices));
        self.add(to, WALL);
    }

    fn ends(&mut self, ray: &Ray, fate: Fate, _weight: f64) {
        let lines = self.lines;
        let end = path_end(fate, lines);
        for vertices in std::mem::take(&mut self.before) {
            self.paths.push(TracedPath {
                power_w: self.power_w,
                wavelength_nm: None,
                fate: end,
                vertices,
                leaves_along: None,
            });
        }
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

/// Number and axis of the package nearest to the middle of the array, which pictures show.
pub fn middle_package(design: &Design) -> (usize, [f64; 2]) {
    let away = |[x, y]: &[f64; 2]| x * x + y * y;
    let axes = design.array.axes_mm().into_iter().enumerate();
    axes.min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b))).unwrap_or_default()
}

/// The scene of `design` in which the package nearest to the middle shines alone, among all others,
/// and the place of its axis.
///
/// # Errors
/// A scene that cannot be built.
pub(super) fn lit_scene(design: &Design, surface: &DomeSurface) -> Result<(Scene, DVec3)> {
    let (number, [x, y]) = middle_package(design);
    // It shines alone, whatever its power.
    let mut even = design.clone();
    even.array.drives = None;
    Ok((scene::build(&even, surface)?.lit_by(number), DVec3::new(x, y, 0.0)))
}

/// Traces `count` paths from one package of `design` with `surface` on all domes; coordinates from
/// its axis.
pub fn paths(
    design: &Design,
    surface: &DomeSurface,
    count: u64,
    seed: u64,
) -> Result<Vec<TracedPath>> {
    let (scene, axis) = lit_scene(design, surface)?;
    let settings = Settings {
        sampling: Sampling::Random,
        roulette_below: 1.0,
        ..scene::settings(design, count, seed)
    };
    let mut album = PathRecorder {
        lines: scene.lines(),
        axis,
        power_w: scene.power() / count as f64,
        vertices: Vec::new(),
        before: Vec::new(),
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
        // Beside others that are far away: what meets them leaves the plane no more than the rest.
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
