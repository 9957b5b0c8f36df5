// SPDX-License-Identifier: MIT OR Apache-2.0
//! Simulation.

pub mod absolute;
pub mod bodies;
pub mod cells;
pub mod description;
pub mod dome_surface;
pub mod job;
pub mod model;
pub mod model_result;
pub mod model_traces;
pub mod observation;
pub mod package;
pub mod package_drawing;
pub mod paths;
pub mod paths_3d;
pub mod run;
pub mod scene;
pub mod scene_check;
pub mod seeds;
pub mod shard;
pub mod snapshot;
pub mod solids;
pub mod spectral;
pub mod stopping_rule;
pub mod tables;
pub mod trace;
pub mod trace_plan;
pub mod units;
