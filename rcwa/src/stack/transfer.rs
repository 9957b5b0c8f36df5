// SPDX-License-Identifier: MIT OR Apache-2.0
//! The transfer through several layers at once, for many ky of one kx0.
//!
//! The transfer of the coordinates is an entire function of ky: even between coordinates of one
//! family of modes, odd between families. It is computed at nodes of Chebyshev in ky² and
//! interpolated for all ky by a polynomial in ky². The fields (3.3) are cos and sin of kz d, where kz² =
//! b minus ky². On an interval of length L the coefficients of cos √x fall as 2 (L/4)^k/(2k)!: a
//! dozen nodes reach the last digits, wall corrections included. A problem then passes these layers
//! by two products in place of two for each layer.

use super::arithmetic::Arithmetic;
use super::interface::InterfaceMatrices;
use super::ky_batch::KyBatch;
use super::propagate::{LayerStep, choose_parameters, pass_thin_layers};
use super::state::{Parameters, Scratch, State, magnetic_blocks, place};
use crate::linalg::{Accum, Scalar, product};
use crate::modes::Modes;
use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, MatRef};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// ky evaluated together, so that the nodes are read from memory once for all of them.
const TOGETHER: usize = 8;

/// Elements of a transfer evaluated for all ky before the next ones: with those of all nodes they
/// fit into a processor's cache.
const BLOCK: usize = 256;

/// Memory of one recursion, shared by its groups of layers and its threads.
pub(crate) struct Workspace<T> {
    /// Even and odd parts of transfers at some ky.
    evaluated: Mutex<Vec<[Mat<T>; 2]>>,
    /// States without light from below, to be overwritten.
    blank: Mutex<Vec<State<T>>>,
}

impl<T: Scalar> Workspace<T> {
    pub(crate) fn new() -> Self {
        Self { evaluated: Mutex::new(Vec::new()), blank: Mutex::new(Vec::new()) }
    }
}

/// Calls `work` with memory from a pool, or with new memory.
fn with_pooled<M, R>(
    pool: &Mutex<Vec<M>>,
    make: impl FnOnce() -> M,
    work: impl FnOnce(&mut M) -> R,
) -> R {
    let open = || pool.lock().unwrap_or_else(PoisonError::into_inner);
    let found = open().pop();
    let mut memory = found.unwrap_or_else(make);
    let result = work(&mut memory);
    open().push(memory);
    result
}

/// Numbers of LSM and LSE coordinates.
#[derive(Clone, Copy)]
struct CoordinateCounts {
    lsm: usize,
    lse: usize,
}

impl CoordinateCounts {
    fn new<T>(modes: &Modes<T>) -> Self {
        Self { lsm: modes.b_lsm.len(), lse: modes.b_lse.len() }
    }

    fn both(self) -> usize {
        self.lsm + self.lse
    }

    /// Even and odd elements from one kind of coordinates to one.
    fn elements(self) -> [usize; 2] {
        let Self { lsm, lse } = self;
        [lsm * lsm + lse * lse, 2 * lsm * lse]
    }
}

/// The transfer through some layers at nodes of ky, transposed as states are.
pub(crate) struct Transfer<T> {
    sizes: CoordinateCounts,
    /// ky of the nodes, ascending or descending.
    nodes: Vec<f64>,
    /// Node by node: by electric and by magnetic coordinates below, electric and magnetic ones
    /// above. Columns of LSM coordinates, one after the other, are by ex or hy, then those of LSE
    /// coordinates by ey or hx.
    even: Vec<T>,
    /// The same over ky: columns of LSM coordinates by ey or hx, those of LSE coordinates by ex or
    /// hy.
    odd: Vec<T>,
}

impl<T: Arithmetic> Transfer<T> {
    /// Computes the transfer through these layers, the lowest first.
    pub(crate) fn new(steps: &[LayerStep<'_, T>], span: &KyBatch, shelf: &Workspace<T>) -> Self {
        let thickness = steps.iter().map(|s| s.thickness).sum();
        let nodes = span.places(thickness);
        let sizes = CoordinateCounts::new(steps[0].modes);
        let parts = sizes.elements().map(|count| 4 * count);
        let [mut even, mut odd] = parts.map(|part| vec![T::ZERO; part * nodes.len()]);
        even.par_chunks_mut(parts[0]).zip(odd.par_chunks_mut(parts[1])).zip(&nodes).for_each(
            |(parts, &ky)| {
                with_pooled(
                    &shelf.blank,
                    || blank(sizes.both()),
                    |state| {
                        state.ky = ky;
                        pass_layers(steps, state);
                        split_by_parity(state, sizes, parts);
                    },
                );
            },
        );
        Self { sizes, nodes, even, odd }
    }

    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        (self.even.len() + self.odd.len()) * size_of::<T>()
    }

    /// Takes states through the layers and chooses new parameters.
    pub(crate) fn pass(&self, states: &mut [&mut State<T>], shelf: &Workspace<T>) {
        let memory = || {
            let parts = self.sizes.elements().map(|count| 4 * count);
            parts.map(|part| Mat::zeros(part, TOGETHER))
        };
        states.par_chunks_mut(TOGETHER).for_each(|few| {
            with_pooled(&shelf.evaluated, memory, |evaluated| {
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
            pulp::Arch::new().dispatch(Interpolate { out, nodes, weights });
        }
        for (k, state) in states.iter_mut().enumerate() {
            let parts = EvaluatedTransfer {
                sizes: self.sizes,
                even: evaluated[0].col_as_slice(k),
                odd: evaluated[1].col_as_slice(k),
            };
            parts.apply(state);
            choose_parameters(state);
        }
    }

    /// Weights of the nodes at `ky`: Lagrange's polynomials in ky².
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

/// Writes to each column of `out` the sum of the parts of `nodes`, one after the other, by one list
/// of weights.
struct Interpolate<'a, T> {
    out: &'a mut Mat<T>,
    nodes: &'a [T],
    weights: &'a [Vec<f64>],
}

impl<T: Scalar> WithSimd for Interpolate<'_, T> {
    type Output = ();

    #[expect(clippy::inline_always, reason = "compiled for the instructions that were found")]
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { out, nodes, weights } = self;
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

/// Overwrites a state by the transfer through the layers: its parameters are the electric, then the
/// magnetic coordinates below them.
fn pass_layers<T: Arithmetic>(steps: &[LayerStep<'_, T>], state: &mut State<T>) {
    match &steps[0].interface {
        Some(interface) => interface_parameters(interface, state),
        None => identity_parameters(state),
    }
    let alike = steps.chunk_by(|_, next| next.interface.is_none());
    for (number, layers) in alike.enumerate() {
        if number > 0
            && let Some(interface) = &layers[0].interface
        {
            state.cross(interface);
        }
        let passed = layers.iter().map(|s| (s.thickness, s.corrections.as_slice()));
        pass_thin_layers(state, layers[0].modes, passed);
    }
}

/// A state without light from below, with twice as many parameters as coordinates.
fn blank<T: Scalar>(size: usize) -> State<T> {
    let rows = 2 * size;
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
        scratch: Scratch {
            squares: [tall(), Mat::new()],
            by_below: Mat::zeros(0, size),
            outgoing: Mat::zeros(rows, 0),
        },
    }
}

/// Makes every coordinate a parameter.
fn identity_parameters<T: Scalar>(state: &mut State<T>) {
    let size = state.electric.ncols();
    for (fields, row) in [(&mut state.electric, 0), (&mut state.magnetic, size)] {
        fields.fill(T::ZERO);
        for j in 0..size {
            fields[(row + j, j)] = T::ONE;
        }
    }
}

/// Makes every coordinate below an interface a parameter of the fields above it.
fn interface_parameters<T: Scalar>(interface: &InterfaceMatrices<T>, state: &mut State<T>) {
    let (lsm, lse) = (interface.electric.nrows(), interface.lse.nrows());
    let (ky, e) = (state.ky, &mut state.electric);
    e.fill(T::ZERO);
    place(e, [0, 0], &interface.electric, 1.0);
    place(e, [0, lsm], &interface.electric_coupling, ky);
    place(e, [lsm, lsm], &interface.lse, 1.0);
    magnetic_blocks(&mut state.magnetic, lsm + lse, interface, ky);
}

/// Even and odd parts of a transfer, the latter over ky, in the order of [`Transfer`].
fn split_by_parity<T: Scalar>(
    state: &State<T>,
    sizes: CoordinateCounts,
    (even, odd): (&mut [T], &mut [T]),
) {
    let by_ky = 1.0 / state.ky;
    let (mut even, mut odd) = (even, odd);
    for from in [0, sizes.both()] {
        for fields in [&state.electric, &state.magnetic] {
            for j in 0..sizes.both() {
                let column = &fields.col_as_slice(j)[from..from + sizes.both()];
                let (lsm, lse) = column.split_at(sizes.lsm);
                let (own, other) = if j < sizes.lsm { (lsm, lse) } else { (lse, lsm) };
                let (to, rest) = even.split_at_mut(own.len());
                to.copy_from_slice(own);
                even = rest;
                let (to, rest) = odd.split_at_mut(other.len());
                for (to, from) in to.iter_mut().zip(other) {
                    *to = from.scaled(by_ky);
                }
                odd = rest;
            }
        }
    }
}

/// The transfer at one ky.
struct EvaluatedTransfer<'a, T> {
    sizes: CoordinateCounts,
    even: &'a [T],
    odd: &'a [T],
}

/// The matrix that begins here, column by column.
fn block<T>(from: &[T], rows: usize, columns: usize) -> MatRef<'_, T> {
    MatRef::from_column_major_slice(&from[..rows * columns], rows, columns)
}

impl<T: Scalar> EvaluatedTransfer<'_, T> {
    /// Even and odd parts of electric (`above` 0) or magnetic (1) coordinates above by those
    /// `below`: to LSM, then to LSE coordinates.
    fn part(&self, below: usize, above: usize) -> [[MatRef<'_, T>; 2]; 2] {
        let CoordinateCounts { lsm, lse } = self.sizes;
        let number = 2 * below + above;
        let [even, odd] = self.sizes.elements().map(|size| number * size);
        let (even, odd) = (&self.even[even..], &self.odd[odd..]);
        [
            [block(even, lsm, lsm), block(odd, lse, lsm)],
            [block(&even[lsm * lsm..], lse, lse), block(&odd[lse * lsm..], lsm, lse)],
        ]
    }

    /// Adds to `out`, coordinates above, the transfer of `fields` below.
    fn add(
        &self,
        mut out: MatMut<'_, T>,
        accum: Accum,
        fields: MatRef<'_, T>,
        (below, above): (usize, usize),
    ) {
        let (lsm, lse) = fields.split_at_col(self.sizes.lsm);
        let [to_lsm, to_lse] = self.part(below, above);
        let (x, z) = out.rb_mut().split_at_col_mut(self.sizes.lsm);
        for (mut to, own, other, [even, odd]) in [(x, lsm, lse, to_lsm), (z, lse, lsm, to_lse)] {
            product(to.rb_mut(), accum, T::ONE, own, even);
            product(to, Accum::Add, T::ONE, other, odd);
        }
    }

    /// [`Self::add`] for magnetic fields that are the identity.
    fn add_identity(&self, out: &mut Mat<T>, above: usize) {
        let count = self.sizes.lsm;
        let [to_lsm, to_lse] = self.part(1, above);
        for column in 0..self.sizes.both() {
            let (lsm, lse) = out.col_as_slice_mut(column).split_at_mut(count);
            let (own, other, [even, odd], column) = if column < count {
                (lsm, lse, to_lsm, column)
            } else {
                (lse, lsm, to_lse, column - count)
            };
            for (to, from) in own.iter_mut().zip(even.col(column).iter()) {
                *to += *from;
            }
            for (to, from) in other.iter_mut().zip(odd.col(column).iter()) {
                *to += *from;
            }
        }
    }

    fn apply(&self, state: &mut State<T>) {
        let is_magnetic = state.parameters == Parameters::Magnetic;
        for (above, out) in state.scratch.squares.iter_mut().enumerate() {
            self.add(out.as_mut(), Accum::Replace, state.electric.as_ref(), (0, above));
            if is_magnetic {
                self.add_identity(out, above);
            } else {
                self.add(out.as_mut(), Accum::Add, state.magnetic.as_ref(), (1, above));
            }
        }
        let [e, h] = &mut state.scratch.squares;
        std::mem::swap(e, &mut state.electric);
        std::mem::swap(h, &mut state.magnetic);
        let (e, h) = (&mut state.electric_by_below, &mut state.magnetic_by_below);
        if e.nrows() > 0 {
            let below = [e.clone(), h.clone()];
            for (above, out) in [e, h].into_iter().enumerate() {
                self.add(out.as_mut(), Accum::Replace, below[0].as_ref(), (0, above));
                if !is_magnetic {
                    self.add(out.as_mut(), Accum::Add, below[1].as_ref(), (1, above));
                }
            }
        }
        state.parameters = Parameters::General;
    }
}
