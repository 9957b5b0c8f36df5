// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rigorous coupled-wave analysis (RCWA) of one-dimensional gratings, in any mount, from either
//! side.
//!
//! A periodic relief goes in; the complex amplitude and the efficiency of every diffraction order
//! come out. The recipe is [`reference`](mod@reference), on one screen; everything else is this,
//! faster. One call solves one Bloch wavevector: all directions of incidence that share it, from
//! both half-spaces and in both polarisations.
//!
//! # A first grating
//!
//! ```
//! use num_complex::Complex64;
//! use rcwa::relief::{Polygon, Relief};
//! use rcwa::{Bloch, Pol, Side, Stack, Truncation, solve};
//!
//! // A silicone sawtooth of 1 µm period and 0.3 µm height, cut into 32 slices.
//! let (silicone, air) = (Complex64::new(1.41, 0.0), Complex64::new(1.0, 0.0));
//! let tooth = Polygon { index: silicone, points: vec![[0.0, 0.0], [1.0, 0.0], [0.9, 0.3]] };
//! let relief = Relief::new(1.0, 0.3, air, vec![tooth])?;
//! let stack = Stack::new(0.55, 1.0, silicone, air, relief.slices(32))?;
//!
//! // Light from the silicone at 20°, in the plane of incidence; orders -12..=12 are kept.
//! let bloch = Bloch::from_angles(&stack, Side::Top, 20f64.to_radians(), 0.0);
//! let scattering = solve(&stack, bloch, Truncation::new(12)?)?;
//!
//! let incident = (Side::Top, 0, Pol::S);
//! for order in scattering.orders(Side::Bottom) {
//!     let efficiency = scattering.efficiency(incident, (Side::Bottom, order));
//!     assert!((0.0..=1.0).contains(&efficiency));
//! }
//! let transmitted = scattering.total(incident, Side::Bottom);
//! let reflected = scattering.total(incident, Side::Top);
//! assert!((transmitted + reflected - 1.0).abs() < 1e-12);
//! # Ok::<(), rcwa::Error>(())
//! ```
//!
//! # Where to go next
//!
//! | task | item |
//! |---|---|
//! | several angles along the grooves at once | [`solve_line`], [`solve_symmetric_line`] |
//! | polarised light, phases | [`Scattering::amplitude`], [`Scattering::jones`] |
//! | usual profiles | [`relief::shapes`] |
//! | refractive indices with dispersion and loss | [`material`] |
//! | a list of directions | [`lines`] |
//! | orders and slices for a tolerance | [`accuracy`] |
//! | all directions of both hemispheres | [`hemisphere`](mod@hemisphere), [`incidence_grid`] |
//! | time and memory of a table | [`cost_model`] |
//! | what is refused for its memory or work | [`guard`] |
//! | fields inside and near the grating | [`field`](mod@field) |
//!
//! # Conventions
//!
//! Fields vary as exp(-iωt), so that an index n + ik with k ≥ 0 absorbs. z points from the top
//! half-space to the bottom one, x along the grating vector, y along the grooves. Wavevectors are
//! in units of k0. Axes, signs, polarisations and normalisation: `docs/explanation/conventions.md`.
//!
//!
//! # How it works
//!
//! Layers to Fourier coefficients, to Toeplitz matrices, to eigenmodes, to S-matrices, to
//! efficiencies: [`reference`](mod@reference) is this recipe on one screen, and everything else is
//! this, faster. [`relief`] cuts a cross-section into layers. `fourier` and `factorization` turn a
//! layer into matrices. `modes` finds its eigenmodes, `stack` joins the layers from the bottom up,
//! and [`scattering`] reads off the orders. Equations in comments carry the numbers of
//! `docs/explanation/theory.md`.
#![forbid(unsafe_code)]

pub mod accuracy;
pub mod cost_model;
pub mod error;
mod expansion;
mod factorization;
pub mod field;
mod fourier;
pub mod guard;
pub mod hemisphere;
pub mod incidence_grid;
pub mod jones;
mod linalg;
pub mod lines;
pub mod material;
mod modes;
pub mod orders;
mod progress;
mod real_basis;
pub mod reference;
pub mod relief;
pub mod scattering;
pub mod solve;
mod stack;
mod wave;

pub use error::Error;
pub use jones::Jones;
pub use orders::{Bloch, SymmetricBloch, Truncation};
pub use progress::{Progress, no_progress};
pub use scattering::Scattering;
pub use solve::{solve, solve_line, solve_symmetric_line};
pub use stack::Stack;
pub use wave::{Pol, Side};

/// The first program of `README.md`, as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
