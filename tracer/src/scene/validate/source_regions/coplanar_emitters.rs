// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks of emitters that lie in flat faces or reach through them, whatever share of their light
//! is concerned.
//!
//! An emitter in the plane of a face may not emit into the face where they share area. For an
//! emitter that crosses a face, rays that start just beside the cut on both sides, in the steepest
//! directions of its cone, must see the medium that the source names. Points, discs and rectangles
//! whose directions fill a cone are judged.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::{Misplacement, probe};
use crate::ray::Ray;
use crate::scene::{Body, CompiledSurface, Location, PlacedSource, Scene};
use crate::shape::{Bounds, Face, Reach, Sides};
use crate::source::{Emission, Emitter, Source};
use crate::surface::Region;

/// Corners of the polygon that stands for a disc; two of them lie farthest along the normal of the
/// face.
const CORNERS: usize = 64;
/// Points along a cut.
const PLACES: usize = 17;
/// Distance of starts from a cut, and of test points from corners, relative to the size of the
/// emitter.
const BESIDE: f64 = 1e-6;
/// Smallest cosine of light that goes into a face: far above rounding.
const INTO: f64 = 1e-9;
/// Distance of test directions from the edge of the cone, rad: a ray along a face decides nothing.
const DRAWN_IN: f64 = 1e-3;
/// Distance from a sheet within which an emitter lies in it, in offsets of a ray's start: a ten
/// millionth of the scene.
const SHEET: f64 = 1e5;
/// Most instances that are all compared with every source of the world.
const NEIGHBOURS: usize = 1000;

/// The directions of a source.
struct Cone {
    axis: DVec3,
    /// rad
    half_angle: f64,
}

impl Cone {
    /// The cone of a source, if its directions fill one.
    fn from_source(source: &Source) -> Option<Self> {
        let about_normal = |half_angle: f64| Self { axis: source.normal, half_angle };
        if matches!(source.emitter, Emitter::Enclosure { .. }) {
            return None;
        }
        match source.emission {
            Emission::Lambertian { half_angle_deg } if half_angle_deg < 90.0 => {
                Some(about_normal(half_angle_deg.to_radians()))
            }
            Emission::Lambertian { .. } | Emission::CosinePower { .. } => {
                Some(about_normal(FRAC_PI_2))
            }
            Emission::Isotropic => Some(about_normal(PI)),
            Emission::Beam { direction } => {
                Some(Self { axis: direction.normalize(), half_angle: 0.0 })
            }
            Emission::Table(_) | Emission::Rays(_) => None,
        }
    }

    /// The direction nearest to a unit vector, `less` from the edge of the cone.
    fn towards(&self, wanted: DVec3, less: f64) -> DVec3 {
        let max = (self.half_angle - less).max(0.0);
        if self.axis.angle_between(wanted) <= max {
            return wanted;
        }
        let aside = wanted - self.axis * wanted.dot(self.axis);
        let aside = aside.try_normalize().unwrap_or_else(|| self.axis.any_orthonormal_vector());
        self.axis * max.cos() + aside * max.sin()
    }
}

/// The corners of an emitter; those of a disc lie farthest along `normal` and against it.
fn outline(source: &Source, normal: DVec3) -> Vec<DVec3> {
    let (u, v) = source.axes();
    let at = |x: f64, y: f64| source.position + u * x + v * y;
    match source.emitter {
        Emitter::Rectangle { half_x, half_y } => {
            vec![at(-half_x, -half_y), at(half_x, -half_y), at(half_x, half_y), at(-half_x, half_y)]
        }
        Emitter::Disc { radius } => {
            let first = normal.dot(v).atan2(normal.dot(u));
            let corner = |k: usize| {
                let (sin, cos) = (first + TAU * k as f64 / CORNERS as f64).sin_cos();
                at(radius * cos, radius * sin)
            };
            (0..CORNERS).map(corner).collect()
        }
        Emitter::Point | Emitter::Enclosure { .. } => vec![source.position],
    }
}

/// Largest distance of a point from a corner.
fn farthest(corners: &[DVec3], from: DVec3) -> f64 {
    let distances = corners.iter().map(|corner| corner.distance(from));
    distances.fold(0.0, f64::max)
}

/// The box around the starts of a source, with some slack.
pub(super) fn around(scene: &Scene, source: &Source) -> Bounds {
    let starts = match (&source.emission, source.emitter) {
        (Emission::Rays(set), _) => set.starts().moved(source.position),
        (_, Emitter::Enclosure { radius }) => Bounds::of_points([source.position]).padded(radius),
        _ => Bounds::of_points(outline(source, DVec3::Z)),
    };
    starts.padded(1e-2 * 0.5 * starts.size().length() + tolerance(scene))
}

/// Distance within which an emitter lies in a face.
fn tolerance(scene: &Scene) -> f64 {
    4.0 * scene.offset()
}

/// Distance within which an emitter lies in a sheet: sheets on the ground are lifted off it.
fn near(scene: &Scene) -> f64 {
    SHEET * scene.offset()
}

/// Judges a source against the flat faces around it.
pub(super) fn check(scene: &Scene, placed: &PlacedSource) -> Result<(), Misplacement> {
    let Some(cone) = Cone::from_source(&placed.source) else {
        return Ok(());
    };
    let judged = Judged { scene, placed, cone };
    let around = match placed.location {
        Location::Inside { instance, .. } => scene.body(instance),
        Location::World => &scene.ground,
    };
    judged.beside(around, DVec3::ZERO, true)?;
    if !scene.meets_other_bodies(placed.location) {
        return Ok(());
    }
    let list = &scene.instances.list;
    let near: Vec<u32> = if list.len() <= NEIGHBOURS {
        (0..list.len() as u32).collect()
    } else {
        // An instance comes before the array solids.
        placed.instance.into_iter().chain(scene.array_solids).collect()
    };
    for number in near {
        let body = scene.body(number);
        if !std::ptr::eq(body, around) {
            judged.beside(body, list[number as usize].position, false)?;
        }
    }
    Ok(())
}

/// A source to be judged.
struct Judged<'a> {
    scene: &'a Scene,
    placed: &'a PlacedSource,
    cone: Cone,
}

impl Judged<'_> {
    /// Judges it against a body at `at`: the one in which it lies (`own`) or another one.
    fn beside(&self, body: &Body, at: DVec3, own: bool) -> Result<(), Misplacement> {
        let around = around(self.scene, &self.placed.source).moved(-at).padded(near(self.scene));
        for surface in &body.surfaces {
            if surface.shape.bounds().overlaps(&around) {
                for face in surface.shape.faces() {
                    self.against(surface, &face, at, own)?;
                }
            }
        }
        Ok(())
    }

    /// Judges it against a face of a body at `at`.
    fn against(
        &self,
        surface: &CompiledSurface,
        face: &Face,
        at: DVec3,
        own: bool,
    ) -> Result<(), Misplacement> {
        let mut corners = outline(&self.placed.source, face.normal);
        for corner in &mut corners {
            *corner -= at;
        }
        let height = |p: DVec3| (p - face.point).dot(face.normal);
        let heights = corners.iter().map(|corner| height(*corner));
        let (low, high) = heights
            .fold((f64::INFINITY, f64::NEG_INFINITY), |all, one| (all.0.min(one), all.1.max(one)));
        let is_sheet = surface.regions[0] == surface.regions[1];
        let reach = if is_sheet { near(self.scene) } else { tolerance(self.scene) };
        if low.abs().max(high.abs()) <= reach {
            return self.within(surface, face, (&corners, reach), own);
        }
        if low > -tolerance(self.scene) || high < tolerance(self.scene) {
            return Ok(());
        }
        // The cut of the plane with the emitter.
        let mut cut = Vec::new();
        for (k, from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            let (a, b) = (height(*from), height(to));
            if (a >= 0.0) != (b >= 0.0) {
                cut.push(*from + (to - *from) * (a / (a - b)));
            }
        }
        let [from, to] = cut[..] else { return Ok(()) };
        let Some([from, to]) = face.clipped([from, to]) else {
            return Ok(());
        };
        let emitter = self.placed.source.normal;
        let rise = (face.normal - emitter * face.normal.dot(emitter)).normalize_or_zero();
        let middle = self.placed.source.position - at;
        let aside = rise * (BESIDE * farthest(&corners, middle));
        // Off all symmetries, so that no ray runs into a corner.
        let steepest = (face.normal + DVec3::new(3.7e-5, 6.1e-5, 7.1e-5)).normalize();
        let directions = [steepest, -steepest].map(|n| self.cone.towards(n, DRAWN_IN));
        for place in 0..PLACES {
            let share = (place as f64 + 0.5) / PLACES as f64;
            for start in [aside, -aside].map(|aside| from + (to - from) * share + aside + at) {
                for direction in directions {
                    let exact = Ray { origin: start, direction };
                    let off = self.scene.offset() * direction.dot(emitter).signum();
                    let ray = Ray { origin: start + emitter * off, direction };
                    probe(self.scene, self.placed, &exact, &ray)?;
                }
            }
        }
        Ok(())
    }

    /// Judges it in the plane of a face, to `reach`: it may not emit into the area that it shares with
    /// it.
    fn within(
        &self,
        surface: &CompiledSurface,
        face: &Face,
        (corners, reach): (&[DVec3], f64),
        own: bool,
    ) -> Result<(), Misplacement> {
        let claimed = self.placed.source.region;
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        // n points from the inner side, the first one, to the outer.
        for (region, from) in surface.regions.into_iter().zip([-face.normal, face.normal]) {
            let there = region == claimed || (!own && region == Region::World);
            if !there || self.cone.towards(-from, 0.0).dot(from) >= -INTO {
                continue;
            }
            let pulled = corners.iter().map(|c| *c + (middle - *c) * BESIDE);
            let mut points = pulled.chain([middle]).chain(face.shared(corners));
            let slack = 4.0 * reach;
            let patch = points.find_map(|point| {
                let ray = Ray { origin: point + face.normal * slack, direction: -face.normal };
                let reach = Reach { from: 0.0, to: 2.0 * slack };
                let met = surface.shape.intersect(&ray, reach, Sides::Both)?;
                Some(surface.shape.patch(met.primitive))
            });
            if let Some(patch) = patch {
                return Err(Misplacement::Into(surface.patches[patch as usize].line));
            }
        }
        Ok(())
    }
}
