// SPDX-License-Identifier: MIT OR Apache-2.0
//! Binary STL: 80 bytes of text, the number of triangles, then 50 bytes a triangle (normal, three
//! corners, two zero bytes), little-endian f32. The unit, which the format does not state, is the
//! millimetre.

use std::io::Write;

use anyhow::{Context, Result, bail, ensure};
use glam::DVec3;

use super::mesh::Mesh;
use super::{Writer, Writes};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "stl",
    help: "CAD: binary STL of the bodies, .stl",
    endings: &["stl"],
    writes: Writes::Bodies { single: true, write },
};

/// Length of the header with the number of triangles, and of one triangle, bytes.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// The triangles of a file, binary or text, corners times `unit_mm`; stated normals are not looked
/// at, the order of the corners tells them.
pub fn read(bytes: &[u8], unit_mm: f64) -> Result<Vec<[DVec3; 3]>> {
    let stated =
        bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let whole = |count: usize| count.checked_mul(RECORD).and_then(|n| n.checked_add(HEADER));
    let corner = |record: &[u8], k: usize| {
        let value = |axis: usize| {
            let at = 12 + 12 * k + 4 * axis;
            f64::from(f32::from_le_bytes([
                record[at],
                record[at + 1],
                record[at + 2],
                record[at + 3],
            ]))
        };
        DVec3::new(value(0), value(1), value(2)) * unit_mm
    };
    if let Some(count) = stated
        && whole(count) == Some(bytes.len())
    {
        let records = bytes[HEADER..].chunks_exact(RECORD);
        return Ok(records.map(|r| [0, 1, 2].map(|k| corner(r, k))).collect());
    }
    if bytes.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        return text(bytes, unit_mm);
    }
    let expected = stated.and_then(whole).unwrap_or(HEADER);
    bail!(
        "STL: expected {expected} bytes for the {} triangles that the header states, got {}",
        stated.unwrap_or(0),
        bytes.len()
    )
}

/// The text form, keywords in small or capital letters: of all its words, `vertex x y z` is what
/// counts, and that the last line ends a solid.
fn text(bytes: &[u8], unit_mm: f64) -> Result<Vec<[DVec3; 3]>> {
    let text = std::str::from_utf8(bytes).context("STL: expected a binary file or text")?;
    let mut corners = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace();
        let word = words.next().unwrap_or_default();
        if word.eq_ignore_ascii_case("vertex") {
            let values: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
            let [x, y, z] = values[..] else {
                bail!("STL, line {number}: expected `vertex x y z`, got {line:?}");
            };
            corners.push(DVec3::new(x, y, z) * unit_mm);
        } else if word.eq_ignore_ascii_case("endloop") {
            ensure!(
                corners.len() % 3 == 0,
                "STL, line {number}: expected three corners in each loop"
            );
        }
    }
    ensure!(
        corners.len() % 3 == 0,
        "STL: expected three corners for each triangle, got {} corners in all",
        corners.len()
    );
    let last = text.lines().map(str::trim).rfind(|line| !line.is_empty());
    let last = last.unwrap_or_default();
    ensure!(
        last.split_whitespace().any(|word| word.eq_ignore_ascii_case("endsolid")),
        "STL: expected `endsolid` on the last line, got another word: the file was cut off"
    );
    Ok(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
}

/// Writes the triangles of all `bodies`.
pub fn write(bodies: &[Mesh], about: &str, file: &mut dyn Write) -> Result<()> {
    let mut header = [b' '; 80];
    // "solid" at the beginning would make some readers expect text.
    for (slot, byte) in header.iter_mut().zip(format!("binary STL, mm: {about}").bytes()) {
        *slot = byte;
    }
    file.write_all(&header)?;
    let count: usize = bodies.iter().map(|b| b.triangles.len()).sum();
    file.write_all(&u32::try_from(count)?.to_le_bytes())?;
    for body in bodies {
        for triangle in &body.triangles {
            let corners = triangle.map(|k| DVec3::from_array(body.vertices[k as usize]));
            let normal =
                (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
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
