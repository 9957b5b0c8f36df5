// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reader of the CSV files of refractiveindex.info: blocks of rows below headings `wl,n`, `wl,k` or
//! `wl,n,k`, wavelengths in micrometres.

use super::{Material, MaterialError, Source, Table};

/// True of the first line of such a file.
pub(super) fn is_heading(line: &str) -> bool {
    line.split(SEPARATORS).next().is_some_and(|cell| cell.trim().eq_ignore_ascii_case("wl"))
}

const SEPARATORS: [char; 3] = [',', ';', '\t'];

pub(super) fn parse(text: &str) -> Result<Material, MaterialError> {
    let mut tables = [Vec::new(), Vec::new()];
    // For each column beside the wavelength, whether it is n or k.
    let mut columns: Vec<usize> = Vec::new();
    let lines = text.lines().map(str::trim);
    for (line, text) in (1..).zip(lines).filter(|(_, l)| !l.is_empty() && !l.starts_with('#')) {
        let refused = |expected| MaterialError::Line { line, expected, got: text.into() };
        let mut cells = text.split(SEPARATORS).map(str::trim);
        if is_heading(text) {
            let place = |cell: &str| ["n", "k"].iter().position(|c| c.eq_ignore_ascii_case(cell));
            let found: Option<Vec<usize>> = cells.skip(1).map(place).collect();
            columns = found.ok_or_else(|| refused("a heading wl,n or wl,k or wl,n,k"))?;
            continue;
        }
        let row = cells.try_fold(Vec::new(), |mut row: Vec<f64>, cell| {
            row.push(cell.parse().ok()?);
            Some(row)
        });
        let row = row.filter(|row| row.len() == columns.len() + 1);
        let row = row.ok_or_else(|| refused("as many numbers as the heading has columns"))?;
        columns.iter().zip(&row[1..]).for_each(|(place, v)| tables[*place].push([row[0], *v]));
    }
    let [n, k] = tables;
    if n.is_empty() {
        return Err(MaterialError::Missing("a row below wl,n"));
    }
    let k = if k.is_empty() { None } else { Some(Source::Table(Table::new(k)?)) };
    Material::paired(Source::Table(Table::new(n)?), k)
}
