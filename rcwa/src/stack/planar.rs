// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light from the top in the plane of incidence (ky = 0), where TM and TE decouple.
//!
//! Two recursions of size N, e = N t and h = D t for each family, replace one of size 2N and take
//! an eighth of its work each. At ky = 0 kz² = b, so that the coordinates obey -i e' = b h, -i h' =
//! e (TM) or the reverse (TE), and modes with b = 0 need no care. In: the state just above the
//! bottom half-space. Out: the state just below the top one, in the same form.

use super::Stack;
use super::arithmetic::{Arithmetic, THIN};
use super::state::{Parameters, State};
use crate::error::Error;
use crate::linalg::{CMat, Lu, is_bounded, mul, transpose};
use crate::modes::{Basis, Modes, modes};
use crate::orders::{Bloch, tangent};
use faer::Mat;
use num_complex::Complex64;

/// Layers in which evanescent waves grow by more than so many times e^[`THIN`] go the general way.
const MOST_SLABS: f64 = 40.0;

/// The modes without Hx (TM at ky = 0) or those without Ex (TE).
#[derive(Clone, Copy, PartialEq, Eq)]
enum ModeFamily {
    Lsm,
    Lse,
}

impl ModeFamily {
    const BOTH: [Self; 2] = [Self::Lsm, Self::Lse];

    /// Place among s and p of a state's first parameters, and of the coordinates.
    fn places(self, orders: usize) -> (usize, usize) {
        match self {
            Self::Lsm => (1, 0),
            Self::Lse => (0, orders),
        }
    }

    fn b(self, modes: &Modes) -> &[Complex64] {
        match self {
            Self::Lsm => &modes.b_lsm,
            Self::Lse => &modes.b_lse,
        }
    }

    /// Matrices from the coordinates below an interface to those above it, transposed: electric,
    /// magnetic.
    fn crossing(self, above: &Basis, below: &Basis) -> [CMat; 2] {
        let step = |inverse: &CMat, matrix: &CMat| transpose(&mul(inverse, matrix));
        match self {
            Self::Lsm => [step(&above.ag_inverse, &below.ag), step(&above.g_inverse, &below.g)],
            Self::Lse => {
                let both = step(&above.f_inverse, &below.f);
                [both.clone(), both]
            }
        }
    }
}

/// Fields (3.1) of one family, transposed as in [`State`].
struct FamilyFields {
    family: ModeFamily,
    electric: CMat,
    magnetic: CMat,
    transmitted: CMat,
    growth: f64,
}

impl FamilyFields {
    /// From a state whose parameters are amplitudes of s and p by turns.
    fn of(state: &State, family: ModeFamily) -> Self {
        let n = state.electric.nrows() / 2;
        let (pol, column) = family.places(n);
        let part = |m: &CMat| -> CMat { Mat::from_fn(n, n, |i, j| m[(2 * i + pol, column + j)]) };
        let outgoing = state.transmitted.ncols() / 2;
        Self {
            family,
            electric: part(&state.electric),
            magnetic: part(&state.magnetic),
            transmitted: Mat::from_fn(n, outgoing, |i, j| {
                state.transmitted[(2 * i + pol, 2 * j + pol)]
            }),
            growth: 0.0,
        }
    }

    fn cross(&mut self, above: &Basis, below: &Basis) {
        let [electric, magnetic] = self.family.crossing(above, below);
        self.electric = mul(&self.electric, &electric);
        self.magnetic = mul(&self.magnetic, &magnetic);
    }

    fn propagate(&mut self, modes: &Modes, d: f64) {
        let b = self.family.b(modes);
        let growth = growth(b, d);
        let slabs = (growth / THIN).ceil().max(1.0);
        for _ in 0..slabs as usize {
            self.slab(b, d / slabs);
            self.growth += growth / slabs;
            if self.growth + growth / slabs > THIN {
                self.choose();
            }
        }
    }

    fn slab(&mut self, b: &[Complex64], d: f64) {
        let minus_i = -Complex64::I;
        for (column, &b) in b.iter().enumerate() {
            let (c, sinc) = Complex64::cosine_and_sinc(b, d);
            let (se, sh) = match self.family {
                ModeFamily::Lsm => (minus_i * b * sinc, minus_i * sinc),
                ModeFamily::Lse => (minus_i * sinc, minus_i * b * sinc),
            };
            let electric = self.electric.col_as_slice_mut(column).iter_mut();
            for (e, h) in electric.zip(self.magnetic.col_as_slice_mut(column)) {
                (*e, *h) = (c * *e + se * *h, c * *h + sh * *e);
            }
        }
    }

    /// Chooses new parameters: h, or e + h where the impedance is near a pole.
    fn choose(&mut self) {
        self.growth = 0.0;
        let n = self.electric.nrows();
        let one = |i: usize, j: usize| {
            if i == j { Complex64::ONE } else { Complex64::ZERO }
        };
        let mut by = Lu::new(&self.magnetic);
        let mut electric = Mat::zeros(n, n);
        by.solve_into(&self.electric, &mut electric);
        let is_impedance = is_bounded(&electric, <Complex64 as Arithmetic>::LARGEST_IMPEDANCE);
        if !is_impedance {
            by = Lu::new(&Mat::from_fn(n, n, |i, j| self.electric[(i, j)] + self.magnetic[(i, j)]));
            by.solve_into(&self.electric, &mut electric);
        }
        self.magnetic = Mat::from_fn(n, n, |i, j| {
            let e = if is_impedance { Complex64::ZERO } else { electric[(i, j)] };
            one(i, j) - e
        });
        by.solve(self.transmitted.as_mut());
        self.electric = electric;
    }
}

/// Exponent by which waves of these kz² grow over a thickness.
fn growth(kz_squared: &[Complex64], d: f64) -> f64 {
    let each = kz_squared.iter().map(|&b| Complex64::decay(b) * d);
    each.fold(0.0, f64::max)
}

/// Whether all wavevectors lie in the plane of incidence and all walls are upright.
pub(crate) fn applies(stack: &Stack, bloch: Bloch, kx: &[f64]) -> bool {
    bloch.ky == 0.0
        && kx.iter().all(|&k| tangent(k, bloch).1 == 0.0)
        && stack.wall_corrections().iter().all(Vec::is_empty)
}

/// Takes a state without light from below, of a problem that [`applies`] admits, through all
/// layers. Returns `false`, and leaves the state as it was, where a layer is too thick.
pub(crate) fn carry_to_top(state: &mut State, stack: &Stack, kx: &[f64]) -> Result<bool, Error> {
    let n = kx.len();
    let fourier = Basis::fourier([n, n]);
    let mut below = fourier.clone();
    let mut families = ModeFamily::BOTH.map(|family| FamilyFields::of(state, family));
    for layer in stack.layers().iter().rev() {
        let found = modes(layer, kx)?;
        let d = stack.optical_thickness(layer);
        let steepest = growth(&found.b_lsm, d).max(growth(&found.b_lse, d));
        if steepest > MOST_SLABS * THIN {
            return Ok(false);
        }
        for family in &mut families {
            family.cross(&found.basis, &below);
            family.propagate(&found, d);
        }
        below = found.basis;
    }
    let (size, outgoing) = (2 * n, state.transmitted.ncols());
    state.electric = Mat::zeros(size, size);
    state.magnetic = Mat::zeros(size, size);
    state.transmitted = Mat::zeros(size, outgoing);
    for mut family in families {
        family.cross(&fourier, &below);
        let (pol, column) = family.family.places(n);
        for (to, from) in
            [(&mut state.electric, &family.electric), (&mut state.magnetic, &family.magnetic)]
        {
            to.as_mut().submatrix_mut(column, column, n, n).copy_from(from);
        }
        for j in 0..outgoing / 2 {
            for i in 0..n {
                state.transmitted[(column + i, 2 * j + pol)] = family.transmitted[(i, j)];
            }
        }
    }
    state.parameters = Parameters::General;
    Ok(true)
}
