// SPDX-License-Identifier: MIT OR Apache-2.0
//! What slanted walls add to a layer that is solved as if its walls were upright.
//!
//! Let n be the normal of a wall. Across it n·D and what of E is tangential are continuous, so that D = εE is to be factorised as
//!
//! - D = E_L E - (Δ W + W Δ)/2 E,   Δ = E_L - A⁻¹,   W = n nᵀ between the walls continued linearly,
//!
//! in the components x and z, with E_L the Toeplitz matrix of ε and A that of 1/ε \[Popov & Nevière 2001\], made symmetric so that energy is kept at any
//! truncation \[Götz et al. 2008\]. Upright walls (W = diag(1, 0)) give Li's rules, with which the modes of [`super`] are found; at slanted walls these
//! converge as 1/M only. Let Q be the matrix of D above, B = Qzz⁻¹, C = B Qzx, G = Qxx - Qxz C, and s = K Hy - ky Hx. In the quadratic form whose
//! derivatives are the equations of the fields the difference is v* Φ v / 2 with v = (Ex, s) and
//!
//! - Φ = [ G - A⁻¹, -C* ; -C, E_L⁻¹ - B ].
//!
//! Δ acts at the highest orders only, and Φ = P φ P* has hardly a score of values that count, at any truncation. So a slice is passed
//! by its lower layer, then by the exact flow of that form over the whole of it, a change of small rank that keeps the flux of power to the last bit, then by its upper
//! layer [Strang 1968].

use super::Basis;
use crate::error::Error;
use crate::fourier::coefficients;
use crate::linalg::{CMat, Lu, Onto, Scalar, adjoint, mul, product, transpose};
use crate::relief::{Wall, Walls};
use faer::Mat;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Values of Φ below this part of the largest are left out.
const LEAST: f64 = 3e-3;
/// Vectors for each wall with which the range of Φ is found.
const SKETCHED: usize = 11;

/// The functions in which fields are expanded.
pub(crate) trait Expansion<T: Scalar> {
    /// Highest order of Fourier coefficients that a product needs.
    fn reach(&self) -> usize;
    /// Matrix of the product with a real function of these coefficients.
    fn multiplication(&self, c: &[Complex64]) -> Mat<T>;
    /// K m, or ∂ m where coordinates are real.
    fn along(&self, m: &Mat<T>) -> Mat<T>;
    /// A real function made of numbers, each of which is asked for once.
    fn function(&self, number: &mut dyn FnMut() -> f64) -> Vec<T>;
    /// Factors of what electric and magnetic coordinates gain towards the top.
    fn steps(&self) -> (T, T);
}

/// Orders with these kx.
pub(crate) struct Orders<'a>(pub(crate) &'a [f64]);

impl Expansion<Complex64> for Orders<'_> {
    fn reach(&self) -> usize {
        self.0.len() - 1
    }

    fn multiplication(&self, c: &[Complex64]) -> CMat {
        let reach = self.reach();
        Mat::from_fn(reach + 1, reach + 1, |i, j| c[reach + i - j])
    }

    fn along(&self, m: &CMat) -> CMat {
        Mat::from_fn(m.nrows(), m.ncols(), |i, j| self.0[i] * m[(i, j)])
    }

    fn function(&self, number: &mut dyn FnMut() -> f64) -> Vec<Complex64> {
        let last = self.reach();
        let mut c = vec![Complex64::ZERO; last + 1];
        for i in 0..=last / 2 {
            let value = Complex64::new(number(), if 2 * i == last { 0.0 } else { number() });
            (c[i], c[last - i]) = (value, value.conj());
        }
        c
    }

    fn steps(&self) -> (Complex64, Complex64) {
        (-Complex64::I, -Complex64::I)
    }
}

/// The change of coordinates by the slanted walls of a slice.
#[derive(Clone, Debug)]
pub(crate) struct Slant<T = Complex64> {
    /// Parts of v by ex, hy and ky hx, transposed: (N, rank).
    reads: [Mat<T>; 3],
    /// Conjugates of the former: (rank, N).
    writes: [Mat<T>; 3],
    /// What of v is added, φ ∫ v over the height, by v; transposed.
    gains: Mat<T>,
    steps: (T, T),
}

impl<T: Scalar> Slant<T> {
    /// Of these walls over the height `d` (times k0), in the coordinates of a layer that they bound.
    pub(crate) fn new(
        space: &impl Expansion<T>,
        walls: &Walls,
        basis: &Basis<T>,
        d: f64,
    ) -> Result<Option<Self>, Error> {
        let form = form(space, walls);
        let count = SKETCHED * walls.borders.len();
        let sketch = sketch(space, count.min(form.nrows()));
        let (values, vectors) = largest(&form, &sketch)?;
        if values.is_empty() {
            return Ok(None);
        }
        let n = form.nrows() / 2;
        let electric = adjoint(&vectors.as_ref().subrows(0, n).to_owned());
        let magnetic = adjoint(&vectors.as_ref().subrows(n, n).to_owned());
        let along = space.along(&basis.g);
        let mut by_hx = mul(&along, &basis.q);
        for j in 0..n {
            for i in 0..n {
                by_hx[(i, j)] += basis.f[(i, j)];
            }
        }
        let (ex, hy) = (mul(&electric, &basis.ag), mul(&magnetic, &along));
        let hx = mul(&magnetic, &by_hx);
        let steps = space.steps();
        let rank = values.len();
        let overlap = mul(&ex, &adjoint(&hy));
        let generator: Mat<T> = Mat::from_fn(rank, rank, |i, j| {
            (steps.0 * overlap[(i, j)] + steps.1 * overlap[(j, i)].conjugate()).scaled(values[j])
        });
        Ok(Some(Self {
            reads: [transpose(&ex), transpose(&hy), transpose(&hx)],
            writes: [ex, hy, hx].map(|m| adjoint(&transpose(&m))),
            gains: gains(&generator, &values, d),
            steps,
        }))
    }

    /// Adds to fields, a row for each parameter, what the walls add.
    pub(crate) fn add(&self, e: &mut Mat<T>, h: &mut Mat<T>, ky: f64) {
        let (n, rows, rank) = (e.ncols() / 2, e.nrows(), self.gains.nrows());
        if rows == 0 {
            return;
        }
        let (one, ky) = (T::ONE, T::ONE.scaled(ky));
        let [ex, hy, hx] = &self.reads;
        let mut v: Mat<T> = Mat::zeros(rows, rank);
        let (mut lower_e, mut upper_e) = e.as_mut().split_at_col_mut(n);
        let (mut lower_h, upper_h) = h.as_mut().split_at_col_mut(n);
        product(
            v.as_mut(),
            Onto::Replace,
            one,
            lower_e.as_ref(),
            ex.as_ref(),
        );
        product(v.as_mut(), Onto::Add, one, lower_h.as_ref(), hy.as_ref());
        product(v.as_mut(), Onto::Add, ky, upper_h.as_ref(), hx.as_ref());
        let gains = mul(&v, &self.gains);
        let [ex, hy, hx] = &self.writes;
        let (electric, magnetic) = self.steps;
        product(
            lower_e.as_mut(),
            Onto::Add,
            electric,
            gains.as_ref(),
            hy.as_ref(),
        );
        product(
            upper_e.as_mut(),
            Onto::Add,
            electric * ky,
            gains.as_ref(),
            hx.as_ref(),
        );
        product(
            lower_h.as_mut(),
            Onto::Add,
            magnetic,
            gains.as_ref(),
            ex.as_ref(),
        );
    }
}

/// φ ∫ v over a thickness by v, transposed, where `generator` is of the equation that v obeys in the flow.
fn gains<T: Scalar>(generator: &Mat<T>, values: &[f64], d: f64) -> Mat<T> {
    let rank = values.len();
    let mut term: Mat<T> =
        Mat::from_fn(
            rank,
            rank,
            |i, j| {
                if i == j { T::ONE.scaled(d) } else { T::ZERO }
            },
        );
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

/// Φ of a section.
fn form<T: Scalar>(space: &impl Expansion<T>, walls: &Walls) -> Mat<T> {
    let reach = space.reach();
    let of = |value: fn(Complex64) -> Complex64| {
        space.multiplication(&coefficients(&walls.segments, value, reach))
    };
    let (e, a) = (of(|n| n * n), of(|n| (n * n).inv()));
    let along =
        |value: fn(&Wall) -> f64| space.multiplication(&linear(&walls.borders, value, reach));
    let (e_inverse, a_inverse) = (inverse(&e), inverse(&a));
    let n = e.nrows();
    let delta = sum(&e, &a_inverse, -1.0);
    let symmetric = |w: &Mat<T>| {
        let x = mul(&delta, w);
        Mat::from_fn(n, n, |i, j| (x[(i, j)] + x[(j, i)].conjugate()).scaled(0.5))
    };
    let (xx, xz) = (symmetric(&along(|w| w.xx)), symmetric(&along(|w| w.xz)));
    let b = inverse(&sum(&sum(&e, &delta, -1.0), &xx, 1.0));
    // Qxz is minus `xz`.
    let c = Mat::from_fn(n, n, {
        let product = mul(&b, &xz);
        move |i, j| -product[(i, j)]
    });
    let g = sum(&sum(&e, &xx, -1.0), &mul(&xz, &c), 1.0);
    Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => half_sum(&g, i, j) - half_sum(&a_inverse, i, j),
        (false, true) => -c[(i - n, j)],
        (true, false) => -c[(j - n, i)].conjugate(),
        (false, false) => half_sum(&e_inverse, i - n, j - n) - half_sum(&b, i - n, j - n),
    })
}

/// Element of (m + m*)/2.
fn half_sum<T: Scalar>(m: &Mat<T>, i: usize, j: usize) -> T {
    (m[(i, j)] + m[(j, i)].conjugate()).scaled(0.5)
}

fn sum<T: Scalar>(a: &Mat<T>, b: &Mat<T>, factor: f64) -> Mat<T> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| {
        a[(i, j)] + b[(i, j)].scaled(factor)
    })
}

fn inverse<T: Scalar>(a: &Mat<T>) -> Mat<T> {
    let mut out: Mat<T> = Mat::identity(a.nrows(), a.nrows());
    Lu::new(a).solve(out.as_mut());
    out
}

/// Fourier coefficients of what is linear between the walls and has `value` at each.
fn linear(walls: &[Wall], value: fn(&Wall) -> f64, reach: usize) -> Vec<Complex64> {
    let count = walls.len();
    let width = |j: usize| {
        let next = walls[(j + 1) % count].x - walls[j].x;
        if j + 1 == count { next + 1.0 } else { next }
    };
    let rise = |j: usize| value(&walls[(j + 1) % count]) - value(&walls[j]);
    let slopes: Vec<f64> = (0..count).map(|j| rise(j) / width(j)).collect();
    let mut c = vec![Complex64::ZERO; 2 * reach + 1];
    for (j, wall) in walls.iter().enumerate() {
        c[reach] += width(j) * (value(wall) + 0.5 * rise(j));
        let bend = slopes[j] - slopes[(j + count - 1) % count];
        for n in 1..=reach {
            let phase = TAU * n as f64;
            let part = Complex64::cis(-phase * wall.x) * (-bend / (phase * phase));
            c[reach + n] += part;
            c[reach - n] += part.conj();
        }
    }
    c
}

/// As many real functions of no particular shape, in both parts of v. That they are real is what keeps reciprocity to the last digits, however many
/// there are.
fn sketch<T: Scalar>(space: &impl Expansion<T>, count: usize) -> Mat<T> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut number = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let columns: Vec<Vec<T>> = (0..count)
        .map(|_| [space.function(&mut number), space.function(&mut number)].concat())
        .collect();
    Mat::from_fn(columns[0].len(), count, |i, j| columns[j][i])
}

/// The eigenvalues of a Hermitian matrix that are largest by magnitude, and their vectors: from what the matrix makes of a sketch of
/// as many vectors, twice.
fn largest<T: Scalar>(form: &Mat<T>, sketch: &Mat<T>) -> Result<(Vec<f64>, Mat<T>), Error> {
    let mut range = mul(form, sketch);
    orthonormalise(&mut range, 1);
    range = mul(form, &range);
    orthonormalise(&mut range, 2);
    let image = mul(form, &range);
    let small = mul(&adjoint(&range), &image);
    let (values, vectors) = T::eigen(&small)?;
    let top = values.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    let kept: Vec<usize> = (0..values.len())
        .filter(|&i| values[i].abs() > LEAST * top)
        .collect();
    let chosen = Mat::from_fn(vectors.nrows(), kept.len(), |i, j| vectors[(i, kept[j])]);
    Ok((
        kept.iter().map(|&i| values[i]).collect(),
        mul(&range, &chosen),
    ))
}

/// Columns made orthogonal to those before, so many times over, and of length 1; those that are nothing else than the former become 0.
fn orthonormalise<T: Scalar>(m: &mut Mat<T>, times: usize) {
    for j in 0..m.ncols() {
        let mut column = m.col_as_slice(j).to_vec();
        let before = norm(&column);
        for _ in 0..times {
            for k in 0..j {
                let other = m.col_as_slice(k);
                let overlap = overlap(other, &column);
                for (c, o) in column.iter_mut().zip(other) {
                    *c += -(*o * overlap);
                }
            }
        }
        let after = norm(&column);
        let scale = if after > 1e-13 * before {
            1.0 / after
        } else {
            0.0
        };
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

    #[test]
    fn a_line_between_walls_has_the_coefficients_of_its_integral() {
        let walls: Vec<Wall> = [(0.1, 0.3), (0.45, 0.9), (0.8, 0.1)]
            .map(|(x, xx)| Wall { x, xx, xz: 0.0 })
            .to_vec();
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
        let c = linear(&walls, |w| w.xx, 5);
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
    fn the_largest_values_of_a_matrix_of_small_rank_are_all_there_is() {
        // 0.7 a aᵀ - 0.2 b bᵀ.
        let vector = |k: f64| {
            (0..20)
                .map(|i| (k * f64::from(i)).cos())
                .collect::<Vec<_>>()
        };
        let (a, b) = (vector(0.3), vector(1.1));
        let form: Mat<f64> = Mat::from_fn(20, 20, |i, j| 0.7 * a[i] * a[j] - 0.2 * b[i] * b[j]);
        let sketch = Mat::from_fn(20, 6, |i, j| (1.0 + i as f64 * (0.7 + j as f64)).sin());
        let (values, vectors) = largest(&form, &sketch).unwrap();
        assert_eq!(values.len(), 2);
        for j in 0..20 {
            for i in 0..20 {
                let again: f64 = (0..2)
                    .map(|k| vectors[(i, k)] * values[k] * vectors[(j, k)])
                    .sum();
                assert!((again - form[(i, j)]).abs() < 1e-12);
            }
        }
    }
}
