// SPDX-License-Identifier: MIT OR Apache-2.0
//! Results for people: pictures, tables of text, one page of HTML.
//!
//! In: results data and the files that they list. Out: SVG and PNG, text for the terminal, a page
//! that needs no other file. Nothing is simulated here, and the same input gives the same bytes.
//!
//! ```
//! use metrics::quantity::{Curve, Quantity, Unit};
//! use report::plots::{FarField, Heading, LineColours, far_field_cartesian};
//!
//! let curve = Curve::new("Lambertian", vec![0.0, 60.0], vec![1.0, 0.5], vec![0.01; 2])?;
//! let picture = FarField {
//!     heading: &Heading::new("Far field", "a flat LED"),
//!     quantity: &Quantity::new("intensity", Unit::PerSteradian),
//!     curves: &[curve],
//!     colours: LineColours::Neutral,
//!     numbers: &[],
//!     peaks: &[],
//! };
//! assert!(far_field_cartesian(&picture)?.png()?.starts_with(b"\x89PNG"));
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`plots`] | far fields, maps, sections, bars, dots |
//! | [`path_picture`] | section of a package with paths of light |
//! | [`summary`], [`run_summary`] | tables of figures as text |
//! | [`html`] | the page |
//! | [`paper_figures`], [`published`] | figures of the paper, and how they join results |
//! | [`optimisation`], [`tolerance`], [`study`], [`convergence_study`], [`full_wave`] | pictures of these files |

pub mod convergence_study;
pub mod full_wave;
pub mod html;
pub mod optimisation;
pub mod paper_figures;
pub mod path_picture;
pub mod plots;
pub mod published;
pub mod run_summary;
pub mod study;
pub mod summary;
pub mod tolerance;
