// SPDX-License-Identifier: MIT OR Apache-2.0
//! From a design file to its light: the only crate that knows all the others.
//!
//! A design ([`config`]) becomes geometry ([`geometry`]); every distinct ring of its relief becomes
//! a table of diffraction orders ([`stages::tables`], kept in the [`cache`]); a scene is traced
//! ([`stages::trace`]); what the receivers saw becomes figures with standard errors ([`metrics`]),
//! files and pictures ([`report`]). Paths, TOML, time, printing and the number of threads live here
//! and nowhere else. Axes, signs and units: `docs/explanation/conventions.md`.
//!
//! ```
//! use pipeline::{config, geometry};
//!
//! let design = config::embedded("d1.toml")?;
//! let rings = design.hybrid_rings();
//! let dome = design.dome.as_ref().and_then(|dome| dome.sphere()).expect("D1 has a sphere");
//! let index = design.silicone.index;
//! let cell = geometry::ring_cell(dome, &rings, 75, index).expect("sharp corners");
//! let cell = cell.expect("ring 75 is a step");
//! assert!((cell.period_um - 10.78).abs() < 0.005);
//! # Ok::<(), config::ConfigError>(())
//! ```

pub mod atomic_file;
pub mod cache;
pub mod case;
pub mod checkpoint;
pub mod cli;
pub mod cli_errors;
pub mod commands;
pub mod config;
pub mod content_hash;
pub mod digits;
pub mod exit;
pub mod formats;
pub mod geometry;
pub mod interrupt;
pub mod material;
pub mod metrics;
pub mod optimise;
pub mod plural;
pub mod program;
pub mod progress;
pub mod provenance;
pub mod published;
pub mod quantity;
pub mod reader_words;
pub mod report;
pub mod results;
pub mod run_context;
pub mod search;
pub mod shard;
pub mod spectrum;
pub mod stages;
pub mod study;
pub mod tolerance;
