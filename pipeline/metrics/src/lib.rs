// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of merit from receiver sums, with jackknife errors.
//!
//! Observations are kept apart for the groups of paths of a run ([`Grouped`]). A figure is any
//! function of their sums, and becomes an [`Estimate`] with its standard error by leaving out one
//! group at a time (jackknife). Ratios, maxima and fitted angles so need no error propagation by
//! hand. Reference: B. Efron, C. Stein, Ann. Stat. 9 (1981) 586.

mod bounds;
pub mod colour_difference;
pub mod colour_matching;
pub mod columns;
pub mod digits;
pub mod estimate;
pub mod extraction;
pub mod far_field;
pub mod figures;
pub mod illuminance;
mod jackknife;
mod jackknifed_figure;
pub mod layout;
pub mod photopic;
pub mod plural;
pub mod quantity;
pub mod uniformity;
pub mod uniformity_forms;
pub mod valley;

pub use bounds::Bounds;
pub use estimate::Estimate;
pub use jackknife::{Grouped, changes, jackknife, spread};
pub use jackknifed_figure::JackknifedFigure;
