// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which scenes can be traced as a convoy, and the numbers of theirs that the loops need.

use super::climb::Ladder;
use bsdf::Side;
use bsdf::orders::{OrderDeck, OrderTable};

use super::orders;
use super::step::{Frame, flat, mode};
use super::{Clearance, Convoy, Departs, Dome, Exit, Piece, Zones};
use crate::scene::{Place, ReadySurface, Scene};
use crate::shape::{Edge, Shape, Shell};
use crate::surface::{Optics, Region};

impl<'a> Piece<'a> {
    fn new(surface: &'a ReadySurface, number: u32, line: [f64; 3]) -> Self {
        let part = &surface.parts[surface.shape.part(number) as usize];
        let table = orders::table(&part.optics);
        let (mode, reflectance) = match part.optics {
            Optics::Interface => (mode::INTERFACE, 1.0),
            Optics::Mirror { reflectance } => (mode::MIRROR, reflectance),
            _ if table.is_some() => (mode::ORDERS, 1.0),
            _ => (mode::OTHER, 1.0),
        };
        Self {
            surface,
            part,
            number,
            mode,
            reflectance,
            table,
            line,
        }
    }

    /// Leaves draws from a table to the table itself.
    fn draw_alone(&mut self) {
        if self.table.take().is_some() {
            self.mode = mode::OTHER;
        }
    }
}

/// The surfaces of a package.
struct Members<'a> {
    dome: &'a ReadySurface,
    bottom: &'a ReadySurface,
    side: Option<&'a ReadySurface>,
    solid: Option<&'a ReadySurface>,
}

impl<'a> Members<'a> {
    /// All of `surfaces`, if they are those of a package.
    fn of(surfaces: &'a [ReadySurface]) -> Option<Self> {
        const SKIN: [Region; 2] = [Region::Body(0), Region::World];
        const FURNITURE: [Region; 2] = [Region::Opaque, Region::Body(0)];
        let (mut dome, mut bottom, mut side, mut solid) = (None, None, None, None);
        for surface in surfaces {
            let place = match (&surface.shape, surface.regions) {
                (Shape::Sphere(_) | Shape::Revolution(_), SKIN) => &mut dome,
                (Shape::Edge(edge), SKIN) if edge.cylinder_facing_out().is_some() => &mut side,
                (Shape::Edge(edge), FURNITURE) if edge.disc_facing_up().is_some() => &mut bottom,
                (Shape::Cuboid(_), FURNITURE) => &mut solid,
                _ => return None,
            };
            if place.replace(surface).is_some() {
                return None;
            }
        }
        Some(Self {
            dome: dome?,
            bottom: bottom?,
            side,
            solid,
        })
    }
}

/// A frame with nothing in it but two media.
fn empty(offset: f64, [inner, outer]: [f64; 2]) -> Frame {
    Frame {
        offset,
        inner,
        outer,
        level: 0.0,
        rim2: 0.0,
        side2: 0.0,
        side: [f64::INFINITY, f64::NEG_INFINITY],
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
        centre: 0.0,
        radius: 1.0,
        zone: [f64::INFINITY, f64::NEG_INFINITY],
        shell: Shell {
            centre_z: 0.0,
            inner: 0.0,
            outer: 0.0,
        },
        side_radius: 0.0,
        dome_mode: 0.0,
        flat_mode: [mode::NOTHING; 9],
        most: f64::INFINITY,
        orders: [1.0; 2],
    }
}

/// The edge that a surface is.
fn edge_of(surface: &ReadySurface) -> Option<&Edge> {
    match &surface.shape {
        Shape::Edge(edge) => Some(edge),
        _ => None,
    }
}

/// A cap above its equator over an upright side of its own rim, or no side.
fn convex(frame: &Frame, side: bool) -> bool {
    let below = frame.zone[0] - frame.centre;
    let rim2 = frame.radius * frame.radius - below * below;
    !side || (below >= 0.0 && (rim2 - frame.side2).abs() <= 1e-8 * rim2)
}

impl<'a> Convoy<'a> {
    /// The scene as a convoy, if it is one; paths are given up after `most` surfaces.
    pub fn of(scene: &'a Scene, most: u32) -> Option<Self> {
        let list = &scene.instances.list;
        let prototype = list.first()?.prototype;
        // What stands among the instances, and what stands in it, is no copy of them.
        let alike =
            list.iter().all(|other| other.prototype == prototype) && scene.among().is_none();
        let mut slots = scene.slots.iter();
        let inside = slots.all(|slot| matches!(slot.place, Place::Inside { medium: 0, .. }));
        let body = &scene.bodies[prototype as usize];
        let ([medium], false) = (&body.media[..], scene.world.absorption > 0.0) else {
            return None;
        };
        let members = Members::of(&body.surfaces)?;
        if !alike || !inside {
            return None;
        }

        let mut frame = empty(scene.offset(), members.dome.indices);
        frame.most = f64::from(most);
        let mut pieces = Vec::new();
        let (dome, convex, opening) = match &members.dome.shape {
            Shape::Sphere(sphere) => {
                (frame.centre, frame.radius, frame.zone) = sphere.ball();
                let zones = 0..members.dome.shape.parts() as u32;
                pieces.extend(zones.map(|zone| Piece::new(members.dome, zone, [0.0; 3])));
                (
                    Dome::Round(Zones::new(sphere.cuts(), frame.zone)),
                    true,
                    true,
                )
            }
            Shape::Revolution(relief) => {
                frame.shell = relief.shell();
                for (number, edge) in (0..).zip(relief.edges()) {
                    pieces.push(Piece::new(members.dome, number, edge.line()));
                }
                let dome = relief
                    .stairs()
                    .and_then(Ladder::new)
                    .map_or(Dome::Relief(relief), Dome::Stairs);
                (dome, false, relief.opening())
            }
            _ => return None,
        };
        let deck = set_orders(&mut frame, &mut pieces);
        frame.dome_mode = pieces[0].mode;
        let varied = pieces
            .iter()
            .any(|piece| (piece.mode - pieces[0].mode).abs() > 0.0);
        let bottom = pieces.len();
        let (level, rim) = edge_of(members.bottom)?.disc_facing_up()?;
        (frame.level, frame.rim2) = (level, rim * rim);
        pieces.push(Piece::new(members.bottom, 0, [0.0, 1.0, level]));
        if let Some(surface) = members.side {
            let (radius, heights) = edge_of(surface)?.cylinder_facing_out()?;
            (frame.side2, frame.side) = (radius * radius, heights);
            frame.side_radius = radius;
            pieces.push(Piece::new(surface, 0, [1.0, 0.0, radius]));
        }
        // Their tangents are not those of a dome.
        for piece in &mut pieces[bottom..] {
            piece.draw_alone();
        }
        frame.flat_mode[1..=pieces.len() - bottom]
            .iter_mut()
            .zip(&pieces[bottom..])
            .for_each(|(mode, piece)| *mode = piece.mode);
        let faces = pieces.len() as f64 - flat::FACE;
        if let Some(surface) = members.solid {
            add_box(&mut frame, &mut pieces, surface)?;
        }
        Some(Self {
            scene,
            dome,
            pieces,
            flats: [bottom as f64 - flat::BOTTOM, faces],
            absorption: medium.absorption,
            medium_line: medium.line,
            varied,
            deck,
            exit: Exit {
                departs: if convex && self::convex(&frame, members.side.is_some()) {
                    Departs::Always
                } else if opening {
                    Departs::Opening
                } else {
                    Departs::Unknown
                },
                alone: list.len() == 1 && scene.ground.surfaces.is_empty(),
                clearance: Clearance::of(scene, level),
            },
            frame,
        })
    }
}

/// The tables of a dome, whose indices it notes; `None` if it has none, or if they have different indices or do not fit together, when each is asked by
/// itself.
fn set_orders<'a>(frame: &mut Frame, pieces: &mut [Piece<'a>]) -> Option<OrderDeck<'a>> {
    let indices = |table: &OrderTable| Side::BOTH.map(|side| table.grid().index(side));
    let all: Vec<[f64; 2]> = pieces.iter().filter_map(|p| p.table).map(indices).collect();
    frame.orders = *all.first()?;
    let mut pairs = all.iter().flatten().zip(frame.orders.iter().cycle());
    let deck = pairs
        .all(|(a, b)| a.to_bits() == b.to_bits())
        .then(|| OrderDeck::new(pieces.iter().map(|piece| piece.table).collect()))
        .flatten();
    if deck.is_none() {
        for piece in pieces {
            piece.draw_alone();
        }
    }
    deck
}

fn add_box<'a>(
    frame: &mut Frame,
    pieces: &mut Vec<Piece<'a>>,
    surface: &'a ReadySurface,
) -> Option<()> {
    let Shape::Cuboid(cuboid) = &surface.shape else {
        return None;
    };
    let [low, high] = cuboid.corners();
    (frame.low, frame.high) = (low.to_array(), high.to_array());
    for face in 0..6 {
        let mut piece = Piece::new(surface, face, [0.0; 3]);
        piece.draw_alone();
        frame.flat_mode[flat::FACE as usize + face as usize] = piece.mode;
        pieces.push(piece);
    }
    Some(())
}
