// SPDX-License-Identifier: MIT OR Apache-2.0
//! `dome.mesh`: the solid of a dome from a file of triangles.
//!
//! In: an STL or OBJ file with its unit, or triangles in the place of a surface. Out: a checked shape in
//! two parts, the triangles that lie in the plane z = 0, which are the bottom, and all others; and the
//! dome's height and largest radius, which are those of its corners. The solid must be closed and
//! stand on z = 0.

use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use glam::{DVec3, Vec3};
use tracer::Shape;
use tracer::shape::{Mesh, MeshError};

use formats::mesh::{JOINED, joined};
use formats::{obj, stl};
use geometry::tessellation::Tessellation;
use metrics::plural::count;
use runtime::bounded_text::{MAX_TABLES, bounded_bytes};
use runtime::content_hash::sha256_hex;
use runtime::progress::warn_once;

use crate::resolved::dome::DomeMesh;
use crate::schema::dome::{MeshDome, MeshUnit};

/// Largest distance from z = 0 of a corner of the bottom, as a share of the size of the solid: the
/// rounding of f32.
const ROUNDING: f64 = 1e-6;

/// Reads the mesh of `raw` and measures it.
pub(crate) fn load(raw: &MeshDome, folder: &Path) -> Result<DomeMesh> {
    let name = &raw.mesh;
    let (triangles, sha256) = triangles("dome", name, raw.mesh_unit, folder)?;
    let path = folder.join(name);
    let smooth = |mesh| smoothed(mesh, raw.smooth_deg);
    let solid = measured(sha256, triangles, smooth)
        .with_context(|| format!("dome.mesh: `{}`", path.display()))?;
    Ok(DomeMesh { file: Some(raw.mesh.clone()), smooth_deg: raw.smooth_deg, ..solid })
}

/// The dome of triangles in the place of a surface, which is told from others by its hash.
pub(crate) fn tessellated(made: Tessellation, sha256: String) -> Result<DomeMesh> {
    let normals = single_precision(&made);
    let deviation = Some(made.deviation);
    let solid = measured(sha256, made.triangles, |mesh| mesh.with_normals(&normals))?;
    Ok(DomeMesh { deviation, ..solid })
}

/// The solid of triangles in the place of its surface.
pub(crate) fn solid(made: &Tessellation) -> Result<Shape, MeshError> {
    let mesh = Mesh::welded(&made.triangles, &vec![0; made.triangles.len()])?;
    Ok(Shape::mesh(mesh.with_normals(&single_precision(made))))
}

fn single_precision(made: &Tessellation) -> Vec<[Vec3; 3]> {
    made.normals.iter().map(|corners| corners.map(DVec3::as_vec3)).collect()
}

/// The mesh with smooth normals, where they are asked for.
pub(crate) fn smoothed(mesh: Mesh, smooth_deg: Option<f64>) -> Mesh {
    match smooth_deg {
        Some(max_deg) => mesh.smoothed(max_deg),
        None => mesh,
    }
}

/// The triangles of the file `mesh` of a table in millimetres, and the hash of the file.
pub(crate) fn triangles(
    table: &str,
    name: &str,
    unit: MeshUnit,
    folder: &Path,
) -> Result<(Vec<[DVec3; 3]>, String)> {
    let unit_mm = unit.mm();
    let path = folder.join(name);
    let bytes = bounded_bytes(&path, MAX_TABLES).with_context(|| {
        format!("{table}.mesh: expected a mesh, cannot read `{}`", path.display())
    })?;
    let ending = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    let triangles = match ending.as_ref().and_then(|e| e.to_str()) {
        Some("stl") => stl::read(&bytes, unit_mm),
        Some("obj") => obj::read(&bytes, unit_mm),
        _ => bail!("{table}.mesh: expected a file ending in .stl or .obj, got `{name}`"),
    };
    let triangles = triangles.with_context(|| format!("{table}.mesh: `{}`", path.display()))?;
    let (triangles, moved) = joined(triangles);
    if moved > 0 {
        warn_once(&format!(
            "{}: {} within {JOINED:e} of the size of the body from others, joined with them",
            path.display(),
            count(moved, "corner")
        ));
    }
    Ok((triangles, sha256_hex(&bytes)))
}

/// The solid with its normals, and its measures.
fn measured(
    sha256: String,
    mut triangles: Vec<[DVec3; 3]>,
    normals: impl FnOnce(Mesh) -> Mesh,
) -> Result<DomeMesh> {
    let corners = || triangles.iter().flatten();
    let height_mm = corners().map(|corner| corner.z).fold(0.0, f64::max);
    let radius_mm = corners().map(|corner| corner.truncate().length()).fold(0.0, f64::max);
    let slack = ROUNDING * height_mm.max(radius_mm);
    for corner in triangles.iter_mut().flatten() {
        if corner.z.abs() <= slack {
            corner.z = 0.0;
        }
        ensure!(corner.z >= 0.0, "corner {corner} mm: expected all corners at z = 0 and above");
    }
    let part = |t: &[DVec3; 3]| u32::from(t.iter().all(|corner| corner.z <= 0.0));
    let parts: Vec<u32> = triangles.iter().map(part).collect();
    ensure!(
        parts.contains(&0) && parts.contains(&1),
        "expected a solid that stands on the plane z = 0, with triangles in it and above it"
    );
    let mesh = Mesh::welded(&triangles, &parts)?;
    Ok(DomeMesh {
        file: None,
        sha256,
        height_mm,
        radius_mm,
        triangles: triangles.len(),
        smooth_deg: None,
        deviation: None,
        shape: Shape::mesh(normals(mesh)),
    })
}
