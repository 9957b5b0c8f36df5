// SPDX-License-Identifier: MIT OR Apache-2.0
//! Spherical shells around reliefs, and the stretches of a ray within their two spheres.

/// The spherical shell in which a relief lies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shell {
    /// Height of its centre.
    pub centre_z: f64,
    /// Inner and outer radius.
    pub inner: f64,
    pub outer: f64,
}

/// The stretches of a ray within the spheres of a shell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passage {
    /// Distances at which it enters and leaves the inner ball; far behind if it never does.
    pub gap: [f64; 2],
    /// Distances at which it enters and leaves the outer ball; far behind if it never does.
    pub whole: [f64; 2],
}

/// A distance far behind.
const BEHIND: f64 = -1e300;

impl Shell {
    /// The passage of a ray from (x, y, z) along (dx, dy, dz).
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub fn passage(&self, [x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3]) -> Passage {
        let line = self.line([x, y, z], [dx, dy, dz]);
        Passage { gap: line.within(self.inner), whole: line.within(self.outer) }
    }

    /// A ray by its place beside the centre.
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub fn line(&self, [x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3]) -> CentredLine {
        let z = z - self.centre_z;
        let nearest = -(x * dx + y * dy + z * dz);
        let (ax, ay, az) = (x + dx * nearest, y + dy * nearest, z + dz * nearest);
        CentredLine { nearest, across2: ax * ax + ay * ay + az * az }
    }
}

/// A ray beside the centre of a shell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CentredLine {
    /// Distance at which the ray is nearest to the centre.
    nearest: f64,
    /// Squared distance from the centre there.
    across2: f64,
}

impl CentredLine {
    /// Distances at which it enters and leaves the ball of this radius; far behind if it never
    /// does.
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub fn within(&self, radius: f64) -> [f64; 2] {
        let half2 = radius * radius - self.across2;
        let half = if half2 > 0.0 { half2 } else { 0.0 }.sqrt();
        let (first, last) = (self.nearest - half, self.nearest + half);
        [first, last].map(|end| if half2 > 0.0 { end } else { BEHIND })
    }
}
