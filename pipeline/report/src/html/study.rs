// SPDX-License-Identifier: MIT OR Apache-2.0
//! The page of a study: best set-up with its targets, set-ups side by side, changes.

use anyhow::Result;
use serde_json::{Value, json};

use metrics::plural::count;
use results::shown::{self, named, text};
use results::study::{SetupEntry, StudyFigureEntry, StudyFile};
use results::target::{Sought, Verdict};

use super::models::label;
use super::pictures::Album;
use crate::study as pictures;

/// Tables and pictures of `file` for the template.
///
/// # Errors
/// Changes that cannot be drawn.
pub fn study(album: &mut Album, file: &StudyFile) -> Result<Value> {
    let setups = in_order(file);
    let first = setups[0];
    let targets: Vec<&StudyFigureEntry> =
        first.figures.iter().filter(|entry| entry.sought().is_some()).collect();
    let asked = targets.iter().map(|entry| asked(file, entry));
    let met = targets.iter().filter(|entry| entry.verdict == Some(Verdict::Met)).count();
    let row = |setup: &&SetupEntry| {
        let ranked = file.ranking.iter().find(|ranked| ranked.setup == setup.name);
        let cell = |target: &&StudyFigureEntry| {
            let own = setup.figures.iter().find(|entry| same(entry, target));
            json!({
                "label": place_of(file, target),
                "text": own.map(value),
                "verdict": own.and_then(|entry| entry.verdict).map(Verdict::words),
            })
        };
        json!({
            "name": setup.name,
            "misfit": ranked.map(|ranked| {
                shown::with_error(ranked.misfit)
            }),
            "cells": targets.iter().map(cell).collect::<Vec<_>>(),
        })
    };
    let misfits = pictures::misfit_picture(file)?;
    let misfits = misfits.map(|picture| {
        let words = "Misfits to the targets: root mean square of misses in units of their scales, with bars of two standard errors to each side.";
        album.fixed(&picture, words)
    });
    let mut changes = Vec::new();
    for figure in pictures::figures(file) {
        if let Some(picture) = pictures::change_picture(file, figure)? {
            let (words, _) = named(figure);
            let caption = format!(
                "Changes of {words} by set-up against the base, by the same random numbers, with bars of two standard errors to each side."
            );
            let picture = album.fixed(&picture, &caption);
            changes.push(json!({"figure": words, "picture": picture, "is_target": targets.iter().any(|t| t.figure == figure)}));
        }
    }
    changes.sort_by_key(|change| change["is_target"] == false);
    let base = &file.setups[0];
    Ok(json!({
        "name": file.name,
        "description": file.description,
        "setups": count(file.setups.len(), "set-up"),
        "first": first.name,
        "is_ranked": !file.ranking.is_empty(),
        "tied": pictures::tied(file),
        "asked": asked.collect::<Vec<_>>(),
        "met": met,
        "heads": targets.iter().map(|target| place_of(file, target)).collect::<Vec<_>>(),
        "rows": setups.iter().map(row).collect::<Vec<_>>(),
        "base": base.figures.iter().map(|entry| json!({"name": place_of(file, entry), "text": value(entry)})).collect::<Vec<_>>(),
        "misfits": misfits,
        "changes": changes,
        "sensitivities": sensitivities(file),
        "impossible": file.impossible,
        "unranked": file.unranked,
    }))
}

/// Set-ups by misfit, or as they stand where there are no targets.
fn in_order(file: &StudyFile) -> Vec<&SetupEntry> {
    let place = |setup: &SetupEntry| {
        let found = file.ranking.iter().position(|ranked| ranked.setup == setup.name);
        found.unwrap_or(file.ranking.len())
    };
    let mut setups: Vec<&SetupEntry> = file.setups.iter().collect();
    setups.sort_by_key(|setup| place(setup));
    setups
}

fn same(a: &StudyFigureEntry, b: &StudyFigureEntry) -> bool {
    (&a.design, &a.model, &a.figure) == (&b.design, &b.model, &b.figure)
}

/// Name of a figure, with design and model where the study has several.
fn place(file: &StudyFile, [design, model, figure]: [&String; 3]) -> String {
    let base = &file.setups[0].figures;
    let mut words = vec![named(figure).0];
    if base.iter().any(|entry| entry.design != *design) {
        words.push(design.clone());
    }
    if base.iter().any(|entry| entry.model != *model) {
        words.push(label(model));
    }
    words.join(", ")
}

/// Name of a figure of a set-up.
fn place_of(file: &StudyFile, entry: &StudyFigureEntry) -> String {
    place(file, [&entry.design, &entry.model, &entry.figure])
}

fn value(entry: &StudyFigureEntry) -> String {
    text(&entry.value, entry.unit())
}

/// A target of the first set-up with what it reached.
fn asked(file: &StudyFile, entry: &StudyFigureEntry) -> Value {
    let unit = entry.unit();
    let asked = entry.sought().map(|sought| match sought {
        Sought::Within(bounds) => shown::bounds(bounds, unit),
        Sought::Near(near) => {
            let (factor, symbol) = shown::shown_unit(unit);
            let shown = |number: f64| metrics::digits::shortest(number * factor);
            let scale = file.scales.get(&entry.figure);
            let scale = scale.map_or(String::new(), |scale| format!(" ± {}", shown(*scale)));
            format!("{}{scale} {symbol}", shown(near))
        }
    });
    json!({
        "name": place_of(file, entry), "asked": asked, "reached": value(entry),
        "verdict": entry.verdict.map(Verdict::words),
        "is_met": entry.verdict == Some(Verdict::Met),
    })
}

/// Slopes over factors that are numbers: a table for each factor.
fn sensitivities(file: &StudyFile) -> Vec<Value> {
    let mut factors: Vec<&str> = Vec::new();
    for entry in &file.sensitivities {
        if !factors.contains(&entry.factor.as_str()) {
            factors.push(&entry.factor);
        }
    }
    let table = |factor: &str| {
        let rows = file.sensitivities.iter().filter(|entry| entry.factor == factor);
        let rows = rows.map(|entry| {
            let name = place(file, [&entry.design, &entry.model, &entry.figure]);
            let mut all = file.setups.iter().flat_map(|setup| &setup.figures);
            let unit = all.find(|known| known.figure == entry.figure);
            let unit = unit.map_or(named(&entry.figure).1, StudyFigureEntry::unit);
            let slope = shown::difference(entry.change_per_unit, unit);
            json!({"name": name, "text": slope})
        });
        json!({"factor": factor, "rows": rows.collect::<Vec<_>>()})
    };
    factors.into_iter().map(table).collect()
}
