// SPDX-License-Identifier: MIT OR Apache-2.0
//! V(λ), the spectral luminous efficiency for photopic vision, and the constant that makes lumens
//! of watts.
//!
//! Source of the values: `data/spectra/photopic.csv` (CIE 1924, 2° field; CIE 018:2019).

use std::sync::LazyLock;

use super::columns;

/// Lumens per watt where V is 1: 683 lm/W at 540 THz (SI brochure, 9th edition), there 555 nm.
pub const LUMENS_PER_WATT: f64 = 683.0;

/// Rows (wavelength nm, V), ascending.
static ROWS: LazyLock<Vec<[f64; 2]>> =
    LazyLock::new(|| columns::rows(include_str!("../../../data/spectra/photopic.csv")));

/// Wavelengths at which V is given, nm.
pub fn knots_nm() -> impl Iterator<Item = f64> {
    ROWS.iter().map(|row| row[0])
}

/// First and last wavelength at which V is given, nm.
pub fn range_nm() -> [f64; 2] {
    let end = |row: Option<&[f64; 2]>| row.map_or(f64::NAN, |r| r[0]);
    [end(ROWS.first()), end(ROWS.last())]
}

/// V at a wavelength, linear between rows; 0 outside [`range_nm`].
pub fn v(wavelength_nm: f64) -> f64 {
    columns::linear(&ROWS, wavelength_nm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_that_of_the_standard() {
        assert_eq!((ROWS.len(), range_nm()), (95, [360.0, 830.0]));
        // Rows that every edition prints, and the sum over all of them: 21.3714 (CIE 015, ȳ every 5
        // nm).
        for (nm, value) in
            [(450.0, 0.038), (510.0, 0.503), (555.0, 1.0), (610.0, 0.503), (700.0, 0.004_102)]
        {
            assert!((v(nm) - value).abs() < 1e-12, "{nm}");
        }
        let sum: f64 = ROWS.iter().map(|row| row[1]).sum();
        assert!((sum - 21.3714).abs() < 5e-5, "{sum}");
    }

    #[test]
    fn between_rows_v_is_linear_and_beyond_them_nothing() {
        assert!((v(557.5) - 0.9975).abs() < 1e-12);
        assert!((v(360.0) - 3.917e-6).abs() < 1e-18 && (v(830.0) - 4.5181e-7).abs() < 1e-18);
        assert!([0.0, 359.999, 830.001, 1e4].iter().all(|&nm| v(nm) == 0.0));
    }
}
