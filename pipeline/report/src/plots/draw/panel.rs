// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cartesian axes: places of numbers in a rectangle, its grid, ticks and labels, and curves with
//! their error bands.

use metrics::quantity::{Curve, Quantity, Unit};
use results::figure_entry::FigureEntry;
use results::shown;

use super::canvas::{Align, Canvas, Letters, Pen, Point, Rect};
use super::colour::Colour;
use super::scale::{AxisScale, DECADES_WITH_FACTORS, Tick, common_power, every, power_of_ten};
use super::sheet::CURVE;

/// Font size of numbers at ticks.
pub const TICK_SIZE: f64 = 17.0;
/// Font size of the names of axes.
pub const LABEL_SIZE: f64 = 19.0;
/// Distance of two lines of an axis name.
pub const LINE: f64 = 23.0;
/// Error bands reach this many standard errors to both sides.
pub const BAND_ERRORS: f64 = 2.0;

/// One axis of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelAxis {
    /// Places of numbers.
    pub scale: AxisScale,
    /// Ticks, labelled or not.
    pub ticks: Vec<Tick>,
    /// Name and unit; empty for none.
    pub label: String,
    /// True if the ticks' labels are drawn.
    pub numbered: bool,
}

impl PanelAxis {
    /// A linear axis with about `count` ticks. Fractions are numbered in per cent; a common power
    /// of ten moves into the label.
    pub fn linear(quantity: &Quantity, ends: [f64; 2], count: usize) -> Self {
        let scale = AxisScale::linear(ends);
        if quantity.unit().is_percentage() {
            let name = Quantity::new(quantity.name(), Unit::Relative).label();
            return Self::scaled(format!("{name} (%)"), scale, 0.01, count);
        }
        let power = common_power(ends[0].abs().max(ends[1].abs()));
        let label = with_power(quantity, power);
        Self::scaled(label, scale, 10f64.powi(power), count)
    }

    /// A logarithmic axis; over few decades a common power of ten moves into the label.
    pub fn log(quantity: &Quantity, low: f64, high: f64, count: usize) -> Self {
        let power =
            if (high / low).log10() < DECADES_WITH_FACTORS { common_power(high) } else { 0 };
        let label = with_power(quantity, power);
        Self::scaled(label, AxisScale::log([low, high]), 10f64.powi(power), count)
    }

    /// An axis numbered in multiples of `unit`.
    fn scaled(label: String, scale: AxisScale, unit: f64, count: usize) -> Self {
        let mut ticks = scale.divided(unit).ticks(count);
        for tick in &mut ticks {
            tick.at *= unit;
        }
        Self { scale, ticks, label, numbered: true }
    }

    /// The axis for a position: angles over at least half a right angle get ticks at multiples of
    /// 5°, 10°, 15° or 30°.
    pub fn position(quantity: &Quantity, low: f64, high: f64, count: usize) -> Self {
        if quantity.unit() == Unit::Degree && high - low >= 45.0 {
            let wanted = (high - low) / count as f64;
            let step = [5.0, 10.0, 15.0, 30.0, 45.0]
                .into_iter()
                .find(|&step| step >= wanted)
                .unwrap_or(90.0);
            Self {
                scale: AxisScale::linear([low, high]),
                ticks: every(low, high, step),
                label: quantity.label(),
                numbered: true,
            }
        } else {
            Self::linear(quantity, [low, high], count)
        }
    }

    /// A linear axis without ticks and name.
    pub fn blank(low: f64, high: f64) -> Self {
        Self {
            scale: AxisScale::linear([low, high]),
            ticks: Vec::new(),
            label: String::new(),
            numbered: false,
        }
    }

    /// The same axis without numbers and name, for a panel above another that has them.
    pub fn bare(mut self) -> Self {
        self.numbered = false;
        self.label.clear();
        self
    }
}

fn with_power(quantity: &Quantity, power: i32) -> String {
    if power == 0 {
        return quantity.label();
    }
    let symbol = quantity.unit().symbol();
    let name = Quantity::new(quantity.name(), Unit::Relative).label();
    let factor = power_of_ten(power);
    if symbol.is_empty() {
        format!("{name} ({factor})")
    } else {
        format!("{name} ({factor} {symbol})")
    }
}

/// A rectangle with two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Area of the data.
    pub area: Rect,
    /// Axis to the right.
    pub x: PanelAxis,
    /// Axis upwards.
    pub y: PanelAxis,
}

impl Panel {
    /// Pixel of a pair of numbers.
    pub fn at(&self, x: f64, y: f64) -> Point {
        [self.column(x), self.row(y)]
    }

    /// Pixels of a column at `x` and of a row at `y`, for one of them alone.
    fn column(&self, x: f64) -> f64 {
        self.area.left + self.x.scale.share(x) * self.area.width()
    }

    fn row(&self, y: f64) -> f64 {
        self.area.bottom - self.y.scale.share(y) * self.area.height()
    }

    /// Draws the grid, to be covered by data, and tells scripts where the axes lie.
    pub fn grid(&self, canvas: &mut Canvas) {
        let Rect { left, top, right, bottom } = self.area;
        let ends = |axis: &PanelAxis| {
            let ends = axis.scale.ends.map(|end| end.to_string()).join(" ");
            ends + if axis.scale.is_log { " log" } else { "" }
        };
        let area = format!("{left:.2} {top:.2} {right:.2} {bottom:.2}");
        let attributes =
            [("data-panel", area.as_str()), ("data-x", &ends(&self.x)), ("data-y", &ends(&self.y))];
        canvas.group(&attributes, |canvas| {
            for (faint, colour) in [(true, Colour::FAINT), (false, Colour::GRID)] {
                let pen = Pen::solid(colour, 1.0);
                let chosen = |tick: &&Tick| tick.label.is_none() == faint;
                let columns = self.x.ticks.iter().filter(chosen);
                let columns = columns.map(|tick| self.column(tick.at));
                let rows = self.y.ticks.iter().filter(chosen);
                let rows = rows.map(|tick| self.row(tick.at));
                let lines = columns
                    .map(|x| [[x, top], [x, bottom]])
                    .chain(rows.map(|y| [[left, y], [right, y]]));
                canvas.lines(&lines.collect::<Vec<_>>(), &pen);
            }
        });
    }

    /// Room that the numbers of the y axis take, for aligning the names of panels above each other.
    pub fn number_room(&self) -> f64 {
        let numbers = Letters::new(TICK_SIZE, Align::Right);
        let labels = self.y.ticks.iter().filter_map(|tick| tick.label.as_deref());
        labels.map(|label| numbers.width(label)).fold(0.0, f64::max)
    }

    /// Draws the border, ticks, numbers and names, over the data.
    pub fn frame(&self, canvas: &mut Canvas) {
        self.frame_with_room(canvas, self.number_room());
    }

    /// Draws the frame with so much room between the y axis and its name.
    pub fn frame_with_room(&self, canvas: &mut Canvas, room: f64) {
        let pen = Pen::solid(Colour::MUTED, 1.4);
        canvas.outline(&self.area.corners(), &pen);
        let Rect { left, bottom, .. } = self.area;
        let mut ticks = Vec::new();
        let numbers = Letters::new(TICK_SIZE, Align::Centre);
        for tick in &self.x.ticks {
            let x = self.column(tick.at);
            ticks.push([[x, bottom], [x, bottom + tick.length()]]);
            if let (Some(label), true) = (&tick.label, self.x.numbered) {
                canvas.text(label, [x, bottom + 22.0], &numbers);
            }
        }
        let numbers = Letters::new(TICK_SIZE, Align::Right);
        for tick in &self.y.ticks {
            let y = self.row(tick.at);
            ticks.push([[left - tick.length(), y], [left, y]]);
            if let (Some(label), true) = (&tick.label, self.y.numbered) {
                canvas.text(label, [left - 12.0, y], &numbers);
            }
        }
        canvas.lines(&ticks, &pen);
        let name = Letters::new(LABEL_SIZE, Align::Centre);
        let [x, y] = self.area.centre();
        for (line, words) in wrapped(&self.x.label, &name, self.area.width()).iter().enumerate() {
            canvas.text(words, [x, bottom + 52.0 + LINE * line as f64], &name);
        }
        canvas.text(&self.y.label, [left - 34.0 - room, y], &name.upwards());
    }

    /// Draws curves over their error bands.
    pub fn curves(&self, canvas: &mut Canvas, curves: &[Curve], pens: &[Pen]) {
        canvas.clipped(self.area, |canvas| {
            draw_curves(canvas, curves, pens, |x, y| self.held(x, y));
        });
    }

    /// A pixel that lies at most one height of the panel outside it, so that outlines stay finite.
    fn held(&self, x: f64, y: f64) -> Point {
        let [x, y] = self.at(x, y);
        let room = self.area.height();
        [x, y.clamp(self.area.top - room, self.area.bottom + room)]
    }
}

/// A name in one line, or in two where it is wider than the room.
fn wrapped<'a>(name: &'a str, letters: &Letters, room: f64) -> Vec<&'a str> {
    let breaks = name.match_indices(' ').map(|(at, _)| (&name[..at], &name[at + 1..]));
    let widest = |(a, b): &(&str, &str)| letters.width(a).max(letters.width(b));
    match breaks.min_by(|a, b| widest(a).total_cmp(&widest(b))) {
        Some((first, second)) if letters.width(name) > room => vec![first, second],
        _ => vec![name],
    }
}

/// Draws curves over their error bands, each point where `place` puts it.
pub fn draw_curves(
    canvas: &mut Canvas,
    curves: &[Curve],
    pens: &[Pen],
    place: impl Fn(f64, f64) -> Point,
) {
    let line = |curve: &Curve, errors: f64| -> Vec<Point> {
        let values = curve.value().iter().zip(curve.standard_error());
        let points = curve.x().iter().zip(values);
        points.map(|(&x, (v, e))| place(x, v + errors * e)).collect()
    };
    for (curve, pen) in curves.iter().zip(pens) {
        let mut band = line(curve, BAND_ERRORS);
        band.extend(line(curve, -BAND_ERRORS).into_iter().rev());
        canvas.group(&[(CURVE, curve.label())], |canvas| {
            canvas.polygon(&band, pen.colour.with_opacity(0.25));
        });
    }
    for (curve, pen) in curves.iter().zip(pens) {
        canvas.group(&[(CURVE, curve.label())], |canvas| {
            canvas.with_tooltip(curve.label(), |canvas| {
                canvas.polyline(&line(curve, 0.0), pen);
            });
        });
    }
}

/// Draws the colours of a scale right of a panel, with numbers and name; returns its place.
pub fn colour_bar(
    canvas: &mut Canvas,
    panel: &Panel,
    axis: &PanelAxis,
    tint: fn(f64) -> Colour,
) -> Rect {
    let beside = panel.area.right + 34.0;
    // Beside low panels there is room for numbers and name all the same.
    let bottom = panel.area.bottom.max(panel.area.top + MIN_BAR);
    let area = Rect::new(beside, panel.area.top, beside + 28.0, bottom);
    canvas.image(area, [1, COLOURS], true, |_, row| tint(1.0 - row as f64 / (COLOURS - 1) as f64));
    let pen = Pen::solid(Colour::MUTED, 1.4);
    canvas.outline(&area.corners(), &pen);
    let numbers = Letters::new(TICK_SIZE, Align::Left);
    let mut widest: f64 = 0.0;
    let mut ticks = Vec::new();
    for tick in &axis.ticks {
        let y = area.bottom - axis.scale.share(tick.at) * area.height();
        ticks.push([[area.right, y], [area.right + tick.length(), y]]);
        if let Some(label) = &tick.label {
            canvas.text(label, [area.right + 12.0, y], &numbers);
            widest = widest.max(numbers.width(label));
        }
    }
    canvas.lines(&ticks, &pen);
    let name = Letters::new(LABEL_SIZE, Align::Centre).upwards();
    let x = area.right + 12.0 + widest + 22.0;
    canvas.text(&axis.label, [x, area.centre()[1]], &name);
    area
}

/// Smallest height of a colour bar, pixels.
const MIN_BAR: f64 = 230.0;

/// Colours of a colour bar.
const COLOURS: usize = 256;

/// Kind of a marked point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// A maximum: a triangle from above, its label above.
    Peak,
    /// A minimum: a triangle from below, its label below.
    Valley,
}

/// A marked point.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Peak or valley.
    pub kind: MarkKind,
    /// Numbers along both axes.
    pub at: [f64; 2],
    /// Short text: `valley 25.10 ± 0.30 %`.
    pub label: String,
}

impl Mark {
    /// A peak.
    pub fn peak(at: [f64; 2]) -> Self {
        Self { kind: MarkKind::Peak, at, label: "peak".to_owned() }
    }

    /// A valley with its share of the peak.
    pub fn valley(at: [f64; 2], share: &FigureEntry) -> Self {
        let label =
            format!("valley {}", shown::text(&share.in_range(Unit::Fraction), Unit::Fraction));
        Self { kind: MarkKind::Valley, at, label }
    }
}

/// Draws marks, whose labels stay within the panel, off `kept_free` and off each other.
pub fn draw_marks(canvas: &mut Canvas, panel: &Panel, marks: &[Mark], kept_free: &[Rect]) {
    let mut taken = kept_free.to_vec();
    for mark in marks {
        let [x, y] = panel.at(mark.at[0], mark.at[1]);
        let up = match mark.kind {
            MarkKind::Peak => -1.0,
            MarkKind::Valley => 1.0,
        };
        let (tip, base) = (y + up * 3.0, y + up * 15.0);
        let triangle = [[x, tip], [x - 8.0, base], [x + 8.0, base]];
        canvas.polygon(&triangle, Colour::WHITE);
        canvas.outline(&triangle, &Pen::solid(Colour::BLACK, 1.2));
        let letters = Letters::new(TICK_SIZE, Align::Centre);
        let place = label_place([x, y + up * 9.0], up, letters.width(&mark.label), panel, &taken);
        canvas.text_with_rim(&mark.label, place.centre(), &letters);
        taken.push(place);
    }
}

/// Distances of a label from its mark that are tried, pixels.
const STEPS: usize = 12;
const STEP: f64 = 10.0;

/// The nearest place for a label of this width about a mark that overlaps the least of `taken`: on
/// its own side first, then on the other, right and left.
fn label_place([x, y]: Point, up: f64, width: f64, panel: &Panel, taken: &[Rect]) -> Rect {
    let half = [0.5 * width + 8.0, 0.5 * TICK_SIZE + 2.0];
    let Rect { left, top, right, bottom } = panel.area;
    let held = |at: f64, half: f64, low: f64, high: f64| {
        at.clamp(low + half, (high - half).max(low + half))
    };
    let at = |[dx, dy]: [f64; 2]| {
        let x = held(x + dx, half[0], left, right);
        let y = held(y + dy, half[1], top, bottom);
        Rect::new(x - half[0], y - half[1], x + half[0], y + half[1])
    };
    let overlap = |a: &Rect| {
        let of = |b: &Rect| {
            let across = a.right.min(b.right) - a.left.max(b.left);
            let down = a.bottom.min(b.bottom) - a.top.max(b.top);
            across.max(0.0) * down.max(0.0)
        };
        taken.iter().map(of).sum::<f64>()
    };
    let places = (0..STEPS).flat_map(|step| {
        let more = STEP * step as f64;
        let (down, across) = (20.0 + more, half[0] + 6.0 + more);
        [[0.0, up * down], [0.0, -up * down], [across, 0.0], [-across, 0.0]].map(at)
    });
    let mut best = at([0.0, up * 20.0]);
    for place in places {
        if overlap(&place) < overlap(&best) {
            best = place;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use metrics::Estimate;

    use super::*;

    fn panel() -> Panel {
        let x = Quantity::new("x", Unit::Millimetre);
        let y = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        Panel {
            area: Rect::new(100.0, 50.0, 300.0, 250.0),
            x: PanelAxis::linear(&x, [-1.0, 1.0], 4),
            y: PanelAxis::log(&y, 0.01, 1.0, 4),
        }
    }

    #[test]
    fn numbers_have_their_pixels() {
        let panel = panel();
        let [x, y] = panel.at(0.0, 0.1);
        assert!((x - 200.0).abs() < 1e-9 && (y - 150.0).abs() < 1e-9);
        let [x, y] = panel.at(0.5, 0.01);
        assert!((x - 250.0).abs() < 1e-9 && (y - 250.0).abs() < 1e-9);
    }

    #[test]
    fn small_numbers_move_their_power_into_the_label() {
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let axis = PanelAxis::linear(&quantity, [0.0, 4.1e-3], 5);
        assert_eq!(axis.label, "Illuminance (10⁻³ W/mm²)");
        assert_eq!(axis.ticks[1].label.as_deref(), Some("1"));
        assert!((axis.ticks[1].at - 1e-3).abs() < 1e-15);
    }

    #[test]
    fn fractions_are_numbered_in_per_cent() {
        let share = Quantity::new("share of power", Unit::Fraction);
        let axis = PanelAxis::linear(&share, [0.0, 0.05], 5);
        assert_eq!(axis.label, "Share of power (%)");
        assert_eq!(axis.ticks[2].label.as_deref(), Some("2"));
        assert!((axis.ticks[2].at - 0.02).abs() < 1e-15);
    }

    #[test]
    fn angles_get_ticks_at_their_usual_steps() {
        let theta = Quantity::new("θ", Unit::Degree);
        let steps = |low, high, count| {
            let ticks = PanelAxis::position(&theta, low, high, count).ticks;
            ticks[1].at - ticks[0].at
        };
        assert!((steps(-90.0, 90.0, 12) - 15.0).abs() < 1e-12);
        assert!((steps(-90.0, 90.0, 6) - 30.0).abs() < 1e-12);
        assert!((steps(0.0, 90.0, 9) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn a_valley_that_is_not_resolved_is_a_range() {
        let label = |share| Mark::valley([0.0; 2], &FigureEntry::new(share)).label;
        assert_eq!(label(Estimate::new(0.251, 0.003)), "valley 25.10 ± 0.30 %");
        assert_eq!(label(Estimate::between(0.9, 0.98, 0.01)), "valley 84 to 100 %");
    }

    #[test]
    fn labels_of_marks_keep_off_what_is_there() {
        let panel = panel();
        let led = Rect::new(180.0, 130.0, 220.0, 170.0);
        for up in [-1.0, 1.0] {
            let place = label_place([200.0, 150.0], up, 60.0, &panel, &[led]);
            assert!(place.bottom <= led.top || place.top >= led.bottom, "{place:?}");
            assert!(place.left >= panel.area.left && place.right <= panel.area.right);
            // A second one keeps off the first.
            let second = label_place([200.0, 150.0], up, 60.0, &panel, &[led, place]);
            assert!(second.bottom <= place.top || second.top >= place.bottom, "{second:?}");
        }
    }

    #[test]
    fn long_names_of_axes_take_two_lines() {
        let letters = Letters::new(LABEL_SIZE, Align::Centre);
        let name = "Illuminance valley / peak (%)";
        assert_eq!(wrapped(name, &letters, 1000.0), [name]);
        assert_eq!(wrapped(name, &letters, 150.0), ["Illuminance", "valley / peak (%)"]);
    }
}
