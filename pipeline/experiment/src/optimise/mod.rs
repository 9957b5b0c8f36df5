// SPDX-License-Identifier: MIT OR Apache-2.0
//! Optimisation: the design that a problem file asks for.
//!
//! [`mod@file`] mirrors the TOML and [`problem`] checks it. `variables` makes designs of points of
//! the unit box, each coefficient in its `range`, with `heights` of smooth domes and within the
//! [`limits`] of a mould. `evaluate` traces them, alone or by `shared_evaluations` with other
//! processes, `objective` judges what the traces show, also by the distance from a `target`.
//! `stage` runs one search, `front` one for a Pareto front, and [`log`] records every candidate, so
//! that a search goes on where it was stopped. [`recipe`] says what it will `cost`, joins the stages,
//! makes each [`found_design`] with copies of its [`named_files`] beside the other [`outputs`], and
//! verifies it beside its `sensitivities`, [`search_results`] writes it down,
//! and [`shared_search`] is the work of one shard.

pub(crate) mod cost;
mod evaluate;
pub mod external_search;
pub mod file;
pub mod found_design;
mod front;
mod heights;
pub mod limits;
pub mod log;
pub mod named_files;
mod noise;
mod objective;
mod outcome;
pub mod outputs;
pub mod problem;
mod range;
pub mod recipe;
mod robust;
pub mod search_results;
mod sensitivities;
mod shared_evaluations;
pub mod shared_search;
mod spline;
mod stage;
mod target;
#[cfg(test)]
mod tests;
mod variables;
pub mod verification_run;
