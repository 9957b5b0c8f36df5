// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chi-square tests of ablated BSDFs: samples against densities and powers of lobes.

use super::*;
use crate::direction::spherical;
use crate::tests::chi_square::{WithoutCosine, density_p_value, sidak_level, test_lobes};
use crate::{Lambertian, Outline, Polygon, SmoothInterface, UnitCell};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::f64::consts::{FRAC_PI_2, PI};

const DRAWS: usize = 200_000;

/// At the normal, oblique, grazing, from both sides.
const INCIDENCES: [(f64, f64); 8] = [
    (0.0, 0.0),
    (0.5, 1.1),
    (1.1, 4.0),
    (1.55, 2.5),
    (PI, 0.0),
    (PI - 0.4, 5.2),
    (PI - 0.6, 0.7),
    (PI - 1.56, 3.3),
];

/// A leaning triangle of silicone.
fn relief() -> Arc<dyn Bsdf> {
    let triangle = Polygon { index: 1.41, points: vec![[0.0, 0.0], [10.0, 0.0], [7.0, 4.0]] };
    let outline = Outline {
        period: 10.0,
        depth: 4.0,
        index_inner: 1.41,
        index_outer: 1.0,
        background: 1.0,
        polygons: vec![triangle],
    };
    Arc::new(UnitCell::new(&outline).expect("valid").with_power_cutoff(1e-8))
}

fn spread_of(bsdf: &Arc<dyn Bsdf>) -> Binned {
    Binned::new(Arc::clone(bsdf), WIDTH)
}

/// Width of a cell, degrees.
const WIDTH: f64 = 15.0;

/// Polar and azimuthal number of the cell of a direction: polar bounds are multiples of the width,
/// azimuths are multiples of it in the middle.
fn cell(wo: DVec3) -> (usize, usize) {
    let width = WIDTH.to_radians();
    let polar = wo.z.abs().min(1.0).acos() / width;
    let turn = (wo.y.atan2(wo.x) / width + 0.5).rem_euclid(TAU / width);
    (polar as usize, turn as usize)
}

/// Every discrete lobe fills its cell evenly in cos θ dΩ.
fn density(lobes: &[OutgoingLobe], wo: DVec3) -> f64 {
    let (polar, azimuth) = cell(wo);
    let here =
        lobes.iter().filter(|l| Side::of(l.wo) == Side::of(wo) && cell(l.wo) == (polar, azimuth));
    let power: f64 = here.map(|l| l.power).sum();
    let sin2 = |k: usize| (k as f64 * WIDTH.to_radians()).min(FRAC_PI_2).sin().powi(2);
    let projected = 0.5 * WIDTH.to_radians() * (sin2(polar + 1) - sin2(polar));
    power / projected * wo.z.abs()
}

#[test]
fn spread_lobes_fill_their_cells_evenly() {
    let interface: Arc<dyn Bsdf> = Arc::new(SmoothInterface::new(1.41, 1.0).expect("valid"));
    let mut rng = Pcg64::seed_from_u64(41);
    let scatterers = [interface, relief()];
    let level = sidak_level(scatterers.len() * INCIDENCES.len());
    for scatter in &scatterers {
        let spread = spread_of(scatter);
        for (theta, phi) in INCIDENCES {
            let wi = spherical(theta, phi);
            let lobes = scatter.lobes(wi, Polarization::Unpolarized);
            let expected = |wo: DVec3| density(&lobes, wo);
            let p = density_p_value(&spread, &expected, wi, DRAWS, &mut rng);
            assert!(p > level, "wi {wi}: p = {p}");
        }
    }
}

#[test]
fn spreading_without_the_cosine_is_found_out() {
    let mut rng = Pcg64::seed_from_u64(42);
    let scatter = relief();
    let spread = Arc::new(spread_of(&scatter));
    for (theta, phi) in INCIDENCES {
        let wi = spherical(theta, phi);
        let lobes = scatter.lobes(wi, Polarization::Unpolarized);
        let wrong = WithoutCosine { surface: spread.clone(), cells: spread.cells.clone() };
        let expected = |wo: DVec3| density(&lobes, wo);
        let p = density_p_value(&wrong, &expected, wi, DRAWS, &mut rng);
        assert!(p < 1e-9, "wi {wi}: p = {p}");
    }
}

/// A cosine law that is spread over cells evenly in cos θ dΩ is the same cosine law.
#[test]
fn a_cosine_law_stays_one_when_spread() {
    let matt: Arc<dyn Bsdf> = Arc::new(Lambertian::new(1.0, 1.0).expect("valid"));
    let spread = spread_of(&matt);
    let mut rng = Pcg64::seed_from_u64(43);
    let level = sidak_level(INCIDENCES.len());
    for (theta, phi) in INCIDENCES {
        let wi = spherical(theta, phi);
        let cosine = |wo: DVec3| {
            if Side::of(wo) == Side::of(wi) { wo.z.abs() / PI } else { 0.0 }
        };
        let p = density_p_value(&spread, &cosine, wi, DRAWS, &mut rng);
        assert!(p > level, "wi {wi}: p = {p}");
    }
}

#[test]
fn substitutes_and_parts_are_drawn_as_they_are_listed() {
    let mut rng = Pcg64::seed_from_u64(44);
    let substitutes = [
        IncidenceMap::InPlane,
        IncidenceMap::FromPositiveX,
        IncidenceMap::FromNegativeX,
        IncidenceMap::HalfTurn,
        IncidenceMap::AzimuthMean,
    ];
    let parts = [Mask::Transmission, Mask::FromInside, Mask::SpecularReflection];
    let level = sidak_level((substitutes.len() + parts.len()) * INCIDENCES.len());
    for (theta, phi) in INCIDENCES {
        let wi = spherical(theta, phi);
        for map in substitutes {
            let surface = RemappedIncidence { bsdf: relief(), map };
            let drawn = test_lobes(&surface, wi, DRAWS, &mut rng);
            assert!(drawn.p_value > level, "{map:?}, wi {wi}: p = {}", drawn.p_value);
        }
        for part in parts {
            let surface = Masked { bsdf: relief(), mask: part };
            let drawn = test_lobes(&surface, wi, DRAWS, &mut rng);
            assert!(drawn.p_value > level, "{part:?}, wi {wi}: p = {}", drawn.p_value);
        }
    }
}
