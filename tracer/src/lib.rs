// SPDX-License-Identifier: MIT OR Apache-2.0
#![forbid(unsafe_code)]
//! Monte Carlo ray tracer for LED packages: a scene and a seed in, what the receivers saw out.
//!
//! Shapes are exact and in f64, not tessellated; surfaces refract by Fresnel's formulas, reflect,
//! absorb, or scatter by any [`bsdf::Bsdf`]; packages are prototypes placed as instances, so that
//! light crosses from one to its neighbours. Rays carry power: refraction brings no factor n², and
//! emitted = escaped + absorbed + lost for every path. Every mean comes with its standard error.
//! Axes, units and signs are those of `docs/explanation/conventions.md`: millimetres, watts, z
//! upwards.
//!
//! ```
//! use tracer::{glam::DVec3, *};
//!
//! # fn main() -> Result<(), Error> {
//! // A disc that emits into a hemisphere of silicone standing on an absorbing plane.
//! let silicone = Region::Body(0);
//! let dome = Shape::sphere_zones(0.0, 2.0, &[2.0, 0.0])?;
//! let mut scene = SceneBuilder::new(Medium::air());
//! let package = scene.prototype(Prototype {
//!     media: vec![Medium::clear("silicone", 1.41)],
//!     surfaces: vec![
//!         Surface::new("dome", dome, silicone, Region::World, &SurfaceModel::Interface),
//!         Surface::new("base", Shape::annulus(0.0, 0.0, 2.001)?, Region::Opaque, silicone, &SurfaceModel::Absorber),
//!     ],
//!     sources: vec![Source::new("LED", DVec3::ZERO, silicone, Emitter::Disc { radius: 0.2 }, Emission::LAMBERTIAN)],
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
//! How the parts lie: [`shape`] and [`surface`] make a [`Prototype`] (or [`Package`] makes one),
//! [`SceneBuilder`] places prototypes and checks the whole, [`run()`] follows paths and fills
//! [`receiver`]s, [`Outcome`] answers with estimates.

mod batch;
pub mod checkpoint;
pub mod error;
pub mod formats;
pub mod housing;
pub mod ledger;
pub mod observer;
pub mod optics;
pub mod outcome;
pub mod package;
mod path;
mod path_splitting;
pub mod random;
pub mod ray;
pub mod receiver;
pub mod run;
mod scatter;
pub mod scene;
pub mod shape;
pub mod source;
pub mod statistics;
pub mod surface;

pub use glam;

pub use checkpoint::CheckpointStore;
pub use error::Error;
pub use ledger::{Ledger, Loss};
pub use observer::{Fate, Interaction, Observer};
pub use optics::media::Medium;
pub use optics::polarization::Polarization;
pub use optics::thin_film::{Film, Layer};
pub use outcome::{Outcome, Totals};
pub use package::{Cap, Dome, Interior, LedBox, Package};
pub use ray::Ray;
pub use receiver::{Detector, FarField, Filter, Measurement, PlaneMap, Receiver};
pub use run::{
    Control, Sampling, Settings, run, run_detecting, run_rays, run_with, trace_observed,
};
pub use scene::{Prototype, PrototypeId, Scene, SceneBuilder, Standing, Surroundings};
pub use shape::{Meridian, Shape};
pub use source::{Distribution, Emission, Emitter, RayRecord, RaySet, Source};
pub use statistics::{Estimate, jackknife};
pub use surface::{LayeredMirror, Mixed, Patch, Region, Surface, SurfaceModel};
