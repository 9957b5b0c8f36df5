// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rules of the workspace, and fuzz tests of the readers.

mod altered_files;
mod crate_borders;
mod import_cycles;
mod recipes;
mod release;
mod validation_report;
