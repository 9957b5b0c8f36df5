// SPDX-License-Identifier: MIT OR Apache-2.0
//! Statistics that the unit tests share.

pub(crate) mod chi_square;
