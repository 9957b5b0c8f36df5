// SPDX-License-Identifier: MIT OR Apache-2.0
//! Parts of a picture: points, lines, areas, letters and images.

use tiny_skia::Pixmap;

use super::colour::Colour;
use super::font::{self, Weight};

/// A point in pixels: x to the right, y downwards.
pub type Point = [f64; 2];

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
        Self { left, top, right, bottom }
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
        [f64::midpoint(self.left, self.right), f64::midpoint(self.top, self.bottom)]
    }

    /// The rectangle with its edges moved inwards: left, top, right, bottom.
    pub fn inset(&self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self::new(self.left + left, self.top + top, self.right - right, self.bottom - bottom)
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
        Self { colour, width, dash: &[] }
    }

    /// A dashed line.
    pub const fn dashed(colour: Colour, width: f64, dash: &'static [f32]) -> Self {
        Self { colour, width, dash }
    }
}

/// Point of the text that is at the given place, horizontally.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Left end.
    Left,
    /// Middle.
    Centre,
    /// Right end.
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
        Self { size, weight: Weight::Regular, colour: Colour::TEXT, align, turn_deg: 0.0 }
    }

    /// The same in another colour.
    pub const fn coloured(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }

    /// The same in bold.
    pub const fn bold(self) -> Self {
        Self { weight: Weight::Bold, ..self }
    }

    /// The same, turned to read upwards.
    pub const fn upwards(self) -> Self {
        Self { turn_deg: -90.0, ..self }
    }

    /// Width of `text` in pixels.
    pub fn width(&self, text: &str) -> f64 {
        font::width(text, self.size, self.weight)
    }
}

/// A part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// What lies within an odd number of closed lines.
    Area { lines: Vec<Vec<Point>>, colour: Colour },
    /// Lines through points.
    Line { lines: Vec<Vec<Point>>, is_closed: bool, pen: Pen },
    /// A filled circle.
    Disk { centre: Point, radius: f64, colour: Colour },
    /// A line of text, on a rim where there is one.
    Text { text: String, at: Point, letters: Letters, rim: Option<Pen> },
    /// Pixels that fill a rectangle.
    Image { area: Rect, pixels: Pixmap, smooth: bool },
    /// Begins to show only what lies within a polygon, up to its [`Mark::Unclip`].
    Clip(Vec<Point>),
    /// Ends the last [`Mark::Clip`].
    Unclip,
}

impl Mark {
    /// Lines through points.
    pub fn line(lines: Vec<Vec<Point>>, is_closed: bool, pen: &Pen) -> Self {
        Self::Line { lines, is_closed, pen: *pen }
    }

    /// What lies within an odd number of closed lines.
    pub const fn area(lines: Vec<Vec<Point>>, colour: Colour) -> Self {
        Self::Area { lines, colour }
    }
}
