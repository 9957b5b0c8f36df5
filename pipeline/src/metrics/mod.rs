// SPDX-License-Identifier: MIT OR Apache-2.0
//! From what receivers counted to the figures a design is judged by.
//!
//! In: observations kept apart for the groups of paths a run is cut into ([`Grouped`]). Out: one [`Estimate`] per
//! figure, with its standard error. A figure is any function of the sums; its error comes from leaving
//! out one group at a time (jackknife), so that ratios, maxima and fitted angles need no error propagation
//! by hand. Reference: B. Efron, C. Stein, Ann. Stat. 9 (1981) 586.

pub mod estimate;
pub mod extraction;
pub mod far_field;
pub mod illuminance;
mod jackknife;
pub mod layout;
pub mod uniformity;
pub mod valley;

pub use estimate::Estimate;
pub use jackknife::{Grouped, changes, jackknife, spread};
