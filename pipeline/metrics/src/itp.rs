// SPDX-License-Identifier: MIT OR Apache-2.0
//! ΔE_ITP, the difference of two colours of displays (ITU-R BT.2124-0): 1 is a just noticeable one,
//! with the eye adapted to either.
//!
//! | step | formula |
//! |---|---|
//! | light of cones | L, M, S of linear BT.2020 red, green, blue, by BT.2100, table 7 |
//! | levels | L', M', S' by PQ ([`Transfer::Pq`]), of absolute luminance |
//! | I, T, P | (L' + M')/2, half of C_T, C_P |
//! | ΔE_ITP | 720 (ΔI² + ΔT² + ΔP²)^½ |

use std::sync::LazyLock;

use super::gamut::{BT2020, D65, Matrix, apply, inverse};
use super::transfer::{PQ_PEAK, Transfer};

/// ΔE of a step of 1 in I.
const SCALE: f64 = 720.0;

/// X, Y and Z in cd/m² to L, M and S over the peak of PQ.
static TO_CONES: LazyLock<Matrix> = LazyLock::new(|| {
    const OF_RGB: Matrix = [[1688.0, 2146.0, 262.0], [683.0, 2951.0, 462.0], [99.0, 309.0, 3688.0]];
    let to_rgb = inverse(&BT2020.to_xyz(D65)).unwrap_or_default();
    OF_RGB.map(|row| {
        [0, 1, 2].map(|j| (0..3).map(|k| row[k] * to_rgb[k][j]).sum::<f64>() / 4096.0 / PQ_PEAK)
    })
});

/// 720 (I, T, P) of X, Y and Z in cd/m², where the distance of two points is ΔE_ITP. Light of cones
/// below 0, which no surface sends, counts as 0.
pub fn coordinates(xyz: [f64; 3]) -> [f64; 3] {
    let [l, m, s] = apply(&TO_CONES, xyz).map(|light| Transfer::Pq.level(light));
    let i = 0.5 * (l + m);
    let t = 0.5 * (6610.0 * l - 13_613.0 * m + 7003.0 * s) / 4096.0;
    let p = (17_933.0 * l - 17_390.0 * m - 543.0 * s) / 4096.0;
    [i, t, p].map(|v| SCALE * v)
}

/// ΔE_ITP of two colours in X, Y and Z, cd/m².
pub fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [a, b] = [a, b].map(coordinates);
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// XYZ_to_ICtCp and delta_E_ITP of colour-science 0.4.7 (PyPI), with BT.2100-2 PQ and the matrix
    /// of BT.2020 about the white 0.3127, 0.3290.
    #[test]
    fn differences_are_those_of_another_code() {
        for (a, b, expected) in [
            ([95.047, 100.0, 108.883], [95.0, 100.0, 108.0], 0.484_614_387_8),
            ([0.0, 0.0, 0.0], [0.0095, 0.01, 0.0109], 15.469_401_787_2),
            ([20.0, 30.0, 10.0], [20.5, 30.0, 10.0], 2.801_489_897_0),
            ([475.0, 500.0, 540.0], [480.0, 500.0, 530.0], 2.803_424_087_1),
            ([0.5, 0.4, 0.3], [0.5, 0.41, 0.3], 1.939_126_057_3),
            ([3000.0, 3200.0, 3500.0], [3100.0, 3200.0, 3500.0], 6.004_651_817_9),
            ([41.0, 21.0, 2.0], [42.0, 22.0, 2.5], 7.025_888_510_7),
            ([36.0, 72.0, 12.0], [36.0, 70.0, 13.0], 4.969_732_296_7),
            ([18.0, 7.0, 95.0], [17.0, 7.0, 90.0], 3.080_033_797_0),
            ([0.001, 0.001, 0.001], [0.1, 0.1, 0.1], 40.480_833_929_2),
        ] {
            let found = difference(a, b);
            assert!((found - expected).abs() < 1e-4 * expected, "{a:?} {b:?}: {found}");
            assert_eq!(found.to_bits(), difference(b, a).to_bits());
            assert!(difference(a, a).abs() < f64::MIN_POSITIVE);
        }
    }

    /// Measured against wanted colours of a display in I, C_T and C_P, in the tests of colour-science for
    /// BT.2124; here by way of their X, Y and Z.
    #[test]
    fn differences_are_those_of_the_test_data_of_bt_2124() {
        let of_cones =
            [[2048.0, 2048.0, 0.0], [6610.0, -13_613.0, 7003.0], [17_933.0, -17_390.0, -543.0]];
        let to_cones = inverse(&of_cones.map(|row| row.map(|v: f64| v / 4096.0))).expect("regular");
        let to_xyz = inverse(&TO_CONES).expect("regular");
        let xyz = |ictcp: [f64; 3]| {
            apply(&to_xyz, apply(&to_cones, ictcp).map(|level| Transfer::Pq.light(level)))
        };
        for (wanted, measured, expected) in [
            (
                [0.488_546_807_2, -0.047_393_506_75, 0.074_754_013_02],
                [0.489_920_323_1, -0.045_675_082_03, 0.073_613_417_75],
                1.426_572_247,
            ),
            (
                [0.753_843_872_7, 0.0, 0.0],
                [0.753_891_224_4, 0.001_930_922_514, -0.000_359_995_595_1],
                0.742_666_805_5,
            ),
            (
                [0.159_617_906_1, 0.0, 0.0],
                [0.160_357_515_2, 0.028_814_448_89, -0.009_908_665_843],
                12.600_962_64,
            ),
            (
                [0.596_565_033_1, -0.208_321_048_2, 0.369_972_971_6],
                [0.596_263_079, -0.162_974_203_3, 0.361_776_702_6],
                17.360_125_52,
            ),
            (
                [0.705_578_751_3, -0.406_373_151_4, -0.072_787_673_82],
                [0.704_694_608_2, -0.377_103_758_6, -0.071_416_267_53],
                10.602_273_27,
            ),
            (
                [0.518_065_261_1, 0.293_242_097_8, -0.187_311_269_5],
                [0.516_709_086_8, 0.298_191_609, -0.182_460_995_3],
                4.040_270_489,
            ),
        ] {
            let found = difference(xyz(wanted), xyz(measured));
            assert!((found - expected).abs() < 1e-6 * expected, "{found} {expected}");
        }
    }

    /// Greys of the white D65 differ in I alone, half of whose steps are those of PQ.
    #[test]
    fn greys_lie_on_one_axis() {
        let grey = |nits: f64| [0.3127 / 0.3290 * nits, nits, 0.3583 / 0.3290 * nits];
        let [i, t, p] = coordinates(grey(203.0));
        assert!((i / 720.0 - Transfer::Pq.level(0.0203)).abs() < 1e-9, "{i}");
        assert!(t.abs() < 1e-6 && p.abs() < 1e-6, "{t} {p}");
        // Light of cones below 0 is none.
        assert!(coordinates([-1.0, 0.0, 0.0]).iter().all(|v| v.is_finite()));
    }
}
