// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures of an optimisation, from `optimise.json`.

use anyhow::Result;

use metrics::Estimate;
use metrics::quantity::{Curve, Unit};
use results::figure_entry::FigureEntry;
use results::optimisation::{GenerationEntry, OptimisationFile};

use super::plots::{Heading, MarkedLine, Picture, marked_lines, pareto_front, search_convergence};

fn heading(file: &OptimisationFile, title: &str) -> Heading {
    Heading::new(title, format!("{} from {}", file.name, file.design))
}

/// The convergence of the search: the best candidate of every generation that met the
/// constraints, over the number of candidates, and the verified objective before and after.
///
/// # Errors
/// Values that are no curve.
pub fn convergence_picture(file: &OptimisationFile) -> Result<Picture> {
    let heading = heading(file, "Convergence of the search");
    search_convergence(&heading, &convergence(file)?)
}

fn convergence(file: &OptimisationFile) -> Result<Vec<Curve>> {
    let (mut at, mut value, mut error) = (Vec::new(), Vec::new(), Vec::new());
    let mut so_far: Vec<Estimate> = Vec::new();
    let mut candidates = 0.0;
    for stage in &file.stages {
        // Values of stages with other settings are no better or worse than these.
        let mut least: Option<Estimate> = None;
        for generation in &stage.generations {
            candidates += generation.candidates as f64;
            let GenerationEntry { best, standard_error, feasible, .. } = generation;
            if let (Some(best), Some(standard_error), true) = (best, standard_error, feasible) {
                at.push(candidates);
                value.push(*best);
                error.push(*standard_error);
                let known = least.filter(|known| known.value <= *best);
                let best = known.unwrap_or(Estimate::new(*best, *standard_error));
                so_far.push(best);
                least = Some(best);
            }
        }
    }
    let level = |label: &str, entry: FigureEntry| {
        let e = entry.between_ends().unwrap_or(entry.estimate());
        let errors = vec![e.standard_error; 2];
        Curve::new(label, vec![0.0, candidates], vec![e.value; 2], errors)
    };
    let mut curves = Vec::new();
    if at.len() > 1 {
        let label = "best of a generation, in the search";
        let (best, errors) = so_far.iter().map(|e| (e.value, e.standard_error)).unzip();
        curves.push(Curve::new(label, at.clone(), value, error)?);
        curves.push(Curve::new("best so far, in the search", at, best, errors)?);
    }
    if let Some(before) = file.objective.before {
        curves.push(level("verified before", before)?);
    }
    curves.push(level("verified after", file.objective.after)?);
    Ok(curves)
}

/// Change of the objective for one unit of each coefficient, where it was looked at.
///
/// # Errors
/// Values that cannot be drawn.
pub fn sensitivity_picture(file: &OptimisationFile) -> Result<Option<Picture>> {
    let lines = file.coefficients.iter().filter_map(|c| {
        let sensitivity = c.sensitivity?;
        Some(MarkedLine {
            label: c.variable.clone(),
            marks: vec![(String::new(), sensitivity)],
            least: f64::NEG_INFINITY,
        })
    });
    let lines: Vec<MarkedLine> = lines.collect();
    if lines.is_empty() {
        return Ok(None);
    }
    let heading = heading(file, "Sensitivities at the design found");
    let words = "change of the objective for one unit";
    marked_lines(&heading, words, Unit::Relative, &lines).map(Some)
}

/// The Pareto front, where one was sought.
///
/// # Errors
/// Values that cannot be drawn.
pub fn front_picture(file: &OptimisationFile) -> Result<Option<Picture>> {
    let Some(front) = &file.front else {
        return Ok(None);
    };
    let heading = heading(file, "Pareto front");
    let names = front.figures.each_ref().map(String::as_str);
    let designs: Vec<[FigureEntry; 2]> = front.designs.iter().map(|d| d.figures).collect();
    pareto_front(&heading, names, &designs, front.before).map(Some)
}
