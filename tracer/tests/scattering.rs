// SPDX-License-Identifier: MIT OR Apache-2.0
//! Media that scatter: free paths and angles, slabs of others, limits, conservation, and every
//! route of the tracer.

use std::sync::Arc;

use crate::common::package::Dome;
use crate::common::*;
use tracer::glam::DVec3;
use tracer::observer::{Fate, Observer};
use tracer::random;
use tracer::run::{Control, run_rays, trace_observed};
use tracer::{
    Emission, Emitter, Error, Medium, PhaseFunction, PhaseTable, Polarisation, Prototype, Ray,
    Region, Scattering, Scene, SceneBuilder, Settings, Shape, Source, Sphere, Surface,
    SurfaceModel, run,
};

/// Henyey-Greenstein scattering.
fn scattering(per_mm: f64, g: f64) -> Scattering {
    Scattering { per_mm, phase: PhaseFunction::HenyeyGreenstein(g) }
}

/// Light from above on endless layers from z = 0 downwards, each with its thickness.
fn layers(layers: &[(f64, Medium)], emission: Emission) -> Scene {
    let region = |k: usize| {
        if k == 0 || k > layers.len() { Region::World } else { Region::Body(k as u8 - 1) }
    };
    let mut depth = 0.0;
    let mut surfaces = Vec::new();
    for k in 0..=layers.len() {
        let shape = Shape::horizontal(-depth).unwrap();
        let name = format!("plane {k}");
        let interface = SurfaceModel::Interface;
        surfaces.push(Surface::new(&name, shape, region(k + 1), region(k), &interface));
        depth += layers.get(k).map_or(0.0, |(thickness, _)| *thickness);
    }
    let media = layers.iter().map(|(_, medium)| medium.clone()).collect();
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype { media, surfaces, sources: Vec::new() });
    scene.place(id, DVec3::ZERO);
    let lamp = Source::new("lamp", DVec3::Z, Region::World, Emitter::Point, emission);
    scene.source(lamp.facing(-DVec3::Z));
    scene.build().unwrap()
}

fn beam(cosine: f64) -> Emission {
    let sine = (1.0 - cosine * cosine).sqrt();
    Emission::Beam { direction: DVec3::new(0.6 * sine, 0.8 * sine, -cosine) }
}

/// A slab with the cosine of incidence, `None` for Lambertian light, and R and T with their
/// tolerance.
type Known = (&'static str, Vec<(f64, Medium)>, Option<f64>, [f64; 3]);

/// R and T of slabs, all light out of the lit and of the other face: \[van de Hulst 1980\], Table
/// 35 as quoted by L. Wang, S. L. Jacques, L. Zheng, *MCML*, Comput. Methods Programs Biomed. 47, 131
/// (1995), and vol. 1, p. 256; the others by discrete ordinates, 2 x 40 Gauss nodes split at the
/// critical angle, which give the former to all digits. Coefficients "QD" of a quantum-dot film are
/// those of Sci. Rep. 7, 16663 (2017).
///
/// \[van de Hulst 1980\] H. C. van de Hulst, *Multiple Light Scattering*.
fn known_slabs() -> Vec<Known> {
    let slab = |index: f64, [absorbs, scatters, g, thickness]: [f64; 4]| {
        let medium = Medium::clear("slab", index).absorbing(absorbs);
        (thickness, medium.scattering(Some(scattering(scatters, g))))
    };
    let matched = |numbers| vec![slab(1.0, numbers)];
    let glass = (1.0, Medium::clear("glass", 1.5));
    let between = vec![glass.clone(), slab(1.4, [0.1, 0.9, 0.8, 1.0]), glass];
    let red = vec![slab(1.41, [0.6062, 1.249, 0.5038, 0.5])];
    let blue = matched([3.7, 2.9382, 0.4918, 0.1]);
    let forward = matched([0.1, 0.9, 0.8, 1.0]);
    let conservative = matched([0.0, 1.0, 0.0, 1.0]);
    vec![
        ("MCML", matched([1.0, 9.0, 0.75, 0.2]), Some(1.0), [0.09739, 0.66096, 1e-5]),
        ("isotropic", matched([0.01, 0.99, 0.0, 1.0]), Some(0.5), [0.48652, 0.49163, 1e-5]),
        ("forward", forward.clone(), Some(1.0), [0.042_355, 0.845_378, 2e-5]),
        ("forward, diffuse", forward, None, [0.116_62, 0.710_55, 2e-5]),
        ("conservative", conservative.clone(), Some(1.0), [0.341_329, 0.658_671, 2e-5]),
        ("conservative, diffuse", conservative, None, [0.446_594, 0.553_406, 2e-5]),
        ("between glass", between.clone(), Some(1.0), [0.106_39, 0.719_01, 1e-4]),
        ("between glass, diffuse", between, None, [0.181_04, 0.595_37, 1e-4]),
        ("QD blue", blue.clone(), Some(1.0), [0.026_921, 0.634_482, 2e-5]),
        ("QD blue, diffuse", blue, None, [0.056_573, 0.474_543, 2e-5]),
        ("QD red", red.clone(), Some(1.0), [0.073_73, 0.520_38, 1e-4]),
        ("QD red, diffuse", red, None, [0.130_23, 0.427_09, 1e-4]),
    ]
}

/// Traces the known slabs to this standard error and judges each by five of its own.
fn judge_slabs(standard_error: f64) {
    for (what, slabs, incidence, [reflected, transmitted, tolerance]) in known_slabs() {
        // R and T are shares of paths, less some absorption.
        let variance = [reflected, transmitted].map(|share| share * (1.0 - share));
        let paths = (variance[0].max(variance[1]) / (standard_error * standard_error)) as u64;
        let scene = layers(&slabs, incidence.map_or(Emission::LAMBERTIAN, beam));
        let outcome = trace(&scene, &[], &Settings::new(paths, 41));
        assert_none_lost(what, &outcome);
        for (upward, expected) in [(true, reflected), (false, transmitted)] {
            let seen = outcome.mean(|totals| {
                if upward { totals.ledger.escaped_up } else { totals.ledger.escaped_down }
            });
            // Scatter of 64 groups is known to a tenth only.
            assert!(seen.standard_error < 1.3 * standard_error, "{what}: {seen:?}");
            let bound = 5.0 * seen.standard_error + tolerance;
            assert!((seen.value - expected).abs() < bound, "{what}: {seen:?}, not {expected}");
        }
    }
}

#[test]
#[ignore = "slow: 4 s"]
fn slabs_reflect_and_transmit_as_published() {
    judge_slabs(5e-4);
}

#[test]
#[ignore = "nightly: 25 million paths through each of twelve slabs (120 s)"]
fn nightly_slabs_reflect_and_transmit_as_published_to_a_ten_thousandth() {
    judge_slabs(1e-4);
}

/// Places at which a path is scattered, and how it ends.
#[derive(Default)]
struct Places {
    of_path: Vec<DVec3>,
    /// Of all paths, with the direction in which they left the scene, if they did.
    paths: Vec<(Vec<DVec3>, Option<DVec3>)>,
}

impl Observer for Places {
    fn scatters(&mut self, ray: &Ray, _line: usize) {
        self.of_path.push(ray.origin);
    }

    fn ends(&mut self, ray: &Ray, fate: Fate, _weight: f64) {
        let escaped = matches!(fate, Fate::EscapedUp | Fate::EscapedDown);
        let places = std::mem::take(&mut self.of_path);
        self.paths.push((places, escaped.then_some(ray.direction)));
    }
}

fn observed(scene: &Scene, settings: &Settings) -> Places {
    let mut places = Places::default();
    trace_observed(scene, settings, |ray| ray, &mut places).unwrap();
    places
}

/// A ball about a beam along +z that scatters.
fn ball(radius: f64, medium: Medium) -> Scene {
    let sphere = Shape::sphere(0.0, radius).unwrap();
    let surface = Surface::new("ball", sphere, BODY, Region::World, &SurfaceModel::Absorber);
    let beam = Emission::Beam { direction: DVec3::Z };
    let sources = vec![inside(DVec3::ZERO, Emitter::Point, beam)];
    single(Prototype { media: vec![medium], surfaces: vec![surface], sources })
}

/// The mean and its standard error.
fn mean(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    [mean, (variance / count).sqrt()]
}

fn assert_mean(what: &str, values: impl Iterator<Item = f64> + Clone, expected: f64) {
    let [mean, error] = mean(values);
    assert!((mean - expected).abs() < 5.0 * error, "{what}: {mean} ± {error}, not {expected}");
}

/// Fails where counts in bins of equal probability are unlikely: for 19 degrees of freedom χ² is
/// above 50 once in 10 000 times.
fn assert_even(what: &str, chances: impl Iterator<Item = f64>) {
    let mut counts = [0.0; 20];
    for chance in chances {
        counts[(20.0 * chance) as usize] += 1.0;
    }
    let expected = counts.iter().sum::<f64>() / 20.0;
    let chi2: f64 = counts.iter().map(|count| (count - expected).powi(2) / expected).sum();
    assert!(chi2 < 50.0, "{what}: χ² = {chi2}");
}

/// Free paths are exponential, and places of the first four scatterings have the moments
/// ⟨z⟩ = 1, 1.9, 2.71, 3.439 of "Two-step verification method for Monte Carlo codes in biomedical
/// optics applications", Table 7 (the last is misprinted there), and ⟨r²⟩ = 2n + 2 Σ (n - k) gᵏ.
#[test]
fn places_of_scattering_have_the_known_moments() {
    let g = 0.9_f64;
    let medium = Medium::clear("fog", 1.3).scattering(Some(scattering(1.0, g)));
    let scene = ball(40.0, medium);
    let settings = Settings { max_bounces: 1, ..Settings::new(100_000, 5) };
    let places = observed(&scene, &settings).paths;
    let at = |n: usize| places.iter().map(move |(places, _)| places[n - 1]);
    assert_even("free path", at(1).map(|place| (-place.z).exp()));
    for (n, expected) in [1.0, 1.9, 2.71, 3.439].into_iter().enumerate() {
        let n = n + 1;
        assert_mean("z", at(n).map(|place| place.z), expected);
        assert_mean("x", at(n.max(2)).map(|place| place.x), 0.0);
        let along = (1..n).map(|k| (n - k) as f64 * g.powi(k as i32)).sum::<f64>();
        let squared = 2.0 * n as f64 + 2.0 * along;
        assert_mean("r²", at(n).map(DVec3::length_squared), squared);
    }
    assert_even(
        "azimuth",
        at(2).map(|place| 0.5 + place.y.atan2(place.x) / std::f64::consts::TAU).map(|t| t % 1.0),
    );
}

/// Henyey-Greenstein's angles: the distribution, ⟨cos θ⟩ = g and ⟨P₂⟩ = g², also where g is
/// nearly 0 or its bounds, at which light goes straight on or back.
#[test]
fn angles_follow_henyey_and_greenstein() {
    for (number, g) in [-0.7_f64, -1e-9, 0.0, 1e-5, 0.5, 0.8, 0.99].into_iter().enumerate() {
        let phase = PhaseFunction::HenyeyGreenstein(g);
        let mut rng = random::stream(3, number as u64);
        let cosines: Vec<f64> = (0..200_000).map(|_| phase.sample_cosine(&mut rng)).collect();
        let p2 = |cosine: f64| 0.5 * (3.0 * cosine * cosine - 1.0);
        assert_mean("g", cosines.iter().copied(), g);
        assert_mean("g²", cosines.iter().map(|cosine| p2(*cosine)), g * g);
        if g.abs() > 0.1 {
            let below = |cosine: f64| {
                let root = (1.0 + g * g - 2.0 * g * cosine).sqrt();
                (1.0 - g * g) / (2.0 * g) * (1.0 / root - 1.0 / (1.0 + g))
            };
            assert_even(
                "Henyey-Greenstein",
                cosines.iter().map(|c| below(*c).clamp(0.0, 1.0 - 1e-7)),
            );
        }
    }
    let mut rng = random::stream(3, 99);
    for g in [-1.0, 1.0] {
        let phase = PhaseFunction::HenyeyGreenstein(g);
        assert!((0..1000).all(|_| (phase.sample_cosine(&mut rng) - g).abs() < 1e-9));
    }
}

/// Angles of a table: Rayleigh's 1 + cos² θ at many angles, and 1 - cos θ, which three angles say
/// exactly.
#[test]
fn angles_follow_a_table() {
    let angles: Vec<f64> = (0..=360).map(|k| 0.5 * f64::from(k)).collect();
    let rayleigh = |angle: &f64| 1.0 + angle.to_radians().cos().powi(2);
    let values: Vec<f64> = angles.iter().map(rayleigh).collect();
    let below = |c: f64| 0.375 * (c + c.powi(3) / 3.0) + 0.5;
    let table = PhaseTable::new(&angles, &values).unwrap();
    assert!(table.mean_cosine().abs() < 1e-12);
    let back = PhaseTable::new(&[0.0, 90.0, 180.0], &[0.0, 3.0, 6.0]).unwrap();
    assert!((back.mean_cosine() + 1.0 / 3.0).abs() < 1e-12);
    let mut rng = random::stream(4, 0);
    let mut draw = |table: PhaseTable| -> Vec<f64> {
        let phase = PhaseFunction::Table(Arc::new(table));
        (0..200_000).map(|_| phase.sample_cosine(&mut rng)).collect()
    };
    assert_even("Rayleigh", draw(table).into_iter().map(|c| below(c).clamp(0.0, 0.999_999_9)));
    let linear = draw(back).into_iter();
    assert_even("linear", linear.map(|c| (0.75 + 0.5 * c - 0.25 * c * c).clamp(0.0, 0.999_999_9)));
}

/// Of light scattered once by an isotropic slab of optical depth τ, ½ ∫ e^-z E₂(z) dz goes back and
/// ½ ∫ e^-z E₂(τ - z) dz goes on.
#[test]
fn light_scattered_once_leaves_as_the_closed_form_says() {
    let depth = 1.0_f64;
    // ½ ∫ dμ ∫ dz by the midpoint rule.
    let steps = 1000;
    let middles =
        |length: f64| (0..steps).map(move |k| length * (f64::from(k) + 0.5) / f64::from(steps));
    let sum = |away: &dyn Fn(f64) -> f64| {
        let at = |z: f64| middles(1.0).map(|mu| (-z - away(z) / mu).exp()).sum::<f64>();
        0.5 * middles(depth).map(at).sum::<f64>() * depth / f64::from(steps).powi(2)
    };
    let expected = [sum(&|z| z), sum(&|z| depth - z)];
    let medium = Medium::clear("slab", 1.0).scattering(Some(scattering(1.0, 0.0)));
    let scene = layers(&[(depth, medium)], beam(1.0));
    let paths = 400_000;
    let places = observed(&scene, &Settings::new(paths, 8));
    let share = |upward: bool| {
        let once = places.paths.iter().filter(|(places, escaped)| {
            places.len() == 1 && escaped.is_some_and(|d| (d.z > 0.0) == upward)
        });
        once.count() as f64 / paths as f64
    };
    assert_share("back", share(true), expected[0], paths, 1e-5);
    assert_share("on", share(false), expected[1], paths, 1e-5);
}

/// A deep isotropic slab that absorbs nothing lets (4/3)/(τ + 2 q) of Lambertian light pass, with
/// Hopf's q(∞) = 0.710446: the diffusion limit with Milne's extrapolated ends.
#[test]
fn a_deep_slab_transmits_by_the_diffusion_limit() {
    let medium = Medium::clear("slab", 1.0).scattering(Some(scattering(4.0, 0.0)));
    for depth in [6.0, 12.0] {
        let scene = layers(&[(depth / 4.0, medium.clone())], Emission::LAMBERTIAN);
        let outcome = trace(&scene, &[], &Settings::new(300_000, 9));
        let expected = 4.0 / 3.0 / (depth + 2.0 * 0.710_446);
        let passed = outcome.total.ledger.escaped_down;
        assert_share("diffusion", passed, expected, outcome.paths, 2e-5);
        assert_none_lost("diffusion", &outcome);
    }
}

fn milky(medium: Medium) -> Medium {
    medium.scattering(Some(scattering(3.0, 0.6)))
}

/// A ball of a medium.
fn droplet(radius: f64, medium: Medium) -> Prototype {
    let shape = Shape::sphere(0.3, radius).unwrap();
    let surface = Surface::new("drop", shape, BODY, Region::World, &SurfaceModel::Interface);
    Prototype { media: vec![medium], surfaces: vec![surface], sources: Vec::new() }
}

/// A scattering ball with a clear bead in it, beside its middle, in a black sphere of one radiance:
/// whatever they do, the wall finds the same irradiance all over, and all light.
#[test]
fn a_body_that_scatters_keeps_a_furnace_white() {
    for (polarisation, has_bead) in [
        (Polarisation::Unpolarised, false),
        (Polarisation::Unpolarised, true),
        (Polarisation::Carried, true),
    ] {
        let mut scene = SceneBuilder::new(Medium::air());
        let milk = scene.prototype(droplet(1.2, milky(Medium::clear("milk", 1.41))));
        if has_bead {
            let bead = scene.prototype(droplet(0.5, Medium::clear("bead", 1.7)));
            scene.place(bead, DVec3::new(0.4, -0.2, 0.1)).array_solids(milk);
        } else {
            scene.place(milk, DVec3::new(0.4, -0.2, 0.5));
        }
        scene.surface(furnace_wall(3.0));
        let wall = Emitter::Enclosure { radius: 3.0 };
        let source = Source::new("wall", DVec3::ZERO, Region::World, wall, Emission::LAMBERTIAN);
        scene.source(source);
        let scene = scene.build().unwrap();
        assert_eq!(scene.scattering_media(), ["milk"]);
        let settings = Settings { polarisation, ..Settings::new(400_000, 12) };
        let outcome = trace(&scene, &[], &settings);
        let ledger = &outcome.total.ledger;
        assert_none_lost("furnace", &outcome);
        for zone in 0..20 {
            let power = ledger.surface(&format!("zone {zone}")).unwrap().absorbed;
            assert_share("zone", power, 0.05, outcome.paths, 1e-9);
        }
    }
}

/// What a scattering dome absorbs, sends out and loses, by the batch, by packets of a mesh and path
/// by path: the same draws, so the same ledger.
#[test]
fn all_routes_scatter_alike() {
    let mut package = package(N, Dome::smooth(&CAP), 0.95, 0.86);
    package.silicone = milky(package.silicone).absorbing(0.1);
    let mut mesh = meshed_cap(4000, Emission::LAMBERTIAN);
    mesh.media = vec![milky(Medium::clear("silicone", N)).absorbing(0.1)];
    let scenes = [
        single(package.prototype().unwrap()),
        array(&package, 2, 8.3).build().unwrap(),
        single(mesh),
    ];
    for scene in scenes {
        let settings = Settings { groups: 4, ..Settings::new(4 * 16_384, 7) };
        let many = trace(&scene, &[], &settings);
        let alone = run_rays(&scene, &settings, Control::default(), |_, _| Ok(())).unwrap();
        let accounts = |outcome: &tracer::Outcome| {
            let ledger = &outcome.total.ledger;
            [ledger.escaped_up, ledger.media.iter().sum(), ledger.extraction(), ledger.absorbed()]
        };
        assert!(accounts(&many)[1] > 0.05);
        for (a, b) in accounts(&many).into_iter().zip(accounts(&alone)) {
            assert!((a - b).abs() < 6.0 / many.paths as f64, "{a} {b}");
        }
    }
}

/// The same bits on any number of threads.
#[test]
fn threads_change_nothing() {
    let mut package = package(N, Dome::relief(staircase(17)), 0.95, 0.86);
    package.silicone = milky(package.silicone).absorbing(0.1);
    let scene = array(&package, 2, 8.3).build().unwrap();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&scene, &[], &Settings::new(20_000, 2)).unwrap())
    };
    assert_eq!(on(1), on(3));
}

/// Spheres much smaller than the wavelength scatter as Rayleigh says: 2/3 π⁵ d⁶ (n/λ)⁴
/// ((m² - 1)/(m² + 2))² each, forwards as much as backwards.
#[test]
fn small_spheres_scatter_as_rayleigh_says() {
    let (sphere, index, nm, share) = (Sphere { diameter_um: 0.01, index: 1.6 }, 1.4, 550.0, 0.02);
    let seen = Scattering::of_spheres(&sphere, share, index, nm).unwrap();
    let pi = std::f64::consts::PI;
    let (d, wavelength, m2) = (1e-5, nm * 1e-6 / index, (1.6 / index).powi(2));
    let one = 2.0 / 3.0 * pi.powi(5) * f64::powi(d, 6) / f64::powi(wavelength, 4)
        * ((m2 - 1.0) / (m2 + 2.0)).powi(2);
    let expected = share / (pi / 6.0 * f64::powi(d, 3)) * one;
    assert!((seen.per_mm / expected - 1.0).abs() < 2e-3, "{} {expected}", seen.per_mm);
    assert!(seen.phase.mean_cosine().abs() < 2e-3);
}

/// A path that a medium scatters without end is given up and its power shown.
#[test]
fn endless_scattering_is_lost_and_shown() {
    let medium = Medium::clear("fog", 1.0).scattering(Some(scattering(1e4, 0.0)));
    let settings = Settings { max_bounces: 10, ..Settings::new(200, 1) };
    let outcome = trace(&ball(1.0, medium), &[], &settings);
    assert!(outcome.total.ledger.lost_total() > 0.99);
}

#[test]
fn media_that_make_no_sense_are_refused() {
    let number = |medium: Medium| {
        let mut scene = SceneBuilder::new(Medium::air());
        let prototype = Prototype { media: vec![medium], ..Prototype::default() };
        scene.prototype(prototype);
        match scene.build() {
            Err(Error::Number { got, .. }) => got,
            other => panic!("{:?}", other.map(drop)),
        }
    };
    let fog = || Medium::clear("fog", 1.0);
    assert!((number(fog().scattering(Some(scattering(1.0, 1.5)))) - 1.5).abs() < 1e-12);
    assert!((number(fog().scattering(Some(scattering(-2.0, 0.5)))) + 2.0).abs() < 1e-12);
    let world = SceneBuilder::new(fog().scattering(Some(scattering(1.0, 0.0)))).build();
    assert!(matches!(world, Err(Error::Number { .. })));
    for (angles, values) in [
        (vec![0.0, 90.0], vec![1.0, 1.0]),
        (vec![0.0, 90.0, 80.0, 180.0], vec![1.0; 4]),
        (vec![0.0, 180.0], vec![0.0, 0.0]),
        (vec![0.0, 180.0], vec![1.0, -1.0]),
        (vec![0.0, 180.0], vec![1.0]),
        (vec![0.0], vec![1.0]),
    ] {
        assert!(PhaseTable::new(&angles, &values).is_err(), "{angles:?} {values:?}");
    }
    let huge = Sphere { diameter_um: 1e4, index: 1.5 };
    assert!(Scattering::of_spheres(&huge, 0.1, 1.4, 550.0).is_err());
    assert!(Scattering::of_spheres(&Sphere { diameter_um: 1.0, ..huge }, 1.1, 1.4, 550.0).is_err());
}
