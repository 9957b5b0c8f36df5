// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing optimise`: the design that a problem file asks for, verified beside the one that the
//! search began with.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use clap::Args;

use design::Design;
use experiment::checked_file::Texts;
use experiment::optimise::outputs::{self, CONVERGENCE, SENSITIVITIES};
use experiment::optimise::problem::{self, Problem};
use experiment::optimise::recipe::{Optimised, Recipe};
use experiment::optimise::search_results::{missed_constraints, plain_text};
use experiment::optimise::shared_search::SharedSearch;
use experiment::optimise::verification_run::VerificationRun;
use experiment::optimise::{external_search, named_files};
use report::optimisation::{convergence_picture, front_picture, sensitivity_picture};
use results::Results;
use results::optimisation::{FILE, OptimisationFile};
use results::schema::DomeParts;
use runtime::atomic_file;
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use simulate::job::SharedWork;
use simulate::model_result;
use simulate::model_writer::Destination;

use super::outputs::{results_writable, writable};
use super::shardable::{CommandLine, JobOptions, Shardable, Sharing};
use output::ModelFilesWriter;

/// `batwing optimise`.
#[derive(Debug, Args)]
pub struct OptimiseArgs {
    /// Problem file
    #[arg(value_name = "PROBLEM.toml")]
    pub problem: PathBuf,
    /// Directory for results
    #[arg(long, value_name = "DIR", default_value = "optimised")]
    pub out: PathBuf,
    /// Time for search, selection and verification, such as 90s, 6min or 2h
    #[arg(long, value_name = "TIME", value_parser = budget)]
    pub budget: Option<Duration>,
    /// Go on with the log in the directory
    #[arg(long)]
    pub resume: bool,
    /// Judge candidates from standard input, JSON lines in and out, instead of searching
    #[arg(long, conflicts_with_all = ["budget", "resume"])]
    pub evaluate: bool,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Shards.
    #[command(flatten)]
    pub sharing: Sharing,
    /// Texts in place of files.
    #[arg(skip)]
    pub texts: Texts,
}

impl Shardable for OptimiseArgs {
    fn job_options(&self) -> JobOptions<'_> {
        JobOptions::new(&self.out, self.cache.as_deref(), &self.sharing)
    }

    fn words(&self) -> Vec<String> {
        CommandLine::new("optimise", &self.problem).all()
    }

    fn work(&self, context: RunContext) -> Result<Box<dyn SharedWork>> {
        ensure!(
            self.budget.is_none(),
            "--budget: expected a number of evaluations for shards, got a time, in which each of them comes elsewhere"
        );
        ensure!(
            !self.resume && !self.evaluate,
            "--resume, --evaluate: expected neither with shards, which search and go on from their pieces"
        );
        let problem = problem::load(&self.problem, &self.texts)?;
        Ok(Box::new(SharedSearch::new(problem, context)?))
    }

    /// Searches and verifies; writes the log, the design, the results of both designs and
    /// `optimise.json` last.
    fn run(&self, context: RunContext) -> Result<()> {
        let started = Instant::now();
        let mut problem = problem::load(&self.problem, &self.texts)?;
        let out = self.out.as_path();
        let cache = self.job_options().cache();
        let mut recipe = Recipe::new(&problem, &cache, self.budget);
        if !context.is_merging() {
            recipe.pilot(context)?;
        }
        if self.evaluate {
            let (input, output) = (std::io::stdin().lock(), std::io::stdout().lock());
            return external_search::judge_lines(&problem, &cache, context, input, output);
        }
        let folders = [&problem.design.name, &problem.name].into_iter().flat_map(|name| {
            let design = Design { name: name.clone(), ..problem.design.clone() };
            let models = problem.models.iter();
            let folders: Vec<PathBuf> = models.map(|&m| model_result::folder(&design, m)).collect();
            folders
        });
        keeps_inputs(&problem, out)?;
        let copies = named_files::copies(&problem, out).into_iter();
        let copies: Vec<String> = copies.map(|copy| copy.display().to_string()).collect();
        let files = copies.iter().map(String::as_str).chain([results::FILE, FILE]);
        results_writable(out, folders, &files.collect::<Vec<_>>(), Some(&cache))?;
        writable(cache.directory())?;
        context.interrupt.note(format!(
            "before {FILE} was written; the log stays in `{}`, --resume goes on from there",
            out.display()
        ));
        let found = recipe.run(out, self.resume, context)?;
        problem.verification_paths = found.verification_paths;
        let results = verified(&problem, &found, out, &cache, context)?;
        results.write(out)?;
        // The log states times, which no two runs share.
        let mut files = vec![outputs::DESIGN, results::FILE];
        let mut file = found.to_file(&problem, context.seed);
        files.extend(pictures(&file, out)?);
        let front = file.front.iter().flat_map(|front| &front.designs);
        files.extend(front.map(|one| one.design.as_str()));
        let files = files.into_iter().map(|name| FileRecord::of_output(out, name));
        file.files = files.collect::<Result<Vec<_>>>()?;
        for missed in missed_constraints(&file) {
            context.console.warn(&format!("{}: {missed}", self.problem.display()));
        }
        let json = sealed(serde_json::to_value(&file)?)?;
        atomic_file::write_json(&out.join(FILE), &json)?;
        context.console.result(&json, || {
            format!(
                "{}\n{:.1} s; results in {}",
                plain_text(&file),
                started.elapsed().as_secs_f64(),
                out.display()
            )
        })
    }
}

/// A time with its unit.
fn budget(text: &str) -> Result<Duration, String> {
    let units = [("min", 60.0), ("h", 3600.0), ("s", 1.0)];
    let found = units.iter().find_map(|(unit, seconds)| {
        let number = text.strip_suffix(unit)?.trim().parse::<f64>().ok()?;
        Some(number * seconds)
    });
    let seconds = found.filter(|seconds| (1.0..=1e7).contains(seconds));
    seconds
        .map(Duration::from_secs_f64)
        .ok_or_else(|| "expected a time such as 90s, 6min or 2h, at least 1 s".to_owned())
}

/// Refuses a directory in which results would replace what the search reads.
fn keeps_inputs(problem: &Problem, out: &Path) -> Result<()> {
    let Ok(directory) = out.canonicalize() else {
        return Ok(());
    };
    for input in &problem.inputs {
        let Ok(path) = Path::new(&input.file).canonicalize() else {
            continue;
        };
        let replaced = path.parent() == Some(&directory)
            && path.file_name().and_then(OsStr::to_str).is_some_and(outputs::is_output);
        ensure!(
            !replaced,
            "--out: expected a directory without files that the search reads, got `{}`, where `{}` would be \
             replaced",
            out.display(),
            input.file
        );
    }
    Ok(())
}

/// Draws the convergence of the search, and the front and the sensitivities where there are any.
fn pictures(file: &OptimisationFile, out: &Path) -> Result<Vec<&'static str>> {
    let all = [
        (CONVERGENCE, Some(convergence_picture(file)?)),
        (outputs::FRONT_PICTURE, front_picture(file)?),
        (SENSITIVITIES, sensitivity_picture(file)?),
    ];
    let mut drawn = Vec::new();
    for (name, picture) in all {
        if let Some(picture) = picture {
            atomic_file::write_bytes(&out.join(name), &picture.png()?)?;
            drawn.push(name);
        }
    }
    Ok(drawn)
}

/// Results of both designs, in all models of the verification.
fn verified(
    problem: &Problem,
    found: &Optimised,
    out: &Path,
    cache: &arrays::cache::Cache,
    context: RunContext,
) -> Result<Results> {
    let context = RunContext { seed: VerificationRun::seed(context.seed), ..context };
    let destination = Destination { out, writer: &ModelFilesWriter::default() };
    let one = |design| VerificationRun::new(problem, design).results(destination, cache, context);
    let designs = vec![one(&problem.design)?, one(&found.design)?];
    Ok(Results {
        quick: false,
        seed: context.seed,
        inputs: problem.inputs.clone(),
        files: results::written(out, &designs, [])?,
        designs,
        references: Vec::new(),
        parts: DomeParts::default(),
    })
}
