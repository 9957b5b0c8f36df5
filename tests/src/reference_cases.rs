// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reference cases of `data/reference/`.

use serde_json::Value;

/// The cases of `file` whose identifier begins with `prefix`.
///
/// # Panics
/// If the file is not what it should be.
pub fn cases(file: &str, prefix: &str) -> Vec<Value> {
    let text = crate::read(format!("data/reference/{file}"));
    let document: Value = serde_json::from_str(&text).expect("a JSON file");
    let all = document["cases"].as_array().expect("a list of cases");
    all.iter()
        .filter(|case| case["id"].as_str().is_some_and(|id| id.starts_with(prefix)))
        .cloned()
        .collect()
}
