// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chromaticity of X, Y and Z: u', v', the correlated colour temperature and Duv.
//!
//! u' = 4 X / (X + 15 Y + 3 Z), v' = 9 Y / (X + 15 Y + 3 Z) (CIE 1976; CIE 015:2018). The correlated
//! colour temperature is that of the nearest Planckian radiator in the plane (u', ⅔ v') (CIE
//! 015:2018, 9.5), and Duv the distance to it there, positive above the locus (Y. Ohno, LEUKOS 10
//! (2014) 47). As there, the locus is a table, here in steps of 0.25 %, and the nearest point that of
//! a parabola through squared distances at three rows. Both are stated from 1000 to 20 000 K and up
//! to |Duv| = 0.05; farther away a temperature names no colour.

use std::sync::LazyLock;

use super::{Estimate, Grouped, colour_matching};

/// Temperatures of radiators that are stated, K.
pub const RANGE_K: [f64; 2] = [1000.0, 20_000.0];
/// Largest |Duv| at which they are.
pub const MAX_DUV: f64 = 0.05;
/// Largest standard error of X + 15 Y + 3 Z, over its value, of light whose colour is stated: fewer
/// than some 25 paths may all be of one wavelength and show no scatter.
pub const MAX_RELATIVE_ERROR: f64 = 0.2;

/// Step of the logarithm of the temperature from row to row.
const STEP: f64 = 0.0025;
/// Second radiation constant, nm K (CIE 015:2018; ITS-90).
const C2: f64 = 1.4388e7;

/// Points (u, v) of the Planckian locus, from a row below [`RANGE_K`] to one above.
static LOCUS: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let rows = ((RANGE_K[1] / RANGE_K[0]).ln() / STEP).ceil() as i32 + 1;
    (-1..=rows).map(|row| of_radiator(RANGE_K[0] * (STEP * f64::from(row)).exp())).collect()
});

/// (u, v) of a radiator.
fn of_radiator(kelvin: f64) -> [f64; 2] {
    let [u, v] = uv(radiator(kelvin)).unwrap_or_default();
    [u, v / 1.5]
}

/// X, Y and Z of a radiator, up to a factor, by sums over the rows of the table.
fn radiator(kelvin: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for nm in colour_matching::knots_nm() {
        let power = (nm / 560.0).powi(-5) / (C2 / (nm * kelvin)).exp_m1();
        for (sum, matching) in sum.iter_mut().zip(colour_matching::xyz(nm)) {
            *sum += power * matching;
        }
    }
    sum
}

/// Least and most of x, y, u' and v' of any light: those of the spectral colours, between which all
/// others lie.
static LIMITS: LazyLock<[[f64; 2]; 4]> = LazyLock::new(|| {
    let colours = colour_matching::knots_nm().map(colour_matching::xyz);
    let places = colours.filter_map(|xyz| Some([xy(xyz)?, uv(xyz)?].concat()));
    let none = [[f64::INFINITY, f64::NEG_INFINITY]; 4];
    places.fold(none, |all, at| [0, 1, 2, 3].map(|k| [all[k][0].min(at[k]), all[k][1].max(at[k])]))
});

/// Least and most of x, y, u' and v'.
pub fn limits() -> [[f64; 2]; 4] {
    *LIMITS
}

/// u' and v' of X, Y and Z; `None` of no light.
pub fn uv([x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let sum = x + 15.0 * y + 3.0 * z;
    (sum > 0.0).then(|| [4.0 * x / sum, 9.0 * y / sum])
}

/// x and y of X, Y and Z; `None` of no light.
pub fn xy([x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let sum = x + y + z;
    (sum > 0.0).then(|| [x / sum, y / sum])
}

/// X, Y and Z of x and y, with Y = 1.
pub fn xyz_of_xy([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// Temperatures at which [`white_of`] gives daylight, K.
pub const DAYLIGHT_K: [f64; 2] = [4000.0, 25_000.0];

/// x and y of the white of a temperature: from 4000 to 25 000 K that of daylight (CIE 015:2018,
/// 4.1.2; 6504 K is D65), from 1000 to 4000 K that of the Planckian radiator; `None` beyond.
pub fn white_of(kelvin: f64) -> Option<[f64; 2]> {
    let t = 1e3 / kelvin;
    let cubic = |[a, b, c, d]: [f64; 4]| a + t * (b + t * (c + t * d));
    let x = match kelvin {
        k if (RANGE_K[0]..DAYLIGHT_K[0]).contains(&k) => return xy(radiator(k)),
        k if (DAYLIGHT_K[0]..=7000.0).contains(&k) => cubic([0.244_063, 0.099_11, 2.9678, -4.6070]),
        k if (7000.0..=DAYLIGHT_K[1]).contains(&k) => cubic([0.237_040, 0.247_48, 1.9018, -2.0064]),
        _ => return None,
    };
    Some([x, -3.0 * x * x + 2.870 * x - 0.275])
}

/// Correlated colour temperature, K, and Duv of u' and v'; `None` where they are not stated.
pub fn correlated([u, v]: [f64; 2]) -> Option<[f64; 2]> {
    let at = [u, v / 1.5];
    let square = |row: usize| {
        let [du, dv] = [0, 1].map(|k| at[k] - LOCUS[row][k]);
        du * du + dv * dv
    };
    let nearest = (0..LOCUS.len()).min_by(|a, b| square(*a).total_cmp(&square(*b)))?;
    if nearest == 0 || nearest + 1 == LOCUS.len() {
        return None;
    }
    let [before, here, after] = [nearest - 1, nearest, nearest + 1].map(square);
    let part = 0.5 * (before - after) / (before - 2.0 * here + after);
    let kelvin = RANGE_K[0] * (STEP * (nearest as f64 - 1.0 + part)).exp();
    // The foot and the tangent there, through the same three rows.
    let [a, b, c] = [nearest - 1, nearest, nearest + 1].map(|row| LOCUS[row]);
    let foot = [0, 1]
        .map(|k| b[k] + part * (0.5 * (c[k] - a[k]) + 0.5 * part * (a[k] - 2.0 * b[k] + c[k])));
    let along = [0, 1].map(|k| 0.5 * (c[k] - a[k]) + part * (a[k] - 2.0 * b[k] + c[k]));
    let [du, dv] = [0, 1].map(|k| at[k] - foot[k]);
    // Towards higher temperatures the locus runs to smaller u: above it lies right of the way.
    let duv = (du * along[1] - dv * along[0]) / along[0].hypot(along[1]);
    let is_stated = (RANGE_K[0]..=RANGE_K[1]).contains(&kelvin) && duv.abs() <= MAX_DUV;
    is_stated.then_some([kelvin, duv])
}

/// u', v', correlated colour temperature and Duv of X, Y and Z; NaN of what is not stated.
pub fn figures(xyz: [f64; 3]) -> [f64; 4] {
    let Some([u, v]) = uv(xyz) else { return [f64::NAN; 4] };
    let [kelvin, duv] = correlated([u, v]).unwrap_or([f64::NAN; 2]);
    [u, v, kelvin, duv]
}

/// X, Y and Z with the covariances of their errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tristimulus {
    /// X, Y and Z.
    pub xyz: [f64; 3],
    /// Covariances XX, XY, XZ, YY, YZ, ZZ.
    pub covariance: [f64; 6],
}

/// Pairs of the covariances, and the place of each.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];
const PLACES: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

impl Tristimulus {
    /// Every bin, from groups of X, Y and Z.
    pub fn of_bins(colours: &[Grouped; 3]) -> Vec<Self> {
        let groups = colours[0].count();
        let n = groups as f64;
        let of = |bin: usize| {
            let xyz = [0, 1, 2].map(|k| colours[k].total()[bin]);
            let mut covariance = [0.0; 6];
            for g in 0..groups {
                let off = [0, 1, 2].map(|k| colours[k].group(g)[bin] - xyz[k] / n);
                for (sum, [i, j]) in covariance.iter_mut().zip(PAIRS) {
                    *sum += off[i] * off[j] * n / (n - 1.0);
                }
            }
            Self { xyz, covariance }
        };
        (0..colours[0].total().len()).map(of).collect()
    }

    /// The same in a unit that is smaller by `factor`.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            xyz: self.xyz.map(|v| v * factor),
            covariance: self.covariance.map(|v| v * factor * factor),
        }
    }

    /// X, Y and Z, then the covariances.
    pub fn numbers(&self) -> [f64; 9] {
        std::array::from_fn(|k| if k < 3 { self.xyz[k] } else { self.covariance[k - 3] })
    }

    /// Covariance of two sums over X, Y and Z.
    fn covariance_of(&self, a: [f64; 3], b: [f64; 3]) -> f64 {
        let pairs = (0..3).flat_map(|i| (0..3).map(move |j| [i, j]));
        pairs.map(|[i, j]| a[i] * b[j] * self.covariance[PLACES[i][j]]).sum()
    }

    /// True if there is enough light to state its colour ([`MAX_RELATIVE_ERROR`]).
    pub fn is_known(&self) -> bool {
        const SUM: [f64; 3] = [1.0, 15.0, 3.0];
        let sum: f64 = (0..3).map(|k| SUM[k] * self.xyz[k]).sum();
        let error = self.covariance_of(SUM, SUM).max(0.0).sqrt();
        sum > 0.0 && error <= MAX_RELATIVE_ERROR * sum
    }

    /// u' and v' with errors to first order; `None` of light that is not known.
    pub fn chromaticity(&self) -> Option<Chromaticity> {
        if !self.is_known() {
            return None;
        }
        let [x, y, z] = self.xyz;
        let sum = x + 15.0 * y + 3.0 * z;
        let [u, v] = uv(self.xyz)?;
        // ∂u'/∂X = (4 - u')/S, and so on.
        let du = [(4.0 - u) / sum, -15.0 * u / sum, -3.0 * u / sum];
        let dv = [-v / sum, (9.0 - 15.0 * v) / sum, -3.0 * v / sum];
        let of = |a, b| self.covariance_of(a, b);
        Some(Chromaticity { uv: [u, v], covariance: [of(du, du), of(du, dv), of(dv, dv)] })
    }
}

/// u' and v' with the covariances of their errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chromaticity {
    /// u' and v'.
    pub uv: [f64; 2],
    /// Covariances u'u', u'v', v'v'.
    pub covariance: [f64; 3],
}

impl Chromaticity {
    /// u' and v'.
    pub fn estimates(&self) -> [Estimate; 2] {
        let error = |k: usize| self.covariance[k].max(0.0).sqrt();
        [Estimate::new(self.uv[0], error(0)), Estimate::new(self.uv[1], error(2))]
    }

    /// Root mean square length of the error in the plane (u', v').
    pub fn error(&self) -> f64 {
        (self.covariance[0] + self.covariance[2]).max(0.0).sqrt()
    }

    /// Correlated colour temperature and Duv, with errors to first order; `None` where they are not
    /// stated.
    pub fn correlated(&self) -> Option<[Estimate; 2]> {
        const STEP: f64 = 1e-5;
        let values = correlated(self.uv)?;
        let mut slopes = [[0.0; 2]; 2];
        for k in 0..2 {
            let at = |side: f64| {
                let mut moved = self.uv;
                moved[k] += side * STEP;
                correlated(moved)
            };
            let (low, high) = (at(-1.0)?, at(1.0)?);
            for (slope, (low, high)) in slopes.iter_mut().zip(low.into_iter().zip(high)) {
                slope[k] = (high - low) / (2.0 * STEP);
            }
        }
        let [uu, uv, vv] = self.covariance;
        let error = |[a, b]: [f64; 2]| a * a * uu + 2.0 * a * b * uv + b * b * vv;
        Some([0, 1].map(|k| Estimate::new(values[k], error(slopes[k]).max(0.0).sqrt())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends of the spectral locus (CIE 015:2018), at 404, 504, 521 and 531 nm and beyond 700 nm.
    #[test]
    fn all_light_lies_within_the_spectral_colours() {
        let printed = [[0.0036, 0.7347], [0.0048, 0.8338], [0.0014, 0.6234], [0.0159, 0.5868]];
        for (found, printed) in limits().iter().zip(printed) {
            assert!((0..2).all(|k| (found[k] - printed[k]).abs() < 2e-3), "{found:?} {printed:?}");
        }
        let all = limits();
        for kelvin in [1000.0, 6504.0, 25_000.0].map(white_of) {
            let xy = kelvin.expect("a white");
            assert!((0..2).all(|k| xy[k] > all[k][0] && xy[k] < all[k][1]), "{xy:?}");
        }
    }

    /// x, y and the temperature of CIE 015:2018, tables 3 and 11 (FL2, FL4, FL7 and FL11, printed to
    /// 10 K), and of D50 and D75 there; Duv of D65 and of the equal-energy light E follows from the
    /// definition (Ohno 2014 gives 0.0032 for D65).
    #[test]
    fn temperatures_of_illuminants_are_the_published_ones() {
        for (name, xy, kelvin, duv) in [
            ("A", [0.447_58, 0.407_45], 2855.5, Some(0.0)),
            ("D50", [0.345_67, 0.358_51], 5003.0, Some(0.0032)),
            ("D65", [0.312_72, 0.329_03], 6504.0, Some(0.0032)),
            ("D75", [0.299_03, 0.314_88], 7504.0, Some(0.0032)),
            ("E", [1.0 / 3.0, 1.0 / 3.0], 5455.0, Some(-0.0044)),
            ("FL2", [0.3721, 0.3751], 4230.0, None),
            ("FL4", [0.4402, 0.4031], 2940.0, None),
            ("FL7", [0.3129, 0.3292], 6500.0, None),
            ("FL11", [0.3805, 0.3769], 4000.0, None),
        ] {
            let [_, _, found, of] = figures(xyz_of_xy(xy));
            // Half a step of the last digit of x and y is some 5 K there.
            let printed = if duv.is_some() { 2.0 } else { 10.0 };
            assert!((found - kelvin).abs() < printed, "{name}: {found} K");
            assert!(duv.is_none_or(|duv| (of - duv).abs() < 1.5e-4), "{name}: {of}");
        }
        for (xy, printed) in
            [([0.312_72, 0.329_03], [0.1978, 0.4683]), ([1.0 / 3.0, 1.0 / 3.0], [0.2105, 0.4737])]
        {
            let found = uv(xyz_of_xy(xy)).expect("lit");
            assert!((0..2).all(|k| (found[k] - printed[k]).abs() < 6e-5), "{found:?}");
        }
    }

    /// Isotemperature lines of A. R. Robertson, J. Opt. Soc. Am. 58 (1968) 1528: micro reciprocal
    /// degree, u, v on the locus, and the slope dv/du of the line. A colour on the line has its
    /// temperature.
    #[test]
    fn colours_beside_the_locus_have_the_temperature_of_robertsons_lines() {
        for (mired, u, v, slope) in [
            (60.0, 0.184_94, 0.280_21, -0.351_56),
            (100.0, 0.190_32, 0.293_26, -0.478_88),
            (200.0, 0.211_42, 0.323_12, -1.0182),
            (300.0, 0.240_10, 0.343_08, -2.0637),
            (400.0, 0.272_18, 0.354_07, -4.3633),
            (500.0, 0.305_05, 0.359_07, -11.324),
        ] {
            let kelvin = 1e6 / mired;
            for duv in [-0.03, -0.01, 0.0, 0.01, 0.03] {
                let length = f64::hypot(1.0, slope);
                // Above the locus v is larger.
                let at = [u - duv / length, v - duv * slope / length];
                let [found, of] = correlated([at[0], 1.5 * at[1]]).expect("stated");
                // The table has five digits; that is 1.5e-3 of a temperature of 20 000 K.
                assert!((found / kelvin - 1.0).abs() < 2e-3, "{mired} {duv}: {found} K");
                assert!((of - duv).abs() < 2e-5, "{mired} {duv}: {of}");
            }
        }
    }

    /// D55, D65 and D75 of CIE 015:2018, table 3; illuminant A by its definition at 2855.5 K.
    #[test]
    fn whites_of_temperatures_are_the_published_ones() {
        for (kelvin, [x, y]) in [
            (5503.0, [0.332_43, 0.347_44]),
            (6504.0, [0.312_72, 0.329_03]),
            (7504.0, [0.299_03, 0.314_88]),
            (2855.5, [0.447_58, 0.407_45]),
        ] {
            let found = white_of(kelvin).expect("stated");
            assert!((found[0] - x).abs() < 1.2e-4 && (found[1] - y).abs() < 1.2e-4, "{found:?}");
        }
        assert_eq!([999.0, 25_001.0, f64::NAN].map(white_of), [None; 3]);
        // Both parts of the daylight locus meet, and whites have the temperature that names them.
        for kelvin in [1000.5, 3999.0, 4001.0, 6999.9, 7000.1, 15_000.0] {
            let [_, _, found, _] = figures(xyz_of_xy(white_of(kelvin).expect("stated")));
            assert!((found / kelvin - 1.0).abs() < 2e-3, "{kelvin}: {found}");
        }
    }

    #[test]
    fn radiators_have_their_own_temperature() {
        for kelvin in [1000.5, 1234.5, 2700.0, 5432.1, 12_345.0, 19_990.0] {
            let [u, v] = of_radiator(kelvin);
            let [found, duv] = correlated([u, 1.5 * v]).expect("stated");
            assert!((found / kelvin - 1.0).abs() < 1e-5 && duv.abs() < 1e-7, "{kelvin}: {found}");
        }
        // Too cold, too hot, too far from the locus, and no light.
        for kelvin in [950.0, 25_000.0] {
            let [u, v] = of_radiator(kelvin);
            assert_eq!(correlated([u, 1.5 * v]), None, "{kelvin}");
        }
        assert_eq!(correlated([0.15, 0.55]), None);
        assert!(figures([0.0; 3]).iter().all(|v| v.is_nan()));
    }

    /// First-order errors beside the scatter of samples.
    #[test]
    fn errors_hold_the_covariances() {
        let mut rng = tracer::random::stream(17, 0);
        let mut normal = || (0..12).map(|_| tracer::random::unit(&mut rng)).sum::<f64>() - 6.0;
        let white = xyz_of_xy([0.36, 0.36]);
        // What X, Y and Z have in common moves no colour.
        let mut draw = || {
            let common = 0.1 * normal();
            [0, 1, 2].map(|k| white[k] * (1.0 + common + 0.01 * normal()))
        };
        let samples: Vec<[f64; 3]> = (0..4000).map(|_| draw()).collect();
        let of = |k: usize| Grouped::new(samples.iter().map(|s| vec![s[k] / 4000.0]).collect());
        let all = Tristimulus::of_bins(&[0, 1, 2].map(of))[0];
        let found = all.chromaticity().expect("lit");
        let scatter = |value: &dyn Fn([f64; 3]) -> f64| {
            let values: Vec<f64> = samples.iter().map(|s| value(*s)).collect();
            let mean = values.iter().sum::<f64>() / 4000.0;
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4000.0).sqrt()
                / 4000f64.sqrt()
        };
        let [u, v] = found.estimates();
        let [kelvin, duv] = found.correlated().expect("stated");
        for (k, estimate) in [u, v, kelvin, duv].into_iter().enumerate() {
            let expected = scatter(&|xyz| figures(xyz)[k]);
            let ratio = estimate.standard_error / expected;
            assert!((ratio - 1.0).abs() < 0.05, "{k}: {ratio}");
        }
        assert!(u.standard_error < 0.2 * 0.1 * u.value / 4000f64.sqrt() * 10.0);
    }

    #[test]
    fn a_few_paths_have_no_colour() {
        let one = |lit: usize| {
            let of = |_| Grouped::new((0..16).map(|g| vec![f64::from(g < lit)]).collect());
            Tristimulus::of_bins(&[0, 1, 2].map(of))[0]
        };
        assert_eq!(one(1).chromaticity(), None);
        assert_eq!(one(0).chromaticity(), None);
        assert!(one(16).chromaticity().is_some());
    }
}
