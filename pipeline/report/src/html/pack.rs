// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers in few letters: quantised to 16 bits and written in base 64 [RFC 4648].

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;

/// Steps from 0 to the largest number.
pub const STEPS: f64 = 65_535.0;

/// Letters that `count` numbers of 16 bits take.
pub fn letters(count: usize) -> usize {
    (2 * count).div_ceil(3) * 4
}

/// Little-endian 16-bit numbers in base 64, padded.
pub fn base64_of_numbers(numbers: &[u16]) -> String {
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    BASE64_STANDARD.encode(bytes)
}

/// `value` as a share of `full` in [`STEPS`] equal steps; what lies outside is cut.
pub fn linear(value: f64, full: f64) -> u16 {
    (value / full).clamp(0.0, 1.0).mul_add(STEPS, 0.5) as u16
}

/// The root of a share in [`STEPS`] equal steps, so that small shares keep digits: a share x comes
/// back within √x / 65535.
pub fn root(share: f64) -> u16 {
    linear(share.max(0.0).sqrt(), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_little_endian_in_the_base_64_of_the_standard() {
        // "foobar" of RFC 4648, section 10, and its beginnings of whole 16-bit numbers.
        let pair = |a: u8, b: u8| u16::from_le_bytes([a, b]);
        let word = [pair(b'f', b'o'), pair(b'o', b'b'), pair(b'a', b'r')];
        assert_eq!(base64_of_numbers(&word), "Zm9vYmFy");
        assert_eq!(base64_of_numbers(&word[..2]), "Zm9vYg==");
        assert_eq!(base64_of_numbers(&word[..1]), "Zm8=");
        assert_eq!(base64_of_numbers(&[]), "");
        for count in 0..7 {
            assert_eq!(base64_of_numbers(&vec![7; count]).len(), letters(count));
        }
    }

    #[test]
    fn shares_come_back_within_the_stated_error() {
        for share in [0.0, 1e-9, 1e-6, 3.3e-4, 0.02, 0.5, 0.999, 1.0] {
            let back = (f64::from(root(share)) / STEPS).powi(2);
            assert!((back - share).abs() <= share.sqrt() / STEPS + 1e-10, "{share}");
        }
        assert_eq!((linear(2.0, 1.0), linear(-1.0, 1.0)), (65_535, 0));
        assert_eq!(linear(0.5, 2.0), 16_384);
    }
}
