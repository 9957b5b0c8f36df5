// SPDX-License-Identifier: MIT OR Apache-2.0
//! Designs of `batwing new`.

use std::path::Path;

use pipeline::commands::new::{self, Template};

#[test]
fn designs_are_valid_under_any_good_name() {
    for template in [Template::Package, Template::Backlight, Template::RgbBacklight] {
        let text = new::text("my-own.2", template).expect("a valid design");
        let design = design::parse("a.toml", &text, Path::new("")).expect("the same");
        assert_eq!(design.name, "my-own.2");
        assert!(new::text("a/b", template).is_err());
    }
}
