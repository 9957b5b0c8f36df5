// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tolerances: what deviations of a real package from its design do to its figures.
//!
//! [`mod@file`] mirrors the TOML and [`definition`] checks it. [`deviations`] draws samples of the
//! design, [`compute`] traces them, and [`shared_traces`] does so in several processes.
//! [`statistics`] tells mean shift, scatter, quantiles, yield and contributors from what the traces
//! show.

pub mod compute;
pub mod definition;
pub mod deviations;
mod drawn_samples;
pub mod file;
mod sample_tracer;
pub mod shared_traces;
pub mod statistics;
pub mod tolerance_results;
