// SPDX-License-Identifier: MIT OR Apache-2.0
//! Speos anisotropic BSDFs in binary mode, turned into the text that holds the same.
//!
//! The vendor describes the text alone. What is read here follows from one measurement in both
//! modes, whose 16 359 values, angles and percentages are alike to the bit: `R_test` (binary, 9.0)
//! and `aniso_bsdf` (text, 11.0) of the test assets of `ansys/pyspeos`. Numbers are little-endian;
//! lists are one block of LZ4 behind their lengths. The cones of specular enhancement after the
//! tables are passed over. Whatever these files do not show is refused.

use std::fmt::Write as _;

use crate::text::FormatError;

/// First words: two of unknown meaning, the lengths of comment and description.
const BEGINNING: [u32; 4] = [3, 1, 0, 0];
/// Most numbers of a file: a quarter of a gigabyte of text.
const MAX_NUMBERS: u64 = 16_000_000;
/// Bytes of which one tells reflected intensities; the others are 0 in the known file.
const REFLECTED: [u8; 3] = [0, 1, 0];

/// The text of a file whose binary content begins at byte `begin`, under this heading.
pub(super) fn as_text(heading: &str, bytes: &[u8], begin: usize) -> Result<String, FormatError> {
    let mut from = Cursor { bytes, at: begin, left: MAX_NUMBERS };
    let words = [from.word()?, from.word()?, from.word()?, from.word()?];
    let [x, y, z] = [from.real()?, from.real()?, from.real()?];
    let flags: [u8; 3] = from.take()?;
    let _indices_of_enhancement: [u8; 16] = from.take()?;
    let enhancements: [u8; 2] = from.take()?;
    if words != BEGINNING || flags != REFLECTED || enhancements != [0, 0] {
        let expected = "reflected intensities without comment, description and specular \
                        enhancement, the only binary content whose layout is known; open the file \
                        in the BSDF viewer of Speos and save it as text";
        return Err(FormatError::offset(
            begin as u64,
            expected,
            "a binary Speos BSDF of another kind",
        ));
    }
    let mut text = format!("{heading}\n0\n\n0\n\n{x} {y} {z}\n1 0\n0\n");
    let rotations = from.counted(&mut text)?;
    let mut tables = 0;
    for _ in 0..rotations {
        tables += from.counted(&mut text)?;
    }
    let (incidence, rotation, description) = (from.real()?, from.real()?, from.word()?);
    if description != 0 {
        let at = from.at as u64 - 4;
        return Err(FormatError::offset(
            at,
            "0, no description of the spectrum",
            description.to_string(),
        ));
    }
    let count = from.word()?;
    let mut reals = || (0..count).map(|_| from.real()).collect::<Result<Vec<f64>, _>>();
    let (wavelengths, percentages) = (reals()?, reals()?);
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{incidence} {rotation}\n\n{count}");
    for (wavelength, percentage) in wavelengths.iter().zip(percentages) {
        let _ = writeln!(text, "{wavelength} {percentage}");
    }
    for _ in 0..tables {
        let (rows, columns) = (from.word()?, from.word()?);
        let (thetas, phis) = (from.list(rows.into())?, from.list(columns.into())?);
        let values = from.list(u64::from(rows) * u64::from(columns))?;
        let _ = writeln!(text, "{rows} {columns}");
        push(&mut text, &phis);
        for (theta, row) in thetas.iter().zip(values.chunks(phis.len().max(1))) {
            let _ = write!(text, "{theta} ");
            push(&mut text, row);
        }
    }
    Ok(text)
}

/// Appends a line of numbers.
fn push(text: &mut String, numbers: &[f64]) {
    for number in numbers {
        let _ = write!(text, "{number} ");
    }
    text.push('\n');
}

/// A place in a file.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Numbers that the file may still hold.
    left: u64,
}

impl Cursor<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let part = rest.first_chunk().ok_or_else(|| {
            FormatError::offset(self.at as u64, format!("{N} bytes more"), "the end of the file")
        })?;
        self.at += N;
        Ok(*part)
    }

    fn word(&mut self) -> Result<u32, FormatError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn real(&mut self) -> Result<f64, FormatError> {
        Ok(f64::from_le_bytes(self.take()?))
    }

    /// Appends a count and its list of numbers.
    fn counted(&mut self, text: &mut String) -> Result<u32, FormatError> {
        let count = self.word()?;
        let numbers = self.list(count.into())?;
        let _ = writeln!(text, "{count}");
        push(text, &numbers);
        Ok(count)
    }

    /// So many numbers.
    fn list(&mut self, count: u64) -> Result<Vec<f64>, FormatError> {
        let begin = self.at as u64;
        self.left = self.left.checked_sub(count).ok_or_else(|| {
            let expected = format!("at most {MAX_NUMBERS} numbers in all lists");
            FormatError::offset(begin, expected, count.to_string())
        })?;
        let (whole, first) = (u64::from_le_bytes(self.take()?), self.word()?);
        let packed = self.word()? as usize;
        let block = self.bytes[self.at..].get(..packed);
        self.at += packed;
        let is_one = count.checked_mul(8) == Some(whole) && whole == u64::from(first);
        let numbers = block.filter(|_| is_one).and_then(|block| unpacked(block, first as usize));
        let numbers = numbers.ok_or_else(|| {
            let expected = format!("{count} numbers in one block of LZ4");
            FormatError::offset(begin, expected, format!("{whole} bytes, {packed} packed"))
        })?;
        Ok(numbers.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
    }
}

/// The `length` bytes of a block of LZ4: sequences of a token, bytes as they are, and the distance
/// back to bytes that come again.
fn unpacked(block: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut rest = block.iter().copied();
    let mut whole: Vec<u8> = Vec::new();
    while let Some(token) = rest.next() {
        let literals = count(token >> 4, &mut rest)?;
        for _ in 0..literals {
            whole.push(rest.next()?);
        }
        // The last sequence ends here.
        let Some(low) = rest.next() else { break };
        let distance = usize::from(u16::from_le_bytes([low, rest.next()?]));
        let copied = count(token & 15, &mut rest)? + 4;
        if whole.len() + copied > length {
            return None;
        }
        for _ in 0..copied {
            let from = whole.len().checked_sub(distance)?;
            whole.push(*whole.get(from)?);
        }
    }
    (whole.len() == length).then_some(whole)
}

/// Four bits of a token; 15 goes on in bytes, to the first below 255.
fn count(bits: u8, rest: &mut impl Iterator<Item = u8>) -> Option<usize> {
    let mut sum = usize::from(bits);
    let mut goes_on = bits == 15;
    while goes_on {
        let more = rest.next()?;
        sum += usize::from(more);
        goes_on = more == 255;
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::speos::layout::read;

    /// Bytes as they are behind a token, as LZ4 holds what does not repeat.
    fn plain(numbers: &[f64]) -> Vec<u8> {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let length = bytes.len();
        let token = match length.checked_sub(15) {
            None => vec![(length as u8) << 4],
            Some(more) => [vec![0xf0], vec![255; more / 255], vec![(more % 255) as u8]].concat(),
        };
        let packed = [token, bytes].concat();
        [
            &(length as u64).to_le_bytes()[..],
            &(length as u32).to_le_bytes(),
            &(packed.len() as u32).to_le_bytes(),
            &packed,
        ]
        .concat()
    }

    #[test]
    fn blocks_repeat_what_lies_before() {
        // 1 literal, then 5 times the byte before; 2 literals, 4 from 7 back; 15 + 255 + 0 + 4 zeros.
        let block = [0x11, 0, 1, 0, 0x20, 0x14, 0x40, 7, 0, 0x1f, 9, 1, 0, 255, 0, 0x10, 5];
        let expected = [&[0; 6][..], &[0x14, 0x40, 0, 0, 0, 0], &[9; 275], &[5]].concat();
        assert_eq!(unpacked(&block, expected.len()), Some(expected));
        for bad in [&[0x10][..], &[0x00, 0, 0], &[0x10, 1, 2, 0], &[0x1f, 1, 1, 0, 255]] {
            assert_eq!(unpacked(bad, 5), None, "{bad:?}");
        }
    }

    #[test]
    fn both_modes_hold_the_same_and_other_content_is_refused() {
        let (heading, phis) =
            ("OPTIS - Anisotropic BSDF surface file v9.0", [0.0, 120.0, 240.0, 360.0]);
        let values: [f64; 8] = [1.0, 1.0, 1.0, 1.0, 0.1, 0.25, 0.5, 0.1];
        let reals = |all: &[f64]| all.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let words = |all: &[u32]| all.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let table = [words(&[2, 4]), plain(&[0.0, 90.0]), plain(&phis), plain(&values)].concat();
        let binary = [
            format!("{heading}\n1").into_bytes(),
            words(&BEGINNING),
            reals(&[1.0, 0.0, 0.0]),
            REFLECTED.to_vec(),
            reals(&[1.0, 1.5]),
            vec![0, 0],
            [words(&[1]), plain(&[0.0]), words(&[2]), plain(&[5.0, 60.0])].concat(),
            [reals(&[5.0, 0.0]), words(&[0, 2]), reals(&[360.0, 830.0, 40.0, 40.0])].concat(),
            [&table[..], &table, &reals(&[1.0])].concat(),
        ];
        let table = "2 4\n0 120 240 360\n0 1 1 1 1\n90 0.1 0.25 0.5 0.1\n";
        let text = format!(
            "{heading}\n0\n\n0\n\n1 0 0\n1 0\n0\n1\n0\n2\n5 60\n5 0\n\n2\n360 40\n830 40\n{table}{table}"
        );
        let expected = read(text.as_bytes()).expect("text");
        assert_eq!(read(&binary.concat()), Ok(expected));
        let refused = |part: usize, byte: usize, value: u8, says: &str| {
            let mut parts = binary.clone();
            parts[part][byte] = value;
            let message = read(&parts.concat()).expect_err(says).to_string();
            assert!(message.contains(says), "{message}");
        };
        refused(1, 8, 4, "offset 44: expected reflected intensities without comment");
        refused(3, 2, 1, "save it as text, got a binary Speos BSDF of another kind");
        refused(7, 16, 1, "expected 0, no description of the spectrum, got 1");
        refused(6, 4, 9, "expected 1 numbers in one block of LZ4, got 9 bytes");
        refused(6, 1, 0xff, "numbers");
        refused(6, 58, 0xc0, "at line 12 of the file as text");
        let whole = binary.concat();
        for end in [50, 120, 200, whole.len() - 30] {
            assert!(read(&whole[..end]).is_err(), "{end}");
        }
    }
}
