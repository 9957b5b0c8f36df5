// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[receivers]]`, from the design file to files and `results.json`.

use std::path::Path;

use crate::support::binary::batwing;
use crate::support::runs::{contents, estimate, run_text};
use serde_json::{Value, json};
use tempfile::tempdir;

const DESIGN: &str = r#"
name = "seen"
dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }
elements = { count = 17, width_um = 100.0, shapes = [{ from = 1, to = 17, type = "OS1" }] }
silicone = { index = 1.41 }
mirror = { kind = "specular", reflectance = 0.95, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.86, reflection = "specular" }
array = { columns = 2, rows = 2, pitch_mm = 8.3 }
receiver = { bin_mm = 0.5 }
trace = { paths = 64_000 }
"#;

const GREEN: &str = "light = { wavelength_nm = 555.0 }\n";
const GREEN_IN_LUMENS: &str = "light = { spectrum = { kind = \"lines\", wavelength_nm = [555.0], power = [1.0], weighting = \"photometric\" } }\n";

const RECEIVERS: &str = r#"
[[receivers]]
name = "sky"
kind = "far_field"
theta_bin_deg = 10.0
phi_bin_deg = 10.0

[[receivers]]
name = "few"
kind = "far_field"
theta_bin_deg = 10.0
phi_bin_deg = 10.0
only = { max_bounces = 1 }

[[receivers]]
name = "many"
kind = "far_field"
theta_bin_deg = 10.0
phi_bin_deg = 10.0
only = { min_bounces = 2 }

[[receivers]]
name = "rings"
kind = "c_gamma"
theta_bin_deg = 15.0
phi_bin_deg = 30.0
only = { last_surface = "dome", last_elements = [6, 8], packages = [1, 4] }

[[receivers]]
name = "plane"
kind = "plane"
position_mm = [0.0, 0.0, 3.0]
size_mm = [20.0, 10.0]
bins = [4, 2]

[[receivers]]
name = "glow"
kind = "luminance"
position_mm = [0.0, 0.0, 3.0]
size_mm = [20.0, 10.0]
bins = [2, 1]
theta_bin_deg = 30.0
phi_bin_deg = 90.0

[[receivers]]
name = "mirror"
kind = "surface"
surface = "ground mirror"
"#;

fn run(
    folder: &Path,
    light: &str,
    receivers: &str,
    out: &str,
    flags: &[&str],
) -> Result<Value, String> {
    let text = format!("{DESIGN}{light}{receivers}");
    let flags = [&["--model", "geometric"], flags].concat();
    let results = run_text(folder, "seen", &text, out, &flags)?;
    Ok(results["designs"]["seen"]["geometric_100um"].clone())
}

/// Rows of numbers of a file of columns, and their heading.
fn csv(path: &Path) -> (String, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    let heading = lines.next().expect("a heading").to_owned();
    let numbers = |line: &str| line.split(',').map(|n| n.parse().expect("a number")).collect();
    (heading, lines.map(numbers).collect())
}

/// The column before the last one: values.
fn values(rows: &[Vec<f64>]) -> Vec<f64> {
    rows.iter().map(|row| row[row.len() - 2]).collect()
}

#[test]
fn receivers_write_what_they_saw() {
    let directory = tempdir().expect("a folder");
    let folder = directory.path();
    let model = run(folder, GREEN, RECEIVERS, "one", &["--threads", "1"]).expect("results");
    run(folder, GREEN, RECEIVERS, "two", &["--threads", "2"]).expect("results");
    assert_eq!(contents(&folder.join("one")), contents(&folder.join("two")));
    let place = folder.join("one/seen/geometric_100um");
    let table = |name: &str| csv(&place.join(format!("receivers/{name}.csv")));

    // The same far field as that of every run, and two parts of it.
    let (heading, sky) = table("sky");
    assert_eq!(heading, "theta_deg,phi_deg,intensity_w_per_sr,intensity_standard_error_w_per_sr");
    assert_eq!(sky.len(), 18 * 36);
    assert_eq!(sky[37][..2], [15.0, 15.0]);
    let (few, many) = (values(&table("few").1), values(&table("many").1));
    for ((all, a), b) in values(&sky).iter().zip(&few).zip(&many) {
        assert!((a + b - all).abs() <= 1e-12 * all);
    }
    let seen = &model["receivers"];
    let (flux, error) = estimate(&seen["sky"]["flux"]);
    let ledger = &model["power_ledger"];
    let escaped = estimate(&ledger["escaped_up"]).0 + estimate(&ledger["escaped_down"]).0;
    assert!((flux - escaped).abs() < 1e-12 && error > 0.0);
    let direct = estimate(&seen["few"]["flux"]).0;
    assert!(direct > 0.3 * flux && direct < flux, "{direct} of {flux}");
    assert_eq!(seen["sky"]["unit"], "W/sr");

    // Three of seventeen elements, of two of four packages.
    let rings = estimate(&seen["rings"]["flux"]).0;
    assert!(rings > 0.02 * flux && rings < 0.5 * flux, "{rings} of {flux}");
    let (heading, rows) = table("rings");
    assert!(heading.starts_with("gamma_deg,c_deg,"), "{heading}");
    assert_eq!(rows.len(), 13 * 12);

    // Means over area, and over area and directions.
    let figure = |name: &str, key: &str| estimate(&seen[name][key]).0;
    let over_area = figure("plane", "flux") / 200.0;
    assert!((figure("plane", "mean") / over_area - 1.0).abs() < 1e-9);
    let radiance = figure("glow", "flux") / 200.0 / std::f64::consts::PI * 1e6;
    assert!((figure("glow", "mean") / radiance - 1.0).abs() < 1e-9);
    for name in ["plane", "glow"] {
        let [min, mean, max] = ["min", "mean", "max"].map(|key| figure(name, key));
        assert!(min > 0.0 && min < mean && mean < max, "{name}: {min} {mean} {max}");
        assert!(place.join(format!("receivers/{name}.png")).exists());
    }
    assert!(seen["mirror"].get("mean").is_none() && !place.join("receivers/sky.png").exists());
    let report = batwing(folder).args(["report", "one"]).output().expect("it runs");
    assert!(report.status.success(), "{report:?}");
    let page = std::fs::read_to_string(folder.join("one/report.html")).expect("a page");
    for words in ["plane, max", "glow, mean", "radiance of glow", "data:image/png;base64,"] {
        assert!(page.contains(words), "{words}");
    }

    // Irradiance from the right and from radiance over half the sphere.
    let (heading, plane) = table("plane");
    assert_eq!(heading, "y_mm,x_mm,irradiance_w_per_mm2,irradiance_standard_error_w_per_mm2");
    assert_eq!(plane[1][..2], [-2.5, -2.5]);
    let power: f64 = values(&plane).iter().map(|e| e * 25.0).sum();
    assert!((power - estimate(&seen["plane"]["flux"]).0).abs() < 1e-12);
    assert!((power - estimate(&seen["glow"]["flux"]).0).abs() < 1e-12);
    let (heading, glow) = table("glow");
    assert_eq!(
        heading,
        "y_mm,x_mm,theta_deg,phi_deg,radiance_w_per_m2_sr,radiance_standard_error_w_per_m2_sr"
    );
    assert_eq!(glow.len(), 2 * 3 * 4);
    let projected = |theta: f64| {
        let sin2 = |deg: f64| deg.to_radians().sin().powi(2);
        0.25 * std::f64::consts::PI * (sin2(theta + 15.0) - sin2(theta - 15.0))
    };
    let sum: f64 = glow.iter().map(|row| row[4] * 1e-6 * 100.0 * projected(row[2])).sum();
    assert!((sum - power).abs() < 1e-12, "{sum} {power}");

    // Silver keeps 95 %.
    let of_mirror = |bin: &str| estimate(&seen["mirror"][bin]).0;
    let absorbed = of_mirror("from_outside_absorbed");
    assert!((absorbed - estimate(&ledger["absorbed_by_ground_mirror"]).0).abs() < 1e-12);
    assert!((absorbed / of_mirror("from_outside") - 0.05).abs() < 0.01);

    let text = std::fs::read(place.join("receivers/glow.json")).expect("a description");
    let described: Value = serde_json::from_slice(&text).expect("JSON");
    assert_eq!(described["shape"], json!([2, 1, 2, 3, 4]));
    assert_eq!(described["axes"][0]["edges"], json!([-5.0, 5.0]));
    assert!(place.join("receivers/plane.exr").exists());
    let files = seen["glow"]["files"].as_array().expect("a list");
    assert!(files.contains(&json!("receivers/glow.exr")), "{files:?}");
    let image = std::fs::read(place.join("receivers/glow.exr")).expect("an image");
    for name in ["radiance_w_per_m2_sr_y_0_mm_x_-5_mm", "radiance_w_per_m2_sr_y_0_mm_x_5_mm"] {
        let named = image.windows(name.len()).any(|bytes| bytes == name.as_bytes());
        assert!(named, "{name}");
    }
}

#[test]
fn light_in_lumens_is_683_times_that_in_watts_at_555_nm() {
    let directory = tempdir().expect("a folder");
    let folder = directory.path();
    let watts = run(folder, GREEN, RECEIVERS, "watts", &[]).expect("results");
    let lumens = run(folder, GREEN_IN_LUMENS, RECEIVERS, "lumens", &[]).expect("results");
    let factors = [("sky", 683.0), ("plane", 683e6), ("glow", 683.0)];
    for (name, factor) in factors {
        let of = |out: &str| {
            let path = format!("{out}/seen/geometric_100um/receivers/{name}.csv");
            csv(&folder.join(path))
        };
        let (heading, rows) = of("lumens");
        let unit = ["cd", "lx", "cd_per_m2"].map(|unit| format!("_{unit}"));
        assert!(unit.iter().any(|unit| heading.ends_with(unit)), "{heading}");
        let light = values(&rows);
        for (lumens, watts) in light.iter().zip(values(&of("watts").1)) {
            assert!((lumens - factor * watts).abs() <= 1e-6 * lumens.abs(), "{name}");
        }
    }
    let flux = |model: &Value| estimate(&model["receivers"]["sky"]["flux"]).0;
    assert!((flux(&lumens) / flux(&watts) - 683.0).abs() < 1e-3);
    assert_eq!(lumens["receivers"]["mirror"]["unit"], "lm");
}

#[test]
fn stokes_parameters_are_read_where_the_design_asks_for_them() {
    let directory = tempdir().expect("a folder");
    let folder = directory.path();
    let light = GREEN.replace(" }", ", polarization = \"carried\" }");
    assert_ne!(light, GREEN);
    let asked = RECEIVERS.replace("kind = \"far_field\"", "stokes = true\nkind = \"far_field\"");
    let asked = asked.replace("kind = \"luminance\"", "stokes = true\nkind = \"luminance\"");
    let asked = asked.replace("kind = \"plane\"", "stokes = true\nkind = \"plane\"");
    let with = run(folder, &light, &asked, "with", &[]).expect("results");
    let without = run(folder, &light, RECEIVERS, "without", &[]).expect("results");
    for (name, shape, layer) in [
        ("sky", 4, "intensity_w_per_sr_U"),
        ("plane", 4, "irradiance_w_per_mm2_U"),
        ("glow", 6, "radiance_w_per_m2_sr_U"),
    ] {
        let (a, b) = (&with["receivers"][name], &without["receivers"][name]);
        assert_eq!((&a["flux"], &a["unit"]), (&b["flux"], &b["unit"]), "{name}");
        let of = |out: &str, ending: &str| {
            folder.join(format!("{out}/seen/geometric_100um/receivers/{name}.{ending}"))
        };
        let text = std::fs::read(of("with", "json")).expect("a description");
        let described: Value = serde_json::from_slice(&text).expect("JSON");
        assert_eq!(described["stokes"], json!(["I", "Q", "U", "V"]));
        assert_eq!(described["shape"].as_array().map(Vec::len), Some(shape));
        assert_eq!(described["p"], "s x k");
        let (heading, rows) = csv(&of("with", "csv"));
        let (_, plain) = csv(&of("without", "csv"));
        assert!(heading.contains("_q_w") && heading.contains("_v_standard_error_w"), "{heading}");
        for (row, plain) in rows.iter().zip(&plain) {
            // The power as before, and no more polarised than it can be.
            let (places, power) = row.split_at(row.len() - 8);
            assert_eq!([places, &power[..2]].concat(), *plain);
            let degree = power[2].hypot(power[4]).hypot(power[6]);
            assert!(degree <= power[0] * (1.0 + 1e-9), "{row:?}");
        }
        let image = std::fs::read(of("with", "exr")).expect("an image");
        let mut windows = image.windows(layer.len());
        assert!(windows.any(|bytes| bytes == layer.as_bytes()), "{layer}");
    }
    // What leaves the dome at a slant is p more than s, as the first surface passes it.
    let q = estimate(&with["receivers"]["sky"]["flux_q"]);
    assert!(q.0 < -5.0 * q.1, "{q:?}");

    for (light, keys, said) in [
        (
            GREEN,
            asked.as_str(),
            "stokes = true: expected no such key without light.polarization = \"carried\"",
        ),
        (
            light.as_str(),
            "[[receivers]]\nname = \"a\"\nkind = \"surface\"\nsurface = \"bottom\"\nstokes = true\n",
            "receivers[1].stokes: no such key for \"surface\", expected surface",
        ),
    ] {
        let error = run(folder, light, keys, "bad", &[]).expect_err("refused");
        assert!(error.contains(said) && error.matches("batwing:").count() == 1, "{error}");
    }
}

/// Of what two sources emit towards a black sheet a quarter comes from below, which is its inside.
#[test]
fn a_sheet_tells_its_sides_apart() {
    let directory = tempdir().expect("a folder");
    let source = |name: &str, z: f64, down: f64, power: f64| {
        format!(
            "[[sources]]\nname = \"{name}\"\nkind = \"cosine\"\nexponent = 1.0\npower = {power}\n\
             position_mm = [0.0, 0.0, {z}]\nnormal = [0.0, 0.0, {down}]\n"
        )
    };
    let text = format!(
        "name = \"sides\"\nlight = {{ wavelength_nm = 600.0 }}\n\
         mirror = {{ kind = \"absorbing\", extent = \"array\" }}\n\
         led = {{ size_mm = [0.2, 0.2], height_mm = 0.1, reflection = \"absorbing\" }}\n\
         array = {{ columns = 1, rows = 1, pitch_mm = 4.0 }}\nreceiver = {{ plane_height_mm = 3.0 }}\n\
         trace = {{ paths = 20_000 }}\n{}{}[[solids]]\nname = \"sheet\"\nkind = \"rectangle\"\n\
         per = \"array\"\nposition_mm = [0.0, 0.0, 1.0]\nsize_mm = [2000.0, 2000.0]\n\
         surface = {{ kind = \"absorbing\" }}\n[[receivers]]\nname = \"r\"\nkind = \"surface\"\n\
         surface = \"sheet\"\n",
        source("below", 0.5, 1.0, 1.0),
        source("above", 1.5, -1.0, 3.0),
    );
    let flags = ["--until-error", "from_inside.r=1%"];
    let results = run_text(directory.path(), "sides", &text, "out", &flags).expect("results");
    let model = &results["designs"]["sides"]["geometric"];
    assert_eq!(model["until_error"]["reached"], true, "{model}");
    let seen = &model["receivers"]["r"];
    assert_eq!(seen["flux_unit"], "W");
    for (bin, expected) in [
        ("from_inside", 0.25),
        ("from_inside_absorbed", 0.25),
        ("from_outside", 0.75),
        ("from_outside_absorbed", 0.75),
    ] {
        let (value, error) = estimate(&seen[bin]);
        assert!((value - expected).abs() < 4.0 * error + 1e-5, "{bin}: {value} ± {error}");
    }
    batwing(directory.path()).args(["report", "out", "--out", "page.html"]).assert().success();
    let page = std::fs::read_to_string(directory.path().join("page.html")).expect("a page");
    assert!(page.contains("r, from inside, absorbed"), "no fluxes of sides");
}
