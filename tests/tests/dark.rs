// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light that misses the map, or the section through it: refused in words with nothing written, or drawn dark. Lights that take more memory than there may be.
//!
//! Source: `docs/design-file.md`.
#![cfg(unix)]

use batwing_tests::runs::{estimate, run_text};
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

#[test]
fn a_map_without_light_is_refused_and_nothing_written() {
    let folder = tempdir().expect("a folder");
    let text = format!("{BARE}{}", beam(3.0, -1.0));
    let said = run_text(folder.path(), "dark", &text, "r", &[]).expect_err("a dark map");
    assert_eq!(
        said.trim(),
        "batwing: dark.toml: receiver.plane_height_mm = 3: expected light that goes up through the map there, got none of 64000 paths"
    );
    assert!(!folder.path().join("r/results.json").exists());
    let left = std::fs::read_dir(folder.path().join("r"));
    assert_eq!(left.map_or(0, Iterator::count), 0);
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
