// SPDX-License-Identifier: MIT OR Apache-2.0
//! The commands of the binary: each with its arguments, one file a command.

pub mod arguments;
pub mod bsdf;
pub mod check;
pub mod converge;
pub mod explore;
pub mod export;
pub mod file_formats;
pub mod full_wave;
pub mod grating;
pub mod import;
pub mod job_record;
pub mod near_field;
pub mod new;
pub mod optimise;
mod outputs;
pub mod rays;
pub mod report;
pub mod reproduce;
pub mod run;
pub mod schema;
pub mod shardable;
pub mod shards;
pub mod shell;
pub mod study;
pub mod submit;
pub mod tolerance;
mod zone_film;
mod zone_inputs;
mod zone_options;
mod zone_pictures;
pub mod zones;
