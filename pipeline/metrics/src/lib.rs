// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of merit from receiver sums, with jackknife errors, quantities and units.
//!
//! In: power in bins, for each group of the paths of a run ([`Grouped`]). Out: figures as
//! [`Estimate`]s. A figure is any function of the sums; its standard error comes from leaving out
//! one group at a time (jackknife), so ratios, maxima and fitted angles need no error propagation by
//! hand. Reference: B. Efron, C. Stein, Ann. Stat. 9 (1981) 586.
//!
//! ```
//! use metrics::{Grouped, jackknife};
//!
//! // Emitted and absorbed power in four groups of paths.
//! let groups = [[1.0, 0.1], [1.0, 0.2], [1.0, 0.1], [1.0, 0.2]];
//! let power = Grouped::new(groups.map(Vec::from).to_vec());
//! let absorbed = jackknife(&power, |sum| sum[1] / sum[0]);
//! assert!((absorbed.value - 0.15).abs() < 1e-12);
//! assert!((absorbed.standard_error - 0.0289).abs() < 1e-4);
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`figures`] | registry: key, label, unit, comparison, meaning of every figure |
//! | [`far_field`] | intensity over angle, peak angle, centre/peak |
//! | [`illuminance`], [`lit`], [`layout`] | maps on the plane, lit parts of bins, places of the LEDs |
//! | [`uniformity`], [`uniformity_forms`], [`valley`] | uniformity in all forms, minimum of a noisy map |
//! | [`extraction`] | extraction efficiency, ends of light |
//! | [`chromaticity`], [`colour_matching`], [`photopic`] | u', v', colour temperature; CIE tables |
//! | [`colour_difference`], [`colour_regions`], [`colour_map`] | colour over cell, angle and maps |
//! | [`gamut`], [`itp`], [`transfer`] | primaries and what they reach, ΔE_ITP, levels of pictures |
//! | [`glare`] | light that the eye scatters over a display |
//! | [`dimming`] | panel before a backlight, spread of a zone's light |
//! | [`bins`] | mean and extremes over the bins of a receiver |
//! | [`estimate`], [`hits`] | value with standard error, bound of a sum that no path reached |
//! | [`quantity`] | maps, curves and axes with units |
//! | [`kinds`] | weighting, polarisation, kinds of receiver |
//! | [`digits`], [`plural`] | numbers and counts for people |
//! | [`columns`] | two columns of text as numbers |

pub mod bins;
mod bounds;
pub mod chromaticity;
pub mod colour_difference;
pub mod colour_map;
pub mod colour_matching;
pub mod colour_regions;
pub mod columns;
pub mod digits;
pub mod dimming;
pub mod estimate;
pub mod extraction;
pub mod far_field;
pub mod figures;
pub mod gamut;
pub mod glare;
mod halves;
pub mod hits;
pub mod illuminance;
pub mod itp;
mod jackknife;
mod jackknifed_figure;
pub mod kinds;
pub mod layout;
pub mod lit;
pub mod photopic;
pub mod plural;
pub mod quantity;
mod sample;
mod sampled;
pub mod transfer;
pub mod uniformity;
pub mod uniformity_forms;
pub mod valley;

pub use bounds::Bounds;
pub use estimate::Estimate;
pub use jackknife::{Grouped, jackknife, spread, without_group, without_noise};
pub use jackknifed_figure::JackknifedFigure;
