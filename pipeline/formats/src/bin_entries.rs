// SPDX-License-Identifier: MIT OR Apache-2.0
//! Entries of a table that give back the content of bins when they are interpolated.
//!
//! In: what each of a row of bins holds, and the weights with which the entries at its lower edge,
//! its middle and its upper edge count for it. Out: entries at all edges and middles, none below 0,
//! whose linear interpolation has exactly the content of every bin. An edge gets the mean of its
//! two neighbours, but no more than half of what either bin can hold, so that a bin without light
//! ends its neighbour at 0; the middle takes the rest.

/// Weights of lower edge, middle and upper edge.
pub type Weights = [f64; 3];

/// Weights in a bin from `low` to `high` radians of polar angle, for the solid angle per radian of
/// azimuth: the integrals of sin θ times the linear functions that are 1 at one entry and 0 at its
/// neighbours.
pub fn polar_weights(low: f64, high: f64) -> Weights {
    let middle = 0.5 * (low + high);
    // ∫ sin θ (b - θ)/(b - a) dθ = cos a - (sin b - sin a)/(b - a), and so the other way.
    let falling = |a: f64, b: f64| a.cos() - (b.sin() - a.sin()) / (b - a);
    let rising = |a: f64, b: f64| (b.sin() - a.sin()) / (b - a) - b.cos();
    [falling(low, middle), rising(low, middle) + falling(middle, high), rising(middle, high)]
}

/// Entries 0 to 2n of n bins in a row: the edges at even places, the middles at odd ones.
pub fn in_a_row(contents: &[f64], weights: &[Weights]) -> Vec<f64> {
    let bins = contents.len();
    let edge = |k: usize| {
        let sides = [k.checked_sub(1).map(|below| (below, 2)), (k < bins).then_some((k, 0))];
        between(sides.into_iter().flatten(), contents, weights)
    };
    let edges: Vec<f64> = (0..=bins).map(edge).collect();
    let mut entries = vec![edges[0]];
    for bin in 0..bins {
        let ends = [edges[bin], edges[bin + 1]];
        entries.extend([middle(contents[bin], weights[bin], ends), ends[1]]);
    }
    entries
}

/// Entries 0 to 2n - 1 of n equal bins around a circle, from the lower edge of the first; contents
/// are means over the bins.
pub fn around(contents: &[f64]) -> Vec<f64> {
    let bins = contents.len();
    let weights = vec![[0.25, 0.5, 0.25]; bins];
    let edge = |k: usize| {
        let sides = [((k + bins - 1) % bins, 2), (k % bins, 0)];
        between(sides.into_iter(), contents, &weights)
    };
    let edges: Vec<f64> = (0..=bins).map(edge).collect();
    (0..bins)
        .flat_map(|bin| {
            let ends = [edges[bin], edges[bin + 1]];
            [ends[0], middle(contents[bin], weights[bin], ends)]
        })
        .collect()
}

/// The entry at an edge, from the bins beside it, each with the place of the edge in its weights.
fn between(
    sides: impl Iterator<Item = (usize, usize)>,
    contents: &[f64],
    weights: &[Weights],
) -> f64 {
    let (mut sum, mut count, mut most) = (0.0, 0.0, f64::INFINITY);
    for (bin, place) in sides {
        sum += contents[bin] / weights[bin].iter().sum::<f64>();
        count += 1.0;
        most = f64::min(most, 0.5 * contents[bin] / weights[bin][place]);
    }
    f64::min(sum / count, most)
}

/// The entry in the middle of a bin between two edges.
fn middle(content: f64, weights: Weights, ends: [f64; 2]) -> f64 {
    let rest = content - weights[0] * ends[0] - weights[2] * ends[1];
    // Rounding must not take light away.
    (rest / weights[1]).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_come_back_from_their_entries() {
        let contents = [0.0, 3.0, 1.0, 7.0, 0.0, 0.0, 2.0, 2.0];
        let edge = |k: usize| 0.3 * k as f64;
        let weights: Vec<Weights> = (0..8).map(|k| polar_weights(edge(k), edge(k + 1))).collect();
        let entries = in_a_row(&contents, &weights);
        let circle = around(&contents);
        assert!(entries.iter().chain(&circle).all(|e| *e >= 0.0));
        for (bin, content) in contents.iter().enumerate() {
            let three = &entries[2 * bin..=2 * bin + 2];
            let sum: f64 = three.iter().zip(weights[bin]).map(|(e, w)| e * w).sum();
            assert!((sum - content).abs() < 1e-12, "{bin}: {sum}");
            let [a, b, c] = [0, 1, 2].map(|k| circle[(2 * bin + k) % 16]);
            let mean = 0.25 * a + 0.5 * b + 0.25 * c;
            assert!((mean - content).abs() < 1e-12, "{bin}: {mean}");
            if *content == 0.0 {
                assert!(three.iter().all(|e| *e <= 0.0), "{bin}: {three:?}");
            }
        }
    }

    #[test]
    fn weights_of_a_bin_sum_to_its_solid_angle_and_keep_a_line_a_line() {
        let [low, high] = [0.4_f64, 0.9];
        let weights = polar_weights(low, high);
        let whole = low.cos() - high.cos();
        assert!((weights.iter().sum::<f64>() - whole).abs() < 1e-14);
        // ∫ θ sin θ dθ = sin θ - θ cos θ.
        let line = |t: f64| t.sin() - t * t.cos();
        let [a, b, c] = weights;
        let sum = a * low + b * 0.5 * (low + high) + c * high;
        assert!((sum - (line(high) - line(low))).abs() < 1e-14);
    }
}
