// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rules of the workspace, and altered files against every reader.

mod altered_files;
mod crate_borders;
