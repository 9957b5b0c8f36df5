// SPDX-License-Identifier: MIT OR Apache-2.0
//! `package.json` of a model: what was simulated, drawn and traced by a few paths, for pictures.
//!
//! The layout is written out in `docs/reference/results-schema.md`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ray_paths::{PathEnd, TracedPath};

/// File in the folder of a model.
pub const FILE: &str = "package.json";

/// Name under which [`PackageFile::simulated`] says how the map of the plane is averaged and smoothed.
pub const MAP: &str = "map";

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PackageFile {
    /// The design in words: pairs of name and words.
    pub simulated: Vec<(String, String)>,
    /// Lines of the package nearest to the middle of the array, in mm from its axis, which lies at
    /// `at_mm`.
    pub drawing: PackageDrawing,
    /// 120 paths in the plane y = 0, as `batwing rays` lists them.
    pub section_paths: Vec<TracedPath>,
    /// Paths in three dimensions.
    pub paths_3d: Paths3d,
}

/// The package nearest to the middle of the array, with its axis at the origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PackageDrawing {
    /// The dome: lines in the plane y = 0 that close, (x, z) in mm.
    pub dome_mm: Vec<Vec<[f64; 2]>>,
    /// Refractive index of the dome; none of a bare package.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dome_index: Option<f64>,
    /// Right half of its generating curve by rings, (r, z) in mm; empty for a mesh or an oval
    /// dome.
    pub rings: Vec<RingOutline>,
    /// Largest distance of the package from its axis, mm.
    pub radius_mm: f64,
    /// Width, depth and height of the LED's box, mm.
    pub led_mm: [f64; 3],
    /// Corners of a box that stands off the axis, is tilted or turns with its package, mm; the bits
    /// of their numbers say low or high along its x, y and z. Empty for other boxes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub led_corners_mm: Vec<[f64; 3]>,
    /// From the axes of all packages to the centres of the feet of their boxes, mm; empty where
    /// all of them are on the axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub led_offsets_mm: Vec<[f64; 2]>,
    /// Turns of all packages about their axes, degrees; empty where none is turned.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub turns_deg: Vec<f64>,
    /// Sizes of all packages over that of this one; empty where all are alike.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scales: Vec<f64>,
    /// Half the width of the mirror under the package, as far as half the pitch, mm.
    pub mirror_half_mm: f64,
    /// Height of the receiver plane, mm.
    pub plane_mm: f64,
    /// Distance of the nearest package beside this one along x, in the plane y = 0, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch_mm: Option<f64>,
    /// Axes of all packages on the map, mm.
    pub axes_mm: Vec<[f64; 2]>,
    /// Axis of this package on the map, mm.
    #[serde(default)]
    pub at_mm: [f64; 2],
    /// Other solids and sheets, and the walls of the housing.
    pub solids: Vec<SolidDrawing>,
}

impl PackageDrawing {
    /// Largest distance from the axis along x, and largest height, of package, LED and those solids
    /// that `counts`, as far as the plane y = 0 cuts them, mm.
    pub fn reach_mm(&self, counts: impl Fn(&SolidDrawing) -> bool) -> [f64; 2] {
        let solids = self.solids.iter().filter(|solid| counts(solid));
        let solids = solids.flat_map(|solid| solid.lines_mm.iter().flat_map(|(line, _)| line));
        let led = self.led_corners().map(|[x, _, z]| [x, z]);
        let points = led.iter().chain(self.dome_mm.iter().flatten()).chain(solids);
        points.fold([self.radius_mm, 0.0], |[reach, top], [x, z]| [reach.max(x.abs()), top.max(*z)])
    }

    /// Axes of the other packages within `reach_mm`, from the axis of this one, mm.
    pub fn neighbours(&self, reach_mm: f64) -> impl Iterator<Item = [f64; 2]> {
        let from_own = self.axes_mm.iter().map(|at| [0, 1].map(|k| at[k] - self.at_mm[k]));
        from_own.filter(move |[x, y]| (1e-9..=reach_mm).contains(&x.hypot(*y)))
    }

    /// Half the width of the largest package, mm.
    pub fn largest_radius_mm(&self) -> f64 {
        self.scales.iter().copied().fold(1.0, f64::max) * self.radius_mm
    }

    /// Turn of the package `at` mm from the axis of this one, degrees, and its size over that of this
    /// one.
    pub fn turn_and_scale(&self, at: [f64; 2]) -> [f64; 2] {
        let is_there =
            |axis: &[f64; 2]| (0..2).all(|k| (axis[k] - self.at_mm[k] - at[k]).abs() < 1e-9);
        let package = self.axes_mm.iter().position(is_there);
        let of = |all: &[f64]| package.and_then(|package| all.get(package)).copied();
        [of(&self.turns_deg).unwrap_or_default(), of(&self.scales).unwrap_or(1.0)]
    }

    /// Corners of the LED's box, mm, numbered as [`Self::led_corners_mm`].
    pub fn led_corners(&self) -> [[f64; 3]; 8] {
        if let Ok(corners) = <[[f64; 3]; 8]>::try_from(&self.led_corners_mm[..]) {
            return corners;
        }
        let [width, depth, height] = self.led_mm;
        std::array::from_fn(|k| {
            let half =
                |bit: usize, length: f64| if k >> bit & 1 == 1 { 0.5 } else { -0.5 } * length;
            [half(0, width), half(1, depth), if k >> 2 == 1 { height } else { 0.0 }]
        })
    }
}

/// A ring of the dome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RingOutline {
    /// Name.
    pub name: String,
    /// Part of the generating curve, (r, z) in mm.
    pub points_mm: Vec<[f64; 2]>,
}

/// A solid or sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SolidDrawing {
    /// Name.
    pub name: String,
    /// Refractive index of what light enters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<f64>,
    /// True if light enters it or passes through it.
    pub entered: bool,
    /// True if every package carries it.
    #[serde(default)]
    pub each: bool,
    /// Low and high corner of the box about it, mm.
    pub bounds_mm: [[f64; 3]; 2],
    /// Lines (x, z) along which the plane y = 0 cuts it, mm; true for those that close.
    pub lines_mm: Vec<(Vec<[f64; 2]>, bool)>,
}

/// Paths from one package among all others, and what leaves where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Paths3d {
    /// Paths traced, of equal power.
    pub traced: u64,
    /// Names of the dome's rings, from the axis outwards; a dome without relief has twelve of equal
    /// width.
    pub rings: Vec<String>,
    /// Names of surfaces.
    pub faces: Vec<String>,
    /// The first 1500 of them: `fate`, `points_mm`, `leaves_along`, last `ring` and surface
    /// (`face`).
    pub paths: Vec<Path3d>,
    /// Width of the polar angles counted, degrees.
    pub bin_deg: f64,
    /// Escaped paths by polar angle and by the ring through which they left the dome last; the last
    /// number of each row counts those that left through none.
    pub by_ring: Vec<Vec<u32>>,
    /// Escaped paths by polar angle and by the surface met last; the last number of each row counts
    /// those that met none.
    pub by_face: Vec<Vec<u32>>,
}

/// A path in three dimensions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Path3d {
    /// Fate.
    pub fate: PathEnd,
    /// Ring through which it left the dome last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ring: Option<usize>,
    /// Surface met last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<usize>,
    /// Points at which it begins, bends and ends, or meets another package, mm.
    pub points_mm: Vec<[f64; 3]>,
    /// Direction of the last flight of a path that escaped or was given up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaves_along: Option<[f64; 3]>,
}
