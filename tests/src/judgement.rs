// SPDX-License-Identifier: MIT OR Apache-2.0
//! Comparison of traced estimates with expected values, in standard errors.

use metrics::Estimate;
use simulate::observation::Observation;

/// Paths of these tests, by which powers without scatter are judged too.
pub const PATHS: u64 = 200_000;

/// One account of the ledger, as a share of what is emitted.
///
/// # Panics
/// If there is none of that name.
pub fn account(seen: &Observation, name: &str) -> Estimate {
    let ledger = seen.ledger();
    let found = ledger.accounts.iter().find(|(known, _)| known == name);
    let known: Vec<&String> = ledger.accounts.iter().map(|(name, _)| name).collect();
    found.unwrap_or_else(|| panic!("{name} among {known:?}")).1.estimate()
}

/// Judges whether an estimate is what it should be.
///
/// # Panics
/// If it is farther off than 4.5 standard errors.
pub fn close(what: &str, found: Estimate, expected: f64) {
    let error = found.standard_error.max(2.0 / PATHS as f64);
    let off = (found.value - expected) / error;
    assert!(off.abs() < 4.5, "{what}: {found:?} for {expected}: {off}");
}

/// Judges whether two estimates are of one number.
///
/// # Panics
/// If they are farther apart than 4.5 standard errors.
pub fn alike(what: &str, a: Estimate, b: Estimate) {
    let error = a.standard_error.hypot(b.standard_error).max(2.0 / PATHS as f64);
    assert!((a.value - b.value).abs() < 4.5 * error, "{what}: {a:?} {b:?}");
}
