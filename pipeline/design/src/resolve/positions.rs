// SPDX-License-Identifier: MIT OR Apache-2.0
//! `array.positions_file`: where packages stand, as text with x and y in mm, separated by a comma
//! or by spaces, one package a line, and its power in any unit as a third number, of all or of none.
//! Lines that begin with `#` and a first line of words are passed over.

use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use runtime::bounded_text::{MAX_ROWS, bounded_text};

use crate::schema;

/// Most packages in a file.
const MAX_POSITIONS: usize = 20_000;

/// Largest power, in the unit of the file.
const MAX_POWER: f64 = 1e9;

/// Farthest from the origin, mm.
const FARTHEST: f64 = 1e5;

/// Positions, mm, and the power of each package over the mean of all, where the file states powers.
pub(crate) type Placed = (Vec<[f64; 2]>, Option<Vec<f64>>);

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
    let mut positions: Vec<([f64; 2], usize)> = Vec::new();
    let mut powers = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words = line.split(|c: char| c == ',' || c.is_whitespace());
        let values: Option<Vec<f64>> =
            words.filter(|word| !word.is_empty()).map(|word| word.parse().ok()).collect();
        match values.as_deref() {
            Some(&[x, y, ref power @ ..])
                if x.abs() <= FARTHEST
                    && y.abs() <= FARTHEST
                    && power.len() <= 1
                    && power.iter().all(|power| (0.0..=MAX_POWER).contains(power)) =>
            {
                positions.push(([x, y], number));
                powers.extend(power);
                ensure!(
                    powers.is_empty() || powers.len() == positions.len(),
                    "line {number}: expected a power in all lines or in none"
                );
            }
            None if positions.is_empty() && number == 1 => {}
            other => {
                let got = other.map_or("text".to_owned(), |values| format!("{values:?}"));
                bail!(
                    "line {number}: expected x and y in mm, at most {FARTHEST} from 0, and if at all \
                     a power from 0 to {MAX_POWER:e}, got {got}"
                )
            }
        }
    }
    ensure!(
        (1..=MAX_POSITIONS).contains(&positions.len()),
        "expected 1 to {MAX_POSITIONS} positions, got {}",
        positions.len()
    );
    apart(&positions, pitch_mm)?;
    let mean = powers.iter().sum::<f64>() / positions.len() as f64;
    ensure!(powers.is_empty() || mean > 0.0, "expected a power above 0, got 0 in all lines");
    let is_even = powers.iter().all(|power| power.to_bits() == powers[0].to_bits());
    let drives = (!is_even).then(|| powers.iter().map(|power| power / mean).collect());
    Ok((positions.into_iter().map(|(at, _)| at).collect(), drives))
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
        let (found, drives) = parse(text, 8.0).expect("three positions");
        assert_eq!(found, [[0.0, 0.0], [8.3, 0.0], [-8.3, 1.0]]);
        assert_eq!(drives, None);
        // Powers count by their mean.
        let (_, drives) = parse("0 0 3\n9 0 1\n18,0,2\n", 8.0).expect("powers");
        assert_eq!(drives, Some(vec![1.5, 0.5, 1.0]));
        assert_eq!(parse("0 0 3\n9 0 3\n", 8.0).expect("powers").1, None);
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
            ("0 0 1\n9 9", "line 2: expected a power in all lines"),
            ("0 0\n9 9 1", "line 2: expected a power in all lines"),
            ("0 0 -1", "line 1"),
            ("0 0 1 2", "line 1"),
            ("0 0 0\n9 9 0", "a power above 0"),
        ] {
            let error = format!("{:#}", parse(text, 8.0).expect_err(text));
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
