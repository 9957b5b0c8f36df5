// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering tables written in the formats of other programs, with what they lost on the way.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use bsdf::convert::{self, Resolution, Smearing};
use bsdf::formats::text::scatter_type;
use bsdf::formats::{lighttools, order_json, speos, window, zemax};
use bsdf::{Bsdf, OrderTable, Side, Transport};
use serde_json::{Value, json};

use super::npz;
use crate::atomic_file::write_atomic;

/// Formats on direction cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellFormat {
    /// Zemax tabular: four files, for both sides and types.
    Zemax,
    /// LightTools text.
    LightTools,
    /// Speos text: two files, for both sides.
    Speos,
    /// XML on the Klems basis.
    Klems,
    /// XML with tensor trees.
    TensorTree,
}

/// How fine a table is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fineness {
    /// Steps of tables on angles.
    pub resolution: Resolution,
    /// Logarithm of the cells of a tensor tree along one coordinate.
    pub tree_log2: u32,
}

/// One written file.
pub struct Written {
    /// Where.
    pub path: PathBuf,
    /// What it lost.
    pub smearing: Smearing,
}

/// The files that [`write_cells`] writes for `path`.
pub fn targets(format: CellFormat, path: &Path) -> Vec<PathBuf> {
    let beside = |end: String| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!("{stem}-{end}.{ending}"))
    };
    match format {
        CellFormat::Zemax => Side::BOTH
            .into_iter()
            .flat_map(|side| Transport::BOTH.map(|transport| (side, transport)))
            .map(|(side, t)| beside(format!("{side}-{}", scatter_type(t).to_ascii_lowercase())))
            .collect(),
        CellFormat::Speos => Side::BOTH.map(|side| beside(side.to_string())).to_vec(),
        _ => vec![path.to_path_buf()],
    }
}

/// Writes `surface` to `path` (Speos: to two files beside it, whose names say the side; Zemax: to
/// four files beside it, whose names say side and type).
///
/// # Errors
/// A resolution that is none, or a file that cannot be written.
pub fn write_cells(
    surface: &dyn Bsdf,
    format: CellFormat,
    fineness: &Fineness,
    wavelength_nm: Option<f64>,
    path: &Path,
) -> Result<Vec<Written>> {
    let program = format!("batwing {}", env!("CARGO_PKG_VERSION"));
    match format {
        CellFormat::Zemax => zemax_files(surface, fineness, &program, wavelength_nm, path),
        CellFormat::Speos => speos_files(surface, fineness, &program, wavelength_nm, path),
        CellFormat::LightTools => {
            let (mut file, smearing) = convert::to_lighttools(
                surface,
                wavelength_nm.unwrap_or(0.0),
                &fineness.resolution,
            )?;
            file.comments = comments(&program, wavelength_nm, &smearing);
            file.comments
                .push("Front is the outer side of the surface, Back the inner side".to_owned());
            write_atomic(path, |mut sink| Ok(lighttools::write(&file, &mut sink)?))?;
            Ok(vec![written(path, smearing)])
        }
        CellFormat::Klems | CellFormat::TensorTree => {
            let (mut file, smearing) = if format == CellFormat::Klems {
                convert::to_klems(surface, fineness.resolution.samples)?
            } else {
                convert::to_tree(surface, fineness.tree_log2, fineness.resolution.samples)?
            };
            file.name = stated(wavelength_nm);
            file.manufacturer = program;
            write_atomic(path, |mut sink| Ok(window::write(&file, &mut sink)?))?;
            Ok(vec![written(path, smearing)])
        }
    }
}

fn written(path: &Path, smearing: Smearing) -> Written {
    Written { path: path.to_path_buf(), smearing }
}

/// A wavelength in words.
fn stated(wavelength_nm: Option<f64>) -> String {
    wavelength_nm.map_or("wavelength not stated".to_owned(), |w| format!("{w} nm"))
}

fn comments(program: &str, wavelength_nm: Option<f64>, smearing: &Smearing) -> Vec<String> {
    vec![
        format!("{program}, {}, unpolarised light", stated(wavelength_nm)),
        format!(
            "orders are spread over cells up to {:.4} degrees wide; {:.4} would keep neighbours apart",
            smearing.width_deg,
            smearing.resolving_deg()
        ),
    ]
}

fn zemax_files(
    surface: &dyn Bsdf,
    fineness: &Fineness,
    program: &str,
    wavelength_nm: Option<f64>,
    path: &Path,
) -> Result<Vec<Written>> {
    let mut files = Vec::new();
    let mut paths = targets(CellFormat::Zemax, path).into_iter();
    for side in Side::BOTH {
        for transport in Transport::BOTH {
            let (mut file, smearing) =
                convert::to_zemax(surface, side, transport, &fineness.resolution)?;
            file.comments = comments(program, wavelength_nm, &smearing);
            file.comments.push(format!("light from the {side} side"));
            let path = paths.next().unwrap_or_default();
            write_atomic(&path, |mut sink| Ok(zemax::write(&file, &mut sink)?))?;
            files.push(written(&path, smearing));
        }
    }
    Ok(files)
}

fn speos_files(
    surface: &dyn Bsdf,
    fineness: &Fineness,
    program: &str,
    wavelength_nm: Option<f64>,
    path: &Path,
) -> Result<Vec<Written>> {
    let mut files = Vec::new();
    for (side, path) in Side::BOTH.into_iter().zip(targets(CellFormat::Speos, path)) {
        let (mut file, smearing) = convert::to_speos(surface, side, &fineness.resolution)?;
        // A side from which nothing is scattered has no file: the format has no place for none.
        if file.parts.is_empty() {
            continue;
        }
        let said = comments(program, wavelength_nm, &smearing).join("; ");
        file.comment = format!("light from the {side} side; {said}");
        write_atomic(&path, |mut sink| Ok(speos::write(&file, &mut sink)?))?;
        files.push(written(&path, smearing));
    }
    ensure!(!files.is_empty(), "expected a surface that scatters light from some side, got none");
    Ok(files)
}

/// Writes `table` order by order as JSON.
///
/// # Errors
/// A file that cannot be written.
pub fn write_json(table: &OrderTable, path: &Path) -> Result<()> {
    write_atomic(path, |sink| Ok(order_json::write(table, sink)?))
}

/// Writes `table` order by order as `.npz`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_npz(table: &OrderTable, path: &Path) -> Result<()> {
    write_atomic(path, |mut sink| npz::write(table, &mut sink))
}

/// Figures of a smearing, every incidence included.
pub fn describe(written: &Written) -> Value {
    let s = &written.smearing;
    let incidences: Vec<Value> = s
        .incidences
        .iter()
        .map(|i| {
            json!({
                "from": i.side, "transport": if i.transport == Transport::Reflection { "reflected" } else { "transmitted" },
                "theta_deg": i.theta_deg, "phi_deg": i.phi_deg, "before": i.before, "after": i.after, "merged": i.merged,
            })
        })
        .collect();
    json!({
        "file": written.path.display().to_string(),
        "cell_width_deg": s.width_deg,
        "mean_shift_deg": s.mean_shift_deg,
        "closest_orders_deg": s.closest_deg.is_finite().then_some(s.closest_deg),
        "resolving_deg": s.resolving_deg().is_finite().then_some(s.resolving_deg()),
        "share_in_shared_cells": s.merged(),
        "worst_energy_difference": s.worst_energy(),
        "incidences": incidences,
    })
}

/// The same for people.
pub fn summary(written: &Written) -> String {
    let s = &written.smearing;
    let apart = if s.resolving_deg().is_finite() {
        format!(
            "orders of 1 % and more stand {:.3} degrees apart at least: cells of {:.3} degrees would keep them apart",
            s.closest_deg,
            s.resolving_deg()
        )
    } else {
        "no two orders of 1 % and more".to_owned()
    };
    format!(
        "{}\n  cells up to {:.3} degrees wide, orders moved by {:.3} degrees on the mean, {:.1} % of the power in cells with several orders\n  power of any of {} incidences changed by at most {:.1e}\n  {apart}",
        written.path.display(),
        s.width_deg,
        s.mean_shift_deg,
        100.0 * s.merged(),
        s.incidences.len(),
        s.worst_energy(),
    )
}
