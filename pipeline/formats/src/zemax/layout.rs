// SPDX-License-Identifier: MIT OR Apache-2.0
//! Zemax tabular BSDF (`.bsdf`): one scatter type over sample rotations, incidences and scatter
//! angles.
//!
//! In: the text of a file, or a [`ZemaxBsdf`]. Out: the other. Scatter angles are relative to the
//! specular direction: radial from it, azimuth 0 towards the normal. `AngleOfIncidence` is the
//! angle of the specular direction, reflected or transmitted, to the normal. Values are in 1/sr;
//! `TIS` is the total integrated scatter, power per incident power. Sources of the layout: the
//! vendor's support article on BSDF data files, and the sample files of the public converter
//! `ansys/optical-automation`. A file states neither the side of incidence nor the wavelength.

use crate::text::{
    FormatError, Tokens, check_line_ends, leading_comments, push_angles, push_comments, push_rows,
    quoted, scatter_type,
};
use bsdf::Transport;
use std::fmt::Write as _;
use std::io::{self, Write};

/// Symmetry of the scattering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// Isotropic, and symmetric about the plane of incidence: azimuths 0 to 180.
    PlaneSymmetrical,
    /// Isotropic, azimuths 0 to 360.
    Asymmetrical,
    /// Depends on the rotation of the sample.
    Asymmetrical4D,
}

const SYMMETRIES: [(&str, Symmetry); 3] = [
    ("PlaneSymmetrical", Symmetry::PlaneSymmetrical),
    ("ASymmetrical", Symmetry::Asymmetrical),
    ("ASymmetrical4D", Symmetry::Asymmetrical4D),
];

/// Headings of the three parts of a file with `SpectralContent XYZ`.
const COLOURS: [&str; 3] = ["TristimulusX", "TristimulusY", "TristimulusZ"];

/// Values of one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Power scattered per incident power, shape (rotation, incidence).
    pub tis: Vec<f64>,
    /// BSDF in 1/sr, shape (rotation, incidence, azimuth, radial).
    pub values: Vec<f64>,
}

/// The content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ZemaxBsdf {
    /// Lines before the data, written as comments.
    pub comments: Vec<String>,
    /// Reflected or transmitted.
    pub transport: Transport,
    /// Symmetry.
    pub symmetry: Symmetry,
    /// Rotations of the sample about its normal, degrees.
    pub rotations: Vec<f64>,
    /// Angles of the specular direction, degrees from the normal.
    pub incidences: Vec<f64>,
    /// Azimuths about the specular direction, degrees.
    pub azimuths: Vec<f64>,
    /// Angles from the specular direction, degrees.
    pub radials: Vec<f64>,
    /// One for `Monochrome`; X, Y, Z for `XYZ`.
    pub channels: Vec<Channel>,
}

impl ZemaxBsdf {
    /// The channel that stands for power: the only one, or Y.
    pub fn power_channel(&self) -> &Channel {
        &self.channels[self.channels.len() / 2]
    }

    /// Number of values in one channel.
    pub fn values_per_channel(&self) -> usize {
        let lists = [&self.rotations, &self.incidences, &self.azimuths, &self.radials];
        lists.iter().fold(1, |n, l| n.saturating_mul(l.len()))
    }
}

/// Reads the text of a file.
///
/// # Errors
/// If it is not of this layout; several kinds of line end; NaN, infinite or negative values; angles
/// out of order; a power above 1.
pub fn read(text: &str) -> Result<ZemaxBsdf, FormatError> {
    check_line_ends(text)?;
    let comments = leading_comments(text);
    let mut words = Tokens::new(text, true);
    let (mut transport, mut symmetry, mut names) = (None, None, None);
    let [mut rotations, mut incidences, mut azimuths, mut radials] = [const { Vec::new() }; 4];
    loop {
        let line = words.line();
        let keyword = words.peek().unwrap_or_default().to_ascii_lowercase();
        if keyword == "monochrome" || keyword == "tristimulusx" {
            break;
        }
        let word = words.word("a keyword of the header or Monochrome")?;
        match keyword.as_str() {
            "source" => drop(words.word("the kind of source")?),
            "symmetry" => symmetry = Some(SYMMETRIES[words.one_of(&SYMMETRIES.map(|s| s.0))?].1),
            "spectralcontent" => {
                let all = [&["Monochrome"][..], &COLOURS[..]];
                names = Some(all[words.one_of(&["Monochrome", "XYZ"])?]);
            }
            "scattertype" => transport = Some(words.scatter_type()?),
            "samplerotation" => rotations = words.angles("SampleRotation", 0.0, 360.0)?,
            "angleofincidence" => incidences = words.angles("AngleOfIncidence", 0.0, 90.0)?,
            "scatterazimuth" => azimuths = words.angles("ScatterAzimuth", 0.0, 360.0)?,
            "scatterradial" => radials = words.angles("ScatterRadial", 0.0, 180.0)?,
            _ => {
                let expected = "a keyword of a Zemax BSDF file";
                return Err(FormatError::line(line, expected, quoted(word)));
            }
        }
    }
    let line = words.line();
    let missing = |name: &str| FormatError::line(line, format!("{name} before the data"), "none");
    if rotations.is_empty() {
        rotations.push(0.0);
    }
    for (name, list) in [
        ("AngleOfIncidence", &incidences),
        ("ScatterAzimuth", &azimuths),
        ("ScatterRadial", &radials),
    ] {
        if list.is_empty() {
            return Err(missing(name));
        }
    }
    let mut bsdf = ZemaxBsdf {
        comments,
        transport: transport.ok_or_else(|| missing("ScatterType"))?,
        symmetry: symmetry.ok_or_else(|| missing("Symmetry"))?,
        rotations,
        incidences,
        azimuths,
        radials,
        channels: Vec::new(),
    };
    for name in names.ok_or_else(|| missing("SpectralContent"))? {
        words.one_of(&[name])?;
        let channel = channel(&bsdf, &mut words)?;
        bsdf.channels.push(channel);
    }
    words.end("the end of the file after DataEnd")?;
    Ok(bsdf)
}

fn channel(bsdf: &ZemaxBsdf, words: &mut Tokens<'_>) -> Result<Channel, FormatError> {
    words.one_of(&["DataBegin"])?;
    let max = words.at_most();
    let block = bsdf.azimuths.len() * bsdf.radials.len();
    let mut channel =
        Channel { tis: Vec::new(), values: Vec::with_capacity(bsdf.values_per_channel().min(max)) };
    for _ in 0..bsdf.rotations.len() * bsdf.incidences.len() {
        words.one_of(&["TIS"])?;
        channel.tis.push(words.total_scatter()?);
        channel.values.extend(words.values("a BSDF value", block)?);
    }
    words.one_of(&["DataEnd"])?;
    Ok(channel)
}

/// Writes a file.
///
/// # Errors
/// If the writer fails.
pub fn write(bsdf: &ZemaxBsdf, writer: &mut impl Write) -> io::Result<()> {
    let mut text = String::new();
    push_comments(&mut text, &bsdf.comments);
    let symmetry = SYMMETRIES.iter().find(|s| s.1 == bsdf.symmetry).map_or("", |s| s.0);
    let (content, names) = if bsdf.channels.len() == 3 {
        ("XYZ", &COLOURS[..])
    } else {
        ("Monochrome", &["Monochrome"][..])
    };
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "Source  Measured\nSymmetry  {symmetry}\nSpectralContent  {content}\nScatterType  {}\n",
        scatter_type(bsdf.transport)
    );
    push_angles(&mut text, "SampleRotation", &bsdf.rotations);
    push_angles(&mut text, "AngleOfIncidence", &bsdf.incidences);
    push_angles(&mut text, "ScatterAzimuth", &bsdf.azimuths);
    push_angles(&mut text, "ScatterRadial", &bsdf.radials);
    text.push('\n');
    let block = bsdf.azimuths.len() * bsdf.radials.len();
    for (name, channel) in names.iter().zip(&bsdf.channels) {
        let _ = writeln!(text, "{name}\nDataBegin");
        for (tis, values) in channel.tis.iter().zip(channel.values.chunks_exact(block)) {
            let _ = writeln!(text, "TIS {tis:.9}");
            push_rows(&mut text, values, bsdf.radials.len());
            writer.write_all(text.as_bytes())?;
            text.clear();
        }
        text.push_str("DataEnd\n");
    }
    writer.write_all(text.as_bytes())
}
