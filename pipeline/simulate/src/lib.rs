// SPDX-License-Identifier: MIT OR Apache-2.0
//! From a design to its light: tables, scene, trace, observation, figures.
//!
//! In: a checked [`design::Design`], a [`model::Model`], a cache of tables and a
//! [`RunContext`](runtime::run_context::RunContext). Out: an [`observation::Observation`] (sums of
//! the receivers by groups of paths), the figures of merit that follow from it, and the results
//! data of [`run::Run`]. Files of a model are written by the [`model_writer::ModelWriter`] that the caller
//! passes; nothing is drawn here.
//!
//! ```
//! use runtime::{interrupt::Interrupt, run_context::RunContext};
//! use simulate::{dome_surface::dome_surface, model::Model, trace::observe};
//!
//! let design = design::embedded("bare-dome.toml")?;
//! let surface = dome_surface(&design, Model::Geometric, None)?;
//! let interrupt = Interrupt::default();
//! let context = RunContext::quiet(&interrupt, 1);
//! let observation = observe(&design, &surface, 4096, "bare dome", context)?;
//! let figures = observation.figures(&design);
//! let extraction = figures.iter().find(|figure| figure.key == "extraction_efficiency").expect("a dome");
//! assert!(extraction.entry.value > 0.9 && extraction.entry.standard_error < 0.01);
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`model`] | the four treatments of the relief |
//! | [`cells`] | unit cells of the rings |
//! | [`rings`] | tables of chosen rings, with what they took |
//! | [`tables`] | diffraction orders of every band, from the cache or the solver |
//! | [`dome_surface`], [`solids`], [`scene`] | surfaces that rays meet |
//! | [`scene_check`] | refusals that need the scene |
//! | [`warnings`], `mirror_walls` | what a design may say by mistake |
//! | [`seeds`] | seeds of the traces of one run |
//! | [`trace`] | Monte Carlo trace of one model |
//! | [`symmetry`] | symmetries of a design, for averages and drawings |
//! | `film_planes` | planes between the films of a stack |
//! | [`film_table`], `film_parts` | the films as one layer, by a table, and what is kept of it |
//! | [`film_surface`] | the films as one surface |
//! | [`observation`] | receiver sums and figures of merit |
//! | [`lit`] | the part of each bin of a receiver that can be lit |
//! | [`absolute`], [`units`] | watts, lumens, and factors between them |
//! | [`snapshot`], [`stopping_rule`] | batches of paths until a figure is known |
//! | [`trace_plan`], [`shard`], [`job`] | pieces of a computation that processes share |
//! | `added_errors` | errors beside the scatter, from coarser computations |
//! | [`spectral`] | the same at several wavelengths |
//! | `scenes` | one scene, or one for each wavelength where media convert light |
//! | [`model_traces`] | traces of many designs without files |
//! | [`paths`], [`paths_3d`], [`package_drawing`], [`description`], [`package`] | the package in lines, words and a few paths |
//! | [`bodies`] | the package as triangle meshes |
//! | [`run`], [`model_writer`], [`model_result`] | the recipe of a run, its writer of files, its results |

pub mod absolute;
mod added_errors;
pub mod bodies;
pub mod cells;
pub mod description;
pub mod dome_surface;
mod film_parts;
mod film_planes;
pub mod film_surface;
pub mod film_table;
pub mod job;
pub mod lit;
mod mirror_walls;
pub mod model;
pub mod model_result;
pub mod model_traces;
pub mod model_writer;
pub mod observation;
pub mod package;
pub mod package_drawing;
pub mod paths;
pub mod paths_3d;
pub mod rings;
pub mod run;
pub mod scene;
pub mod scene_check;
mod scenes;
pub mod seeds;
pub mod shard;
pub mod snapshot;
pub mod solids;
pub mod spectral;
pub mod stopping_rule;
pub mod symmetry;
pub mod tables;
pub mod trace;
pub mod trace_plan;
pub mod units;
pub mod warnings;
