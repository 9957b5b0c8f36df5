// SPDX-License-Identifier: MIT OR Apache-2.0
//! Wavefront OBJ: one object a body, vertices in millimetres, faces counted from 1 through the
//! whole file.

use std::io::Write;

use anyhow::{Context, Result, bail, ensure};
use glam::DVec3;

use super::mesh::Mesh;
use super::{Writer, Writes};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "obj",
    help: "CAD: Wavefront OBJ of the bodies, .obj",
    endings: &["obj"],
    writes: Writes::Bodies { single: false, write },
};

/// The triangles of all objects of a file, corners times `unit_mm`; polygons are cut into fans,
/// which is right for convex ones. A line that ends in a backslash goes on in the next. Texture,
/// normals and materials are not looked at.
pub fn read(bytes: &[u8], unit_mm: f64) -> Result<Vec<[DVec3; 3]>> {
    let text = std::str::from_utf8(bytes).context("OBJ: expected text")?;
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut triangles = Vec::new();
    // Parts of a line that a backslash continues.
    let mut begun = String::new();
    for (line_number, line) in (1..).zip(text.lines().chain([""])) {
        if let Some(part) = line.trim_end().strip_suffix('\\') {
            begun = begun + part + " ";
            continue;
        }
        let line = std::mem::take(&mut begun) + line;
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let values: Vec<f64> = words.take(3).map_while(|word| word.parse().ok()).collect();
                let [x, y, z] = values[..] else {
                    bail!("OBJ, line {line_number}: expected `v x y z`, got {line:?}");
                };
                vertices.push(DVec3::new(x, y, z) * unit_mm);
            }
            Some("f") => {
                let corners: Vec<DVec3> = words
                    .map(|word| corner(word, &vertices))
                    .collect::<Option<_>>()
                    .with_context(|| {
                        format!(
                            "OBJ, line {line_number}: expected numbers of the {} vertices above, got {line:?}",
                            vertices.len()
                        )
                    })?;
                ensure!(
                    corners.len() >= 3,
                    "OBJ, line {line_number}: expected three corners or more, got {}",
                    corners.len()
                );
                let fan = corners[1..].windows(2);
                triangles.extend(fan.map(|pair| [corners[0], pair[0], pair[1]]));
            }
            Some(word @ ("curv" | "surf" | "curv2")) => {
                bail!("OBJ, line {line_number}: expected polygons, got `{word}`, a curved element");
            }
            _ => {}
        }
    }
    Ok(triangles)
}

/// The vertex of `7`, `7/1`, `7//3` or `-1` (the last one so far).
fn corner(word: &str, vertices: &[DVec3]) -> Option<DVec3> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index = if number > 0 { number - 1 } else { vertices.len() as i64 + number };
    vertices.get(usize::try_from(index).ok()?).copied()
}

/// Writes all `bodies`.
pub fn write(bodies: &[Mesh], about: &str, file: &mut dyn Write) -> Result<()> {
    writeln!(file, "# {about}, lengths in mm")?;
    let mut first = 1;
    for body in bodies {
        writeln!(file, "o {}", body.name)?;
        for [x, y, z] in &body.vertices {
            writeln!(file, "v {x:.9} {y:.9} {z:.9}")?;
        }
        for [a, b, c] in &body.triangles {
            writeln!(file, "f {} {} {}", a + first, b + first, c + first)?;
        }
        first += u32::try_from(body.vertices.len())?;
    }
    Ok(())
}
