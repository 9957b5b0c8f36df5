// SPDX-License-Identifier: MIT OR Apache-2.0
//! The normal-vector correction of slanted walls in Ex and Ez (4.2).
//!
//! Let n be the normal of a wall. Across it n·D and the tangential part of E are continuous, so
//! that D = εE is factorised as
//!
//! - D = E_L E - (Δ W + W Δ)/2 E,   Δ = E_L - A⁻¹,   W = n nᵀ between the walls continued linearly,
//!
//! in the components x and z, with E_L the Toeplitz matrix of ε and A that of 1/ε \[Popov & Nevière
//! 2001\], made symmetric so that energy is kept at any truncation \[Götz et al. 2008\].
//! Vertical walls (W = diag(1, 0)) give Li's rules, with which the modes of [`super`] are
//! found; at slanted walls these converge as 1/M only. Let Q be the matrix of D above, B = Qzz⁻¹, C
//! = B Qzx, G = Qxx - Qxz C, and s = K Hy - ky Hx. In the quadratic form whose derivatives are the
//! equations of the fields the difference is v* Φ v / 2 with v = (Ex, s) and
//!
//! - Φ = [ G - A₀⁻¹, -C* ; -C, E₀⁻¹ - B ]
//!
//! with A₀ and E₀ of the layer that the modes are of, and all else of the section that is meant. Δ
//! acts at the highest orders only, and sections differ in narrow strips, so that Φ = P φ P* has
//! hardly a score of values that count: its exact flow is a change of small rank, which keeps the
//! flux of power to the last bit.

use super::Basis;
use crate::error::Error;
use crate::expansion::{Expansion, FieldGroup};
use crate::fourier::permittivities_about;
use crate::linalg::{Accum, Scalar, adjoint, combined, inverse, mul, product, transpose};
use crate::relief::{Segment, Wall, WallCorrection};
use faer::prelude::ReborrowMut;
use faer::{Mat, MatRef};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Eigenvalues of Φ below this part of the largest are left out.
const LEAST: f64 = 1e-3;
/// Columns of the sketch for each wall.
const SKETCHED: usize = 12;

/// Largest distance of an image from its vector at which it replaces it.
const MAX_BESIDE: f64 = 0.3;

/// Matrices shared by all sections of one layer.
pub(crate) struct VerticalLayer<'a, T> {
    basis: &'a Basis<T>,
    /// E₀⁻¹.
    e_inverse: Mat<T>,
    /// A₀⁻¹.
    a_inverse: Mat<T>,
    /// The sketch with which ranges are found, as wide as sections like this one need.
    sketch: Mat<T>,
    /// s by hy, and by ky hx.
    by_hy: Mat<T>,
    by_hx: Mat<T>,
}

impl<'a, T: Scalar> VerticalLayer<'a, T> {
    pub(super) fn basis(&self) -> &Basis<T> {
        self.basis
    }

    pub(crate) fn new(
        expansion: &impl Expansion<T>,
        segments: &[Segment],
        basis: &'a Basis<T>,
    ) -> Self {
        let [epsilon, inverted] =
            permittivities_about(segments, expansion.reach(), expansion.origin());
        let e = expansion.multiplication(FieldGroup::Z, FieldGroup::Z, &epsilon);
        let a = expansion.multiplication(FieldGroup::X, FieldGroup::X, &inverted);
        let walls = segments.len().next_multiple_of(2);
        let by_hy = expansion.derivative(&basis.g);
        Self {
            basis,
            by_hx: combined(&mul(&by_hy, &basis.q), &basis.f, 1.0),
            by_hy,
            e_inverse: inverse(&e),
            a_inverse: inverse(&a),
            sketch: sketch(expansion, sketched(expansion, walls)),
        }
    }
}

/// The change of coordinates by the flow of Φ.
#[derive(Clone, Debug)]
pub(crate) struct NormalVectorFlow<T = Complex64> {
    /// Parts of v by ex, hy and ky hx, transposed: (N, rank).
    pub(super) reads: [Mat<T>; 3],
    /// Conjugates of the former: (rank, N).
    pub(super) writes: [Mat<T>; 3],
    /// The increment of v, φ ∫ v over the height, by v; transposed.
    pub(super) gains: Mat<T>,
    /// Factors of the increments of electric coordinates, by magnetic inputs, and of magnetic
    /// coordinates, by electric inputs.
    pub(super) steps: [T; 2],
}

impl<T: Scalar> NormalVectorFlow<T> {
    /// The identity, for so many coordinates of X and of Z.
    pub(super) fn none([x, z]: [usize; 2]) -> Self {
        let sizes = [x, x, z];
        Self {
            reads: sizes.map(|n| Mat::zeros(n, 0)),
            writes: sizes.map(|n| Mat::zeros(0, n)),
            gains: Mat::zeros(0, 0),
            steps: [T::ONE; 2],
        }
    }

    /// Of a section with the weight `d` (times k0), beside a layer of vertical walls.
    pub(crate) fn new(
        expansion: &impl Expansion<T>,
        section: &WallCorrection,
        vertical: &VerticalLayer<'_, T>,
        d: f64,
    ) -> Result<Option<Self>, Error> {
        let basis = vertical.basis;
        let form = QuadraticForm::new(expansion, section, vertical);
        let mut count = sketched(expansion, section.borders.len());
        let (values, vectors) = loop {
            let known = &vertical.sketch;
            let found = if count <= known.ncols() {
                largest(|v| form.times(v), known.as_ref().subcols(0, count))?
            } else {
                largest(|v| form.times(v), sketch(expansion, count).as_ref())?
            };
            // Strips that are wide for the orders kept make more of them count.
            if 5 * found.0.len() <= 4 * count || count == form.size() {
                break found;
            }
            count = (2 * count).min(form.size());
        };
        if values.is_empty() {
            return Ok(None);
        }
        let (x, z) = (expansion.count(FieldGroup::X), expansion.count(FieldGroup::Z));
        let electric = adjoint(&vectors.as_ref().subrows(0, x).to_owned());
        let magnetic = adjoint(&vectors.as_ref().subrows(x, z).to_owned());
        let (ex, hy) = (mul(&electric, &basis.ag), mul(&magnetic, &vertical.by_hy));
        let hx = mul(&magnetic, &vertical.by_hx);
        let steps = expansion.step_factors();
        let rank = values.len();
        let overlap = mul(&ex, &adjoint(&hy));
        let generator: Mat<T> = Mat::from_fn(rank, rank, |i, j| {
            (steps.0 * overlap[(i, j)] + steps.1 * overlap[(j, i)].conjugate()).scaled(values[j])
        });
        Ok(Some(Self {
            reads: [transpose(&ex), transpose(&hy), transpose(&hx)],
            writes: [ex, hy, hx].map(|m| adjoint(&transpose(&m))),
            gains: gains(&generator, &values, d),
            steps: [steps.0, steps.1],
        }))
    }
}

/// φ ∫ v over a thickness by v, transposed, where `generator` is of the equation that v obeys in
/// the flow.
fn gains<T: Scalar>(generator: &Mat<T>, values: &[f64], d: f64) -> Mat<T> {
    let rank = values.len();
    let mut term: Mat<T> =
        Mat::from_fn(rank, rank, |i, j| if i == j { T::ONE.scaled(d) } else { T::ZERO });
    let mut sum = term.clone();
    for k in 2..60 {
        let next = mul(generator, &term);
        term = Mat::from_fn(rank, rank, |i, j| next[(i, j)].scaled(d / f64::from(k)));
        let mut size = 0.0_f64;
        for j in 0..rank {
            for i in 0..rank {
                sum[(i, j)] += term[(i, j)];
                size = size.max(term[(i, j)].squared());
            }
        }
        if size < 1e-36 * d * d {
            break;
        }
    }
    Mat::from_fn(rank, rank, |i, j| sum[(j, i)].scaled(values[j]))
}

/// Φ of a section beside one of vertical walls, in blocks.
struct QuadraticForm<T> {
    /// By Ex in Ex.
    electric: Mat<T>,
    /// By Ex in s.
    mixed: Mat<T>,
    /// Conjugate transpose.
    mixed_adjoint: Mat<T>,
    /// By s in s.
    magnetic: Mat<T>,
}

/// The parts of Δ and W that act within one group of components.
struct GroupMatrices<T> {
    e: Mat<T>,
    a_inverse: Mat<T>,
    delta: Mat<T>,
    /// (Δ Wxx + Wxx Δ)/2.
    xx: Mat<T>,
}

impl<T: Scalar> GroupMatrices<T> {
    /// From the coefficients of ε, 1/ε and Wxx.
    fn new(
        expansion: &impl Expansion<T>,
        of: FieldGroup,
        [epsilon, inverted, xx]: [&[Complex64]; 3],
    ) -> Self {
        let e = expansion.multiplication(of, of, epsilon);
        let a = expansion.multiplication(of, of, inverted);
        let a_inverse = inverse(&a);
        let delta = combined(&e, &a_inverse, -1.0);
        let xx = symmetric(&mul(&delta, &expansion.multiplication(of, of, xx)));
        Self { e, a_inverse, delta, xx }
    }
}

impl<T: Scalar> QuadraticForm<T> {
    fn new(
        expansion: &impl Expansion<T>,
        section: &WallCorrection,
        vertical: &VerticalLayer<'_, T>,
    ) -> Self {
        let weights = |w: &Wall| [w.xx, w.xz];
        let (reach, origin) = (expansion.reach(), expansion.origin());
        let [xx, xz] = linear(&section.borders, weights, reach, origin);
        let [epsilon, inverted] = permittivities_about(&section.segments, reach, origin);
        let within = |of| GroupMatrices::new(expansion, of, [&epsilon, &inverted, &xx]);
        let z = within(FieldGroup::Z);
        let own = match expansion.adjoint_sign() {
            Some(_) => None,
            None => Some(within(FieldGroup::X)),
        };
        let x = own.as_ref().unwrap_or(&z);
        // (Δ Wzx + Wzx Δ)/2, which is minus Qzx.
        let xz = expansion.multiplication(FieldGroup::Z, FieldGroup::X, &xz);
        let left = mul(&z.delta, &xz);
        let right = match expansion.adjoint_sign() {
            Some(sign) => Mat::from_fn(left.ncols(), left.nrows(), |i, j| {
                left[(j, i)].conjugate().scaled(sign)
            }),
            None => mul(&xz, &x.delta),
        };
        let xz = Mat::from_fn(left.nrows(), left.ncols(), |i, j| {
            (left[(i, j)] + right[(i, j)]).scaled(0.5)
        });
        // E_L - Δ = A⁻¹.
        let b = inverse(&combined(&z.a_inverse, &z.xx, 1.0));
        let mixed = mul(&b, &xz);
        let mut g = combined(&x.e, &x.xx, -1.0);
        let zx = adjoint(&xz);
        product(g.as_mut(), Accum::Add, -T::ONE, zx.as_ref(), mixed.as_ref());
        Self {
            electric: symmetric(&combined(&g, &vertical.a_inverse, -1.0)),
            mixed_adjoint: adjoint(&mixed),
            mixed,
            magnetic: symmetric(&combined(&vertical.e_inverse, &b, -1.0)),
        }
    }

    fn size(&self) -> usize {
        self.mixed.nrows() + self.mixed.ncols()
    }

    fn times(&self, v: MatRef<'_, T>) -> Mat<T> {
        let n = self.electric.nrows();
        let mut out = Mat::zeros(self.size(), v.ncols());
        let (ex, s) = v.split_at_row(n);
        let (mut top, mut bottom) = out.as_mut().split_at_row_mut(n);
        let one = T::ONE;
        product(top.rb_mut(), Accum::Replace, one, self.electric.as_ref(), ex);
        product(top, Accum::Add, one, self.mixed_adjoint.as_ref(), s);
        product(bottom.rb_mut(), Accum::Replace, one, self.mixed.as_ref(), ex);
        product(bottom, Accum::Add, one, self.magnetic.as_ref(), s);
        out
    }
}

/// (m + m*)/2.
fn symmetric<T: Scalar>(m: &Mat<T>) -> Mat<T> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| (m[(i, j)] + m[(j, i)].conjugate()).scaled(0.5))
}

/// Fourier coefficients, about `origin`, of functions that are linear between the walls, with the
/// given values at each.
fn linear<const K: usize>(
    walls: &[Wall],
    values: impl Fn(&Wall) -> [f64; K],
    reach: usize,
    origin: f64,
) -> [Vec<Complex64>; K] {
    let count = walls.len();
    let width = |j: usize| {
        let next = walls[(j + 1) % count].x - walls[j].x;
        if j + 1 == count { next + 1.0 } else { next }
    };
    let at: Vec<[f64; K]> = walls.iter().map(values).collect();
    let rise = |j: usize, k: usize| at[(j + 1) % count][k] - at[j][k];
    let slope = |j: usize, k: usize| rise(j, k) / width(j);
    let mut all = std::array::from_fn(|_| vec![Complex64::ZERO; 2 * reach + 1]);
    for (j, wall) in walls.iter().enumerate() {
        let bends: [f64; K] =
            std::array::from_fn(|k| slope(j, k) - slope((j + count - 1) % count, k));
        for (k, c) in all.iter_mut().enumerate() {
            c[reach] += width(j) * (at[j][k] + 0.5 * rise(j, k));
        }
        for n in 1..=reach {
            let phase = TAU * n as f64;
            let part = Complex64::cis(-phase * (wall.x - origin)) * (-1.0 / (phase * phase));
            for (c, bend) in all.iter_mut().zip(bends) {
                c[reach + n] += part * bend;
                c[reach - n] += part.conj() * bend;
            }
        }
    }
    all
}

/// Columns of the sketch for so many walls to begin with: half as many of one parity, which has
/// half of all values.
fn sketched<T: Scalar>(expansion: &impl Expansion<T>, walls: usize) -> usize {
    let size = expansion.count(FieldGroup::X) + expansion.count(FieldGroup::Z);
    let each = if expansion.adjoint_sign().is_none() { 2 } else { 1 };
    (SKETCHED * walls).div_ceil(each).min(size)
}

/// So many random real functions in both parts of v. Since they are real, reciprocity holds to the
/// last digits, however many there are.
fn sketch<T: Scalar>(expansion: &impl Expansion<T>, count: usize) -> Mat<T> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut number = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let columns: Vec<Vec<T>> =
        (0..count).map(|column| expansion.random_vector(column, &mut number)).collect();
    Mat::from_fn(columns[0].len(), count, |i, j| columns[j][i])
}

/// The eigenvalues of a Hermitian matrix that are largest by magnitude, and vectors P with which P
/// φ P* is the matrix but for what is less: from what the matrix makes of a sketch of so many
/// vectors, and of the range that this spans \[Halko, Martinsson & Tropp 2011, section 5.5\].
fn largest<T: Scalar>(
    times: impl Fn(MatRef<'_, T>) -> Mat<T>,
    sketch: MatRef<'_, T>,
) -> Result<(Vec<f64>, Mat<T>), Error> {
    let mut range = times(sketch);
    orthonormalise(&mut range);
    let image = times(range.as_ref());
    let small = mul(&adjoint(&range), &image);
    let (values, vectors) = T::eigen(&small)?;
    let top = values.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    let kept: Vec<usize> = (0..values.len()).filter(|&i| values[i].abs() > LEAST * top).collect();
    let chosen = |scale: &dyn Fn(usize) -> f64| -> Mat<T> {
        Mat::from_fn(vectors.nrows(), kept.len(), |i, j| {
            vectors[(i, kept[j])].scaled(scale(kept[j]))
        })
    };
    // The image of a vector over its value is nearer to the truth than the vector, unless the value
    // is no more than the part left out.
    let mut better = mul(&image, &chosen(&|i| 1.0 / values[i]));
    let vectors = mul(&range, &chosen(&|_| 1.0));
    for j in 0..kept.len() {
        let (image, vector) = (better.col_as_slice_mut(j), vectors.col_as_slice(j));
        let deviation: f64 = image.iter().zip(vector).map(|(a, b)| (*a + -*b).squared()).sum();
        if deviation > MAX_BESIDE * MAX_BESIDE {
            image.copy_from_slice(vector);
        }
    }
    Ok((kept.iter().map(|&i| values[i]).collect(), better))
}

/// Columns made orthogonal to those before, and of length 1; those that are nothing else than the
/// former become 0.
fn orthonormalise<T: Scalar>(m: &mut Mat<T>) {
    for j in 0..m.ncols() {
        let mut column = m.col_as_slice(j).to_vec();
        let before = norm(&column);
        for k in 0..j {
            let other = m.col_as_slice(k);
            let overlap = overlap(other, &column);
            for (c, o) in column.iter_mut().zip(other) {
                *c += -(*o * overlap);
            }
        }
        let after = norm(&column);
        let scale = if after > 1e-13 * before { 1.0 / after } else { 0.0 };
        for (to, c) in m.col_as_slice_mut(j).iter_mut().zip(column) {
            *to = c.scaled(scale);
        }
    }
}

/// Σ a* b, in eight sums that do not wait for each other.
fn overlap<T: Scalar>(a: &[T], b: &[T]) -> T {
    let mut sums = [T::ZERO; 8];
    for (a, b) in a.chunks(8).zip(b.chunks(8)) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a.conjugate() * *b;
        }
    }
    sums.into_iter().fold(T::ZERO, |all, sum| all + sum)
}

fn norm<T: Scalar>(column: &[T]) -> f64 {
    column.iter().map(|c| c.squared()).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_line_between_walls_has_the_coefficients_of_its_integral() {
        let walls: Vec<Wall> =
            [(0.1, 0.3), (0.45, 0.9), (0.8, 0.1)].map(|(x, xx)| Wall { x, xx, xz: 0.0 }).to_vec();
        let at = |x: f64| {
            let y = (x - 0.1).rem_euclid(1.0);
            if y < 0.35 {
                0.3 + 0.6 * y / 0.35
            } else if y < 0.7 {
                0.9 - 0.8 * (y - 0.35) / 0.35
            } else {
                0.1 + 0.2 * (y - 0.7) / 0.3
            }
        };
        let [c] = linear(&walls, |w| [w.xx], 5, 0.0);
        let steps = 20_000;
        for n in -5..=5_i32 {
            let each = (0..steps).map(|i| {
                let x = (f64::from(i) + 0.5) / f64::from(steps);
                at(x) * Complex64::cis(-TAU * f64::from(n) * x) / f64::from(steps)
            });
            let expected: Complex64 = each.sum();
            assert!((c[(n + 5) as usize] - expected).norm() < 1e-8, "{n}");
        }
    }

    #[test]
    fn vectors_of_a_matrix_of_higher_rank_than_its_sketch_stay_near_it() {
        // Values of both signs that fall by a half each, more than are sketched.
        let vector = |k: usize, i: usize| {
            (2.0_f64 / 30.0).sqrt() * (PI * (i as f64 + 0.5) * (k + 1) as f64 / 30.0).cos()
        };
        let value =
            |k: usize| 0.5_f64.powi(k as i32) * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let form: Mat<f64> = Mat::from_fn(30, 30, |i, j| {
            (0..20).map(|k| value(k) * vector(k, i) * vector(k, j)).sum()
        });
        // With as few columns as values that count they are asked for again.
        for (columns, most) in [(12, 2e-2), (24, LEAST)] {
            let sketch =
                Mat::from_fn(30, columns, |i, j| (1.0 + i as f64 * (0.7 + j as f64)).sin());
            let (values, vectors) =
                largest(|v| mul(&form, &v.to_owned()), sketch.as_ref()).unwrap();
            let mut worst = 0.0_f64;
            for j in 0..30 {
                for i in 0..30 {
                    let again: f64 = (0..values.len())
                        .map(|k| vectors[(i, k)] * values[k] * vectors[(j, k)])
                        .sum();
                    worst = worst.max((again - form[(i, j)]).abs());
                }
            }
            assert!(worst < most, "{columns}: {worst:.1e}");
        }
    }

    #[test]
    fn the_largest_values_of_a_matrix_of_small_rank_are_all_there_is() {
        // 0.7 a aᵀ - 0.2 b bᵀ.
        let vector = |k: f64| (0..20).map(|i| (k * f64::from(i)).cos()).collect::<Vec<_>>();
        let (a, b) = (vector(0.3), vector(1.1));
        let form: Mat<f64> = Mat::from_fn(20, 20, |i, j| 0.7 * a[i] * a[j] - 0.2 * b[i] * b[j]);
        let sketch = Mat::from_fn(20, 6, |i, j| (1.0 + i as f64 * (0.7 + j as f64)).sin());
        let (values, vectors) = largest(|v| mul(&form, &v.to_owned()), sketch.as_ref()).unwrap();
        assert_eq!(values.len(), 2);
        for j in 0..20 {
            for i in 0..20 {
                let again: f64 =
                    (0..2).map(|k| vectors[(i, k)] * values[k] * vectors[(j, k)]).sum();
                assert!((again - form[(i, j)]).abs() < 1e-12);
            }
        }
    }
}
