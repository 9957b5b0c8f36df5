// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures of a study: misfits to targets, and changes of each figure by set-up.

use anyhow::Result;

use metrics::Estimate;
use metrics::estimate::DISTINCT;
use metrics::plural::count;
use metrics::quantity::Unit;
use results::shown::{named, unit_of_differences};
use results::study::{StudyFigureEntry, StudyFile};

use super::plots::{Heading, MarkedLine, Picture, marked_lines};

/// Set-ups of the picture of misfits.
pub const SHOWN: usize = 20;

/// The smallest misfits; none of a study without targets.
///
/// # Errors
/// No finite misfit.
pub fn misfit_picture(study: &StudyFile) -> Result<Option<Picture>> {
    let shown = study.ranking.iter().take(SHOWN);
    let bar = |ranked: &results::study::RankedEntry| MarkedLine {
        label: ranked.setup.clone(),
        marks: vec![(String::new(), ranked.misfit)],
        least: 0.0,
    };
    let bars: Vec<MarkedLine> = shown.map(bar).collect();
    if bars.is_empty() {
        return Ok(None);
    }
    let setups = count(study.ranking.len(), "set-up");
    let subtitle = format!("smallest {} of {setups}; {}", bars.len(), tied(study));
    let heading = Heading::new(format!("{}: misfit to targets", study.name), subtitle);
    marked_lines(&heading, "misfit, in units of the scales", Unit::Relative, &bars).map(Some)
}

/// Counts the other set-ups that may be better than the first.
pub fn tied(study: &StudyFile) -> String {
    if study.ranking.len() < 2 {
        return "there is one alone".to_owned();
    }
    match study.ranking.iter().skip(1).filter(|ranked| ranked.tied_with_first).count() {
        0 => format!("the first is ahead of the others by more than {DISTINCT} standard errors"),
        1 => "1 other cannot be told from the first".to_owned(),
        tied => format!("{tied} others cannot be told from the first"),
    }
}

/// Keys of the figures whose changes are drawn: those of a model in `results.json`, and those with a
/// target. In the order of the tables.
pub fn figures(study: &StudyFile) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    let is_main = |key: &str| metrics::figures::find(key).is_none_or(|figure| figure.is_main());
    let base = study.setups.first().into_iter().flat_map(|base| &base.figures);
    for entry in base.filter(|entry| is_main(&entry.figure) || entry.sought().is_some()) {
        if !names.contains(&entry.figure.as_str()) {
            names.push(&entry.figure);
        }
    }
    names
}

/// Changes of `figure`, a line for each set-up; none where no set-up changes it.
///
/// # Errors
/// No finite change.
pub fn change_picture(study: &StudyFile, figure: &str) -> Result<Option<Picture>> {
    let (words, unit) = named(figure);
    let mut all = study.setups.iter().flat_map(|setup| &setup.figures);
    let unit = all.find(|entry| entry.figure == figure).map_or(unit, StudyFigureEntry::unit);
    let (factor, symbol) = unit_of_differences(unit);
    let lines = study.setups.iter().skip(1).map(|setup| MarkedLine {
        least: f64::NEG_INFINITY,
        label: setup.name.clone(),
        marks: setup
            .figures
            .iter()
            .filter(|entry| entry.figure == figure)
            .filter_map(|entry| {
                let change = entry.change.filter(|change| change.peak_place.is_off_axis())?;
                let place = format!("{} {}", entry.design, entry.model);
                // Two errors to each side reach the ends.
                let drawn = change.ends().map_or(change.estimate(), |[low, high]| {
                    Estimate::new(f64::midpoint(low, high), 0.25 * (high - low))
                });
                Some((place, drawn.times(factor)))
            })
            .collect(),
    });
    let lines: Vec<MarkedLine> = lines.filter(|line| !line.marks.is_empty()).collect();
    if lines.is_empty() {
        return Ok(None);
    }
    let heading =
        Heading::new(format!("{}: change of {words}", study.name), "each set-up against the base");
    // Percentages differ by points.
    let axis = match unit {
        unit if unit.is_percentage() => (format!("change of {words} ({symbol})"), Unit::Relative),
        other => (format!("change of {words}"), other),
    };
    marked_lines(&heading, &axis.0, axis.1, &lines).map(Some)
}
