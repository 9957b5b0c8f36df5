// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a release says of itself: one version everywhere, and workflows that run known actions.

use std::path::PathBuf;

use batwing_tests::{read, workspace};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The value of a key at the beginning of a line.
fn value(text: &str, key: &str) -> Option<String> {
    let line = text.lines().find(|line| line.starts_with(key))?;
    Some(line[key.len()..].trim_matches([' ', ':', '=', '"']).to_owned())
}

#[test]
fn one_version_stands_everywhere() {
    let citation = read("CITATION.cff");
    assert_eq!(value(&citation, "version").as_deref(), Some(VERSION), "CITATION.cff");
    let changes = read("CHANGELOG.md");
    let heading = value(&changes, &format!("## {VERSION} -")).expect("a section of this version");
    if heading != "unreleased" {
        assert_eq!(value(&citation, "date-released"), Some(heading), "CITATION.cff");
    }
    let wheel = format!("batwing-{VERSION}-");
    assert!(read("docs/install.md").contains(&wheel), "docs/install.md: no {wheel}");
    let pyproject = read("pipeline/python/pyproject.toml");
    assert!(pyproject.contains("dynamic = [\"version\"]"), "pyproject.toml");
    let workspace: toml::Table = read("Cargo.toml").parse().expect("TOML");
    for member in workspace["workspace"]["members"].as_array().expect("members") {
        let path = format!("{}/Cargo.toml", member.as_str().expect("a path"));
        let manifest: toml::Table = read(&path).parse().expect("TOML");
        let version = manifest["package"]["version"].as_table();
        assert!(version.is_some_and(|v| v["workspace"] == true.into()), "{path}: a version");
    }
}

/// Files of a folder by their ending.
fn files(folder: &str, ending: &str) -> Vec<PathBuf> {
    let entries = workspace().join(folder).read_dir().expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.filter(|path| path.extension().is_some_and(|e| e == ending)).collect()
}

#[test]
fn actions_stand_by_their_commits() {
    let mut actions = 0;
    for path in files(".github/workflows", "yml") {
        let text = read(&path);
        assert!(text.contains("\npermissions:\n"), "{}: no permissions", path.display());
        assert!(text.contains("\nconcurrency:\n"), "{}: no concurrency", path.display());
        for line in text.lines().filter(|line| line.contains("uses: ")) {
            let (_, action) = line.split_once('@').expect("a version");
            let (commit, tag) = action.split_once(" # v").expect("a tag as a comment");
            let is_hash = commit.len() == 40 && commit.chars().all(|c| c.is_ascii_hexdigit());
            assert!(is_hash && !tag.is_empty(), "{}: {line}", path.display());
            actions += 1;
        }
    }
    assert!(actions > 10, "{actions}");
}
