// SPDX-License-Identifier: MIT OR Apache-2.0
//! The grating case as written: one field for each key, unchecked
//! (`docs/reference/grating-case.md`).

use schemars::JsonSchema;
use serde::Deserialize;

use runtime::serde_arrays::List;

/// A grating case.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CaseKeys {
    /// Vacuum wavelength, in any one unit of length; 1e-100 to 1e100.
    pub wavelength: f64,
    /// Period along x, in the same unit; 1e-100 to 1e100.
    pub period: f64,
    /// Refractive index [n, k] of the half-space from which light comes: n above 0, at most 1e6; k
    /// 0.
    pub n_top: List<f64, 2>,
    /// Refractive index [n, k] of the half-space behind: n and k not negative, not both 0, at most
    /// 1e6.
    pub n_bottom: List<f64, 2>,
    /// Layers, at most 1e9 wavelengths in all; this, `relief` or `profile`.
    pub layers_top_to_bottom: Option<Vec<LayerKeys>>,
    /// Cross-section by polygons; this, `layers_top_to_bottom` or `profile`.
    pub relief: Option<ReliefKeys>,
    /// Surface between the two half-spaces by its shape; this, `layers_top_to_bottom` or `relief`.
    pub profile: Option<ProfileKeys>,
    /// Polar angle of incidence, degrees; above -90, below 90.
    pub theta_deg: f64,
    /// Azimuth of the plane of incidence from x, degrees; -360 to 360.
    #[serde(default)]
    pub phi_deg: f64,
    /// Polarisation of the incident wave.
    pub pol: Polarization,
    /// Highest order kept, 0 to 1500: orders -N..N; this or `tolerance`.
    #[serde(rename = "N")]
    pub highest_order: Option<usize>,
    /// Largest error of an efficiency, 1e-8 to 0.1, from which orders and slices follow; this or
    /// `N`.
    pub tolerance: Option<f64>,
    /// True for the Jones matrices of all orders too.
    #[serde(default)]
    pub jones: bool,
    /// Mount, which is only checked.
    pub mount: Option<Mount>,
}

/// A layer.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerKeys {
    /// Thickness, from 0.
    pub thickness: f64,
    /// Segments that cover 0 to 1 without gap or overlap.
    pub segments: Vec<SegmentKeys>,
}

/// A stretch of a layer.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentKeys {
    /// Beginning, as a fraction of the period.
    pub x0: f64,
    /// End, as a fraction of the period.
    pub x1: f64,
    /// Refractive index [n, k].
    pub n: List<f64, 2>,
}

/// A cross-section.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReliefKeys {
    /// Depth, above 0, at most 1e9 wavelengths.
    pub depth: f64,
    /// Refractive index [n, k] around the polygons.
    pub background: List<f64, 2>,
    /// Polygons; a later one lies over an earlier one.
    pub polygons: Vec<PolygonKeys>,
}

/// A polygon.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolygonKeys {
    /// Refractive index [n, k].
    pub n: List<f64, 2>,
    /// Corners [x, z], z from 0 to the depth, at most 16 periods wide; x is wrapped at the period.
    pub points: Vec<List<f64, 2>>,
}

/// A surface.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProfileKeys {
    /// Height h of the sinusoid z = h (1 + cos 2πx/period)/2, at most 1e9 wavelengths; this or `points`.
    pub sinusoid: Option<f64>,
    /// Corners [x, z] or [x, z, turn] over one period, from left to right, the last one joined to the
    /// first of the next period; the side to the next corner is an arc that turns by so many degrees
    /// towards the bottom, less than 360; this or `sinusoid`.
    pub points: Option<Vec<Vec<f64>>>,
}

/// Polarisation of the incident wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Polarization {
    /// E normal to the plane of incidence.
    S,
    /// H normal to the plane of incidence.
    P,
    /// Half of each.
    #[serde(alias = "unpolarized")]
    Unpolarised,
}

/// Kinds of incidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mount {
    /// In the plane across the grooves.
    Classical,
    /// Any.
    Conical,
}
