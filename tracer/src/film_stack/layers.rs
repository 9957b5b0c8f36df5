// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light on its way through films that have no ends: the walker of [`crate::path`] where the next
//! surface is known, the face above or the face below.
//!
//! Spaces are counted upwards: the air below as 0, then films, and the air between those that are not
//! in contact. Face k lies between space k and space k + 1.

use bsdf::Side;
use glam::{DVec2, DVec3};

use super::backward::{Backwards, Excitations};
use super::cells::Turn;
use super::part::{Course, Exit, FilmOutcome};
use super::traveller::Traveller;
use crate::ledger::Loss;
use crate::optics::fresnel::refract;
use crate::optics::luminescence::Luminophore;
use crate::optics::polarisation::Light;
use crate::path::{Flight, Tracer};
use crate::random::PathStream;
use crate::ray::Ray;
use crate::receiver::{PathHistory, Tally};
use crate::scatter::scatter;
use crate::scene::{CompiledMedium, CompiledPatch, CompiledSurface, Hit, Scene};
use crate::surface::{Region, SurfaceModel};

/// Components of a direction that differ by less are equal.
pub(super) const SAME: f64 = 1e-9;
/// Faces of a box and a plane, by primitive and patch.
const BOTTOM: (u32, u32) = (4, 2);
const TOP: (u32, u32) = (5, 1);
const PLANE: (u32, u32) = (0, 0);

/// A face between two spaces.
struct Face<'a> {
    surface: &'a CompiledSurface,
    primitive: u32,
    patch: &'a CompiledPatch,
    normal: DVec3,
    /// Height, mm.
    z: f64,
}

impl<'a> Face<'a> {
    fn new(
        surface: &'a CompiledSurface,
        (primitive, patch): (u32, u32),
        normal: DVec3,
        z: f64,
    ) -> Self {
        Self { surface, primitive, patch: &surface.patches[patch as usize], normal, z }
    }
}

/// A film, or air.
struct Space<'a> {
    medium: &'a CompiledMedium,
    /// The number of the gap, of air over a film.
    gap: Option<usize>,
}

/// The films of a stack at one wavelength.
pub(super) struct Layers<'a> {
    spaces: Vec<Space<'a>>,
    faces: Vec<Face<'a>>,
    films: usize,
}

/// A rectangle about the origin that ends films, seen from where light meets the stack.
#[derive(Clone, Copy)]
pub(super) struct Ends<'t> {
    /// Where the light meets the stack.
    pub from: DVec2,
    /// From the frame of the light to that of the rectangle.
    pub turn: &'t Turn,
    /// Half the lengths, mm; infinite where nothing ends.
    pub half_mm: DVec2,
}

impl Ends<'_> {
    /// Distance at which light comes to the end.
    fn ahead(&self, at: DVec3, direction: DVec3) -> f64 {
        let at = self.from + self.turn.apply(at).truncate();
        let direction = self.turn.apply(direction).truncate();
        let ends = self.half_mm * direction.signum();
        let distances =
            DVec2::select(direction.cmpeq(DVec2::ZERO), DVec2::INFINITY, (ends - at) / direction);
        distances.min_element().max(0.0)
    }
}

impl<'a> Layers<'a> {
    /// The films of a scene that has nothing else: boxes, the lowest first, and planes between those in
    /// contact.
    pub fn new(scene: &'a Scene) -> Self {
        let body = &scene.bodies[0];
        let (films, contacts): (Vec<_>, Vec<_>) =
            body.surfaces.iter().partition(|surface| surface.regions[1] == Region::World);
        let air = |gap: Option<usize>| Space { medium: &scene.world, gap };
        let (mut spaces, mut faces): (Vec<Space<'_>>, Vec<Face<'_>>) =
            (vec![air(None)], Vec::new());
        for (number, (film, medium)) in films.iter().zip(&body.media).enumerate() {
            let (low, high) = (film.shape.bounds().low.z, film.shape.bounds().high.z);
            let contact = contacts.iter().find(|contact| {
                let below = number.checked_sub(1).map(|below| films[below].regions[0]);
                let joins = |region: Region| contact.regions.contains(&region);
                below.is_some_and(joins) && joins(film.regions[0])
            });
            if let Some(contact) = contact {
                spaces.pop();
                faces.pop();
                let is_of_film = contact.regions[0] == film.regions[0];
                let normal = if is_of_film { DVec3::NEG_Z } else { DVec3::Z };
                faces.push(Face::new(contact, PLANE, normal, low));
            } else {
                faces.push(Face::new(film, BOTTOM, DVec3::NEG_Z, low));
            }
            spaces.push(Space { medium, gap: None });
            faces.push(Face::new(film, TOP, DVec3::Z, high));
            spaces.push(air(Some(number)));
        }
        Self { spaces, faces, films: films.len() }
    }

    /// The outer face that light along `direction` meets, where that is smooth without layers, with its
    /// reflectance for unpolarised light and the direction behind it; `None` of both where all light is
    /// reflected.
    pub fn smooth_outer_face(&self, direction: DVec3) -> Option<(usize, Option<(f64, DVec3)>)> {
        let number = if direction.z < 0.0 { self.faces.len() - 1 } else { 0 };
        let Face { surface, patch, normal, .. } = &self.faces[number];
        let [inner, outer] = surface.indices;
        let is_smooth = matches!(patch.optics, SurfaceModel::Interface);
        is_smooth.then(|| (number, refract(direction, *normal, outer, inner)))
    }

    /// Heights between which light in a space lies, mm, and the film that the space is, the lowest 0.
    pub fn space(&self, number: usize) -> ([f64; 2], Option<u8>) {
        let is_film = |space: &&Space<'_>| space.gap.is_none();
        let below = self.spaces[1..=number].iter().filter(is_film).count();
        let film = is_film(&&self.spaces[number]).then(|| below as u8 - 1);
        ([number - 1, number].map(|face| self.faces[face].z), film)
    }

    /// Line of the uppermost face in the ledger of the films.
    pub fn top_line(&self) -> u32 {
        self.faces[self.faces.len() - 1].patch.line as u32
    }

    /// True if light on the reversed path has the same share at every face.
    pub fn are_reciprocal(&self) -> bool {
        self.faces.iter().all(|face| face.patch.optics.is_reciprocal())
    }

    /// The luminophores of a space.
    fn luminophores(&self, space: usize) -> &[(Luminophore, usize)] {
        let collisions = self.spaces[space].medium.collisions.as_ref();
        collisions.map_or(&[], |collisions| collisions.luminophores())
    }

    /// Refractive index of a space.
    fn index(&self, space: usize) -> f64 {
        self.spaces[space].medium.index
    }

    /// Where conversion comes from in films at each of these wavelengths, nm.
    pub fn excitations(films: &[Self], wavelengths_nm: &[f64]) -> Excitations {
        let of = |space: usize, emitted: usize| -> Vec<f64> {
            let mut sum = 0.0;
            let sums = films.iter().zip(wavelengths_nm).map(|(own, nm)| {
                let dense = (own.index(space) / films[emitted].index(space)).powi(2);
                let shift = nm / wavelengths_nm[emitted] * dense;
                let rates = own.luminophores(space).iter().map(|(luminophore, _)| {
                    luminophore.absorption_per_mm * luminophore.yields(emitted, shift)
                });
                sum += rates.sum::<f64>();
                sum
            });
            let sums: Vec<f64> = sums.collect();
            if sum > 0.0 { sums } else { Vec::new() }
        };
        let count = wavelengths_nm.len();
        let spaces = films.first().map_or(0, |films| films.spaces.len());
        let sums = (0..spaces).flat_map(|space| (0..count).map(move |emitted| (space, emitted)));
        Excitations::new(count, sums.map(|(space, emitted)| of(space, emitted)).collect())
    }

    /// Number of films but one: of gaps, with those that contact closes.
    pub fn gaps(&self) -> usize {
        self.films - 1
    }
}

/// Films at all wavelengths, with what books light on its way through them.
pub(super) struct LayerWalk<'s, 't, 'a> {
    pub layers: &'s [Layers<'a>],
    pub tracers: &'s [Tracer<'a>],
    pub tallies: &'s mut [Tally<'t>],
    /// Light that passed each gap upwards and downwards, at each wavelength.
    pub passed: &'s mut [Vec<[f64; 2]>],
    /// Wavelengths that light has had, each once.
    pub had: Vec<u16>,
    /// What ends the films.
    pub ends: Option<Ends<'s>>,
    /// Light that has come there.
    pub ended: Option<Traveller>,
    /// Of light traced backwards, what it needs beside.
    pub backwards: Option<Backwards<'s>>,
}

/// True of light on `ray` that leaves as it came, along `direction`, moved in its plane of incidence
/// alone.
fn is_straight(direction: DVec3, ray: &Traveller, sign: f64) -> bool {
    let place = ray.at.truncate();
    // Facets may restore a direction and move light aside.
    let aside = place.perp_dot(direction.truncate()).abs();
    let off = ray.direction - direction * DVec3::new(1.0, 1.0, sign);
    aside <= SAME * (1.0 + place.length()) && off.abs().max_element() < SAME
}

impl<'s, 't, 'a> LayerWalk<'s, 't, 'a> {
    /// Through films of these layers and tracers at each wavelength, with sums of what light leaves in
    /// them and of what passes their gaps.
    pub fn new(
        (layers, tracers): (&'s [Layers<'a>], &'s [Tracer<'a>]),
        (tallies, passed): (&'s mut [Tally<'t>], &'s mut [Vec<[f64; 2]>]),
    ) -> Self {
        let (had, ends, ended, backwards) = (Vec::new(), None, None, None);
        Self { layers, tracers, tallies, passed, had, ends, ended, backwards }
    }

    /// Follows a ray of weight 1 that meets an outer face at x = y = 0 until it leaves, is absorbed or
    /// comes to an end of the films. A ray that `enters` is not reflected at a smooth outer face.
    pub fn follow<L: Light>(
        &mut self,
        (direction, enters): (DVec3, bool),
        wavelength: u16,
        light: &mut L,
        rng: &mut PathStream,
    ) -> FilmOutcome {
        let (mut ray, face) = self.arrive(direction, wavelength);
        let has_entered = enters && self.enter(&mut ray, rng);
        let is_out = self.go(&mut ray, (face, has_entered), light, rng);
        let course = match is_out {
            false => Course::Ended,
            true if is_straight(direction, &ray, 1.0) => Course::Through,
            true if is_straight(direction, &ray, -1.0) => Course::Mirrored,
            true => Course::Turned,
        };
        let sin = direction.truncate().length();
        let exit = Exit { direction: ray.direction, place: ray.at.truncate(), sin };
        let weight = if is_out { ray.weight } else { 0.0 };
        let mut outcome = FilmOutcome::new(&exit, weight, ray.wavelength, course);
        (outcome.bounces, outcome.line) = (ray.history.bounces, ray.history.line);
        outcome.reach = ray.reach2.sqrt() as f32;
        outcome
    }

    /// Follows a ray backwards, against `leaving` from the uppermost face at x = y = 0; shows where it
    /// leaves below in another direction, with where it has been and its polarisation, and likewise light
    /// that excites what it was.
    pub fn follow_back<L: Light>(
        &mut self,
        (leaving, wavelength, excitations, has_ends): (DVec3, u16, &'s Excitations, bool),
        rng: &mut PathStream,
        mut show: impl FnMut(Traveller, &[DVec2], &L),
    ) {
        self.had.push(wavelength);
        let mut backwards = Some(Backwards::new(excitations, has_ends));
        let (mut ray, mut face) = self.arrive(-leaving, wavelength);
        let mut light = L::default();
        let mut has_entered = false;
        // A smooth face lets pass as much light on both ways.
        if let Some((_, Some((reflectance, _)))) =
            self.layers[usize::from(wavelength)].smooth_outer_face(-leaving)
            && !L::CARRIED
        {
            has_entered = self.enter(&mut ray, rng);
            ray.weight *= 1.0 - reflectance;
        }
        loop {
            self.backwards = backwards.take();
            let is_out = self.go(&mut ray, (face, has_entered), &mut light, rng);
            backwards = self.backwards.take();
            let Some(own) = &mut backwards else { return };
            if !self.had.contains(&ray.wavelength) {
                self.had.push(ray.wavelength);
            }
            if is_out && ray.space == 0 && !is_straight(-leaving, &ray, 1.0) {
                show(ray, &own.trail, &light);
            }
            let Some((excites, trail)) = own.waiting.pop() else { return };
            (ray, own.trail) = (excites, trail);
            (light, face, has_entered) = (L::default(), 0, true);
        }
    }

    /// A ray of weight 1 that meets an outer face at x = y = 0, and the number of the face.
    fn arrive(&self, direction: DVec3, wavelength: u16) -> (Traveller, usize) {
        let faces = self.layers[0].faces.len();
        let (face, space) = if direction.z < 0.0 { (faces - 1, faces) } else { (0, 0) };
        let at = DVec3::new(0.0, 0.0, self.layers[0].faces[face].z);
        let history = PathHistory::new(0);
        let ray = Traveller {
            at,
            direction,
            space,
            weight: 1.0,
            scatterings: 0,
            wavelength,
            history,
            reach2: 0.0,
        };
        (ray, face)
    }

    /// Follows a ray at a face, or one that `has_entered` a space on its way on, until it leaves; false if
    /// it ends before.
    fn go<L: Light>(
        &mut self,
        ray: &mut Traveller,
        (mut face, mut has_entered): (usize, bool),
        light: &mut L,
        rng: &mut PathStream,
    ) -> bool {
        loop {
            if !std::mem::take(&mut has_entered) && self.meet(ray, face, light, rng).is_none() {
                return false;
            }
            if ray.space == 0 || ray.space == self.layers[0].faces.len() {
                return true;
            }
            match self.travel(ray, light, rng) {
                Some(next) => face = next,
                None => return false,
            }
        }
    }

    /// Takes light from outside across an outer face, if that is smooth.
    fn enter(&mut self, ray: &mut Traveller, rng: &mut PathStream) -> bool {
        let wavelength = usize::from(ray.wavelength);
        let layers = &self.layers[wavelength];
        let Some((number, Some((_, direction)))) = layers.smooth_outer_face(ray.direction) else {
            return false;
        };
        let Face { patch, .. } = layers.faces[number];
        let (tracer, tally) = (&self.tracers[wavelength], &mut self.tallies[wavelength]);
        let sides = [Side::Outer, Side::Inner];
        tracer.settle(patch.line, sides, 1.0, &mut ray.weight, rng, tally);
        ray.history.bounces += 1;
        ray.history.line = patch.line as u32;
        ray.direction = direction;
        ray.space = if direction.z < 0.0 { number } else { number + 1 };
        true
    }

    /// Takes light across or back from a face; `None` where it ends.
    #[inline]
    fn meet<L: Light>(
        &mut self,
        ray: &mut Traveller,
        face: usize,
        light: &mut L,
        rng: &mut PathStream,
    ) -> Option<()> {
        let number = usize::from(ray.wavelength);
        let (layers, tracer) = (&self.layers[number], &self.tracers[number]);
        let tally = &mut self.tallies[number];
        if ray.history.bounces >= tracer.max_bounces {
            tally.lose(Loss::Bounces, ray.weight);
            return None;
        }
        let Face { surface, primitive, patch, normal, .. } = layers.faces[face];
        let side = if ray.direction.z * normal.z < 0.0 { Side::Outer } else { Side::Inner };
        let CompiledPatch { optics, line } = patch;
        let hit = Hit { distance: 0.0, surface, primitive, side, instance: Some(0) };
        let event = scatter(&hit, optics, ray.direction, ray.at, normal, light, rng);
        let sides = [side, event.side];
        tracer.settle(*line, sides, event.efficiency, &mut ray.weight, rng, tally);
        ray.history.bounces += 1;
        ray.history.line = *line as u32;
        if ray.weight == 0.0 {
            return None;
        }
        if !event.sound(normal) {
            tally.lose(Loss::Invalid, ray.weight);
            return None;
        }
        ray.direction = event.direction;
        let is_above = (normal.z > 0.0) == (event.side == Side::Outer);
        ray.space = face + usize::from(is_above);
        Some(())
    }

    /// Takes light to the next face; `None` where it ends on the way.
    #[inline]
    fn travel<L: Light>(
        &mut self,
        ray: &mut Traveller,
        light: &mut L,
        rng: &mut PathStream,
    ) -> Option<usize> {
        loop {
            let number = usize::from(ray.wavelength);
            let (layers, tracer) = (&self.layers[number], &self.tracers[number]);
            let tally = &mut self.tallies[number];
            let Space { medium, gap } = layers.spaces[ray.space];
            let rises = ray.direction.z > 0.0;
            let face = if rises { ray.space } else { ray.space - 1 };
            let length = (layers.faces[face].z - ray.at.z) / ray.direction.z;
            if !length.is_finite() {
                tally.lose(Loss::Leak, ray.weight);
                return None;
            }
            let to_end = self.ends.map_or(f64::INFINITY, |ends| ends.ahead(ray.at, ray.direction));
            let (length, is_end) = (length.min(to_end), to_end < length);
            let way = Ray { origin: ray.at, direction: ray.direction };
            let before = *ray;
            if let Some(collisions) = &medium.collisions {
                let power = (&mut ray.weight, &mut ray.scatterings);
                let turned = match tracer.fly(medium, collisions, (&way, length), power, rng, tally)
                {
                    Flight::Free => None,
                    Flight::Lost => return None,
                    Flight::Absorbed(length) => {
                        ray.reach(way.at(length));
                        if let Some(backwards) = &mut self.backwards {
                            backwards.excite(&before, length, medium.absorption, rng);
                        }
                        return None;
                    }
                    Flight::Scattered(turned) => Some(turned),
                    Flight::Converted(turned, wavelength) => {
                        if let Some(backwards) = &mut self.backwards {
                            let length = (turned.origin - way.origin).length();
                            backwards.excite(&before, length, medium.absorption, rng);
                            return None;
                        }
                        ray.wavelength = wavelength;
                        if !self.had.contains(&wavelength) {
                            self.had.push(wavelength);
                        }
                        Some(turned)
                    }
                };
                if let Some(Ray { origin, direction }) = turned {
                    if let Some(backwards) = &mut self.backwards {
                        let length = (origin - way.origin).length();
                        backwards.excite(&before, length, medium.absorption, rng);
                        backwards.visit(origin);
                    }
                    light.depolarise();
                    (ray.at, ray.direction) = (origin, direction);
                    ray.reach(origin);
                    continue;
                }
            }
            // Before chance may end the light: a ray to an end has come to it whatever lies beyond.
            ray.reach(way.at(length));
            if let Some(backwards) = &mut self.backwards {
                backwards.excite(&before, length, medium.absorption, rng);
                backwards.visit(way.at(length));
            }
            if medium.absorption > 0.0 {
                let transmittance = (-medium.absorption * length).exp();
                tracer.transmit(medium.line, transmittance, &mut ray.weight, rng, tally);
                if ray.weight == 0.0 {
                    return None;
                }
            }
            // Planes are read below films: light that falls has passed before it comes to an end.
            if let Some(gap) = gap.filter(|_| !(is_end && rises)) {
                self.passed[number][gap][usize::from(!rises)] += ray.weight;
            }
            ray.at = way.at(length);
            if is_end {
                self.ended = Some(*ray);
                return None;
            }
            ray.at.z = layers.faces[face].z;
            return Some(face);
        }
    }
}
