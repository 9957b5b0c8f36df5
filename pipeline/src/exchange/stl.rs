// SPDX-License-Identifier: MIT OR Apache-2.0
//! Binary STL: 80 bytes of text, the number of triangles, then 50 bytes a triangle (normal, three corners, two zero bytes), little-endian f32. The unit,
//! which the format does not state, is the millimetre.

use std::io::Write;

use anyhow::Result;
use glam::DVec3;

use super::mesh::Mesh;

/// Writes the triangles of all `bodies`.
pub fn write(bodies: &[Mesh], about: &str, file: &mut (impl Write + ?Sized)) -> Result<()> {
    let mut header = [b' '; 80];
    // "solid" at the beginning would make some readers expect text.
    for (slot, byte) in header
        .iter_mut()
        .zip(format!("binary STL, mm: {about}").bytes())
    {
        *slot = byte;
    }
    file.write_all(&header)?;
    let count: usize = bodies.iter().map(|b| b.triangles.len()).sum();
    file.write_all(&u32::try_from(count)?.to_le_bytes())?;
    for body in bodies {
        for triangle in &body.triangles {
            let corners = triangle.map(|k| DVec3::from_array(body.vertices[k as usize]));
            let normal = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or_zero();
            let mut record = [0_u8; 50];
            let values = [normal, corners[0], corners[1], corners[2]];
            for (k, value) in values.iter().flat_map(DVec3::to_array).enumerate() {
                record[4 * k..4 * k + 4].copy_from_slice(&(value as f32).to_le_bytes());
            }
            file.write_all(&record)?;
        }
    }
    Ok(())
}
