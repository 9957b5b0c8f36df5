// SPDX-License-Identifier: MIT OR Apache-2.0
//! Through the thickness of a layer, from its bottom to its top.
//!
//! A thin slice needs only even functions of kz (cos kz d, sin(kz d)/kz), so no branch and no degeneracy matters; its
//! evanescent waves must not grow by more than a few e-folds. A thick layer is written in upward and downward
//! amplitudes, where only decaying exponentials occur. Where that basis degenerates (kz near 0, or modes that
//! coalesce) a thick layer is cut into thin slices instead.

use super::span::MOST_GROWTH;
use super::state::{Parameters, State};
use crate::linalg::{CMat, Lu, Onto, Scalar, product};
use crate::modes::{Coalescing, Correction, Modes};
use crate::orders::outgoing_kz;
use faer::Mat;
use num_complex::Complex64;
use pulp::{Simd, WithSimd};

/// Largest growth exponent Im(kz) d of a slice that is treated as thin: cosh of it loses a digit.
pub(crate) const THIN: f64 = 2.5;
/// Below this |kz| the upward and downward waves of a mode are too alike to tell apart.
const GRAZING: f64 = 1e-4;

/// Numbers in which the coordinates of a line are kept: complex for running waves, real where `crate::standing` serves.
pub(crate) trait Coordinates: Scalar {
    /// e' = c e + `ELECTRIC_STEP` se h towards the top.
    const ELECTRIC_STEP: Self;
    /// h' = c h + `MAGNETIC_STEP` sh e towards the top.
    const MAGNETIC_STEP: Self;
    /// Largest element of an impedance E = Z H that is carried on as such: each digit of it costs a digit of the fields.
    const LARGEST_IMPEDANCE: f64;
    /// The α of the parameters e + α h, in the order in which they are tried where an impedance is near a pole.
    const SUMS: &'static [f64];

    /// Growth exponent of evanescent waves beyond which the parameters of thin slices are chosen anew.
    const MOST_GROWN: f64;

    /// cos(kz d) and sin(kz d)/kz, both even in kz.
    fn cosine_and_sinc(kz_squared: Self, d: f64) -> (Self, Self);

    /// Im kz of the wave that leaves.
    fn decay(kz_squared: Self) -> f64;

    /// A thick layer at once by upward and downward amplitudes, if these can be told apart. Returns whether it was done.
    fn thick(state: &mut State<Self>, modes: &Modes<Self>, d: f64) -> bool;
}

impl Coordinates for Complex64 {
    const ELECTRIC_STEP: Self = Self::new(0.0, -1.0);
    const MAGNETIC_STEP: Self = Self::new(0.0, -1.0);
    const LARGEST_IMPEDANCE: f64 = 1e3;
    // For a passive structure |e + h|² ≥ |e|² + |h|².
    const SUMS: &'static [f64] = &[1.0];
    const MOST_GROWN: f64 = THIN;

    fn cosine_and_sinc(kz_squared: Self, d: f64) -> (Self, Self) {
        let x2 = kz_squared * d * d;
        if x2.norm_sqr() < 1e-12 {
            series(x2, d)
        } else {
            let x = x2.sqrt();
            (x.cos(), x.sin() / x * d)
        }
    }

    fn decay(kz_squared: Self) -> f64 {
        outgoing_kz(kz_squared).im
    }

    fn thick(state: &mut State<Self>, modes: &Modes<Self>, d: f64) -> bool {
        let kz: Vec<Self> = kz_squared(modes, state.ky * state.ky)
            .into_iter()
            .map(outgoing_kz)
            .collect();
        if modes.coalescing.is_some() || kz.iter().any(|k| k.norm() < GRAZING) {
            return false;
        }
        thick(state, modes, &kz, d);
        true
    }
}

impl Coordinates for f64 {
    const ELECTRIC_STEP: Self = 1.0;
    const MAGNETIC_STEP: Self = -1.0;
    const LARGEST_IMPEDANCE: f64 = 300.0;
    // Without radiation each of them has poles of its own, never at the same place.
    const SUMS: &'static [f64] = &[1.0, -1.0, 0.5, -0.5, 2.0, -2.0];
    // As of layers that are taken together.
    const MOST_GROWN: f64 = MOST_GROWTH;

    fn cosine_and_sinc(kz_squared: Self, d: f64) -> (Self, Self) {
        let x2 = kz_squared * d * d;
        if x2.abs() < 1e-6 {
            series(x2, d)
        } else if x2 > 0.0 {
            let x = x2.sqrt();
            let (sin, cos) = x.sin_cos();
            (cos, sin / x * d)
        } else {
            let x = (-x2).sqrt();
            let up = x.exp();
            let down = 1.0 / up;
            (0.5 * (up + down), 0.5 * (up - down) / x * d)
        }
    }

    fn decay(kz_squared: Self) -> f64 {
        (-kz_squared).max(0.0).sqrt()
    }

    fn thick(_: &mut State<Self>, _: &Modes<Self>, _: f64) -> bool {
        false
    }
}

/// The first terms, for small x² = kz² d².
fn series<T: Scalar>(x2: T, d: f64) -> (T, T) {
    (
        T::ONE - x2.scaled(0.5) * (T::ONE - x2.scaled(1.0 / 12.0)),
        (T::ONE - x2.scaled(1.0 / 6.0) * (T::ONE - x2.scaled(0.05))).scaled(d),
    )
}

/// Of the LSM modes, then of the LSE modes.
fn kz_squared<T: Scalar>(modes: &Modes<T>, ky_squared: f64) -> Vec<T> {
    let of = |&b: &T| b - T::ONE.scaled(ky_squared);
    modes.b_lsm.iter().chain(&modes.b_lse).map(of).collect()
}

/// A column of coordinates each through a slab: e' = c e + se h, h' = c h + sh e.
struct Factors<T> {
    c: Vec<T>,
    se: Vec<T>,
    sh: Vec<T>,
}

/// Takes the state from the bottom to the top of a layer of thickness `d` (times k0) with these modes and corrections.
pub(crate) fn propagate<T: Coordinates>(
    state: &mut State<T>,
    modes: &Modes<T>,
    corrections: &[Correction<T>],
    d: f64,
) {
    let kz_squared = kz_squared(modes, state.ky * state.ky);
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
    let mut pieces = pieces(corrections, d).peekable();
    let first = pieces.peek().map_or(d, |p| p.0);
    while let Some((thickness, correction)) = pieces.next() {
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
                next = slabs(pieces.peek().map_or(first, |p| p.0)).1;
            }
            if state.growth + steepest * next > T::MOST_GROWN {
                choose(state);
            }
        }
    }
}

/// Takes the state through layers with the same modes, thickness and corrections of each, the lowest first, by which evanescent waves grow little; the parameters stay what they are.
pub(crate) fn thin<'a, T: Coordinates + 'a>(
    state: &mut State<T>,
    modes: &Modes<T>,
    layers: impl Iterator<Item = (f64, &'a [Correction<T>])>,
) {
    let kz_squared = kz_squared(modes, state.ky * state.ky);
    let mut before = 0.0;
    for (thickness, correction) in layers.flat_map(|(d, corrections)| pieces(corrections, d)) {
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

/// The thicknesses of a layer from one correction to the next, each with that at its top.
fn pieces<T>(
    corrections: &[Correction<T>],
    d: f64,
) -> impl Iterator<Item = (f64, Option<&Correction<T>>)> {
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

fn correct<T: Coordinates>(state: &mut State<T>, correction: &Correction<T>) {
    correction.add(&mut state.electric, &mut state.magnetic, state.ky);
    let (e, h) = (&mut state.electric_by_below, &mut state.magnetic_by_below);
    correction.add(e, h, state.ky);
}

/// Largest Im kz of the modes at this ky².
pub(crate) fn decay_of_modes<T: Coordinates>(modes: &Modes<T>, ky_squared: f64) -> f64 {
    kz_squared(modes, ky_squared)
        .into_iter()
        .map(T::decay)
        .fold(0.0, f64::max)
}

/// New parameters.
pub(crate) fn choose<T: Coordinates>(state: &mut State<T>) {
    if !take_magnetic(state) {
        take_sum(state);
    }
    state.growth = 0.0;
}

fn factors<T: Coordinates>(modes: &Modes<T>, kz_squared: &[T], d: f64) -> Factors<T> {
    let count = modes.b_lsm.len();
    let (mut c, mut se, mut sh) = (Vec::new(), Vec::new(), Vec::new());
    for (column, &kz2) in kz_squared.iter().enumerate() {
        let (cosine, sinc) = T::cosine_and_sinc(kz2, d);
        c.push(cosine);
        // The coordinates of LSM modes obey -i e' = b h, -i h' = (kz²/b) e; those of LSE modes the reverse.
        let is_lsm = column < count;
        let b = if is_lsm {
            modes.b_lsm[column]
        } else {
            modes.b_lse[column - count]
        };
        let (by_b, by_quotient) = (b * sinc, kz2 * b.inverted() * sinc);
        let (electric, magnetic) = if is_lsm {
            (by_b, by_quotient)
        } else {
            (by_quotient, by_b)
        };
        se.push(T::ELECTRIC_STEP * electric);
        sh.push(T::MAGNETIC_STEP * magnetic);
    }
    Factors { c, se, sh }
}

/// Carries the fields through a thickness; the parameters stay what they are.
fn slab<T: Coordinates>(state: &mut State<T>, modes: &Modes<T>, kz_squared: &[T], d: f64) {
    state.make_explicit();
    let factors = factors(modes, kz_squared, d);
    let pairs = modes.coalescing.as_ref();
    advance(
        &mut state.electric,
        &mut state.magnetic,
        &factors,
        modes,
        pairs,
        state.ky,
        d,
    );
    advance(
        &mut state.electric_by_below,
        &mut state.magnetic_by_below,
        &factors,
        modes,
        pairs,
        state.ky,
        d,
    );
}

/// Whether every element is smaller; a NaN is not.
pub(crate) fn is_bounded<T: Scalar>(m: &Mat<T>, largest: f64) -> bool {
    let allowed = largest * largest;
    (0..m.ncols()).all(|j| {
        let column = m.col_as_slice(j).iter();
        column.fold(true, |all, z| all & (z.squared() < allowed))
    })
}

/// New parameters t' = h, transposed (h by t) N' = e by t: the cheapest choice, since nothing has to be multiplied for
/// h at the next interface. Leaves the state as it is and returns false where this impedance is close to a pole.
fn take_magnetic<T: Coordinates>(state: &mut State<T>) -> bool {
    let [factors, impedance] = &mut state.spare.squares;
    factors.copy_from(&state.magnetic);
    let lu = Lu::of(std::mem::replace(factors, Mat::new()));
    lu.solve_into(&state.electric, impedance);
    let taken = is_bounded(impedance, T::LARGEST_IMPEDANCE);
    if taken {
        std::mem::swap(impedance, &mut state.electric);
        retake(state, &lu);
        state.parameters = Parameters::Magnetic;
    }
    state.spare.squares[0] = lu.into_matrix();
    taken
}

/// New parameters t' = e + α h, transposed (e + α h by t) N' = e by t: never near a pole.
fn take_sum<T: Coordinates>(state: &mut State<T>) {
    let size = state.electric.ncols();
    for (attempt, &alpha) in T::SUMS.iter().enumerate() {
        let lu = Lu::of(added(&state.electric, &state.magnetic, alpha));
        let [_, electric] = &mut state.spare.squares;
        lu.solve_into(&state.electric, electric);
        if attempt + 1 < T::SUMS.len() && !is_bounded(electric, T::LARGEST_IMPEDANCE) {
            continue;
        }
        std::mem::swap(electric, &mut state.electric);
        let one = |i: usize, j: usize| if i == j { T::ONE } else { T::ZERO };
        state.magnetic = Mat::from_fn(size, size, |i, j| {
            (one(i, j) - state.electric[(i, j)]).scaled(1.0 / alpha)
        });
        state.magnetic_by_below = added(&state.electric_by_below, &state.magnetic_by_below, alpha);
        retake(state, &lu);
        // e + α h does not depend on u any more.
        let by_below = &state.electric_by_below;
        state.magnetic_by_below = Mat::from_fn(by_below.nrows(), size, |i, j| {
            by_below[(i, j)].scaled(-1.0 / alpha)
        });
        state.parameters = Parameters::General;
        return;
    }
}

/// What depends on u and what leaves at the bottom, once `electric` is by the new parameters: `lu` are the factors of the new
/// parameters by the old; `magnetic_by_below` holds the new parameters by u.
fn retake<T: Coordinates>(state: &mut State<T>, lu: &Lu<T>) {
    let minus = -T::ONE;
    product(
        state.electric_by_below.as_mut(),
        Onto::Add,
        minus,
        state.magnetic_by_below.as_ref(),
        state.electric.as_ref(),
    );
    // In real numbers this is the transpose of `electric_by_below`, but to use that loses four digits near a pole.
    lu.solve_into(&state.transmitted, &mut state.spare.outgoing);
    std::mem::swap(&mut state.spare.outgoing, &mut state.transmitted);
    product(
        state.reflected_below.as_mut(),
        Onto::Add,
        minus,
        state.magnetic_by_below.as_ref(),
        state.transmitted.as_ref(),
    );
}

fn added<T: Scalar>(a: &Mat<T>, b: &Mat<T>, alpha: f64) -> Mat<T> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| {
        a[(i, j)] + b[(i, j)].scaled(alpha)
    })
}

/// Applies the slab to the columns of `e` and `h`.
fn advance<T: Coordinates>(
    e: &mut Mat<T>,
    h: &mut Mat<T>,
    factors: &Factors<T>,
    modes: &Modes<T>,
    pairs: Option<&Coalescing<T>>,
    ky: f64,
    d: f64,
) {
    let together = pairs.map(|pairs| {
        let count = modes.b_lsm.len();
        let columns: Vec<usize> = pairs
            .lsm
            .iter()
            .copied()
            .chain(pairs.lse.iter().map(|m| count + m))
            .collect();
        let before: Vec<(Vec<T>, Vec<T>)> = columns
            .iter()
            .map(|&c| (e.col_as_slice(c).to_vec(), h.col_as_slice(c).to_vec()))
            .collect();
        (
            columns,
            before,
            pairs.transfer((&modes.b_lse, &modes.b_lsm), ky, d),
        )
    });
    pulp::Arch::new().dispatch(Columns { e, h, factors });
    if let Some((columns, before, transfer)) = together {
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

/// Every column of coordinates by its own factors.
struct Columns<'a, T> {
    e: &'a mut Mat<T>,
    h: &'a mut Mat<T>,
    factors: &'a Factors<T>,
}

impl<T: Scalar> WithSimd for Columns<'_, T> {
    type Output = ();

    #[expect(
        clippy::inline_always,
        reason = "compiled for the instructions that were found"
    )]
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { e, h, factors } = self;
        for column in 0..e.ncols() {
            let (c, se, sh) = (factors.c[column], factors.se[column], factors.sh[column]);
            let both = e
                .col_as_slice_mut(column)
                .iter_mut()
                .zip(h.col_as_slice_mut(column));
            for (e, h) in both {
                (*e, *h) = (c * *e + se * *h, c * *h + sh * *e);
            }
        }
    }
}

/// e = p (a + b), h = q (a - b) with a downward and b upward; q/p is kz/b (LSM) or b/kz (LSE), and the larger of the
/// two amplitudes is 1.
fn amplitudes(modes: &Modes, kz: &[Complex64]) -> (Vec<Complex64>, Vec<Complex64>) {
    let count = modes.b_lsm.len();
    let scale = |numerator: Complex64, denominator: Complex64| {
        if numerator.norm() <= denominator.norm() {
            (Complex64::ONE, numerator / denominator)
        } else {
            (denominator / numerator, Complex64::ONE)
        }
    };
    kz.iter()
        .enumerate()
        .map(|(i, &kz)| {
            if i < count {
                scale(kz, modes.b_lsm[i])
            } else {
                scale(modes.b_lse[i - count], kz)
            }
        })
        .unzip()
}

fn thick(state: &mut State, modes: &Modes, kz: &[Complex64], d: f64) {
    let size = kz.len();
    let (p, q) = amplitudes(modes, kz);
    let decay: Vec<Complex64> = kz.iter().map(|k| (Complex64::I * k * d).exp()).collect();
    let waves = |e: &CMat, h: &CMat, sign: f64| -> CMat {
        Mat::from_fn(e.nrows(), size, |i, j| {
            0.5 * (e[(i, j)] / p[j] + sign * h[(i, j)] / q[j])
        })
    };
    let down = waves(&state.electric, &state.magnetic, 1.0);
    let mut up = waves(&state.electric, &state.magnetic, -1.0);
    let down_by_below = waves(&state.electric_by_below, &state.magnetic_by_below, 1.0);
    let mut up_by_below = waves(&state.electric_by_below, &state.magnetic_by_below, -1.0);

    // New parameters: the downward amplitudes at the top, a. At the bottom X a = down t + down_by_below u.
    let lu = Lu::new(&down);
    lu.solve(up.as_mut());
    lu.solve(state.transmitted.as_mut());
    let minus = -Complex64::ONE;
    product(
        up_by_below.as_mut(),
        Onto::Add,
        minus,
        down_by_below.as_ref(),
        up.as_ref(),
    );
    product(
        state.reflected_below.as_mut(),
        Onto::Add,
        minus,
        down_by_below.as_ref(),
        state.transmitted.as_ref(),
    );
    let outgoing = state.transmitted.ncols();
    state.transmitted = Mat::from_fn(size, outgoing, |i, j| decay[i] * state.transmitted[(i, j)]);

    // Upward amplitudes at the top: ρ a + (up_by_below X) u with ρ = X (up/down) X.
    let reflection: CMat = Mat::from_fn(size, size, |i, j| decay[i] * up[(i, j)] * decay[j]);
    let field = |scale: &[Complex64], sign: f64| -> CMat {
        Mat::from_fn(size, size, |i, j| {
            let one = if i == j { 1.0 } else { 0.0 };
            (one + sign * reflection[(i, j)]) * scale[j]
        })
    };
    state.electric = field(&p, 1.0);
    state.magnetic = field(&q, -1.0);
    let below = up_by_below.nrows();
    let by_below = |scale: &[Complex64], sign: f64| -> CMat {
        Mat::from_fn(below, size, |i, j| {
            sign * up_by_below[(i, j)] * decay[j] * scale[j]
        })
    };
    state.electric_by_below = by_below(&p, 1.0);
    state.magnetic_by_below = by_below(&q, -1.0);
}
