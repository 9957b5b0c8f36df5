// SPDX-License-Identifier: MIT OR Apache-2.0
//! The program `batwing`: its command line, and a file or a few for each command.
//!
//! In: words of a command line ([`cli::Cli`]). Out: files under the directory of results, one
//! result on standard output, an exit code ([`exit`]). The commands join the crates `design`,
//! `simulate`, `experiment`, `gratings`, `zones`, `report` and `formats`. The Python package calls
//! [`cli::Cli::run_until`].
//!
//! ```
//! use clap::Parser;
//! use pipeline::cli::{Cli, Command};
//! use pipeline::commands::job_record::SharedCommand;
//!
//! let cli = Cli::try_parse_from(["batwing", "run", "d1.toml", "--seed", "7"])?;
//! assert_eq!(cli.common.seed, 7);
//! assert!(matches!(cli.command, Command::Shared(SharedCommand::Run(_))));
//! # Ok::<(), clap::Error>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`cli`], [`cli_errors`], [`exit`] | options, messages, exit codes |
//! | [`commands`] | commands, and the records of shared jobs |
//! | [`paper_figures`] | Figures 3, 4 and 6 of the paper |
//! | [`ray_export`] | rays that leave a design, as a ray file |

pub mod cli;
pub mod cli_errors;
pub mod commands;
pub mod exit;
pub mod paper_figures;
pub mod ray_export;
