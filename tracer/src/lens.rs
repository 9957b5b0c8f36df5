// SPDX-License-Identifier: MIT OR Apache-2.0
//! The simplest package, many paths at once: one clear body between a smooth zone of a sphere, which refracts into the world, and a level
//! mirror, with nothing around it.
//!
//! In: a scene of that kind (all others are refused, and traced path by path) and the streams of a group's paths. Out: the same tally as path by
//! path, from the same draws. [`LANES`] paths begin together; a step takes all of them to their next surface and beyond it with the same
//! operations, no branches, which the compiler turns into the widest instructions that the processor has. Four of five have left then. The others
//! are gathered, and go on together as soon as there are enough of them. All operations are those of IEEE 754 without contraction, so that
//! the bits are the same on any processor. The formulas are those of [`crate::shape::Sphere`], [`crate::shape::Frustum`] and [`crate::optics::fresnel`]: a light ray
//! in a ball meets the sphere at the far one of its two roots, and having left a ball it never meets it again.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "a branch or a call within the step would keep it from being compiled to wide instructions"
)]

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use crate::ledger::Loss;
use crate::path::{Tally, Tracer};
use crate::random::{self, PathStream, Streams};
use crate::ray::{Ray, lanes};
use crate::run::SourcePicker;
use crate::scene::{Location, PlacedSource, Scene};
use crate::shape::Shape;
use crate::source::emission::{EmittedRays, STOCK};
use crate::surface::{Region, SurfaceModel};

/// Paths that begin together.
const LANES: usize = STOCK;

/// One number for each lane.
type Lane = [f64; LANES];

/// A scene that can be traced so.
pub(crate) struct Lens<'a> {
    placed: &'a PlacedSource,
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

/// Rays in flight.
struct Packet {
    origin: [Lane; 3],
    direction: [Lane; 3],
    /// Their random streams.
    state: [[u64; LANES]; 2],
    weight: Lane,
    /// Surfaces met so far.
    bounces: [u32; LANES],
}

/// One of them.
struct Single {
    ray: Ray,
    stream: PathStream,
    weight: f64,
    bounces: u32,
}

impl<'a> Lens<'a> {
    /// The scene as a lens, if it is one.
    pub fn of(scene: &'a Scene) -> Option<Self> {
        let ([instance], [placed], []) = (
            &scene.instances.list[..],
            &scene.sources[..],
            &scene.ground.surfaces[..],
        ) else {
            return None;
        };
        let body = &scene.bodies[instance.prototype as usize];
        let inside = placed.location
            == Location::Inside {
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
        let (Shape::Sphere(sphere), Shape::Frustum(disc)) = (&dome.shape, &base.shape) else {
            return None;
        };
        let (centre, radius, [low, high]) = sphere.single_zone()?;
        let (level, rim) = disc.disc_facing_up()?;
        let closed = dome.regions == [Region::Body(0), Region::World]
            && base.regions == [Region::Opaque, Region::Body(0)]
            && high >= centre + radius
            && low <= level;
        let reflectance = match &base.patches[0].optics {
            SurfaceModel::Mirror { reflectance } => *reflectance,
            SurfaceModel::Absorber => 0.0,
            _ => return None,
        };
        let refracts = matches!(dome.patches[0].optics, SurfaceModel::Interface);
        (closed && refracts).then_some(Self {
            placed,
            position: instance.position,
            centre,
            radius,
            low,
            level,
            rim2: rim * rim,
            reflectance,
            inner: dome.indices[0],
            outer: dome.indices[1],
            dome_line: dome.patches[0].line,
            mirror_line: base.patches[0].line,
            offset: scene.offset(),
        })
    }

    /// Traces `paths` paths; `look` is called before each step with the number of paths begun so far and may stop the whole. Returns how many
    /// surfaces the paths met; `None` if stopped.
    pub fn trace(
        &self,
        tracer: &Tracer<'_>,
        paths: u64,
        (streams, mut picker): (Streams, SourcePicker<'_>),
        tally: &mut Tally,
        mut look: impl FnMut(u64) -> bool,
    ) -> Option<u64> {
        let emitted = if picker.by_sobol() {
            None
        } else {
            EmittedRays::new(&self.placed.source)
        };
        let mut emitted = emitted.map(Box::new);
        let (mut young, mut old) = (Packet::new(self.level), Packet::new(self.level));
        let (mut begun, mut hits) = (0, 0);
        // The lanes 0 to `flying` of the old ones hold a path each.
        let mut flying = 0;
        while begun < paths || flying > 0 {
            if !look(begun) {
                return None;
            }
            if begun == paths {
                flying = self.go_on(tracer, &mut old, flying, tally, &mut hits);
                continue;
            }
            let count = (paths - begun).min(LANES as u64) as usize;
            if let Some(emitted) = &mut emitted {
                let from = self.placed.source.position + DVec3::Z * self.offset;
                let Packet {
                    origin,
                    direction,
                    state,
                    ..
                } = &mut *young;
                emitted.many(begun, &streams, from, origin, direction, state);
            } else {
                for lane in 0..count {
                    let number = begun + lane as u64;
                    let mut stream = streams.path(number);
                    let ray = picker.begin(number, self.placed, self.offset, &mut stream);
                    ray.into_lane(&mut young.origin, &mut young.direction, lane);
                    young.keep(lane, stream);
                }
            }
            young.weight = [1.0; LANES];
            young.bounces = [0; LANES];
            tally.totals.ledger.emitted += count as f64;
            begun += count as u64;
            let still = self.pass(tracer, &mut young, count, tally, &mut hits);
            while flying + still.count_ones() as usize > LANES {
                flying = self.go_on(tracer, &mut old, flying, tally, &mut hits);
            }
            for lane in lanes(still) {
                old.put(flying, &young.path(lane));
                flying += 1;
            }
        }
        Some(hits)
    }

    /// Takes the first `count` rays to their next surface and beyond; how many go on, which are then the first ones.
    fn go_on(
        &self,
        tracer: &Tracer<'_>,
        packet: &mut Packet,
        count: usize,
        tally: &mut Tally,
        hits: &mut u64,
    ) -> usize {
        let still = self.pass(tracer, packet, count, tally, hits);
        for (place, lane) in lanes(still).enumerate() {
            let path = packet.path(lane);
            packet.put(place, &path);
        }
        still.count_ones() as usize
    }

    /// Takes the first `count` rays to their next surface and beyond and counts what happened; those whose bits are set go on.
    #[inline]
    fn pass(
        &self,
        tracer: &Tracer<'_>,
        packet: &mut Packet,
        count: usize,
        tally: &mut Tally,
        hits: &mut u64,
    ) -> u64 {
        let flying = u64::MAX >> (LANES - count);
        let events = Arch::new().dispatch(Step { lens: self, packet });
        let [left, mirror, leak] = events.map(|lanes| lanes & flying);
        *hits += u64::from((flying & !leak).count_ones());
        let ledger = &mut tally.totals.ledger;
        let weight = &mut packet.weight;
        let (mut outward, mut spent, mut escaped) = (0.0, 0.0, left);
        for lane in lanes(left) {
            outward += weight[lane];
            // As for all paths, the last surface allowed ends it.
            if packet.bounces[lane] + 1 == tracer.max_bounces {
                spent += weight[lane];
                escaped ^= 1 << lane;
            }
        }
        ledger.surfaces[self.dome_line].outward += outward;
        ledger.lost[Loss::Bounces as usize] += spent;
        for lane in lanes(leak) {
            ledger.lost[Loss::Leak as usize] += weight[lane];
        }
        let (mut absorbed, mut ended) = (0.0, left | leak);
        for lane in lanes(mirror) {
            let mut stream = PathStream {
                state: [packet.state[0][lane], packet.state[1][lane]],
            };
            absorbed += tracer.share(&mut weight[lane], self.reflectance, &mut stream);
            [packet.state[0][lane], packet.state[1][lane]] = stream.state;
            ended |= u64::from(weight[lane] == 0.0) << lane;
        }
        ledger.surfaces[self.mirror_line].absorbed += absorbed;
        for lane in lanes(flying & !ended) {
            packet.bounces[lane] += 1;
            if packet.bounces[lane] == tracer.max_bounces {
                ledger.lost[Loss::Bounces as usize] += weight[lane];
                ended |= 1 << lane;
            }
        }
        let rays = (&packet.origin, &packet.direction);
        tracer.leave_many(rays, weight, (escaped, |_| self.position), tally);
        flying & !ended
    }

    /// Takes a ray to its next surface and beyond; whether it left, met the mirror, or met nothing.
    #[inline(always)]
    fn advance(&self, packet: &mut Packet, lane: usize) -> [bool; 3] {
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
        let draws = dome & !mirror & (sin2_t < 1.0);
        let (word, after) = PathStream::step([packet.state[0][lane], packet.state[1][lane]]);
        for (state, after) in packet.state.iter_mut().zip(after) {
            state[lane] = if draws { after } else { state[lane] };
        }
        let back = !draws | (random::share(word) * (2.0 * whole * whole) < s * s + p * p);

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
        [dome & !back, mirror, !dome & !mirror]
    }
}

/// A step, in a form that [`Arch::dispatch`] compiles for each set of instructions. Its result are the lanes that left, met the mirror, or met nothing.
struct Step<'a> {
    lens: &'a Lens<'a>,
    packet: &'a mut Packet,
}

impl WithSimd for Step<'_> {
    type Output = [u64; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> [u64; 3] {
        let mut events = [0; 3];
        for lane in 0..LANES {
            let happened = self.lens.advance(self.packet, lane);
            for (all, happened) in events.iter_mut().zip(happened) {
                *all |= u64::from(happened) << lane;
            }
        }
        events
    }
}

/// 0 in place of a negative number.
#[inline(always)]
fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

impl Packet {
    /// Rays that go straight up from `level`.
    fn new(level: f64) -> Box<Self> {
        Box::new(Self {
            origin: [[0.0; LANES], [0.0; LANES], [level; LANES]],
            direction: [[0.0; LANES], [0.0; LANES], [1.0; LANES]],
            state: [[1; LANES]; 2],
            weight: [0.0; LANES],
            bounces: [0; LANES],
        })
    }

    #[inline]
    fn keep(&mut self, lane: usize, stream: PathStream) {
        [self.state[0][lane], self.state[1][lane]] = stream.state;
    }

    #[inline]
    fn path(&self, lane: usize) -> Single {
        Single {
            ray: Ray::of_lane(&self.origin, &self.direction, lane),
            stream: PathStream {
                state: [self.state[0][lane], self.state[1][lane]],
            },
            weight: self.weight[lane],
            bounces: self.bounces[lane],
        }
    }

    #[inline]
    fn put(&mut self, lane: usize, path: &Single) {
        path.ray
            .into_lane(&mut self.origin, &mut self.direction, lane);
        self.keep(lane, path.stream);
        self.weight[lane] = path.weight;
        self.bounces[lane] = path.bounces;
    }
}
