// SPDX-License-Identifier: MIT OR Apache-2.0
//! The fonts compiled in (`fonts/README.md`) and the widths of their letters.

use std::sync::LazyLock;

use ttf_parser::Face;

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
pub const FILES: [&[u8]; 2] = [
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
