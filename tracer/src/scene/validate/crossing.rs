// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks that the solids of a body do not cut each other.
//!
//! Along a straight line the region behind one surface must be the region before the next. Where it
//! is not, light would pass the second surface unseen. The check follows lines through random
//! points of the body, lines around every place where an edge of a box or a mesh passes through
//! another surface, and lines through what two balls share.
//!
//! Only closed solids are judged (boxes, meshes, whole spheres, closed bodies of revolution):
//! sheets may reach beyond what they end, and what is hidden in something opaque does no harm. Cuts
//! thinner than a millionth of the body do not count, so solids may touch.
//!
//! If a shape is placed among the others ([`Shape::Placed`]), all surfaces are judged, also
//! sheets with one medium on both sides. Two coincident faces are refused unless one of them is
//! opaque, because rounding would decide which comes first. Two opaque solids, one of them placed,
//! cut each other if a line passes through what each has alone and what both have.

use glam::DVec3;
use rand::Rng;

use super::overlap;
use crate::error::Error;
use crate::random;
use crate::ray::Ray;
use crate::scene::Lines;
use crate::scene::compiled::CompiledSurface;
use crate::shape::{Bounds, Reach, Shape, Sides};
use crate::surface::Region;

/// Lines through a body.
const LINES: usize = 1024;
/// Lines about a place where an edge passes through a surface, for each of the distances below.
const ABOUT: usize = 8;
/// Distances of such lines from the place, as shares of the size of the body.
const DISTANCES: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];
/// Most places about which lines are followed; of more, an even choice.
const PLACES: usize = 2048;
/// Lines for each solid, where shapes are placed among others.
const LINES_OF_EACH: usize = 256;
/// Largest distance of coincident faces relative to the size of the body: a tenth of the gap
/// between inset solids.
const SAME: f64 = 1e-10;
/// Smallest thickness of a cut relative to the size of the body.
const THICKNESS: f64 = 1e-6;

/// Surfaces in one frame, and the names of their media by number; the world's is the last.
pub(super) struct Space<'a> {
    pub surfaces: &'a [CompiledSurface],
    pub media: &'a [&'a str],
}

impl Space<'_> {
    /// The name of a region for messages.
    fn name(&self, region: Region) -> String {
        let named = match region {
            Region::World => self.media.last(),
            Region::Body(number) => self.media.get(usize::from(number)),
            Region::Opaque => None,
        };
        named.map_or_else(|| "something opaque".to_owned(), |name| (*name).to_owned())
    }

    /// True if one of its shapes was placed among the others.
    fn placed(&self) -> bool {
        self.surfaces.iter().any(|s| matches!(s.shape, Shape::Placed(_)))
    }
}

/// Checks that no two solids cut each other.
pub(super) fn check(space: &Space<'_>, lines: &Lines) -> Result<(), Error> {
    let surfaces = space.surfaces;
    let whole = space.placed();
    let solids: Vec<&CompiledSurface> = surfaces
        .iter()
        .filter(|s| solid(s) || (whole && matches!(s.shape, Shape::Placed(_))))
        .collect();
    let bounds = Bounds::union_of(surfaces.iter().map(|s| s.shape.bounds()));
    // Sheets cut no solid.
    if solids.is_empty() || surfaces.len() < 2 || !bounds.is_finite() {
        return Ok(());
    }
    let size = bounds.size().max_element();
    let search = CrossingSearch { space, lines, size, whole };
    let mut rng = random::stream(0x0c20_551e, 0);
    for number in 0..LINES {
        // Half of the lines through the whole body, the others through the solids in turn.
        let through =
            if number % 2 == 0 { bounds } else { solids[number / 2 % solids.len()].shape.bounds() };
        search.follow(point_in(&through, &mut rng), &mut rng)?;
    }
    if whole && LINES_OF_EACH * solids.len() > LINES {
        for solid in &solids {
            search.within(&solid.shape.bounds(), &mut rng)?;
        }
    }
    let places = search.places();
    for place in places.iter().step_by(places.len().div_ceil(PLACES).max(1)) {
        for distance in DISTANCES {
            for _ in 0..ABOUT {
                let aside = random::isotropic(&mut rng) * (distance * size);
                search.follow(*place + aside, &mut rng)?;
            }
        }
    }
    search.balls(&mut rng)
}

/// A point of a box.
fn point_in(bounds: &Bounds, rng: &mut impl Rng) -> DVec3 {
    let share = DVec3::new(random::unit(rng), random::unit(rng), random::unit(rng));
    bounds.low + share * bounds.size()
}

/// True if a surface is that of a closed solid.
fn solid(surface: &CompiledSurface) -> bool {
    surface.regions[0] != surface.regions[1] && surface.shape.closed()
}

/// The crossing of a line with a surface.
struct LineCrossing<'a> {
    distance: f64,
    surface: &'a CompiledSurface,
    /// The regions before and behind it.
    regions: [Region; 2],
    patch: u32,
    /// Cosine to the normal.
    cos: f64,
}

struct CrossingSearch<'a> {
    space: &'a Space<'a>,
    lines: &'a Lines,
    size: f64,
    /// True if all surfaces are judged, not only those of closed solids.
    whole: bool,
}

impl<'a> CrossingSearch<'a> {
    /// Follows lines through the overlap of any two balls: beside the line through their centres,
    /// where the overlap is thickest. On that line other shapes about the same axis may have no
    /// normal.
    fn balls(&self, rng: &mut impl Rng) -> Result<(), Error> {
        let balls: Vec<(DVec3, f64)> =
            self.space.surfaces.iter().filter_map(|s| s.shape.ball()).collect();
        for (k, &(centre, radius)) in balls.iter().enumerate() {
            for &(other, other_radius) in &balls[..k] {
                let distance = centre.distance(other);
                let shared = radius + other_radius - distance;
                let inside = distance <= (radius - other_radius).abs() + THICKNESS * self.size;
                if shared <= THICKNESS * self.size || inside {
                    continue;
                }
                let along = (centre - other) / distance;
                // At this distance at most a fifth of the thickness is lost.
                let aside = (0.2 * shared * radius.min(other_radius)).sqrt();
                for _ in 0..ABOUT {
                    let beside = random::isotropic(rng).cross(along) * aside;
                    self.along(other + beside, along)?;
                }
            }
        }
        Ok(())
    }

    /// Follows lines through points of the box of a solid, as far as the box reaches: of many solids
    /// few are in it.
    fn within(&self, bounds: &Bounds, rng: &mut impl Rng) -> Result<(), Error> {
        let bounds = bounds.padded(THICKNESS * self.size);
        let near = self.space.surfaces.iter().filter(|s| s.shape.bounds().overlaps(&bounds));
        let near: Vec<&CompiledSurface> = near.collect();
        for _ in 0..LINES_OF_EACH {
            let direction = random::isotropic(rng);
            let through = point_in(&bounds, rng);
            let ray = Ray { origin: through - direction * (4.0 * self.size), direction };
            let Some([from, to]) = bounds.span(ray.origin, direction.recip(), Reach::AHEAD) else {
                continue;
            };
            let met = self.crossings(&near, &ray, Reach { from, to });
            self.judge(&met, &ray, None)?;
        }
        Ok(())
    }

    /// All crossings of a ray with these surfaces, in order.
    fn crossings(
        &self,
        surfaces: &[&'a CompiledSurface],
        ray: &Ray,
        within: Reach,
    ) -> Vec<LineCrossing<'a>> {
        let mut all = Vec::new();
        for &surface in surfaces {
            let mut reach = within;
            while let Some(hit) = surface.shape.intersect(ray, reach, Sides::Both) {
                let (_, normal) = surface.shape.settle(ray.at(hit.distance), hit.primitive);
                let (before, behind) = (hit.side.index(), hit.side.opposite().index());
                all.push(LineCrossing {
                    distance: hit.distance,
                    surface,
                    regions: [surface.regions[before], surface.regions[behind]],
                    patch: surface.shape.patch(hit.primitive),
                    cos: normal.dot(ray.direction).abs(),
                });
                // Rounding may give the same crossing again.
                reach.from = hit.distance + 1e-12 * self.size;
            }
        }
        all.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        all
    }

    /// Follows the line through a point in a random direction.
    fn follow(&self, through: DVec3, rng: &mut impl Rng) -> Result<(), Error> {
        self.along(through, random::isotropic(rng))
    }

    /// Refuses two opaque solids, one of them placed, that cut each other on a line with these
    /// crossings.
    fn opaque_apart(&self, met: &[LineCrossing<'a>], ray: &Ray) -> Result<(), Error> {
        let mut opaque: Vec<&CompiledSurface> = Vec::new();
        for meeting in met {
            let surface = meeting.surface;
            let known = opaque.iter().any(|other| std::ptr::eq(*other, surface));
            if !known && solid(surface) && surface.regions[0] == Region::Opaque {
                opaque.push(surface);
            }
        }
        for (k, b) in opaque.iter().enumerate() {
            for a in &opaque[..k] {
                let placed = |s: &CompiledSurface| matches!(s.shape, Shape::Placed(_));
                if let Some(at) =
                    (placed(a) || placed(b)).then(|| self.common(met, [a, b], ray)).flatten()
                {
                    let name = |s: &CompiledSurface| self.lines.surfaces[s.patches[0].line].clone();
                    let region = self.space.name(Region::Opaque);
                    return Err(Error::Crossing {
                        first: name(b),
                        second: name(a),
                        at_mm: at.to_array(),
                        regions: Box::new([region.clone(), region]),
                        depth_mm: overlap::depth(&a.shape, &b.shape),
                    });
                }
            }
        }
        Ok(())
    }

    /// A point within both solids, if the line passes through both and through each alone, all
    /// stretches thicker than a cut.
    fn common(
        &self,
        met: &[LineCrossing<'a>],
        pair: [&CompiledSurface; 2],
        ray: &Ray,
    ) -> Option<DVec3> {
        let (mut within, mut seen) = ([false; 2], [false; 4]);
        let (mut before, mut at): (Option<&LineCrossing<'a>>, _) = (None, None);
        for meeting in met {
            let Some(which) = pair.iter().position(|s| std::ptr::eq(*s, meeting.surface)) else {
                continue;
            };
            if let Some(before) = before {
                let length = meeting.distance - before.distance;
                if length * before.cos.min(meeting.cos) > THICKNESS * self.size {
                    seen[usize::from(within[0]) + 2 * usize::from(within[1])] = true;
                    if within == [true; 2] {
                        at = Some(ray.at(before.distance + 0.5 * length));
                    }
                }
            }
            within[which] = meeting.regions[1] == Region::Opaque;
            before = Some(meeting);
        }
        at.filter(|_| seen[1] && seen[2])
    }

    /// Follows the line through a point in this direction.
    fn along(&self, through: DVec3, direction: DVec3) -> Result<(), Error> {
        let ray = Ray { origin: through - direction * (4.0 * self.size), direction };
        let surfaces: Vec<&CompiledSurface> = self.space.surfaces.iter().collect();
        let met = self.crossings(&surfaces, &ray, Reach::AHEAD);
        let borders_world = surfaces.iter().any(|s| s.regions.contains(&Region::World));
        let outside = if borders_world { Region::World } else { Region::Opaque };
        self.judge(&met, &ray, Some(outside))
    }

    /// Judges the crossings of a line that begins in `outside`, or anywhere.
    fn judge(
        &self,
        met: &[LineCrossing<'a>],
        ray: &Ray,
        outside: Option<Region>,
    ) -> Result<(), Error> {
        if self.whole {
            self.opaque_apart(met, ray)?;
        }
        // Crossings closer together than a cut have no order.
        let apart = |a: &LineCrossing<'_>, b: &LineCrossing<'_>| {
            (b.distance - a.distance) * a.cos.min(b.cos) > THICKNESS * self.size
        };
        let clusters: Vec<&[LineCrossing<'a>]> = met.chunk_by(|a, b| !apart(a, b)).collect();
        let mut before: Option<&[LineCrossing<'a>]> = None;
        for cluster in clusters {
            let behind: Vec<Region> = match before {
                Some(before) => before.iter().map(|met| met.regions[1]).collect(),
                None => outside.into_iter().collect(),
            };
            let opaque = |region: &Region| *region == Region::Opaque;
            let fits = behind.is_empty()
                || behind.iter().any(opaque)
                || cluster.iter().any(|met| {
                    let front = met.regions[0];
                    opaque(&front) || behind.contains(&front)
                });
            let counts = |met: &LineCrossing<'_>| self.whole || solid(met.surface);
            let judged =
                cluster.iter().all(counts) && before.is_none_or(|before| before.iter().all(counts));
            if self.whole {
                self.told_apart(cluster, ray)?;
            }
            if !fits && judged {
                let at = ray.at(cluster[0].distance);
                return Err(self.refusal(
                    before.map(|all| &all[all.len() - 1]),
                    &cluster[0],
                    behind[0],
                    at,
                ));
            }
            before = Some(cluster);
        }
        Ok(())
    }

    /// Refuses coincident faces, and faces so close that their order is wrong.
    fn told_apart(&self, cluster: &[LineCrossing<'a>], ray: &Ray) -> Result<(), Error> {
        let opaque = |met: &LineCrossing<'_>| met.regions.contains(&Region::Opaque);
        if cluster.iter().any(opaque) {
            return Ok(());
        }
        for pair in cluster.windows(2) {
            let [a, b] = pair else { continue };
            let gap = (b.distance - a.distance) * a.cos.min(b.cos);
            let one = std::ptr::eq(a.surface, b.surface);
            // A grazing line decides nothing.
            if one || a.cos.min(b.cos) < 1e-2 {
                continue;
            }
            if gap < SAME * self.size || a.regions[1] != b.regions[0] {
                let at = ray.at(a.distance);
                return Err(self.refusal(Some(a), b, a.regions[1], at));
            }
        }
        Ok(())
    }

    /// The error for a surface met from `region`, behind `before`, which it does not border.
    fn refusal(
        &self,
        before: Option<&LineCrossing<'a>>,
        met: &LineCrossing<'a>,
        region: Region,
        at: DVec3,
    ) -> Error {
        let name = |surface: &CompiledSurface, patch: u32| {
            self.lines.surfaces[surface.patches[patch as usize].line].clone()
        };
        let regions = [met.regions[0], region].map(|region| self.space.name(region));
        // Without a crossing before, the surface that should lie between the two regions.
        let between = || {
            let surfaces = self.space.surfaces.iter();
            let borders = |s: &&CompiledSurface| {
                !std::ptr::eq(*s, met.surface) && s.regions.contains(&region)
            };
            let both =
                surfaces.clone().filter(borders).find(|s| s.regions.contains(&met.regions[0]));
            both.or_else(|| surfaces.clone().find(borders))
        };
        // Before a placed shape the line may have met something else that lies in it.
        let told = match before {
            Some(before) if !self.whole => Some((before.surface, before.patch)),
            Some(before) => Some(between().map_or((before.surface, before.patch), |s| (s, 0))),
            None => between().map(|surface| (surface, 0)),
        };
        let depth = |other: &CompiledSurface| {
            let both = solid(met.surface) && solid(other) && !std::ptr::eq(other, met.surface);
            both.then(|| overlap::depth(&met.surface.shape, &other.shape)).flatten()
        };
        // What another body displaces is open there, and has the box around it.
        let of_boxes = |other: &CompiledSurface| {
            let differ = |s: &CompiledSurface| s.regions[0] != s.regions[1];
            let both = differ(met.surface) && differ(other) && !std::ptr::eq(other, met.surface);
            both.then(|| overlap::depth_of_boxes(&met.surface.shape, &other.shape)).flatten()
        };
        let (mut other, mut depth_mm) = (told, told.and_then(|(surface, _)| depth(surface)));
        // The line may have passed through a solid that the one met does not overlap.
        if depth_mm.is_none() && told.is_none_or(|(surface, _)| solid(surface)) {
            let surfaces = self.space.surfaces.iter();
            let deep = surfaces.filter_map(|surface| Some((surface, depth(surface)?)));
            if let Some((surface, deepest)) = deep.max_by(|a, b| a.1.0.total_cmp(&b.1.0)) {
                (other, depth_mm) = (Some((surface, 0)), Some(deepest));
            }
        }
        let depth_mm = depth_mm.or_else(|| other.and_then(|(surface, _)| of_boxes(surface)));
        Error::Crossing {
            first: name(met.surface, met.patch),
            second: other.map_or_else(|| self.space.name(region), |(s, patch)| name(s, patch)),
            at_mm: at.to_array(),
            regions: Box::new(regions),
            depth_mm,
        }
    }

    /// Points where edges of boxes and meshes pass through other surfaces.
    fn places(&self) -> Vec<DVec3> {
        let mut places = Vec::new();
        for (number, surface) in self.space.surfaces.iter().enumerate() {
            let others = self.space.surfaces.iter().enumerate();
            let bounds = surface.shape.bounds();
            let near = |s: &CompiledSurface| s.shape.bounds().overlaps(&bounds);
            let others: Vec<&CompiledSurface> =
                others.filter(|(k, s)| *k != number && near(s)).map(|(_, s)| s).collect();
            let mut try_edge = |[from, to]: [DVec3; 2]| {
                let length = from.distance(to);
                let ray = Ray { origin: from, direction: (to - from) / length };
                let reach = Reach { from: 0.0, to: length };
                for other in &others {
                    if let Some(hit) = other.shape.intersect(&ray, reach, Sides::Both) {
                        places.push(ray.at(hit.distance));
                    }
                }
            };
            match &surface.shape {
                Shape::Cuboid(cuboid) => cuboid.edges().into_iter().for_each(&mut try_edge),
                Shape::Mesh(mesh) => mesh.edges().for_each(&mut try_edge),
                Shape::Placed(placed) => placed.edges().into_iter().for_each(&mut try_edge),
                _ => {}
            }
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_of_a_box_are_twelve() {
        let Shape::Cuboid(cuboid) =
            Shape::cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)).expect("a box")
        else {
            panic!("a box");
        };
        let edges = cuboid.edges();
        let total: f64 = edges.iter().map(|[a, b]| a.distance(*b)).sum();
        assert_eq!((edges.len(), total), (12, 24.0));
    }
}
