// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reflecting surfaces of a checked design.

use serde::Serialize;
use tracer::{Mixed, SurfaceModel};

/// A law of reflection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Reflector {
    /// Mirror.
    Specular {
        /// Reflectance; of metal, the share of what it reflects that is kept.
        reflectance: f64,
    },
    /// Cosine law.
    Lambertian {
        /// Reflectance.
        reflectance: f64,
    },
    /// Not at all.
    Absorbing,
    /// Of walls: light goes on from the opposite one.
    Periodic,
    /// Partly as a mirror, partly by the cosine law.
    Mixed {
        /// Reflectance of both parts together.
        reflectance: f64,
        /// Share of what is reflected that goes on as from a mirror.
        specular_fraction: f64,
    },
}

impl Reflector {
    /// Optical surface.
    pub fn optics(self) -> SurfaceModel {
        match self {
            Self::Specular { reflectance } => SurfaceModel::Mirror { reflectance },
            Self::Lambertian { reflectance } => SurfaceModel::Lambertian { reflectance },
            Self::Absorbing => SurfaceModel::Absorber,
            Self::Periodic => SurfaceModel::Periodic,
            Self::Mixed { reflectance, specular_fraction } => {
                SurfaceModel::Mixed(Mixed { reflectance, specular: specular_fraction })
            }
        }
    }

    /// Reflectance as stated.
    pub fn reflectance(self) -> f64 {
        match self {
            Self::Specular { reflectance }
            | Self::Lambertian { reflectance }
            | Self::Mixed { reflectance, .. } => reflectance,
            Self::Absorbing | Self::Periodic => 0.0,
        }
    }
}
