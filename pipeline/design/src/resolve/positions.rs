// SPDX-License-Identifier: MIT OR Apache-2.0
//! `array.positions_file`: where packages stand, as text with x and y in mm, separated by a comma
//! or by spaces, one package a line. Lines that begin with `#` and a first line of words are passed
//! over.

use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use runtime::bounded_text::{MAX_ROWS, bounded_text};

use crate::schema;

/// Most packages in a file.
const MAX_POSITIONS: usize = 20_000;

/// Farthest from the origin, mm.
const FARTHEST: f64 = 1e5;

/// The positions in the file `name`, mm.
pub(crate) fn load(array: &schema::Array, name: &str, folder: &Path) -> Result<Vec<[f64; 2]>> {
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

fn parse(text: &str, pitch_mm: f64) -> Result<Vec<[f64; 2]>> {
    let mut found: Vec<([f64; 2], usize)> = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words = line.split(|c: char| c == ',' || c.is_whitespace());
        let values: Option<Vec<f64>> =
            words.filter(|word| !word.is_empty()).map(|word| word.parse().ok()).collect();
        match values.as_deref() {
            Some(&[x, y]) if x.abs() <= FARTHEST && y.abs() <= FARTHEST => {
                found.push(([x, y], number));
            }
            None if found.is_empty() && number == 1 => {}
            other => {
                let got = other.map_or("text".to_owned(), |values| format!("{values:?}"));
                bail!("line {number}: expected x and y in mm, at most {FARTHEST} from 0, got {got}")
            }
        }
    }
    ensure!(
        (1..=MAX_POSITIONS).contains(&found.len()),
        "expected 1 to {MAX_POSITIONS} positions, got {}",
        found.len()
    );
    apart(&found, pitch_mm)?;
    Ok(found.into_iter().map(|(at, _)| at).collect())
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
    use super::parse;

    #[test]
    fn positions_in_every_notation() {
        let text = "x_mm,y_mm\n# a comment\n0, 0\n8.3 0\n\n-8.3,\t1e0\n";
        let found = parse(text, 8.0).expect("three positions");
        assert_eq!(found, [[0.0, 0.0], [8.3, 0.0], [-8.3, 1.0]]);
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
        ] {
            let error = format!("{:#}", parse(text, 8.0).expect_err(text));
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
