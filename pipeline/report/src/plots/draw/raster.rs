// SPDX-License-Identifier: MIT OR Apache-2.0
//! The marks of a picture as pixels.

use anyhow::{Context, Result};
use tiny_skia::{
    FillRule, FilterQuality, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pattern, Pixmap,
    Shader, SpreadMode, Stroke, StrokeDash, Transform,
};

use super::colour::Colour;
use super::font::{self, CAPITAL_HEIGHT};
use super::mark::{Align, Letters, Mark, Pen, Point, Rect};

/// Draws marks one over the other.
///
/// # Errors
/// A picture for which there is no memory.
pub fn draw(marks: &[Mark], [width, height]: [u32; 2]) -> Result<Pixmap> {
    let no_memory = || format!("cannot draw a picture of {width} x {height} pixels");
    let pixels = Pixmap::new(width, height).with_context(no_memory)?;
    let mut raster = Raster { pixels, masks: Vec::new() };
    for mark in marks {
        match mark {
            Mark::Area { lines, colour } => raster.fill(path(lines, true), *colour),
            Mark::Line { lines, is_closed, pen } => raster.stroke(path(lines, *is_closed), pen),
            Mark::Disk { centre: [x, y], radius, colour } => {
                let circle = PathBuilder::from_circle(*x as f32, *y as f32, *radius as f32);
                raster.fill(circle, *colour);
            }
            Mark::Text { text, at, letters, rim } => {
                let glyphs = glyphs(text, *at, letters);
                if let Some(rim) = rim {
                    raster.stroke(glyphs.clone(), rim);
                }
                raster.fill_by(glyphs, letters.colour, FillRule::Winding);
            }
            Mark::Image { area, pixels, smooth } => raster.image(area, pixels, *smooth),
            Mark::Clip(outline) => {
                let mut mask = if let Some(outer) = raster.masks.last() {
                    outer.clone()
                } else {
                    let mut whole = Mask::new(width, height).with_context(no_memory)?;
                    whole.invert();
                    whole
                };
                match path(std::slice::from_ref(outline), true) {
                    Some(path) => {
                        mask.intersect_path(&path, FillRule::Winding, true, Transform::identity());
                    }
                    None => mask.clear(),
                }
                raster.masks.push(mask);
            }
            Mark::Unclip => {
                raster.masks.pop();
            }
        }
    }
    Ok(raster.pixels)
}

/// Pixels, and what of them is open to marks.
struct Raster {
    pixels: Pixmap,
    masks: Vec<Mask>,
}

impl Raster {
    fn fill(&mut self, path: Option<Path>, colour: Colour) {
        self.fill_by(path, colour, FillRule::EvenOdd);
    }

    fn fill_by(&mut self, path: Option<Path>, colour: Colour, rule: FillRule) {
        if let Some(path) = path {
            let paint = paint(colour);
            self.pixels.fill_path(&path, &paint, rule, Transform::identity(), self.masks.last());
        }
    }

    fn stroke(&mut self, path: Option<Path>, pen: &Pen) {
        let stroke = Stroke {
            width: pen.width as f32,
            line_cap: if pen.dash.is_empty() { LineCap::Round } else { LineCap::Butt },
            line_join: LineJoin::Round,
            dash: StrokeDash::new(pen.dash.to_vec(), 0.0),
            ..Stroke::default()
        };
        if let Some(path) = path {
            let (paint, open) = (paint(pen.colour), self.masks.last());
            self.pixels.stroke_path(&path, &paint, &stroke, Transform::identity(), open);
        }
    }

    fn image(&mut self, area: &Rect, image: &Pixmap, smooth: bool) {
        let scale =
            [area.width() / f64::from(image.width()), area.height() / f64::from(image.height())];
        let [across, down] = scale.map(|scale| scale as f32);
        let place = Transform::from_row(across, 0.0, 0.0, down, area.left as f32, area.top as f32);
        let quality = if smooth { FilterQuality::Bilinear } else { FilterQuality::Nearest };
        let shader = Pattern::new(image.as_ref(), SpreadMode::Pad, quality, 1.0, place);
        let paint = Paint { shader, anti_alias: true, ..Paint::default() };
        if let Some(path) = path(&[area.corners().to_vec()], true) {
            let open = self.masks.last();
            self.pixels.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), open);
        }
    }
}

fn paint(colour: Colour) -> Paint<'static> {
    let [r, g, b] = colour.rgb.map(|share| f32::from(share) / 255.0);
    let opacity = colour.opacity.clamp(0.0, 1.0) as f32;
    let colour = tiny_skia::Color::from_rgba(r, g, b, opacity).unwrap_or(tiny_skia::Color::BLACK);
    Paint { shader: Shader::SolidColor(colour), anti_alias: true, ..Paint::default() }
}

/// Lines through points; `None` where there is nothing to draw.
fn path(lines: &[Vec<Point>], is_closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for line in lines {
        for (i, [x, y]) in line.iter().enumerate() {
            let (x, y) = (*x as f32, *y as f32);
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if is_closed {
            path.close();
        }
    }
    path.finish()
}

/// Outlines of the letters of a text, centred on the capital letters.
fn glyphs(text: &str, [x, y]: Point, letters: &Letters) -> Option<Path> {
    let width = letters.width(text);
    let left = match letters.align {
        Align::Left => 0.0,
        Align::Centre => -width / 2.0,
        Align::Right => -width,
    };
    let drop = letters.size * CAPITAL_HEIGHT / 2.0;
    let outlines = font::outlines(text, letters.size, letters.weight)?;
    outlines.transform(
        Transform::from_translate(left as f32, drop as f32)
            .post_concat(Transform::from_rotate(letters.turn_deg as f32))
            .post_translate(x as f32, y as f32),
    )
}
