// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures of merit that are asked for, and that a trace of the design does not show.

use anyhow::Error;

use design::Design;
use metrics::digits::thousands;
use simulate::observation::{Observation, why_absent};

/// Keys of the figures that `seen`, a trace of `design`, shows.
pub fn shown(design: &Design, seen: &Observation) -> Vec<String> {
    let all = seen.replicated(design, |_| true).into_iter();
    all.map(|(key, _)| key.to_string()).collect()
}

/// Complaint about `key`, which asks for a figure that is not among those `shown` by the paths of
/// `design`.
pub fn missing_figure(key: &str, figure: &str, shown: &[String], design: &Design) -> Error {
    Error::msg(format!(
        "{key}: expected a figure that the design has, {} (as {} paths show), got {figure:?}: {}",
        shown.join(", "),
        thousands(design.trace.paths),
        why_absent(design, design.trace.paths, figure, |key| shown
            .iter()
            .any(|shown| shown == key)),
    ))
}
