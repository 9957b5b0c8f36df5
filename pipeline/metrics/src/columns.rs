// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text of columns of numbers into lists.

use std::ops::RangeInclusive;

/// First line of a spectrum of Speos, which a line of description and the number of rows follow.
const SPEOS: &str = "OPTIS - Spectrum file";
const SPEOS_LINES: usize = 3;

/// Reads rows separated by lines, columns by commas, semicolons, tabs or spaces; lines that begin
/// with `#` and empty lines are left out, and so is the first other line if it begins with no
/// number (a heading). Of the head of a spectrum of Speos the number of rows is checked. The first
/// row decides how many columns there are, one of `counts`.
///
/// # Errors
/// A line that holds anything but so many numbers: its number, what was expected and what was found.
pub fn read(text: &str, counts: RangeInclusive<usize>) -> Result<Vec<Vec<f64>>, String> {
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut heading_allowed = true;
    let head = if text.starts_with(SPEOS) { SPEOS_LINES } else { 0 };
    for (number, line) in text.lines().enumerate().skip(head) {
        let line = line.trim().trim_start_matches('\u{feff}');
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = line
            .split(|c: char| ",;".contains(c) || c.is_whitespace())
            .filter(|cell| !cell.is_empty())
            .collect();
        let heading = heading_allowed && cells.first().is_none_or(|c| c.parse::<f64>().is_err());
        heading_allowed = false;
        if heading {
            continue;
        }
        let numbers: Option<Vec<f64>> = cells.iter().map(|c| c.parse().ok()).collect();
        let fits = |row: &Vec<f64>| match columns.len() {
            0 => counts.contains(&row.len()),
            count => row.len() == count,
        };
        let row = numbers.filter(fits).ok_or_else(|| {
            let of_counts = counts.clone().map(|count| count.to_string()).collect::<Vec<_>>();
            let of_counts = of_counts.join(" or ");
            format!(
                "line {}: expected {of_counts} numbers, as many in every row, got `{line}`",
                number + 1
            )
        })?;
        columns.resize(row.len(), Vec::new());
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
    }
    if columns.is_empty() {
        columns.resize(*counts.start(), Vec::new());
    }
    let rows = columns.first().map_or(0, Vec::len);
    let stated = text.lines().nth(head.wrapping_sub(1)).map(str::trim);
    if let Some(stated) = stated.filter(|stated| stated.parse() != Ok(rows)) {
        return Err(format!("line {head}: expected the number of rows, {rows}, got `{stated}`"));
    }
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_comments_and_separators() {
        let text = "\u{feff}# measured\nwavelength_nm,power\n400, 0.5\n\n401;1\n402\t2e-1\n";
        assert_eq!(read(text, 2..=2), Ok(vec![vec![400.0, 401.0, 402.0], vec![0.5, 1.0, 0.2]]));
        assert_eq!(read("", 2..=2), Ok(vec![vec![], vec![]]));
        assert_eq!(read("1 2 3\n4 5 6", 2..=3).map(|columns| columns.len()), Ok(3));
        let speos = "OPTIS - Spectrum file v1.0\nWhite LED 6500K\n2\n430\t0\n450\t100\n";
        assert_eq!(read(speos, 2..=2), Ok(vec![vec![430.0, 450.0], vec![0.0, 100.0]]));
    }

    #[test]
    fn other_lines_are_named() {
        for (text, line) in [
            ("400,1\n401", "line 2"),
            ("400,1,2", "line 1"),
            ("a,b\nc,d\n", "line 2"),
            ("400,1\n# x\n401,one", "line 3"),
            ("OPTIS - Spectrum file v1.0\ncut off\n3\n430\t0\n450\t1\n", "line 3"),
        ] {
            let error = read(text, 2..=2).expect_err("bad");
            assert!(error.starts_with(line), "{text:?}: {error}");
        }
    }
}
