// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers with error bars on lines one under the other, a column for each quantity: published
//! beside computed figures, and what many set-ups do to a figure.

use anyhow::{Result, ensure};

use metrics::Estimate;
use metrics::quantity::{Quantity, Unit};
use results::figure_entry::FigureEntry;
use results::shown::{self, shown_unit};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Rect};
use super::draw::colour::Colour;
use super::draw::palette;
use super::draw::panel::{BAND_ERRORS, LINE as LINE_OF_NAME, Panel, PanelAxis, TICK_SIZE};
use super::draw::scale;
use super::draw::sheet::{Entry, Sample, Sheet, diamond};
use crate::summary::SummaryRow;

/// Pixels of a line, of one whose label has two, of a picture without lines, and of the highest
/// picture.
const LINE: f64 = 30.0;
const BROKEN: f64 = 46.0;
const REST: f64 = 290.0;
const HIGHEST: f64 = 12_000.0;
/// Radius of a dot.
const DOT: f64 = 5.5;
/// Widest part of the picture that labels may take, pixels, and letters of a label on one line.
const LABELS: f64 = 620.0;
const LETTERS: usize = 58;
/// Distance of the two lines of a label, and of columns, pixels.
const APART: f64 = 20.0;
const GAP: f64 = 40.0;
/// Room of a number at a tick.
const TICK: f64 = 75.0;
/// Half the range drawn where nothing differs from 0.
const NOTHING: f64 = 0.01;

/// One line of [`marked_lines`].
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedLine {
    /// Name at the left.
    pub label: String,
    /// Series, and difference or slope.
    pub marks: Vec<(String, Estimate)>,
    /// Least value that there can be, at which bars end.
    pub least: f64,
}

/// Draws a dot with a bar of two standard errors for every mark, coloured by its series, and a line
/// at 0. Fractions are drawn as percentages.
///
/// # Errors
/// No finite value, or more lines than a picture can hold.
pub fn marked_lines(
    heading: &Heading,
    quantity: &str,
    unit: Unit,
    lines: &[MarkedLine],
) -> Result<Picture> {
    let mut chart =
        Chart { columns: vec![Quantity::new(quantity, unit)], from_zero: true, ..Chart::default() };
    for (line, MarkedLine { label, marks, least }) in lines.iter().enumerate() {
        chart.lines.push(broken(label));
        for (series, mark) in marks.iter().filter(|(_, mark)| mark.value.is_finite()) {
            let [low, high] = band(*mark);
            chart.dots.push(Dot {
                line,
                column: 0,
                series: place_of(&mut chart.series, series),
                computed: Some(Computed {
                    value: mark.value,
                    bar: [low.max(*least), high],
                    words: shown::difference(*mark, unit),
                }),
                published: None,
            });
        }
    }
    ensure!(!chart.dots.is_empty(), "expected a finite value to draw");
    chart.draw(heading)
}

/// Draws published values as open diamonds and computed values as dots with bars of two standard
/// errors. Columns and lines stand in the order in which `rows` first names them; fractions are
/// drawn as percentages.
///
/// # Errors
/// No row with a number, or more than six figures of merit.
pub fn published_vs_computed(heading: &Heading, rows: &[SummaryRow]) -> Result<Picture> {
    let mut chart = Chart::default();
    let mut named: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        let published = row.published.filter(|v| v.is_finite());
        let computed = row.resolved();
        if published.is_none() && computed.is_none() {
            continue;
        }
        let name = (row.design.as_str(), row.model.as_str());
        let line = place_of(&mut named, &name);
        if line == chart.lines.len() {
            // Designs are set apart.
            if line > 0 && named[line - 1].0 != name.0 {
                chart.separated.push(line);
            }
            let parts = [name.0, name.1].into_iter().filter(|part| !part.is_empty());
            chart.lines.push(vec![parts.collect::<Vec<_>>().join(", ")]);
        }
        let quantity = Quantity::new(&row.quantity, row.unit);
        chart.dots.push(Dot {
            line,
            column: place_of(&mut chart.columns, &quantity),
            series: place_of(&mut chart.series, &row.model),
            computed: computed.map(|entry| Computed::new(&entry, row.unit)),
            published,
        });
    }
    ensure!(
        (1..=6).contains(&chart.columns.len()),
        "expected one to six figures of merit to compare, got {}",
        chart.columns.len()
    );
    chart.draw(heading)
}

/// Index of `item` in `list`, to which it is added where it is missing.
fn place_of<T: PartialEq + Clone>(list: &mut Vec<T>, item: &T) -> usize {
    list.iter().position(|other| other == item).unwrap_or_else(|| {
        list.push(item.clone());
        list.len() - 1
    })
}

/// A number on its line, in its column.
struct Dot {
    line: usize,
    column: usize,
    series: usize,
    computed: Option<Computed>,
    published: Option<f64>,
}

/// A computed number.
struct Computed {
    value: f64,
    /// Ends of its error bar, or of the range of a figure that is not resolved.
    bar: [f64; 2],
    /// Text of its tooltip.
    words: String,
}

impl Computed {
    fn new(entry: &FigureEntry, unit: Unit) -> Self {
        let [low, high] = entry.interval.unwrap_or_else(|| band(entry.with_added_errors()));
        // No share lies beyond 0 and 1.
        let bar = match unit {
            Unit::Fraction => [low.max(0.0), high.min(1.0)],
            Unit::Ratio => [low.max(0.0), high],
            _ => [low, high],
        };
        Self { value: entry.value, bar, words: shown::text(&entry.in_range(unit), unit) }
    }
}

/// Two errors to each side of a value, none where the error is not known.
fn band(Estimate { value, standard_error, .. }: Estimate) -> [f64; 2] {
    let bar = if standard_error.is_finite() { BAND_ERRORS * standard_error } else { 0.0 };
    [value - bar, value + bar]
}

impl Dot {
    fn ends(&self) -> impl Iterator<Item = f64> {
        self.computed.iter().flat_map(|computed| computed.bar).chain(self.published)
    }
}

/// Content of the picture.
#[derive(Default)]
struct Chart {
    columns: Vec<Quantity>,
    /// Labels at the left, of one or two lines of text.
    lines: Vec<Vec<String>>,
    /// Lines above which a stronger line stands.
    separated: Vec<usize>,
    /// Names in the legend.
    series: Vec<String>,
    dots: Vec<Dot>,
    /// True if the axes hold 0, with a line there.
    from_zero: bool,
}

impl Chart {
    fn colour(&self, series: usize) -> Colour {
        let name = &self.series[series];
        palette::model_number(name).map_or_else(|| palette::neutral(series), palette::model)
    }

    fn legend(&self) -> Vec<Entry> {
        let published = self.dots.iter().any(|dot| dot.published.is_some());
        let diamond = Entry::new(Sample::Diamond(Colour::TEXT), "published");
        let named = self.series.iter().enumerate();
        let dots = named.filter(|(_, name)| !name.is_empty()).map(|(i, name)| {
            let words = if published { "computed, " } else { "" };
            Entry::new(Sample::Dot(self.colour(i), DOT), format!("{words}{name}"))
        });
        let bar = Pen::solid(Colour::MUTED, 2.0);
        let bar = Entry::new(Sample::Line(bar), "±2 standard errors");
        published.then_some(diamond).into_iter().chain(dots).chain([bar]).collect()
    }

    fn draw(&self, heading: &Heading) -> Result<Picture> {
        let two = self.lines.iter().any(|label| label.len() > 1);
        let line = if two || !self.from_zero { BROKEN } else { LINE };
        let height = REST + line * self.lines.len() as f64;
        ensure!(
            height <= HIGHEST,
            "expected at most {} lines to draw, got {}",
            ((HIGHEST - REST) / line).floor(),
            self.lines.len()
        );
        let mut sheet = Sheet::new(1600, height as u32, heading, &self.legend());
        let names = Letters::new(TICK_SIZE, Align::Right);
        let widest = self.lines.iter().flatten().map(|label| names.width(label));
        let widest = widest.fold(0.0, f64::max).min(LABELS);
        // Names of narrow columns take two lines.
        let below = if self.columns.len() > 1 { 65.0 + LINE_OF_NAME } else { 65.0 };
        let body = sheet.body.inset(widest + 26.0, 10.0, 20.0, below);
        let place = |index: f64| body.top + body.height() * index / self.lines.len() as f64;
        let width = (body.width() + GAP) / self.columns.len() as f64 - GAP;
        for (column, quantity) in self.columns.iter().enumerate() {
            let left = body.left + column as f64 * (width + GAP);
            let area = Rect::new(left, body.top, left + width, body.bottom);
            let dots = || self.dots.iter().filter(|dot| dot.column == column);
            let ends = self.scale(dots().flat_map(Dot::ends));
            let count = ((width / TICK) as usize).clamp(2, 8);
            let panel = Panel {
                area,
                x: PanelAxis::linear(quantity, ends, count),
                y: PanelAxis::blank(0.0, 1.0),
            };
            let canvas = &mut sheet.canvas;
            panel.grid(canvas);
            if self.from_zero {
                let x = panel.at(0.0, 0.0)[0];
                let pen = Pen::solid(Colour::TEXT, 1.4);
                canvas.line([x, area.top], [x, area.bottom], &pen);
            }
            for &line in &self.separated {
                let y = place(line as f64);
                let pen = Pen::solid(Colour::MUTED, 1.0);
                canvas.line([area.left, y], [area.right, y], &pen);
            }
            for dot in dots() {
                self.dot(canvas, dot, quantity, place(dot.line as f64 + 0.5), |v| {
                    panel.at(v, 0.0)[0]
                });
            }
            panel.frame(canvas);
        }
        for (index, label) in self.lines.iter().enumerate() {
            for (k, part) in label.iter().enumerate() {
                let down = APART * (k as f64 - 0.5 * (label.len() as f64 - 1.0));
                let y = place(index as f64 + 0.5) + down;
                sheet.canvas.text(part, [body.left - 14.0, y], &names);
            }
        }
        Ok(sheet.canvas.finish())
    }

    /// The range of a column, with a margin.
    fn scale(&self, ends: impl Iterator<Item = f64>) -> [f64; 2] {
        let [low, high] = scale::ends(ends);
        if self.from_zero {
            let (low, high) = drawn(low.min(0.0), high.max(0.0));
            let margin = 0.06 * (high - low);
            return [if low < 0.0 { low - margin } else { 0.0 }, high + margin];
        }
        let margin = 0.1 * (high - low).max(0.01 * high.abs()).max(1e-9);
        [low - margin, high + margin]
    }

    fn dot(
        &self,
        canvas: &mut Canvas,
        dot: &Dot,
        quantity: &Quantity,
        y: f64,
        x: impl Fn(f64) -> f64,
    ) {
        let (scale, unit) = shown_unit(quantity.unit());
        let label = self.lines[dot.line].join(" ");
        if let (Some(from), Some(to)) = (dot.published, &dot.computed) {
            let pen = Pen::dashed(Colour::MUTED, 1.2, &[3.0, 4.0]);
            canvas.line([x(from), y], [x(to.value), y], &pen);
        }
        if let Some(published) = dot.published {
            let words = format!("{label}: published {} {unit}", published * scale);
            canvas.with_tooltip(&words, |canvas| {
                diamond(canvas, [x(published), y], 8.5, Colour::TEXT);
            });
        }
        if let Some(Computed { value, bar, words }) = &dot.computed {
            let colour = self.colour(dot.series);
            let pen = Pen::solid(colour, 2.4);
            canvas.with_tooltip(&format!("{label}: {words}"), |canvas| {
                let ends = bar.map(&x);
                canvas.line([ends[0], y], [ends[1], y], &pen);
                if ends[1] - ends[0] > 13.0 {
                    for x in ends {
                        canvas.line([x, y - 6.0], [x, y + 6.0], &pen);
                    }
                }
                canvas.disk([x(*value), y], DOT, colour);
            });
        }
    }
}

/// The range that is drawn for values from `low` to `high`.
fn drawn(low: f64, high: f64) -> (f64, f64) {
    if high > low { (low, high) } else { (-NOTHING, NOTHING) }
}

/// A label on one line, or a longer one on two, broken after the comma that leaves the shortest
/// lines.
fn broken(label: &str) -> Vec<String> {
    let count = |part: &str| part.chars().count();
    if count(label) <= LETTERS {
        return vec![label.to_owned()];
    }
    let commas = label.match_indices(", ").map(|(at, _)| label.split_at(at + 1));
    let best = commas.min_by_key(|(a, b)| count(a).max(count(b)));
    best.map_or_else(
        || vec![shortened(label)],
        |(a, b)| vec![shortened(a), shortened(b.trim_start())],
    )
}

fn shortened(label: &str) -> String {
    if label.chars().count() <= LETTERS {
        return label.to_owned();
    }
    let kept: String = label.chars().take(LETTERS - 1).collect();
    format!("{kept}...")
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;

    fn line(label: &str, value: f64) -> MarkedLine {
        MarkedLine {
            least: f64::NEG_INFINITY,
            label: label.to_owned(),
            marks: vec![
                ("D1".to_owned(), Estimate::new(value, 0.01)),
                ("D2".to_owned(), Estimate::new(-value, f64::NAN)),
            ],
        }
    }

    #[test]
    fn pictures_differ_with_their_numbers_and_hold_long_names() {
        let heading = Heading::new("study", "test");
        let draw = |value: f64| {
            let lines = [line("base", value), line(&"long name ".repeat(20), 0.2)];
            marked_lines(&heading, "change of uniformity", Unit::Fraction, &lines).expect("drawn")
        };
        assert_eq!(draw(0.1), draw(0.1));
        assert_ne!(draw(0.1), draw(0.15));
    }

    #[test]
    fn labels_of_two_factors_are_kept_whole() {
        let label =
            "OS2 = inner alpha, apex beta, chord, OS3 = inner alpha, outer beta, horizontal";
        let lines = broken(label);
        assert_eq!(lines.join(" "), label);
        assert!(lines.len() == 2 && lines.iter().all(|l| l.len() <= LETTERS));
        assert_eq!(broken("base"), ["base"]);
        assert!(broken(&"x".repeat(200))[0].ends_with("..."));
    }

    #[test]
    fn no_change_is_drawn_in_a_range_around_0() {
        assert_eq!(drawn(0.0, 0.0), (-NOTHING, NOTHING));
        assert_eq!(drawn(-0.2, 0.1), (-0.2, 0.1));
    }

    #[test]
    fn nothing_to_draw_and_too_much_are_refused() {
        let heading = Heading::new("study", "test");
        let draw = |lines: &[MarkedLine]| marked_lines(&heading, "misfit", Unit::Relative, lines);
        assert!(draw(&[]).is_err());
        assert!(draw(&[line("x", f64::NAN)]).is_err());
        assert!(draw(&vec![line("x", 1.0); 5000]).is_err());
    }

    fn row(quantity: &str, published: Option<f64>, computed: Option<f64>) -> SummaryRow {
        SummaryRow {
            design: "D1".into(),
            model: "geometric".into(),
            quantity: quantity.into(),
            unit: Unit::Fraction,
            published,
            computed: computed.map(|value| FigureEntry::new(Estimate::new(value, 0.01))),
        }
    }

    #[test]
    fn missing_numbers_leave_their_place_empty() {
        let heading = Heading::new("Comparison", "all designs");
        let blue = palette::model(0).rgb;
        let dots = |rows: &[SummaryRow]| {
            let picture = decode(&published_vs_computed(&heading, rows).unwrap());
            // Below the legend, which holds a dot of its own.
            let from = (picture.width() * 140) as usize;
            let pixels = &picture.pixels()[from..];
            pixels.iter().filter(|p| [p.red(), p.green(), p.blue()] == blue).count()
        };
        assert!(dots(&[row("uniformity", Some(0.7), Some(0.8))]) > 50);
        assert_eq!(dots(&[row("uniformity", Some(0.7), None)]), 0);
        assert!(dots(&[row("uniformity", None, Some(0.8))]) > 50);
        assert!(published_vs_computed(&heading, &[row("uniformity", None, None)]).is_err());
        assert!(published_vs_computed(&heading, &[]).is_err());
    }

    #[test]
    fn bars_of_shares_end_at_1_and_those_of_open_figures_at_their_ends() {
        let bar = |estimate, unit| {
            let computed = Computed::new(&FigureEntry::new(estimate), unit);
            (computed.bar, computed.words)
        };
        let (ends, words) = bar(Estimate::new(0.99, 0.01), Unit::Fraction);
        assert!((ends[0] - 0.97).abs() < 1e-12 && (ends[1] - 1.0).abs() < 1e-12, "{ends:?}");
        assert_eq!(words, "99.0 ± 1.0 %");
        let (ends, words) = bar(Estimate::between(0.92, 1.02, 0.01), Unit::Fraction);
        assert!((ends[0] - 0.8589).abs() < 1e-4 && (ends[1] - 1.0).abs() < 1e-12, "{ends:?}");
        assert_eq!(words, "85 to 100 %");
        let (ends, _) = bar(Estimate::new(2.0, 0.5), Unit::Degree);
        assert!((ends[0] - 1.0).abs() < 1e-12 && (ends[1] - 3.0).abs() < 1e-12, "{ends:?}");
    }

    #[test]
    fn an_axis_holds_all_its_numbers() {
        let chart = Chart::default();
        let [low, high] = chart.scale([0.5, 0.88, 0.92, 0.95].into_iter());
        assert!(low < 0.5 && high > 0.95);
    }
}
