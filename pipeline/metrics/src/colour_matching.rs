// SPDX-License-Identifier: MIT OR Apache-2.0
//! The colour-matching functions of the standard observer CIE 1931, 2° field; ȳ is V(λ), the
//! spectral luminous efficiency for photopic vision (CIE 1924).
//!
//! Source of the values: `data/spectra/cie_1931.csv` (ISO/CIE 11664-1:2019; CIE 018:2019).

use std::sync::LazyLock;

/// Rows (wavelength nm, x̄, ȳ, z̄), ascending. A row that is no row would be missing from the sums that
/// a test reads.
static ROWS: LazyLock<Vec<[f64; 4]>> = LazyLock::new(|| {
    let row = |line: &str| {
        let cells: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
        <[f64; 4]>::try_from(cells.ok()?).ok()
    };
    include_str!("../../../data/spectra/cie_1931.csv").lines().filter_map(row).collect()
});

/// Wavelengths of the rows, nm.
pub fn knots_nm() -> impl Iterator<Item = f64> {
    ROWS.iter().map(|row| row[0])
}

/// First and last wavelength at which the functions are given, nm.
pub fn range_nm() -> [f64; 2] {
    [ROWS.first(), ROWS.last()].map(|row| row.map_or(f64::NAN, |row| row[0]))
}

/// x̄, ȳ and z̄ at a wavelength, linear between rows; 0 outside [`range_nm`].
pub fn xyz(wavelength_nm: f64) -> [f64; 3] {
    let after = ROWS.partition_point(|row| row[0] < wavelength_nm);
    match (after.checked_sub(1).map(|i| ROWS[i]), ROWS.get(after)) {
        (Some([x, start @ ..]), Some([end_x, end @ ..])) => {
            let part = (wavelength_nm - x) / (end_x - x);
            [0, 1, 2].map(|k| start[k] + (end[k] - start[k]) * part)
        }
        // The first row itself has none before it.
        (None, Some([x, first @ ..])) if *x <= wavelength_nm => *first,
        _ => [0.0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums as CIE 015 prints them below the tables: every 5 nm from 380 to 780 nm.
    #[test]
    fn the_table_is_that_of_the_standard() {
        assert_eq!((ROWS.len(), range_nm()), (471, [360.0, 830.0]));
        let sum = |k: usize| -> f64 {
            let rows = (0..81).map(|row| 380.0 + 5.0 * f64::from(row));
            rows.map(|nm| xyz(nm)[k]).sum()
        };
        for (k, printed) in [21.3714, 21.3711, 21.3715].into_iter().enumerate() {
            assert!((sum(k) - printed).abs() < 4e-4, "{k}: {}", sum(k));
        }
        // Below the table of every nanometre stand these sums; the largest ȳ is 1, at 555 nm.
        for (k, printed) in [106.8655, 106.8569, 106.8922].into_iter().enumerate() {
            let sum: f64 = ROWS.iter().map(|row| row[k + 1]).sum();
            assert!((sum - printed).abs() < 1e-3, "{k}: {sum}");
        }
        let brightest = knots_nm().max_by(|a, b| xyz(*a)[1].total_cmp(&xyz(*b)[1]));
        assert_eq!((brightest, xyz(555.0)[1]), (Some(555.0), 1.0));
        assert_eq!([xyz(359.999), xyz(830.001), xyz(f64::NAN)], [[0.0; 3]; 3]);
        // Rows of ISO/CIE 11664-1 between those of every 5 nm, and a middle.
        for (nm, v) in [(452.0, 0.041_768), (412.0, 0.001_530_752), (360.0, 3.917e-6)] {
            assert!((xyz(nm)[1] - v).abs() < 1e-15, "{nm}");
        }
        assert!((xyz(557.5)[1] - 0.5 * (xyz(557.0)[1] + xyz(558.0)[1])).abs() < 1e-15);
    }

    /// Planck's radiator at 2856 K is illuminant A: x = 0.44758, y = 0.40745 (CIE 015:2018, table
    /// 3).
    #[test]
    fn a_radiator_has_the_chromaticity_of_illuminant_a() {
        let mut sum = [0.0; 3];
        for nm in knots_nm() {
            // The ratio 1.435e-2 m K / 2848 K, with which A is defined.
            let power = (nm / 560.0).powi(-5) / ((1.435e7 / (2848.0 * nm)).exp() - 1.0);
            for (sum, matching) in sum.iter_mut().zip(xyz(nm)) {
                *sum += power * matching;
            }
        }
        let whole: f64 = sum.iter().sum();
        assert!((sum[0] / whole - 0.447_58).abs() < 2e-5, "{}", sum[0] / whole);
        assert!((sum[1] / whole - 0.407_45).abs() < 2e-5, "{}", sum[1] / whole);
    }
}
