// SPDX-License-Identifier: MIT OR Apache-2.0
//! Several pictures of `batwing zones`: a table with a row for each, and what the panel shows.

use std::path::Path;

use anyhow::{Context, Result};

use arrays::csv::{Column, write_named_csv};
use metrics::Estimate;
use metrics::quantity::Quantity;
use results::zones::{FILM_FOLDER, FILM_TABLE, film_figures};
use runtime::atomic_file::write_bytes;

use super::zone_pictures::Frame;

/// Reads a figure of a picture.
type Read = fn(&Row) -> Option<Estimate>;

/// Figures of one picture, with errors.
struct Row {
    mean: Estimate,
    largest_zone: Estimate,
    /// Black beside bright, and that over bright.
    halo: Option<[Estimate; 2]>,
    missing: Option<Estimate>,
    leaking: Option<Estimate>,
    power_share: f64,
}

/// What the pictures show, one after the other.
#[derive(Default)]
pub struct Film {
    names: Vec<String>,
    rows: Vec<Row>,
}

impl Film {
    /// Adds a picture of this file name, and writes what the panel shows of it into its folder under
    /// `out`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn add(&mut self, name: &str, frame: &Frame, out: &Path) -> Result<()> {
        if let Some(painted) = &frame.painted {
            let folder = out.join(FILM_FOLDER);
            std::fs::create_dir_all(&folder)
                .with_context(|| format!("cannot create `{}`", folder.display()))?;
            write_bytes(&folder.join(name), painted)?;
        }
        let dimmed = &frame.dimmed;
        let zones = dimmed.zones[1].iter().copied();
        let colours = dimmed.colours.as_ref();
        self.names.push(name.to_owned());
        self.rows.push(Row {
            mean: dimmed.mean,
            largest_zone: zones
                .max_by(|a, b| a.value.total_cmp(&b.value))
                .unwrap_or(Estimate::new(f64::NAN, f64::NAN)),
            halo: dimmed.halo.map(|[black, _, contrast]| [black, contrast]),
            missing: colours.and_then(|colours| colours.missing),
            leaking: colours.and_then(|colours| colours.leaking),
            power_share: frame.power_share,
        });
        Ok(())
    }

    /// Writes the table; light is of this name and unit.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, out: &Path, light: &Quantity) -> Result<()> {
        let [power, figures @ ..] = film_figures(light);
        let mut columns = vec![Column::new(&power, self.column(|row| Some(row.power_share)))];
        let readers: [Read; 6] = [
            |row| Some(row.mean),
            |row| Some(row.largest_zone),
            |row| row.halo.map(|[black, _]| black),
            |row| row.halo.map(|[_, contrast]| contrast),
            |row| row.missing,
            |row| row.leaking,
        ];
        for (quantity, read) in figures.iter().zip(readers) {
            let value = self.column(|row| read(row).map(|figure| figure.value));
            let error = self.column(|row| read(row).map(|figure| figure.standard_error));
            columns.push(Column::new(quantity, value));
            columns.push(Column::standard_error(quantity, error));
        }
        write_named_csv(&out.join(FILM_TABLE), "picture", &self.names, &columns)
    }

    /// Numbers of all rows, NaN where there is none.
    fn column(&self, read: impl Fn(&Row) -> Option<f64>) -> Vec<f64> {
        let finite = |row| read(row).filter(|value| value.is_finite()).unwrap_or(f64::NAN);
        self.rows.iter().map(finite).collect()
    }
}
