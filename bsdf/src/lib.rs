// SPDX-License-Identifier: MIT OR Apache-2.0
#![forbid(unsafe_code)]
//! Scattering shares of a surface, from a solver, a formula or a file: in; something a ray tracer can sample: out.
//!
//! A surface is a [`Bsdf`]: from the direction `wi` that light comes from, it draws a direction `wo` that it goes to, or lists
//! all of them with their shares of the power. Behind it stand closed forms ([`analytic`]), ray optics in one period of a relief
//! ([`UnitCell`]), and tables of diffraction orders over the hemisphere of incidence ([`OrderTable`]), which come from
//! any solver as plain [`Row`]s, are judged by [`checks`], and live in files of [`format::native`]. Axes, sides, signs and units are
//! those of `docs/explanation/conventions.md`.
//!
//! A table from rows, one incidence, and a mean with its standard error; the solver here is Fresnel's formula:
//!
//! ```
//! use bsdf::{Bsdf, Grid, OrderEfficiency, OrderTable, Polarization, Side, TableHeader, Transport, direction::spherical};
//! use rand::SeedableRng;
//!
//! let ky = Grid::ky_nodes(1.41, 1.0, 24);
//! let grid = Grid { period: 10.78, wavelength: 0.55, index_inner: 1.41, index_outer: 1.0, kx_per_zone: 4, ky };
//! let rows = grid.rows(|side, kx, ky, polarization| {
//!     let (n1, n2) = if side == Side::Inner { (1.41, 1.0) } else { (1.0, 1.41_f64) };
//!     let cos_theta_i = (1.0 - (kx * kx + ky * ky) / (n1 * n1)).sqrt();
//!     let r = bsdf::analytic::fresnel(n1, n2, cos_theta_i).of(polarization);
//!     [(side, r), (side.opposite(), 1.0 - r)].into_iter().filter(|(_, r)| *r > 0.0).map(|(to, r)| OrderEfficiency::new(to, 0, r)).collect()
//! });
//! let table = OrderTable::build(TableHeader::default(), grid.clone(), rows)?;
//! let (wi, n) = (spherical(2.6, 0.3), 10_000);
//! let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
//! let passes = (0..n).filter(|_| table.sample(wi, &mut rng).is_some_and(|s| s.lobe.transport == Transport::Transmission));
//! let mean = passes.count() as f64 / f64::from(n);
//! let standard_error = (mean * (1.0 - mean) / f64::from(n)).sqrt();
//! println!("transmitted: {mean:.4} ± {standard_error:.4}");
//! assert!((mean - table.albedo(wi, Polarization::Unpolarized).transmitted).abs() < 4.0 * standard_error);
//! # Ok::<(), bsdf::Error>(())
//! ```

pub mod ablation;
pub mod analytic;
pub mod angular_basis;
mod bsdf;
pub mod convert;
pub mod direction;
mod error;
pub mod formats;
pub mod json;
pub mod measured;
pub mod order_table;
pub mod ray_optics;
pub mod tensor_tree;
#[cfg(test)]
mod tests;
pub mod validate;

pub use ablation::{Binned, IncidenceMap, Mask, Masked, RemappedIncidence};
pub use analytic::{Lambertian, Mirror, SmoothInterface};
pub use bsdf::{
    Albedo, Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarization, PolarizedBsdf, Transport,
    s_axis,
};
pub use direction::Side;
pub use error::Error;
pub use measured::{LobeMotion, MeasuredBsdf};
pub use order_table::{EfficiencyRow, Grid, NodeId, OrderEfficiency, OrderTable, TableHeader};
pub use ray_optics::{Outline, Polygon, UnitCell};
