// SPDX-License-Identifier: MIT OR Apache-2.0
//! A run through the scenes of several wavelengths: a path carries its wavelength, and luminophores
//! take it to another.
//!
//! Every wavelength has a scene of its own, of the same shapes, media and sources; indices,
//! absorption, scattering and surfaces are those of the wavelength. A path that is converted goes on
//! from where it is in the scene of its new wavelength. Readings of each wavelength are summed with
//! stated weights into channels: power with weight 1 everywhere, X, Y and Z with those of the
//! standard observer.

use super::control::Control;
use super::groups::{self, Group, Progress};
use super::one_by_one;
use super::walk::SpectralWalker;
use crate::error::{Error, check};
use crate::film_stack::{BoundStack, StackWalker};
use crate::outcome::{Outcome, Totals};
use crate::path::Tracer;
use crate::receiver::{Receiver, Tally};
use crate::scene::Scene;
use crate::settings::Settings;

/// Scenes of several wavelengths, what sources emit at each, and the sums to read.
///
/// ```
/// use tracer::{glam::DVec3, *};
///
/// # fn main() -> Result<(), Error> {
/// // A blue source in a ball of phosphor of index 1 and yield 0.9, in air.
/// let scene = |absorption: f64| {
///     let phosphor = Luminophore::new("phosphor", absorption, 0.9, &[0.0, 1.0])?;
///     let inside = Region::Body(0);
///     let ball = Shape::sphere(0.0, 1.0)?;
///     let mut scene = SceneBuilder::new(Medium::air());
///     let package = scene.prototype(Prototype {
///         media: vec![Medium::clear("binder", 1.0).luminescent(vec![phosphor])],
///         surfaces: vec![Surface::new("ball", ball, inside, Region::World, &SurfaceModel::Interface)],
///         sources: vec![Source::new("LED", DVec3::ZERO, inside, Emitter::Point, Emission::Isotropic)],
///     });
///     scene.place(package, DVec3::ZERO).build()
/// };
/// let (blue, red) = (scene(1.0)?, scene(0.0)?);
/// let run = WavelengthRun {
///     wavelengths_nm: &[450.0, 600.0],
///     scenes: &[&blue, &red],
///     emission: &[vec![1.0, 0.0]],
///     channels: &[vec![1.0, 1.0], vec![1.0, 0.0]],
/// };
/// let sums = run.run(&[], &Settings::new(100_000, 1), Control::default())?;
/// let escaped = |channel: usize| sums[channel].jackknife(|totals| totals.ledger.escaped());
/// let unconverted = (-1.0f64).exp();
/// assert!(escaped(1).deviations_from(unconverted) < 5.0);
/// let converted = (1.0 - unconverted) * 0.9 * 450.0 / 600.0;
/// assert!(escaped(0).deviations_from(unconverted + converted) < 5.0);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy)]
pub struct WavelengthRun<'a> {
    /// Wavelengths, nm.
    pub wavelengths_nm: &'a [f64],
    /// The scene of each, alike but for their optics.
    pub scenes: &'a [&'a Scene],
    /// For each source of the scene, its shares of power at the wavelengths.
    pub emission: &'a [Vec<f64>],
    /// For each sum that is read, the weights of the wavelengths.
    pub channels: &'a [Vec<f64>],
}

impl WavelengthRun<'_> {
    /// Traces all wavelengths together; one outcome for each channel.
    ///
    /// # Errors
    /// Those of [`super::run_with`]; lists of other lengths than the number of wavelengths, scenes
    /// that are not alike, and sources that emit nothing.
    pub fn run(
        &self,
        receivers: &[&dyn Receiver],
        settings: &Settings,
        control: Control<'_>,
    ) -> Result<Vec<Outcome>, Error> {
        let groups = self.groups(receivers, settings, control, 0..u64::MAX)?;
        Ok(groups::outcomes(settings, self.channels.len(), groups))
    }

    /// Traces those of `groups` that the checkpoints of `control` lack, and hands them to the
    /// checkpoints.
    ///
    /// # Errors
    /// Those of [`Self::run`].
    pub fn run_groups(
        &self,
        receivers: &[&dyn Receiver],
        settings: &Settings,
        control: Control<'_>,
        groups: std::ops::Range<u64>,
    ) -> Result<(), Error> {
        self.groups(receivers, settings, control, groups).map(drop)
    }

    /// Totals of all channels and surfaces met, group by group.
    fn groups(
        &self,
        receivers: &[&dyn Receiver],
        settings: &Settings,
        control: Control<'_>,
        groups: std::ops::Range<u64>,
    ) -> Result<Vec<Group>, Error> {
        settings.check()?;
        let emission = self.check()?;
        for scene in self.scenes {
            receivers.iter().try_for_each(|receiver| scene.admits(*receiver))?;
        }
        let bound = control
            .films
            .map(|films| BoundStack::new(films, self.scenes, self.wavelengths_nm, settings));
        let films = bound.transpose()?;
        let numbered = self.scenes.iter().enumerate();
        let tracers: Vec<Tracer<'_>> = numbered
            .map(|(number, scene)| {
                let mut tracer = Tracer::new(scene, receivers, settings);
                if let Some(films) = &films {
                    films.relieve(&mut tracer);
                }
                tracer.at(self.wavelengths_nm, number)
            })
            .collect();
        let like = || Tally::new(&tracers[0].receivers).totals;
        groups::resumed(settings, control, groups, self.channels.len(), like, |group| {
            let at = (settings.seed, group);
            self.group((&tracers, films.as_ref()), &emission, at, settings.in_group(), control)
        })
    }

    fn group<'a>(
        &self,
        (tracers, films): (&[Tracer<'a>], Option<&BoundStack<'a>>),
        emission: &[Vec<f64>],
        at: (u64, u64),
        paths: u64,
        control: Control<'_>,
    ) -> Result<Group, Error> {
        let first = &tracers[0];
        let (picker, streams) = groups::begin(first, at, paths);
        let mut walker = SpectralWalker {
            tracers,
            picker,
            tallies: tracers.iter().map(|tracer| Tally::new(&tracer.receivers)).collect(),
            emission,
            films: films.map(|films| StackWalker::new(films, at.1)),
            observer: &mut (),
        };
        let mut progress = Progress::new(control);
        let keep_going = |done: u64| progress.keep_going(done);
        let hits = one_by_one::trace(&mut walker, first.polarisation, paths, streams, keep_going);
        let hits = hits.ok_or(Error::Cancelled)?;
        if let Some(films) = walker.films {
            films.close(&mut walker.tallies.iter_mut().collect::<Vec<_>>());
        }
        progress.report(paths);
        let scale = first.scene.power() / paths as f64;
        let of_wavelength: Vec<Totals> = walker.tallies.into_iter().map(Tally::close).collect();
        let sum = |weights: &Vec<f64>| {
            let mut sum = of_wavelength[0].clone();
            sum.scale(weights[0] * scale);
            for (totals, weight) in of_wavelength.iter().zip(weights).skip(1) {
                sum.combine(1.0, totals, weight * scale);
            }
            sum
        };
        Ok((self.channels.iter().map(sum).collect(), hits))
    }

    /// Checks the lists, and adds up the shares of every source to 1.
    fn check(&self) -> Result<Vec<Vec<f64>>, Error> {
        let count = self.wavelengths_nm.len();
        let scenes = self.scenes.len();
        let is_long = |list: &Vec<f64>| list.len() == count;
        let fits = (1..=usize::from(u16::MAX)).contains(&count)
            && !self.channels.is_empty()
            && scenes == count
            && self.channels.iter().chain(self.emission).all(is_long);
        check("number of wavelengths", count as f64, "one scene and one weight for each", fits)?;
        for nm in self.wavelengths_nm {
            crate::error::positive("wavelength, nm", *nm)?;
        }
        let sources = self.scenes[0].sources.len();
        let are_alike = self.emission.len() == sources
            && self.scenes.iter().all(|scene| {
                let first = self.scenes[0];
                let media =
                    |of: &Scene| of.bodies.iter().map(|b| b.media.len()).collect::<Vec<_>>();
                scene.lines() == first.lines()
                    && scene.sources.len() == sources
                    && scene.instances.list.len() == first.instances.list.len()
                    && media(scene) == media(first)
            });
        check(
            "number of sources",
            sources as f64,
            "the same surfaces, media and sources at all wavelengths",
            are_alike,
        )?;
        for luminophore in self.scenes.iter().flat_map(|scene| scene.luminophores()) {
            let emitted = luminophore.wavelengths();
            let what = format!("wavelengths of the emission of '{}'", luminophore.name);
            check(&what, emitted as f64, "those of the run", emitted == count)?;
        }
        self.emission
            .iter()
            .map(|shares| {
                let whole: f64 = shares.iter().sum();
                let is_sound =
                    whole > 0.0 && whole.is_finite() && shares.iter().all(|share| *share >= 0.0);
                check("power of a source", whole, "a finite number above 0", is_sound)?;
                let mut sum = 0.0;
                Ok(shares
                    .iter()
                    .map(|share| {
                        sum += share / whole;
                        sum
                    })
                    .collect())
            })
            .collect()
    }
}
