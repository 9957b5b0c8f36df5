// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths through one scene, or through the scenes of several wavelengths.

use crate::film_stack::{Exits, StackWalker};
use crate::observer::Observer;
use crate::optics::polarisation::Light;
use crate::path::{PathState, Stop, Tracer, Walk};
use crate::random::{self, PathStream};
use crate::receiver::Tally;
use crate::source_picker::SourcePicker;

/// Begins paths and follows them.
pub(super) trait Walker<L: Light> {
    /// Path `number`, at its source.
    fn begin(&mut self, number: u64, rng: &mut PathStream) -> PathState;

    /// Follows a path until it has met `surfaces` surfaces; true if it has ended. What has left a film
    /// stack in other ways is followed to its end.
    fn walk_to(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        surfaces: u32,
    ) -> bool {
        let mut exits = Exits::default();
        let is_over = self.walk_one_to(path, light, rng, surfaces, &mut exits);
        while let Some((mut path, mut light)) = exits.paths.pop() {
            self.walk_one_to(&mut path, &mut light, rng, u32::MAX, &mut exits);
        }
        for seen in exits.seen {
            self.show_seen(seen, rng);
        }
        is_over
    }

    /// Shows light that receivers into a narrow cone see.
    fn show_seen(&mut self, path: PathState, rng: &mut PathStream);

    /// Follows a path until it has met `surfaces` surfaces; true if it has ended, and all of its
    /// power but that of `exits` is booked.
    fn walk_one_to(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        surfaces: u32,
        exits: &mut Exits<L>,
    ) -> bool;
}

/// Follows a path until it ends, has met `surfaces` surfaces, or takes an outcome of a film stack.
#[inline]
fn follow<L: Light, O: Observer>(
    walk: Walk<'_, '_, '_, L, PathStream, O>,
    surfaces: u32,
    films: Option<&StackWalker<'_, '_>>,
) -> (PathState, Stop) {
    if let Some(films) = films {
        let faces = films.faces(walk.path.wavelength);
        return walk.follow_to_films(surfaces, faces);
    }
    let (path, is_over) = walk.follow_to(surfaces);
    (path, if is_over { Stop::Over } else { Stop::Long })
}

/// Takes a path beyond a film stack, see [`StackWalker::pass`]; false if it ends there.
fn passes<L: Light>(
    films: &mut Option<StackWalker<'_, '_>>,
    path: &mut PathState,
    light: &mut L,
    rng: &mut PathStream,
    exits: &mut Exits<L>,
) -> bool {
    films.as_mut().is_some_and(|films| films.pass(path, light, rng, exits))
}

/// Paths through one scene.
pub(super) struct SceneWalker<'w, 'a, O> {
    pub tracer: &'w Tracer<'a>,
    pub picker: SourcePicker<'w>,
    pub tally: &'w mut Tally<'a>,
    pub films: Option<StackWalker<'w, 'a>>,
    pub observer: &'w mut O,
}

impl<L: Light, O: Observer> Walker<L> for SceneWalker<'_, '_, O> {
    #[inline]
    fn begin(&mut self, number: u64, rng: &mut PathStream) -> PathState {
        let (source, placed) = self.picker.next();
        let ray = self.picker.begin(number, placed, self.tracer.scene.offset(), rng);
        self.tracer.begin(ray, (source, placed), self.tally, self.observer)
    }

    fn show_seen(&mut self, path: PathState, rng: &mut PathStream) {
        let Self { tracer, tally, .. } = self;
        let (light, observer) = (&mut L::default(), &mut ());
        Walk { tracer, path, light, rng, tally, observer }.show_seen();
    }

    #[inline]
    fn walk_one_to(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        surfaces: u32,
        exits: &mut Exits<L>,
    ) -> bool {
        loop {
            let Self { tracer, tally, films, observer, .. } = self;
            let (light, rng) = (&mut *light, &mut *rng);
            let (tally, observer) = (&mut **tally, &mut **observer);
            let walk = Walk { tracer, path: *path, light, rng, tally, observer };
            let stop;
            (*path, stop) = follow(walk, surfaces, films.as_ref());
            if stop != Stop::AtFilms {
                return stop == Stop::Over;
            }
            if !passes(films, path, light, rng, exits) {
                return true;
            }
        }
    }
}

/// Paths through the scenes of several wavelengths, one tracer and one tally for each.
pub(super) struct SpectralWalker<'w, 'a, O> {
    pub tracers: &'w [Tracer<'a>],
    pub picker: SourcePicker<'w>,
    pub tallies: Vec<Tally<'w>>,
    /// Sums of the shares of power that each source emits at the wavelengths.
    pub emission: &'w [Vec<f64>],
    pub films: Option<StackWalker<'w, 'a>>,
    pub observer: &'w mut O,
}

impl<L: Light, O: Observer> Walker<L> for SpectralWalker<'_, '_, O> {
    fn begin(&mut self, number: u64, rng: &mut PathStream) -> PathState {
        let (source, placed) = self.picker.next();
        let ray = self.picker.begin(number, placed, self.tracers[0].scene.offset(), rng);
        let cumulated = &self.emission[source];
        let pick = random::unit(rng);
        let wavelength = cumulated.partition_point(|sum| *sum <= pick).min(cumulated.len() - 1);
        let tally = &mut self.tallies[wavelength];
        self.tracers[wavelength].begin(ray, (source, placed), tally, self.observer)
    }

    fn show_seen(&mut self, path: PathState, rng: &mut PathStream) {
        let tracer = &self.tracers[usize::from(path.wavelength)];
        let tally = &mut self.tallies[usize::from(path.wavelength)];
        let (light, observer) = (&mut L::default(), &mut ());
        Walk { tracer, path, light, rng, tally, observer }.show_seen();
    }

    fn walk_one_to(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        surfaces: u32,
        exits: &mut Exits<L>,
    ) -> bool {
        loop {
            let wavelength = path.wavelength;
            let tracer = &self.tracers[usize::from(wavelength)];
            let tally = &mut self.tallies[usize::from(wavelength)];
            let (light, rng, observer) = (&mut *light, &mut *rng, &mut *self.observer);
            let walk = Walk { tracer, path: *path, light, rng, tally, observer };
            let stop;
            (*path, stop) = follow(walk, surfaces, self.films.as_ref());
            match stop {
                Stop::AtFilms if passes(&mut self.films, path, light, rng, exits) => {}
                Stop::AtFilms => return true,
                _ if path.wavelength == wavelength => return stop == Stop::Over,
                Stop::Over | Stop::Long => {}
            }
        }
    }
}
