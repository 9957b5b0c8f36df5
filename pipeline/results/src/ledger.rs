// SPDX-License-Identifier: MIT OR Apache-2.0
//! The power ledger: where the emitted power goes.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use metrics::extraction::is_end;
use metrics::hits::with_one_path;
use metrics::{Grouped, jackknife};

use crate::figure_entry::FigureEntry;

/// Name of each account and its share of the emitted power.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "BTreeMap<String, FigureEntry>", into = "BTreeMap<String, FigureEntry>")]
pub struct Ledger {
    /// Accounts in the order of a ray's life; of a ledger that was read, by name.
    pub accounts: Vec<(String, FigureEntry)>,
}

impl Ledger {
    /// From the powers of each account by groups; `emitted` is the position of the emitted power.
    pub fn new(names: &[String], powers: &Grouped, emitted: usize) -> Self {
        let share = |i: usize| FigureEntry::new(jackknife(powers, |p| p[i] / p[emitted]));
        let accounts = names.iter().enumerate().map(|(i, name)| (name.clone(), share(i)));
        Self { accounts: accounts.collect() }
    }

    /// The same with errors of accounts that no path reached: `one_path` is the share of one path,
    /// 0 of an account that none can reach.
    #[must_use]
    pub fn with_one_path(mut self, one_path: impl Fn(&str) -> f64) -> Self {
        for (name, share) in &mut self.accounts {
            *share = FigureEntry::new(with_one_path(share.estimate(), one_path(name)));
        }
        self
    }

    /// Sum of all ends of light less 1, as a reader of the file finds it: of accounts with one
    /// name, the last counts. Within [`metrics::extraction::ROUNDING`] of 0.
    pub fn surplus(&self) -> f64 {
        let by_name: BTreeMap<String, FigureEntry> = self.clone().into();
        let ended = by_name.iter().filter(|(name, _)| is_end(name));
        ended.map(|(_, share)| share.value).sum::<f64>() - 1.0
    }

    /// The account of this name.
    pub fn account(&self, name: &str) -> Option<&FigureEntry> {
        let mut latest_first = self.accounts.iter().rev();
        latest_first.find_map(|(known, share)| (known == name).then_some(share))
    }
}

impl From<Ledger> for BTreeMap<String, FigureEntry> {
    fn from(ledger: Ledger) -> Self {
        ledger.accounts.into_iter().collect()
    }
}

impl From<BTreeMap<String, FigureEntry>> for Ledger {
    fn from(accounts: BTreeMap<String, FigureEntry>) -> Self {
        Self { accounts: accounts.into_iter().collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accounts_of_one_name_do_not_add_up() {
        let powers = Grouped::new(vec![vec![2.0, 1.5, 0.25, 0.25], vec![1.0, 0.75, 0.125, 0.125]]);
        let of = |names: [&str; 4]| {
            let names = names.map(str::to_owned);
            Ledger::new(&names, &powers, 0).surplus()
        };
        let good = of(["emitted", "escaped_up", "absorbed_by_wall", "lost_leak"]);
        assert!(good.abs() < 1e-12, "{good}");
        let twice = of(["emitted", "escaped_up", "absorbed_by_wall", "absorbed_by_wall"]);
        assert!((twice + 0.125).abs() < 1e-12, "{twice}");
    }
}
