// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cartesian axes: where numbers lie in a rectangle, its grid, ticks and labels, and curves with their error bands.

use super::canvas::{Align, Canvas, Letters, Pen, Point, Rect};
use super::colour::{Colour, glow};
use super::scale::{DECADES_WITH_FACTORS, Scale, Tick, common_power, every, power_of_ten};
use crate::quantity::{Curve, Quantity, Unit};

/// Font size of numbers at ticks.
pub const TICK_SIZE: f64 = 17.0;
/// Font size of the names of axes.
pub const LABEL_SIZE: f64 = 19.0;
/// Error bands reach this many standard errors to both sides.
pub const BAND_ERRORS: f64 = 2.0;

/// One axis of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelAxis {
    /// Where numbers lie.
    pub scale: Scale,
    /// Ticks, labelled or not.
    pub ticks: Vec<Tick>,
    /// Name and unit; empty for none.
    pub label: String,
    /// Whether the ticks' labels are drawn.
    pub numbered: bool,
}

impl PanelAxis {
    /// A linear axis with about `count` ticks. Fractions are numbered in per cent; a common power of ten moves into the label.
    pub fn linear(quantity: &Quantity, scale: Scale, count: usize) -> Self {
        if quantity.unit() == Unit::Fraction {
            let name = Quantity::new(quantity.name(), Unit::Relative).label();
            return Self::scaled(format!("{name} (%)"), scale, 0.01, count);
        }
        let [low, high] = scale.ends();
        let power = common_power(low.abs().max(high.abs()));
        let label = with_power(quantity, power);
        Self::scaled(label, scale, 10f64.powi(power), count)
    }

    /// A logarithmic axis; over few decades a common power of ten moves into the label.
    pub fn log(quantity: &Quantity, low: f64, high: f64, count: usize) -> Self {
        let power = if (high / low).log10() < DECADES_WITH_FACTORS {
            common_power(high)
        } else {
            0
        };
        let label = with_power(quantity, power);
        Self::scaled(label, Scale::Log { low, high }, 10f64.powi(power), count)
    }

    /// An axis numbered in multiples of `unit`.
    fn scaled(label: String, scale: Scale, unit: f64, count: usize) -> Self {
        let mut ticks = scale.divided(unit).ticks(count);
        for tick in &mut ticks {
            tick.at *= unit;
        }
        Self {
            scale,
            ticks,
            label,
            numbered: true,
        }
    }

    /// An axis of angles in degrees with a tick every `step`.
    pub fn angle(quantity: &Quantity, low: f64, high: f64, step: f64) -> Self {
        Self {
            scale: Scale::Linear { low, high },
            ticks: every(low, high, step),
            label: quantity.label(),
            numbered: true,
        }
    }

    /// The axis for a position: angles over at least half a right angle get ticks at multiples of 5°, 10°, 15° or 30°.
    pub fn position(quantity: &Quantity, low: f64, high: f64, count: usize) -> Self {
        if quantity.unit() == Unit::Degree && high - low >= 45.0 {
            let wanted = (high - low) / count as f64;
            let step = [5.0, 10.0, 15.0, 30.0, 45.0]
                .into_iter()
                .find(|&step| step >= wanted)
                .unwrap_or(90.0);
            Self::angle(quantity, low, high, step)
        } else {
            Self::linear(quantity, Scale::Linear { low, high }, count)
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
    /// Where the data lie.
    pub area: Rect,
    /// Axis to the right.
    pub x: PanelAxis,
    /// Axis upwards.
    pub y: PanelAxis,
}

impl Panel {
    /// Pixel of a pair of numbers.
    pub fn at(&self, x: f64, y: f64) -> Point {
        [
            self.area.left + self.x.scale.share(x) * self.area.width(),
            self.area.bottom - self.y.scale.share(y) * self.area.height(),
        ]
    }

    /// Numbers at a pixel.
    pub fn numbers(&self, [x, y]: Point) -> [f64; 2] {
        [
            self.x
                .scale
                .number((x - self.area.left) / self.area.width()),
            self.y
                .scale
                .number((self.area.bottom - y) / self.area.height()),
        ]
    }

    /// Draws the grid, to be covered by data.
    pub fn grid(&self, canvas: &mut Canvas) {
        let pen = |tick: &Tick| {
            Pen::solid(
                if tick.label.is_some() {
                    Colour::GRID
                } else {
                    Colour::FAINT
                },
                1.0,
            )
        };
        for faint in [true, false] {
            for tick in self.x.ticks.iter().filter(|t| t.label.is_none() == faint) {
                let x = self.at(tick.at, 1.0)[0];
                canvas.line([x, self.area.top], [x, self.area.bottom], &pen(tick));
            }
            for tick in self.y.ticks.iter().filter(|t| t.label.is_none() == faint) {
                let y = self.area.bottom - self.y.scale.share(tick.at) * self.area.height();
                canvas.line([self.area.left, y], [self.area.right, y], &pen(tick));
            }
        }
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
        let numbers = Letters::new(TICK_SIZE, Align::Centre);
        for tick in &self.x.ticks {
            let x = self.area.left + self.x.scale.share(tick.at) * self.area.width();
            let length = if tick.label.is_some() { 7.0 } else { 4.0 };
            canvas.line([x, self.area.bottom], [x, self.area.bottom + length], &pen);
            if let (Some(label), true) = (&tick.label, self.x.numbered) {
                canvas.text(label, [x, self.area.bottom + 22.0], &numbers);
            }
        }
        let numbers = Letters::new(TICK_SIZE, Align::Right);
        for tick in &self.y.ticks {
            let y = self.area.bottom - self.y.scale.share(tick.at) * self.area.height();
            let length = if tick.label.is_some() { 7.0 } else { 4.0 };
            canvas.line([self.area.left - length, y], [self.area.left, y], &pen);
            if let (Some(label), true) = (&tick.label, self.y.numbered) {
                canvas.text(label, [self.area.left - 12.0, y], &numbers);
            }
        }
        let name = Letters::new(LABEL_SIZE, Align::Centre);
        let [x, y] = self.area.centre();
        canvas.text(&self.x.label, [x, self.area.bottom + 52.0], &name);
        let left = self.area.left - 12.0 - room - 22.0;
        canvas.text(&self.y.label, [left, y], &name.upwards());
    }

    /// Draws the error band of a curve.
    pub fn band(&self, canvas: &mut Canvas, curve: &Curve, colour: Colour) {
        let edge = |sign: f64| {
            let values = curve.value().iter().zip(curve.standard_error());
            let points = curve.x().iter().zip(values);
            points
                .map(|(&x, (v, e))| self.held(x, v + sign * BAND_ERRORS * e))
                .collect::<Vec<_>>()
        };
        let mut outline = edge(1.0);
        outline.extend(edge(-1.0).into_iter().rev());
        canvas.clipped(self.area, |canvas| {
            canvas.polygon(&outline, colour.with_opacity(0.25));
        });
    }

    /// Draws a curve.
    pub fn curve(&self, canvas: &mut Canvas, curve: &Curve, pen: &Pen) {
        let points: Vec<Point> = curve
            .x()
            .iter()
            .zip(curve.value())
            .map(|(&x, &y)| self.held(x, y))
            .collect();
        canvas.clipped(self.area, |canvas| canvas.polyline(&points, pen));
    }

    /// A pixel that lies at most one height of the panel outside it, so that outlines stay finite.
    fn held(&self, x: f64, y: f64) -> Point {
        let [x, y] = self.at(x, y);
        let room = self.area.height();
        [x, y.clamp(self.area.top - room, self.area.bottom + room)]
    }
}

/// Draws an upright colour bar with numbers at its right and its name beside them.
pub fn colour_bar(canvas: &mut Canvas, area: Rect, axis: &PanelAxis) {
    canvas.paint(area, |[_, y]| Some(glow((area.bottom - y) / area.height())));
    let pen = Pen::solid(Colour::MUTED, 1.4);
    canvas.outline(&area.corners(), &pen);
    let numbers = Letters::new(TICK_SIZE, Align::Left);
    let mut widest: f64 = 0.0;
    for tick in &axis.ticks {
        let y = area.bottom - axis.scale.share(tick.at) * area.height();
        let length = if tick.label.is_some() { 7.0 } else { 4.0 };
        canvas.line([area.right, y], [area.right + length, y], &pen);
        if let Some(label) = &tick.label {
            canvas.text(label, [area.right + 12.0, y], &numbers);
            widest = widest.max(numbers.width(label));
        }
    }
    let name = Letters::new(LABEL_SIZE, Align::Centre).upwards();
    let x = area.right + 12.0 + widest + 22.0;
    canvas.text(&axis.label, [x, area.centre()[1]], &name);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel() -> Panel {
        let x = Quantity::new("x", Unit::Millimetre);
        let y = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        Panel {
            area: Rect::new(100.0, 50.0, 300.0, 250.0),
            x: PanelAxis::linear(
                &x,
                Scale::Linear {
                    low: -1.0,
                    high: 1.0,
                },
                4,
            ),
            y: PanelAxis::log(&y, 0.01, 1.0, 4),
        }
    }

    #[test]
    fn pixels_and_numbers_are_inverse() {
        let panel = panel();
        let [x, y] = panel.at(0.0, 0.1);
        assert!((x - 200.0).abs() < 1e-9 && (y - 150.0).abs() < 1e-9);
        let [x, y] = panel.numbers([250.0, 250.0]);
        assert!((x - 0.5).abs() < 1e-12 && (y - 0.01).abs() < 1e-12);
    }

    #[test]
    fn small_numbers_move_their_power_into_the_label() {
        let quantity = Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let scale = Scale::Linear {
            low: 0.0,
            high: 4.1e-3,
        };
        let axis = PanelAxis::linear(&quantity, scale, 5);
        assert_eq!(axis.label, "Illuminance (10⁻³ W/mm²)");
        assert_eq!(axis.ticks[1].label.as_deref(), Some("1"));
        assert!((axis.ticks[1].at - 1e-3).abs() < 1e-15);
    }

    #[test]
    fn fractions_are_numbered_in_per_cent() {
        let share = Quantity::new("share of power", Unit::Fraction);
        let scale = Scale::Linear {
            low: 0.0,
            high: 0.05,
        };
        let axis = PanelAxis::linear(&share, scale, 5);
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
}
