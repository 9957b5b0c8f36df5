// SPDX-License-Identifier: MIT OR Apache-2.0
//! Interrupted traces continue from their finished groups and give the bytes of whole ones.

use std::path::{Path, PathBuf};

use crate::support::binary::batwing;
use crate::support::runs::{contents, files, interrupted, signalled};
use tempfile::tempdir;

/// Two packages whose side is left out, so that a million paths are traced in seconds.
const DESIGN: &str = r#"
name = "pair"
dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }
silicone = { index = 1.41 }
mirror = { kind = "specular", reflectance = 0.95, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.86, reflection = "specular" }
array = { columns = 2, rows = 1, pitch_mm = 8.3 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.25 }
trace = { paths = 1_000_000 }
"#;

const GLASS: &str =
    "DATA:\n  - type: tabulated n\n    data: |\n        0.4 1.43\n        0.7 1.40\n";

fn run(folder: &Path, out: &str, flags: &[&str]) -> String {
    let output = batwing(folder)
        .args(["run", "pair.toml", "--out", out, "--quiet"])
        .args(flags)
        .output()
        .expect("it runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(output.status.success(), "{said}");
    said
}

fn groups(folder: &Path) -> Vec<PathBuf> {
    let mut groups = files(&folder.join("cache/checkpoints"));
    groups.retain(|path| path.extension().is_some_and(|e| e == "group"));
    groups
}

#[test]
fn an_interrupted_trace_goes_on_to_the_same_bytes() {
    let directory = tempdir().expect("a folder");
    let folder = directory.path();
    std::fs::write(folder.join("pair.toml"), DESIGN).expect("written");
    assert_eq!(run(folder, "whole", &["--threads", "2"]), "");
    let whole = contents(&folder.join("whole"));
    assert!(!folder.join(".batwing-cache").exists());

    for (out, threads, signal, exit_code) in
        [("first", "1", "-INT", 130), ("second", "2", "-TERM", 143)]
    {
        let arguments = ["run", "pair.toml", "--out", out, "--cache", "cache", "--threads", "2"];
        let ready = || groups(folder).len() > 4;
        let (code, said) = signalled(signal, folder, &arguments, ready);
        assert_eq!(code, Some(exit_code), "{said}");
        assert_eq!(
            said,
            "batwing: interrupted before results.json was written; finished groups of paths stay in `cache`, a new run goes on from there\n"
        );
        let kept = groups(folder);
        assert!(kept.len() > 4 && kept.len() < 64, "{} groups", kept.len());

        // Groups of another seed are others: none of these is touched.
        run(folder, "other", &["--cache", "cache", "--seed", "2"]);
        assert_eq!(groups(folder).len(), kept.len());

        // One of them is another's before the first attempt, and damaged before the second.
        let cache = kept[0].strip_prefix(folder).expect("in the folder");
        let why = if threads == "1" {
            std::fs::copy(&kept[1], &kept[0]).expect("copied");
            "holds paths of another trace or group"
        } else {
            let bytes = std::fs::read(&kept[0]).expect("a group");
            std::fs::write(&kept[0], &bytes[..bytes.len() - 9]).expect("written");
            "is damaged"
        };
        let warned =
            format!("batwing: warning: `{}` {why}; its paths are traced anew\n", cache.display());
        let said = run(folder, out, &["--cache", "cache", "--threads", threads]);
        assert_eq!(said, warned);
        assert_eq!(contents(&folder.join(out)), whole, "{threads} threads");
        assert!(!folder.join("cache").exists(), "{:?}", files(&folder.join("cache")));
    }
    let other = contents(&folder.join("other"));
    assert_ne!(other[Path::new("results.json")], whole[Path::new("results.json")]);
}

/// Interrupts batches of `design`, each of fewer paths than a trace is kept in parts for, and lets
/// them go on.
fn batches_go_on(folder: &Path, design: &str) {
    std::fs::write(folder.join("pair.toml"), design).expect("written");
    let until = [
        "--until-error",
        "extraction_efficiency=1e-9",
        "--most-paths",
        "9000000",
        "--cache",
        "cache",
    ];
    let whole = run(folder, "whole", &until);
    assert!(whole.contains("--most-paths allows no further batch"), "{whole}");
    assert!(!folder.join("cache").exists());

    let mut arguments = vec!["run", "pair.toml", "--out", "again"];
    arguments.extend(until);
    let (code, said) = interrupted(folder, &arguments, || !groups(folder).is_empty());
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("finished groups of paths stay in `cache`"), "{said}");
    // The sums of all wavelengths are kept in one file.
    let kept = groups(folder);
    assert_eq!(kept.len(), 1, "{kept:?}");
    assert!(std::fs::metadata(&kept[0]).is_ok_and(|file| file.len() > 1000));
    assert_eq!(run(folder, "again", &until), whole);
    assert_eq!(contents(&folder.join("again")), contents(&folder.join("whole")));
    assert!(!folder.join("cache").exists());
}

#[test]
fn interrupted_batches_go_on_to_the_same_bytes() {
    let directory = tempdir().expect("a folder");
    batches_go_on(directory.path(), &DESIGN.replace("1_000_000", "200_000"));
}

#[test]
fn interrupted_batches_of_a_spectrum_go_on_to_the_same_bytes() {
    let directory = tempdir().expect("a folder");
    let folder = directory.path();
    let white = "light = { spectrum = { kind = \"lines\", wavelength_nm = [450.0, 650.0], power = [1.0, 2.0], weighting = \"radiometric\" } }";
    let design = DESIGN
        .replace("1_000_000", "200_000")
        .replace("index = 1.41", "material_file = \"glass.yml\"")
        .replace("light = { wavelength_nm = 550.0 }", white);
    std::fs::write(folder.join("glass.yml"), GLASS).expect("written");
    batches_go_on(folder, &design);
}
