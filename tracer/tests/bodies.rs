// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bodies that light meets: shapes and their crossings, what stands in what, packages traced many
//! paths at a time.

mod axis;
mod batch;
mod common;
mod crossing;
mod geometry;
mod gjk;
mod housing;
mod leaks;
mod leaving;
mod mesh;
mod nested;
mod placed;
mod placed_crossing;
mod torus;
