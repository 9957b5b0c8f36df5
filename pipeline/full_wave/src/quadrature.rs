// SPDX-License-Identifier: MIT OR Apache-2.0
//! Gauss-Legendre quadrature on [-1, 1], interpolation from its nodes, and weights for a logarithm.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// Nodes of a panel.
pub(crate) const NODES: usize = 16;

/// Values at the nodes of a panel.
pub(crate) type PerNode = [f64; NODES];

/// The rule of one panel.
pub(crate) struct Rule {
    /// Nodes in ascending order.
    pub nodes: PerNode,
    /// Weights; their sum is 2.
    pub weights: PerNode,
    /// Weights of barycentric interpolation.
    barycentric: PerNode,
    /// Interpolation from the nodes to those of the halves [-1, 0] and [0, 1].
    pub to_halves: [[PerNode; NODES]; 2],
    /// Row i: weights of ∫ log|t_i - s| f(s) ds at the node t_i.
    pub log_weights: [PerNode; NODES],
}

static RULE: LazyLock<Rule> = LazyLock::new(Rule::new);

/// Returns the rule of 16 nodes.
pub(crate) fn rule() -> &'static Rule {
    &RULE
}

impl Rule {
    fn new() -> Self {
        let mut nodes = [0.0; NODES];
        let mut weights = [0.0; NODES];
        for i in 0..NODES {
            // Newton's iteration on the Legendre polynomial from the usual first guess.
            let mut x = -(PI * (i as f64 + 0.75) / (NODES as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..20 {
                let (value, derivative) = legendre(x);
                slope = derivative;
                let step = value / derivative;
                x -= step;
                if step.abs() < 1e-16 {
                    break;
                }
            }
            nodes[i] = x;
            weights[i] = 2.0 / ((1.0 - x * x) * slope * slope);
        }
        // For Gauss-Legendre nodes the barycentric weight is (-1)^i sqrt((1 - x²) w).
        let barycentric = std::array::from_fn(|i| {
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            sign * ((1.0 - nodes[i] * nodes[i]) * weights[i]).sqrt()
        });
        let mut rule = Self {
            nodes,
            weights,
            barycentric,
            to_halves: [[[0.0; NODES]; NODES]; 2],
            log_weights: [[0.0; NODES]; NODES],
        };
        rule.to_halves =
            [-0.5, 0.5].map(|mid| std::array::from_fn(|i| rule.basis(mid + 0.5 * nodes[i])));
        rule.log_weights = std::array::from_fn(|i| rule.log_weights_at(nodes[i]));
        rule
    }

    /// Returns the Lagrange polynomials of the nodes at `x`.
    pub fn basis(&self, x: f64) -> PerNode {
        let mut values = [0.0; NODES];
        let mut sum = 0.0;
        for i in 0..NODES {
            let difference = x - self.nodes[i];
            if difference == 0.0 {
                values = [0.0; NODES];
                values[i] = 1.0;
                return values;
            }
            values[i] = self.barycentric[i] / difference;
            sum += values[i];
        }
        values.map(|value| value / sum)
    }

    /// Returns the weights of ∫ log|t - s| f(s) ds over [-1, 1] at the nodes s, for any real `t`:
    /// the interval is halved towards t until its pieces are as far away as they are long.
    pub fn log_weights_at(&self, t: f64) -> PerNode {
        let mut weights = [0.0; NODES];
        let cut = t.clamp(-1.0, 1.0);
        for far in [-1.0, 1.0_f64] {
            // Distances from the cut, so that t - s keeps its digits next to t.
            let (side, mut rest) = (far.signum(), (far - cut).abs());
            let gap = (t - cut).abs();
            while rest > 1e-20 {
                let last = gap >= rest || rest < 1e-18;
                let end = if last { 0.0 } else { 0.5 * rest };
                let (mid, half) = (0.5 * (rest + end), 0.5 * (rest - end));
                for (node, weight) in self.nodes.iter().zip(&self.weights) {
                    let distance = mid + half * node;
                    let value = half * weight * (t - cut - side * distance).abs().ln();
                    for (sum, basis) in weights.iter_mut().zip(self.basis(cut + side * distance)) {
                        *sum += value * basis;
                    }
                }
                rest = end;
            }
        }
        weights
    }
}

/// Legendre polynomial of degree [`NODES`] and its derivative.
fn legendre(x: f64) -> (f64, f64) {
    let (mut below, mut here) = (1.0, x);
    for n in 2..=NODES {
        let degree = n as f64;
        let above = ((2.0 * degree - 1.0) * x * here - (degree - 1.0) * below) / degree;
        (below, here) = (here, above);
    }
    (here, NODES as f64 * (x * here - below) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_31_are_integrated() {
        let rule = rule();
        for degree in 0..32_u8 {
            let got: f64 =
                (0..NODES).map(|i| rule.weights[i] * rule.nodes[i].powi(i32::from(degree))).sum();
            let exact = if degree % 2 == 0 { 2.0 / (f64::from(degree) + 1.0) } else { 0.0 };
            assert!((got - exact).abs() < 1e-14, "degree {degree}: {got}");
        }
    }

    /// ∫ log|t - s| ds and ∫ log|t - s| s ds in closed form.
    #[test]
    fn the_logarithm_is_integrated_inside_and_outside() {
        let rule = rule();
        for t in [-3.0, -1.2, -0.9, 0.0, 0.3, rule.nodes[0], rule.nodes[9], 1.01, 2.5_f64] {
            let weights = rule.log_weights_at(t);
            let log = |x: f64| if x == 0.0 { 0.0 } else { x.abs().ln() };
            let zeroth = (t + 1.0) * log(t + 1.0) - (t - 1.0) * log(t - 1.0) - 2.0;
            let first = 0.5 * (t * t - 1.0) * (log(t + 1.0) - log(t - 1.0)) - t;
            let got: f64 = weights.iter().sum();
            let moment: f64 = weights.iter().zip(&rule.nodes).map(|(w, s)| w * s).sum();
            assert!((got - zeroth).abs() < 4e-14, "t = {t}: {got} for {zeroth}");
            assert!((moment - first).abs() < 4e-14, "t = {t}: {moment} for {first}");
        }
    }
}
