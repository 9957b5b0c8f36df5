// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modules keep to the floors of their crate, and no two of them import each other.
//!
//! Source: the blocks `floors CRATE` of `docs/explanation/architecture.md`; the sources themselves.

use batwing_tests::module_dependencies::{Crate, floors};
use batwing_tests::{read, workspace};

#[test]
fn imports_run_downwards() {
    let document = read("docs/explanation/architecture.md");
    let mut broken = Vec::new();
    for name in ["rcwa", "bsdf", "tracer", "pipeline"] {
        let floors = floors(&document, name).unwrap_or_else(|| panic!("no floors of {name}"));
        let read = |path: &str| std::fs::read_to_string(workspace().join(path)).ok();
        let read = Crate::read(&format!("{name}/src"), &read);
        let violations = read.violations(&floors);
        broken.extend(violations.iter().map(|v| format!("{name}: {v}")));
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
