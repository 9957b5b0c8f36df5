// SPDX-License-Identifier: MIT OR Apache-2.0
//! The binary `batwing` of the profile of the running test.

use std::path::Path;

use assert_cmd::Command;

/// The binary, which cargo builds before this program.
pub const PATH: &str = env!("CARGO_BIN_EXE_batwing");

/// A command that runs the binary in the directory `at`.
pub fn batwing(at: &Path) -> Command {
    let mut command = Command::new(PATH);
    command.current_dir(at);
    command
}

/// Runs the binary in the directory `at` and returns the JSON that it prints.
///
/// # Panics
/// If it fails or prints no JSON.
pub fn json(at: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = batwing(at).args(arguments).args(["--json", "--quiet"]).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {text}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}
