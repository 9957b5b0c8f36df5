// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sources with spectra of their own: sums of runs of one colour, lumens, ledgers, interruption.
//!
//! Sources: `docs/reference/design-file.md`, `docs/reference/results-schema.md`; 683 lm/W, CIE
//! 018:2019 for V.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use batwing_tests::bad_input::good;
use batwing_tests::statistics::agree;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::spectral::SpectralJob;
use simulate::trace::observe;

use crate::support::binary::batwing;
use crate::support::runs::{contents, estimate, files, interrupted, results, run_text};

/// A hemisphere of a glass that disperses, absorbs blue, and stands on a mirror.
const DOME: &str = r#"
name = "two"
dome = { sphere_radius_mm = 2.0, height_mm = 2.0, width_mm = 4.0 }
silicone = { material_file = "glass.yml" }
mirror = { kind = "specular", reflectance = 0.9, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.5, reflection = "specular" }
array = { columns = 2, rows = 1, pitch_mm = 6.0 }
receiver = { bin_mm = 0.5 }
far_field = { bin_deg = 5.0, azimuth_bin_deg = 30.0, centre_deg = 10.0, peak_fit_deg = 10.0 }
trace = { paths = 200_000 }
"#;

/// n and k fall from 400 to 800 nm: 1.6 to 1.4, 2e-5 to 0.
const GLASS: &str =
    "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1.6 2e-5\n        0.8 1.4 0\n";

const LEFT: &str = "[[sources]]\nname = \"left\"\nkind = \"isotropic\"\nposition_mm = [-0.6, 0.3, 0.8]\npower = 3.0\n";
const RIGHT: &str = "[[sources]]\nname = \"right\"\nkind = \"cosine\"\nexponent = 4.0\nnormal = [1.0, 0.0, 1.0]\nposition_mm = [0.7, 0.0, 0.5]\n";
const GREEN: &str = "light = { wavelength_nm = 550.0 }\n";

/// A folder with the glass in it.
fn folder() -> tempfile::TempDir {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("glass.yml"), GLASS).expect("written");
    folder
}

fn seen(text: &str, at: &Path, seed: u64) -> Observation {
    let design = design::parse("two.toml", text, at).unwrap_or_else(|e| panic!("{e}"));
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, seed);
    if let Some(lights) = design.all_lights() {
        let job = SpectralJob {
            design: &design,
            lights: &lights,
            model: Model::Geometric,
            cache: None,
            context: env,
        };
        return job.observe().expect("a trace");
    }
    let surface = dome_surface(&design, Model::Geometric, None).expect("a dome");
    observe(&design, &surface, design.trace.paths, "", env).expect("a trace")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

#[test]
fn two_colours_are_the_sum_of_two_runs() {
    let folder = folder();
    let at = folder.path();
    let both = format!("{GREEN}{DOME}{LEFT}wavelength_nm = 450.0\n{RIGHT}wavelength_nm = 650.0\n");
    let blue = format!("light = {{ wavelength_nm = 450.0 }}\n{DOME}{LEFT}");
    let red = format!("light = {{ wavelength_nm = 650.0 }}\n{DOME}{RIGHT}");
    let [both, blue, red] = [(both, 1), (blue, 2), (red, 3)].map(|(t, seed)| seen(&t, at, seed));
    let sum = Observation::weighted(&[(0.75, &blue), (0.25, &red)]);
    for (what, a, b) in [
        ("far field", &both.far_field, &sum.far_field),
        ("map", &both.illuminance, &sum.illuminance),
        ("ledger", &both.powers, &sum.powers),
    ] {
        // Bins with a few paths only say little of their error.
        agree(what, a, b, 2e-6);
    }
    // The two colours are no mere shades of each other: blue is held back, and it is absorbed.
    let account = |o: &Observation, name: &str| {
        let place = o.accounts.iter().position(|a| a == name).expect(name);
        o.powers.total()[place]
    };
    let absorbed = [&both, &blue, &red].map(|o| account(o, "absorbed_in_silicone"));
    assert!(absorbed[1] > 2.0 * absorbed[2] && absorbed[1] > absorbed[0], "{absorbed:?}");
}

#[test]
fn a_wavelength_of_the_only_source_is_that_of_the_design() {
    let folder = folder();
    let at = folder.path();
    // With a film, whose phase goes with the wavelength.
    let coated = "width_mm = 4.0, coating = [{ index = 1.2, thickness_nm = 95.0 }] }";
    let dome = DOME.replace("width_mm = 4.0 }", coated);
    let own = seen(&format!("{GREEN}{dome}{LEFT}wavelength_nm = 450.0\n"), at, 5);
    let of_design = format!("light = {{ wavelength_nm = 450.0 }}\n{dome}{LEFT}");
    let of_design = seen(&of_design, at, 5);
    // To the last bit, and so is a source that says what holds anyway.
    for other in [
        own,
        seen(
            &format!(
                "light = {{ wavelength_nm = 450.0 }}\n{dome}{LEFT}spectrum = {{ kind = \"lines\", wavelength_nm = [450.0], power = [1.0] }}\n"
            ),
            at,
            5,
        ),
    ] {
        assert_eq!(other.far_field, of_design.far_field);
        assert_eq!(other.illuminance, of_design.illuminance);
        assert_eq!(other.powers, of_design.powers);
    }
}

#[test]
fn tables_of_orders_are_those_of_the_colour() {
    let design = good(include_str!("../bad_input/design.toml"));
    let every = "shapes = [{ from = 1, to = 17, type = \"OS1\" }]";
    let one =
        "shapes = [{ from = 1, to = 1, type = \"OS1\" }, { from = 2, to = 17, type = \"smooth\" }]";
    let source = "\n[[sources]]\nname = \"top\"\nkind = \"rectangle\"\nposition_mm = [0.0, 0.0, 0.5]\nsize_mm = [0.5, 0.5]\n";
    let design = design.replace(every, one) + source;
    let folder = tempdir().expect("a folder");
    let flags = ["--model", "hybrid", "--paths", "20000", "--cache", "cache"];
    let ran = |name: &str, text: &str| {
        run_text(folder.path(), name, text, name, &flags).unwrap_or_else(|e| panic!("{e}"))
    };
    let own = ran("own", &format!("{design}wavelength_nm = 500.0\n"));
    let plain = "light = { wavelength_nm = 550.0 }";
    assert_eq!(design.matches(plain).count(), 1);
    let of_design = ran("design", &design.replace(plain, "light = { wavelength_nm = 500.0 }"));
    // One table, of 500 nm.
    assert_eq!(files(&folder.path().join("cache")).len(), 1);
    let model = |r: &Value| r["designs"]["bad"]["hybrid_10um"].clone();
    let (own, of_design) = (model(&own), model(&of_design));
    for key in ["uniformity", "extraction_efficiency", "power_ledger"] {
        assert_eq!(own[key], of_design[key], "{key}");
    }
    // More colours than tables may be solved at are refused before the first.
    let many: Vec<String> = (0..65).map(|k| format!("{}.0", 500 + k)).collect();
    let power = vec!["1.0"; 65].join(", ");
    let lines = format!(
        "{design}spectrum = {{ kind = \"lines\", wavelength_nm = [{}], power = [{power}] }}\n",
        many.join(", ")
    );
    let lines = lines.replace("array = {", "far_field = { azimuth_bin_deg = 45.0 }\narray = {");
    let refused = run_text(folder.path(), "many", &lines, "many", &flags[..2]);
    let said = refused.expect_err("refused");
    assert!(
        said.contains("[[sources]] at 65 wavelengths: expected at most 64 in the hybrid"),
        "{said}"
    );
    assert!(!folder.path().join("many").exists());
}

/// A box in air without reflections: what the sources send up is what arrives.
const BARE: &str = r#"
name = "bare"
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5 }
trace = { paths = 64_000 }
"#;

/// V of the standard (CIE 018:2019).
const V: [(f64, f64); 3] = [(450.0, 0.038), (555.0, 1.0), (650.0, 0.107)];

#[test]
fn lumens_are_watts_times_v_source_by_source() {
    let lamp = |name: &str, x: f64, power: f64, nm: f64| {
        format!(
            "[[sources]]\nname = \"{name}\"\nkind = \"cosine\"\nexponent = 1.0\nposition_mm = [{x:?}, 0.0, 1.0]\npower = {power:?}\nwavelength_nm = {nm:?}\n"
        )
    };
    let plane = |name: &str| {
        format!(
            "[[receivers]]\nname = \"of-{name}\"\nkind = \"plane\"\nposition_mm = [0.0, 0.0, 3.0]\nsize_mm = [2e6, 2e6]\nbins = [1, 1]\nonly = {{ sources = [\"{name}\"] }}\n"
        )
    };
    let sources = [("blue", 5.0), ("green", 1.0), ("red", 2.0)];
    let mut text =
        format!("light = {{ wavelength_nm = 600.0, weighting = \"photometric\" }}\n{BARE}");
    for ((name, power), (nm, _)) in sources.iter().zip(V) {
        text += &lamp(name, power - 3.0, *power, nm);
        text += &plane(name);
    }
    let folder = tempdir().expect("a folder");
    let run = run_text(folder.path(), "bare", &text, "lm", &[]).expect("it runs");
    let watts = text.replace(", weighting = \"photometric\"", "");
    let radiant = run_text(folder.path(), "watts", &watts, "w", &[]).expect("it runs");
    let [lm, w] = [&run, &radiant].map(|r| &r["designs"]["bare"]["geometric"]);
    let lumens: Vec<f64> =
        sources.iter().zip(V).map(|((_, power), (_, v))| power / 8.0 * 683.0 * v).collect();
    let all: f64 = lumens.iter().sum();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b.abs(), "{a} for {b}");
    near(number(&lm["spectrum"]["emitted"]["emitted_lm"]), all);
    near(number(&lm["spectrum"]["emitted"]["emitted_w"]), 1.0);
    for (k, (name, power)) in sources.iter().enumerate() {
        // All light goes up, so that every lumen is seen.
        let of = |r: &Value| number(&r["receivers"][format!("of-{name}")]["flux"]["value"]);
        near(of(lm), lumens[k]);
        near(of(w), power / 8.0);
        assert_eq!(lm["receivers"][format!("of-{name}")]["flux_unit"], "lm");
        assert_eq!(lm["receivers"][format!("of-{name}")]["quantity"], "illuminance");
        let listed = &lm["spectrum"]["light"]["sources"][k];
        assert_eq!(listed["sources"], serde_json::json!([name]));
        near(number(&listed["emitted_lm"]), lumens[k]);
        near(number(&listed["emitted_w"]), power / 8.0);
    }
    assert_eq!(lm["units"]["power_ledger"], "lm/lm");
    assert_eq!(w["units"]["power_ledger"], "W/W");
    // Far field: Lambert's law at θ = 22.5°, I = Φ cos θ / π, in cd and in W/sr.
    for (run, flux, unit) in
        [("lm", all, "luminous_intensity_cd"), ("w", 1.0, "intensity_w_per_sr")]
    {
        let csv = folder.path().join(run).join("bare/geometric/far_field.csv");
        let csv = std::fs::read_to_string(csv).expect("readable");
        let mut lines = csv.lines();
        assert!(lines.next().is_some_and(|heading| heading.contains(unit)), "{csv}");
        let row: Vec<f64> = lines
            .map(|line| line.split(',').map(|v| v.parse().expect("a number")).collect())
            .find(|row: &Vec<f64>| (row[0] - 23.0).abs() < 1e-9)
            .expect("23 degrees");
        let expected = flux * row[0].to_radians().cos() / std::f64::consts::PI;
        assert!((row[1] - expected).abs() < 5.0 * row[2] + 1e-3 * expected, "{row:?} {expected}");
    }
}

#[test]
fn efficiencies_and_ledgers_are_those_of_the_sources() {
    let folder = folder();
    let at = folder.path();
    let text = format!(
        "light = {{ wavelength_nm = 550.0, weighting = \"photometric\" }}\n{DOME}{LEFT}wavelength_nm = 450.0\n{RIGHT}spectrum = {{ kind = \"table\", wavelength_nm = [600.0, 640.0], power = [1.0, 1.0], samples = 3 }}\n"
    );
    let run = run_text(at, "two", &text, "r", &[]).expect("it runs");
    let model = &run["designs"]["two"]["geometric"];
    let spectrum = &model["spectrum"];
    let lights = spectrum["light"]["sources"].as_array().expect("a list");
    assert_eq!(lights.len(), 2);
    let mut sums = [[0.0; 2]; 2];
    for light in lights {
        let ledger = light["power_ledger"].as_object().expect("a ledger");
        let of = |name: &str| estimate(&ledger[name]).0;
        let ends: f64 = ledger
            .iter()
            .filter(|(name, _)| ["escaped", "absorbed", "lost"].iter().any(|w| name.starts_with(w)))
            .map(|(_, value)| estimate(value).0)
            .sum();
        assert!((of("emitted") - 1.0).abs() < 1e-12 && (ends - 1.0).abs() < 1e-9, "{ends}");
        let out = of("out_of_domes") - of("back_into_domes");
        for (k, key) in ["emitted_w", "emitted_lm"].into_iter().enumerate() {
            sums[k][0] += number(&light[key]) * out;
            sums[k][1] += number(&light[key]);
        }
    }
    let [watts, lumens] = ["radiometric", "photometric"].map(|name| &spectrum["efficiency"][name]);
    // The other weighting is that of a run that asks for it, at wavelengths of its own.
    let text_w = text.replace(", weighting = \"photometric\"", "");
    let in_watts = run_text(at, "watts", &text_w, "w", &[]).expect("it runs");
    let in_watts = &in_watts["designs"]["two"]["geometric"];
    for (a, b) in [
        (watts, &in_watts["extraction_efficiency"]),
        (&in_watts["spectrum"]["efficiency"]["photometric"], &model["extraction_efficiency"]),
    ] {
        let (a, b) = (estimate(&a["extraction_efficiency"]), estimate(b));
        assert!((a.0 - b.0).abs() < 5.0 * a.1.hypot(b.1), "{a:?} {b:?}");
    }
    assert!((estimate(&lumens["extraction_efficiency"]).0 - sums[1][0] / sums[1][1]).abs() < 1e-12);
    let [a, b] = [lumens, model].map(|of| estimate(&of["extraction_efficiency"]));
    assert_eq!(a, b);
    assert_eq!((&watts["unit"], &lumens["unit"]), (&"W/W".into(), &"lm/lm".into()));
    // Blue, which has most of the watts and few of the lumens, is held back.
    let both = [watts, lumens].map(|e| estimate(&e["extraction_efficiency"]).0);
    assert!(both[0] < both[1] - 0.02, "{both:?}");
    let wavelengths = spectrum["wavelengths"].as_array().expect("a list");
    assert_eq!(wavelengths.len(), 4);
    let weights: f64 = wavelengths.iter().map(|w| number(&w["weight"])).sum();
    assert!((weights - 1.0).abs() < 1e-12);
    assert_eq!(spectrum["stopped_by"], "samples");
    // What stands beside a source changes nothing of it: the right one in the company of another
    // blue.
    let beside = text_w.replace("wavelength_nm = 450.0\n", "wavelength_nm = 470.0\n");
    let beside = run_text(at, "beside", &beside, "o", &[]).expect("it runs");
    let of = |model: &Value| {
        let all = model["spectrum"]["wavelengths"].as_array().expect("a list");
        all.iter()
            .filter(|w| w["sources"] == serde_json::json!(["right"]))
            .cloned()
            .collect::<Vec<_>>()
    };
    let right = of(in_watts);
    assert_eq!(right.len(), 3);
    assert_eq!(right, of(&beside["designs"]["two"]["geometric"]));
}

#[test]
fn stopped_runs_of_two_colours_go_on_to_the_same_bytes() {
    let folder = folder();
    let at = folder.path();
    let text = format!("{GREEN}{DOME}{LEFT}wavelength_nm = 450.0\n{RIGHT}wavelength_nm = 650.0\n");
    let text = text.replace("paths = 200_000", "paths = 4_000_000, sampling = \"sobol\"");
    std::fs::write(at.join("two.toml"), text).expect("written");
    let run = |out: &str, threads: &str| {
        let arguments = ["run", "two.toml", "--out", out, "--cache", "cache", "--quiet"];
        let output = batwing(at).args(arguments).args(["--threads", threads]).output();
        let output = output.expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run("whole", "2");
    assert!(!at.join("cache").exists());
    let groups = || files(&at.join("cache/checkpoints")).len();
    let arguments = ["run", "two.toml", "--out", "again", "--cache", "cache"];
    let (code, said) = interrupted(at, &arguments, || groups() > 6);
    assert_eq!(code, Some(130), "{said}");
    assert!(groups() > 6);
    run("again", "1");
    assert_eq!(contents(&at.join("again")), contents(&at.join("whole")));
    let paths = number(&results(&at.join("whole"))["designs"]["two"]["geometric"]["paths"]);
    assert!((paths - 4e6).abs() < 200.0);
}

#[test]
fn batches_of_two_colours_end_at_an_error() {
    let folder = folder();
    let at = folder.path();
    let text = format!("{GREEN}{DOME}{LEFT}wavelength_nm = 450.0\n{RIGHT}wavelength_nm = 650.0\n");
    let text = text.replace("200_000", "20_000");
    let flags = ["--until-error", "extraction_efficiency=0.05%"];
    let run = run_text(at, "two", &text, "r", &flags).expect("it runs");
    let model = &run["designs"]["two"]["geometric"];
    assert_eq!(model["until_error"]["reached"], true);
    let batches = number(&model["until_error"]["batches"]);
    assert!(batches > 2.0 && (number(&model["paths"]) / batches - 20_000.0).abs() < 150.0);
    assert!(estimate(&model["extraction_efficiency"]).1 <= 5e-4);
}

/// n, k and a wavelength in nm, between which nothing is asked for but 550 nm, the light of the
/// design.
const FLINT: &str = "DATA:\n  - type: tabulated nk\n    data: |\n        0.40 1.65 3e-6\n        0.45 1.62 2e-6\n        0.65 1.48 0\n        0.80 1.45 0\n";
const BEAM: &str = "kind = \"cosine\"\nexponent = 1e6\nposition_mm = [0.0, 0.0, 1.0]\n";
/// Above a source, and once for all packages.
const PLATE: &str = "[[solids]]\nname = \"plate\"\nkind = \"box\"\nper = \"array\"\nposition_mm = [0.0, 0.0, 25.0]\nsize_mm = [60.0, 60.0, 2.0]\n";

#[test]
fn solids_are_of_the_colour_of_each_source() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("flint.yml"), FLINT).expect("written");
    let bare = BARE.replace("64_000", "400_000");
    let beams = format!(
        "[[sources]]\nname = \"blue\"\npower = 1.0\nwavelength_nm = 450.0\n{BEAM}[[sources]]\nname = \"red\"\npower = 3.0\nwavelength_nm = 650.0\n{BEAM}"
    );
    let flint = format!("{PLATE}medium = {{ material_file = \"flint.yml\" }}\n");
    // A quarter of a wave of 450 nm, of the index √n.
    let n = 1.7_f64;
    let quarter = 450.0 / 4.0 / n.sqrt();
    let coated = format!(
        "{PLATE}medium = {{ index = {n} }}\ncoating = [{{ index = {}, thickness_nm = {quarter} }}]\n",
        n.sqrt()
    );
    // Both faces and all inner reflections, with what is absorbed on every way through.
    let through = |r: f64, alpha: f64| {
        let on_the_way = (-2.0 * alpha).exp();
        (1.0 - r).powi(2) * on_the_way / (1.0 - (r * on_the_way).powi(2))
    };
    let fresnel = |n: f64| ((n - 1.0) / (n + 1.0)).powi(2);
    let alpha = 4.0 * std::f64::consts::PI * 2e-6 / 450e-6;
    // One layer whose faces reflect alike: ρ (1 + w)/(1 + ρ² w) with w = exp(2iβ).
    let layered = |nm: f64| {
        let rho = (1.0 - n.sqrt()) / (1.0 + n.sqrt());
        let w = std::f64::consts::PI * 450.0 / nm;
        let below = 1.0 + rho.powi(4) + 2.0 * rho * rho * w.cos();
        rho * rho * (2.0 + 2.0 * w.cos()) / below
    };
    let closed = [
        (&flint, [through(fresnel(1.62), alpha), through(fresnel(1.48), 0.0)]),
        (&coated, [through(layered(450.0), 0.0), through(layered(650.0), 0.0)]),
    ];
    for (k, (solid, of)) in closed.iter().enumerate() {
        let text = format!("{GREEN}{bare}{beams}{solid}");
        let run = run_text(at, "bare", &text, &format!("own-{k}"), &[]).expect("it runs");
        let lights = &run["designs"]["bare"]["geometric"]["spectrum"]["light"]["sources"];
        for (light, expected) in [0, 1].into_iter().zip(of) {
            let (up, error) = estimate(&lights[light]["power_ledger"]["escaped_up"]);
            assert!(
                (up - expected).abs() < 4.5 * error.max(1e-5) && error < 1.5e-3,
                "{k} {light}: {up} +- {error} for {expected}"
            );
        }
        // The same beams as two lines of the light of the design.
        let lines = "light = { spectrum = { kind = \"lines\", wavelength_nm = [450.0, 650.0], power = [1.0, 3.0], weighting = \"radiometric\" } }\n";
        let text = format!("{lines}{bare}[[sources]]\nname = \"beam\"\n{BEAM}{solid}");
        let run = run_text(at, "bare", &text, &format!("lines-{k}"), &[]).expect("it runs");
        let ledger = &run["designs"]["bare"]["geometric"]["power_ledger"];
        let (up, error) = estimate(&ledger["escaped_up"]);
        let expected = 0.25 * of[0] + 0.75 * of[1];
        assert!((up - expected).abs() < 4.5 * error, "{k}: {up} +- {error} for {expected}");
    }
    let beyond = beams.replace("650.0", "900.0");
    let beyond = design::parse("bad.toml", &format!("{GREEN}{bare}{beyond}{flint}"), at);
    let said = beyond.expect_err("no data there").to_string();
    assert!(
        said.contains("solids[1].medium.material_file = flint.yml: expected a readable material")
            && said.contains("for light of 900 nm from red"),
        "{said}"
    );
}

/// Blue and red points on either side of the axis of each of four packages, above black.
const TWO_COLOURS: &str = r#"
name = "two"
light = { wavelength_nm = 550.0 }
mirror = { kind = "absorbing", extent = "package" }
led = { size_mm = [0.2, 0.2], height_mm = 0.1, reflection = "absorbing" }
array = { columns = 2, rows = 2, pitch_mm = 8.0 }
receiver = { plane_height_mm = 3.2, bin_mm = 0.2, smoothing_sigma_mm = 0.2 }
trace = { paths = 4_000_000 }

[[sources]]
name = "blue"
kind = "cosine"
exponent = 1.0
position_mm = [-1.0, 0.0, 0.2]
power = 3.0
wavelength_nm = 460.0

[[sources]]
name = "red"
kind = "cosine"
exponent = 1.0
position_mm = [1.0, 0.0, 0.2]
wavelength_nm = 620.0
"#;

/// E = Φ h² / (π (h² + ρ²)²) of every point; colours by the CIE's table.
#[test]
fn two_colours_differ_over_the_cell_as_lamberts_law_says() {
    let folder = tempdir().expect("a folder");
    let found = run_text(folder.path(), "two", TWO_COLOURS, "out", &[]);
    let found = found.unwrap_or_else(|e| panic!("{e}"));
    let model = &found["designs"]["two"]["geometric"];
    let figure = &model["cell_colour_difference"];
    let colour = |[x, y]: [f64; 2]| -> [f64; 2] {
        let mut xyz = [0.0; 3];
        for (offset, power, nm) in [(-1.0, 3.0, 460.0), (1.0, 1.0, 620.0)] {
            for axis in [[-4.0, -4.0], [4.0, -4.0], [-4.0, 4.0], [4.0, 4.0]] {
                let from: [f64; 2] = [x - axis[0] - offset, y - axis[1]];
                let square = 9.0 + from[0].powi(2) + from[1].powi(2);
                for (sum, matching) in xyz.iter_mut().zip(metrics::colour_matching::xyz(nm)) {
                    *sum += power * matching / square.powi(2);
                }
            }
        }
        let all = xyz[0] + 15.0 * xyz[1] + 3.0 * xyz[2];
        [4.0 * xyz[0] / all, 9.0 * xyz[1] / all]
    };
    let largest = |at: &[f64]| {
        let colours: Vec<[f64; 2]> =
            at.iter().flat_map(|y| at.iter().map(|x| colour([*x, *y]))).collect();
        let pairs = colours.iter().flat_map(|a| colours.iter().map(move |b| [a, b]));
        let distances = pairs.map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1]));
        distances.fold(0.0, f64::max)
    };
    // Middles of the parts of a cell 8 mm wide, twelve to the pitch.
    let parts: Vec<f64> = (0..12).map(|k| 8.0 / 12.0 * (f64::from(k) - 5.5)).collect();
    let (value, error) = estimate(&model["cell_colour_difference_parts"]);
    let bias = number(&model["cell_colour_difference_parts"]["bias_bound"]);
    let of_parts = largest(&parts);
    let off = (value - of_parts).abs();
    assert!(off <= 4.0 * error + bias + 2e-2 * of_parts, "{value} ± {error}, not {of_parts}");
    // Both shine into all directions alike.
    let (value, error) = estimate(&model["far_field_colour_difference"]);
    let bias = number(&model["far_field_colour_difference"]["bias_bound"]);
    assert!(value <= bias + 3.0 * error && value < 5e-3, "{value} ± {error}, {bias}");
    let expected = largest(&[-8.0 / 3.0, 0.0, 8.0 / 3.0]);
    let (value, error) = estimate(figure);
    let bias = number(&figure["bias_bound"]);
    assert!(expected > 0.05 && error + bias < 0.05 * expected, "{figure}, {expected}");
    let off = (value - expected).abs();
    assert!(off <= 4.0 * error + bias + 5e-3 * expected, "{figure}, not {expected}");
}
