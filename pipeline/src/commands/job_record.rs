// SPDX-License-Identifier: MIT OR Apache-2.0
//! The record of a job in the directory of its results: which command its shards share, how many
//! they are, and everything that must be the same in all of them.
//!
//! The first shard writes it; every other one, and the merge, compare themselves with it. It holds
//! no time and no host. The merge removes it with the pieces once the results are written.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::{CommandFactory, Parser, Subcommand};
use serde::{Deserialize, Serialize};
use serde_json::json;

use runtime::atomic_file;
use runtime::bounded_text::{MAX_KEYS, bounded_text};
use runtime::content_hash::{hashes, sealed, sha256_hex};
use runtime::key::SOLVER_VERSION;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use runtime::store::program_sha256;
use simulate::job::SharedWork;
use simulate::shard::SHARDS;

use super::arguments::negative_numbers;
use super::bsdf::BsdfArgs;
use super::optimise::OptimiseArgs;
use super::reproduce::ReproduceArgs;
use super::run::RunArgs;
use super::shardable::Shardable;
use super::study::StudyArgs;
use super::tolerance::ToleranceArgs;

/// File in the directory of results.
pub const FILE: &str = "job.json";
/// Version of its layout.
const VERSION: u32 = 1;

/// A command line whose work may be shared.
#[derive(Debug, Parser)]
#[command(name = "batwing", no_binary_name = true, mut_subcommands = negative_numbers)]
pub struct SharedLine {
    /// Seed of every random number
    #[arg(long, global = true, default_value_t = 1)]
    pub seed: u64,
    /// The command.
    #[command(subcommand)]
    pub command: SharedCommand,
}

/// The commands whose work may be shared.
#[derive(Debug, Subcommand)]
pub enum SharedCommand {
    /// Compute the paper's tables and figures from nothing
    #[command(after_help = "Example: batwing reproduce --quick --out results-quick")]
    Reproduce(ReproduceArgs),
    /// Trace one design
    #[command(
        after_help = "Example: batwing run data/designs/d1.toml --model geometric --out results-d1"
    )]
    Run(RunArgs),
    /// Compute the tables of diffraction orders of a design, or its film stack as a file
    #[command(
        after_help = "Example: batwing bsdf data/designs/d2.toml --rings 5,75,165 --tolerance 1e-3 --out tables-d2"
    )]
    Bsdf(BsdfArgs),
    /// Vary keys of designs and rank the set-ups by how near their figures come to targets
    #[command(after_help = "Example: batwing study data/studies/readings.toml --out study")]
    Study(StudyArgs),
    /// Search for the design that a problem file asks for, and verify it
    #[command(
        after_help = "Example: batwing optimise data/gallery/d3-by-rays/problem.toml --out optimised"
    )]
    Optimise(OptimiseArgs),
    /// Show what deviations of real packages do to the figures of a design
    #[command(
        after_help = "Example: batwing tolerance data/gallery/d3-by-rays/tolerance.toml --out tolerance"
    )]
    Tolerance(ToleranceArgs),
}

impl SharedCommand {
    /// The command itself.
    pub fn get(&self) -> &dyn Shardable {
        match self {
            Self::Reproduce(arguments) => arguments,
            Self::Run(arguments) => arguments,
            Self::Bsdf(arguments) => arguments,
            Self::Study(arguments) => arguments,
            Self::Tolerance(arguments) => arguments,
            Self::Optimise(arguments) => arguments,
        }
    }
}

impl SharedLine {
    /// The command line of these words.
    ///
    /// # Errors
    /// Words that make no command.
    pub fn of(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Self> {
        Self::try_parse_from(words).map_err(|error| {
            let text = error.to_string();
            let first = text.lines().next().unwrap_or_default();
            let commands = Self::command();
            let names = commands.get_subcommands().map(clap::Command::get_name);
            anyhow::anyhow!(
                "expected one of {} with its options: {}",
                names.filter(|name| *name != "help").collect::<Vec<_>>().join(", "),
                first.trim_start_matches("error: ")
            )
        })
    }
}

/// Record of what all shards of a job have in common.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobRecord {
    job_version: u32,
    /// The command line, as [`Shardable::words`].
    pub command: Vec<String>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of shards.
    pub shards: usize,
    /// Directory of the cache, as given.
    pub cache: Option<PathBuf>,
    /// Directory in which the first shard was started, by which paths that are not absolute are meant.
    pub directory: PathBuf,
    /// Files read, by their hashes.
    inputs: Vec<FileRecord>,
    program_version: String,
    program_sha256: String,
    solver_version: u32,
    #[serde(default)]
    content_sha256: String,
}

impl JobRecord {
    /// The record of `command`, whose pieces are those of `work`.
    ///
    /// # Errors
    /// A program that cannot be read, no current directory.
    pub fn of(
        command: &dyn Shardable,
        work: &dyn SharedWork,
        shards: usize,
        context: RunContext,
    ) -> Result<Self> {
        Ok(Self {
            job_version: VERSION,
            command: command.words(),
            seed: context.seed,
            shards,
            cache: command.job_options().cache_given.map(Path::to_path_buf),
            directory: std::env::current_dir().context("no current directory")?,
            inputs: work.inputs().to_vec(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            program_sha256: program_sha256()?,
            solver_version: SOLVER_VERSION,
            content_sha256: String::new(),
        })
    }

    /// The record in `out`; `None` without one.
    ///
    /// # Errors
    /// One that cannot be read or was altered.
    pub fn read(out: &Path) -> Result<Option<Self>> {
        let path = out.join(FILE);
        if !path.try_exists().with_context(|| format!("`{}`: cannot be read", path.display()))? {
            return Ok(None);
        }
        let text = bounded_text(&path, MAX_KEYS)
            .with_context(|| format!("`{}`: cannot be read", path.display()))?;
        let whole = hashes(&text).is_some_and(|(found, stated)| found == stated);
        ensure!(
            whole,
            "`{}`: expected the record of a job, got one that was altered; remove it and start the job again",
            path.display()
        );
        let record: Self = serde_json::from_str(&text)
            .with_context(|| format!("`{}` is no record of a job", path.display()))?;
        ensure!(
            SHARDS.contains(&record.shards),
            "`{}`: shards: expected from {} to {}, got {}",
            path.display(),
            SHARDS.start(),
            SHARDS.end(),
            record.shards
        );
        Ok(Some(record))
    }

    /// Writes the record in `out`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, out: &Path) -> Result<()> {
        atomic_file::write_json(&out.join(FILE), &self.json()?)
    }

    fn json(&self) -> Result<serde_json::Value> {
        Ok(sealed(serde_json::to_value(self)?)?)
    }

    /// Refuses to take part in `other`, which is another job.
    ///
    /// # Errors
    /// A difference.
    pub fn same_job(&self, other: &Self, out: &Path) -> Result<()> {
        let path = out.join(FILE);
        let differs = |what: &str, of_job: &str, own: &str| {
            format!(
                "`{}`: {what}: expected {of_job}, as the job was started there, got {own}; use another --out, or remove that file, to start another job",
                path.display()
            )
        };
        let lines = [self, other].map(|job| format!("`{}`", job.line()));
        ensure!(lines[0] == lines[1], differs("command", &lines[1], &lines[0]));
        let caches = [self, other].map(JobRecord::cache_place);
        ensure!(caches[0] == caches[1], differs("cache", &caches[1], &caches[0]));
        let programs = [self, other].map(|job| {
            let (version, hash) = (&job.program_version, &job.program_sha256);
            format!("batwing {version} with SHA-256 {}", hash.get(..16).unwrap_or(hash))
        });
        ensure!(programs[0] == programs[1], differs("program", &programs[1], &programs[0]));
        let solvers = [self, other].map(|job| format!("version {}", job.solver_version));
        ensure!(solvers[0] == solvers[1], differs("solver", &solvers[1], &solvers[0]));
        for (own, of_job) in self.inputs.iter().zip(&other.inputs) {
            let said =
                [own, of_job].map(|file| format!("{} with SHA-256 {}", file.file, file.sha256));
            ensure!(own == of_job, differs("file", &said[1], &said[0]));
        }
        let files = [self, other].map(|job| job.inputs.len().to_string());
        ensure!(files[0] == files[1], differs("files", &files[1], &files[0]));
        Ok(())
    }

    /// Takes part in the job in `out`, which this starts if there is none.
    ///
    /// # Errors
    /// Another job there, or another number of shards.
    pub fn join(&self, out: &Path) -> Result<()> {
        let started = if let Some(started) = Self::read(out)? {
            started
        } else {
            // Another job may be started in the same moment: the first record stays.
            atomic_file::write_new_json(&out.join(FILE), &self.json()?)?;
            Self::read(out)?.context("the record of the job was removed")?
        };
        self.same_job(&started, out)?;
        let path = out.join(FILE);
        ensure!(
            started.shards == self.shards,
            "`{}`: expected shards of {}, as the job was started there, got {}; remove that file to deal the job anew, finished pieces stay",
            path.display(),
            started.shards,
            self.shards
        );
        Ok(())
    }

    /// Hash that distinguishes the job from others in one cache.
    pub fn identity(&self) -> String {
        let fields = json!({
            "command": self.command,
            "seed": self.seed,
            "inputs": self.inputs,
            "program": self.program_sha256,
            "solver_version": self.solver_version,
        });
        sha256_hex(fields.to_string().as_bytes())[..16].to_owned()
    }

    /// The command in `out`.
    ///
    /// # Errors
    /// A command that this program does not know.
    pub fn command_in(&self, out: &Path) -> Result<SharedLine> {
        let words = self.words_in(out);
        SharedLine::of(words).with_context(|| format!("`{}`", out.join(FILE).display()))
    }

    /// Words of the command in `out`, without the program.
    pub fn words_in(&self, out: &Path) -> Vec<OsString> {
        let own = self.command.iter().map(OsString::from);
        let place = ["--out".into(), out.into()];
        let cache = self.cache.iter();
        let cache = cache.flat_map(|cache| ["--cache".into(), cache.into()]);
        let seed = ["--seed".into(), self.seed.to_string().into()];
        own.chain(seed).chain(place).chain(cache).collect()
    }

    /// Place of the cache, for people; two processes with the same one share pieces.
    fn cache_place(&self) -> String {
        match &self.cache {
            Some(cache) => format!("`{}`", self.directory.join(cache).display()),
            None => "that beside the results".to_owned(),
        }
    }

    /// The command as it is typed, without directories.
    fn line(&self) -> String {
        let mut words: Vec<&str> = self.command.iter().map(String::as_str).collect();
        words.insert(0, "batwing");
        format!("{} --seed {}", words.join(" "), self.seed)
    }
}

/// Words as a shell takes them.
pub fn shell_line(words: &[OsString]) -> String {
    let quoted = words.iter().map(|word| {
        let text = word.to_string_lossy();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=:+%@".contains(c);
        if !text.is_empty() && text.chars().all(plain) {
            text.into_owned()
        } else {
            format!("'{}'", text.replace('\'', r"'\''"))
        }
    });
    quoted.collect::<Vec<_>>().join(" ")
}
