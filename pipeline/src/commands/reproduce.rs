// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing reproduce`: computes the paper's tables and figures.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;

use design::Design;
use report::plots::{Heading, published_vs_computed};
use report::published::{self, Published};
use report::summary::{self, SummaryRow};
use results::{DesignResult, QUICK_NOTE, Results};
use runtime::atomic_file;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use runtime::store::Store;
use simulate::job::{Job, SharedWork, Task};
use simulate::model::Model;
use simulate::model_result;
use simulate::model_writer::Destination;
use simulate::run::Run;
use simulate::tables::{DesignTables, tables};
use simulate::trace_plan::TracePlan;

use super::arguments::cache;
use super::outputs::{PATHS, TABLES, checkpoints, note_interrupt, results_writable};
use super::shardable::{JobOptions, Shardable, Sharing};
use crate::paper_figures;
use output::ModelFilesWriter;

/// Designs compared with the paper.
const COMPARED: [&str; 3] = ["d1.toml", "d2.toml", "d3.toml"];
const REFERENCES: [&str; 2] = ["bare-dome.toml", "commercial-7p5.toml"];

/// The final table as a file.
const SUMMARY: &str = "summary.md";
/// The same as a picture.
const COMPARISON: &str = "published-and-computed.png";

/// `batwing reproduce`.
#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Coarser tables and fewer rays, in under 90 seconds; the results say so
    #[arg(long)]
    pub quick: bool,
    /// Directory for results
    #[arg(long, value_name = "DIR", default_value = "results")]
    pub out: PathBuf,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Shards.
    #[command(flatten)]
    pub sharing: Sharing,
}

impl Shardable for ReproduceArgs {
    fn job_options(&self) -> JobOptions<'_> {
        JobOptions::new(&self.out, self.cache.as_deref(), &self.sharing)
    }

    fn words(&self) -> Vec<String> {
        let quick = self.quick.then_some("--quick");
        let words = ["reproduce"].into_iter().chain(quick);
        words.map(str::to_owned).collect()
    }

    fn work(&self, context: RunContext) -> Result<Box<dyn SharedWork>> {
        let (compared, references) = self.designs()?;
        let inputs = inputs(&compared, &references);
        let seed = context.seed;
        let designs = compared.iter().chain(&references);
        let plans = designs.flat_map(|design| {
            let models = Model::all_of(design).into_iter();
            models.map(|model| TracePlan::of_model(design, model, seed))
        });
        let plans = plans.chain(paper_figures::plans(&compared, seed));
        let tasks = plans.map(|plan| Box::new(plan) as Box<dyn Task>);
        Ok(Box::new(Job::new(Vec::new(), tasks.collect(), inputs)))
    }

    /// Computes everything and writes it under the output directory, `results.json` last.
    fn run(&self, context: RunContext) -> Result<()> {
        let published = Published::load()?;
        let (compared, references) = self.designs()?;
        let cache = cache(self.cache.as_deref(), &self.out);
        let folders = compared
            .iter()
            .chain(&references)
            .flat_map(|d| Model::all_of(d).into_iter().map(|m| model_result::folder(d, m)))
            .chain([PathBuf::from(paper_figures::FOLDER)]);
        let files = [results::FILE, SUMMARY, COMPARISON];
        results_writable(&self.out, folders, &files, Some(&cache))?;
        let kept = [Some(TABLES), (!self.quick).then_some(PATHS)];
        note_interrupt(context, Some(&cache), &kept);
        let checkpoints = checkpoints(Some(&cache).filter(|_| !self.quick), context)?;
        let context = context.storing(checkpoints.as_ref());
        if self.quick {
            context.console.say(QUICK_NOTE);
        }
        let all_tables = tables(&compared.iter().collect::<Vec<_>>(), Some(&cache), None, context)?;

        let destination = Destination { out: &self.out, writer: &ModelFilesWriter::default() };
        let trace = |design: &Design, tables: Option<&DesignTables>| -> Result<DesignResult> {
            let run = Run { design, lights: None, stopping_rule: None, cache: Some(&cache) };
            let models = Model::all_of(design)
                .into_iter()
                .map(|model| run.model(model, tables, destination, context));
            Ok(DesignResult {
                name: design.name.clone(),
                design_sha256: design.provenance.sha256.clone(),
                models: models.collect::<Result<_>>()?,
            })
        };
        let designs: Vec<DesignResult> = compared
            .iter()
            .zip(&all_tables)
            .map(|(d, t)| trace(d, Some(t)))
            .collect::<Result<_>>()?;
        let beside: Vec<DesignResult> =
            references.iter().map(|d| trace(d, None)).collect::<Result<_>>()?;
        let parts = paper_figures::all(&compared, &all_tables[0], &self.out, context)?;

        let mut results = Results {
            quick: self.quick,
            seed: context.seed,
            inputs: inputs(&compared, &references),
            designs,
            references: beside,
            parts,
            files: Vec::new(),
        };
        let rows = summary::rows(&results, &published);
        comparison(&rows, self.quick, &self.out)?;
        atomic_file::write_bytes(
            &self.out.join(SUMMARY),
            summary_file(&rows, self.quick).as_bytes(),
        )?;
        let pictures = paper_figures::FILES.map(|file| Path::new(paper_figures::FOLDER).join(file));
        let others = [SUMMARY, COMPARISON].map(PathBuf::from);
        results.files = results::written(
            &self.out,
            results.designs.iter().chain(&results.references),
            pictures.into_iter().chain(others),
        )?;
        let mut file = results.to_file();
        published.join(&mut file);
        let json = file.to_json()?;
        atomic_file::write_json(&self.out.join(results::FILE), &json)?;
        checkpoints.iter().for_each(Store::finish);
        context.console.result(&json, || {
            let note = if self.quick { format!("\n{QUICK_NOTE}\n") } else { String::new() };
            format!("{}{note}\nwritten to {}", summary::plain_text(&rows), self.out.display())
        })
    }
}

impl ReproduceArgs {
    /// Designs of the paper, and those beside them.
    fn designs(&self) -> Result<(Vec<Design>, Vec<Design>)> {
        let load = |names: &[&str]| -> Result<Vec<Design>> {
            let quick = |d: Design| if self.quick { quick(d) } else { d };
            names.iter().map(|name| Ok(quick(design::embedded(name)?))).collect()
        };
        Ok((load(&COMPARED)?, load(&REFERENCES)?))
    }
}

/// Files that went in.
fn inputs(compared: &[Design], references: &[Design]) -> Vec<FileRecord> {
    let designs = compared.iter().chain(references);
    let files = designs.flat_map(|design| design.provenance.inputs());
    let published = FileRecord::new("tables.toml", published::TABLES.as_bytes());
    files.chain([published]).collect()
}

/// The picture of published and computed figures.
fn comparison(rows: &[SummaryRow], quick: bool, out: &Path) -> Result<()> {
    let rows: Vec<SummaryRow> = rows.iter().filter(|r| r.published.is_some()).cloned().collect();
    let subtitle = if quick { "quick run: coarse tables, few rays" } else { "Tables 1 and 2" };
    atomic_file::write_bytes(
        &out.join(COMPARISON),
        &published_vs_computed(&Heading::new("Published and computed", subtitle), &rows)?.png()?,
    )
}

fn summary_file(rows: &[summary::SummaryRow], quick: bool) -> String {
    let note = if quick { format!("\n{QUICK_NOTE}\n") } else { String::new() };
    format!(
        "# Published and computed\n\nValue ± one standard error; differences of percentages are in points.\n{note}\n{}",
        summary::markdown(rows)
    )
}

/// The same design with coarser tables and fewer paths.
fn quick(mut design: Design) -> Design {
    design.hybrid.tolerance = 0.05;
    design.hybrid.kx_per_zone = Some(2);
    design.hybrid.ky_count = Some(6);
    design.trace.paths = 600_000;
    design
}
