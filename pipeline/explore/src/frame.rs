// SPDX-License-Identifier: MIT OR Apache-2.0
//! What one trace shows: figures, ledger and pictures, as the page reads them.

use serde::Serialize;
use serde_json::{Value, json};

use metrics::digits::thousands;
use metrics::extraction::is_end;
use metrics::figures::{
    self, CENTRE_TO_PEAK, EXTRACTION, FLUX_UP, OF_RECEIVER, PEAK_ANGLE, UNIFORMITY,
    colours_of_receiver,
};
use metrics::quantity::Unit;
use output::live::LiveLight;
use report::html::pictures::within_page;
use results::figure_entry::FigureEntry;
use results::headline::headline;
use results::optimisation::Verdict;
use results::{ModelResult, shown};

/// Figures that stand large at the top, unless those of receivers do.
const GENERAL: [&str; 6] = [
    UNIFORMITY.key,
    "cell_valley_to_peak",
    EXTRACTION.key,
    PEAK_ANGLE.key,
    CENTRE_TO_PEAK.key,
    FLUX_UP.key,
];
/// Shares of the ledger below this are left out.
const NEGLIGIBLE: f64 = 5e-7;

/// Rings that are solved, and what that means for the picture.
#[derive(Debug, Clone, Serialize)]
pub struct WavesState {
    /// Bands that have a table.
    pub solved: usize,
    /// Bands that need one.
    pub rings: usize,
    /// In words.
    pub words: String,
}

/// What a trace shows as the page reads it, with the result of what stands beside: `package` is the
/// section of the package as a part of a page, and `warnings` say what the design may say by mistake.
pub fn frame(
    result: &ModelResult,
    beside: Option<&ModelResult>,
    light: &LiveLight,
    package: Option<&str>,
    warnings: &[String],
) -> Value {
    let drawn = light.pictures.iter().map(|one| {
        let svg = within_page(&one.picture, &one.caption, one.id);
        json!({"id": one.id, "caption": one.caption, "svg": svg})
    });
    let package = package.map(|svg| {
        json!({"id": "package", "svg": svg,
            "caption": "Section of the package nearest to the middle, with a few paths; it alone shines."})
    });
    let (now, before) = (rows(result), beside.map(rows));
    let other_units = before.as_ref().and_then(|before| other_units(&now, before));
    json!({
        "paths": result.paths,
        "paths_text": thousands(result.paths),
        "label": result.label,
        "figures": figures(now, &before.unwrap_or_default(), &light.changes),
        "headline": headline(&GENERAL, result.receivers.as_ref()),
        "ledger": ledger(result),
        "warnings": warnings.iter().cloned().chain(other_units).collect::<Vec<_>>(),
        "pictures": package.into_iter().chain(drawn).collect::<Vec<_>>(),
    })
}

/// Says that what stands beside is in other units.
fn other_units(now: &[Row], before: &[Row]) -> Option<String> {
    let differs = |row: &Row| before.iter().any(|old| old.key == row.key && old.unit != row.unit);
    now.iter().any(differs).then(|| {
        "the kept state is in other units (watts and lumens): its curves are left out, and \
         figures in those units have no change"
            .to_owned()
    })
}

fn figures(now: Vec<Row>, before: &[Row], changes: &[(String, FigureEntry)]) -> Vec<Value> {
    let row = |row: Row| {
        let Row { key, label, unit, entry } = row;
        let kept = before.iter().find(|other| other.key == key);
        let change = changes.iter().find(|(other, _)| *other == key).map(|(_, c)| c);
        let change = change.filter(|_| kept.is_some_and(|kept| kept.unit == unit));
        let larger = figures::find(&key).and_then(|figure| figure.larger_is_better);
        let scale = figures::find(&key).and_then(|figure| figure.scale);
        json!({
            "key": key,
            "label": label,
            "meaning": figures::find(&key).map(|figure| figure.meaning()),
            "value": entry.value,
            "standard_error": entry.standard_error,
            "text": shown::text(&entry, unit),
            "larger_is_better": larger,
            "scale": scale,
            "resolved": shown::in_words(&entry, unit).is_none(),
            "beside": kept.map(|kept| shown::text(&kept.entry, kept.unit)),
            "change": change.map(|change| shown::difference_between(change, unit)),
            "verdict": change.map(|change| Verdict::new(change, larger).words()),
        })
    };
    now.into_iter().map(row).collect()
}

fn ledger(result: &ModelResult) -> Vec<Value> {
    let ends = result.ledger.accounts.iter().filter(|(key, _)| is_end(key));
    let seen = ends.filter(|(_, share)| share.value > NEGLIGIBLE);
    let row = |(key, _): &(String, _)| {
        let share = result.ledger.account(key)?;
        let text = shown::text(share, Unit::Fraction);
        Some(json!({"key": key, "label": key.replace('_', " "), "text": text, "share": share.value,
                "error": share.standard_error}))
    };
    seen.filter_map(row).collect()
}

/// A figure with its name and unit.
struct Row {
    key: String,
    label: String,
    unit: Unit,
    entry: FigureEntry,
}

/// Figures of merit, then those in the units of the light, then those of the receivers.
fn rows(result: &ModelResult) -> Vec<Row> {
    let main = result.figures.iter().map(|figure| {
        let (mut label, _) = shown::named(&figure.key);
        if label.starts_with(UNIFORMITY.label) {
            // Beside ratios their scale has to be told.
            label += ", logarithmic";
        }
        Row { key: figure.key.to_string(), label, unit: figure.unit, entry: figure.entry }
    });
    let absolute = result.absolute.iter().flat_map(|all| &all.figures);
    let absolute = absolute.map(|(key, figure)| {
        let (label, _) = shown::named(key);
        Row { key: key.clone(), label, unit: figure.unit(), entry: figure.array }
    });
    let receivers = result.receivers.iter().flatten().flat_map(|(name, receiver)| {
        OF_RECEIVER.into_iter().chain(colours_of_receiver()).filter_map(move |figure| {
            let (entry, unit) = receiver.figure(figure.key)?;
            let key = format!("{}.{name}", figure.key);
            Some(Row { label: format!("{name}, {}", figure.label), key, unit, entry: *entry })
        })
    });
    main.chain(absolute).chain(receivers).collect()
}
