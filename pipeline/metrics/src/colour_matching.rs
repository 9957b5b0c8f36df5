// SPDX-License-Identifier: MIT OR Apache-2.0
//! The colour-matching functions of the standard observer CIE 1931, 2° field.
//!
//! Source of the values: `data/spectra/x_bar.csv` and `z_bar.csv` (CIE 015:2018); ȳ is V(λ),
//! [`photopic`].

use std::sync::LazyLock;

use super::{columns, photopic};

/// Rows (wavelength nm, value), ascending.
type Rows = LazyLock<Vec<[f64; 2]>>;

static X_BAR: Rows =
    LazyLock::new(|| columns::rows(include_str!("../../../data/spectra/x_bar.csv")));
static Z_BAR: Rows =
    LazyLock::new(|| columns::rows(include_str!("../../../data/spectra/z_bar.csv")));

/// x̄, ȳ and z̄ at a wavelength, linear between rows; 0 outside [`photopic::range_nm`].
pub fn xyz(wavelength_nm: f64) -> [f64; 3] {
    let x = columns::linear(&X_BAR, wavelength_nm);
    let z = columns::linear(&Z_BAR, wavelength_nm);
    [x, photopic::v(wavelength_nm), z]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums from 380 to 780 nm as CIE 015 prints them below the tables.
    #[test]
    fn the_tables_are_those_of_the_standard() {
        assert_eq!((X_BAR.len(), Z_BAR.len()), (95, 95));
        let sum = |k: usize| -> f64 {
            let rows = (0..81).map(|row| 380.0 + 5.0 * f64::from(row));
            rows.map(|nm| xyz(nm)[k]).sum()
        };
        for (k, printed) in [21.3714, 21.3711, 21.3715].into_iter().enumerate() {
            assert!((sum(k) - printed).abs() < 4e-4, "{k}: {}", sum(k));
        }
        assert_eq!([xyz(359.0), xyz(831.0)], [[0.0; 3]; 2]);
    }

    /// Planck's radiator at 2856 K is illuminant A: x = 0.44758, y = 0.40745 (CIE 015:2018, table
    /// 3).
    #[test]
    fn a_radiator_has_the_chromaticity_of_illuminant_a() {
        let mut sum = [0.0; 3];
        for step in 0..=470 {
            let nm = 360.0 + f64::from(step);
            // The ratio 1.435e-2 m K / 2848 K, with which A is defined.
            let power = (nm / 560.0).powi(-5) / ((1.435e7 / (2848.0 * nm)).exp() - 1.0);
            for (sum, matching) in sum.iter_mut().zip(xyz(nm)) {
                *sum += power * matching;
            }
        }
        let all: f64 = sum.iter().sum();
        assert!((sum[0] / all - 0.447_58).abs() < 5e-5, "{}", sum[0] / all);
        assert!((sum[1] / all - 0.407_45).abs() < 5e-5, "{}", sum[1] / all);
    }
}
