// SPDX-License-Identifier: MIT OR Apache-2.0
//! Results for people: pictures ([`plots`], [`path_picture`]), the table of results ([`summary`])
//! and one page of HTML that shows them all ([`html`]). The same input gives the same bytes.

pub mod convergence_study;
pub mod html;
pub mod optimisation;
pub mod path_picture;
pub mod plots;
pub mod run_summary;
pub mod summary;
pub mod tolerance;
