// SPDX-License-Identifier: MIT OR Apache-2.0
//! The largest distance between the chromaticities of any two of some points, parts or directions, and
//! that of colours to one of them.
//!
//! Δu'v' = ((Δu')² + (Δv')²)^½, in which colour uniformity of displays is stated (IDMS 1.2, 8.1);
//! ΔE_ITP, in which errors of pictures are ([`itp`]).
//!
//! Noise makes every distance larger, and the largest of them more so. The distance that one half of
//! the paths finds, read in the other half along its direction between the same points, lies below
//! the true one. As with the extremes of maps ([`super::uniformity_forms`]) the reported value is the
//! middle of both, half their distance bounds its bias, and the scatter is that of halves.

use super::chromaticity::uv;
use super::halves::picked;
use super::{Estimate, Grouped, itp};

/// Distances up to it are rounding of sums over bins, and the points of one chromaticity.
const ROUNDING: f64 = 1e-12;

/// X, Y and Z of every point, one point after the other.
type Tristimulus = [f64];

/// The largest distance between two points; `None` with a dark one.
pub fn plain(values: &Tristimulus) -> Option<f64> {
    let colours = chromaticities(values)?;
    Some(farthest(&colours).map_or(0.0, |pair| length(between(&colours, pair))))
}

/// The same with its error, from groups of paths; `None` if a point is dark in half of them.
pub fn estimate(values: &Grouped) -> Option<Estimate> {
    let pick = |values: &Tristimulus| {
        let colours = chromaticities(values)?;
        let pair = farthest(&colours)?;
        Some((pair, between(&colours, pair)))
    };
    // Along the difference that was picked.
    let read = |picked: &Option<([usize; 2], [f64; 2])>, values: &Tristimulus| {
        let Some(colours) = chromaticities(values) else { return f64::NAN };
        picked.map_or(0.0, |(pair, [u, v])| {
            let [s, t] = between(&colours, pair);
            (u * s + v * t) / length([u, v])
        })
    };
    Some(picked(values, pick, read)).filter(|found| found.standard_error.is_finite())
}

/// Coordinates of X, Y and Z in which the difference of colours is a distance; `None` of no light.
pub type Coordinates = fn([f64; 3]) -> Option<[f64; 3]>;

/// u' and v', of Δu'v'.
pub const IN_UV: Coordinates = |xyz| uv(xyz).map(|[u, v]| [u, v, 0.0]);
/// 720 (I, T, P), of ΔE_ITP; X, Y and Z in cd/m².
pub const IN_ITP: Coordinates = |xyz| Some(itp::coordinates(xyz));

/// The largest distance of a point to the last one, with its error, from groups of paths; `None` if a
/// point is dark in half of them, or of fewer than two points. Points are best no smaller than what
/// an eye tells apart, such as zones: every one is read in every half.
pub fn from_last(values: &Grouped, coordinates: Coordinates) -> Option<Estimate> {
    let points = values.total().len() / 3;
    let at = |values: &Tristimulus, point: usize| {
        let xyz = values.as_chunks::<3>().0.get(point)?;
        coordinates(*xyz)
    };
    let last = points.checked_sub(1).filter(|last| *last > 0)?;
    let difference = |values: &Tristimulus, point: usize| {
        let [a, b] = [at(values, point)?, at(values, last)?];
        Some([0, 1, 2].map(|k| a[k] - b[k]))
    };
    let product = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
    let pick = |values: &Tristimulus| {
        let origin = at(values, last)?;
        let mut far = (-1.0, 0, [0.0; 3]);
        for point in 0..last {
            let here = at(values, point)?;
            let along = [0, 1, 2].map(|k| here[k] - origin[k]);
            let square = product(along, along);
            if square > far.0 {
                far = (square, point, along);
            }
        }
        Some((far.1, far.2))
    };
    // Along the difference that was picked.
    let read = |picked: &Option<(usize, [f64; 3])>, values: &Tristimulus| {
        let read = || {
            let (point, along) = (*picked)?;
            let length = product(along, along).sqrt();
            let found = difference(values, point)?;
            Some(if length <= ROUNDING { 0.0 } else { product(found, along) / length })
        };
        read().unwrap_or(f64::NAN)
    };
    Some(picked(values, pick, read)).filter(|found| found.standard_error.is_finite())
}

fn chromaticities(values: &Tristimulus) -> Option<Vec<[f64; 2]>> {
    let (points, _) = values.as_chunks::<3>();
    points.iter().map(|xyz| uv(*xyz)).collect()
}

/// The two points that lie farthest apart, corners of the convex hull; `None` where all are of one
/// chromaticity.
fn farthest(colours: &[[f64; 2]]) -> Option<[usize; 2]> {
    let corners = hull(colours);
    let pairs = (0..corners.len()).flat_map(|i| (0..i).map(move |j| [i, j]));
    let pairs = pairs.map(|pair| pair.map(|k| corners[k]));
    let far =
        pairs.max_by(|a, b| length(between(colours, *a)).total_cmp(&length(between(colours, *b))));
    far.filter(|pair| length(between(colours, *pair)) > ROUNDING)
}

/// Corners of the convex hull (A. M. Andrew, Inf. Process. Lett. 9 (1979) 216).
fn hull(points: &[[f64; 2]]) -> Vec<usize> {
    let at = |k: usize| points[k];
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| {
        at(*a)[0].total_cmp(&at(*b)[0]).then_with(|| at(*a)[1].total_cmp(&at(*b)[1]))
    });
    let turns_left = |a: usize, b: usize, c: usize| {
        let [p, q] = [between(points, [b, a]), between(points, [c, a])];
        p[0] * q[1] - p[1] * q[0] > 0.0
    };
    let chain = |order: &mut dyn Iterator<Item = usize>| {
        let mut chain: Vec<usize> = Vec::new();
        for k in order {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, k)
            {
                chain.pop();
            }
            chain.push(k);
        }
        chain
    };
    let mut corners = chain(&mut order.iter().copied());
    corners.extend(chain(&mut order.iter().rev().copied()));
    corners.sort_unstable();
    corners.dedup();
    corners
}

fn between(colours: &[[f64; 2]], [i, j]: [usize; 2]) -> [f64; 2] {
    [0, 1].map(|k| colours[i][k] - colours[j][k])
}

fn length([u, v]: [f64; 2]) -> f64 {
    u.hypot(v)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// X, Y and Z of a chromaticity, for Y = 1.
    fn xyz([u, v]: [f64; 2]) -> [f64; 3] {
        let sum = 9.0 / v;
        [0.25 * u * sum, 1.0, (sum - 0.25 * u * sum - 15.0) / 3.0]
    }

    fn grouped(colours: &[[f64; 2]], noise: f64) -> Grouped {
        let mut rng = tracer::random::stream(11, 0);
        let mut normal = || {
            let twelve = (0..12).map(|_| tracer::random::unit(&mut rng));
            twelve.sum::<f64>() - 6.0
        };
        let values: Vec<f64> = colours.iter().flat_map(|uv| xyz(*uv)).collect();
        let group = |_| {
            let noisy = values.iter().map(|v| v * (1.0 + 8.0 * noise * normal()) / 64.0);
            noisy.collect()
        };
        Grouped::new((0..64).map(group).collect())
    }

    #[test]
    fn points_of_one_chromaticity_differ_by_nothing() {
        let of = |group: usize| {
            // The same light, in sums that round differently.
            let scale = |point: usize| 0.1 + 1.0 / (3.0 + (group + 7 * point) as f64);
            let point = |point: usize| xyz([0.21, 0.47]).map(|value| value * scale(point));
            (0..9).flat_map(point).collect::<Vec<f64>>()
        };
        let grouped = Grouped::new((0..64).map(of).collect());
        let found = estimate(&grouped).expect("no point is dark");
        assert_eq!((found.value, found.standard_error), (0.0, 0.0));
        assert_eq!(plain(grouped.total()), Some(0.0));
    }

    /// Illuminants A and D65 (u', v' of CIE 015:2018, table 3) lie 0.0818 apart.
    #[test]
    fn two_illuminants_are_as_far_apart_as_published() {
        let (a, d65): ([f64; 2], [f64; 2]) = ([0.2560, 0.5243], [0.1978, 0.4683]);
        let mut colours = vec![[0.22, 0.49]; 9];
        (colours[2], colours[7]) = (a, d65);
        let expected = (a[0] - d65[0]).hypot(a[1] - d65[1]);
        let values: Vec<f64> = colours.iter().flat_map(|uv| xyz(*uv)).collect();
        let found = plain(&values).expect("lit");
        assert!((found - expected).abs() < 1e-12, "{found}");
        let white = xyz(d65);
        let all: f64 = white.iter().sum();
        assert!((white[0] / all - 0.3127).abs() < 2e-4, "{}", white[0] / all);
        let estimate = estimate(&grouped(&colours, 1e-3)).expect("lit");
        let error = estimate.standard_error + estimate.bias_bound.unwrap_or(0.0);
        assert!((estimate.value - expected).abs() < 3.0 * error, "{estimate:?}");
        assert!(error < 2e-3, "{error}");
    }

    /// A ramp whose colour runs off its white: the largest Δu'v' is that of its far end, and ΔE_ITP that
    /// of [`itp::difference`]. Of one colour, noise alone is no difference.
    #[test]
    fn a_ramp_differs_from_its_white_by_its_far_end() {
        let ramp: Vec<[f64; 2]> = (0..9)
            .map(|k| [0.2 + 0.0005 * f64::from(8 - k), 0.47 - 0.001 * f64::from(8 - k)])
            .collect();
        let expected = 0.004f64.hypot(0.008);
        let itp = itp::difference(xyz(ramp[0]).map(|v| 100.0 * v), xyz(ramp[8]).map(|v| 100.0 * v));
        let bright = |values: Grouped| values.map(|all| all.iter().map(|v| 100.0 * v).collect());
        let exact = bright(Grouped::new(vec![
            ramp.iter()
                .flat_map(|uv| xyz(*uv))
                .map(|v| v / 2.0)
                .collect();
            2
        ]));
        let noisy = bright(grouped(&ramp, 1e-4));
        for (coordinates, expected) in [(IN_UV, expected), (IN_ITP, itp)] {
            let found = from_last(&exact, coordinates).expect("lit");
            assert!((found.value - expected).abs() < 1e-9 * expected, "{found:?}");
            let found = from_last(&noisy, coordinates).expect("lit");
            assert!(found.standard_error > 0.0 && found.standard_error < 0.1 * expected);
            assert!((found.value - expected).abs() < 3.0 * found.standard_error, "{found:?}");
        }
        let even = from_last(&grouped(&[[0.2, 0.48]; 9], 1e-3), IN_UV).expect("lit");
        assert!(even.value <= even.bias_bound.unwrap_or(0.0) + 2.0 * even.standard_error);
        let one = Grouped::new(vec![vec![1.0; 3]; 4]);
        assert_eq!(from_last(&one, IN_UV), None);
    }

    /// Noise alone makes a difference that lies within error and bound of none.
    #[test]
    fn one_colour_has_no_difference_that_could_be_told() {
        let even = vec![[0.2, 0.48]; 9];
        let values: Vec<f64> = even.iter().flat_map(|uv| xyz(*uv)).collect();
        assert_eq!(plain(&values), Some(0.0));
        let noisy = estimate(&grouped(&even, 1e-3)).expect("lit");
        let bound = noisy.bias_bound.unwrap_or(0.0);
        assert!(noisy.value <= bound + 2.0 * noisy.standard_error, "{noisy:?}");
    }

    #[test]
    fn the_hull_holds_the_farthest_pair() {
        let mut rng = tracer::random::stream(23, 0);
        for count in [1, 2, 3, 60] {
            let mut draw = || (8.0 * tracer::random::unit(&mut rng)).floor() / 8.0;
            // Some points are one, many lie on lines.
            let points: Vec<[f64; 2]> = (0..count).map(|_| [draw(), draw()]).collect();
            let pairs = (0..count).flat_map(|i| (0..i).map(move |j| [i, j]));
            let expected = pairs.map(|pair| length(between(&points, pair))).fold(0.0, f64::max);
            let found = farthest(&points).map_or(0.0, |pair| length(between(&points, pair)));
            assert!((found - expected).abs() < 1e-15, "{count}: {found} {expected}");
        }
    }

    #[test]
    fn a_dark_point_has_no_colour() {
        let mut values: Vec<f64> = [[0.2, 0.48]; 9].iter().flat_map(|uv| xyz(*uv)).collect();
        values[3..6].fill(0.0);
        assert_eq!(plain(&values), None);
    }
}
