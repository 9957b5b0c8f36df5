// SPDX-License-Identifier: MIT OR Apache-2.0
//! A checked problem: reads the problem file and its design, and checks them against each other.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::json;

use design::Design;
use design::dotted_keys::{Settings, check_entries_stay};
use design::resolved::check_paths;
use runtime::key::Key;
use runtime::provenance::FileRecord;
use simulate::model::Model;

use super::file::{Method, ProblemFile, StageKeys};
use super::limits::Limits;
use super::objective::Objective;
use super::robust::RobustObjective;
use super::variables::Variables;
use crate::checked_file::{CheckedFile, Texts, is_file_name};

/// Version of the search; raise it whenever the same problem would be searched otherwise.
const SEARCH_VERSION: u32 = 6;
/// Paths of the first traces of a stage.
const FIRST_PATHS: u64 = 65_536;
/// Most paths of the traces of a stage.
const MOST_PATHS: u64 = 1_048_576;
/// Runs of a search by CMA-ES.
const RESTARTS: usize = 3;
/// Candidates of a generation of a search for a Pareto front.
const FRONT_POPULATION: usize = 40;
/// Standard deviation at the start of a search, as a share of the ranges.
const STEP: f64 = 0.2;
/// Most letters of a name, as of a design.
const MAX_LETTERS: usize = 100;
/// Most candidates of a stage.
const MOST_EVALUATIONS: usize = 1_000_000;

/// A checked problem.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Short name, used for the design that is found.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// The design to start from.
    pub design: Design,
    /// Searches in their order.
    pub stages: Vec<StageSettings>,
    /// Models in which the result is verified.
    pub models: Vec<Model>,
    /// Paths of the verification, instead of those of the design.
    pub verification_paths: Option<u64>,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    pub(super) variables: Variables,
    pub(super) objective: Objective,
    /// Tolerances over which the objective is taken.
    pub(super) robust: Option<RobustObjective>,
    text: String,
}

/// A checked stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageSettings {
    /// Model of its traces.
    pub model: Model,
    /// Method that selects candidates.
    pub method: Method,
    /// Coefficients of each profile over rings.
    pub knots: Option<usize>,
    /// Most candidates.
    pub evaluations: usize,
    /// Runs.
    pub restarts: usize,
    /// Candidates of a generation.
    pub population: usize,
    /// Standard deviation at the start, as a share of the ranges.
    pub step: f64,
    /// Paths of the first traces.
    pub paths: u64,
    /// Most paths of a trace.
    pub most_paths: u64,
    /// Keys of the design that hold for its traces alone.
    pub set: Settings,
}

/// Reads and checks the problem at `path` with its design; `texts` stand for files.
///
/// # Errors
/// A file that cannot be read, a key out of range, variables or figures that the design does not
/// have.
pub fn load(path: &Path, texts: &Texts) -> Result<Problem> {
    CheckedFile::load(path, texts, check)
}

fn check(mut head: CheckedFile<ProblemFile>) -> Result<Problem> {
    let file = head.keys.clone();
    ensure!(
        file.name.len() <= MAX_LETTERS && is_file_name(&file.name),
        "name: expected at most {MAX_LETTERS} letters, digits, '-', '_' and '.', got {:?}",
        file.name
    );
    // The folder of its results lies beside files of the search.
    ensure!(
        !["toml", "json", "jsonl", "png"].iter().any(|end| file.name.ends_with(&format!(".{end}"))),
        "name: expected none that ends as a file does, got {:?}",
        file.name
    );
    let source = head.design("design", &file.design)?;
    let design = source.with(&Settings::new())?;
    ensure!(
        design.name != file.name,
        "name: expected another name than that of the design, got {:?}",
        file.name
    );
    let limits = Limits::new(&file.limits)?;
    let variables = Variables::new(source, &file.variables, limits)?;
    // A coefficient that starts nowhere is refused before anything is written.
    variables.start().context("variables")?;
    let (terms, source) = (&file.objective.terms, &variables.source);
    let (objective, targets) = Objective::new(terms, &file.constraints, source, &head.folder)?;
    let default = [StageKeys::default()];
    let stages = match file.stages.as_slice() {
        [] => default.as_slice(),
        stages => stages,
    };
    let stages = stages.iter().enumerate().map(|(k, keys)| {
        stage(keys, &variables, &design).with_context(|| format!("stages[{}]", k + 1))
    });
    let stages: Vec<StageSettings> = stages.collect::<Result<_>>()?;
    let (robust, named) =
        RobustObjective::new(&file.objective, file.verification.samples, &head.folder)?.unzip();
    if let Some(robust) = &robust {
        robust.check(&variables.source).context("objective.tolerances")?;
    }
    for (k, one) in stages.iter().enumerate() {
        if one.method == Method::Nsga2 {
            seeks_a_front(&objective, robust.is_some(), k + 1 == stages.len())
                .with_context(|| format!("stages[{}].method", k + 1))?;
        }
    }
    let of_stages = || {
        let mut models: Vec<Model> = Vec::new();
        for stage in &stages {
            if !models.contains(&stage.model) {
                models.push(stage.model);
            }
        }
        models
    };
    let models = file.verification.models.unwrap_or_else(of_stages);
    ensure!(!models.is_empty(), "verification.models: expected at least one, got none");
    for model in &models {
        model.available(&design).context("verification.models")?;
    }
    if let Some(paths) = file.verification.paths {
        check_paths("verification.paths", paths)?;
    }
    let mut inputs = head.inputs;
    inputs.extend(design.provenance.all_named().cloned());
    inputs.extend(named.into_iter().flatten());
    inputs.extend(targets);
    Ok(Problem {
        name: file.name,
        description: file.description,
        design,
        stages,
        models,
        verification_paths: file.verification.paths,
        inputs,
        variables,
        objective,
        robust,
        text: head.text,
    })
}

impl Problem {
    /// Key of the search: all that its candidates depend on.
    pub fn key(&self, seed: u64) -> Key {
        let hashes = self.inputs.iter().map(|input| &input.sha256);
        Key::of(&json!({
            "search_version": SEARCH_VERSION,
            "version": env!("CARGO_PKG_VERSION"),
            "problem": self.text,
            "inputs": hashes.collect::<Vec<_>>(),
            "seed": seed,
        }))
    }
}

/// Checks that a stage may seek a Pareto front.
fn seeks_a_front(objective: &Objective, robust: bool, last: bool) -> Result<()> {
    let front = "\"nsga2\"";
    ensure!(objective.pair().is_some(), "expected {front} with two terms of different figures");
    ensure!(!robust, "expected {front} without objective.tolerances");
    ensure!(last, "expected {front} in the last stage alone");
    Ok(())
}

fn stage(keys: &StageKeys, variables: &Variables, design: &Design) -> Result<StageSettings> {
    let model = keys.model.unwrap_or(Model::Geometric);
    // A smooth dome has rays alone, whatever the variables make of it.
    model.available(design)?;
    ensure!(keys.knots != Some(0), "knots: expected 1 or more, got 0");
    let variables = variables.resumed(&Settings::new(), keys.knots)?;
    let dimension = variables.dimension();
    let population = match keys.population {
        Some(population) => population,
        None if keys.method == Method::Nsga2 => FRONT_POPULATION,
        None => 4 + (3.0 * (dimension as f64).ln()) as usize,
    };
    ensure!(
        (4..=10_000).contains(&population),
        "population: expected 4 to 10000, got {population}"
    );
    let evaluations = keys.evaluations.unwrap_or(100 * population);
    ensure!(
        (population..=MOST_EVALUATIONS).contains(&evaluations),
        "evaluations: expected {population}, one generation, to {MOST_EVALUATIONS}, got {evaluations}"
    );
    ensure!(
        keys.restarts.is_none_or(|restarts| restarts == 1) || keys.method == Method::CmaEs,
        "restarts: expected more than 1 with method = \"cma_es\" alone, got it with {:?}",
        keys.method.name()
    );
    let restarts = match keys.method {
        Method::CmaEs => RESTARTS.min(evaluations / population),
        _ => 1,
    };
    let restarts = keys.restarts.unwrap_or(restarts);
    ensure!(
        restarts >= 1 && restarts * population <= evaluations,
        "restarts: expected 1 to {}, each with a generation of {population}, got {restarts}",
        evaluations / population
    );
    let step = keys.step.unwrap_or(STEP);
    ensure!(
        step > 0.0 && step <= 1.0,
        "step: expected a share of the ranges above 0 and up to 1, got {step}"
    );
    let paths = keys.paths.unwrap_or(FIRST_PATHS);
    let most_paths = keys.most_paths.unwrap_or(MOST_PATHS.max(paths));
    check_paths("paths", paths)?;
    check_paths("most_paths", most_paths)?;
    ensure!(
        most_paths >= paths,
        "most_paths: expected at least `paths`, {paths}, got {most_paths}"
    );
    for key in keys.set.keys() {
        ensure!(!variables.is_set(key), "set: expected keys that no variable changes, got {key}");
    }
    check_entries_stay(&variables.source.table, &keys.set).context("set")?;
    variables.source.with(&keys.set).context("set")?;
    Ok(StageSettings {
        model,
        method: keys.method,
        knots: keys.knots,
        evaluations,
        restarts,
        population,
        step,
        paths,
        most_paths,
        set: keys.set.clone(),
    })
}
