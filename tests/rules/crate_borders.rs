// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rules of the workspace: dependencies between crates, pinned versions, shared lints, no unsafe
//! code, no files, clock or printing in libraries, file lengths, licence lines.
//!
//! Source: the table of crates in `docs/explanation/architecture.md`; manifests and sources of this
//! workspace. Each checker is first shown a made-up offence.

use batwing_tests::{crate_dependencies, read, source_scan, workspace};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::Table;

fn manifest(path: &str) -> Table {
    read(path).parse().unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn members() -> Vec<Table> {
    crate_dependencies::ALLOWED
        .iter()
        .map(|(folder, ..)| manifest(&format!("{folder}/Cargo.toml")))
        .collect()
}

fn made_up(text: &str) -> Table {
    text.parse().expect("valid TOML")
}

#[test]
fn forbidden_arrows_are_found() {
    let workspace = manifest("Cargo.toml");
    for (text, offence) in [
        (
            "[package]\nname = 'batwing-rcwa'\n[dependencies]\nbsdf.workspace = true",
            "batwing-rcwa: dependencies must not name batwing-bsdf",
        ),
        (
            "[package]\nname = 'batwing-tracer'\n[dev-dependencies]\nrcwa = { workspace = true }",
            "batwing-tracer: dev-dependencies must not name batwing-rcwa",
        ),
        (
            "[package]\nname = 'batwing-bsdf'\n[build-dependencies]\nrays = { path = '../tracer' }",
            "batwing-bsdf: build-dependencies must not name batwing-tracer",
        ),
        (
            "[package]\nname = 'batwing-bsdf'\n[target.'cfg(unix)'.dependencies]\nx = { package = 'batwing', version = '1' }",
            "batwing-bsdf: target.cfg(unix).dependencies must not name batwing",
        ),
        (
            "[package]\nname = 'batwing'\n[dependencies]\nx = { path = '../tests/' }",
            "batwing: dependencies must not name batwing-tests",
        ),
        ("[package]\nname = 'batwing-new'", "batwing-new: is in no row of the table of crates"),
    ] {
        assert_eq!(crate_dependencies::forbidden(&made_up(text), &workspace), [offence], "{text}");
    }
    let allowed = "[package]\nname = 'batwing-tracer'\n[dependencies]\nbsdf.workspace = true\nglam.workspace = true";
    assert!(crate_dependencies::forbidden(&made_up(allowed), &workspace).is_empty());
    let for_tests = "[package]\nname = 'batwing'\n[dev-dependencies]\nx = { path = '../tests/' }";
    assert!(crate_dependencies::forbidden(&made_up(for_tests), &workspace).is_empty());
}

#[test]
fn dependency_arrows_keep_to_the_table() {
    let workspace = manifest("Cargo.toml");
    let listed = workspace["workspace"]["members"].as_array().expect("a list of members");
    assert_eq!(
        listed.len(),
        crate_dependencies::ALLOWED.len(),
        "members of the workspace and rows of the table"
    );
    let members = members();
    for ((folder, package, ..), member) in crate_dependencies::ALLOWED.iter().zip(&members) {
        assert_eq!(crate_dependencies::name(member), *package, "{folder}");
        let lib = member["lib"]["name"].as_str().expect("a library");
        let last = folder.rsplit('/').next().expect("a name");
        let expected = if *folder == crate_dependencies::PYTHON { "native" } else { last };
        assert_eq!(lib.trim_start_matches("batwing_"), expected);
    }
    let broken: Vec<String> =
        members.iter().flat_map(|m| crate_dependencies::forbidden(m, &workspace)).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn loose_versions_are_found() {
    let lock = made_up(
        "[[package]]\nname = 'a'\nversion = '1.2.3'\n[[package]]\nname = 'real'\nversion = '0.4.0'",
    );
    let workspace = made_up(
        "[workspace.dependencies]\na = '1'\nb = '=1.2.3'\nc = '*'\nd = { git = 'https://example.org' }\n\
         e = { version = '>=1, <3' }\nf = { package = 'real', version = '=0.4.0' }\nours = { path = 'rcwa' }",
    );
    assert_eq!(
        crate_dependencies::unpinned(&workspace, &lock),
        [
            "b: the lock file has no version =1.2.3",
            "c: `*` is no version but a range",
            "d: has no version",
            "e: `>=1, <3` is no version but a range",
        ]
    );
    let own = made_up("[package]\nname = 'batwing-bsdf'\n[dependencies]\nglam = '0.34'");
    assert_eq!(
        crate_dependencies::not_inherited(&own, &workspace),
        [
            "batwing-bsdf: dependencies of glam is not the workspace's",
            "batwing-bsdf: lints are not the workspace's"
        ]
    );
}

#[test]
fn versions_are_pinned_and_lints_shared() {
    let workspace = manifest("Cargo.toml");
    let loose = crate_dependencies::unpinned(&workspace, &manifest("Cargo.lock"));
    assert!(loose.is_empty(), "{loose:#?}");
    let ignored = read(".gitignore");
    assert!(!ignored.lines().any(|l| l.contains("Cargo.lock")), "the lock file is kept");
    let own: Vec<String> =
        members().iter().flat_map(|m| crate_dependencies::not_inherited(m, &workspace)).collect();
    assert!(own.is_empty(), "{own:#?}");
    let unsafe_code = workspace["workspace"]["lints"]["rust"]["unsafe_code"].as_str();
    assert!(matches!(unsafe_code, Some("deny" | "forbid")));
    // Plain `cargo test` and `cargo run` select every member that needs no Python.
    let list = |key: &str| {
        let list = workspace["workspace"][key].as_array();
        let names = list.expect("a list").iter().filter_map(|name| name.as_str());
        names.filter(|name| *name != crate_dependencies::PYTHON).collect::<Vec<_>>()
    };
    assert_eq!(list("default-members"), list("members"));
}

#[test]
fn offending_lines_are_found() {
    let text = "use std::fs;\nlet t = Instant::now(); // fine\n// println!\nlet x = Fingerprint!(1);\nprint!(\"x\");\n\
                #[cfg(test)]\nmod tests {\n    println!();\n}\n";
    assert_eq!(source_scan::forbidden(text), [(1, "std::fs"), (2, "Instant"), (5, "print!")]);
    // A test module in a file of its own does not hide what follows.
    let apart = "#[cfg(test)]\nmod testing;\npub fn f() { println!(); }\n";
    assert_eq!(source_scan::forbidden(apart), [(3, "println!")]);
}

#[test]
fn libraries_open_no_files_read_no_clock_and_print_nothing() {
    for library in ["rcwa", "bsdf", "tracer"] {
        let folder = workspace().join(library).join("src");
        let files = source_scan::rust_files(&folder);
        assert!(files.len() > 5, "{} files in {library}", files.len());
        let lib = read(format!("{library}/src/lib.rs"));
        assert!(
            lib.lines().any(|l| l.trim() == "#![forbid(unsafe_code)]"),
            "{library} forbids unsafe code"
        );
        // The guard of memory asks the system.
        let asks = |path: &Path| path.ends_with("rcwa/src/guard.rs");
        for path in files.iter().filter(|p| !source_scan::is_test(p) && !asks(p)) {
            let text = std::fs::read_to_string(path).expect("a readable file");
            let found = source_scan::forbidden(&text);
            assert!(found.is_empty(), "{}: {found:?}", path.display());
        }
    }
}

#[test]
fn idle_files_of_tests_are_found() {
    let programs = [("light".to_owned(), "mod films;\nmod lens;\n".to_owned())];
    let files = ["films", "len", "lens", "light", "mod films"].map(str::to_owned);
    assert_eq!(source_scan::idle(&files, &programs), ["len", "mod films"]);
}

#[test]
fn every_file_of_tests_belongs_to_a_program() {
    let mut roots: BTreeMap<PathBuf, Vec<(String, String)>> = BTreeMap::new();
    for ((folder, ..), member) in crate_dependencies::ALLOWED.iter().zip(members()) {
        let programs = member.get("test").and_then(toml::Value::as_array);
        for program in programs.into_iter().flatten() {
            let path = Path::new(folder).join(program["path"].as_str().expect("a path"));
            let name = path.file_stem().expect("a name").to_string_lossy();
            let at = workspace().join(path.parent().expect("a folder"));
            let at = at.canonicalize().expect("a folder");
            let root = (name.into_owned(), read(&path));
            roots.entry(at).or_default().push(root);
        }
    }
    for (folder, roots) in &roots {
        let entries = std::fs::read_dir(folder).expect("a folder");
        let files: Vec<String> = entries
            .map(|entry| entry.expect("a readable entry").path())
            .filter(|path| path.is_dir() || path.extension().is_some_and(|e| e == "rs"))
            .map(|path| {
                let stem = path.file_stem().expect("a name");
                stem.to_string_lossy().into_owned()
            })
            .collect();
        assert!(files.len() > roots.len(), "{}: {files:?}", folder.display());
        let idle = source_scan::idle(&files, roots);
        assert!(idle.is_empty(), "{}: in no program: {idle:?}", folder.display());
    }
    for program in ["end_to_end", "physics", "rules"] {
        let found = roots.keys().any(|at| at.ends_with(Path::new("tests").join(program)));
        assert!(found, "no manifest declares tests/{program}");
    }
}

#[test]
fn files_are_of_a_readable_length_and_name_their_licence() {
    for (folder, ..) in crate_dependencies::ALLOWED {
        for path in source_scan::rust_files(&workspace().join(folder)) {
            let text = std::fs::read_to_string(&path).expect("a readable file");
            let code = |line: &&str| !line.trim().is_empty() && !line.trim().starts_with("//");
            let lines = text.lines().filter(code).count();
            assert!(lines <= 600, "{}: {lines} lines of code", path.display());
            assert_eq!(
                text.lines().next(),
                Some("// SPDX-License-Identifier: MIT OR Apache-2.0"),
                "{}",
                path.display()
            );
        }
    }
}

/// Whether a line of `.gitignore` covers `name`: the whole name, or its beginning before a `*`.
fn is_ignored(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(beginning) => !beginning.is_empty() && name.starts_with(beginning),
        None => pattern == name,
    }
}

#[test]
fn the_top_holds_the_agreed_folders() {
    let ignored = read(".gitignore");
    let ignored: Vec<&str> = ignored.lines().map(|l| l.trim_matches('/')).collect();
    let entries = std::fs::read_dir(workspace()).expect("the top of the workspace");
    let mut folders: Vec<String> = entries
        .map(|e| e.expect("a readable entry"))
        .filter(|e| e.path().is_dir())
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .filter(|name| name != ".git" && !ignored.iter().any(|pattern| is_ignored(pattern, name)))
        .collect();
    folders.sort();
    assert_eq!(
        folders,
        [".ci", ".github", "bsdf", "data", "docs", "pipeline", "rcwa", "tests", "tracer"]
    );
}
