// SPDX-License-Identifier: MIT OR Apache-2.0
//! Studies: vary keys of designs, and compare each set-up with the base and with targets.
//!
//! [`mod@file`] mirrors the TOML, [`setups`] combines levels of factors to set-ups, [`targets`]
//! holds what figures should be, [`definition`] reads and checks a whole study, [`compute`] traces
//! it, [`trace_figures`] holds the figures of each trace, and [`study_results`] their changes and
//! misfits.

mod checks;
pub mod compute;
pub mod definition;
pub mod file;
pub mod setups;
pub mod study_results;
pub mod targets;
pub mod trace_figures;

pub use definition::{Study, load};
