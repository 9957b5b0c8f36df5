// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rectangles that lie in a face, or in what emits.
//!
//! Light that ends at a face, is turned back there or begins there has no order with a rectangle in
//! the same place: whether it counts would be left to rounding, or to how far starts are moved off
//! surfaces. Faces that are drawn in ([`crate::shape::Placement`]) stand apart from a rectangle
//! where they are stated, by a gap far above both, in which it counts what comes to them and what
//! leaves them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;

use super::rectangle::DetectorRectangle;
use crate::error::Error;
use crate::scene::{Body, Location, Scene};
use crate::shape::{Facet, Window};
use crate::source::{Emission, Emitter, Source};
use crate::surface::Region;

/// Largest distance, in units of [`Scene::offset`], at which a rectangle and a face are in one
/// plane: a tenth of what placed faces are drawn in by.
const SAME: f64 = 100.0;

impl DetectorRectangle {
    /// Refuses a scene in which something emits in the rectangle, or has a flat face in its plane
    /// that it shares area with.
    pub(super) fn stands_alone(&self, name: &str, scene: &Scene) -> Result<(), Error> {
        let bounds = self.bounds();
        let window = Window {
            bounds,
            axis: self.normal_axis(),
            within: SAME * scene.offset() + 4.0 * f64::EPSILON * bounds.farthest(),
        };
        let mut seen = HashMap::new();
        for placed in scene.sources.iter().filter(|s| s.location == Location::World) {
            if placed.source.weight > 0.0 && emits_in(&window, &placed.source, &mut seen) {
                return Err(Error::ReceiverInSource {
                    receiver: name.to_owned(),
                    source_name: placed.source.name.clone(),
                    apart_mm: window.within,
                });
            }
        }
        let array_solids = scene.array_solids().map(|body| (body, DVec3::ZERO));
        let ground = (&scene.ground, DVec3::ZERO);
        for (body, position) in scene.packages().chain(array_solids).chain([ground]) {
            if let Some(line) = face_in(&window.from(position), body) {
                return Err(Error::ReceiverInFace {
                    receiver: name.to_owned(),
                    surface: scene.lines.surfaces[line].clone(),
                    apart_mm: window.within,
                });
            }
        }
        Ok(())
    }
}

/// The line of a part that borders the world and shares area with the window.
fn face_in(window: &Window, body: &Body) -> Option<usize> {
    let mut found = None;
    let to_world = |s: &&crate::scene::CompiledSurface| s.regions.contains(&Region::World);
    for surface in body.surfaces.iter().filter(to_world) {
        if !window.meets(&surface.shape.bounds()) {
            continue;
        }
        surface.shape.facets(window, &mut |patch, facet| {
            if found.is_none() && window.overlaps(&facet) {
                found = Some(surface.patches[patch as usize].line);
            }
        });
    }
    found
}

/// True if some ray of a set (by its address) begins in the plane of a window, when its source
/// stands at a height (its bits) over that plane.
type Levels = HashMap<(usize, u64), bool>;

/// True if light of a source begins in the window.
fn emits_in(window: &Window, source: &Source, levels: &mut Levels) -> bool {
    let at = source.position;
    if let Emission::Rays(rays) = &source.emission {
        let mut starts = (0..rays.len()).map(|number| rays.ray(number).origin + at);
        let key = (Arc::as_ptr(rays) as usize, at[window.axis].to_bits());
        let mut level = || {
            let any = || starts.clone().any(|start| window.level(start));
            *levels.entry(key).or_insert_with(any)
        };
        return window.meets(&rays.starts().moved(at))
            && level()
            && starts.any(|start| window.holds(start));
    }
    let facet = match source.emitter {
        Emitter::Point => return window.holds(at),
        Emitter::Enclosure { .. } => return false,
        Emitter::Disc { radius } => {
            Facet::Ring { centre: at, normal: source.normal, inner: 0.0, outer: radius }
        }
        Emitter::Rectangle { half_x, half_y } => {
            let (u, v) = source.axes();
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            Facet::Polygon(corners.map(|(x, y)| at + u * (x * half_x) + v * (y * half_y)).to_vec())
        }
    };
    window.overlaps(&facet)
}
