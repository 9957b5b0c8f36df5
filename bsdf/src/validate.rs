// SPDX-License-Identifier: MIT OR Apache-2.0
//! Validation of order tables: energy, reciprocity, albedo, and interpolation against a solver.
//!
//! In: an [`OrderTable`], and for interpolation a solver as a closure. Out: small reports. A
//! lossless relief conserves power. Reciprocity [Petit 1980]: the efficiency from incidence (kx,
//! ky) into order l equals that of light sent back along the order, from (-kx - l λ/Λ, -ky) into
//! order l again, both summed over polarisations. It holds with absorption and for any groove. kx
//! nodes are symmetric about 0, so the reverse path is a node too.
//!
//! \[Petit 1980\] R. Petit (ed.), *Electromagnetic Theory of Gratings*, Springer, chapter 1.

use crate::bsdf::Polarisation;
use crate::direction::{Side, Wavevector};
use crate::order_table::{NodeId, OrderEfficiency, OrderTable};
use rand::RngExt;
use std::collections::BTreeMap;

/// Statistics of differences that should vanish, in units of the incident power.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Largest absolute value.
    pub worst: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Mean, signed.
    pub mean: f64,
    /// Standard error of the mean; 0 for fewer than two values.
    pub mean_error: f64,
    /// Number of values.
    pub count: usize,
}

impl Deviation {
    /// Deviation of a set of values.
    pub fn new(values: impl IntoIterator<Item = f64>) -> Self {
        let (mut worst, mut sum, mut squares, mut count) = (0.0_f64, 0.0, 0.0, 0_usize);
        for value in values {
            worst = worst.max(value.abs());
            sum += value;
            squares += value * value;
            count += 1;
        }
        if count == 0 {
            return Self::default();
        }
        let n = count as f64;
        let (mean, square) = (sum / n, squares / n);
        let variance = (square - mean * mean).max(0.0);
        let mean_error = if count > 1 { (variance / (n - 1.0)).sqrt() } else { 0.0 };
        Self { worst, rms: square.sqrt(), mean, mean_error, count }
    }
}

/// Deviation over all nodes, with the worst node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeReport {
    /// Over all nodes.
    pub deviation: Deviation,
    /// Node where it is worst; `None` if there was nothing to compare.
    pub at: Option<NodeId>,
}

impl NodeReport {
    fn new(values: &[(NodeId, f64)]) -> Self {
        Self {
            deviation: Deviation::new(values.iter().map(|v| v.1)),
            at: values.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map(|v| v.0),
        }
    }
}

/// Sum of the efficiencies minus 1, for s and for p at every node: 0 without absorption, up to the
/// rounding of f32.
pub fn energy(table: &OrderTable) -> NodeReport {
    let mut values = Vec::new();
    for node in table.grid().nodes() {
        for polarisation in [Polarisation::S, Polarisation::P] {
            let orders = table.node_efficiencies(node, polarisation).unwrap_or_default();
            values.push((node, orders.iter().map(|o| o.efficiency).sum::<f64>() - 1.0));
        }
    }
    NodeReport::new(&values)
}

/// Efficiency of each order minus that of the reverse path, for unpolarised light, at every node.
/// Pairs are counted twice.
pub fn reciprocity(table: &OrderTable) -> NodeReport {
    let per_zone = table.grid().kx_per_zone as i64;
    let mut values = Vec::new();
    for node in table.grid().nodes() {
        for OrderEfficiency { to, order, efficiency } in
            table.node_efficiencies(node, Polarisation::Unpolarised).unwrap_or_default()
        {
            // The outgoing wave is node i + l · per_zone; the reverse path comes from its mirror
            // image.
            let back = NodeId {
                side: to,
                kx_index: table.grid().mirror(node.kx_index + i64::from(order) * per_zone),
                ky_index: node.ky_index,
            };
            let returned = table
                .node_efficiency(back, node.side, order, Polarisation::Unpolarised)
                .unwrap_or(0.0);
            values.push((node, efficiency - returned));
        }
    }
    NodeReport::new(&values)
}

/// Estimate of the interpolation error in the unpolarised reflectance of a single direction, from
/// the nodes alone.
///
/// It is half of the root mean square error at the nodes themselves when each is left out, along kx
/// and along ky, added in squares. Doubling the spacing multiplies the interpolation error by four
/// where efficiencies are smooth, and by less at Rayleigh points, where they bend as square roots.
/// A mean over many directions is far more accurate, as the signs alternate. 0 where no node has
/// neighbours.
pub fn leave_one_out(table: &OrderTable, side: Side) -> f64 {
    let grid = table.grid();
    let reflected = |kx_index: i64, ky_index: usize| -> Option<f64> {
        let node = NodeId { side, kx_index, ky_index };
        let orders = table.node_efficiencies(node, Polarisation::Unpolarised).ok()?;
        let back = orders.iter().filter(|o| o.to == side);
        Some(back.map(|o| o.efficiency).sum())
    };
    // Interpolation never crosses the critical ky.
    let apart = |a: f64, b: f64| a < grid.critical_ky() && b >= grid.critical_ky();
    let (mut along_kx, mut along_ky) = (Mean::default(), Mean::default());
    for j in 0..grid.ky.len() {
        let (before, after) = (j.checked_sub(1), (j + 1 < grid.ky.len()).then_some(j + 1));
        let weight = 0.5 * (grid.ky[after.unwrap_or(j)] - grid.ky[before.unwrap_or(j)]);
        for i in grid.kx_indices(side, j) {
            let Some(here) = reflected(i, j) else {
                continue;
            };
            if let (Some(left), Some(right)) = (reflected(i - 1, j), reflected(i + 1, j)) {
                along_kx.add(weight, (here - 0.5 * (left + right)).powi(2));
            }
            if let (Some(below), Some(above)) = (before, after)
                && !apart(grid.ky[below], grid.ky[above])
                && let (Some(low), Some(high)) = (reflected(i, below), reflected(i, above))
            {
                let part = (grid.ky[j] - grid.ky[below]) / (grid.ky[above] - grid.ky[below]);
                along_ky.add(weight, (here - low - part * (high - low)).powi(2));
            }
        }
    }
    0.5 * (along_kx.value() + along_ky.value()).sqrt()
}

/// A weighted mean.
#[derive(Default)]
struct Mean {
    weight: f64,
    sum: f64,
}

impl Mean {
    fn add(&mut self, weight: f64, value: f64) {
        self.weight += weight;
        self.sum += weight * value;
    }

    fn value(&self) -> f64 {
        if self.weight > 0.0 { self.sum / self.weight } else { 0.0 }
    }
}

/// Range of the albedo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlbedoReport {
    /// Lowest albedo.
    pub lowest: f64,
    /// Highest albedo; above 1 the table creates power.
    pub highest: f64,
}

/// Albedo at `count` random incidences from each side, between the nodes, for s, p and unpolarised
/// light.
pub fn albedo(table: &OrderTable, count: usize, rng: &mut dyn rand::Rng) -> AlbedoReport {
    let mut report = AlbedoReport { lowest: f64::INFINITY, highest: f64::NEG_INFINITY };
    for side in Side::BOTH {
        for _ in 0..count {
            let k = random_incidence(table, side, rng);
            for polarisation in [Polarisation::S, Polarisation::P, Polarisation::Unpolarised] {
                let total: f64 =
                    table.efficiencies(side, k, polarisation).iter().map(|o| o.efficiency).sum();
                report.lowest = report.lowest.min(total);
                report.highest = report.highest.max(total);
            }
        }
    }
    report
}

/// Interpolated minus directly solved efficiencies, at random incidences.
#[derive(Clone, Debug, PartialEq)]
pub struct InterpolationReport {
    /// Reflectance, one value for each incidence and polarisation. Its mean is the error for
    /// diffuse light.
    pub reflected: Deviation,
    /// Transmittance.
    pub transmitted: Deviation,
    /// Single orders, one value each.
    pub orders: Deviation,
    /// Mean error of every order for diffuse light.
    pub order_means: Vec<OrderEfficiency>,
}

/// Compares the table with a solver at `count` random incidences from `side`, for s and p. The
/// incidences are those of diffuse light, uniform in (kx, ky), so plain means are weighted by flux.
///
/// # Errors
/// Errors of the solver.
pub fn interpolation<E>(
    table: &OrderTable,
    side: Side,
    count: usize,
    rng: &mut dyn rand::Rng,
    mut solve: impl FnMut(Side, Wavevector, Polarisation) -> Result<Vec<OrderEfficiency>, E>,
) -> Result<InterpolationReport, E> {
    let (mut reflected, mut transmitted, mut orders) = (Vec::new(), Vec::new(), Vec::new());
    let mut means: BTreeMap<(Side, i32), f64> = BTreeMap::new();
    for _ in 0..count {
        let k = random_incidence(table, side, rng);
        for polarisation in [Polarisation::S, Polarisation::P] {
            let mut difference: BTreeMap<(Side, i32), f64> = BTreeMap::new();
            for o in table.efficiencies(side, k, polarisation) {
                *difference.entry((o.to, o.order)).or_default() += o.efficiency;
            }
            for o in solve(side, k, polarisation)? {
                *difference.entry((o.to, o.order)).or_default() -= o.efficiency;
            }
            let total =
                |to: Side| difference.iter().filter(|d| d.0.0 == to).map(|d| d.1).sum::<f64>();
            reflected.push(total(side));
            transmitted.push(total(side.opposite()));
            for (key, value) in difference {
                orders.push(value);
                *means.entry(key).or_default() += value / (2.0 * count as f64);
            }
        }
    }
    Ok(InterpolationReport {
        reflected: Deviation::new(reflected),
        transmitted: Deviation::new(transmitted),
        orders: Deviation::new(orders),
        order_means: means
            .into_iter()
            .map(|((to, order), mean)| OrderEfficiency::new(to, order, mean))
            .collect(),
    })
}

/// Random wavevector of diffuse light from `side`: uniform over the disc of propagating ones.
pub(crate) fn random_incidence(
    table: &OrderTable,
    side: Side,
    rng: &mut dyn rand::Rng,
) -> Wavevector {
    let n = table.grid().index(side);
    loop {
        let k = Wavevector {
            kx: n * (2.0 * rng.random::<f64>() - 1.0),
            ky: n * (2.0 * rng.random::<f64>() - 1.0),
        };
        if k.propagates(n) {
            return k;
        }
    }
}
