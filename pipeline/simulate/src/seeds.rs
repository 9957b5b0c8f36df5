// SPDX-License-Identifier: MIT OR Apache-2.0
//! Seeds of the traces of one run, derived from its seed so that their random numbers are
//! independent.

/// The output function of SplitMix64 [Steele Lea Flood 2014], a bijection that scatters neighbours.
pub fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The seed of a wavelength. Neighbours are independent, so that their errors average out; the
/// order of computation does not matter.
pub fn of_wavelength(seed: u64, nm: f64) -> u64 {
    mix(mix(seed) ^ nm.to_bits())
}

/// The seed of a light among others, by its first source: what stands beside it does not matter.
pub fn of_light(seed: u64, source: &str) -> u64 {
    source.bytes().fold(seed, |seed, byte| mix(seed ^ u64::from(byte)))
}

/// The seed of the response of a package.
pub fn of_package(seed: u64, number: usize) -> u64 {
    mix(mix(seed ^ 0x7061_636b_6167_6573) ^ number as u64)
}

/// The seed of a batch; batch 1 is the first after the initial one.
pub fn of_batch(seed: u64, batch: u32) -> u64 {
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
    mix(seed.wrapping_add(u64::from(batch - 1).wrapping_mul(STEP)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_of_wavelengths_differ() {
        let wavelengths = [450.0, 450.001, 550.0, 650.0];
        let seeds: std::collections::BTreeSet<u64> =
            (0..100).flat_map(|s| wavelengths.map(|nm| of_wavelength(s, nm))).collect();
        assert_eq!(seeds.len(), 400);
        // The first output of SplitMix64 from state 0, as its authors' program prints it.
        assert_eq!(mix(0), 0xe220_a839_7b1d_cdaf);
    }
}
