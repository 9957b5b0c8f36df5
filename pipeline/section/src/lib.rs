// SPDX-License-Identifier: MIT OR Apache-2.0
//! The section of a dome in two dimensions by three models: rays on the relief, the hybrid, and
//! Maxwell's equations.
//!
//! In: a dome with rings of relief, scaled to a number of rings that full wave can hold, on a
//! perfect mirror, with isotropic line sources inside. Out: the share of the emitted power in bins
//! of the far field, by each model, with its error. Light and structure do not change along y, so
//! that the three models differ in nothing but the treatment of the surface. Full wave is
//! [`full_wave`]; the hybrid samples the tables of [`bsdf`] with the orders that [`rcwa`] solves
//! for the rings' own chords, as a run does.
//!
//! | module | content |
//! |---|---|
//! | [`dome`] | the scaled section, as an outline and as surfaces for rays |
//! | [`tables`] | one table a ring and polarisation, for light in the plane |
//! | [`trace`] | rays in the plane |
//! | [`compare`] | far fields of the models and the distances between them |
//! | [`sets`] | shares by set of sources, and errors from their scatter |

pub mod compare;
pub mod dome;
pub mod sets;
pub mod tables;
pub mod trace;
