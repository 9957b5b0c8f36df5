// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a design may say by mistake, for `check` and `run`: sources that hang over the edge of what
//! they lie on, sources in one place, and bodies that hold the light.

use anyhow::Result;
use tracer::glam::DVec3;
use tracer::shape::Bounds;
use tracer::{
    Emission, Emitter, Interaction, Observer, Sampling, Settings, Source, trace_observed,
};

use design::Design;
use design::resolved::led::BoxPlace;
use metrics::digits::shortest;

use super::dome_surface::dome_surface;
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

/// Warnings on `design`, in words.
///
/// # Errors
/// A scene that cannot be built.
pub fn warnings(design: &Design) -> Result<Vec<String>> {
    let mut said = of_sources(design);
    said.extend(held_light(design)?);
    Ok(said)
}

/// Surfaces met by the paths of a probe, by ledger line.
struct Counter(Vec<u64>);

impl Observer for Counter {
    fn meets(&mut self, met: &Interaction) {
        self.0[met.line] += 1;
    }
}

/// The body that holds the paths, where they meet many surfaces.
fn held_light(design: &Design) -> Result<Option<String>> {
    let surface = dome_surface(design, Model::Geometric, None)?;
    let scene = scene::build(design, &surface)?;
    let names = &scene.lines().surfaces;
    let mut counter = Counter(vec![0; names.len()]);
    let settings = Settings { sampling: Sampling::Random, ..scene::settings(design, PROBED, 1) };
    trace_observed(&scene, &settings, |ray| ray, &mut counter)?;
    let all: u64 = counter.0.iter().sum();
    let mean = all as f64 / PROBED as f64;
    let most = counter.0.iter().zip(names).max_by_key(|(met, _)| **met);
    let held = most.filter(|_| mean > MANY).map(|(met, name)| {
        format!(
            "{}: {name:?} holds the light: a path meets some {} surfaces, {:.0} % of them of {name:?}, so that a trace takes long; some ten are usual, and paths are given up after {} (trace.max_interactions)",
            design.provenance.file,
            shortest(format!("{mean:.1e}").parse().unwrap_or(mean)),
            100.0 * *met as f64 / all as f64,
            design.trace.max_interactions,
        )
    });
    Ok(held)
}

/// Warnings on the places of sources.
fn of_sources(design: &Design) -> Vec<String> {
    let lit: Vec<(String, &Source)> = design
        .sources
        .iter()
        .enumerate()
        .flat_map(|(k, source)| {
            let key = format!("sources[{}] {:?}", k + 1, source.name());
            source.emitters.iter().map(move |emitter| (key.clone(), &emitter.source))
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
