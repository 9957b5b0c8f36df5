// SPDX-License-Identifier: MIT OR Apache-2.0
//! Writer of the files of a model, which the caller of a run hands in.

use std::borrow::Cow;
use std::path::Path;

use anyhow::Result;

use design::Design;
use results::ModelResult;
use runtime::run_context::RunContext;

use super::observation::Observation;
use super::units::Units;

/// Design, units and directory of the files of a model.
#[derive(Clone, Copy)]
pub struct Output<'a> {
    /// The design.
    pub design: &'a Design,
    /// Units of far fields and maps.
    pub units: Units,
    /// Directory of results.
    pub out: &'a Path,
}

/// Writer of the files of a model: maps, sections, pictures, receivers.
pub trait ModelWriter: Sync {
    /// True where the package is drawn beside its light.
    fn draws_package(&self) -> bool {
        true
    }

    /// Writes the files of `observation` and lists them in `result`. An owned observation loses
    /// its receivers, to free their memory.
    ///
    /// # Errors
    /// A ledger that does not add up; files that cannot be written.
    fn write(
        &self,
        output: Output,
        result: &mut ModelResult,
        observation: &mut Cow<'_, Observation>,
        context: RunContext,
    ) -> Result<()>;

    /// Writes the azimuthal means at every wavelength (source, nm, observation) and of their
    /// `sum`, each per flux that the sources emit there, and lists the files in `result`. Writers
    /// of no files leave them out.
    ///
    /// # Errors
    /// Files that cannot be written.
    fn write_by_wavelength(
        &self,
        _output: Output,
        _result: &mut ModelResult,
        _nodes: &[(Option<&str>, f64, &Observation)],
        _sum: &Observation,
    ) -> Result<()> {
        Ok(())
    }
}

/// Directory of results, and the writer of the files of each model there.
#[derive(Clone, Copy)]
pub struct Destination<'a> {
    /// Directory of results.
    pub out: &'a Path,
    /// Writer of the files of each model.
    pub writer: &'a dyn ModelWriter,
}
