// SPDX-License-Identifier: MIT OR Apache-2.0
//! What each coefficient does to the objective at the design that was found.

use anyhow::Result;

use metrics::Estimate;
use runtime::run_context::RunContext;
use search::Point;
use simulate::model::Model;
use simulate::seeds::mix;

use super::evaluate::Evaluator;
use super::objective::Evaluation;
use super::outcome::Outcome;
use super::shared_evaluations::Batch;

/// Share of a range by which a coefficient is moved to see what it does.
const MOVE: f64 = 0.02;
/// Number of the seed beside those of the search.
const SENSITIVITY: u64 = 0x5e45;

/// Change of the objective for one unit of each coefficient at `point`, by paired traces; only
/// where no tables have to be solved for it.
///
/// # Errors
/// Errors of the evaluator.
pub(super) fn sensitivities(
    mut evaluator: Evaluator,
    point: &Point,
    context: RunContext,
) -> Result<Vec<Option<Estimate>>> {
    let (stage, variables) = (evaluator.stage, evaluator.variables);
    if stage.model == Model::Hybrid {
        return Ok(vec![None; point.len()]);
    }
    let seed = mix(context.seed ^ mix(SENSITIVITY));
    let context = RunContext { seed, ..context };
    let what = "sensitivities";
    let progress = context.console.progress(2 * point.len() as u64, what);
    let moved = (0..point.len()).flat_map(|k| {
        [-MOVE, MOVE].map(|side| {
            let mut moved = point.clone();
            moved[k] = (moved[k] + side).clamp(0.0, 1.0);
            moved
        })
    });
    let moved: Vec<Point> = moved.collect();
    let batch = Batch {
        name: what.to_owned(),
        count: moved.len(),
        points: &moved,
        paths: stage.most_paths,
        progress: &progress,
    };
    let outcomes = evaluator.outcomes(&batch, context, |evaluator, number| {
        evaluator.evaluate(&moved[number], stage.most_paths, what, context)
    });
    progress.finish_and_clear();
    let outcomes: Vec<_> = moved.iter().zip(outcomes?).collect();
    let mut found = Vec::new();
    for (k, pair) in outcomes.chunks(2).enumerate() {
        let at = |moved: &Point| variables.coefficients(moved)[k];
        let judged = pair.iter().filter_map(|(moved, outcome)| match outcome {
            Outcome::Evaluated(one) => Some((at(moved), one)),
            Outcome::Refused(_) => None,
        });
        let judged: Vec<(f64, &Evaluation)> = judged.collect();
        found.push(match judged.as_slice() {
            [(a, low), (b, high)] if b > a && variables.is_number(k) => {
                Some(high.objective.change(&low.objective).times(1.0 / (b - a)))
            }
            _ => None,
        });
    }
    Ok(found)
}
