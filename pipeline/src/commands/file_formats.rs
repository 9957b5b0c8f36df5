// SPDX-License-Identifier: MIT OR Apache-2.0
//! File formats of other programs as arguments of `export` and `import`, and the writer of tables
//! on direction cells.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use bsdf::Bsdf;
use bsdf::convert::Resolution;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use files::formats::ray_files::RayFormat;
use files::formats::tables::{self, CellFormat, Fineness};
use files::run_context::RunContext;

use super::arguments::whole;

/// Formats to write, by what they hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FileFormat {
    /// Table: Zemax tabular BSDF, four .bsdf files
    Zemax,
    /// Table: LightTools BSDF text, .bsdf
    Lighttools,
    /// Table: Speos anisotropic BSDF text, two .anisotropicbsdf files
    Speos,
    /// Table: WINDOW/Radiance XML, Klems matrix, .xml
    Klems,
    /// Table: WINDOW/Radiance XML, tensor tree, .xml
    Tensortree,
    /// Table of orders: JSON, .json
    Json,
    /// Table of orders: NumPy archive, .npz
    Npz,
    /// Far field: IES LM-63, .ies
    Ies,
    /// Far field: EULUMDAT, .ldt
    Ldt,
    /// Rays: TM-25, .tm25ray
    Tm25,
    /// Rays: LightTools, .ray
    Ray,
    /// Rays: Speos, .ray
    SpeosRay,
    /// Rays: Zemax, .sdf or .dat
    ZemaxRay,
    /// CAD: binary STL of the bodies, .stl
    Stl,
    /// CAD: Wavefront OBJ of the bodies, .obj
    Obj,
    /// CAD: DXF of the meridian, .dxf
    Dxf,
    /// CAD: SVG of the meridian, .svg
    Svg,
}

impl FileFormat {
    /// Endings of its files.
    fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Zemax | Self::Lighttools => &["bsdf"],
            Self::Speos => &["anisotropicbsdf"],
            Self::Klems | Self::Tensortree => &["xml"],
            Self::Json => &["json"],
            Self::Npz => &["npz"],
            Self::Ies => &["ies"],
            Self::Ldt => &["ldt"],
            Self::Tm25 => &["tm25ray"],
            Self::Ray | Self::SpeosRay => &["ray"],
            Self::ZemaxRay => &["sdf", "dat"],
            Self::Stl => &["stl"],
            Self::Obj => &["obj"],
            Self::Dxf => &["dxf"],
            Self::Svg => &["svg"],
        }
    }

    /// As it is given on the command line.
    pub fn word(self) -> String {
        let value = self.to_possible_value();
        value.map_or(String::new(), |value| value.get_name().to_owned())
    }

    /// The format to write `out` in: `given`, which the ending must fit, or that of the ending. A
    /// `.ray` file is one of LightTools unless told otherwise.
    ///
    /// # Errors
    /// An ending that contradicts the format, or that no format or several have.
    pub fn of(given: Option<Self>, out: &Path) -> Result<Self> {
        let ending = out.extension().unwrap_or_default().to_string_lossy();
        let ending = ending.to_ascii_lowercase();
        let fits = |format: &Self| format.endings().contains(&ending.as_str());
        if let Some(format) = given {
            ensure!(
                fits(&format),
                "--out: expected a file ending in .{}, got `{}`",
                format.endings().join(" or ."),
                out.display()
            );
            return Ok(format);
        }
        let fitting: Vec<Self> =
            Self::value_variants().iter().copied().filter(|format| fits(format)).collect();
        match fitting[..] {
            [] => bail!(
                "--out: expected a file whose ending names a format that `--help` lists, or --format, got `{}`",
                out.display()
            ),
            [format] | [format @ Self::Ray, _] => Ok(format),
            [ref most @ .., last] => {
                let most: Vec<String> = most.iter().map(|format| format.word()).collect();
                let (most, last) = (most.join(", "), last.word());
                bail!(
                    "--format: expected {most} or {last} for a file ending in .{ending}, got none"
                )
            }
        }
    }

    /// The format of tables on direction cells; `None` for other formats.
    pub fn cells(self) -> Option<CellFormat> {
        match self {
            Self::Zemax => Some(CellFormat::Zemax),
            Self::Lighttools => Some(CellFormat::LightTools),
            Self::Speos => Some(CellFormat::Speos),
            Self::Klems => Some(CellFormat::Klems),
            Self::Tensortree => Some(CellFormat::TensorTree),
            _ => None,
        }
    }

    /// The format of rays; `None` for other formats.
    pub fn rays(self) -> Option<RayFormat> {
        match self {
            Self::Tm25 => Some(RayFormat::Tm25),
            Self::Ray => Some(RayFormat::LightTools),
            Self::SpeosRay => Some(RayFormat::Speos),
            Self::ZemaxRay => Some(RayFormat::Zemax),
            _ => None,
        }
    }
}

/// Refuses to write over `input`: `out`, or a file that the format puts beside it.
pub(super) fn not_over(input: &Path, out: &Path, format: FileFormat) -> Result<()> {
    let written = match format.cells() {
        Some(cells) => tables::targets(cells, out),
        None => vec![out.to_path_buf()],
    };
    let input = input.canonicalize().ok();
    for path in written {
        let same = input.is_some() && path.canonicalize().ok() == input;
        ensure!(
            !same,
            "--out: expected another file than the one that is read, got `{}`",
            path.display()
        );
    }
    Ok(())
}

/// Resolution of tables on direction cells.
#[derive(Debug, Clone, Copy, Args)]
pub struct CellSteps {
    /// Step of the polar angle of incidence, degrees
    #[arg(long, value_name = "DEG", default_value_t = 10.0, allow_negative_numbers = true)]
    pub incidence_step: f64,
    /// Step of the azimuth of incidence, degrees
    #[arg(long, value_name = "DEG", default_value_t = 30.0, allow_negative_numbers = true)]
    pub azimuth_step: f64,
    /// Step of the angles of scatter, degrees: the width over which orders are spread
    #[arg(long, value_name = "DEG", default_value_t = 1.0, allow_negative_numbers = true)]
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
        let fineness = self.steps.fineness();
        let written =
            tables::write_cells(surface, self.format, &fineness, self.wavelength_nm, self.out)?;
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
