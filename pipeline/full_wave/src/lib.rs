// SPDX-License-Identifier: MIT OR Apache-2.0
//! Full wave in two dimensions: line sources in a dielectric body of any outline of lines and
//! arcs, alone or on a perfect mirror, by boundary integral equations.
//!
//! In: an [`Outline`], wavelength, two indices, sources. Out: the power that each source emits,
//! its far field and the power by angle, in TE and TM. Structure and light do not change along y.
//!
//! Green's theorem for both media and the sum of its limits on the outline give Müller's two
//! equations of the second kind \[Mueller1969\] for the field and its normal derivative. Panels of 16
//! Gauss-Legendre nodes hold both; the logarithm of the kernels is split off \[Helsing2008\], and
//! corners are compressed \[Helsing2013\]. A mirror is an image of the outline; a body that is
//! symmetric in x is solved for even and odd light apart. Of a large body, tiles of some forty panels are
//! solved by themselves, and one dense matrix couples the few unknowns by which they act on each
//! other \[Martinsson2005\]. Nothing is cut into layers, nothing is
//! expanded in orders and no power is balanced by construction: what a source emits and what
//! arrives far away are computed by themselves.
//!
//! ```
//! use full_wave::{Body, Outline, Polarisation, Resolution};
//! use std::f64::consts::{FRAC_PI_2, PI};
//!
//! // Half a cylinder of 2 µm on a mirror, and a source 0.8 µm above it.
//! let outline = Outline::on_mirror([2.0, 0.0]).arc_to([-2.0, 0.0], PI);
//! let body = Body::new(&outline, 0.55, [1.41, 1.0], Resolution::default())?;
//! let field = body.solve(Polarisation::Te, &[[0.0, 0.8]])?;
//! let (emitted, radiated) = (field.emitted()[0], field.bins(&[-FRAC_PI_2, FRAC_PI_2])[0][0]);
//! assert!((emitted - radiated).abs() < 1e-9 * emitted);
//! # Ok::<(), full_wave::FullWaveError>(())
//! ```
//!
//! | module | content |
//! |---|---|
//! | `outline` | lines and arcs, their symmetry and what is wrong with them |
//! | `mesh` | panels, corners and images |
//! | `kernel` | kernels between two points, without cancellation |
//! | `panel` | kernels between two panels |
//! | `compression` | compressed inverse of a corner |
//! | `body` | a body, its sources and what its solution costs |
//! | `coupling` | kernels between parts of the outline, with all images |
//! | `tile` | tiles of the outline, and the unknowns by which each acts on the others |
//! | `reduced` | the equations reduced to these unknowns, in single precision |
//! | `lu` | factors of a dense matrix |
//! | `system` | error by exact equations, refinement in double precision |
//! | `field` | emitted power and far field |
//! | `quadrature`, `bessel` | rules of 16 nodes; Bessel functions |

pub mod bessel;
mod body;
mod compression;
mod coupling;
mod equations;
mod error;
mod field;
mod kernel;
mod lu;
mod mesh;
mod outline;
mod panel;
mod quadrature;
mod reduced;
mod system;
mod tile;

pub use body::{Body, Cost, Polarisation, Resolution};
pub use error::FullWaveError;
pub use field::Field;
pub use outline::{Curve, Outline};
