// SPDX-License-Identifier: MIT OR Apache-2.0
//! The series of a circular cylinder with a line source inside.

use full_wave::bessel::Bessel;
use num_complex::Complex64;

/// J_m and H_m for m = 0..=count.
fn cylinder_functions(z: f64, count: usize) -> Vec<(f64, Complex64)> {
    // J downwards from far above, scaled by the sum; Y upwards.
    let top = count + 40 + (z as usize) + 2 * (z.cbrt() as usize) * 10;
    let mut j = vec![0.0; top + 2];
    j[top] = 1e-290;
    for m in (1..=top).rev() {
        j[m - 1] = 2.0 * m as f64 / z * j[m] - j[m + 1];
        if j[m - 1].abs() > 1e200 {
            for value in &mut j[m - 1..] {
                *value *= 1e-200;
            }
        }
    }
    let sum: f64 = j[0] + 2.0 * j.iter().skip(2).step_by(2).sum::<f64>();
    let start = Bessel::at(z);
    let (mut below, mut here) = (start.y0, start.y1);
    (0..=count)
        .map(|m| {
            let y = match m {
                0 => start.y0,
                1 => start.y1,
                _ => {
                    let above = 2.0 * (m as f64 - 1.0) / z * here - below;
                    (below, here) = (here, above);
                    above
                }
            };
            (j[m] / sum, Complex64::new(j[m] / sum, y))
        })
        .collect()
}

/// Far field amplitudes F by the series, for a line source at distance `rho` on the axis at
/// `azimuth`; lengths times k0.
pub fn series(
    radius: f64,
    index: [f64; 2],
    te: bool,
    (rho, azimuth): (f64, f64),
    directions: &[f64],
) -> Vec<Complex64> {
    let [n1, n2] = index;
    let count = (n1 * radius + 12.0 * (n1 * radius).cbrt() + 20.0) as usize;
    let inside = cylinder_functions(n1 * radius, count + 1);
    let outside = cylinder_functions(n2 * radius, count + 1);
    let source = cylinder_functions(n1 * rho, count + 1);
    let weight = if te { 1.0 } else { (n1 / n2).powi(2) };
    let mut sums = vec![Complex64::ZERO; directions.len()];
    for m in 0..=count {
        let order = m as f64;
        // f'(z) = m/z f - f_{m+1}.
        let (j, h1) = inside[m];
        let h2 = outside[m].1;
        let largest = h1.norm() + h2.norm() + inside[m + 1].1.norm() + outside[m + 1].1.norm();
        if largest > 1e140 || !largest.is_finite() || source[m].0 == 0.0 && m > 0 {
            break;
        }
        let slope = |z: f64, here: Complex64, above: Complex64| order / z * here - above;
        let dj = slope(n1 * radius, j.into(), inside[m + 1].0.into());
        let dh1 = slope(n1 * radius, h1, inside[m + 1].1);
        let dh2 = slope(n2 * radius, h2, outside[m + 1].1);
        // J1 a + H1 s = H2 b; n1 (J1' a + H1' s) = weight n2 H2' b, with s = (i/4) J_m(k1 rho).
        let s = Complex64::new(0.0, 0.25) * source[m].0;
        let wronskian = n1 * (j * dh1 - dj * h1);
        let b = s * wronskian / (j * weight * n2 * dh2 - n1 * dj * h2);
        let phase = Complex64::new(0.0, -1.0).powu(m as u32 % 4);
        for (sum, direction) in sums.iter_mut().zip(directions) {
            let twice = if m == 0 { 1.0 } else { 2.0 * (order * (direction - azimuth)).cos() };
            *sum += b * phase * twice;
        }
    }
    // u = sqrt(2/πkr) e^(i(kr - π/4)) Σ = (i/4) ... F.
    sums.into_iter().map(|sum| sum * Complex64::new(0.0, -4.0)).collect()
}

/// Largest difference over the largest amplitude.
pub fn worst(got: &[Vec<Complex64>], source: usize, expected: &[Complex64]) -> f64 {
    let largest = expected.iter().map(|f| f.norm()).fold(0.0, f64::max);
    let differences = got.iter().zip(expected).map(|(g, e)| (g[source] - e).norm());
    differences.fold(0.0, f64::max) / largest
}
