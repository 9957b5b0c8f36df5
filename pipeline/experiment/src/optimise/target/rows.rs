// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of targets: rows of numbers.

use anyhow::{Result, bail};

/// Rows of `N` numbers out of lines that commas, semicolons or blanks divide; `#` begins a comment, a
/// first line of words is passed over.
///
/// # Errors
/// A line of other than `N` numbers that `allowed` takes after the rows before it; `expected` says
/// which.
pub(super) fn read<const N: usize>(
    text: &str,
    expected: &str,
    allowed: impl Fn(&[[f64; N]], [f64; N]) -> bool,
) -> Result<Vec<[f64; N]>> {
    let mut rows: Vec<[f64; N]> = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.split('#').next().unwrap_or_default().trim();
        let words = line.split(|c: char| c == ',' || c == ';' || c.is_whitespace());
        let numbers = words.filter(|w| !w.is_empty()).map(str::parse::<f64>);
        let numbers: Result<Vec<f64>, _> = numbers.collect();
        match numbers {
            Ok(numbers) if numbers.is_empty() => continue,
            Err(_) if number == 1 => continue,
            Ok(numbers) => {
                if let Ok(row) = <[f64; N]>::try_from(numbers)
                    && allowed(&rows, row)
                {
                    rows.push(row);
                    continue;
                }
            }
            Err(_) => {}
        }
        bail!("line {number}: expected {expected}, got {line:?}");
    }
    Ok(rows)
}
