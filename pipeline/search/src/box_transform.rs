// SPDX-License-Identifier: MIT OR Apache-2.0
//! From all reals onto the unit interval: the identity inside, parabolas at both ends, mirrored and
//! periodic beyond.
//!
//! The map has a continuous derivative, and every optimum on the border of the box is one at a
//! finite place, around which the objective is smooth. Inside, the search sees the objective
//! itself. Source: `BoxConstraintsLinQuadTransformation` in `transformations.py` of pycma
//! (N. Hansen, <https://github.com/CMA-ES/pycma>); there the parabolas are 1/20 and 1/10 wide for
//! \[0, 1\], here both are 1/20.

/// Half the width of a parabola, inside and outside the interval.
const WIDTH: f64 = 0.05;

/// The coordinate of the box that the free coordinate `x` stands for.
pub(super) fn into_box(x: f64) -> f64 {
    // One period: from the outer end of the lower parabola to that of the upper one and back.
    let span = 1.0 + 2.0 * WIDTH;
    let along = (x + WIDTH).rem_euclid(2.0 * span);
    let x = along.min(2.0 * span - along) - WIDTH;
    let inside = if x < WIDTH {
        (x + WIDTH).powi(2) / (4.0 * WIDTH)
    } else if x > 1.0 - WIDTH {
        1.0 - (1.0 + WIDTH - x).powi(2) / (4.0 * WIDTH)
    } else {
        x
    };
    inside.clamp(0.0, 1.0)
}

/// The free coordinate of the coordinate `u` of the box: the inverse of [`into_box`].
pub(super) fn from_box(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    if u < WIDTH {
        2.0 * (WIDTH * u).sqrt() - WIDTH
    } else if u > 1.0 - WIDTH {
        1.0 + WIDTH - 2.0 * (WIDTH * (1.0 - u)).sqrt()
    } else {
        u
    }
}

#[cfg(test)]
mod tests {
    use super::{WIDTH, from_box, into_box};

    #[test]
    fn the_transform_is_inverted_and_smooth() {
        for k in 0..=1000 {
            let u = f64::from(k) / 1000.0;
            assert!((into_box(from_box(u)) - u).abs() < 1e-15, "{u}");
            let x = from_box(u);
            for image in [x + 2.0 + 4.0 * WIDTH, -x - 2.0 * WIDTH] {
                assert!((into_box(image) - u).abs() < 1e-14, "{u} {image}");
            }
        }
        // Slope of the parabola where it meets the identity.
        for x in [WIDTH, 1.0 - WIDTH] {
            let slope = (into_box(x + 1e-7) - into_box(x - 1e-7)) / 2e-7;
            assert!((slope - 1.0).abs() < 1e-5, "{x}: {slope}");
        }
    }
}
