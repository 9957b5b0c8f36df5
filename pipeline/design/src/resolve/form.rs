// SPDX-License-Identifier: MIT OR Apache-2.0
//! The form of a solid or a sheet, checked, and where it stands.

use std::f64::consts::TAU;
use std::fmt::Display;
use std::path::Path;

use tracer::Shape;
use tracer::glam::{DMat3, DVec3};
use tracer::shape::{Bounds, Closing, Extent, Mesh, Placement, Plane};

use formats::level_image::LevelImage;
use geometry::Meridian;
use geometry::height_map::HeightMap;
use geometry::outline::Ends;
use geometry::tessellation::Tessellation;
use metrics::digits::shortest;
use runtime::bounded_text::{MAX_ROWS, bounded_bytes};
use runtime::provenance::FileRecord;

use super::{dome, dome_mesh};
use crate::check::{Context, MAX_LENGTH_MM};
use crate::error::ConfigError;
use crate::resolved::form::{CHORDS, Form, LEVEL};
use crate::schema::solids::{
    Ball, Cylinder, Disc, Flat, Solid, SolidForm, SolidHeightMap, SolidMesh,
};
use crate::shapes;
use runtime::serde_arrays::List;

/// Largest angle that an arc's chord turns through in sections.
const CHORD_TURN: f64 = TAU / CHORDS as f64;

/// Points (r, z) along a curve, arcs by chords.
fn flattened(meridian: &Meridian) -> Vec<[f64; 2]> {
    let mut points = vec![meridian.pieces[0].start];
    for piece in &meridian.pieces {
        let chords = (piece.sweep() / CHORD_TURN).ceil().max(1.0) as usize;
        let inner = (1..chords).map(|k| piece.along(k as f64 / chords as f64));
        points.extend(inner);
        points.push(piece.end);
    }
    points
}

/// Pieces and the outline of a form.
type Pieces = (Vec<Shape>, Vec<[f64; 2]>);

/// The table of a solid or a film that is read.
pub(super) struct SolidTable<'a> {
    /// Its key: `solids[1]`, `films[2]`.
    pub name: &'a str,
    pub folder: &'a Path,
    /// True if light carries its polarisation.
    pub is_polarised: bool,
    pub at: &'a Context<'a>,
}

pub(super) fn resolve(
    solid: &Solid,
    read: &SolidTable,
    files: &mut Vec<FileRecord>,
) -> Result<Form, ConfigError> {
    let placement = read.placement(solid)?;
    let (mut meridian, mut deviation) = (None, None);
    let (pieces, outline) = match &solid.kind {
        SolidForm::Box(stated) => read.cuboid(stated)?,
        SolidForm::Rectangle(stated) => read.rectangle(stated)?,
        SolidForm::Disc(stated) => read.disc(stated)?,
        SolidForm::Sphere(stated) => read.sphere(stated)?,
        SolidForm::Cylinder(stated) => read.cylinder(stated)?,
        SolidForm::Meridian(stated) => {
            let (rows, path) = (stated.meridian_mm.as_deref(), stated.meridian_file.as_deref());
            let x = read.meridian(["meridian_mm", "meridian_file"], rows, path, files)?;
            let (rows, path) = (stated.meridian_y_mm.as_deref(), stated.meridian_y_file.as_deref());
            let y = read.meridian(["meridian_y_mm", "meridian_y_file"], rows, path, files)?;
            let x = x.ok_or_else(|| {
                let expected = "this key or `meridian_file`, for this kind";
                read.at.value(&read.key("meridian_mm"), "missing", expected)
            })?;
            if let Some(y) = y.filter(|y| *y != x) {
                let name = path.map_or("meridian_y_mm", |_| "meridian_y_file");
                let key = read.key(name);
                let made = dome::between([&x, &y], (&key, path), read.at)?;
                deviation = Some(made.deviation);
                let solid = dome_mesh::solid(&made);
                let solid = solid.map_err(|e| dome::no_solid(&key, &e.to_string(), read.at))?;
                (vec![solid], Vec::new())
            } else {
                let x = meridian.insert(x);
                let pieces = shapes::of(x).map_err(|error| read.refuse("meridian_mm", &error))?;
                (pieces, flattened(x))
            }
        }
        SolidForm::Mesh(stated) => read.mesh(stated, files)?,
        SolidForm::HeightMap(stated) => {
            let made = read.height_map(stated, files)?;
            deviation = Some(made.deviation);
            let solid = dome_mesh::solid(&made).map_err(|error| read.refuse("map_file", &error))?;
            (vec![solid], Vec::new())
        }
    };
    let form = Form {
        pieces,
        closing: if solid.kind.is_sheet() { Closing::Open } else { Closing::Closed },
        placement,
        outline,
        meridian,
        deviation,
    };
    read.above_bottom(&form, solid)?;
    Ok(form)
}

/// The point of a circle of this radius on ray `k` of [`CHORDS`], from the second axis on.
fn on_circle(radius: f64, k: usize) -> [f64; 2] {
    let (sin, cos) = (TAU * k as f64 / CHORDS as f64).sin_cos();
    [radius * sin, radius * cos]
}

impl SolidTable<'_> {
    pub(super) fn key(&self, name: &str) -> String {
        format!("{}.{name}", self.name)
    }

    fn refuse(&self, name: &str, error: &dyn Display) -> ConfigError {
        let expected = format!("a form that can be built: {error}");
        self.at.value(&self.key(name), "a bad value", &expected)
    }

    pub(super) fn length(&self, name: &str, value: f64) -> Result<f64, ConfigError> {
        self.at.length(&self.key(name), value)
    }

    /// The lengths under `size_mm`, halved.
    fn half_sizes<const N: usize>(&self, stated: &Flat<N>) -> Result<[f64; N], ConfigError> {
        for size in stated.size_mm.0 {
            self.length("size_mm", size)?;
        }
        Ok(stated.size_mm.0.map(|size| 0.5 * size))
    }

    fn cuboid(&self, stated: &Flat<3>) -> Result<Pieces, ConfigError> {
        let half = DVec3::from_array(self.half_sizes(stated)?);
        let right = [[0.0, half.z], [half.x, half.z], [half.x, -half.z], [0.0, -half.z]];
        let shape = Shape::cuboid(-half, half).map_err(|error| self.refuse("size_mm", &error))?;
        Ok((vec![shape], right.to_vec()))
    }

    fn rectangle(&self, stated: &Flat<2>) -> Result<Pieces, ConfigError> {
        let [x, y] = self.half_sizes(stated)?;
        let extent = Extent::Rectangle { half_u: x, half_v: y };
        let plane = Plane::new(DVec3::ZERO, DVec3::Z, extent)
            .map_err(|error| self.refuse("size_mm", &error))?;
        let edge = vec![[-x, -y], [x, -y], [x, y], [-x, y]];
        Ok((vec![Shape::Plane(plane)], edge))
    }

    fn disc(&self, stated: &Disc) -> Result<Pieces, ConfigError> {
        let radius = self.length("radius_mm", stated.radius_mm)?;
        let shape = Shape::annulus(0.0, 0.0, radius);
        let shape = shape.map_err(|error| self.refuse("radius_mm", &error))?;
        let edge = (0..CHORDS).map(|k| on_circle(radius, k));
        Ok((vec![shape], edge.collect()))
    }

    fn sphere(&self, stated: &Ball) -> Result<Pieces, ConfigError> {
        let radius = self.length("radius_mm", stated.radius_mm)?;
        let shape = Shape::sphere(0.0, radius);
        let shape = shape.map_err(|error| self.refuse("radius_mm", &error))?;
        let half = (0..=CHORDS / 2).map(|k| on_circle(radius, k));
        let mut half: Vec<[f64; 2]> = half.collect();
        // Exactly on the axis at its end.
        half[CHORDS / 2][0] = 0.0;
        Ok((vec![shape], half))
    }

    fn cylinder(&self, stated: &Cylinder) -> Result<Pieces, ConfigError> {
        let radius = self.length("radius_mm", stated.radius_mm)?;
        let half = 0.5 * self.length("height_mm", stated.height_mm)?;
        let rows = [[0.0, half], [radius, half], [radius, -half], [0.0, -half]];
        let points = rows.map(|row| row.to_vec());
        let key = self.key("radius_mm");
        let meridian = dome::in_design(&key, &points, Ends::OnAxis, self.at)?;
        let pieces = shapes::of(&meridian).map_err(|error| self.refuse("radius_mm", &error))?;
        Ok((pieces, rows.to_vec()))
    }

    /// The curve under one of two keys, in rows or in a file.
    fn meridian(
        &self,
        [name, file]: [&str; 2],
        rows: Option<&[Vec<f64>]>,
        path: Option<&str>,
        files: &mut Vec<FileRecord>,
    ) -> Result<Option<Meridian>, ConfigError> {
        match (rows, path) {
            (Some(rows), None) => {
                dome::in_design(&self.key(name), rows, Ends::OnAxis, self.at).map(Some)
            }
            (None, Some(path)) => {
                let key = self.key(file);
                let stated = [&*key, path];
                let meridian = dome::in_file(stated, self.folder, Ends::OnAxis, self.at)?;
                let bytes = bounded_bytes(&self.folder.join(path), MAX_ROWS).unwrap_or_default();
                files.push(FileRecord::new(path, &bytes));
                Ok(Some(meridian))
            }
            (None, None) => Ok(None),
            (Some(_), Some(_)) => {
                let expected = format!("no such key beside `{name}`");
                Err(self.at.value(&self.key(file), "given", &expected))
            }
        }
    }

    /// The solid under a height map.
    fn height_map(
        &self,
        stated: &SolidHeightMap,
        files: &mut Vec<FileRecord>,
    ) -> Result<Tessellation, ConfigError> {
        let SolidHeightMap { size_mm: List(size_mm), map_file, scale_mm, base_mm, .. } = stated;
        for size in size_mm {
            self.length("size_mm", *size)?;
        }
        for (name, value) in [("scale_mm", *scale_mm), ("base_mm", *base_mm)] {
            self.at.within(&self.key(name), value, -MAX_LENGTH_MM, MAX_LENGTH_MM)?;
        }
        let key = self.key("map_file");
        let read = LevelImage::read_heights(&self.folder.join(map_file));
        let (map, sha256) = read.map_err(|error| self.at.of_files(&error.context(key.clone())))?;
        files.push(FileRecord { file: map_file.clone(), sha256 });
        let counts = [map.columns, map.rows];
        let heights_mm = map.levels.iter().map(|z| base_mm + scale_mm * z).collect();
        let made = HeightMap { counts, size_mm: *size_mm, heights_mm }.solid();
        made.map_err(|[got, expected]| self.at.value(&key, format!("{map_file}: {got}"), &expected))
    }

    fn mesh(&self, stated: &SolidMesh, files: &mut Vec<FileRecord>) -> Result<Pieces, ConfigError> {
        let name = &stated.mesh;
        let (triangles, sha256) =
            dome_mesh::triangles(self.name, name, stated.mesh_unit, self.folder)
                .map_err(|error| self.at.of_files(&error))?;
        let parts = vec![0; triangles.len()];
        let path = self.folder.join(name);
        let mesh = Mesh::welded(&triangles, &parts).map_err(|error| {
            let key = self.key("mesh");
            let error = anyhow::anyhow!("{key}: `{}`: {error}", path.display());
            self.at.of_files(&error)
        })?;
        let file = name.clone();
        files.push(FileRecord { file, sha256 });
        if let Some(smooth_deg) = stated.smooth_deg {
            self.at.within(&self.key("smooth_deg"), smooth_deg, 0.0, 90.0)?;
        }
        Ok((vec![Shape::mesh(dome_mesh::smoothed(mesh, stated.smooth_deg))], Vec::new()))
    }

    /// Nothing lies below the bottom, and nothing farther than ten metres away.
    fn above_bottom(&self, form: &Form, solid: &Solid) -> Result<(), ConfigError> {
        let got = format!("{:?}", solid.shared.position_mm);
        let shape = form.shape(0.0);
        let shape =
            shape.map_err(|e| self.at.value(&self.key("position_mm"), &got, &e.to_string()))?;
        let Bounds { low, high } = shape.bounds();
        let size = (high - low).max_element();
        // Touching to the rounding of its place and size is touching.
        if low.z < -LEVEL * size.max(form.placement.origin.z.abs()) {
            let expected = format!(
                "a place above the bottom, z = 0; it reaches down to {} mm",
                shortest(format!("{:.3e}", low.z).parse().unwrap_or(low.z))
            );
            return Err(self.at.value(&self.key("position_mm"), got, &expected));
        }
        if low.abs().max(high.abs()).max_element() > 2.0 * MAX_LENGTH_MM {
            let expected = "a solid within 20 m of the origin";
            return Err(self.at.value(&self.key("position_mm"), got, expected));
        }
        Ok(())
    }

    /// Place and rotation.
    fn placement(&self, solid: &Solid) -> Result<Placement, ConfigError> {
        let position_mm = solid.shared.position_mm.0;
        for value in position_mm {
            self.at.within(&self.key("position_mm"), value, -MAX_LENGTH_MM, MAX_LENGTH_MM)?;
        }
        let mut placement = Placement::at(DVec3::from_array(position_mm));
        let (axis, rotation_deg) = match &solid.kind {
            SolidForm::Cylinder(cylinder) => (cylinder.axis, None),
            SolidForm::Meridian(meridian) => (meridian.axis, meridian.rotation_deg),
            SolidForm::Disc(disc) => (disc.axis, None),
            SolidForm::Box(flat) => (None, flat.rotation_deg),
            SolidForm::Rectangle(flat) => (None, flat.rotation_deg),
            SolidForm::Mesh(mesh) => (None, mesh.rotation_deg),
            SolidForm::HeightMap(map) => (None, map.rotation_deg),
            SolidForm::Sphere(_) => (None, None),
        };
        if axis.is_some() && rotation_deg.is_some() {
            let expected = "no such key beside `rotation_deg`";
            return Err(self.at.value(&self.key("axis"), "given", expected));
        }
        if let (Some(_), SolidForm::Meridian(keys)) = (axis, &solid.kind)
            && (keys.meridian_y_mm.is_some() || keys.meridian_y_file.is_some())
        {
            let expected = "no such key of an oval solid: use `rotation_deg`";
            return Err(self.at.value(&self.key("axis"), "given", expected));
        }
        if let Some(List(axis)) = axis {
            let axis = self.at.direction(&self.key("axis"), axis)?;
            let along = placement.along(axis);
            placement = along.map_err(|error| {
                self.at.value(&self.key("axis"), "a bad value", &error.to_string())
            })?;
        }
        if let Some(List(angles)) = rotation_deg {
            placement.rotation = rotation(angles, &self.key("rotation_deg"), self.at)?;
        }
        Ok(placement)
    }
}

/// The rotation by these angles in degrees, from `key`.
pub(super) fn rotation(
    angles_deg: [f64; 3],
    key: &str,
    at: &Context,
) -> Result<DMat3, ConfigError> {
    for angle in angles_deg {
        at.within(key, angle, -360.0, 360.0)?;
    }
    Ok(turned(angles_deg))
}

/// About x, then y, then z, whose directions stay. Quarter turns are exact.
fn turned(angles_deg: [f64; 3]) -> DMat3 {
    if angles_deg.iter().all(|angle| *angle == 0.0) {
        return DMat3::IDENTITY;
    }
    let [x, y, z] = angles_deg.map(f64::to_radians);
    let turn = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
    let whole = |value: f64| {
        let near = value.round();
        if (value - near).abs() < 1e-15 { near } else { value }
    };
    DMat3::from_cols_array(&turn.to_cols_array().map(whole))
}
