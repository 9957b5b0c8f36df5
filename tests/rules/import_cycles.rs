// SPDX-License-Identifier: MIT OR Apache-2.0
//! Top-level modules of a crate import each other without cycles.
//!
//! Source: the sources of this workspace, read as text: module names after `crate::`. The checker is
//! first shown a made-up cycle.

use batwing_tests::{crate_dependencies, source_scan, workspace};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Modules by name, with the modules that each imports.
type Imports = BTreeMap<String, BTreeSet<String>>;

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Code of a file without comments and without its module of tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// Names after `crate::`, those of a list in braces included.
fn named(code: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for path in code.split("crate::").skip(1) {
        let Some(list) = path.strip_prefix('{') else {
            found.extend(path.split(|c| !is_name(c)).next().map(str::to_owned));
            continue;
        };
        let mut depth = 1;
        let mut begins = true;
        for (at, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 1 => begins = true,
                c if begins && is_name(c) => {
                    found.extend(list[at..].split(|c| !is_name(c)).next().map(str::to_owned));
                    begins = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    found
}

/// Imports between the top-level modules of the crate whose sources lie in `folder`.
fn imports(folder: &Path) -> Imports {
    let mut found = Imports::new();
    for path in source_scan::rust_files(folder) {
        let below = path.strip_prefix(folder).expect("a file below the folder");
        let first = below.components().next().expect("a name").as_os_str().to_string_lossy();
        let module = first.trim_end_matches(".rs");
        if !source_scan::is_test(below) && !["lib", "main"].contains(&module) {
            let text = std::fs::read_to_string(&path).expect("a readable file");
            found.entry(module.to_owned()).or_default().extend(named(&code(&text)));
        }
    }
    found
}

/// Modules that are part of a cycle or import from one.
fn in_cycles(mut imports: Imports) -> Imports {
    loop {
        let modules: BTreeSet<String> = imports.keys().cloned().collect();
        for (module, others) in &mut imports {
            others.retain(|other| other != module && modules.contains(other));
        }
        imports.retain(|_, others| !others.is_empty());
        if imports.len() == modules.len() {
            return imports;
        }
    }
}

#[test]
fn a_cycle_is_found() {
    let texts = [
        ("a", "use crate::{\n    b::{C, d},\n    e,\n};"),
        ("b", "fn f(x: crate::a::X) {} // crate::e"),
        ("e", "use std::fmt;\n#[cfg(test)]\nmod tests {\n    use crate::a;\n}\n"),
    ];
    let all: Imports =
        texts.iter().map(|(module, text)| ((*module).to_owned(), named(&code(text)))).collect();
    assert_eq!(all["a"].iter().collect::<Vec<_>>(), ["b", "e"]);
    assert_eq!(in_cycles(all).into_keys().collect::<Vec<_>>(), ["a", "b"]);
}

#[test]
fn imports_make_no_cycle() {
    for (folder, ..) in crate_dependencies::ALLOWED {
        let imports = imports(&workspace().join(folder).join("src"));
        let cycles = in_cycles(imports);
        assert!(cycles.is_empty(), "{folder}: {cycles:#?}");
    }
}
