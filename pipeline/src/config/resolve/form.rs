// SPDX-License-Identifier: MIT OR Apache-2.0
//! The form of a solid or a sheet, checked, and where it stands.

use std::f64::consts::TAU;
use std::path::Path;

use tracer::Shape;
use tracer::glam::{DMat3, DVec3};
use tracer::shape::{Bounds, Closing, Extent, Mesh, Placement, Plane};

use super::{dome, dome_mesh};
use crate::config::check::Context;
use crate::config::design::form::{CHORDS, Form};
use crate::config::error::ConfigError;
use crate::config::schema::solids::{Solid, SolidKind};
use crate::geometry::outline::Ends;
use crate::geometry::{Meridian, shapes};
use crate::provenance::FileRecord;

/// Largest coordinate and length, mm: ten metres.
const MOST_MM: f64 = 1e4;

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

/// The table of a solid that is read.
struct SolidTable<'a> {
    solid: &'a Solid,
    name: &'a str,
    folder: &'a Path,
    at: &'a Context<'a>,
}

pub(in crate::config) fn resolve(
    solid: &Solid,
    table: &str,
    folder: &Path,
    files: &mut Vec<FileRecord>,
    at: &Context,
) -> Result<Form, ConfigError> {
    let read = SolidTable {
        solid,
        name: table,
        folder,
        at,
    };
    let key = |name: &str| read.key(name);
    foreign(solid, &key, at)?;
    let placement = placement(solid, &key, at)?;
    let (pieces, outline) = match solid.kind {
        SolidKind::Box | SolidKind::Rectangle => read.flat()?,
        SolidKind::Disc | SolidKind::Sphere | SolidKind::Cylinder => read.round()?,
        SolidKind::Meridian => read.meridian(files)?,
        SolidKind::Mesh => read.mesh(files)?,
    };
    let form = Form {
        pieces,
        closing: if solid.kind.is_sheet() {
            Closing::Open
        } else {
            Closing::Closed
        },
        placement,
        outline,
    };
    above_bottom(&form, solid, &key, at)?;
    Ok(form)
}

impl SolidTable<'_> {
    fn key(&self, name: &str) -> String {
        format!("{}.{name}", self.name)
    }

    fn refuse(&self, name: &str, error: &tracer::Error) -> ConfigError {
        let expected = format!("a form that can be built: {error}");
        self.at.value(&self.key(name), "a bad value", &expected)
    }

    fn length(&self, name: &str, value: f64) -> Result<f64, ConfigError> {
        self.at.within(&self.key(name), value, 1e-6, MOST_MM)
    }

    /// `count` lengths under `size_mm`, halved.
    fn half_sizes(&self, count: usize) -> Result<Vec<f64>, ConfigError> {
        let sizes = self.solid.size_mm.clone().unwrap_or_default();
        if sizes.len() != count {
            let (key, got) = (self.key("size_mm"), format!("{sizes:?}"));
            return Err(self.at.value(&key, got, &format!("{count} lengths")));
        }
        let half = |size: &f64| Ok(0.5 * self.length("size_mm", *size)?);
        sizes.iter().map(half).collect()
    }

    /// A box or a rectangle.
    fn flat(&self) -> Result<Pieces, ConfigError> {
        let refuse = |error: tracer::Error| self.refuse("size_mm", &error);
        if self.solid.kind == SolidKind::Box {
            let half = self.half_sizes(3)?;
            let half = DVec3::new(half[0], half[1], half[2]);
            let right = [
                [0.0, half.z],
                [half.x, half.z],
                [half.x, -half.z],
                [0.0, -half.z],
            ];
            let shape = Shape::cuboid(-half, half).map_err(refuse)?;
            return Ok((vec![shape], right.to_vec()));
        }
        let half = self.half_sizes(2)?;
        let (x, y) = (half[0], half[1]);
        let extent = Extent::Rectangle {
            half_u: x,
            half_v: y,
        };
        let plane = Plane::new(DVec3::ZERO, DVec3::Z, extent).map_err(refuse)?;
        let edge = vec![[-x, -y], [x, -y], [x, y], [-x, y]];
        Ok((vec![Shape::Plane(plane)], edge))
    }

    /// A disc, a ball or a cylinder.
    fn round(&self) -> Result<Pieces, ConfigError> {
        let radius = self.length("radius_mm", self.solid.radius_mm.unwrap_or_default())?;
        let refuse = |error: tracer::Error| self.refuse("radius_mm", &error);
        let on_circle = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / CHORDS as f64).sin_cos();
            [radius * sin, radius * cos]
        };
        match self.solid.kind {
            SolidKind::Disc => {
                let shape = Shape::annulus(0.0, 0.0, radius).map_err(refuse)?;
                Ok((vec![shape], (0..CHORDS).map(on_circle).collect()))
            }
            SolidKind::Sphere => {
                let shape = Shape::sphere(0.0, radius).map_err(refuse)?;
                let mut half: Vec<[f64; 2]> = (0..=CHORDS / 2).map(on_circle).collect();
                // Exactly on the axis at its end.
                half[CHORDS / 2][0] = 0.0;
                Ok((vec![shape], half))
            }
            _ => {
                let height = self.solid.height_mm.unwrap_or_default();
                let half = 0.5 * self.length("height_mm", height)?;
                let rows = [[0.0, half], [radius, half], [radius, -half], [0.0, -half]];
                let points = rows.map(|row| row.to_vec());
                let key = self.key("radius_mm");
                let meridian = dome::in_design(&key, &points, Ends::OnAxis, self.at)?;
                Ok((shapes::of(&meridian).map_err(refuse)?, rows.to_vec()))
            }
        }
    }

    /// A body of revolution.
    fn meridian(&self, files: &mut Vec<FileRecord>) -> Result<Pieces, ConfigError> {
        let (name, file) = ("meridian_mm", "meridian_file");
        let meridian = match (&self.solid.meridian_mm, &self.solid.meridian_file) {
            (Some(rows), None) => dome::in_design(&self.key(name), rows, Ends::OnAxis, self.at)?,
            (None, Some(path)) => {
                let key = self.key(file);
                let stated = [&*key, path];
                let meridian = dome::in_file(stated, self.folder, Ends::OnAxis, self.at)?;
                let bytes = std::fs::read(self.folder.join(path)).unwrap_or_default();
                files.push(FileRecord::new(path, &bytes));
                meridian
            }
            (None, None) => {
                let expected = "this key or `meridian_file`, for this kind";
                return Err(self.at.value(&self.key(name), "missing", expected));
            }
            (Some(_), Some(_)) => {
                let expected = "no such key beside `meridian_mm`";
                return Err(self.at.value(&self.key(file), "given", expected));
            }
        };
        let pieces = shapes::of(&meridian).map_err(|error| self.refuse(name, &error))?;
        Ok((pieces, flattened(&meridian)))
    }

    /// A mesh.
    fn mesh(&self, files: &mut Vec<FileRecord>) -> Result<Pieces, ConfigError> {
        let name = self.solid.mesh.clone().unwrap_or_default();
        let of_files = |error: anyhow::Error| ConfigError::Files {
            file: self.at.file.to_owned(),
            message: format!("{error:#}"),
        };
        let unit = self.solid.mesh_unit.as_deref();
        let (triangles, sha256) =
            dome_mesh::triangles(self.name, &name, unit, self.folder).map_err(of_files)?;
        let parts = vec![0; triangles.len()];
        let path = self.folder.join(&name);
        let mesh = Mesh::welded(&triangles, &parts).map_err(|error| {
            let key = self.key("mesh");
            of_files(anyhow::anyhow!("{key}: `{}`: {error}", path.display()))
        })?;
        files.push(FileRecord { file: name, sha256 });
        Ok((vec![Shape::mesh(mesh)], Vec::new()))
    }
}

/// Nothing lies below the bottom, and nothing farther than ten metres away.
fn above_bottom(
    form: &Form,
    solid: &Solid,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<(), ConfigError> {
    let got = format!("{:?}", solid.position_mm);
    let shape = form.shape(0.0);
    let shape = shape.map_err(|e| at.value(&key("position_mm"), &got, &e.to_string()))?;
    let Bounds { low, high } = shape.bounds();
    let size = (high - low).max_element();
    if low.z < -1e-9 * size {
        let expected = format!(
            "a place above the bottom, z = 0; it reaches down to {} mm",
            low.z
        );
        return Err(at.value(&key("position_mm"), got, &expected));
    }
    if low.abs().max(high.abs()).max_element() > 2.0 * MOST_MM {
        let expected = "a solid within 20 m of the origin";
        return Err(at.value(&key("position_mm"), got, expected));
    }
    Ok(())
}

/// Keys of other kinds are refused: they would be overlooked.
fn foreign(solid: &Solid, key: &impl Fn(&str) -> String, at: &Context) -> Result<(), ConfigError> {
    let of = |kinds: &[SolidKind]| kinds.contains(&solid.kind);
    let flat = of(&[SolidKind::Box, SolidKind::Rectangle]);
    let round = of(&[SolidKind::Cylinder, SolidKind::Sphere, SolidKind::Disc]);
    let mesh = of(&[SolidKind::Mesh]);
    let given = [
        ("size_mm", solid.size_mm.is_some(), flat, true),
        ("radius_mm", solid.radius_mm.is_some(), round, true),
        (
            "height_mm",
            solid.height_mm.is_some(),
            of(&[SolidKind::Cylinder]),
            true,
        ),
        (
            "meridian_mm",
            solid.meridian_mm.is_some(),
            of(&[SolidKind::Meridian]),
            false,
        ),
        (
            "meridian_file",
            solid.meridian_file.is_some(),
            of(&[SolidKind::Meridian]),
            false,
        ),
        ("mesh", solid.mesh.is_some(), mesh, true),
        ("mesh_unit", solid.mesh_unit.is_some(), mesh, true),
        (
            "rotation_deg",
            solid.rotation_deg.is_some(),
            flat || mesh,
            false,
        ),
        (
            "axis",
            solid.axis.is_some(),
            of(&[SolidKind::Cylinder, SolidKind::Meridian, SolidKind::Disc]),
            false,
        ),
    ];
    for (name, given, belongs, required) in given {
        if given && !belongs {
            return Err(at.value(&key(name), "given", "no such key for this kind"));
        }
        if belongs && required && !given {
            return Err(at.value(&key(name), "missing", "a value, for this kind"));
        }
    }
    Ok(())
}

fn placement(
    solid: &Solid,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<Placement, ConfigError> {
    for value in solid.position_mm {
        at.within(&key("position_mm"), value, -MOST_MM, MOST_MM)?;
    }
    let mut placement = Placement::at(DVec3::from_array(solid.position_mm));
    if let Some(axis) = solid.axis {
        let axis = direction(&key("axis"), axis, at)?;
        let along = placement.along(axis);
        placement = along.map_err(|e| at.value(&key("axis"), "a bad value", &e.to_string()))?;
    }
    if let Some(angles) = solid.rotation_deg {
        for angle in angles {
            at.within(&key("rotation_deg"), angle, -360.0, 360.0)?;
        }
        placement.rotation = turned(angles);
    }
    Ok(placement)
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
        if (value - near).abs() < 1e-15 {
            near
        } else {
            value
        }
    };
    DMat3::from_cols_array(&turn.to_cols_array().map(whole))
}

/// A direction of any length, or the complaint about it.
fn direction(key: &str, stated: [f64; 3], at: &Context) -> Result<DVec3, ConfigError> {
    let direction = DVec3::from_array(stated);
    if direction.is_finite() && direction.length() > 0.0 && direction.length().is_finite() {
        return Ok(direction.normalize());
    }
    Err(at.value(
        key,
        format!("{stated:?}"),
        "a direction, of any length above 0",
    ))
}
