// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rigorous coupled-wave analysis of one-dimensional gratings, in any mount, from either side.
//!
//! A periodic relief goes in, the complex amplitude and the efficiency of every diffraction order come out. One
//! call solves one Bloch wavevector and returns all directions of incidence that share it, from both half-spaces
//! and in both polarisations. Conventions (axes, signs, polarisations, normalisation) are those of
//! `docs/explanation/conventions.md`.
//!
//! The way of the data: [`relief`] cuts a cross-section into layers, [`fourier`] and [`factorization`] turn a layer
//! into matrices, [`modes`] finds its eigenmodes, [`stack`] joins the layers, [`scattering`] reads off the orders,
//! [`hemisphere`] and [`convergence`] do so for whole hemispheres and to a stated tolerance.
//!
//! ```
//! use num_complex::Complex64;
//! use rcwa::relief::{Polygon, Relief};
//! use rcwa::{Bloch, Pol, Side, Stack, Truncation, solve};
//!
//! // A silicone sawtooth of 1 µm period and 0.3 µm height, light from the silicone at 20°.
//! let (silicone, air) = (Complex64::new(1.41, 0.0), Complex64::new(1.0, 0.0));
//! let tooth = Polygon { index: silicone, points: vec![[0.0, 0.0], [1.0, 0.0], [0.9, 0.3]] };
//! let relief = Relief::new(1.0, 0.3, air, vec![tooth])?;
//! let stack = Stack::new(0.55, 1.0, silicone, air, relief.slices(32))?;
//! let bloch = Bloch::from_angles(&stack, Side::Top, 20f64.to_radians(), 0.0);
//! let scattering = solve(&stack, bloch, Truncation::new(12)?)?;
//!
//! let transmitted: f64 =
//!     scattering.orders(Side::Bottom).map(|m| scattering.efficiency((Side::Top, 0, Pol::S), (Side::Bottom, m))).sum();
//! let reflected: f64 =
//!     scattering.orders(Side::Top).map(|m| scattering.efficiency((Side::Top, 0, Pol::S), (Side::Top, m))).sum();
//! assert!((transmitted + reflected - 1.0).abs() < 1e-12);
//! # Ok::<(), rcwa::Error>(())
//! ```
#![forbid(unsafe_code)]

pub mod convergence;
pub mod cost_model;
pub mod error;
mod expansion;
pub mod factorization;
pub mod field;
pub mod fourier;
pub mod hemisphere;
pub mod incidence_grid;
pub mod jones;
mod linalg;
pub mod material;
pub mod modes;
pub mod orders;
mod progress;
mod real_basis;
pub mod relief;
pub mod scattering;
pub mod solve;
pub mod stack;
mod wave;

pub use error::Error;
pub use jones::Jones;
pub use orders::{Bloch, SymmetricBloch, Truncation};
pub use progress::{Progress, no_progress};
pub use scattering::Scattering;
pub use solve::{solve, solve_from_top, solve_line, solve_symmetric_line};
pub use stack::Stack;
pub use wave::{Pol, Side};
