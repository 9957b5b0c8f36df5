// SPDX-License-Identifier: MIT OR Apache-2.0
//! A hemisphere of dispersive glass, rays that start in it, and its traces.

use std::path::Path;

use tempfile::{TempDir, tempdir};

use design::Design;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::scene_check;
use simulate::spectral::SpectralJob;
use simulate::trace::observe;

use super::{Ray, Says, write};
use crate::statistics;

/// A hemisphere of glass, 2 mm in radius, its middle at z = 0.
pub const DOME: &str = r#"
name = "rays"
dome = { sphere_radius_mm = 2.0, height_mm = 2.0, width_mm = 4.0 }
silicone = { material_file = "glass.yml" }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 6.0 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
trace = { paths = 256_000 }
"#;

const GLASS: &str = "DATA:\n  - type: tabulated n\n    data: |\n        0.4 1.7\n        0.8 1.3\n";

/// The index of that glass.
pub fn index(nm: f64) -> f64 {
    1.7 - 0.4 * (nm - 400.0) / 400.0
}

/// A folder with the glass.
///
/// # Panics
/// If there is none to be had.
pub fn folder() -> TempDir {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("glass.yml"), GLASS).expect("written");
    folder
}

/// A source of `[[sources]]` by a file, half a millimetre above the bottom.
pub fn source(name: &str, file: &str, keys: &str) -> String {
    format!(
        "[[sources]]\nname = \"{name}\"\nkind = \"file\"\nfile = \"{file}\"\nposition_mm = [0.0, 0.0, 0.5]\n{keys}\n"
    )
}

/// The design that `text` states, with files in `at`.
///
/// # Panics
/// If it is refused.
pub fn parse(text: &str, at: &Path) -> Design {
    design::parse("rays.toml", text, at).unwrap_or_else(|e| panic!("{e}"))
}

/// What a trace of it sees.
///
/// # Panics
/// If rays start outside the dome.
pub fn seen(design: &Design, seed: u64) -> Observation {
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, seed);
    scene_check::check(design).expect("rays in the dome");
    if let Some(lights) = design.all_lights() {
        let job = SpectralJob {
            design,
            lights: &lights,
            model: Model::Geometric,
            cache: None,
            context: env,
        };
        return job.observe().expect("a trace");
    }
    let surface = dome_surface(design, Model::Geometric, None).expect("a dome");
    observe(design, &surface, design.trace.paths, "", env).expect("a trace")
}

/// Rays from near the middle into a cone, `k` of `count`, with a colour of their own.
pub fn fan(count: usize, colour: impl Fn(usize) -> f32) -> Vec<Ray> {
    let golden = 0.618_033_988_749_894_8;
    let ray = |k: usize| {
        let u = (k as f64 + 0.5) / count as f64;
        let phi = std::f64::consts::TAU * (k as f64 * golden).fract();
        let cos = 1.0 - 0.8 * u;
        let sin = (1.0 - cos * cos).sqrt();
        Ray {
            position: [0.9 * phi.sin() as f32, -0.5 * u as f32, 0.1 * u as f32],
            direction: [sin * phi.cos(), sin * phi.sin(), cos].map(|v| v as f32),
            flux: 0.5 + (k % 5) as f32,
            colour: colour(k),
        }
    };
    (0..count).map(ray).collect()
}

/// Judges whether two observations agree within their errors, bin by bin.
///
/// # Panics
/// If they do not.
pub fn agree(what: &str, a: &Observation, b: &Observation) {
    for (part, a, b) in
        [("far field", &a.far_field, &b.far_field), ("ledger", &a.powers, &b.powers)]
    {
        statistics::agree(&format!("{what}, {part}"), a, b, 2e-5);
    }
}

/// Writes a file of rays with two spectral tables, blue and red, of unequal flux; its rays.
///
/// # Panics
/// If it cannot be written.
pub fn write_two_tables(path: &Path) -> Vec<Ray> {
    let rays = fan(1000, |k| if k % 4 == 0 { 2.0 } else { 1.0 });
    let tables =
        Says::Tables(vec![vec![[440.0, 1.0], [460.0, 3.0]], vec![[620.0, 1.0], [640.0, 1.0]]]);
    write(path, &tables, true, &rays);
    rays
}
