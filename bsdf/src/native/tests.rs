// SPDX-License-Identifier: MIT OR Apache-2.0
//! The format returns what was written and refuses everything else.

use super::*;
use crate::bsdf::Polarisation;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A table with a header of its own, for the formats that hold all of it.
fn table() -> OrderTable {
    let grid = Grid {
        period: 2.2,
        wavelength: 0.55,
        index_inner: 1.41,
        index_outer: 1.0,
        kx_per_zone: 2,
        ky: vec![0.0, 0.6, 0.95, 1.2],
    };
    let header = TableHeader {
        design: "d1".to_owned(),
        ring: "75".to_owned(),
        length_unit: "um".to_owned(),
        truncation: 60,
        slices: 128,
        estimated_error: 1.3e-3,
        energy_residual: 2e-12,
        more: serde_json::Map::from_iter([("solver".to_owned(), "closed form".into())]),
        ..TableHeader::default()
    };
    let rows = grid.rows(|side, kx, ky, polarisation| {
        let reflected =
            0.3 + 0.1 * kx.sin() * ky + if polarisation == Polarisation::S { 0.1 } else { 0.0 };
        vec![crate::OrderEfficiency::new(side, 0, reflected)]
    });
    OrderTable::build(header, grid.clone(), rows).unwrap()
}

fn bytes() -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&table(), &mut bytes).unwrap();
    bytes
}

/// A file of the given header and payload with a correct checksum.
fn signed(header: &[u8], payload: &[u8]) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    file.extend(VERSION.to_le_bytes());
    file.extend((header.len() as u32).to_le_bytes());
    file.extend((payload.len() as u64).to_le_bytes());
    file.extend(header);
    file.extend(payload);
    let checksum = Sha256::digest(&file);
    file.extend(checksum);
    file
}

#[test]
fn what_was_written_comes_back() {
    let (before, after) = (table(), read(&bytes()[..]).unwrap());
    assert_eq!(before.header(), after.header());
    assert_eq!(before.grid(), after.grid());
    assert_eq!(before.arrays(), after.arrays());
    let mut again = Vec::new();
    write(&after, &mut again).unwrap();
    assert_eq!(again, bytes());
}

#[test]
fn every_truncation_is_named() {
    let whole = bytes();
    for length in 0..whole.len() {
        let error = read(&whole[..length]).unwrap_err();
        assert!(matches!(error, Error::Truncated { .. }), "{length}: {error}");
    }
    let error = read(&whole[..100]).unwrap_err().to_string();
    assert!(error.starts_with("table is truncated in its header: expected"), "{error}");
    let mut longer = whole;
    longer.push(0);
    assert!(matches!(read(&longer[..]), Err(Error::TrailingBytes { .. })));
}

#[test]
fn every_altered_byte_is_found() {
    let whole = bytes();
    let mut rng = Pcg64::seed_from_u64(5);
    for at in 0..whole.len() {
        let mut altered = whole.clone();
        altered[at] ^= 1 << rng.random_range(0..8);
        let error = read(&altered[..]).unwrap_err();
        let right = match at {
            0..8 => matches!(error, Error::Magic { .. }),
            8..12 => matches!(error, Error::Version { .. }),
            12..24 => matches!(
                error,
                Error::Truncated { .. } | Error::Checksum { .. } | Error::TrailingBytes { .. }
            ),
            _ => matches!(error, Error::Checksum { .. }),
        };
        assert!(right, "byte {at}: {error}");
    }
}

#[test]
fn another_version_is_named() {
    let mut other = bytes();
    other[8] = 7;
    assert_eq!(read(&other[..]).unwrap_err().to_string(), "table format version 7, expected 2");
    let error = read(&b"PK\x03\x04 something else altogether"[..]).unwrap_err().to_string();
    assert!(
        error.starts_with(
            "not a table of diffraction orders: expected it to begin with \"BWORDERS\""
        )
    );
}

#[test]
fn hostile_content_with_a_right_checksum_is_refused() {
    let whole = bytes();
    let header_length = u32::from_le_bytes(four(&whole[12..])) as usize;
    let (header, payload) = whole[PRELUDE..whole.len() - 32].split_at(header_length);
    assert!(read(&signed(header, payload)[..]).is_ok());
    let header = std::str::from_utf8(header).unwrap();
    // Each replacement makes the header contradict the arrays, or ask for more than there is.
    for (from, to) in [
        ("\"kx_per_zone\":2", "\"kx_per_zone\":3"),
        ("\"kx_per_zone\":2", "\"kx_per_zone\":20000"),
        ("\"kx_per_zone\":2", "\"kx_per_zone\":18446744073709551615"),
        ("\"period\":2.2", "\"period\":2200"),
        ("\"period\":2.2", "\"period\":-2.2"),
        ("\"period\":2.2", "\"period\":1e308"),
        ("\"wavelength\":0.55", "\"wavelength\":5e-324"),
        ("\"index_inner\":1.41", "\"index_inner\":1e200"),
        ("\"index_inner\":1.41", "\"index_inner\":null"),
        ("\"ky\":[0.0,0.6,", "\"ky\":[0.6,0.0,"),
        ("\"ky\":[0.0,0.6,", "\"ky\":[0.0,1.0,"),
        ("\"estimated_error\":0.0013", "\"estimated_error\":-1"),
        ("\"offset\":0", "\"offset\":8"),
        ("\"<f4\"", "\"<f8\""),
        ("\"design\"", "\"designer\""),
        ("\"more\":{", "\"more\":{\"x\":1,\"x\":2,"),
        ("\"slices\"", "\"slices\":1,\"slices\""),
    ] {
        assert!(header.contains(from), "{from}");
        let error = read(&signed(header.replacen(from, to, 1).as_bytes(), payload)[..]);
        assert!(error.is_err(), "{from} -> {to}");
    }
    for (name, to) in [("\"s\"", "18446744073709551615"), ("\"p\"", "4611686018427387904")] {
        let start = header.find(&format!("\"name\":{name}")).unwrap();
        let shape = start + header[start..].find("\"shape\":[").unwrap() + 9;
        let end = shape + header[shape..].find(']').unwrap();
        let hostile = format!("{}{to}{}", &header[..shape], &header[end..]);
        assert!(matches!(
            read(&signed(hostile.as_bytes(), payload)[..]),
            Err(Error::Inconsistent { .. })
        ));
    }
    // Shares that are none, and nodes that the grid does not have.
    for (at_end, value) in [(4, f32::NAN), (4, -0.5), (4, 2.0)] {
        let mut payload = payload.to_vec();
        let at = payload.len() - at_end;
        payload[at..].copy_from_slice(&value.to_le_bytes());
        assert!(matches!(
            read(&signed(header.as_bytes(), &payload)[..]),
            Err(Error::Efficiency { .. })
        ));
    }
    let mut other = payload.to_vec();
    other[0] = 1;
    assert!(matches!(
        read(&signed(header.as_bytes(), &other)[..]),
        Err(Error::Inconsistent { .. })
    ));
    // Random bytes anywhere: an error or the same table, never a panic.
    let mut rng = Pcg64::seed_from_u64(6);
    for _ in 0..2000 {
        let (mut header, mut payload) = (header.as_bytes().to_vec(), payload.to_vec());
        let at = rng.random_range(0..header.len());
        header[at] = rng.random();
        if rng.random() {
            let at = rng.random_range(0..payload.len());
            payload[at] = rng.random();
        }
        drop(read(&signed(&header, &payload)[..]));
    }
}
