// SPDX-License-Identifier: MIT OR Apache-2.0
//! The part of the page on a tolerance analysis, where the folder holds one.

use anyhow::Result;
use serde_json::{Value, json};

use metrics::Bounds;
use metrics::digits::thousands;
use metrics::plural::count;
use results::shown::{self, named};
use results::tolerance::{
    BoundEntry, ToleranceFigureEntry, ToleranceResultsFile, YieldEntry, share_words, unseen,
};

use super::models::label;
use super::pictures::Album;
use crate::tolerance::distribution_picture;

/// Contributors of a figure that the page lists.
const LISTED: usize = 12;

/// Tables and the picture of `file` for the template.
///
/// # Errors
/// A distribution that cannot be drawn.
pub fn tolerance(album: &mut Album, file: &ToleranceResultsFile) -> Result<Value> {
    let words = file.distribution.as_ref().map(|distribution| {
        format!(
            "Share of packages at or below each value of {}, noise of the traces taken out.",
            named(&distribution.figure).0
        )
    });
    let picture = distribution_picture(file)?;
    let picture = picture.zip(words).map(|(picture, words)| album.fixed(&picture, &words));
    let figures = in_order(file);
    let causes = figures.iter();
    let causes = causes.filter_map(|(key, figure)| contributions(key, figure));
    let levels = figures.iter().map(|(_, figure)| &figure.quantiles);
    let levels = levels.max_by_key(|quantiles| quantiles.len());
    let levels = levels.into_iter().flatten().map(|quantile| level(quantile.level));
    let bounded = figures.iter().filter_map(|(key, figure)| {
        let below = shown::spread(figure.deviation_below?, figure.unit(key));
        Some(format!("{} {below}", named(key).0))
    });
    let unseen = unseen(&bounded.collect::<Vec<_>>());
    Ok(json!({
        "name": file.name,
        "description": file.description,
        "design": file.design,
        "model": label(&file.model),
        "packages": count(thousands(file.samples as u64), "package"),
        "paths": thousands(file.paths),
        "levels": levels.collect::<Vec<_>>(),
        "rows": figures.iter().map(|(key, figure)| row(key, figure)).collect::<Vec<_>>(),
        "constraints": file.constraints.iter().map(|entry| bound(file, entry)).collect::<Vec<_>>(),
        "unseen": unseen,
        "yield": file.yielded.as_ref().map(YieldEntry::words),
        "unread": file.unread.iter().map(|(key, why)| format!("{} {why}", named(key).0)).collect::<Vec<_>>(),
        "without_design": file.without_design.len(),
        "contributions": causes.collect::<Vec<_>>(),
        "picture": picture,
    }))
}

/// Figures by key, that of the distribution first.
fn in_order(file: &ToleranceResultsFile) -> Vec<(&String, &ToleranceFigureEntry)> {
    let first = file.distribution.as_ref().map(|one| &one.figure);
    let mut figures: Vec<_> = file.figures.iter().collect();
    figures.sort_by_key(|(key, _)| Some(*key) != first);
    figures
}

fn level(level: f64) -> String {
    format!("{} %", 100.0 * level)
}

fn row(key: &str, figure: &ToleranceFigureEntry) -> Value {
    let (name, row) = (named(key).0, figure.row(key));
    let quantiles = row.quantiles.into_iter();
    let quantiles = quantiles.map(|(at, text)| json!({"level": level(at), "text": text}));
    json!({
        "name": name,
        "nominal": row.nominal,
        "shift": row.shift,
        "deviation": row.deviation,
        "noise": row.noise,
        "quantiles": quantiles.collect::<Vec<_>>(),
    })
}

fn bound(file: &ToleranceResultsFile, entry: &BoundEntry) -> String {
    let bounds = Bounds { at_least: entry.at_least, at_most: entry.at_most };
    format!("{} {}", named(&entry.figure).0, shown::bounds(bounds, file.unit(&entry.figure)))
}

/// Contributors of a figure, the largest first.
fn contributions(key: &str, figure: &ToleranceFigureEntry) -> Option<Value> {
    let found = figure.contributions.as_ref()?;
    let mut parts: Vec<_> = found.by_tolerance.iter().collect();
    parts.sort_by(|a, b| b.share.value.total_cmp(&a.share.value));
    let left_out = parts.len().saturating_sub(LISTED);
    let (name, unit) = (named(key).0, figure.unit(key));
    let parts = parts.into_iter().take(LISTED).map(|part| {
        json!({
            "tolerance": part.tolerance,
            "share": share_words(part.share),
            "change": part.change_per_deviation.map(|change| shown::difference(change, unit)),
        })
    });
    Some(json!({
        "figure": name,
        "rows": parts.collect::<Vec<_>>(),
        "left_out": left_out,
        "unexplained": share_words(found.unexplained),
    }))
}
