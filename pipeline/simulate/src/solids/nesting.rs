// SPDX-License-Identifier: MIT OR Apache-2.0
//! Nesting of solids: which lies in which.
//!
//! It finds the surroundings and the depth of every shape, and the surroundings of the dome and the
//! LED's box.

use tracer::glam::DVec3;
use tracer::package::SILICONE;
use tracer::shape::{Reach, Sides};
use tracer::{Prototype, Ray, Region, Shape, Surface, random};

/// Random lines through a shape whose hits give its points.
const LINES: usize = 160;
/// Depth of the points below a surface, as a share of the chord there or of the size of a sheet.
const DEEP: f64 = 1e-6;
/// Share of the points that must agree; the others may lie on an edge.
const MAJORITY: f64 = 0.98;

/// A solid or a sheet.
pub(super) struct NestedObject {
    pub shape: Shape,
    pub sheet: bool,
    /// True of a sheet that lies on the bottom, and of a solid in optical contact with it.
    pub on_bottom: bool,
    /// Region within it.
    pub inner: Region,
}

/// The place of an object among the others.
#[derive(Debug, Clone, Copy)]
pub(super) struct NestedPlace {
    /// Region around it.
    pub outer: Region,
    /// Number of others that hold it.
    pub depth: usize,
}

/// An object in the wrong place, and the other object that it conflicts with.
#[derive(Debug)]
pub(super) struct NestingError {
    pub object: usize,
    pub with: Option<usize>,
    pub expected: &'static str,
}

/// Places of all objects, and the regions around the dome and the box.
pub(super) struct Nesting {
    pub places: Vec<NestedPlace>,
    /// Of every object, the others that hold it.
    pub holders: Vec<Vec<usize>>,
    pub about_dome: Region,
    pub about_box: Region,
}

impl Nesting {
    /// Finds the places of `objects` within each other and within the body.
    pub fn new(objects: &[NestedObject], body: &Prototype) -> Result<Self, NestingError> {
        let points: Vec<ProbePoints> = objects.iter().map(ProbePoints::from_object).collect();
        // A sheet on the bottom lies below the gap of the solids that stand there.
        let may_hold = |holder: usize, held: usize| {
            let is_below = objects[held].sheet && objects[held].on_bottom;
            holder != held && !objects[holder].sheet && (!is_below || objects[holder].on_bottom)
        };
        let holds = |holder: usize, held: usize| {
            may_hold(holder, held) && points[held].are_in(&objects[holder].shape)
        };
        let holders: Vec<Vec<usize>> = (0..objects.len())
            .map(|held| (0..objects.len()).filter(|h| holds(*h, held)).collect())
            .collect();
        for (object, holding) in holders.iter().enumerate() {
            if let Some(other) = holding.iter().find(|other| holders[**other].contains(&object)) {
                let (object, other) = (object.max(*other), object.min(*other));
                return Err(NestingError {
                    object,
                    with: Some(other),
                    expected: "a place of its own, not that of",
                });
            }
        }
        for (object, of) in points.iter().enumerate() {
            let is_below = objects[object].sheet && objects[object].on_bottom;
            let is_cut_by = |other: &usize| {
                may_hold(*other, object)
                    && !holders[object].contains(other)
                    && of.points.iter().any(|point| objects[*other].shape.holds(*point))
            };
            if let Some(other) = (0..objects.len()).find(|other| is_below && is_cut_by(other)) {
                return Err(NestingError {
                    object,
                    with: Some(other),
                    expected: "a sheet wholly within or wholly beside the foot of",
                });
            }
            let wet = of.points.iter().filter(|point| body.region_at(**point) == SILICONE).count();
            if is_below && wet > 0 && !of.lie_in_silicone(body) {
                let expected = "a sheet wholly within or wholly beside the dome";
                return Err(NestingError { object, with: None, expected });
            }
            of.clear_of(body).map_err(|expected| NestingError { object, with: None, expected })?;
        }
        let in_dome: Vec<bool> = points.iter().map(|of| of.lie_in_silicone(body)).collect();
        let holding = |outside: &[DVec3]| -> Vec<usize> {
            (0..objects.len())
                .filter(|k| !objects[*k].sheet && all_in(outside, &objects[*k].shape))
                .collect()
        };
        let dome = outside(body, is_skin);
        let about_dome = holding(&dome);
        let about_box = holding(&outside(body, is_box));

        // The innermost of several holders lies in most of the others.
        let depth_of = |object: usize| holders[object].len() + usize::from(in_dome[object]);
        let innermost = |within: &[usize], domed: bool| {
            let deepest = within.iter().copied().max_by_key(|object| depth_of(*object));
            match deepest {
                Some(object) if !domed || depth_of(object) > about_dome.len() => {
                    (objects[object].inner, Some(object))
                }
                _ if domed => (SILICONE, None),
                _ => (Region::World, None),
            }
        };
        let mut places = Vec::new();
        for object in 0..objects.len() {
            let (outer, with) = innermost(&holders[object], in_dome[object]);
            if outer == Region::Opaque {
                let expected = "a place that light can reach, not one within the opaque";
                return Err(NestingError { object, with, expected });
            }
            places.push(NestedPlace { outer, depth: depth_of(object) });
        }
        let domed = !dome.is_empty();
        let [around_dome, around_box] =
            [innermost(&about_dome, false), innermost(&about_box, domed)];
        for (region, object) in [around_dome, around_box] {
            if let (Region::Opaque, Some(object)) = (region, object) {
                return Err(NestingError {
                    object,
                    with: None,
                    expected: "an opaque solid that does not hold the dome or the LED's box",
                });
            }
        }
        Ok(Self { places, holders, about_dome: around_dome.0, about_box: around_box.0 })
    }

    /// Sets the outer regions of the body's surfaces.
    pub fn surround(&self, body: &mut Prototype) {
        for surface in &mut body.surfaces {
            if is_skin(surface) {
                surface.outer = self.about_dome;
            } else if is_box(surface) {
                surface.outer = self.about_box;
            }
        }
    }
}

/// True if a surface is one between silicone and air.
fn is_skin(surface: &Surface) -> bool {
    surface.inner == SILICONE && surface.outer == Region::World
}

/// True if a surface is that of the LED's box.
pub(super) fn is_box(surface: &Surface) -> bool {
    surface.inner == Region::Opaque && matches!(surface.shape, Shape::Cuboid(_))
}

const WHOLE: Reach = Reach { from: 0.0, to: f64::INFINITY };

fn majority(points: &[DVec3], holds: impl Fn(DVec3) -> bool) -> bool {
    let count = points.iter().filter(|point| holds(**point)).count();
    !points.is_empty() && count as f64 >= MAJORITY * points.len() as f64
}

pub(super) fn all_in(points: &[DVec3], shape: &Shape) -> bool {
    majority(points, |point| shape.holds(point))
}

/// Hits of random lines through the box around a shape: each line, with distances and pieces.
pub(super) fn lines(shape: &Shape) -> impl Iterator<Item = (Ray, Vec<(f64, u32)>)> {
    let mut rng = random::stream(0x5011_d5ee, 0);
    let around = shape.bounds();
    let size = around.size().length();
    let shape = shape.clone();
    (0..LINES).map(move |_| {
        let part =
            DVec3::new(random::unit(&mut rng), random::unit(&mut rng), random::unit(&mut rng));
        let direction = random::isotropic(&mut rng);
        let through = around.low + part * around.size();
        let line = Ray { origin: through - direction * (2.0 * size), direction };
        let (mut reach, mut met) = (WHOLE, Vec::new());
        while let Some(hit) = shape.intersect(&line, reach, Sides::Both) {
            met.push((hit.distance, hit.primitive));
            reach.from = hit.distance + 1e-12 * size;
        }
        (line, met)
    })
}

/// Points just outside of the surfaces of a body that are `wanted`, above the bottom.
fn outside(body: &Prototype, wanted: impl Fn(&Surface) -> bool) -> Vec<DVec3> {
    let mut points = Vec::new();
    for surface in body.surfaces.iter().filter(|s| wanted(s)) {
        let off = DEEP * surface.shape.bounds().size().length();
        for (line, met) in lines(&surface.shape) {
            for (distance, piece) in met {
                let (at, normal) = surface.shape.settle(line.at(distance), piece);
                let point = at + normal * off;
                // Whatever stands on the bottom, below it lies no medium.
                if point.z > 10.0 * off {
                    points.push(point);
                }
            }
        }
    }
    points
}

/// Points just outside of a package: of its surfaces to the air, above the bottom.
pub(super) fn around(body: &Prototype) -> Vec<DVec3> {
    outside(body, |s| s.outer == Region::World && s.shape.bounds().high.is_finite())
}

/// Points just within a solid, or on both sides of a sheet.
struct ProbePoints {
    points: Vec<DVec3>,
    /// Of a sheet, those on the other side, in the same order; none of one on the bottom.
    beyond: Vec<DVec3>,
}

impl ProbePoints {
    fn from_object(object: &NestedObject) -> Self {
        let (mut points, mut beyond) = (Vec::new(), Vec::new());
        let off = DEEP * object.shape.bounds().size().length();
        for (line, met) in lines(&object.shape) {
            if object.sheet {
                for (distance, piece) in met {
                    let (at, normal) = object.shape.settle(line.at(distance), piece);
                    let sides = [at + normal * off, at - normal * off];
                    if object.on_bottom {
                        // Below it lies no medium.
                        points.extend(sides.into_iter().filter(|side| side.z > at.z));
                    } else {
                        points.push(sides[0]);
                        beyond.push(sides[1]);
                    }
                }
                continue;
            }
            for pair in met.chunks_exact(2) {
                let [from, to] = [pair[0].0, pair[1].0];
                let chord = to - from;
                points.push(line.at(from + DEEP * chord));
                points.push(line.at(to - DEEP * chord));
            }
        }
        Self { points, beyond }
    }

    fn are_in(&self, shape: &Shape) -> bool {
        all_in(&self.points, shape) && (self.beyond.is_empty() || all_in(&self.beyond, shape))
    }

    fn lie_in_silicone(&self, body: &Prototype) -> bool {
        // The points of an object that holds the LED's box say nothing where they lie within it.
        let seen = self.points.iter().map(|point| body.region_at(*point));
        let seen: Vec<Region> = seen.filter(|seen| *seen != Region::Opaque).collect();
        let silicone = seen.iter().filter(|seen| **seen == SILICONE);
        !body.media.is_empty()
            && !seen.is_empty()
            && silicone.count() as f64 >= MAJORITY * seen.len() as f64
    }

    /// Refuses objects within the box, and sheets in a surface of the body.
    fn clear_of(&self, body: &Prototype) -> Result<(), &'static str> {
        if majority(&self.points, |point| body.region_at(point) == Region::Opaque) {
            return Err("a place outside of the LED's box");
        }
        let pairs = self.points.iter().zip(&self.beyond);
        let split = pairs.filter(|(a, b)| body.region_at(**a) != body.region_at(**b));
        if !self.beyond.is_empty()
            && split.count() as f64 > (1.0 - MAJORITY) * self.points.len() as f64
        {
            return Err("a sheet that does not lie in another surface: leave a gap of 0.001 mm");
        }
        Ok(())
    }
}
