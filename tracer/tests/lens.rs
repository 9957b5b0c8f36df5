// SPDX-License-Identifier: MIT OR Apache-2.0
//! The simplest package is traced many paths at once: it must tell what path by path tells, keep its books, and not depend on threads.

use crate::common;
use crate::common::{BODY, N, lamp, mirrored_cap, single, trace};
use tracer::glam::DVec3;
use tracer::{
    Emission, Emitter, FarField, Medium, PlaneMap, Region, SceneBuilder, Settings, Shape, Source,
    Surface, SurfaceModel, run,
};

/// A floor far below makes the scene one that is traced path by path.
#[test]
fn many_at_once_is_one_by_one_in_every_row_of_the_far_field() {
    let emissions = [
        Emission::LAMBERTIAN,
        Emission::Isotropic,
        Emission::Lambertian {
            half_angle_deg: 50.0,
        },
    ];
    for (number, emission) in emissions.into_iter().enumerate() {
        let quick = single(mirrored_cap(emission.clone()));
        let mut slow = SceneBuilder::new(Medium::air());
        let id = slow.prototype(mirrored_cap(emission));
        let floor = Shape::horizontal(-50.0).unwrap();
        slow.surface(Surface::new(
            "floor",
            floor,
            Region::Opaque,
            Region::World,
            &SurfaceModel::Absorber,
        ));
        let slow = slow.place(id, DVec3::ZERO).build().unwrap();
        let far = FarField::new(3.0, 30.0).unwrap();
        let plane = PlaneMap::centred(2.0, 0.5, 24, 24).unwrap();
        let settings = Settings::new(400_000, 5 + number as u64);
        let [a, b] = [&quick, &slow].map(|scene| trace(scene, &[&far, &plane], &settings));
        let shares = |totals: &tracer::Totals| {
            let ledger = &totals.ledger;
            let mirror = ledger.surface("mirror").unwrap().absorbed;
            let mut all = vec![ledger.escaped_up, ledger.extraction(), mirror];
            let rows = totals.readings[0].chunks(far.phis()).take(30);
            all.extend(rows.map(|row| row.iter().sum::<f64>()));
            let columns = |offset: usize| (0..12).map(move |k| 24 * 2 * k + offset);
            all.extend(columns(11).map(|bin| totals.readings[1][bin]));
            all
        };
        let (a, b) = (a.jackknife_many(shares), b.jackknife_many(shares));
        let mut chi2 = 0.0;
        for (k, (a, b)) in a.iter().zip(&b).enumerate() {
            let error = a.standard_error.hypot(b.standard_error);
            let off = (a.value - b.value) / error;
            assert!(off.abs() < 5.0, "{k}: {a:?} {b:?}");
            chi2 += off * off;
        }
        let freedom = a.len() as f64;
        assert!(chi2 < freedom + 5.0 * (2.0 * freedom).sqrt(), "{chi2}");
    }
}

#[test]
fn no_path_is_lost_and_the_books_balance() {
    let scene = single(mirrored_cap(Emission::Isotropic));
    let paths = common::many() / 2;
    let outcome = trace(&scene, &[], &Settings::new(paths, 2));
    assert!(outcome.total.ledger.lost_total() <= 0.0);
    // Given up after a few surfaces, and all or nothing at every mirror: still all power is somewhere.
    let mut settings = Settings::new(50_000, 3);
    settings.max_bounces = 3;
    settings.roulette_below = 1.0;
    let outcome = trace(&scene, &[], &settings);
    assert!(outcome.total.ledger.lost_total() > 0.0);
    assert!(outcome.hits <= 3 * outcome.paths);
}

#[test]
fn threads_change_no_bit() {
    let scene = single(mirrored_cap(Emission::LAMBERTIAN));
    let far = FarField::default();
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| run(&scene, &[&far], &Settings::new(100_000, 9)).unwrap())
    });
    assert_eq!(one, three);
}

/// A point in the middle of a half ball: nothing bends, so the far field of a Lambertian point stays one, less the reflection at
/// normal incidence, and what is reflected falls on the black base.
#[test]
fn a_point_in_the_middle_is_not_bent() {
    let dome = Shape::sphere_zones(0.0, 2.0, &[2.0, 0.0]).unwrap();
    let base = Shape::annulus(0.0, 0.0, 2.0 + 1e-9).unwrap();
    let surfaces = vec![
        Surface::new("dome", dome, BODY, Region::World, &SurfaceModel::Interface),
        Surface::new("base", base, Region::Opaque, BODY, &SurfaceModel::Absorber),
    ];
    let point: Source = common::inside(DVec3::ZERO, Emitter::Point, Emission::LAMBERTIAN);
    let scene = single(lamp(N, surfaces, point));
    let far = FarField::new(10.0, 90.0).unwrap();
    let paths = 1_000_000;
    let outcome = trace(&scene, &[&far], &Settings::new(paths, 4));
    let through = 4.0 * N / ((N + 1.0) * (N + 1.0));
    for (row, bins) in outcome.total.readings[0].chunks(4).enumerate().take(9) {
        let sin2 = |k: usize| (10.0 * k as f64).to_radians().sin().powi(2);
        let expected = through * (sin2(row + 1) - sin2(row)) / 4.0;
        for bin in bins {
            common::assert_share("bin", *bin, expected, outcome.paths, 0.0);
        }
    }
}
