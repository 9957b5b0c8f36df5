// SPDX-License-Identifier: MIT OR Apache-2.0
//! Supercells: rings among their true neighbours and single teeth, against periodic gratings.
//!
//! [`surface`] builds one period of a supercell of several rings. [`waves`] solves it for every
//! direction on some lines in the plane of wavevectors. [`effect`] gives the distance of two such
//! results. A supercell of K periods Λ has orders λ/(KΛ) apart; a grating of period Λ meets the
//! same directions on K lines. With orders -M..=M on each of these lines and
//! -(KM+(K-1)/2)..=KM+(K-1)/2 in the supercell both keep the same wavevectors, so that K equal
//! teeth give the grating's efficiencies but for rounding. K is odd throughout.

pub mod effect;
pub mod surface;
pub mod waves;
