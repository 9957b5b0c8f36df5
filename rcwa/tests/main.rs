// SPDX-License-Identifier: MIT OR Apache-2.0
//! All tests of the solver, one module a subject. They make one program: each links the libraries again.

mod bad_input;
mod closed_forms;
mod coalescing;
mod converged;
mod energy;
mod fields;
mod jones;
mod laws;
mod limits;
mod one_side;
mod oracle;
mod properties;
mod resolution;
mod standing;
mod support;
mod together;
mod truncated_references;
