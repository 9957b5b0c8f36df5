// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths through one scene, or through the scenes of several wavelengths.

use crate::film_stack::StackWalker;
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

    /// Follows a path until it has met `surfaces` surfaces; true if it has ended, and all of its
    /// power is booked.
    fn walk_to(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        surfaces: u32,
    ) -> bool;
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

    #[inline]
    fn walk_to(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        surfaces: u32,
    ) -> bool {
        let Self { tracer, tally, films, observer, .. } = self;
        let (tally, observer) = (&mut **tally, &mut **observer);
        let Some(films) = films else {
            let is_over;
            (*path, is_over) =
                Walk { tracer, path: *path, light, rng, tally, observer }.follow_to(surfaces);
            return is_over;
        };
        loop {
            let (light, rng) = (&mut *light, &mut *rng);
            let (tally, observer) = (&mut *tally, &mut *observer);
            let walk = Walk { tracer, path: *path, light, rng, tally, observer };
            let stop;
            (*path, stop) = walk.follow_to_films(surfaces, films.faces(path.wavelength));
            match stop {
                Stop::AtFilms if films.pass(path, light, rng) => {}
                Stop::AtFilms | Stop::Over => return true,
                Stop::Long => return false,
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

    fn walk_to(
        &mut self,
        path: &mut PathState,
        light: &mut L,
        rng: &mut PathStream,
        surfaces: u32,
    ) -> bool {
        loop {
            let wavelength = path.wavelength;
            let tracer = &self.tracers[usize::from(wavelength)];
            let tally = &mut self.tallies[usize::from(wavelength)];
            let (light, rng, observer) = (&mut *light, &mut *rng, &mut *self.observer);
            let walk = Walk { tracer, path: *path, light, rng, tally, observer };
            let stop;
            (*path, stop) = match &self.films {
                Some(films) => walk.follow_to_films(surfaces, films.faces(wavelength)),
                None => match walk.follow_to(surfaces) {
                    (path, true) => (path, Stop::Over),
                    (path, false) => (path, Stop::Long),
                },
            };
            let films = self.films.as_mut().filter(|_| stop == Stop::AtFilms);
            match films.map(|films| films.pass(path, light, rng)) {
                Some(true) => {}
                Some(false) => return true,
                _ if path.wavelength == wavelength => return stop == Stop::Over,
                _ => {}
            }
        }
    }
}
