// SPDX-License-Identifier: MIT OR Apache-2.0
//! A folder of results as one page of HTML that needs nothing else: no network, no other file.
//!
//! In: a folder that [`folder`] has checked, and the tables that its hybrids list. Out: the text of the page. Tables of numbers are made
//! here ([`sections`]); what is drawn stands in the page as JSON, quantised where it is large ([`pack`], [`models`], [`orders`]), and the
//! page's own scripts draw it. The same folder gives the same bytes.

pub mod convergence;
pub mod folder;
pub mod markup;
pub mod models;
pub mod orders;
pub mod pack;
pub mod sections;
pub mod value;

use std::fmt::Write as _;

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use folder::Folder;
use markup::{escaped, filled, script_json};
use models::{Model, Plane};
use orders::Source;

/// Largest page in bytes.
pub const LIMIT: usize = 6_000_000;
/// Letters that all maps together may take; beyond that neighbouring bins are merged.
const MAPS_BUDGET: usize = 1_400_000;

const TEMPLATE: &str = include_str!("assets/page.html");
const STYLES: [&str; 3] = [
    include_str!("assets/base.css"),
    include_str!("assets/parts.css"),
    include_str!("assets/print.css"),
];
const SCRIPTS: [&str; 12] = [
    include_str!("assets/core.js"),
    include_str!("assets/controls.js"),
    include_str!("assets/axes.js"),
    include_str!("assets/lines.js"),
    include_str!("assets/polar.js"),
    include_str!("assets/merit.js"),
    include_str!("assets/far-field.js"),
    include_str!("assets/map.js"),
    include_str!("assets/bsdf.js"),
    include_str!("assets/convergence.js"),
    include_str!("assets/ledger.js"),
    include_str!("assets/paper.js"),
];

/// A page and what is in it.
#[derive(Debug)]
pub struct Page {
    /// The page.
    pub html: String,
    /// How many of the tables that the results list were found, of how many.
    pub tables: (usize, usize),
}

/// The page of `folder`, with the tables that `source` holds.
///
/// # Errors
/// Results of another layout, tables that are not the ones listed, a page beyond [`LIMIT`].
pub fn page(folder: &Folder, source: &Source) -> Result<Page> {
    let results = folder.results();
    let models = models::models(&results)?;
    models.iter().try_for_each(Model::complete)?;
    let listed = orders::listed(&models)?;
    let embedded = orders::embed(&listed, source)?;
    let mut maps = models
        .iter()
        .map(|model| Plane::read(model, folder))
        .collect::<Result<Vec<_>>>()?;
    while maps.iter().map(Plane::letters).sum::<usize>() > MAPS_BUDGET {
        maps.iter_mut().for_each(Plane::halve);
    }
    let drawn = models
        .iter()
        .zip(&maps)
        .map(|(model, map)| drawn(model, map, folder))
        .collect::<Result<Vec<_>>>()?;
    let paper = convergence::of_paper(&results)?;
    let data = json!({
        "models": drawn,
        "orders": embedded.json,
        "tableErrors": convergence::of_tables(&listed)?,
        "studies": convergence::studies(folder.directory())?,
        "paper": paper,
    });

    let quick = results.get("quick")?.flag()?;
    let note = if quick {
        let note = results.get("quick_note")?.text()?;
        format!(
            "<p class=\"quick\" role=\"note\"><strong>Quick run.</strong> {}</p>",
            escaped(note)
        )
    } else {
        String::new()
    };
    let mut names: Vec<&str> = models.iter().map(|m| m.design).collect();
    names.dedup();
    let title = format!("batwing: {}", names.join(", "));
    let seed = results.get("seed")?.count()?;
    let kind = if quick { "quick run" } else { "full run" };
    let version = results.get("program")?.get("version")?.text()?;
    let html = filled(
        TEMPLATE,
        &[
            ("title", escaped(&title).into_owned()),
            ("style", STYLES.concat()),
            (
                "summary",
                escaped(&format!("batwing {version}, seed {seed}, {kind}")).into_owned(),
            ),
            ("quick", note),
            ("results", sections::results(&models)?),
            ("spectrum", spectra(&models)?),
            ("bsdf_note", bsdf_note(embedded.found, &embedded.json)),
            ("tables", sections::tables(&listed)?),
            ("ledger", sections::ledger(&models)?),
            ("provenance", sections::provenance(folder, &models)?),
            ("data", script_json(&data)),
            ("script", SCRIPTS.concat()),
        ],
    )?;
    ensure!(
        html.len() <= LIMIT,
        "`{}`: the page would take {} bytes, more than {LIMIT}; results of fewer designs at a time take less",
        folder.directory().display(),
        html.len()
    );
    Ok(Page {
        html,
        tables: embedded.found,
    })
}

/// What is drawn of one model.
fn drawn(model: &Model, map: &Plane, folder: &Folder) -> Result<Value> {
    let mut figures = Vec::new();
    for figure in sections::figures(model)? {
        let e = figure.at.estimate()?;
        let published = figure.at.find("published").map(|at| at.number());
        figures.push(json!({
            "label": figure.label, "unit": figure.unit,
            "value": e.value * figure.scale, "error": e.standard_error * figure.scale,
            "published": published.transpose()?.map(|x| x * figure.scale),
            "onAxis": figure.at.find("on_axis").is_some(),
        }));
    }
    let mut ledger = Vec::new();
    for (account, at) in model.at.get("power_ledger")?.entries()? {
        let e = at.estimate()?;
        ledger.push(json!([account, e.value, e.standard_error]));
    }
    Ok(json!({
        "design": model.design, "key": model.key, "label": model.label(),
        "figures": figures, "ledger": ledger,
        "farField": models::far_field(model, folder)?, "map": map.to_json(),
    }))
}

/// A line on the light of each model in a spectrum; empty for monochromatic light.
fn spectra(models: &[Model]) -> Result<String> {
    let mut lines = String::new();
    for model in models {
        let Some(spectrum) = model.at.find("spectrum") else {
            continue;
        };
        let weighting = spectrum.get("light")?.get("weighting")?.text()?;
        let count = spectrum.get("wavelengths")?.list()?.len();
        let wavelengths = if count == 1 {
            "wavelength"
        } else {
            "wavelengths"
        };
        let stopped = spectrum.get("stopped_by")?.text()?;
        let _ = writeln!(
            lines,
            "<p>{}, {}: light of a spectrum, weighting {}, {count} {wavelengths} (ended by: {}).</p>",
            escaped(model.design),
            escaped(&model.label()),
            escaped(weighting),
            escaped(&stopped.replace('_', " "))
        );
    }
    Ok(lines)
}

/// What of the tables is in the page.
fn bsdf_note((found, listed): (usize, usize), json: &Value) -> String {
    if listed == 0 {
        return "<p>No model here uses tables of diffraction orders.</p>".to_owned();
    }
    if found == 0 {
        return format!(
            "<p>None of the {listed} tables that the results list were found, so there is nothing to explore here. <code>batwing report --tables DIR</code> says where they are.</p>"
        );
    }
    let missing = match listed - found {
        0 => String::new(),
        count => format!(" {count} of {listed} tables were not found and are left out."),
    };
    let every = |stride: &Value| match stride.as_i64() {
        None | Some(1) => "every node of kx".to_owned(),
        Some(stride) => format!("one node of kx in {stride}"),
    };
    let mut kept = format!("the lowest ky with {}", every(&json["stride"]));
    if let Some(more @ 1..) = json["moreKy"].as_u64() {
        let _ = write!(kept, ", {more} more ky with {}", every(&json["moreStride"]));
    }
    format!(
        "<p>In this page: {found} tables, {kept}; both sides, s and p. Roots of shares are kept in 16 bits: a share x is exact to √x / 65 535.{missing}</p>"
    )
}

#[cfg(test)]
mod tests;
