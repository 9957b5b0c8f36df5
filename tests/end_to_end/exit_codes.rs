// SPDX-License-Identifier: MIT OR Apache-2.0
//! How the program ends: help and version, mistakes, a reader that goes away.

use batwing_tests::bad_input::good;
use tempfile::tempdir;

use crate::support::binary::{PATH, batwing};

const DESIGN: &str = include_str!("../bad_input/design.toml");

/// Help and version are answers, not mistakes; command lines that are none have an exit code of
/// their own.
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
        let (stdout, stderr) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
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
    let good = good(DESIGN);
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
