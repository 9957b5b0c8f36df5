// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bad input: one clear message (file, key, what was expected, what was found), a non-zero exit, and nothing written.
//!
//! The cases lie in `tests/bad_input/`, their form is described in `batwing_tests::bad`. Damaged tables
//! and bad flags are made here.

use std::path::Path;

use crate::support::binary::{PATH, batwing};
use batwing_tests::bad::{Case, json_cases, toml_cases};
use batwing_tests::tables::{on_silicone, order_table, resolution};
use bsdf::Grid;
use bsdf::formats::native;
use num_complex::Complex64;
use rcwa::Truncation;
use rcwa::hemisphere::{Directions, Resolution, hemisphere};
use rcwa::no_progress;
use rcwa::relief::Relief;
use tempfile::tempdir;

const DESIGNS: &str = include_str!("../bad_input/design.toml");
const GRATINGS: &str = include_str!("../bad_input/grating.json");

/// Names in a folder, with those of its folders.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// The command fails with all `words` on one stream, says nothing on the other and writes nothing.
fn refused(folder: &Path, arguments: &[&str], title: &str, words: &[String]) {
    let before = names(folder);
    let output = batwing(folder).args(arguments).output().expect("it runs");
    let (stdout, stderr) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    let what = format!("{title}: batwing {}", arguments.join(" "));
    assert!(
        matches!(output.status.code(), Some(1 | 2)),
        "{what}: exit {:?}, {stderr}",
        output.status.code()
    );
    for word in words {
        assert!(
            stderr.contains(word.as_str()),
            "{what}: no `{word}` in: {stderr}"
        );
    }
    assert!(stdout.is_empty(), "{what}: {stdout}");
    assert!(!stderr.contains("panicked"), "{what}: {stderr}");
    assert_eq!(names(folder), before, "{what}: files");
}

fn accepted(folder: &Path, arguments: &[&str]) {
    let output = batwing(folder).args(arguments).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {stderr}");
}

fn all_refused(file: &str, good: &str, cases: &[Case], commands: &[&[&str]]) {
    let folder = tempdir().expect("a folder");
    let path = folder.path().join(file);
    std::fs::write(&path, good).expect("written");
    accepted(folder.path(), commands[0]);
    for Case { title, words, text } in cases {
        std::fs::write(&path, text).expect("written");
        for arguments in commands {
            refused(folder.path(), arguments, title, words);
        }
    }
}

#[test]
fn bad_designs_are_refused_alike_by_every_command() {
    let (good, cases) = toml_cases(DESIGNS);
    assert!(cases.len() >= 25, "{} cases", cases.len());
    let commands: [&[&str]; 3] = [
        &["check", "bad.toml"],
        &["run", "bad.toml", "--out", "out"],
        &["bsdf", "bad.toml", "--out", "out"],
    ];
    all_refused("bad.toml", &good, &cases, &commands);
}

#[test]
fn bad_gratings_are_refused() {
    let (good, cases) = json_cases(GRATINGS);
    assert!(cases.len() >= 20, "{} cases", cases.len());
    all_refused("bad.json", &good, &cases, &[&["grating", "bad.json"]]);
}

#[test]
fn missing_files_are_named() {
    let folder = tempdir().expect("a folder");
    for (arguments, expected) in [
        (&["check", "no/such.toml"][..], "expected a design"),
        (
            &["run", "no/such.toml", "--out", "out"],
            "expected a design",
        ),
        (
            &["bsdf", "no/such.toml", "--out", "out"],
            "expected a design",
        ),
        (&["grating", "no/such.json"], "expected a case of a grating"),
        (
            &["check", "no/such.bworders"],
            "expected a table of diffraction orders",
        ),
        (
            &["import", "no/such.ies"],
            "expected a table, a far field, rays or scattering",
        ),
        (&["report", "no/such"], "expected a directory of results"),
    ] {
        let words = [arguments[1], expected, "No such file"].map(str::to_owned);
        refused(folder.path(), arguments, "missing file", &words);
    }
}

#[test]
fn bad_flags_are_refused() {
    let folder = tempdir().expect("a folder");
    let (good, _) = toml_cases(DESIGNS);
    std::fs::write(folder.path().join("good.toml"), good).expect("written");
    std::fs::write(folder.path().join("file"), "").expect("written");
    std::fs::create_dir_all(folder.path().join("taken")).expect("made");
    std::fs::write(folder.path().join("taken/bad"), "").expect("written");
    std::fs::create_dir_all(folder.path().join("old/results.json")).expect("made");
    for (arguments, words) in [
        (
            &["run", "good.toml", "--threads", "0"][..],
            &["--threads: expected a whole number from 1 to 1024, got \"0\""][..],
        ),
        (
            &["run", "good.toml", "--threads", "two"],
            &["--threads", "two"],
        ),
        (&["run", "good.toml", "--seed", "-1"], &["-1"]),
        (
            &["run", "good.toml", "--paths", "10"],
            &["--paths", "10", "1000"],
        ),
        (
            &["run", "good.toml", "--model", "magic"],
            &["--model", "magic", "hybrid"],
        ),
        (
            &["run", "good.toml", "--paths", "2000000000000"],
            &["--paths", "2000000000000", "1000"],
        ),
        (
            &["run", "good.toml", "--out", "file/out"],
            &["file/out", "expected a directory, got the file `file`"],
        ),
        (
            &["run", "good.toml", "--out", "taken"],
            &[
                "taken/bad/",
                "expected a directory, got the file `taken/bad`",
            ],
        ),
        (
            &["run", "good.toml", "--out", "old"],
            &["old/results.json", "got a directory"],
        ),
        (
            &["run", "good.toml", "--out", "out", "--cache", "file"],
            &["--cache", "expected a directory, got the file `file`"],
        ),
        (
            &["reproduce", "--out", "out", "--cache", "file/tables"],
            &["--cache", "file/tables", "got the file `file`"],
        ),
        (
            &["bsdf", "good.toml", "--rings", "171", "--out", "out"],
            &["--rings", "171", "1 to 170"],
        ),
        (
            &["bsdf", "good.toml", "--rings", "0", "--out", "out"],
            &["--rings", "0", "representatives"],
        ),
        (
            &["bsdf", "good.toml", "--tolerance", "0.5", "--out", "out"],
            &["--tolerance", "0.5", "0.1"],
        ),
        (
            &["run", "good.toml", "--until-error", "abc"],
            &["--until-error", "abc", "uniformity"],
        ),
        (
            &["run", "good.toml", "--until-error", "uniformity=0"],
            &["--until-error", "above 0"],
        ),
        (&["run", "good.toml", "--out"], &["--out: expected DIR"]),
        (&["run"], &["batwing run: expected DESIGN.toml"]),
        (&["reproduce", "--fast"], &["--fast", "reproduce --help"]),
        (&["reproduce", "--out", "file/out"], &["file/out"]),
        (&["improve"], &["improve"]),
        (&["check"], &["DESIGN.toml"]),
        (&[], &["Usage"]),
    ] {
        let words: Vec<String> = words.iter().map(|&w| w.to_owned()).collect();
        refused(folder.path(), arguments, "flags", &words);
        // One line, but for the help that stands in for a command.
        let output = batwing(folder.path()).args(arguments).output();
        let stderr = output.expect("it runs").stderr;
        let lines = String::from_utf8_lossy(&stderr).lines().count();
        assert!(lines == 1 || arguments.is_empty(), "{arguments:?}: {lines}");
    }
}

/// Help and version are answers, not mistakes; command lines that are none have an exit code of their own.
#[test]
fn help_and_version_are_printed_and_mistakes_have_their_exit_code() {
    let folder = tempdir().expect("a folder");
    for (arguments, code, out) in [
        (&["--help"][..], 0, "Usage: batwing"),
        (&["run", "--help"], 0, "Usage: batwing run"),
        (&["help", "run"], 0, "Usage: batwing run"),
        (&["--version"], 0, "batwing "),
        (&["run"], 2, ""),
        (&["run", "d.toml", "--threads", "0"], 2, ""),
        (&["improve"], 2, ""),
        (&["check", "d.toml"], 1, ""),
    ] {
        let output = batwing(folder.path()).args(arguments).output();
        let output = output.expect("it runs");
        let (stdout, stderr) = (
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr),
        );
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        assert_eq!(stdout.is_empty(), out.is_empty(), "{arguments:?}: {stdout}");
        assert!(stdout.contains(out), "{arguments:?}: {stdout}");
        assert_eq!(stderr.is_empty(), code == 0, "{arguments:?}: {stderr}");
        assert!(code == 0 || stderr.starts_with("batwing: "), "{stderr}");
    }
}

#[test]
fn a_reader_that_goes_away_ends_the_program_quietly() {
    let folder = tempdir().expect("a folder");
    let (good, _) = toml_cases(DESIGNS);
    std::fs::write(folder.path().join("good.toml"), good).expect("written");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let output = std::process::Command::new(PATH)
        .args(["check", "good.toml"])
        .current_dir(folder.path())
        .stdout(writer)
        .output()
        .expect("it runs");
    // As a shell reports a program that SIGPIPE ended.
    assert_eq!(output.status.code(), Some(141));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}

#[test]
fn damaged_tables_are_refused() {
    let folder = tempdir().expect("a folder");
    let path = folder.path().join("t.bworders");
    let relief = Relief::new(2.0, 0.1, Complex64::new(1.2, 0.0), Vec::new()).expect("a relief");
    let interface = on_silicone(relief);
    let resolution = resolution(&interface, 0, 1).expect("a resolution");
    let table =
        order_table(&interface, 2, Grid::ky_nodes(1.41, 1.0, 4), &resolution).expect("a table");
    let mut whole = Vec::new();
    native::write(&table, &mut whole).expect("written");
    std::fs::write(&path, &whole).expect("written");
    accepted(folder.path(), &["check", "t.bworders"]);

    let edited = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    let middle = whole.len() / 2;
    let damaged: [(&str, Vec<u8>, &str); 8] = [
        ("empty", Vec::new(), "truncated"),
        ("cut in its first bytes", whole[..10].to_vec(), "truncated"),
        ("cut in the middle", whole[..middle].to_vec(), "truncated"),
        (
            "cut by its last byte",
            whole[..whole.len() - 1].to_vec(),
            "truncated",
        ),
        (
            "one bit altered",
            edited(middle, whole[middle] ^ 1),
            "altered",
        ),
        (
            "of another kind",
            edited(0, b'x'),
            "not a table of diffraction orders",
        ),
        (
            "of another version",
            edited(8, 99),
            "version 99, expected 2",
        ),
        (
            "followed by more",
            [&whole[..], b"more"].concat(),
            "followed by more bytes",
        ),
    ];
    for (title, bytes, words) in damaged {
        std::fs::write(&path, bytes).expect("written");
        let words = ["t.bworders".to_owned(), words.to_owned()];
        refused(folder.path(), &["check", "t.bworders"], title, &words);
    }
}

#[test]
fn tables_with_too_few_orders_are_refused() {
    // From the solver, which every table comes from: 2.0 um at 0.55 um lets orders up to ±5 propagate in silicone.
    let relief = Relief::new(2.0, 0.1, Complex64::new(1.2, 0.0), Vec::new()).expect("a relief");
    let interface = on_silicone(relief);
    let solve = |highest: usize| {
        let resolution = Resolution {
            truncation: Truncation::new(highest).expect("a truncation"),
            plan: interface.relief.slice_plan(1),
        };
        let directions = Directions {
            kx_per_zone: 2,
            ky: vec![0.1],
        };
        hemisphere(&interface, &directions, &resolution, &no_progress)
    };
    let message = solve(4).expect_err("too few").to_string();
    assert!(
        message.contains("orders -4..4 are kept, but orders up to ±5 propagate"),
        "{message}"
    );
    assert!(solve(5).is_ok());
}
