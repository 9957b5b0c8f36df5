// SPDX-License-Identifier: MIT OR Apache-2.0
//! Several layers at once, for many ky of one kx0.
//!
//! The transfer of the coordinates through layers is an entire function of ky: even between coordinates of one family of modes,
//! odd between families. So it is computed at some nodes, those of Chebyshev in ky², and interpolated for all ky by a polynomial in ky². The
//! fields are cos and sin of kz d, kz² = b - ky², and the coefficients of cos √x on an interval of length L fall as 2 (L/4)^k/(2k)!: a dozen nodes
//! reach the last digits, with the corrections of layers too, which together with the layers come near the flow of a relief of the same height. A problem then takes so many layers by two products, where it took as many products as layers.

use super::interface::Interface;
use super::propagate::{Coordinates, choose, decay_of_modes, thin};
use super::state::{Parameters, Spare, State};
use crate::linalg::{Onto, Scalar, product};
use crate::modes::{Basis, Correction, Modes};
use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, MatRef};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Largest growth exponent of the layers that are taken together. At 10 energy closes as well; at 14 it does not.
const MOST_GROWTH: f64 = 8.0;
/// What the polynomial may miss, of the transfer.
const ACCURACY: f64 = 5e-14;
/// Nodes beyond which nothing is gained.
const MOST_NODES: usize = 20;
/// ky for which transfers are evaluated together, so that the nodes are read from memory once for all of them.
const TOGETHER: usize = 8;

/// Elements of a transfer that are evaluated for all ky before the next: with those of all nodes they stay in a processor's nearest memory.
const BLOCK: usize = 256;

/// One layer to be passed.
pub(crate) struct Step<'a, T> {
    /// The interface below it, unless the layer below has the same modes.
    pub(crate) interface: Option<Interface<T>>,
    pub(crate) modes: &'a Modes<T>,
    /// What a relief departs from it by, from its bottom to its top.
    pub(crate) corrections: Vec<Correction<T>>,
    /// Thickness times k0.
    pub(crate) thickness: f64,
}

/// Layers that follow each other.
pub(crate) struct Group {
    /// Which.
    pub(crate) layers: Range<usize>,
    /// Whether they are taken by one [`Transfer`].
    pub(crate) together: bool,
}

/// Memory of one march that groups of layers take in turns, so that the system is asked for it once.
pub(crate) struct Shelf<T> {
    /// Even and odd parts of transfers at some ky.
    evaluated: Mutex<Vec<[Mat<T>; 2]>>,
    /// States without light from below, whose contents do not matter.
    blank: Mutex<Vec<State<T>>>,
}

impl<T: Scalar> Shelf<T> {
    pub(crate) fn new() -> Self {
        Self {
            evaluated: Mutex::new(Vec::new()),
            blank: Mutex::new(Vec::new()),
        }
    }
}

/// Lends one of a pool, or a new one.
fn lent<M, R>(pool: &Mutex<Vec<M>>, make: impl FnOnce() -> M, work: impl FnOnce(&mut M) -> R) -> R {
    let open = || pool.lock().unwrap_or_else(PoisonError::into_inner);
    let found = open().pop();
    let mut memory = found.unwrap_or_else(make);
    let result = work(&mut memory);
    open().push(memory);
    result
}

/// Transfers through the lowest layers of a stack, kept for further ky.
pub(crate) struct Kept<T> {
    /// From the bottom up.
    transfers: Vec<Transfer<T>>,
    /// Layers that they pass.
    layers: usize,
    /// Coordinates above the highest of them.
    basis: Option<Basis<T>>,
    /// The ky that they hold for.
    span: Option<Span>,
    /// Whether the next layers may be kept too.
    grows: bool,
    /// Bytes for them.
    bytes: usize,
}

impl<T: Coordinates> Kept<T> {
    /// Nothing yet, and so many bytes for what comes.
    pub(crate) fn within(bytes: usize) -> Self {
        Self {
            transfers: Vec::new(),
            layers: 0,
            basis: None,
            span: None,
            grows: bytes > 0,
            bytes,
        }
    }

    /// Takes states through the layers that are kept. Returns how many, and the coordinates above the highest.
    pub(crate) fn pass(
        &self,
        states: &mut [&mut State<T>],
        span: &Span,
        shelf: &Shelf<T>,
    ) -> (usize, Option<Basis<T>>) {
        if !self.span.as_ref().is_some_and(|own| own.holds(span)) {
            return (0, None);
        }
        for transfer in &self.transfers {
            transfer.pass(states, shelf);
        }
        (self.layers, self.basis.clone())
    }

    /// Adds transfers through further `layers` with `basis` above them, if they fit and all below are kept; `None` if the layers were not taken together.
    pub(crate) fn add(
        &mut self,
        found: Option<Vec<Transfer<T>>>,
        span: &Span,
        layers: usize,
        basis: &Basis<T>,
    ) {
        if self.span.as_ref().is_some_and(|own| !own.holds(span)) {
            // They were found for other ky, and nothing was passed by them.
            self.bytes += self.transfers.iter().map(Transfer::bytes).sum::<usize>();
            (self.transfers, self.layers, self.span) = (Vec::new(), 0, None);
        }
        let fitting = found.filter(|some| {
            let bytes: usize = some.iter().map(Transfer::bytes).sum();
            self.grows && bytes <= self.bytes
        });
        let Some(some) = fitting else {
            self.grows = false;
            return;
        };
        self.bytes -= some.iter().map(Transfer::bytes).sum::<usize>();
        self.transfers.extend(some);
        self.layers += layers;
        self.basis = Some(basis.clone());
        self.span = Some(*span);
    }
}

/// The ky of a line, as far as they decide which layers are taken together.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    /// Least and largest ky².
    squares: [f64; 2],
    count: usize,
}

impl Span {
    pub(crate) fn of(ky: impl Iterator<Item = f64>) -> Self {
        let mut span = Self {
            squares: [f64::INFINITY, 0.0],
            count: 0,
        };
        for ky in ky {
            span.squares = [span.squares[0].min(ky * ky), span.squares[1].max(ky * ky)];
            span.count += 1;
        }
        span
    }

    /// Whether it holds all ky of another one.
    fn holds(&self, other: &Self) -> bool {
        self.squares[0] <= other.squares[0] && other.squares[1] <= self.squares[1]
    }

    /// Nodes that a thickness (times k0) takes.
    fn nodes(&self, d: f64) -> usize {
        let quarter = 0.25 * (self.squares[1] - self.squares[0]) * d * d;
        let mut term = 2.0;
        let mut k = 0;
        while term > ACCURACY && k <= MOST_NODES {
            k += 1;
            term *= quarter / ((2 * k) as f64 * (2 * k - 1) as f64);
        }
        k.max(1)
    }

    /// Which of the layers are taken together, and which one by one.
    pub(crate) fn groups<T: Coordinates>(&self, steps: &[Step<'_, T>]) -> Vec<Group> {
        let growth: Vec<f64> = steps
            .iter()
            .map(|s| decay_of_modes(s.modes, self.squares[1]) * s.thickness)
            .collect();
        let mut groups: Vec<Group> = Vec::new();
        let mut from = 0;
        while from < steps.len() {
            // As many groups as the rest takes, of equal size.
            let whole: f64 = growth[from..].iter().sum();
            let share = whole / (whole / MOST_GROWTH).ceil().max(1.0) * 1.000_001;
            let (mut to, mut sum) = (from, 0.0);
            while to < steps.len() && (to == from || sum + growth[to] <= share) {
                sum += growth[to];
                to += 1;
            }
            let thickness: f64 = steps[from..to].iter().map(|s| s.thickness).sum();
            let pays = 2 * self.count > 3 * self.nodes(thickness) && sum <= MOST_GROWTH;
            match groups.last_mut() {
                Some(Group {
                    layers,
                    together: false,
                }) if !pays => layers.end = to,
                _ => groups.push(Group {
                    layers: from..to,
                    together: pays,
                }),
            }
            from = to;
        }
        groups
    }

    /// Nodes of Chebyshev in ky², as ky.
    fn places(&self, d: f64) -> Vec<f64> {
        let count = self.nodes(d);
        let [low, high] = self.squares;
        (0..count)
            .map(|j| {
                let x = ((2 * j + 1) as f64 / (2 * count) as f64 * PI).cos();
                (0.5 * (low + high) + 0.5 * (high - low) * x).sqrt()
            })
            .collect()
    }
}

/// The transfer through some layers at nodes of ky, transposed as states are.
pub(crate) struct Transfer<T> {
    orders: usize,
    /// ky of the nodes, ascending or descending.
    nodes: Vec<f64>,
    /// Node by node: by electric and by magnetic coordinates below, electric and magnetic ones above, (N, 2N) each. Columns of LSM coordinates
    /// are by ex or hy, those of LSE coordinates by ey or hx.
    even: Vec<T>,
    /// The same over ky: columns of LSM coordinates by ey or hx, those of LSE coordinates by ex or hy.
    odd: Vec<T>,
}

impl<T: Coordinates> Transfer<T> {
    /// Of these layers, the lowest first.
    pub(crate) fn new(steps: &[Step<'_, T>], span: &Span, shelf: &Shelf<T>) -> Self {
        let thickness = steps.iter().map(|s| s.thickness).sum();
        let nodes = span.places(thickness);
        let orders = steps[0].modes.b_lse.len();
        let part = 8 * orders * orders;
        let [mut even, mut odd] = [0, 1].map(|_| vec![T::ZERO; part * nodes.len()]);
        even.par_chunks_mut(part)
            .zip(odd.par_chunks_mut(part))
            .zip(&nodes)
            .for_each(|(parts, &ky)| {
                lent(
                    &shelf.blank,
                    || blank(orders),
                    |state| {
                        state.ky = ky;
                        through(steps, state);
                        split(state, parts);
                    },
                );
            });
        Self {
            orders,
            nodes,
            even,
            odd,
        }
    }

    /// Memory that it takes.
    pub(crate) fn bytes(&self) -> usize {
        2 * self.even.len() * size_of::<T>()
    }

    /// Takes states through the layers and chooses new parameters.
    pub(crate) fn pass(&self, states: &mut [&mut State<T>], shelf: &Shelf<T>) {
        let rows = self.even.len() / self.nodes.len();
        let memory = || [0, 1].map(|_| Mat::zeros(rows, TOGETHER));
        states.par_chunks_mut(TOGETHER).for_each(|few| {
            lent(&shelf.evaluated, memory, |evaluated| {
                self.pass_few(few, evaluated);
            });
        });
    }

    fn pass_few(&self, states: &mut [&mut State<T>], evaluated: &mut [Mat<T>; 2]) {
        let [even, odd] = &mut *evaluated;
        let weights: Vec<Vec<f64>> = states.iter().map(|s| self.weights(s.ky)).collect();
        let odd_weights: Vec<Vec<f64>> = weights
            .iter()
            .zip(states.iter())
            .map(|(w, state)| w.iter().map(|w| w * state.ky).collect())
            .collect();
        for (out, nodes, weights) in [(even, &self.even, &weights), (odd, &self.odd, &odd_weights)]
        {
            pulp::Arch::new().dispatch(Combine {
                out,
                nodes,
                weights,
            });
        }
        for (k, state) in states.iter_mut().enumerate() {
            let parts = Parts {
                orders: self.orders,
                even: evaluated[0].col_as_slice(k),
                odd: evaluated[1].col_as_slice(k),
            };
            parts.apply(state);
            choose(state);
        }
    }

    /// Of each node's transfer in that at `ky`: Lagrange's polynomials.
    fn weights(&self, ky: f64) -> Vec<f64> {
        let nodes = &self.nodes;
        (0..nodes.len())
            .map(|j| {
                let others = (0..nodes.len()).filter(|&i| i != j);
                others
                    .map(|i| {
                        (ky - nodes[i]) * (ky + nodes[i])
                            / ((nodes[j] - nodes[i]) * (nodes[j] + nodes[i]))
                    })
                    .product()
            })
            .collect()
    }
}

/// `out`, a column for each list of weights: the sum of as many parts of `nodes`, one after the other, by these weights.
struct Combine<'a, T> {
    out: &'a mut Mat<T>,
    nodes: &'a [T],
    weights: &'a [Vec<f64>],
}

impl<T: Scalar> WithSimd for Combine<'_, T> {
    type Output = ();

    #[expect(
        clippy::inline_always,
        reason = "compiled for the instructions that were found"
    )]
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            out,
            nodes,
            weights,
        } = self;
        let rows = out.nrows();
        for from in (0..rows).step_by(BLOCK) {
            let block = from..rows.min(from + BLOCK);
            for (column, weights) in weights.iter().enumerate() {
                let out = &mut out.col_as_slice_mut(column)[block.clone()];
                out.fill(T::ZERO);
                for (pair, weights) in nodes.chunks(2 * rows).zip(weights.chunks(2)) {
                    let first = &pair[block.clone()];
                    if let &[w, v] = weights {
                        let second = &pair[rows..][block.clone()];
                        for ((to, x), y) in out.iter_mut().zip(first).zip(second) {
                            *to += x.scaled(w) + y.scaled(v);
                        }
                    } else {
                        for (to, x) in out.iter_mut().zip(first) {
                            *to += x.scaled(weights[0]);
                        }
                    }
                }
            }
        }
    }
}

/// Takes the state, whose contents do not matter, through the layers; electric, then magnetic coordinates below them become the parameters.
fn through<T: Coordinates>(steps: &[Step<'_, T>], state: &mut State<T>) {
    match &steps[0].interface {
        Some(interface) => crossed(interface, state),
        None => given(state),
    }
    for (number, step) in steps.iter().enumerate() {
        if number > 0
            && let Some(interface) = &step.interface
        {
            state.cross(interface);
        }
        thin(state, step.modes, &step.corrections, step.thickness);
    }
}

/// A state without any light from below, and twice as many parameters as coordinates of a kind.
fn blank<T: Scalar>(orders: usize) -> State<T> {
    let (rows, size) = (4 * orders, 2 * orders);
    let tall = || Mat::zeros(rows, size);
    State {
        ky: 0.0,
        parameters: Parameters::General,
        growth: 0.0,
        electric: tall(),
        magnetic: tall(),
        electric_by_below: Mat::zeros(0, size),
        magnetic_by_below: Mat::zeros(0, size),
        transmitted: Mat::zeros(rows, 0),
        reflected_below: Mat::zeros(0, 0),
        spare: Spare {
            squares: [tall(), Mat::new()],
            by_below: Mat::zeros(0, size),
            outgoing: Mat::zeros(rows, 0),
        },
    }
}

/// The coordinates themselves, each of them a parameter.
fn given<T: Scalar>(state: &mut State<T>) {
    let size = state.electric.ncols();
    for (fields, row) in [(&mut state.electric, 0), (&mut state.magnetic, size)] {
        fields.fill(T::ZERO);
        for j in 0..size {
            fields[(row + j, j)] = T::ONE;
        }
    }
}

/// What an interface makes of the coordinates below it, each of them a parameter.
fn crossed<T: Scalar>(interface: &Interface<T>, state: &mut State<T>) {
    let n = interface.lse.nrows();
    state.electric.fill(T::ZERO);
    state.magnetic.fill(T::ZERO);
    let ky = state.ky;
    let place = |to: &mut Mat<T>, row: usize, column: usize, from: &Mat<T>, by: f64| {
        for j in 0..n {
            let target = &mut to.col_as_slice_mut(column + j)[row..row + n];
            for (to, from) in target.iter_mut().zip(from.col_as_slice(j)) {
                *to = from.scaled(by);
            }
        }
    };
    let (e, h) = (&mut state.electric, &mut state.magnetic);
    place(e, 0, 0, &interface.electric, 1.0);
    place(e, 0, n, &interface.electric_coupling, ky);
    place(e, n, n, &interface.lse, 1.0);
    place(h, 2 * n, 0, &interface.magnetic, 1.0);
    place(h, 3 * n, 0, &interface.magnetic_coupling, ky);
    place(h, 3 * n, n, &interface.lse, 1.0);
}

/// Even and odd parts of a transfer, the latter over ky: by electric, then by magnetic coordinates below; electric, then magnetic ones above, (N, 2N) each.
fn split<T: Scalar>(state: &State<T>, (even, odd): (&mut [T], &mut [T])) {
    let n = state.electric.ncols() / 2;
    let by_ky = 1.0 / state.ky;
    let mut parts = even.chunks_mut(n).zip(odd.chunks_mut(n));
    for from in [0, 2 * n] {
        for fields in [&state.electric, &state.magnetic] {
            for j in 0..2 * n {
                let (lsm, lse) = fields.col_as_slice(j)[from..from + 2 * n].split_at(n);
                let (own, other) = if j < n { (lsm, lse) } else { (lse, lsm) };
                let Some((even, odd)) = parts.next() else {
                    return;
                };
                even.copy_from_slice(own);
                for (to, from) in odd.iter_mut().zip(other) {
                    *to = from.scaled(by_ky);
                }
            }
        }
    }
}

/// A transfer at one ky.
struct Parts<'a, T> {
    orders: usize,
    even: &'a [T],
    odd: &'a [T],
}

impl<T: Scalar> Parts<'_, T> {
    /// Even and odd parts of electric (`above` 0) or magnetic (1) coordinates above by those `below`, (N, 2N) each.
    fn part(&self, below: usize, above: usize) -> [MatRef<'_, T>; 2] {
        let n = self.orders;
        let size = 2 * n * n;
        let from = (2 * below + above) * size;
        [self.even, self.odd]
            .map(|all| MatRef::from_column_major_slice(&all[from..from + size], n, 2 * n))
    }

    /// Adds to `out`, coordinates above, what `fields` below make.
    fn add(
        &self,
        mut out: MatMut<'_, T>,
        onto: Onto,
        fields: MatRef<'_, T>,
        (below, above): (usize, usize),
    ) {
        let n = self.orders;
        let (lsm, lse) = (fields.subcols(0, n), fields.subcols(n, n));
        let parts = self.part(below, above);
        for (column, own, other) in [(0, lsm, lse), (n, lse, lsm)] {
            let [even, odd] = parts.map(|m| m.subcols(column, n));
            let mut to = out.rb_mut().subcols_mut(column, n);
            product(to.rb_mut(), onto, T::ONE, own, even);
            product(to, Onto::Add, T::ONE, other, odd);
        }
    }

    /// The same of magnetic fields that are the identity.
    fn add_identity(&self, out: &mut Mat<T>, above: usize) {
        let n = self.orders;
        let [even, odd] = self.part(1, above);
        for column in 0..2 * n {
            let (lsm, lse) = out.col_as_slice_mut(column).split_at_mut(n);
            let (own, other) = if column < n { (lsm, lse) } else { (lse, lsm) };
            for i in 0..n {
                own[i] += even[(i, column)];
                other[i] += odd[(i, column)];
            }
        }
    }

    fn apply(&self, state: &mut State<T>) {
        let is_magnetic = state.parameters == Parameters::Magnetic;
        for (above, out) in state.spare.squares.iter_mut().enumerate() {
            self.add(
                out.as_mut(),
                Onto::Replace,
                state.electric.as_ref(),
                (0, above),
            );
            if is_magnetic {
                self.add_identity(out, above);
            } else {
                self.add(out.as_mut(), Onto::Add, state.magnetic.as_ref(), (1, above));
            }
        }
        let [e, h] = &mut state.spare.squares;
        std::mem::swap(e, &mut state.electric);
        std::mem::swap(h, &mut state.magnetic);
        let (e, h) = (&mut state.electric_by_below, &mut state.magnetic_by_below);
        if e.nrows() > 0 {
            let below = [e.clone(), h.clone()];
            for (above, out) in [e, h].into_iter().enumerate() {
                self.add(out.as_mut(), Onto::Replace, below[0].as_ref(), (0, above));
                if !is_magnetic {
                    self.add(out.as_mut(), Onto::Add, below[1].as_ref(), (1, above));
                }
            }
        }
        state.parameters = Parameters::General;
    }
}
