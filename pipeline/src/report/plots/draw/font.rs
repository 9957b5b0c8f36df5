// SPDX-License-Identifier: MIT OR Apache-2.0
//! Letters as outlines, from the fonts compiled in (`fonts/README.md`), so that no picture depends on the machine.

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

static REGULAR: LazyLock<Option<Face<'static>>> =
    LazyLock::new(|| Face::parse(include_bytes!("fonts/DejaVuSans-subset.ttf"), 0).ok());
static BOLD: LazyLock<Option<Face<'static>>> =
    LazyLock::new(|| Face::parse(include_bytes!("fonts/DejaVuSans-Bold-subset.ttf"), 0).ok());

fn face(weight: Weight) -> &'static Face<'static> {
    let face = match weight {
        Weight::Regular => &REGULAR,
        Weight::Bold => &BOLD,
    };
    face.as_ref().expect("the fonts compiled in are readable")
}

/// Width of one line of text in pixels at `size` pixels an em.
pub fn width(text: &str, size: f64, weight: Weight) -> f64 {
    let face = face(weight);
    let units: f64 = text.chars().map(|letter| advance(face, letter)).sum();
    units * size / f64::from(face.units_per_em())
}

/// Outline of one line of text whose baseline starts at the origin; `None` where nothing is visible.
pub fn outline(text: &str, size: f64, weight: Weight) -> Option<Path> {
    let face = face(weight);
    let scale = (size / f64::from(face.units_per_em())) as f32;
    let mut pen = Pen {
        builder: PathBuilder::new(),
        x: 0.0,
    };
    for letter in text.chars() {
        if let Some(glyph) = face.glyph_index(letter).or_else(|| face.glyph_index('?')) {
            face.outline_glyph(glyph, &mut pen);
        }
        pen.x += advance(face, letter) as f32;
    }
    // Font units point upwards, pixels downwards.
    pen.builder
        .finish()?
        .transform(Transform::from_scale(scale, -scale))
}

/// Whether the fonts hold every letter of `text`.
#[cfg(test)]
pub fn covers(text: &str) -> bool {
    [Weight::Regular, Weight::Bold].iter().all(|&weight| {
        text.chars()
            .all(|letter| face(weight).glyph_index(letter).is_some())
    })
}

fn advance(face: &Face, letter: char) -> f64 {
    face.glyph_index(letter)
        .or_else(|| face.glyph_index('?'))
        .and_then(|glyph| face.glyph_hor_advance(glyph))
        .map_or(0.0, f64::from)
}

struct Pen {
    builder: PathBuilder,
    x: f32,
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.builder.move_to(self.x + x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.builder.line_to(self.x + x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.builder.quad_to(self.x + x1, y1, self.x + x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.builder
            .cubic_to(self.x + x1, y1, self.x + x2, y2, self.x + x, y);
    }

    fn close(&mut self) {
        self.builder.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fonts_hold_the_letters_of_labels() {
        assert!(covers(
            "Intensity (W/sr) θ φ λ α β µm mm² ° ± × − ≤ ≥ → 10⁻¹²³⁴⁵⁶⁷⁸⁹⁰ · – σ"
        ));
        assert!(!covers("漢"));
    }

    #[test]
    fn width_grows_with_size_and_letters() {
        let one = width("0", 20.0, Weight::Regular);
        assert!((width("000", 20.0, Weight::Regular) - 3.0 * one).abs() < 1e-9);
        assert!((width("0", 40.0, Weight::Regular) - 2.0 * one).abs() < 1e-9);
        assert!(width("abc", 20.0, Weight::Bold) > width("abc", 20.0, Weight::Regular));
    }

    #[test]
    fn outlines_stand_on_the_baseline() {
        let bounds = outline("H", 100.0, Weight::Regular).unwrap().bounds();
        assert!(bounds.bottom().abs() < 0.5);
        assert!((f64::from(bounds.height()) / 100.0 - CAPITAL_HEIGHT).abs() < 0.005);
        assert!(outline(" ", 100.0, Weight::Regular).is_none());
    }
}
