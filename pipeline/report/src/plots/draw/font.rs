// SPDX-License-Identifier: MIT OR Apache-2.0
//! The fonts compiled in (`fonts/README.md`): widths and outlines of their letters.

use std::sync::LazyLock;

use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, OutlineBuilder};

/// Weight of the letters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// For labels.
    Regular,
    /// For titles.
    Bold,
}

/// Height of capital letters per font size, for centring.
pub const CAPITAL_HEIGHT: f64 = 0.729;

/// The font files: regular, bold.
const FILES: [&[u8]; 2] = [
    include_bytes!("fonts/DejaVuSans-subset.ttf"),
    include_bytes!("fonts/DejaVuSans-Bold-subset.ttf"),
];

static FACES: LazyLock<[Option<Face<'static>>; 2]> =
    LazyLock::new(|| FILES.map(|bytes| Face::parse(bytes, 0).ok()));

fn face(weight: Weight) -> &'static Face<'static> {
    let face = match weight {
        Weight::Regular => &FACES[0],
        Weight::Bold => &FACES[1],
    };
    face.as_ref().expect("the fonts compiled in are readable")
}

/// Width of one line of text in pixels at `size` pixels an em.
pub fn width(text: &str, size: f64, weight: Weight) -> f64 {
    let face = face(weight);
    let units: f64 = text.chars().map(|letter| advance(face, letter)).sum();
    units * size / f64::from(face.units_per_em())
}

/// Outlines of one line of text at `size` pixels an em, its baseline from (0, 0) to the right; `None`
/// of blanks.
pub fn outlines(text: &str, size: f64, weight: Weight) -> Option<Path> {
    let face = face(weight);
    let scale = size / f64::from(face.units_per_em());
    let mut path = PathBuilder::new();
    let mut right = 0.0;
    for letter in text.chars() {
        let Some(glyph) = face.glyph_index(letter).or_else(|| face.glyph_index('?')) else {
            continue;
        };
        let mut outline = Outline(PathBuilder::new());
        face.outline_glyph(glyph, &mut outline);
        let place =
            Transform::from_row(scale as f32, 0.0, 0.0, -scale as f32, (right * scale) as f32, 0.0);
        if let Some(outline) = outline.0.finish().and_then(|outline| outline.transform(place)) {
            path.push_path(&outline);
        }
        right += face.glyph_hor_advance(glyph).map_or(0.0, f64::from);
    }
    path.finish()
}

/// Outline of one letter in units of its font.
struct Outline(PathBuilder);

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.0.close();
    }
}

/// True if the fonts hold every letter of `text`.
#[cfg(test)]
pub fn covers(text: &str) -> bool {
    [Weight::Regular, Weight::Bold]
        .iter()
        .all(|&weight| text.chars().all(|letter| face(weight).glyph_index(letter).is_some()))
}

fn advance(face: &Face, letter: char) -> f64 {
    face.glyph_index(letter)
        .or_else(|| face.glyph_index('?'))
        .and_then(|glyph| face.glyph_hor_advance(glyph))
        .map_or(0.0, f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fonts_hold_the_letters_of_labels() {
        assert!(covers("Intensity (W/sr) θ φ λ α β µm mm² ° ± × − ≤ ≥ → 10⁻¹²³⁴⁵⁶⁷⁸⁹⁰ · – σ"));
        assert!(!covers("漢"));
    }

    #[test]
    fn width_grows_with_size_and_letters() {
        let one = width("0", 20.0, Weight::Regular);
        assert!((width("000", 20.0, Weight::Regular) - 3.0 * one).abs() < 1e-9);
        assert!((width("0", 40.0, Weight::Regular) - 2.0 * one).abs() < 1e-9);
        assert!(width("abc", 20.0, Weight::Bold) > width("abc", 20.0, Weight::Regular));
    }
}
