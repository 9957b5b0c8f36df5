// SPDX-License-Identifier: MIT OR Apache-2.0
//! Labels of curves by wavelength, each the heading of its own column.

use arrays::csv::column_of;

/// Most digits after the point: f64 has no more in the range of wavelengths.
const MAX_DIGITS: usize = 17;

/// Labels of curves, one for each source (if any) and wavelength in nm. They have tenths of a
/// nanometre, and more digits where two would head one column. Sources whose names make one column
/// (`a-b` and `a_b`) are numbered.
pub(super) fn labels(curves: &[(Option<&str>, f64)]) -> Vec<String> {
    let label = |(source, nm): (Option<&str>, f64), digits: usize| match source {
        Some(source) => format!("{source} {nm:.digits$} nm"),
        None => format!("{nm:.digits$} nm"),
    };
    let alike = |a: usize, b: usize, digits: usize| {
        column_of(&label(curves[a], digits)) == column_of(&label(curves[b], digits))
    };
    let one = |k: usize| {
        let nm = |which: usize| curves[which].1.to_bits();
        let others = (0..curves.len()).filter(|other| nm(*other) != nm(k));
        let near: Vec<usize> = others.filter(|other| alike(k, *other, 1)).collect();
        let digits = (1..MAX_DIGITS).find(|d| near.iter().all(|other| !alike(k, *other, *d)));
        label(curves[k], digits.unwrap_or(MAX_DIGITS))
    };
    let labels: Vec<String> = (0..curves.len()).map(one).collect();
    let columns: Vec<String> = labels.iter().map(|label| column_of(label)).collect();
    let numbered = labels.into_iter().enumerate().map(|(k, label)| {
        let before = columns[..k].iter().filter(|c| **c == columns[k]).count();
        match before {
            0 => label,
            _ => format!("{label} {}", before + 1),
        }
    });
    numbered.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_in_tenths_keeps_them() {
        let lines = [(None, 450.0), (None, 549.96), (None, 550.06)];
        assert_eq!(labels(&lines), ["450.0 nm", "550.0 nm", "550.1 nm"]);
    }

    #[test]
    fn wavelengths_nearer_to_each_other_have_more_digits() {
        let lines = [(None, 550.0), (None, 550.04), (None, 600.0)];
        assert_eq!(labels(&lines), ["550.00 nm", "550.04 nm", "600.0 nm"]);
        let next = 550.0_f64.next_up();
        let columns = labels(&[(None, 550.0), (None, next), (None, 550.001)]);
        let columns: std::collections::BTreeSet<String> =
            columns.iter().map(|label| column_of(label)).collect();
        assert_eq!(columns.len(), 3, "{columns:?}");
    }

    #[test]
    fn sources_whose_names_make_one_column_are_numbered() {
        let lines = [(Some("a-b"), 550.0), (Some("a_b"), 550.0), (Some("a_b"), 600.0)];
        assert_eq!(labels(&lines), ["a-b 550.0 nm", "a_b 550.0 nm 2", "a_b 600.0 nm"]);
    }
}
