// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing tolerance`: what deviations of a real package do to the figures of a design.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, ensure};
use clap::Args;

use arrays::csv;
use experiment::checked_file::Texts;
use experiment::tolerance::compute::compute;
use experiment::tolerance::definition::{self, Overrides, ToleranceAnalysis};
use experiment::tolerance::shared_traces::shared_traces;
use experiment::tolerance::tolerance_results::ToleranceResults;
use results::tolerance::FILE;
use runtime::atomic_file;
use runtime::content_hash::sealed;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use simulate::job::{Job, SharedWork, Task};

use super::arguments::{cache, paths, whole};
use super::outputs::{checkpoints, writable};
use super::shardable::{CommandLine, JobOptions, Shardable, Sharing};

/// A line for each sample.
const TABLE: &str = "samples.csv";

/// Picture of the distribution of the first figure.
const DISTRIBUTION: &str = "distribution.png";

/// `batwing tolerance`.
#[derive(Debug, Args)]
pub struct ToleranceArgs {
    /// Tolerance file
    #[arg(value_name = "TOLERANCE.toml")]
    pub file: PathBuf,
    /// Number of samples, instead of that of the file
    #[arg(long, value_name = "N", value_parser = whole(8..=100_000_usize))]
    pub samples: Option<usize>,
    /// Paths of each sample, instead of those of the file
    #[arg(long, value_name = "N", value_parser = paths)]
    pub paths: Option<u64>,
    /// Directory for results
    #[arg(long, value_name = "DIR", default_value = "tolerance")]
    pub out: PathBuf,
    /// Go on with the samples that an interrupted command kept
    #[arg(long)]
    pub resume: bool,
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

impl Shardable for ToleranceArgs {
    fn job_options(&self) -> JobOptions<'_> {
        JobOptions::new(&self.out, self.cache.as_deref(), &self.sharing)
    }

    fn words(&self) -> Vec<String> {
        CommandLine::new("tolerance", &self.file)
            .option("--samples", self.samples)
            .option("--paths", self.paths)
            .all()
    }

    fn work(&self, context: RunContext) -> Result<Box<dyn SharedWork>> {
        ensure!(!self.resume, "--resume: expected none with shards, which go on from their pieces");
        let analysis = self.analysis()?;
        let inputs = analysis.inputs.clone();
        let traces = shared_traces(analysis, context.seed)?.into_iter();
        let tasks = traces.map(|traces| Box::new(traces) as Box<dyn Task>);
        Ok(Box::new(Job::new(Vec::new(), tasks.collect(), inputs)))
    }

    /// Traces the samples and writes the table of samples and a picture, then `tolerance.json`.
    fn run(&self, context: RunContext) -> Result<()> {
        let started = Instant::now();
        let analysis = self.analysis()?;
        let out = self.out.as_path();
        let cache = cache(self.cache.as_deref(), out);
        writable(out)?;
        writable(cache.directory())?;
        context.interrupt.note(format!(
            "before {FILE} was written; finished samples and tables stay in `{}`, --resume goes on from \
             there",
            cache.directory().display()
        ));
        let store = checkpoints(Some(&cache), context)?;
        if let Some(store) = store.as_ref().filter(|_| !self.resume) {
            store.discard(analysis.key(context.seed));
        }
        let sampled = compute(&analysis, &cache, context.storing(store.as_ref()))?;
        let results = ToleranceResults::new(&analysis, &sampled);
        let path = |name: &str| out.join(name);
        atomic_file::supersede(&path(FILE))?;
        let headings = results.headings();
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        csv::write_text_csv(&path(TABLE), &headings, &results.rows())?;
        let mut file = results.to_file(context.seed);
        file.files = vec![FileRecord::of_output(out, TABLE)?];
        if let Some(picture) = report::tolerance::distribution_picture(&file)? {
            let png = picture.png()?;
            atomic_file::write_bytes(&path(DISTRIBUTION), &png)?;
            file.files.push(FileRecord::new(DISTRIBUTION, &png));
        }
        let json = sealed(serde_json::to_value(&file)?)?;
        atomic_file::write_json(&path(FILE), &json)?;
        if let Some(store) = store {
            store.finish();
        }
        context.console.result(&json, || {
            format!(
                "{}\n{:.1} s; results in {}",
                results.plain_text(),
                started.elapsed().as_secs_f64(),
                out.display()
            )
        })
    }
}

impl ToleranceArgs {
    /// The analysis with what the arguments replace in its file.
    fn analysis(&self) -> Result<ToleranceAnalysis> {
        let overrides = Overrides { samples: self.samples, paths: self.paths };
        definition::load(&self.file, &self.texts, overrides)
    }
}
