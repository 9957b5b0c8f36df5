// SPDX-License-Identifier: MIT OR Apache-2.0
//! What an optimisation says of itself: the content of `optimise.json`, and lines for people.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use metrics::Estimate;
use metrics::digits::{shortest, thousands};
use metrics::plural::count;
use metrics::quantity::Unit;
use results::constraint;
use results::figure_entry::FigureEntry;
use results::optimisation::{
    CoefficientEntry, ComparedFigure, ConstraintEntry, FrontDesignEntry, FrontEntry,
    MissedCandidate, ObjectiveEntry, OptimisationFile, SCHEMA_VERSION, StageEntry, Verdict,
};
use results::schema::Program;
use results::shown::{self, named, with_error};
use simulate::observation::unit_in_files;

use super::front::FrontDesign;
use super::objective::{Evaluation, Objective};
use super::problem::Problem;
use super::recipe::{Optimised, StageOutcome};

/// Coefficients whose sensitivity is listed for people.
const LISTED: usize = 8;
/// Reasons of refusals that are listed.
const REASONS: usize = 5;
/// A difference of so many standard errors is seen.
const SEEN: f64 = 2.0;

impl Optimised {
    /// The content of `optimise.json`, without the files that came out.
    pub fn to_file(&self, problem: &Problem, seed: u64) -> OptimisationFile {
        let figures = self.figures().map(|(key, before, after)| {
            let change =
                before.map(|before| after.change(before).in_range_of_changes(named(key).1));
            let verdict = before.zip(change).map(|(before, change)| {
                let values = [before.entry.value, after.entry.value];
                Verdict::new(&change, problem.objective.larger_is_better(key, values))
            });
            let entry = ComparedFigure {
                unit: unit_in_files(&problem.design, key),
                before: before.map(|before| before.entry),
                after: after.entry,
                change,
                verdict,
            };
            (key.to_owned(), entry)
        });
        OptimisationFile {
            schema_version: SCHEMA_VERSION,
            program: Program::this(),
            name: problem.name.clone(),
            design: problem.design.name.clone(),
            description: problem.description.clone(),
            seed,
            inputs: problem.inputs.clone(),
            files: Vec::new(),
            objective: self.objective(&problem.objective),
            terms: problem.objective.terms(),
            figures: figures.collect::<BTreeMap<_, _>>(),
            constraints: self.constraints(problem),
            front: self.front_entry(problem),
            active_limits: self.active_limits.clone(),
            coefficients: self.verified.coefficients.clone(),
            stages: self.stages.iter().map(StageOutcome::entry).collect(),
        }
    }

    fn objective(&self, objective: &Objective) -> ObjectiveEntry {
        let (_, selected) = &self.stages[self.stages.len() - 1].result.final_candidates[0];
        let entry = |judged: &Evaluation| objective.entry(judged);
        let as_in_search = entry(&self.verified.as_in_search);
        let before = self.verified.before.as_ref();
        let change = before.map(|before| objective.change(&self.verified.after, before));
        ObjectiveEntry {
            before: before.map(entry),
            after: entry(&self.verified.after),
            change,
            verdict: change.map(|change| Verdict::new(&change, Some(false))),
            in_search: selected.in_search,
            at_selection: selected.objective(),
            bias_of_search: selected.in_search.map(|value| FigureEntry {
                value: as_in_search.value - value,
                interval: as_in_search.interval.map(|ends| ends.map(|end| end - value)),
                ..as_in_search
            }),
            as_in_search,
        }
    }

    fn constraints(&self, problem: &Problem) -> Vec<ConstraintEntry> {
        let all = problem.objective.constraints.iter().map(|constraint| {
            let figure = self.verified.after.figure(&constraint.figure);
            ConstraintEntry {
                figure: constraint.figure.clone(),
                at_least: constraint.bounds.at_least,
                at_most: constraint.bounds.at_most,
                margin: constraint.margin,
                value: figure.map(|figure| figure.entry),
                met: figure.is_some_and(|figure| constraint.is_met(&figure.entry)),
            }
        });
        all.collect()
    }

    /// The Pareto front with both figures of every design; none where no front was sought.
    fn front_entry(&self, problem: &Problem) -> Option<FrontEntry> {
        let names = problem.objective.pair()?;
        let pair = |judged: &Evaluation| {
            let [first, second] = names.map(|key| judged.figure(key).map(|figure| figure.entry));
            Some([first?, second?])
        };
        let entry = |one: &FrontDesign| {
            Some(FrontDesignEntry {
                design: one.file.clone(),
                coefficients: one.coefficients.clone(),
                figures: pair(&one.judged)?,
                feasible: one.judged.miss <= 0.0,
                misses: problem.objective.missed(&one.judged.entries()),
            })
        };
        let designs: Vec<FrontDesignEntry> = self.verified.front.iter().filter_map(entry).collect();
        (!designs.is_empty()).then(|| FrontEntry {
            figures: names.map(str::to_owned),
            before: self.verified.before.as_ref().and_then(pair),
            designs,
        })
    }
}

impl StageOutcome {
    fn entry(&self) -> StageEntry {
        let (settings, result) = (&self.settings, &self.result);
        let final_candidates = result.final_candidates.iter();
        StageEntry {
            model: settings.model.word().to_owned(),
            method: settings.method.name().to_owned(),
            most_evaluations: settings.evaluations,
            restarts: settings.restarts,
            population: settings.population,
            evaluations: result.evaluations,
            cut_short: result.cut_short,
            refusals: result.refusals.iter().take(REASONS).cloned().collect(),
            missed: self.missed.clone(),
            generations: result.generations.clone(),
            final_candidates: final_candidates.map(|(_, entry)| entry.clone()).collect(),
        }
    }
}

/// Lines for people.
pub fn plain_text(file: &OptimisationFile) -> String {
    let mut text = String::new();
    for (number, stage) in (1..).zip(&file.stages) {
        add_stage(&mut text, number, stage);
    }
    add_figures(&mut text, file);
    if let Some(front) = &file.front {
        add_front(&mut text, front);
    }
    add_sensitivities(&mut text, file);
    text
}

// Writing to a string cannot fail.

fn add_stage(text: &mut String, at: usize, stage: &StageEntry) {
    let ended = if stage.cut_short { "; ended by the budget of time" } else { "" };
    let _ = match stage.generations.last() {
        None => writeln!(text, "stage {at}: no generation{ended}"),
        Some(last) => writeln!(
            text,
            "stage {at}: {} in {}, last with {} paths each{ended}",
            count(stage.evaluations, "candidate"),
            count(stage.generations.len(), "generation"),
            thousands(last.paths)
        ),
    };
    for (why, times) in &stage.refusals {
        let _ = writeln!(text, "  refused {}: {why}", count(*times, "time"));
    }
    if let Some(MissedCandidate { objective, variables, misses }) = &stage.missed {
        let _ = writeln!(
            text,
            "  a better objective, {}, misses constraints: {}; with {}",
            shown::number(objective, Unit::Relative),
            misses.join("; "),
            variables.join(", ")
        );
    }
}

/// Constraints that the verified figures do not meet.
pub fn missed_constraints(file: &OptimisationFile) -> Vec<String> {
    let missed = missed(file, |constraint| constraint.value).into_iter();
    missed.map(|missed| format!("constraints: when verified, {missed}")).collect()
}

/// Constraints that the figures `of` each do not meet.
fn missed(
    file: &OptimisationFile,
    of: impl Fn(&ConstraintEntry) -> Option<FigureEntry>,
) -> Vec<String> {
    let missed = file.constraints.iter().filter_map(|c| match of(c) {
        Some(figure) => constraint::missed(&c.figure, c.bounds(), c.margin, &figure),
        None => Some(format!("{} cannot be read", c.figure)),
    });
    missed.collect()
}

fn add_figures(text: &mut String, file: &OptimisationFile) {
    text.push('\n');
    let mut row = |name: &str, [before, after, change]: [&str; 3], verdict: Option<Verdict>| {
        let verdict = verdict.map_or("", Verdict::words);
        let line = format!("{name:<28} {before:>20} {after:>20} {change:>22}  {verdict}");
        let _ = writeln!(text, "{}", line.trim_end());
    };
    row("verified", [&file.design, &file.name, "change"], None);
    let (listed, others) = file.listed();
    for (key, f) in listed {
        let unit = Unit::from_name(&f.unit).unwrap_or(named(key).1);
        let is_judged = file.objective.before.is_some();
        let absent = || if is_judged { shown::absent(key).to_owned() } else { String::new() };
        let before = f.before.map_or_else(absent, |before| shown::text(&before, unit));
        let change = f.change.map(|change| shown::difference_between(&change, unit));
        let change = change.unwrap_or_default();
        row(key, [&before, &shown::text(&f.after, unit), &change], f.verdict);
    }
    let objective = &file.objective;
    let words = [objective.before, Some(objective.after), objective.change];
    let words = words.map(|e| e.map(|e| shown::number(&e, Unit::Relative)).unwrap_or_default());
    row("objective", words.each_ref().map(String::as_str), objective.verdict);
    if let Some(others) = others {
        let _ = writeln!(text, "{others}");
    }
    let worse = file.figures.iter().filter(|(_, figure)| figure.verdict == Some(Verdict::Worse));
    let worse: Vec<&str> = worse.map(|(key, _)| key.as_str()).collect();
    if !worse.is_empty() {
        let _ = writeln!(text, "worse than {} beyond errors: {}", file.design, worse.join(", "));
    }
    let missed = missed(file, |c| file.figures.get(&c.figure)?.before);
    if !missed.is_empty() {
        let missed = missed.join("; ");
        let _ = writeln!(text, "{} does not meet the constraints: {missed}", file.design);
    }
    if let Some(change) = objective.change.filter(|_| missed.is_empty())
        && objective.verdict != Some(Verdict::Better)
    {
        let changed = match objective.verdict {
            Some(Verdict::Unchanged) => "did not change".to_owned(),
            _ => format!("changed by {}", shown::number(&change, Unit::Relative)),
        };
        let design = &file.design;
        let _ = writeln!(text, "not better than {design} beyond errors: the objective {changed}");
    }
    if let (Some(value), Some(bias)) = (objective.in_search, objective.bias_in_words()) {
        let _ = writeln!(text, "the search's own best value was {}, {bias}", shortest(value));
    }
    let runs = file.stages.last().map(StageEntry::runs);
    let runs = runs.unwrap_or_default();
    if runs.len() > 1 {
        let listed: Vec<String> = runs
            .iter()
            .map(|(run, e)| format!("{} (run {run})", shown::number(e, Unit::Relative)))
            .collect();
        let _ = writeln!(text, "runs of the last stage ended at {}", listed.join(", "));
    }
}

fn add_front(text: &mut String, front: &FrontEntry) {
    let [first, second] = &front.figures;
    let _ = writeln!(text, "\n{:<28} {first:>28} {second:>28}", "front, verified");
    for one in &front.designs {
        let [a, b] = [0, 1].map(|k| shown::text(&one.figures[k], named(&front.figures[k]).1));
        let _ = writeln!(text, "{:<28} {a:>28} {b:>28}", one.design);
        for missed in &one.misses {
            let _ = writeln!(text, "  misses a constraint: {missed}");
        }
    }
}

fn add_sensitivities(text: &mut String, file: &OptimisationFile) {
    if !file.active_limits.is_empty() {
        let _ = writeln!(text, "at the limits: {}", file.active_limits.join("; "));
    }
    let seen = |c: &CoefficientEntry| {
        let sensitivity = c.sensitivity?;
        let clear = sensitivity.value.abs() > SEEN * sensitivity.standard_error;
        clear.then(|| (c.clone(), sensitivity))
    };
    let mut strongest: Vec<(CoefficientEntry, Estimate)> =
        file.coefficients.iter().filter_map(seen).collect();
    strongest.sort_by(|a, b| b.1.value.abs().total_cmp(&a.1.value.abs()));
    if !strongest.is_empty() {
        let _ = writeln!(text, "objective for one unit of:");
    }
    for (c, sensitivity) in strongest.into_iter().take(LISTED) {
        let slope = with_error(sensitivity);
        let _ = writeln!(text, "  {:<26} {slope:>18}, at {}", c.variable, shortest(c.found));
    }
}
