// SPDX-License-Identifier: MIT OR Apache-2.0
//! Names of files that a search writes into the directory of results.

use super::log;

/// The design that was found, under the directory of results.
pub const DESIGN: &str = "design.toml";
/// Picture of the Pareto front, beside it.
pub const FRONT_PICTURE: &str = "front.png";
/// Picture of the convergence of the search.
pub const CONVERGENCE: &str = "convergence.png";
/// Picture of the sensitivities.
pub const SENSITIVITIES: &str = "sensitivities.png";
/// Start of the names of files of a Pareto front.
pub(super) const FRONT: &str = "front-";

/// True where `name` is that of a file that a search writes, or of its page.
pub fn is_output(name: &str) -> bool {
    const OUTPUTS: [&str; 8] = [
        DESIGN,
        FRONT_PICTURE,
        CONVERGENCE,
        SENSITIVITIES,
        results::FILE,
        results::optimisation::FILE,
        log::FILE,
        "report.html",
    ];
    OUTPUTS.contains(&name) || is_of_front(name)
}

/// True where `name` is that of a design of a Pareto front.
pub(super) fn is_of_front(name: &str) -> bool {
    let number = name.strip_prefix(FRONT).and_then(|rest| rest.strip_suffix(".toml"));
    number.is_some_and(|number| number.parse::<u32>().is_ok())
}
