// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipes of CONTRIBUTING name files that exist, and lists that these files hold.

use std::path::Path;

use batwing_tests::workspace;

#[test]
fn recipes_name_what_exists() {
    let text = std::fs::read_to_string(workspace().join("CONTRIBUTING.md")).expect("a document");
    let (_, recipes) = text.split_once("## Add something").expect("the recipes");
    let recipes = recipes.split("\n## ").next().unwrap_or_default();
    // Words and code by turns.
    let parts: Vec<&str> = recipes.split('`').collect();
    let mut files = 0;
    for (number, code) in parts.iter().enumerate().skip(1).step_by(2) {
        let has_ending = Path::new(code).extension().is_some_and(|ending| ending == "rs");
        let is_file = code.contains('/') || has_ending;
        if !is_file || code.contains(' ') {
            continue;
        }
        files += 1;
        let path = workspace().join(code);
        assert!(path.exists(), "CONTRIBUTING.md: `{code}` does not exist");
        if path.is_file() && ["in", "of"].contains(&parts[number - 1].trim()) {
            let list = parts[number - 2];
            let source = std::fs::read_to_string(&path).expect("a file");
            assert!(source.contains(list), "CONTRIBUTING.md: `{code}` holds no `{list}`");
        }
    }
    assert!(files > 20, "{files}");
}
