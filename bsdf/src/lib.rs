// SPDX-License-Identifier: MIT OR Apache-2.0
#![forbid(unsafe_code)]
//! Scattering shares of a surface, from a solver, a formula or a file: in; something a ray tracer can sample: out.
//!
//! Axes, sides, signs and units are those of `docs/conventions.md`.

pub mod analytic;
pub mod direction;
mod error;
pub mod format;
pub mod geometric;
pub mod orders;
pub mod scatter;
#[cfg(test)]
mod testing;

pub use analytic::{Lambertian, Mirror, SmoothInterface};
pub use direction::Side;
pub use error::Error;
pub use geometric::{Outline, Polygon, UnitCell};
pub use orders::{Grid, NodeId, OrderTable, Row, TableHeader};
pub use scatter::{Albedo, Lobe, LobeKind, OutgoingLobe, Polarization, Sample, Scatter, Transport};
