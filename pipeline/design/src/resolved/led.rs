// SPDX-License-Identifier: MIT OR Apache-2.0
//! The box of the LED, and where it stands in its package.
//!
//! The box is rotated about x, then about y, about the centre of its foot, and lifted until its
//! lowest corner lies on the bottom, z = 0. Its sides go on along its own axis down to the bottom:
//! what joins a tilted chip to its substrate fills the gap below it and reflects as the sides do.

use serde::Serialize;
use tracer::glam::{DMat3, DVec3};
use tracer::shape::Mesh;
use tracer::{Shape, Source};

use formats::mesh::BOX_FACES;

use super::reflector::Reflector;
use crate::schema::is_default;

/// The light source box.
#[derive(Debug, Clone, Serialize)]
pub struct Led {
    /// Width along x and y, mm.
    pub size_mm: [f64; 2],
    /// Height of the top face, mm.
    pub height_mm: f64,
    /// Law of reflection of the box.
    #[serde(flatten)]
    pub reflector: Reflector,
    /// Law of its upright faces, where they are not as the top.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sides: Option<Reflector>,
    /// From the axis of the package to the centre of the foot, mm.
    #[serde(skip_serializing_if = "is_default")]
    pub offset_mm: [f64; 2],
    /// Rotation about x, then about y, degrees.
    #[serde(skip_serializing_if = "is_default")]
    pub tilt_deg: [f64; 2],
    /// Offset added in each package, in the order of the array, mm; empty for
    /// nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub offsets_mm: Vec<[f64; 2]>,
    /// Tilt added in each package, likewise, degrees.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tilts_deg: Vec<[f64; 2]>,
}

/// Place of a box in its package.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BoxPlace {
    /// From the axis of the package to the centre of the foot, mm.
    pub offset_mm: [f64; 2],
    /// Rotation about x, then about y, degrees.
    pub tilt_deg: [f64; 2],
}

impl BoxPlace {
    /// True if the centre of the foot lies on the axis of the package.
    pub fn is_on_axis(&self) -> bool {
        is_default(&self.offset_mm)
    }

    /// True if it is not tilted.
    pub fn is_level(&self) -> bool {
        is_default(&self.tilt_deg)
    }
}

impl Led {
    /// True if every box stands level about the axis of its package.
    pub fn is_centred(&self) -> bool {
        self.stated_places().all(|place| place == BoxPlace::default())
    }

    /// Places of the boxes as far as they are stated one by one; one of boxes that stand alike.
    pub fn stated_places(&self) -> impl Iterator<Item = BoxPlace> {
        let rows = self.offsets_mm.len().max(self.tilts_deg.len()).max(1);
        (0..rows).map(|package| self.place(package))
    }

    /// Place of the box of a package.
    pub fn place(&self, package: usize) -> BoxPlace {
        let sum = |common: [f64; 2], own: &[[f64; 2]]| {
            let own = own.get(package).copied().unwrap_or_default();
            [0, 1].map(|k| common[k] + own[k])
        };
        BoxPlace {
            offset_mm: sum(self.offset_mm, &self.offsets_mm),
            tilt_deg: sum(self.tilt_deg, &self.tilts_deg),
        }
    }

    /// The box at `place`.
    pub fn at(&self, place: BoxPlace) -> PlacedBox {
        let [x, y] = place.tilt_deg.map(f64::to_radians);
        let rotation = DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
        let half = DVec3::new(0.5 * self.size_mm[0], 0.5 * self.size_mm[1], 0.0);
        let level = place.is_level();
        let drop = (rotation * DVec3::X).z.abs() * half.x + (rotation * DVec3::Y).z.abs() * half.y;
        let [offset_x, offset_y] = place.offset_mm;
        PlacedBox {
            half,
            height_mm: self.height_mm,
            foot: DVec3::new(offset_x, offset_y, if level { 0.0 } else { drop }),
            rotation: if level { DMat3::IDENTITY } else { rotation },
        }
    }
}

/// A box where it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedBox {
    /// Half lengths along its own x and y, mm; no height.
    half: DVec3,
    height_mm: f64,
    /// Centre of its foot, mm.
    foot: DVec3,
    rotation: DMat3,
}

impl PlacedBox {
    /// A point of the box that stands level about the axis, where it is now, mm.
    pub fn carried(&self, point_mm: DVec3) -> DVec3 {
        self.foot + self.rotation * point_mm
    }

    /// Corners, mm, the lower ones on the plane z = `bottom_mm`; the bits of their numbers say
    /// low or high along its own x, y and z.
    pub fn corners(&self, bottom_mm: f64) -> [DVec3; 8] {
        let axis = self.rotation.z_axis;
        std::array::from_fn(|k| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let level = DVec3::new(sign(0) * self.half.x, sign(1) * self.half.y, 0.0);
            if k >> 2 == 1 {
                return self.carried(level + DVec3::Z * self.height_mm);
            }
            let foot = self.carried(level);
            foot - axis * ((foot.z - bottom_mm) / axis.z)
        })
    }

    /// The highest z, mm.
    pub fn top_mm(&self) -> f64 {
        let heights = self.corners(0.0).map(|corner| corner.z);
        heights.into_iter().fold(0.0, f64::max)
    }

    /// Surface from z = `bottom_mm` up, in three patches: sides, top, bottom.
    ///
    /// # Errors
    /// Lengths that the tracer refuses.
    pub fn shape(&self, bottom_mm: f64) -> Result<Shape, tracer::Error> {
        let corners = self.corners(bottom_mm);
        if self.rotation == DMat3::IDENTITY {
            return Shape::cuboid(corners[0], corners[7]);
        }
        let triangles: Vec<[u32; 3]> = BOX_FACES
            .iter()
            .map(|face| face.map(|corner| corner as u32))
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        // The first two faces are low and high along z.
        let patches: Vec<u32> = [2, 2, 1, 1].into_iter().chain([0; 8]).collect();
        Ok(Shape::mesh(Mesh::new(&corners, &triangles, &patches)?))
    }

    /// A source on the box that stands level about the axis, where it is now.
    pub fn carry(&self, source: Source) -> Source {
        let position = self.carried(source.position);
        if self.rotation == DMat3::IDENTITY {
            return Source { position, ..source };
        }
        Source { position, ..source.turned(&self.rotation) }
    }
}
