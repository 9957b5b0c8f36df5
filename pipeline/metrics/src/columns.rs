// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text of two columns, wavelength in nm and a number, into two lists.

/// First line of a spectrum of Speos, which a line of description and the number of rows follow.
const SPEOS: &str = "OPTIS - Spectrum file";
const SPEOS_LINES: usize = 3;

/// Reads rows separated by lines, columns by commas, semicolons, tabs or spaces; lines that begin
/// with `#` and empty lines are left out, and so is the first other line if it begins with no
/// number (a heading). A spectrum of Speos is read without its head.
///
/// # Errors
/// A line that holds anything but two numbers: its number, what was expected and what was found.
pub fn read(text: &str) -> Result<[Vec<f64>; 2], String> {
    let mut columns = [Vec::new(), Vec::new()];
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
        match numbers.as_deref() {
            Some(&[wavelength, value]) => {
                columns[0].push(wavelength);
                columns[1].push(value);
            }
            _ => {
                return Err(format!(
                    "line {}: expected a wavelength in nm and a number, got `{line}`",
                    number + 1
                ));
            }
        }
    }
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_comments_and_separators() {
        let text = "\u{feff}# measured\nwavelength_nm,power\n400, 0.5\n\n401;1\n402\t2e-1\n";
        let [nm, power] = read(text).expect("two columns");
        assert_eq!(nm, [400.0, 401.0, 402.0]);
        assert_eq!(power, [0.5, 1.0, 0.2]);
        assert_eq!(read(""), Ok([vec![], vec![]]));
        let speos = "OPTIS - Spectrum file v1.0\nWhite LED 6500K\n2\n430\t0\n450\t100\n";
        assert_eq!(read(speos), Ok([vec![430.0, 450.0], vec![0.0, 100.0]]));
    }

    #[test]
    fn other_lines_are_named() {
        for (text, line) in [
            ("400,1\n401", "line 2"),
            ("400,1,2", "line 1"),
            ("a,b\nc,d\n", "line 2"),
            ("400,1\n# x\n401,one", "line 3"),
        ] {
            let error = read(text).expect_err("bad");
            assert!(error.starts_with(line), "{text:?}: {error}");
        }
    }
}
