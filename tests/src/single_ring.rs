// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the periodic cell of a ring leaves out: rings among their true neighbours, and single
//! teeth, against endless gratings.
//!
//! [`surface`] builds one period of a supercell that holds several rings, [`waves`] solves it for
//! every direction of some lines in the plane of wavevectors, [`effect`] says how far two such
//! results are apart. A supercell of K periods Λ has orders λ/(KΛ) apart; a grating of period Λ
//! meets the same directions on K lines. With orders -M..=M on each of these lines and
//! -(KM+(K-1)/2)..=KM+(K-1)/2 in the supercell both keep the same wavevectors, so that K equal
//! teeth give the grating's efficiencies but for rounding. K is odd throughout.

pub mod effect;
pub mod surface;
pub mod waves;
