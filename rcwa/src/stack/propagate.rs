// SPDX-License-Identifier: MIT OR Apache-2.0
//! Propagation through the thickness of a layer, from its bottom to its top (3.3).
//!
//! A thin slice needs only even functions of kz, cos kz d and sin(kz d)/kz, so that no branch and
//! no degeneracy matters; its evanescent waves grow by a few e-folds at most. A thick layer is
//! written in upward and downward amplitudes. Where these degenerate (kz near 0, or degenerate
//! modes) it is cut into thin slices.

use super::arithmetic::{Arithmetic, THIN};
use super::interface::InterfaceMatrices;
use super::state::{Parameters, State};
use crate::linalg::{Accum, Lu, Scalar, combined, delta, is_bounded, product};
use crate::modes::{CorrectionStep, DegenerateModes, DegenerateTransfer, Modes};
use faer::Mat;
use pulp::{Simd, WithSimd};

/// One layer of the recursion.
pub(crate) struct LayerStep<'a, T> {
    /// The interface below it, unless the layer below has the same modes.
    pub(crate) interface: Option<InterfaceMatrices<T>>,
    pub(crate) modes: &'a Modes<T>,
    /// Wall corrections, from its bottom to its top.
    pub(crate) corrections: Vec<CorrectionStep<T>>,
    /// Thickness times k0.
    pub(crate) thickness: f64,
}

/// Factors of a slab for every column of coordinates: e' = c e + se h, h' = c h + sh e.
struct ColumnFactors<T> {
    c: Vec<T>,
    se: Vec<T>,
    sh: Vec<T>,
}

impl<T: Arithmetic> LayerStep<'_, T> {
    /// Takes a state across the interface below the layer (3.2) and through its thickness (3.3).
    pub(crate) fn pass(&self, state: &mut State<T>) {
        if let Some(interface) = &self.interface {
            state.cross(interface);
        }
        propagate(state, self.modes, &self.corrections, self.thickness);
    }
}

/// The transfer through a slab at one ky, mode by mode.
struct SlabTransfer<'a, T> {
    factors: ColumnFactors<T>,
    /// Number of LSM modes.
    lsm: usize,
    /// The degenerate modes and their joint transfer (2.4).
    degenerate: Option<(&'a DegenerateModes<T>, DegenerateTransfer<T>)>,
}

/// Takes a state from the bottom to the top of a layer of thickness `d` (times k0), in slabs as
/// thin as needed.
fn propagate<T: Arithmetic>(
    state: &mut State<T>,
    modes: &Modes<T>,
    corrections: &[CorrectionStep<T>],
    d: f64,
) {
    let kz_squared = modes.kz_squared(state.ky * state.ky);
    let steepest = kz_squared.iter().map(|&k| T::decay(k)).fold(0.0, f64::max);
    state.make_explicit();
    if steepest * d > THIN && corrections.is_empty() && T::thick(state, modes, d) {
        state.growth = 0.0;
        return;
    }
    // Thickness of a slab no thicker than this.
    let slabs = |thickness: f64| {
        let count = (steepest * thickness / THIN).ceil().max(1.0);
        (count as usize, thickness / count)
    };
    let mut between_corrections = between_corrections(corrections, d).peekable();
    let first = between_corrections.peek().map_or(d, |p| p.0);
    while let Some((thickness, correction)) = between_corrections.next() {
        let (count, each) = slabs(thickness);
        for number in 1..=count {
            slab(state, modes, &kz_squared, each);
            state.growth += steepest * each;
            let mut next = each;
            if number == count {
                if let Some(correction) = correction {
                    correct(state, correction);
                }
                // Layers are taken to be followed by their like.
                next = slabs(between_corrections.peek().map_or(first, |p| p.0)).1;
            }
            if state.growth + steepest * next > T::MAX_GROWN_EXPONENT {
                choose_parameters(state);
            }
        }
    }
}

/// Takes a state through thin layers with the same modes, each given by its thickness and
/// corrections, the lowest first. The parameters stay.
pub(crate) fn pass_thin_layers<'a, T: Arithmetic + 'a>(
    state: &mut State<T>,
    modes: &Modes<T>,
    layers: impl Iterator<Item = (f64, &'a [CorrectionStep<T>])>,
) {
    let kz_squared = modes.kz_squared(state.ky * state.ky);
    let mut before = 0.0;
    for (thickness, correction) in
        layers.flat_map(|(d, corrections)| between_corrections(corrections, d))
    {
        before += thickness;
        if let Some(correction) = correction {
            slab(state, modes, &kz_squared, before);
            correct(state, correction);
            before = 0.0;
        }
    }
    if before > 0.0 {
        slab(state, modes, &kz_squared, before);
    }
}

/// Thicknesses of a layer between its corrections, each with the correction at its top.
fn between_corrections<T>(
    corrections: &[CorrectionStep<T>],
    d: f64,
) -> impl Iterator<Item = (f64, Option<&CorrectionStep<T>>)> {
    let mut at = 0.0;
    let places = corrections.iter().map(|c| (c.place, Some(c)));
    places
        .chain([(1.0, None)])
        .map(move |(place, correction)| {
            let thickness = (place - at) * d;
            at = place;
            (thickness, correction)
        })
        .filter(|(thickness, correction)| *thickness > 0.0 || correction.is_some())
}

fn correct<T: Arithmetic>(state: &mut State<T>, correction: &CorrectionStep<T>) {
    correction.add(&mut state.electric, &mut state.magnetic, state.ky);
    let (e, h) = (&mut state.electric_by_below, &mut state.magnetic_by_below);
    correction.add(e, h, state.ky);
}

/// Largest Im kz of the modes at this ky².
pub(crate) fn decay_of_modes<T: Arithmetic>(modes: &Modes<T>, ky_squared: f64) -> f64 {
    modes.kz_squared(ky_squared).into_iter().map(T::decay).fold(0.0, f64::max)
}

/// Chooses new parameters.
pub(crate) fn choose_parameters<T: Arithmetic>(state: &mut State<T>) {
    if !take_impedance(state) {
        take_sum(state);
    }
    state.growth = 0.0;
}

impl<T: Arithmetic> SlabTransfer<'_, T> {
    /// Of thickness `d` (times k0) at one ky.
    fn new<'a>(modes: &'a Modes<T>, kz_squared: &[T], ky: f64, d: f64) -> SlabTransfer<'a, T> {
        let lsm = modes.b_lsm.len();
        let (mut c, mut se, mut sh) = (Vec::new(), Vec::new(), Vec::new());
        for (column, &kz2) in kz_squared.iter().enumerate() {
            let (cosine, sinc) = T::cosine_and_sinc(kz2, d);
            c.push(cosine);
            // LSM modes obey -i e' = b h, -i h' = (kz²/b) e; LSE modes the reverse (3.3).
            let is_lsm = column < lsm;
            let b = if is_lsm { modes.b_lsm[column] } else { modes.b_lse[column - lsm] };
            let (by_b, by_quotient) = (b * sinc, kz2 * b.inverted() * sinc);
            let (electric, magnetic) =
                if is_lsm { (by_b, by_quotient) } else { (by_quotient, by_b) };
            se.push(T::ELECTRIC_STEP * electric);
            sh.push(T::MAGNETIC_STEP * magnetic);
        }
        let degenerate = modes.degenerate.as_ref();
        SlabTransfer {
            factors: ColumnFactors { c, se, sh },
            lsm,
            degenerate: degenerate.map(|pairs| (pairs, pairs.transfer(ky, d))),
        }
    }

    /// Applies the slab to the columns of `e` and `h`.
    fn apply(&self, e: &mut Mat<T>, h: &mut Mat<T>) {
        let together = self.degenerate.as_ref().map(|(pairs, transfer)| {
            let lse = pairs.lse.iter().map(|m| self.lsm + m);
            let columns: Vec<usize> = pairs.lsm.iter().copied().chain(lse).collect();
            let before: Vec<(Vec<T>, Vec<T>)> = columns
                .iter()
                .map(|&c| (e.col_as_slice(c).to_vec(), h.col_as_slice(c).to_vec()))
                .collect();
            (columns, before, transfer)
        });
        let factors = &self.factors;
        pulp::Arch::new().dispatch(ScaleColumns { e, h, factors });
        let Some((columns, before, transfer)) = together else {
            return;
        };
        for (i, &column) in columns.iter().enumerate() {
            for row in 0..e.nrows() {
                let (mut electric, mut magnetic) = (T::ZERO, T::ZERO);
                for (j, (eb, hb)) in before.iter().enumerate() {
                    electric += transfer.ce[(i, j)] * eb[row]
                        + T::ELECTRIC_STEP * transfer.se[(i, j)] * hb[row];
                    magnetic += transfer.ch[(i, j)] * hb[row]
                        + T::MAGNETIC_STEP * transfer.sh[(i, j)] * eb[row];
                }
                e[(row, column)] = electric;
                h[(row, column)] = magnetic;
            }
        }
    }
}

/// Carries the fields through a thickness. The parameters stay.
fn slab<T: Arithmetic>(state: &mut State<T>, modes: &Modes<T>, kz_squared: &[T], d: f64) {
    state.make_explicit();
    let slab = SlabTransfer::new(modes, kz_squared, state.ky, d);
    slab.apply(&mut state.electric, &mut state.magnetic);
    slab.apply(&mut state.electric_by_below, &mut state.magnetic_by_below);
}

/// Takes the parameters t' = h, so that transposed (h by t) N' = e by t. The cheapest choice, since
/// h is the identity at the next interface. Returns `false`, and leaves the state as it was, where
/// this impedance is close to a pole.
fn take_impedance<T: Arithmetic>(state: &mut State<T>) -> bool {
    let [factors, impedance] = &mut state.scratch.squares;
    factors.copy_from(&state.magnetic);
    let lu = Lu::in_place(std::mem::replace(factors, Mat::new()));
    lu.solve_into(&state.electric, impedance);
    let taken = is_bounded(impedance, T::LARGEST_IMPEDANCE);
    if taken {
        std::mem::swap(impedance, &mut state.electric);
        apply_parameters(state, &lu);
        state.parameters = Parameters::Magnetic;
    }
    state.scratch.squares[0] = lu.into_matrix();
    taken
}

/// Takes the parameters t' = e + α h, so that transposed (e + α h by t) N' = e by t: never near a
/// pole.
fn take_sum<T: Arithmetic>(state: &mut State<T>) {
    let size = state.electric.ncols();
    for (attempt, &alpha) in T::SUMS.iter().enumerate() {
        let lu = Lu::in_place(combined(&state.electric, &state.magnetic, alpha));
        let [_, electric] = &mut state.scratch.squares;
        lu.solve_into(&state.electric, electric);
        if attempt + 1 < T::SUMS.len() && !is_bounded(electric, T::LARGEST_IMPEDANCE) {
            continue;
        }
        std::mem::swap(electric, &mut state.electric);
        state.magnetic = Mat::from_fn(size, size, |i, j| {
            (delta::<T>(i, j) - state.electric[(i, j)]).scaled(1.0 / alpha)
        });
        state.magnetic_by_below =
            combined(&state.electric_by_below, &state.magnetic_by_below, alpha);
        apply_parameters(state, &lu);
        // e + α h does not depend on u any more.
        let by_below = &state.electric_by_below;
        state.magnetic_by_below =
            Mat::from_fn(by_below.nrows(), size, |i, j| by_below[(i, j)].scaled(-1.0 / alpha));
        state.parameters = Parameters::General;
        return;
    }
}

/// Updates the matrices of u and of the outgoing waves once `electric` is by the new parameters.
/// `lu` holds the factors of the new parameters by the old, `magnetic_by_below` the new parameters
/// by u.
fn apply_parameters<T: Arithmetic>(state: &mut State<T>, lu: &Lu<T>) {
    let minus = -T::ONE;
    product(
        state.electric_by_below.as_mut(),
        Accum::Add,
        minus,
        state.magnetic_by_below.as_ref(),
        state.electric.as_ref(),
    );
    // In real numbers this is the transpose of `electric_by_below`, but to use that loses four
    // digits near a pole.
    lu.solve_into(&state.transmitted, &mut state.scratch.outgoing);
    std::mem::swap(&mut state.scratch.outgoing, &mut state.transmitted);
    product(
        state.reflected_below.as_mut(),
        Accum::Add,
        minus,
        state.magnetic_by_below.as_ref(),
        state.transmitted.as_ref(),
    );
}

/// Multiplies every column of coordinates by its factors.
struct ScaleColumns<'a, T> {
    e: &'a mut Mat<T>,
    h: &'a mut Mat<T>,
    factors: &'a ColumnFactors<T>,
}

impl<T: Scalar> WithSimd for ScaleColumns<'_, T> {
    type Output = ();

    #[expect(clippy::inline_always, reason = "compiled for the instructions that were found")]
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { e, h, factors } = self;
        for column in 0..e.ncols() {
            let (c, se, sh) = (factors.c[column], factors.se[column], factors.sh[column]);
            let both = e.col_as_slice_mut(column).iter_mut().zip(h.col_as_slice_mut(column));
            for (e, h) in both {
                (*e, *h) = (c * *e + se * *h, c * *h + sh * *e);
            }
        }
    }
}
