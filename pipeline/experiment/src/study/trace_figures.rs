// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of the traces of a study, with their jackknife replicates.

use std::collections::BTreeMap;

use serde::Serialize;

use results::paired_figure::PairedFigure;

/// Figures of one trace, in the order of the tables.
pub type NamedFigures = Vec<(String, PairedFigure)>;

/// Design and model of a trace.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct TraceId {
    /// Name of the design.
    pub design: String,
    /// Model, or the element of a probe.
    pub model: String,
}

/// All traces of a set-up.
pub type SetupFigures = BTreeMap<TraceId, NamedFigures>;

/// A figure of one trace.
pub(super) fn find<'a>(
    found: &'a SetupFigures,
    place: &TraceId,
    figure: &str,
) -> Option<&'a PairedFigure> {
    found.get(place)?.iter().find(|(name, _)| name == figure).map(|f| &f.1)
}
