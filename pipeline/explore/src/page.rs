// SPDX-License-Identifier: MIT OR Apache-2.0
//! The page: its text, its style (that of the report, and its own) and its scripts.

use report::html::style_of_pictures;

/// The page without style and scripts.
pub const HTML: &str = include_str!("page/page.html");

/// Scripts, each of which builds on those before.
const SCRIPTS: [&str; 0] = [];

/// All scripts.
pub fn script() -> String {
    SCRIPTS.concat()
}

/// The style.
pub fn style() -> String {
    style_of_pictures() + include_str!("page/explore.css")
}
