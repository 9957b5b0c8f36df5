// SPDX-License-Identifier: MIT OR Apache-2.0
//! A picture of lines, areas and letters: the text of an SVG image, and the same marks for a PNG.

use std::fmt::{Arguments, Write as _};

use anyhow::{Context, Result};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use minijinja::HtmlEscape;
use tiny_skia::{ColorU8, Pixmap};

use super::colour::Colour;
use super::font::{CAPITAL_HEIGHT, Weight};
use super::mark::Mark;
pub use super::mark::{Align, Letters, Pen, Point, Rect};
use super::raster;

/// A picture being drawn.
pub struct Canvas {
    elements: String,
    marks: Vec<Mark>,
    clips: usize,
    size: [u32; 2],
}

impl Canvas {
    /// A white canvas of so many pixels.
    pub fn new(width: u32, height: u32) -> Self {
        let (elements, marks) = (String::new(), Vec::new());
        let mut canvas = Self { elements, marks, clips: 0, size: [width, height] };
        canvas.rectangle(canvas.area(), Colour::WHITE);
        canvas
    }

    /// The whole canvas.
    pub fn area(&self) -> Rect {
        Rect::new(0.0, 0.0, f64::from(self.size[0]), f64::from(self.size[1]))
    }

    /// Cuts off what lies below `bottom`.
    pub fn cut(&mut self, bottom: f64) {
        self.size[1] = self.size[1].min(bottom.ceil() as u32);
    }

    /// Draws through `draw` as one group with these attributes.
    pub fn group(&mut self, attributes: &[(&str, &str)], draw: impl FnOnce(&mut Self)) {
        self.elements.push_str("<g");
        for (name, value) in attributes {
            let _ = write!(self.elements, r#" {name}="{}""#, HtmlEscape(value));
        }
        self.elements.push_str(">\n");
        draw(self);
        self.add(format_args!("</g>"));
    }

    /// Draws through `draw`; a browser shows `words` where the pointer rests on it.
    pub fn with_tooltip(&mut self, words: &str, draw: impl FnOnce(&mut Self)) {
        self.add(format_args!("<g><title>{}</title>", HtmlEscape(words)));
        draw(self);
        self.add(format_args!("</g>"));
    }

    /// Draws through `draw` within `area` only.
    pub fn clipped(&mut self, area: Rect, draw: impl FnOnce(&mut Self)) {
        self.clipped_to(&area.corners(), draw);
    }

    /// Draws through `draw` within a polygon only.
    pub fn clipped_to(&mut self, outline: &[Point], draw: impl FnOnce(&mut Self)) {
        self.clips += 1;
        let (id, points) = (self.clips, points(outline));
        self.add(format_args!(
            r#"<clipPath id="clip{id}"><polygon points="{points}"/></clipPath><g clip-path="url(#clip{id})">"#
        ));
        self.marks.push(Mark::Clip(outline.to_vec()));
        draw(self);
        self.marks.push(Mark::Unclip);
        self.add(format_args!("</g>"));
    }

    /// A straight line.
    pub fn line(&mut self, from: Point, to: Point, pen: &Pen) {
        self.polyline(&[from, to], pen);
    }

    /// Straight lines of one kind.
    pub fn lines(&mut self, lines: &[[Point; 2]], pen: &Pen) {
        if lines.is_empty() {
            return;
        }
        let one = |[[a, b], [c, d]]: &[Point; 2]| format!("M{a:.1} {b:.1}L{c:.1} {d:.1}");
        let d: String = lines.iter().map(one).collect();
        let stroke = stroke(pen);
        self.add(format_args!(r#"<path d="{d}" fill="none"{stroke}/>"#));
        let lines = lines.iter().map(|line| line.to_vec()).collect();
        self.marks.push(Mark::line(lines, false, pen));
    }

    /// A line through points.
    pub fn polyline(&mut self, line: &[Point], pen: &Pen) {
        let (points, stroke) = (points(line), stroke(pen));
        self.add(format_args!(r#"<polyline points="{points}" fill="none"{stroke}/>"#));
        self.marks.push(Mark::line(vec![line.to_vec()], false, pen));
    }

    /// The outline of a polygon.
    pub fn outline(&mut self, corners: &[Point], pen: &Pen) {
        let (points, stroke) = (points(corners), stroke(pen));
        self.add(format_args!(r#"<polygon points="{points}" fill="none"{stroke}/>"#));
        self.marks.push(Mark::line(vec![corners.to_vec()], true, pen));
    }

    /// A filled polygon.
    pub fn polygon(&mut self, corners: &[Point], colour: Colour) {
        let (points, fill) = (points(corners), paint("fill", colour));
        self.add(format_args!(r#"<polygon points="{points}"{fill}/>"#));
        self.marks.push(Mark::area(vec![corners.to_vec()], colour));
    }

    /// Lines, closed or not, with what lies within an odd number of them filled.
    pub fn shape(&mut self, lines: &[Vec<Point>], closed: bool, fill: Option<Colour>, pen: &Pen) {
        let one = |line: &Vec<Point>| {
            let points: Vec<String> = line.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
            format!("M {}{}", points.join(" L "), if closed { " Z" } else { "" })
        };
        let d: Vec<String> = lines.iter().map(one).collect();
        let filled = fill.map_or(r#" fill="none""#.to_owned(), |colour| paint("fill", colour));
        self.add(format_args!(
            r#"<path d="{}" fill-rule="evenodd"{filled}{}/>"#,
            d.join(" "),
            stroke(pen)
        ));
        if let Some(colour) = fill {
            self.marks.push(Mark::area(lines.to_vec(), colour));
        }
        self.marks.push(Mark::line(lines.to_vec(), closed, pen));
    }

    /// A filled rectangle.
    pub fn rectangle(&mut self, area: Rect, colour: Colour) {
        self.polygon(&area.corners(), colour);
    }

    /// A filled circle.
    pub fn disk(&mut self, [x, y]: Point, radius: f64, colour: Colour) {
        let fill = paint("fill", colour);
        self.add(format_args!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius:.1}"{fill}/>"#));
        self.marks.push(Mark::Disk { centre: [x, y], radius, colour });
    }

    /// One line of text at a place.
    pub fn text(&mut self, text: &str, at: Point, letters: &Letters) {
        self.write(text, at, letters, None);
    }

    /// Text with a white rim, readable on any ground.
    pub fn text_with_rim(&mut self, text: &str, at: Point, letters: &Letters) {
        let rim = Pen::solid(Colour::WHITE.with_opacity(0.85), 3.6);
        self.write(text, at, letters, Some(rim));
    }

    fn write(&mut self, text: &str, [x, y]: Point, letters: &Letters, rim: Option<Pen>) {
        let (size, drop) = (letters.size, letters.size * CAPITAL_HEIGHT / 2.0);
        let anchor = match letters.align {
            Align::Left => "",
            Align::Centre => r#" text-anchor="middle""#,
            Align::Right => r#" text-anchor="end""#,
        };
        let weight = match letters.weight {
            Weight::Regular => "",
            Weight::Bold => r#" font-weight="bold""#,
        };
        let place = if letters.turn_deg == 0.0 {
            format!(r#"x="{x:.1}" y="{:.1}""#, y + drop)
        } else {
            let turn = letters.turn_deg;
            format!(r#"transform="translate({x:.1} {y:.1}) rotate({turn})" y="{drop:.1}""#)
        };
        let more =
            rim.map_or(String::new(), |rim| format!(r#" paint-order="stroke"{}"#, stroke(&rim)));
        let (fill, escaped) = (paint("fill", letters.colour), HtmlEscape(text));
        self.add(format_args!(
            r#"<text {place} font-size="{size:.1}"{weight}{anchor}{fill}{more}>{escaped}</text>"#
        ));
        self.marks.push(Mark::Text { text: text.to_owned(), at: [x, y], letters: *letters, rim });
    }

    /// Fills `area` with an embedded image of `columns` times `rows` pixels, the first row on top.
    /// Pixels show as rectangles, or run into each other where `smooth`.
    pub fn image(
        &mut self,
        area: Rect,
        [columns, rows]: [usize; 2],
        smooth: bool,
        colour: impl Fn(usize, usize) -> Colour,
    ) {
        let Some(mut pixels) = Pixmap::new(columns as u32, rows as u32) else {
            return;
        };
        for (index, pixel) in pixels.pixels_mut().iter_mut().enumerate() {
            let [r, g, b] = colour(index % columns, index / columns).rgb;
            *pixel = ColorU8::from_rgba(r, g, b, 255).premultiply();
        }
        let Ok(png) = pixels.encode_png() else {
            return;
        };
        let rendering = if smooth { "smooth" } else { "pixelated" };
        self.add(format_args!(
            r#"<image x="{:.2}" y="{:.2}" width="{:.2}" height="{:.2}" preserveAspectRatio="none" style="image-rendering:{rendering}" href="data:image/png;base64,{}"/>"#,
            area.left,
            area.top,
            area.width(),
            area.height(),
            BASE64_STANDARD.encode(png)
        ));
        self.marks.push(Mark::Image { area, pixels, smooth });
    }

    /// The finished picture.
    pub fn finish(self) -> Picture {
        let [width, height] = self.size;
        Picture {
            svg: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" font-family=\"DejaVu Sans, sans-serif\">\n{}</svg>\n",
                self.elements
            ),
            marks: self.marks,
            size: self.size,
        }
    }

    fn add(&mut self, element: Arguments) {
        let _ = writeln!(self.elements, "{element}");
    }
}

/// A finished picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    svg: String,
    marks: Vec<Mark>,
    size: [u32; 2],
}

impl Picture {
    /// The picture as the text of an SVG image.
    pub fn svg(&self) -> &str {
        &self.svg
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// A picture for which there is no memory, or a failing encoder.
    pub fn png(&self) -> Result<Vec<u8>> {
        raster::draw(&self.marks, self.size)?.encode_png().context("cannot encode the picture")
    }
}

fn points(list: &[Point]) -> String {
    let pairs: Vec<String> = list.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    pairs.join(" ")
}

/// The attributes of a colour for `fill` or `stroke`.
fn paint(what: &str, colour: Colour) -> String {
    let [r, g, b] = colour.rgb;
    let opacity = match colour.opacity.clamp(0.0, 1.0) {
        1.0 => String::new(),
        opacity => format!(r#" {what}-opacity="{opacity:.3}""#),
    };
    format!(r##" {what}="#{r:02x}{g:02x}{b:02x}"{opacity}"##)
}

/// The attributes of a pen.
fn stroke(pen: &Pen) -> String {
    let line = if pen.dash.is_empty() {
        r#" stroke-linecap="round""#.to_owned()
    } else {
        let lengths: Vec<String> = pen.dash.iter().map(f32::to_string).collect();
        format!(r#" stroke-dasharray="{}""#, lengths.join(" "))
    };
    let (colour, width) = (paint("stroke", pen.colour), pen.width);
    format!(r#"{colour} stroke-width="{width:.1}" stroke-linejoin="round"{line}"#)
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// The pixels of a picture's PNG.
    pub fn decode(picture: &Picture) -> Pixmap {
        Pixmap::decode_png(&picture.png().unwrap()).unwrap()
    }

    #[test]
    fn a_canvas_starts_white_and_keeps_its_size() {
        let canvas = Canvas::new(7, 5);
        let picture = decode(&canvas.finish());
        assert_eq!((picture.width(), picture.height()), (7, 5));
        assert!(picture.pixels().iter().all(|p| p.red() == 255 && p.alpha() == 255));
    }

    #[test]
    fn edges_between_pixels_are_averaged() {
        let mut canvas = Canvas::new(4, 4);
        canvas.rectangle(Rect::new(0.0, 0.0, 1.5, 4.0), Colour::BLACK);
        let picture = decode(&canvas.finish());
        let red = |x| picture.pixel(x, 2).unwrap().red();
        assert_eq!([red(0), red(2)], [0, 255]);
        assert!((100..160).contains(&red(1)), "{}", red(1));
    }

    #[test]
    fn clipping_keeps_the_outside() {
        let mut canvas = Canvas::new(10, 10);
        canvas.clipped(Rect::new(0.0, 0.0, 5.0, 10.0), |canvas| {
            canvas.rectangle(Rect::new(0.0, 0.0, 10.0, 10.0), Colour::BLACK);
        });
        canvas.disk([8.0, 8.0], 1.5, Colour::new(255, 0, 0));
        let picture = decode(&canvas.finish());
        assert_eq!(picture.pixel(2, 5).unwrap().red(), 0);
        assert_eq!(picture.pixel(8, 2).unwrap().red(), 255);
        assert_eq!(picture.pixel(7, 7).unwrap().green(), 0);
    }

    #[test]
    fn pixels_of_an_image_fill_rectangles() {
        let mut canvas = Canvas::new(8, 8);
        let colours = [Colour::new(10, 20, 30), Colour::new(200, 100, 50)];
        canvas.image(Rect::new(1.0, 1.0, 7.0, 7.0), [2, 1], false, |x, _| colours[x]);
        let picture = decode(&canvas.finish());
        for (x, colour) in [(1, colours[0]), (3, colours[0]), (4, colours[1]), (6, colours[1])] {
            let pixel = picture.pixel(x, 5).unwrap();
            assert_eq!([pixel.red(), pixel.green(), pixel.blue()], colour.rgb, "{x}");
        }
        assert_eq!(picture.pixel(0, 5).unwrap().red(), 255);
    }

    #[test]
    fn words_cannot_leave_their_place() {
        let mut canvas = Canvas::new(8, 8);
        canvas.with_tooltip("<b>", |canvas| {
            canvas.group(&[("data-name", "\"><script>")], |_| {});
        });
        let picture = canvas.finish();
        assert!(!picture.svg().contains("<b>") && !picture.svg().contains("<script>"));
        assert!(picture.png().is_ok());
    }

    #[test]
    fn text_leaves_ink_where_it_is_aligned() {
        let ink = |align| {
            let mut canvas = Canvas::new(200, 40);
            canvas.text("Wide", [100.0, 20.0], &Letters::new(20.0, align));
            let picture = decode(&canvas.finish());
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
