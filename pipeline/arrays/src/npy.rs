// SPDX-License-Identifier: MIT OR Apache-2.0
//! NumPy's `.npy`: a header that states type and shape, then the values.
//!
//! A reader compares the header with the length of the file before it allocates anything, so that a
//! file cannot ask for memory out of proportion to its length. Layout: NumPy's `numpy.lib.format`;
//! little-endian values in C order, read in versions 1 to 3 and written in version 1.

use std::io::Write;

use anyhow::{Context, Result, bail, ensure};

const MAGIC: &[u8] = b"\x93NUMPY";

/// A type of values.
pub trait Element: Copy {
    /// Name in the header.
    const DESCR: &'static str;
    /// Bytes of one value.
    const SIZE: usize;
    /// The value in [`Element::SIZE`] bytes.
    fn from_bytes(bytes: &[u8]) -> Self;
    /// Appends the bytes of the value.
    fn append_to(self, bytes: &mut Vec<u8>);
}

macro_rules! elements {
    ($($kind:ty, $descr:literal;)*) => {$(
        impl Element for $kind {
            const DESCR: &'static str = $descr;
            const SIZE: usize = size_of::<$kind>();
            fn from_bytes(bytes: &[u8]) -> Self {
                let mut own = [0; size_of::<$kind>()];
                own.copy_from_slice(bytes);
                Self::from_le_bytes(own)
            }
            fn append_to(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

elements! {
    u8, "|u1";
    i32, "<i4";
    f32, "<f4";
    f64, "<f8";
}

/// The length of magic, version, length and header is a multiple of this.
const ALIGNMENT: usize = 64;

/// Writes `values` as an array of this shape, the last index running fastest.
///
/// # Errors
/// Values that do not fill the shape, a file that cannot be written.
pub fn write<T: Element>(
    file: &mut (impl Write + ?Sized),
    shape: &[usize],
    values: &[T],
) -> Result<()> {
    ensure!(
        shape.iter().product::<usize>() == values.len(),
        "expected the values of the shape {shape:?}, got {}",
        values.len()
    );
    let mut lengths = shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    if shape.len() == 1 {
        lengths.push(',');
    }
    let mut header =
        format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({lengths}), }}", T::DESCR);
    let unpadded = MAGIC.len() + 4 + header.len() + 1;
    header.push_str(&" ".repeat(unpadded.next_multiple_of(ALIGNMENT) - unpadded));
    header.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(&[1, 0]);
    bytes.extend_from_slice(&u16::try_from(header.len())?.to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    for &value in values {
        value.append_to(&mut bytes);
    }
    Ok(file.write_all(&bytes)?)
}

/// Shape and values of the array in `bytes`, the last index running fastest.
///
/// # Errors
/// If it is no such file, of another version, type or order, or its values do not fill the shape.
pub fn read<T: Element>(bytes: &[u8]) -> Result<(Vec<usize>, Vec<T>)> {
    let at = |from: usize, to: usize| {
        let got = bytes.len();
        bytes.get(from..to).with_context(|| {
            format!("offset {got}: expected {to} bytes of a .npy header at least, got the end")
        })
    };
    ensure!(
        at(0, 6)? == MAGIC,
        "offset 0: expected a .npy file (\\x93NUMPY), got {:?}",
        String::from_utf8_lossy(&bytes[..6])
    );
    let version = at(6, 8)?[0];
    let (start, length) = match version {
        1 => (10, little(at(8, 10)?)),
        2 | 3 => (12, little(at(8, 12)?)),
        _ => bail!("offset 6: expected version 1, 2 or 3 of .npy, got {version}"),
    };
    let end = start + length;
    let header = std::str::from_utf8(at(start, end)?).ok().with_context(|| {
        format!("offset {start}: expected a header in UTF-8, got another encoding")
    })?;
    let entry = |key: &str| {
        let found = header.split_once(&format!("'{key}':"));
        found
            .map(|(_, rest)| rest.trim_start())
            .with_context(|| format!("offset {start}: expected '{key}' in the header, got none"))
    };
    let descr = entry("descr")?;
    ensure!(
        descr.starts_with(&format!("'{}'", T::DESCR)),
        "offset {start}: expected values of type {}, got {}",
        T::DESCR,
        descr.split([',', '}']).next().unwrap_or_default().trim()
    );
    let order = entry("fortran_order")?;
    let shape = shape(entry("shape")?).with_context(|| {
        format!("offset {start}: expected a shape of whole numbers in the header")
    })?;
    ensure!(
        order.starts_with("False") || shape.len() == 1,
        "offset {start}: expected fortran_order False, got True"
    );
    let values = &bytes[end..];
    let count = shape.iter().try_fold(1_usize, |n, l| n.checked_mul(*l));
    let expected = count.and_then(|n| n.checked_mul(T::SIZE));
    ensure!(
        expected == Some(values.len()),
        "offset {end}: expected the values of the shape {shape:?}, {} bytes each, got {} bytes",
        T::SIZE,
        values.len()
    );
    let values = values.chunks_exact(T::SIZE).map(T::from_bytes).collect();
    Ok((shape, values))
}

/// The number in at most four bytes.
fn little(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |n, b| n << 8 | usize::from(*b))
}

/// The numbers of `(2, 3)`, `(2,)` or `()`.
fn shape(text: &str) -> Option<Vec<usize>> {
    let (inside, _) = text.strip_prefix('(')?.split_once(')')?;
    let inside = inside.trim();
    let inside = inside.strip_suffix(',').unwrap_or(inside);
    if inside.trim().is_empty() {
        return Some(Vec::new());
    }
    inside.split(',').map(|n| n.trim().parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file<T: Element>(shape: &[usize], values: &[T]) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&mut bytes, shape, values).expect("written");
        bytes
    }

    /// What `numpy.save` of NumPy 2.3 writes for `np.array([[1.5, -2.0]])`.
    #[test]
    fn bytes_are_those_of_numpy() {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2), }";
        let mut expected = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        expected.extend_from_slice(format!("{header:<117}\n").as_bytes());
        expected.extend_from_slice(&[0, 0, 0, 0, 0, 0, 0xf8, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0xc0]);
        assert_eq!(file(&[1, 2], &[1.5, -2.0]), expected);
    }

    #[test]
    fn arrays_come_back() {
        let cube: Vec<f64> = (0..24).map(f64::from).collect();
        assert_eq!(read(&file(&[2, 3, 4], &cube)).expect("valid"), (vec![2, 3, 4], cube));
        assert_eq!(read::<u8>(&file(&[2], &[7_u8, 8])).expect("valid"), (vec![2], vec![7, 8]));
        assert_eq!(read::<i32>(&file::<i32>(&[0], &[])).expect("valid"), (vec![0], vec![]));
        assert_eq!(read::<f32>(&file(&[], &[7_f32])).expect("valid"), (vec![], vec![7.0]));
        assert!(write(&mut Vec::new(), &[2, 2], &[1.0; 3]).is_err());
    }

    #[test]
    fn headers_that_lie_are_refused_before_anything_is_allocated() {
        let good = file(&[2], &[1.0_f32, 2.0]);
        let text = |from: &str, to: &str| {
            let at = good.windows(from.len()).position(|w| w == from.as_bytes());
            let at = at.expect("in the header");
            // The header is padded with blanks: its length stays.
            let mut bad = good.clone();
            let more = to.len() - from.len();
            bad.splice(at..at + from.len(), to.bytes());
            let blank = bad.iter().rposition(|b| *b == b' ').expect("padding");
            bad.drain(blank + 1 - more..=blank);
            bad
        };
        let error = |bytes: &[u8]| format!("{:#}", read::<f32>(bytes).unwrap_err());
        for (bad, expected) in [
            (
                text("(2,)", "(1000000000000,)"),
                "expected the values of the shape [1000000000000], 4 bytes each, got 8 bytes",
            ),
            (text("(2,)", "(4611686018427387904,)"), "got 8 bytes"),
            (text("(2,)", "(99999999999999999999,)"), "expected a shape of whole numbers"),
            (text("(2,)", "(-2,)"), "expected a shape of whole numbers"),
            (text("(2,)", "(2,1,2)"), "[2, 1, 2]"),
            (text("<f4", ">f4"), "expected values of type <f4, got '>f4'"),
            (text("'shape'", "'shaped'"), "expected 'shape' in the header, got none"),
            (good[..good.len() - 1].to_vec(), "got 7 bytes"),
            (good[..40].to_vec(), "offset 40: expected"),
            (Vec::new(), "offset 0: expected 6 bytes"),
            (
                b"\x93NUMPY\x04\x00\x00\x00".to_vec(),
                "offset 6: expected version 1, 2 or 3 of .npy, got 4",
            ),
            (b"PK\x03\x04aaaaaaaa".to_vec(), "offset 0: expected a .npy file"),
        ] {
            let got = error(&bad);
            assert!(got.contains(expected), "{expected}: {got}");
        }
        let square = file(&[1, 2], &[1.0_f32, 2.0]);
        let turned = String::from_utf8_lossy(&square[10..]).replace("False", "True ");
        let turned = [&square[..10], turned.as_bytes()].concat();
        assert!(error(&turned).contains("expected fortran_order False"));
    }
}
