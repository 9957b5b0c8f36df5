// SPDX-License-Identifier: MIT OR Apache-2.0
//! SVG of generating curves: lines and true arcs in the plane x = r, y = z (upwards), one user unit a
//! millimetre and drawn at that size, one group for each kind of piece as the layers of the DXF.

use std::collections::BTreeMap;
use std::io::Write;

use anyhow::Result;

use geometry::{Curve, Meridian, Piece};

use super::body::DOME;
use super::dxf::layer;
use super::{Writer, Writes};

/// Writes the format.
pub static WRITER: Writer = Writer {
    word: "svg",
    help: "CAD: SVG of the meridians, .svg",
    endings: &["svg"],
    writes: Writes::Meridians(write),
};

/// Writes the pieces of the curves of bodies, that of the dome under [`DOME`]; its bottom and the
/// axis in groups of their own.
pub fn write(curves: &[(String, Meridian)], about: &str, file: &mut dyn Write) -> Result<()> {
    let most = |size: fn(&Meridian) -> f64| curves.iter().map(|(_, c)| size(c)).fold(0.0, f64::max);
    let (width, height) = (most(Meridian::radius_mm), most(Meridian::top_mm));
    let about = about.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    // The group turns y upwards.
    write!(
        file,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.9}mm\" height=\"{height:.9}mm\" viewBox=\"0 {:.9} {width:.9} {height:.9}\">\n\
         <title>{about}</title>\n\
         <g transform=\"scale(1,-1)\" fill=\"none\" stroke=\"black\" stroke-width=\"0.002\">\n\
         <g id=\"AXIS\"><path d=\"M 0 0 L 0 {height:.9}\"/></g>\n",
        -height
    )?;
    for (_, dome) in curves.iter().filter(|(name, _)| name == DOME) {
        let end = dome.end_mm()[0];
        writeln!(file, "<g id=\"BOTTOM\"><path d=\"M 0 0 L {end:.9} 0\"/></g>")?;
    }
    let mut layers: BTreeMap<String, Vec<&Piece>> = BTreeMap::new();
    for (name, curve) in curves {
        for piece in &curve.pieces {
            layers.entry(layer(name, piece.role)).or_default().push(piece);
        }
    }
    for (name, pieces) in layers {
        writeln!(file, "<g id=\"{name}\">")?;
        for piece in pieces {
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
