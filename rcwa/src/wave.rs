// SPDX-License-Identifier: MIT OR Apache-2.0
//! The half-space and the linear polarisation of a plane wave.

/// Half-space above (where z < 0) or below the structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// Light from here travels towards +z.
    Top,
    /// Light from here travels towards -z.
    Bottom,
}

impl Side {
    /// Both, in the order used by arrays.
    pub const BOTH: [Self; 2] = [Self::Top, Self::Bottom];

    /// Its name in words.
    pub fn name(self) -> &'static str {
        if self == Self::Top { "top" } else { "bottom" }
    }

    /// Position in arrays over both half-spaces.
    pub(crate) fn number(self) -> usize {
        usize::from(self == Self::Bottom)
    }
}

/// Linear polarisation of a plane wave with respect to its own plane (z, k).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Pol {
    /// Electric field normal to the plane of z and k (TE).
    S,
    /// Magnetic field normal to the plane of z and k (TM).
    P,
}

impl Pol {
    /// Both, in the order used by matrices.
    pub const BOTH: [Self; 2] = [Self::S, Self::P];

    /// Position in arrays over both polarisations.
    pub(crate) fn number(self) -> usize {
        usize::from(self == Self::P)
    }
}
