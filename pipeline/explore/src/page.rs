// SPDX-License-Identifier: MIT OR Apache-2.0
//! The page: its text, its style (that of the report, and its own) and its scripts.

use report::html::style_of_pictures;

/// The page without style and scripts.
pub const HTML: &str = include_str!("page/page.html");

/// Scripts, each of which builds on those before.
const SCRIPTS: [&str; 6] = [
    include_str!("page/connection.js"),
    include_str!("page/numbers.js"),
    include_str!("page/curves.js"),
    include_str!("page/light.js"),
    include_str!("page/file.js"),
    include_str!("page/search.js"),
];

/// All scripts.
pub fn script() -> String {
    SCRIPTS.concat()
}

/// The style.
pub fn style() -> String {
    style_of_pictures() + include_str!("page/explore.css")
}
