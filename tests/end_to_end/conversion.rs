// SPDX-License-Identifier: MIT OR Apache-2.0
//! Media that convert light, through the design file: a plate in closed form, colours, the shipped
//! designs, parts of a run, and what cannot be written.

use std::path::Path;

use design::Design;
use design::resolved::trace_key::ReliefModel;
use serde_json::{Map, Value};
use tempfile::tempdir;

use crate::support::binary::batwing;
use crate::support::runs::{estimate, results, run_text, small};

/// A beam of 450 nm upwards through a wide plate of index 1 over a black board. The plate absorbs
/// the share 1 - exp(-0.5) of it and emits at 600 nm, to which it is clear.
const PLATE: &str = r#"
name = "plate"
light = { wavelength_nm = 450.0 }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5, plane_height_mm = 8.0 }
trace = { paths = 50_000 }

[[sources]]
name = "lamp"
kind = "cosine"
position_mm = [0.0, 0.0, 1.0]
exponent = 1e6

[[solids]]
name = "plate"
kind = "box"
per = "array"
position_mm = [0.0, 0.0, 5.0]
size_mm = [5000.0, 5000.0, 0.1]

[solids.medium]
index = 1.0

[[solids.medium.luminophores]]
name = "dye"
absorption_per_mm = [[440, 5.0], [460, 5.0]]
quantum_yield = 0.8
emission = { wavelength_nm = [599, 600, 601], power = [1, 1, 1] }
"#;

/// Light and a receiver for lumens.
const LUMENS: &str = r#"light = { wavelength_nm = 450.0, weighting = "photometric" }
receivers = [{ name = "above", kind = "plane", position_mm = [0.0, 0.0, 20.0], size_mm = [9000.0, 9000.0], bins = [1, 1] }]"#;

fn run(folder: &Path, text: &str, out: &str, flags: &[&str]) -> Value {
    let all = run_text(folder, "design", text, out, flags).unwrap_or_else(|e| panic!("{e}"));
    let design = all["designs"].as_object().expect("designs").values().next().cloned();
    design.expect("a design")["geometric"].clone()
}

#[test]
fn a_plate_converts_light_as_its_closed_form() {
    let folder = tempdir().expect("a folder");
    let found = run(folder.path(), PLATE, "out", &[]);
    let ledger = found["power_ledger"].as_object().expect("a ledger");
    let absorbed = 1.0 - (-0.5f64).exp();
    let emitted = absorbed * 0.8 * 450.0 / 600.0;
    for (account, expected) in [
        ("escaped_up", 1.0 - absorbed + 0.5 * emitted),
        ("absorbed_in_dye_quantum_loss", 0.2 * absorbed),
        ("absorbed_in_dye_stokes_loss", 0.8 * 0.25 * absorbed),
    ] {
        let (value, error) = estimate(&ledger[account]);
        assert!(
            error > 0.0 && (value - expected).abs() < 4.0 * error,
            "{account}: {value} ± {error}"
        );
    }
    let is_end = |name: &str| ["escaped", "absorbed", "lost"].iter().any(|b| name.starts_with(b));
    let ends = |ledger: &Map<String, Value>| -> f64 {
        ledger.iter().filter(|(name, _)| is_end(name)).map(|(_, v)| estimate(v).0).sum()
    };
    assert!((ends(ledger) - 1.0).abs() < 1e-9, "{}", ends(ledger));
    // Of each photon absorbed 0.8 are emitted again, whatever their energy.
    let photons = found["photon_ledger"].as_object().expect("a ledger");
    assert!(photons.keys().all(|account| !account.ends_with("stokes_loss")));
    for (account, expected) in [
        ("escaped_up", 1.0 - absorbed + 0.5 * 0.8 * absorbed),
        ("absorbed_in_dye_quantum_loss", 0.2 * absorbed),
    ] {
        let (value, error) = estimate(&photons[account]);
        assert!(
            error > 0.0 && (value - expected).abs() < 4.0 * error,
            "{account}: {value} ± {error}"
        );
    }
    assert!((ends(photons) - 1.0).abs() < 0.01, "{}", ends(photons));
}

/// Lumens of what leaves, of the light that was not absorbed and of that emitted; the ledger holds watts.
#[test]
fn lumens_of_converted_light_are_those_of_its_closed_form() {
    let folder = tempdir().expect("a folder");
    let text = PLATE
        .replace("light = { wavelength_nm = 450.0 }", LUMENS)
        .replace("reflection = \"absorbing\" }", "reflection = \"absorbing\", power_w = 0.1 }");
    let found = run(folder.path(), &text, "lumens", &[]);
    let watts = run(folder.path(), PLATE, "watts", &[]);
    assert_eq!(found["power_ledger"], watts["power_ledger"]);
    let absorbed = 1.0 - (-0.5f64).exp();
    let emitted = 0.5 * absorbed * 0.8 * 450.0 / 600.0;
    let seen = |nm: f64| metrics::colour_matching::xyz(nm)[1];
    let lumens = 0.1 * 683.0 * ((1.0 - absorbed) * seen(450.0) + emitted * seen(600.0));
    let flux = &found["absolute"]["figures"]["flux_up"];
    let [(above, _), (up, error)] =
        [estimate(&found["receivers"]["above"]["flux"]), estimate(flux)];
    assert_eq!(flux["unit"], "lm");
    assert!(error > 0.0 && (up - lumens).abs() < 4.0 * error + 2e-3 * lumens, "{up} for {lumens}");
    assert!((0.99..1.0).contains(&(above / up)), "{above} of {up}");
    assert_eq!(found["receivers"]["above"]["unit"], "lx");
    assert_eq!(found["absolute"]["emitted"]["emitted_lm"], Value::Null);

    let export = |out: &str| {
        let folder_of = format!("{out}/plate/geometric");
        batwing(folder.path())
            .args(["export", &folder_of, "--format", "ies", "--out", "x.ies", "--json"])
            .output()
            .expect("it runs")
    };
    let said: Value = serde_json::from_slice(&export("lumens").stdout).expect("JSON");
    let leaving = said["flux_lm"].as_f64().expect("lumens");
    assert!((leaving / up - 1.0).abs() < 0.02, "{leaving} for {up}");
    let ies = std::fs::read_to_string(folder.path().join("x.ies")).expect("a file");
    assert!(ies.lines().any(|line| line == "1 1 0"), "electrical power that is not stated: {ies}");
    // A beam on the axis has no centre/peak, and a page all the same.
    batwing(folder.path()).args(["report", "lumens", "--out", "page.html"]).assert().success();
    let said = String::from_utf8(export("watts").stderr).expect("UTF-8");
    assert!(said.contains("converted light in watts: expected lumens"), "{said}");
}

/// Lumens and watts of one study have figures of their own, and no difference.
#[test]
fn a_study_subtracts_no_watts_from_lumens() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let text = PLATE
        .replace("light = { wavelength_nm = 450.0 }", LUMENS)
        .replace("reflection = \"absorbing\" }", "reflection = \"absorbing\", power_w = 0.1 }");
    std::fs::write(at.join("design.toml"), text).expect("written");
    let study = "name = \"s\"\ndesigns = [\"design.toml\"]\nmodels = [\"geometric\"]\npaths = 2000\n\
                 [[factors]]\nname = \"weighting\"\nkey = \"light.weighting\"\n\
                 values = [\"photometric\", \"radiometric\"]\n\
                 [targets.plate.geometric]\nflux_up = { at_least = 0.01 }\n\"flux.above\" = { at_least = 1e-4 }\nescaped_up = { at_least = 0.1 }\n\
                 [scales]\nflux_up = 1.0\n";
    std::fs::write(at.join("study.toml"), study).expect("written");
    batwing(at).args(["study", "study.toml", "--out", "out"]).assert().success();
    let text = std::fs::read(at.join("out/study.json")).expect("study.json");
    let study: Value = serde_json::from_slice(&text).expect("JSON");
    let figure = |setup: usize, key: &str| {
        let all = study["setups"][setup]["figures"].as_array().expect("figures");
        all.iter().find(|figure| figure["figure"] == key).expect(key).clone()
    };
    let last = study["setups"].as_array().expect("set-ups").len() - 1;
    let [lumens, watts] = [0, last].map(|setup| figure(setup, "flux_up"));
    assert!(estimate(&lumens).0 > 1.0 && estimate(&watts).0 < 0.1, "{lumens} {watts}");
    assert_eq!(watts["change"], Value::Null);
    // In the base a share of 683 lm for each watt, in the last set-up of watts.
    assert_eq!(figure(last, "flux.above")["change"], Value::Null);
    assert_eq!(figure(last, "escaped_up")["change"]["value"], 0.0);
}

#[test]
fn lumens_change_nothing_of_what_is_traced() {
    let text = include_str!("../../data/designs/phosphor-dome.toml");
    let parsed = |text: &str| design::parse("a.toml", text, Path::new("")).expect("valid");
    let lumens = parsed(text);
    let watts = parsed(&text.replace("\"photometric\"", "\"radiometric\""));
    assert!(lumens.converts_in_lumens && !watts.converts_in_lumens);
    assert_eq!(lumens.wavelength_nm.to_bits(), watts.wavelength_nm.to_bits());
    assert_eq!(lumens.tables_nm(), watts.tables_nm());
    // What a cache keeps is weighted.
    let fields = |design: &Design| design.trace_fields(ReliefModel::OrderTables);
    assert_ne!(fields(&lumens), fields(&watts));
    // No eye sees this pump.
    let unseen = text.replace("[430, 440, 450, 460, 470]", "[330, 340, 350, 360, 370]");
    assert!(parsed(&unseen.replace("[400, 0.2]", "[320, 1.0], [400, 0.2]")).converts_in_lumens);
}

#[test]
fn a_converting_design_has_the_same_bits_on_any_threads_and_from_shards() {
    let folder = tempdir().expect("a folder");
    let one = run(folder.path(), PLATE, "one", &["--threads", "1"]);
    let two = run(folder.path(), PLATE, "two", &["--threads", "2"]);
    assert_eq!(one["power_ledger"], two["power_ledger"]);
    let cache = ["--cache", "kept"];
    for part in ["0/2", "1/2"] {
        let flags = ["run", "design.toml", "--out", "parts", "--shard", part];
        batwing(folder.path()).args(flags).args(cache).assert().success();
    }
    let shared = run(folder.path(), PLATE, "shared", &cache);
    assert_eq!(one["power_ledger"], shared["power_ledger"]);
    assert_eq!(one["figures"], shared["figures"]);
}

#[test]
fn shipped_designs_that_convert_light_keep_their_books() {
    let folder = tempdir().expect("a folder");
    for text in [
        include_str!("../../data/designs/phosphor-dome.toml"),
        include_str!("../../data/designs/converting-film.toml"),
    ] {
        let text = text.replace("paths = 200_000", "paths = 4_000");
        let found = run(folder.path(), &text, &format!("out {}", text.len()), &[]);
        let ledger = found["power_ledger"].as_object().expect("a ledger");
        let of = |what: &str| -> f64 {
            let accounts = ledger.iter().filter(|(name, _)| name.ends_with(what));
            accounts.map(|(_, value)| estimate(value).0).sum()
        };
        assert!(of("stokes_loss") > 0.05 && of("quantum_loss") > 0.01, "{ledger:?}");
        assert!(of("escaped_up") > 0.3, "{ledger:?}");
    }
}

/// The hybrid solves its rings at the light of the source and at that of the dye, and says what
/// other tables would change.
#[test]
#[ignore = "slow: 6 s"]
fn relief_has_tables_at_the_wavelengths_of_converted_light() {
    let folder = small();
    let file = folder.path().join("small.toml");
    let text = std::fs::read_to_string(&file).expect("a design");
    let dye = "luminophores = [{ name = \"dye\", absorption_per_mm = 0.5, quantum_yield = 0.9, \
        emission = { peak_nm = 630, fwhm_nm = 20 } }]";
    let text = text.replacen("index = 1.41", &format!("index = 1.41, {dye}"), 1);
    let all = run_text(folder.path(), "small", &text, "out", &["--paths", "20000"])
        .unwrap_or_else(|e| panic!("{e}"));
    let models = all["designs"]["small"].as_object().expect("models");
    let hybrid = models.iter().find(|(name, _)| name.starts_with("hybrid")).expect("a hybrid").1;
    let tables = hybrid["tables"].as_array().expect("tables").iter();
    let mut nm: Vec<f64> =
        tables.map(|table| table["wavelength_nm"].as_f64().expect("nm").round()).collect();
    nm.dedup();
    assert_eq!(nm, [550.0, 630.0]);
    let extraction = &hybrid["extraction_efficiency"];
    let error = extraction["wavelength_error"]["value"].as_f64().expect("an error of the tables");
    assert!((0.0..0.05).contains(&error), "{extraction}");
    // Rays on the relief itself know no tables.
    let rays = models.iter().find(|(name, _)| name.starts_with("geometric")).expect("rays").1;
    assert!(rays["extraction_efficiency"].get("wavelength_error").is_none());
    let difference = estimate(extraction).0 - estimate(&rays["extraction_efficiency"]).0;
    assert!(difference.abs() < 0.1, "{difference}");

    // Tables at one wavelength say which, as those of light that keeps its own do.
    let one = text.replacen("[hybrid]", "[hybrid]\ntables_nm = [600.0]", 1);
    assert_ne!(one, text);
    let all = run_text(folder.path(), "small", &one, "one", &["--paths", "2000"]);
    let all = all.unwrap_or_else(|e| panic!("{e}"));
    let models = all["designs"]["small"].as_object().expect("models");
    let hybrid = models.iter().find(|(name, _)| name.starts_with("hybrid")).expect("a hybrid").1;
    for table in hybrid["tables"].as_array().expect("tables") {
        assert_eq!(table["wavelength_nm"], 600.0, "{table}");
    }
}

#[test]
fn keys_that_conversion_leaves_no_room_for_are_refused() {
    let folder = tempdir().expect("a folder");
    let line = "light = { wavelength_nm = 450.0 }";
    let spectrum = "light = { spectrum = { kind = \"table\", weighting = \"radiometric\", \
        wavelength_nm = [440, 460], power = [1, 1], KEY } }";
    let trace = "trace = { paths = 50_000 }";
    for (old, new, expected) in [
        (line, spectrum.replace("KEY", "samples = 3"), "light.spectrum.samples = 3"),
        (line, spectrum.replace("KEY", "tolerance = 0.01"), "light.spectrum.tolerance = 0.01"),
        (trace, "trace = { ledger_by_source = true }".to_owned(), "trace.ledger_by_source = true"),
    ] {
        let text = PLATE.replacen(old, &new, 1);
        let error = run_text(folder.path(), "design", &text, "out", &[]).expect_err("refused");
        assert!(error.contains("converts light") && error.contains(expected), "{error}");
        assert!(!folder.path().join("out").exists());
    }
}

#[test]
fn files_of_one_wavelength_of_converted_light_are_refused() {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("design.toml"), PLATE).expect("written");
    for file in ["rays.tm25ray", "far.ies"] {
        let done = batwing(folder.path()).args(["export", "design.toml", "--out", file]).output();
        let done = done.expect("it runs");
        let error = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(!done.status.success() && error.lines().count() == 1, "{error}");
        assert!(error.contains("luminophores") && error.contains("design.toml"), "{error}");
        assert!(!folder.path().join(file).exists());
    }
}

/// A clear plate keeps what it converts beyond its critical angle. The message says which plate, how
/// much, and what ends it; with scatter there is none.
#[test]
fn clear_plates_that_hold_converted_light_are_named_with_a_cure() {
    let folder = tempdir().expect("a folder");
    let design = r#"
name = "clear"
mirror = { kind = "lambertian", reflectance = 0.95, extent = "array" }
led = { size_mm = [0.5, 0.5], height_mm = 0.15, reflectance = 0.85, reflection = "lambertian" }
array = { columns = 2, rows = 2, pitch_mm = 6.0 }
receiver = { plane_height_mm = 7.0, bin_mm = 0.25 }
trace = { paths = 1000 }
[housing]
kind = "specular"
reflectance = 1.0
height_mm = 8.0
inner_size_mm = [12.0, 12.0]
[light.spectrum]
kind = "table"
weighting = "radiometric"
wavelength_nm = [445, 450, 455]
power = [0.0, 1.0, 0.0]
[[films]]
name = "cover"
z_mm = 3.0
thickness_mm = 0.5
medium = { index = 1.5 }
[[films]]
name = "dots"
thickness_mm = 0.5
gap_mm = 0.5
[films.medium]
index = 1.5
[[films.medium.luminophores]]
name = "green"
absorption_per_mm = [[400, 4.8], [450, 3.2], [490, 2.5], [520, 1.5], [550, 0.0]]
quantum_yield = 0.9
emission = { peak_nm = 535, fwhm_nm = 30 }
"#;
    let said = |name: &str, text: &str| {
        std::fs::write(folder.path().join("clear.toml"), text).expect("written");
        let output = batwing(folder.path()).args(["run", "clear.toml", "--out", name]).output();
        let output = output.expect("it runs");
        assert!(output.status.success(), "{output:?}");
        let results = results(&folder.path().join(name));
        let ledger = results["designs"]["clear"]["geometric"]["power_ledger"].clone();
        let lost = estimate(&ledger["lost_too_many_bounces"]).0;
        (String::from_utf8(output.stderr).expect("UTF-8"), lost)
    };
    let (words, lost) = said("clear", design);
    // Isotropic light in a plate of index n: the share (1 - 1/n²)^½ is beyond the critical angle.
    assert!(lost > 0.1, "{lost}");
    let share = metrics::digits::significant(100.0 * lost);
    let expected = format!(
        "clear.toml, clear geometric: {share} % of the power is lost (too many bounces), and no figure holds \
         it: light that films[2] \"dots\" converts stays between clear faces by total reflection; \
         scattering_per_mm or absorption_per_mm of the medium, or a face that scatters, lets it out \
         or ends it"
    );
    assert!(words.contains(&expected), "{words}");
    let milky =
        design.replace("index = 1.5\n[[films", "index = 1.5\nscattering_per_mm = 1.0\n[[films");
    let (words, lost) = said("milky", &milky);
    assert!(lost < 1e-5 && !words.contains("is lost"), "{lost} {words}");

    // Photons with more energy than those of the light are said with file and key.
    let blue = design.replace("peak_nm = 535", "peak_nm = 455");
    let blue = blue.replace("[400, 4.8]", "[400, 0.0], [440, 0.0]");
    std::fs::write(folder.path().join("blue.toml"), blue).expect("written");
    let output = batwing(folder.path()).args(["check", "blue.toml"]).output().expect("it runs");
    let words = String::from_utf8(output.stderr).expect("UTF-8");
    let key = "blue.toml: films[2].medium.luminophores[1]: ";
    assert!(words.contains(key) && words.contains("\"green\" emits have more energy"), "{words}");
}

/// A dye takes blue watts that the eye hardly sees: the share of watts that leaves is none of lumens.
#[test]
fn photometry_is_not_made_of_the_watts_of_several_wavelengths() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("dye.yml"), include_str!("../findings/dye.yml")).expect("written");
    let text = include_str!("../findings/dye-white.toml").replace("samples = 31", "samples = 3");
    let export = |weighting: &str| {
        let text = text.replace("\"radiometric\"", &format!("\"{weighting}\""));
        std::fs::write(at.join("dye.toml"), text).expect("written");
        let flags = ["run", "dye.toml", "--paths", "4096", "--out", weighting];
        batwing(at).args(flags).assert().success();
        let design = std::fs::read_dir(at.join(weighting)).expect("a folder");
        let mut designs = design.filter_map(|entry| Some(entry.ok()?.path()));
        let design = designs.find(|path| path.join("geometric").is_dir()).expect("one");
        let results = design.join("geometric");
        batwing(at).arg("export").arg(results).args(["--format", "ies", "--out", "x.ies"]).output()
    };
    let refused = export("radiometric").expect("it runs");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && said.contains("in watts: expected lumens"), "{said}");
    let written = export("photometric").expect("it runs");
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
}
