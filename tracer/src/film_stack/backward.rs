// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light that receivers above the films see in a narrow cone, traced backwards from the cone.
//!
//! Of the light that meets a stack little leaves into such a cone, and of its outcomes as few do. By
//! reciprocity the films send to the direction ω of the cone what light that falls on them against ω
//! sends back: with f the distribution of the whole stack in air, displaced by d,
//!
//! f(ωi, ω; d) = f(-ω, -ωi; -d).
//!
//! So rays begin at the uppermost face against directions that fill the cone as diffuse light does, and
//! are followed down through the films. Each one that leaves below is a [`Sight`] for the cell of
//! incidence from which it seems to come: with N rays at each wavelength, of weights W where they leave,
//! α the half angle of the cone and C the number of cells, which hold equal shares of diffuse light, a ray
//! in a cell sends into the cone the share
//!
//! (C sin²α/N) Σ W over the sights of the cell.
//!
//! What passes straight is left to the outcomes of the table, which keep the direction of the ray itself.
//!
//! *Polarisation.* A ray traced backwards begins unpolarised, as a receiver weighs all light alike. With
//! (q', u', v') its Stokes parameters where it leaves, referred to the same direction s, light (q, u, v)
//! has 1 + qq' - uu' + vv' times the share of unpolarised light: reversed, p = s × k has the opposite sign.
//!
//! *Conversion.* Light of λ' at a place of a medium comes from light of λ that a luminophore absorbs
//! there, with the power Y e(λ') λ/λ' of that. So on its way backwards at λ' light gives rise to light at λ,
//! from any direction, a(λ) Y e(λ') (λ/λ') n(λ)²/n(λ')² for each mm. Here a is the absorption coefficient, Y
//! the yield, e the share of the photons and n the index of the medium, in which light from air fills n²
//! times less of all directions. A collision that excites a luminophore ends the way.

use glam::{DVec2, DVec3, Vec2, Vec3};
use rand::Rng;

use super::cells::Turn;
use super::part::PLENTY;
use super::traveller::Traveller;
use crate::optics::polarisation::Stokes;
use crate::random;

/// Weight of light that has been traced back through a conversion: a ray of white light behind quantum
/// dots gives rise to about two, each as useful as itself.
const CONVERTED: f64 = 0.2;

/// Light of a cell of incidence that leaves into the cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sight {
    /// Number of the ray traced backwards.
    start: u32,
    /// Cell of all wavelengths.
    slot: u32,
    /// Number of the wavelength with which it leaves.
    pub wavelength: u16,
    /// Surfaces met.
    pub bounces: u32,
    weight: f32,
    /// Direction against which the ray began, in the frame of the cell.
    direction: Vec3,
    /// Where light of the cell leaves above, from where it meets the stack below, mm.
    place: Vec2,
    /// Farthest that the ray has been from where it leaves below, mm.
    pub reach: f32,
    /// Stokes parameters of the ray traced backwards, and s.
    light: [Vec3; 2],
}

/// Where light has been, x and y, mm; last where it leaves below.
type Trail = Vec<DVec2>;

impl Sight {
    /// Words of a sight in a file.
    const WORDS: usize = 17;

    /// The sight of ray `start`, which began against `leaving` and has left below, where it seems to come
    /// from a cell with this turn.
    pub fn new(
        (start, slot, turn): (u32, u32, &Turn),
        (leaving, wavelength): (DVec3, u16),
        (ray, trail, light): (&Traveller, &[DVec2], Stokes),
    ) -> Self {
        let sign = if turn.mirrors() { -1.0 } else { 1.0 };
        let parameters = DVec3::new(light.q, sign * light.u, sign * light.v);
        let from = ray.at.truncate();
        let reach2 = trail.iter().map(|at| at.distance_squared(from)).fold(0.0, f64::max);
        Self {
            start,
            slot,
            wavelength,
            bounces: ray.history.bounces,
            weight: ray.weight as f32,
            direction: turn.undo(leaving).as_vec3(),
            place: turn.undo(-ray.at).truncate().as_vec2(),
            reach: reach2.sqrt() as f32,
            light: [parameters, turn.undo(light.s)].map(DVec3::as_vec3),
        }
    }

    pub fn direction(&self) -> DVec3 {
        self.direction.as_dvec3()
    }

    pub fn place(&self) -> DVec2 {
        self.place.as_dvec2()
    }

    pub fn light(&self) -> Stokes {
        let [parameters, s] = self.light.map(Vec3::as_dvec3);
        Stokes { q: parameters.x, u: parameters.y, v: parameters.z, s }
    }

    fn words(&self) -> [u32; Self::WORDS] {
        let [light, s] = self.light;
        let reals = [self.weight, self.reach].into_iter();
        let reals = reals.chain(self.direction.to_array()).chain(self.place.to_array());
        let reals = reals.chain(light.to_array()).chain(s.to_array());
        let mut words = [self.start, self.slot, self.wavelength.into(), self.bounces]
            .into_iter()
            .chain(reals.map(f32::to_bits));
        std::array::from_fn(|_| words.next().unwrap_or_default())
    }

    fn from_words(words: [u32; Self::WORDS]) -> Self {
        let real = |k: usize| f32::from_bits(words[k]);
        let vector = |k: usize| Vec3::new(real(k), real(k + 1), real(k + 2));
        Self {
            start: words[0],
            slot: words[1],
            wavelength: words[2] as u16,
            bounces: words[3],
            weight: real(4),
            reach: real(5),
            direction: vector(6),
            place: Vec2::new(real(9), real(10)),
            light: [vector(11), vector(14)],
        }
    }
}

/// Sights of a cell.
#[derive(Debug, Clone, Default)]
struct Cell {
    /// Their numbers.
    members: Vec<u32>,
    /// Sums of the weights up to each.
    sums: Vec<f64>,
}

/// The sights of one group of paths.
#[derive(Debug)]
pub(super) struct Sights {
    /// Those of all rays that have been followed, in their order.
    drawn: Vec<Sight>,
    /// Number of these rays.
    starts: u32,
    /// Sights that the run takes, the first ones.
    taken: usize,
    /// Rays at each wavelength from which they come.
    rounds: u32,
    /// Sine squared of the half angle of the cone that they fill.
    sin2: f64,
    cells: Vec<Cell>,
    pub has_grown: bool,
}

impl Sights {
    /// Without rays, of so many cells, for a cone of this sine squared of its half angle.
    pub fn new(cells: usize, sin2: f64) -> Self {
        let cells = vec![Cell::default(); cells];
        Self { drawn: Vec::new(), starts: 0, taken: 0, rounds: 0, sin2, cells, has_grown: false }
    }

    /// True if the run takes one more ray at each of so many wavelengths, as it has taken this number of
    /// outcomes.
    pub fn lags(&self, wavelengths: u32, outcomes: u32) -> bool {
        let rays = self.rounds * wavelengths;
        rays <= outcomes && rays < PLENTY
    }

    /// The number of the next rays, one at each of so many wavelengths, of which the first has this number,
    /// that are yet to be followed.
    pub fn lacking(&self, wavelengths: u32) -> std::ops::Range<u32> {
        let first = self.rounds * wavelengths;
        first.max(self.starts)..first + wavelengths
    }

    /// Keeps what the next ray has shown.
    pub fn put(&mut self, sights: Vec<Sight>) {
        self.drawn.extend(sights);
        self.starts += 1;
        self.has_grown = true;
    }

    /// Has the run take the next rays, one at each of so many wavelengths.
    pub fn take(&mut self, wavelengths: u32) {
        self.rounds += 1;
        let end = self.rounds * wavelengths;
        while let Some(sight) = self.drawn.get(self.taken).filter(|sight| sight.start < end) {
            let cell = &mut self.cells[sight.slot as usize];
            let sum = cell.sums.last().copied().unwrap_or_default();
            cell.sums.push(sum + f64::from(sight.weight));
            cell.members.push(self.taken as u32);
            self.taken += 1;
        }
    }

    /// A sight of a cell, as often as its weight says, and the mean weight of all of the cell for each
    /// ray at one wavelength; `None` where there are none.
    pub fn one(&self, cell: usize, rng: &mut impl Rng) -> Option<(Sight, f64)> {
        let Cell { members, sums } = &self.cells[cell];
        let whole = *sums.last()?;
        let pick = random::unit(rng) * whole;
        let turn = sums.partition_point(|sum| *sum <= pick).min(sums.len() - 1);
        Some((self.drawn[members[turn] as usize], whole / f64::from(self.rounds)))
    }

    /// All sights as bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let words = self.drawn.iter().flat_map(Sight::words);
        let words = std::iter::once(self.starts).chain(words).flat_map(u32::to_le_bytes);
        self.sin2.to_le_bytes().into_iter().chain(words).collect()
    }

    /// What [`Self::bytes`] made, of as many cells, the same cone and wavelengths below `wavelengths`; `None`
    /// of other bytes.
    pub fn from_bytes(bytes: &[u8], (cells, sin2): (usize, f64), wavelengths: u16) -> Option<Self> {
        let (of_cone, rest) = bytes.split_first_chunk()?;
        (f64::from_le_bytes(*of_cone).to_bits() == sin2.to_bits()).then_some(())?;
        let (words, rest) = rest.as_chunks::<4>();
        let mut words = words.iter().map(|word| u32::from_le_bytes(*word));
        let starts = words.next()?;
        let words: Vec<u32> = words.collect();
        let (sights, left) = words.as_chunks::<{ Sight::WORDS }>();
        let drawn: Vec<Sight> = sights.iter().map(|words| Sight::from_words(*words)).collect();
        let is_sound = |sight: &Sight| {
            sight.start < starts && (sight.slot as usize) < cells && sight.wavelength < wavelengths
        };
        let ascends = drawn.is_sorted_by_key(|sight| sight.start);
        (rest.is_empty() && left.is_empty() && ascends && drawn.iter().all(is_sound))
            .then(|| Self { drawn, starts, ..Self::new(cells, sin2) })
    }
}

/// Wavelengths from which conversion comes in the spaces of a stack.
#[derive(Debug)]
pub(super) struct Excitations {
    wavelengths: usize,
    /// For each space, for each wavelength of what is emitted: sums of the rates over the wavelengths of
    /// what excites, 1/mm. Empty without conversion.
    sums: Vec<Vec<f64>>,
}

impl Excitations {
    /// Sums for each space and each of so many wavelengths.
    pub fn new(wavelengths: usize, sums: Vec<Vec<f64>>) -> Self {
        Self { wavelengths, sums }
    }
}

/// What is known of a ray traced backwards beside its light.
pub(super) struct Backwards<'s> {
    excitations: &'s Excitations,
    /// Where the ray has been, if anything ends the films.
    pub trail: Trail,
    has_ends: bool,
    /// Light before conversions, which is yet to be followed.
    pub waiting: Vec<(Traveller, Trail)>,
}

impl<'s> Backwards<'s> {
    /// A ray that begins at x = y = 0.
    pub fn new(excitations: &'s Excitations, has_ends: bool) -> Self {
        Self { excitations, trail: vec![DVec2::ZERO], has_ends, waiting: Vec::new() }
    }

    /// Records where light has been.
    pub fn visit(&mut self, at: DVec3) {
        if self.has_ends {
            self.trail.push(at.truncate());
        }
    }

    /// Draws the light that excites what light on a flight of this length, mm, in a medium of this absorption
    /// coefficient comes from by conversion.
    pub fn excite(
        &mut self,
        ray: &Traveller,
        length: f64,
        absorption_per_mm: f64,
        rng: &mut impl Rng,
    ) {
        let number = ray.space * self.excitations.wavelengths + usize::from(ray.wavelength);
        let Some(sums) = self.excitations.sums.get(number).filter(|sums| !sums.is_empty()) else {
            return;
        };
        let whole = sums[sums.len() - 1];
        let expected = ray.weight * whole * length / CONVERTED;
        for _ in 0..(expected + random::unit(rng)) as u32 {
            let run = length * random::unit(rng);
            let pick = random::unit(rng) * whole;
            let wavelength = sums.partition_point(|sum| *sum <= pick).min(sums.len() - 1) as u16;
            let at = ray.at + run * ray.direction;
            let weight = CONVERTED * (-absorption_per_mm * run).exp();
            let direction = random::isotropic(rng);
            let scatterings = ray.scatterings.saturating_add(1);
            let mut trail = self.trail.clone();
            if self.has_ends {
                trail.push(at.truncate());
            }
            let excites = Traveller { at, direction, weight, scatterings, wavelength, ..*ray };
            self.waiting.push((excites, trail));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bsdf::{
        AxisShares, Outline, Polariser, Polygon, Relief, ReliefCell, ReliefLattice, ReliefShape,
        UnitCell,
    };
    use num_complex::Complex64;

    use super::super::cells::{Cells, StackSymmetry};
    use super::super::layers::{LayerWalk, Layers};
    use super::*;
    use crate::optics::luminescence::Luminophore;
    use crate::optics::phase::{PhaseFunction, Scattering};
    use crate::optics::polarisation::{Light, Unpolarised};
    use crate::path::Tracer;
    use crate::receiver::Tally;
    use crate::settings::Settings;
    use crate::statistics::{Estimate, Moments};
    use crate::{
        Emission, Emitter, Film, Layer, Medium, Patch, Prototype, Region, Scene, SceneBuilder,
        Shape, Source, Surface, SurfaceModel,
    };

    const NM: [f64; 3] = [450.0, 540.0, 620.0];
    const RAYS: usize = 5_000;
    const GROUPS: usize = 12;
    /// Sine squared of 20 degrees.
    const CONE: f64 = 0.117;

    /// One film above the other, each of a medium and of the optics below and above.
    fn films(all: &[(Medium, SurfaceModel, SurfaceModel)]) -> Scene {
        let mut body = Prototype::default();
        for (number, (medium, below, above)) in all.iter().enumerate() {
            let low = 0.6 * number as f64;
            let corner = |sign: f64, z: f64| DVec3::new(sign * 1e4, sign * 1e4, z);
            let shape = Shape::cuboid(corner(-1.0, low), corner(1.0, low + 0.5)).expect("a film");
            let optics = (0..3).map(|patch| match patch {
                1 => above,
                2 => below,
                _ => &SurfaceModel::Interface,
            });
            let patches = optics.map(|optics| Patch::new("film", optics.clone())).collect();
            body.media.push(medium.clone());
            let inside = Region::Body(number as u8);
            body.surfaces.push(Surface::zoned(shape, inside, Region::World, patches));
        }
        let mut scene = SceneBuilder::new(Medium::air());
        let body = scene.prototype(body);
        let lamp = Source::new(
            "lamp",
            DVec3::new(0.0, 0.0, -1.0),
            Region::World,
            Emitter::Point,
            Emission::Isotropic,
        );
        scene.source(lamp).place(body, DVec3::ZERO).build().expect("films")
    }

    /// A medium that scatters, absorbs a little, and converts blue light.
    fn dots(number: usize) -> Medium {
        let absorption = [3.0, 0.8, 0.0][number];
        let emission = [0.0, 0.7, 0.3];
        let green = Luminophore::new("green", absorption, 0.9, &emission).expect("a luminophore");
        let phase = PhaseFunction::HenyeyGreenstein(0.6);
        Medium {
            absorption_per_mm: 0.05,
            scattering: Some(Scattering { per_mm: 1.5, phase }),
            luminophores: vec![green],
            ..Medium::clear("dots", [1.7, 1.5, 1.45][number])
        }
    }

    fn prisms(angle: f64) -> SurfaceModel {
        let outline = Outline {
            period: 1.0,
            depth: 0.5,
            index_inner: 1.5,
            index_outer: 1.0,
            background: 1.0,
            polygons: vec![Polygon {
                index: 1.5,
                points: vec![[0.0, 0.0], [1.0, 0.0], [0.5, 0.5]],
            }],
        };
        SurfaceModel::Scatter(Arc::new(UnitCell::new(&outline).expect("prisms").turned(angle)))
    }

    fn polariser(angle: f64, indices: [f64; 2]) -> SurfaceModel {
        let shares = |t: f64, r: f64| AxisShares::new(&[[0.0, t], [80.0, 0.5 * t]], &[[0.0, r]]);
        let axes = [shares(0.9, 0.05), shares(0.03, 0.9)].map(|axis| axis.expect("an axis"));
        SurfaceModel::Scatter(Arc::new(Polariser::new(axes, angle, indices).expect("a sheet")))
    }

    /// Light at each wavelength that leaves into the cone, of light of a wavelength that falls on the films
    /// from a quarter of the azimuths, diffuse, with these Stokes parameters referred to s at right angles
    /// to x: traced forwards, backwards, and as a control backwards to the quarter beside.
    fn forwards_and_backwards<L: Light>(
        scenes: &[Scene],
        arriving: u16,
        light: [f64; 3],
    ) -> Vec<[Estimate; 3]> {
        let settings = Settings { roulette_below: 0.01, ..Settings::new(64, 1) };
        let tracers: Vec<Tracer<'_>> = scenes
            .iter()
            .enumerate()
            .map(|(number, scene)| {
                Tracer::new(scene, &[], &settings).at(&NM[..scenes.len()], number)
            })
            .collect();
        let layers: Vec<Layers<'_>> = scenes.iter().map(Layers::new).collect();
        let excitations = Layers::excitations(&layers, &NM[..scenes.len()]);
        assert!(layers.iter().all(Layers::are_reciprocal));
        let s_of = |direction: DVec3| direction.cross(DVec3::X).normalize();
        let mut found = vec![[const { Vec::new() }; 3]; scenes.len()];
        for group in 0..GROUPS {
            let streams = random::Streams::new(&mut random::stream(7, group as u64));
            let mut tallies: Vec<_> = tracers.iter().map(|t| Tally::new(&t.receivers)).collect();
            let mut passed = vec![vec![[0.0; 2]; layers[0].gaps()]; scenes.len()];
            let mut walk = LayerWalk::new((&layers, &tracers), (&mut tallies, &mut passed));
            let mut sums = vec![[0.0; 3]; scenes.len()];
            for ray in 0..RAYS {
                let mut rng = streams.path(ray as u64);
                let mut direction = random::cosine(&mut rng, 1.0);
                // A quarter of all azimuths.
                direction = direction.abs();
                let mut own = L::default();
                own.become_light(light, s_of(direction));
                let outcome = walk.follow((direction, false), arriving, &mut own, &mut rng);
                let leaving = outcome.exit().direction;
                let is_seen = leaving.z > 0.0 && leaving.truncate().length_squared() < CONE;
                if is_seen && outcome.course == super::super::part::Course::Turned {
                    sums[usize::from(outcome.wavelength)][0] += outcome.weight;
                }
                for emitted in 0..scenes.len() as u16 {
                    let mut rng = streams.path((RAYS + 3 * ray + usize::from(emitted)) as u64);
                    let leaving = random::cosine(&mut rng, CONE.sqrt());
                    let begins = (leaving, emitted, &excitations, false);
                    walk.follow_back::<L>(begins, &mut rng, |ray, _, seen| {
                        let from = -ray.direction;
                        if ray.wavelength != arriving || from.y < 0.0 {
                            return;
                        }
                        let way = if from.x > 0.0 { 1 } else { 2 };
                        let s = s_of(from);
                        let seen = seen.stokes().turned(ray.direction, s);
                        let [q, u, v] = light;
                        let share = 1.0 + q * seen.q - u * seen.u + v * seen.v;
                        let share = if L::CARRIED { share } else { 1.0 };
                        sums[usize::from(emitted)][way] += 4.0 * CONE * ray.weight * share;
                    });
                }
            }
            for (found, sums) in found.iter_mut().zip(sums) {
                (0..3).for_each(|way| found[way].push(sums[way] / RAYS as f64));
            }
        }
        let estimate = |all: Vec<f64>| all.into_iter().collect::<Moments>().estimate();
        found.into_iter().map(|ways| ways.map(estimate)).collect()
    }

    /// Difference in standard errors.
    fn apart(a: &Estimate, b: &Estimate) -> f64 {
        (a.value - b.value) / a.standard_error.hypot(b.standard_error).max(1e-12)
    }

    fn assert_same(name: &str, found: &[[Estimate; 3]]) {
        for (number, [forwards, backwards, _]) in found.iter().enumerate() {
            let off = apart(forwards, backwards);
            assert!(off.abs() < 4.0, "{name} {number}: {forwards:?} {backwards:?}");
        }
    }

    #[test]
    fn light_into_a_cone_is_the_same_traced_backwards() {
        let smooth = || SurfaceModel::Interface;
        let clear = || Medium::clear("film", 1.5);
        let crossed = [(clear(), smooth(), prisms(0.4)), (clear(), smooth(), prisms(1.1))];
        let pairs = forwards_and_backwards::<Unpolarised>(&[films(&crossed)], 0, [0.0; 3]);
        assert!(pairs[0][0].value > 0.02, "{pairs:?}");
        assert_same("crossed prisms", &pairs);
        assert!(apart(&pairs[0][0], &pairs[0][2]).abs() > 8.0, "{pairs:?}");
        let stack = |number: usize| {
            films(&[(dots(number), smooth(), smooth()), (clear(), smooth(), prisms(0.0))])
        };
        let scenes: Vec<Scene> = (0..3).map(stack).collect();
        for arriving in 0..3 {
            let pairs = forwards_and_backwards::<Unpolarised>(&scenes, arriving, [0.0; 3]);
            assert_same("dots under prisms", &pairs);
            assert_eq!(pairs[0][0].value > 0.0, arriving == 0, "{pairs:?}");
        }
    }

    /// Each kind of face that counts as reciprocal, lossy ones too, between other indices than 1.
    #[test]
    fn faces_are_reciprocal() {
        let smooth = || SurfaceModel::Interface;
        let index = Complex64::new(0.06, 3.6);
        let lossy = Film::new(550.0, vec![Layer { index, thickness_nm: 15.0 }]).expect("a film");
        let relief = Relief {
            lattice: ReliefLattice::Hexagonal,
            shape: ReliefShape::Pyramid,
            pitch: 1.0,
            base: 0.9,
            height: 0.4,
            is_pressed_in: true,
        };
        let relief = ReliefCell::new(relief, [1.5, 1.0]).expect("a relief");
        for (name, face) in [
            ("a lossy layer", SurfaceModel::Layered(Arc::new(lossy))),
            ("pyramids", SurfaceModel::Scatter(Arc::new(relief))),
            ("a filter", polariser(0.7, [1.5, 1.0])),
        ] {
            let film = |above: SurfaceModel| (Medium::clear("film", 1.5), smooth(), above);
            let scenes = [films(&[film(face.clone()), film(prisms(0.3))])];
            let found = forwards_and_backwards::<Unpolarised>(&scenes, 0, [0.0; 3]);
            assert!(found[0][0].value > 0.01, "{name}: {found:?}");
            assert_same(name, &found);
            let found = forwards_and_backwards::<Stokes>(&scenes, 0, [0.3, -0.8, 0.4]);
            assert_same(name, &found);
        }
    }

    #[test]
    fn polarised_light_into_a_cone_is_the_same_traced_backwards() {
        let air = || Medium::clear("film", 1.0);
        let plate = Medium::clear("plate", 1.6);
        let stack = [
            (plate, SurfaceModel::Interface, SurfaceModel::Interface),
            (air(), SurfaceModel::Interface, polariser(0.7, [1.0, 1.0])),
            (Medium::clear("film", 1.5), SurfaceModel::Interface, prisms(0.2)),
        ];
        let scenes = [films(&stack)];
        let mut all = Vec::new();
        for light in [[0.0; 3], [0.6, 0.8, 0.0], [0.6, -0.8, 0.0], [-0.6, 0.0, 0.8]] {
            let pairs = forwards_and_backwards::<Stokes>(&scenes, 0, light);
            assert_same("a polariser between a plate and prisms", &pairs);
            all.push(pairs[0][0]);
        }
        // Control: the states have shares of their own.
        assert!(apart(&all[1], &all[2]).abs() > 20.0, "{all:?}");
    }

    /// Sights are taken in rounds, offered by their weights, and read as they were written.
    #[test]
    fn sights_are_kept_and_offered_by_weight() {
        let cells = Cells::new(StackSymmetry::None);
        let sight = |start: u32, slot: u32, weight: f32| Sight {
            start,
            slot,
            wavelength: 1,
            bounces: 3,
            weight,
            direction: Vec3::Z,
            place: Vec2::new(0.1, -2.0),
            reach: 2.5,
            light: [Vec3::new(0.5, 0.0, 0.1), Vec3::X],
        };
        let slots = 2 * cells.count();
        let mut sights = Sights::new(slots, 0.1);
        for (start, weight) in [(0, 0.2), (1, 0.6), (2, 1.0), (3, 0.5)] {
            assert_eq!(sights.lacking(2).start, start);
            sights.put(vec![sight(start, 5, weight)]);
            if start % 2 == 1 {
                sights.take(2);
            }
        }
        assert!(sights.lags(2, 4) && !sights.lags(2, 3));
        let mut rng = random::stream(3, 0);
        assert!(sights.one(4, &mut rng).is_none());
        let mut heavy = 0.0;
        for _ in 0..4000 {
            let (found, mean) = sights.one(5, &mut rng).expect("four");
            assert!((mean - 2.3 / 2.0).abs() < 1e-6, "{mean}");
            heavy += f64::from(u8::from(found.start == 2));
        }
        let share: f64 = 1.0 / 2.3;
        let error = (4000.0 * share * (1.0 - share)).sqrt();
        assert!((heavy - 4000.0 * share).abs() < 4.5 * error, "{heavy}");
        let bytes = sights.bytes();
        let mut read = Sights::from_bytes(&bytes, (slots, 0.1), 2).expect("as written");
        assert_eq!((read.bytes(), &read.drawn), (bytes.clone(), &sights.drawn));
        // One round of them, as a run takes them anew.
        assert!(read.lacking(2).is_empty());
        read.take(2);
        assert_eq!((read.taken, read.has_grown), (2, false));
        assert!(Sights::from_bytes(&bytes, (slots, 0.2), 2).is_none());
        assert!(Sights::from_bytes(&bytes, (5, 0.1), 2).is_none());
        assert!(Sights::from_bytes(&bytes[..bytes.len() - 4], (slots, 0.1), 2).is_none());
    }
}
