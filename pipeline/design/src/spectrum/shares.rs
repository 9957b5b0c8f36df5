// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light at any wavelength, shared by a few: between two by nearness, beyond the first and the last
//! all to that one.

use metrics::colour_matching;

/// The two of `nodes`, ascending, that light of `nm` belongs to, and the share of each.
fn of(nodes: &[f64], nm: f64) -> [(usize, f64); 2] {
    let after = nodes.partition_point(|node| *node < nm);
    if after == nodes.len() {
        return [(after - 1, 1.0), (after - 1, 0.0)];
    }
    if after == 0 || nodes[after].to_bits() == nm.to_bits() {
        return [(after, 1.0), (after, 0.0)];
    }
    let t = (nm - nodes[after - 1]) / (nodes[after] - nodes[after - 1]);
    [(after - 1, 1.0 - t), (after, t)]
}

/// The share that `nodes[node]` has of light of `nm`.
pub(super) fn part(nodes: &[f64], node: usize, nm: f64) -> f64 {
    let shares = of(nodes, nm).into_iter();
    shares.filter(|(k, _)| *k == node).map(|(_, s)| s).sum()
}

/// The share of all of `light`, wavelengths (nm) and flux, that each of `nodes` stands for; zeros
/// where there is no flux.
pub(super) fn of_nodes(nodes: &[f64], light: impl IntoIterator<Item = (f64, f64)>) -> Vec<f64> {
    let mut weights = vec![0.0; nodes.len()];
    for (nm, flux) in light {
        for (node, share) in of(nodes, nm) {
            weights[node] += flux * share;
        }
    }
    let whole: f64 = weights.iter().sum();
    if whole > 0.0 {
        for weight in &mut weights {
            *weight /= whole;
        }
    }
    weights
}

/// X, Y and Z (CIE 1931) of the part of `light`, wavelengths (nm) and power, that each of `nodes`
/// stands for, for a power of 1 in all, seen through a filter of this transmittance.
pub(super) fn tristimulus(
    nodes: &[f64],
    light: impl IntoIterator<Item = (f64, f64)>,
    filter: &dyn Fn(f64) -> f64,
) -> Vec<[f64; 3]> {
    let (mut sums, mut whole) = (vec![[0.0; 3]; nodes.len()], 0.0);
    for (nm, power) in light {
        whole += power;
        let passed = filter(nm);
        let matching = colour_matching::xyz(nm).map(|value| passed * value);
        for (node, share) in of(nodes, nm) {
            for (sum, value) in sums[node].iter_mut().zip(matching) {
                *sum += power * share * value;
            }
        }
    }
    for sum in sums.iter_mut().flatten() {
        *sum /= whole;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tristimulus_values_of_all_nodes_are_those_of_the_light() {
        let light = [(450.0, 1.0), (530.0, 2.0), (611.0, 1.0)];
        let nodes = tristimulus(&[440.0, 500.0, 620.0], light, &|_| 1.0);
        for k in 0..3 {
            let sum: f64 = nodes.iter().map(|xyz| xyz[k]).sum();
            let expected = light.map(|(nm, power)| 0.25 * power * colour_matching::xyz(nm)[k]);
            assert!((sum - expected.iter().sum::<f64>()).abs() < 1e-14);
        }
    }

    #[test]
    fn shares_add_up_and_keep_the_mean() {
        let nodes = [400.0, 500.0, 650.0];
        for nm in [380.0, 400.0, 437.0, 500.0, 501.0, 650.0, 700.0] {
            let shares: Vec<f64> = (0..3).map(|k| part(&nodes, k, nm)).collect();
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            let mean: f64 = shares.iter().zip(nodes).map(|(s, n)| s * n).sum();
            assert!((mean - nm.clamp(400.0, 650.0)).abs() < 1e-10, "{nm}");
        }
        let weights = of_nodes(&nodes, [(400.0, 1.0), (575.0, 2.0), (900.0, 1.0)]);
        assert_eq!(weights, [0.25, 0.25, 0.5]);
        assert_eq!(of_nodes(&nodes, [(450.0, 0.0)]), [0.0; 3]);
    }
}
