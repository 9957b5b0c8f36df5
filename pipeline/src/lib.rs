// SPDX-License-Identifier: MIT OR Apache-2.0
//! The program.

pub mod cli;
pub mod cli_errors;
pub mod commands;
pub mod convergence;
pub mod exit;
pub mod grating;
pub mod grating_case;
#[cfg(test)]
mod key_tables;
pub mod near_field;
pub mod output;
pub mod paper_figures;
pub mod ray_export;
pub mod rings;
