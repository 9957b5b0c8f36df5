// SPDX-License-Identifier: MIT OR Apache-2.0
//! The binary `batwing` of the same profile as the running test, built once if it is not up to date.

use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::OnceLock;

use assert_cmd::Command;

/// A command that runs the binary, in the directory `at`.
pub fn batwing(at: &Path) -> Command {
    let mut command = Command::new(path());
    command.current_dir(at);
    command
}

/// Runs the binary in the directory `at` and returns what `--json` says.
///
/// # Panics
/// If it fails or says no JSON.
pub fn json(at: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = batwing(at)
        .args(arguments)
        .args(["--json", "--quiet"])
        .output()
        .expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {text}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Where the binary is.
///
/// # Panics
/// If it cannot be built.
pub fn path() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(build)
}

/// Builds beside the test that asks: it runs as `<target>/<profile>/deps/<test>`. An example is built with it because that alone makes cargo choose the features
/// of dependencies as `cargo test --workspace` does, whose libraries are then taken as they are.
fn build() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test");
    let profile = test
        .ancestors()
        .nth(2)
        .expect("tests lie in a folder of their profile");
    let target = profile.parent().expect("the target directory");
    let name = profile
        .file_name()
        .expect("the name of a profile")
        .to_string_lossy();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Process::new(cargo);
    command
        .args([
            "build",
            "--quiet",
            "--workspace",
            "--bin",
            "batwing",
            "--example",
            "fuzz_readers",
        ])
        .args(["--profile", if name == "debug" { "dev" } else { &name }])
        .arg("--target-dir")
        .arg(target)
        .current_dir(crate::workspace());
    let built = command.status().expect("cargo runs");
    assert!(built.success(), "batwing could not be built");
    profile.join(format!("batwing{}", std::env::consts::EXE_SUFFIX))
}
