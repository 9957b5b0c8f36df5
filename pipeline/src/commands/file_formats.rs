// SPDX-License-Identifier: MIT OR Apache-2.0
//! File formats of other programs as arguments of `export` and `import`, and the writer of tables
//! on direction cells.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use bsdf::Bsdf;
use bsdf::convert::Resolution;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use super::arguments::whole;
use crate::formats::tables::{self, CellFormat, Fineness};
use crate::run_context::RunContext;

/// Formats to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FileFormat {
    /// Zemax tabular BSDF, four files
    Zemax,
    /// LightTools BSDF text
    Lighttools,
    /// WINDOW/Radiance XML, Klems matrix
    Klems,
    /// WINDOW/Radiance XML, tensor tree
    Tensortree,
    /// Table of orders as JSON
    Json,
    /// Table of orders as NumPy archive
    Npz,
    /// IES LM-63 far field
    Ies,
    /// EULUMDAT far field
    Ldt,
    /// TM-25 rays
    Tm25,
    /// LightTools rays
    Ray,
    /// Binary STL of the bodies
    Stl,
    /// Wavefront OBJ of the bodies
    Obj,
    /// DXF of the meridian
    Dxf,
    /// SVG of the meridian
    Svg,
}

impl FileFormat {
    /// The format of tables on direction cells; `None` for other formats.
    pub fn cells(self) -> Option<CellFormat> {
        match self {
            Self::Zemax => Some(CellFormat::Zemax),
            Self::Lighttools => Some(CellFormat::LightTools),
            Self::Klems => Some(CellFormat::Klems),
            Self::Tensortree => Some(CellFormat::TensorTree),
            _ => None,
        }
    }
}

/// Resolution of tables on direction cells.
#[derive(Debug, Clone, Copy, Args)]
pub struct CellSteps {
    /// Step of the polar angle of incidence, degrees
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 10.0,
        allow_negative_numbers = true
    )]
    pub incidence_step: f64,
    /// Step of the azimuth of incidence, degrees
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 30.0,
        allow_negative_numbers = true
    )]
    pub azimuth_step: f64,
    /// Step of the angles of scatter, degrees: the width over which orders are spread
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    pub scatter_step: f64,
    /// Cells of a tensor tree along each coordinate: 2 to this power
    #[arg(
        long,
        value_name = "N",
        default_value_t = 5,
        allow_negative_numbers = true,
        value_parser = whole(1..=7_u32)
    )]
    pub tree_log2: u32,
    /// Incidences over which the shares at each incidence of a file are averaged
    #[arg(
        long,
        value_name = "N",
        default_value_t = 64,
        allow_negative_numbers = true,
        value_parser = whole(1..=1024_u16)
    )]
    pub samples: u16,
}

impl CellSteps {
    /// The resolution as the writers take it.
    pub fn fineness(&self) -> Fineness {
        Fineness {
            resolution: Resolution {
                incidence_deg: self.incidence_step,
                azimuth_deg: self.azimuth_step,
                scatter_deg: self.scatter_step,
                samples: usize::from(self.samples),
            },
            tree_log2: self.tree_log2,
        }
    }
}

/// Refuses a file name whose ending contradicts the format.
pub(super) fn ending(path: &Path, expected: &str) -> Result<()> {
    ensure!(
        path.extension().is_some_and(|e| e == expected),
        "--out: expected a file ending in .{expected}, got `{}`",
        path.display()
    );
    Ok(())
}

/// Vacuum wavelength of a table, nm.
pub fn nanometres(table: &bsdf::OrderTable) -> Result<f64> {
    let factor = match table.header().length_unit.as_str() {
        "um" => 1e3,
        "nm" => 1.0,
        other => bail!("length unit of the table: expected um or nm, got `{other}`"),
    };
    Ok((table.grid().wavelength * factor * 1e6).round() / 1e6)
}

/// A table on direction cells to be written.
pub struct CellFile<'a> {
    /// Format.
    pub format: CellFormat,
    /// Resolution.
    pub steps: &'a CellSteps,
    /// Vacuum wavelength to state, nm.
    pub wavelength_nm: Option<f64>,
    /// File.
    pub out: &'a Path,
}

impl CellFile<'_> {
    /// Writes `surface` and prints what was written; `source` is the table of orders behind it, if
    /// any.
    pub fn write(
        &self,
        surface: &dyn Bsdf,
        source: Option<&bsdf::OrderTable>,
        context: RunContext,
    ) -> Result<()> {
        ending(
            self.out,
            match self.format {
                CellFormat::Zemax | CellFormat::LightTools => "bsdf",
                CellFormat::Klems | CellFormat::TensorTree => "xml",
            },
        )?;
        let fineness = self.steps.fineness();
        let written = tables::write_cells(
            surface,
            self.format,
            &fineness,
            self.wavelength_nm,
            self.out,
        )?;
        let json: Vec<Value> = written.iter().map(tables::describe).collect();
        let mut json = json!({"files": json});
        let mut lines: Vec<String> = written.iter().map(tables::summary).collect();
        if let Some(table) = source {
            // A reader that checks reciprocity finds at least this deviation.
            let off = bsdf::validate::reciprocity(table).deviation;
            json["reciprocity_of_the_table"] = json!({"worst": off.worst, "rms": off.rms});
            lines.push(format!(
            "reciprocity of the table itself: shares there and back differ by {:.1e} at most, {:.1e} rms",
            off.worst, off.rms
        ));
        }
        context.console.result(&json, || lines.join("\n"))
    }
}
