// SPDX-License-Identifier: MIT OR Apache-2.0
#![forbid(unsafe_code)]
//! BSDFs of micro-structured surfaces: tables of diffraction orders, ray optics of a unit cell,
//! measured tables and closed forms, behind one trait.
//!
//! A surface is a [`Bsdf`]. From the direction `wi` towards the light's origin it samples a
//! direction `wo` towards the light's destination, or lists all outgoing lobes with their powers.
//! The implementations are:
//!
//! | type | what it is |
//! |---|---|
//! | [`OrderTable`] | efficiencies of diffraction orders over both hemispheres of incidence, from any solver |
//! | [`UnitCell`] | ray optics in one period of a relief, the control without diffraction |
//! | [`ReliefCell`] | ray optics in one cell of lenses, pyramids or cones |
//! | [`MeasuredBsdf`] | tables on cells of direction, from files of Zemax, LightTools, WINDOW and Radiance |
//! | [`SmoothInterface`], [`Lambertian`] | closed forms |
//! | [`Diffuser`] | stated shares by the cosine law or in Gaussian lobes |
//! | [`HazyFace`] | stated haze: light straight on and in a Gaussian lobe |
//! | [`Polariser`] | sheets with shares of two axes by the angle |
//!
//! [`native`] reads and writes files of tables, and [`validate`] checks energy, reciprocity and
//! interpolation. Axes, sides, signs and units are
//! those of `docs/explanation/conventions.md`.
//!
//! The example builds a table from rows, samples it at one incidence, and compares the mean with
//! the table's own albedo. The solver is Fresnel's formula, with all power in order 0.
//!
//! ```
//! use bsdf::direction::spherical;
//! use bsdf::{
//!     Bsdf, Grid, OrderEfficiency, OrderTable, Polarisation, TableHeader, Transport, analytic,
//! };
//! use rand::SeedableRng;
//!
//! // Silicone inside, air outside; a period of 10.78 µm at a wavelength of 0.55 µm.
//! let grid = Grid {
//!     period: 10.78,
//!     wavelength: 0.55,
//!     index_inner: 1.41,
//!     index_outer: 1.0,
//!     kx_per_zone: 4,
//!     ky: Grid::ky_nodes(1.41, 1.0, 24),
//! };
//! let rows = grid.rows(|side, kx, ky, polarisation| {
//!     let (n1, n2) = (grid.index(side), grid.index(side.opposite()));
//!     let cos_theta_i = (1.0 - (kx * kx + ky * ky) / (n1 * n1)).sqrt();
//!     let r = analytic::fresnel(n1, n2, cos_theta_i).for_polarisation(polarisation);
//!     let mut orders = vec![OrderEfficiency::new(side, 0, r)];
//!     if r < 1.0 {
//!         orders.push(OrderEfficiency::new(side.opposite(), 0, 1.0 - r));
//!     }
//!     orders
//! });
//! let table = OrderTable::build(TableHeader::default(), grid.clone(), rows)?;
//!
//! let (wi, n) = (spherical(2.6, 0.3), 10_000);
//! let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
//! let transmitted = (0..n)
//!     .filter_map(|_| table.sample(wi, &mut rng))
//!     .filter(|sample| sample.lobe.transport == Transport::Transmission)
//!     .count();
//! let mean = transmitted as f64 / f64::from(n);
//! let standard_error = (mean * (1.0 - mean) / f64::from(n)).sqrt();
//! println!("transmitted: {mean:.4} ± {standard_error:.4}");
//! let expected = table.albedo(wi, Polarisation::Unpolarised).transmitted;
//! assert!((mean - expected).abs() < 4.0 * standard_error);
//! # Ok::<(), bsdf::Error>(())
//! ```

pub mod analytic;
pub mod angular_basis;
mod bsdf;
pub mod direction;
mod error;
pub mod json;
pub mod measured;
pub mod native;
pub mod order_table;
pub mod ray_optics;
pub mod stokes;
pub mod tensor_tree;
#[cfg(test)]
mod tests;
pub mod validate;

pub use analytic::{
    AxisShares, DiffuseLaw, DiffuseLobe, Diffuser, GaussianLobe, HAZE_DEG, HazyFace, Lambertian,
    Polariser, SmoothInterface,
};
pub use bsdf::{
    Albedo, Bsdf, BsdfSample, GAIN_TOLERANCE, Lobe, LobeKind, OutgoingLobe, Polarisation,
    PolarisedBsdf, Transport, s_axis,
};
pub use direction::Side;
pub use error::Error;
pub use measured::{LobeMotion, MeasuredBsdf};
pub use order_table::{EfficiencyRow, Grid, NodeId, OrderEfficiency, OrderTable, TableHeader};
pub use ray_optics::{Outline, Polygon, Relief, ReliefCell, ReliefLattice, ReliefShape, UnitCell};

/// The first program of `README.md`, as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
