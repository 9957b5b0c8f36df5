// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modes against the full conical equations, against exact modes of lamellae, and against effective
//! media.

use super::*;
use crate::factorization::toeplitz;
use crate::linalg::{inverse, transpose};
use crate::orders::outgoing_kz;
use crate::relief::Segment;
use nalgebra::DMatrix;
use serde_json::Value;

fn layer(ends: &[(f64, Complex64)]) -> Layer {
    let mut x0 = 0.0;
    let segments = ends.iter().map(|&(x1, index)| {
        let segment = Segment { x0, x1, index };
        x0 = x1;
        segment
    });
    Layer::new(1.0, segments.collect()).unwrap()
}

fn real(n: f64) -> Complex64 {
    Complex64::new(n, 0.0)
}

fn wavevectors(kx0: f64, spacing: f64, highest: i32) -> Vec<f64> {
    (-highest..=highest).map(|m| kx0 + f64::from(m) * spacing).collect()
}

/// A layer for each way of solving.
fn layers() -> [(&'static str, Layer); 5] {
    let metal = Complex64::new(0.22, 6.71);
    [
        ("symmetric", layer(&[(0.2, real(1.0)), (0.7, real(1.41)), (1.0, real(1.0))])),
        (
            "without symmetry",
            layer(&[(0.2, real(1.0)), (0.5, real(1.41)), (0.6, real(2.0)), (1.0, real(1.3))]),
        ),
        ("absorbing", layer(&[(0.2, metal), (0.5, real(1.41)), (1.0, Complex64::new(2.0, 0.1))])),
        ("negative ε", layer(&[(0.2, Complex64::new(0.0, 2.1)), (1.0, real(1.41))])),
        ("uniform", layer(&[(1.0, real(1.41))])),
    ]
}

/// The two halves of the conical equations for (Ex, Ey) and (Hx, Hy): kz E = P H, kz H = Q E.
fn conical(layer: &Layer, kx: &[f64], ky: f64) -> (CMat, CMat) {
    let n = kx.len();
    let matrices = toeplitz(&layer.segments, n);
    let e = &matrices.permittivity;
    let (e_inverse, inner) = (inverse(e), inverse(&matrices.inverse_permittivity));
    let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    let p = Mat::from_fn(2 * n, 2 * n, |row, column| {
        let (i, j) = (row % n, column % n);
        match (row < n, column < n) {
            (true, true) => kx[i] * e_inverse[(i, j)] * ky,
            (true, false) => one(i, j) - kx[i] * e_inverse[(i, j)] * kx[j],
            (false, true) => ky * e_inverse[(i, j)] * ky - one(i, j),
            (false, false) => -ky * e_inverse[(i, j)] * kx[j],
        }
    });
    let q = Mat::from_fn(2 * n, 2 * n, |row, column| {
        let (i, j) = (row % n, column % n);
        match (row < n, column < n) {
            (true, true) => Complex64::from(-ky * kx[i] * one(i, j)),
            (true, false) => kx[i] * kx[i] * one(i, j) - e[(i, j)],
            (false, true) => inner[(i, j)] - ky * ky * one(i, j),
            (false, false) => Complex64::from(ky * kx[i] * one(i, j)),
        }
    });
    (p, q)
}

fn nearest(value: Complex64, of: &[Complex64]) -> f64 {
    of.iter().map(|o| (o - value).norm()).fold(f64::INFINITY, f64::min)
}

#[test]
fn conical_modes_are_the_planar_ones_less_ky_squared() {
    for (name, layer) in layers() {
        for (kx0, ky) in [(0.0, 0.4), (0.23, 0.0), (0.31, 0.9), (-0.4, 1.7)] {
            let kx = wavevectors(kx0, 0.61, 5);
            let modes = modes(&layer, &kx).unwrap();
            let ours: Vec<Complex64> =
                modes.b_lse.iter().chain(&modes.b_lsm).map(|b| b - ky * ky).collect();
            let (p, q) = conical(&layer, &kx, ky);
            let pq = mul(&p, &q);
            let pq = DMatrix::from_fn(pq.nrows(), pq.ncols(), |i, j| pq[(i, j)]);
            let scale = pq.camax();
            let theirs: Vec<Complex64> = pq.eigenvalues().unwrap().iter().copied().collect();
            assert_eq!(ours.len(), theirs.len());
            for &value in &ours {
                // Double eigenvalues of a general problem come apart by the root of round-off.
                let allowed = if name == "uniform" { 1e-7 } else { 1e-11 } * scale;
                assert!(nearest(value, &theirs) < allowed, "{name}, ({kx0}, {ky}): {value}");
            }
            for &value in &theirs {
                assert!(nearest(value, &ours) < 1e-7 * scale, "{name}, ({kx0}, {ky}): {value}");
            }
            let sum = |of: &[Complex64]| of.iter().sum::<Complex64>();
            assert!((sum(&ours) - sum(&theirs)).norm() < 1e-11 * scale, "{name}");
        }
    }
}

#[test]
fn every_mode_solves_the_conical_equations() {
    for (name, layer) in layers() {
        for (kx0, ky) in [(0.0, 0.4), (0.23, 0.0), (0.31, 0.9), (-0.4, 1.7)] {
            let kx = wavevectors(kx0, 0.61, 5);
            let n = kx.len();
            let Modes { basis, b_lse, b_lsm, degenerate, .. } = modes(&layer, &kx).unwrap();
            assert!(degenerate.is_none(), "{name}: choose another kx0");
            let (p, q) = conical(&layer, &kx, ky);
            // Coordinates (ex, ey | hy, hx) of all modes, then their fields.
            let kz: Vec<Complex64> =
                b_lsm.iter().chain(&b_lse).map(|b| outgoing_kz(b - ky * ky)).collect();
            let unit =
                |scale: &dyn Fn(usize) -> Complex64, from: usize| -> CMat {
                    Mat::from_fn(n, 2 * n, |i, mode| {
                        if i + from == mode { scale(mode) } else { Complex64::ZERO }
                    })
                };
            let (ex, ey) = (unit(&|_| Complex64::ONE, 0), unit(&|_| Complex64::ONE, n));
            let (hy, hx) = (unit(&|m| kz[m] / b_lsm[m], 0), unit(&|m| b_lse[m - n] / kz[m], n));
            let field_ex = mul(&basis.ag, &ex);
            let o = mul(&basis.o, &ex);
            let field_ey =
                mul(&basis.f, &Mat::from_fn(n, 2 * n, |i, j| ey[(i, j)] - ky * o[(i, j)]));
            let qx = mul(&basis.q, &hx);
            let field_hy =
                mul(&basis.g, &Mat::from_fn(n, 2 * n, |i, j| hy[(i, j)] + ky * qx[(i, j)]));
            let field_hx = mul(&basis.f, &hx);
            let electric = Mat::from_fn(2 * n, 2 * n, |i, j| {
                if i < n { field_ex[(i, j)] } else { field_ey[(i - n, j)] }
            });
            let magnetic = Mat::from_fn(2 * n, 2 * n, |i, j| {
                if i < n { -field_hx[(i, j)] } else { field_hy[(i - n, j)] }
            });
            let (ph, qe) = (mul(&p, &magnetic), mul(&q, &electric));
            for mode in 0..2 * n {
                for i in 0..2 * n {
                    let first = ph[(i, mode)] - kz[mode] * electric[(i, mode)];
                    let second = qe[(i, mode)] - kz[mode] * magnetic[(i, mode)];
                    let worst = first.norm().max(second.norm());
                    assert!(worst < 1e-10, "{name}, ({kx0}, {ky}), mode {mode}: {worst:.1e}");
                }
            }
        }
    }
}

#[test]
fn generalised_problem_is_solved_as_it_stands() {
    // (1 - K E⁻¹ K) g = b A g and (E - K²) f = b f, f orthonormal and g A-orthonormal without loss.
    for (name, layer) in layers() {
        let kx = wavevectors(0.17, 0.4, 12);
        let n = kx.len();
        let matrices = toeplitz(&layer.segments, n);
        let (e, a) = (&matrices.permittivity, &matrices.inverse_permittivity);
        let e_inverse = inverse(e);
        let Modes { basis, b_lse, b_lsm, .. } = modes(&layer, &kx).unwrap();
        let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let lse: CMat = Mat::from_fn(n, n, |i, j| e[(i, j)] - kx[i] * kx[i] * one(i, j));
        let lsm: CMat = Mat::from_fn(n, n, |i, j| one(i, j) - kx[i] * e_inverse[(i, j)] * kx[j]);
        let (left_f, left_g) = (mul(&lse, &basis.f), mul(&lsm, &basis.g));
        let ag = mul(a, &basis.g);
        for j in 0..n {
            for i in 0..n {
                let f = (left_f[(i, j)] - b_lse[j] * basis.f[(i, j)]).norm();
                let g = (left_g[(i, j)] - b_lsm[j] * ag[(i, j)]).norm();
                let same = (ag[(i, j)] - basis.ag[(i, j)]).norm();
                let scale = kx[0] * kx[0];
                assert!(f < 1e-13 * scale && same < 1e-12, "{name}: {f:.1e} {same:.1e}");
                assert!(g < 1e-12 * scale, "{name}: {g:.1e}");
            }
        }
        assert!(residual(&layer, &kx).unwrap() < 1e-11, "{name}");
        if layer.segments.iter().all(|s| s.index.im == 0.0) {
            assert!(b_lse.iter().chain(&b_lsm).all(|b| b.im == 0.0), "{name}: b must be real");
        }
    }
}

#[test]
fn couplings_have_two_equal_forms() {
    // O = f⁻¹ E⁻¹ K g / b_g = f⁻¹ K A g / b_f and Q = g⁻¹ K f / b_f = (Ag)⁻¹ K E⁻¹ f / b_g; Q = Oᴴ
    // without loss.
    for (name, layer) in layers() {
        let kx = wavevectors(0.17, 0.61, 4);
        let n = kx.len();
        let e_inverse = inverse(&toeplitz(&layer.segments, n).permittivity);
        let Modes { basis, b_lse, b_lsm, .. } = modes(&layer, &kx).unwrap();
        let times_k = |m: &CMat| -> CMat { Mat::from_fn(n, n, |i, j| kx[i] * m[(i, j)]) };
        let by_lsm = mul(&basis.f_inverse, &mul(&e_inverse, &times_k(&basis.g)));
        let by_lse = mul(&basis.f_inverse, &times_k(&basis.ag));
        let q_by_lse = mul(&basis.g_inverse, &times_k(&basis.f));
        let q_by_lsm = mul(&basis.ag_inverse, &times_k(&mul(&e_inverse, &basis.f)));
        for i in 0..n {
            for j in 0..n {
                let o = basis.o[(i, j)];
                assert!((o * b_lsm[j] - by_lsm[(i, j)]).norm() < 1e-11, "{name}");
                assert!((o * b_lse[i] - by_lse[(i, j)]).norm() < 1e-11, "{name}");
                let q = basis.q[(j, i)];
                assert!((q * b_lse[i] - q_by_lse[(j, i)]).norm() < 1e-11, "{name}");
                assert!((q * b_lsm[j] - q_by_lsm[(j, i)]).norm() < 1e-11, "{name}");
                if name == "symmetric" || name == "without symmetry" {
                    assert!((q - o.conj()).norm() < 1e-12, "{name}");
                }
            }
        }
    }
}

#[test]
fn the_frame_of_the_cell_does_not_matter() {
    // The symmetric solver against the general complex one, on the same layer, by what both must
    // agree on.
    let layer = &layers()[0].1;
    let kx = wavevectors(0.23, 0.61, 6);
    let n = kx.len();
    let real_way = lossless::modes(layer, &kx).unwrap().unwrap();
    let general_way = absorbing::modes(layer, &kx).unwrap();
    for b in &real_way.b_lse {
        assert!(nearest(*b, &general_way.b_lse) < 1e-12);
    }
    for b in &real_way.b_lsm {
        assert!(nearest(*b, &general_way.b_lsm) < 1e-11);
    }
    // f b f⁻¹ and g b g⁻¹ are the operators themselves, whatever the phases and the order of the
    // modes.
    let operator = |v: &CMat, b: &[Complex64], inverse: &CMat| {
        mul(&Mat::from_fn(n, n, |i, j| v[(i, j)] * b[j]), inverse)
    };
    let pairs = [
        (
            operator(&real_way.basis.f, &real_way.b_lse, &real_way.basis.f_inverse),
            operator(&general_way.basis.f, &general_way.b_lse, &general_way.basis.f_inverse),
        ),
        (
            operator(&real_way.basis.g, &real_way.b_lsm, &real_way.basis.g_inverse),
            operator(&general_way.basis.g, &general_way.b_lsm, &general_way.basis.g_inverse),
        ),
    ];
    for (a, b) in pairs {
        for i in 0..n {
            for j in 0..n {
                assert!((a[(i, j)] - b[(i, j)]).norm() < 1e-11);
            }
        }
    }
    assert_eq!(transpose(&transpose(&real_way.basis.o)), real_way.basis.o);
}

#[expect(clippy::disallowed_methods, reason = "tests read the reference cases from their files")]
fn published(id: &str, file: &str) -> Value {
    let path = format!("{}/../data/reference/{file}", env!("CARGO_MANIFEST_DIR"));
    let document: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let cases = document["cases"].as_array().unwrap();
    cases.iter().find(|c| c["id"] == id).unwrap().clone()
}

/// Distance of the nearest eigenvalue from each exact one. (In metal, truncated TM problems have
/// some that are none of the layer's: Li's rule keeps them where they do no harm.)
fn errors(exact: &Value, b: &[Complex64]) -> Vec<f64> {
    let exact = exact.as_array().unwrap();
    assert_eq!(exact.len(), 5);
    let part = |e: &Value, i: usize| e[i].as_f64().unwrap();
    exact.iter().map(|e| nearest(Complex64::new(part(e, 0), part(e, 1)), b)).collect()
}

#[test]
fn lamellar_modes_approach_the_exact_ones() {
    let case = published("derived/lamellar_mode_eigenvalues", "published.json");
    let (air, silicone, metal) = (real(1.0), real(1.41), Complex64::new(0.22, 6.71));
    let cases = [
        ("diel_1.41_normal", silicone, 0.5, 1.0, 0.0),
        ("diel_1.41_kx0.5", silicone, 0.5, 1.0, 0.5),
        ("diel_1.41_f0.3_L2_kx0.3", silicone, 0.3, 2.0, 0.3),
        ("metal_0.22+6.71i_kx0.5", metal, 0.5, 1.0, 0.5),
    ];
    for (name, ridge, fill, period, kx0) in cases {
        let lamella = layer(&[(fill, ridge), (1.0, air)]);
        let at = |highest: i32| {
            let m = modes(&lamella, &wavevectors(kx0, 1.0 / period, highest)).unwrap();
            let exact = &case["outputs"][name];
            (errors(&exact["te"], &m.b_lse), errors(&exact["tm"], &m.b_lsm))
        };
        let (coarse, fine) = (at(20), at(40));
        let dielectric = ridge.im == 0.0;
        for i in 0..5 {
            // Third order in 1/N for TE whatever the material and for TM without metal.
            let (te, te_fine) = (coarse.0[i], fine.0[i]);
            assert!(te_fine < 0.2 * te && te < 3e-2, "{name}, TE {i}: {te:.1e} {te_fine:.1e}");
            let (tm, tm_fine) = (coarse.1[i], fine.1[i]);
            let (factor, largest) = if dielectric { (0.2, 3e-2) } else { (0.75, 0.3) };
            assert!(
                tm_fine < factor * tm && tm < largest,
                "{name}, TM {i}: {tm:.1e} {tm_fine:.1e}"
            );
        }
        if name == "diel_1.41_kx0.5" {
            let expected = [(10, 2.2e-5, 4.7e-5), (20, 2.9e-6, 6.6e-6), (40, 3.8e-7, 8.9e-7)];
            for (highest, te, tm) in expected {
                let (found_te, found_tm) = at(highest);
                assert!((found_te[0] / te - 1.0).abs() < 0.03, "{highest}: {:.2e}", found_te[0]);
                assert!((found_tm[0] / tm - 1.0).abs() < 0.03, "{highest}: {:.2e}", found_tm[0]);
            }
        }
    }
}

#[test]
fn subwavelength_lamellae_are_effective_media() {
    let case = published("analytic/rytov", "analytic.json");
    let lamella = layer(&[(0.5, real(1.41)), (1.0, real(1.0))]);
    let largest = |b: &[Complex64]| b.iter().map(|b| b.re).fold(f64::NEG_INFINITY, f64::max);
    let (e1, e2) = (1.41_f64.powi(2), 1.0);
    let (te0, tm0) = (0.5 * (e1 + e2), 1.0 / (0.5 / e1 + 0.5 / e2));
    let third = std::f64::consts::PI.powi(2) / 3.0 / 16.0;
    let mut missing: Vec<(f64, f64)> = Vec::new();
    for (x, key) in [(0.4, None), (0.2, Some("0.2")), (0.1, Some("0.1"))] {
        let m = modes(&lamella, &wavevectors(0.0, 1.0 / x, 90)).unwrap();
        let (te, tm) = (largest(&m.b_lse), largest(&m.b_lsm));
        if let Some(key) = key {
            let exact =
                |pol: &str| case["outputs"][pol][format!("L/lam={key} exact")].as_f64().unwrap();
            assert!((te - exact("eps_TE")).abs() < 1e-8, "{te} at {x}");
            assert!((tm - exact("eps_TM")).abs() < 1e-7, "{tm} at {x}");
        }
        let te2 = te0 + third * x * x * (e1 - e2).powi(2);
        let tm2 = tm0 + third * x * x * (1.0 / e1 - 1.0 / e2).powi(2) * te0 * tm0.powi(3);
        missing.push((te - te2, tm - tm2));
    }
    // What the second-order formula misses is of fourth order; in TE, at a fill of one half, of
    // sixth.
    for pair in missing.windows(2) {
        let (te, tm) = (pair[0].0 / pair[1].0, pair[0].1 / pair[1].1);
        assert!((te / 64.0 - 1.0).abs() < 0.1, "TE {te}");
        assert!((tm / 16.0 - 1.0).abs() < 0.1, "TM {tm}");
    }
    // One order kept: the two means themselves.
    let single = modes(&lamella, &[0.0]).unwrap();
    assert!((single.b_lse[0] - te0).norm() < 1e-15 && (single.b_lsm[0] - tm0).norm() < 1e-15);
}
