// SPDX-License-Identifier: MIT OR Apache-2.0
//! SVG of the meridian: lines and true arcs in the plane x = r, y = z (upwards), one user unit a
//! millimetre and drawn at that size, one group for each kind of piece as the layers of the DXF.

use std::io::Write;

use anyhow::Result;

use geometry::{Curve, Meridian};

use super::dxf::layer;
use super::{Writer, Writes};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "svg",
    help: "CAD: SVG of the meridian, .svg",
    endings: &["svg"],
    writes: Writes::Meridian(|meridian, about, file| write(meridian, about, file)),
};

/// Layers in the order in which they are drawn.
const LAYERS: [&str; 4] = ["RELIEF", "SPHERE", "MERIDIAN", "CYLINDER"];

/// Writes the pieces of `meridian`, and the bottom and the axis in groups of their own.
pub fn write(meridian: &Meridian, about: &str, file: &mut (impl Write + ?Sized)) -> Result<()> {
    let (width, height) = (meridian.radius_mm(), meridian.top_mm());
    let about = about.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // The group turns y upwards.
    write!(
        file,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.9}mm\" height=\"{height:.9}mm\" viewBox=\"0 {:.9} {width:.9} {height:.9}\">\n\
         <title>{about}</title>\n\
         <g transform=\"scale(1,-1)\" fill=\"none\" stroke=\"black\" stroke-width=\"0.002\">\n\
         <g id=\"AXIS\"><path d=\"M 0 0 L 0 {height:.9}\"/></g>\n\
         <g id=\"BOTTOM\"><path d=\"M 0 0 L {:.9} 0\"/></g>\n",
        -height,
        meridian.end_mm()[0]
    )?;
    for name in LAYERS {
        writeln!(file, "<g id=\"{name}\">")?;
        for piece in meridian.pieces.iter().filter(|p| layer(p.role) == name) {
            let ([r, z], [to_r, to_z]) = (piece.start, piece.end);
            write!(file, "<path d=\"M {r:.9} {z:.9} ")?;
            match piece.curve {
                Curve::Line => write!(file, "L")?,
                // The sweep is the sense from x to y: 0 for clockwise, as y goes up.
                Curve::Arc { radius_mm, .. } | Curve::Bend { radius_mm, .. } => {
                    let large = u8::from(piece.sweep() > std::f64::consts::PI);
                    let sweep = u8::from(!piece.clockwise());
                    write!(file, "A {radius_mm:.9} {radius_mm:.9} 0 {large} {sweep}")?;
                }
            }
            writeln!(file, " {to_r:.9} {to_z:.9}\"/>")?;
        }
        writeln!(file, "</g>")?;
    }
    write!(file, "</g>\n</svg>\n")?;
    Ok(())
}
