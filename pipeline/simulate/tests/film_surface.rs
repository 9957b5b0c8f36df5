// SPDX-License-Identifier: MIT OR Apache-2.0
//! Film stacks as surfaces and as files of other programs: closed forms, conservation, and what a
//! file gives where it is read back.

use std::path::Path;

use bsdf::angular_basis::AngularBasis;
use bsdf::direction::{mirrored, spherical};
use bsdf::{Bsdf, LobeMotion, Polarisation, Side, Transport};
use design::Design;
use formats::convert::Resolution;
use formats::scattering::Scattering;
use formats::tables::{CellTable, Fineness};
use formats::{Writer, Writes, window, zemax};
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::film_surface;
use simulate::model::Model;
use simulate::trace::observe;
use tracer::StackLight;

/// Four LEDs on a white board between white walls.
const BOX: &str = r#"
name = "stack"
light = { wavelength_nm = 550.0 }
mirror = { kind = "lambertian", reflectance = 0.9, extent = "array" }
led = { size_mm = [0.5, 0.4], height_mm = 0.15, reflection = "lambertian", reflectance = 0.8 }
array = { columns = 2, rows = 2, pitch_mm = 6.0 }
housing = { kind = "lambertian", reflectance = 0.95, height_mm = 8.0, inner_size_mm = [12.0, 12.0] }
receiver = { plane_height_mm = 7.0, bin_mm = 1.5, average = "none" }
"#;

const CLEAR: &str = r#"
[[films]]
name = "plate"
z_mm = 4.0
thickness_mm = 1.0
medium = { index = 1.49 }
"#;

const STACK: &str = r#"
[[films]]
name = "plate"
z_mm = 4.0
thickness_mm = 1.0
medium = { index = 1.49, scattering_per_mm = 1.0, g = 0.8, absorption_per_mm = 0.05 }

[[films]]
name = "prisms"
thickness_mm = 0.125
medium = { index = 1.586 }
top = { kind = "prisms", direction_deg = 20.0 }

[[films]]
name = "lenses"
thickness_mm = 0.125
medium = { index = 1.5 }
top = { kind = "microlenses", cell = "hexagonal", height_um = 15.0 }
"#;

fn parsed(films: &str, folder: &Path) -> Design {
    design::parse("own.toml", &format!("{BOX}{films}"), folder)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Writes the films of a design, with this number of paths for an incidence.
fn written(design: &Design, writer: &Writer, fineness: &Fineness, path: &Path) {
    let samples = fineness.resolution.samples as u64;
    let surface = film_surface::surface(design, PATHS / samples, 5).expect("films");
    let Writes::Cells { write, .. } = writer.writes else { panic!("cells") };
    let cells = CellTable { surface: &surface, fineness, wavelength_nm: Some(550.0) };
    let files = write(&cells, path).expect("a file");
    for incidence in files.iter().flat_map(|file| &file.smearing.incidences) {
        assert!((incidence.before - incidence.after).abs() < 1e-5, "{incidence:?}");
    }
}

const PATHS: u64 = 8192;

fn fineness() -> Fineness {
    let resolution =
        Resolution { incidence_deg: 30.0, azimuth_deg: 60.0, scatter_deg: 5.0, samples: 64 };
    Fineness { resolution, tree_log2: 4 }
}

/// Within 4.5 standard errors.
fn agree(what: &str, value: f64, expected: f64, error: f64) {
    let off = (value - expected) / error;
    assert!(off.abs() < 4.5, "{what}: {value} instead of {expected}, {off:.1} errors");
}

/// R = 2r/(1 + r), T = (1 - r)/(1 + r), straight on and mirrored, and of a file in the cell of the
/// incidence alone.
#[test]
fn a_clear_plate_is_its_closed_form() {
    let design = parsed(CLEAR, Path::new(""));
    let surface = film_surface::surface(&design, PATHS, 1).expect("films");
    for side in Side::BOTH {
        for (theta, phi) in [(0.0_f64, 0.0), (0.7, 1.0), (1.3, 4.0)] {
            let wi = spherical(theta, phi) * glam::DVec3::new(1.0, 1.0, side.sign());
            let r = bsdf::analytic::fresnel(1.0, 1.49, theta.cos());
            let r = r.for_polarisation(Polarisation::Unpolarised);
            let (back, through) = (2.0 * r / (1.0 + r), (1.0 - r) / (1.0 + r));
            let lobes = surface.lobes(wi, Polarisation::Unpolarised);
            assert_eq!(lobes, surface.lobes(wi, Polarisation::Unpolarised));
            for lobe in &lobes {
                let straight = match lobe.lobe.transport {
                    Transport::Reflection => mirrored(wi),
                    Transport::Transmission => -wi,
                };
                assert!((lobe.wo - straight).length() < 1e-6);
            }
            let albedo = surface.albedo(wi, Polarisation::Unpolarised);
            let error = (back * through / PATHS as f64).sqrt();
            agree("reflected", albedo.reflected, back, error);
            agree("transmitted", albedo.transmitted, through, error);
        }
    }

    for deg in [0.0, 62.0, 81.0_f64] {
        let r = bsdf::analytic::fresnel(1.0, 1.49, deg.to_radians().cos());
        let r = r.for_polarisation(Polarisation::Unpolarised);
        let (back, through) = (2.0 * r / (1.0 + r), (1.0 - r) / (1.0 + r));
        let light = StackLight::Angle(deg);
        let shares = surface.shares(Side::Outer, light, PATHS);
        agree("reflected", shares.reflected.value, back, shares.reflected.standard_error);
        agree("transmitted", shares.transmitted.value, through, shares.transmitted.standard_error);
        // All of it leaves in the bin of the angle.
        for (own, share) in
            surface.intensity(Side::Outer, light, PATHS, 9).iter().zip([through, back])
        {
            let bin = (deg / 10.0) as usize;
            let ends = [bin, bin + 1].map(|end| (10.0 * end as f64).to_radians().cos());
            let solid_angle = std::f64::consts::TAU * (ends[0] - ends[1]);
            agree("intensity", own[bin].value, share / solid_angle, own[bin].standard_error);
            assert!(own.iter().enumerate().all(|(k, other)| k == bin || other.value == 0.0));
        }
    }

    let (file, _) = window::convert::to_klems(&surface, 2).expect("a matrix");
    for block in &file.blocks {
        let window::layout::ScatteringData::Klems(matrix) = &block.data else { panic!("Klems") };
        let cells = AngularBasis::klems();
        let count = cells.len();
        for (number, value) in matrix.iter().enumerate() {
            let (exit, incidence) = (number / count, number % count);
            assert!((exit == incidence) == (*value > 0.0), "{exit} {incidence} {value}");
        }
    }
}

#[test]
fn what_passes_comes_back_and_is_absorbed_is_all() {
    let polarising =
        "polariser\", axis_deg = 30.0, pass = { transmittance = 0.9, reflectance = 0.05 } }\n";
    let sheet = format!(
        "[[films]]\nname = \"sheet\"\nthickness_mm = 0.1\nmedium = {{ index = 1.0 }}\ntop = {{ kind = \"{polarising}"
    );
    let carried = BOX.replace("550.0 }", "550.0, polarization = \"carried\" }");
    let polarised = design::parse("own.toml", &format!("{carried}{STACK}{sheet}"), Path::new(""));
    for design in [parsed(STACK, Path::new("")), polarised.expect("a design")] {
        let surface = film_surface::surface(&design, 64, 1).expect("films");
        for side in Side::BOTH {
            let shares = surface.shares(side, StackLight::Diffuse, 20_000);
            let parts = [shares.reflected, shares.transmitted, shares.absorbed];
            let sum: f64 = parts.iter().map(|part| part.value).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{shares:?}");
            assert!(parts.iter().all(|part| part.value > 0.01 && part.standard_error < 0.01));
        }
    }
}

/// Films turned upside down do to light from above what they did to light from below, whatever is in
/// them; the lower one alone does something else.
#[test]
fn turned_stacks_do_from_above_what_they_did_from_below() {
    let film = |name: &str, keys: &str| {
        format!("[[films]]\nname = \"{name}\"\nthickness_mm = 1.0\nmedium = {{ {keys} }}\n")
    };
    let milky =
        film("milky", "index = 1.49, scattering_per_mm = 2.0, g = 0.7, absorption_per_mm = 0.05");
    let tinted = film("tinted", "index = 1.6, scattering_per_mm = 0.3, absorption_per_mm = 0.4");
    let shares = |films: &[&str], side: Side| {
        let films = films.concat().replacen("]\n", "]\nz_mm = 3.0\n", 1);
        let surface = film_surface::surface(&parsed(&films, Path::new("")), 64, 3);
        let shares = surface.expect("films").shares(side, StackLight::Diffuse, 100_000);
        [shares.reflected, shares.transmitted, shares.absorbed]
    };
    let below = shares(&[&milky, &tinted], Side::Inner);
    let above = shares(&[&tinted, &milky], Side::Outer);
    for (a, b) in below.iter().zip(&above) {
        agree("from both sides", a.value, b.value, a.standard_error.hypot(b.standard_error));
    }
    let one = shares(&[&milky], Side::Outer);
    assert!((one[2].value - above[2].value).abs() > 0.05, "{one:?} {above:?}");
}

/// Shares of diffuse light by the file are those that the films give themselves.
#[test]
#[ignore = "nightly: a matrix and a tree of a stack (30 s)"]
fn nightly_files_hold_the_shares_of_diffuse_light() {
    let folder = tempfile::tempdir().expect("a folder");
    let design = parsed(STACK, folder.path());
    let surface = film_surface::surface(&design, 1, 9).expect("films");
    let cells = AngularBasis::klems();
    for (name, writer) in [("klems.xml", &window::KLEMS), ("tree.xml", &window::TENSOR_TREE)] {
        written(&design, writer, &fineness(), &folder.path().join(name));
        let file = Scattering::load(Some(name), [&[], &[]], LobeMotion::Fixed, folder.path());
        let file = file.expect("a file").bsdf([1.0, 1.0]).expect("a surface");
        for side in Side::BOTH {
            // The mean over cells of 145 directions, by their shares of diffuse light.
            let mean = |of: &dyn Fn(bsdf::Albedo) -> f64| -> f64 {
                let points = 16;
                (0..cells.len())
                    .flat_map(|cell| (0..points * points).map(move |k| (cell, k)))
                    .map(|(cell, k)| {
                        let at = |k: usize| (k as f64 + 0.5) / points as f64;
                        let wi = cells.sample_projected(cell, at(k % points), at(k / points));
                        let wi = wi * glam::DVec3::new(1.0, 1.0, side.sign());
                        let share = cells.projected_solid_angle(cell) / std::f64::consts::PI;
                        share * of(file.albedo(wi, Polarisation::Unpolarised))
                            / (points * points) as f64
                    })
                    .sum()
            };
            let own = surface.shares(side, StackLight::Diffuse, 200_000);
            // Of all cells of a file together.
            let of_file = 0.5 / (PATHS as f64 * cells.len() as f64).sqrt();
            let (back, through) = (mean(&|a| a.reflected), mean(&|a| a.transmitted));
            let error = |e: tracer::Estimate| e.standard_error.hypot(of_file);
            agree(name, back, own.reflected.value, error(own.reflected));
            agree(name, through, own.transmitted.value, error(own.transmitted));
        }
    }
}

/// The design with the file in place of its films lets the same light out.
#[test]
#[ignore = "slow: a stack and its file in a housing, over eight seeds (20 s)"]
fn a_file_in_place_of_the_films_lets_the_same_light_out() {
    let folder = tempfile::tempdir().expect("a folder");
    // Cells that repeat have no walls that light meets between films, or beside a sheet.
    let endless = |films: &str| {
        let walls = "kind = \"lambertian\", reflectance = 0.95";
        let text = format!("{BOX}{films}").replace(walls, "kind = \"periodic\"");
        design::parse("own.toml", &text, folder.path()).unwrap_or_else(|error| panic!("{error}"))
    };
    let own = endless(STACK);
    written(&own, &window::KLEMS, &fineness(), &folder.path().join("stack.xml"));
    let sheet = "[[films]]\nname = \"sheet\"\nz_mm = 4.0\nthickness_mm = 1.0\nmedium = { index = 1.0 }\n\
                 top = { kind = \"file\", file = \"stack.xml\" }\n";
    let replaced = endless(sheet);
    let escaped = |design: &Design| -> Vec<f64> {
        let of_seed = |seed: u64| {
            let interrupt = Interrupt::default();
            let context = RunContext::quiet(&interrupt, seed);
            let surface = dome_surface(design, Model::Geometric, None).expect("no dome");
            let seen = observe(design, &surface, 64_000, "", context).expect("a trace");
            let accounts = seen.ledger().accounts;
            accounts.iter().find(|(name, _)| name == "escaped_up").expect("an account").1.value
        };
        (1..=8).map(of_seed).collect()
    };
    let moments = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        (mean, (square / (values.len() * (values.len() - 1)) as f64).sqrt())
    };
    let (direct, direct_error) = moments(&escaped(&own));
    let (by_file, file_error) = moments(&escaped(&replaced));
    // The noise of the file itself, which all seeds share.
    let of_file = 0.5 / (PATHS as f64 * 145.0).sqrt();
    let error = direct_error.hypot(file_error).hypot(of_file);
    agree("escaped upwards", by_file, direct, error);
    assert!(direct > 0.2 && error < 3e-3, "{direct} {error}");
}

#[test]
fn stacks_that_no_file_holds_are_refused() {
    let refused = |films: &str| {
        let design = parsed(films, Path::new(""));
        film_surface::surface(&design, 1, 1).err().expect("refused").to_string()
    };
    assert!(refused("").contains("own.toml: films: expected at least one table, got none"));
    let dots = r#"
[[films]]
name = "dots"
z_mm = 4.0
thickness_mm = 0.1
[films.medium]
index = 1.5
[[films.medium.luminophores]]
name = "green"
absorption_per_mm = [[400, 4.0], [560, 1.0]]
quantum_yield = 0.9
emission = { peak_nm = 600, fwhm_nm = 40 }
"#;
    let said = refused(dots);
    assert!(said.contains("films[1].medium.luminophores: expected films that keep"), "{said}");
}

/// Formats of one side and transport a file take the stack too.
#[test]
fn zemax_files_hold_the_stack() {
    let folder = tempfile::tempdir().expect("a folder");
    let design = parsed(CLEAR, folder.path());
    written(&design, &zemax::WRITER, &fineness(), &folder.path().join("stack.bsdf"));
    assert!(folder.path().read_dir().expect("files").count() >= 4);
}
