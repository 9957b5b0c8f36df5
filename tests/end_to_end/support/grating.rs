// SPDX-License-Identifier: MIT OR Apache-2.0
//! Answers of `batwing grating`.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use super::binary::batwing;

/// What the command printed for one case.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Standard output, as printed.
    pub text: String,
    /// Standard error.
    pub warnings: String,
    /// Standard output, read.
    pub json: Value,
}

impl Answer {
    /// Efficiencies by order under `key`.
    ///
    /// # Panics
    /// If there is no such object of numbers.
    pub fn orders(&self, key: &str) -> BTreeMap<i32, f64> {
        let orders =
            self.json[key].as_object().unwrap_or_else(|| panic!("no {key} in {}", self.text));
        orders
            .iter()
            .map(|(m, v)| (m.parse().expect("an order"), v.as_f64().expect("a number")))
            .collect()
    }

    /// The number under `key`.
    ///
    /// # Panics
    /// If it is none.
    pub fn number(&self, key: &str) -> f64 {
        self.json[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {}", self.text))
    }
}

/// Saves `case` in `folder` and runs `batwing grating` on it.
///
/// # Panics
/// If the command fails or prints no JSON.
pub fn grating(folder: &Path, case: &Value) -> Answer {
    let path = folder.join("case.json");
    std::fs::write(&path, case.to_string()).expect("a written case");
    let output =
        batwing(folder).args(["grating", "case.json", "--quiet"]).output().expect("it runs");
    let (text, warnings) = (
        String::from_utf8(output.stdout).expect("UTF-8"),
        String::from_utf8(output.stderr).expect("UTF-8"),
    );
    assert!(output.status.success(), "{}: {warnings}", case["id"]);
    let json = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
    Answer { text, warnings, json }
}
