// SPDX-License-Identifier: MIT OR Apache-2.0
//! The result of a model from its observation, and the folder of its files.

use std::path::{Path, PathBuf};

use design::Design;
use metrics::kinds::Carrying;
use results::ModelResult;
use results::ledger::Ledger;
use results::schema::PolarizationEntry;

use super::model::Model;
use super::observation::{Observation, of_one_path};

/// Folder of the files of `model` of `design`, under the directory of results.
pub fn folder(design: &Design, model: Model) -> PathBuf {
    Path::new(&design.name).join(model.key(design))
}

/// The result of a model: figures, ledger, counters; without tables.
pub fn model_result(design: &Design, model: Model, observation: &Observation) -> ModelResult {
    let one_path = 1.0 / observation.paths as f64;
    let known =
        |ledger: Ledger| ledger.with_one_path(|account| of_one_path(design, account, one_path));
    ModelResult {
        key: model.key(design),
        label: model.label(design),
        paths: observation.paths,
        figures: observation.figures(design),
        ledger: known(observation.ledger()),
        photons: observation.photon_ledger().map(known),
        counters: observation.counters(),
        tables: Vec::new(),
        spectrum: None,
        absolute: None,
        until_error: None,
        receivers: None,
        polarization: (design.polarization == Carrying::Carried).then(|| PolarizationEntry {
            light: design.polarization,
            depolarised_by: observation.depolarised_by.clone(),
        }),
        files: Vec::new(),
    }
}
