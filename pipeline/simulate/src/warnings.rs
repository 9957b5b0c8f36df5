// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a design may say by mistake, for `check` and `run`: sources that hang over the edge of what
//! they lie on, sources in one place, bodies that hold the light, media that scatter it very often,
//! spheres too near each other to scatter independently, and walls that mirror what is not its own
//! image.
//!
//! \[Tien, Drolen 1987\] C. L. Tien, B. L. Drolen, *Thermal radiation in particulate media with
//! dependent and independent scattering*, Annu. Rev. Numer. Fluid Mech. Heat Transfer 1, 1.

use anyhow::Result;
use tracer::glam::DVec3;
use tracer::ledger::Lines;
use tracer::shape::Bounds;
use tracer::{
    Emission, Emitter, Interaction, Observer, Ray, Sampling, Settings, Source, trace_observed,
};

use design::Design;
use design::resolved::led::BoxPlace;
use design::resolved::medium::Medium;
use design::resolved::scattering::Phase;
use design::resolved::solids::CheckedSolid;
use metrics::digits::shortest;

use super::dome_surface::dome_surface;
use super::lit;
use super::mirror_walls;
use super::model::Model;
use super::scene;

/// Largest distance of a source from the face that it lies on, as a share of the size of the face.
const ON: f64 = 1e-2;
/// Least length that hangs over, as a share of the size of the face.
const OVER: f64 = 1e-6;

/// A rectangle in space, from its lowest to its highest corner, and where it faces.
struct Face {
    bounds: Bounds,
    normal: DVec3,
}

/// Paths that are followed to see how many surfaces they meet.
const PROBED: u64 = 64;
/// Mean surfaces of a path beyond which a trace is slow: the usual is some ten.
const MANY: f64 = 300.0;

/// Share of emitted photons with more energy than any of the light that goes without a word.
const MAX_ANTI_STOKES: f64 = 1e-3;

/// Mean scatterings of a path beyond which a trace is slow.
const MANY_SCATTERINGS: f64 = 3000.0;

/// Warnings on `design`, in words.
///
/// # Errors
/// A scene that cannot be built.
pub fn warnings(design: &Design) -> Result<Vec<String>> {
    let mut said = of_sources(design);
    said.extend(of_spheres(design));
    said.extend(of_luminophores(design));
    said.extend(of_films(design));
    said.extend(mirror_walls::warning(design));
    said.extend(held_light(design)?);
    Ok(said)
}

/// Warnings on substances that emit photons of more energy than those of the light.
fn of_luminophores(design: &Design) -> Vec<String> {
    let all = design.anti_stokes().into_iter().filter(|(_, share)| *share > MAX_ANTI_STOKES);
    let warning = |([table, name], share): ([&str; 2], f64)| {
        format!(
            "{}: {table}: {:.1} % of the photons that {name:?} emits have more energy than \
             any of the light, which their surroundings must give; `stokes_only = true` leaves \
             them out",
            design.provenance.file,
            100.0 * share
        )
    };
    all.map(warning).collect()
}

/// Warnings on spheres whose neighbours are near: independent are those of a volume share below
/// 0.006, or with half a wavelength of the medium between them \[Tien, Drolen 1987\].
fn of_spheres(design: &Design) -> Vec<String> {
    let solids = design.solids.iter();
    let solids = solids
        .filter_map(|solid| Some((format!("{}.medium", solid.table), solid.medium.as_ref()?)));
    let media = [("silicone".to_owned(), &design.silicone)].into_iter().chain(solids);
    let warning = |(table, medium): (String, &Medium)| {
        let Phase::Spheres { diameter_um, wavelength_nm, volume_fraction, .. } =
            medium.scattering.as_ref()?.phase
        else {
            return None;
        };
        let gap_nm = 1e3 * diameter_um * (0.905 / volume_fraction.cbrt() - 1.0);
        let is_dense = volume_fraction > 0.006 && gap_nm < 0.5 * wavelength_nm;
        is_dense.then(|| {
            format!(
                "{}: {table}.particles: {:.0} nm between spheres of a volume share of {volume_fraction} are less than half a wavelength there, {:.0} nm: they do not scatter independently, as they are taken to, and real ones scatter less",
                design.provenance.file,
                gap_nm.max(0.0),
                0.5 * wavelength_nm
            )
        })
    };
    media.filter_map(warning).collect()
}

/// Warnings on films whose edge cuts bins just above them.
fn of_films(design: &Design) -> Vec<String> {
    let warning = |(key, film): (String, &CheckedSolid)| {
        format!(
            "{}: {key}: the edge of {} {:?} cuts bins, which hold light of both sides: figures of uniformity and extremes leave them out; with bins that end at the edge none is cut",
            design.provenance.file,
            film.table,
            film.name()
        )
    };
    lit::cut_by_films(design).into_iter().map(warning).collect()
}

/// Surfaces met by the paths of a probe, and scatterings in media, by ledger line.
struct Counter {
    met: Vec<u64>,
    scattered: Vec<u64>,
}

impl Observer for Counter {
    fn meets(&mut self, met: &Interaction) {
        self.met[met.line] += 1;
    }

    fn scatters(&mut self, _ray: &Ray, line: usize) {
        self.scattered[line] += 1;
    }
}

/// The body that holds the paths, where they meet many surfaces, and the medium that scatters them
/// many times.
fn held_light(design: &Design) -> Result<Vec<String>> {
    let surface = dome_surface(design, Model::Geometric, None)?;
    let scene = scene::build(design, &surface)?;
    let Lines { surfaces: names, media, .. } = scene.lines();
    let mut counter = Counter { met: vec![0; names.len()], scattered: vec![0; media.len()] };
    let settings = Settings { sampling: Sampling::Random, ..scene::settings(design, PROBED, 1) };
    trace_observed(&scene, &settings, |ray| ray, &mut counter)?;
    let rounded = |mean: f64| shortest(format!("{mean:.1e}").parse().unwrap_or(mean));
    let all: u64 = counter.met.iter().sum();
    let mean = all as f64 / PROBED as f64;
    let most = counter.met.iter().zip(names).max_by_key(|(met, _)| **met);
    let held = most.filter(|_| mean > MANY).map(|(met, name)| {
        format!(
            "{}: {name:?} holds the light: a path meets some {} surfaces, {:.0} % of them of {name:?}, so that a trace takes long; some ten are usual, and paths are given up after {} (trace.max_interactions)",
            design.provenance.file,
            rounded(mean),
            100.0 * *met as f64 / all as f64,
            design.trace.max_interactions,
        )
    });
    let turned = counter.scattered.iter().zip(media).filter_map(|(count, name)| {
        let mean = *count as f64 / PROBED as f64;
        (mean > MANY_SCATTERINGS).then(|| {
            format!(
                "{}: {name:?} scatters a path some {} times, so that a trace takes long; paths are given up after {} scatterings (100 trace.max_interactions)",
                design.provenance.file,
                rounded(mean),
                100 * u64::from(design.trace.max_interactions),
            )
        })
    });
    Ok(held.into_iter().chain(turned).collect())
}

/// Warnings on the places of sources.
fn of_sources(design: &Design) -> Vec<String> {
    let led = design.led.at(design.led.place(0));
    let sources = design.sources.iter().enumerate();
    let lit: Vec<(String, Source)> = sources
        .flat_map(|(k, source)| {
            let key = format!("sources[{}] {:?}", k + 1, source.name());
            // Sources without a place of their own stand on the box.
            let is_carried = source.stated.kind.place().is_none();
            source.emitters.iter().map(move |emitter| {
                let emitter = emitter.source.clone();
                (key.clone(), if is_carried { led.carry(emitter) } else { emitter })
            })
        })
        .collect();
    let mut said = Vec::new();
    let mut say = |words: String| {
        let words = format!("{}: {words}", design.provenance.file);
        if !said.contains(&words) {
            said.push(words);
        }
    };
    let bodies = bodies(design);
    for (key, source) in &lit {
        let Some(face) = face(source) else { continue };
        for (name, body) in &bodies {
            if let Some(over_mm) = hangs_over(&face, body) {
                say(format!(
                    "{key} hangs over the edge of {name} by {} mm; what it emits there starts beside that body",
                    shortest(over_mm)
                ));
            }
        }
    }
    for (k, (key, source)) in lit.iter().enumerate() {
        for (other_key, other) in &lit[..k] {
            if key != other_key && share_a_place(source, other) {
                let at = source.position.to_array().map(shortest).join(", ");
                say(format!("{other_key} and {key} emit from one place, about [{at}] mm"));
            }
        }
    }
    said
}

/// Boxes that sources may lie on: that of the LED where it stands level, and solids along the axes.
fn bodies(design: &Design) -> Vec<(String, Bounds)> {
    let mut bodies = Vec::new();
    let place: BoxPlace = design.led.place(0);
    if place.is_level() {
        let corners = design.led.at(place).corners(0.0);
        bodies.push(("the LED".to_owned(), Bounds::of_points(corners)));
    }
    bodies.extend(design.solids.iter().filter_map(|solid| {
        Some((format!("solid {:?}", solid.name()), solid.form.upright_box()?))
    }));
    bodies
}

/// The face of a source that emits from a rectangle along two axes.
fn face(source: &Source) -> Option<Face> {
    let Emitter::Rectangle { half_x, half_y } = source.emitter else {
        return None;
    };
    let (u, v) = source.axes();
    let half = (u * half_x).abs() + (v * half_y).abs();
    let along = [u, v, source.normal].iter().all(|d| d.abs().max_element() > 1.0 - 1e-12);
    let bounds = Bounds { low: source.position - half, high: source.position + half };
    along.then_some(Face { bounds, normal: source.normal })
}

/// Length by which `face` hangs over the side of a body on which it lies, if it lies on one.
fn hangs_over(face: &Face, body: &Bounds) -> Option<f64> {
    let axis = (0..3).find(|k| face.normal[*k].abs() > 0.5)?;
    let size = body.size().max_element();
    let plane = if face.normal[axis] > 0.0 { body.high[axis] } else { body.low[axis] };
    if (face.bounds.low[axis] - plane).abs() > ON * size {
        return None;
    }
    let mut over = 0.0_f64;
    for k in (0..3).filter(|k| *k != axis) {
        if face.bounds.high[k] <= body.low[k] || face.bounds.low[k] >= body.high[k] {
            return None;
        }
        over = over.max(body.low[k] - face.bounds.low[k]).max(face.bounds.high[k] - body.high[k]);
    }
    (over > OVER * size).then_some(over)
}

/// True if two sources emit from places that share more than an edge, in one direction. Rays of
/// files have places of their own.
fn share_a_place(a: &Source, b: &Source) -> bool {
    let rays = |s: &Source| matches!(s.emission, Emission::Rays(_));
    if rays(a) || rays(b) || a.normal.dot(b.normal) < 1.0 - 1e-9 {
        return false;
    }
    match (face(a), face(b)) {
        (Some(one), Some(two)) => {
            let size = one.bounds.union(two.bounds).size().max_element();
            let low = one.bounds.low.max(two.bounds.low);
            let shared = one.bounds.high.min(two.bounds.high) - low;
            (0..3).all(|k| {
                let across = one.normal[k].abs() > 0.5;
                if across { shared[k].abs() <= 1e-6 * size } else { shared[k] > OVER * size }
            })
        }
        (None, None) => (a.position - b.position).length() <= 1e-9 && a.emitter == b.emitter,
        _ => false,
    }
}
