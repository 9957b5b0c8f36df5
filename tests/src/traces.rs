// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces of a design: on its true steps, and on the smooth sphere in bands.

use std::path::Path;

use design::Design;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::trace::observe;

/// The design of the paper in `name`.
///
/// # Panics
/// If it is none.
pub fn design(name: &str) -> Design {
    design::embedded(name).expect("a valid design")
}

/// The design of `text`, checked with its scene.
///
/// # Panics
/// With what is wrong with it.
pub fn parsed(text: &str) -> Design {
    let design = design::parse("own.toml", text, Path::new(""));
    let design = design.unwrap_or_else(|error| panic!("{error}"));
    scene_check::check(&design).unwrap_or_else(|error| panic!("{error}"));
    design
}

/// The same design with a cell for every ring instead of one for every ten.
pub fn every_ring(name: &str) -> Design {
    let mut design = design(name);
    design.hybrid.rings_per_band = 1;
    design.hybrid.representative = 1;
    design
}

/// Traces a model that needs no tables.
///
/// # Panics
/// If the scene is refused.
pub fn trace(design: &Design, model: Model, paths: u64, seed: u64) -> Observation {
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, seed);
    let surface = dome_surface(design, model, None).expect("a surface");
    observe(design, &surface, paths, "", env).expect("a trace")
}
