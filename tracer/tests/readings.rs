// SPDX-License-Identifier: MIT OR Apache-2.0
//! Readings and what is kept: receivers, files, checkpoints, refusals.

mod bad_input;
mod checkpoints;
mod common;
mod coplanar;
mod detectors;
