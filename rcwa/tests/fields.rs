// SPDX-License-Identifier: MIT OR Apache-2.0
//! Near fields: closed forms of films, continuity, the power through every plane, what a layer
//! absorbs, and the far field that follows from the amplitudes of the scattering matrix.

use crate::support::{SIDES, assert_near, layer, real, ridge, solve, uniform};
use num_complex::Complex64;
use rcwa::field::{Field, Grid, Incident, Sample, field};
use rcwa::no_progress;
use rcwa::relief::{Layer, Polygon, Relief};
use rcwa::{Bloch, Error, Pol, Side, Stack, Truncation};
use std::f64::consts::TAU;
use std::ops::ControlFlow;

const WAVELENGTH: f64 = 0.55;
const PERIOD: f64 = 0.9;

fn stack(layers: Vec<Layer>) -> Stack {
    Stack::new(WAVELENGTH, PERIOD, real(1.41), real(1.0), layers).unwrap()
}

fn found(stack: &Stack, bloch: Bloch, highest: usize, incident: Incident, grid: Grid) -> Field {
    let truncation = Truncation::new(highest).unwrap();
    field(stack, bloch, truncation, &incident, grid, &no_progress).unwrap()
}

fn depths(stack: &Stack, from: f64, to: f64, count: usize) -> Vec<f64> {
    let depth: f64 = stack.layers().iter().map(|l| l.thickness).sum();
    let (from, to) = (from * WAVELENGTH, depth + to * WAVELENGTH);
    (0..count).map(|i| from + (to - from) * i as f64 / (count - 1) as f64).collect()
}

/// Places of one period, `count` of them, so that means over them are integrals of what has few
/// orders.
fn one_period(count: usize) -> Vec<f64> {
    (0..count).map(|i| PERIOD * i as f64 / count as f64).collect()
}

/// Mean over x of the z component of the Poynting vector.
fn mean_flux(row: &[Sample]) -> f64 {
    row.iter().map(|s| s.poynting()[2]).sum::<f64>() / row.len() as f64
}

#[test]
fn a_film_has_its_standing_wave() {
    // Fields of a film between two half-spaces from the 2 × 2 transfer matrices of Abelès, at 40°,
    // azimuth 25°.
    let (n, d) = ([1.41, 1.9, 1.0], 0.23);
    let film = stack(vec![uniform(d, n[1])]);
    let (theta, phi) = (40f64.to_radians(), 25f64.to_radians());
    let bloch = Bloch::from_angles(&film, Side::Top, theta, phi);
    let kt = n[0] * theta.sin();
    let k0 = TAU / WAVELENGTH;
    let kz = n.map(|n: f64| Complex64::from(n * n - kt * kt).sqrt());
    for pol in Pol::BOTH {
        // Admittance h/e of a downward wave in the tangential pair (e, h).
        let y = [0, 1, 2].map(|i| match pol {
            Pol::S => kz[i],
            Pol::P => n[i] * n[i] / kz[i],
        });
        let delta = kz[1] * k0 * d;
        let at_bottom = [Complex64::ONE, y[2]];
        let above = |[e, h]: [Complex64; 2], delta: Complex64| {
            let (c, s) = (delta.cos(), -Complex64::I * delta.sin());
            [c * e + s / y[1] * h, c * h + s * y[1] * e]
        };
        let [e, h] = above(at_bottom, delta);
        let incoming = 0.5 * (e + h / y[0]);
        // Tangential e of a wave of unit amplitude: 1 for s, kz/n for p.
        let unit = if pol == Pol::S { Complex64::ONE } else { kz[0] / n[0] };
        let scale = unit / incoming;
        let grid = Grid { x: vec![0.0, 0.31], z: vec![-0.4, -0.001, 0.0, 0.05, 0.2299, 0.23, 0.9] };
        let got = found(&film, bloch, 3, Incident::unit(Side::Top, pol), grid);
        for (i, &z) in got.grid.z.iter().enumerate() {
            let [e, h] = if z < 0.0 {
                let (down, up) = (incoming, 0.5 * (e - h / y[0]));
                let phase = (Complex64::I * kz[0] * k0 * z).exp();
                [down * phase + up / phase, y[0] * (down * phase - up / phase)]
            } else if z < d {
                above(at_bottom, kz[1] * k0 * (d - z))
            } else {
                let phase = (Complex64::I * kz[2] * k0 * (z - d)).exp();
                at_bottom.map(|f| f * phase)
            };
            let index = if z < 0.0 {
                n[0]
            } else if z < d {
                n[1]
            } else {
                n[2]
            };
            for (j, &x) in got.grid.x.iter().enumerate() {
                let sample = got.samples[i * 2 + j];
                let shift = scale * Complex64::cis(k0 * bloch.kx0 * x);
                let (e, h) = (e * shift, h * shift);
                // Along k∥ is c, across it s; s: E = e s, H = -h c + …; p: E = e c + …, H = h s.
                let (cos, sin) = (phi.cos(), phi.sin());
                let (along, across) = (Complex64::from(cos), Complex64::from(sin));
                let zero = Complex64::ZERO;
                let (electric, magnetic) = match pol {
                    Pol::S => ([-across * e, along * e, zero], [-along * h, -across * h, kt * e]),
                    Pol::P => (
                        [along * e, across * e, -kt * h / (index * index)],
                        [-across * h, along * h, zero],
                    ),
                };
                assert_near("index", (sample.index - index).norm(), 0.0, 1e-15);
                for c in 0..3 {
                    let what = format!("{pol:?}, z {z}, component {c}");
                    assert_near(&what, (sample.electric[c] - electric[c]).norm(), 0.0, 1e-11);
                    assert_near(&what, (sample.magnetic[c] - magnetic[c]).norm(), 0.0, 1e-11);
                }
            }
        }
    }
}

/// A relief with slanted sides, a rectangular ridge, and a film as thick as ten wavelengths.
fn lossless() -> Stack {
    let silicone = Polygon { index: real(1.41), points: vec![[0.0, 0.0], [0.9, 0.0], [0.7, 0.4]] };
    let relief = Relief::new(PERIOD, 0.4, real(1.0), vec![silicone]).unwrap();
    let mut layers = relief.slices(7);
    layers.push(ridge(0.3, 0.4, 0.2, real(2.1), real(1.0)));
    layers.push(uniform(5.5, 1.3));
    stack(layers)
}

const BLOCHS: [(f64, f64); 4] = [(0.0, 0.0), (0.31, 0.0), (0.21, 0.5), (-0.4, 0.8)];

#[test]
fn power_through_every_plane_is_what_does_not_come_back() {
    let stack = lossless();
    for (kx0, ky) in BLOCHS {
        let bloch = Bloch::new(kx0, ky);
        let scattering = solve(&stack, bloch, 9);
        for side in SIDES {
            for pol in Pol::BOTH {
                // Light from below need not propagate at order 0: any order that does.
                let order = scattering.orders(side).last().unwrap();
                let incident = Incident { order, ..Incident::unit(side, pol) };
                let grid = Grid { x: vec![0.1], z: depths(&stack, -1.0, 1.0, 41) };
                let got = found(&stack, bloch, 9, incident, grid);
                let from = (side, order, pol);
                let what = format!("{from:?} at {kx0}, {ky}");
                let (near, far) = match side {
                    Side::Top => (Side::Top, Side::Bottom),
                    Side::Bottom => (Side::Bottom, Side::Top),
                };
                assert_near(&what, got.reflected, scattering.total(from, near), 1e-10);
                assert_near(&what, got.transmitted, scattering.total(from, far), 1e-10);
                for (z, flux) in got.grid.z.iter().zip(&got.flux) {
                    assert_near(&format!("{what}, z {z}"), *flux, 1.0 - got.reflected, 1e-10);
                }
            }
        }
    }
}

#[test]
fn the_mean_of_the_poynting_vector_is_the_power() {
    // In half-spaces and uniform layers the points carry the same orders as the coefficients.
    let stack = lossless();
    let bloch = Bloch::new(0.21, 0.5);
    for side in SIDES {
        let order = solve(&stack, bloch, 9).orders(side).next().unwrap();
        let incident = Incident { order, ..Incident::unit(side, Pol::P) };
        let grid = Grid { x: one_period(64), z: vec![-0.3, -0.01, 0.75, 3.0, 6.19, 6.21, 7.0] };
        let got = found(&stack, bloch, 9, incident, grid);
        let (n, kx) = match side {
            Side::Top => (1.41, 0.21 + f64::from(order) * WAVELENGTH / PERIOD),
            Side::Bottom => (1.0, 0.21 + f64::from(order) * WAVELENGTH / PERIOD),
        };
        let sense = if side == Side::Top { 1.0 } else { -1.0 };
        let incident = 0.5 * f64::sqrt(n * n - kx * kx - 0.25);
        for (row, flux) in got.samples.chunks(64).zip(&got.flux) {
            assert_near("mean flux", sense * mean_flux(row) / incident, *flux, 1e-10);
        }
    }
}

#[test]
fn what_is_continuous_is_continuous() {
    // Tangential fields and normal inductions of the truncated problem on both sides of every
    // plane; inside the patterned layers the displacement εEx is summed and not Ex, so Ex is
    // compared where both sides are uniform.
    let stack = lossless();
    let planes: Vec<f64> = stack
        .layers()
        .iter()
        .scan(0.0, |z, l| {
            let top = *z;
            *z += l.thickness;
            Some(top)
        })
        .chain([stack.layers().iter().map(|l| l.thickness).sum()])
        .collect();
    let step = 1e-12;
    let z: Vec<f64> = planes.iter().flat_map(|z| [z - step, z + step]).collect();
    for side in SIDES {
        let grid = Grid { x: one_period(11), z: z.clone() };
        let bloch = Bloch::new(0.21, 0.5);
        let order = solve(&stack, bloch, 9).orders(side).next().unwrap();
        let incident = Incident {
            side,
            order,
            amplitudes: [Complex64::new(0.6, 0.2), Complex64::new(-0.1, 0.7)],
        };
        let got = found(&stack, bloch, 9, incident, grid);
        let rows: Vec<&[Sample]> = got.samples.chunks(11).collect();
        for (i, pair) in rows.chunks(2).enumerate() {
            for (a, b) in pair[0].iter().zip(pair[1]) {
                let what = format!("plane {i} from {side:?}");
                assert_near(&what, (a.electric[1] - b.electric[1]).norm(), 0.0, 1e-8);
                for c in 0..3 {
                    assert_near(&what, (a.magnetic[c] - b.magnetic[c]).norm(), 0.0, 1e-8);
                }
            }
        }
        let last = rows.len() - 2;
        for (a, b) in rows[last].iter().zip(rows[last + 1]) {
            let (e, f) = (a.electric, b.electric);
            assert_near("Ex", (e[0] - f[0]).norm(), 0.0, 1e-8);
            let normal = a.index * a.index * e[2] - b.index * b.index * f[2];
            assert_near("εEz", normal.norm(), 0.0, 1e-8);
            assert!((e[2] - f[2]).norm() > 1e-3, "Ez itself jumps");
        }
    }
}

#[test]
#[ignore = "slow: 4 s"]
fn displacement_is_continuous_across_a_wall() {
    // Ex jumps by the ratio of ε at the side of a ridge, and does so more exactly the more orders
    // there are.
    let stack = stack(vec![ridge(0.3, 0.5, 0.2, real(2.0), real(1.0))]);
    let jump = |highest: usize| {
        let wall = 0.3 * PERIOD;
        let grid = Grid { x: vec![wall - 1e-9, wall + 1e-9], z: vec![0.15] };
        let bloch = Bloch::new(0.2, 0.3);
        let got = found(&stack, bloch, highest, Incident::unit(Side::Top, Pol::P), grid);
        let [out, inside] = [got.samples[0], got.samples[1]];
        assert_eq!((out.index.re, inside.index.re), (1.0, 2.0));
        assert_near("ε Ex", (out.electric[0] / inside.electric[0] - 4.0).norm(), 0.0, 1e-6);
        got.samples[1].intensity()
    };
    assert_near("|E|² at the wall", jump(40), jump(60), 0.02 * jump(60));
}

#[test]
fn what_a_layer_absorbs_is_the_difference_of_the_flux() {
    let lossy = Complex64::new(1.6, 0.15);
    let layers = vec![
        ridge(0.2, 0.4, 0.2, real(2.1), real(1.0)),
        uniform(0.1, 1.2),
        Layer::uniform(0.25, lossy).unwrap(),
        uniform(0.2, 1.3),
    ];
    let stack = stack(layers);
    for (pol, (kx0, ky)) in Pol::BOTH.into_iter().zip([(0.21, 0.5), (0.31, 0.2)]) {
        let bloch = Bloch::new(kx0, ky);
        // Gauss-Legendre nodes of order 5 in 20 stretches of the absorbing layer.
        let nodes: [(f64, f64); 3] =
            [(0.0, 8.0 / 9.0), (0.6f64.sqrt(), 5.0 / 9.0), (-(0.6f64.sqrt()), 5.0 / 9.0)];
        let part = 0.25 / 20.0;
        let mut z = vec![0.299_999, 0.550_001];
        let mut weights = Vec::new();
        for i in 0..20 {
            for (node, weight) in nodes {
                z.push(0.3 + part * (f64::from(i) + 0.5 + 0.5 * node));
                weights.push(weight * part / 2.0);
            }
        }
        let grid = Grid { x: one_period(48), z };
        let got = found(&stack, bloch, 9, Incident::unit(Side::Top, pol), grid);
        // Mean of ½ k0 Im ε |E|² over a period, per incident power.
        let incident = 0.5 * (1.41f64 * 1.41 - kx0 * kx0 - ky * ky).sqrt();
        let absorbed: f64 = got.samples[2 * 48..]
            .chunks(48)
            .zip(&weights)
            .map(|(row, w)| w * row.iter().map(Sample::intensity).sum::<f64>() / 48.0)
            .sum::<f64>()
            * 0.5
            * (TAU / WAVELENGTH)
            * (lossy * lossy).im
            / incident;
        assert!(absorbed > 0.02, "{absorbed}");
        assert_near("absorbed", absorbed, got.flux[0] - got.flux[1], 1e-9);
        assert_near("balance", 1.0 - got.reflected - got.transmitted, absorbed, 1e-9);
    }
}

#[test]
fn far_away_the_field_is_the_sum_of_the_orders() {
    let lossy = Complex64::new(1.8, 0.1);
    let stack = stack(vec![
        layer(0.21, &[(0.15, real(1.0)), (0.4, lossy), (1.0, real(1.3))]),
        layer(0.4, &[(0.05, real(1.0)), (0.6, real(1.41)), (1.0, lossy)]),
    ]);
    let (bloch, k0) = (Bloch::new(0.21, 0.5), TAU / WAVELENGTH);
    let depth = 0.61;
    let scattering = solve(&stack, bloch, 9);
    let amplitudes = [Complex64::new(0.6, 0.2), Complex64::new(-0.1, 0.7)];
    for from in SIDES {
        for order in scattering.orders(from).collect::<Vec<_>>() {
            let incident = Incident { side: from, order, amplitudes };
            // Evanescent orders have decayed: the slowest by exp(-2π·100·κ).
            let grid = Grid { x: vec![0.0, 0.37], z: vec![-60.0, depth + 60.0] };
            let got = found(&stack, bloch, 9, incident, grid);
            for (i, side) in SIDES.into_iter().enumerate() {
                let n = stack.index(side).re;
                for (j, &x) in got.grid.x.iter().enumerate() {
                    let mut expected = [Complex64::ZERO; 3];
                    let z = got.grid.z[i] - if side == Side::Top { 0.0 } else { depth };
                    let mut add = |kx: f64, kz: f64, [s, p]: [Complex64; 2]| {
                        let length = kx.hypot(bloch.ky);
                        let (cos, sin) = (kx / length, bloch.ky / length);
                        let phase = Complex64::cis(k0 * (kx * x + kz * z));
                        // s = z × k∥/|k∥|, p = s × k/|k|.
                        for (e, (along_s, along_p)) in expected.iter_mut().zip([
                            (-sin, cos * kz / n),
                            (cos, sin * kz / n),
                            (0.0, -length / n),
                        ]) {
                            *e += phase * (s * along_s + p * along_p);
                        }
                    };
                    let sign = if side == Side::Top { -1.0 } else { 1.0 };
                    for channel in scattering.channels(side) {
                        let jones = scattering.jones((from, order), (side, channel.order)).unwrap();
                        add(channel.kx, sign * channel.kz.re, jones.apply(amplitudes));
                    }
                    if side == from {
                        let channel = scattering.channel(side, order).unwrap();
                        add(channel.kx, -sign * channel.kz.re, amplitudes);
                    }
                    let got = got.samples[2 * i + j].electric;
                    for c in 0..3 {
                        let what = format!("{from:?} {order}, seen in {side:?}, {c}");
                        assert_near(&what, (got[c] - expected[c]).norm(), 0.0, 1e-9);
                    }
                }
            }
        }
    }
}

#[test]
fn a_structure_turned_over_has_the_same_field() {
    // Light from below against light from above on the structure upside down.
    let layers = vec![
        layer(0.2, &[(0.2, real(1.0)), (0.5, real(1.8)), (1.0, real(1.41))]),
        ridge(0.3, 0.6, 0.2, Complex64::new(1.5, 0.1), real(1.0)),
    ];
    let vertical = stack(layers.clone());
    let turned =
        Stack::new(WAVELENGTH, PERIOD, real(1.0), real(1.41), layers.into_iter().rev().collect())
            .unwrap();
    let bloch = Bloch::new(0.2, 0.3);
    let z = vec![-0.2, 0.1, 0.35, 0.6];
    let x = one_period(5);
    let a = found(
        &vertical,
        bloch,
        8,
        Incident::unit(Side::Bottom, Pol::P),
        Grid { x: x.clone(), z: z.clone() },
    );
    let mirrored = z.iter().map(|z| 0.5 - z).collect();
    let b = found(&turned, bloch, 8, Incident::unit(Side::Top, Pol::P), Grid { x, z: mirrored });
    for (a, b) in a.samples.iter().zip(&b.samples) {
        assert_near("|E|²", a.intensity(), b.intensity(), 1e-12);
        let (s, t) = (a.poynting(), b.poynting());
        for (s, t) in [(s[0], t[0]), (s[1], t[1]), (s[2], -t[2])] {
            assert_near("Poynting", s, t, 1e-12);
        }
    }
    for (a, b) in a.flux.iter().zip(&b.flux) {
        assert_near("flux", *a, *b, 1e-12);
    }
}

#[test]
fn cut_offs_and_many_evanescent_orders_are_survived() {
    // kx of order 1 in air is exactly 1, and 61 orders cross three periods of a uniform gap.
    let stack = stack(vec![
        ridge(0.2, 0.5, 0.25, real(1.41), real(1.0)),
        uniform(2.7, 1.0),
        ridge(0.2, 0.5, 0.25, real(2.0), real(1.0)),
    ]);
    let kx0 = 1.0 - WAVELENGTH / PERIOD;
    for pol in Pol::BOTH {
        let grid = Grid { x: vec![0.0, 0.4], z: depths(&stack, -1.0, 1.0, 31) };
        let got = found(&stack, Bloch::new(kx0, 0.0), 30, Incident::unit(Side::Top, pol), grid);
        for flux in &got.flux {
            assert_near("flux", *flux, 1.0 - got.reflected, 1e-10);
        }
        assert!(got.samples.iter().all(|s| s.intensity() < 100.0));
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let stack = stack(vec![ridge(0.2, 0.5, 0.25, real(1.41), real(1.0))]);
    let run = |bloch: Bloch, incident: Incident, x: f64| {
        let grid = Grid { x: vec![x], z: vec![0.0] };
        field(&stack, bloch, Truncation::new(4).unwrap(), &incident, grid, &no_progress)
    };
    let (good, s) = (Bloch::new(0.2, 0.1), Incident::unit(Side::Top, Pol::S));
    assert!(run(good, s, 0.0).is_ok());
    assert!(matches!(run(Bloch::new(f64::NAN, 0.0), s, 0.0), Err(Error::Bloch { .. })));
    assert!(matches!(run(good, s, f64::INFINITY), Err(Error::Position { .. })));
    let dark = Incident { amplitudes: [Complex64::ZERO; 2], ..s };
    assert!(matches!(run(good, dark, 0.0), Err(Error::Amplitudes { .. })));
    for side in SIDES {
        let far = Incident { side, order: 4, ..s };
        assert!(
            matches!(run(good, far, 0.0), Err(Error::Evanescent { order: 4, side: found }) if found == side)
        );
    }
    let stop = |_: usize| ControlFlow::Break(());
    let grid = Grid { x: vec![0.0], z: vec![0.0] };
    let stopped = field(&stack, good, Truncation::new(4).unwrap(), &s, grid, &stop);
    assert!(matches!(stopped, Err(Error::Stopped)));
}
