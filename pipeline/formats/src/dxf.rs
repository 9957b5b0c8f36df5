// SPDX-License-Identifier: MIT OR Apache-2.0
//! DXF (release 12, ASCII) of generating curves for the tool maker: lines and true arcs in the plane
//! x = r, y = z, in millimetres, one layer for each kind of piece of the dome and for each solid.

use std::io::Write;

use anyhow::Result;

use geometry::{Curve, Meridian, Role};

use super::body::DOME;
use super::{Writer, Writes};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "dxf",
    help: "CAD: DXF of the meridians, .dxf",
    endings: &["dxf"],
    writes: Writes::Meridians(write),
};

/// The layer of a piece of a body: the kinds of the dome's have one each, other bodies one by name
/// in letters that the release allows.
pub fn layer(body: &str, role: Role) -> String {
    let of_dome = match role {
        Role::Element(_) => "RELIEF",
        Role::Rest => "SPHERE",
        Role::Cylinder => "CYLINDER",
        Role::Stated => "MERIDIAN",
    };
    if body == DOME {
        return of_dome.to_owned();
    }
    let allowed = |letter: char| match letter.to_ascii_uppercase() {
        upper @ ('A'..='Z' | '0'..='9' | '-' | '_') => upper,
        _ => '_',
    };
    // Apart from those of the dome.
    format!("SOLID_{}", body.chars().map(allowed).collect::<String>())
}

/// Writes the pieces of the curves of bodies, that of the dome under [`DOME`]; its bottom and the
/// axis on layers of their own.
pub fn write(curves: &[(String, Meridian)], about: &str, file: &mut dyn Write) -> Result<()> {
    // Comments, the drawing unit millimetre (code 70, value 4), then entities: pairs of a code and
    // a value, each on its line.
    let about = about.replace(['\r', '\n'], " ");
    write!(
        file,
        "999\n{about}\n0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
    )?;
    let mut line = |layer: &str, a: [f64; 2], b: [f64; 2]| {
        write!(
            file,
            "0\nLINE\n8\n{layer}\n10\n{:.9}\n20\n{:.9}\n30\n0.0\n11\n{:.9}\n21\n{:.9}\n31\n0.0\n",
            a[0], a[1], b[0], b[1]
        )
    };
    let top = curves.iter().map(|(_, curve)| curve.top_mm()).fold(0.0, f64::max);
    line("AXIS", [0.0, 0.0], [0.0, top])?;
    for (_, dome) in curves.iter().filter(|(name, _)| name == DOME) {
        line("BOTTOM", [0.0, 0.0], dome.end_mm())?;
    }
    let pieces = || {
        curves.iter().flat_map(|(name, curve)| {
            curve.pieces.iter().map(move |piece| (layer(name, piece.role), piece))
        })
    };
    for (layer, piece) in pieces().filter(|(_, piece)| piece.curve == Curve::Line) {
        line(&layer, piece.start, piece.end)?;
    }
    for (layer, piece) in pieces() {
        let ([centre_r, centre_z], radius_mm) = match piece.curve {
            Curve::Line => continue,
            Curve::Arc { radius_mm, centre_mm } => ([0.0, centre_mm], radius_mm),
            Curve::Bend { radius_mm, centre_mm, .. } => (centre_mm, radius_mm),
        };
        // Counter-clockwise: those that run clockwise from their end to their start.
        let [from, to] =
            if piece.clockwise() { [piece.end, piece.start] } else { [piece.start, piece.end] };
        let degrees = |p: [f64; 2]| (p[1] - centre_z).atan2(p[0] - centre_r).to_degrees();
        write!(
            file,
            "0\nARC\n8\n{layer}\n10\n{centre_r:.9}\n20\n{centre_z:.9}\n30\n0.0\n40\n{radius_mm:.9}\n50\n{:.9}\n51\n{:.9}\n",
            degrees(from),
            degrees(to)
        )?;
    }
    write!(file, "0\nENDSEC\n0\nEOF\n")?;
    Ok(())
}
