// SPDX-License-Identifier: MIT OR Apache-2.0
//! Time of one sample, table and unit cell, at directions spread over the hemisphere (`cargo bench
//! -p batwing-bsdf`).

use bsdf::direction::Side;
use bsdf::{
    Bsdf, Grid, OrderEfficiency, OrderTable, Outline, Polarisation, Polygon, TableHeader, UnitCell,
};
use glam::DVec3;
use rand::SeedableRng;
use rand_pcg::Pcg64;

fn main() {
    divan::main();
}

/// Directions from one side, uniform in cos² θ.
fn directions(side: Side) -> Vec<DVec3> {
    let mut rng = Pcg64::seed_from_u64(7);
    (0..4096)
        .map(|_| {
            bsdf::analytic::sample_cosine_hemisphere(&mut rng) * DVec3::new(1.0, 1.0, side.sign())
        })
        .collect()
}

/// A table as large as that of ring 75 with power spread over all orders.
fn table() -> OrderTable {
    let grid = Grid {
        period: 10.78,
        wavelength: 0.55,
        index_inner: 1.41,
        index_outer: 1.0,
        kx_per_zone: 4,
        ky: Grid::ky_nodes(1.41, 1.0, 24),
    };
    let zone = grid.zone();
    let spread = |side: Side, kx: f64, ky: f64, _: Polarisation| {
        let mut orders = Vec::new();
        for (to, n) in [(Side::Inner, 1.41_f64), (Side::Outer, 1.0)] {
            for l in -70_i32..=70 {
                let out = kx + f64::from(l) * zone;
                if out * out + ky * ky < n * n {
                    let weight = if to == side { 0.3 } else { 1.0 } / f64::from(1 + l.abs());
                    orders.push(OrderEfficiency::new(to, l, weight));
                }
            }
        }
        let sum: f64 = orders.iter().map(|o| o.efficiency).sum();
        for order in &mut orders {
            order.efficiency /= sum;
        }
        orders
    };
    OrderTable::build(TableHeader::default(), grid.clone(), grid.rows(spread))
        .expect("a valid table")
}

fn run(bencher: divan::Bencher<'_, '_>, surface: &impl Bsdf, side: Side) {
    let directions = directions(side);
    let mut rng = Pcg64::seed_from_u64(1);
    bencher.counter(divan::counter::ItemsCount::new(directions.len())).bench_local(|| {
        directions
            .iter()
            .filter_map(|wi| surface.sample(*wi, &mut rng))
            .map(|s| s.wo.z)
            .sum::<f64>()
    });
}

#[divan::bench]
fn table_from_inner(bencher: divan::Bencher<'_, '_>) {
    run(bencher, &table(), Side::Inner);
}

#[divan::bench]
fn table_from_outer(bencher: divan::Bencher<'_, '_>) {
    run(bencher, &table(), Side::Outer);
}

/// OS1 of ring 75: a triangle with a level tread and an upright riser.
fn cell() -> UnitCell {
    let apex = [9.275, 3.734];
    let silicone = Polygon { index: 1.41, points: vec![[0.0, 0.0], [10.778, 0.0], apex] };
    let outline = Outline {
        period: 10.778,
        depth: apex[1],
        index_inner: 1.41,
        index_outer: 1.0,
        background: 1.0,
        polygons: vec![silicone],
    };
    UnitCell::new(&outline).expect("a valid outline")
}

#[divan::bench]
fn cell_from_inner(bencher: divan::Bencher<'_, '_>) {
    run(bencher, &cell(), Side::Inner);
}

#[divan::bench]
fn cell_from_outer(bencher: divan::Bencher<'_, '_>) {
    run(bencher, &cell(), Side::Outer);
}

#[divan::bench]
fn cell_lobes(bencher: divan::Bencher<'_, '_>) {
    let (cell, directions) = (cell(), directions(Side::Inner));
    bencher.counter(divan::counter::ItemsCount::new(64_usize)).bench_local(|| {
        directions[..64]
            .iter()
            .map(|wi| cell.lobes(*wi, Polarisation::Unpolarised).len())
            .sum::<usize>()
    });
}

#[divan::bench]
fn table_lobes(bencher: divan::Bencher<'_, '_>) {
    let (table, directions) = (table(), directions(Side::Inner));
    bencher.counter(divan::counter::ItemsCount::new(64_usize)).bench_local(|| {
        directions[..64]
            .iter()
            .map(|wi| table.lobes(*wi, Polarisation::Unpolarised).len())
            .sum::<usize>()
    });
}
