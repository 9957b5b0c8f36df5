// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes of one trace of a design: one, or where its media convert light one for each wavelength.
//!
//! A trace of several scenes gives an observation of the power, one each of X, Y, Z and photons, and one
//! each of X, Y and Z behind each sub-pixel of the panel.

use std::borrow::Cow;
use std::ops::Range;

use anyhow::{Result, ensure};
use tracer::{Control, Error, Outcome, Receiver, Scene, Settings, WavelengthRun};

use design::Design;
use design::resolved::panel::SubPixel;
use metrics::colour_matching;
use metrics::plural::count;

use super::film_planes::FilmPlanes;
use super::observation::colours::{ColourArrays, Colours, Part};
use super::observation::{Observation, bins};
use super::scene::{self, DomeSurface};

/// Groups of paths, from whose scatter all errors come.
pub const GROUPS: usize = 64;

/// Memory of the readings of all wavelengths on all threads and of the observations, bytes.
const MAX_BYTES: f64 = 2.0 * 1024.0 * 1024.0 * 1024.0;

/// Scenes that a trace goes through.
pub(super) enum Scenes {
    /// Light keeps its wavelength.
    One(Box<Scene>),
    /// A scene for each wavelength.
    Converting(ConvertingScenes),
}

/// Scenes at all wavelengths of a design, and what its sources emit at each.
pub(super) struct ConvertingScenes {
    wavelengths_nm: Vec<f64>,
    scenes: Vec<Scene>,
    emission: Vec<Vec<f64>>,
    /// Weights by wavelength: power, X, Y and Z (CIE 1931) for a power of 1, photons, then X, Y and Z
    /// behind each sub-pixel of the panel.
    channels: Vec<Vec<f64>>,
}

impl Scenes {
    /// Scenes of `design` with `surface` on its domes.
    ///
    /// # Errors
    /// A scene that cannot be built; more bins at all wavelengths than there is memory for.
    pub fn new(design: &Design, surface: &DomeSurface) -> Result<Self> {
        if design.converts() {
            return ConvertingScenes::new(design, surface).map(Self::Converting);
        }
        Ok(Self::One(Box::new(scene::build(design, surface)?)))
    }

    /// The scene, or one of all: they differ in media alone.
    pub fn first(&self) -> &Scene {
        match self {
            Self::One(scene) => scene,
            Self::Converting(all) => &all.scenes[0],
        }
    }

    /// The design at the wavelength of each scene.
    ///
    /// # Errors
    /// A wavelength at which a material has no data.
    pub fn designs(&self, design: &Design) -> Result<Vec<Design>> {
        match self {
            Self::One(_) => Ok(vec![design.clone()]),
            Self::Converting(all) => {
                let nodes = &all.wavelengths_nm;
                let at = |node| Ok(design.converting_at(nodes, node)?);
                (0..nodes.len()).map(at).collect()
            }
        }
    }

    /// Traces them; one outcome for each channel.
    pub fn run(
        &self,
        receivers: &[&dyn Receiver],
        settings: &Settings,
        control: Control<'_>,
    ) -> Result<Vec<Outcome>, Error> {
        match self {
            Self::One(scene) => Ok(vec![tracer::run_with(scene, receivers, settings, control)?]),
            Self::Converting(all) => all.with_run(|run| run.run(receivers, settings, control)),
        }
    }

    /// Traces some groups of paths for the checkpoints of `control`.
    pub fn run_groups(
        &self,
        receivers: &[&dyn Receiver],
        settings: &Settings,
        control: Control<'_>,
        groups: Range<u64>,
    ) -> Result<(), Error> {
        match self {
            Self::One(scene) => tracer::run_groups(scene, receivers, settings, control, groups),
            Self::Converting(all) => {
                all.with_run(|run| run.run_groups(receivers, settings, control, groups))
            }
        }
    }

    /// Observations of the channels: power, and of several wavelengths X, Y, Z, photons, and X, Y and Z
    /// behind each sub-pixel. These are of the paths of the first, and have none of their own.
    pub fn observations(
        &self,
        design: &Design,
        planes: &FilmPlanes,
        outcomes: Vec<Outcome>,
    ) -> Vec<Observation> {
        let scene = self.first();
        let mut depolarised_by = scene.scattering_surfaces();
        depolarised_by.extend(scene.scattering_media());
        let outcomes = outcomes.into_iter().enumerate();
        let observation = |(channel, outcome)| {
            let seen = Observation::new(design, &planes.accounts, outcome);
            let paths = if channel == 0 { seen.paths } else { 0 };
            Observation { paths, depolarised_by: depolarised_by.clone(), ..seen }
        };
        outcomes.map(observation).collect()
    }
}

impl ConvertingScenes {
    fn new(design: &Design, surface: &DomeSurface) -> Result<Self> {
        let wavelengths_nm = design.traced_nm();
        converted_fits(design)?;
        let scene_at = |node| scene::build(&design.converting_at(&wavelengths_nm, node)?, surface);
        let scenes: Vec<Scene> = (0..wavelengths_nm.len()).map(scene_at).collect::<Result<_>>()?;
        let of_package = design.emitted_at(&wavelengths_nm);
        let sources = 0..scenes[0].sources();
        let emission =
            sources.map(|number| of_package[number % of_package.len()].clone()).collect();
        let matching = |k: usize| {
            wavelengths_nm.iter().map(|nm| colour_matching::xyz(*nm)[k]).collect::<Vec<f64>>()
        };
        let power = vec![1.0; scenes.len()];
        // Photons of a watt are as many as its waves are long.
        let photons = wavelengths_nm.clone();
        let mut channels = vec![power, matching(0), matching(1), matching(2), photons];
        for filter in filters(design) {
            let passed = |weight: &f64, nm: &f64| weight * filter.at(*nm);
            channels.extend([0, 1, 2].map(|k| {
                let weights = matching(k);
                weights.iter().zip(&wavelengths_nm).map(|(w, nm)| passed(w, nm)).collect()
            }));
        }
        Ok(Self { wavelengths_nm, scenes, emission, channels })
    }

    fn with_run<T>(&self, use_run: impl FnOnce(WavelengthRun<'_>) -> T) -> T {
        let scenes: Vec<&Scene> = self.scenes.iter().collect();
        use_run(WavelengthRun {
            wavelengths_nm: &self.wavelengths_nm,
            scenes: &scenes,
            emission: &self.emission,
            channels: &self.channels,
        })
    }
}

/// The channels of Y and of photons.
const LUMINOUS: usize = 2;
const PHOTONS: usize = 4;

/// Filters behind which a trace of `design` counts X, Y and Z: the sub-pixels, where a medium converts
/// light.
fn filters(design: &Design) -> &[SubPixel] {
    if design.converts() { design.sub_pixels() } else { &[] }
}

/// Number of the channels of a trace of `design`.
pub(super) fn channels(design: &Design) -> usize {
    if design.converts() { 5 + 3 * filters(design).len() } else { 1 }
}

/// The observation that the channels of a trace make: what is counted, with the colours of the light
/// and its photons where there are X, Y and Z.
pub(super) fn put_together(design: &Design, mut channels: Vec<Observation>) -> Observation {
    let filters = filters(design).len();
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let dark = Part { weights: [0.0; 3], behind: vec![[0.0; 3]; filters], seen: &channels[0] };
    let mut parts: Vec<Part> = Vec::new();
    for (k, seen) in channels.iter().enumerate().skip(1).filter(|(k, _)| *k != PHOTONS) {
        let mut part = Part { seen, ..dark.clone() };
        match k.checked_sub(PHOTONS + 1) {
            Some(behind) => part.behind[behind / 3] = axes[behind % 3],
            None => part.weights = axes[k - 1],
        }
        parts.push(part);
    }
    let colours = Colours::new(design, &parts, true);
    let photons = channels.get(PHOTONS).map(|photons| photons.powers.clone());
    let luminous = design.converts_in_lumens.then(|| channels.swap_remove(LUMINOUS));
    let power = channels.swap_remove(0);
    let counted = match luminous {
        Some(luminous) => in_lumens(&power, luminous),
        None => power,
    };
    Observation { photons, colours, ..counted }
}

/// What figures are read from, of the channels of a trace, without colours.
pub(super) fn counted<'a>(design: &Design, channels: &'a [Observation]) -> Cow<'a, Observation> {
    if design.converts_in_lumens {
        Cow::Owned(in_lumens(&channels[0], channels[LUMINOUS].clone()))
    } else {
        Cow::Borrowed(&channels[0])
    }
}

/// Map, far field and receivers of Y beside the ledger of the power.
fn in_lumens(power: &Observation, luminous: Observation) -> Observation {
    Observation {
        paths: power.paths,
        surfaces_per_path: power.surfaces_per_path,
        flows: power.flows.clone(),
        powers: power.powers.clone(),
        luminous: Some(luminous.powers),
        ..luminous
    }
}

/// Refuses more bins of light that is converted than there is memory for.
///
/// # Errors
/// These.
pub fn converted_fits(design: &Design) -> Result<()> {
    let (bins, wavelengths) = (bins(design), design.traced_nm().len());
    let on_threads = bins * wavelengths * rayon::current_num_threads();
    // Observations of the channels, and what is made of three of them.
    let observed = channels(design) * bins * (GROUPS + 1) + ColourArrays::count(design, GROUPS);
    let bytes = 8.0 * (on_threads + observed) as f64;
    ensure!(
        bytes <= MAX_BYTES,
        "{}: {bins} bins at {}: expected at most 2 GiB for them, got {:.1} GiB; larger bins, a larger light.step_nm, fewer threads or no panel.sub_pixels take less",
        design.provenance.file,
        count(wavelengths, "wavelength"),
        bytes / MAX_BYTES * 2.0
    );
    Ok(())
}
