// SPDX-License-Identifier: MIT OR Apache-2.0
//! The page: its text, its style (that of the report, and its own) and its scripts.

use report::html::{scene_3d, style_of_pictures};

/// The page without style and scripts.
pub const HTML: &str = include_str!("page/page.html");

/// Scripts, each of which builds on those before; first those that the report draws with.
const SCRIPTS: [&str; 10] = [
    scene_3d::ELEMENTS,
    scene_3d::WEBGL,
    scene_3d::VIEW,
    include_str!("page/connection.js"),
    include_str!("page/numbers.js"),
    include_str!("page/curves.js"),
    include_str!("page/light.js"),
    include_str!("page/view.js"),
    include_str!("page/file.js"),
    include_str!("page/search.js"),
];

/// All scripts.
pub fn script() -> String {
    "\"use strict\";\n".to_owned() + &SCRIPTS.concat()
}

/// The style.
pub fn style() -> String {
    style_of_pictures() + scene_3d::STYLE + include_str!("page/explore.css")
}
