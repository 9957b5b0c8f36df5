// SPDX-License-Identifier: MIT OR Apache-2.0
//! The far images in the quasi-periodic Green's function, as a sum of products.
//!
//! The field at (x, z) of sources at (x' + jd, z') with phases e^{iαjd} is the sum of the images'
//! (i/4) H0. Those with |j| < J are summed one by one elsewhere. The others lie to the right and to
//! the left of all points of the surface, where (i/4) H0 = (i/4π) ∫ e^{iκ|x| + itz} dt/κ, κ² = k² -
//! t², and their sum is a geometric series under the integral \[Petit1980; Linton1998\]:
//!
//! Σ_{j≥J} = (i/4π) ∫ e^{-iκ(x-x') + it(z-z')} e^{i(α+κ)Jd} / (1 - e^{i(α+κ)d}) dt/κ,
//!
//! and likewise to the left with -α and x'-x. Poles stand where the orders do, at t = ±kz_m. The
//! contour t = s e^{-iβ} passes them on the side that outgoing waves require, and there e^{iκ...}
//! falls off like a Gaussian, so that the trapezoidal rule converges exponentially. Every node is a
//! product of a function of (x, z) and one of (x', z').

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

/// Natural logarithm of what is neglected.
const DIGITS: f64 = 36.0;
/// Most nodes on the contour; more are needed only at a cut-off.
pub(super) const MOST: usize = 6000;
/// Periods below this, times k0, need more nodes than that: no contour is tried.
const SHORTEST: f64 = 1e-3;
/// What one more image costs, in nodes of the contour.
const COST_OF_IMAGE: f64 = 40.0;

/// Where and how the surface lies, in units of 1/k0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub period: f64,
    pub low: [f64; 2],
    pub high: [f64; 2],
}

/// A node of the contour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wave {
    pub t: Complex64,
    pub kappa: Complex64,
    /// Factors of the images to the right and to the left.
    pub right: Complex64,
    pub left: Complex64,
}

/// All far images in one medium.
#[derive(Clone, Debug)]
pub(super) struct Far {
    place: Place,
    /// Images |j| below this are not contained.
    pub first: i32,
    pub waves: Vec<Wave>,
}

/// A contour not yet filled: J, β, step and number of nodes on either half.
#[derive(Clone, Copy, Debug)]
struct Plan {
    first: i32,
    tilt: f64,
    step: f64,
    half: usize,
}

impl Far {
    /// For index `n`, phase `alpha` per length, and the kz of all orders that matter (`poles`).
    /// `None` if an order is so near its cut-off that the contour would need more than [`MOST`]
    /// nodes.
    pub(super) fn new(n: Complex64, alpha: f64, poles: &[Complex64], place: Place) -> Option<Self> {
        if place.period < SHORTEST {
            return None;
        }
        let width = place.high[0] - place.low[0];
        let least = (width / place.period - 1e-9).ceil() as i32 + 1;
        if n.im * place.gap(least) > DIGITS {
            return Some(Self { place, first: least, waves: Vec::new() });
        }
        let cost = |p: &Plan| p.half as f64 * 2.0 + COST_OF_IMAGE * f64::from(p.first);
        let plan = (least..least + 4)
            .flat_map(|first| (1..=15).map(move |i| (first, 0.05 * f64::from(i))))
            .filter_map(|(first, tilt)| Plan::new(n, poles, place, first, tilt))
            .min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        let (d, first) = (place.period, f64::from(plan.first));
        let turn = Complex64::from_polar(1.0, -plan.tilt);
        let i = Complex64::I;
        let waves = (0..2 * plan.half)
            .map(|q| {
                let t = turn * (plan.step * (q as f64 + 0.5 - plan.half as f64));
                let kappa = (n * n - t * t).sqrt();
                let common = turn * plan.step * i / (4.0 * PI) / kappa
                    * (i * kappa * (first * d - width)).exp();
                let side = |alpha: f64| {
                    common * (i * alpha * first * d).exp() / (1.0 - (i * (kappa + alpha) * d).exp())
                };
                Wave { t, kappa, right: side(alpha), left: side(-alpha) }
            })
            .collect();
        Some(Self { place, first: plan.first, waves })
    }

    /// Factors of a wave at a point where the field is read, for the right and the left images.
    pub(super) fn reads(&self, wave: &Wave, [x, z]: [f64; 2]) -> [Complex64; 2] {
        let across = Complex64::I * wave.t * (z - self.middle());
        let along = |length: f64| (Complex64::I * wave.kappa * length + across).exp();
        [along(self.place.high[0] - x), along(x - self.place.low[0])]
    }

    /// Factors at a source, and those of the source's derivative along `normal`.
    pub(super) fn sources(
        &self,
        wave: &Wave,
        [x, z]: [f64; 2],
        normal: [f64; 2],
    ) -> [[Complex64; 2]; 2] {
        let i = Complex64::I;
        let across = -i * wave.t * (z - self.middle());
        let along = |length: f64| (i * wave.kappa * length + across).exp();
        let (right, left) =
            (wave.right * along(x - self.place.low[0]), wave.left * along(self.place.high[0] - x));
        let slope = |sign: f64| i * (sign * wave.kappa * normal[0] - wave.t * normal[1]);
        [[right, left], [right * slope(1.0), left * slope(-1.0)]]
    }

    fn middle(&self) -> f64 {
        0.5 * (self.place.low[1] + self.place.high[1])
    }
}

impl Place {
    /// Distance along x from all points of the surface to the next of the images from `first` on.
    fn gap(&self, first: i32) -> f64 {
        f64::from(first) * self.period - (self.high[0] - self.low[0])
    }
}

impl Plan {
    fn new(n: Complex64, poles: &[Complex64], place: Place, first: i32, tilt: f64) -> Option<Self> {
        let (distance, size_of_n) = (place.gap(first), n.norm());
        let depth = place.high[1] - place.low[1];
        let turn = Complex64::from_polar(1.0, -tilt);
        // Largest logarithm of the integrand on the line through `i shift` (tilted).
        let size = |s: f64, shift: f64| {
            let t = turn * Complex64::new(s, shift);
            let kappa = (n * n - t * t).sqrt();
            -kappa.im * distance + t.im.abs() * depth
        };
        let scale = (size_of_n / distance).sqrt().min(size_of_n);
        let largest = |shift: f64| {
            let mut top = f64::NEG_INFINITY;
            let mut s = 0.0;
            loop {
                let here = size(s, shift).max(size(-s, shift));
                top = top.max(here);
                if here < -DIGITS && s > scale {
                    return (top, s);
                }
                if s > 1e3 * (size_of_n + (DIGITS + 1.0) / distance) {
                    return (f64::INFINITY, s);
                }
                s += (0.1 * scale).max(0.02 * s);
            }
        };
        let (growth, end) = largest(0.0);
        // Digits that a sum of large terms would lose.
        if growth > 4.0 {
            return None;
        }
        // κ branches at t = ±n.
        let singular = poles.iter().chain([&n]);
        let clear = singular.map(|p| (p / turn).im).fold(f64::INFINITY, f64::min);
        let step = [0.95, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1]
            .into_iter()
            .map(|share| {
                let shift = share * clear;
                let worst = largest(shift).0.max(largest(-shift).0).max(0.0);
                TAU * shift / (DIGITS + worst - (1.0_f64 - share).ln())
            })
            .fold(0.0, f64::max);
        let half = (end / step).ceil();
        (half < 0.5 * MOST as f64).then_some(Self { first, tilt, step, half: half as usize })
    }
}

#[cfg(test)]
mod tests {
    use super::super::cylinder::Cylinder;
    use super::*;

    /// kx and kz of orders far beyond the last that propagates.
    fn orders(n: Complex64, alpha: f64, period: f64) -> Vec<(f64, Complex64)> {
        let reach = (n.re * period / TAU) as i32 + 60;
        (-reach..=reach)
            .map(|m| {
                let kx = alpha + TAU * f64::from(m) / period;
                (kx, (n * n - kx * kx).sqrt())
            })
            .collect()
    }

    /// Near images one by one and far images by the contour, from the origin to (x, z).
    fn green(far: &Far, n: Complex64, alpha: f64, [x, z]: [f64; 2], source: [f64; 2]) -> Complex64 {
        let d = far.place.period;
        let near: Complex64 = (1 - far.first..far.first)
            .map(|image| {
                let shift = f64::from(image) * d;
                let r = (x - source[0] - shift).hypot(z - source[1]);
                let h0 = Cylinder::at(n * r, false).h[0];
                Complex64::new(0.0, 0.25) * h0 * (Complex64::I * alpha * shift).exp()
            })
            .sum();
        let products = far.waves.iter().map(|wave| {
            let (reads, sends) = (far.reads(wave, [x, z]), far.sources(wave, source, [0.0, 1.0]));
            reads[0] * sends[0][0] + reads[1] * sends[0][1]
        });
        near + products.sum::<Complex64>()
    }

    /// From short periods to those of the steps, shallow and deep, also in absorbing media and metals:
    /// the sum over images is the sum over orders Σ i/(2 d kz_m) e^{i kx_m x + i kz_m |z|}.
    #[test]
    fn images_and_orders_sum_to_one_field() {
        for (period, depth, n, k, alpha) in [
            (0.9, 0.5, 1.0, 0.0, 0.2),
            (3.1, 8.0, 1.41, 0.0, 0.3),
            (12.0, 6.0, 1.0, 0.0, 0.713),
            (63.0, 126.0, 1.5, 0.0, 0.0123),
            (200.8, 94.0, 1.41, 0.0, 0.1234),
            (200.8, 94.0, 1.0, 0.0, 0.1234),
            (12.0, 6.0, 1.5, 0.01, 0.713),
            (3.1, 2.0, 3.0, 0.3, 0.3),
            (3.1, 2.0, 0.0562, 4.2776, 0.3),
            (0.9, 0.5, 0.0, 3.0, 0.2),
        ] {
            let n = Complex64::new(n, k);
            let orders = orders(n, alpha, period);
            let poles: Vec<Complex64> = orders.iter().map(|o| o.1).collect();
            let place = Place { period, low: [0.0, 0.0], high: [period, depth] };
            let far = Far::new(n, alpha, &poles, place).expect("no cut-off");
            for (at, source) in [
                ([0.0, depth], [0.0, 0.0]),
                ([0.9 * period, 0.0], [0.0, depth]),
                ([0.2, 0.9 * depth], [period, 0.0]),
            ] {
                let (x, z) = (at[0] - source[0], (at[1] - source[1]).abs());
                let expected: Complex64 = orders
                    .iter()
                    .map(|(kx, kz)| {
                        Complex64::I / (2.0 * period * kz)
                            * (Complex64::I * (kx * x + kz * z)).exp()
                    })
                    .sum();
                let got = green(&far, n, alpha, at, source);
                // Evanescent orders die off with depth; the least of these depths leaves e^(-2π 60
                // · 0.45/0.9).
                let error = (got - expected).norm();
                assert!(
                    error < 2e-13,
                    "period {period}, n {n}: {error:.1e} of {:.1e}",
                    expected.norm()
                );
            }
        }
    }

    #[test]
    fn an_order_at_its_cut_off_is_not_solved() {
        let place = Place { period: 10.0, low: [0.0; 2], high: [10.0, 1.0] };
        assert!(Far::new(1.0.into(), 0.2, &[Complex64::new(1e-7, 0.0)], place).is_none());
    }
}
