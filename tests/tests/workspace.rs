// SPDX-License-Identifier: MIT OR Apache-2.0
//! The rules of the workspace, and readers that meet anything: borders of the crates, random files.

mod boundaries;
mod fuzz;
