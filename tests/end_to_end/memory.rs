// SPDX-License-Identifier: MIT OR Apache-2.0
//! Memory of a run with many bins, one copy of the groups of paths; and of solutions with many orders.
//!
//! The address space of the process is limited, so that one copy more fails. The figures are those
//! of `docs/reference/design-file.md`.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::{Command, Output};

use crate::support::binary::PATH;
use tempfile::tempdir;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data");

/// Bytes of a bin: 64 groups of paths and their total.
const BIN: usize = 8 * 65;
/// What the program takes besides: itself (some 30 MB), stacks of threads, one heap, and single maps on
/// their way into files, bytes: 130 to 180 MB. One copy more of the smallest groups here takes 420 MB on
/// top.
const BESIDES: usize = 320_000_000;

/// What comes of running `text` within so many bytes.
fn within(folder: &Path, text: &str, bytes: usize, more: &str) -> Output {
    std::fs::write(folder.join("many.toml"), text).expect("written");
    let run = "run many.toml --paths 6400 --threads 2 --quiet --out out";
    limited(folder, bytes, &format!("{run} {more}"))
}

/// What comes of a command within so many bytes.
fn limited(folder: &Path, bytes: usize, command: &str) -> Output {
    Command::new("sh")
        .arg("-c")
        .arg(format!("ulimit -v {}; exec '{PATH}' {command}", bytes / 1024))
        .current_dir(folder)
        // A heap for each thread that waits for another takes 64 MB of addresses, used or not.
        .env("MALLOC_ARENA_MAX", "1")
        .output()
        .expect("it runs")
}

/// 4001 orders, a third more than asked for, take some 16 GB; states of 100,000 slices as many.
#[test]
fn solutions_for_which_there_is_no_memory_are_refused_in_one_line() {
    let folder = tempdir().expect("a folder");
    let case = format!("{FOLDER}/../tests/findings/grating-n1500.json");
    let design = format!("{FOLDER}/designs/d1.toml");
    for (command, words) in [
        (format!("--quiet grating '{case}'"), "grating-n1500.json: orders: expected at most "),
        (
            format!("--quiet near-field '{design}' --ring 75 --slices 100000"),
            "orders: expected at most ",
        ),
    ] {
        let output = limited(folder.path(), 3_000_000_000, &command);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(said.contains(words) && said.contains(" GiB of free memory"), "{said}");
    }
}

/// Runs `text` within so many bytes.
fn fits(folder: &Path, text: &str, bytes: usize, more: &str) {
    let output = within(folder, text, bytes, more);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{bytes} bytes: {said}");
}

/// The bare dome with a receiver of so many bins.
fn receiver(side: usize) -> String {
    let bare = std::fs::read_to_string(Path::new(FOLDER).join("designs/bare-dome.toml"));
    let bare = bare.expect("the design");
    format!(
        "{bare}\n[[receivers]]\nname = \"fine\"\nkind = \"plane\"\nposition_mm = [0.0, 0.0, 4.0]\nsize_mm = [20.0, 20.0]\nbins = [{side}, {side}]\n"
    )
}

#[test]
fn bins_for_which_there_is_no_memory_are_refused_in_one_line() {
    let folder = tempdir().expect("a folder");
    let output = within(folder.path(), &receiver(2000), 1_500_000_000, "");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("many.toml") && said.contains(" GiB of memory"), "{said}");
    assert!(!folder.path().join("out").exists());
}

#[test]
#[ignore = "slow: maps near the limit of the memory (6 s)"]
fn groups_are_in_memory_once() {
    let folder = tempdir().expect("a folder");
    let bins = 900 * 900;
    fits(folder.path(), &receiver(900), bins * BIN + BESIDES, "");
    // With batches, what is added and what it is added to.
    let until = "--until-error uniformity=0.0001% --most-paths 20000";
    fits(folder.path(), &receiver(900), 2 * bins * BIN + BESIDES, until);
}

#[test]
#[ignore = "nightly: maps near the limit of the memory (12 s)"]
fn nightly_maps_and_far_fields_are_in_memory_once_beside_what_is_judged() {
    let folder = tempdir().expect("a folder");
    let text = receiver(1);
    let mut fine = text.clone();
    for (from, to) in [
        ("\nbin_mm = 0.1 ", "\nbin_mm = 0.02 "),
        ("\nbin_deg = 2.5 ", "\nbin_deg = 0.1 "),
        ("\nazimuth_bin_deg = 10.0 ", "\nazimuth_bin_deg = 1.0 "),
    ] {
        assert!(fine.contains(from), "{from}");
        fine = fine.replace(from, to);
    }
    // The design scales the map from its smallest bin on, which makes another map.
    let bins = 2 * 890 * 890 + 1800 * 360;
    fits(folder.path(), &fine, bins * BIN + BESIDES, "");
}

#[test]
#[ignore = "nightly: 9 s"]
fn nightly_many_wavelengths_take_what_is_said() {
    let folder = tempdir().expect("a folder");
    let glass = Path::new(FOLDER).join("materials/fused-silica.yml");
    std::fs::copy(glass, folder.path().join("glass.yml")).expect("copied");
    let mut text = receiver(700);
    for (from, to) in [
        ("\nindex = 1.41 ", "\nmaterial_file = \"glass.yml\" "),
        (
            "\n[light]\nwavelength_nm = 550.0 ",
            "\n[light.spectrum]\nkind = \"table\"\nwavelength_nm = [450.0, 650.0]\npower = [1.0, 1.0]\nweighting = \"radiometric\"\nsamples = 3 ",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    // Three wavelengths and their sum, the figures of one, and the judged maps of both.
    let (map, far) = (178 * 178, 72 * 36);
    let bins = 4 * (700 * 700 + map + far) + map + far + 2 * map;
    // X, Y and Z of every bin in 16 groups and their sum, and the largest on its way into files.
    let colours = (3 * (16 + 1) * (700 * 700 + map + far) + 90 * 700 * 700) * size_of::<f64>();
    fits(folder.path(), &text, bins * BIN + colours + BESIDES, "");
}
