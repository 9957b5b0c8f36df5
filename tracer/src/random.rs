// SPDX-License-Identifier: MIT OR Apache-2.0
//! Random numbers: one independent stream per (seed, batch), one for each path of a batch, and the
//! few distributions the tracer needs.
//!
//! \[Blackman, Vigna 2021\] D. Blackman, S. Vigna, *Scrambled linear pseudorandom number
//! generators*, ACM Trans. Math. Softw. 47, 36.
//!
//! \[Marsaglia 1972\] G. Marsaglia, *Choosing a point from the surface of a sphere*, Ann. Math.
//! Stat. 43, 645.

use std::convert::Infallible;

use glam::DVec3;
use rand::{Rng, TryRng};
use rand_pcg::Pcg64;

use crate::conversion;

/// The generator of batch `batch` of a run with `seed`: PCG64 with its own increment, hence its own
/// sequence.
pub fn stream(seed: u64, batch: u64) -> Pcg64 {
    // PCG mixes its output, not its state: neighbouring seeds are spread first (SplitMix64
    // finaliser).
    let high = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
    let low = mix(high ^ seed.rotate_left(32));
    Pcg64::new(
        (u128::from(high) << 64) | u128::from(low),
        u128::from(mix(batch)) << 32 | u128::from(batch),
    )
}

/// The streams of the paths of one group: path k has the same one whatever comes before it.
#[derive(Debug, Clone, Copy)]
pub struct Streams {
    keys: [u64; 2],
}

impl Streams {
    /// Streams that `rng` draws.
    pub fn new(rng: &mut impl Rng) -> Self {
        // One even, one odd: with the same multiple of an odd number added to both they never are 0
        // together.
        Self { keys: [rng.next_u64() & !1, rng.next_u64() | 1] }
    }

    /// The stream of path `number`: two SplitMix64 sequences side by side give the state.
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub fn path(&self, number: u64) -> PathStream {
        let far = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        PathStream { state: self.keys.map(|key| mix(key.wrapping_add(far))) }
    }
}

/// Numbers for one path: xoroshiro128++ \[Blackman, Vigna 2021\], two words of state, cheap to
/// begin and cheap to go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathStream {
    pub(crate) state: [u64; 2],
}

impl PathStream {
    /// The next number of a state, and the state after it.
    #[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
    #[inline(always)]
    pub(crate) fn step([a, b]: [u64; 2]) -> (u64, [u64; 2]) {
        let out = a.wrapping_add(b).rotate_left(17).wrapping_add(a);
        let b = b ^ a;
        let after = [a.rotate_left(49) ^ b ^ (b << 21), b.rotate_left(28)];
        (out, after)
    }
}

impl TryRng for PathStream {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        // The high half: the low bits of such generators are the weaker ones.
        self.try_next_u64().map(|word| (word >> 32) as u32)
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let (out, state) = Self::step(self.state);
        self.state = state;
        Ok(out)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(8) {
            let word = self.next_u64().to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
        Ok(())
    }
}

#[inline]
const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// 2^-53.
const STEP: f64 = 1.0 / 9_007_199_254_740_992.0;

/// Uniform on [0, 1) in steps of 2^-53.
#[inline]
pub fn unit(rng: &mut (impl Rng + ?Sized)) -> f64 {
    // One word by the processor's own instruction: the bits are those of [`unit_from_word`].
    (rng.next_u64() >> 11) as i64 as f64 * STEP
}

/// A random word as a number on [0, 1) in steps of 2^-53.
#[expect(clippy::inline_always, reason = "compiled into the wide loop over many paths")]
#[inline(always)]
pub(crate) fn unit_from_word(word: u64) -> f64 {
    conversion::real(word >> 11) * STEP
}

/// Direction about +z with density cos θ/π, restricted to sin θ < `sin_max`.
#[inline]
pub fn cosine(rng: &mut (impl Rng + ?Sized), sin_max: f64) -> DVec3 {
    risen(disc(rng, sin_max))
}

/// The unit vector with z ≥ 0 above a point of the unit disc: uniform points become directions with
/// density cos θ/π.
#[inline]
pub(crate) fn risen((x, y): (f64, f64)) -> DVec3 {
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// Uniform direction on the whole sphere.
#[inline]
pub fn isotropic(rng: &mut (impl Rng + ?Sized)) -> DVec3 {
    wrapped(disc(rng, 1.0))
}

/// The direction that a point of the unit disc is mapped to: uniform points become uniform
/// directions on the whole sphere.
#[inline]
pub(crate) fn wrapped((x, y): (f64, f64)) -> DVec3 {
    // With s = x² + y² uniform on [0, 1): cos θ = 1 - 2s, and sin θ = 2 √(s (1 - s)) along (x,
    // y)/√s [Marsaglia 1972].
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
