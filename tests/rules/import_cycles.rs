// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modules of a crate that lie beside each other import each other without cycles.
//!
//! Source: the sources of this workspace, read as text: paths after `crate::` and `super::`. The
//! checker is first shown made-up cycles.

use batwing_tests::{source_scan, workspace};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::crate_borders::members;

/// Modules by name, with the modules that each imports.
type Imports = BTreeMap<String, BTreeSet<String>>;
/// The same of all modules that lie in one, by the path of that one.
type Levels = BTreeMap<Vec<String>, Imports>;

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Code of a file without comments and without its module of tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// Paths that `code` of the module at `own` names after `crate::` and `super::`, from the root of the
/// crate; of a list in braces each name.
fn named(code: &str, own: &[String]) -> BTreeSet<Vec<String>> {
    let mut found = BTreeSet::new();
    for (at, _) in code.match_indices("crate::").chain(code.match_indices("super::")) {
        if code[..at].ends_with("super::") {
            continue;
        }
        let mut rest = &code[at..];
        let mut base = own.to_vec();
        while let Some(above) = rest.strip_prefix("super::") {
            base.pop();
            rest = above;
        }
        if let Some(below) = rest.strip_prefix("crate::") {
            base.clear();
            rest = below;
        }
        let name = |text: &str| text.split(|c| !is_name(c)).next().unwrap_or_default().to_owned();
        let Some(list) = rest.strip_prefix('{') else {
            let path = rest.split(|c| !is_name(c) && c != ':').next().unwrap_or_default();
            base.extend(path.split("::").filter(|part| !part.is_empty()).map(str::to_owned));
            found.insert(base);
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
                    found.insert([&base[..], &[name(&list[at..])]].concat());
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

/// Adds what the module at `own` imports from those beside it and beside its parents.
fn add(levels: &mut Levels, own: &[String], code: &str) {
    for above in 0..own.len() {
        levels.entry(own[..above].to_vec()).or_default().entry(own[above].clone()).or_default();
    }
    for target in named(code, own) {
        let common = own.iter().zip(&target).take_while(|(a, b)| a == b).count();
        if let (Some(from), Some(to)) = (own.get(common), target.get(common)) {
            let beside = levels.entry(own[..common].to_vec()).or_default();
            beside.entry(from.clone()).or_default().insert(to.clone());
        }
    }
}

/// Imports between the modules of the crate whose sources lie in `folder`.
fn imports(folder: &Path) -> Levels {
    let mut found = Levels::new();
    for path in source_scan::rust_files(folder) {
        let below = path.strip_prefix(folder).expect("a file below the folder");
        let parts = below.with_extension("");
        let mut own: Vec<String> =
            parts.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        own.retain(|part| part != "mod");
        if !source_scan::is_test(below) && !["lib", "main"].contains(&own[0].as_str()) {
            let text = std::fs::read_to_string(&path).expect("a readable file");
            add(&mut found, &own, &code(&text));
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
        ("b", "fn f(x: super::a::X) {} // crate::e"),
        ("e", "use std::fmt;\n#[cfg(test)]\nmod tests {\n    use crate::a;\n}\n"),
        ("e::f", "use super::g::Y;\nuse super::super::h;"),
        ("e::g", "use super::f;"),
        ("h", "use super::e::g::Z;"),
    ];
    let mut all = Levels::new();
    for (module, text) in texts {
        let own: Vec<String> = module.split("::").map(str::to_owned).collect();
        add(&mut all, &own, &code(text));
    }
    let cycles = |level: &[&str]| {
        let level: Vec<String> = level.iter().map(|part| (*part).to_owned()).collect();
        in_cycles(all[&level].clone()).into_keys().collect::<Vec<_>>()
    };
    assert_eq!(all[&vec![]]["a"].iter().collect::<Vec<_>>(), ["b", "e"]);
    assert_eq!(cycles(&[]), ["a", "b", "e", "h"]);
    assert_eq!(cycles(&["e"]), ["f", "g"]);
}

#[test]
fn imports_make_no_cycle() {
    for (folder, _) in members() {
        for (parent, imports) in imports(&workspace().join(&folder).join("src")) {
            let cycles = in_cycles(imports);
            assert!(cycles.is_empty(), "{folder} {}: {cycles:#?}", parent.join("::"));
        }
    }
}
