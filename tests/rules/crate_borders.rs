// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rules of the workspace: what crates do without, shared lints, no unsafe code, no files, clock or printing
//! in libraries, file lengths, licence lines.
//!
//! Source: the table of crates in `docs/explanation/architecture.md`; manifests and sources of this
//! workspace.

use batwing_tests::{read, source_scan, workspace};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use toml::{Table, Value};

fn manifest(path: &str) -> Table {
    read(path).parse().unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Folders and manifests of the members of the workspace.
pub fn members() -> Vec<(String, Table)> {
    let workspace = manifest("Cargo.toml");
    let listed = workspace["workspace"]["members"].as_array().expect("a list of members");
    let folders = listed.iter().filter_map(Value::as_str);
    folders.map(|at| (at.to_owned(), manifest(&format!("{at}/Cargo.toml")))).collect()
}

/// Libraries of ours that `library` needs, through others too.
fn needs(library: &str) -> BTreeSet<String> {
    let libraries: BTreeMap<String, Table> = members()
        .into_iter()
        .map(|(folder, member)| (folder.rsplit('/').next().expect("a name").to_owned(), member))
        .collect();
    let (mut found, mut open) = (BTreeSet::new(), vec![library.to_owned()]);
    while let Some(next) = open.pop() {
        let named = libraries[&next].get("dependencies").and_then(Value::as_table);
        let ours = named.into_iter().flatten().map(|(key, _)| key);
        for key in ours.filter(|key| libraries.contains_key(*key)) {
            if found.insert(key.clone()) {
                open.push(key.clone());
            }
        }
    }
    found
}

/// A change of the solver or of the tracer builds none of these anew.
#[test]
fn pictures_figures_and_searches_need_neither_solver_nor_tracer() {
    assert!(needs("simulate").is_superset(&["rcwa", "tracer", "bsdf"].map(str::to_owned).into()));
    for library in ["rcwa", "bsdf", "runtime", "search", "metrics", "geometry", "full_wave"] {
        assert!(needs(library).is_empty(), "{library}: {:?}", needs(library));
    }
    assert_eq!(needs("tracer"), BTreeSet::from(["bsdf".to_owned()]));
    for library in ["results", "report"] {
        let found = needs(library);
        assert!(!found.contains("rcwa") && !found.contains("tracer"), "{library}: {found:?}");
    }
}

#[test]
fn lints_are_shared_and_plain_commands_take_all_but_the_python_package() {
    let workspace = manifest("Cargo.toml");
    for (folder, member) in members() {
        let shared = member.get("lints").and_then(|lints| lints.get("workspace"));
        assert_eq!(shared.and_then(Value::as_bool), Some(true), "{folder}");
    }
    let unsafe_code = workspace["workspace"]["lints"]["rust"]["unsafe_code"].as_str();
    assert!(matches!(unsafe_code, Some("deny" | "forbid")));
    let list = |key: &str| {
        let list = workspace["workspace"][key].as_array();
        let names = list.expect("a list").iter().filter_map(Value::as_str);
        names.filter(|name| *name != "pipeline/python").collect::<Vec<_>>()
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
    for (folder, member) in members() {
        let programs = member.get("test").and_then(Value::as_array);
        for program in programs.into_iter().flatten() {
            let path = Path::new(&folder).join(program["path"].as_str().expect("a path"));
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
    for (folder, _) in members() {
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
