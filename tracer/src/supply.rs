// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays of one source, drawn many at a time.
//!
//! What most packages have, a level face that emits by Lambert's law, is drawn without a branch that depends on chance: a pair of numbers outside of the unit
//! circle is overwritten by the next one. All other sources are drawn ray by ray.

use glam::DVec3;
use rand::Rng;

use crate::net::Net;
use crate::random;
use crate::ray::Ray;
use crate::source::{Emission, Emitter, Source};

/// Rays drawn at a time.
const STOCK: usize = 64;

/// A source with rays in stock.
pub(crate) struct Supply<'a> {
    source: &'a Source,
    offset: f64,
    /// Half lengths of a level rectangle that emits by Lambert's law.
    face: Option<[f64; 2]>,
    /// x and y where the rays start, from the middle of the source.
    start: [[f64; STOCK]; 2],
    direction: [[f64; STOCK]; 3],
    left: usize,
    /// Where rays begin, if not by chance, and the number of the next one.
    net: Option<Net>,
    number: u64,
}

impl<'a> Supply<'a> {
    /// Rays start `offset` mm off the surface that carries the source, at the points of `net` or by chance.
    pub fn new(source: &'a Source, offset: f64, net: Option<Net>) -> Self {
        let lambertian = source.emission == Emission::LAMBERTIAN && source.normal == DVec3::Z;
        let face = match source.emitter {
            Emitter::Point if lambertian => Some([0.0; 2]),
            Emitter::Rectangle { half_x, half_y } if lambertian => Some([half_x, half_y]),
            _ => None,
        };
        Self {
            source,
            offset,
            face,
            start: [[0.0; STOCK]; 2],
            direction: [[0.0; STOCK]; 3],
            left: 0,
            net,
            number: 0,
        }
    }

    /// The next ray.
    #[inline]
    pub fn next(&mut self, rng: &mut impl Rng) -> Ray {
        if let Some(net) = &mut self.net {
            let point = net.point(self.number);
            self.number += 1;
            return self.source.begin(self.offset, &point, rng);
        }
        let Some(half) = self.face else {
            return self.source.sample(self.offset, rng);
        };
        if self.left == 0 {
            self.draw(half, rng);
        }
        self.left -= 1;
        let k = self.left;
        let mut origin = self.source.position;
        origin.x += self.start[0][k];
        origin.y += self.start[1][k];
        origin.z += self.offset;
        Ray {
            origin,
            direction: [
                self.direction[0][k],
                self.direction[1][k],
                self.direction[2][k],
            ]
            .into(),
        }
    }

    fn draw(&mut self, half: [f64; 2], rng: &mut impl Rng) {
        let [dx, dy, dz] = &mut self.direction;
        let mut kept = 0;
        while kept < STOCK {
            let (x, y) = (2.0 * random::unit(rng) - 1.0, 2.0 * random::unit(rng) - 1.0);
            (dx[kept], dy[kept]) = (x, y);
            kept += usize::from(x * x + y * y < 1.0);
        }
        for k in 0..STOCK {
            dz[k] = (1.0 - dx[k] * dx[k] - dy[k] * dy[k]).sqrt();
        }
        for (start, half) in self.start.iter_mut().zip(half) {
            for value in start {
                *value = half * (2.0 * random::unit(rng) - 1.0);
            }
        }
        self.left = STOCK;
    }
}
