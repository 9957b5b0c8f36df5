// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shards of a job: `--shard` of the commands whose work may be shared, `batwing plan` and
//! `batwing merge`.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result, bail, ensure};
use clap::Args;
use serde_json::{Value, json};

use metrics::plural::count;
use runtime::atomic_file;
use runtime::interrupt::Stopped;
use runtime::run_context::RunContext;
use runtime::store::Store;
use simulate::job::{Cost, MissingPieces, SharedWork};
use simulate::shard::{SHARDS, ShardChoice};

use super::arguments::whole;
use super::job_record::{FILE, JobRecord, SharedLine, shell_line};
use super::outputs::{refuse_control, writable};
use super::shardable::Shardable;
use super::submit;

/// Exit code of a shard or a merge that is worth repeating, as EX_TEMPFAIL of sysexits.h.
const REPEAT: u8 = 75;
/// Seconds on one core that a shard takes, about, where the number of shards is not given.
const USUAL_SECONDS: f64 = 600.0;
/// Tasks of an array that SLURM takes unless it is configured otherwise (MaxArraySize 1001).
const USUAL_ARRAY: usize = 1000;
/// Lines of shards on the terminal.
const SHOWN: usize = 16;
/// Pieces named of a shard.
const NAMED: usize = 3;

/// Which job.
#[derive(Debug, Args)]
pub struct JobChoice {
    /// Directory of results in which the job was started
    #[arg(value_name = "JOB", required_unless_present = "command")]
    pub directory: Option<PathBuf>,
    /// Number of shards [default: that of the job, or one for every ten minutes]
    #[arg(long, value_name = "N", value_parser = whole(SHARDS))]
    pub shards: Option<usize>,
    /// A command that starts a job in its --out, with its options
    #[arg(last = true, value_name = "COMMAND", conflicts_with = "directory")]
    pub command: Vec<OsString>,
}

/// `batwing plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// Which job.
    #[command(flatten)]
    pub job: JobChoice,
}

/// `batwing merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Directory of results in which the job was started
    #[arg(value_name = "JOB")]
    pub directory: PathBuf,
}

/// `batwing submit`.
#[derive(Debug, Args)]
pub struct SubmitArgs {
    /// Which job.
    #[command(flatten)]
    pub job: JobChoice,
    /// Write scripts for SLURM: an array of all shards, and the merge after it
    #[arg(long, required = true)]
    pub slurm: bool,
    /// Further options of sbatch, such as "--time=2:00:00 --cpus-per-task=4"
    #[arg(long, value_name = "OPTIONS", allow_hyphen_values = true)]
    pub sbatch: Option<String>,
    /// Submit the scripts too
    #[arg(long)]
    pub go: bool,
}

/// Computes the pieces of the shards `choice` of `command`.
///
/// # Errors
/// Errors of the command; another job in its directory; a shard that the job does not have.
pub fn compute(command: &dyn Shardable, choice: &ShardChoice, context: RunContext) -> Result<()> {
    let options = command.job_options();
    let (out, cache) = (options.out, options.cache());
    context.interrupt.exit_with(REPEAT);
    if let Some(beyond) = choice.numbers.iter().find(|&&number| number >= choice.count) {
        bail!("--shard {choice}: expected shards from 0 to {}, got {beyond}", choice.count - 1);
    }
    let work = command.work(context)?;
    writable(out)?;
    writable(cache.directory())?;
    let record = JobRecord::of(command, &*work, choice.count, context)?;
    let compute = || -> Result<Cost> {
        record.join(out)?;
        context.interrupt.note(format!(
            "before the shard was done; finished pieces stay in `{}`, the same command goes on from there",
            cache.directory().display()
        ));
        let identity = record.identity();
        let pieces = Store::of_job(cache.directory(), &identity, false, context.console);
        work.compute(choice, &cache, context.storing(Some(&pieces)))
    };
    let cost = compute().map_err(worth_repeating)?;
    let json = json!({"shard": choice.to_string(), "cost": described(&cost)});
    context.console.result(&json, || {
        format!(
            "shard {choice} is done: {} in `{}`; `{}` puts all shards together",
            pieces(&cost),
            cache.directory().display(),
            shell_line(&["batwing".into(), "merge".into(), out.into()])
        )
    })
}

/// Prints how many shards a job has and what each costs.
///
/// # Errors
/// Errors of the command; another job in its directory.
pub fn plan(arguments: &PlanArgs, context: RunContext) -> Result<()> {
    let open = OpenJob::open(&arguments.job, context)?;
    let costs = open.work.costs(open.record.shards);
    let all = costs.iter().fold(Cost::default(), |all, cost| all + *cost);
    let shards = costs.len();
    let json = json!({
        "job": open.out.display().to_string(),
        "shards": costs.iter().map(described).collect::<Vec<_>>(),
        "all": described(&all),
    });
    context.console.result(&json, || {
        let mut text = format!(
            "{}: {}\n shard  pieces  tables  operations       paths   seconds on a core\n",
            count(shards, "shard"),
            pieces(&all)
        );
        let row = |name: &str, cost: &Cost| {
            format!(
                "{name:>6}  {:>6}  {:>6}  {:>10.2e}  {:>10}  {:>18.1}\n",
                cost.pieces, cost.tables, cost.operations, cost.paths, cost.seconds
            )
        };
        for (number, cost) in costs.iter().enumerate().take(SHOWN) {
            text += &row(&number.to_string(), cost);
        }
        if shards > SHOWN {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "and {} more", shards - SHOWN);
        }
        text + &row("all", &all)
    })
}

/// Puts the pieces of all shards together: runs the command of the job, which finds them, and
/// removes them.
///
/// # Errors
/// Pieces that are missing, with the command that computes them; those of the command.
pub fn merge(arguments: &MergeArgs, context: RunContext) -> Result<()> {
    context.interrupt.exit_with(REPEAT);
    let out = &arguments.directory;
    let choice = JobChoice { directory: Some(out.clone()), shards: None, command: Vec::new() };
    let open = OpenJob::open(&choice, context)?;
    let (record, line) = (&open.record, &open.line);
    let command = line.command.get();
    let (cache, identity) = (command.job_options().cache(), record.identity());
    let context = RunContext { seed: line.seed, ..context };
    let pieces = Store::of_job(cache.directory(), &identity, true, context.console);
    let context = context.storing(Some(&pieces));
    let merge = || -> Result<()> {
        let missing = open.work.missing(record.shards, &cache, context)?;
        if !missing.is_empty() {
            return Err(incomplete(record, out, &missing).into());
        }
        command.run(context)?;
        // What killed shards and merges left: they wrote to the folders that this merge wrote to.
        atomic_file::discard_abandoned_beside();
        atomic_file::discard_abandoned(out);
        atomic_file::discard_abandoned(cache.directory());
        // Pieces go after the record: a merge that is killed here can be repeated, or is done.
        let path = out.join(FILE);
        std::fs::remove_file(&path)
            .with_context(|| format!("cannot remove `{}`", path.display()))?;
        pieces.discard_job();
        Ok(())
    };
    merge().map_err(worth_repeating)
}

/// Writes the scripts of a job for SLURM, and submits them if that is asked for.
///
/// # Errors
/// Errors of the command and of sbatch; another job in its directory.
pub fn submit(arguments: &SubmitArgs, context: RunContext) -> Result<()> {
    let open = OpenJob::open(&arguments.job, context)?;
    let (record, out) = (&open.record, &open.out);
    writable(out)?;
    record.write(out)?;
    if record.shards > USUAL_ARRAY {
        context.console.warn(&format!(
            "--shards: expected at most {USUAL_ARRAY} for the usual MaxArraySize of SLURM, got {}; `scontrol show config` states that of the cluster",
            record.shards
        ));
    }
    submit::write_scripts(record, out, arguments.sbatch.as_deref())?;
    let folder = submit::script_of_shards(out);
    let numbers = arguments.go.then(|| submit::submit(out)).transpose()?;
    let json = json!({
        "job": out.display().to_string(),
        "shards": record.shards,
        "script": folder.display().to_string(),
        "array_and_merge": numbers,
    });
    context.console.result(&json, || match &numbers {
        Some([array, merge]) => format!(
            "submitted {} as array {array}, and the merge after them as job {merge}",
            count(record.shards, "shard")
        ),
        None => format!(
            "{} in an array:
{}",
            count(record.shards, "shard"),
            submit::by_hand(out)
        ),
    })
}

/// A job that is started in a directory.
pub(super) struct OpenJob {
    pub record: JobRecord,
    pub line: SharedLine,
    pub work: Box<dyn SharedWork>,
    pub out: PathBuf,
}

impl OpenJob {
    /// The job in a directory, or that of a command.
    pub fn open(choice: &JobChoice, context: RunContext) -> Result<Self> {
        let (line, started) = if let Some(out) = &choice.directory {
            let record = JobRecord::read(out)?.with_context(|| {
                format!(
                    "`{}`: expected the record of a job that was started there, got none: none was started, or it is merged already",
                    out.join(FILE).display()
                )
            })?;
            (record.command_in(out)?, Some(record))
        } else {
            // The seed of this very command is that of its job, unless it has one of its own.
            let seed = ["--seed".into(), context.seed.to_string().into()];
            let has_seed = choice.command.iter().any(|word| {
                let word = word.to_string_lossy();
                word == "--seed" || word.starts_with("--seed=")
            });
            let seed = seed.into_iter().filter(|_| !has_seed);
            let words = choice.command.iter().cloned().chain(seed);
            (SharedLine::of(words.collect::<Vec<_>>())?, None)
        };
        let command = line.command.get();
        let options = command.job_options();
        ensure!(options.shard.is_none(), "expected a command without --shard");
        let out = options.out.to_path_buf();
        refuse_control("path of results", &out)?;
        let context = RunContext { seed: line.seed, ..context };
        let work = command.work(context).with_context(|| match &started {
            Some(record) => format!("the job was started in `{}`", record.directory.display()),
            None => out.display().to_string(),
        })?;
        let started = match started {
            Some(record) => Some(record),
            None => JobRecord::read(&out)?,
        };
        let before = started.as_ref().map(|record| record.shards);
        let shards = choice.shards.or(before).unwrap_or_else(|| usual(&*work));
        let own = JobRecord::of(command, &*work, shards, context)?;
        if let Some(started) = &started {
            own.same_job(started, &out)?;
        }
        Ok(Self { record: own, line, work, out })
    }
}

/// Shards of ten minutes, as many as have something to do at most.
fn usual(work: &dyn SharedWork) -> usize {
    let seconds: f64 = work.costs(1).iter().map(|cost| cost.seconds).sum();
    let most = work.most_shards().clamp(1, *SHARDS.end());
    ((seconds / USUAL_SECONDS).ceil() as usize).clamp(1, most)
}

/// The message of shards that are not done, with the command that repeats them.
fn incomplete(record: &JobRecord, out: &Path, missing: &[MissingPieces]) -> Stopped {
    let numbers = missing.iter().map(|shard| shard.shard).collect();
    let choice = ShardChoice { numbers, count: record.shards };
    let all = missing.iter().take(SHOWN).map(|shard| {
        let tables = shard.tables.iter().map(|ring| format!("the table of {ring}"));
        let tasks = shard.tasks.iter();
        let tasks = tasks.map(|(what, pieces)| format!("{pieces} of {what}"));
        let mut pieces: Vec<String> = tables.chain(tasks).collect();
        let more = pieces.len().saturating_sub(NAMED);
        pieces.truncate(NAMED);
        if more > 0 {
            pieces.push(format!("{more} more"));
        }
        if pieces.is_empty() {
            pieces.push("what follows".to_owned());
        }
        format!("{} ({})", shard.shard, pieces.join(", "))
    });
    let mut all: Vec<String> = all.collect();
    if missing.len() > SHOWN {
        all.push(format!("and {} more", missing.len() - SHOWN));
    }
    let script = submit::script_of_shards(out);
    let words = if submit::is_script_of(record.shards, out) {
        let numbers: Vec<String> = choice.numbers.iter().map(ToString::to_string).collect();
        let array = format!("--array={}", numbers.join(","));
        vec!["sbatch".into(), array.into(), script.into()]
    } else {
        let shard = vec!["--shard".into(), choice.to_string().into()];
        [vec!["batwing".into()], record.words_in(out), shard].concat()
    };
    Stopped {
        line: format!(
            "{}: expected the pieces of {}, got {} without all of theirs: {}; `{}` computes them",
            out.display(),
            count(record.shards, "shard"),
            missing.len(),
            all.join("; "),
            shell_line(&words)
        ),
        exit_code: REPEAT,
    }
}

/// A failure of the file system that may pass, such as a full disk, ends with the exit code of what
/// is worth repeating.
fn worth_repeating(error: Error) -> Error {
    let passes = |error: &std::io::Error| {
        matches!(
            error.kind(),
            ErrorKind::StorageFull
                | ErrorKind::QuotaExceeded
                | ErrorKind::StaleNetworkFileHandle
                | ErrorKind::ResourceBusy
                | ErrorKind::TimedOut
        )
    };
    if atomic_file::file_errors(&error).any(passes) {
        Stopped { line: format!("{error:#}"), exit_code: REPEAT }.into()
    } else {
        error
    }
}

fn pieces(cost: &Cost) -> String {
    let all = count(cost.pieces, "piece");
    match cost.tables {
        0 => all,
        tables => format!("{all} with {}", count(tables, "table")),
    }
}

fn described(cost: &Cost) -> Value {
    json!({
        "pieces": cost.pieces,
        "tables": cost.tables,
        "operations": cost.operations.round(),
        "paths": cost.paths,
        "seconds": cost.seconds,
    })
}
