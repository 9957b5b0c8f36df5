// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traced rays that leave the package, as a ray file.

use std::path::Path;

use anyhow::Result;
use tracer::RayRecord;
use tracer::{Control, run_rays};

use design::Design;
use formats::ray_files::{self, RayFormat};
use runtime::run_context::RunContext;
use simulate::scene::{self, DomeSurface};
use simulate::trace_plan::TracePlan;

/// Traces whose rays are written.
pub struct RayExport<'a> {
    /// The design.
    pub design: &'a Design,
    /// Traces, each in light of one wavelength, with its share of the radiant power.
    pub traces: &'a [(TracePlan, f64)],
    /// Finds the surface of the domes of a trace.
    pub surface: &'a dyn Fn(&TracePlan) -> Result<DomeSurface>,
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

/// The wavelength of all traces, nm, if they have one in common.
pub fn common_wavelength(traces: &[(TracePlan, f64)]) -> Option<f64> {
    let mut all = traces.iter().map(|(plan, _)| plan.design.wavelength_nm);
    let first = all.next()?;
    all.all(|nm| nm.to_bits() == first.to_bits()).then_some(first)
}

impl RayExport<'_> {
    /// Traces and writes the rays that leave the scene to `path`.
    ///
    /// # Errors
    /// An interrupt, or a file that cannot be written.
    pub fn write(&self, path: &Path, context: RunContext) -> Result<ExportedRays> {
        let paths = self.traces.iter().map(|(plan, _)| plan.paths).sum();
        let bar = context.console.progress(paths, &format!("{} rays", self.design.name));
        let progress = |done: u64| bar.inc(done);
        let control = Control {
            progress: Some(&progress),
            cancel: Some(context.interrupt.flag()),
            ..Control::default()
        };
        let about = ray_files::RayMetadata::traced(
            &self.design.name,
            common_wavelength(self.traces),
            self.lumens_per_watt.unwrap_or(f64::NAN),
        );
        let mut escaped_w = 0.0;
        let outcome = ray_files::write(path, self.format, &about, |put| {
            for (plan, share) in self.traces {
                let scene = scene::build(&plan.design, &(self.surface)(plan)?)?;
                let settings = scene::settings(&plan.design, plan.paths, plan.seed);
                // A trace emits 1 W.
                let emitted_w = share * self.design.emitted_w();
                let mut failed = None;
                let outcome = run_rays(&scene, &settings, control, |ray, power| {
                    let record = RayRecord {
                        position: ray.origin.to_array().map(|v| v as f32),
                        direction: ray.direction.to_array().map(|v| v as f32),
                        flux: (power * emitted_w) as f32,
                        wavelength: plan.design.wavelength_nm as f32,
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
                escaped_w += emitted_w * outcome?.total.ledger.escaped();
            }
            Ok(())
        });
        bar.finish_and_clear();
        let (rays, flux_w) = outcome?;
        Ok(ExportedRays { rays, flux_w, escaped_w })
    }
}
