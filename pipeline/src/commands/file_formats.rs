// SPDX-License-Identifier: MIT OR Apache-2.0
//! File formats of other programs as arguments of `export` and `import`, and the writer of tables
//! on direction cells.

use std::path::Path;
use std::sync::LazyLock;

use anyhow::{Result, bail, ensure};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use formats::convert::Resolution;
use serde_json::{Value, json};

use formats::tables::{self, Fineness, Written};
use formats::{WRITERS, Writer, Writes, listed};
use runtime::run_context::RunContext;

use super::arguments::whole;

/// A format to write, one of the registry.
#[derive(Debug, Clone, Copy)]
pub struct FileFormat(&'static Writer);

static FORMATS: LazyLock<Vec<FileFormat>> =
    LazyLock::new(|| WRITERS.iter().copied().map(FileFormat).collect());

impl ValueEnum for FileFormat {
    fn value_variants<'a>() -> &'a [Self] {
        &FORMATS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.word).help(self.help))
    }
}

/// A format of scattering on direction cells.
#[derive(Debug, Clone, Copy)]
pub struct CellFormat(&'static Writer);

static CELL_FORMATS: LazyLock<Vec<CellFormat>> = LazyLock::new(|| {
    let writers = WRITERS.iter().copied();
    writers.filter(|writer| matches!(writer.writes, Writes::Cells { .. })).map(CellFormat).collect()
});

impl ValueEnum for CellFormat {
    fn value_variants<'a>() -> &'a [Self] {
        &CELL_FORMATS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        FileFormat(self.0).to_possible_value()
    }
}

impl std::ops::Deref for CellFormat {
    type Target = Writer;

    fn deref(&self) -> &Writer {
        self.0
    }
}

impl std::ops::Deref for FileFormat {
    type Target = Writer;

    fn deref(&self) -> &Writer {
        self.0
    }
}

impl FileFormat {
    /// The format to write `out` in: `given`, which the ending must fit, or that of the ending. A
    /// `.ray` file is one of LightTools unless told otherwise.
    ///
    /// # Errors
    /// An ending that contradicts the format, or that no format or several have.
    pub fn of(given: Option<Self>, out: &Path) -> Result<Self> {
        let ending = out.extension().unwrap_or_default().to_string_lossy();
        let ending = ending.to_ascii_lowercase();
        let fits = |format: &Self| format.endings.contains(&ending.as_str());
        if let Some(format) = given {
            ensure!(
                fits(&format),
                "--out: expected a file ending in .{}, got `{}`",
                format.endings.join(" or ."),
                out.display()
            );
            return Ok(format);
        }
        let fitting: Vec<Self> = FORMATS.iter().copied().filter(fits).collect();
        match fitting[..] {
            [] => bail!(
                "--out: expected a file whose ending names a format that `--help` lists, or --format, got `{}`",
                out.display()
            ),
            [format] => Ok(format),
            // The word is the ending.
            [format, ..] if format.word == ending => Ok(format),
            _ => {
                let words: Vec<&str> = fitting.iter().map(|format| format.word).collect();
                let words = listed(&words, "or");
                bail!("--format: expected {words} for a file ending in .{ending}, got none")
            }
        }
    }
}

/// Refuses to write over `input`: `out`, or a file that the format puts beside it.
pub(super) fn not_over(input: &Path, out: &Path, format: FileFormat) -> Result<()> {
    let written = match format.writes {
        Writes::Cells { targets, .. } => targets(out),
        _ => vec![out.to_path_buf()],
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
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct CellSteps {
    /// Step of the polar angle of incidence, degrees
    #[arg(long, value_name = "DEG", default_value_t = Self::default().incidence_step)]
    pub incidence_step: f64,
    /// Step of the azimuth of incidence, degrees
    #[arg(long, value_name = "DEG", default_value_t = Self::default().azimuth_step)]
    pub azimuth_step: f64,
    /// Step of the angles of scatter, degrees: the width over which orders are spread
    #[arg(long, value_name = "DEG", default_value_t = Self::default().scatter_step)]
    pub scatter_step: f64,
    /// Cells of a tensor tree along each coordinate: 2 to this power
    #[arg(
        long,
        value_name = "N",
        default_value_t = Self::default().tree_log2,
        value_parser = whole(1..=7_u32)
    )]
    pub tree_log2: u32,
    /// Incidences over which the shares at each incidence of a file are averaged
    #[arg(
        long,
        value_name = "N",
        default_value_t = Self::default().samples,
        value_parser = whole(1..=1024_u16)
    )]
    pub samples: u16,
}

impl CellSteps {
    /// Names of the options, each true if it differs from its default.
    pub fn changed(&self) -> [(&'static str, bool); 5] {
        let plain = Self::default();
        let differs = |step: f64, plain: f64| step.to_bits() != plain.to_bits();
        [
            ("--incidence-step", differs(self.incidence_step, plain.incidence_step)),
            ("--azimuth-step", differs(self.azimuth_step, plain.azimuth_step)),
            ("--scatter-step", differs(self.scatter_step, plain.scatter_step)),
            ("--tree-log2", self.tree_log2 != plain.tree_log2),
            ("--samples", self.samples != plain.samples),
        ]
    }
}

impl Default for CellSteps {
    fn default() -> Self {
        Self {
            incidence_step: 10.0,
            azimuth_step: 30.0,
            scatter_step: 1.0,
            tree_log2: 5,
            samples: 64,
        }
    }
}

impl CellSteps {
    /// Resolution as the writers take it.
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

/// Prints what `written` files of `surface` lost; `source` is the table of orders behind it, if
/// any.
pub(super) fn print_written(
    written: &[Written],
    source: Option<&bsdf::OrderTable>,
    context: RunContext,
) -> Result<()> {
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
