// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jones matrices of tables: closed forms, laws, samples against interpolated matrices, files.

use super::*;
use crate::bsdf::{LobeKind, Polarisation, s_axis};
use crate::direction::spherical;
use crate::native;
use crate::order_table::tests::memory;
use crate::tests::chi_square::sidak_level;
use crate::{EfficiencyRow, Grid, OrderEfficiency, TableHeader};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

fn grid(kx_per_zone: usize, ky: usize) -> Grid {
    Grid {
        period: 1.3,
        wavelength: 0.55,
        index_inner: 1.41,
        index_outer: 1.0,
        kx_per_zone,
        ky: Grid::ky_nodes(1.41, 1.0, ky),
    }
}

/// A table of the shares and matrices of these rows.
fn table(grid: Grid, rows: Vec<JonesRow>) -> Result<OrderTable, Error> {
    let efficiency = |m: &Jones, column: usize| m[0][column].norm_sqr() + m[1][column].norm_sqr();
    let efficiencies = rows.iter().flat_map(|row| {
        [Polarisation::S, Polarisation::P].map(|polarisation| EfficiencyRow {
            node: row.node,
            polarisation,
            orders: row
                .orders
                .iter()
                .map(|o| {
                    OrderEfficiency::new(o.to, o.order, efficiency(&o.jones, polarisation as usize))
                })
                .collect(),
        })
    });
    let plain = OrderTable::build(TableHeader::default(), grid, efficiencies.collect::<Vec<_>>())?;
    plain.with_jones(rows)
}

/// Response of every node of a grid, from a function of its wavevector.
fn rows(grid: &Grid, mut of: impl FnMut(NodeId, &[(Side, i32)]) -> Vec<Jones>) -> Vec<JonesRow> {
    grid.nodes()
        .map(|id| {
            let k = Wavevector { kx: grid.kx(id.kx_index), ky: grid.ky[id.ky_index] };
            let leaving = |to: Side, order: i32| {
                let kx = k.kx + f64::from(order) * grid.zone();
                Wavevector { kx, ..k }.propagates(grid.index(to))
            };
            let orders: Vec<(Side, i32)> = Side::BOTH
                .into_iter()
                .flat_map(|to| (-40..=40).map(move |order| (to, order)))
                .filter(|&(to, order)| leaving(to, order))
                .collect();
            let matrices = of(id, &orders);
            JonesRow {
                node: id,
                orders: orders
                    .iter()
                    .zip(matrices)
                    .map(|(&(to, order), jones)| OrderJones { to, order, jones })
                    .collect(),
            }
        })
        .collect()
}

/// Any lossless surface: s and p go to two orthonormal vectors over all orders.
fn any(grid: &Grid, seed: u64) -> Vec<JonesRow> {
    let mut rng = Pcg64::seed_from_u64(seed);
    rows(grid, |_, orders| {
        let mut draw = || {
            let size = 2 * orders.len();
            let each = (0..size)
                .map(|_| Complex64::from_polar(rng.random::<f64>(), TAU * rng.random::<f64>()));
            each.collect::<Vec<_>>()
        };
        let unit = |v: &mut Vec<Complex64>| {
            let length = v.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
            for z in v.iter_mut() {
                *z /= length;
            }
        };
        let (mut s, mut p) = (draw(), draw());
        unit(&mut s);
        let along: Complex64 = s.iter().zip(&p).map(|(s, p)| s.conj() * p).sum();
        p.iter_mut().zip(&s).for_each(|(p, s)| *p -= along * s);
        unit(&mut p);
        s.chunks(2).zip(p.chunks(2)).map(|(s, p)| [[s[0], p[0]], [s[1], p[1]]]).collect()
    })
}

/// A smooth interface by Fresnel's formulas.
fn smooth(grid: &Grid) -> Vec<JonesRow> {
    rows(grid, |id, orders| {
        let (kx, ky) = (grid.kx(id.kx_index), grid.ky[id.ky_index]);
        orders
            .iter()
            .map(|&(to, order)| {
                let k2 = kx * kx + ky * ky;
                let own = fresnel(grid.index(id.side), grid.index(id.side.opposite()), k2);
                match (order, to == id.side) {
                    (0, true) => own[0],
                    (0, false) => own[1],
                    _ => [[Complex64::ZERO; 2]; 2],
                }
            })
            .collect()
    })
}

/// Reflection and transmission by unit power at a squared tangential wavevector.
fn fresnel(n1: f64, n2: f64, k2: f64) -> [Jones; 2] {
    let kz = |n: f64| Complex64::from(n * n - k2).sqrt();
    let (a, b) = (kz(n1), kz(n2));
    let (e1, e2) = (n1 * n1, n2 * n2);
    let reflected = [(a - b) / (a + b), (e2 * a - e1 * b) / (e2 * a + e1 * b)];
    let flux = (b.re / a.re).sqrt();
    let transmitted = [2.0 * a / (a + b) * flux, 2.0 * n1 * n2 * a / (e2 * a + e1 * b) * flux];
    let diagonal = |[s, p]: [Complex64; 2]| [[s, Complex64::ZERO], [Complex64::ZERO, p]];
    [diagonal(reflected), diagonal(transmitted)]
}

fn apply(matrix: &Mueller, light: [f64; 4]) -> [f64; 4] {
    matrix.map(|row| row.iter().zip(light).map(|(m, l)| m * l).sum())
}

fn polarised(rng: &mut impl Rng, degree: f64) -> [f64; 3] {
    let v = loop {
        let v: [f64; 3] = std::array::from_fn(|_| 2.0 * rng.random::<f64>() - 1.0);
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.1 && length < 1.0 {
            break v.map(|x| x / length);
        }
    };
    v.map(|x| x * degree)
}

/// Smallest eigenvalue of the covariance matrix ½ Σ M_ij σ_i ⊗ σ_j*, by the smallest value that the
/// quadratic form takes on unit vectors while it falls.
fn smallest_covariance(m: &Mueller) -> f64 {
    let i = Complex64::I;
    let (one, zero) = (Complex64::ONE, Complex64::ZERO);
    // The matrices by which I, Q, U, V are made of the coherency matrix: tr(σ C); V = -2 Im C_sp =
    // i (C_sp - C_ps).
    let sigma = [
        [[one, zero], [zero, one]],
        [[one, zero], [zero, -one]],
        [[zero, one], [one, zero]],
        [[zero, -i], [i, zero]],
    ];
    let mut covariance = [[zero; 4]; 4];
    for (row, a) in m.iter().zip(&sigma) {
        for (value, b) in row.iter().zip(&sigma) {
            for (r, out) in covariance.iter_mut().enumerate() {
                for (c, out) in out.iter_mut().enumerate() {
                    *out += 0.25 * value * a[r / 2][c / 2] * b[r % 2][c % 2].conj();
                }
            }
        }
    }
    // Power iteration on trace - covariance, whose largest eigenvalue belongs to the smallest of
    // the covariance.
    let trace: f64 = (0..4).map(|k| covariance[k][k].re).sum();
    let mut v = [one, i * 0.7, -one * 0.3, Complex64::new(0.2, 0.9)];
    let mut value = 0.0;
    for _ in 0..300 {
        let w: [Complex64; 4] = std::array::from_fn(|r| {
            trace * v[r] - (0..4).map(|c| covariance[r][c] * v[c]).sum::<Complex64>()
        });
        let length = w.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
        if length == 0.0 {
            return trace;
        }
        value = length;
        v = w.map(|z| z / length);
    }
    trace - value
}

#[test]
fn a_matrix_does_to_stokes_parameters_what_it_does_to_fields() {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut complex =
        || Complex64::new(2.0 * rng.random::<f64>() - 1.0, 2.0 * rng.random::<f64>() - 1.0);
    for _ in 0..200 {
        let jones: Jones = std::array::from_fn(|_| std::array::from_fn(|_| complex()));
        let field = [complex(), complex()];
        let stokes = |[s, p]: [Complex64; 2]| {
            let c = s * p.conj();
            let (s, p) = (s.norm_sqr(), p.norm_sqr());
            [s + p, s - p, 2.0 * c.re, -2.0 * c.im]
        };
        let out = jones.map(|row| row[0] * field[0] + row[1] * field[1]);
        let by_matrix = apply(&mueller(&jones), stokes(field));
        for (a, b) in by_matrix.into_iter().zip(stokes(out)) {
            assert!((a - b).abs() < 1e-13, "{by_matrix:?}");
        }
        assert!(smallest_covariance(&mueller(&jones)).abs() < 1e-12);
    }
    // V does not come back with its sign from a mirror that leaves no other trace: no Mueller
    // matrix of a passive surface.
    let wrong =
        [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, -1.0]];
    assert!(smallest_covariance(&wrong) < -0.4);
}

#[test]
fn turning_s_about_the_normal_keeps_the_field() {
    let mut rng = Pcg64::seed_from_u64(5);
    for outwards in [true, false] {
        let z = if outwards { 1.0 } else { -1.0 };
        for _ in 0..50 {
            // A field along the normal, in the s and p of two azimuths.
            let field = [0, 1].map(|_| Complex64::new(rng.random(), rng.random::<f64>() - 0.5));
            let k = |phi: f64| Wavevector { kx: 0.2 * phi.cos(), ky: 0.2 * phi.sin() };
            let [a, b] = [0, 1].map(|_| k(TAU * rng.random::<f64>()));
            let light = |k: Wavevector| {
                let [c, s] = azimuth(k);
                // s = z × k∥/|k∥|, p = s × k/|k|.
                let along_s = -s * field[0] + c * field[1];
                let along_p = z * (c * field[0] + s * field[1]);
                let (i, j) = (along_s.norm_sqr(), along_p.norm_sqr());
                let w = along_s * along_p.conj();
                [i + j, i - j, 2.0 * w.re, -2.0 * w.im]
            };
            for (got, expected) in turned(light(a), a, b, outwards).into_iter().zip(light(b)) {
                assert!((got - expected).abs() < 1e-13);
            }
        }
    }
}

#[test]
fn a_smooth_interface_has_the_matrices_of_fresnel_at_nodes_and_nearly_between() {
    let grid = grid(4, 40);
    let table = table(grid.clone(), smooth(&grid)).unwrap();
    for JonesRow { node: id, orders } in table.jones_rows().unwrap() {
        let k2 = grid.kx(id.kx_index).powi(2) + grid.ky[id.ky_index].powi(2);
        let expected = fresnel(grid.index(id.side), grid.index(id.side.opposite()), k2);
        for OrderJones { to, jones: got, .. } in orders.into_iter().filter(|o| o.order == 0) {
            let expected = expected[usize::from(to != id.side)];
            for (a, b) in got.as_flattened().iter().zip(expected.as_flattened()) {
                assert!((a - b).norm() < 1e-6, "{id:?} {got:?} {expected:?}");
            }
        }
    }
    let mut rng = Pcg64::seed_from_u64(7);
    for side in Side::BOTH {
        let n = grid.index(side);
        for _ in 0..400 {
            let wi = spherical(0.6 * rng.random::<f64>(), TAU * rng.random::<f64>());
            let wi = if side == Side::Outer { wi } else { -wi };
            let k = Wavevector::incoming(wi, n);
            let k2 = k.kx * k.kx + k.ky * k.ky;
            let expected = fresnel(n, grid.index(side.opposite()), k2);
            for OrderMueller { to, order, mueller: got } in table.mueller(side, k).unwrap() {
                let expected = match (order, to == side) {
                    (0, true) => mueller(&expected[0]),
                    (0, false) => mueller(&expected[1]),
                    _ => [[0.0; 4]; 4],
                };
                let off = got
                    .as_flattened()
                    .iter()
                    .zip(expected.as_flattened())
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                assert!(off < 0.015, "{k:?} {to} {order}: {off} {got:?} {expected:?}");
            }
        }
    }
}

#[test]
fn interpolated_matrices_are_physical_and_keep_the_power_and_the_shares() {
    for (kx_per_zone, seed) in [(1, 1), (2, 2), (3, 3)] {
        let grid = grid(kx_per_zone, 7);
        let table = table(grid.clone(), any(&grid, seed)).unwrap();
        let mut rng = Pcg64::seed_from_u64(11 + seed);
        for _ in 0..120 {
            let wi =
                spherical(std::f64::consts::PI * rng.random::<f64>(), TAU * rng.random::<f64>());
            let side = Side::from_direction(wi);
            let k = Wavevector::incoming(wi, grid.index(side));
            let matrices = table.mueller(side, k).unwrap();
            let mut sum = [0.0; 4];
            for OrderMueller { mueller: m, .. } in &matrices {
                // Each matrix takes light to light; those of orders that took over what others lost
                // are no pure ones.
                assert!(smallest_covariance(m) > -1e-6, "{m:?}");
                sum.iter_mut().zip(m[0]).for_each(|(sum, m)| *sum += m);
            }
            for (sum, expected) in sum.into_iter().zip([1.0, 0.0, 0.0, 0.0]) {
                assert!((sum - expected).abs() < 1e-5, "{sum}");
            }
            let orders = table.efficiencies(side, k, Polarisation::Unpolarised);
            for (o, m) in orders.into_iter().zip(&matrices) {
                assert_eq!((o.to, o.order), (m.to, m.order));
                let (efficiency, mean) = (o.efficiency, m.mueller[0][0]);
                assert!((efficiency - mean).abs() < 1e-5, "{efficiency} {mean}");
            }
        }
    }
}

#[test]
fn the_mirror_y_changes_the_signs_of_u_and_v() {
    let grid = grid(2, 6);
    let table = table(grid.clone(), any(&grid, 4)).unwrap();
    let k = Wavevector { kx: 0.31, ky: 0.22 };
    let other = Wavevector { ky: -k.ky, ..k };
    let (a, b) = (table.mueller(Side::Inner, k), table.mueller(Side::Inner, other));
    for (a, b) in a.unwrap().into_iter().zip(b.unwrap()) {
        for (row, (a, b)) in a.mueller.into_iter().zip(b.mueller).enumerate() {
            for (column, (a, b)) in a.into_iter().zip(b).enumerate() {
                let sign = if (row < 2) == (column < 2) { 1.0 } else { -1.0 };
                assert!((a - sign * b).abs() < 1e-12);
            }
        }
    }
}

/// Draws by order and the sums of the light that they leave, against lists; light of any
/// polarisation and of none.
#[test]
fn draws_follow_the_interpolated_matrices() {
    let grid = grid(2, 6);
    let table = table(grid.clone(), any(&grid, 9)).unwrap();
    let mut rng = Pcg64::seed_from_u64(13);
    let level = sidak_level(6);
    for (number, degree) in [0.0, 1.0, 1.0, 0.6, 1.0, 1.0].into_iter().enumerate() {
        let wi = spherical(0.35 + 0.45 * number as f64, 1.1 * number as f64 + 0.2);
        let side = Side::from_direction(wi);
        let light = polarised(&mut rng, degree);
        let stokes = [1.0, light[0], light[1], light[2]];
        let k = Wavevector::incoming(wi, grid.index(side));
        let expected: Vec<(Side, i32, [f64; 4])> = table
            .mueller(side, k)
            .unwrap()
            .iter()
            .map(|m| (m.to, m.order, apply(&m.mueller, stokes)))
            .collect();
        let draws = 200_000;
        let mut counts = vec![0.0; expected.len()];
        let mut sums = vec![[0.0; 3]; expected.len()];
        for _ in 0..draws {
            let (sample, left) = table.sample_polarised(wi, light, &mut rng).unwrap();
            assert!((sample.weight - 1.0).abs() < 1e-15);
            assert!(left.iter().map(|x| x * x).sum::<f64>() < 1.0 + 1e-9);
            let LobeKind::Order(drawn) = sample.lobe.kind else {
                panic!("{sample:?}");
            };
            let to = Side::from_direction(sample.wo);
            let place = expected.iter().position(|e| (e.0, e.1) == (to, drawn)).unwrap();
            counts[place] += 1.0;
            sums[place].iter_mut().zip(left).for_each(|(s, l)| *s += l);
        }
        let n = f64::from(draws);
        let (mut chi2, mut cells) = (0.0, 0.0);
        for (((_, _, e), count), sums) in expected.iter().zip(&counts).zip(&sums) {
            assert!(e[0] > -1e-6);
            if n * e[0] < 5.0 {
                continue;
            }
            chi2 += (count - n * e[0]).powi(2) / (n * e[0]);
            cells += 1.0;
            // Each reading of Q, U, V lies between -1 and 1.
            let error = (n * e[0]).sqrt();
            for (sum, e) in sums.iter().zip(&e[1..]) {
                assert!((sum - n * e).abs() < 4.8 * error, "{sum} {} {error}", n * e);
            }
        }
        let dof: f64 = cells - 1.0;
        let z = ((chi2 / dof).cbrt() - (1.0 - 2.0 / (9.0 * dof))) / (2.0 / (9.0 * dof)).sqrt();
        // One-sided normal deviate of the level, 1.7e-3.
        assert!(level < 2e-3 && z < 2.93, "{number}: {z}");
    }
}

#[test]
fn unpolarised_light_is_drawn_as_without_matrices() {
    let grid = grid(2, 6);
    let with = table(grid.clone(), any(&grid, 21)).unwrap();
    assert!(
        with.as_polarised().is_some()
            && with.clone().for_polarisation(Polarisation::S).unwrap().as_polarised().is_none()
    );
    let mut streams = [Pcg64::seed_from_u64(17), Pcg64::seed_from_u64(17)];
    let mut directions = Pcg64::seed_from_u64(19);
    for _ in 0..5000 {
        let wi = spherical(
            std::f64::consts::PI * directions.random::<f64>(),
            TAU * directions.random::<f64>(),
        );
        let plain = with.sample(wi, &mut streams[0]);
        let carried = with.sample_polarised(wi, [0.0; 3], &mut streams[1]);
        assert_eq!(plain, carried.map(|c| c.0));
    }
}

#[test]
fn axes_of_s_are_level() {
    assert_eq!(s_axis(DVec3::Z), DVec3::Y);
    let d = spherical(0.8, 1.9);
    assert!(s_axis(d).z.abs() < 1e-15 && s_axis(d).dot(d).abs() < 1e-15);
}

#[test]
fn files_keep_every_bit_of_the_matrices_and_refuse_others() {
    let grid = grid(2, 5);
    let with = table(grid.clone(), any(&grid, 31)).unwrap();
    let mut bytes = Vec::new();
    native::write(&with, &mut bytes).unwrap();
    assert_eq!(bytes[8..12], 3u32.to_le_bytes());
    let back = native::read(bytes.as_slice()).unwrap();
    assert_eq!(back.packed_jones(), with.packed_jones());
    let rows: Vec<JonesRow> = back.jones_rows().unwrap().collect();
    let again = with.clone().with_jones(rows).unwrap();
    assert_eq!(again.packed_jones(), with.packed_jones());
    let plain = with.for_polarisation(Polarisation::Unpolarised).unwrap();
    assert_eq!(memory(&with) - 32 * with.entry_count(), memory(&plain));

    // Another version number over the same content: what is there decides.
    let mut old = bytes.clone();
    old[8] = 2;
    let end = old.len() - 32;
    let checksum = <sha2::Sha256 as sha2::Digest>::digest(&old[..end]);
    old[end..].copy_from_slice(&checksum);
    let error = native::read(old.as_slice()).unwrap_err().to_string();
    assert!(error.contains("version"), "{error}");

    // A matrix that does not give the shares.
    let mut altered = with.packed_jones().unwrap().to_vec();
    altered[7] = [0.5; 8];
    let error = with.clone().with_packed_jones(altered).unwrap_err();
    assert!(error.to_string().contains("the efficiencies of the table"), "{error}");
    // One that does, for s and p, but loses light at 45°: the columns of the first order are no
    // more what they were to each other.
    let mut turned = with.packed_jones().unwrap().to_vec();
    let [_, _, re, im, _, _, re2, im2] = &mut turned[0];
    for x in [re, im, re2, im2] {
        *x = -*x;
    }
    let error = with.clone().with_packed_jones(turned).unwrap_err();
    assert!(error.to_string().contains("any polarisation"), "{error}");
    let missing = any(&grid, 31).into_iter().skip(1);
    let error = with.with_jones(missing).unwrap_err();
    assert!(error.to_string().contains("expected one row a node, got none"), "{error}");
}
