// SPDX-License-Identifier: MIT OR Apache-2.0
//! The objective and the constraints: from figures of a trace to one value, smaller is better.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use design::Design;
use design::dotted_keys::Settings;
use design::formulas;
use metrics::{Bounds, Estimate, figures};
use results::constraint;
use results::figure_entry::FigureEntry;
use results::paired_figure::PairedFigure;
use results::shown;
use runtime::provenance::FileRecord;
use simulate::observation::{Observation, check_figure};

use super::file::{ConstraintKeys, Goal, TermKeys};
use super::target::{DISTANCES, Target};
use crate::design_file::DesignFile;
use crate::paired_sum::{PairedSum, differences, of_packages};

/// Before a dotted key of the design: its number, without error.
const DESIGN: &str = "design.";
/// Before the name of a receiver: its share of the light.
const RECEIVER: &str = "receiver.";

/// Scales and weights of terms.
const FACTORS: RangeInclusive<f64> = 1e-12..=1e12;

/// A term of the objective.
#[derive(Debug, Clone)]
struct Term {
    figure: String,
    goal: Goal,
    target: f64,
    scale: f64,
    weight: f64,
}

impl Term {
    /// What one unit of the figure changes of it.
    fn slope(&self) -> f64 {
        self.weight / self.scale
    }

    /// What it adds to the objective.
    fn cost(&self, value: f64) -> f64 {
        self.weight
            * match self.goal {
                Goal::Maximise => -value / self.scale,
                Goal::Minimise => value / self.scale,
                Goal::Target => (value - self.target).abs() / self.scale,
            }
    }
}

/// A bound of a figure.
#[derive(Debug, Clone)]
pub(super) struct Constraint {
    pub figure: String,
    pub bounds: Bounds,
    pub margin: f64,
}

impl Constraint {
    /// How far `figure` is from meeting it, relative to the bound; 0 where it is met.
    fn miss(&self, figure: &FigureEntry) -> f64 {
        constraint::miss(self.bounds, self.margin, figure)
    }

    /// Whether `figure` meets it, margin included.
    pub fn is_met(&self, figure: &FigureEntry) -> bool {
        self.miss(figure) <= 0.0
    }

    /// Whether one standard error of `figure` to either side decides if it is met.
    pub fn is_undecided(&self, figure: &FigureEntry) -> bool {
        let miss = |errors: f64| self.bounds.miss(figure.value, errors * figure.standard_error);
        miss(self.margin + 1.0) > 0.0 && miss(self.margin - 1.0) <= 0.0
    }

    /// For people.
    pub fn words(&self) -> String {
        let bounds = shown::bounds(self.bounds, shown::named(&self.figure).1);
        format!("{} {bounds} by {} standard errors", self.figure, self.margin)
    }

    /// For people: the bound that `figure` misses and by how much; `None` where it is met.
    pub fn missed(&self, figure: &FigureEntry) -> Option<String> {
        constraint::missed(&self.figure, self.bounds, self.margin, figure)
    }
}

/// What a search seeks.
#[derive(Debug, Clone)]
pub(super) struct Objective {
    terms: Vec<Term>,
    pub constraints: Vec<Constraint>,
    /// Targets of figures that are distances.
    targets: BTreeMap<String, Target>,
}

/// A candidate judged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Evaluation {
    /// Objective; smaller is better.
    pub objective: PairedSum,
    /// Sum of the misses of constraints.
    pub miss: f64,
    /// Figures of the objective and the constraints.
    pub figures: Vec<(String, PairedFigure)>,
}

impl Evaluation {
    /// Figures of the objective and the constraints by key.
    pub fn entries(&self) -> BTreeMap<String, FigureEntry> {
        self.figures.iter().map(|(key, figure)| (key.clone(), figure.entry)).collect()
    }

    /// A figure with its state and its replicates.
    pub fn figure(&self, key: &str) -> Option<&PairedFigure> {
        self.figures.iter().find(|(known, _)| known == key).map(|(_, figure)| figure)
    }
}

impl Objective {
    /// Checks `terms` and `constraints` against `design`; files of targets lie beside `folder` and
    /// come back as records.
    ///
    /// # Errors
    /// Figures that there are not, bounds that cross, targets that cannot be read.
    pub fn new(
        terms: &[TermKeys],
        constraints: &[ConstraintKeys],
        source: &DesignFile,
        folder: &Path,
    ) -> Result<(Self, Vec<FileRecord>)> {
        let design = &source.with(&Settings::new())?;
        ensure!(!terms.is_empty(), "objective.terms: expected at least one, got none");
        let (mut targets, mut inputs) = (BTreeMap::new(), Vec::new());
        for (k, keys) in terms.iter().enumerate() {
            let at = || format!("objective.terms[{}]", k + 1);
            known(&keys.figure, design, source).with_context(at)?;
            if let Some((target, record)) = target(keys, folder).with_context(at)? {
                ensure!(
                    targets.insert(keys.figure.clone(), target).is_none(),
                    "{}.figure: expected {} in one term, got it in two",
                    at(),
                    keys.figure
                );
                inputs.push(record);
            }
        }
        let terms = terms.iter().enumerate();
        let terms = terms
            .map(|(k, keys)| term(keys).with_context(|| format!("objective.terms[{}]", k + 1)));
        let bounds = constraints.iter().enumerate();
        let bounds = bounds.map(|(k, keys)| {
            constraint_of(keys, design, source).with_context(|| format!("constraints[{}]", k + 1))
        });
        let objective = Self {
            terms: terms.collect::<Result<_>>()?,
            constraints: bounds.collect::<Result<_>>()?,
            targets,
        };
        Ok((objective, inputs))
    }

    /// The objective of `judged`, between two ends where a figure of a term is.
    pub fn entry(&self, judged: &Evaluation) -> FigureEntry {
        let parts = self.terms.iter().filter_map(|term| {
            let entry = judged.figure(&term.figure)?.entry;
            let value = term.cost(entry.value);
            let off = |ends: [f64; 2]| {
                // A target between the ends is met there.
                let target = term.target.clamp(ends[0], ends[1]);
                let at = [ends[0], target, ends[1]].map(|end| term.cost(end) - value);
                [
                    at.into_iter().fold(f64::INFINITY, f64::min),
                    at.into_iter().fold(f64::NEG_INFINITY, f64::max),
                ]
            };
            Some((entry.interval.map(off), term.slope() * entry.standard_error))
        });
        known_between(judged.objective.estimate(), parts, &judged.objective.without_package)
    }

    /// The objective of `after` less that of `before`, between two ends where the change of a figure of
    /// a term is.
    pub fn change(&self, after: &Evaluation, before: &Evaluation) -> FigureEntry {
        let [own, other] = [after, before].map(|judged| &judged.objective);
        let by_packages = differences(&own.without_package, &other.without_package);
        let parts = self.terms.iter().filter_map(|term| {
            let change = after.figure(&term.figure)?.change(before.figure(&term.figure)?);
            let off = |[low, high]: [f64; 2]| {
                let [low, high] = [low - change.value, high - change.value];
                let [low, high] = match term.goal {
                    Goal::Minimise => [low, high],
                    Goal::Maximise => [-high, -low],
                    // The side of the target may change.
                    Goal::Target => [-high.max(-low), high.max(-low)],
                };
                [low * term.slope(), high * term.slope()]
            };
            Some((change.interval.map(off), term.slope() * change.standard_error))
        });
        known_between(own.change(other), parts, &by_packages)
    }

    /// Figures that are needed, in order of first use.
    fn wanted(&self) -> Vec<&str> {
        let terms = self.terms.iter().map(|t| t.figure.as_str());
        let bounds = self.constraints.iter().map(|c| c.figure.as_str());
        let mut wanted: Vec<&str> = Vec::new();
        for figure in terms.chain(bounds) {
            if !wanted.contains(&figure) {
                wanted.push(figure);
            }
        }
        wanted
    }

    /// True where the larger of two values of a figure is better: by the terms, then by the
    /// constraints, then by its definition. `None` where it is told by none of them.
    pub fn larger_is_better(&self, key: &str, [before, after]: [f64; 2]) -> Option<bool> {
        let term = self.terms.iter().find(|term| term.figure == key);
        let of_term = term.map(|term| match term.goal {
            Goal::Maximise => true,
            Goal::Minimise => false,
            Goal::Target => (term.cost(after) < term.cost(before)) == (after > before),
        });
        let constraint = self.constraints.iter().find(|constraint| constraint.figure == key);
        let of_constraint = constraint.and_then(|constraint| {
            let Bounds { at_least, at_most } = constraint.bounds;
            (at_least.is_some() != at_most.is_some()).then_some(at_least.is_some())
        });
        let registered =
            || figures::find(&registered(key)).and_then(|figure| figure.larger_is_better);
        of_term.or(of_constraint).or_else(registered)
    }

    /// Figures that a trace of a design must show, each with the key that asks for it.
    pub fn read_figures(&self) -> Vec<(String, &str)> {
        let terms = self.terms.iter().enumerate();
        let terms = terms
            .map(|(k, term)| (format!("objective.terms[{}].figure", k + 1), term.figure.as_str()));
        let constraints = self.constraints.iter().enumerate();
        let constraints = constraints.map(|(k, constraint)| {
            (format!("constraints[{}].figure", k + 1), constraint.figure.as_str())
        });
        let is_read = |figure: &str| figures::find(&registered(figure)).is_some();
        terms.chain(constraints).filter(|(_, figure)| is_read(figure)).collect()
    }

    /// Judges an observation of `design`, read from `file`; with `all`, its figures are those of
    /// the objective and all others that the observation shows.
    ///
    /// # Errors
    /// A figure that cannot be read from it.
    pub fn judge(
        &self,
        file: &DesignFile,
        design: &Design,
        seen: &Observation,
        all: bool,
    ) -> Result<Evaluation> {
        let wanted = self.wanted();
        let wanted_key = |key: &str| all || wanted.iter().any(|w| registered(w) == key);
        let read = seen.estimated_replicates(design, wanted_key);
        let figure = |key: &str| -> Result<PairedFigure> {
            if let Some(target) = self.targets.get(key) {
                return target.distance(design, seen);
            }
            if let Some(key) = key.strip_prefix(DESIGN) {
                let groups = seen.far_field.count();
                let value = number_of(key, file)?;
                return Ok(PairedFigure::new(value, vec![value; groups]));
            }
            let found = read.iter().find(|(known, _)| *known == registered(key));
            let (_, figure) = found.with_context(|| {
                let why = seen.why_absent(design, &registered(key));
                format!("{key} cannot be read: {why}")
            })?;
            Ok(figure.clone())
        };
        let figures = wanted.iter().map(|key| Ok(((*key).to_owned(), figure(key)?)));
        let mut figures: Vec<(String, PairedFigure)> = figures.collect::<Result<_>>()?;
        for (key, figure) in read {
            let FigureEntry { value, standard_error, .. } = figure.entry;
            let is_finite = value.is_finite() && standard_error.is_finite();
            if is_finite && figures.iter().all(|(known, _)| *known != key) {
                figures.push((key, figure));
            }
        }
        Ok(self.of_figures(figures))
    }

    /// Figures of the terms, if there are two different ones.
    pub fn pair(&self) -> Option<[&str; 2]> {
        match &self.terms[..] {
            [first, second] if first.figure != second.figure => {
                Some([&first.figure, &second.figure])
            }
            _ => None,
        }
    }

    /// Costs of both terms by their figures.
    pub fn pair_of_costs(&self, figures: &BTreeMap<String, FigureEntry>) -> Option<[f64; 2]> {
        self.pair()?;
        let cost = |term: &Term| Some(term.cost(figures.get(&term.figure)?.value));
        Some([cost(&self.terms[0])?, cost(&self.terms[1])?])
    }

    /// Terms for people.
    pub fn words(&self) -> Vec<String> {
        let words = |term: &Term| match term.goal {
            Goal::Maximise => format!("{}, larger", term.figure),
            Goal::Minimise => format!("{}, smaller", term.figure),
            Goal::Target => {
                let target = shown::stated(term.target, shown::named(&term.figure).1);
                format!("{}, near {target}", term.figure)
            }
        };
        self.terms.iter().map(words).collect()
    }

    /// Keys of the figures of the terms.
    pub fn terms(&self) -> Vec<String> {
        self.terms.iter().map(|term| term.figure.clone()).collect()
    }

    /// For people: the constraints that `figures` miss, each with by how much.
    pub fn missed(&self, figures: &BTreeMap<String, FigureEntry>) -> Vec<String> {
        let missed = self.constraints.iter();
        missed.filter_map(|c| c.missed(figures.get(&c.figure)?)).collect()
    }

    /// Sum of the misses of constraints of `figures`.
    pub fn miss(&self, figures: &[(String, PairedFigure)]) -> f64 {
        let misses = self.constraints.iter().filter_map(|constraint| {
            let (_, figure) = figures.iter().find(|(key, _)| *key == constraint.figure)?;
            Some(constraint.miss(&figure.entry))
        });
        misses.sum()
    }

    /// Objective and misses of `figures`.
    pub fn of_figures(&self, figures: Vec<(String, PairedFigure)>) -> Evaluation {
        let find = |key: &str| figures.iter().find(|(known, _)| known == key).map(|f| &f.1);
        let terms = self.terms.iter().filter_map(|term| Some((term, find(&term.figure)?)));
        let (terms, values): (Vec<&Term>, Vec<&PairedFigure>) = terms.unzip();
        let cost =
            |values: &[f64]| terms.iter().zip(values).map(|(t, value)| t.cost(*value)).sum::<f64>();
        Evaluation { objective: PairedSum::new(&values, cost), miss: self.miss(&figures), figures }
    }
}

/// A sum of parts with the state of its parts: each has its ends, relative to its value, where it is
/// known between them alone, and else its error.
fn known_between(
    sum: Estimate,
    parts: impl Iterator<Item = (Option<[f64; 2]>, f64)>,
    without_package: &[f64],
) -> FigureEntry {
    let (mut low, mut high, mut squares, mut is_open) = (sum.value, sum.value, 0.0, false);
    for (ends, error) in parts {
        if let Some(ends) = ends {
            is_open = true;
            low += ends[0];
            high += ends[1];
        } else {
            squares += error * error;
        }
    }
    let reach = 2.0 * f64::sqrt(squares).hypot(of_packages(without_package));
    FigureEntry::of_sum(sum, is_open.then_some([low - reach, high + reach]))
}

/// The key in the registry of figures: `receiver.NAME` is `flux.NAME`.
fn registered(figure: &str) -> Cow<'_, str> {
    match figure.strip_prefix(RECEIVER) {
        Some(name) => format!("flux.{name}").into(),
        None => figure.into(),
    }
}

/// The number under a dotted key of a design.
fn number_of(key: &str, file: &DesignFile) -> Result<f64> {
    let value = formulas::number_at(&file.table, key);
    value.with_context(|| format!("figure: expected a key of the design with a number, got {key}"))
}

fn is_distance(figure: &str) -> bool {
    DISTANCES.contains(&figure)
}

/// The target of a term, where its figure is a distance, and the record of its file.
fn target(keys: &TermKeys, folder: &Path) -> Result<Option<(Target, FileRecord)>> {
    match (&keys.file, is_distance(&keys.figure)) {
        (Some(file), true) => Target::read(&keys.figure, &folder.join(file)).map(Some),
        (None, false) => Ok(None),
        (Some(_), false) => bail!("file: expected it with {} alone", DISTANCES.join(" and ")),
        (None, true) => bail!("file: expected a file with the target of {}", keys.figure),
    }
}

fn known(figure: &str, design: &Design, source: &DesignFile) -> Result<()> {
    if let Some(key) = figure.strip_prefix(DESIGN) {
        return number_of(key, source).map(drop);
    }
    if is_distance(figure) {
        return Ok(());
    }
    let besides = || format!("figure (or one of {}, design.KEY)", DISTANCES.join(", "));
    check_figure(design, &registered(figure)).with_context(besides).map(drop)
}

fn term(keys: &TermKeys) -> Result<Term> {
    let scale = keys.scale.unwrap_or(1.0);
    for (key, value) in [("scale", scale), ("weight", keys.weight)] {
        ensure!(
            FACTORS.contains(&value),
            "{key}: expected a number from {:e} to {:e}, got {value:e}",
            FACTORS.start(),
            FACTORS.end()
        );
    }
    ensure!(
        keys.target.is_none_or(f64::is_finite),
        "target: expected a finite number, got {}",
        keys.target.unwrap_or_default()
    );
    ensure!(
        keys.target.is_some() == (keys.goal == Goal::Target),
        "target: expected it with goal = \"target\", and there alone"
    );
    ensure!(
        !is_distance(&keys.figure) || keys.goal != Goal::Maximise,
        "goal: expected \"minimise\" or \"target\" with {}",
        keys.figure
    );
    Ok(Term {
        figure: keys.figure.clone(),
        goal: keys.goal,
        target: keys.target.unwrap_or(0.0),
        scale,
        weight: keys.weight,
    })
}

fn constraint_of(
    keys: &ConstraintKeys,
    design: &Design,
    source: &DesignFile,
) -> Result<Constraint> {
    known(&keys.figure, design, source)?;
    ensure!(!is_distance(&keys.figure), "figure: expected {} in the objective alone", keys.figure);
    let bounds = Bounds::new(keys.at_least, keys.at_most)?;
    ensure!(
        keys.margin >= 0.0 && keys.margin.is_finite(),
        "margin: expected a number of standard errors from 0, got {}",
        keys.margin
    );
    Ok(Constraint { figure: keys.figure.clone(), bounds, margin: keys.margin })
}
