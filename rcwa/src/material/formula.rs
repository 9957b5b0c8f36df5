// SPDX-License-Identifier: MIT OR Apache-2.0
//! The nine dispersion formulas of refractiveindex.info, by its numbers.

use super::MaterialError;

/// A formula for n against the wavelength λ in micrometres, with coefficients C1, C2, ...
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formula {
    /// 1: n² - 1 = C1 + C2 λ²/(λ² - C3²) + C4 λ²/(λ² - C5²) + ...
    Sellmeier,
    /// 2: n² - 1 = C1 + C2 λ²/(λ² - C3) + C4 λ²/(λ² - C5) + ...
    Sellmeier2,
    /// 3: n² = C1 + C2 λ^C3 + C4 λ^C5 + ...
    Polynomial,
    /// 4: n² = C1 + C2 λ^C3/(λ² - C4^C5) + C6 λ^C7/(λ² - C8^C9) + C10 λ^C11 + C12 λ^C13 + ...
    Mixed,
    /// 5: n = C1 + C2 λ^C3 + C4 λ^C5 + ...
    Cauchy,
    /// 6: n - 1 = C1 + C2/(C3 - λ⁻²) + C4/(C5 - λ⁻²) + ...
    Gases,
    /// 7: n = C1 + C2/(λ² - 0.028) + C3/(λ² - 0.028)² + C4 λ² + C5 λ⁴ + C6 λ⁶
    Herzberger,
    /// 8: (n² - 1)/(n² + 2) = C1 + C2 λ²/(λ² - C3) + C4 λ²
    Retro,
    /// 9: n² = C1 + C2/(λ² - C3) + C4 (λ - C5)/((λ - C5)² + C6)
    Exotic,
}

impl Formula {
    /// All, in the order of their numbers, from 1.
    const ALL: [Self; 9] = [
        Self::Sellmeier,
        Self::Sellmeier2,
        Self::Polynomial,
        Self::Mixed,
        Self::Cauchy,
        Self::Gases,
        Self::Herzberger,
        Self::Retro,
        Self::Exotic,
    ];

    /// The formula of refractiveindex.info's number 1 to 9.
    pub fn from_number(number: usize) -> Option<Self> {
        Self::ALL.get(number.checked_sub(1)?).copied()
    }

    /// True where the formula takes these coefficients.
    pub(super) fn check(self, coefficients: &[f64]) -> Result<(), MaterialError> {
        let got = coefficients.len();
        let (fits, expected) = match self {
            Self::Sellmeier | Self::Sellmeier2 | Self::Polynomial | Self::Cauchy | Self::Gases => {
                (got % 2 == 1, "1, 3, 5, ...")
            }
            Self::Mixed => {
                (got == 1 || got == 5 || (got >= 9 && got % 2 == 1), "1, 5, 9, 11, 13, ...")
            }
            Self::Herzberger => ((3..=6).contains(&got), "3 to 6"),
            Self::Retro => (got == 4, "4"),
            Self::Exotic => (got == 6, "6"),
        };
        if !fits {
            return Err(MaterialError::Coefficients { formula: self, expected, got });
        }
        match coefficients.iter().position(|c| !c.is_finite()) {
            Some(i) => Err(MaterialError::Coefficient { place: i + 1, got: coefficients[i] }),
            None => Ok(()),
        }
    }

    /// n at a wavelength; none where the formula has no real positive one.
    pub(super) fn index(self, c: &[f64], wavelength: f64) -> Option<f64> {
        let l = wavelength;
        let l2 = l * l;
        let pairs = |from: usize| c[from..].chunks_exact(2).map(|p| (p[0], p[1]));
        let n = match self {
            Self::Sellmeier => {
                (1.0 + c[0] + pairs(1).map(|(b, r)| b * l2 / (l2 - r * r)).sum::<f64>()).sqrt()
            }
            Self::Sellmeier2 => {
                (1.0 + c[0] + pairs(1).map(|(b, r)| b * l2 / (l2 - r)).sum::<f64>()).sqrt()
            }
            Self::Polynomial => (c[0] + pairs(1).map(|(b, e)| b * l.powf(e)).sum::<f64>()).sqrt(),
            Self::Mixed => {
                let poles = c[1..].chunks_exact(4).take(2);
                let poles: f64 = poles.map(|p| p[0] * l.powf(p[1]) / (l2 - p[2].powf(p[3]))).sum();
                let powers: f64 =
                    if c.len() > 9 { pairs(9).map(|(b, e)| b * l.powf(e)).sum() } else { 0.0 };
                (c[0] + poles + powers).sqrt()
            }
            Self::Cauchy => c[0] + pairs(1).map(|(b, e)| b * l.powf(e)).sum::<f64>(),
            Self::Gases => 1.0 + c[0] + pairs(1).map(|(b, r)| b / (r - 1.0 / l2)).sum::<f64>(),
            Self::Herzberger => {
                let pole = 1.0 / (l2 - 0.028);
                // C4 λ² + C5 λ⁴ + C6 λ⁶ by Horner's scheme.
                let powers = c[3..].iter().rev().fold(0.0, |sum, b| (sum + b) * l2);
                c[0] + c[1] * pole + c[2] * pole * pole + powers
            }
            Self::Retro => {
                let x = c[0] + c[1] * l2 / (l2 - c[2]) + c[3] * l2;
                ((1.0 + 2.0 * x) / (1.0 - x)).sqrt()
            }
            Self::Exotic => {
                let d = l - c[4];
                (c[0] + c[1] / (l2 - c[2]) + c[3] * d / (d * d + c[5])).sqrt()
            }
        };
        (n.is_finite() && n > 0.0).then_some(n)
    }
}
