// SPDX-License-Identifier: MIT OR Apache-2.0
//! The table at the end of a run: published, computed ± standard error, difference.
//!
//! In: one [`SummaryRow`] a figure of merit. Out: aligned plain text for the terminal and Markdown for documents. Standard
//! errors show two significant digits and values as many decimals, as the guide to uncertainty asks [JCGM 100:2008, 7.2.6].
//! Fractions appear as percentages, their differences as points.

use std::fmt::Write as _;

use super::data::{Estimate, Unit};

/// One line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct SummaryRow {
    /// Design: `D1`.
    pub design: String,
    /// Model: `hybrid, 10 µm`.
    pub model: String,
    /// Figure of merit: `uniformity`.
    pub quantity: String,
    /// Unit in which `published` and `computed` are given.
    pub unit: Unit,
    /// Published value, where there is one.
    pub published: Option<f64>,
    /// Computed value, where there is one.
    pub computed: Option<Estimate>,
    /// Words in place of a computed value.
    pub instead: Option<&'static str>,
}

/// What stands in place of a missing number.
const MISSING: &str = "-";

/// The table as plain text: aligned columns, a design's name only where it changes.
pub fn plain_text(rows: &[SummaryRow]) -> String {
    let table = Table::new(rows);
    let mut text = String::new();
    table.plain_line(&mut text, &HEADINGS.map(String::from));
    let rule: usize = table.widths.iter().sum::<usize>() + 2 * (COLUMNS - 1);
    text.push_str(&"-".repeat(rule));
    text.push('\n');
    let mut previous: Option<&[String; COLUMNS]> = None;
    for line in &table.lines {
        let mut shown = line.clone();
        if let Some(before) = previous {
            if before[0] == line[0] {
                shown[0].clear();
                if before[1] == line[1] {
                    shown[1].clear();
                }
            } else {
                text.push('\n');
            }
        }
        table.plain_line(&mut text, &shown);
        previous = Some(line);
    }
    text
}

/// The table as Markdown, every cell filled.
pub fn markdown(rows: &[SummaryRow]) -> String {
    let table = Table::new(rows);
    let mut text = String::new();
    table.markdown_line(&mut text, &HEADINGS.map(String::from));
    text.push('|');
    for (column, width) in table.widths.iter().enumerate() {
        let dashes = "-".repeat(*width);
        let _ = if right_aligned(column) {
            write!(text, " {dashes}:|")
        } else {
            write!(text, " {dashes} |")
        };
    }
    text.push('\n');
    for line in &table.lines {
        table.markdown_line(&mut text, line);
    }
    text
}

/// `75.31 ± 0.12`: the error to two significant digits, the value to the same decimal; very large and very small numbers
/// with a common power of ten, `(1.234 ± 0.012)e-9`.
///
/// An error of exactly 0 shows as `± 0`, an unknown one (NaN) as `± ?`, a value that is not finite as `n/a`.
pub fn format_value_with_error(value: f64, error: f64) -> String {
    let digits = Digits::new(value, error);
    if digits.error.is_empty() {
        return digits.value;
    }
    match digits.power {
        0 => format!("{} ± {}", digits.value, digits.error),
        power => format!("({} ± {})e{power}", digits.value, digits.error),
    }
}

/// An estimate in the unit that people read it in: fractions as percentages, then [`format_value_with_error`] and the unit.
pub fn format_estimate(estimate: Estimate, unit: Unit) -> String {
    let (scale, symbol) = shown_unit(unit);
    let text = format_value_with_error(estimate.value * scale, estimate.standard_error * scale);
    if symbol.is_empty() || !text.contains('±') {
        text
    } else if text.starts_with('(') {
        format!("{text} {symbol}")
    } else {
        format!("({text}) {symbol}")
    }
}

fn shown_unit(unit: Unit) -> (f64, &'static str) {
    match unit {
        Unit::Fraction => (100.0, "%"),
        other => (1.0, other.symbol()),
    }
}

/// A value and its error written to the same decimal.
struct Digits {
    value: String,
    error: String,
    /// Power of ten that both are to be multiplied by.
    power: i32,
    /// Decimals of the value, where numbers beside it should have as many.
    decimals: usize,
}

impl Digits {
    fn new(value: f64, error: f64) -> Self {
        if !value.is_finite() {
            return Self {
                value: "n/a".into(),
                error: String::new(),
                power: 0,
                decimals: 0,
            };
        }
        let size = value.abs().max(if error.is_finite() { error } else { 0.0 });
        let power = if size > 0.0 && !(1e-4..1e7).contains(&size) {
            exponent(size, 1)
        } else {
            0
        };
        let scale = 10f64.powi(-power);
        let (value, error) = (value * scale, error * scale);
        if error > 0.0 && error.is_finite() {
            let decimals = 1 - exponent(error, 1);
            return Self {
                value: fixed(value, decimals),
                error: fixed(error, decimals),
                power,
                decimals: decimals.max(0) as usize,
            };
        }
        let value = shortest(value);
        Self {
            decimals: value.split_once('.').map_or(0, |(_, d)| d.len()),
            value,
            error: if error == 0.0 { "0" } else { "?" }.into(),
            power,
        }
    }
}

/// Decimal exponent of a positive number after rounding to `digits + 1` significant digits.
fn exponent(number: f64, digits: usize) -> i32 {
    let text = format!("{number:.digits$e}");
    text.split_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0)
}

/// `number` to so many decimals; negative decimals round before the point.
fn fixed(number: f64, decimals: i32) -> String {
    let text = if decimals >= 0 {
        format!("{number:.*}", decimals as usize)
    } else {
        let unit = 10f64.powi(-decimals);
        format!("{:.0}", (number / unit).round() * unit)
    };
    // A value that rounds to zero has no sign.
    if text.chars().all(|c| matches!(c, '-' | '0' | '.')) {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// A number that is known without an error: six significant digits without trailing zeros.
fn shortest(number: f64) -> String {
    if number == 0.0 {
        return "0".into();
    }
    let text = fixed(number, 5 - exponent(number.abs(), 5));
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

const COLUMNS: usize = 6;
const HEADINGS: [&str; COLUMNS] = [
    "Design",
    "Model",
    "Quantity",
    "Published",
    "Computed",
    "Difference",
];

fn right_aligned(column: usize) -> bool {
    column >= 3
}

/// Cells as text, and the width that every column needs.
struct Table {
    lines: Vec<[String; COLUMNS]>,
    widths: [usize; COLUMNS],
}

impl Table {
    fn new(rows: &[SummaryRow]) -> Self {
        let computed: Vec<Option<Digits>> = rows.iter().map(computed_digits).collect();
        // The signs ± stand in one column: errors are padded to the longest.
        let errors = computed.iter().flatten().map(|d| d.error.chars().count());
        let longest = errors.max().unwrap_or(0);
        let lines: Vec<_> = rows
            .iter()
            .zip(&computed)
            .map(|(row, digits)| line(row, digits.as_ref(), longest))
            .collect();
        let widths = std::array::from_fn(|column| {
            let cells = lines.iter().map(|line| line[column].chars().count());
            cells.max().unwrap_or(0).max(HEADINGS[column].len())
        });
        Self { lines, widths }
    }

    fn cells(&self, line: &[String; COLUMNS]) -> [String; COLUMNS] {
        std::array::from_fn(|column| {
            let (cell, width) = (&line[column], self.widths[column]);
            if right_aligned(column) {
                format!("{cell:>width$}")
            } else {
                format!("{cell:<width$}")
            }
        })
    }

    fn plain_line(&self, text: &mut String, line: &[String; COLUMNS]) {
        text.push_str(self.cells(line).join("  ").trim_end());
        text.push('\n');
    }

    fn markdown_line(&self, text: &mut String, line: &[String; COLUMNS]) {
        let _ = writeln!(text, "| {} |", self.cells(line).join(" | "));
    }
}

fn computed_digits(row: &SummaryRow) -> Option<Digits> {
    let (scale, _) = shown_unit(row.unit);
    row.computed
        .map(|c| Digits::new(c.value * scale, c.standard_error * scale))
}

fn line(row: &SummaryRow, digits: Option<&Digits>, longest_error: usize) -> [String; COLUMNS] {
    let (scale, symbol) = shown_unit(row.unit);
    let quantity = match symbol {
        "" => row.quantity.clone(),
        _ => format!("{} ({symbol})", row.quantity),
    };
    let computed = match digits {
        None => row.instead.unwrap_or(MISSING).into(),
        Some(d) if d.error.is_empty() => d.value.clone(),
        Some(d) => {
            let error = format!("{:<longest_error$}", d.error);
            match d.power {
                0 => format!("{} ± {error}", d.value),
                power => format!("({} ± {})e{power}", d.value, d.error),
            }
        }
    };
    let difference = match (row.published, row.computed, digits) {
        (Some(published), Some(computed), Some(digits))
            if published.is_finite() && computed.value.is_finite() =>
        {
            let difference = (computed.value - published) * scale;
            if digits.power == 0 {
                let text = fixed(difference, digits.decimals as i32);
                let sign = if text.starts_with('-') || difference == 0.0 {
                    ""
                } else {
                    "+"
                };
                format!("{sign}{text}")
            } else {
                format!("{difference:+.1e}")
            }
        }
        _ => MISSING.into(),
    };
    let published = match row.published {
        Some(value) if value.is_finite() => shortest(value * scale),
        _ => MISSING.into(),
    };
    [
        row.design.clone(),
        row.model.clone(),
        quantity,
        published,
        computed,
        difference,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(
        design: &str,
        quantity: &str,
        unit: Unit,
        published: Option<f64>,
        computed: Option<(f64, f64)>,
    ) -> SummaryRow {
        SummaryRow {
            design: design.into(),
            model: "rays, 100 µm".into(),
            quantity: quantity.into(),
            unit,
            published,
            computed: computed.map(|(value, standard_error)| Estimate {
                value,
                standard_error,
            }),
            instead: None,
        }
    }

    #[test]
    fn errors_have_two_digits_and_values_as_many_decimals() {
        let cases = [
            ((75.312_34, 0.1234), "75.31 ± 0.12"),
            ((75.312_34, 0.0996), "75.31 ± 0.10"),
            ((75.0, 12.7), "75 ± 13"),
            ((1234.5, 123.0), "1230 ± 120"),
            ((0.591, 0.0042), "0.5910 ± 0.0042"),
            ((-0.0001, 0.12), "0.00 ± 0.12"),
            ((-2.5, 0.4), "-2.50 ± 0.40"),
            ((1.2345e-9, 1.2e-11), "(1.234 ± 0.012)e-9"),
            ((3.0e9, 2.0e7), "(3.000 ± 0.020)e9"),
            ((0.0, 3.4e-8), "(0.0 ± 3.4)e-8"),
            ((20.0, 0.0), "20 ± 0"),
            ((20.125, f64::NAN), "20.125 ± ?"),
            ((f64::NAN, 0.1), "n/a"),
            ((0.0, 0.0), "0 ± 0"),
        ];
        for ((value, error), expected) in cases {
            assert_eq!(format_value_with_error(value, error), expected);
        }
    }

    #[test]
    fn estimates_show_the_unit_people_read() {
        let estimate = |value, standard_error| Estimate {
            value,
            standard_error,
        };
        assert_eq!(
            format_estimate(estimate(0.7531, 0.0012), Unit::Fraction),
            "(75.31 ± 0.12) %"
        );
        assert_eq!(
            format_estimate(estimate(24.31, 0.31), Unit::Degree),
            "(24.31 ± 0.31) °"
        );
        assert_eq!(
            format_estimate(estimate(f64::NAN, 0.0), Unit::Degree),
            "n/a"
        );
        assert_eq!(
            format_estimate(estimate(2.0, 0.5), Unit::Relative),
            "2.00 ± 0.50"
        );
    }

    fn sample() -> Vec<SummaryRow> {
        vec![
            row(
                "D1",
                "peak angle",
                Unit::Degree,
                Some(20.0),
                Some((21.36, 0.24)),
            ),
            row(
                "D1",
                "uniformity",
                Unit::Fraction,
                Some(0.755),
                Some((0.7791, 0.0009)),
            ),
            row("D1", "extraction", Unit::Fraction, Some(0.95), None),
            row(
                "D2",
                "extraction",
                Unit::Fraction,
                None,
                Some((0.9571, 0.000_12)),
            ),
        ]
    }

    #[test]
    fn plain_text_is_aligned_and_names_each_design_once() {
        let text = plain_text(&sample());
        let signs: Vec<usize> = text
            .lines()
            .filter_map(|line| line.chars().position(|c| c == '±'))
            .collect();
        assert_eq!(signs.len(), 3);
        assert!(signs.windows(2).all(|w| w[0] == w[1]), "{text}");
        assert_eq!(text.matches("D1").count(), 1);
        assert!(text.contains("+1.36") && text.contains("+2.410"), "{text}");
        assert!(!text.lines().any(|line| line.ends_with(' ')));
    }

    #[test]
    fn missing_numbers_show_as_a_dash() {
        let text = markdown(&sample());
        let fields = |row: usize| -> Vec<String> {
            let line = text.lines().nth(row + 2).unwrap();
            line.trim_matches('|')
                .split('|')
                .map(|c| c.trim().to_owned())
                .collect()
        };
        assert_eq!(fields(2)[3..], ["95", "-", "-"]);
        assert_eq!(fields(3)[3..], ["-", "95.710 ± 0.012", "-"]);
        assert_eq!(fields(0)[3..], ["20", "21.36 ± 0.24", "+1.36"]);
    }

    #[test]
    fn markdown_lines_are_equally_long() {
        let text = markdown(&sample());
        let lengths: Vec<usize> = text.lines().map(|line| line.chars().count()).collect();
        assert_eq!(lengths.len(), 6);
        assert!(lengths.windows(2).all(|w| w[0] == w[1]), "{text}");
        assert!(text.lines().all(|l| l.starts_with('|') && l.ends_with('|')));
    }

    #[test]
    fn an_empty_table_is_its_heading() {
        assert_eq!(plain_text(&[]).lines().count(), 2);
        assert_eq!(markdown(&[]).lines().count(), 2);
    }
}
