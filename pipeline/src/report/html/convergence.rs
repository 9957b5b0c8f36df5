// SPDX-License-Identifier: MIT OR Apache-2.0
//! What `batwing converge` left in the folder, and the figures that the tables and the paper's pictures give to the page.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::{Map, Value, json};

use super::models::rounded;
use super::orders::Listed;
use super::value::At;

/// How files of `batwing converge` end.
const ENDING: &str = "-convergence.json";
/// Folders under the results that are looked into: itself, and the default of `batwing converge`.
const FOLDERS: [&str; 2] = ["", "convergence"];

/// Errors of a point that are shown.
const ERRORS: [&str; 5] = [
    "largest_order",
    "max",
    "percentile_99",
    "rms",
    "flux_weighted_mean",
];

/// Every study of convergence in the folder, by name.
///
/// # Errors
/// A file that cannot be read or is of another layout.
pub fn studies(results: &Path) -> Result<Value> {
    let mut all = Vec::new();
    for folder in FOLDERS.map(|f| results.join(f)) {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        let mut paths: Vec<PathBuf> = entries
            .filter_map(|entry| entry.ok().map(|e| e.path()))
            .filter(|p| p.to_string_lossy().ends_with(ENDING))
            .collect();
        paths.sort();
        for path in paths {
            all.push(study(&path)?);
        }
    }
    Ok(all.into())
}

fn study(path: &Path) -> Result<Value> {
    let text = std::fs::read(path).with_context(|| format!("cannot read `{}`", path.display()))?;
    let json = bsdf::json::parse(&text)
        .with_context(|| format!("`{}` is no usable JSON", path.display()))?;
    let top = At::top(path, &json);
    let study = top.get("study")?;
    let plan = study.get("plan")?;
    let mut out = Map::new();
    out.insert("design".to_owned(), top.get("design")?.text()?.into());
    out.insert("ring".to_owned(), top.get("ring")?.count()?.into());
    for key in ["period_um", "depth_um", "wavelength_um", "tolerance"] {
        out.insert(key.to_owned(), top.get(key)?.number()?.into());
    }
    for key in [
        "fixed_slices",
        "fixed_orders",
        "reference_orders",
        "reference_slices",
    ] {
        out.insert(key.to_owned(), plan.get(key)?.count()?.into());
    }
    for (sweep, at) in [("by_orders", "orders"), ("by_slices", "slices")] {
        let points = study.get(sweep)?.list()?;
        let point = |point: &At| -> Result<Value> {
            let errors = point.get("errors")?;
            let errors = ERRORS.map(|key| errors.get(key)?.number());
            let errors = errors.into_iter().collect::<Result<Vec<_>>>()?;
            Ok(json!({
                "at": point.get(at)?.count()?,
                "errors": errors.into_iter().map(rounded).collect::<Vec<_>>(),
                "operations": rounded(point.get("operations_per_problem")?.number()?),
            }))
        };
        let points = points.iter().map(point).collect::<Result<Vec<_>>>()?;
        out.insert(sweep.to_owned(), points.into());
    }
    Ok(out.into())
}

/// Estimated errors of the tables by band.
///
/// # Errors
/// Entries of another layout.
pub fn of_tables(listed: &Listed) -> Result<Value> {
    let one = |(design, _, entry): &(&str, Option<f64>, At)| -> Result<Value> {
        let grid = entry.find("grid_error").filter(|at| !at.value().is_null());
        Ok(json!({
            "design": design,
            "band": entry.get("band")?.count()?,
            "ring": entry.get("ring")?.count()?,
            "error": rounded(entry.get("estimated_error")?.number()?),
            "grid": grid.map(|at| at.number()).transpose()?.map(rounded),
            "residual": rounded(entry.get("energy_residual")?.number()?),
        }))
    };
    let all = listed.entries.iter().map(one);
    Ok(all.collect::<Result<Vec<_>>>()?.into())
}

/// Figures 3, 4 and 6, as far as `results.json` holds them.
///
/// # Errors
/// Entries of another layout.
pub fn of_paper(results: &At) -> Result<Value> {
    let figures = results.get("figures")?;
    let mut out = Map::new();
    let numbers = |at: At| -> Result<Value> {
        let list = at.list()?.into_iter().map(|x| Ok(rounded(x.number()?)));
        Ok(list.collect::<Result<Vec<_>>>()?.into())
    };
    for name in ["figure_3", "figure_4"] {
        let Some(figure) = figures.find(name) else {
            continue;
        };
        let curve = |curve: At| -> Result<Value> {
            Ok(json!({
                "label": curve.get("label")?.text()?,
                "theta": numbers(curve.get("theta_deg")?)?,
                "value": numbers(curve.get("intensity_w_per_sr")?)?,
                "error": numbers(curve.get("standard_error_w_per_sr")?)?,
            }))
        };
        let curves = figure.get("curves")?.list()?.into_iter().map(curve);
        out.insert(name.to_owned(), curves.collect::<Result<Vec<_>>>()?.into());
    }
    if let Some(figure) = figures.find("figure_6") {
        let lobes = |name: &str| -> Result<Value> {
            let lobe = |lobe: At| -> Result<Value> {
                Ok(json!([
                    lobe.get("side")?.text()?,
                    rounded(lobe.get("theta_deg")?.number()?),
                    rounded(lobe.get("share")?.number()?)
                ]))
            };
            let list = figure.get(name)?.list()?.into_iter().map(lobe);
            Ok(list.collect::<Result<Vec<_>>>()?.into())
        };
        out.insert(
            "figure_6".to_owned(),
            json!({
                "band": figure.get("band")?.count()?, "ring": figure.get("ring")?.count()?,
                "rays": lobes("rays")?, "rcwa": lobes("rcwa")?,
            }),
        );
    }
    Ok(out.into())
}
