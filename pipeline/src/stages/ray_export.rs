// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traced rays that leave the package, as a ray file.

use std::path::Path;

use anyhow::Result;
use tracer::formats::rays::RayRecord;
use tracer::{Control, Settings, run_rays};

use super::scene::{self, DomeSurface};
use crate::config::design::Design;
use crate::formats::ray_files;
use crate::run_context::RunContext;

/// Traces `paths` paths of `design` with the dome's surface `surface` and writes the rays that leave the scene to `path`; the sources emit 1 W. Returns the
/// number of rays, their flux in W, and the escaped power of the ledger.
///
/// # Errors
/// An interrupt, or a file that cannot be written.
pub fn trace(
    design: &Design,
    surface: &DomeSurface,
    paths: u64,
    lumens_per_watt: Option<f64>,
    path: &Path,
    context: RunContext,
) -> Result<(u64, f64, f64)> {
    let scene = scene::build(design, surface)?;
    let settings = Settings {
        max_bounces: design.trace.max_interactions,
        polarization: scene::polarization(design),
        sampling: scene::sampling(design),
        ..Settings::new(paths, context.seed)
    };
    let bar = context.console.bar(paths, &format!("{} rays", design.name));
    let progress = |done: u64| bar.inc(done);
    let control = Control {
        progress: Some(&progress),
        cancel: Some(context.interrupt.flag()),
        ..Control::default()
    };
    let about = ray_files::about(
        &design.name,
        design.wavelength_nm,
        lumens_per_watt.unwrap_or(f64::NAN),
    );
    let mut escaped = 0.0;
    let outcome = ray_files::write(path, &about, |put| {
        let mut failed = None;
        let outcome = run_rays(&scene, &settings, control, |ray, power| {
            let record = RayRecord {
                position: ray.origin.to_array().map(|v| v as f32),
                direction: ray.direction.to_array().map(|v| v as f32),
                flux: power as f32,
                wavelength: f32::NAN,
            };
            put(&record).map_err(|error| {
                failed = Some(error);
                tracer::Error::Cancelled
            })
        });
        if let Some(error) = failed {
            return Err(error);
        }
        context.interrupt.check()?;
        escaped = outcome?.total.ledger.escaped();
        Ok(())
    });
    bar.finish_and_clear();
    let (rays, flux) = outcome?;
    Ok((rays, flux, escaped))
}
