// SPDX-License-Identifier: MIT OR Apache-2.0
//! The part of the page on the search that led to the design, where the folder holds one.

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use metrics::quantity::Unit;
use results::figure_entry::FigureEntry;
use results::optimisation::{self, ObjectiveEntry, OptimisationFile, StageEntry, Verdict};
use results::sealed_file::SealedFile;
use results::shown;
use runtime::content_hash::sha256_hex;

use super::folder::{Folder, check_files};
use super::models::Model;
use super::pictures::Album;
use super::verdict::named_in;
use crate::optimisation as pictures;

/// `optimise.json` of the folder, if there is one.
///
/// # Errors
/// A file of another layout, or one of other results.
pub fn read(folder: &Folder) -> Result<Option<OptimisationFile>> {
    let file = OptimisationFile::read(folder.directory())?;
    file.iter().try_for_each(|file| belongs(file, folder))?;
    Ok(file)
}

/// The model in which a search judged its designs, of the design called `design`; the first one of
/// that design where it is not in the folder.
pub fn searched<'m, 'a>(
    file: &OptimisationFile,
    models: &'m [Model<'a>],
    design: &str,
) -> Option<&'m Model<'a>> {
    let word = file.stages.last().map_or("", |stage| &stage.model);
    let of_design = || models.iter().filter(|model| model.design == design);
    // A key is the kind of the model and the width of its rings; the fine model is one by rays too.
    let of_kind = |kind| of_design().filter(move |m| m.key.split('_').next() == Some(kind));
    let named = match word {
        "fine" => of_kind("geometric").next_back(),
        kind => of_kind(kind).next(),
    };
    named.or_else(|| of_design().next())
}

/// Tables and pictures of a search; nothing where there is none.
///
/// # Errors
/// Values that cannot be drawn.
pub fn optimisation(
    album: &mut Album,
    file: Option<&OptimisationFile>,
    models: &[Model],
) -> Result<Value> {
    let Some(file) = file else {
        return Ok(Value::Null);
    };
    let model = searched(file, models, &file.name);
    let named = |key: &str| match model {
        Some(model) => named_in(model, key),
        None => shown::named(key),
    };
    let captions = [
        "Best candidate of every generation that met the constraints, as the search saw it, and the objective verified by fresh paths; smaller is better.",
        "Designs of the Pareto front, verified by fresh paths.",
        "Change of the objective for one unit of each coefficient at the design found, by paired traces.",
    ];
    let drawn = [
        Some(pictures::convergence_picture(file)?),
        pictures::front_picture(file)?,
        pictures::sensitivity_picture(file)?,
    ];
    let drawn = drawn.into_iter().zip(captions);
    let drawn = drawn.filter_map(|(picture, words)| Some(album.fixed(&picture?, words)));
    Ok(json!({
        "design": file.design,
        "name": file.name,
        "rows": rows(file, named),
        "others": file.listed().1,
        "missed": missed(file),
        "constraints": file.constraints.iter().map(|entry| constraint(entry, named)).collect::<Vec<_>>(),
        "runs": runs(file),
        "bias": file.objective.bias_in_words(),
        "evaluations": file.stages.iter().map(|stage| stage.evaluations).sum::<usize>(),
        "limits": file.active_limits,
        "pictures": drawn.collect::<Vec<_>>(),
    }))
}

/// Refuses a search whose results are not those of the folder.
fn belongs(file: &OptimisationFile, folder: &Folder) -> Result<()> {
    let path = folder.directory().join(results::FILE);
    let got = sha256_hex(&std::fs::read(&path)?);
    let listed = file.files.iter().find(|entry| entry.file == results::FILE);
    let expected = listed.map_or("none", |entry| entry.sha256.as_str());
    ensure!(
        expected == got,
        "`{}`: files: expected the hash of `{}`, {got}, got {expected}; it belongs to other results",
        folder.directory().join(optimisation::FILE).display(),
        path.display()
    );
    check_files(folder.directory(), optimisation::FILE, &file.files)
}

fn rows(file: &OptimisationFile, named: impl Fn(&str) -> (String, Unit)) -> Vec<Value> {
    let row = |name: &str, before, after: String, change, verdict: Option<Verdict>| {
        let (before, change): (Option<String>, Option<String>) = (before, change);
        json!({
            "name": name,
            "before": before,
            "after": after,
            "change": change,
            "verdict": verdict.map(Verdict::words),
        })
    };
    let figures = file.listed().0.into_iter().map(|(key, one)| {
        let (name, unit) = named(key);
        let value = |entry: FigureEntry| shown::text(&entry, unit);
        let change = one.change.map(|change| shown::difference_between(&change, unit));
        let is_judged = file.objective.before.is_some();
        let absent = is_judged.then(|| shown::absent(key).to_owned());
        row(&name, one.before.map(value).or(absent), value(one.after), change, one.verdict)
    });
    let ObjectiveEntry { before, after, change, verdict, .. } = file.objective;
    let words = |objective: FigureEntry| shown::number(&objective, Unit::Relative);
    let [before, change] = [before, change].map(|e| e.map(words));
    figures.chain([row("objective", before, words(after), change, verdict)]).collect()
}

/// Candidates with a better objective that miss constraints, a sentence for each stage.
fn missed(file: &OptimisationFile) -> Vec<String> {
    let missed = file.stages.iter().filter_map(|stage: &StageEntry| stage.missed.as_ref());
    let words = missed.map(|one| {
        format!(
            "A candidate with a better objective, {}, misses constraints: {}; with {}.",
            shown::number(&one.objective, Unit::Relative),
            one.misses.join("; "),
            one.variables.join(", ")
        )
    });
    words.collect()
}

/// Ends of the runs of the last stage; nothing of a single one.
fn runs(file: &OptimisationFile) -> Vec<String> {
    let runs = file.stages.last().map(optimisation::StageEntry::runs);
    let runs = runs.filter(|runs| runs.len() > 1).unwrap_or_default();
    runs.into_iter().map(|(_, value)| shown::number(&value, Unit::Relative)).collect()
}

fn constraint(
    entry: &optimisation::ConstraintEntry,
    named: impl Fn(&str) -> (String, Unit),
) -> Value {
    let (name, unit) = named(&entry.figure);
    json!({
        "words": format!("{name} {}", shown::bounds(entry.bounds(), unit)),
        "met": entry.met,
    })
}
