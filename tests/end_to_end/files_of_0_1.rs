// SPDX-License-Identifier: MIT OR Apache-2.0
//! What files of version 0.1 get: they are read, or refused with the reason.
//!
//! Sources: `tests/files_of_0_1`, as the commit of 0.1.0 has them (paths between them adapted);
//! [installation](../../docs/install.md), which states what holds.

use std::path::Path;

use serde_json::{Value, json};
use tempfile::tempdir;

use batwing_tests::{read, workspace};

use crate::support::binary::{batwing, json};

const FOLDER: &str = "tests/files_of_0_1";

/// What the program says when it refuses.
fn refusal(at: &Path, arguments: &[&str]) -> String {
    let output = batwing(at).args(arguments).output().expect("it runs");
    assert!(!output.status.success(), "{arguments:?} is accepted");
    String::from_utf8(output.stderr).expect("text")
}

#[test]
fn designs_of_0_1_are_read_and_keep_their_meaning() {
    let at = workspace().join(FOLDER);
    let read = |name: &str| json(&at, &["check", name])["design"].clone();
    let white = read("d1-white.toml");
    assert_eq!(white["array"]["pitch_mm"], 8.3, "{white}");
    assert_eq!(white["led"]["reflectance"], 0.86, "{white}");
    assert_eq!(white["hybrid"]["rings_per_band"], 10, "{white}");
    assert_eq!(white["spectrum"]["source"]["kind"], "white_led", "{white}");
    let solids = read("solids.toml");
    let count = |key: &str| solids[key].as_array().map(Vec::len);
    assert_eq!([count("solids"), count("receivers")], [Some(7), Some(2)], "{solids}");
}

#[test]
fn tables_of_0_1_are_read() {
    let corpus = workspace().join("tests/formats/corpus");
    for (command, table) in [("check", "small.bworders"), ("import", "small.json")] {
        batwing(&corpus).args([command, table, "--quiet"]).assert().success();
    }
}

#[test]
fn what_is_gone_since_0_1_is_refused_with_the_reason() {
    let at = workspace().join(FOLDER);
    let study = refusal(&at, &["study", "short-runs.toml", "--out", "/nonexistent/out"]);
    for words in ["short-runs.toml: rounding: removed", "docs/reproduction.md"] {
        assert!(study.contains(words), "no `{words}` in: {study}");
    }
    let folder = tempdir().expect("a folder");
    let design = read(format!("{FOLDER}/d1-white.toml"));
    for (table, line, words) in [
        (
            "trace",
            "split = 4",
            "trace.split: removed: path splitting costs more time than it saves",
        ),
        ("hybrid", "incidence = \"in_plane\"", "hybrid.incidence: removed"),
        ("hybrid", "scattering = \"transmission\"", "hybrid.scattering: removed"),
        ("hybrid", "spread_deg = 1.0", "hybrid.spread_deg: removed"),
    ] {
        let heading = format!("\n[{table}]\n");
        assert!(design.contains(&heading), "{table}");
        let text = design.replace(&heading, &format!("{heading}{line}\n"));
        std::fs::write(folder.path().join("old.toml"), text).expect("written");
        let said = refusal(folder.path(), &["check", "old.toml"]);
        assert!(said.contains(words), "no `{words}` in: {said}");
    }
}

#[test]
fn results_of_0_1_are_refused_with_both_versions() {
    for (file, version, words) in [
        ("results.json", 3, "expected 4, got 3; run the design again with this version"),
        ("study.json", 2, "expected 4, got 2; run the study again with this version"),
    ] {
        let folder = tempdir().expect("a folder");
        let text = json!({"schema_version": version, "content_sha256": "", "designs": {}});
        std::fs::write(folder.path().join(file), text.to_string()).expect("written");
        let said = refusal(folder.path(), &["report", "."]);
        for words in [file, "schema_version", words] {
            assert!(said.contains(words), "no `{words}` in: {said}");
        }
        let left: Vec<Value> = folder
            .path()
            .read_dir()
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into())
            .collect();
        assert_eq!(left, [json!(file)], "nothing is written");
    }
}
