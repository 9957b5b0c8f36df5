// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bodies that light meets, its fate, readings and what is kept of them.

mod axis;
mod bad_input;
mod batch;
mod checkpoints;
mod closed_forms;
mod common;
mod coplanar;
mod crossing;
mod detectors;
mod emitters;
mod films;
mod geometry;
mod gjk;
mod housing;
mod leaks;
mod leaving;
mod low_discrepancy;
mod luminescence;
mod matrices;
mod mesh;
mod mixed;
mod nested;
mod placed;
mod placed_crossing;
mod reliefs;
mod samplers;
mod sampling;
mod scattering;
mod stokes;
mod torus;
mod transport;
