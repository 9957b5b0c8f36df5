// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bodies that light meets: shapes and their crossings, what stands in what, packages traced many paths at a time.

mod apart;
mod axis;
mod common;
mod convoy;
mod crossing;
mod geometry;
mod housing;
mod leaks;
mod leaving;
mod lens;
mod mesh;
mod placed;
mod placed_crossing;
mod potted;
mod torus;
