// SPDX-License-Identifier: MIT OR Apache-2.0
//! Local dimming: a panel before a backlight, the spread of a zone's light, and light that a small
//! array does not show.
//!
//! | figure | formula |
//! |---|---|
//! | behind the panel | L = min(max(T W, B / C), B) ([`behind_panel`]) |
//! | bias of noise there | s exp(-d²/2) / √π at each of its two bends ([`panel_bias`]) |
//! | window of a share of the area | the part of each cell that it covers ([`window`]) |
//! | radius of a level | where the mean over rings first falls below the level beyond its largest ([`radius_at`]) |
//! | light beyond the reach | Σ n_j d_R q^(j-R) over the shells j beyond the last, R ([`beyond`]) |

use super::Estimate;

/// Luminance behind a panel of contrast C = `contrast` (1 or more), before a backlight of luminance
/// B = `backlight`, where T W = `wanted`: the liquid crystal passes T W / B, at least 1/C and at
/// most 1.
pub fn behind_panel(backlight: f64, wanted: f64, contrast: f64) -> f64 {
    let backlight = backlight.max(0.0);
    wanted.min(backlight).max(backlight / contrast)
}

/// Bound of the bias that noise of `backlight`, normal with its standard error s, leaves in
/// [`behind_panel`].
///
/// At the bend B = T W the mean lies s (φ(d) - d Φ(-d)) low, d = |B - T W| / s, which is at most
/// s φ(d), 0.4 s where d = 0; at the bend B / C = T W it lies 1/C of the same high. With the d that
/// noise gives, √2 φ(d) = exp(-d²/2) / √π is φ(d/√2) in the mean, which is at least φ(d). Black has no
/// bend: 1/C of the backlight passes, however bright.
pub fn panel_bias(backlight: Estimate, wanted: f64, contrast: f64) -> f64 {
    let Estimate { value, standard_error, .. } = backlight;
    if standard_error <= 0.0 || wanted <= 0.0 {
        return 0.0;
    }
    let of_bend = |bend: f64| {
        let d = (value - bend) / standard_error;
        standard_error * (-0.5 * d * d).exp() / std::f64::consts::PI.sqrt()
    };
    of_bend(wanted) + of_bend(wanted * contrast) / contrast
}

/// Levels of a window of this `share` of the area, in the middle and of the shape of the display, in
/// `columns` times `rows` cells, row by row: the part of each that it covers.
pub fn window(columns: usize, rows: usize, share: f64) -> Vec<f64> {
    let side = share.sqrt();
    let part = |cell: usize, count: usize| {
        let [from, to] = [cell, cell + 1].map(|k| k as f64 / count as f64);
        let covered = to.min(0.5 + 0.5 * side) - from.max(0.5 - 0.5 * side);
        (covered.max(0.0) * count as f64).min(1.0)
    };
    (0..rows).flat_map(|j| (0..columns).map(move |i| part(i, columns) * part(j, rows))).collect()
}

/// The distance at which `values` at these distances first fall below `share` of the largest,
/// beyond it; `None` where they do not.
pub fn radius_at(distances: &[f64], values: &[f64], share: f64) -> Option<f64> {
    let (largest, level) = values
        .iter()
        .copied()
        .enumerate()
        .fold((0, 0.0), |best, (k, value)| if value > best.1 { (k, value) } else { best });
    crossing(distances, values, largest, share * level)
}

/// The distance at which `values` first fall below `level` beyond number `from`.
fn crossing(distances: &[f64], values: &[f64], from: usize, level: f64) -> Option<f64> {
    let next = (from + 1..values.len()).find(|&k| values[k] < level)?;
    let ([a, b], [x, y]) =
        ([values[next - 1], values[next]], [distances[next - 1], distances[next]]);
    Some(x + (y - x) * (a - level) / (a - b))
}

/// Light beyond the last of the `shells` of packages about a lit one, in their unit: shell k holds
/// `packages(k)`. Light for each package falls off by one factor a shell, which the outer half of
/// the shells gives. `None` where it does not fall off, or of fewer than three shells.
pub fn beyond(shells: &[f64], packages: impl Fn(usize) -> f64) -> Option<f64> {
    /// Terms of the series; a factor that needs more is no fall.
    const TERMS: usize = 100_000;
    let last = shells.len().checked_sub(1).filter(|last| *last >= 2)?;
    let from = last / 2;
    let density = |shell: usize| shells[shell] / packages(shell);
    let factor = (density(last) / density(from)).powf(1.0 / (last - from) as f64);
    let (mut sum, mut each) = (0.0, density(last));
    for shell in last + 1..last + TERMS {
        each *= factor;
        let term = packages(shell) * each;
        sum += term;
        if factor < 1.0 && term <= 1e-12 * sum {
            return Some(sum);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panel_passes_what_is_wanted_between_its_ends() {
        // Bright enough, too dark, and black: 1/C of the backlight leaks.
        for (backlight, wanted, contrast, expected) in [
            (400.0, 100.0, 1000.0, 100.0),
            (400.0, 500.0, 1000.0, 400.0),
            (400.0, 0.0, 1000.0, 0.4),
            (400.0, 0.0, 1.0, 400.0),
            (-1e-18, 1.0, 2.0, 0.0),
        ] {
            let found = behind_panel(backlight, wanted, contrast);
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }

    /// E[min(w, B)] of a normal B, by the mean over its law; bounds are means over the same law.
    #[test]
    fn the_bias_of_noise_before_a_panel_is_within_its_bound() {
        let (wanted, noise) = (100.0, 3.0);
        for d in [0.0, 0.3, 0.7, 1.0, 1.5, 2.0, 3.0, -0.5, -2.0] {
            let backlight = wanted + d * noise;
            let (mut weight, mut mean, mut bound) = (0.0, 0.0, 0.0);
            for step in -8000..=8000 {
                let z = f64::from(step) * 1e-3;
                let density = (-0.5 * z * z).exp();
                let seen = backlight + z * noise;
                weight += density;
                mean += density * behind_panel(seen, wanted, 5000.0);
                bound += density * panel_bias(Estimate::new(seen, noise), wanted, 5000.0);
            }
            let bias = mean / weight - behind_panel(backlight, wanted, 5000.0);
            assert!(bias <= 1e-9 && bound / weight >= -bias, "{d}: {bias} {bound}");
            if d == 0.0 {
                // φ(0) of the error, 0.4 of it.
                assert!((bias + 0.398_942 * noise).abs() < 1e-4, "{bias}");
                assert!((bound / weight - 0.398_942 * noise).abs() < 1e-3, "{bound}");
            }
        }
        assert!(panel_bias(Estimate::new(1.0, 0.0), 1.0, 10.0).abs() < f64::MIN_POSITIVE);
        // Black leaks in proportion to a backlight far from dark: nothing bends.
        assert!(panel_bias(Estimate::new(100.0, 3.0), 0.0, 5000.0) < 1e-100);
        assert!(panel_bias(Estimate::new(1.0, 3.0), 0.0, 5000.0) < 1e-100);
    }

    #[test]
    fn windows_cover_their_share() {
        for (columns, rows, share) in [(16, 9, 0.1), (3, 3, 0.1), (48, 27, 1.0), (1, 1, 0.25)] {
            let levels = window(columns, rows, share);
            let mean = levels.iter().sum::<f64>() / (columns * rows) as f64;
            assert!((mean - share).abs() < 1e-12, "{columns} {rows}: {mean}");
            let reversed: Vec<f64> = levels.iter().rev().copied().collect();
            assert!(levels.iter().zip(reversed).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        assert!(window(4, 4, 0.25)[5] > 1.0 - 1e-12);
    }

    #[test]
    fn radii_of_a_gaussian_are_its_own() {
        let distances: Vec<f64> = (0..400).map(|k| 0.1 * f64::from(k)).collect();
        let values: Vec<f64> = distances.iter().map(|r| (-r * r / 50.0).exp()).collect();
        for share in [0.5, 0.1, 0.01f64] {
            let exact = (-50.0 * share.ln()).sqrt();
            let found = radius_at(&distances, &values, share).expect("a radius");
            assert!((found - exact).abs() < 2e-3, "{share}: {found} {exact}");
        }
        assert_eq!(radius_at(&distances[..20], &values[..20], 0.1), None);
        assert_eq!(radius_at(&distances, &vec![0.0; 400], 0.1), None);
    }

    #[test]
    fn a_geometric_fall_is_summed_to_its_closed_form() {
        let packages = |k: usize| if k == 0 { 1.0 } else { 8.0 * k as f64 };
        let (q, last) = (0.4f64, 4);
        let shells: Vec<f64> = (0..=last).map(|k| packages(k) * q.powi(k as i32)).collect();
        // Σ 8 j q^j from R + 1 on = 8 q^(R+1) ((R + 1) - R q) / (1 - q)².
        let r = last as f64;
        let exact = 8.0 * q.powi(last as i32 + 1) * (r + 1.0 - r * q) / (1.0 - q).powi(2);
        let found = beyond(&shells, packages).expect("it falls");
        assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
        assert_eq!(beyond(&[1.0, 8.0, 16.0], packages), None);
        assert_eq!(beyond(&[1.0, 1.0], packages), None);
    }
}
