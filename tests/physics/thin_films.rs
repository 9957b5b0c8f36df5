// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films of the tracer against stacks of uniform layers of the solver, complex amplitudes
//! included.

use num_complex::Complex64;
use rcwa::relief::Layer as Slab;
use rcwa::{Bloch, Side, Stack, Truncation};
use tracer::optics::thin_film::{End, Film, Layer};

const WAVELENGTH_UM: f64 = 0.55;

/// (n, k, thickness in nm) from the side from which light comes.
type Layers = [(f64, f64, f64)];

fn film(layers: &Layers) -> Film {
    let layers = layers
        .iter()
        .map(|&(n, k, thickness_nm)| Layer { index: Complex64::new(n, k), thickness_nm });
    Film::new(1e3 * WAVELENGTH_UM, layers.collect()).expect("valid")
}

fn stack(above: f64, layers: &Layers, below: Complex64) -> Stack {
    let slabs = layers
        .iter()
        .map(|&(n, k, nm)| Slab::uniform(nm * 1e-3, Complex64::new(n, k)).expect("valid"));
    let top = Complex64::new(above, 0.0);
    Stack::new(WAVELENGTH_UM, 0.9, top, below, slabs.collect()).expect("valid")
}

#[test]
fn films_are_the_solvers_stacks() {
    let clear: &Layers = &[(2.1, 0.0, 83.0), (1.38, 0.0, 140.0)];
    let absorbing: &Layers = &[(1.45, 0.0, 60.0), (0.06, 3.6, 18.0), (2.0, 0.1, 35.0)];
    let silver = Complex64::new(0.06, 3.6);
    let cases = [
        (1.41, clear, Complex64::new(1.0, 0.0)),
        (1.0, clear, Complex64::new(1.41, 0.0)),
        (1.41, absorbing, Complex64::new(1.0, 0.0)),
        (1.41, clear, silver),
        (1.0, &[], silver),
    ];
    for (above, layers, below) in cases {
        let (stack, film) = (stack(above, layers, below), film(layers));
        // The last one is beyond the critical angle of 1.41 to 1.
        for degrees in [0.0, 17.0, 40.0, 60.0, 83.0] {
            let theta = f64::to_radians(degrees);
            let bloch = Bloch::from_angles(&stack, Side::Top, theta, 0.3);
            let truncation = Truncation::new(0).expect("valid");
            let solved = rcwa::solve(&stack, bloch, truncation).expect("solved");
            let met = film.amplitudes(End::First, above, below, theta.cos());
            for k in 0..2 {
                // Where no wave leaves there is no matrix.
                let amplitude = |side| {
                    let jones = solved.jones((Side::Top, 0), (side, 0));
                    jones.map_or(Complex64::ZERO, |j| j.power_normalised()[k][k])
                };
                let what = format!("{above} {layers:?} {below} at {degrees}, {k}");
                let (r, t) = (met.reflected[k], met.transmitted[k]);
                assert!((r - amplitude(Side::Top)).norm() < 1e-11, "{what}: {r}");
                if below.im < 1e-12 {
                    assert!((t - amplitude(Side::Bottom)).norm() < 1e-11, "{what}: {t}");
                }
            }
        }
    }
}
