// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sections of `docs/validation/report.md` that follow from other pages: the paper's figures and the list of all
//! checks.
//!
//! Sources: `docs/validation.md`, `docs/reproduction.md`, `data/published/tables.toml`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use batwing_tests::validation_report::{Row, hold, hold_text};
use batwing_tests::{read, workspace};
use report::published::Published;

/// Figures of the table of the paper: key, name, aims by rays and by waves.
const FIGURES: [(&str, &str, [f64; 2]); 4] = [
    ("peak_angle_deg", "peak angle, °", [5.0, 5.0]),
    ("centre_to_peak", "centre/peak, %", [6.0, 6.0]),
    ("uniformity", "uniformity, %", [1.0, 2.0]),
    ("extraction_efficiency", "extraction, %", [1.0, 1.0]),
];

/// Cells of the rows of all tables of a text.
fn rows(text: &str) -> Vec<Vec<String>> {
    // Dollars and spans of code hold signs of tables.
    let cells = |line: &str| {
        let line = line.replace("\\|", "\u{1}");
        let cells = line.trim_matches('|').split('|').map(|c| c.trim().replace('\u{1}', "\\|"));
        cells.collect::<Vec<String>>()
    };
    text.lines().filter(|line| line.starts_with('|')).map(cells).collect()
}

#[test]
fn figures_of_the_paper_stand_beside_ours() {
    let published = Published::load().expect("the published figures");
    let page = read("docs/reproduction.md");
    let (_, table) = page.split_once("## The paper beside ours").expect("the table");
    let (mut shown, mut missed) = (Vec::new(), Vec::new());
    for row in rows(table.split("\n## ").next().unwrap_or_default()) {
        let Some((design, light)) = row[0].split_once(", ") else { continue };
        let (model, wave) = match light {
            "rays" => ("geometric_100um", 0),
            "hybrid" => ("hybrid_10um", 1),
            _ => continue,
        };
        // The column of the parabola has no published figure.
        for ((key, name, aims), cell) in FIGURES.iter().zip([&row[1], &row[3], &row[4], &row[5]]) {
            let Some(stated) = published.designs[design][model].get(*key) else {
                continue;
            };
            let stated = if *key == "peak_angle_deg" { *stated } else { stated * 100.0 };
            let numbers: Vec<String> =
                cell.split("; ").map(|n| n.trim_matches(['*', '°']).to_owned()).collect();
            let [of_paper, ours] = [0, 1].map(|k| numbers[k].parse::<f64>().expect("a number"));
            assert!(
                (of_paper - stated).abs() < 1e-9,
                "{design} {model} {key}: {of_paper}, {stated}"
            );
            let (off, aim) = (ours - of_paper, aims[wave]);
            let check = format!("{design}, {light}, {name}");
            if off.abs() > aim {
                missed.push(check.clone());
            }
            let texts =
                [numbers[0].clone(), numbers[1].clone(), format!("{off:+.1}"), format!("{aim}")];
            shown.push(Row::quoted(&check, texts, off.abs() <= aim));
        }
    }
    assert_eq!((shown.len(), missed.len()), (21, 1), "{missed:?}");
    hold("paper", &shown);
}

/// Numbers of tests of a file or folder: quick, slow, nightly.
fn tests(path: &str) -> [usize; 3] {
    let path = workspace().join(path);
    let files: Vec<_> = if path.is_dir() {
        let entries =
            path.read_dir().expect("a folder").map(|entry| entry.expect("an entry").path());
        entries.filter(|path| path.extension().is_some_and(|ending| ending == "rs")).collect()
    } else {
        vec![path]
    };
    let mut counts = [0; 3];
    for file in files {
        let text =
            std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        for after in text.split("#[test]").skip(1) {
            let head = after.split("fn ").next().unwrap_or_default();
            let tier = match head {
                head if head.contains("ignore = \"nightly") => 2,
                head if head.contains("#[ignore") => 1,
                _ => 0,
            };
            counts[tier] += 1;
        }
    }
    counts
}

/// Who runs the tests of a cell of `docs/validation.md`.
fn run_by(cell: &str, folders: &mut BTreeMap<String, [usize; 3]>) -> String {
    let mut sum = [0; 3];
    for path in cell.split('`').skip(1).step_by(2) {
        if path == ".ci/nightly" {
            sum[2] += 1;
        }
        if path.starts_with(".ci") || !path.contains('/') {
            continue;
        }
        let counts = folders.entry(path.to_owned()).or_insert_with(|| tests(path));
        sum = [0, 1, 2].map(|k| sum[k] + counts[k]);
    }
    let named = ["quick", "slow", "nightly"];
    let tiers: Vec<&str> = (0..3).filter(|k| sum[*k] > 0).map(|k| named[k]).collect();
    if tiers.is_empty() { "every run".to_owned() } else { tiers.join(", ") }
}

#[test]
fn the_report_lists_every_check() {
    let page = read("docs/validation.md");
    let mut folders = BTreeMap::new();
    let (mut list, mut counts, mut all) = (String::new(), String::new(), 0);
    for section in page.split("\n## ").skip(1) {
        let heading = section.lines().next().unwrap_or_default();
        let (mut last, mut inside) = (String::new(), Vec::new());
        for row in rows(section) {
            if let [check, allowed, test] = &row[..]
                && check != "claim"
                && !check.starts_with("---")
                && (test.contains('`') || test.starts_with("the same"))
            {
                if test.contains('`') {
                    last.clone_from(test);
                }
                inside.push(format!("| {check} | {allowed} | {} |", run_by(&last, &mut folders)));
            }
        }
        if inside.is_empty() {
            continue;
        }
        all += inside.len();
        let _ = writeln!(counts, "| {heading} | {} |", inside.len());
        let _ = writeln!(list, "### {heading}\n\n| check | allowed | tests |\n|---|---|---|");
        let _ = writeln!(list, "{}\n", inside.join("\n"));
    }
    assert!(all > 120, "{all}");
    let counts = format!("| part | checks |\n|---|---|\n{counts}| all | {all} |\n");
    hold_text("counts", &counts);
    hold_text("checks", &format!("{}\n", list.trim_end()));
}
