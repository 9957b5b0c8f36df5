// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[sources]]` of a design: shares of power, irradiance of receivers, faces of a chip.
//!
//! Sources: solid angles and view factors in closed form; the same light by other keys.

use std::fs::File;
use std::path::Path;

use formats::lighttools_rays::layout as lighttools_rays;
use tracer::RayRecord;

use design::Design;
use metrics::{Estimate, jackknife};
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::trace::observe;

const DOMED: &str = include_str!("../../data/designs/bare-dome.toml");
const PATHS: u64 = 400_000;

/// A box in air without reflections: what the sources send is what arrives.
const BARE: &str = r#"
name = "bare"
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
"#;

fn parse(text: &str) -> Design {
    design::parse("lamps.toml", text, Path::new("")).unwrap_or_else(|e| panic!("{e}"))
}

fn seen(design: &Design) -> Observation {
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, 23);
    let surface = dome_surface(design, Model::Geometric, None).expect("a surface");
    observe(design, &surface, PATHS, "", env).expect("a trace")
}

/// The sum of all bins of receiver `number`.
fn reading(seen: &Observation, number: usize) -> Estimate {
    jackknife(&seen.receivers[number], |bins| bins.iter().sum())
}

fn close(what: &str, found: Estimate, expected: f64) {
    let error = found.standard_error.max(2.0 / PATHS as f64);
    let off = (found.value - expected) / error;
    assert!(off.abs() < 4.5, "{what}: {found:?} for {expected}: {off}");
}

fn plane(name: &str, [x, y, z]: [f64; 3], size: f64, only: &str) -> String {
    format!(
        "[[receivers]]\nname = \"{name}\"\nkind = \"plane\"\nposition_mm = [{x:?}, {y:?}, {z:?}]\nsize_mm = [{size:?}, {size:?}]\nbins = [4, 4]\nonly = {only}\n"
    )
}

/// Share of the light of an isotropic point through a square of half length a at height h above it.
fn through_square(a: f64, h: f64) -> f64 {
    (a * a / (h * (2.0 * a * a + h * h).sqrt())).atan() / std::f64::consts::PI
}

#[test]
fn points_light_rectangles_by_their_solid_angle() {
    let text = format!(
        "{BARE}\n{}{}{}\n
[[sources]]
name = \"all around\"
kind = \"isotropic\"
position_mm = [2.0, 1.0, 1.0]
power = 3.0
[[sources]]
name = \"beam\"
kind = \"cosine\"
exponent = 40.0
position_mm = [-2.0, 0.0, 0.5]
normal = [0.0, 0.0, 2.0]
",
        plane("a", [2.0, 1.0, 3.0], 2.0, "{ sources = [\"all around\"] }"),
        plane("b", [-2.0, 0.0, 3.5], 6.0, "{ sources = [\"beam\"] }"),
        plane("c", [0.0, 0.0, 5.0], 400.0, "{ sources = [\"beam\", \"all around\"] }"),
    );
    let design = parse(&text);
    scene_check::check(&design).expect("sources in air");
    let seen = seen(&design);
    // Three quarters of the power by the first, a quarter by the second.
    close("square", reading(&seen, 0), 0.75 * through_square(1.0, 2.0));
    // I = (m + 1) / 2π cos^m over the square: by Simpson's rule, 200 x 200.
    let lobe = |m: f64, a: f64, h: f64| {
        let (n, step) = (200, 2.0 * a / 200.0);
        let weight = |k: usize| match k {
            0 => 1.0,
            k if k == n => 1.0,
            k if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let at = |k: usize| k as f64 * step - a;
        let mut sum = 0.0;
        for i in 0..=n {
            for j in 0..=n {
                let r2 = at(i).powi(2) + at(j).powi(2) + h * h;
                sum += weight(i) * weight(j) * (h / r2.sqrt()).powf(m) * h / r2.powf(1.5);
            }
        }
        (m + 1.0) / std::f64::consts::TAU * sum * step * step / 9.0
    };
    close("lobe", reading(&seen, 1), 0.25 * lobe(40.0, 3.0, 3.0));
    let wide = 0.75 * through_square(200.0, 4.0) + 0.25 * lobe(40.0, 18.0, 4.5);
    // The squares of the closed forms are centred on the sources: 2 mm of 400 aside, less than the
    // error.
    close("half of all, and all", reading(&seen, 2), wide);
}

#[test]
fn faces_of_a_chip_share_its_power() {
    let text = format!(
        "{BARE}\n{}{}{}{}{}\n
[[sources]]
name = \"chip\"
kind = \"chip\"
face_powers = [6.0, 1.0, 0.5, 1.5, 1.0]
",
        plane("up", [0.0, 0.0, 2.0], 1e6, "{ sources = [\"chip\"] }"),
        upright("right", "+x", [0.7, 0.0, 500.0]),
        upright("left", "-x", [-0.7, 0.0, 500.0]),
        upright("back", "+y", [0.0, 0.5, 500.0]),
        upright("front", "-y", [0.0, -0.5, 500.0]),
    );
    let design = parse(&text);
    scene_check::check(&design).expect("a chip");
    let seen = seen(&design);
    // Half of a side's light goes up; the other half ends on the black floor.
    close("up", reading(&seen, 0), 0.6 + 0.5 * 0.4);
    // The planes beside opposite faces get the same of all other faces; of their own all of its
    // upper half and some of its lower one, whose rest ends on the floor.
    let [right, left, back, front] = [1, 2, 3, 4].map(|k| reading(&seen, k).value);
    for (more, less) in [(right, left), (back, front)] {
        let per_power = (more - less) / 0.05;
        assert!((0.5..1.0).contains(&per_power), "{more} {less}");
    }
}

/// Of cosⁿ the share 1 - cosⁿ⁺¹ of a face's light goes into a cone about its normal, of a table its
/// integral over the solid angle.
#[test]
fn faces_of_a_chip_emit_by_their_laws() {
    let cone = "[[receivers]]\nname = \"far\"\nkind = \"far_field\"\ntheta_bin_deg = 30.0\nphi_bin_deg = 360.0\n";
    let shares = |powers: &str, laws: &str| {
        let text = format!(
            "{BARE}\n{cone}\n[[sources]]\nname = \"chip\"\nkind = \"chip\"\nface_powers = {powers}\n{laws}\n"
        );
        let seen = seen(&parse(&text));
        [0, 1].map(|bin| jackknife(&seen.receivers[0], |bins| bins[bin]))
    };
    let top = "[1.0, 0.0, 0.0, 0.0, 0.0]";
    let within = |power: i32| 1.0 - 30f64.to_radians().cos().powi(power);
    let cube = shares(top, "top = { exponent = 3.0 }");
    close("cube", cube[0], within(4));
    // Lambert's law is far off.
    assert!((cube[0].value - within(2)).abs() > 50.0 * cube[0].standard_error, "{cube:?}");
    // Dark but for a ring: all of its light lies in it.
    let ring = "top = { angle_deg = [0, 30, 30.001, 60, 60.0001], intensity = [0, 0, 1, 1, 0] }";
    let found = shares(top, ring);
    close("ring", found[1], 1.0);
    // Of a side `across` counts upwards: all of the light goes up, or none.
    let up = |across: &str| {
        let law =
            format!("angle_deg = [-60, 0, 0.001, 60], intensity = [0, 0, 0, 0], across = {across}");
        let text = format!(
            "{BARE}\n[[sources]]\nname = \"chip\"\nkind = \"chip\"\nface_powers = [0, 1, 1, 1, 1]\n\
             sides = {{ {law} }}\n"
        );
        let ledger = seen(&parse(&text)).ledger();
        ledger.accounts.iter().find(|(name, _)| name == "escaped_up").expect("an account").1.value
    };
    assert!(up("[0, 0, 1, 1]") > 0.999 && up("[1, 1, 0, 0]") < 1e-3);
    // Sides shine level and add nothing to the cone about the normal of the top.
    let both =
        shares("[0.6, 0.1, 0.1, 0.1, 0.1]", "top = { exponent = 3.0 }\nsides = { exponent = 1e5 }");
    close("top beside sides", both[0], 0.6 * within(4));
}

fn upright(name: &str, normal: &str, [x, y, z]: [f64; 3]) -> String {
    format!(
        "[[receivers]]\nname = \"{name}\"\nkind = \"plane\"\nposition_mm = [{x:?}, {y:?}, {z:?}]\nnormal = \"{normal}\"\nsize_mm = [1000.0, 1000.0]\nbins = [2, 2]\n"
    )
}

#[test]
fn in_the_plane_of_the_mirror_only_what_faces_up_may_lie() {
    let check = |source: &str| {
        let text =
            format!("{BARE}\n[[sources]]\nname = \"a\"\nposition_mm = [1.5, 0, 0]\n{source}\n");
        design::parse("lamps.toml", &text, Path::new(""))
            .map_err(anyhow::Error::from)
            .and_then(|design| scene_check::check(&design))
    };
    let rectangle = "kind = \"rectangle\"\nsize_mm = [0.5, 0.5]";
    check(rectangle).expect("faces up");
    check("kind = \"cosine\"\nexponent = 1").expect("faces up");
    for source in [
        "kind = \"isotropic\"",
        "kind = \"cosine\"\nexponent = 1\nnormal = [1, 0, 1]",
        &format!("{rectangle}\nnormal = [0, 0, -1]"),
    ] {
        let error = check(source).expect_err(source).to_string();
        assert!(error.contains("sources[1].position_mm = [1.5, 0.0, 0.0]"), "{error}");
        assert!(
            error.contains("lies in the surface of") && error.contains("emits into it"),
            "{error}"
        );
    }
    // What lies there emits all of its light upwards.
    let design = parse(&format!(
        "{BARE}\n[[sources]]\nname = \"a\"\nposition_mm = [1.5, 0, 0]\n{rectangle}\n"
    ));
    let ledger = seen(&design).ledger();
    let up = ledger.accounts.iter().find(|(name, _)| name == "escaped_up").expect("an account").1;
    let box_side = ledger
        .accounts
        .iter()
        .filter(|(name, _)| name.starts_with("absorbed_by_box"))
        .map(|(_, e)| e.value)
        .sum::<f64>();
    assert!((up.value + box_side - 1.0).abs() < 1e-9 && up.value > 0.9, "{ledger:?}");
}

#[test]
fn a_rectangle_on_the_box_is_the_box() {
    let design = parse(DOMED);
    let stated = format!(
        "{DOMED}\n[[sources]]\nname = \"top\"\nkind = \"rectangle\"\nposition_mm = [0.0, 0.0, 0.35]\nsize_mm = [1.0, 1.0]\n"
    );
    let chip = format!(
        "{DOMED}\n[[sources]]\nname = \"top\"\nkind = \"chip\"\nface_powers = [2.0, 0.0, 0.0, 0.0, 0.0]\n"
    );
    let expected = seen(&design);
    for text in [stated, chip] {
        let found = seen(&parse(&text));
        assert_eq!(found.far_field, expected.far_field);
        assert_eq!(found.illuminance, expected.illuminance);
    }
}

#[test]
fn sources_in_every_package_add_up() {
    let lamps = "
[[sources]]
name = \"chip\"
kind = \"chip\"
face_powers = [4.0, 1.0, 1.0, 1.0, 1.0]
[[sources]]
name = \"glow\"
kind = \"isotropic\"
position_mm = [0.3, 0.2, 0.6]
power = 0.5
";
    let far = |name: &str, only: &str| {
        format!(
            "[[receivers]]\nname = \"{name}\"\nkind = \"far_field\"\ntheta_bin_deg = 90.0\nphi_bin_deg = 90.0\n{only}\n"
        )
    };
    let text = format!(
        "{DOMED}\n{lamps}{}{}{}{}{}",
        far("all", ""),
        far("chip", "only = { sources = [\"chip\"] }"),
        far("glow", "only = { sources = [\"glow\"] }"),
        far("second", "only = { sources = [\"chip\", \"glow\"], packages = [2] }"),
        far("rest", "only = { packages = [1, 3, 4] }"),
    );
    let design = parse(&text);
    scene_check::check(&design).expect("sources in silicone");
    for crossing in [true, false] {
        let mut design = design.clone();
        design.array.crossing = crossing;
        let seen = seen(&design);
        let sum = |number: usize| seen.receivers[number].total().iter().sum::<f64>();
        assert!((sum(0) - sum(1) - sum(2)).abs() < 1e-12, "{crossing}");
        assert!((sum(0) - sum(3) - sum(4)).abs() < 1e-12, "{crossing}");
        assert!(sum(2) > 0.2 && sum(1) > 1.5 * sum(2) && sum(3) > 0.2, "{crossing}");
        for (account, value) in seen.ledger().accounts {
            assert!(!account.starts_with("lost") || value.value < 1e-6, "{account}");
        }
    }
}

/// What is kept of a trace is found by the checked design: another file of the same name must be
/// another design.
#[test]
fn a_file_of_rays_belongs_to_the_design_by_its_content() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!(
        "{DOMED}\n[[sources]]\nname = \"rays\"\nkind = \"file\"\nposition_mm = [0.0, 0.0, 0.5]\nfile = \"up.ray\"\n"
    );
    let with = |direction: [f32; 3]| {
        let file = File::create(folder.path().join("up.ray")).expect("created");
        let mut writer = lighttools_rays::LightToolsWriter::new(file).expect("begun");
        let ray = RayRecord { position: [0.0; 3], direction, flux: 1.0, wavelength: 550.0 };
        writer.write(&ray).expect("written");
        writer.finish().expect("finished");
        let design = design::parse("lamps.toml", &text, folder.path()).expect("a design");
        serde_json::to_string(&design.sources).expect("JSON")
    };
    let up = with([0.0, 0.0, 1.0]);
    let aside = with([0.6, 0.0, 0.8]);
    assert_eq!(up, with([0.0, 0.0, 1.0]));
    assert_ne!(up, aside);
}
