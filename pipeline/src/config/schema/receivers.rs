// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[receivers]]` as written.

use serde::{Deserialize, Serialize};
use tracer::receiver::{Facing, Sense};

use super::is_default;

/// `[[receivers]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Receiver {
    /// Names its files.
    pub name: String,
    /// What it looks at.
    pub kind: ReceiverKind,
    /// Plane, luminance: middle of the rectangle, mm.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub position_mm: Option<[f64; 3]>,
    /// Plane, luminance: lengths along u and v, mm.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub size_mm: Option<[f64; 2]>,
    /// Plane, luminance: bins along u and v.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub bins: Option<[usize; 2]>,
    /// Plane, luminance: the direction in which light passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<Normal>,
    /// Far field, luminance: bin of the polar angle, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub theta_bin_deg: Option<f64>,
    /// Far field, luminance: bin of the azimuth, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phi_bin_deg: Option<f64>,
    /// Surface: its name in the ledger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
    /// Whether it reads I, Q, U and V.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stokes: bool,
    /// Which light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub only: Option<Only>,
}

/// Kinds of receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ReceiverKind {
    /// Irradiance on a rectangle.
    Plane,
    /// Intensity over polar angle and azimuth, bins between multiples of their widths.
    FarField,
    /// Intensity on C-γ planes, bins about them.
    CGamma,
    /// Radiance on a rectangle by place and direction.
    Luminance,
    /// Flux on surfaces.
    Surface,
}

/// Directions along the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
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
    pub(in crate::config) fn facing(self) -> Facing {
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
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Only {
    /// Name in the ledger of the surface met last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_surface: Option<String>,
    /// First and last element, from 1, within whose radii the last surface was met.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        skip_serializing_if = "Option::is_none"
    )]
    pub last_elements: Option<[usize; 2]>,
    /// Least number of surfaces met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_bounces: Option<u32>,
    /// Largest number of surfaces met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_bounces: Option<u32>,
    /// Packages from which the light comes, from 1, row by row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packages: Option<Vec<usize>>,
    /// Names of the sources from which the light comes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sources: Option<Vec<String>>,
}
