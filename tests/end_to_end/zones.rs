// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing zones`: superposition against direct traces, energy, larger arrays, refusals.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use batwing_tests::read;

use crate::support::binary::batwing;
use crate::support::runs::{contents, estimate, run_text};

/// `count` x `count` LEDs in a white box under a plate that scatters; walls half a pitch beyond.
pub fn boxed(count: usize) -> String {
    let length = 6 * count;
    format!(
        r#"
name = "boxed"
mirror = {{ kind = "lambertian", reflectance = 0.8, extent = "array" }}
led = {{ size_mm = [0.5, 0.5], height_mm = 0.15, reflectance = 0.8, reflection = "lambertian", power_lm = 8.0 }}
array = {{ columns = {count}, rows = {count}, pitch_mm = 6.0 }}
light = {{ wavelength_nm = 550.0 }}
receiver = {{ plane_height_mm = 4.5, bin_mm = 1.0, smoothing_sigma_mm = 0.0 }}
trace = {{ paths = 40_000 }}

[housing]
kind = "lambertian"
reflectance = 0.8
height_mm = 4.0
inner_size_mm = [{length}.0, {length}.0]
floor = {{ kind = "lambertian", reflectance = 0.8 }}

[[solids]]
name = "plate"
kind = "box"
per = "array"
size_mm = [{length}.0e0, {length}.0e0, 1.0]
position_mm = [0.0, 0.0, 3.5]
medium = {{ index = 1.49 }}
scatter = {{ kind = "lambertian", transmitted = 0.6, reflected = 0.38 }}

[[receivers]]
name = "front"
kind = "luminance"
position_mm = [0.0, 0.0, 4.5]
size_mm = [{length}.0, {length}.0]
bins = [{length}, {length}]
theta_bin_deg = 30.0
phi_bin_deg = 360.0
"#
    )
    // A little smaller than the box.
    .replace(&format!("{length}.0e0"), &format!("{}", length as f64 - 0.1))
}

/// Drives that differ from package to package.
const DRIVES: &str = "1,0.2,0,0.4,0.9\n0,0.7,0.1,0,0\n0.3,0,1,0.5,0\n0,0,0.6,0,0.8\n0.05,0,0,1,0\n";

/// Runs `zones` with these arguments in `folder`; the results in `out`.
fn zones(folder: &Path, line: &str, out: &str) -> Value {
    let arguments = line.split_whitespace().chain(["--quiet", "--out", out, "--cache"]);
    let cache = format!("cache-{out}");
    batwing(folder).arg("zones").args(arguments).arg(&cache).assert().success();
    serde_json::from_str(&read(folder.join(out).join("zones.json"))).expect("JSON")
}

/// Rows of a table without its heading.
fn table(path: &Path) -> Vec<Vec<f64>> {
    let text = read(path);
    let rows = text.lines().skip(1);
    rows.map(|row| row.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect()
}

#[test]
fn a_pattern_is_what_a_trace_of_its_drives_gives() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("boxed.toml"), boxed(5)).expect("written");
    std::fs::write(at.join("drives.csv"), DRIVES).expect("written");
    for (receiver, out) in [("--receiver front", "front"), ("", "plane")] {
        let line = format!("boxed.toml --pattern drives.csv --direct {receiver}");
        let found = zones(at, &line, out);
        // One response for each kind of place of a square array.
        assert_eq!(found["responses"], 6);
        let direct = &found["direct"];
        let [square, largest] =
            ["chi_square", "largest"].map(|key| direct[key].as_f64().expect("a number"));
        // Of 25 degrees of freedom: between the quantiles of 0.1 and 99.9 %.
        assert!((8.6..52.6).contains(&square) && largest < 3.5, "{out}: {direct}");
        assert!(found["beyond_reach"].is_null());
    }
    // The first row of the pattern is the top, and lights the zones there.
    let rows = table(&at.join("front/zones.csv"));
    assert_eq!(rows[0][..5], [1.0, 1.0, -12.0, 12.0, 1.0]);
    assert_eq!(rows[3][..5], [4.0, 1.0, 6.0, 12.0, 0.4]);
    assert!(rows[0][5] > 1.5 * rows[3][5], "{rows:?}");
    // Black zones leak a share of the backlight.
    let black = &rows[5];
    assert!(black[4] == 0.0 && (black[7] * 5000.0 / black[5] - 1.0).abs() < 1e-9, "{black:?}");
    assert!(rows.iter().all(|row| row[6] > 0.0 && row[8] > 0.0));
    // Columns and rows are whole numbers.
    assert!(
        read(at.join("front/zones.csv")).lines().nth(4).is_some_and(|row| row.starts_with("4,1,"))
    );
}

/// Staggered rows and places in no rows: as a trace of the drives, and otherwise than rows at right
/// angles of the same pitches.
#[test]
fn zones_of_packages_in_no_full_rows_are_what_a_trace_gives() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let square = boxed(4).replace("pitch_mm = 6.0", "pitch_mm = [5.0, 5.5]");
    let staggered = square.replace("5.5]", "5.5], arrangement = \"hexagonal\"");
    std::fs::write(at.join("square.toml"), square).expect("written");
    std::fs::write(at.join("staggered.toml"), staggered).expect("written");
    // Chips off the axes, so that turns move their light.
    let free = boxed(4)
        .replace(
            "columns = 4, rows = 4, pitch_mm = 6.0",
            "positions_file = \"p.txt\", pitch_mm = 4.0",
        )
        .replace("size_mm = [0.5, 0.5]", "size_mm = [1.5, 0.3], offset_mm = [1.0, 0.0]");
    std::fs::write(at.join("free.toml"), &free).expect("written");
    std::fs::write(at.join("unturned.toml"), free.replace("p.txt", "q.txt")).expect("written");
    let rows = ["-6 -6 90", "5 -4 -150", "6 5.5 -60", "-4 1 0", "-5 6 180"];
    let text = format!("x_mm y_mm turn_deg\n{}\n", rows.join("\n"));
    std::fs::write(at.join("p.txt"), text).expect("written");
    let places = rows.map(|row| row.rsplit_once(' ').expect("a turn").0);
    std::fs::write(at.join("q.txt"), places.join("\n")).expect("written");
    std::fs::write(at.join("drives.csv"), "1,0.2,0,0.4\n0,0.7,0.1,0\n0.3,0,1,0.5\n0,0,0.6,0\n")
        .expect("written");
    std::fs::write(at.join("four.csv"), "1,0.2\n0,0.7\n").expect("written");
    let direct = |line: &str, out: &str, [low, high]: [f64; 2]| {
        let found = zones(at, &format!("{line} --direct --receiver front --paths 20000"), out);
        let direct = &found["direct"];
        let [square, largest] =
            ["chi_square", "largest"].map(|key| direct[key].as_f64().expect("a number"));
        // Between the quantiles of 0.1 and 99.9 %.
        assert!((low..high).contains(&square) && largest < 4.0, "{out}: {direct}");
        (found, table(&at.join(out).join("zones.csv")))
    };
    let sixteen = [3.9, 39.3];
    let (found, rows) = direct("staggered.toml --pattern drives.csv", "staggered", sixteen);
    // No place stands for another.
    assert_eq!(found["responses"], 16);
    let (_, control) = direct("square.toml --pattern drives.csv", "square", sixteen);
    let apart = |rows: &[Vec<f64>], control: &[Vec<f64>]| {
        let off = rows.iter().zip(control).map(|(a, b)| (a[5] - b[5]) / a[6].hypot(b[6]));
        let square: f64 = off.map(|off| off.powi(2)).sum();
        assert!(square > 100.0, "{square}: {rows:?} {control:?}");
    };
    apart(&rows, &control);
    assert!(found.get("free_places").is_none());
    let line = "free.toml --pattern four.csv --zones 2x2";
    let (found, rows) = direct(line, "free", [0.09, 18.5]);
    assert_eq!((&found["responses"], &found["free_places"]), (&5.into(), &true.into()));
    let (_, control) = direct(&line.replace("free", "unturned"), "unturned", [0.09, 18.5]);
    apart(&rows, &control);
    for (line, words) in [
        ("free.toml --pattern four.csv", "--zones: expected columns and rows of zones"),
        ("free.toml --pattern drives.csv --zones 4x4", "--zones: expected at most as many"),
        (
            "staggered.toml --pattern drives.csv --packages 6x6",
            "--packages: expected none of packages",
        ),
    ] {
        let arguments = line.split_whitespace().chain(["--out", "none"]);
        let refused = batwing(at).arg("zones").args(arguments).assert().failure();
        let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(said.contains(words) && said.lines().count() == 1, "{said}");
    }
    assert!(!at.join("none").exists(), "half-written");
}

/// In a cell that repeats every zone shines in all cells.
#[test]
fn cells_that_repeat_have_no_zones() {
    let folder = tempdir().expect("a folder");
    let walls = "kind = \"lambertian\"\nreflectance = 0.8\nheight_mm = 4.0\n";
    let cell = boxed(2).replace(walls, "kind = \"periodic\"\nheight_mm = 5.0\n");
    std::fs::write(folder.path().join("cell.toml"), cell).expect("written");
    std::fs::write(folder.path().join("drives.csv"), "1,0\n0,1\n").expect("written");
    let line = ["zones", "cell.toml", "--pattern", "drives.csv", "--out", "out"];
    let refused = batwing(folder.path()).args(line).assert().failure();
    let said = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(said.contains("cell.toml: housing.kind") && said.contains("\"periodic\""), "{said}");
    assert!(!folder.path().join("out").exists(), "half-written");
}

/// Small drives leave numbers that people can read, with errors.
#[test]
fn the_smallest_drives_give_no_rows_of_zeros() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("boxed.toml"), boxed(3)).expect("written");
    std::fs::write(at.join("drives.csv"), "1e-12,0,0\n0,0,0\n0,0,0\n").expect("written");
    let line = "zones boxed.toml --pattern drives.csv --paths 4096 --out out";
    let output = batwing(at).args(line.split(' ')).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{output:?}");
    let halo = said.lines().find(|line| line.starts_with("bright")).expect("a line");
    assert!(halo.chars().count() < 80 && halo.contains(")e-"), "{halo}");
    let rows = table(&at.join("out/zones.csv"));
    assert!(rows.iter().all(|row| row[6] > 0.0), "{rows:?}");
}

#[test]
fn full_drive_is_the_light_of_a_run() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let text = boxed(5);
    let run = run_text(at, "boxed", &text, "out", &["--paths", "200000"]).expect("results");
    std::fs::write(at.join("full.csv"), "1").expect("written");
    let line = "boxed.toml --pattern full.csv --zones 1x1 --receiver front";
    let found = zones(at, line, "zones");
    let of_run = &run["designs"]["boxed"]["geometric"]["receivers"]["front"];
    for (figure, of_zones) in [("mean", &found["white"]), ("mean", &found["uniformity"]["mean"])] {
        let (expected, got) = (estimate(&of_run[figure]), estimate(of_zones));
        let error = expected.1.hypot(got.1);
        assert!((expected.0 - got.0).abs() < 3.5 * error, "{figure}: {expected:?} {got:?}");
        assert!(error < 0.01 * got.0);
    }
    // White everywhere leaves no black.
    assert!(found["halo"].is_null());
}

#[test]
fn the_number_of_threads_and_kept_responses_change_no_bit() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("boxed.toml"), boxed(5)).expect("written");
    std::fs::write(at.join("drives.csv"), DRIVES).expect("written");
    let line = "boxed.toml --pattern drives.csv --paths 6400 --threads";
    zones(at, &format!("{line} 1"), "one");
    zones(at, &format!("{line} 2"), "two");
    let one = contents(&at.join("one"));
    assert_eq!(one.len(), 9);
    assert!(one == contents(&at.join("two")));
    // Again, from what was kept: traced with other results in the way, it would not be the same.
    std::fs::rename(at.join("cache-two"), at.join("cache-three")).expect("moved");
    zones(at, &format!("{line} 2"), "three");
    assert!(one == contents(&at.join("three")));
}

#[test]
#[ignore = "slow: 5 s"]
fn a_small_array_stands_for_a_larger_one() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("five.toml"), boxed(5)).expect("written");
    std::fs::write(at.join("twelve.toml"), boxed(12)).expect("written");
    std::fs::write(at.join("drives.csv"), "0,0,0\n0.5,0,0\n0,1,0\n").expect("written");
    let line = "--pattern drives.csv --zones 3x3 --receiver front --paths 20000";
    let small = zones(at, &format!("five.toml {line} --packages 12x12"), "small");
    let whole = zones(at, &format!("twelve.toml {line}"), "whole");
    assert_eq!((&small["responses"], &whole["responses"]), (&6.into(), &21.into()));
    let (share, error) = estimate(&small["beyond_reach"]["share"]);
    assert!(share > 0.0 && share < 0.1 && error > 0.0, "{share} {error}");
    // Up to twice the packages of the design all are traced, and nothing is left beyond.
    let six = zones(at, &format!("five.toml {line} --packages 6x9"), "six");
    assert_eq!((&six["beyond_reach"], &six["responses"]), (&Value::Null, &15.into()));
    let tables = ["small/zones.csv", "whole/zones.csv"].map(|name| table(&at.join(name)));
    for (a, b) in tables[0].iter().zip(&tables[1]) {
        assert_eq!(a[..5], b[..5]);
        let off = (a[5] - b[5]).abs() / a[6].hypot(b[6]);
        assert!(off < 4.0, "{a:?} {b:?}");
    }
    for radius in 0..2 {
        let of = |found: &Value| estimate(&found["light_spread"]["radii"][radius]["radius_mm"]);
        let (a, b) = (of(&small), of(&whole));
        assert!((a.0 - b.0).abs() < 4.0 * a.1.hypot(b.1), "{a:?} {b:?}");
    }
    let contrast = |found: &Value| estimate(&found["halo"]["contrast"]);
    let (a, b) = (contrast(&small), contrast(&whole));
    assert!((a.0 - b.0).abs() < 4.0 * a.1.hypot(b.1) && a.0 < 1e-3, "{a:?} {b:?}");
}

/// White walls send back nine tenths of what would lie farther out, black ones none: in both the law of
/// the walls comes from packages beside them, and 25 packages give what all of 13 x 12 give.
#[test]
#[ignore = "nightly: 10 s"]
fn nightly_light_that_is_moved_to_walls_is_that_of_the_whole_array() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let drives = |is_lit: &dyn Fn([usize; 2]) -> bool| -> String {
        let level = |i: usize, j: usize| if is_lit([i, j]) { "1" } else { "0" };
        let row = |j: usize| (0..13).map(|i| level(i, j)).collect::<Vec<_>>().join(",") + "\n";
        (0..3).map(row).collect()
    };
    let some = drives(&|at| [[0, 0], [2, 1], [3, 1], [9, 2]].contains(&at));
    std::fs::write(at.join("some.csv"), some).expect("written");
    std::fs::write(at.join("full.csv"), drives(&|_| true)).expect("written");
    let edges = ["0.9", "0.02"].map(|reflectance| {
        let wall = format!("kind = \"lambertian\"\nreflectance = {reflectance}\nheight_mm");
        let text = |count: usize| {
            boxed(count).replace("kind = \"lambertian\"\nreflectance = 0.8\nheight_mm", &wall)
        };
        let whole = text(12)
            .replace("columns = 12", "columns = 13")
            .replace("[72.0, 72.0]", "[78.0, 72.0]")
            .replace("[71.9, 71.9, 1.0]", "[77.9, 71.9, 1.0]")
            .replace("bins = [72, 72]", "bins = [78, 72]");
        assert!(whole.contains(&wall) && whole.contains("bins = [78, 72]"), "{whole}");
        std::fs::write(at.join("few.toml"), text(5)).expect("written");
        std::fs::write(at.join("whole.toml"), whole).expect("written");
        let compared = ["some", "full"].map(|pattern| {
            let line =
                format!("--pattern {pattern}.csv --zones 13x3 --receiver front --paths 20000");
            let few = zones(at, &format!("few.toml {line} --packages 13x12"), "few");
            let all = zones(at, &format!("whole.toml {line}"), "all");
            assert_eq!(few["traced_packages"], serde_json::json!([13, 12]));
            // Two packages from each wall, and those in the middle.
            assert!(few["responses"].as_u64() < Some(13), "{}", few["responses"]);
            let (wrong, _) = estimate(&few["beyond_reach"]["walls"]);
            assert!(wrong > 0.0 && wrong < 0.05, "{reflectance}: {wrong}");
            let tables = ["few/zones.csv", "all/zones.csv"].map(|name| table(&at.join(name)));
            let brightest = tables[1].iter().map(|row| row[5]).fold(0.0, f64::max);
            for (a, b) in tables[0].iter().zip(&tables[1]) {
                // Chance makes 0.5 % of it, and stated errors hold what else there is.
                let off = (a[5] - b[5]).abs();
                assert!(off < 0.02 * brightest, "{reflectance}: {a:?} {b:?}");
                assert!(off < 3.0 * a[6].hypot(b[6]), "{reflectance}: {a:?} {b:?}");
                assert!(a[6] < 0.06 * brightest, "{reflectance}: {a:?}");
            }
            let (a, b) = (estimate(&few["white"]), estimate(&all["white"]));
            assert!((a.0 - b.0).abs() < 0.02 * b.0, "{reflectance}: {a:?} {b:?}");
            assert!((a.0 - b.0).abs() < 4.0 * a.1.hypot(b.1), "{reflectance}: {a:?} {b:?}");
            // Light lies wrong beside walls alone: the mean has less of it than a corner.
            let bound = |key: &str| {
                let (share, error) = estimate(&few["beyond_reach"][key]);
                share + 2.0 * error
            };
            let stated = few["white"]["bias_bound"].as_f64().expect("a bound") / a.0;
            assert!(stated < bound("share") + 0.5 * bound("walls"), "{reflectance}: {stated}");
            let chance = (a.1.powi(2) - (stated * a.0).powi(2) / 3.0).sqrt().hypot(b.1);
            assert!((a.0 - b.0).abs() < stated * a.0 + 3.0 * chance, "{reflectance}: {a:?} {b:?}");
            assert!(a.1 < 0.03 * a.0, "{reflectance}: {a:?}");
            (tables[0][0][5] / brightest, a)
        });
        compared[1]
    });
    // Control: at full drive the corner shows which walls there are, and the mean far beyond its error.
    let [white, black] = edges;
    assert!(white.0 > black.0 + 0.15, "{edges:?}");
    assert!(white.1.0 - black.1.0 > 4.0 * white.1.1.hypot(black.1.1), "{edges:?}");
}

/// A post that stands once repeats in no larger array.
#[test]
fn what_stands_once_is_warned_of_where_packages_stand_for_more() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("drives.csv"), "1\n").expect("written");
    let post = "\n[[solids]]\nname = \"post\"\nkind = \"box\"\nper = \"array\"\nsize_mm = [1.0, 1.0, 1.0]\nposition_mm = [3.0, 3.0, 1.5]\nsurface = { kind = \"absorbing\" }\n";
    for (name, more, traced) in [("plain", "", [12, 12]), ("post", post, [5, 5])] {
        std::fs::write(at.join(format!("{name}.toml")), boxed(5) + more).expect("written");
        let line = format!(
            "zones {name}.toml --pattern drives.csv --zones 1x1 --receiver front --packages 12x12 --paths 1000 --out {name}"
        );
        let output = batwing(at).args(line.split(' ')).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        let warns = said.contains("traced among the packages of the design alone");
        assert_eq!(warns, name == "post", "{said}");
        let found: Value =
            serde_json::from_str(&read(at.join(name).join("zones.json"))).expect("JSON");
        assert_eq!(found["traced_packages"], serde_json::json!(traced));
    }
}

#[test]
fn the_page_shows_figures_maps_and_the_light_of_a_zone() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("boxed.toml"), boxed(3)).expect("written");
    std::fs::write(at.join("p.csv"), "1,0,0\n0,0.5,0\n0,0,1\n").expect("written");
    let line = "boxed.toml --pattern p.csv --receiver front --paths 20000";
    let found = zones(at, line, "out");
    batwing(at).args(["report", "out", "--quiet"]).assert().success();
    let page = read(at.join("out/report.html"));
    assert_eq!(page.matches("data:image/png;base64,").count(), 2);
    assert_eq!(page.matches("<svg").count(), 1);
    assert!(!page.contains("<script"));
    let (contrast, _) = estimate(&found["halo"]["contrast"]);
    assert!(contrast > 0.0);
    for words in
        ["Dimming zones", "3 x 3 of 3 x 3 packages", "halo contrast", "light of one zone, 50 % at"]
    {
        assert!(page.contains(words), "{words}");
    }
    // A file that was altered is refused.
    let table = at.join("out/light_spread.csv");
    std::fs::write(&table, read(&table) + "1,1,1\n").expect("written");
    let output = batwing(at).args(["report", "out"]).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("light_spread.csv` was altered"), "{said}");
}
