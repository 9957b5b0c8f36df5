// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bodies with corners: energy and reciprocity, which nothing enforces, and refinement; what is
//! refused.

use crate::radiated;
use full_wave::{Body, Field, FullWaveError, Outline, Polarisation, Resolution};
use std::f64::consts::{FRAC_PI_2, PI};

pub(crate) const WAVELENGTH: f64 = 0.55;
pub(crate) const INDEX: [f64; 2] = [1.41, 1.0];
pub(crate) const SOURCES: [[f64; 2]; 2] = [[0.0, 1.5], [-1.1, 1.2]];

/// Steps of a dome 6 µm wide: upright risers, level treads, one slanted re-entrant riser.
const STEPS: [[f64; 2]; 11] = [
    [3.0, 1.6],
    [2.2, 1.5],
    [2.4, 2.4],
    [1.0, 2.4],
    [1.0, 3.0],
    [-1.0, 3.0],
    [-1.0, 2.4],
    [-2.4, 2.4],
    [-2.2, 1.5],
    [-3.0, 1.6],
    [-3.0, 0.0],
];

pub(crate) fn steps() -> Outline {
    STEPS.into_iter().fold(Outline::on_mirror([3.0, 0.0]), Outline::line_to)
}

/// The same with one side moved, so that no symmetry is left.
fn skew_steps() -> Outline {
    let mut outline = Outline::on_mirror([3.0, 0.0]).line_to([3.0, 1.6]).line_to([2.0, 1.6]);
    for point in [[2.0, 2.6], [0.2, 3.0], [-0.4, 2.5], [-2.0, 2.2], [-2.4, 1.0], [-3.2, 0.0]] {
        outline = outline.line_to(point);
    }
    outline
}

fn solve(outline: &Outline, nodes_per_wavelength: f64, polarisation: Polarisation) -> Field {
    let resolution = Resolution { nodes_per_wavelength, ..Resolution::default() };
    let body = Body::new(outline, WAVELENGTH, INDEX, resolution).unwrap();
    body.solve(polarisation, &SOURCES).unwrap()
}

fn bins(field: &Field) -> Vec<Vec<f64>> {
    let edges: Vec<f64> = (0..=36).map(|i| (-90.0 + 5.0 * f64::from(i)).to_radians()).collect();
    field.bins(&edges)
}

/// Checks that two lists of bins differ by at most a share of the largest.
fn close(a: &[Vec<f64>], b: &[Vec<f64>], tolerance: f64) {
    let largest = a.iter().flatten().copied().fold(0.0, f64::max);
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((a - b).abs() < tolerance * largest, "{a} and {b}");
    }
}

fn check_laws(outline: &Outline) {
    for polarisation in [Polarisation::Te, Polarisation::Tm] {
        let (coarse, fine) =
            (solve(outline, 8.0, polarisation), solve(outline, 12.0, polarisation));
        for (emitted, radiated) in fine.emitted().iter().zip(radiated(&fine, FRAC_PI_2)) {
            let balance = (emitted - radiated).abs() / emitted;
            assert!(balance < 1e-9, "{polarisation:?}: {balance:e}");
        }
        let (there, back) = (fine.between(0, 1), fine.between(1, 0));
        let difference = (there - back).norm() / there.norm();
        assert!(difference < 1e-8, "{polarisation:?}, reciprocity: {difference:e}");
        close(&bins(&fine), &bins(&coarse), 1e-6);
    }
}

/// What a lossless body takes from a plane wave, Im F straight on, is what it scatters,
/// ∫|F|² dθ / 8π.
#[test]
fn a_plane_wave_loses_what_is_scattered() {
    let outline = Outline::closed([1.0, -0.5]).line_to([0.3, 1.2]).line_to([-1.1, 0.2]);
    let outline = outline.line_to([1.0, -0.5]);
    let body = Body::new(&outline, WAVELENGTH, INDEX, Resolution::default()).unwrap();
    for (polarisation, weight) in
        [(Polarisation::Te, 1.0), (Polarisation::Tm, 1.0 / INDEX[0].powi(2))]
    {
        let field = body.scatter(polarisation, &[0.4]).expect("a solution");
        let lost = field.amplitudes(&[0.4])[0][0].im;
        let scattered = 0.25 * weight * radiated(&field, PI)[0];
        assert!((lost - scattered).abs() < 1e-8 * lost, "{lost}, {scattered}");
    }
}

#[test]
#[ignore = "slow: 6 s"]
fn energy_reciprocity_and_refinement_of_steps() {
    check_laws(&steps());
}

#[test]
#[ignore = "slow: 6 s"]
fn energy_reciprocity_and_refinement_without_symmetry() {
    check_laws(&skew_steps());
}

/// Even and odd light apart, and both together: the same field by two ways.
#[test]
fn symmetry_changes_nothing() {
    let symmetric = steps();
    // A vertex in the middle of a side, on one half alone, hides the symmetry.
    let hidden = Outline::on_mirror([3.0, 0.0]).line_to([3.0, 0.7]);
    let hidden = STEPS.into_iter().fold(hidden, Outline::line_to);
    assert!(symmetric.is_symmetric() && !hidden.is_symmetric());
    let (a, b) =
        (solve(&symmetric, 12.0, Polarisation::Tm), solve(&hidden, 12.0, Polarisation::Tm));
    close(&bins(&a), &bins(&b), 1e-7);
}

/// Where the memory holds one of the two matrices, they follow each other: the same bits.
#[test]
fn one_matrix_at_a_time_gives_the_same() {
    let solved = |max_bytes| {
        let resolution = Resolution { max_bytes, ..Resolution::within(1e-3) };
        let body = Body::new(&steps(), WAVELENGTH, INDEX, resolution).unwrap();
        (body.cost(), bins(&body.solve(Polarisation::Tm, &SOURCES).unwrap()))
    };
    let (all, together) = solved(1e12);
    let (half, apart) = solved(0.6 * all.bytes);
    assert_eq!((all.held, half.held), (2, 1));
    assert!((half.bytes - 0.5 * all.bytes).abs() < 1.0);
    assert_eq!(together, apart);
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let body = Body::new(&steps(), WAVELENGTH, INDEX, Resolution::default()).unwrap();
    let refused = |at| body.solve(Polarisation::Te, &[at]).unwrap_err();
    assert!(refused([0.0, 3.5]).to_string().contains("outside"));
    assert!(refused([0.0, -1.0]).to_string().contains("outside"));
    assert!(refused([2.999, 1.0]).to_string().contains("at least"));
    let small = Resolution { max_bytes: 1e6, ..Resolution::default() };
    let memory = Body::new(&steps(), WAVELENGTH, INDEX, small).unwrap_err();
    assert!(matches!(memory, FullWaveError::Memory { .. }), "{memory}");
    let index = Body::new(&steps(), WAVELENGTH, [f64::NAN, 1.0], Resolution::default());
    assert!(index.unwrap_err().to_string().contains("index inside"));
    let coarse = Resolution { nodes_per_wavelength: 4.0, ..Resolution::default() };
    let coarse = Body::new(&steps(), WAVELENGTH, INDEX, coarse).unwrap_err().to_string();
    assert!(coarse.contains("nodes per wavelength: expected a number above 4"), "{coarse}");
}
