// SPDX-License-Identifier: MIT OR Apache-2.0
//! Emission of many rays at a time, by a point or a level rectangle of Lambertian emission.
//!
//! Numbers and their order are those of [`Source::sample`], so each path begins as it begins alone.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    clippy::needless_range_loop,
    reason = "a branch or a call within a loop would keep it from being compiled to wide \
        instructions"
)]

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::sobol::{BLOCK, SobolSequence, Words, concentric};
use crate::random::{self, PathStream, Streams};
use crate::ray::{Ray, lanes};
use crate::source::{Emission, Emitter, Source};

/// Rays emitted at a time.
const COUNT: usize = BLOCK;
/// Attempts at a direction by rejection that all paths make together; one path in 100 needs more.
const ATTEMPTS: usize = 3;

type Lane = [f64; COUNT];

/// Rays emitted ahead, by path number.
pub(crate) struct EmittedRays {
    /// Half lengths of the rectangle; none for a point.
    half: Option<[f64; 2]>,
    /// Number of the first path.
    first: u64,
    state: [[u64; COUNT]; 2],
    position: [Lane; 2],
    direction: [Lane; 3],
    /// 1 where rejection has found a direction.
    found: Lane,
    /// Numbers that choose the source, of Sobol' points.
    turn: Lane,
}

impl EmittedRays {
    /// No rays yet; `None` for other sources.
    pub fn new(source: &Source) -> Option<Self> {
        let half = match source.emitter {
            Emitter::Point => None,
            Emitter::Rectangle { half_x, half_y } => Some([half_x, half_y]),
            _ => return None,
        };
        let level = source.normal == DVec3::Z && source.along.is_none();
        (level && source.emission == Emission::LAMBERTIAN).then_some(Self {
            half,
            // Far from any path.
            first: u64::MAX / 2,
            state: [[0; COUNT]; 2],
            position: [[0.0; COUNT]; 2],
            direction: [[0.0; COUNT]; 3],
            found: [0.0; COUNT],
            turn: [0.0; COUNT],
        })
    }

    /// Index of the ray of path `number`; paths are asked for in ascending order.
    #[inline]
    pub fn ready(
        &mut self,
        number: u64,
        streams: &Streams,
        sobol: Option<&mut SobolSequence>,
    ) -> usize {
        let index = number.wrapping_sub(self.first);
        if index < COUNT as u64 {
            return index as usize;
        }
        match sobol {
            None => self.draw(number, streams),
            Some(sobol) => self.draw_points(number, streams, sobol),
        }
        (number - self.first) as usize
    }

    /// The number that chooses the source of a ray.
    #[inline]
    pub fn turn(&self, index: usize) -> f64 {
        self.turn[index]
    }

    /// A ray from a source at `position`, and the stream of its path.
    #[inline]
    pub fn ray(&self, index: usize, position: DVec3, offset: f64) -> (Ray, PathStream) {
        let origin = DVec3::new(self.position[0][index], self.position[1][index], offset);
        // Element by element: mapping the arrays would copy them.
        let direction = [0, 1, 2].map(|axis| self.direction[axis][index]);
        let ray = Ray { origin: position + origin, direction: direction.into() };
        let state = [0, 1].map(|half| self.state[half][index]);
        (ray, PathStream { state })
    }

    /// Emits rays from path `number` on, by the streams of the paths.
    #[inline]
    fn draw(&mut self, number: u64, streams: &Streams) {
        self.first = number;
        let random = ByStreams { rays: self, streams };
        for k in lanes(Arch::new().dispatch(random)) {
            self.reject_alone(k);
        }
    }

    /// Emits the rays of a block of Sobol' points, that of path `number`.
    fn draw_points(&mut self, number: u64, streams: &Streams, sobol: &mut SobolSequence) {
        self.first = number - number % BLOCK as u64;
        let (low, high) = sobol.block(number);
        Arch::new().dispatch(ByPoints { rays: self, streams, low, high });
    }

    /// Makes further attempts for one path.
    #[cold]
    fn reject_alone(&mut self, k: usize) {
        while self.found[k] == 0.0 {
            self.attempt(k);
        }
        self.rise(k);
    }

    /// One attempt at a direction, where it is still missing: a point of the square, kept if it
    /// lies in the unit disc.
    #[inline(always)]
    fn attempt(&mut self, k: usize) {
        let before = [self.state[0][k], self.state[1][k]];
        let found_before = [self.direction[0][k], self.direction[1][k]];
        let (a, state) = PathStream::step(before);
        let (b, state) = PathStream::step(state);
        let (x, y) = (2.0 * random::unit_from_word(a) - 1.0, 2.0 * random::unit_from_word(b) - 1.0);
        let open = self.found[k] == 0.0;
        for half in 0..2 {
            self.state[half][k] = if open { state[half] } else { before[half] };
        }
        self.direction[0][k] = if open { x } else { found_before[0] };
        self.direction[1][k] = if open { y } else { found_before[1] };
        let found = x * x + y * y < 1.0;
        self.found[k] = if open & !found { 0.0 } else { 1.0 };
    }

    /// z of a direction of given x and y.
    #[inline(always)]
    fn rise(&mut self, k: usize) {
        let (x, y) = (self.direction[0][k], self.direction[1][k]);
        let square = 1.0 - x * x - y * y;
        self.direction[2][k] = if square > 0.0 { square } else { 0.0 }.sqrt();
    }

    /// The stream of every path at its beginning.
    #[inline(always)]
    fn start(&mut self, streams: &Streams) {
        for k in 0..COUNT {
            let state = streams.path(self.first.wrapping_add(k as u64)).state;
            self.state[0][k] = state[0];
            self.state[1][k] = state[1];
        }
    }
}

/// Draws all rays from the streams of their paths; gives those whose direction is still missing.
struct ByStreams<'a> {
    rays: &'a mut EmittedRays,
    streams: &'a Streams,
}

impl WithSimd for ByStreams<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> u64 {
        let rays = self.rays;
        rays.start(self.streams);
        rays.found = [0.0; COUNT];
        if let Some(half) = rays.half {
            for (position, half) in rays.position.iter_mut().zip(half) {
                for k in 0..COUNT {
                    let (word, state) = PathStream::step([rays.state[0][k], rays.state[1][k]]);
                    position[k] = half * (2.0 * random::unit_from_word(word) - 1.0);
                    rays.state[0][k] = state[0];
                    rays.state[1][k] = state[1];
                }
            }
        }
        for _ in 0..ATTEMPTS {
            for k in 0..COUNT {
                rays.attempt(k);
            }
        }
        let mut open = 0;
        for k in 0..COUNT {
            rays.rise(k);
            open |= u64::from(rays.found[k] == 0.0) << k;
        }
        open
    }
}

/// Takes all rays from Sobol' points, of the words `low` with `high` added modulo 2.
struct ByPoints<'a> {
    rays: &'a mut EmittedRays,
    streams: &'a Streams,
    low: &'a Words<[u64; BLOCK]>,
    high: Words<u64>,
}

impl WithSimd for ByPoints<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let (rays, high) = (self.rays, self.high);
        let [a, b, u, v, turn] = self.low;
        rays.start(self.streams);
        for k in 0..COUNT {
            rays.turn[k] = random::unit_from_word(turn[k] ^ high[4]);
        }
        for k in 0..COUNT {
            let (x, y) = concentric([a[k] ^ high[0], b[k] ^ high[1]].map(random::unit_from_word));
            rays.direction[0][k] = x;
            rays.direction[1][k] = y;
        }
        for k in 0..COUNT {
            rays.rise(k);
        }
        if let Some(half) = rays.half {
            for k in 0..COUNT {
                let at = [u[k] ^ high[2], v[k] ^ high[3]].map(random::unit_from_word);
                rays.position[0][k] = half[0] * (2.0 * at[0] - 1.0);
                rays.position[1][k] = half[1] * (2.0 * at[1] - 1.0);
            }
        }
    }
}
