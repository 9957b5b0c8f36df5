// SPDX-License-Identifier: MIT OR Apache-2.0
//! `dome.mesh`: the solid of a dome from a file of triangles.
//!
//! In: an STL or OBJ file with its unit. Out: a checked shape in two parts, the triangles that lie in the plane z = 0, which are the bottom, and all others. The
//! solid must be closed, stand on z = 0 and fit into the height and width that the design states.

use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use glam::DVec3;
use serde::Serialize;
use tracer::Shape;
use tracer::shape::Mesh;

use super::raw;
use super::resolved::{Dome, sha256_hex};
use crate::exchange::{obj, stl};

/// How far below or above z = 0 a corner may lie to belong to the bottom, and how far the solid may exceed its stated size, as a share of it: the rounding of f32.
const ROUNDING: f64 = 1e-6;

/// The solid of a dome.
#[derive(Debug, Clone, Serialize)]
pub struct DomeMesh {
    /// Name in the design.
    pub file: String,
    /// Hexadecimal SHA-256 of the file.
    pub sha256: String,
    /// Number of triangles.
    pub triangles: usize,
    /// Part 0 is the dome, part 1 the bottom.
    #[serde(skip)]
    pub shape: Shape,
}

impl DomeMesh {
    /// The closed lines (x, z) in which the plane y = 0 cuts it, mm.
    pub fn section(&self) -> Vec<Vec<[f64; 2]>> {
        let Shape::Mesh(mesh) = &self.shape else {
            return Vec::new();
        };
        let lines = mesh.section(DVec3::ZERO, DVec3::Y).into_iter();
        lines
            .map(|line| line.into_iter().map(|at| [at.x, at.z]).collect())
            .collect()
    }
}

/// Reads the mesh of `raw`, if it names one.
pub(super) fn load(raw: &raw::Dome, dome: &Dome, folder: &Path) -> Result<Option<DomeMesh>> {
    let Some(name) = &raw.mesh else {
        ensure!(
            raw.mesh_unit.is_none(),
            "dome.mesh_unit: expected no such key without dome.mesh"
        );
        return Ok(None);
    };
    let unit = raw.mesh_unit.as_deref();
    let (triangles, sha256) = triangles("dome", name, unit, folder)?;
    let found = shape(triangles, dome);
    let path = folder.join(name);
    let (shape, count) = found.with_context(|| format!("dome.mesh: `{}`", path.display()))?;
    Ok(Some(DomeMesh {
        file: name.clone(),
        sha256,
        triangles: count,
        shape,
    }))
}

/// The triangles of the file `mesh` of a table in millimetres, and the hash of the file; `unit` is the value of `mesh_unit`.
pub(super) fn triangles(
    table: &str,
    name: &str,
    unit: Option<&str>,
    folder: &Path,
) -> Result<(Vec<[DVec3; 3]>, String)> {
    let unit_mm = match unit {
        Some("um") => 1e-3,
        Some("mm") => 1.0,
        Some("cm") => 10.0,
        Some("m") => 1e3,
        Some("inch") => 25.4,
        Some(other) => {
            bail!(
                "{table}.mesh_unit: expected \"um\", \"mm\", \"cm\", \"m\" or \"inch\", got {other:?}"
            )
        }
        None => {
            bail!("{table}.mesh_unit: missing; the file does not say in which unit its lengths are")
        }
    };
    let path = folder.join(name);
    let bytes = std::fs::read(&path).with_context(|| {
        format!(
            "{table}.mesh: expected a mesh, cannot read `{}`",
            path.display()
        )
    })?;
    let ending = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    let triangles = match ending.as_ref().and_then(|e| e.to_str()) {
        Some("stl") => stl::read(&bytes, unit_mm),
        Some("obj") => obj::read(&bytes, unit_mm),
        _ => bail!("{table}.mesh: expected a file ending in .stl or .obj, got `{name}`"),
    };
    let triangles = triangles.with_context(|| format!("{table}.mesh: `{}`", path.display()))?;
    Ok((triangles, sha256_hex(&bytes)))
}

fn shape(mut triangles: Vec<[DVec3; 3]>, dome: &Dome) -> Result<(Shape, usize)> {
    let slack = ROUNDING * dome.height_mm.max(dome.radius_mm);
    for corner in triangles.iter_mut().flatten() {
        if corner.z.abs() <= slack {
            corner.z = 0.0;
        }
        let inside = corner.z >= 0.0
            && corner.z <= dome.height_mm + slack
            && corner.truncate().length() <= dome.radius_mm + slack;
        ensure!(
            inside,
            "corner {corner} mm: expected all corners above z = 0, within dome.height_mm = {} and half of dome.width_mm = {}",
            dome.height_mm,
            dome.radius_mm
        );
    }
    let part = |t: &[DVec3; 3]| u32::from(t.iter().all(|corner| corner.z <= 0.0));
    let parts: Vec<u32> = triangles.iter().map(part).collect();
    ensure!(
        parts.contains(&0) && parts.contains(&1),
        "expected a solid that stands on the plane z = 0, with triangles in it and above it"
    );
    let mesh = Mesh::welded(&triangles, &parts)?;
    Ok((Shape::mesh(mesh), triangles.len()))
}
