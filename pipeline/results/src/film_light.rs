// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light between the films of a stack, as the ledger holds it: `passed_K_up_below_NAME` and
//! `passed_K_down_below_NAME` of the plane K below a film, `above_NAME` of the last.

use crate::figure_entry::FigureEntry;
use crate::ledger::Ledger;

/// Beginning of the accounts.
pub const PASSED: &str = "passed_";
/// Both ways through a plane.
pub const WAYS: [&str; 2] = ["up", "down"];

/// Account of the light through the plane `number` called `name`, for one of [`WAYS`].
pub fn account(number: &str, way: &str, name: &str) -> String {
    format!("{PASSED}{number}_{way}_{name}")
}

/// Each plane, upwards, in words, and the shares of the emitted power that pass it up and down; light
/// that comes back counts again.
pub fn planes(ledger: &Ledger) -> Vec<(String, [FigureEntry; 2])> {
    let planes = ledger.accounts.iter().filter_map(|(account_up, _)| {
        let (number, rest) = account_up.strip_prefix(PASSED)?.split_once('_')?;
        let name = rest.strip_prefix(WAYS[0])?.strip_prefix('_')?;
        let [up, down] = WAYS.map(|way| ledger.account(&account(number, way, name)));
        Some((name.replacen('_', " ", 1), [*up?, *down?]))
    });
    planes.collect()
}
