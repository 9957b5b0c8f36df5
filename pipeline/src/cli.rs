// SPDX-License-Identifier: MIT OR Apache-2.0
//! The command line. `--threads`, `--seed`, `--quiet` and `--json` mean the same in every command.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use rcwa::convergence::{LARGEST_TOLERANCE, SMALLEST_TOLERANCE};

use crate::cli_errors::whole;
use crate::config::design::PATHS;
use crate::stages::rings::RingChoice;
use crate::stages::stopping_rule::Target;

/// From the design file of a micro-structured LED package to its light: relief, RCWA, BSDF, ray trace, metrics.
#[derive(Debug, Parser)]
#[command(
    name = "batwing",
    version,
    about,
    after_help = "Example: batwing reproduce --quick"
)]
pub struct Cli {
    /// What holds for every command.
    #[command(flatten)]
    pub common: Common,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// Arguments of every command.
#[derive(Debug, Clone, Copy, Args)]
pub struct Common {
    /// Threads to compute with; results do not depend on it [default: all processors]
    #[arg(long, global = true, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=1024_u16))]
    pub threads: Option<u16>,
    /// Seed of every random number; the same seed gives the same results to the last bit
    #[arg(long, global = true, value_name = "S", default_value_t = 1, allow_negative_numbers = true, value_parser = whole(0..=u64::MAX))]
    pub seed: u64,
    /// No progress and no tables: only errors, warnings and what --json asks for
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Results as JSON on standard output
    #[arg(long, global = true)]
    pub json: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Compute the paper's tables and figures from nothing
    #[command(after_help = "Example: batwing reproduce --quick --out results-quick")]
    Reproduce(Reproduce),
    /// Trace one design
    #[command(
        after_help = "Example: batwing run data/designs/d1.toml --model geometric --out results-d1"
    )]
    Run(Run),
    /// Compute the tables of diffraction orders of a design
    #[command(
        after_help = "Example: batwing bsdf data/designs/d2.toml --rings 5,75,165 --tolerance 1e-3 --out tables-d2"
    )]
    Bsdf(Bsdf),
    /// Show error and cost of a ring's solution against orders kept and against slices
    #[command(
        after_help = "Example: batwing converge data/designs/d1.toml --ring 75 --out convergence"
    )]
    Converge(Converge),
    /// Map the near field of a ring: |E|² and the flow of power
    #[command(
        after_help = "Example: batwing field data/designs/d1.toml --ring 75 --theta-deg 30 --pol p --out fields"
    )]
    Field(Field),
    /// Vary keys of designs and rank the set-ups by how near their figures come to targets
    #[command(after_help = "Example: batwing study data/studies/readings.toml --out study")]
    Study(Study),
    /// Solve one grating and print every order as JSON
    #[command(after_help = "Example: batwing grating case.json")]
    Grating(Grating),
    /// Write a design, a table or a far field in a format of other programs
    #[command(
        after_help = "Example: batwing export tables/D1-ring-075.bworders --format klems --out ring-075.xml"
    )]
    Export(crate::commands::export::Arguments),
    /// Read a file of another program, check it, say what it holds, and convert it
    #[command(after_help = "Example: batwing import led.ldt --out led.ies")]
    Import(crate::commands::import::Arguments),
    /// Show a folder of results as one HTML page
    #[command(after_help = "Example: batwing report results --out results.html")]
    Report(crate::commands::report::Arguments),
    /// Draw a package's cross-section with traced paths, and write the paths as JSON
    #[command(after_help = "Example: batwing rays data/designs/d1.toml --count 100 --out rays")]
    Rays(crate::commands::rays::Arguments),
    /// Check a design file, or a table, and say what it describes
    #[command(after_help = "Example: batwing check data/designs/d3.toml")]
    Check(Check),
}

/// `batwing reproduce`.
#[derive(Debug, Args)]
pub struct Reproduce {
    /// Coarser tables and fewer rays, in under 90 seconds; the results say so
    #[arg(long)]
    pub quick: bool,
    /// Directory for results
    #[arg(long, value_name = "DIR", default_value = "results")]
    pub out: PathBuf,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// Ways to compute a design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModelChoice {
    /// Rays on the relief as designed.
    Geometric,
    /// Rays on the relief in the hybrid's finer steps.
    Fine,
    /// Rays, with the relief as a BSDF by geometric optics.
    Control,
    /// Rays, with the relief as a BSDF by RCWA.
    Hybrid,
    /// Everything that the design allows.
    All,
}

/// `batwing run`.
#[derive(Debug, Args)]
pub struct Run {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// How to compute it
    #[arg(long, value_enum, default_value = "all")]
    pub model: ModelChoice,
    /// Paths to trace, instead of the design's trace.paths
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(PATHS))]
    pub paths: Option<u64>,
    /// Trace further batches of as many paths until the standard error of a figure is at most this
    #[arg(long, value_name = "FIGURE=ERROR")]
    pub until_error: Option<Target>,
    /// With --until-error: begin no batch that would go beyond so many paths
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2_000_000_000,
        allow_negative_numbers = true,
        value_parser = whole(PATHS),
        requires = "until_error"
    )]
    pub most_paths: u64,
    /// Directory for results
    #[arg(long, value_name = "DIR", default_value = "results")]
    pub out: PathBuf,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// `batwing bsdf`.
#[derive(Debug, Args)]
pub struct Bsdf {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Rings: numbers from 1, `representatives` (one for each band) or `all`, each from its own cell
    #[arg(
        long,
        value_name = "75|5,75,165|representatives|all",
        default_value = "representatives"
    )]
    pub rings: RingChoice,
    /// Largest error of a direction's R or T, instead of the design's hybrid.tolerance
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = tolerance)]
    pub tolerance: Option<f64>,
    /// Directory for the tables
    #[arg(long, value_name = "DIR", default_value = "tables")]
    pub out: PathBuf,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the tables]
    #[arg(long, value_name = "DIR", conflicts_with = "no_cache")]
    pub cache: Option<PathBuf>,
    /// Compute everything, and keep nothing but the tables themselves
    #[arg(long)]
    pub no_cache: bool,
}

/// A tolerance that the solver accepts.
fn tolerance(text: &str) -> Result<f64, String> {
    let range = SMALLEST_TOLERANCE..=LARGEST_TOLERANCE;
    text.parse()
        .ok()
        .filter(|t| range.contains(t))
        .ok_or_else(|| {
            format!("expected a number from {SMALLEST_TOLERANCE:e} to {LARGEST_TOLERANCE}")
        })
}

/// `batwing converge`.
#[derive(Debug, Args)]
pub struct Converge {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Ring, from 1
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub ring: usize,
    /// Highest orders to try, such as 30,40,60 [default: from what propagates to nearly twice that]
    #[arg(
        long,
        value_name = "LIST",
        allow_negative_numbers = true,
        value_delimiter = ','
    )]
    pub orders: Option<Vec<usize>>,
    /// Numbers of slices to try [default: from 1 to 14 per wavelength of depth]
    #[arg(
        long,
        value_name = "LIST",
        allow_negative_numbers = true,
        value_delimiter = ','
    )]
    pub slices: Option<Vec<usize>>,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "convergence")]
    pub out: PathBuf,
}

/// Sides that light comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IncidentSide {
    /// The silicone.
    Inner,
    /// The air.
    Outer,
}

/// Polarisations, as in `docs/explanation/conventions.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IncidentPol {
    /// E across the plane of incidence.
    S,
    /// H across it.
    P,
}

/// `batwing field`.
#[derive(Debug, Args)]
pub struct Field {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Ring, from 1
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub ring: usize,
    /// Side that the light comes from
    #[arg(long, value_enum, default_value = "inner")]
    pub side: IncidentSide,
    /// Angle to the normal of the ring's chord, above -90 and below 90
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true, value_parser = polar_angle)]
    pub theta_deg: f64,
    /// Azimuth from the meridian
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub phi_deg: f64,
    /// Polarisation
    #[arg(long, value_enum, default_value = "s")]
    pub pol: IncidentPol,
    /// Periods to show
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = whole(1..=20_u8))]
    pub periods: u8,
    /// How far to look into both half-spaces, in µm [default: two wavelengths or a quarter of the relief]
    #[arg(long, value_name = "UM", allow_negative_numbers = true, value_parser = finite)]
    pub margin_um: Option<f64>,
    /// Highest order to keep [default: half as many again as propagate]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub orders: Option<usize>,
    /// Slices of the relief [default: 24 to a wavelength]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub slices: Option<usize>,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "fields")]
    pub out: PathBuf,
}

/// `batwing study`.
#[derive(Debug, Args)]
pub struct Study {
    /// Study file
    #[arg(value_name = "STUDY.toml")]
    pub study: PathBuf,
    /// Paths of each trace, instead of those of the study or its designs
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(PATHS))]
    pub paths: Option<u64>,
    /// Directory for the results
    #[arg(long, value_name = "DIR", default_value = "study")]
    pub out: PathBuf,
    /// Directory that keeps tables and traces for later runs [default: .batwing-cache beside the results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v: &f64| v.is_finite());
    number.ok_or_else(|| "expected a finite number".to_owned())
}

fn polar_angle(text: &str) -> Result<f64, String> {
    let angle = finite(text).ok().filter(|v| v.abs() < 90.0);
    angle.ok_or_else(|| "expected an angle above -90 and below 90 degrees".to_owned())
}

/// `batwing grating`.
#[derive(Debug, Args)]
pub struct Grating {
    /// Case file
    #[arg(value_name = "CASE.json")]
    pub case: PathBuf,
}

/// `batwing check`.
#[derive(Debug, Args)]
pub struct Check {
    /// Design file, or a table written by `batwing bsdf` (.bworders)
    #[arg(value_name = "DESIGN.toml")]
    pub file: PathBuf,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn every_command_has_one_example() {
        let cli = Cli::command();
        cli.clone().debug_assert();
        for command in cli.get_subcommands() {
            let help = command
                .get_after_help()
                .map(ToString::to_string)
                .unwrap_or_default();
            assert_eq!(
                help.matches("batwing ").count(),
                1,
                "help of {}: {help}",
                command.get_name()
            );
            assert!(help.contains(command.get_name()));
        }
    }

    #[test]
    fn tolerances_out_of_range_and_rings_that_are_none_are_refused() {
        for (argument, value, good) in [
            ("--tolerance", "1e-3", true),
            ("--tolerance", "0", false),
            ("--tolerance", "0.2", false),
            ("--tolerance", "nan", false),
            ("--rings", "5,75,165", true),
            ("--rings", "all", true),
            ("--rings", "0", false),
            ("--rings", "some", false),
        ] {
            let line = ["batwing", "bsdf", "d.toml", argument, value];
            assert_eq!(Cli::try_parse_from(line).is_ok(), good, "{line:?}");
        }
        for (theta, good) in [("-40", true), ("90", false), ("nan", false)] {
            let line = [
                "batwing",
                "field",
                "d.toml",
                "--ring",
                "7",
                "--theta-deg",
                theta,
            ];
            assert_eq!(Cli::try_parse_from(line).is_ok(), good, "{line:?}");
        }
        let both = ["batwing", "bsdf", "d.toml", "--no-cache", "--cache", "c"];
        assert!(Cli::try_parse_from(both).is_err());
    }

    #[test]
    fn common_arguments_go_before_and_after_the_command() {
        for line in [
            ["batwing", "--seed", "7", "--json", "check", "d.toml"],
            ["batwing", "check", "d.toml", "--seed", "7", "--json"],
        ] {
            let cli = Cli::try_parse_from(line).expect("valid");
            assert_eq!((cli.common.seed, cli.common.json), (7, true));
        }
    }
}
