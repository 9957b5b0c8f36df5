// SPDX-License-Identifier: MIT OR Apache-2.0
#![forbid(unsafe_code)]
//! Monte Carlo ray tracing of LED packages and arrays.
//!
//! [`run()`] takes a [`Scene`], [`receiver`]s and a seed, and returns the power in the bins of the
//! receivers and in the [`Ledger`], for each of 64 groups of paths. [`Outcome`] turns these into
//! estimates with standard errors.
//!
//! ```
//! use tracer::{glam::DVec3, *};
//!
//! # fn main() -> Result<(), Error> {
//! // A disc that emits into a hemisphere of silicone standing on an absorbing plane.
//! let silicone = Region::Body(0);
//! let dome = Shape::sphere_zones(0.0, 2.0, &[2.0, 0.0])?;
//! let base = Shape::annulus(0.0, 0.0, 2.001)?;
//! let disc = Emitter::Disc { radius: 0.2 };
//! let mut scene = SceneBuilder::new(Medium::air());
//! let package = scene.prototype(Prototype {
//!     media: vec![Medium::clear("silicone", 1.41)],
//!     surfaces: vec![
//!         Surface::new("dome", dome, silicone, Region::World, &SurfaceModel::Interface),
//!         Surface::new("base", base, Region::Opaque, silicone, &SurfaceModel::Absorber),
//!     ],
//!     sources: vec![Source::new("LED", DVec3::ZERO, silicone, disc, Emission::LAMBERTIAN)],
//! });
//! let scene = scene.place(package, DVec3::ZERO).build()?;
//! let outcome = run(&scene, &[], &Settings::new(100_000, 1))?;
//! let extraction = outcome.jackknife(|totals| totals.ledger.extraction());
//! println!("extraction {:.4} ± {:.4}", extraction.value, extraction.standard_error);
//! assert!(extraction.deviations_from(0.971_05) < 5.0);
//! # Ok(())
//! # }
//! ```
//!
//! # Model
//!
//! - [`shape`]s are exact and in f64, not tessellated. A hit counts only from the side of the
//!   region in which the ray is, so a ray never meets the surface that it has just left.
//! - A [`Surface`] is a shape, the regions on its two sides, and a [`SurfaceModel`] for each of its
//!   patches: Fresnel interface, thin film, mirror, Lambertian, absorber, or any [`bsdf::Bsdf`].
//! - A [`Prototype`] holds media, surfaces and sources in its own frame. [`SceneBuilder`] places it
//!   many times, checks that nothing overlaps or leaks, and compiles the [`Scene`]. [`Interior`]
//!   and [`housing::Housing`] build the usual ones.
//! - A [`Medium`] absorbs along the way, scatters by a [`PhaseFunction`], and converts light to
//!   other wavelengths by [`Luminophore`]s; [`WavelengthRun`] follows light through all of them.
//! - Rays carry power, so refraction brings no factor n². For every path, emitted = escaped +
//!   absorbed + lost.
//! - Light that meets a stack of films takes an outcome of a [`FilmTable`], where a run has one.
//! - All random numbers come from (seed, group, path). The number of threads changes no bit.
//!
//! Lengths are in millimetres, powers in watts, z points upwards;
//! `docs/explanation/conventions.md` has the axes, units and signs.

mod batch;
mod checkpoint;
mod conversion;
pub mod error;
mod film_stack;
pub mod housing;
pub mod ledger;
pub mod observer;
pub mod optics;
pub mod outcome;
pub mod package;
mod path;
pub mod pattern;
pub mod random;
pub mod ray;
pub mod receiver;
pub mod run;
mod scatter;
pub mod scene;
pub mod settings;
pub mod shape;
pub mod source;
mod source_picker;
pub mod statistics;
pub mod surface;

pub use glam;

pub use checkpoint::CheckpointStore;
pub use error::Error;
pub use film_stack::{
    FilmTable, Passage, StackBorder, StackLight, StackShares, StackSurface, StackSymmetry,
    TabulatedFilms, Viewer,
};
pub use ledger::{Ledger, Loss};
pub use observer::{Fate, Interaction, Observer};
pub use optics::luminescence::Luminophore;
pub use optics::media::Medium;
pub use optics::mie::{Mie, Sphere};
pub use optics::phase::{PhaseFunction, PhaseTable, Scattering, SpherePhase};
pub use optics::polarisation::Polarisation;
pub use optics::thin_film::{Film, Layer};
pub use outcome::{Outcome, Totals};
pub use package::{Interior, LedBox};
pub use pattern::{Marks, Pattern};
pub use ray::Ray;
pub use receiver::{Detector, FarField, Filter, Measurement, PlaneMap, Receiver};
pub use run::{Control, WavelengthRun, run, run_groups, run_rays, run_with, trace_observed};
pub use scene::{Containment, Prototype, PrototypeId, Scene, SceneBuilder, Surroundings};
pub use settings::{Sampling, Settings};
pub use shape::{Meridian, Shape};
pub use source::{Distribution, Emission, Emitter, RayRecord, RaySet, Source};
pub use statistics::{Estimate, jackknife};
pub use surface::{LayeredMirror, Mixed, Patch, Printed, Region, Surface, SurfaceModel};

/// The first program of `README.md`, as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
