// SPDX-License-Identifier: MIT OR Apache-2.0
//! Against nalgebra's algorithms and by residuals, to round-off times size.

use super::*;
use nalgebra::DMatrix;

const SIZES: [usize; 5] = [1, 2, 7, 24, 61];

/// Numbers from -1 to 1 that are always the same.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn complex(&mut self, size: usize) -> CMat {
        Mat::from_fn(size, size, |_, _| Complex64::new(self.next(), self.next()))
    }
}

fn numbers(size: usize) -> Numbers {
    Numbers(97 + size as u64)
}

fn hermitian(size: usize) -> CMat {
    let a = numbers(size).complex(size);
    Mat::from_fn(size, size, |i, j| a[(i, j)] + a[(j, i)].conj())
}

fn symmetric(size: usize) -> RMat {
    let a = hermitian(size);
    Mat::from_fn(size, size, |i, j| a[(i, j)].re)
}

fn positive(size: usize) -> CMat {
    let a = numbers(size).complex(size);
    let mut product = mul(&adjoint(&a), &a);
    for i in 0..size {
        product[(i, i)] += 0.1;
    }
    product
}

fn theirs(a: &CMat) -> DMatrix<Complex64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)])
}

fn complexified(a: &RMat) -> CMat {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| Complex64::from(a[(i, j)]))
}

/// Largest difference of any element.
fn distance(a: &CMat, b: &CMat) -> f64 {
    assert_eq!((a.nrows(), a.ncols()), (b.nrows(), b.ncols()));
    let mut worst = 0.0_f64;
    for j in 0..a.ncols() {
        for i in 0..a.nrows() {
            assert!(a[(i, j)].is_finite() && b[(i, j)].is_finite());
            worst = worst.max((a[(i, j)] - b[(i, j)]).norm());
        }
    }
    worst
}

fn allowed(size: usize) -> f64 {
    64.0 * f64::EPSILON * size as f64
}

fn diagonal(values: &[Complex64]) -> CMat {
    Mat::from_fn(
        values.len(),
        values.len(),
        |i, j| {
            if i == j { values[i] } else { Complex64::ZERO }
        },
    )
}

/// Largest element of A U - U Λ.
fn residual(a: &CMat, values: &[Complex64], vectors: &CMat) -> f64 {
    distance(&mul(a, vectors), &mul(vectors, &diagonal(values)))
}

#[test]
fn hermitian_eigenproblems() {
    for size in SIZES {
        let a = hermitian(size);
        let (values, vectors) = eigen_hermitian(&a).unwrap();
        let complex: Vec<Complex64> = values.iter().copied().map(Complex64::from).collect();
        assert!(residual(&a, &complex, &vectors) < allowed(size));
        let one = Mat::identity(size, size);
        assert!(distance(&mul(&adjoint(&vectors), &vectors), &one) < allowed(size));
        compare_ascending(&values, &theirs(&a));
    }
}

#[test]
fn real_symmetric_eigenproblems() {
    for size in SIZES {
        let a = symmetric(size);
        let (values, vectors) = eigen_symmetric(&a).unwrap();
        let complex: Vec<Complex64> = values.iter().copied().map(Complex64::from).collect();
        let (a, vectors) = (complexified(&a), complexified(&vectors));
        assert!(residual(&a, &complex, &vectors) < allowed(size));
        let one = Mat::identity(size, size);
        assert!(distance(&mul(&adjoint(&vectors), &vectors), &one) < allowed(size));
        compare_ascending(&values, &theirs(&a));
    }
}

fn compare_ascending(values: &[f64], matrix: &DMatrix<Complex64>) {
    assert!(values.is_sorted());
    let size = values.len();
    let mut expected: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    expected.sort_by(f64::total_cmp);
    for (value, expected) in values.iter().zip(expected) {
        assert!((value - expected).abs() < allowed(size), "{value} {expected}");
    }
}

#[test]
fn only_the_lower_half_of_a_symmetric_matrix_is_read() {
    let a = hermitian(7);
    let garbled =
        Mat::from_fn(7, 7, |i, j| if i < j { Complex64::new(9.0, 9.0) } else { a[(i, j)] });
    let (values, _) = eigen_hermitian(&a).unwrap();
    let (again, _) = eigen_hermitian(&garbled).unwrap();
    assert!(values.iter().zip(again).all(|(a, b)| (a - b).abs() < 1e-14));
}

#[test]
fn general_eigenproblems() {
    for size in SIZES {
        let a = numbers(size).complex(size);
        let (values, vectors) = eigen_general(&a).unwrap();
        assert!(residual(&a, &values, &vectors) < allowed(size));
        // No fixed order: every value of theirs has one of ours next to it, and the other way
        // round.
        let expected: Vec<Complex64> = theirs(&a).eigenvalues().unwrap().iter().copied().collect();
        let nearest = |v: Complex64, of: &[Complex64]| {
            of.iter().map(|o| (o - v).norm()).fold(f64::INFINITY, f64::min)
        };
        for value in &values {
            assert!(nearest(*value, &expected) < 1e-12 * size as f64);
        }
        for value in &expected {
            assert!(nearest(*value, &values) < 1e-12 * size as f64);
        }
    }
}

#[test]
fn a_matrix_without_enough_eigenvectors_gives_no_nan() {
    let defective: CMat =
        Mat::from_fn(
            3,
            3,
            |i, j| {
                if j == i || j == i + 1 { Complex64::ONE } else { Complex64::ZERO }
            },
        );
    match eigen_general(&defective) {
        Err(error) => assert!(matches!(error, Error::Eigen { size: 3 })),
        Ok((values, vectors)) => {
            // Parallel to round-off, and of any length.
            let length = distance(&vectors, &CMat::zeros(3, 3));
            assert!(residual(&defective, &values, &vectors) < 1e-12 * length);
        }
    }
}

#[test]
fn numbers_that_are_none_are_an_error() {
    let mut a = hermitian(5);
    a[(3, 2)] = Complex64::new(f64::NAN, 0.0);
    assert!(matches!(eigen_hermitian(&a), Err(Error::Eigen { size: 5 })));
    assert!(matches!(eigen_general(&a), Err(Error::Eigen { size: 5 })));
}

#[test]
fn linear_systems_by_lu() {
    for size in SIZES {
        let a = numbers(size).complex(size);
        let rhs = Numbers(3).complex(size);
        let mut solved = rhs.clone();
        Lu::new(&a).solve(solved.as_mut());
        // Backward stable: the residual is round-off whatever the condition.
        let scale = 1.0 + distance(&solved, &Mat::zeros(size, size));
        assert!(distance(&mul(&a, &solved), &rhs) < allowed(size) * scale);
        let expected = theirs(&a).lu().solve(&theirs(&rhs)).unwrap();
        let expected = Mat::from_fn(size, size, |i, j| expected[(i, j)]);
        assert!(distance(&solved, &expected) < 100.0 * allowed(size) * scale);
        assert!(distance(&mul(&inverse(&a), &a), &Mat::identity(size, size)) < 1e-10);
    }
}

#[test]
fn a_singular_system_does_not_pass_for_solved() {
    let mut rhs = Numbers(3).complex(4);
    Lu::new(&Mat::zeros(4, 4)).solve(rhs.as_mut());
    assert!((0..4).all(|i| !rhs[(i, 0)].is_finite()));
}

#[test]
fn cholesky_factors_and_triangles() {
    for size in SIZES {
        let a = positive(size);
        let l = cholesky(&a).unwrap();
        let largest = distance(&a, &Mat::zeros(size, size));
        assert!(distance(&mul(&l, &adjoint(&l)), &a) < allowed(size) * largest);
        assert!((0..size).all(|j| (0..j).all(|i| l[(i, j)] == Complex64::ZERO)));
        let rhs = Numbers(3).complex(size);
        let (mut forward, mut back) = (rhs.clone(), rhs.clone());
        solve_lower(&l, forward.as_mut());
        solve_lower_adjoint(&l, back.as_mut());
        assert!(distance(&mul(&l, &forward), &rhs) < 1e-10);
        assert!(distance(&mul(&adjoint(&l), &back), &rhs) < 1e-10);

        let real: RMat = Mat::from_fn(size, size, |i, j| a[(i, j)].re);
        let l = cholesky(&real).unwrap();
        let reconstructed = complexified(&mul(&l, &l.transpose().to_owned()));
        assert!(distance(&reconstructed, &complexified(&real)) < allowed(size) * largest);
        let inverted = f64::inverse_of_definite(&real).unwrap();
        let one = Mat::identity(size, size);
        assert!(distance(&complexified(&mul(&inverted, &real)), &one) < 1e-9);
        let mut both: RMat = Mat::identity(size, size);
        solve_lower(&l, both.as_mut());
        solve_lower_adjoint(&l, both.as_mut());
        assert!(distance(&complexified(&both), &complexified(&inverted)) < 1e-9);
    }
    let indefinite: CMat = diagonal(&[Complex64::ONE, -Complex64::ONE]);
    assert!(cholesky(&indefinite).is_none());
    let indefinite: RMat = Mat::from_fn(2, 2, |i, j| f64::from(u8::from(i != j)));
    assert!(cholesky(&indefinite).is_none() && f64::inverse_of_definite(&indefinite).is_none());
}

#[test]
fn products_replace_or_add() {
    let (a, b) = (Numbers(1).complex(9), Numbers(2).complex(9));
    let expected = theirs(&a) * theirs(&b);
    let expected: CMat = Mat::from_fn(9, 9, |i, j| expected[(i, j)]);
    assert!(distance(&mul(&a, &b), &expected) < allowed(9));
    let mut sum = expected.clone();
    product(sum.as_mut(), Accum::Add, -Complex64::ONE, a.as_ref(), b.as_ref());
    assert!(distance(&sum, &Mat::zeros(9, 9)) < allowed(9));
    assert!(
        distance(&transpose(&adjoint(&a)), &Mat::from_fn(9, 9, |i, j| a[(i, j)].conj())) == 0.0
    );
}

/// Both makers of the same thing.
#[cfg(feature = "lapack")]
#[test]
fn lapack_and_faer_agree() {
    for size in SIZES {
        let (a, h) = (numbers(size).complex(size), hermitian(size));
        let ours = by_faer::eigen_hermitian(&h).unwrap().0;
        let lapack = by_lapack::eigen_hermitian(&h).unwrap().0;
        assert!(ours.iter().zip(lapack).all(|(a, b)| (a - b).abs() < allowed(size)));
        let real = symmetric(size);
        let ours = by_faer::eigen_symmetric(&real).unwrap().0;
        let lapack = by_lapack::eigen_symmetric(&real).unwrap().0;
        assert!(ours.iter().zip(lapack).all(|(a, b)| (a - b).abs() < allowed(size)));
        let ours: Complex64 = by_faer::eigen_general(&a).unwrap().0.iter().sum();
        let lapack: Complex64 = by_lapack::eigen_general(&a).unwrap().0.iter().sum();
        assert!((ours - lapack).norm() < allowed(size) * size as f64);
        let (mut x, mut y) = (CMat::identity(size, size), CMat::identity(size, size));
        by_faer::Lu::new(&a).solve(x.as_mut());
        by_lapack::Lu::new(&a).solve(y.as_mut());
        let scale = 1.0 + distance(&x, &Mat::zeros(size, size));
        assert!(distance(&x, &y) < 100.0 * allowed(size) * scale * scale);
    }
}
