// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light between the films of a stack, as the ledger holds it: `passed_K_up_below_NAME` and
//! `passed_K_down_below_NAME` of the plane K below a film, `above_NAME` of the last.

use metrics::Estimate;
use metrics::extraction::Ledger;

/// Beginning of the accounts.
pub const PASSED: &str = "passed_";
/// Both ways through a plane.
pub const WAYS: [&str; 2] = ["up", "down"];

/// Each plane, upwards, in words, and the shares of the emitted power that pass it up and down; light
/// that comes back counts again.
pub fn film_light(ledger: &Ledger) -> Vec<(String, [Estimate; 2])> {
    let planes = ledger.accounts.iter().filter_map(|(account, up)| {
        let (number, name) = account.strip_prefix(PASSED)?.split_once("_up_")?;
        let down = ledger.account(&format!("{PASSED}{number}_down_{name}"))?;
        Some((name.replacen('_', " ", 1), [*up, down]))
    });
    planes.collect()
}
