// SPDX-License-Identifier: MIT OR Apache-2.0
//! The table of published figures beside computed ones: published, computed ± standard error,
//! difference.
//!
//! In: one [`SummaryRow`] a figure of the paper's tables. Out: aligned plain text for the terminal
//! and Markdown for documents. Standard errors show two significant digits and values as many
//! decimals, as the guide to uncertainty asks [JCGM 100:2008, 7.2.6]. Fractions appear as
//! percentages, their differences as points.

use std::fmt::Write as _;

use crate::published::Published;
use metrics::digits::{Digits, fixed, shortest};
use metrics::figures::{self, COLOUR_DIFFERENCE, Definition, PARABOLA};
use metrics::quantity::Unit;
use results::figure_entry::FigureEntry;
use results::shown::{self, shown_unit};
use results::{Figure, Results};

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
    pub computed: Option<FigureEntry>,
}

impl SummaryRow {
    /// The computed value, unless it is noise.
    pub fn resolved(&self) -> Option<FigureEntry> {
        self.computed.filter(|c| c.value.is_finite() && c.peak_place.is_off_axis())
    }
}

/// Every figure of every model, beside the published one.
pub fn rows(results: &Results, published: &Published) -> Vec<SummaryRow> {
    let mut rows = Vec::new();
    for design in results.designs.iter().chain(&results.references) {
        let of_design = published.design(&design.design_sha256);
        for model in &design.models {
            let of_tables = |figure: &&Figure| {
                figures::find(&figure.key).is_some_and(|found| in_tables(&found))
            };
            for figure in model.figures.iter().filter(of_tables) {
                rows.push(SummaryRow {
                    design: design.name.clone(),
                    model: model.label.clone(),
                    quantity: figure.label.to_string(),
                    unit: figure.unit,
                    published: of_design
                        .and_then(|models| models.get(&model.key)?.get(&*figure.key).copied()),
                    computed: Some(figure.entry),
                });
            }
        }
    }
    rows
}

/// True of the figures of the paper's tables, and of those that stand beside them.
fn in_tables(figure: &Definition) -> bool {
    figure.heading.is_some() || [PARABOLA, COLOUR_DIFFERENCE].contains(figure)
}

/// Sign of a missing number.
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

const COLUMNS: usize = 6;
const HEADINGS: [&str; COLUMNS] =
    ["Design", "Model", "Quantity", "Published", "Computed", "Difference"];

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
    shown::digits(row.computed.as_ref()?, row.unit)
}

fn line(row: &SummaryRow, digits: Option<&Digits>, longest_error: usize) -> [String; COLUMNS] {
    let (scale, symbol) = shown_unit(row.unit);
    let quantity = match symbol {
        "" => row.quantity.clone(),
        _ => format!("{} ({symbol})", row.quantity),
    };
    let computed = match digits {
        None => row
            .computed
            .and_then(|computed| shown::in_words(&computed, row.unit))
            .unwrap_or(MISSING.into()),
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
                let sign = if text.starts_with('-') || difference == 0.0 { "" } else { "+" };
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
    [row.design.clone(), row.model.clone(), quantity, published, computed, difference]
}

#[cfg(test)]
mod tests {
    use super::*;
    use metrics::Estimate;
    use metrics::far_field::PeakPlace;

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
            computed: computed.map(|(value, error)| FigureEntry::new(Estimate::new(value, error))),
        }
    }

    fn sample() -> Vec<SummaryRow> {
        vec![
            row("D1", "peak angle", Unit::Degree, Some(20.0), Some((21.36, 0.24))),
            row("D1", "uniformity", Unit::Fraction, Some(0.755), Some((0.7791, 0.0009))),
            row("D1", "extraction", Unit::Fraction, Some(0.95), None),
            row("D2", "extraction", Unit::Fraction, None, Some((0.9571, 0.000_12))),
        ]
    }

    #[test]
    fn plain_text_is_aligned_and_names_each_design_once() {
        let text = plain_text(&sample());
        let signs: Vec<usize> =
            text.lines().filter_map(|line| line.chars().position(|c| c == '±')).collect();
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
            line.trim_matches('|').split('|').map(|c| c.trim().to_owned()).collect()
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

    #[test]
    fn a_maximum_on_the_axis_stands_in_words() {
        let mut none = row("D1", "peak angle", Unit::Degree, Some(20.0), Some((3.0, 1.0)));
        none.computed.as_mut().unwrap().peak_place = PeakPlace::OnAxis;
        let text = plain_text(&[none]);
        assert!(text.contains("none (maximum on axis)") && !text.contains('±'), "{text}");
    }
}
