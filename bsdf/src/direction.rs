// SPDX-License-Identifier: MIT OR Apache-2.0
//! Directions in the local frame of a surface, and their tangential wavevectors.
//!
//! The local frame is x = t, y = b, z = n (right-handed). Light that travels along the unit vector
//! d in a medium of index n has the tangential wavevector (kx, ky) = n (d·t, d·b), in units of the
//! vacuum wavenumber. A surface periodic along t keeps ky and changes kx in steps of
//! wavelength/period [Petit 1980], so the tables of this crate are functions of wavevectors, not of
//! angles. Both `wi` (towards the light's origin) and `wo` (towards its destination) point away
//! from the surface.
//!
//! \[Petit 1980\] R. Petit (ed.), *Electromagnetic Theory of Gratings*, Springer, chapter 1.

use glam::DVec3;

/// Side of a surface.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The side of the negative normal, z < 0 in the local frame: silicone on a dome.
    Inner,
    /// The side of the positive normal, z > 0 in the local frame: air on a dome.
    Outer,
}

impl Side {
    /// Both sides, inner first: the order in which arrays store them.
    pub const BOTH: [Self; 2] = [Self::Inner, Self::Outer];

    /// The side into which a direction away from the surface points; a tangent counts as outer.
    pub fn from_direction(local: DVec3) -> Self {
        if local.z < 0.0 { Self::Inner } else { Self::Outer }
    }

    /// The other side.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Inner => Self::Outer,
            Self::Outer => Self::Inner,
        }
    }

    /// Sign of z on this side: -1 inner, +1 outer.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Inner => -1.0,
            Self::Outer => 1.0,
        }
    }

    /// Index into arrays with one value a side: 0 inner, 1 outer.
    pub const fn index(self) -> usize {
        match self {
            Self::Inner => 0,
            Self::Outer => 1,
        }
    }
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Inner => "inner",
            Self::Outer => "outer",
        })
    }
}

/// Tangential wavevector of travelling light, in units of the vacuum wavenumber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavevector {
    /// Component along t (across the grooves).
    pub kx: f64,
    /// Component along b (along the grooves); a relief that varies along t alone conserves it.
    pub ky: f64,
}

impl Wavevector {
    /// Wavevector of light from `wi` (unit, local) in a medium of refractive index `index`.
    pub fn incoming(wi: DVec3, index: f64) -> Self {
        Self { kx: -index * wi.x, ky: -index * wi.y }
    }

    /// True if the wave propagates in a medium of refractive index `index`.
    pub fn propagates(self, index: f64) -> bool {
        self.kx * self.kx + self.ky * self.ky < index * index
    }

    /// Unit vector `wo` into `side` of refractive index `index`; `None` if the wave is evanescent.
    pub fn leaving(self, side: Side, index: f64) -> Option<DVec3> {
        let kz2 = index * index - self.kx * self.kx - self.ky * self.ky;
        (kz2 > 0.0).then(|| DVec3::new(self.kx, self.ky, side.sign() * kz2.sqrt()) / index)
    }

    /// Unit vector `wi` of light that arrives from `side` of refractive index `index`; `None` if
    /// the wave is evanescent.
    pub fn arriving(self, side: Side, index: f64) -> Option<DVec3> {
        Self { kx: -self.kx, ky: -self.ky }.leaving(side, index)
    }
}

/// Right-handed orthonormal frame of a surface point, in world coordinates. On a body of revolution
/// t points along the meridian, outward and down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x: along the grating vector.
    pub t: DVec3,
    /// Local y: along the grooves, b = n × t.
    pub b: DVec3,
    /// Local z: the outward normal.
    pub n: DVec3,
}

impl Frame {
    /// Frame of the unit normal `normal` with t along the tangential part of `along`; `None` if
    /// `along` is parallel to the normal to within 1e-12.
    pub fn new(normal: DVec3, along: DVec3) -> Option<Self> {
        let tangent = along - normal * normal.dot(along);
        let length = tangent.length();
        (length > 1e-12 * along.length()).then(|| {
            let t = tangent / length;
            Self { t, b: normal.cross(t), n: normal }
        })
    }

    /// Components of a world vector in this frame.
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        DVec3::new(self.t.dot(world), self.b.dot(world), self.n.dot(world))
    }

    /// World vector of local components.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.t * local.x + self.b * local.y + self.n * local.z
    }
}

/// Unit vector at polar angle `theta` from +z and azimuth `phi` from +x towards +y, both in
/// radians.
pub fn spherical(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// Specular reflection at the plane z = 0; light goes back from a direction along the other.
pub fn mirrored(direction: DVec3) -> DVec3 {
    DVec3::new(-direction.x, -direction.y, direction.z)
}

/// Point k of n evenly spread points of the unit square (golden-ratio sequence).
pub fn lattice_point(k: usize, n: usize) -> [f64; 2] {
    [(k as f64 + 0.5) / n as f64, (0.5 + k as f64 * 0.618_033_988_749_895).fract()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn wavevector_and_direction_are_inverse() {
        for (side, index) in [(Side::Inner, 1.41), (Side::Outer, 1.0)] {
            for k in 0..50 {
                let theta = 0.03 * f64::from(k);
                let phi = 0.7 * f64::from(k);
                let mut w = spherical(theta, phi);
                w.z *= side.sign();
                assert_eq!(Side::from_direction(w), side);
                let back = Wavevector::incoming(-w, index).leaving(side, index).unwrap();
                assert!((back - w).length() < 1e-13);
                let back = Wavevector::incoming(w, index).arriving(side, index).unwrap();
                assert!((back - w).length() < 1e-13);
            }
        }
    }

    #[test]
    fn light_from_behind_moves_forward() {
        // Light that comes from -x below the surface travels towards +x.
        let wi = DVec3::new(-0.6, 0.0, -0.8);
        let k = Wavevector::incoming(wi, 1.41);
        assert_relative_eq!(k.kx, 0.846, epsilon = 1e-15);
        assert!(k.propagates(1.0) && !k.propagates(0.8));
        assert!(k.leaving(Side::Outer, 0.8).is_none());
    }

    #[test]
    fn frame_is_right_handed_and_orthonormal() {
        let n = DVec3::new(0.3, -0.4, 0.5).normalize();
        let frame = Frame::new(n, DVec3::new(1.0, 1.0, -2.0)).unwrap();
        assert!((frame.t.cross(frame.b) - frame.n).length() < 1e-15);
        let v = DVec3::new(0.1, 0.2, -0.3);
        assert!((frame.to_world(frame.to_local(v)) - v).length() < 1e-15);
        assert!(Frame::new(n, n * 3.0).is_none());
    }
}
