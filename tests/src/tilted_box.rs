// SPDX-License-Identifier: MIT OR Apache-2.0
//! A tilted box above the package, as a table of `[[solids]]` and as a mesh.

use std::fmt::Write as _;
use std::path::Path;

/// Keys of it that do not say its form.
pub const WEDGE: &str = "position_mm = [0.5, -0.3, 2.0]\nrotation_deg = [10.0, 25.0, -30.0]\nmedium = { index = 1.6 }\n";

/// A closed box of these half lengths as triangles in an OBJ file, in its own coordinates.
///
/// # Panics
/// If the file cannot be written.
pub fn write_box(path: &Path, half: [f64; 3]) {
    let mut text = String::new();
    for k in 0..8 {
        let pick = |axis: usize| {
            if k >> axis & 1 == 0 { -half[axis] } else { half[axis] }
        };
        let _ = writeln!(text, "v {} {} {}", pick(0), pick(1), pick(2));
    }
    for [a, b, c, d] in
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    {
        let _ = writeln!(text, "f {} {} {}\nf {} {} {}", a + 1, b + 1, c + 1, a + 1, c + 1, d + 1);
    }
    std::fs::write(path, text).expect("written");
}
