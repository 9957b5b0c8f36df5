// SPDX-License-Identifier: MIT OR Apache-2.0
//! Extraction efficiency: power that leaves the silicone for good, per power emitted.
//!
//! It is the power from domes into air, less what enters a dome again, over what the sources emit.
//! Power that a mirror outside the package absorbs afterwards counts as extracted; the [`Ledger`]
//! lists it.

use std::collections::BTreeMap;

use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::hits::{upper_bound, with_one_path};
use super::{Estimate, Grouped, estimate, jackknife};

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

/// Largest rounding of the sum of a [`Ledger`], as a share of the emitted power, for the most paths
/// that a run may have.
pub const ROUNDING: f64 = 1e-6;

/// Whether `account` of a [`Ledger`] is an end of light: escaped, absorbed or lost.
pub fn is_end(account: &str) -> bool {
    ["escaped_", "absorbed_", "lost_"].iter().any(|begin| account.starts_with(begin))
}

/// The power ledger: name of each account and its share of the emitted power.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ledger {
    /// Accounts in the order of a ray's life.
    pub accounts: Vec<(String, Estimate)>,
    /// Changes of accounts when the last wavelengths of a spectrum were added.
    pub wavelength_errors: BTreeMap<String, Estimate>,
    /// Estimates of what cells of the table of a film stack add.
    pub film_table_errors: BTreeMap<String, Estimate>,
}

impl Ledger {
    /// From the powers of each account by groups; `emitted` is the position of the emitted power.
    pub fn new(names: &[String], powers: &Grouped, emitted: usize) -> Self {
        let accounts = names
            .iter()
            .enumerate()
            .map(|(i, name)| (name.clone(), jackknife(powers, |p| p[i] / p[emitted])))
            .collect();
        Self { accounts, ..Self::default() }
    }

    /// The same with errors of accounts that no path reached: `one_path` is the share of one path,
    /// 0 of an account that none can reach.
    #[must_use]
    pub fn with_one_path(mut self, one_path: impl Fn(&str) -> f64) -> Self {
        for (name, share) in &mut self.accounts {
            *share = with_one_path(*share, one_path(name));
        }
        self
    }

    /// Sum of all ends of light less 1, as a reader of the file finds it: of accounts with one
    /// name, the last counts. Within [`ROUNDING`] of 0.
    pub fn surplus(&self) -> f64 {
        let found = self.accounts.iter().map(|(name, e)| (name.as_str(), e.value));
        let found: BTreeMap<&str, f64> = found.collect();
        let ended = found.iter().filter(|(name, _)| is_end(name));
        ended.map(|(_, share)| share).sum::<f64>() - 1.0
    }

    /// The account of this name; its error holds that of the wavelengths.
    pub fn account(&self, name: &str) -> Option<Estimate> {
        let mut found = self.accounts.iter().filter(|(known, _)| known == name);
        let error = self.wavelength_errors.get(name).map_or(0.0, |error| error.value);
        found.next_back().map(|(_, share)| share.with_error(error))
    }
}

/// An account as it is written.
#[derive(Serialize, Deserialize)]
struct Account {
    value: f64,
    #[serde(deserialize_with = "estimate::standard_error")]
    standard_error: f64,
    #[serde(skip_serializing_if = "Option::is_none", skip_deserializing)]
    upper_bound: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    wavelength_error: Option<Estimate>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    film_table_error: Option<Estimate>,
}

impl Serialize for Ledger {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.accounts.len()))?;
        for (name, share) in &self.accounts {
            let Estimate { value, standard_error, .. } = *share;
            let account = Account {
                value,
                standard_error,
                upper_bound: upper_bound(value, standard_error),
                wavelength_error: self.wavelength_errors.get(name).copied(),
                film_table_error: self.film_table_errors.get(name).copied(),
            };
            map.serialize_entry(name, &account)?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Ledger {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut ledger = Self::default();
        for (name, account) in BTreeMap::<String, Account>::deserialize(deserializer)? {
            let error = account.wavelength_error.map(|error| (name.clone(), error));
            ledger.wavelength_errors.extend(error);
            let error = account.film_table_error.map(|error| (name.clone(), error));
            ledger.film_table_errors.extend(error);
            let share = Estimate::new(account.value, account.standard_error);
            ledger.accounts.push((name, share));
        }
        Ok(ledger)
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
            Ledger::new(&names, &powers, flow::EMITTED).surplus()
        };
        let good = of(["emitted", "escaped_up", "absorbed_by_wall", "lost_leak"]);
        assert!(good.abs() < 1e-12, "{good}");
        let twice = of(["emitted", "escaped_up", "absorbed_by_wall", "absorbed_by_wall"]);
        assert!((twice + 0.125).abs() < 1e-12, "{twice}");
    }

    #[test]
    fn light_that_comes_back_is_not_extracted() {
        let flows = Grouped::new(vec![vec![2.0, 1.9, 0.1], vec![2.0, 2.0, 0.2]]);
        let estimate = extraction(&flows);
        assert!((estimate.value - 0.9).abs() < 1e-12);
        assert!(estimate.standard_error < 1e-12);
    }
}
