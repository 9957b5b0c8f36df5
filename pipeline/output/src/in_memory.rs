// SPDX-License-Identifier: MIT OR Apache-2.0
//! The arrays of models in memory, in place of files.

use std::borrow::Cow;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;

use results::ModelResult;
use runtime::run_context::RunContext;
use simulate::model_writer::{ModelWriter, Output};
use simulate::observation::Observation;

use super::array::Array;
use super::{ModelFiles, receivers, take_receivers};

/// The arrays of each model by its key, in the order of the models.
pub type ModelArrays = Vec<(String, Vec<Array>)>;

/// Keeps arrays and writes no file.
#[derive(Debug, Default)]
pub struct MemoryWriter(Mutex<ModelArrays>);

impl MemoryWriter {
    /// The arrays kept.
    pub fn into_arrays(self) -> ModelArrays {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ModelWriter for MemoryWriter {
    fn draws_package(&self) -> bool {
        false
    }

    fn write(
        &self,
        output: Output,
        result: &mut ModelResult,
        observation: &mut Cow<'_, Observation>,
        context: RunContext,
    ) -> Result<()> {
        let (of_receivers, seen) = take_receivers(output.design, result, observation);
        let files = ModelFiles::new(output, result, observation, Path::new(""), context.seed);
        files.check(context)?;
        let mean = files.far_field_curves(180.0, &[])?;
        let mut arrays = vec![
            Array::of_map("far_field", &files.far_field_map()?),
            Array::of_curve("far_field_mean", &mean[0]),
            Array::of_map("illuminance", &files.map()?),
            Array::of_curve("illuminance_cross_section", &files.section(&files.line())?),
        ];
        if let Some(colours) = files.arrays() {
            arrays.extend(files.colour_arrays(colours)?);
        }
        if !output.design.receivers.is_empty() {
            let provenance = files.provenance();
            let shared = files.of_receivers(&of_receivers, &provenance);
            let (others, said) = receivers::keep(output.design, seen, &shared)?;
            arrays.extend(others);
            result.receivers = Some(said);
        }
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push((result.key.clone(), arrays));
        Ok(())
    }
}
