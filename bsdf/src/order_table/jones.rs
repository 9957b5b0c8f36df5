// SPDX-License-Identifier: MIT OR Apache-2.0
//! Polarisation of an order table: a Jones matrix for every stored order, queried as Mueller
//! matrices.
//!
//! In: one [`JonesRow`] for each node, with matrices between waves of unit power through the
//! surface, so that |element|² is an efficiency. Out: Stokes parameters of the outgoing light.
//! Light is described by I = |E_s|² + |E_p|², Q = |E_s|² - |E_p|², U = 2 Re E_s E_p*, V = -2 Im E_s
//! E_p*, with s = z × k∥/|k∥| (y where k∥ = 0) and p = s × k/|k|, k the wavevector of the
//! travelling light.
//!
//! **Interpolation** is that of the efficiencies: Mueller matrices with the weights of the nodes,
//! at fixed relative order. A sum of Mueller matrices with positive weights is that of a passive
//! surface; phases are never interpolated. s rotates with the azimuth of k∥. Between two nodes near
//! the normal that is any angle, although the surface sees almost the same field. Therefore the
//! matrices of a node are applied to light whose s and p were rotated about z by the difference of
//! the azimuths of query and node, before and after. For ky < 0 the reflection y → -y changes the
//! signs of U and V before and after.
//!
//! **At the rim** the mirror reflection that no node gives keeps the Stokes parameters: at grazing
//! incidence the reflected field is the incident one with its sign changed.
//!
//! **Evanescent orders** pass their power on as efficiencies do, unpolarised.
//!
//! **Sampling.** A node by its weight and an order by its unpolarised efficiency, as in
//! [`Bsdf::sample`](crate::Bsdf::sample). With S the ratio of the order's efficiency for the
//! incident light to that for unpolarised light and P the degree of polarisation, the order is
//! accepted with probability S/(1 + P) and otherwise sampled again at the same node. S is at most
//! 1 + P, and its mean over the orders of a lossless node is 1, so at most half of the samples are
//! rejected on average. Weights are 1, and unpolarised light consumes the same random numbers as
//! without matrices.

use super::layout::NodeOrders;
use super::{BinLocation, EFFICIENCY_TOLERANCE, NodeId, OrderTable};
use crate::bsdf::{Bsdf, BsdfSample, PolarisedBsdf};
use crate::direction::{Side, Wavevector};
use crate::error::Error;
use glam::DVec3;
use num_complex::Complex64;
use rand::RngExt;

/// Rows out by columns in, s before p, between waves of unit power.
pub type Jones = [[Complex64; 2]; 2];

/// Rows out by columns in of (I, Q, U, V), per power that comes in.
pub type Mueller = [[f64; 4]; 4];

/// Tolerance of sums over the orders of a node against those of a lossless surface.
const LOSS_TOLERANCE: f64 = 1e-5;

/// Jones matrix of one diffraction order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderJones {
    /// Side it leaves on.
    pub to: Side,
    /// Relative order l.
    pub order: i32,
    /// From the incident to the outgoing wave.
    pub jones: Jones,
}

/// Mueller matrix of one diffraction order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderMueller {
    /// Side it leaves on.
    pub to: Side,
    /// Relative order l.
    pub order: i32,
    /// From the incident to the outgoing light.
    pub mueller: Mueller,
}

/// The matrices of one node of incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct JonesRow {
    /// The incident wavevector, with positive ky.
    pub node: NodeId,
    /// The matrices; zero for the orders left out.
    pub orders: Vec<OrderJones>,
}

/// A stored matrix.
pub(crate) type Packed = [f32; 8];

fn packed(matrix: &Jones) -> Packed {
    let [[a, b], [c, d]] = matrix;
    [a, b, c, d]
        .map(|z| [z.re as f32, z.im as f32])
        .as_flattened()
        .try_into()
        .expect("four complex numbers")
}

fn unpacked(packed: &Packed) -> Jones {
    let at = |k: usize| Complex64::new(f64::from(packed[2 * k]), f64::from(packed[2 * k + 1]));
    [[at(0), at(1)], [at(2), at(3)]]
}

/// Stokes parameters after a Jones matrix: J C J† with the coherency matrix C.
fn pass(j: &Jones, [i, q, u, v]: [f64; 4]) -> [f64; 4] {
    let c = Complex64::new(0.5 * u, -0.5 * v);
    let coherency =
        [[Complex64::from(0.5 * (i + q)), c], [c.conj(), Complex64::from(0.5 * (i - q))]];
    let jc = j.map(|row| [0, 1].map(|k| row[0] * coherency[0][k] + row[1] * coherency[1][k]));
    let out = |a: usize, b: usize| jc[a][0] * j[b][0].conj() + jc[a][1] * j[b][1].conj();
    let (s, p, c) = (out(0, 0).re, out(1, 1).re, out(0, 1));
    [s + p, s - p, 2.0 * c.re, -2.0 * c.im]
}

/// The Mueller matrix of a Jones matrix.
pub fn mueller(jones: &Jones) -> Mueller {
    columns(|light| pass(jones, light))
}

/// Matrix of a linear map.
fn columns(map: impl Fn([f64; 4]) -> [f64; 4]) -> Mueller {
    let mut matrix = [[0.0; 4]; 4];
    for column in 0..4 {
        let mut unit = [0.0; 4];
        unit[column] = 1.0;
        for (row, value) in matrix.iter_mut().zip(map(unit)) {
            row[column] = value;
        }
    }
    matrix
}

/// Unit vector along k∥, or x.
fn azimuth(k: Wavevector) -> [f64; 2] {
    let length = k.kx.hypot(k.ky);
    if length > 0.0 { [k.kx / length, k.ky / length] } else { [1.0, 0.0] }
}

/// Stokes parameters in the s and p of wavevector `from`, expressed in those of `to`, for the same
/// field; `outwards` if the light travels along +z.
fn turned([i, q, u, v]: [f64; 4], from: Wavevector, to: Wavevector, outwards: bool) -> [f64; 4] {
    let (a, b) = (azimuth(from), azimuth(to));
    // s rotates by δ about z, which is -δ in the plane of s and p = s × k for light along +z.
    let cos = a[0] * b[0] + a[1] * b[1];
    let about_z = a[0] * b[1] - a[1] * b[0];
    let sin = if outwards { -about_z } else { about_z };
    let (cos2, sin2) = (cos * cos - sin * sin, 2.0 * sin * cos);
    [i, q * cos2 + u * sin2, u * cos2 - q * sin2, v]
}

/// Light after the reflection y → -y.
fn mirrored([i, q, u, v]: [f64; 4]) -> [f64; 4] {
    [i, q, -u, -v]
}

/// A query: side and wavevector of incidence with ky ≥ 0, and whether ky was negative.
#[derive(Clone, Copy)]
struct Query {
    from: Side,
    k: Wavevector,
    mirrored: bool,
}

impl Query {
    fn new(from: Side, k: Wavevector) -> Self {
        Self { from, k: Wavevector { kx: k.kx, ky: k.ky.abs() }, mirrored: k.ky < 0.0 }
    }
}

/// The error of matrices that contradict their table.
fn contradiction(node: NodeId, expected: &'static str, got: String) -> Error {
    let node = node.to_string();
    Error::Matrices { node, expected, got }
}

impl OrderTable {
    /// The same table with the matrices of all nodes, one row each, in any order.
    ///
    /// # Errors
    /// If a row is missing, doubled or outside the grid, a matrix belongs to an evanescent order or
    /// contradicts the efficiencies of the table, or a node gains or loses power for light of any
    /// polarisation.
    pub fn with_jones(self, rows: impl IntoIterator<Item = JonesRow>) -> Result<Self, Error> {
        let mut jones: Vec<Packed> = vec![[0.0; 8]; self.entry_count()];
        let mut seen = vec![false; self.layout.nodes.len()];
        for row in rows {
            let refuse = |expected, got: String| Err(contradiction(row.node, expected, got));
            let Some(index) = self.layout.find(row.node) else {
                return refuse("a node of the grid", "none there".to_owned());
            };
            if std::mem::replace(&mut seen[index], true) {
                return refuse("one row a node", "another".to_owned());
            }
            let node = self.layout.nodes[index];
            for OrderJones { to, order, jones: matrix } in row.orders {
                let power: f64 = matrix.as_flattened().iter().map(Complex64::norm_sqr).sum();
                match node.entry(to, order) {
                    Some(entry) => jones[entry] = packed(&matrix),
                    None if power <= EFFICIENCY_TOLERANCE => {}
                    None => {
                        return refuse(
                            "no power in an order that does not propagate",
                            format!("{power} in order {order} to the {to} side"),
                        );
                    }
                }
            }
        }
        if let Some((id, _)) = self.grid.nodes().zip(&seen).find(|(_, seen)| !**seen) {
            return Err(contradiction(id, "one row a node", "none".to_owned()));
        }
        self.with_packed_jones(jones)
    }

    /// The same table with the matrices of a file, entry by entry.
    pub(crate) fn with_packed_jones(mut self, jones: Vec<Packed>) -> Result<Self, Error> {
        for (id, node) in self.grid.nodes().zip(&self.layout.nodes) {
            let mut sum = [0.0; 4];
            for (entry, to, order) in node.orders() {
                let first = mueller(&unpacked(&jones[entry]))[0];
                let efficiencies = [first[0] + first[1], first[0] - first[1]];
                let stored = [self.s[entry], self.p[entry]].map(f64::from);
                let off =
                    (efficiencies[0] - stored[0]).abs().max((efficiencies[1] - stored[1]).abs());
                if off.is_nan() || off > LOSS_TOLERANCE {
                    let got = format!(
                        "{efficiencies:?} instead of {stored:?} in order {order} to the {to} side"
                    );
                    return Err(contradiction(id, "the efficiencies of the table", got));
                }
                sum.iter_mut().zip(first).for_each(|(sum, m)| *sum += m);
            }
            let off = [sum[0] - 1.0, sum[1], sum[2], sum[3]];
            if off.iter().any(|off| off.abs() > LOSS_TOLERANCE) {
                let got = format!("{sum:?} in all orders");
                return Err(contradiction(id, "all power of light of any polarisation", got));
            }
        }
        self.jones = Some(jones);
        Ok(self)
    }

    /// True if the table has Jones matrices.
    pub fn has_jones(&self) -> bool {
        self.jones.is_some()
    }

    /// The matrices of a file.
    pub(crate) fn packed_jones(&self) -> Option<&[Packed]> {
        self.jones.as_deref()
    }

    /// All matrices, node by node.
    pub fn jones_rows(&self) -> Option<impl Iterator<Item = JonesRow> + '_> {
        let jones = self.jones.as_ref()?;
        let nodes = self.grid.nodes().zip(&self.layout.nodes);
        Some(nodes.map(move |(id, node)| {
            JonesRow {
                node: id,
                orders: node
                    .orders()
                    .map(|(entry, to, order)| OrderJones {
                        to,
                        order,
                        jones: unpacked(&jones[entry]),
                    })
                    .collect(),
            }
        }))
    }

    /// Interpolated Mueller matrices at an incidence, in the order of [`OrderTable::efficiencies`];
    /// their first elements are the unpolarised efficiencies. `None` if the table has no matrices.
    pub fn mueller(&self, side: Side, k: Wavevector) -> Option<Vec<OrderMueller>> {
        let jones = self.jones.as_ref()?;
        let query = Query::new(side, k);
        let stencil = self.stencil(side, query.k.kx, query.k.ky);
        let range = Side::BOTH.map(|to| self.propagating_orders(to, k));
        let mut raw =
            range.map(|(low, high)| vec![[[0.0; 4]; 4]; (high - low + 1).max(0) as usize]);
        // First rows of the evanescent orders, by side, and unpolarised power of the propagating
        // ones.
        let (mut evanescent, mut propagating) = ([[0.0; 4]; 2], [0.0; 2]);
        for (index, weight) in stencil.iter() {
            let (node, at) = (self.layout.nodes[index], self.wavevector(side, index));
            for (entry, to, order) in node.orders() {
                let matrix = unpacked(&jones[entry]);
                let map = columns(|light| self.at_node(query, at, (to, order), &matrix, light));
                let (low, high) = range[to.index()];
                let number = to.index();
                if (low..=high).contains(&order) {
                    let sum = &mut raw[number][(order - low) as usize];
                    for (sum, m) in sum.as_flattened_mut().iter_mut().zip(map.as_flattened()) {
                        *sum += weight * m;
                    }
                    propagating[number] += weight * map[0][0];
                } else {
                    for (sum, m) in evanescent[number].iter_mut().zip(map[0]) {
                        *sum += weight * m;
                    }
                }
            }
        }
        let mut all = Vec::new();
        for to in Side::BOTH {
            let (own, other) = (to.index(), to.opposite().index());
            for (order, mut mueller) in (range[own].0..).zip(std::mem::take(&mut raw[own])) {
                // Redistribution as in `gains`.
                let own_part =
                    if propagating[own] > 0.0 { mueller[0][0] / propagating[own] } else { 0.0 };
                let nowhere = propagating[0] + propagating[1] <= 0.0 && to == side && order == 0;
                let parts = match (nowhere, propagating[other] > 0.0) {
                    (true, _) => [1.0; 2],
                    (false, true) => [own_part, 0.0],
                    (false, false) => [own_part; 2],
                };
                for (column, value) in mueller[0].iter_mut().enumerate() {
                    *value +=
                        parts[0] * evanescent[own][column] + parts[1] * evanescent[other][column];
                }
                // Grazing light comes back as it came.
                for (n, row) in mueller.iter_mut().enumerate() {
                    for (m, element) in row.iter_mut().enumerate() {
                        *element =
                            stencil.with_mirror(*element, n == m && to == side && order == 0);
                    }
                }
                all.push(OrderMueller { to, order, mueller });
            }
        }
        Some(all)
    }

    /// Light after an order of the node with wavevector `at`, from and to the s and p of the query.
    fn at_node(
        &self,
        query: Query,
        at: Wavevector,
        (to, order): (Side, i32),
        matrix: &Jones,
        light: [f64; 4],
    ) -> [f64; 4] {
        let mirror = |light| {
            if query.mirrored { mirrored(light) } else { light }
        };
        let (k, inwards) = (query.k, query.from == Side::Outer);
        let met = pass(matrix, turned(mirror(light), k, at, !inwards));
        let [from, back] = [at, k].map(|k| self.diffracted(k, order));
        mirror(turned(met, from, back, to == Side::Outer))
    }

    /// Wavevector of the node number `index` on a side.
    pub(super) fn wavevector(&self, side: Side, index: usize) -> Wavevector {
        let rows = &self.layout.rows[side.index()];
        let first = |row: &super::layout::KyRow| i64::from(row.origin) + i64::from(row.kx[0]);
        let row = &rows[rows.partition_point(|row| first(row) <= index as i64) - 1];
        Wavevector { kx: self.grid.kx(index as i64 - i64::from(row.origin)), ky: row.ky }
    }

    /// NodeOrders and wavevector of a spot.
    fn node_of(&self, side: Side, location: &BinLocation) -> (NodeOrders, Wavevector) {
        let per_zone = self.alias_table.kx_per_zone as usize;
        let (row, place) = (location.bloch as usize / per_zone, location.bloch as usize % per_zone);
        let row = &self.layout.rows[side.index()][row];
        let kx = location.zone as i64 * per_zone as i64 + place as i64;
        let node = self.layout.nodes[(i64::from(row.origin) + kx) as usize];
        (node, Wavevector { kx: self.grid.kx(kx), ky: row.ky })
    }
}

impl PolarisedBsdf for OrderTable {
    fn sample_polarised(
        &self,
        wi: DVec3,
        [q, u, v]: [f64; 3],
        rng: &mut dyn rand::Rng,
    ) -> Option<(BsdfSample, [f64; 3])> {
        let Some(jones) = &self.jones else {
            return self.sample(wi, rng).map(|sample| (sample, [0.0; 3]));
        };
        let from = Side::from_direction(wi);
        let k = Wavevector::incoming(wi, self.grid.index(from));
        let mut location = self.locate_bin(from, k, [rng.random(), rng.random()]);
        if location.is_mirror() {
            return Some((self.order_sample(from, from, 0, k)?, [q, u, v]));
        }
        let (node, at) = self.node_of(from, &location);
        let query = Query::new(from, k);
        let degree = (q * q + u * u + v * v).sqrt();
        loop {
            let (to, order) = self.order(from, &location, self.bin(&location))?;
            let entry = node.entry(to, order)?;
            let matrix = unpacked(&jones[entry]);
            let mean = 0.5 * matrix.as_flattened().iter().map(Complex64::norm_sqr).sum::<f64>();
            let left = self.at_node(query, at, (to, order), &matrix, [1.0, q, u, v]);
            if degree > 0.0 && rng.random::<f64>() * mean * (1.0 + degree) > left[0] {
                location = self.resample_bin(from, &location, rng.random());
                continue;
            }
            let Some(sample) = self.order_sample(from, to, order, k) else {
                let sample = self.resample_propagating(from, to, k, rng)?;
                return Some((sample, [0.0; 3]));
            };
            let light = if left[0] > 0.0 { [1, 2, 3].map(|n| left[n] / left[0]) } else { [0.0; 3] };
            return Some((sample, light));
        }
    }
}

#[cfg(test)]
mod tests;
