// SPDX-License-Identifier: MIT OR Apache-2.0
//! Relief → RCWA → table of orders → ray tracer, against closed forms.
//!
//! A relief without contrast is a smooth interface (Fresnel), so the banded dome traces like the
//! smooth one. The grating equation gives the directions of a beam's orders, a direct solve their
//! efficiency. Energy is conserved.

#![expect(
    clippy::print_stdout,
    reason = "the numbers found are what a reader of the test wants to see"
)]

use std::sync::Arc;

use crate::package::{Cap, Dome, Package};
use batwing_tests::statistics::{SIGMAS, chi_square, chi_square_limit};
use batwing_tests::tables::{direct, on_silicone, order_table, resolution};
use bsdf::{Grid, OrderTable};
use num_complex::Complex64;
use rcwa::Side;
use rcwa::hemisphere::Interface;
use rcwa::relief::{Polygon, Relief};
use tracer::glam::DVec3;
use tracer::package::ground;
use tracer::{
    Emission, Emitter, FarField, LedBox, Medium, Outcome, Patch, Prototype, Ray, Receiver, Region,
    Scene, SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, run,
};

const N: f64 = 1.41;
const CAP: Cap = Cap { radius: 2.0, apex: 1.0, rim: 1.7 };
const BANDS: usize = 17;

fn real(n: f64) -> Complex64 {
    Complex64::new(n, 0.0)
}

/// Silicone in silicone: nothing but the surface at its lower end.
fn without_contrast(period: f64) -> Interface {
    on_silicone(Relief::new(period, 0.4, real(N), Vec::new()).expect("a relief"))
}

/// Two unequal upright ridges: no mirror symmetry, no slices.
fn two_ridges(period: f64) -> Interface {
    let ridge = |from: f64, to: f64| Polygon {
        index: real(N),
        points: [[from, 0.0], [to, 0.0], [to, 0.6], [from, 0.6]]
            .map(|[x, z]| [x * period, z])
            .to_vec(),
    };
    let ridges = vec![ridge(0.05, 0.3), ridge(0.45, 0.6)];
    on_silicone(Relief::new(period, 0.6, real(1.0), ridges).expect("a relief"))
}

fn table(interface: &Interface, kx_per_zone: usize, ky: usize) -> OrderTable {
    let resolution = resolution(interface, 8, 1).expect("a resolution");
    order_table(interface, kx_per_zone, Grid::ky_nodes(N, 1.0, ky), &resolution).expect("a table")
}

/// Two of the paper's packages with `dome` as their surface, close together on a mirror, so that
/// light comes from outside too.
fn package(dome: Dome) -> Scene {
    let mirror = |reflectance| SurfaceModel::Mirror { reflectance };
    let package = Package {
        cap: CAP,
        silicone: Medium::clear("silicone", N),
        dome,
        side: SurfaceModel::Interface,
        bottom: mirror(0.95),
        led: LedBox { size: DVec3::new(1.0, 1.0, 0.35), side: mirror(0.86), top: mirror(0.86) },
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(package.prototype().expect("a package"));
    scene.surface(ground(4.0, 2.0, mirror(0.95), SurfaceModel::Absorber).expect("a ground"));
    scene.place(id, DVec3::new(-2.0, 0.0, 0.0)).place(id, DVec3::new(2.0, 0.0, 0.0));
    scene.build().expect("a scene")
}

fn banded(tables: &[Arc<OrderTable>]) -> Scene {
    let zones = (1..=BANDS).map(|k| {
        let outer = CAP.rim * k as f64 / BANDS as f64;
        let optics = SurfaceModel::Scatter(tables[k % tables.len()].clone());
        (if k == BANDS { CAP.rim } else { outer }, Patch::new("dome", optics))
    });
    package(Dome::Zones(zones.collect()))
}

fn trace(scene: &Scene, receivers: &[&dyn Receiver], paths: u64, seed: u64) -> Outcome {
    let outcome = run(scene, receivers, &Settings::new(paths, seed)).expect("a trace");
    let ledger = &outcome.total.ledger;
    assert!(ledger.imbalance().abs() < 1e-11, "imbalance {}", ledger.imbalance());
    assert!((ledger.emitted - 1.0).abs() < 1e-12);
    assert!(ledger.lost_total() < 1e-4, "lost {:?}", ledger.lost);
    outcome
}

#[test]
fn dome_of_reliefs_without_contrast_is_the_smooth_dome() {
    // Tables of two periods take turns, since a period without contrast means nothing. Nodes are
    // close enough that what linear interpolation leaves of the square roots at the critical angle
    // stays below the noise of these paths.
    let tables: Vec<Arc<OrderTable>> =
        [1.0, 1.7].map(|period| Arc::new(table(&without_contrast(period), 64, 96))).to_vec();
    let far = FarField::new(3.0, 30.0).expect("bins");
    let paths = 600_000;
    let bands = trace(&banded(&tables), &[&far], paths, 11);
    let smooth = trace(&package(Dome::smooth(&CAP)), &[&far], paths, 12);

    let [a, b] = [&bands, &smooth].map(|o| o.jackknife(|t| t.ledger.extraction()));
    let error = a.standard_error.hypot(b.standard_error);
    println!("extraction {:.5} by tables, {:.5} by Fresnel, +- {error:.5}", a.value, b.value);
    assert!((a.value - b.value).abs() < SIGMAS * error, "{a:?} {b:?}");

    let rings = |totals: &tracer::Totals| -> Vec<f64> {
        totals.readings[0].chunks_exact(far.phis()).map(|row| row.iter().sum()).collect()
    };
    let [a, b] = [&bands, &smooth].map(|outcome| outcome.jackknife_many(rings));
    let mut worst = (0.0, 0.0);
    for (i, (a, b)) in a.iter().zip(&b).enumerate() {
        let error = a.standard_error.hypot(b.standard_error);
        let off = (a.value - b.value).abs();
        assert!(off <= SIGMAS * error, "{} degrees: {a:?} {b:?}", far.theta_deg(i));
        if error > 0.0 && off / error > worst.0 {
            worst = (off / error, far.theta_deg(i));
        }
    }
    println!("far field: {:.2} standard errors at worst, at {} degrees", worst.0, worst.1);
}

#[test]
fn dome_of_gratings_keeps_all_power() {
    let tables = [Arc::new(table(&two_ridges(1.5), 4, 12))];
    let outcome = trace(&banded(&tables), &[], 100_000, 13);
    // The gratings themselves absorb nothing, in any line of the ledger.
    let dome = outcome.total.ledger.surface("dome").expect("a line");
    assert!(dome.absorbed.abs() < 1e-12, "{dome:?}");
    assert!(dome.outward > 0.5 && dome.inward > 0.0, "{dome:?}");
}

/// Counts rays by the direction in which they leave; the last bin is for those that leave in none
/// of them.
struct Directions(Vec<DVec3>);

impl Receiver for Directions {
    fn bins(&self) -> usize {
        self.0.len() + 1
    }

    fn bin(&self, ray: &Ray, length: f64) -> Option<usize> {
        if length < f64::INFINITY {
            return None;
        }
        let found = self.0.iter().position(|d| (*d - ray.direction).length() < 1e-6);
        Some(found.unwrap_or(self.0.len()))
    }
}

/// A drum of silicone whose lid is the grating, its walls black. A beam meets the lid at (0.5, 0,
/// 1), where t = x and b = y, with the tangential wavevector (`kx`, `ky`), from inside or from
/// outside.
fn drum(table: &Arc<OrderTable>, from: Side, kx: f64, ky: f64) -> Scene {
    let body = Region::Body(0);
    let lid = Shape::annulus(1.0, 0.0, 1.0).expect("a disc");
    let wall = Shape::cylinder(1.0, -1e-9, 1.0 + 1e-9).expect("a cylinder");
    let floor = Shape::annulus(0.0, 0.0, 1.0 + 1e-9).expect("a disc");
    let (n, up) = if from == Side::Top { (N, 1.0) } else { (1.0, -1.0) };
    let direction = DVec3::new(kx, ky, up * (n * n - kx * kx - ky * ky).sqrt()) / n;
    let position = DVec3::new(0.5, 0.0, 1.0) - 0.3 * direction;
    let region = if from == Side::Top { body } else { Region::World };
    let source =
        Source::new("beam", position, region, Emitter::Point, Emission::Beam { direction });
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype {
        media: vec![Medium::clear("silicone", N)],
        surfaces: vec![
            Surface::new("lid", lid, body, Region::World, &SurfaceModel::Scatter(table.clone())),
            Surface::new("wall", wall, body, Region::Opaque, &SurfaceModel::Absorber),
            Surface::new("floor", floor, Region::Opaque, body, &SurfaceModel::Absorber),
        ],
        sources: vec![source],
    });
    scene.place(id, DVec3::ZERO).build().expect("a scene")
}

#[test]
fn beam_on_a_grating_goes_into_its_orders_with_their_efficiencies() {
    let interface = two_ridges(3.0);
    let table = Arc::new(table(&interface, 2, 6));
    let resolution = resolution(&interface, 8, 1).expect("a resolution");
    let grid = table.grid();
    for (seed, (from, kx_index, ky_index)) in [
        (Side::Top, 3_i64, 2_usize),
        (Side::Top, -5, 1),
        (Side::Top, 0, 0),
        (Side::Bottom, 2, 2),
        (Side::Bottom, -4, 1),
    ]
    .into_iter()
    .enumerate()
    {
        let (kx, ky) = (grid.kx(kx_index), grid.ky[ky_index]);
        // Unpolarised efficiencies, solved for this incidence alone.
        let [s, p] = direct(&interface, from, (kx, ky), &resolution).expect("solved");
        let mean = s.iter().zip(&p).map(|(s, p)| (s.0, s.1, 0.5 * (s.2 + p.2)));
        let (outside, inside): (Vec<_>, Vec<_>) = mean.partition(|(to, _, _)| *to == Side::Bottom);
        let leaving = |order: i32| {
            let kx = kx + f64::from(order) * interface.order_spacing();
            DVec3::new(kx, ky, (1.0 - kx * kx - ky * ky).sqrt())
        };
        let directions = Directions(outside.iter().map(|(_, m, _)| leaving(*m)).collect());
        let paths = 200_000;
        let outcome = trace(&drum(&table, from, kx, ky), &[&directions], paths, 20 + seed as u64);

        let count = |watts: f64| (watts * outcome.paths as f64).round();
        let mut counts: Vec<f64> = outcome.total.readings[0].iter().map(|&w| count(w)).collect();
        let elsewhere = counts.pop().expect("the bin of the rest");
        assert!(elsewhere.abs() < 0.5, "{elsewhere} rays in no direction of an order");
        // What goes into the drum, its black walls take.
        counts.push(count(outcome.total.ledger.absorbed()));
        let mut expected: Vec<f64> = outside.iter().map(|o| o.2).collect();
        expected.push(inside.iter().map(|o| o.2).sum());
        assert!((expected.iter().sum::<f64>() - 1.0).abs() < 1e-10);
        let (statistic, freedom) = chi_square(&counts, &expected);
        println!(
            "{from:?} kx {kx:.4} ky {ky:.4}: {} orders outside, chi-square {statistic:.1} of {freedom}",
            outside.len()
        );
        assert!(freedom >= 5, "{freedom} classes");
        assert!(
            statistic < chi_square_limit(freedom),
            "{statistic} with {freedom} degrees of freedom"
        );
    }
}
