// SPDX-License-Identifier: MIT OR Apache-2.0
//! A small toothed dome on a mirror against finite elements, which share nothing with boundary integrals.

use crate::corners::{INDEX, SOURCES, WAVELENGTH, steps};
use full_wave::{Body, Polarisation, Resolution};

/// Power in bins of 5° from the left horizon to the right one, over what the source emits in an endless medium
/// of the index of the dome: TE and TM, two sources each. `finite_elements.py` beside this file; elements of
/// order 7, 0.2 µm and 5 nm at the corners, and those of order 6, 0.25 µm and 10 nm differ by at most 6e-5 of
/// the largest bin.
#[rustfmt::skip]
const BINS: [[f64; 36]; 4] = [
    [
        0.00964, 0.01399, 0.02123, 0.02293, 0.01033, 0.02294, 0.03270, 0.00230, 0.00749,
        0.02577, 0.04401, 0.04766, 0.02311, 0.01494, 0.02451, 0.04621, 0.02454, 0.05163,
        0.05163, 0.02454, 0.04621, 0.02451, 0.01494, 0.02311, 0.04766, 0.04401, 0.02577,
        0.00749, 0.00230, 0.03270, 0.02294, 0.01033, 0.02293, 0.02123, 0.01399, 0.00964,
    ],
    [
        0.01686, 0.03806, 0.01757, 0.02202, 0.03040, 0.02874, 0.00545, 0.02183, 0.05064,
        0.05470, 0.05319, 0.06603, 0.01307, 0.00895, 0.00379, 0.00622, 0.00242, 0.00447,
        0.00596, 0.00781, 0.00891, 0.01161, 0.01263, 0.02727, 0.03313, 0.01509, 0.01846,
        0.05149, 0.12130, 0.03221, 0.02587, 0.02023, 0.00683, 0.04422, 0.01480, 0.03791,
    ],
    [
        0.01046, 0.02348, 0.03797, 0.00908, 0.00807, 0.04853, 0.02029, 0.03555, 0.01965,
        0.00418, 0.03526, 0.03534, 0.04946, 0.01562, 0.03150, 0.00834, 0.00166, 0.05385,
        0.05385, 0.00166, 0.00834, 0.03150, 0.01562, 0.04946, 0.03534, 0.03526, 0.00418,
        0.01965, 0.03555, 0.02029, 0.04853, 0.00807, 0.00908, 0.03797, 0.02348, 0.01046,
    ],
    [
        0.02926, 0.02039, 0.02642, 0.01930, 0.01645, 0.00648, 0.02295, 0.02388, 0.00361,
        0.03592, 0.01214, 0.04926, 0.05253, 0.01308, 0.05430, 0.06842, 0.02948, 0.00676,
        0.00837, 0.00989, 0.00648, 0.03947, 0.12337, 0.06207, 0.03524, 0.01334, 0.01852,
        0.02047, 0.07022, 0.05389, 0.01272, 0.00535, 0.01414, 0.04811, 0.02755, 0.01998,
    ],
];

#[test]
fn finite_elements_find_the_same_power_by_angle() {
    let body = Body::new(&steps(), WAVELENGTH, INDEX, Resolution::default()).unwrap();
    let edges: Vec<f64> = (-18..=18).map(|i| f64::from(5 * i).to_radians()).collect();
    let bins = [Polarisation::Te, Polarisation::Tm]
        .map(|polarisation| body.solve(polarisation, &SOURCES).unwrap().bins(&edges));
    for (case, expected) in BINS.iter().enumerate() {
        let found = bins[case / 2].iter().map(|of_sources| of_sources[case % 2]);
        let largest = expected.iter().copied().fold(0.0, f64::max);
        let apart = found.zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 2e-4 * largest, "{case}: {:e}", apart / largest);
    }
}
