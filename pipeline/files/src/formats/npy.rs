// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reading NumPy's `.npy`: a header that says type and shape, then the values.
//!
//! In: the bytes of a file. Out: shape and values, or an error with offset, what was expected and
//! what stands there. The header's word is checked against the bytes before anything is allocated,
//! so that a file cannot ask for memory out of proportion to its length. Layout: NumPy's
//! `numpy.lib.format`, versions 1 to 3; little-endian values in C order.

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
        }
    )*};
}

elements! {
    u8, "|u1";
    i32, "<i4";
    f32, "<f4";
    f64, "<f8";
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
    use ndarray::{Array1, Array2, Array3, ShapeBuilder};
    use ndarray_npy::WriteNpyExt;

    fn file(array: &impl WriteNpyExt) -> Vec<u8> {
        let mut bytes = Vec::new();
        array.write_npy(&mut bytes).expect("written");
        bytes
    }

    #[test]
    fn arrays_of_the_writer_come_back() {
        let cube = Array3::from_shape_fn((2, 3, 4), |(i, j, k)| (100 * i + 10 * j + k) as f64);
        let (shape, values) = read::<f64>(&file(&cube)).expect("valid");
        assert_eq!((shape, values), (vec![2, 3, 4], cube.iter().copied().collect()));
        let (shape, values) = read::<u8>(&file(&Array1::from(vec![7_u8, 8]))).expect("valid");
        assert_eq!((shape, values), (vec![2], vec![7, 8]));
        assert!(read::<i32>(&file(&Array1::from(Vec::<i32>::new()))).expect("valid").1.is_empty());
    }

    #[test]
    fn headers_that_lie_are_refused_before_anything_is_allocated() {
        let good = file(&Array1::from(vec![1.0_f32, 2.0]));
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
        let turned = Array2::<f32>::zeros((2, 3).f());
        assert!(error(&file(&turned)).contains("expected fortran_order False"));
    }
}
