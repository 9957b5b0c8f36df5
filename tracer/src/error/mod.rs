// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors of the tracer: one variant for each cause, with what was expected and what was found.

mod mesh;

pub use mesh::MeshError;

use thiserror::Error;

/// An error of a shape, a scene, a receiver, a file or a run.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A number is NaN, infinite, or outside of its range.
    #[error("{what}: expected {expected}, got {got}")]
    Number {
        /// The quantity, with its unit.
        what: String,
        /// The range that is allowed.
        expected: &'static str,
        /// The value found.
        got: f64,
    },
    /// A surface has another number of optical parts than its shape has zones.
    #[error("surface '{surface}': its shape has {expected} parts, got optics for {got}")]
    Patches {
        /// Name of the first part of the surface.
        surface: String,
        /// Number of zones of the shape.
        expected: usize,
        /// Number of parts given.
        got: usize,
    },
    /// A meridian of a body of revolution is no curve.
    #[error("meridian: {0}")]
    Meridian(String),
    /// Triangles are not the surface of a solid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A surface refers to a region which its prototype (or the world) does not have.
    #[error(
        "surface '{surface}': region {region} does not exist here ({available} media are defined)"
    )]
    Region {
        /// Name of the first part of the surface.
        surface: String,
        /// The region asked for.
        region: String,
        /// Number of media of the prototype.
        available: usize,
    },
    /// Light would have to pass into an opaque region.
    #[error("surface '{surface}': '{optics}' needs a medium on both sides, but one side is opaque")]
    OpaqueSide {
        /// Name of the part.
        surface: String,
        /// The kind of optics.
        optics: &'static str,
    },
    /// A scattering table was made for other refractive indices than those of the scene.
    #[error(
        "surface '{surface}': the scattering table is for index {table} on the {side} side, the \
            medium there has {medium}"
    )]
    IndexMismatch {
        /// Name of the part.
        surface: String,
        /// `inner` or `outer`.
        side: &'static str,
        /// Index in the table.
        table: f64,
        /// Index of the medium of the scene.
        medium: f64,
    },
    /// Two instances share space.
    #[error(
        "packages overlap: instances {} and {} are {} mm apart, they need at least {} mm",
        first + 1, second + 1, rounded(*distance_mm), rounded(*needed_mm)
    )]
    Overlap {
        /// Index of one instance, from 0; messages count from 1.
        first: usize,
        /// Index of the other, from 0.
        second: usize,
        /// Distance of their axes, mm.
        distance_mm: f64,
        /// Smallest distance that is allowed, mm.
        needed_mm: f64,
    },
    /// Two solids of one body share space.
    #[error(
        "'{first}' and '{second}' cut each other near {} mm: {}",
        place(at_mm),
        match depth_mm {
            Some((depth, axis)) => {
                format!("they overlap by up to {} mm along {axis}", rounded(*depth))
            }
            None => format!("there lies {} by the one and {} by the other", regions[0], regions[1]),
        }
    )]
    Crossing {
        /// Name of one surface.
        first: String,
        /// Name of the other.
        second: String,
        /// A place where they claim the same space, in the frame of the body, mm.
        at_mm: [f64; 3],
        /// Regions that lie there by the first and by the second.
        regions: Box<[String; 2]>,
        /// Shortest way along an axis by which one leaves the box around the other, mm, and that
        /// axis; `None` where one is no solid.
        depth_mm: Option<(f64, &'static str)>,
    },
    /// An array solid holds only a part of an instance.
    #[error(
        "instance {} lies in {} and near {} mm in {}: expected a solid to hold all of it \
            or nothing of it", instance + 1, regions[0], place(at_mm), regions[1]
    )]
    Straddles {
        /// Index of the instance, from 0; messages count from 1.
        instance: usize,
        /// A place where it lies in something else than elsewhere, mm.
        at_mm: [f64; 3],
        /// Region of most of it, and the region there.
        regions: [String; 2],
    },
    /// An instance stands in a solid that light does not enter.
    #[error("instance {} stands within '{surface}', which light does not enter", instance + 1)]
    InOpaque {
        /// Index of the instance, from 0; messages count from 1.
        instance: usize,
        /// Name of the solid.
        surface: String,
    },
    /// A body reaches below the ground.
    #[error(
        "instance {} reaches down to z = {} mm, below the ground at z = {} mm",
        instance + 1, rounded(*low_mm), rounded(*ground_mm)
    )]
    BelowGround {
        /// Index of the instance, from 0; messages count from 1.
        instance: usize,
        /// Lowest point, mm.
        low_mm: f64,
        /// Height of the ground, mm.
        ground_mm: f64,
    },
    /// A body reaches into a solid of the world.
    #[error(
        "instance {} reaches into '{surface}', which begins {} mm from its axis",
        instance + 1, rounded(*away_mm)
    )]
    IntoWall {
        /// Index of the instance, from 0; messages count from 1.
        instance: usize,
        /// Name of the solid.
        surface: String,
        /// Distance of its nearest point from the axis of the instance, mm.
        away_mm: f64,
    },
    /// A source does not lie in the region that it claims to emit into.
    #[error(
        "source '{source_name}' does not lie in {region}: the first surface it sees, '{surface}', \
            faces it from another side"
    )]
    SourceOutside {
        /// Name of the source.
        source_name: String,
        /// The region claimed.
        region: String,
        /// The surface met first.
        surface: String,
    },
    /// A source lies in a surface and emits into it.
    #[error(
        "source '{source_name}' lies in the surface of '{surface}' and emits into it: expected \
            one off the surface, or one that faces away from it"
    )]
    SourceInSurface {
        /// Name of the source.
        source_name: String,
        /// The surface.
        surface: String,
    },
    /// A ray of a set does not start in the region that its source claims.
    #[error(
        "source '{source_name}': ray {ray} starts at {at_mm:?} mm: expected a start in {region}, \
            got one from which {seen}"
    )]
    RayOutside {
        /// Name of the source.
        source_name: String,
        /// Number of the ray, from 1, in the order in which the set was given.
        ray: usize,
        /// Start point in the frame of its body or of the world, mm.
        at_mm: [f64; 3],
        /// The region claimed.
        region: String,
        /// Surface that the ray meets first.
        seen: String,
    },
    /// Light can run out of a body without meeting a surface.
    #[error(
        "body around source '{source_name}' is not closed: a ray leaves {region} without meeting \
            a surface"
    )]
    OpenBody {
        /// Name of the source.
        source_name: String,
        /// The region that is open.
        region: String,
    },
    /// A scene without anything that emits.
    #[error("the scene has no source of light")]
    NoSource,
    /// An array of sources, instances or zones that must not be empty.
    #[error("{what}: expected at least {expected}, got {got}")]
    TooFew {
        /// Quantity of which there is too little.
        what: &'static str,
        /// The smallest number allowed.
        expected: usize,
        /// The number found.
        got: usize,
    },
    /// A receiver cuts through a body.
    #[error(
        "plane receiver at z = {height_mm} mm: expected a height above the packages, whose top is \
            at {top_mm} mm"
    )]
    ReceiverTooLow {
        /// Height of the receiver, mm.
        height_mm: f64,
        /// Highest point of all bodies, mm.
        top_mm: f64,
    },
    /// A rectangle in the air cuts a body or a wall.
    #[error(
        "receiver '{receiver}': expected a rectangle that cuts nothing, got one through what \
            stands from {low_mm:?} to {high_mm:?} mm"
    )]
    ReceiverCuts {
        /// Name of the receiver.
        receiver: String,
        /// Lower corner of what it cuts, mm.
        low_mm: [f64; 3],
        /// Upper corner, mm.
        high_mm: [f64; 3],
    },
    /// A rectangle lies in a face, where the order of the two is left to rounding.
    #[error(
        "receiver '{receiver}': expected a rectangle more than {apart_mm:.1e} mm off all faces \
            that it overlaps, got one in the plane of '{surface}'"
    )]
    ReceiverInFace {
        /// Name of the receiver.
        receiver: String,
        /// The surface.
        surface: String,
        /// Distance above which they are told apart, mm.
        apart_mm: f64,
    },
    /// A sheet lies in the plane of a face that it shares area with.
    #[error(
        "'{sheet}' lies in the plane of '{surface}', which it overlaps: expected a sheet more than \
            {apart_mm:.1e} mm off it, as rounding would decide which of the two light meets"
    )]
    SheetInFace {
        /// Name of the sheet.
        sheet: String,
        /// Name of the surface with the face.
        surface: String,
        /// Distance above which they are told apart, mm.
        apart_mm: f64,
    },
    /// A rectangle lies where a source emits.
    #[error(
        "receiver '{receiver}': expected a rectangle more than {apart_mm:.1e} mm off all that \
            emits, got one in which source '{source_name}' does"
    )]
    ReceiverInSource {
        /// Name of the receiver.
        receiver: String,
        /// Name of the source.
        source_name: String,
        /// Distance above which they are told apart, mm.
        apart_mm: f64,
    },
    /// A receiver asks for a surface that the scene does not have.
    #[error("receiver '{receiver}': expected one of the surfaces {known}; got '{surface}'")]
    NoSurface {
        /// Name of the receiver.
        receiver: String,
        /// The surface asked for.
        surface: String,
        /// The surfaces of the scene.
        known: String,
    },
    /// A receiver asks for a source that the scene does not have.
    #[error("receiver '{receiver}': expected a source from 1 to {sources}, got {source_number}")]
    NoSuchSource {
        /// Name of the receiver.
        receiver: String,
        /// The source asked for, from 1.
        source_number: usize,
        /// Number of sources of the scene.
        sources: usize,
    },
    /// A bin width that does not divide its range.
    #[error(
        "{what}: expected a width that divides {range} degrees into whole bins, got {got} degrees"
    )]
    BinWidth {
        /// Name of the bins.
        what: &'static str,
        /// The range to divide, degrees.
        range: f64,
        /// The width, degrees.
        got: f64,
    },
    /// Something that a file of another program holds and this program cannot use.
    #[error("{0}")]
    Format(String),
    /// The caller raised the cancellation flag.
    #[error("cancelled")]
    Cancelled,
}

/// A length for people: four significant digits, at least to a picometre.
fn rounded(mm: f64) -> f64 {
    let digits = format!("{mm:.3e}").parse().unwrap_or(mm);
    let fine = (mm * 1e9).round() * 1e-9;
    if fine == 0.0 { 0.0 } else { digits }
}

/// A place for people, to a nanometre.
fn place(at_mm: &[f64; 3]) -> String {
    format!("{:?}", at_mm.map(|v| (v * 1e6).round() / 1e6 + 0.0))
}

/// `value` if it is finite and positive.
pub(crate) fn positive(what: &str, value: f64) -> Result<f64, Error> {
    check(what, value, "a finite number above 0", value > 0.0)
}

/// `value` if it is finite.
pub(crate) fn finite(what: &str, value: f64) -> Result<f64, Error> {
    check(what, value, "a finite number", true)
}

/// `value` if it lies between 0 and 1.
pub(crate) fn fraction(what: &str, value: f64) -> Result<f64, Error> {
    check(what, value, "a number from 0 to 1", (0.0..=1.0).contains(&value))
}

/// `value` if it is finite and `holds`.
pub(crate) fn check(
    what: &str,
    value: f64,
    expected: &'static str,
    holds: bool,
) -> Result<f64, Error> {
    if value.is_finite() && holds {
        Ok(value)
    } else {
        Err(Error::Number { what: what.to_owned(), expected, got: value })
    }
}
