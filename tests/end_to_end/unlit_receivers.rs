// SPDX-License-Identifier: MIT OR Apache-2.0
//! Maps and sections without light, bins too wide for a figure, bins beyond the memory.
//!
//! A figure that has no light is left out with a warning; its picture is drawn dark.
//! Source: `docs/reference/design-file.md`.

use std::path::Path;

use crate::support::binary::batwing;
use crate::support::runs::{estimate, run_text};
use tempfile::tempdir;

const BARE: &str = r#"
name = "dark"
light = { wavelength_nm = 550.0 }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5 }
trace = { paths = 64_000 }
"#;

fn beam(y: f64, up: f64) -> String {
    format!(
        "[[sources]]\nname = \"beam\"\nkind = \"cosine\"\nexponent = 1e6\nposition_mm = [0.0, {y:?}, 2.0]\nnormal = [0.0, 0.0, {up:?}]\n"
    )
}

/// Runs the design with these flags: whether it succeeds, and what it says.
fn said(folder: &Path, text: &str, flags: &[&str]) -> (bool, String) {
    std::fs::write(folder.join("dark.toml"), text).expect("written");
    let output = batwing(folder)
        .args(["run", "dark.toml", "--quiet"])
        .args(flags)
        .output()
        .expect("it runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.success(), said)
}

/// Two packages, a beam from each to the side, and a receiver that its lower half meets.
fn sideways() -> String {
    let bare = BARE.replace("columns = 1", "columns = 2");
    format!(
        "{bare}[[sources]]\nname = \"side\"\nkind = \"cosine\"\nexponent = 1e6\nposition_mm = [0.0, 0.0, 2.0]\nnormal = [0.0, 1.0, 0.0]\n\
         [[receivers]]\nname = \"wall\"\nkind = \"plane\"\nposition_mm = [0.0, 3.0, 1.0]\nnormal = \"+y\"\nsize_mm = [20.0, 2.0]\nbins = [2, 1]\n"
    )
}

#[test]
fn a_map_without_light_leaves_uniformity_out_and_warns() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let text = sideways();
    let warned = "batwing: warning: dark.toml: receiver.plane_height_mm = 3: no light of 64000 paths goes up through the map there";
    for flags in [
        &["--out", "r"][..],
        &["--out", "u", "--until-error", "flux.wall=1%", "--most-paths", "128000"],
    ] {
        let (good, said) = said(at, &text, flags);
        assert!(good && said.contains(&warned[..80]), "{said}");
    }
    let (_, said) = said(at, &text, &["--out", "s"]);
    assert!(said.starts_with(warned), "{said}");
    let run = run_text(at, "dark", &text, "r2", &[]).expect("it runs");
    let model = &run["designs"]["dark"]["geometric"];
    for absent in ["uniformity", "uniformity_diagonal", "illuminance_valley_to_peak"] {
        assert!(model.get(absent).is_none(), "{absent}");
    }
    let (flux, error) = estimate(&model["receivers"]["wall"]["flux"]);
    assert!((flux - 0.5).abs() < 5.0 * error && error < 0.01, "{flux} ± {error}");
    assert!(estimate(&model["peak_angle_deg"]).0 > 80.0);
    assert!(at.join("r2/dark/geometric/illuminance.png").exists());
    let report = batwing(at).args(["report", "r2"]).output().expect("it runs");
    let wrong = String::from_utf8_lossy(&report.stderr);
    assert!(report.status.success(), "{wrong}");
    // That uniformity was asked for.
    let (good, refused) = self::said(at, &text, &["--out", "v", "--until-error", "uniformity=1%"]);
    assert!(!good && !at.join("v/results.json").exists());
    let last = refused.trim_end().lines().last().unwrap_or_default();
    assert!(
        last.starts_with("batwing: --until-error: dark.toml: expected a figure that the design has, got uniformity, and receiver.bin_mm is too wide"),
        "{refused}"
    );
}

#[test]
fn light_that_nothing_lets_up_leaves_all_figures_out() {
    let folder = tempdir().expect("a folder");
    let text = format!("{BARE}{}", beam(3.0, -1.0));
    let run = run_text(folder.path(), "dark", &text, "r", &[]).expect("it runs");
    let model = &run["designs"]["dark"]["geometric"];
    for absent in ["peak_angle_deg", "centre_to_peak", "uniformity"] {
        assert!(model.get(absent).is_none(), "{absent}");
    }
    let ledger = &model["power_ledger"];
    assert!((estimate(&ledger["absorbed_by_floor"]).0 - 1.0).abs() < 1e-12);
}

#[test]
fn bins_too_wide_for_the_valley_are_told_with_those_that_are_not() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let bare = BARE.replace("columns = 1", "columns = 2");
    let (good, told) = said(at, &bare, &["--out", "wide"]);
    let begins = "batwing: warning: dark.toml: receiver.bin_mm = 0.5: too wide for a fit to the valley between neighbours 8 mm apart";
    assert!(good && told.starts_with(begins), "{told}");
    let (_, advised) = told.split_once("with bins of ").expect("advice");
    let (width, _) = advised.split_once(" mm").expect("a width");
    let narrow = bare.replace("bin_mm = 0.5", &format!("bin_mm = {width}"));
    let (good, told) = said(at, &narrow, &["--out", "narrow"]);
    assert!(good && told.is_empty(), "{told}");
    let read = |out: &str| {
        let text = std::fs::read_to_string(at.join(out).join("results.json")).expect("results");
        let all: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        all["designs"]["dark"]["geometric"].get("uniformity").is_some()
    };
    assert!(read("narrow") && !read("wide"));
}

#[test]
fn a_section_without_light_is_drawn() {
    let folder = tempdir().expect("a folder");
    let text = format!("{BARE}{}", beam(3.0, 1.0));
    let run = run_text(folder.path(), "dark", &text, "r", &[]).expect("it runs");
    let ledger = &run["designs"]["dark"]["geometric"]["power_ledger"];
    assert!((estimate(&ledger["escaped_up"]).0 - 1.0).abs() < 1e-12);
    let picture = "r/dark/geometric/illuminance_cross_section.png";
    assert!(folder.path().join(picture).exists());
}

#[test]
fn lights_beyond_the_memory_are_refused_before_the_folder_is_made() {
    let folder = tempdir().expect("a folder");
    let receiver = "[[receivers]]\nname = \"r\"\nkind = \"plane\"\nposition_mm = [0.0, 0.0, 3.0]\nsize_mm = [1.0, 1.0]\nbins = [2000, 1999]\n";
    let text = format!(
        "{BARE}{receiver}{}wavelength_nm = 450.0\n[far_field]\nbin_deg = 0.1\nazimuth_bin_deg = 1.0\n",
        beam(3.0, 1.0)
    );
    let said = run_text(folder.path(), "dark", &text, "r", &[]).expect_err("too many bins");
    assert!(
        said.contains("dark.toml: ")
            && said.contains(" bins at 1 wavelength: expected at most 2 GiB"),
        "{said}"
    );
    assert!(!folder.path().join("r").exists());
}
