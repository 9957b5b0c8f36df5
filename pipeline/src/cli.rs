// SPDX-License-Identifier: MIT OR Apache-2.0
//! The command line: options of every command, the list of commands, and which function runs each.

use std::path::Path;

use anyhow::{Context, Result, bail};
use clap::{Args, CommandFactory, Parser, Subcommand};
use serde_json::Value;

use design::Design;
use experiment::checked_file::Texts;
use runtime::interrupt::Interrupt;
use runtime::progress::Console;
use runtime::run_context::RunContext;
use simulate::scene_check;

use crate::commands::arguments::{negative_numbers, whole};
use crate::commands::check::{self, CheckArgs};
use crate::commands::converge::{self, ConvergeArgs};
use crate::commands::explore::{self, ExploreArgs};
use crate::commands::export::{self, ExportArgs};
use crate::commands::full_wave::{self, FullWaveArgs};
use crate::commands::grating::{self, GratingArgs};
use crate::commands::import::{self, ImportArgs};
use crate::commands::job_record::SharedCommand;
use crate::commands::near_field::{self, NearFieldArgs};
use crate::commands::new::{self, NewArgs};
use crate::commands::rays::{self, RaysArgs};
use crate::commands::report::{self, ReportArgs};
use crate::commands::run;
use crate::commands::schema::{self, SchemaArgs};
use crate::commands::shards::{self, MergeArgs, PlanArgs, SubmitArgs};
use crate::commands::shell::{self, CompletionsArgs, ManArgs};
use crate::commands::zones::{self, ZonesArgs};
use output::in_memory::ModelArrays;

/// From the design file of a micro-structured LED package to its light: relief, RCWA, BSDF, ray
/// trace, metrics.
#[derive(Debug, Parser)]
#[command(
    name = "batwing",
    version,
    about,
    after_help = "Example: batwing reproduce --quick",
    mut_subcommands = negative_numbers
)]
pub struct Cli {
    /// Options of every command.
    #[command(flatten)]
    pub common: Common,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every command; each means the same everywhere.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Options of every command")]
pub struct Common {
    /// Threads to compute with; results do not depend on it [default: all processors]
    #[arg(
        long,
        global = true,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = whole(1..=1024_u16)
    )]
    pub threads: Option<u16>,
    /// Seed of every random number; the same seed gives the same results to the last bit
    #[arg(
        long,
        global = true,
        value_name = "S",
        default_value_t = 1,
        allow_negative_numbers = true,
        value_parser = whole(0..=u64::MAX)
    )]
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
    /// Write a commented design to start from
    #[command(after_help = "Example: batwing new my-package")]
    New(NewArgs),
    /// The commands whose work may be shared.
    #[command(flatten)]
    Shared(SharedCommand),
    /// Turn the numbers of a design in a page on this machine, and see its light at once
    #[command(after_help = "Example: batwing explore data/designs/d1.toml")]
    Explore(ExploreArgs),
    /// Show error and cost of a ring's solution against orders kept and against slices
    #[command(
        after_help = "Example: batwing converge data/designs/d1.toml --ring 75 --out convergence"
    )]
    Converge(ConvergeArgs),
    /// Map the near field of a ring: |E|² and the flow of power
    #[command(
        alias = "field",
        after_help = "Example: batwing near-field data/designs/d1.toml --ring 75 --theta-deg 30 --pol p --out fields"
    )]
    NearField(NearFieldArgs),
    /// Compare the section of a dome by rays, hybrid and full wave
    #[command(
        after_help = "Example: batwing full-wave data/designs/d1.toml --rings 3 --out full-wave-d1"
    )]
    FullWave(FullWaveArgs),
    /// Add up dimming zones of a backlight, and show a picture on a panel before it
    #[command(
        after_help = "Example: batwing zones backlight.toml --zones 3x2 --pattern pattern.csv --out zones"
    )]
    Zones(ZonesArgs),
    /// Show the shards of a job, which several processes share, and what each costs
    #[command(after_help = "Example: batwing plan --shards 8 -- reproduce --quick --out results")]
    Plan(PlanArgs),
    /// Write the scripts of a job for SLURM, and submit them with --go
    #[command(
        after_help = "Example: batwing submit --slurm --shards 64 --go -- reproduce --out results"
    )]
    Submit(SubmitArgs),
    /// Put the shards of a job together
    #[command(after_help = "Example: batwing merge results")]
    Merge(MergeArgs),
    /// Solve one grating and print every order as JSON
    #[command(after_help = "Example: batwing grating case.json")]
    Grating(GratingArgs),
    /// Write a design, a table or a far field in a format of other programs
    #[command(
        after_help = "Example: batwing export tables/D1-ring-075.bworders --format klems --out ring-075.xml"
    )]
    Export(ExportArgs),
    /// Read a file of another program, check it, say what it holds, and convert it
    #[command(after_help = "Example: batwing import led.ldt --out led.ies")]
    Import(ImportArgs),
    /// Print the JSON Schema of an input file, by which editors complete and check it
    #[command(after_help = "Example: batwing schema > design.schema.json")]
    Schema(SchemaArgs),
    /// Show a folder of results as one HTML page
    #[command(after_help = "Example: batwing report results --out results.html")]
    Report(ReportArgs),
    /// Draw a package's cross-section with traced paths, and write the paths as JSON
    #[command(after_help = "Example: batwing rays data/designs/d1.toml --count 100 --out rays")]
    Rays(RaysArgs),
    /// Check a design file, or a table, and say what it describes
    #[command(after_help = "Example: batwing check data/designs/d3.toml")]
    Check(CheckArgs),
    /// Print the script by which a shell completes commands and options
    #[command(after_help = "Example: batwing completions bash > batwing.bash")]
    Completions(CompletionsArgs),
    /// Write a manual page for each command
    #[command(after_help = "Example: batwing man share/man/man1")]
    Man(ManArgs),
}

impl Cli {
    /// Runs the command.
    ///
    /// # Errors
    /// Errors of the command; an interrupt.
    pub fn run(&self) -> Result<()> {
        let interrupt = Interrupt::install()?;
        threads(self.common)?;
        self.run_until(&interrupt)
    }

    /// Runs the command on the threads that it is called on, for programs that raise `interrupt`
    /// themselves.
    ///
    /// # Errors
    /// Errors of the command; an interrupt.
    pub fn run_until(&self, interrupt: &Interrupt) -> Result<()> {
        let context = self.context(interrupt);
        let done = match &self.command {
            Command::New(arguments) => new::run(arguments, context),
            Command::Shared(command) => {
                let command = command.get();
                match command.job_options().shard {
                    Some(shard) => shards::compute(command, shard, context),
                    None => command.run(context),
                }
            }
            Command::Schema(arguments) => schema::run(arguments, context),
            Command::Completions(arguments) => shell::complete(arguments, Self::command(), context),
            Command::Man(arguments) => shell::man(arguments, Self::command(), context),
            Command::Converge(arguments) => converge::run(arguments, context),
            Command::NearField(arguments) => near_field::run(arguments, context),
            Command::FullWave(arguments) => full_wave::run(arguments, context),
            Command::Zones(arguments) => zones::run(arguments, context),
            Command::Plan(arguments) => shards::plan(arguments, context),
            Command::Submit(arguments) => shards::submit(arguments, context),
            Command::Merge(arguments) => shards::merge(arguments, context),
            Command::Grating(arguments) => grating::run(arguments, context),
            Command::Explore(arguments) => explore::run(arguments, context),
            Command::Export(arguments) => export::run(arguments, context),
            Command::Import(arguments) => import::run(arguments, context),
            Command::Report(arguments) => report::run(arguments, context),
            Command::Rays(arguments) => rays::run(arguments, context),
            Command::Check(arguments) => check::run(arguments, context),
        };
        done.map_err(|error| interrupt.explain(error))
    }

    /// Runs a command on `texts` in place of files, which the arguments name. Files that the text
    /// of a design names lie in `folder`; those of a study, problem or tolerance file beside it.
    ///
    /// # Errors
    /// Errors of the command; a command that takes no text; an interrupt.
    pub fn run_texts(mut self, texts: Texts, folder: &Path, interrupt: &Interrupt) -> Result<()> {
        let context = self.context(interrupt);
        match &mut self.command {
            Command::Shared(SharedCommand::Study(arguments)) => arguments.texts = texts,
            Command::Shared(SharedCommand::Optimise(arguments)) => arguments.texts = texts,
            Command::Shared(SharedCommand::Tolerance(arguments)) => arguments.texts = texts,
            others => {
                let done = match others {
                    Command::Shared(SharedCommand::Run(arguments)) => {
                        design(&arguments.design, &texts, folder)
                            .and_then(|design| run::of_design(design, arguments, context))
                    }
                    Command::Export(arguments) => design(&arguments.input, &texts, folder)
                        .and_then(|design| export::of_design(&design, arguments, context)),
                    Command::Check(arguments) => design(&arguments.file, &texts, folder)
                        .and_then(|design| check::of_design(&design, context)),
                    Command::FullWave(arguments) => design(&arguments.design, &texts, folder)
                        .and_then(|design| full_wave::of_design(&design, arguments, context)),
                    Command::Zones(arguments) => design(&arguments.design, &texts, folder)
                        .and_then(|design| zones::of_design(design, &texts, arguments, context)),
                    _ => bail!("expected a command on a design, got one that takes no text"),
                };
                return done.map_err(|error| interrupt.explain(error));
            }
        }
        self.run_until(interrupt)
    }

    /// Traces a design as `run` does and writes no file. Returns `results.json` and the arrays of
    /// each model. `texts` and `folder` are as of [`Cli::run_texts`].
    ///
    /// # Errors
    /// Errors of the command; another command; an interrupt.
    pub fn run_in_memory(
        &self,
        texts: &Texts,
        folder: &Path,
        interrupt: &Interrupt,
    ) -> Result<(Value, ModelArrays)> {
        let Command::Shared(SharedCommand::Run(arguments)) = &self.command else {
            bail!("expected run, got another command");
        };
        design(&arguments.design, texts, folder)
            .and_then(|design| run::in_memory(design, arguments, self.context(interrupt)))
            .map_err(|error| interrupt.explain(error))
    }

    fn context<'a>(&self, interrupt: &'a Interrupt) -> RunContext<'a> {
        RunContext {
            console: Console { quiet: self.common.quiet, json: self.common.json, warns: true },
            interrupt,
            seed: self.common.seed,
            checkpoints: None,
        }
    }
}

/// The design that the arguments call `name`: of `texts`, or of a file.
fn design(name: &Path, texts: &Texts, folder: &Path) -> Result<Design> {
    let file = name.display().to_string();
    let text = texts.get(&file);
    text.map_or_else(|| scene_check::load(name), |text| scene_check::parse(&file, text, folder))
}

/// Sets the number of threads for everything that follows.
fn threads(common: Common) -> Result<()> {
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(count) = common.threads {
        pool = pool.num_threads(usize::from(count));
    }
    pool.build_global().context("cannot start the threads")
}
