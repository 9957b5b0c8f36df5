// SPDX-License-Identifier: MIT OR Apache-2.0
//! Judges the candidates of a search outside of the program: a line of JSON in for each candidate, a
//! line of JSON out. The first stage of the problem gives model, paths and settings of the traces.

use std::io::{BufRead, Write};

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use arrays::cache::Cache;
use design::dotted_keys::Settings;
use design::resolved::check_paths;
use runtime::run_context::RunContext;
use search::Point;

use super::evaluate::Evaluator;
use super::log::Candidate;
use super::problem::Problem;
use super::variables::Variables;

/// A candidate to judge.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    /// Anything; it comes back with the answer.
    #[serde(default)]
    id: Value,
    /// In the unit box.
    point: Point,
    /// Paths of the trace; absent: `paths` of the stage.
    paths: Option<u64>,
    /// Seed of the trace; absent: that of the command.
    seed: Option<u64>,
}

/// A candidate with what came of it.
#[derive(Debug, Serialize)]
struct Answer {
    id: Value,
    #[serde(flatten)]
    candidate: Candidate,
}

/// Writes a line on the problem to `output`, then a line for each line of `input` until it ends.
///
/// # Errors
/// A line that is no candidate, with its number; an interrupt; those of the streams.
pub fn judge_lines(
    problem: &Problem,
    cache: &Cache,
    context: RunContext,
    input: impl BufRead,
    mut output: impl Write,
) -> Result<()> {
    let stage = &problem.stages[0];
    let variables = problem.variables.resumed(&Settings::new(), stage.knots)?;
    writeln!(output, "{}", head(problem, &variables)?)?;
    output.flush()?;
    let mut evaluator = Evaluator::new(problem, &variables, stage, cache, None);
    for (number, line) in (1..).zip(input.lines()) {
        let line = line.context("standard input cannot be read")?;
        if line.trim().is_empty() {
            continue;
        }
        context.interrupt.check()?;
        let what = format!("standard input, line {number}");
        let answer = answer(&line, &mut evaluator, &what, context);
        let answer = answer.with_context(|| what)?;
        writeln!(output, "{}", serde_json::to_string(&answer)?)?;
        output.flush()?;
    }
    Ok(())
}

/// Line that tells an outer search of the problem.
fn head(problem: &Problem, variables: &Variables) -> Result<Value> {
    let start = variables.start()?;
    let ends = [0.0, 1.0].map(|share| variables.coefficients(&vec![share; start.len()]));
    let labels = variables.labels().into_iter().zip(&start);
    let ends = ends[0].iter().zip(&ends[1]);
    let each = labels.zip(ends).map(|((label, start), (from, to))| {
        json!({"label": label, "from": from, "to": to, "start": start})
    });
    Ok(json!({
        "kind": "problem",
        "name": problem.name,
        "model": problem.stages[0].model.word(),
        "paths": problem.stages[0].paths,
        "variables": each.collect::<Vec<_>>(),
    }))
}

fn answer(
    line: &str,
    evaluator: &mut Evaluator,
    what: &str,
    context: RunContext,
) -> Result<Answer> {
    let request: Request = serde_json::from_str(line)
        .map_err(|error| anyhow::anyhow!("expected a candidate as JSON, got {error}"))?;
    let dimension = evaluator.variables.dimension();
    let inside = request.point.iter().all(|x| (0.0..=1.0).contains(x));
    ensure!(
        request.point.len() == dimension && inside,
        "point: expected {dimension} numbers from 0 to 1, got {:?}",
        request.point
    );
    let paths = request.paths.unwrap_or(evaluator.stage.paths);
    check_paths("paths", paths)?;
    let seed = request.seed.unwrap_or(context.seed);
    let context = RunContext { seed, ..context };
    let outcome = evaluator.evaluate(&request.point, paths, what, context)?;
    let candidate = Candidate::new(&request.point, evaluator, &outcome);
    Ok(Answer { id: request.id, candidate })
}
