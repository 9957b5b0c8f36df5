// SPDX-License-Identifier: MIT OR Apache-2.0
//! Format of a file by its first bytes and its ending.

use std::io::Read;
use std::path::Path;

use crate::fields::photometric_text;
use crate::text::utf8;
use anyhow::{Context, Result};

use runtime::bounded_text::open;

use super::{READERS, Reader, endings, listed};

/// Bytes of a file that are looked at.
const START: u64 = 1 << 16;
/// Lines of a photometric file that are looked at.
const LINES: usize = 64;

/// Tests of the first bytes, those that prove most first.
#[derive(Debug, Clone, Copy)]
pub enum Sniff {
    /// Mark at the beginning.
    Mark(fn(&[u8]) -> bool),
    /// Numbers that fit the layout and the length of the file.
    Layout(fn(&[u8], u64) -> bool),
    /// Trimmed lines of text, which may be Latin-1.
    Lines(fn(&[&str]) -> bool),
    /// XML or JSON, from its first character.
    Markup(fn(&str) -> bool),
    /// Keywords of a text.
    Keywords(fn(&str) -> bool),
}

/// Files of other kinds, by their first bytes.
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
/// XML of other kinds, by an element of it.
const OTHER_MARKUP: [(&str, &str); 2] = [("<svg", "an SVG picture"), ("<html", "a page of HTML")];

/// Kind that a file seems to be of: a format that is read, or something else in words.
pub type Guess = Result<&'static Reader, &'static str>;

/// Reader of the file at `path`: the one of its ending that its content fits, or that of its
/// content where the ending says nothing.
///
/// # Errors
/// A file that cannot be opened, one whose content is of another format than its ending says, or
/// one of no format that is read; the message names what it seems to be.
pub fn reader(path: &Path) -> Result<&'static Reader> {
    let file =
        open(path).context("expected a table, a far field, rays or scattering, cannot open it")?;
    let length = file.metadata().context("cannot look at it")?.len();
    let mut start = Vec::new();
    file.take(START).read_to_end(&mut start).context("cannot read it")?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let fitting = || READERS.iter().copied().filter(|r| r.endings.contains(&ending.as_str()));
    let names = || fitting().map(|reader| reader.name).collect::<Vec<_>>().join(" or ");
    match (fitting().next(), guess(&start, length)) {
        (Some(_), Some(Ok(found))) if found.endings.contains(&ending.as_str()) => Ok(found),
        (None, Some(Ok(found))) => Ok(found),
        (Some(first), None) => Ok(first),
        (Some(_), Some(Ok(found))) => anyhow::bail!(
            "expected {}, as its ending says, got what seems to be {}: the ending .{} reads it",
            names(),
            found.name,
            found.endings[0]
        ),
        (Some(_), Some(Err(found))) => {
            anyhow::bail!("expected {}, got what seems to be {found}", names())
        }
        (None, other) => {
            let found = match other {
                Some(Err(found)) => format!("what seems to be {found}"),
                _ => "content that is none of them".to_owned(),
            };
            let all = listed(&endings(|_| true), "or");
            anyhow::bail!("expected a file ending in {all}, got {found}")
        }
    }
}

/// Kind that a file of `length` bytes that begins with `start` seems to be of.
pub fn guess(start: &[u8], length: u64) -> Option<Guess> {
    let first = |fits: &dyn Fn(&Sniff) -> bool| {
        READERS.iter().copied().find(|reader| fits(&reader.sniff)).map(Ok)
    };
    let of_bytes = first(&|sniff| matches!(sniff, Sniff::Mark(fits) if fits(start)))
        .or_else(|| OTHERS.iter().find(|o| start.starts_with(o.0)).map(|o| Err(o.1)))
        .or_else(|| first(&|sniff| matches!(sniff, Sniff::Layout(fits) if fits(start, length))));
    if of_bytes.is_some() {
        return of_bytes;
    }
    let text = photometric_text(start).ok()?;
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let lines: Vec<&str> = text.split(end).map(str::trim).take(LINES).collect();
    first(&|sniff| matches!(sniff, Sniff::Lines(fits) if fits(&lines))).or_else(|| {
        // The start may end within a character.
        let whole = utf8(start).ok()?;
        let markup = whole.trim_start();
        let other = || {
            let found = OTHER_MARKUP.iter().find(|o| markup.contains(o.0))?;
            markup.starts_with('<').then_some(Err(found.1))
        };
        first(&|sniff| matches!(sniff, Sniff::Markup(fits) if fits(markup)))
            .or_else(other)
            .or_else(|| first(&|sniff| matches!(sniff, Sniff::Keywords(fits) if fits(whole))))
    })
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
            (&speos[..], Some("a Speos ray file")),
            (&speos[..59], None),
            (&zemax, Some("a Zemax ray file")),
            (ldt.as_bytes(), Some("EULUMDAT")),
            (b"IESNA91\n[TEST] x", Some("IES LM-63")),
            (b"x\nTILT=NONE\n", Some("IES LM-63")),
            (b"OPTIS - brdf surface file v8.0\n0", Some("a Speos BSDF")),
            (b"<?xml?><WindowElement>", Some("a WINDOW/Radiance BSDF")),
            (b"<svg/>", Some("an SVG picture")),
            (b"ScatterAzimuth 2\n0 180", Some("a LightTools BSDF")),
            (b"# x\nSource Measured", Some("a Zemax tabular BSDF")),
            (b"\x89PNG\r\n", Some("a PNG picture")),
            (b"name = \"x\"\n", None),
            (b"", None),
        ] {
            let got = guess(bytes, bytes.len() as u64);
            let got = got.map(|found| found.map_or_else(|other| other, |reader| reader.name));
            assert_eq!(got, expected, "{:?}", String::from_utf8_lossy(bytes));
        }
    }
}
