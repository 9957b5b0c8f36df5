// SPDX-License-Identifier: MIT OR Apache-2.0
//! DXF (release 12, ASCII) of the meridian for the tool maker: lines and true arcs in the plane x =
//! r, y = z, in millimetres, one layer for each kind of piece.

use std::io::Write;

use anyhow::Result;

use geometry::{Curve, Meridian, Role};

use super::{Writer, Writes};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "dxf",
    help: "CAD: DXF of the meridian, .dxf",
    endings: &["dxf"],
    writes: Writes::Meridian(|meridian, about, file| write(meridian, about, file)),
};

/// The layer of a kind of piece.
pub fn layer(role: Role) -> &'static str {
    match role {
        Role::Element(_) => "RELIEF",
        Role::Rest => "SPHERE",
        Role::Cylinder => "CYLINDER",
        Role::Stated => "MERIDIAN",
    }
}

/// Writes the pieces of `meridian`, and the bottom and the axis on layers of their own.
pub fn write(meridian: &Meridian, about: &str, file: &mut (impl Write + ?Sized)) -> Result<()> {
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
    line("AXIS", [0.0, 0.0], [0.0, meridian.top_mm()])?;
    line("BOTTOM", [0.0, 0.0], meridian.end_mm())?;
    for piece in &meridian.pieces {
        if piece.curve == Curve::Line {
            line(layer(piece.role), piece.start, piece.end)?;
        }
    }
    for piece in &meridian.pieces {
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
            "0\nARC\n8\n{}\n10\n{centre_r:.9}\n20\n{centre_z:.9}\n30\n0.0\n40\n{radius_mm:.9}\n50\n{:.9}\n51\n{:.9}\n",
            layer(piece.role),
            degrees(from),
            degrees(to)
        )?;
    }
    write!(file, "0\nENDSEC\n0\nEOF\n")?;
    Ok(())
}
