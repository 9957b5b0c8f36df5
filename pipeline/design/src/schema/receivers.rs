// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[receivers]]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tracer::receiver::{Facing, Sense};

use super::is_default;
use crate::tagged::{Kinds, Tagged};
use metrics::kinds::ReceiverKind;
use runtime::serde_arrays::List;

/// `[[receivers]]`.
pub type Receiver = Tagged<ReceiverKeys, ReceiverForm>;

/// Keys of all receivers.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReceiverKeys {
    /// Name of its files: as `name` of the design; none twice, whatever the case.
    pub name: String,
    /// Filter of the light, as below; default all light.
    pub only: Option<Only>,
}

/// Kinds of receiver with their keys.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReceiverForm {
    /// Irradiance on a rectangle.
    Plane(PlaneReceiver),
    /// Intensity over θ and φ, bins between multiples of their widths.
    FarField(AngularReceiver),
    /// Intensity on C-γ planes, bins about them (C is φ, γ is θ from +z).
    CGamma(AngularReceiver),
    /// Radiance on a rectangle by place and direction.
    Luminance(LuminanceReceiver),
    /// Flux on the surfaces of one name.
    Surface(SurfaceReceiver),
}

impl Kinds for ReceiverForm {
    const TAG: &'static str = "kind";
}

/// Keys of a plane.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneReceiver {
    /// Middle (x, y, z), mm; above the bottom, through no package and no wall.
    pub position_mm: List<f64, 3>,
    /// Lengths along u and v, mm: (x, y), (y, z) or (x, z), by the normal.
    pub size_mm: List<f64, 2>,
    /// Bins along u and v.
    pub bins: List<usize, 2>,
    /// Direction in which passing light counts; default `"+z"`.
    pub normal: Option<Normal>,
    /// Diameter of the spots over which nine and thirteen points are averaged, mm: at most a third
    /// of the rectangle and 100 bins. Default: points of the map.
    pub spot_mm: Option<f64>,
    /// True: Stokes parameters I, Q, U and V; needs `light.polarization = "carried"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stokes: bool,
}

/// Keys of a far field and of C-γ planes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngularReceiver {
    /// Bin of the polar angle, degrees: divides 180 (luminance: `theta_max_deg`, to the normal).
    pub theta_bin_deg: f64,
    /// Bin of the azimuth, degrees: divides 360; of luminance from u to v.
    pub phi_bin_deg: f64,
    /// True: Stokes parameters I, Q, U and V; needs `light.polarization = "carried"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stokes: bool,
}

/// Keys of a receiver of radiance.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LuminanceReceiver {
    /// Middle (x, y, z), mm; above the bottom, through no package and no wall.
    pub position_mm: List<f64, 3>,
    /// Lengths along u and v, mm: (x, y), (y, z) or (x, z), by the normal.
    pub size_mm: List<f64, 2>,
    /// Bins along u and v.
    pub bins: List<usize, 2>,
    /// Direction in which passing light counts; default `"+z"`.
    pub normal: Option<Normal>,
    /// Diameter of the spots over which nine and thirteen points are averaged, mm: at most a third
    /// of the rectangle and 100 bins. Default: points of the map.
    pub spot_mm: Option<f64>,
    /// Bin of the polar angle, degrees: divides 180 (luminance: `theta_max_deg`, to the normal).
    pub theta_bin_deg: f64,
    /// Largest polar angle that is read, to the normal, degrees; at most 90. Default 90.0.
    pub theta_max_deg: Option<f64>,
    /// Bin of the azimuth, degrees: divides 360; of luminance from u to v.
    pub phi_bin_deg: f64,
    /// Viewing direction [angle to the normal, azimuth from u to v], degrees, about which
    /// `theta_bin_deg`, `theta_max_deg` and `phi_bin_deg` count then; with `theta_max_deg` up to 90.
    /// Default the normal.
    pub view_deg: Option<List<f64, 2>>,
    /// True: Stokes parameters I, Q, U and V; needs `light.polarization = "carried"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stokes: bool,
}

/// Keys of a receiver on surfaces.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceReceiver {
    /// Name in the ledger, without `absorbed_by_` (`ground_mirror`).
    pub surface: String,
}

/// A rectangle as written.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StatedRectangle {
    /// Middle, mm.
    pub position_mm: [f64; 3],
    /// Lengths along u and v, mm.
    pub size_mm: [f64; 2],
    /// Bins along u and v.
    pub bins: [usize; 2],
    /// The direction in which light passes.
    pub normal: Normal,
    /// Diameter of spots, mm.
    pub spot_mm: Option<f64>,
}

impl ReceiverForm {
    /// The kind by itself.
    pub fn kind(&self) -> ReceiverKind {
        match self {
            Self::Plane(_) => ReceiverKind::Plane,
            Self::FarField(_) => ReceiverKind::FarField,
            Self::CGamma(_) => ReceiverKind::CGamma,
            Self::Luminance(_) => ReceiverKind::Luminance,
            Self::Surface(_) => ReceiverKind::Surface,
        }
    }

    /// The rectangle of a plane and of a receiver of radiance.
    pub fn rectangle(&self) -> Option<StatedRectangle> {
        match self {
            Self::Plane(plane) => Some(StatedRectangle {
                position_mm: plane.position_mm.0,
                size_mm: plane.size_mm.0,
                bins: plane.bins.0,
                normal: plane.normal.unwrap_or_default(),
                spot_mm: plane.spot_mm,
            }),
            Self::Luminance(luminance) => Some(StatedRectangle {
                position_mm: luminance.position_mm.0,
                size_mm: luminance.size_mm.0,
                bins: luminance.bins.0,
                normal: luminance.normal.unwrap_or_default(),
                spot_mm: luminance.spot_mm,
            }),
            Self::FarField(_) | Self::CGamma(_) | Self::Surface(_) => None,
        }
    }

    /// True of luminance by the angle to the normal.
    pub fn is_by_angle(&self) -> bool {
        matches!(self, Self::Luminance(luminance) if luminance.view_deg.is_none())
    }

    /// True if it reads the Stokes parameters.
    pub fn stokes(&self) -> bool {
        match self {
            Self::Plane(plane) => plane.stokes,
            Self::FarField(angular) | Self::CGamma(angular) => angular.stokes,
            Self::Luminance(luminance) => luminance.stokes,
            Self::Surface(_) => false,
        }
    }
}

/// Directions along the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
pub enum Normal {
    /// Upwards.
    #[default]
    #[serde(rename = "+z")]
    Up,
    /// Downwards.
    #[serde(rename = "-z")]
    Down,
    /// Along x.
    #[serde(rename = "+x")]
    AlongX,
    /// Against x.
    #[serde(rename = "-x")]
    AgainstX,
    /// Along y.
    #[serde(rename = "+y")]
    AlongY,
    /// Against y.
    #[serde(rename = "-y")]
    AgainstY,
}

impl Normal {
    pub(crate) fn facing(self) -> Facing {
        match self {
            Self::Up => Facing::Z(Sense::Plus),
            Self::Down => Facing::Z(Sense::Minus),
            Self::AlongX => Facing::X(Sense::Plus),
            Self::AgainstX => Facing::X(Sense::Minus),
            Self::AlongY => Facing::Y(Sense::Plus),
            Self::AgainstY => Facing::Y(Sense::Minus),
        }
    }

    /// Names of u and v.
    pub fn axes(self) -> [&'static str; 2] {
        match self {
            Self::Up | Self::Down => ["x", "y"],
            Self::AlongX | Self::AgainstX => ["y", "z"],
            Self::AlongY | Self::AgainstY => ["x", "z"],
        }
    }
}

/// `[receivers.only]`: all of what is given must hold.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Only {
    /// Name in the ledger of the last surface met, as of `surface`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_surface: Option<String>,
    /// First and last element within whose radii the last surface was met, on every package.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_elements: Option<List<usize, 2>>,
    /// Least number of surfaces met: 0 for light straight from the LED.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_bounces: Option<u32>,
    /// Largest number of surfaces met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_bounces: Option<u32>,
    /// Packages from which the light comes, from 1, row by row from the lowest x and y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packages: Option<Vec<usize>>,
    /// Names of `[[sources]]` from which the light comes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sources: Option<Vec<String>>,
}
