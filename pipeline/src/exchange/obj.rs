// SPDX-License-Identifier: MIT OR Apache-2.0
//! Wavefront OBJ: one object a body, vertices in millimetres, faces counted from 1 through the whole file.

use std::io::Write;

use anyhow::Result;

use super::mesh::Mesh;

/// Writes all `bodies`.
pub fn write(bodies: &[Mesh], about: &str, file: &mut (impl Write + ?Sized)) -> Result<()> {
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
