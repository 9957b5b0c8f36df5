// SPDX-License-Identifier: MIT OR Apache-2.0
//! Far fields: intensity over the polar angle, as a polar diagram, over a straight axis, and both
//! for single elements.

use anyhow::{Result, ensure};

use metrics::quantity::{Curve, Quantity, Unit};

use super::Heading;
use super::draw::canvas::{Align, Canvas, Letters, Pen, Picture, Point, Rect};
use super::draw::colour::Colour;
use super::draw::line_colours::LineColours;
use super::draw::panel::{BAND_ERRORS, LABEL_SIZE, Panel, PanelAxis, TICK_SIZE, draw_curves};
use super::draw::sheet::{CURVE, HEIGHT, Sheet, WIDTH, curve_legend, curve_pens};

/// Intensity curves over the polar angle θ in degrees. Negative angles are the half-plane opposite
/// to the positive ones; [`Curve::mirrored`] makes both from an azimuthal mean.
#[derive(Clone, Copy, Debug)]
pub struct FarField<'a> {
    /// Title, design and model.
    pub heading: &'a Heading,
    /// Quantity of the curves: `intensity` in W/sr, or relative.
    pub quantity: &'a Quantity,
    /// Curves with positions within -90°..90°.
    pub curves: &'a [Curve],
    /// Colours of the curves.
    pub colours: LineColours,
    /// Numbers of the curves' colours where these are not to follow each other; may be empty.
    pub numbers: &'a [usize],
    /// Angles marked above the axes, each with the curve that it belongs to.
    pub peaks: &'a [(usize, f64)],
}

impl FarField<'_> {
    fn check(&self, last_deg: f64) -> Result<()> {
        ensure!(!self.curves.is_empty(), "a far field needs at least one curve");
        for curve in self.curves {
            ensure!(
                curve.x().iter().all(|x| x.abs() <= last_deg),
                "far field `{}`: expected angles within -{last_deg}°..{last_deg}°",
                curve.label()
            );
        }
        Ok(())
    }

    fn pens(&self) -> Vec<Pen> {
        curve_pens(self.colours, self.curves.len(), self.numbers)
    }

    fn sheet(&self, width: u32, height: u32) -> Sheet {
        let legend = curve_legend(self.curves, &self.pens());
        Sheet::new(width, height, self.heading, &legend)
    }

    /// Largest value that is more than noise, with its band.
    fn top(&self) -> f64 {
        let tops = self.curves.iter().map(|curve| {
            let certain = certain_peak(curve);
            let points = curve.value().iter().zip(curve.standard_error());
            let banded = points.map(|(v, e)| v + BAND_ERRORS * e);
            // A bin with few paths, such as that about the axis, may leave the picture.
            banded.filter(|v| *v <= NOISY * certain).fold(certain, f64::max)
        });
        let top = tops.fold(0.0, f64::max);
        if top > 0.0 { top } else { 1.0 }
    }

    /// First and last angle to show: both half-planes unless no curve has negative angles, the
    /// lower half-space only where a curve reaches it.
    fn angles(&self) -> [f64; 2] {
        let one_sided = self.curves.iter().all(|c| c.x()[0] >= 0.0);
        let beyond = self.curves.iter().any(|c| c.x()[c.x().len() - 1] > 90.0);
        let last = if beyond { 180.0 } else { 90.0 };
        [if one_sided { 0.0 } else { -last }, last]
    }
}

/// Values and bands beyond this multiple of the certain peak are left to noise.
const NOISY: f64 = 1.3;

/// The value that stands out most from its noise: that of the largest lower end of a band. The bin
/// about the axis holds few paths, and the largest value may be its noise.
fn certain_peak(curve: &Curve) -> f64 {
    let low = |(v, e): &(&f64, &f64)| **v - BAND_ERRORS * **e;
    let points = curve.value().iter().zip(curve.standard_error());
    // A bin that no path reached has no error, and says nothing.
    let certain = points.filter(|point| low(point) > 0.0);
    let best = certain.max_by(|a, b| low(a).total_cmp(&low(b)));
    best.map_or_else(|| curve.maximum(), |(value, _)| *value)
}

/// Intensity over θ on straight axes, with error bands.
///
/// # Errors
/// No curves, or angles outside -180°..180°.
pub fn far_field_cartesian(far_field: &FarField) -> Result<Picture> {
    far_field.check(180.0)?;
    let mut sheet = far_field.sheet(WIDTH, HEIGHT);
    let area = sheet.body.inset(75.0, 12.0, 10.0, 65.0);
    draw_cartesian(&mut sheet.canvas, area, far_field, 12);
    Ok(sheet.canvas.finish())
}

/// Intensity as radius over θ as angle from the vertical axis, with error bands.
///
/// # Errors
/// No curves, or angles outside -90°..90°.
pub fn far_field_polar(far_field: &FarField) -> Result<Picture> {
    far_field.check(90.0)?;
    let mut sheet = far_field.sheet(WIDTH, 820);
    let body = sheet.body;
    draw_polar(&mut sheet.canvas, body, far_field);
    Ok(sheet.canvas.finish())
}

/// Far fields of single elements (figures 3 and 4 of the paper): left as they are over θ, right
/// each divided by the value that stands out most from its noise as a polar diagram, so that both
/// the power and the direction of each element can be read.
///
/// # Errors
/// No curves, angles outside -90°..90°, or a range that cannot be drawn. A dark curve is left as it
/// is.
pub fn element_far_fields(far_field: &FarField) -> Result<Picture> {
    far_field.check(90.0)?;
    let relative: Vec<Curve> = far_field
        .curves
        .iter()
        .map(|curve| match certain_peak(curve) {
            peak if peak > 0.0 => curve.relative_to(peak),
            _ => Ok(curve.clone()),
        })
        .collect::<Result<_>>()?;
    let name = format!("{} relative to each peak", far_field.quantity.name());
    let normalised = FarField {
        quantity: &Quantity::new(name, Unit::Relative),
        curves: &relative,
        ..*far_field
    };
    let mut sheet = far_field.sheet(1600, 860);
    let middle = sheet.body.centre()[0];
    let (mut left, mut right) = (sheet.body, sheet.body);
    (left.right, right.left) = (middle - 30.0, middle);
    let left = left.inset(75.0, 5.0, 0.0, 65.0);
    draw_cartesian(&mut sheet.canvas, left, far_field, 7);
    draw_polar(&mut sheet.canvas, right, &normalised);
    Ok(sheet.canvas.finish())
}

fn draw_cartesian(canvas: &mut Canvas, area: Rect, far_field: &FarField, count: usize) {
    let [low, high] = far_field.angles();
    let theta = Quantity::new("polar angle θ", Unit::Degree);
    let panel = Panel {
        area,
        x: PanelAxis::position(&theta, low, high, count),
        y: PanelAxis::linear(far_field.quantity, [0.0, far_field.top() * 1.06], 7),
    };
    panel.grid(canvas);
    let pens = far_field.pens();
    panel.curves(canvas, far_field.curves, &pens);
    panel.frame(canvas);
    for &(curve, angle) in far_field.peaks {
        let [x, y] = [panel.at(angle, 0.0)[0], area.top];
        let words = format!("{}: published peak at {angle}°", far_field.curves[curve].label());
        canvas.group(&[(CURVE, far_field.curves[curve].label())], |canvas| {
            canvas.with_tooltip(&words, |canvas| {
                let triangle = [[x - 7.0, y - 12.0], [x + 7.0, y - 12.0], [x, y - 1.0]];
                canvas.polygon(&triangle, pens[curve].colour);
            });
        });
    }
}

/// A half disc over its horizontal axis; directions are angles from the vertical.
struct HalfDisc {
    centre: Point,
    radius: f64,
    top: f64,
}

impl HalfDisc {
    fn at(&self, angle_deg: f64, value: f64) -> Point {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let radius = self.radius * (value / self.top).max(0.0);
        [self.centre[0] + radius * sin, self.centre[1] - radius * cos]
    }

    fn arc(&self, value: f64) -> Vec<Point> {
        // Steps of 3° stay within a third of a pixel of the circle.
        (-30..=30).map(|step| self.at(3.0 * f64::from(step), value)).collect()
    }
}

fn draw_polar(canvas: &mut Canvas, room: Rect, far_field: &FarField) {
    let top = far_field.top() * 1.03;
    let axis = PanelAxis::linear(far_field.quantity, [0.0, top], 7);
    let (below, around) = (80.0, 42.0);
    let radius = (room.width() / 2.0 - around - 12.0).min(room.height() - below - around);
    let spare = room.height() - below - around - radius;
    let disc =
        HalfDisc { centre: [room.centre()[0], room.bottom - below - spare / 2.0], radius, top };

    let grid = Pen::solid(Colour::GRID, 1.0);
    for tick in &axis.ticks {
        canvas.polyline(&disc.arc(tick.at), &grid);
    }
    for step in -5..=5 {
        let deg = f64::from(step) * 15.0;
        canvas.line(disc.centre, disc.at(deg, top), &grid);
    }
    // Nothing below the axis, where θ ends, nor beyond the rim.
    let rim = disc.arc(top);
    canvas.clipped_to(&rim, |canvas| {
        draw_curves(canvas, far_field.curves, &far_field.pens(), |x, y| disc.at(x, y));
    });

    let border = Pen::solid(Colour::MUTED, 1.4);
    canvas.polyline(&disc.arc(top), &border);
    canvas.line(disc.at(-90.0, top), disc.at(90.0, top), &border);
    let numbers = Letters::new(TICK_SIZE, Align::Centre);
    for step in -6..=6 {
        let deg = f64::from(step) * 15.0;
        let [x, y] = disc.at(deg, top * (1.0 + 26.0 / radius));
        let label =
            if step < 0 { format!("−{}°", -15 * step) } else { format!("{}°", 15 * step) };
        let shift = 4.0 * f64::from(step) / 6.0;
        canvas.text(&label, [x + shift, y], &numbers);
    }
    for tick in &axis.ticks {
        let label = tick.label.as_deref().unwrap_or_default();
        for side in [-90.0, 90.0] {
            let [x, y] = disc.at(side, tick.at);
            canvas.line([x, y], [x, y + 7.0], &border);
            // The zero of both sides is one place.
            if side > 0.0 || tick.at > 0.0 {
                canvas.text(label, [x, y + 22.0], &numbers);
            }
        }
    }
    let name = Letters::new(LABEL_SIZE, Align::Centre);
    let place = [disc.centre[0], disc.centre[1] + 54.0];
    let label = format!("{} over polar angle θ (°)", axis.label);
    canvas.text(&label, place, &name);
}

#[cfg(test)]
mod tests {
    use super::super::draw::canvas::tests::decode;
    use super::*;

    fn curve(low: f64, high: f64) -> Curve {
        let x: Vec<f64> = (0..=60).map(|i| low + (high - low) * f64::from(i) / 60.0).collect();
        let value: Vec<f64> = x.iter().map(|x| x.to_radians().cos().max(0.0)).collect();
        Curve::new("cosine", x, value, vec![0.02; 61]).unwrap()
    }

    fn with<T>(curves: &[Curve], draw: impl Fn(&FarField) -> T) -> T {
        let heading = Heading::new("Far field", "D1");
        let quantity = Quantity::new("intensity", Unit::WattPerSteradian);
        draw(&FarField {
            heading: &heading,
            quantity: &quantity,
            curves,
            colours: LineColours::Models,
            numbers: &[],
            peaks: &[(0, 20.0)],
        })
    }

    #[test]
    fn angles_beyond_the_upper_hemisphere_are_refused() {
        for draw in [far_field_cartesian, far_field_polar, element_far_fields] {
            assert!(with(&[curve(-90.0, 90.0)], draw).is_ok());
            assert!(with(&[curve(0.0, 190.0)], draw).is_err());
            assert!(with(&[], draw).is_err());
        }
        for draw in [far_field_polar, element_far_fields] {
            assert!(with(&[curve(0.0, 100.0)], draw).is_err());
        }
        with(&[curve(0.0, 180.0)], |field| {
            let [low, high] = field.angles();
            assert!((high - 180.0).abs() < 1e-12 && low.abs() < 1e-12);
        });
    }

    #[test]
    fn a_noisy_bin_on_the_axis_sets_no_scale() {
        let x: Vec<f64> = (0..=18).map(|i| 5.0 * f64::from(i)).collect();
        let mut value = vec![0.5; 19];
        let mut error = vec![0.01; 19];
        (value[0], error[0], value[4]) = (3.0, 1.5, 1.0);
        let curve = Curve::new("S1", x, value, std::mem::take(&mut error)).unwrap();
        assert!((certain_peak(&curve) - 1.0).abs() < 1e-12);
        with(&[curve], |field| {
            assert!((field.top() - 1.02).abs() < 1e-12, "{}", field.top());
            assert!(element_far_fields(field).is_ok());
        });
    }

    #[test]
    fn the_same_curves_give_the_same_bytes() {
        let curves = [curve(-90.0, 90.0), curve(0.0, 80.0)];
        let draw = || with(&curves, |f| far_field_polar(f).unwrap());
        assert!(draw() == draw());
    }

    #[test]
    fn a_symmetric_curve_gives_a_symmetric_polar_picture() {
        let picture = decode(&with(&[curve(-90.0, 90.0)], far_field_polar).unwrap());
        let blue = LineColours::Models.pick(0, 1).rgb;
        let (mut left, mut right) = (0u32, 0u32);
        for y in 140..picture.height() {
            for x in 0..picture.width() {
                let p = picture.pixel(x, y).unwrap();
                if [p.red(), p.green(), p.blue()] == blue {
                    if x < picture.width() / 2 {
                        left += 1;
                    } else {
                        right += 1;
                    }
                }
            }
        }
        assert!(
            left > 500 && (f64::from(left) / f64::from(right) - 1.0).abs() < 0.02,
            "{left} {right}"
        );
    }

    #[test]
    fn half_disc_puts_zero_on_top_and_positive_angles_right() {
        let disc = HalfDisc { centre: [100.0, 100.0], radius: 50.0, top: 2.0 };
        let close = |a: Point, b: Point| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
        assert!(close(disc.at(0.0, 2.0), [100.0, 50.0]));
        assert!(close(disc.at(90.0, 1.0), [125.0, 100.0]));
        assert!(close(disc.at(-90.0, 1.0), [75.0, 100.0]));
    }
}
