// SPDX-License-Identifier: MIT OR Apache-2.0
//! The form of a solid or a sheet, and where it stands.

use std::f64::consts::TAU;

use tracer::Shape;
use tracer::glam::{DMat3, DVec2, DVec3};
use tracer::shape::{Bounds, Closing, Foot, Placement};

use formats::mesh::BOX_FACES;
use geometry::Meridian;
use geometry::tessellation::Deviation;
use metrics::illuminance::Symmetry;

use super::footprint::{Footprint, TurnedRectangle};
use crate::schema::solids::{Flat, SolidForm};
use runtime::serde_arrays::List;

/// Chords of circles in sections.
pub(crate) const CHORDS: usize = 96;

/// Largest distance from the bottom of what stands on it, as a share of its size: twice what bounds
/// of the tracer's shapes are padded by.
pub(crate) const LEVEL: f64 = 2e-9;
/// Largest deviation of an upright axis, 1 less its cosine.
const UPRIGHT: f64 = 1e-18;

/// A form in its own coordinates, and its place.
#[derive(Debug, Clone)]
pub struct Form {
    /// Pieces that join.
    pub pieces: Vec<Shape>,
    /// True if they enclose something.
    pub closing: Closing,
    /// Place, in its package or in the array.
    pub placement: Placement,
    /// Generating curve (r, z), arcs by chords, or the right half of a box's section; of a
    /// sheet its edge (x, y).
    pub(crate) outline: Vec<[f64; 2]>,
    /// Generating curve of a body of revolution by its meridian, exactly.
    pub meridian: Option<Meridian>,
    /// What triangles are off a surface that is not round.
    pub deviation: Option<Deviation>,
}

impl Form {
    /// The shape at its place, its outer faces drawn in by `inset_mm`.
    ///
    /// # Errors
    /// A form thinner than that.
    pub fn shape(&self, inset_mm: f64) -> Result<Shape, tracer::Error> {
        self.inset(inset_mm, Foot::Raised)
    }

    /// The same, but for its foot, which is sunk by `inset_mm` below the bottom.
    ///
    /// # Errors
    /// A form thinner than that; one that leans.
    pub fn shape_in_contact(&self, inset_mm: f64) -> Result<Shape, tracer::Error> {
        self.inset(inset_mm, Foot::Sunk)
    }

    fn inset(&self, inset_mm: f64, foot: Foot) -> Result<Shape, tracer::Error> {
        let placement = Placement { inset: inset_mm, foot, ..self.placement };
        Shape::placed(self.pieces.clone(), self.closing, &placement)
    }

    /// True of a level sheet on the bottom.
    pub fn is_on_bottom(&self) -> bool {
        let bounds = self.shape(0.0).map(|shape| shape.bounds());
        self.closing == Closing::Open
            && bounds.is_ok_and(|Bounds { low, high }| {
                low.z.abs().max(high.z) <= LEVEL * (high - low).max_element()
            })
    }

    /// The same form, higher by `lift_mm`.
    #[must_use]
    pub fn lifted(&self, lift_mm: f64) -> Self {
        let mut lifted = self.clone();
        lifted.placement.origin.z += lift_mm;
        lifted
    }

    /// The same form in a package that is turned about its axis.
    #[must_use]
    pub fn turned(&self, degrees: f64) -> Self {
        let mut turned = self.clone();
        if degrees != 0.0 {
            let rotation = DMat3::from_rotation_z(degrees.to_radians());
            let Placement { rotation: own, origin, .. } = self.placement;
            turned.placement.rotation = rotation * own;
            turned.placement.origin = rotation * origin;
        }
        turned
    }

    /// The flat face with which it stands on the bottom: that of a box with one axis upright, or of
    /// an upright body of revolution. `None` for all others, and for what ends above the bottom.
    pub fn footprint(&self) -> Option<Footprint> {
        let Bounds { low, high } = self.shape(0.0).ok()?.bounds();
        if self.closing == Closing::Open || low.z.abs() > LEVEL * (high - low).max_element() {
            return None;
        }
        let Placement { rotation, origin, .. } = self.placement;
        let upright = (0..3).find(|axis| 1.0 - rotation.col(*axis).z.abs() < UPRIGHT)?;
        let centre = origin.truncate();
        match &self.pieces[..] {
            [Shape::Mesh(_)] => None,
            [Shape::Cuboid(_)] => {
                let half = self.shape_at_home()?.size() * 0.5;
                let [u, v] = [(upright + 1) % 3, (upright + 2) % 3];
                let along = rotation.col(u).truncate();
                Some(Footprint::Rectangle(TurnedRectangle {
                    centre,
                    along,
                    half: DVec2::new(half[u], half[v]),
                }))
            }
            _ if upright == 2 => {
                let points = self.outline.windows(2);
                let foot = -origin.z * rotation.z_axis.z.signum();
                let near = |z: f64| (z - foot).abs() <= LEVEL * (high - low).max_element();
                let rings = points.filter(|ends| ends.iter().all(|[_, z]| near(*z)));
                let rings: Vec<[f64; 2]> = rings
                    .map(|ends| [ends[0][0].min(ends[1][0]), ends[0][0].max(ends[1][0])])
                    .filter(|[inner, outer]| outer > inner)
                    .collect();
                (!rings.is_empty()).then_some(Footprint::Rings { centre, rings })
            }
            _ => None,
        }
    }

    /// The box itself, of a box whose faces lie along the axes.
    pub fn upright_box(&self) -> Option<Bounds> {
        let along = |axis: usize| self.placement.rotation.col(axis).abs().max_element();
        let is_box = matches!(&self.pieces[..], [Shape::Cuboid(_)]);
        let is_along = (0..3).all(|axis| along(axis) > 1.0 - 1e-12);
        (is_box && is_along).then(|| Some(self.shape(0.0).ok()?.bounds())).flatten()
    }

    /// The box around its pieces in their own coordinates.
    pub(crate) fn shape_at_home(&self) -> Option<Bounds> {
        let home = Shape::placed(self.pieces.clone(), self.closing, &Placement::at(DVec3::ZERO));
        Some(home.ok()?.bounds())
    }

    /// Symmetry about the z axis of its package or of the array, as far as it is plain.
    pub(crate) fn symmetry(&self, solid: &SolidForm) -> Symmetry {
        let at = self.placement.origin;
        let axis = self.placement.rotation.z_axis;
        let centred = at.x == 0.0 && at.y == 0.0;
        let upright = axis.x == 0.0 && axis.y == 0.0;
        let flat = |[x, y]: [f64; 2], rotation_deg: Option<List<f64, 3>>| {
            let turned = rotation_deg.is_some_and(|List(angles)| angles.iter().any(|a| *a != 0.0));
            match (turned, x.to_bits() == y.to_bits()) {
                (true, _) => Symmetry::None,
                (false, true) => Symmetry::Square,
                (false, false) => Symmetry::Rectangle,
            }
        };
        match solid {
            _ if !centred => Symmetry::None,
            SolidForm::Sphere(_) => Symmetry::Square,
            SolidForm::Meridian(oval) if upright && self.meridian.is_none() => {
                flat([1.0, 2.0], oval.rotation_deg)
            }
            SolidForm::Cylinder(_) | SolidForm::Meridian(_) | SolidForm::Disc(_) if upright => {
                Symmetry::Square
            }
            SolidForm::Box(Flat { size_mm: List([x, y, _]), rotation_deg }) => {
                flat([*x, *y], *rotation_deg)
            }
            SolidForm::Rectangle(Flat { size_mm, rotation_deg }) => flat(size_mm.0, *rotation_deg),
            _ => Symmetry::None,
        }
    }

    /// Where the plane y = 0 cuts it as it stands: lines of points (x, z) in mm, and whether each
    /// closes.
    pub fn section(&self) -> Vec<(Vec<[f64; 2]>, bool)> {
        let Placement { rotation, origin, .. } = self.placement;
        let placed = |at: DVec3| {
            let at = origin + rotation * at;
            [at.x, at.z]
        };
        let upright = rotation == DMat3::IDENTITY;
        if upright && origin.y == 0.0 && self.closing == Closing::Closed && !self.outline.is_empty()
        {
            let right = self.outline.iter().copied();
            let left = self.outline.iter().rev().map(|[r, z]| [-r, *z]);
            let around = right.chain(left).map(|[r, z]| placed(DVec3::new(r, 0.0, z)));
            return vec![(around.collect(), true)];
        }
        // The plane in the coordinates of the form.
        let back = rotation.transpose();
        let (point, normal) = (back * (DVec3::Y * -origin.y), back * DVec3::Y);
        if let [Shape::Mesh(mesh)] = &self.pieces[..] {
            let lines = mesh.section(point, normal).into_iter();
            return lines.map(|line| (line.into_iter().map(placed).collect(), true)).collect();
        }
        let height = |at: DVec3| normal.dot(at - point);
        let cut = |[a, b]: [DVec3; 2]| {
            let (low, high) = (height(a), height(b));
            ((low >= 0.0) != (high >= 0.0)).then(|| a + (b - a) * (low / (low - high)))
        };
        let flats: Vec<Vec<DVec3>> = if self.closing == Closing::Closed {
            self.triangles().iter().map(|t| t.to_vec()).collect()
        } else {
            let to_3d = |[x, y]: &[f64; 2]| DVec3::new(*x, *y, 0.0);
            vec![self.outline.iter().map(to_3d).collect()]
        };
        let stretch = |flat: &Vec<DVec3>| {
            let sides = (0..flat.len()).map(|k| [flat[k], flat[(k + 1) % flat.len()]]);
            let ends: Vec<[f64; 2]> = sides.filter_map(cut).map(placed).collect();
            (ends.len() == 2).then_some((ends, false))
        };
        flats.iter().filter_map(stretch).collect()
    }

    /// Flat triangles that follow the surface of a solid, for pictures.
    fn triangles(&self) -> Vec<[DVec3; 3]> {
        if let [Shape::Cuboid(_)] = &self.pieces[..] {
            return box_triangles(self.pieces[0].bounds());
        }
        let turned = |[r, z]: [f64; 2], k: usize| {
            // Corners of neighbours are equal to the last bit.
            let k = k % CHORDS;
            let (sin, cos) = (TAU * k as f64 / CHORDS as f64).sin_cos();
            if r > 0.0 { DVec3::new(r * cos, r * sin, z) } else { DVec3::new(0.0, 0.0, z) }
        };
        let mut triangles = Vec::new();
        for pair in self.outline.windows(2) {
            for k in 0..CHORDS {
                let [a, b] = [pair[0], pair[1]];
                let (a0, a1) = (turned(a, k), turned(a, k + 1));
                let (b0, b1) = (turned(b, k), turned(b, k + 1));
                if a[0] > 0.0 {
                    triangles.push([a0, b0, a1]);
                }
                if b[0] > 0.0 {
                    triangles.push([a1, b0, b1]);
                }
            }
        }
        triangles
    }
}

fn box_triangles(bounds: Bounds) -> Vec<[DVec3; 3]> {
    let corners = bounds.corners();
    let corner = |k: usize| corners[k];
    BOX_FACES
        .iter()
        .flat_map(|[a, b, c, d]| {
            let [a, b, c, d] = [*a, *b, *c, *d].map(corner);
            [[a, b, c], [a, c, d]]
        })
        .collect()
}
