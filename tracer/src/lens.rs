// SPDX-License-Identifier: MIT OR Apache-2.0
//! The simplest package, many paths at once: one clear body between a smooth zone of a sphere, which refracts into the world, and a level
//! mirror, with nothing around it.
//!
//! In: a scene of that kind (all others are refused, and traced path by path) and the random stream of a group. Out: the same books as
//! path by path, from other draws. [`LANES`] paths are kept in flight; a step takes all of them to their next surface and beyond it with the same
//! operations, no branches, which the compiler turns into the widest instructions that the processor has; then what has left or was absorbed is
//! booked and its place is taken by the next ray of the source. All operations are those of IEEE 754 without contraction, so that
//! the bits are the same on any processor. The formulas are those of [`crate::shape::Sphere`], [`crate::shape::Edge`] and [`crate::fresnel`]: a light ray
//! in a ball meets the sphere at the far one of its two roots, and having left a ball it never meets it again.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "a branch or a call within the step would keep it from being compiled to wide instructions"
)]

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rand::Rng;

use crate::ledger::Loss;
use crate::net::Net;
use crate::path::{Books, Tracer};
use crate::random;
use crate::ray::Ray;
use crate::scene::{Place, Scene};
use crate::shape::Shape;
use crate::source::Source;
use crate::supply::Supply;
use crate::surface::{Optics, Region};

/// Paths in flight.
const LANES: usize = 32;

/// One number for each lane.
type Lane = [f64; LANES];

/// A scene that can be traced so.
pub(crate) struct Lens<'a> {
    source: &'a Source,
    position: DVec3,
    /// Height of the centre of the sphere, its radius and the lowest height of its zone.
    centre: f64,
    radius: f64,
    low: f64,
    /// Height of the mirror, square of its radius.
    level: f64,
    rim2: f64,
    reflectance: f64,
    inner: f64,
    outer: f64,
    dome_line: usize,
    mirror_line: usize,
    offset: f64,
}

/// What a step did to a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Event {
    Dome,
    Left,
    Mirror,
    Leak,
}

/// The rays in flight, and what the last step did.
struct Packet {
    origin: [Lane; 3],
    direction: [Lane; 3],
    /// The number between 0 and 1 that decides between reflection and refraction.
    chance: Lane,
    /// [`Event`] as a number.
    event: Lane,
}

impl<'a> Lens<'a> {
    /// The scene as a lens, if it is one.
    pub fn of(scene: &'a Scene) -> Option<Self> {
        let ([instance], [slot], []) = (
            &scene.instances.list[..],
            &scene.slots[..],
            &scene.ground.surfaces[..],
        ) else {
            return None;
        };
        let body = &scene.bodies[instance.prototype as usize];
        let inside = slot.place
            == Place::Inside {
                instance: 0,
                medium: 0,
            };
        let ([medium], [a, b]) = (&body.media[..], &body.surfaces[..]) else {
            return None;
        };
        if !inside || medium.absorption > 0.0 {
            return None;
        }
        let (dome, base) = if matches!(a.shape, Shape::Sphere(_)) {
            (a, b)
        } else {
            (b, a)
        };
        let (Shape::Sphere(sphere), Shape::Edge(disc)) = (&dome.shape, &base.shape) else {
            return None;
        };
        let (centre, radius, [low, high]) = sphere.single_zone()?;
        let (level, rim) = disc.disc_facing_up()?;
        let closed = dome.regions == [Region::Body(0), Region::World]
            && base.regions == [Region::Opaque, Region::Body(0)]
            && high >= centre + radius
            && low <= level;
        let reflectance = match &base.parts[0].optics {
            Optics::Mirror { reflectance } => *reflectance,
            Optics::Absorber => 0.0,
            _ => return None,
        };
        let refracts = matches!(dome.parts[0].optics, Optics::Interface);
        (closed && refracts).then_some(Self {
            source: &slot.source,
            position: instance.position,
            centre,
            radius,
            low,
            level,
            rim2: rim * rim,
            reflectance,
            inner: dome.indices[0],
            outer: dome.indices[1],
            dome_line: dome.parts[0].line,
            mirror_line: base.parts[0].line,
            offset: scene.offset(),
        })
    }

    /// Traces `paths` paths; `look` is called before each step with the number of paths begun so far and may stop the whole. Returns how many
    /// surfaces the paths met; `None` if stopped.
    pub fn trace(
        &self,
        tracer: &Tracer<'_>,
        paths: u64,
        (rng, net): (&mut impl Rng, Option<Net>),
        books: &mut Books,
        mut look: impl FnMut(u64) -> bool,
    ) -> Option<u64> {
        let mut packet = Packet {
            origin: [[0.0; LANES], [0.0; LANES], [self.level; LANES]],
            direction: [[0.0; LANES], [0.0; LANES], [1.0; LANES]],
            chance: [0.5; LANES],
            event: [0.0; LANES],
        };
        let mut supply = Supply::new(self.source, self.offset, net);
        let mut weight = [0.0; LANES];
        let mut bounces = [0_u32; LANES];
        let (mut begun, mut hits) = (0, 0);
        // The lanes 0 to `flying` hold a path each.
        let mut flying = 0;
        loop {
            if !look(begun) {
                return None;
            }
            // Fill lanes with new paths.
            while flying < LANES && begun < paths {
                packet.put(flying, &supply.next(rng));
                (weight[flying], bounces[flying]) = (1.0, 0);
                books.totals.ledger.emitted += 1.0;
                flying += 1;
                begun += 1;
            }
            if flying == 0 {
                return Some(hits);
            }
            for chance in &mut packet.chance[..flying] {
                *chance = random::unit(rng);
            }
            self.step(&mut packet);

            // Book what happened, from the last lane to the first, so that the last one in flight can take the place of one that ended.
            for lane in (0..flying).rev() {
                let mut ended = true;
                hits += 1;
                match packet.event(lane) {
                    Event::Left => {
                        books.totals.ledger.surfaces[self.dome_line].outward += weight[lane];
                        let mut ray = packet.ray(lane);
                        ray.origin += self.position;
                        tracer.leave(&ray, weight[lane], books);
                    }
                    Event::Dome => ended = false,
                    Event::Mirror => {
                        let absorbed = tracer.share(&mut weight[lane], self.reflectance, rng);
                        books.totals.ledger.surfaces[self.mirror_line].absorbed += absorbed;
                        ended = weight[lane] == 0.0;
                    }
                    Event::Leak => {
                        hits -= 1;
                        books.totals.ledger.lost[Loss::Leak as usize] += weight[lane];
                    }
                }
                bounces[lane] += 1;
                if !ended && bounces[lane] == tracer.max_bounces {
                    books.totals.ledger.lost[Loss::Bounces as usize] += weight[lane];
                    ended = true;
                }
                if !ended {
                    continue;
                }
                if begun < paths {
                    packet.put(lane, &supply.next(rng));
                    (weight[lane], bounces[lane]) = (1.0, 0);
                    books.totals.ledger.emitted += 1.0;
                    begun += 1;
                } else {
                    flying -= 1;
                    let last = packet.ray(flying);
                    packet.put(lane, &last);
                    (weight[lane], bounces[lane]) = (weight[flying], bounces[flying]);
                }
            }
        }
    }

    /// Takes every ray to its next surface and beyond.
    fn step(&self, packet: &mut Packet) {
        Arch::new().dispatch(Step { lens: self, packet });
    }

    #[inline(always)]
    fn advance(&self, packet: &mut Packet, lane: usize) {
        let from = -4.0 * self.offset;
        let [ox, oy, oz] = [
            packet.origin[0][lane],
            packet.origin[1][lane],
            packet.origin[2][lane],
        ];
        let [dx, dy, dz] = [
            packet.direction[0][lane],
            packet.direction[1][lane],
            packet.direction[2][lane],
        ];

        // Where it leaves the ball: half chord from the distance of the centre to the ray.
        let cz = oz - self.centre;
        let nearest = -(ox * dx + oy * dy + cz * dz);
        let (ax, ay, az) = (ox + dx * nearest, oy + dy * nearest, cz + dz * nearest);
        let half2 = self.radius * self.radius - (ax * ax + ay * ay + az * az);
        let to_dome = nearest + positive(half2).sqrt();
        let dome_z = oz + to_dome * dz;
        let dome = (half2 >= 0.0) & (to_dome > from) & (dome_z >= self.low);

        // Where it meets the mirror.
        let to_mirror = (self.level - oz) / dz;
        let (mx, my) = (ox + to_mirror * dx, oy + to_mirror * dy);
        let mirror = (dz < 0.0)
            & (to_mirror > from)
            & (mx * mx + my * my <= self.rim2)
            & (!dome | (to_mirror < to_dome));

        // The point on the surface, and the normal there that faces the ray.
        let per_radius = 1.0 / self.radius;
        let length = if mirror { to_mirror } else { to_dome };
        let (px, py, pz) = (ox + length * dx, oy + length * dy, cz + length * dz);
        let (vx, vy, vz) = (px * per_radius, py * per_radius, pz * per_radius);
        let unit = 1.5 - 0.5 * (vx * vx + vy * vy + vz * vz);
        let (nx, ny, nz) = (vx * unit, vy * unit, vz * unit);
        let (px, py, pz) = if mirror {
            (px, py, self.level)
        } else {
            (
                nx * self.radius,
                ny * self.radius,
                nz * self.radius + self.centre,
            )
        };
        let (fx, fy, fz) = if mirror {
            (0.0, 0.0, 1.0)
        } else {
            (-nx, -ny, -nz)
        };

        // Fresnel for unpolarised light, decided without a division.
        let cos_i = -(dx * fx + dy * fy + dz * fz);
        let ratio = self.inner / self.outer;
        let sin2_t = ratio * ratio * positive(1.0 - cos_i * cos_i);
        let cos_t = positive(1.0 - sin2_t).sqrt();
        let (a, b) = (self.inner * cos_i, self.outer * cos_t);
        let (c, d) = (self.outer * cos_i, self.inner * cos_t);
        let (s, p) = ((a - b) * (c + d), (c - d) * (a + b));
        let whole = (a + b) * (c + d);
        let back = mirror
            | (sin2_t >= 1.0)
            | (packet.chance[lane] * (2.0 * whole * whole) < s * s + p * p);

        // The new direction: d + f 2 cos i, or d ratio + f (ratio cos i - cos t).
        let along = if back { 1.0 } else { ratio };
        let aside = if back {
            2.0 * cos_i
        } else {
            ratio * cos_i - cos_t
        };
        let (wx, wy, wz) = (
            dx * along + fx * aside,
            dy * along + fy * aside,
            dz * along + fz * aside,
        );
        let unit = 1.5 - 0.5 * (wx * wx + wy * wy + wz * wz);
        packet.direction[0][lane] = wx * unit;
        packet.direction[1][lane] = wy * unit;
        packet.direction[2][lane] = wz * unit;

        // Start just off the surface, on the side on which the light goes on.
        let off = if back { self.offset } else { -self.offset };
        packet.origin[0][lane] = px + fx * off;
        packet.origin[1][lane] = py + fy * off;
        packet.origin[2][lane] = pz + fz * off;
        packet.event[lane] = if mirror {
            2.0
        } else if !dome {
            3.0
        } else if back {
            0.0
        } else {
            1.0
        };
    }
}

/// A step, in a form that [`Arch::dispatch`] compiles for each set of instructions.
struct Step<'a> {
    lens: &'a Lens<'a>,
    packet: &'a mut Packet,
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for lane in 0..LANES {
            self.lens.advance(self.packet, lane);
        }
    }
}

/// 0 in place of a negative number.
#[inline(always)]
fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

impl Packet {
    #[inline]
    fn put(&mut self, lane: usize, ray: &Ray) {
        ray.into_lane(&mut self.origin, &mut self.direction, lane);
    }

    #[inline]
    fn ray(&self, lane: usize) -> Ray {
        Ray::of_lane(&self.origin, &self.direction, lane)
    }

    #[inline]
    fn event(&self, lane: usize) -> Event {
        match self.event[lane] as u8 {
            0 => Event::Dome,
            1 => Event::Left,
            2 => Event::Mirror,
            _ => Event::Leak,
        }
    }
}
