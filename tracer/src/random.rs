// SPDX-License-Identifier: MIT OR Apache-2.0
//! Random numbers: one independent stream per (seed, batch), and the few distributions the tracer needs.
//!
//! \[Marsaglia 1972\] G. Marsaglia, *Choosing a point from the surface of a sphere*, Ann. Math. Stat. 43, 645.

use glam::DVec3;
use rand::Rng;
use rand_pcg::Pcg64;

/// The generator of batch `batch` of a run with `seed`: PCG64 with its own increment, hence its own sequence.
pub fn stream(seed: u64, batch: u64) -> Pcg64 {
    // PCG mixes its output, not its state: neighbouring seeds are spread first (SplitMix64 finaliser).
    let high = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
    let low = mix(high ^ seed.rotate_left(32));
    Pcg64::new(
        (u128::from(high) << 64) | u128::from(low),
        u128::from(mix(batch)) << 32 | u128::from(batch),
    )
}

/// A generator of its own for what comes next: PCG64 at a place of its cycle that `rng` draws. Cycles of 2^128 numbers leave no two of them near each
/// other.
#[inline]
pub fn child(rng: &mut impl Rng) -> Pcg64 {
    let (high, low) = (rng.next_u64(), rng.next_u64());
    Pcg64::new((u128::from(high) << 64) | u128::from(low), CHILDREN)
}

/// Sequence of all children.
const CHILDREN: u128 = 0x5851_f42d_4c95_7f2d_1405_7b7e_f767_814f;

const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Uniform on [0, 1) in steps of 2^-53.
#[inline]
pub fn unit(rng: &mut (impl Rng + ?Sized)) -> f64 {
    // Through i64, for which the processor has an instruction: the bits are the same.
    (rng.next_u64() >> 11) as i64 as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// Direction about +z with density cos θ/π, restricted to sin θ < `sin_max`.
#[inline]
pub fn cosine(rng: &mut (impl Rng + ?Sized), sin_max: f64) -> DVec3 {
    let (x, y) = disc(rng, sin_max);
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// Uniform direction on the whole sphere.
#[inline]
pub fn isotropic(rng: &mut (impl Rng + ?Sized)) -> DVec3 {
    // With s = x² + y² uniform on [0, 1): cos θ = 1 - 2s, and sin θ = 2 √(s (1 - s)) along (x, y)/√s [Marsaglia 1972].
    let (x, y) = disc(rng, 1.0);
    let s = x * x + y * y;
    let along = 2.0 * (1.0 - s).max(0.0).sqrt();
    DVec3::new(x * along, y * along, 1.0 - 2.0 * s)
}

/// Uniform point of a disc about the origin.
#[inline]
pub fn disc(rng: &mut (impl Rng + ?Sized), radius: f64) -> (f64, f64) {
    // By rejection from the square: a quarter more numbers, and neither root, sine nor cosine.
    loop {
        let (x, y) = (2.0 * unit(rng) - 1.0, 2.0 * unit(rng) - 1.0);
        if x * x + y * y < 1.0 {
            return (radius * x, radius * y);
        }
    }
}

/// A direction given about +z, turned so that +z becomes `normal` (unit).
#[inline]
pub fn about(normal: DVec3, direction: DVec3) -> DVec3 {
    if normal == DVec3::Z {
        return direction;
    }
    let (u, v) = normal.any_orthonormal_pair();
    u * direction.x + v * direction.y + normal * direction.z
}
