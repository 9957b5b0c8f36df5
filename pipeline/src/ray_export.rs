// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traced rays that leave the package, as a ray file.

use std::path::Path;

use anyhow::Result;
use tracer::formats::rays::RayRecord;
use tracer::{Control, run_rays};

use design::Design;
use files::formats::ray_files::{self, RayFormat};
use files::run_context::RunContext;
use simulate::scene::{self, DomeSurface};

/// A trace whose rays are written.
pub struct RayExport<'a> {
    /// The design.
    pub design: &'a Design,
    /// Surface of its domes.
    pub surface: &'a DomeSurface,
    /// Paths to trace.
    pub paths: u64,
    /// Format of the file.
    pub format: &'static RayFormat,
    /// Luminous efficacy to state in the file, lm/W.
    pub lumens_per_watt: Option<f64>,
}

/// What was written.
pub struct ExportedRays {
    /// Number of rays.
    pub rays: u64,
    /// Their flux, W.
    pub flux_w: f64,
    /// Escaped power of the ledger, W.
    pub escaped_w: f64,
}

impl RayExport<'_> {
    /// Traces and writes the rays that leave the scene to `path`.
    ///
    /// # Errors
    /// An interrupt, or a file that cannot be written.
    pub fn write(&self, path: &Path, context: RunContext) -> Result<ExportedRays> {
        let (design, paths) = (self.design, self.paths);
        let scene = scene::build(design, self.surface)?;
        let settings = scene::settings(design, paths, context.seed);
        let bar = context.console.progress(paths, &format!("{} rays", design.name));
        let progress = |done: u64| bar.inc(done);
        let control = Control {
            progress: Some(&progress),
            cancel: Some(context.interrupt.flag()),
            ..Control::default()
        };
        let about = ray_files::RayMetadata::traced(
            &design.name,
            design.wavelength_nm,
            self.lumens_per_watt.unwrap_or(f64::NAN),
        );
        // A trace emits 1 W.
        let emitted_w = design.emitted_w();
        let mut escaped = 0.0;
        let outcome = ray_files::write(path, self.format, &about, |put| {
            let mut failed = None;
            let outcome = run_rays(&scene, &settings, control, |ray, power| {
                let record = RayRecord {
                    position: ray.origin.to_array().map(|v| v as f32),
                    direction: ray.direction.to_array().map(|v| v as f32),
                    flux: (power * emitted_w) as f32,
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
        let (rays, flux_w) = outcome?;
        Ok(ExportedRays { rays, flux_w, escaped_w: escaped * emitted_w })
    }
}
