// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes of a design whose media convert light: one for each wavelength, all in one trace.

use anyhow::{Result, ensure};
use tracer::{Outcome, Scene, WavelengthRun};

use design::Design;
use metrics::Grouped;
use metrics::colour_matching;
use metrics::plural::count;

use super::observation::{Observation, plane_grid, sphere};
use super::scene::{self, DomeSurface};

/// Memory of the readings of all wavelengths on all threads, bytes.
const MAX_BYTES: f64 = 2.0 * 1024.0 * 1024.0 * 1024.0;

/// Scenes at all wavelengths of a design, and what its sources emit at each.
pub(super) struct ConvertingScenes {
    wavelengths_nm: Vec<f64>,
    scenes: Vec<Scene>,
    emission: Vec<Vec<f64>>,
    /// Power; X, Y and Z (CIE 1931) for a power of 1.
    channels: [Vec<f64>; 4],
}

impl ConvertingScenes {
    /// Scenes of `design` with `surface` on its domes.
    ///
    /// # Errors
    /// A scene that cannot be built; more bins at all wavelengths than there is memory for.
    pub fn new(design: &Design, surface: &DomeSurface) -> Result<Self> {
        let wavelengths_nm = design.traced_nm();
        fits(design, wavelengths_nm.len())?;
        let scene_at = |node| scene::build(&design.converting_at(&wavelengths_nm, node)?, surface);
        let scenes: Vec<Scene> = (0..wavelengths_nm.len()).map(scene_at).collect::<Result<_>>()?;
        let of_package = design.emitted_at(&wavelengths_nm);
        let sources = 0..scenes[0].sources();
        let emission =
            sources.map(|number| of_package[number % of_package.len()].clone()).collect();
        let matching = |k: usize| {
            wavelengths_nm.iter().map(|nm| colour_matching::xyz(*nm)[k]).collect::<Vec<f64>>()
        };
        let channels = [vec![1.0; scenes.len()], matching(0), matching(1), matching(2)];
        Ok(Self { wavelengths_nm, scenes, emission, channels })
    }

    /// The scene of the shortest wavelength.
    pub fn first(&self) -> &Scene {
        &self.scenes[0]
    }

    /// The run through all of them.
    pub fn with_run<T>(&self, use_run: impl FnOnce(WavelengthRun<'_>) -> T) -> T {
        let scenes: Vec<&Scene> = self.scenes.iter().collect();
        use_run(WavelengthRun {
            wavelengths_nm: &self.wavelengths_nm,
            scenes: &scenes,
            emission: &self.emission,
            channels: &self.channels,
        })
    }
}

/// The power of `outcomes`, with the colours of the nine points.
pub(super) fn observation(design: &Design, outcomes: Vec<Outcome>) -> Observation {
    let mut of_channels = outcomes.into_iter().map(|outcome| Observation::new(design, outcome));
    let power = of_channels.next().expect("a channel");
    let points: Option<Vec<_>> = of_channels.map(|seen| seen.nine_points(design)).collect();
    Observation { tristimulus: points.map(|xyz| interleaved(&xyz)), ..power }
}

/// X, Y and Z of the first point, of the second, and so on.
fn interleaved(xyz: &[Grouped]) -> Grouped {
    let of_group = |group: usize| {
        let points = 0..xyz[0].group(group).len();
        points.flat_map(|point| xyz.iter().map(move |of| of.group(group)[point])).collect()
    };
    Grouped::new((0..xyz[0].count()).map(of_group).collect())
}

/// Refuses more bins than there is memory for.
fn fits(design: &Design, wavelengths: usize) -> Result<()> {
    let (grid, sphere) = (plane_grid(design), sphere(design));
    let others = design.receivers.iter().map(|receiver| receiver.detector.bins());
    let bins = grid.columns * grid.rows + sphere.polar * sphere.azimuths + others.sum::<usize>();
    let bytes = 8.0 * (bins * wavelengths * rayon::current_num_threads()) as f64;
    ensure!(
        bytes <= MAX_BYTES,
        "{}: {bins} bins at {}: expected at most 2 GiB for them, got {:.1} GiB; larger bins, a larger light.step_nm or fewer threads take less",
        design.provenance.file,
        count(wavelengths, "wavelength"),
        bytes / MAX_BYTES * 2.0
    );
    Ok(())
}
