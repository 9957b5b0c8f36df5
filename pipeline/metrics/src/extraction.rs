// SPDX-License-Identifier: MIT OR Apache-2.0
//! Extraction efficiency: power that leaves the silicone for good, per power emitted.
//!
//! It is the power from domes into air, less what enters a dome again, over what the sources emit.
//! Power that a mirror outside the package absorbs afterwards counts as extracted; the power ledger
//! lists it.

use super::{Estimate, Grouped, jackknife};

/// Positions in the vectors of powers that [`extraction`] reads.
pub mod flow {
    /// Emitted by the sources.
    pub const EMITTED: usize = 0;
    /// Through the surfaces of domes into air.
    pub const OUTWARD: usize = 1;
    /// Through the surfaces of domes from air.
    pub const INWARD: usize = 2;
}

/// Extraction efficiency, a fraction, of the powers at the positions of [`flow`], by groups.
pub fn extraction(flows: &Grouped) -> Estimate {
    jackknife(flows, of_powers)
}

/// Extraction efficiency of one set of powers.
pub fn of_powers(p: &[f64]) -> f64 {
    (p[flow::OUTWARD] - p[flow::INWARD]) / p[flow::EMITTED]
}

/// Largest rounding of the sum of a power ledger, as a share of the emitted power, for the most paths
/// that a run may have.
pub const ROUNDING: f64 = 1e-6;

/// True for an `account` of the power ledger that is an end of light: escaped, absorbed or lost.
pub fn is_end(account: &str) -> bool {
    ["escaped_", "absorbed_", "lost_"].iter().any(|begin| account.starts_with(begin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_that_comes_back_is_not_extracted() {
        let flows = Grouped::new(vec![vec![2.0, 1.9, 0.1], vec![2.0, 2.0, 0.2]]);
        let estimate = extraction(&flows);
        assert!((estimate.value - 0.9).abs() < 1e-12);
        assert!(estimate.standard_error < 1e-12);
    }
}
