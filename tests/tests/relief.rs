// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of relief, and rings by waves and by rays against each other.

mod boundary_integral;
mod chain;
mod contrast;
mod control;
mod matrices;
mod reciprocity;
mod second_opinion;
mod single_ring;
mod tables;
