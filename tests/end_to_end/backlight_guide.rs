// SPDX-License-Identifier: MIT OR Apache-2.0
//! `docs/guide/backlight.md`: every command in it runs on `data/backlight/`, with few paths; what it
//! quotes of the files stands in them, and the figures that it quotes come out within errors.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use batwing_tests::{read, workspace};

use crate::support::binary::batwing;
use crate::support::runs::estimate;

/// Errors by which a figure of few paths may be off.
const ERRORS: f64 = 4.0;

/// `value ± error` of a cell of a table; 0 without an error.
fn quoted(cell: &str) -> (f64, f64) {
    let mut numbers = cell.split('±').map(|number| number.trim().parse().expect(cell));
    (numbers.next().expect(cell), numbers.next().unwrap_or_default())
}

/// Cells of the rows below the heading that begins with these words.
fn rows<'a>(page: &'a str, heading: &str) -> Vec<Vec<&'a str>> {
    let lines = page.lines().skip_while(|line| !line.starts_with(heading)).skip(2);
    let rows = lines.take_while(|line| line.starts_with('|'));
    rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

fn close(found: (f64, f64), cell: &str, what: &str) {
    let (value, error) = quoted(cell);
    let off = (found.0 - value).abs();
    assert!(off <= ERRORS * error.hypot(found.1), "{what}: {found:?}, quoted {cell}");
}

fn times((value, error): (f64, f64), factor: f64) -> (f64, f64) {
    (value * factor, error * factor)
}

/// The file that a run or an analysis left behind.
fn json(at: &Path, file: &str) -> Value {
    serde_json::from_str(&read(at.join(file))).expect("JSON")
}

#[test]
#[ignore = "nightly: runs, studies, a search and tolerances of two backlights (75 s)"]
fn nightly_every_command_of_the_backlight_runs_and_gives_the_quoted_figures() {
    let (folder, data) = (tempdir().expect("a folder"), workspace().join("data/backlight"));
    let at = folder.path();
    let page = read(workspace().join("docs/guide/backlight.md"));
    let mut files = String::new();
    for entry in std::fs::read_dir(&data).expect("a folder") {
        let path = entry.expect("an entry").path();
        let mut text = read(&path);
        files += &text;
        // Fewer paths, samples and candidates.
        for (many, few) in [
            ("paths = 200_000", "paths = 20_000"),
            ("paths = 100_000", "paths = 20_000"),
            ("paths = 50_000", "paths = 10_000"),
            ("samples = 24", "samples = 8"),
            ("evaluations = 8", "evaluations = 4"),
        ] {
            text = text.replace(many, few);
        }
        std::fs::write(at.join(path.file_name().expect("a name")), text).expect("written");
    }
    // What the page shows of the files, but for remarks.
    let mut blocks = page.split("```toml\n").skip(1);
    let shown = blocks.by_ref().flat_map(|block| block.split("```").next().unwrap_or("").lines());
    for line in shown.filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let line = line.split('#').next().unwrap_or(line).trim_end();
        assert!(files.lines().any(|known| known.starts_with(line)), "{line}");
    }
    let mut ran = 0;
    for line in page.lines().filter_map(|line| line.strip_prefix("    batwing ")) {
        let few: &[&str] = if line.starts_with("bsdf") { &["--paths", "512"] } else { &[] };
        let output = batwing(at).args(line.split_whitespace()).args(few).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        // Where slanted faces in contact cross, one path in a million leaks, and is said to.
        let leaks = said.contains("leaked out of a closed body");
        assert!(output.status.success() && (leaks || !said.contains("lost")), "{line}: {said}");
        ran += 1;
    }
    assert_eq!(ran, 13);

    let model = &json(at, "out/results.json")["designs"]["backlight"]["geometric"];
    let absolute = |key: &str| estimate(&model["absolute"]["figures"][key]);
    for row in rows(&page, "| quantity | computed |") {
        let found = match row[0].split(" (").next().unwrap_or_default() {
            "up" => times(estimate(&model["power_ledger"]["escaped_up"]), 100.0),
            "absorbed by cup" => times(estimate(&model["power_ledger"]["absorbed_by_cup"]), 100.0),
            "absorbed by plate" => {
                times(estimate(&model["power_ledger"]["absorbed_by_plate"]), 100.0)
            }
            "flux up" => absolute("flux_up"),
            "illuminance cell mean" => absolute("illuminance_cell_mean"),
            "luminance, mean" => estimate(&model["receivers"]["luminance"]["mean"]),
            "coefficient of variation, cell" => times(estimate(&model["cell_variation"]), 100.0),
            // Ranges of extremes that few paths do not resolve.
            "luminance, min/max" | "nine points, min/max" => continue,
            other => panic!("{other}"),
        };
        close(found, row[1], row[0]);
    }
    // Luminance of a Lambertian panel: its mean times π times its area.
    let luminance = |key: &str| estimate(&model["receivers"]["luminance"][key]).0;
    let flux = luminance("mean") * std::f64::consts::PI * 72e-3 * 44e-3;
    assert!((flux / luminance("flux") - 1.0).abs() < 1e-9, "{flux}");

    let studies = [
        ("distance", "| distance |", 3, vec![("flux.luminance", 3)]),
        ("stacks", "| films |", 6, vec![("mean.display", 1), ("flux_up", 2)]),
    ];
    for (study, heading, count, columns) in studies {
        let study = json(at, &format!("{study}/study.json"));
        let setups = study["setups"].as_array().expect("set-ups");
        let quoted = rows(&page, heading);
        assert_eq!((quoted.len(), setups.len()), (count, count));
        for (row, setup) in quoted.iter().zip(setups) {
            let figures = setup["figures"].as_array().expect("figures");
            for &(key, column) in &columns {
                let found = figures.iter().find(|figure| figure["figure"] == key);
                close(estimate(found.expect(key)), row[column], row[0]);
            }
        }
    }
    let receivers = &json(at, "cell/results.json")["designs"]["cell"]["geometric"]["receivers"];
    for row in rows(&page, "| figure | reads |") {
        let (figure, receiver) = row[0].trim_matches('`').split_once('.').expect("a receiver");
        close(estimate(&receivers[receiver][figure]), row[2], row[0]);
    }
    let dimmed = json(at, "zones/zones.json");
    for row in rows(&page, "| figure | computed |") {
        let found = match row[0].split(" (").next().unwrap_or_default() {
            "luminance at full drive, mean" => &dimmed["white"],
            "black beside bright" => &dimmed["halo"]["black"],
            "bright" => &dimmed["halo"]["bright"],
            "halo contrast" => &dimmed["halo"]["contrast"],
            // In bins of half a pitch.
            "light of one zone, 50 % at" => &dimmed["light_spread"]["radii"][0]["radius_mm"],
            other => panic!("{other}"),
        };
        close(estimate(found), row[1], row[0]);
    }
    let analysis = json(at, "mounted/tolerance.json");
    for row in rows(&page, "| figure | nominal (%) |") {
        let key = row[0].trim_matches('`');
        close(times(estimate(&analysis["figures"][key]["nominal"]), 100.0), row[1], key);
    }
}
