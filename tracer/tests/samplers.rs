// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sources against their densities by chi-square: sets of rays, tables of intensity, enclosures,
//! discs, cones.
//!
//! Places where each sampler of the tracer is judged so: `random::{unit, disc, cosine, isotropic}`,
//! rectangles and streams of paths in `sampling.rs`; points of nets in `sobol.rs`; mixed and
//! Lambertian reflectors in `mixed.rs`, on the far fields of whole scenes; first rays of Sobol
//! points and of batches, which are those of the sources here, in `low_discrepancy.rs` and
//! `batch.rs`; what surfaces draw from tables in the tests of `bsdf`. The rest is here.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use tracer::RayRecord;
use tracer::glam::DVec3;
use tracer::random::{isotropic, stream, unit};
use tracer::{Distribution, Emission, Emitter, RaySet, Region, Source};

const DRAWS: u64 = 1_000_000;
/// One test in a hundred, of the seven here with Šidák's correction.
const LIMIT: f64 = 2.98;

/// Chi-square of counts against expected ones, as a normal deviate [Wilson, Hilferty 1931]; no cell
/// may expect fewer than five.
fn deviate(counts: &[u64], shares: &[f64]) -> f64 {
    let total: u64 = counts.iter().sum();
    let sum: f64 = shares.iter().sum();
    let mut chi2 = 0.0;
    for (count, share) in counts.iter().zip(shares) {
        let expected = share / sum * total as f64;
        assert!(expected >= 5.0, "{expected}");
        chi2 += (*count as f64 - expected).powi(2) / expected;
    }
    let k = (counts.len() - 1) as f64;
    ((chi2 / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt()
}

fn judge(what: &str, counts: &[u64], shares: &[f64]) {
    let z = deviate(counts, shares);
    assert!(z < LIMIT && z > -4.5, "{what}: {z}");
}

/// Counts on 30 × 30 cells of the unit square.
fn square(seed: u64, mut draw: impl FnMut(&mut rand_pcg::Pcg64) -> [f64; 2]) -> Vec<u64> {
    let mut rng = stream(seed, 4);
    let mut counts = vec![0; 900];
    for _ in 0..DRAWS {
        let cells = draw(&mut rng).map(|u| {
            assert!((-1e-12..=1.0 + 1e-12).contains(&u), "{u}");
            ((u * 30.0) as usize).min(29)
        });
        counts[cells[0] * 30 + cells[1]] += 1;
    }
    counts
}

fn turn(x: f64, y: f64) -> f64 {
    (y.atan2(x) / TAU).rem_euclid(1.0)
}

fn source(emitter: Emitter, emission: Emission) -> Source {
    Source::new("s", DVec3::new(0.3, -0.2, 0.1), Region::World, emitter, emission)
}

#[test]
fn rays_of_a_set_are_drawn_by_their_flux() {
    let mut rng = stream(40, 0);
    // From nothing to a hundred times the mean, in no order; the number of a ray stands in its
    // start.
    let fluxes: Vec<f32> = (0..1500)
        .map(|k| match k % 10 {
            0 => 0.0,
            1 => 30.0,
            _ => 0.1 + unit(&mut rng) as f32,
        })
        .collect();
    let records = (0_u16..).zip(&fluxes).map(|(k, flux)| {
        let d = isotropic(&mut rng);
        RayRecord {
            position: [f32::from(k), 0.0, 0.0],
            direction: [d.x as f32, d.y as f32, d.z as f32],
            flux: *flux,
            wavelength: f32::NAN,
        }
    });
    let records: Vec<RayRecord> = records.collect();
    let set = RaySet::new(records).unwrap();
    assert_eq!(set.len(), 1350);
    let lamp = source(Emitter::Point, Emission::Rays(Arc::new(set)));
    let mut counts = vec![0_u64; fluxes.len()];
    let mut rng = stream(41, 0);
    for _ in 0..DRAWS {
        let ray = lamp.sample(0.0, &mut rng);
        counts[(ray.origin.x - 0.3).round() as usize] += 1;
    }
    let lit = |k: &usize| fluxes[*k] > 0.0;
    assert!((0..fluxes.len()).filter(|k| !lit(k)).all(|k| counts[k] == 0));
    let kept: Vec<usize> = (0..fluxes.len()).filter(lit).collect();
    let got: Vec<u64> = kept.iter().map(|k| counts[*k]).collect();
    let flux: Vec<f64> = kept.iter().map(|k| f64::from(fluxes[*k])).collect();
    judge("rays", &got, &flux);
    // Drawn evenly they would not pass.
    assert!(deviate(&got, &vec![1.0; got.len()]) > 50.0);
}

#[test]
fn directions_of_a_table_follow_its_intensity() {
    let thetas: Vec<f64> = [0.0, 10.0, 25.0, 50.0, 90.0, 140.0, 180.0].to_vec();
    let phis = [0.0, 60.0, 90.0, 200.0, 300.0];
    let value = |p: usize, t: usize| 1.0 + (p as f64 + 1.0) * ((3 * t + p) % 5) as f64;
    let values = (0..phis.len()).flat_map(|p| (0..thetas.len()).map(move |t| value(p, t)));
    let table = Distribution::new(&thetas, &phis, values.collect()).unwrap();
    // Expected by the midpoint rule on 16 × 16 points of each cell of (cos θ, φ).
    let fine = 16 * 30;
    let mut shares = vec![0.0; 900];
    for i in 0..fine {
        for j in 0..fine {
            let z = 2.0 * (i as f64 + 0.5) / fine as f64 - 1.0;
            let phi = TAU * (j as f64 + 0.5) / fine as f64;
            let r = (1.0 - z * z).sqrt();
            let d = DVec3::new(r * phi.cos(), r * phi.sin(), z);
            shares[i / 16 * 30 + j / 16] += table.intensity(d);
        }
    }
    let lamp = source(Emitter::Point, Emission::Table(Arc::new(table)));
    let counts = square(42, |rng| {
        let d = lamp.sample(0.0, rng).direction;
        [0.5 * (d.z + 1.0), turn(d.x, d.y)]
    });
    judge("table", &counts, &shares);
    assert!(deviate(&counts, &[1.0; 900]) > 50.0);
}

#[test]
fn enclosures_shine_inward_evenly_by_the_cosine_law() {
    let even = [1.0; 900];
    let lamp = source(Emitter::Enclosure { radius: 3.0 }, Emission::LAMBERTIAN);
    let out = |at: DVec3| (at - lamp.position) / 3.0;
    let places = square(43, |rng| {
        let n = out(lamp.sample(0.0, rng).origin);
        [0.5 * (n.z + 1.0), turn(n.x, n.y)]
    });
    judge("places", &places, &even);
    let directions = square(44, |rng| {
        let ray = lamp.sample(0.0, rng);
        let (u, v) = (-out(ray.origin)).any_orthonormal_pair();
        let (x, y) = (ray.direction.dot(u), ray.direction.dot(v));
        [x * x + y * y, turn(x, y)]
    });
    judge("directions", &directions, &even);
    // Where and whither are independent: chords of a ball lit so have squares that are evenly
    // spread, whatever the height of their start.
    let chords = square(45, |rng| {
        let ray = lamp.sample(0.0, rng);
        let chord = -2.0 * out(ray.origin).dot(ray.direction);
        [0.25 * chord * chord, 0.5 * (out(ray.origin).z + 1.0)]
    });
    judge("chords", &chords, &even);
}

#[test]
fn discs_and_cones_are_even() {
    let even = [1.0; 900];
    let half_angle_deg = 35.0;
    let lamp = source(Emitter::Disc { radius: 0.7 }, Emission::Lambertian { half_angle_deg });
    let places = square(46, |rng| {
        let at = (lamp.sample(0.0, rng).origin - lamp.position) / 0.7;
        [at.x * at.x + at.y * at.y, turn(at.x, at.y)]
    });
    judge("disc", &places, &even);
    let sin2 = (half_angle_deg * PI / 180.0).sin().powi(2);
    let directions = square(47, |rng| {
        let d = lamp.sample(0.0, rng).direction;
        [(1.0 - d.z * d.z) / sin2, turn(d.x, d.y)]
    });
    judge("cone", &directions, &even);
}
