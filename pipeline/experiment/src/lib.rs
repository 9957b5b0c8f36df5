// SPDX-License-Identifier: MIT OR Apache-2.0
//! Experiments with designs: many traces, each compared with the others.
//!
//! In comes a file in TOML that names a design and says what is varied; out go figures with their
//! errors, as [`results`] writes them down. An experiment traces by [`simulate::model_traces`], keeps
//! what it found to the bit in [`runtime::store`], so that it goes on where it was stopped, and deals
//! its traces to several processes by [`simulate::job`].
//!
//! ```
//! use experiment::checked_file::Texts;
//! use experiment::study;
//!
//! # fn main() -> anyhow::Result<()> {
//! let folder = tempfile::tempdir()?;
//! for (name, text) in design::EMBEDDED {
//!     std::fs::write(folder.path().join(name), text)?;
//! }
//! let path = folder.path().join("study.toml");
//! let text = r#"
//!     name = "angles"
//!     designs = ["d1.toml"]
//!     models = ["geometric"]
//!     [[factors]]
//!     name = "reflectance of the LED"
//!     key = "led.reflectance"
//!     values = [0.5, 0.9]
//! "#;
//! std::fs::write(&path, text)?;
//! let study = study::load(&path, &Texts::new(), Some(10_000))?;
//! // The base, and each level alone.
//! assert_eq!(study.setups.len(), 3);
//! # Ok(())
//! # }
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`study`] | set-ups from levels of factors: changes of figures, misfits to targets |
//! | [`tolerance`] | samples that deviate from a design: scatter, yield, contributors |
//! | [`optimise`] | searches for a design: variables, objective, stages, verification |
//! | [`checked_file`] | head of the three input files |
//! | [`description`] | kind and description of such a file |
//! | [`design_file`] | a design file in which keys are set |
//! | `paired_sum` | objectives and misfits with their replicates |
//! | [`ring_slopes`] | relief by the slopes of its rings |

pub mod checked_file;
pub mod description;
pub mod design_file;
mod linked_keys;
mod missing_figure;
pub mod optimise;
mod paired_sum;
pub mod ring_slopes;
pub mod study;
pub mod tolerance;
