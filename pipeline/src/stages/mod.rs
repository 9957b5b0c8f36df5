// SPDX-License-Identifier: MIT OR Apache-2.0
//! The stages of a computation, in the order the data passes them.
//!
//! [`tables`]: every distinct ring of a design → its table of diffraction orders, from the cache or the solver.
//! [`rings`]: the same for chosen rings, with what each took. [`convergence`]: one ring at many resolutions → errors and costs.
//! [`near_field`]: one ring → the fields in and around it.
//! [`scene`]: a design and a [`model::Model`] → what the tracer sees; [`solids`]: those of `[[solids]]` in it. [`trace`]: a scene → an [`observation::Observation`] →
//! figures with errors. [`colour`]: the same for the wavelengths of a spectrum → one observation. [`output`]: files and pictures; [`receivers`]: those of `[[receivers]]`, which [`fitting`] has judged by the scene. [`figures`]: Figures 3, 4 and 6 of the paper. [`grating`]: one grating
//! alone, for the command line. [`paths`]: a few paths through one package, to be looked at. [`study`]: many set-ups of designs → the figures of each.

pub mod cells;
pub mod convergence;
pub mod dome_surface;
pub mod grating;
pub mod model;
pub mod near_field;
pub mod observation;
pub mod output;
pub mod paper_figures;
pub mod paths;
pub mod rings;
pub mod run;
pub mod scene;
pub mod scene_check;
pub mod seeds;
mod snapshot;
pub mod solids;
pub mod spectral;
pub mod stopping_rule;
pub mod tables;
pub mod trace;
pub mod units;
