// SPDX-License-Identifier: MIT OR Apache-2.0
//! A canvas of pixels with lines, areas and letters, drawn at twice the size and averaged down for smooth edges.

use anyhow::{Context, Result};
use tiny_skia::{
    FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8,
    Stroke, StrokeDash, Transform,
};

use super::colour::Colour;
use super::font::{self, CAPITAL_HEIGHT, Weight};

/// A point in pixels: x to the right, y downwards.
pub type Point = [f64; 2];

/// Pixels drawn along x and y for one pixel of the picture.
const FINE: u32 = 2;

/// An upright rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Left edge.
    pub left: f64,
    /// Upper edge.
    pub top: f64,
    /// Right edge.
    pub right: f64,
    /// Lower edge.
    pub bottom: f64,
}

impl Rect {
    /// A rectangle from its edges.
    pub const fn new(left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self {
            left,
            top,
            right,
            bottom,
        }
    }

    /// Horizontal extent.
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    /// Vertical extent.
    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// Middle.
    pub fn centre(&self) -> Point {
        [
            f64::midpoint(self.left, self.right),
            f64::midpoint(self.top, self.bottom),
        ]
    }

    /// The rectangle with its edges moved inwards: left, top, right, bottom.
    pub fn inset(&self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self::new(
            self.left + left,
            self.top + top,
            self.right - right,
            self.bottom - bottom,
        )
    }

    /// Corners in order, for a polygon.
    pub fn corners(&self) -> [Point; 4] {
        [
            [self.left, self.top],
            [self.right, self.top],
            [self.right, self.bottom],
            [self.left, self.bottom],
        ]
    }
}

/// Kind of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Colour of the line.
    pub colour: Colour,
    /// Width in pixels.
    pub width: f64,
    /// Lengths of strokes and gaps in pixels; empty for a solid line.
    pub dash: &'static [f32],
}

impl Pen {
    /// A solid line.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            dash: &[],
        }
    }

    /// A dashed line.
    pub const fn dashed(colour: Colour, width: f64, dash: &'static [f32]) -> Self {
        Self {
            colour,
            width,
            dash,
        }
    }
}

/// Which point of the text is at the given place, horizontally.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Its left end.
    Left,
    /// Its middle.
    Centre,
    /// Its right end.
    Right,
}

/// Look of a text. It is centred vertically on its capital letters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Letters {
    /// Font size in pixels.
    pub size: f64,
    /// Weight.
    pub weight: Weight,
    /// Colour.
    pub colour: Colour,
    /// Horizontal alignment.
    pub align: Align,
    /// Rotation in degrees, clockwise on the picture.
    pub turn_deg: f64,
}

impl Letters {
    /// Regular letters.
    pub const fn new(size: f64, align: Align) -> Self {
        Self {
            size,
            weight: Weight::Regular,
            colour: Colour::TEXT,
            align,
            turn_deg: 0.0,
        }
    }

    /// The same in another colour.
    pub const fn coloured(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }

    /// The same in bold.
    pub const fn bold(self) -> Self {
        Self {
            weight: Weight::Bold,
            ..self
        }
    }

    /// The same, turned to read upwards.
    pub const fn upwards(self) -> Self {
        Self {
            turn_deg: -90.0,
            ..self
        }
    }

    /// Width of `text` in pixels.
    pub fn width(&self, text: &str) -> f64 {
        font::width(text, self.size, self.weight)
    }
}

/// A picture being drawn.
pub struct Canvas {
    pixels: Pixmap,
    clip: Option<Mask>,
    size: [u32; 2],
}

impl Canvas {
    /// A white canvas of so many pixels.
    ///
    /// # Errors
    /// A size of zero, or too large for the memory.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        let mut pixels = Pixmap::new(width * FINE, height * FINE)
            .with_context(|| format!("cannot draw a picture of {width} x {height} pixels"))?;
        pixels.fill(tiny_skia::Color::WHITE);
        Ok(Self {
            pixels,
            clip: None,
            size: [width, height],
        })
    }

    /// The whole canvas.
    pub fn area(&self) -> Rect {
        Rect::new(0.0, 0.0, f64::from(self.size[0]), f64::from(self.size[1]))
    }

    /// Draws through `draw` within `area` only.
    pub fn clipped(&mut self, area: Rect, draw: impl FnOnce(&mut Self)) {
        self.clipped_to(&area.corners(), draw);
    }

    /// Draws through `draw` within a polygon only.
    pub fn clipped_to(&mut self, outline: &[Point], draw: impl FnOnce(&mut Self)) {
        let outer = self.clip.take();
        self.clip = Mask::new(self.pixels.width(), self.pixels.height());
        if let (Some(mask), Some(path)) = (&mut self.clip, path(outline, true)) {
            mask.fill_path(&path, FillRule::Winding, true, enlarge());
        }
        draw(self);
        self.clip = outer;
    }

    /// A straight line.
    pub fn line(&mut self, from: Point, to: Point, pen: &Pen) {
        self.polyline(&[from, to], pen);
    }

    /// A line through points.
    pub fn polyline(&mut self, points: &[Point], pen: &Pen) {
        if let Some(path) = path(points, false) {
            self.stroke(&path, pen);
        }
    }

    /// The outline of a polygon.
    pub fn outline(&mut self, points: &[Point], pen: &Pen) {
        if let Some(path) = path(points, true) {
            self.stroke(&path, pen);
        }
    }

    /// A filled polygon.
    pub fn polygon(&mut self, points: &[Point], colour: Colour) {
        if let Some(path) = path(points, true) {
            self.fill(&path, colour, enlarge());
        }
    }

    /// A filled rectangle.
    pub fn rectangle(&mut self, area: Rect, colour: Colour) {
        self.polygon(&area.corners(), colour);
    }

    /// A filled circle.
    pub fn disk(&mut self, centre: Point, radius: f64, colour: Colour) {
        if let Some(path) = circle_path(centre, radius) {
            self.fill(&path, colour, enlarge());
        }
    }

    /// The outline of a circle.
    pub fn circle(&mut self, centre: Point, radius: f64, pen: &Pen) {
        if let Some(path) = circle_path(centre, radius) {
            self.stroke(&path, pen);
        }
    }

    /// One line of text at a place.
    pub fn text(&mut self, text: &str, at: Point, letters: &Letters) {
        let Some(path) = font::outline(text, letters.size, letters.weight) else {
            return;
        };
        let shift = match letters.align {
            Align::Left => 0.0,
            Align::Centre => -0.5,
            Align::Right => -1.0,
        } * letters.width(text);
        let drop = letters.size * CAPITAL_HEIGHT / 2.0;
        let place = enlarge()
            .pre_translate(at[0] as f32, at[1] as f32)
            .pre_concat(Transform::from_rotate(letters.turn_deg as f32))
            .pre_translate(shift as f32, drop as f32);
        self.fill(&path, letters.colour, place);
    }

    /// Text with a white rim, readable on any ground.
    pub fn text_with_rim(&mut self, text: &str, at: Point, letters: &Letters) {
        let rim = letters.coloured(Colour::WHITE.with_opacity(0.85));
        for step in 0..12 {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 12.0).sin_cos();
            self.text(text, [at[0] + 1.8 * cos, at[1] + 1.8 * sin], &rim);
        }
        self.text(text, at, letters);
    }

    /// Colours the pixels of `area` one by one; `colour` gets the middle of each and may leave it as it is.
    pub fn paint(&mut self, area: Rect, colour: impl Fn(Point) -> Option<Colour>) {
        let fine = f64::from(FINE);
        let index =
            |edge: f64, limit: u32| (edge * fine).round().clamp(0.0, f64::from(limit)) as u32;
        let (width, height) = (self.pixels.width(), self.pixels.height());
        let pixels = self.pixels.pixels_mut();
        for row in index(area.top, height)..index(area.bottom, height) {
            for column in index(area.left, width)..index(area.right, width) {
                let at = [
                    (f64::from(column) + 0.5) / fine,
                    (f64::from(row) + 0.5) / fine,
                ];
                if let Some(Colour { rgb: [r, g, b], .. }) = colour(at) {
                    let opaque = tiny_skia::ColorU8::from_rgba(r, g, b, 255).premultiply();
                    pixels[(row * width + column) as usize] = opaque;
                }
            }
        }
    }

    /// The finished picture as a PNG file.
    ///
    /// # Errors
    /// A failing encoder.
    pub fn into_png(self) -> Result<Vec<u8>> {
        let [width, height] = self.size;
        let mut small = Pixmap::new(width, height).context("cannot make the finished picture")?;
        let fine = self.pixels.pixels();
        let stride = (width * FINE) as usize;
        for (index, pixel) in small.pixels_mut().iter_mut().enumerate() {
            let (row, column) = (index / width as usize, index % width as usize);
            let mut sum = [0u32; 3];
            for y in 0..FINE as usize {
                for x in 0..FINE as usize {
                    let part =
                        fine[(row * FINE as usize + y) * stride + column * FINE as usize + x];
                    for (total, value) in
                        sum.iter_mut().zip([part.red(), part.green(), part.blue()])
                    {
                        *total += u32::from(value);
                    }
                }
            }
            let count = FINE * FINE;
            let [r, g, b] = sum.map(|total| ((total + count / 2) / count) as u8);
            *pixel =
                PremultipliedColorU8::from_rgba(r, g, b, 255).context("opaque pixels are valid")?;
        }
        small.encode_png().context("cannot encode the picture")
    }

    fn fill(&mut self, path: &Path, colour: Colour, place: Transform) {
        self.pixels.fill_path(
            path,
            &paint(colour),
            FillRule::Winding,
            place,
            self.clip.as_ref(),
        );
    }

    fn stroke(&mut self, path: &Path, pen: &Pen) {
        let solid = pen.dash.is_empty();
        let stroke = Stroke {
            width: pen.width as f32,
            line_cap: if solid { LineCap::Round } else { LineCap::Butt },
            line_join: LineJoin::Round,
            dash: if solid {
                None
            } else {
                StrokeDash::new(pen.dash.to_vec(), 0.0)
            },
            ..Stroke::default()
        };
        self.pixels.stroke_path(
            path,
            &paint(pen.colour),
            &stroke,
            enlarge(),
            self.clip.as_ref(),
        );
    }
}

fn enlarge() -> Transform {
    Transform::from_scale(FINE as f32, FINE as f32)
}

fn paint(colour: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    let [r, g, b] = colour.rgb;
    paint.set_color_rgba8(
        r,
        g,
        b,
        (colour.opacity.clamp(0.0, 1.0) * 255.0).round() as u8,
    );
    paint
}

fn path(points: &[Point], close: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (index, point) in points.iter().enumerate() {
        if index == 0 {
            builder.move_to(point[0] as f32, point[1] as f32);
        } else {
            builder.line_to(point[0] as f32, point[1] as f32);
        }
    }
    if close {
        builder.close();
    }
    builder.finish()
}

fn circle_path(centre: Point, radius: f64) -> Option<Path> {
    PathBuilder::from_circle(centre[0] as f32, centre[1] as f32, radius as f32)
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Size and pixels of a PNG picture.
    pub fn decode(png: &[u8]) -> Pixmap {
        Pixmap::decode_png(png).unwrap()
    }

    fn pixel(canvas: Canvas, x: u32, y: u32) -> [u8; 3] {
        let picture = decode(&canvas.into_png().unwrap());
        let pixel = picture.pixel(x, y).unwrap();
        [pixel.red(), pixel.green(), pixel.blue()]
    }

    #[test]
    fn a_canvas_starts_white_and_keeps_its_size() {
        let canvas = Canvas::new(7, 5).unwrap();
        let picture = decode(&canvas.into_png().unwrap());
        assert_eq!((picture.width(), picture.height()), (7, 5));
        assert!(
            picture
                .pixels()
                .iter()
                .all(|p| p.red() == 255 && p.alpha() == 255)
        );
        assert!(Canvas::new(0, 5).is_err());
    }

    #[test]
    fn edges_between_pixels_are_averaged() {
        let mut canvas = Canvas::new(4, 4).unwrap();
        canvas.rectangle(Rect::new(0.0, 0.0, 1.5, 4.0), Colour::BLACK);
        let picture = decode(&canvas.into_png().unwrap());
        let red = |x| picture.pixel(x, 2).unwrap().red();
        assert_eq!([red(0), red(2)], [0, 255]);
        assert!((100..160).contains(&red(1)), "{}", red(1));
    }

    #[test]
    fn clipping_keeps_the_outside() {
        let mut canvas = Canvas::new(10, 10).unwrap();
        canvas.clipped(Rect::new(0.0, 0.0, 5.0, 10.0), |canvas| {
            canvas.rectangle(Rect::new(0.0, 0.0, 10.0, 10.0), Colour::BLACK);
        });
        canvas.disk([8.0, 8.0], 1.5, Colour::new(255, 0, 0));
        let picture = decode(&canvas.into_png().unwrap());
        assert_eq!(picture.pixel(2, 5).unwrap().red(), 0);
        assert_eq!(picture.pixel(8, 2).unwrap().red(), 255);
        assert_eq!(picture.pixel(7, 7).unwrap().green(), 0);
    }

    #[test]
    fn painting_colours_single_pixels() {
        let mut canvas = Canvas::new(4, 4).unwrap();
        canvas.paint(Rect::new(1.0, 1.0, 3.0, 3.0), |[x, _]| {
            (x < 2.0).then_some(Colour::new(10, 20, 30))
        });
        assert_eq!(pixel(canvas, 1, 1), [10, 20, 30]);
    }

    #[test]
    fn text_leaves_ink_where_it_is_aligned() {
        let ink = |align| {
            let mut canvas = Canvas::new(200, 40).unwrap();
            canvas.text("Wide", [100.0, 20.0], &Letters::new(20.0, align));
            let picture = decode(&canvas.into_png().unwrap());
            let dark = |x: u32| (0..40).any(|y| picture.pixel(x, y).unwrap().red() < 128);
            let columns: Vec<u32> = (0..200).filter(|&x| dark(x)).collect();
            [columns[0], columns[columns.len() - 1]]
        };
        assert!(ink(Align::Left)[0] >= 100);
        assert!(ink(Align::Right)[1] <= 100);
        let [left, right] = ink(Align::Centre);
        assert!((i64::from(left + right) - 200).abs() <= 3);
    }
}
