// SPDX-License-Identifier: MIT OR Apache-2.0
//! Media that convert light: series of absorptions, numbers of photons, the ledger, a plate of
//! others, and every way to run them.

use std::collections::BTreeMap;
use std::sync::Mutex;

use crate::common::*;
use tracer::glam::DVec3;
use tracer::{
    CheckpointStore, Control, Emission, Emitter, FarField, Luminophore, Medium, Outcome, Patch,
    Prototype, Region, Scattering, Scene, SceneBuilder, Settings, Shape, Source, Surface,
    SurfaceModel, WavelengthRun,
};

/// A ball of radius 1 mm with a source in its middle.
fn ball(medium: Medium) -> Scene {
    let mut scene = SceneBuilder::new(Medium::air());
    let surface = SurfaceModel::Interface;
    let sphere = Shape::sphere(0.0, 1.0).unwrap();
    let source = Source::new("source", DVec3::ZERO, BODY, Emitter::Point, Emission::Isotropic);
    let package = scene.prototype(Prototype {
        media: vec![medium],
        surfaces: vec![Surface::new("ball", sphere, BODY, Region::World, &surface)],
        sources: vec![source],
    });
    scene.place(package, DVec3::ZERO).build().unwrap()
}

/// Runs scenes of one source each, which emits at the first wavelength, with power and numbers of
/// photons, as many as watts of the first wavelength, for channels.
fn run_all(nm: &[f64], scenes: &[Scene], settings: &Settings) -> [Outcome; 2] {
    let scenes: Vec<&Scene> = scenes.iter().collect();
    let mut shares = vec![0.0; nm.len()];
    shares[0] = 1.0;
    let photons = nm.iter().map(|of| of / nm[0]).collect();
    let run = WavelengthRun {
        wavelengths_nm: nm,
        scenes: &scenes,
        emission: &[shares],
        channels: &[vec![1.0; nm.len()], photons],
    };
    run.run(&[], settings, Control::default()).unwrap().try_into().expect("two channels")
}

/// Light that an opaque medium absorbs again and again leaves it at the wavelength at which it is
/// clear: the share p of the photons is emitted where it is opaque, so that Σ (Y p)ᵏ Y (1 - p) of
/// them leave, with λ/λ' of the energy each.
#[test]
fn a_series_of_absorptions_adds_up() {
    let (quantum_yield, again, nm) = (0.8, 0.6, [450.0, 600.0]);
    let medium = |absorption: f64| {
        let dye = Luminophore::new("dye", absorption, quantum_yield, &[again, 1.0 - again]);
        Medium::clear("binder", 1.0).luminescent(vec![dye.unwrap()])
    };
    let scenes = [ball(medium(60.0)), ball(medium(0.0))];
    let [power, photons] = run_all(&nm, &scenes, &Settings::new(many() / 20, 3));
    let left = quantum_yield * (1.0 - again) / (1.0 - quantum_yield * again);
    for (outcome, expected) in [(&photons, left), (&power, left * nm[0] / nm[1])] {
        let escaped = outcome.jackknife(|totals| totals.ledger.escaped());
        assert!(escaped.deviations_from(expected) < 4.0, "{escaped:?} {expected}");
        assert!(escaped.standard_error < 2e-3 * expected);
    }
    // Both losses by themselves: photons that are not emitted lose the energy that they have.
    let ledger = |of: fn(&tracer::ledger::LuminophoreLine) -> f64| {
        power.jackknife(|totals| of(&totals.ledger.luminophores[0]))
    };
    let absorptions = 1.0 / (1.0 - quantum_yield * again);
    let (absorbed, lost) = (ledger(|line| line.absorbed), ledger(|line| line.quantum_loss));
    let stokes = ledger(|line| line.stokes_loss);
    assert!(absorbed.deviations_from(absorptions) < 4.0, "{absorbed:?}");
    assert!(lost.deviations_from((1.0 - quantum_yield) * absorptions) < 4.0, "{lost:?}");
    let of_stokes = quantum_yield * (1.0 - again) * (1.0 - nm[0] / nm[1]) * absorptions;
    assert!(stokes.deviations_from(of_stokes) < 4.0, "{stokes:?}");
}

/// Two substances in a medium that scatters, absorbs and holds light by total reflection: light
/// goes from blue over green to red, and each may emit above the energy that it has absorbed.
fn cascade(quantum_yield: f64, absorption: f64) -> [Scene; 3] {
    [[3.0, 2.0], [0.5, 1.5], [0.0, 0.3]].map(|[green, red]| {
        let of = |name: &str, per_mm: f64, shares: [f64; 3]| {
            Luminophore::new(name, per_mm, quantum_yield, &shares).unwrap()
        };
        let all = vec![of("green", green, [0.1, 0.8, 0.1]), of("red", red, [0.0, 0.1, 0.9])];
        let scattering = Scattering { per_mm: 1.0, phase: ISOTROPIC };
        let medium = Medium::clear("binder", 1.5).absorbing(absorption);
        ball(medium.scattering(Some(scattering)).luminescent(all))
    })
}

const ISOTROPIC: tracer::PhaseFunction = tracer::PhaseFunction::HenyeyGreenstein(0.0);
const COLOURS_NM: [f64; 3] = [450.0, 530.0, 630.0];

#[test]
fn a_yield_of_one_keeps_the_number_of_photons() {
    let settings = Settings { roulette_below: 0.0, ..Settings::new(20_000, 4) };
    let [power, photons] = run_all(&COLOURS_NM, &cascade(1.0, 0.0), &settings);
    let ledger = &photons.total.ledger;
    let ended = ledger.escaped() + ledger.lost_total();
    assert!((ended - ledger.emitted).abs() < 1e-12, "{ended}");
    let ledger = &power.total.ledger;
    assert!(ledger.luminophores.iter().all(|line| line.quantum_loss.abs() < 1e-12));
    assert!(ledger.escaped() < 0.85 && ledger.imbalance().abs() < 1e-12);
}

#[test]
fn power_balances_with_absorption_roulette_and_both_losses() {
    let [power, photons] = run_all(&COLOURS_NM, &cascade(0.9, 0.2), &Settings::new(many() / 50, 5));
    for group in &power.groups {
        assert!(group.ledger.imbalance().abs() < 1e-12, "{}", group.ledger.imbalance());
    }
    // In photons: of those absorbed by substances a tenth is lost.
    let balance = photons.jackknife(|totals| {
        let ledger = &totals.ledger;
        let lost: f64 = ledger.luminophores.iter().map(|line| line.quantum_loss).sum();
        ledger.escaped() + ledger.media.iter().sum::<f64>() + ledger.lost_total() + lost
    });
    assert!(balance.deviations_from(1.0) < 4.0, "{balance:?}");
    let absorbed = &power.total.ledger.luminophores;
    assert!(absorbed.iter().all(|line| line.absorbed > 0.1 && line.stokes_loss > 0.0));
}

#[test]
fn emitted_wavelengths_follow_the_spectrum() {
    // A clear medium but for the first wavelength: what leaves at each wavelength is what was drawn.
    let shares = [0.0, 0.05, 0.5, 0.0, 0.3, 0.15];
    let nm: Vec<f64> = (0..shares.len()).map(|k| 450.0 + 30.0 * k as f64).collect();
    let scenes: Vec<Scene> = (0..nm.len())
        .map(|k| {
            let absorption = if k == 0 { 100.0 } else { 0.0 };
            let dye = Luminophore::new("dye", absorption, 1.0, &shares).unwrap();
            ball(Medium::clear("binder", 1.0).luminescent(vec![dye]))
        })
        .collect();
    let scenes: Vec<&Scene> = scenes.iter().collect();
    // One channel for each wavelength, in photons.
    let channels: Vec<Vec<f64>> = (0..nm.len())
        .map(|k| (0..nm.len()).map(|of| if of == k { nm[k] / nm[0] } else { 0.0 }).collect())
        .collect();
    let mut emission = vec![0.0; nm.len()];
    emission[0] = 2.0;
    let run = WavelengthRun {
        wavelengths_nm: &nm,
        scenes: &scenes,
        emission: &[emission],
        channels: &channels,
    };
    let settings = Settings { roulette_below: 0.0, ..Settings::new(100_000, 6) };
    let outcomes = run.run(&[], &settings, Control::default()).unwrap();
    let paths = outcomes[0].paths as f64;
    let counts = outcomes.iter().map(|outcome| paths * outcome.total.ledger.escaped());
    let chi_square: f64 = counts
        .zip(shares)
        .filter(|(_, share)| *share > 0.0)
        .map(|(count, share)| (count - paths * share).powi(2) / (paths * share))
        .sum();
    // Three degrees of freedom: above 16.3 in one of a thousand.
    assert!(chi_square < 16.3, "{chi_square}");
    assert!(outcomes[3].total.ledger.escaped() <= 0.0);
}

/// Absorption of the dye Fluro Red over the wavelength in nm, 1 at its peak, and photons that it
/// emits per nm: fits in `pvtrace/data/fluro_red.py` of pvtrace 2.1.4 (D. J. Farrell).
fn fluro_red(nm: f64) -> [f64; 2] {
    let peaks = [
        [549.064_388_435_621_4, 439.067_548_046_269_6, 24.298_601_639_828_65],
        [379.486_457_974_685_7, 85.177_292_848_284_35, 13.513_987_279_089_216],
        [519.588_589_771_315_1, 660.173_129_601_724_1, 38.263_352_007_649_125],
        [490.056_256_085_927_26, 511.115_016_152_910_4, 52.213_294_432_464_53],
    ];
    let sum = |nm: f64| -> f64 {
        peaks.iter().map(|[at, height, width]| height * (-((at - nm) / width).powi(2)).exp()).sum()
    };
    let largest = (400..=800).map(|nm| sum(f64::from(nm))).fold(0.0, f64::max);
    // An exponential of length d after a Gaussian about b with deviation c.
    // Rounding leaves a little below 0 far down.
    let [b, c, d] = [592.064_788_745_488_4, 19.981_040_318_195_117, 12.723_704_058_786_568];
    let reach = ((nm - b) / c - c / d) / 2f64.sqrt();
    let emission = (c * c / (2.0 * d * d) - (nm - b) / d).exp() * (1.0 + erf(reach)).max(0.0);
    [sum(nm) / largest, emission]
}

/// The error function, by the trapezoidal rule.
fn erf(x: f64) -> f64 {
    let steps = 2000;
    let height = |k: i32| (-(x * f64::from(k) / f64::from(steps)).powi(2)).exp();
    let inner: f64 = (1..steps).map(height).sum();
    2.0 / std::f64::consts::PI.sqrt() * x / f64::from(steps)
        * (inner + 0.5 * (height(0) + height(steps)))
}

/// A luminescent plate of 48 x 18 x 2.6 mm, lit from above by white light: shares of the photons
/// that leave by its bottom and by its top, what the top reflects included. Means of three programs:
/// R. Bose, thesis, Imperial College 2014, Fig. 3.21, as read in `examples/Validation.ipynb` of
/// pvtrace; within 0.008.
#[test]
fn a_luminescent_plate_is_that_of_three_programs() {
    let nm: Vec<f64> = (0..=80).map(|k| 400.0 + 5.0 * f64::from(k)).collect();
    let scene = |node: usize| {
        let [absorption, _] = fluro_red(nm[node]);
        // Nothing is emitted with more energy than was absorbed.
        let photons: Vec<f64> = nm
            .iter()
            .enumerate()
            .map(|(k, nm)| if k < node { 0.0 } else { fluro_red(*nm)[1] })
            .collect();
        let dye = Luminophore::new("dye", 1.138_781_5 * absorption, 0.95, &photons).unwrap();
        let medium = Medium::clear("host", 1.5).absorbing(0.002).luminescent(vec![dye]);
        let [x, y] = [24.0, 9.0];
        let low = DVec3::new(-x, -y, -2.6);
        let plate = Shape::cuboid(low, DVec3::new(x, y, 0.0)).unwrap();
        let faces = ["edges", "top", "bottom"].map(|n| Patch::new(n, SurfaceModel::Interface));
        let mut scene = SceneBuilder::new(Medium::air());
        let id = scene.prototype(Prototype {
            media: vec![medium],
            surfaces: vec![Surface::zoned(plate, BODY, Region::World, faces.to_vec())],
            sources: Vec::new(),
        });
        scene.place(id, DVec3::ZERO);
        let lamp = Emitter::Rectangle { half_x: x, half_y: y };
        let beam = Emission::Beam { direction: -DVec3::Z };
        scene.source(Source::new("lamp", DVec3::Z, Region::World, lamp, beam));
        scene.build().unwrap()
    };
    let scenes: Vec<Scene> = (0..nm.len()).map(scene).collect();
    let scenes: Vec<&Scene> = scenes.iter().collect();
    let peak =
        |nm: f64, height: f64, at: f64, width: f64| height * (-((at - nm) / width).powi(2)).exp();
    // Numbers of photons; power is what sources emit.
    let lamp = |nm: &f64| {
        (peak(*nm, 0.530_257, 512.914, 93.491_84) + peak(*nm, 0.635_79, 577.631, 66.031_71)) / nm
    };
    let run = WavelengthRun {
        wavelengths_nm: &nm,
        scenes: &scenes,
        emission: &[nm.iter().map(lamp).collect()],
        channels: std::slice::from_ref(&nm),
    };
    let outcome = run.run(&[], &Settings::new(many() / 12, 7), Control::default()).unwrap();
    let share = |of: fn(&tracer::Ledger) -> f64| {
        outcome[0].jackknife(|totals| of(&totals.ledger) / totals.ledger.emitted)
    };
    let bottom = share(|ledger| ledger.surface("bottom").expect("a face").outward);
    let top = share(|ledger| {
        let face = ledger.surface("top").expect("a face");
        ledger.emitted - face.inward + face.outward
    });
    for (found, expected) in [(bottom, 0.4962), (top, 0.1366)] {
        let error = found.standard_error.hypot(0.008 / 5.0);
        assert!((found.value - expected).abs() < 5.0 * error, "{found:?} {expected}");
        assert!(found.standard_error < 2e-3);
    }
}

/// Keeps groups and gives them back.
#[derive(Default)]
struct Shelf(Mutex<BTreeMap<u64, Vec<u8>>>);

impl CheckpointStore for Shelf {
    fn find(&self, group: u64) -> Option<Vec<u8>> {
        self.0.lock().unwrap().get(&group).cloned()
    }

    fn keep(&self, group: u64, bytes: &[u8]) {
        self.0.lock().unwrap().insert(group, bytes.to_vec());
    }
}

#[test]
fn a_stopped_run_goes_on_to_the_same_bits_on_any_number_of_threads() {
    let scenes = cascade(0.9, 0.2);
    let scenes: Vec<&Scene> = scenes.iter().collect();
    let run = WavelengthRun {
        wavelengths_nm: &COLOURS_NM,
        scenes: &scenes,
        emission: &[vec![0.7, 0.3, 0.0]],
        channels: &[vec![1.0; 3], vec![0.2, 0.9, 0.5]],
    };
    let (far, settings) = (FarField::default(), Settings::new(6400, 8));
    let shelf = Shelf::default();
    let keeping = Control { checkpoints: Some(&shelf), ..Control::default() };
    run.run_groups(&[&far], &settings, keeping, 5..40).unwrap();
    assert_eq!(shelf.0.lock().unwrap().len(), 35);
    let with = |threads: usize, control: Control<'_>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run.run(&[&far], &settings, control)).unwrap()
    };
    let whole = with(1, Control::default());
    assert!(whole == with(3, keeping) && whole == with(2, keeping));
    assert!(whole[0].total.readings[0].iter().sum::<f64>() > 0.3);
}

#[test]
fn lists_that_do_not_fit_are_refused() {
    let scenes = cascade(0.9, 0.2);
    let scenes: Vec<&Scene> = scenes.iter().collect();
    let whole = WavelengthRun {
        wavelengths_nm: &COLOURS_NM,
        scenes: &scenes,
        emission: &[vec![1.0, 0.0, 0.0]],
        channels: &[vec![1.0; 3]],
    };
    let error = |run: WavelengthRun<'_>| {
        let done = run.run(&[], &Settings::new(64, 1), Control::default());
        done.expect_err("it does not fit").to_string()
    };
    let few = WavelengthRun { scenes: &scenes[..2], ..whole };
    assert!(error(few).contains("number of wavelengths"));
    let two = [vec![1.0, 0.0, 0.0], vec![1.0, 0.0, 0.0]];
    assert!(error(WavelengthRun { emission: &two, ..whole }).contains("number of sources"));
    let dark = WavelengthRun { emission: &[vec![0.0; 3]], ..whole };
    assert!(error(dark).contains("power of a source"));
    let odd = ball(Medium::clear("other", 1.5));
    let other = [scenes[0], scenes[1], &odd];
    assert!(error(WavelengthRun { scenes: &other, ..whole }).contains("number of sources"));
    assert!(Luminophore::new("dye", 1.0, 1.1, &[1.0]).is_err());
    assert!(Luminophore::new("dye", -1.0, 0.5, &[1.0]).is_err());
    assert!(Luminophore::new("dye", 1.0, 0.5, &[0.0, 0.0]).is_err());
    assert!(Luminophore::new("dye", 1.0, 0.5, &[1.0, f64::NAN]).is_err());
}
