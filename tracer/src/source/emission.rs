// SPDX-License-Identifier: MIT OR Apache-2.0
//! Beginnings of paths, drawn many at a time from the streams of the paths: those of a level face that emits by Lambert's law, which most packages have.
//! The numbers and their order are those of [`Source::sample`].

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    clippy::needless_range_loop,
    reason = "a branch or a call within a loop would keep it from being compiled to wide instructions"
)]

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use crate::random::{self, PathStream, Streams};
use crate::ray::{Ray, lanes};
use crate::source::{Emission, Emitter, Source};

/// Beginnings drawn at a time.
pub(crate) const STOCK: usize = 64;
/// Pairs of numbers that all paths draw together for a direction; one path in 100 needs more.
const TOGETHER: usize = 3;

type Stock = [f64; STOCK];

/// Beginnings in stock.
pub(crate) struct EmittedRays {
    /// Half lengths of the face; none for a point.
    half: Option<[f64; 2]>,
    /// Number of the first path in stock.
    first: u64,
    state: [[u64; STOCK]; 2],
    place: [Stock; 2],
    direction: [Stock; 3],
    found: Stock,
}

impl EmittedRays {
    /// An empty stock, if the source is one of those.
    pub fn new(source: &Source) -> Option<Self> {
        let half = match source.emitter {
            Emitter::Point => None,
            Emitter::Rectangle { half_x, half_y } => Some([half_x, half_y]),
            _ => return None,
        };
        let level = source.normal == DVec3::Z;
        (level && source.emission == Emission::LAMBERTIAN).then_some(Self {
            half,
            // Far from any path.
            first: u64::MAX / 2,
            state: [[0; STOCK]; 2],
            place: [[0.0; STOCK]; 2],
            direction: [[0.0; STOCK]; 3],
            found: [0.0; STOCK],
        })
    }

    /// The beginning of path `number`, which follows on the last one asked for, and its stream.
    #[inline]
    pub fn next(
        &mut self,
        number: u64,
        streams: &Streams,
        position: DVec3,
        offset: f64,
    ) -> (Ray, PathStream) {
        let place = number.wrapping_sub(self.first);
        let k = if place < STOCK as u64 {
            place as usize
        } else {
            self.draw(number, streams);
            0
        };
        let origin = DVec3::new(self.place[0][k], self.place[1][k], offset);
        // Element by element: mapping the arrays would copy them.
        let direction = [0, 1, 2].map(|axis| self.direction[axis][k]);
        let ray = Ray {
            origin: position + origin,
            direction: direction.into(),
        };
        let state = [0, 1].map(|half| self.state[half][k]);
        (ray, PathStream { state })
    }

    /// The beginnings of [`STOCK`] paths from `number` on, into the arrays of those that follow them: where, which way, and their streams.
    #[inline]
    pub fn many(
        &mut self,
        number: u64,
        streams: &Streams,
        from: DVec3,
        origin: &mut [Stock; 3],
        direction: &mut [Stock; 3],
        state: &mut [[u64; STOCK]; 2],
    ) {
        self.draw(number, streams);
        for axis in 0..2 {
            for (all, place) in origin[axis].iter_mut().zip(&self.place[axis]) {
                *all = from[axis] + place;
            }
        }
        origin[2] = [from.z; STOCK];
        *direction = self.direction;
        *state = self.state;
    }

    /// Draws the beginnings from path `number` on.
    #[inline]
    fn draw(&mut self, number: u64, streams: &Streams) {
        self.first = number;
        let fill = Fill {
            emitted: self,
            streams,
        };
        for k in lanes(Arch::new().dispatch(fill)) {
            self.finish(k);
        }
    }

    /// Draws on until the direction is found.
    #[cold]
    fn finish(&mut self, k: usize) {
        while self.found[k] == 0.0 {
            self.pair(k);
        }
        self.rise(k);
    }

    /// Two numbers of a stream, if it needs them still: x and y of a direction, if they lie within the unit circle.
    #[inline(always)]
    fn pair(&mut self, k: usize) {
        let (a, state) = PathStream::step([self.state[0][k], self.state[1][k]]);
        let (b, state) = PathStream::step(state);
        let (x, y) = (2.0 * random::share(a) - 1.0, 2.0 * random::share(b) - 1.0);
        let open = self.found[k] == 0.0;
        for (all, state) in self.state.iter_mut().zip(state) {
            all[k] = if open { state } else { all[k] };
        }
        self.direction[0][k] = if open { x } else { self.direction[0][k] };
        self.direction[1][k] = if open { y } else { self.direction[1][k] };
        let found = x * x + y * y < 1.0;
        self.found[k] = if open & !found { 0.0 } else { 1.0 };
    }

    #[inline(always)]
    fn rise(&mut self, k: usize) {
        let (x, y) = (self.direction[0][k], self.direction[1][k]);
        let square = 1.0 - x * x - y * y;
        self.direction[2][k] = if square > 0.0 { square } else { 0.0 }.sqrt();
    }

    /// Fills the stock but for those that need more numbers, which it names.
    #[inline(always)]
    fn fill(&mut self, streams: &Streams) -> u64 {
        for k in 0..STOCK {
            let state = streams.path(self.first.wrapping_add(k as u64)).state;
            self.state[0][k] = state[0];
            self.state[1][k] = state[1];
            self.found[k] = 0.0;
        }
        if let Some(half) = self.half {
            for (place, half) in self.place.iter_mut().zip(half) {
                for k in 0..STOCK {
                    let (word, state) = PathStream::step([self.state[0][k], self.state[1][k]]);
                    place[k] = half * (2.0 * random::share(word) - 1.0);
                    self.state[0][k] = state[0];
                    self.state[1][k] = state[1];
                }
            }
        }
        for _ in 0..TOGETHER {
            for k in 0..STOCK {
                self.pair(k);
            }
        }
        let mut open = 0;
        for k in 0..STOCK {
            self.rise(k);
            open |= u64::from(self.found[k] == 0.0) << k;
        }
        open
    }
}

/// Fills the stock.
struct Fill<'a> {
    emitted: &'a mut EmittedRays,
    streams: &'a Streams,
}

impl WithSimd for Fill<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> u64 {
        self.emitted.fill(self.streams)
    }
}
