// SPDX-License-Identifier: MIT OR Apache-2.0
//! One surface between two media, by boundary integral equations, in the classical mount (ky = 0).
//!
//! In: a period of the surface ([`Outline`], also made from a [`Relief`](rcwa::relief::Relief)),
//! wavelength, two indices n + ik, kx0. Out: the efficiencies of all orders that carry power, for light
//! by each of those that propagate, from both sides, in TE (`Pol::S`) and TM (`Pol::P`). Conventions
//! are those of `docs/explanation/conventions.md`.
//!
//! By Green's theorem the field in a homogeneous medium is an integral over its boundary of the
//! field and its normal derivative, with the medium's quasi-periodic Green's function; the limit on
//! the boundary, from both media, makes two equations for two unknown functions of one variable
//! \[Petit1980\]. They are solved at quadrature nodes that crowd at corners \[Kress1990\], with a
//! rule of their own for the logarithm of the Green's function \[Kress1991\]. Nothing is cut into
//! layers and nothing is expanded in modes or in orders. So metals in TM, where orders take hundreds,
//! converge as fast as all else; and the method shares with RCWA no more than the points of a relief
//! and the names of sides and polarisations, and fails, if it fails, for other reasons: the sum of all
//! efficiencies is not 1 by construction but as closely as the solution is accurate
//! ([`Solution::worst_balance`]).
//!
//! What is not solved is refused: a third medium, bodies apart from the surface, an order exactly at
//! its cut-off.
//!
//! ```
//! use gratings::boundary_integral::{Fineness, Grating, Outline};
//! use rcwa::{Pol, Side};
//!
//! // Level treads of 2 µm and upright risers of 1 µm, on their chord; light from the silicone at 20°.
//! let period = 5f64.sqrt();
//! let steps = Outline::corners(period, &[[0.0, 0.0], [0.8 * period, 0.4 * period]])?;
//! let grating = Grating::new(steps, 0.55, 1.41, 1.0)?;
//! let solution = grating.solve(1.41 * 20f64.to_radians().sin(), Fineness::default())?;
//!
//! let light = (Side::Top, 0, Pol::P);
//! let straight_on = solution.efficiency(light, (Side::Bottom, 0));
//! let balance = solution.total(light, Side::Top) + solution.total(light, Side::Bottom) - 1.0;
//! assert!(straight_on > 0.0 && balance.abs() < 1e-9);
//! # Ok::<(), gratings::boundary_integral::IntegralError>(())
//! ```

mod contact;
mod corner;
mod cylinder;
mod error;
mod kernel;
mod lattice;
mod nodes;
mod outline;
mod search;
mod sides;
mod solution;
mod solve;
mod trace;

pub use error::IntegralError;
pub use nodes::Fineness;
pub use outline::Outline;
pub use search::Converged;
pub use solution::{Order, Solution};
pub use solve::Grating;
