// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniform and normal random numbers from one stream.
//!
//! \[Box, Muller 1958\] G. E. P. Box, M. E. Muller, *A note on the generation of random normal
//! deviates*, Ann. Math. Stat. 29, 610.

use std::f64::consts::TAU;

use rand::Rng;
use rand_pcg::Pcg64;

/// One stream of uniform and normal numbers.
#[derive(Debug, Clone)]
pub struct Normal {
    generator: Pcg64,
    spare: Option<f64>,
}

impl Normal {
    /// The stream of `seed`.
    pub fn new(seed: u64) -> Self {
        // PCG mixes its output, not its state: neighbouring seeds are spread first (SplitMix64
        // finaliser).
        let high = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
        let low = mix(high ^ seed.rotate_left(32));
        Self { generator: Pcg64::new((u128::from(high) << 64) | u128::from(low), 0), spare: None }
    }

    /// Uniform on [0, 1) in steps of 2^-53.
    pub fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 / 2f64.powi(53)
    }

    /// A seed for a stream of its own.
    pub fn seed(&mut self) -> u64 {
        // 53 random bits as a whole number.
        (self.uniform() * 2f64.powi(53)) as u64
    }

    /// A point of the unit box.
    pub fn point(&mut self, dimension: usize) -> Vec<f64> {
        (0..dimension).map(|_| self.uniform()).collect()
    }

    /// Mean 0, variance 1 [Box, Muller 1958].
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        // 1 - u lies in (0, 1]: the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        let (sine, cosine) = (TAU * self.uniform()).sin_cos();
        self.spare = Some(radius * sine);
        radius * cosine
    }
}

const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
