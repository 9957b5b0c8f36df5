// SPDX-License-Identifier: MIT OR Apache-2.0
//! Optical contact of solids with each other, and narrow gaps where there is none.
//!
//! Of two solids in contact one displaces the other: the opaque one, or the one that is named. Its
//! surface borders the other where that lies beside it; the surface of the other ends there. So
//! faces that touch, and bodies that overlap, have one surface between them and no gap.

use anyhow::Result;
use tracer::glam::DVec3;
use tracer::shape::{Clip, Reach, Sides};
use tracer::{Prototype, Ray, Region, Shape};

use design::ConfigError;
use design::resolved::solids::CheckedSolid;
use metrics::digits::shortest;

use super::nesting::{NestedObject, Nesting, lines};
use super::{Placing, contact_refused};

/// Distance of faces that count as touching, mm: far below the wavelength.
const TOUCHING_MM: f64 = 1e-5;
/// Width below which a gap is listed, mm.
pub const NARROW_MM: f64 = 0.05;
/// Least share of the points of a surface beside which another lies, for a gap to be one.
const BESIDE: f64 = 0.02;

/// For every solid, those that displace it.
pub(super) struct Displacement(Vec<Vec<usize>>);

/// A part of the surface of a solid, and what lies on its outer side.
pub(super) struct Part {
    pub outer: Region,
    /// The number of the solid there, if it is in contact.
    pub with: Option<usize>,
    pub clips: Vec<Clip>,
}

impl Displacement {
    /// Contacts that `own` state, of solids that are no part of each other.
    ///
    /// # Errors
    /// A solid that does not touch the one that it names.
    pub fn new(
        placing: &Placing<'_>,
        own: &[&CheckedSolid],
        objects: &[NestedObject],
        nest: &Nesting,
    ) -> Result<Self> {
        let mut displacers = vec![Vec::new(); own.len()];
        for (held, solid) in own.iter().enumerate() {
            let stated = &solid.stated.shared.optical_contact;
            for (other, named) in own.iter().enumerate() {
                let nested =
                    nest.holders[held].contains(&other) || nest.holders[other].contains(&held);
                let one_of_both = other == held || nested || objects[other].sheet;
                if one_of_both || !stated.include(named.name()) {
                    continue;
                }
                let gap_mm = nearest([held, other].map(|k| &objects[k].shape));
                if gap_mm.is_none_or(|gap| gap > TOUCHING_MM) {
                    if !stated.names(named.name()) {
                        continue;
                    }
                    return Err(apart(placing, solid, named, gap_mm).into());
                }
                let known: [&Vec<usize>; 2] = [&displacers[held], &displacers[other]];
                if !known[0].contains(&other) && !known[1].contains(&held) {
                    displacers[held].push(other);
                }
            }
        }
        Ok(Self(displacers))
    }

    /// Parts of the surface of a solid that has `outer` around it where it touches nothing.
    pub fn parts(
        &self,
        solid: usize,
        objects: &[NestedObject],
        outer: Region,
        inset_mm: f64,
    ) -> Vec<Part> {
        // Just beyond the gap of two faces that are drawn in, so that a face ends where the edge of
        // the other is, and as far as faces may be apart.
        let reaches_mm = [8.0 * inset_mm, TOUCHING_MM.max(8.0 * inset_mm)];
        let clip = |other: usize, keeps: bool| Clip {
            solid: objects[other].shape.clone(),
            keeps,
            reaches_mm: reaches_mm.to_vec(),
        };
        let displaced = (0..objects.len()).filter(|other| self.0[*other].contains(&solid));
        let displaced: Vec<usize> = displaced.collect();
        // The surface ends beside what displaces the solid, and within it.
        let end = |other: &usize| {
            let reaches_mm = [&[0.0], &reaches_mm[..]].concat();
            Clip { reaches_mm, ..clip(*other, false) }
        };
        let ended: Vec<Clip> = self.0[solid].iter().map(end).collect();
        let beyond = |count: usize| displaced[..count].iter().map(|other| clip(*other, false));
        let beside = displaced.iter().enumerate().map(|(k, other)| Part {
            outer: objects[*other].inner,
            with: Some(*other),
            clips: ended.iter().cloned().chain([clip(*other, true)]).chain(beyond(k)).collect(),
        });
        let clips = ended.iter().cloned().chain(beyond(displaced.len())).collect();
        beside.chain([Part { outer, with: None, clips }]).collect()
    }

    /// True if two solids are in contact.
    pub fn join(&self, a: usize, b: usize) -> bool {
        self.0[a].contains(&b) || self.0[b].contains(&a)
    }
}

/// The error of two solids that are to touch and do not.
fn apart(
    placing: &Placing<'_>,
    solid: &CheckedSolid,
    named: &CheckedSolid,
    gap_mm: Option<f64>,
) -> ConfigError {
    let gap = gap_mm.map_or("they stand apart".to_owned(), |gap| {
        format!("a gap of {} mm lies between them", shortest(gap))
    });
    let expected = format!(
        "solids that {:?} touches or overlaps, and {gap}: let it reach into {:?}, which displaces it there",
        solid.name(),
        named.name()
    );
    contact_refused(placing, solid, expected)
}

/// Points of the surface of a shape with their normals, outward of a closed one.
pub(crate) fn surface_points(shape: &Shape) -> Vec<(DVec3, DVec3)> {
    let mut points = Vec::new();
    for (line, met) in lines(shape) {
        for (distance, piece) in met {
            points.push(shape.settle(line.at(distance), piece));
        }
    }
    points
}

/// Distance of `other` from a point along the normal there, mm: 0 where it lies in `other`; `None`
/// where nothing of it lies ahead within `reach_mm`.
fn ahead(at: DVec3, normal: DVec3, other: &Shape, reach_mm: f64) -> Option<f64> {
    let ray = Ray { origin: at, direction: normal };
    let first = |to: f64| other.intersect(&ray, Reach { from: 0.0, to }, Sides::Outer);
    if other.closed() && other.holds(at + normal * TOUCHING_MM) {
        return Some(first(TOUCHING_MM).map_or(0.0, |hit| hit.distance));
    }
    first(reach_mm).map(|hit| hit.distance)
}

/// Least distance along a normal of `one` from `other` within `reach_mm`, if more than a few points
/// of its surface are so near.
pub(super) fn beside(one: &Shape, other: &Shape, reach_mm: f64) -> Option<f64> {
    if !one.bounds().padded(reach_mm).overlaps(&other.bounds()) {
        return None;
    }
    let points = surface_points(one);
    // A sheet has two sides.
    let sides: &[f64] = if one.closed() { &[1.0] } else { &[1.0, -1.0] };
    let near = points.iter().flat_map(|(at, normal)| {
        sides.iter().filter_map(|side| ahead(*at, *normal * *side, other, reach_mm))
    });
    let near: Vec<f64> = near.collect();
    let is_many = near.len() as f64 > BESIDE * points.len() as f64;
    near.into_iter().min_by(f64::total_cmp).filter(|_| is_many)
}

/// The same from the one to the other or back.
pub(super) fn gap(one: &Shape, other: &Shape, reach_mm: f64) -> Option<f64> {
    let back = || other.closed().then(|| beside(other, one, reach_mm)).flatten();
    let both = [beside(one, other, reach_mm), back()];
    both.into_iter().flatten().min_by(f64::total_cmp)
}

/// Least distance along a normal between the surfaces of two shapes, mm.
fn nearest(pair: [&Shape; 2]) -> Option<f64> {
    let of = |[one, other]: [&Shape; 2]| {
        let size = one.bounds().union(other.bounds()).size().length();
        let found = surface_points(one).into_iter();
        found.filter_map(|(at, normal)| ahead(at, normal, other, size)).min_by(f64::total_cmp)
    };
    [of(pair), of([pair[1], pair[0]])].into_iter().flatten().min_by(f64::total_cmp)
}

/// A narrow gap between two bodies.
pub(super) struct NarrowGap {
    pub names: [String; 2],
    /// Least width, mm; 0 where they touch.
    pub width_mm: f64,
    pub outer: Region,
}

/// Gaps narrower than `reach_mm` between solids, one of which light enters, and between them and the
/// LED's box.
pub(super) fn narrow_gaps(
    own: &[&CheckedSolid],
    objects: &[NestedObject],
    nest: &Nesting,
    joined: &Displacement,
    body: &Prototype,
    reach_mm: f64,
) -> Vec<NarrowGap> {
    let mut gaps = Vec::new();
    let entered = |k: usize| own[k].medium.is_some();
    for k in 0..own.len() {
        if objects[k].sheet {
            continue;
        }
        let outer = nest.places[k].outer;
        for other in 0..k {
            let nested = nest.holders[k].contains(&other) || nest.holders[other].contains(&k);
            // The design says how far films are apart.
            let is_stated = own[k].is_film() && own[other].is_film();
            let seen = entered(k) || entered(other);
            if nested || is_stated || !seen || objects[other].sheet || joined.join(k, other) {
                continue;
            }
            if let Some(width_mm) = gap(&objects[k].shape, &objects[other].shape, reach_mm) {
                let names = [other, k].map(|k| own[k].name().to_owned());
                gaps.push(NarrowGap { names, width_mm, outer });
            }
        }
        let boxes = body.surfaces.iter().filter(|s| super::nesting::is_box(s));
        for led in boxes.filter(|_| entered(k) && nest.about_box == outer) {
            if let Some(width_mm) = gap(&objects[k].shape, &led.shape, reach_mm) {
                let names = ["the LED".to_owned(), own[k].name().to_owned()];
                gaps.push(NarrowGap { names, width_mm, outer });
            }
        }
    }
    gaps
}
