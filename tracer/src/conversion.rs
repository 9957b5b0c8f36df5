// SPDX-License-Identifier: MIT OR Apache-2.0
//! Conversions between reals and whole numbers that compile to wide instructions.
//!
//! Processors without AVX-512 convert 64-bit whole numbers one at a time, so one conversion keeps a
//! whole loop narrow. Sums with 2⁵² do it for many at once: a real of [2⁵², 2⁵³) holds a whole
//! number in the low bits of its mantissa.

#![expect(clippy::inline_always, reason = "compiled into the wide loops over many paths")]

/// 2⁵² and its bits.
const WHOLE: f64 = 4_503_599_627_370_496.0;
const WHOLE_BITS: u64 = WHOLE.to_bits();
/// Bits of 2⁸⁴, and 2⁸⁴ + 2⁵².
const HIGH_BITS: u64 = (1023 + 84) << 52;
const HIGH: f64 = 19_342_813_118_337_666_422_669_312.0;

/// The largest whole number not above `x`, for x from 0 to 2⁵¹.
#[inline(always)]
pub(crate) fn floor(x: f64) -> f64 {
    // The sum rounds to the nearest whole number.
    let nearest = (x + WHOLE) - WHOLE;
    let below = nearest - 1.0;
    if nearest > x { below } else { nearest }
}

/// The same as an integer.
#[inline(always)]
pub(crate) fn whole(x: f64) -> i64 {
    (floor(x) + WHOLE).to_bits().wrapping_sub(WHOLE_BITS) as i64
}

/// A whole number of at most 53 bits as a real, exactly.
#[inline(always)]
pub(crate) fn real(word: u64) -> f64 {
    let high = f64::from_bits(HIGH_BITS | word >> 32);
    let low = f64::from_bits(WHOLE_BITS | word & 0xffff_ffff);
    (high - HIGH) + low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_parts_are_those_of_the_library() {
        let ends = [0.0, 0.5, 1.0, 1.5, 2.5, 4095.0, 4e8 + 0.5, 2_251_799_813_685_248.0];
        for x in ends.into_iter().flat_map(|x: f64| [x, x.next_up(), x.next_down()]) {
            let x = x.max(0.0);
            assert_eq!(floor(x).to_bits(), x.floor().to_bits(), "{x}");
            assert_eq!(whole(x), x as i64, "{x}");
        }
    }

    #[test]
    fn words_of_53_bits_convert_exactly() {
        for shift in 11..64 {
            for word in [u64::MAX, 0x9e37_79b9_7f4a_7c15, 1 << 63, 0x8000_0000_0000_0801] {
                let word = word >> shift;
                assert_eq!(real(word).to_bits(), (word as f64).to_bits(), "{word}");
            }
        }
    }
}
