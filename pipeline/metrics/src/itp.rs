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
