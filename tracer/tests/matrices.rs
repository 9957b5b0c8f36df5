// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfaces that scatter by tables with Jones matrices: closed forms of polarised light through
//! them, and the smooth interfaces that they stand for.

use std::sync::Arc;

use crate::common::*;
use bsdf::order_table::{JonesRow, OrderJones};
use bsdf::{Grid, OrderEfficiency, OrderTable, Polarisation as Incident, Side, TableHeader};
use num_complex::Complex64;
use tracer::glam::DVec3;
use tracer::optics::thin_film::{Amplitudes, End};
use tracer::{
    Emission, Emitter, FarField, Film, Medium, Outcome, Polarisation, Prototype, Region, Scene,
    SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel,
};

/// The table of a smooth interface, in zones of λ/Λ with no orders but the one.
fn smooth(inner: f64, outer: f64, fine: usize) -> OrderTable {
    // 1.3 waves to a period: few orders, all without power.
    let grid = Grid {
        period: 0.55 * 1.3,
        wavelength: 0.55,
        index_inner: inner,
        index_outer: outer,
        kx_per_zone: fine,
        ky: Grid::ky_nodes(inner, outer, fine),
    };
    let film = Film::new(550.0, Vec::new()).unwrap();
    let met = |side: Side, k2: f64| -> Amplitudes {
        let (from, to) = (grid.index(side), grid.index(side.opposite()));
        let cos = (1.0 - k2 / (from * from)).max(0.0).sqrt();
        film.amplitudes(End::First, from, to.into(), cos)
    };
    let zero = Complex64::ZERO;
    let shares = grid.rows(|side, kx, ky, polarisation| {
        let place = usize::from(polarisation == Incident::P);
        let met = met(side, kx * kx + ky * ky);
        let all = [
            OrderEfficiency::new(side, 0, met.reflectances()[place]),
            OrderEfficiency::new(side.opposite(), 0, met.transmittances()[place]),
        ];
        all.into_iter().filter(|o| o.efficiency > 0.0).collect()
    });
    let table = OrderTable::build(TableHeader::default(), grid.clone(), shares).unwrap();
    let rows = grid.nodes().map(|id| {
        let (kx, ky) = (grid.kx(id.kx_index), grid.ky[id.ky_index]);
        let met = met(id.side, kx * kx + ky * ky);
        let diagonal = |[s, p]: [Complex64; 2]| [[s, zero], [zero, p]];
        let through = if met.transmittances().iter().sum::<f64>() <= 0.0 {
            [zero; 2]
        } else {
            met.transmitted
        };
        JonesRow {
            node: id,
            orders: vec![
                OrderJones { to: id.side, order: 0, jones: diagonal(met.reflected) },
                OrderJones { to: id.side.opposite(), order: 0, jones: diagonal(through) },
            ],
        }
    });
    table.with_jones(rows).unwrap()
}

fn scattering(inner: f64, outer: f64, fine: usize) -> SurfaceModel {
    SurfaceModel::Scatter(Arc::new(smooth(inner, outer, fine)))
}

fn traced(scene: &Scene, polarisation: Polarisation, paths: u64, seed: u64) -> Outcome {
    let settings = Settings { polarisation, ..Settings::new(paths, seed) };
    trace(scene, &[], &settings)
}

/// Like the pile of plates of smooth interfaces (`films.rs`): m plates let (1 - R)/(1 + (2m - 1) R)
/// of each polarisation pass [Born, Wolf 1999, section 1.5].
#[test]
fn a_pile_of_plates_of_tables_polarises_by_the_closed_form() {
    let (n, plates) = (1.52, 3_i32);
    let below = |k: i32| if k % 2 == 0 { n } else { 1.0 };
    let tables = [scattering(n, 1.0, 120), scattering(1.0, n, 120)];
    let count = 2 * plates;
    let region = |k: i32| {
        if k == 0 || k == count { Region::World } else { Region::Body(k as u8 - 1) }
    };
    for theta in [f64::atan(n), 1.2] {
        let planes = (0..count).map(|k| {
            let shape = Shape::horizontal(-f64::from(k)).unwrap();
            let (inner, outer) = (region(k + 1), region(k));
            let name = format!("plane {k}");
            Surface::new(&name, shape, inner, outer, &tables[(k % 2) as usize])
        });
        let prototype = Prototype {
            media: (0..count - 1).map(|k| Medium::clear(format!("medium {k}"), below(k))).collect(),
            surfaces: planes.collect(),
            sources: Vec::new(),
        };
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(prototype);
        scene.place(id, DVec3::ZERO);
        let direction = DVec3::new(theta.sin() * 0.6, theta.sin() * 0.8, -theta.cos());
        let source = Source::new(
            "lamp",
            DVec3::Z,
            Region::World,
            Emitter::Point,
            Emission::Beam { direction },
        );
        scene.source(source);
        let scene = scene.build().unwrap();
        assert!(scene.scattering_surfaces().is_empty());

        let film = Film::new(550.0, Vec::new()).unwrap();
        let [s, p] = film.amplitudes(End::First, 1.0, n.into(), theta.cos()).reflectances();
        let passed = |r: f64| (1.0 - r) / (1.0 + f64::from(2 * plates - 1) * r);
        let expected = 0.5 * (passed(s) + passed(p));
        let mean = passed(0.5 * (s + p));
        assert!(expected - mean > 0.02, "{expected} {mean}");
        // What the tables' grid leaves, beside chance.
        let grid = 1.5e-3;
        let carried = traced(&scene, Polarisation::Carried, many() / 50, 1);
        let down = carried.total.ledger.escaped_down;
        assert_share("carried", down, expected, carried.paths, grid);
        let plain = traced(&scene, Polarisation::Unpolarised, many() / 50, 2);
        let down = plain.total.ledger.escaped_down;
        assert_share("unpolarised", down, mean, plain.paths, grid);
    }
}

/// A skew beam in a block of glass: partly reflected by two faces, totally by four, which turn what
/// the two have polarised, and make it elliptic.
#[test]
fn a_block_of_tables_is_the_smooth_block() {
    let n = 1.52;
    let scene = |optics: &SurfaceModel| {
        let half = DVec3::new(1.0, 0.8, 0.9);
        let shape = Shape::cuboid(-half, half).unwrap();
        let prototype = Prototype {
            media: vec![Medium::clear("glass", n).absorbing(0.2)],
            surfaces: vec![Surface::new("block", shape, BODY, Region::World, optics)],
            sources: vec![Source::new(
                "lamp",
                DVec3::new(-0.3, 0.1, 0.2),
                BODY,
                Emitter::Point,
                Emission::Beam { direction: DVec3::new(0.8, 0.45, 0.397).normalize() },
            )],
        };
        single(prototype)
    };
    let far = FarField::new(90.0, 90.0).unwrap();
    let outcome = |optics: &SurfaceModel, polarisation, seed| {
        let settings = Settings { polarisation, ..Settings::new(many() / 25, seed) };
        trace(&scene(optics), &[&far], &settings)
    };
    let tables = scattering(n, 1.0, 120);
    let by_tables = outcome(&tables, Polarisation::Carried, 3);
    let by_formulas = outcome(&SurfaceModel::Interface, Polarisation::Carried, 4);
    let without = outcome(&SurfaceModel::Interface, Polarisation::Unpolarised, 5);
    // The octants into which light leaves, and what the glass absorbs.
    let accounts = |outcome: &Outcome| -> Vec<(f64, f64)> {
        (0..9)
            .map(|n| {
                let of = outcome.jackknife(|t| match n {
                    8 => t.ledger.media[0],
                    bin => t.readings[0][bin],
                });
                (of.value, of.standard_error)
            })
            .collect()
    };
    let (a, b, c) = (accounts(&by_tables), accounts(&by_formulas), accounts(&without));
    for (a, b) in a.iter().zip(&b) {
        // The grid of the tables is good for a fiftieth of a reading.
        let allowed = 0.02 * b.0 + 4.5 * a.1.hypot(b.1);
        assert!((a.0 - b.0).abs() <= allowed, "{a:?} {b:?}");
    }
    // Light that was reflected twice by the two faces comes back to the first octant: half as much
    // as without polarisation.
    assert!((0.4..0.7).contains(&(b[0].0 / c[0].0)), "{b:?} {c:?}");
    assert!(by_tables.total.ledger.lost_total() < 1e-9);
}
