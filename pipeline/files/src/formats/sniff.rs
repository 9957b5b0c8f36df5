// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a file seems to be, by its first bytes, and what its ending says.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result};
use bsdf::formats::text::{Tokens, utf8};
use tracer::formats::{photometric_text, speos_rays, zemax_rays};

use crate::cache::EXTENSION;

/// Bytes of a file that are looked at.
const START: u64 = 1 << 16;

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Native table of diffraction orders.
    Orders,
    /// The same as JSON.
    OrdersJson,
    /// The same for NumPy.
    OrdersNpz,
    /// Zemax tabular BSDF.
    Zemax,
    /// LightTools BSDF.
    LightTools,
    /// XML of WINDOW and Radiance.
    Window,
    /// Speos BSDF, anisotropic or by wavelengths.
    Speos,
    /// IES LM-63.
    Ies,
    /// EULUMDAT.
    Ldt,
    /// TM-25 rays.
    Tm25,
    /// LightTools rays.
    LightToolsRays,
    /// Speos rays.
    SpeosRays,
    /// Zemax rays.
    ZemaxRays,
}

/// All formats with their names and endings.
const KINDS: [(Kind, &str, &[&str]); 13] = [
    (Kind::Orders, "a native table of orders", &[EXTENSION]),
    (Kind::OrdersJson, "a table of orders as JSON", &["json"]),
    (Kind::OrdersNpz, "a NumPy archive", &["npz"]),
    (Kind::LightTools, "a LightTools BSDF", &["bsdf", "txt"]),
    (Kind::Zemax, "a Zemax tabular BSDF", &["bsdf", "txt"]),
    (Kind::Window, "a WINDOW/Radiance BSDF", &["xml"]),
    (Kind::Speos, "a Speos BSDF", &["anisotropicbsdf", "brdf"]),
    (Kind::Ies, "IES LM-63", &["ies"]),
    (Kind::Ldt, "EULUMDAT", &["ldt"]),
    (Kind::Tm25, "a TM-25 ray file", &["tm25ray"]),
    (Kind::LightToolsRays, "a LightTools ray file", &["ray"]),
    (Kind::SpeosRays, "a Speos ray file", &["ray"]),
    (Kind::ZemaxRays, "a Zemax ray file", &["dat", "sdf"]),
];

/// Files of other kinds, by what they begin with.
const OTHERS: [(&[u8], &str); 9] = [
    (b"\x89PNG", "a PNG picture"),
    (b"\x76\x2f\x31\x01", "an EXR picture"),
    (b"%PDF", "a PDF document"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"Rar!", "a RAR archive"),
    (b"\x93NUMPY", "a single NumPy array"),
    (b"solid", "an STL geometry"),
    (b"OPTIS", "a Speos file of another kind"),
];

/// What a file seems to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guess {
    /// A format that is read.
    Format(Kind),
    /// Something else, in words.
    Other(&'static str),
}

impl Kind {
    /// In words.
    pub fn name(self) -> &'static str {
        self.entry().1
    }

    /// Its usual ending.
    fn ending(self) -> &'static str {
        self.entry().2[0]
    }

    fn entry(self) -> &'static (Kind, &'static str, &'static [&'static str]) {
        let found = KINDS.iter().find(|entry| entry.0 == self);
        found.unwrap_or(&KINDS[0])
    }
}

/// The formats that the ending of `path` stands for, the usual one first.
fn by_ending(path: &Path) -> Vec<Kind> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let ending = ending.to_ascii_lowercase();
    let fitting = KINDS.iter().filter(|k| k.2.contains(&ending.as_str()));
    fitting.map(|k| k.0).collect()
}

/// Every ending that is read.
pub fn endings() -> String {
    let mut all: Vec<String> = Vec::new();
    for ending in KINDS.iter().flat_map(|k| k.2) {
        let ending = format!(".{ending}");
        if !all.contains(&ending) {
            all.push(ending);
        }
    }
    let last = all.pop().unwrap_or_default();
    format!("{} or {last}", all.join(", "))
}

/// The format of the file at `path`: the one of its ending that its content fits, or that of its
/// content where the ending says nothing.
///
/// # Errors
/// A file that cannot be opened, one whose content is of another format than its ending says, or
/// one of no format that is read; the message names what it seems to be.
pub fn kind(path: &Path) -> Result<Kind> {
    let file = File::open(path)
        .context("expected a table, a far field, rays or scattering, cannot open it")?;
    let length = file.metadata().context("cannot look at it")?.len();
    let mut start = Vec::new();
    file.take(START).read_to_end(&mut start).context("cannot read it")?;
    let kinds = by_ending(path);
    match (kinds.first(), guess(&start, length)) {
        (Some(_), Some(Guess::Format(found))) if kinds.contains(&found) => Ok(found),
        (None, Some(Guess::Format(found))) => Ok(found),
        (Some(first), None) => Ok(*first),
        (Some(_), Some(Guess::Format(found))) => {
            let (expected, found, ending) = (names(&kinds), found.name(), found.ending());
            anyhow::bail!(
                "expected {expected}, as its ending says, got what seems to be {found}: the ending .{ending} reads it"
            )
        }
        (Some(_), Some(Guess::Other(found))) => {
            anyhow::bail!("expected {}, got what seems to be {found}", names(&kinds))
        }
        (None, other) => {
            let found = match other {
                Some(Guess::Other(found)) => format!("what seems to be {found}"),
                _ => "content that is none of them".to_owned(),
            };
            anyhow::bail!("expected a file ending in {}, got {found}", endings())
        }
    }
}

fn names(kinds: &[Kind]) -> String {
    let names: Vec<&str> = kinds.iter().map(|k| k.name()).collect();
    names.join(" or ")
}

/// What a file of `length` bytes that begins with `start` seems to be.
pub fn guess(start: &[u8], length: u64) -> Option<Guess> {
    let format = |kind| Some(Guess::Format(kind));
    let marks: [(&[u8], Kind); 4] = [
        (b"BWORDERS", Kind::Orders),
        (b"PK\x03\x04", Kind::OrdersNpz),
        (b"TM25", Kind::Tm25),
        (b"LTRF", Kind::LightToolsRays),
    ];
    if let Some((_, kind)) = marks.iter().find(|(mark, _)| start.starts_with(mark)) {
        return format(*kind);
    }
    let identifier = start.first_chunk().map(|four| u32::from_le_bytes(*four));
    if identifier.is_some_and(|found| zemax_rays::IDENTIFIERS.contains(&found)) {
        return format(Kind::ZemaxRays);
    }
    if let Some(kind) = speos_text(start) {
        return format(kind);
    }
    if let Some((_, name)) = OTHERS.iter().find(|(mark, _)| start.starts_with(mark)) {
        return Some(Guess::Other(name));
    }
    if speos_rays::begins_like_one(start, length) {
        return format(Kind::SpeosRays);
    }
    let text = photometric_text(start).ok()?;
    photometry(&text).map(Guess::Format).or_else(|| {
        // The start may end within a character.
        let whole = utf8(start).ok()?;
        markup(whole).or_else(|| scatter(whole).map(Guess::Format))
    })
}

/// Speos BSDFs by their first line.
fn speos_text(start: &[u8]) -> Option<Kind> {
    let line = start.split(|b| matches!(b, b'\r' | b'\n')).next()?;
    let line = String::from_utf8_lossy(line).to_ascii_lowercase();
    let known = ["optis - anisotropic bsdf", "optis - brdf"];
    known.iter().any(|mark| line.starts_with(mark)).then_some(Kind::Speos)
}

/// Photometric files: a line `TILT=`, or the numbers of the first lines of EULUMDAT.
fn photometry(text: &str) -> Option<Kind> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let lines: Vec<&str> = text.split(end).map(str::trim).take(64).collect();
    if lines.iter().any(|line| line.starts_with("TILT=")) || lines[0].starts_with("IESNA") {
        return Some(Kind::Ies);
    }
    let whole = |number: usize| -> Option<f64> {
        let value: f64 = lines.get(number - 1)?.parse().ok()?;
        (value.fract() == 0.0).then_some(value)
    };
    let ranges = [(2, 0.0, 3.0), (3, 0.0, 4.0), (4, 1.0, 721.0), (6, 2.0, 1e4)];
    let fits = ranges
        .iter()
        .all(|&(line, low, high)| whole(line).is_some_and(|v| (low..=high).contains(&v)));
    // Lines 13 to 21 are lengths.
    let lengths = lines.get(12..21)?;
    (fits && lengths.iter().all(|l| l.parse::<f64>().is_ok())).then_some(Kind::Ldt)
}

/// XML and JSON.
fn markup(text: &str) -> Option<Guess> {
    let start = text.trim_start();
    if start.starts_with('<') {
        return [
            ("<WindowElement", Guess::Format(Kind::Window)),
            ("<svg", Guess::Other("an SVG picture")),
            ("<html", Guess::Other("a page of HTML")),
        ]
        .into_iter()
        .find_map(|(mark, guess)| start.contains(mark).then_some(guess));
    }
    let orders = start.starts_with('{') && start.contains(bsdf::formats::order_json::NAME);
    orders.then_some(Guess::Format(Kind::OrdersJson))
}

/// Tables of Zemax and LightTools by their keywords.
fn scatter(text: &str) -> Option<Kind> {
    let first = Tokens::new(text, true).take().unwrap_or_default();
    let has = |words: [&str; 2]| words.iter().any(|word| text.contains(word));
    if first.eq_ignore_ascii_case("Source") || has(["AngleOfIncidence", "SampleRotation"]) {
        Some(Kind::Zemax)
    } else if has(["ScatterAzimuth", "ScatterRadial"]) {
        Some(Kind::LightTools)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bytes_tell_formats_apart() {
        let speos = {
            let row = [0.0_f32, 0.0, 0.0, 0.0, 0.0, 1.0, 550.0, 1.0];
            let header = [1.0_f32, 2.0, 2.0, 2.0, 2.0, 2.0, 555.0];
            let all = header.iter().chain(&row);
            all.flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()
        };
        let zemax = [&1010_u32.to_le_bytes()[..], &[0; 204]].concat();
        let ldt = format!("x\n1\n1\n1\n0\n2\n90\n{}", "0\n".repeat(30));
        for (bytes, expected) in [
            (&speos[..], Some(Guess::Format(Kind::SpeosRays))),
            (&speos[..59], None),
            (&zemax, Some(Guess::Format(Kind::ZemaxRays))),
            (ldt.as_bytes(), Some(Guess::Format(Kind::Ldt))),
            (b"IESNA91\n[TEST] x", Some(Guess::Format(Kind::Ies))),
            (b"x\nTILT=NONE\n", Some(Guess::Format(Kind::Ies))),
            (b"OPTIS - brdf surface file v8.0\n0", Some(Guess::Format(Kind::Speos))),
            (b"<?xml?><WindowElement>", Some(Guess::Format(Kind::Window))),
            (b"<svg/>", Some(Guess::Other("an SVG picture"))),
            (b"ScatterAzimuth 2\n0 180", Some(Guess::Format(Kind::LightTools))),
            (b"# x\nSource Measured", Some(Guess::Format(Kind::Zemax))),
            (b"\x89PNG\r\n", Some(Guess::Other("a PNG picture"))),
            (b"name = \"x\"\n", None),
            (b"", None),
        ] {
            let got = guess(bytes, bytes.len() as u64);
            assert_eq!(got, expected, "{:?}", String::from_utf8_lossy(bytes));
        }
    }
}
