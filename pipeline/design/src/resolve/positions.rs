// SPDX-License-Identifier: MIT OR Apache-2.0
//! `array.positions_file`: where packages stand, as text with numbers separated by commas, semicolons
//! or spaces, one package a line. A first line of words names the columns ([`NAMES`]); without it they
//! are x and y in mm and, in all lines or in none, the power in any unit. Lines that begin with `#`
//! are passed over.

use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use runtime::bounded_text::{MAX_ROWS, bounded_text};

use crate::schema;

/// Most packages in a file.
const MAX_POSITIONS: usize = 20_000;

/// Largest power, in the unit of the file.
const MAX_POWER: f64 = 1e9;

/// Farthest from the origin, mm.
const FARTHEST: f64 = 1e5;

/// Largest turn of a package, degrees.
pub(crate) const MAX_TURN_DEG: f64 = 360.0;

/// Allowed sizes of a package over the stated one.
pub(crate) const SCALES: RangeInclusive<f64> = 0.5..=2.0;

/// Names of columns: x and y in mm, the turn about the axis of the package in degrees, the power, the
/// size over the stated one.
const NAMES: [&str; 5] = ["x_mm", "y_mm", "turn_deg", "power", "scale"];

/// Packages as a file states them.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Placed {
    /// Positions, mm.
    pub(crate) positions_mm: Vec<[f64; 2]>,
    /// Turns, degrees; empty where the file states none.
    pub(crate) turns_deg: Vec<f64>,
    /// Sizes over the stated one; empty where the file states none.
    pub(crate) scales: Vec<f64>,
    /// The power of each over the mean of all, where the file states powers that differ.
    pub(crate) drives: Option<Vec<f64>>,
}

/// What the file `name` states.
pub(crate) fn load(array: &schema::Array, name: &str, folder: &Path) -> Result<Placed> {
    ensure!(
        array.columns == 0 && array.rows == 0 && array.arrangement == schema::Arrangement::Square,
        "array.positions_file: expected neither columns, rows nor arrangement beside it"
    );
    let path = folder.join(name);
    let text = bounded_text(&path, MAX_ROWS).with_context(|| {
        format!("array.positions_file: expected positions, cannot read `{}`", path.display())
    })?;
    let found = parse(&text, array.pitch_mm.min());
    found.with_context(|| format!("array.positions_file: `{}`", path.display()))
}

fn parse(text: &str, pitch_mm: f64) -> Result<Placed> {
    let mut columns: Option<Vec<usize>> = None;
    let mut rows: Vec<([f64; NAMES.len()], usize)> = Vec::new();
    for (line, number) in text.trim_start_matches('\u{feff}').lines().zip(1..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words = line.split(|c: char| matches!(c, ',' | ';') || c.is_whitespace());
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        let values: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
        let is_text = words.first().is_some_and(|word| word.parse::<f64>().is_err());
        let is_heading = columns.is_none() && is_text;
        let Some(values) = values.filter(|_| !is_heading) else {
            ensure!(is_heading, "line {number}: expected numbers, got `{line}`");
            columns = Some(named(&words).with_context(|| format!("line {number}"))?);
            continue;
        };
        let columns = columns.get_or_insert_with(|| match values.len() {
            3 => vec![0, 1, 3],
            _ => vec![0, 1],
        });
        let names: Vec<&str> = columns.iter().map(|column| NAMES[*column]).collect();
        let names = names.join(", ");
        ensure!(
            values.len() == columns.len(),
            "line {number}: expected {} numbers in all lines ({names}), got {}; a first line of names \
             states other columns, of {}",
            columns.len(),
            values.len(),
            NAMES.join(", ")
        );
        let mut row = [0.0, 0.0, 0.0, 0.0, 1.0];
        columns.iter().zip(&values).for_each(|(column, value)| row[*column] = *value);
        let [x, y, turn, power, scale] = row;
        ensure!(
            x.abs() <= FARTHEST
                && y.abs() <= FARTHEST
                && turn.abs() <= MAX_TURN_DEG
                && (0.0..=MAX_POWER).contains(&power)
                && SCALES.contains(&scale),
            "line {number}: expected {names}: places at most {FARTHEST} mm from 0, a turn from \
             -{MAX_TURN_DEG} to {MAX_TURN_DEG}, a power from 0 to {MAX_POWER:e}, a scale from {} to \
             {}, got {values:?}",
            SCALES.start(),
            SCALES.end()
        );
        rows.push((row, number));
    }
    ensure!(
        (1..=MAX_POSITIONS).contains(&rows.len()),
        "expected 1 to {MAX_POSITIONS} positions, got {}",
        rows.len()
    );
    let place = |row: &[f64; NAMES.len()]| [row[0], row[1]];
    apart(&rows.iter().map(|(row, line)| (place(row), *line)).collect::<Vec<_>>(), pitch_mm)?;
    let column = |column: usize| {
        let is_stated = columns.as_ref().is_some_and(|columns| columns.contains(&column));
        rows.iter().filter(|_| is_stated).map(|(row, _)| row[column]).collect::<Vec<f64>>()
    };
    let (turns_deg, powers, scales) = (column(2), column(3), column(4));
    let mean = powers.iter().sum::<f64>() / rows.len() as f64;
    ensure!(powers.is_empty() || mean > 0.0, "expected a power above 0, got 0 in all lines");
    let is_even = powers.iter().all(|power| power.to_bits() == powers[0].to_bits());
    let drives = (!is_even).then(|| powers.iter().map(|power| power / mean).collect());
    let positions_mm = rows.iter().map(|(row, _)| place(row)).collect();
    Ok(Placed { positions_mm, turns_deg, scales, drives })
}

/// The numbers of the columns of these names.
fn named(words: &[&str]) -> Result<Vec<usize>> {
    let number = |word: &&str| NAMES.iter().position(|name| name == word);
    let columns: Option<Vec<usize>> = words.iter().map(number).collect();
    let columns = columns.filter(|columns| {
        let once = (0..columns.len()).all(|k| !columns[..k].contains(&columns[k]));
        once && [0, 1].iter().all(|place| columns.contains(place))
    });
    columns.with_context(|| {
        let [x, y, turn, power, scale] = NAMES;
        format!(
            "expected numbers, or names of columns, each once: {x}, {y} and perhaps {turn}, {power} \
             and {scale}, got `{}`",
            words.join(" ")
        )
    })
}

/// No two may stand nearer than the pitch: sorted by x, only those within a pitch along x are
/// compared.
fn apart(found: &[([f64; 2], usize)], pitch_mm: f64) -> Result<()> {
    let mut sorted = found.to_vec();
    sorted.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    for (k, (a, first)) in sorted.iter().enumerate() {
        for (b, second) in &sorted[k + 1..] {
            if b[0] - a[0] >= pitch_mm {
                break;
            }
            let distance = (b[0] - a[0]).hypot(b[1] - a[1]);
            ensure!(
                distance >= pitch_mm * (1.0 - 1e-9),
                "lines {first} and {second}: expected positions at least \
                 array.pitch_mm = {pitch_mm} apart, got {distance}"
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Placed, parse};

    #[test]
    fn positions_in_every_notation() {
        let text = "x_mm,y_mm\n# a comment\n0, 0\n8.3 0\n\n-8.3,\t1e0\n";
        let plain = parse(text, 8.0).expect("three positions");
        let positions_mm = vec![[0.0, 0.0], [8.3, 0.0], [-8.3, 1.0]];
        assert_eq!(plain, Placed { positions_mm, ..Placed::default() });
        // As spreadsheets write them.
        let sheet = "\u{feff}x_mm;y_mm\r\n0;0\r\n8.3; 0\r\n-8.3;1\r\n";
        assert_eq!(parse(sheet, 8.0).expect("three positions"), plain);
        assert_eq!(parse("\u{feff}0;0\n8.3;0\n-8.3;1\n", 8.0).expect("no heading"), plain);
        // Powers count by their mean.
        let drives = |text: &str| parse(text, 8.0).expect("powers").drives;
        assert_eq!(drives("0 0 3\n9 0 1\n18,0,2\n"), Some(vec![1.5, 0.5, 1.0]));
        assert_eq!(drives("0 0 3\n9 0 3\n"), None);
        // Named columns come in any order.
        let all = parse("turn_deg power y_mm x_mm\n45 3 1 0\n-30 1 0 9\n", 8.0).expect("named");
        let positions_mm = vec![[0.0, 1.0], [9.0, 0.0]];
        let (turns_deg, drives) = (vec![45.0, -30.0], Some(vec![1.5, 0.5]));
        assert_eq!(all, Placed { positions_mm, turns_deg, scales: Vec::new(), drives });
        let scaled = parse("scale x_mm y_mm\n0.5 0 3\n2 9 0\n", 8.0).expect("no power");
        assert_eq!((scaled.scales, scaled.drives), (vec![0.5, 2.0], None));
        let turned = parse("x_mm y_mm turn_deg\n0 0 3\n", 8.0).expect("no power");
        assert_eq!((turned.turns_deg, turned.drives), (vec![3.0], None));
    }

    #[test]
    fn what_is_no_position_is_refused_by_its_line() {
        for (text, says) in [
            ("", "1 to 20000"),
            ("0 0\n1", "line 2"),
            ("0 0\nNaN 4", "line 2"),
            ("0 0\n1e9 4", "line 2"),
            ("0 0\na b", "line 2"),
            ("0 0\n9 9\n0 7.9", "lines 1 and 3"),
            ("0 0 1\n9 9", "line 2: expected 3 numbers in all lines (x_mm, y_mm, power), got 2"),
            ("0 0\n9 9 1", "line 2: expected 2 numbers in all lines"),
            ("0 0 -1", "line 1"),
            ("0 0 1 2", "line 1: expected 2 numbers"),
            (",", "line 1: expected 2 numbers"),
            ("0 0 1 2 3", "a first line of names states other columns"),
            ("0 0 0\n9 9 0", "a power above 0"),
            ("x_mm y_mm tilt\n0 0 1", "line 1: expected numbers, or names of columns"),
            ("x_mm x_mm y_mm\n0 0 1", "each once"),
            ("x_mm power\n0 1", "x_mm, y_mm and perhaps turn_deg, power and scale"),
            ("x_mm y_mm turn_deg\n0 0", "line 2: expected 3 numbers"),
            ("x_mm y_mm turn_deg\n0 0 361", "line 2: expected x_mm, y_mm, turn_deg"),
            ("x_mm y_mm scale\n0 0 0", "a scale from 0.5 to 2, got [0.0, 0.0, 0.0]"),
            ("x_mm y_mm scale\n0 0 nan", "line 2: expected x_mm, y_mm, scale"),
            ("x_mm y_mm scale scale\n0 0 1 1", "each once"),
            ("x_mm y_mm\ny_mm x_mm\n0 0", "line 2: expected numbers, got `y_mm x_mm`"),
        ] {
            let error = format!("{:#}", parse(text, 8.0).expect_err(text));
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
