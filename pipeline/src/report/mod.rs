// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a run leaves behind: files for programs, pictures and tables for people.
//!
//! In: plain data ([`data`]) that the caller fills from receivers and metrics. Out: EXR images ([`exr`], [`layers`]), `.npy` and CSV
//! tables ([`table`]), PNG pictures ([`plots`]), the table of results ([`summary`]) a page that shows them all ([`html`]) and the drawing of single paths ([`path_picture`]). Every file is written under a
//! temporary name and renamed ([`atomic`]), so that no reader ever meets half of one. The same input gives the same bytes.

pub mod data;
pub mod exr;
pub mod html;
pub mod layers;
pub mod path_picture;
pub mod plots;
pub mod summary;
pub mod table;
