// SPDX-License-Identifier: MIT OR Apache-2.0
//! Order tables against closed forms, between their nodes, and samples against efficiencies.

use super::*;
use crate::analytic::fresnel;
use crate::direction::{Wavevector, spherical};
use crate::{Bsdf, SmoothInterface, Transport, validate};
use approx::assert_abs_diff_eq;
use glam::DVec3;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::f64::consts::PI;

mod refusals;
mod sampling;

const N: f64 = 1.41;

fn grid(kx_per_zone: usize, ky_count: usize) -> Grid {
    Grid {
        period: 4.4,
        wavelength: 0.55,
        index_inner: N,
        index_outer: 1.0,
        kx_per_zone,
        ky: Grid::ky_nodes(N, 1.0, ky_count),
    }
}

/// All power in order 0, by Fresnel.
fn smooth(side: Side, kx: f64, ky: f64, polarisation: Polarisation) -> Vec<OrderEfficiency> {
    let (n1, n2) = if side == Side::Inner { (N, 1.0) } else { (1.0, N) };
    let cos = (1.0 - (kx * kx + ky * ky) / (n1 * n1)).max(0.0).sqrt();
    let r = fresnel(n1, n2, cos).for_polarisation(polarisation);
    let mut orders = vec![OrderEfficiency::new(side, 0, r)];
    if r < 1.0 {
        orders.push(OrderEfficiency::new(side.opposite(), 0, 1.0 - r));
    }
    orders
}

/// A blazed phase grating with `loss`: sinc² about a blaze order that drifts with kx, on both
/// sides, whatever propagates made to sum to 1 - loss.
fn blazed(loss: f64) -> impl Fn(Side, f64, f64, Polarisation) -> Vec<OrderEfficiency> {
    move |side, kx, ky, polarisation| {
        let blaze = 1.3 + 0.8 * kx + 0.3 * ky * ky;
        let through = if polarisation == Polarisation::S { 0.7 } else { 0.8 };
        let mut orders = Vec::new();
        for (to, n) in [(Side::Inner, N), (Side::Outer, 1.0)] {
            let weight = if to == side { 1.0 - through } else { through };
            for l in -60_i32..=60 {
                let out = kx + f64::from(l) * 0.125;
                if out * out + ky * ky < n * n {
                    let x = PI * (f64::from(l) - blaze);
                    let sinc = if x.abs() < 1e-9 { 1.0 } else { x.sin() / x };
                    orders.push(OrderEfficiency::new(to, l, weight * sinc * sinc));
                }
            }
        }
        let sum: f64 = orders.iter().map(|o| o.efficiency).sum();
        for order in &mut orders {
            order.efficiency *= (1.0 - loss) / sum;
        }
        orders
    }
}

fn table(
    grid: &Grid,
    orders: impl FnMut(Side, f64, f64, Polarisation) -> Vec<OrderEfficiency>,
) -> OrderTable {
    OrderTable::build(TableHeader::default(), grid.clone(), grid.rows(orders)).unwrap()
}

/// Memory of the arrays of a table.
pub(super) fn memory(table: &OrderTable) -> usize {
    let (layout, alias) = (&table.layout, &table.alias_table);
    let of_sides = |sides: [usize; 2], size: usize| size * (sides[0] + sides[1]);
    size_of_val(&layout.nodes[..])
        + of_sides(layout.rows.each_ref().map(Vec::len), size_of_val(&layout.rows[0][0]))
        + 4 * (table.s.len() + table.p.len() + table.cumulative.len())
        + 4 * (alias.bins.len() + alias.ky_lookup.len())
        + of_sides(alias.bloch_nodes.each_ref().map(Vec::len), 64)
        + of_sides(alias.ky_intervals.each_ref().map(Vec::len), 64)
        + table.jones.as_ref().map_or(0, |jones| 32 * jones.len())
}

#[test]
fn nodes_are_those_that_propagate_and_orders_are_those_of_the_grating_equation() {
    for per_zone in [1, 2, 3, 4] {
        let grid = grid(per_zone, 7);
        let layout = Layout::new(&grid);
        for side in Side::BOTH {
            for (j, ky) in grid.ky.iter().enumerate() {
                for i in -60 * per_zone as i64..60 * per_zone as i64 {
                    let id = NodeId { side, kx_index: i, ky_index: j };
                    let kx = grid.kx(i);
                    let exists = kx * kx + ky * ky < grid.index(side).powi(2);
                    assert_eq!(grid.kx_indices(side, j).contains(&i), exists);
                    assert_eq!(layout.find(id).is_some(), exists);
                    let Some(index) = layout.find(id) else {
                        continue;
                    };
                    for to in Side::BOTH {
                        for l in -100..100 {
                            let out = kx + f64::from(l) * grid.zone();
                            let propagates = out * out + ky * ky < grid.index(to).powi(2);
                            assert_eq!(
                                layout.nodes[index].entry(to, l).is_some(),
                                propagates,
                                "{id:?} {to} {l}"
                            );
                        }
                    }
                }
            }
        }
        assert_eq!(grid.node_count(), grid.nodes().count());
        assert_eq!(layout.nodes.iter().map(|n| n.all().len()).sum::<usize>(), layout.entries);
    }
}

#[test]
fn ky_nodes_keep_off_the_critical_value() {
    for count in [2, 5, 24] {
        let ky = Grid::ky_nodes(N, 1.0, count);
        assert_eq!(ky.len(), count);
        assert!(
            ky[0] == 0.0
                && ky.is_sorted_by(|a, b| a < b)
                && ky[count - 1] < N
                && !ky.contains(&1.0)
        );
        assert!(grid(2, count).validate().is_ok());
    }
}

#[test]
fn a_table_for_one_polarisation_draws_by_its_shares() {
    let both = table(&grid(4, 12), smooth);
    let wi = spherical(2.4, 0.7);
    let of = |t: &OrderTable, p| t.albedo(wi, p).reflected;
    assert!((of(&both, Polarisation::S) - of(&both, Polarisation::P)).abs() > 0.05);
    for polarisation in [Polarisation::S, Polarisation::P, Polarisation::Unpolarised] {
        let one = both.for_polarisation(polarisation).expect("a table");
        for p in [Polarisation::S, Polarisation::P, Polarisation::Unpolarised] {
            assert_abs_diff_eq!(of(&one, p), of(&both, polarisation), epsilon = 1e-6);
        }
    }
    let (s, mut rng) =
        (both.for_polarisation(Polarisation::S).expect("a table"), Pcg64::seed_from_u64(8));
    let draws = 40_000;
    let reflected = (0..draws)
        .filter(|_| {
            s.sample(wi, &mut rng).is_some_and(|d| d.lobe.transport == Transport::Reflection)
        })
        .count() as f64
        / f64::from(draws);
    let expected = of(&both, Polarisation::S);
    let error = (expected * (1.0 - expected) / f64::from(draws)).sqrt();
    assert!((reflected - expected).abs() < 5.0 * error, "{reflected} {expected} {error}");
}

#[test]
fn table_of_a_smooth_interface_is_fresnel() {
    let grid = grid(8, 24);
    let table = table(&grid, smooth);
    assert!(validate::energy(&table).deviation.worst < 1e-7);
    let mut rng = Pcg64::seed_from_u64(21);
    for side in Side::BOTH {
        let direct = |side, k: Wavevector, p| Ok::<_, Error>(smooth(side, k.kx, k.ky, p));
        let report = validate::interpolation(&table, side, 4000, &mut rng, direct).unwrap();
        // Fresnel rises as a root at the critical angle and at the rim: large errors there, but in
        // few directions.
        for deviation in [report.reflected, report.transmitted] {
            assert!(deviation.rms < 0.05, "{side}: {deviation:?}");
            assert!(deviation.mean.abs() < 4e-3, "{side}: {deviation:?}");
        }
        assert_abs_diff_eq!(report.reflected.mean, -report.transmitted.mean, epsilon = 1e-9);
        // Away from both the error is that of linear interpolation, h² R''/8.
        for _ in 0..2000 {
            let k = validate::random_incidence(&table, side, &mut rng);
            if k.kx.hypot(k.ky) < 0.8 {
                for polarisation in [Polarisation::S, Polarisation::P, Polarisation::Unpolarised] {
                    let expected = smooth(side, k.kx, k.ky, polarisation)[0].efficiency;
                    let got: f64 = table
                        .efficiencies(side, k, polarisation)
                        .iter()
                        .filter(|o| o.to == side)
                        .map(|o| o.efficiency)
                        .sum();
                    assert_abs_diff_eq!(got, expected, epsilon = 2e-3);
                }
            }
        }
    }
}

/// A flat surface by Fresnel's formula: from air all light comes back at 90 degrees, at any azimuth;
/// the last nodes of this grid lie 6 to 20 degrees before it.
#[test]
fn reflectance_goes_to_one_at_grazing_incidence() {
    let table = table(&grid(2, 12), smooth);
    let mut rng = Pcg64::seed_from_u64(23);
    for azimuth in [0.0, 0.4, 1.2, 0.5 * PI, 2.5, 4.0] {
        let mut before = 0.0;
        for (degrees, allowed) in
            [(80.0, 0.1), (85.0, 0.03), (88.0, 0.02), (89.0, 0.02), (89.9, 0.003)]
        {
            let theta = f64::to_radians(degrees);
            let wi = spherical(theta, azimuth);
            let expected = fresnel(1.0, N, theta.cos()).for_polarisation(Polarisation::Unpolarised);
            let albedo = table.albedo(wi, Polarisation::Unpolarised);
            assert_abs_diff_eq!(albedo.reflected, expected, epsilon = allowed);
            assert_abs_diff_eq!(albedo.reflected + albedo.transmitted, 1.0, epsilon = 1e-6);
            assert!(albedo.reflected > before, "{degrees} degrees");
            before = albedo.reflected;
            let draws = 4000;
            let back =
                (0..draws).filter(|_| table.sample(wi, &mut rng).unwrap().wo.z > 0.0).count();
            let drawn = back as f64 / f64::from(draws);
            let error = (before * (1.0 - before) / f64::from(draws)).sqrt();
            assert_abs_diff_eq!(drawn, before, epsilon = 5.0 * error + 1e-9);
        }
        // From the silicone, where nothing leaves at such angles.
        let wi = spherical(PI - f64::to_radians(89.5), azimuth);
        assert_abs_diff_eq!(
            table.albedo(wi, Polarisation::Unpolarised).reflected,
            1.0,
            epsilon = 1e-6
        );
    }
}

#[test]
fn more_ky_nodes_make_the_critical_circle_sharper() {
    let direct = |side, k: Wavevector, p| Ok::<_, Error>(smooth(side, k.kx, k.ky, p));
    let [coarse, fine] = [24, 96].map(|count| {
        let mut rng = Pcg64::seed_from_u64(28);
        let table = table(&grid(8, count), smooth);
        validate::interpolation(&table, Side::Inner, 8000, &mut rng, direct).unwrap().reflected
    });
    assert!(
        fine.rms < 0.5 * coarse.rms && fine.mean.abs() < 0.5 * coarse.mean.abs(),
        "{coarse:?}, {fine:?}"
    );
}

#[test]
fn interpolation_error_shrinks_with_the_square_of_the_spacing() {
    let mut rng = Pcg64::seed_from_u64(22);
    let mut rms = [2, 4].map(|refine| {
        let mut grid = grid(2 * refine, 2);
        grid.ky = (0..6 * refine).map(|j| 0.9 * j as f64 / (6 * refine - 1) as f64).collect();
        let table = table(&grid, |side, kx, ky, _| {
            vec![OrderEfficiency::new(side, 0, 0.5 + 0.3 * (2.0 * kx + ky).cos() * ky * ky.cos())]
        });
        let errors = (0..4000).filter_map(|_| {
            let k = validate::random_incidence(&table, Side::Inner, &mut rng);
            let (kx, ky) = (k.kx, k.ky.abs());
            (kx.hypot(ky) < 0.85).then(|| {
                let efficiency = table
                    .efficiencies(Side::Inner, k, Polarisation::S)
                    .iter()
                    .map(|o| o.efficiency)
                    .sum::<f64>();
                efficiency - (0.5 + 0.3 * (2.0 * kx + ky).cos() * ky * ky.cos())
            })
        });
        validate::Deviation::new(errors).rms
    });
    rms[1] *= 4.0;
    assert!((rms[0] / rms[1] - 1.0).abs() < 0.25, "{rms:?}");
}

#[test]
fn order_zero_alone_gives_mirror_and_snell_directions() {
    let table = table(&grid(4, 12), smooth);
    let interface = SmoothInterface::new(N, 1.0).unwrap();
    for wi in [spherical(PI - 0.3, 0.8), spherical(0.9, 4.0), spherical(PI - 1.3, 2.0)] {
        let lobes: Vec<_> =
            table.lobes(wi, Polarisation::P).into_iter().filter(|l| l.power > 0.0).collect();
        let expected = interface.lobes(wi, Polarisation::P);
        assert_eq!(lobes.len(), expected.len());
        for (a, transport) in lobes.iter().map(|l| (l, l.lobe.transport)) {
            let b = expected.iter().find(|b| b.lobe.transport == transport).unwrap();
            assert!((a.wo - b.wo).length() < 1e-14);
        }
    }
}

#[test]
fn orders_stay_orders_between_nodes() {
    // One order only, at nodes far apart: between them there is still one direction, that of the
    // grating equation.
    let single = |_: Side, kx: f64, ky: f64, _: Polarisation| {
        let out = kx - 2.0 * 0.125;
        if out * out + ky * ky < 1.0 {
            vec![OrderEfficiency::new(Side::Outer, -2, 1.0)]
        } else {
            vec![OrderEfficiency::new(Side::Inner, -2, 1.0)]
        }
    };
    let grid = grid(1, 4);
    let rows = grid.rows(single).map(|mut row| {
        // Where not even that propagates, the mirror reflection takes all.
        let (kx, ky) = (grid.kx(row.node.kx_index), grid.ky[row.node.ky_index]);
        let out = kx - 0.25;
        if out * out + ky * ky >= N * N {
            row.orders = vec![OrderEfficiency::new(row.node.side, 0, 1.0)];
        }
        row
    });
    let table = OrderTable::build(TableHeader::default(), grid.clone(), rows).unwrap();
    let wi = spherical(PI - 0.31, 0.4);
    let lobes: Vec<_> =
        table.lobes(wi, Polarisation::S).into_iter().filter(|l| l.power > 0.0).collect();
    assert_eq!(lobes.len(), 1);
    assert_abs_diff_eq!(lobes[0].power, 1.0, epsilon = 1e-12);
    let expected = DVec3::new(-N * wi.x - 0.25, -N * wi.y, 0.0);
    assert_abs_diff_eq!(lobes[0].wo.x, expected.x, epsilon = 1e-15);
    assert_abs_diff_eq!(lobes[0].wo.y, expected.y, epsilon = 1e-15);
    assert!(lobes[0].wo.z > 0.0);
}

#[test]
fn power_is_kept_where_orders_pass_off() {
    let mut rng = Pcg64::seed_from_u64(23);
    for loss in [0.0, 0.2] {
        let table = table(&grid(2, 9), blazed(loss));
        let report = validate::albedo(&table, 20_000, &mut rng);
        // At grazing incidence nothing is lost.
        let most = if loss > 0.0 { 1.0 } else { 1.0 + 1e-7 };
        assert!(report.lowest > 1.0 - loss - 1e-7 && report.highest < most, "{report:?}");
    }
}

#[test]
fn light_beyond_the_critical_ky_is_never_transmitted() {
    let table = table(&grid(2, 9), blazed(0.0));
    let mut rng = Pcg64::seed_from_u64(24);
    for ky in [1.0, 1.000_001, 1.01, 1.2, 1.4] {
        let k = Wavevector { kx: 0.05, ky };
        let orders = table.efficiencies(Side::Inner, k, Polarisation::Unpolarised);
        assert!(orders.iter().all(|o| o.to == Side::Inner));
        assert_abs_diff_eq!(orders.iter().map(|o| o.efficiency).sum::<f64>(), 1.0, epsilon = 1e-9);
        let wi = k.arriving(Side::Inner, N).unwrap();
        for _ in 0..100 {
            assert_eq!(table.sample(wi, &mut rng).unwrap().lobe.transport, Transport::Reflection);
        }
    }
    // Just below it only nodes below count: a table of order 0 that transmits all there still does
    // at the kink.
    let step = |side: Side, _: f64, ky: f64, _: Polarisation| {
        if ky < 1.0 && side == Side::Inner {
            vec![OrderEfficiency::new(Side::Inner, 0, 0.25)]
        } else {
            vec![OrderEfficiency::new(side, 0, 0.5)]
        }
    };
    let step = self::table(&grid(2, 9), step);
    for (ky, expected) in [(0.999_999, 0.25), (1.000_001, 0.5)] {
        let k = Wavevector { kx: 0.01, ky };
        let orders = step.efficiencies(Side::Inner, k, Polarisation::Unpolarised);
        assert_abs_diff_eq!(
            orders.iter().map(|o| o.efficiency).sum::<f64>(),
            expected,
            epsilon = 1e-7
        );
    }
}

#[test]
fn sign_of_ky_changes_no_share() {
    let table = table(&grid(2, 9), blazed(0.0));
    let k = Wavevector { kx: 0.21, ky: 0.4 };
    let mirrored = Wavevector { ky: -0.4, ..k };
    let [a, b] = [k, mirrored].map(|k| table.efficiencies(Side::Inner, k, Polarisation::S));
    assert_eq!(a, b);
    let wo = |k: Wavevector| table.lobes(k.arriving(Side::Inner, N).unwrap(), Polarisation::S);
    for (a, b) in wo(k).iter().zip(wo(mirrored)) {
        assert!((a.wo - b.wo * DVec3::new(1.0, -1.0, 1.0)).length() < 1e-14);
    }
}

#[test]
fn reciprocity_of_a_reciprocal_model_is_seen_and_its_breach_too() {
    // A smooth interface is reciprocal; a model that reflects by the side of incidence is not.
    let grid = grid(2, 9);
    let report = validate::reciprocity(&table(&grid, smooth));
    assert!(report.deviation.worst < 1e-7 && report.deviation.count > 1000, "{report:?}");
    let one_way = |side: Side, _: f64, _: f64, _: Polarisation| {
        vec![OrderEfficiency::new(side, 0, if side == Side::Inner { 0.3 } else { 0.6 })]
    };
    assert!(
        validate::reciprocity(&table(&grid, one_way)).deviation.worst < 1e-7,
        "each side by itself is symmetric"
    );
    let tilted = |side: Side, kx: f64, _: f64, _: Polarisation| {
        vec![OrderEfficiency::new(side, 0, 0.5 + 0.1 * kx)]
    };
    let report = validate::reciprocity(&table(&grid, tilted));
    assert!(report.deviation.worst > 0.2);
    // Light sent back along the mirror order comes from -kx: the breach is 0.2 kx, worst at the
    // rim.
    assert!(grid.kx(report.at.unwrap().kx_index).abs() > 1.3);
}

#[test]
fn full_size_table_is_compact() {
    let grid = Grid { period: 10.78, kx_per_zone: 4, ky: Grid::ky_nodes(N, 1.0, 24), ..grid(1, 2) };
    let table = table(&grid, smooth);
    let bytes = memory(&table);
    assert!(bytes < 7_000_000, "{bytes} bytes for {} orders", table.entry_count());
}

#[test]
fn what_leaving_nodes_out_tells_is_known_for_a_parabola() {
    let grid = grid(2, 6);
    let spacing = grid.kx(1) - grid.kx(0);
    let between = |bend: f64, slope: f64| {
        let table = table(&grid, |side, kx, ky, _| {
            vec![OrderEfficiency::new(side, 0, 0.3 + bend * kx * kx + slope * ky)]
        });
        validate::leave_one_out(&table, Side::Inner)
    };
    // Straight lines leave nothing but the rounding of f32; a parabola is missed by its bend times
    // the spacing squared.
    assert!(between(0.0, 0.2) < 1e-7);
    let half = 0.5 * 0.3 * spacing * spacing;
    assert!((between(0.3, 0.2) / half - 1.0).abs() < 1e-3);
}
