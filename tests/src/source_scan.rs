// SPDX-License-Identifier: MIT OR Apache-2.0
//! Text rules for source files: forbidden calls, test files, modules of test programs.
//!
//! The scan reads text, not syntax. It cuts off comments and whatever follows
//! `#[cfg(test)] mod tests {`.

use std::path::{Path, PathBuf};

/// Words that have no place in a library crate: opening files, the clock, printing, the process and
/// the environment, randomness of its own.
pub const FORBIDDEN: [&str; 18] = [
    "std::fs",
    "File::",
    "OpenOptions",
    "std::env::",
    "std::process",
    "std::net",
    "Instant",
    "SystemTime",
    "print!",
    "println!",
    "eprint!",
    "eprintln!",
    "dbg!",
    "stdout()",
    "stderr()",
    "stdin()",
    "thread_rng",
    "rand::rng()",
];

/// All Rust files under `folder`, in order, without those that cargo built.
///
/// # Panics
/// If a folder cannot be read.
pub fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| entry.expect("a readable entry").path()).collect();
    paths.sort();
    paths
        .into_iter()
        .flat_map(|path| {
            if path.join("CACHEDIR.TAG").exists() {
                Vec::new()
            } else if path.is_dir() {
                rust_files(&path)
            } else if path.extension().is_some_and(|e| e == "rs") {
                vec![path]
            } else {
                Vec::new()
            }
        })
        .collect()
}

/// Whether a file of a crate's `src` holds nothing but tests.
pub fn is_test(path: &Path) -> bool {
    path.components()
        .any(|c| ["tests", "tests.rs", "testing.rs"].contains(&&*c.as_os_str().to_string_lossy()))
}

/// Lines (from 1) of `text` that hold a forbidden word, with the word.
pub fn forbidden(text: &str) -> Vec<(usize, &'static str)> {
    let mut found = Vec::new();
    let lines: Vec<&str> = text.lines().collect();
    for (i, line) in lines.iter().enumerate() {
        let opens_tests = line.trim() == "#[cfg(test)]"
            && lines[i + 1..].first().is_some_and(|next| {
                next.trim_start().starts_with("mod ") && next.trim_end().ends_with('{')
            });
        if opens_tests {
            break;
        }
        let code = line.split("//").next().unwrap_or_default();
        for word in FORBIDDEN {
            let starts_word = |at: usize| {
                let before = code[..at].chars().next_back();
                !before.is_some_and(|c| c.is_alphanumeric() || c == '_')
            };
            if code.match_indices(word).any(|(at, _)| starts_word(at)) {
                found.push((i + 1, word));
            }
        }
    }
    found
}

/// Files of tests that are modules of no program, and would never run: `files` by their names
/// without ending, `programs` the texts of the roots by theirs.
pub fn idle(files: &[String], programs: &[(String, String)]) -> Vec<String> {
    let runs = |file: &String| {
        let module = format!("mod {file};");
        let named = |(name, text): &(String, String)| {
            name == file || text.lines().any(|line| line.trim() == module)
        };
        programs.iter().any(named)
    };
    files.iter().filter(|file| !runs(file)).cloned().collect()
}
