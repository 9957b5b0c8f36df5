// SPDX-License-Identifier: MIT OR Apache-2.0
//! The stages of a computation.
//!
//! A run goes through [`tables`] (diffraction orders of every band), [`dome_surface`] and [`scene`]
//! (what rays meet, with [`solids`]), [`trace`] (Monte Carlo, repeated by a [`stopping_rule`]) or
//! [`spectral`] (the same at several wavelengths), [`observation`] (figures of merit) and
//! [`output`] (files). [`run`] is that recipe. [`scene_check`] refuses designs before it begins.
//!
//! [`design_file`] makes designs by setting keys, [`ring_slopes`] reliefs by their slopes, and
//! [`model_traces`] traces many designs without files. Other commands use [`rings`] (tables one by one), [`convergence`], [`near_field`] and
//! [`grating`] (the solver alone), [`paths`] (a few paths to look at) and [`paper_figures`].
//!
//! A [`job`] lists the pieces of a computation, tables and units of tasks such as a [`trace_plan`],
//! so that several processes share them.

pub mod absolute;
pub mod bodies;
pub mod cells;
pub mod convergence;
pub mod description;
pub mod design_file;
pub mod dome_surface;
pub mod grating;
pub mod job;
pub mod model;
pub mod model_traces;
pub mod near_field;
pub mod observation;
pub mod output;
mod package;
pub mod package_drawing;
pub mod paper_figures;
pub mod paths;
mod paths_3d;
pub mod ray_export;
pub mod ring_slopes;
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
pub mod trace_plan;
pub mod units;
