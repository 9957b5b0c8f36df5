// SPDX-License-Identifier: MIT OR Apache-2.0
//! Errors that figures have beside their scatter, from the change to a coarser computation of the same
//! paths: few wavelengths in place of many, wide cells of a table of films in place of narrow ones.

use std::collections::BTreeMap;

use design::Design;
use metrics::Estimate;
use results::ModelResult;
use results::figure_entry::FigureEntry;

use super::observation::Observation;
use super::units::Units;

/// The change of a figure to cells of twice the width, over the error by those of one: this is of
/// second order in the width, so that the change is four errors less one.
const WIDENED: f64 = 3.0;

/// What the errors come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cause {
    Wavelengths,
    FilmTable,
}

/// Errors of the figures of one model, by key.
pub struct AddedErrors {
    cause: Cause,
    by_key: BTreeMap<String, Estimate>,
    /// That of keys that are not there.
    of_others: Option<f64>,
}

impl AddedErrors {
    /// Of light that is the same at all wavelengths.
    pub fn none() -> Self {
        Self { of_others: Some(0.0), ..Self::unknown() }
    }

    /// Of wavelengths that are compared with none.
    pub fn unknown() -> Self {
        Self { cause: Cause::Wavelengths, by_key: BTreeMap::new(), of_others: None }
    }

    /// Changes of all figures of `design` from fewer wavelengths to `observation`.
    pub fn of_wavelengths(observation: &Observation, fewer: &Observation, design: &Design) -> Self {
        Self::between(Cause::Wavelengths, 1.0, [observation, fewer], design)
    }

    /// Errors of all figures of `design` by the cells of a table of films, from what is seen with
    /// cells of twice the width.
    pub fn of_film_table(seen: &Observation, widened: &Observation, design: &Design) -> Self {
        Self::between(Cause::FilmTable, 1.0 / WIDENED, [seen, widened], design)
    }

    fn between(
        cause: Cause,
        factor: f64,
        [fine, coarse]: [&Observation; 2],
        design: &Design,
    ) -> Self {
        let changes = fine.changes(coarse, design, |_| true).into_iter();
        let by_key = changes.map(|(key, change)| {
            let change = Estimate::new(change.value.abs(), change.standard_error);
            (key.into_owned(), change.times(factor))
        });
        Self { cause, by_key: by_key.collect(), of_others: None }
    }

    fn of(&self, key: &str) -> Option<Estimate> {
        let others = || self.of_others.map(|value| Estimate::new(value, 0.0));
        self.by_key.get(key).copied().or_else(others)
    }

    fn put(&self, entry: &mut FigureEntry, error: Option<Estimate>) {
        match self.cause {
            Cause::Wavelengths => entry.wavelength_error = error,
            Cause::FilmTable => entry.film_table_error = error,
        }
    }

    /// Adds them to the figures, the ledger, absolute figures and receivers of `result`.
    pub fn add_to(&self, result: &mut ModelResult, units: &Units) {
        for figure in &mut result.figures {
            self.put(&mut figure.entry, self.of(&figure.key));
        }
        for (account, share) in &mut result.ledger.accounts {
            self.put(share, self.of(account));
        }
        if let Some(absolute) = &mut result.absolute {
            let per_package = 1.0 / absolute.packages as f64;
            for (key, figure) in &mut absolute.figures {
                let error = self.of(key);
                self.put(&mut figure.array, error);
                if let Some(one) = &mut figure.per_package {
                    self.put(one, error.map(|error| error.times(per_package)));
                }
            }
        }
        for (name, receiver) in result.receivers.iter_mut().flatten() {
            for (key, entry) in &mut receiver.figures {
                // As a figure a flux is a share.
                let factor = if key == "flux" { units.per_flux() } else { 1.0 };
                let error = self.of(&format!("{key}.{name}"));
                self.put(entry, error.map(|error| error.times(factor)));
            }
        }
    }
}
