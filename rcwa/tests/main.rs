// SPDX-License-Identifier: MIT OR Apache-2.0
//! All tests of the solver, one module a subject. They make one program: each links the libraries
//! again.

mod accuracy;
mod bad_input;
mod closed_forms;
mod converged;
mod degenerate_modes;
mod energy;
mod fields;
mod jones;
mod ky_batch;
mod laws;
mod limits;
mod oracle;
mod properties;
mod real_basis;
mod resolution;
mod support;
mod truncated_references;
