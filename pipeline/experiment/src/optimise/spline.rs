// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniform clamped B-splines: profiles by few coefficients, within the bounds of these.

/// Degree of a spline of many coefficients.
const DEGREE: usize = 3;

/// A B-spline on 0 to 1 with `count` coefficients; its ends are the first and the last one. Its
/// degree is 3, or one less than the number of coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BSpline {
    count: usize,
}

impl BSpline {
    /// With `count` coefficients, at least 1.
    pub fn new(count: usize) -> Self {
        Self { count: count.max(1) }
    }

    fn degree(self) -> usize {
        DEGREE.min(self.count - 1)
    }

    /// The knot `number`: clamped at both ends, equally spaced between.
    fn knot(self, number: usize) -> f64 {
        let (degree, spans) = (self.degree(), self.count - self.degree());
        let inner = number.saturating_sub(degree).min(spans);
        inner as f64 / spans as f64
    }

    /// Abscissa at which each coefficient acts most: the mean of its inner knots [Greville].
    pub fn abscissae(self) -> Vec<f64> {
        let degree = self.degree();
        let at = |k: usize| match degree {
            0 => 0.5,
            _ => (1..=degree).map(|j| self.knot(k + j)).sum::<f64>() / degree as f64,
        };
        (0..self.count).map(at).collect()
    }

    /// Value at `t` from 0 to 1, by de Boor's recursion.
    pub fn value(self, coefficients: &[f64], t: f64) -> f64 {
        let (degree, spans) = (self.degree(), self.count - self.degree());
        let span = ((t * spans as f64) as usize).min(spans - 1) + degree;
        let mut values: Vec<f64> = coefficients[span - degree..=span].to_vec();
        for level in 1..=degree {
            for j in (level..=degree).rev() {
                let k = span - degree + j;
                let (low, high) = (self.knot(k), self.knot(k + degree + 1 - level));
                let share = (t - low) / (high - low);
                values[j] = (1.0 - share) * values[j - 1] + share * values[j];
            }
        }
        values[degree]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_lines_are_exact_and_values_stay_within_coefficients() {
        for count in 2..12 {
            let spline = BSpline::new(count);
            let line: Vec<f64> = spline.abscissae().iter().map(|t| 3.0 - 2.0 * t).collect();
            let zigzag: Vec<f64> = (0..count).map(|k| (k % 2) as f64).collect();
            for k in 0..=40 {
                let t = f64::from(k) / 40.0;
                assert!((spline.value(&line, t) - (3.0 - 2.0 * t)).abs() < 1e-13);
                let value = spline.value(&zigzag, t);
                assert!((-1e-15..=1.0 + 1e-15).contains(&value), "{count} {t} {value}");
            }
            assert!(spline.value(&zigzag, 0.0).abs() < 1e-15);
        }
        assert!((BSpline::new(1).value(&[4.0], 0.3) - 4.0).abs() < 1e-15);
    }

    #[test]
    fn four_coefficients_are_a_bezier_curve() {
        let c = [0.3, -1.0, 2.0, 0.7];
        for k in 0..=10 {
            let t = f64::from(k) / 10.0;
            let s = 1.0 - t;
            let bezier = s.powi(3) * c[0]
                + 3.0 * s * s * t * c[1]
                + 3.0 * s * t * t * c[2]
                + t.powi(3) * c[3];
            assert!((BSpline::new(4).value(&c, t) - bezier).abs() < 1e-14);
        }
    }
}
