// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fate of light: closed forms, transport, polarisation, thin films, tables, and how paths
//! are drawn.

mod closed_forms;
mod common;
mod emitters;
mod films;
mod low_discrepancy;
mod luminescence;
mod matrices;
mod mixed;
mod reliefs;
mod samplers;
mod sampling;
mod scattering;
mod stokes;
mod transport;
