// SPDX-License-Identifier: MIT OR Apache-2.0
//! Account of the power: emitted = escaped + absorbed + lost, to rounding, path by path. What
//! conversion to longer waves takes from the power counts as absorbed.

use std::sync::Arc;

use bsdf::Side;

pub use crate::scene::Lines;

/// Why a ray was given up. Its remaining power is shown, never dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// It met more surfaces than the settings allow: light trapped by total reflection.
    Bounces,
    /// Inside a body it met nothing: the body leaks.
    Leak,
    /// A coordinate became NaN or infinite, or a scattering table sent it to the wrong side.
    Invalid,
}

impl Loss {
    /// All causes, in the order of [`Ledger::lost`].
    pub const ALL: [Self; 3] = [Self::Bounces, Self::Leak, Self::Invalid];

    /// A few words for reports.
    pub fn description(self) -> &'static str {
        match self {
            Self::Bounces => "too many bounces",
            Self::Leak => "leaked out of a closed body",
            Self::Invalid => "not finite or on the wrong side",
        }
    }
}

/// Power at one named part, summed over all instances.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SurfaceLine {
    /// Absorbed power, W.
    pub absorbed: f64,
    /// Power that passed from the inner to the outer side, W.
    pub outward: f64,
    /// Power that passed from the outer to the inner side, W.
    pub inward: f64,
}

/// Power at a luminescent substance, over all media and instances.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LuminophoreLine {
    /// Absorbed power, W.
    pub absorbed: f64,
    /// The part of it whose photons are not emitted again, W.
    pub quantum_loss: f64,
    /// The part of it that emitted photons lack, W; negative where they have more.
    pub stokes_loss: f64,
}

/// Power by fate, in watts for a run in which the sources emit the power of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Ledger {
    /// Emitted by all sources, W.
    pub emitted: f64,
    /// Left the scene with direction z ≥ 0, W.
    pub escaped_up: f64,
    /// Left the scene with direction z < 0, W.
    pub escaped_down: f64,
    /// Given up, by cause in the order of [`Loss::ALL`], W.
    pub lost: [f64; 3],
    /// One line for each name of [`Lines::surfaces`].
    pub surfaces: Vec<SurfaceLine>,
    /// Power absorbed on the way through each of [`Lines::media`], W.
    pub media: Vec<f64>,
    /// One line for each of [`Lines::luminophores`].
    pub luminophores: Vec<LuminophoreLine>,
    /// The names.
    pub lines: Arc<Lines>,
}

/// An event of a path that moves power between accounts.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Booking {
    /// A source emits a path of weight 1.
    Emission,
    /// The medium of a line absorbs on the way.
    Transmission { line: usize, absorbed: f64 },
    /// The luminophore of a line absorbs light and emits the rest at another wavelength.
    Conversion { line: usize, absorbed: f64, quantum_loss: f64, stokes_loss: f64 },
    /// The surface of a line takes light from the first side, absorbs a part, and sends the rest on
    /// from the second side.
    Interaction { line: usize, sides: [Side; 2], absorbed: f64, weight: f64 },
    /// Light leaves the scene for good.
    Escape { upward: bool, weight: f64 },
    /// A path is given up.
    Loss { cause: Loss, weight: f64 },
}

impl Ledger {
    /// Books an event: the rules of the ledger, for single paths and batches alike.
    #[expect(clippy::inline_always, reason = "part of the loop over a path; the event is known")]
    #[inline(always)]
    pub(crate) fn book(&mut self, event: Booking) {
        match event {
            Booking::Emission => self.emitted += 1.0,
            Booking::Transmission { line, absorbed } => self.media[line] += absorbed,
            Booking::Conversion { line, absorbed, quantum_loss, stokes_loss } => {
                let line = &mut self.luminophores[line];
                line.absorbed += absorbed;
                line.quantum_loss += quantum_loss;
                line.stokes_loss += stokes_loss;
            }
            Booking::Interaction { line, sides, absorbed, weight } => {
                let line = &mut self.surfaces[line];
                line.absorbed += absorbed;
                match sides {
                    [Side::Inner, Side::Outer] => line.outward += weight,
                    [Side::Outer, Side::Inner] => line.inward += weight,
                    [Side::Inner, Side::Inner] | [Side::Outer, Side::Outer] => {}
                }
            }
            Booking::Escape { upward: true, weight } => self.escaped_up += weight,
            Booking::Escape { upward: false, weight } => self.escaped_down += weight,
            Booking::Loss { cause, weight } => self.lost[cause as usize] += weight,
        }
    }

    pub(crate) fn new(lines: &Arc<Lines>) -> Self {
        Self {
            emitted: 0.0,
            escaped_up: 0.0,
            escaped_down: 0.0,
            lost: [0.0; 3],
            surfaces: vec![SurfaceLine::default(); lines.surfaces.len()],
            media: vec![0.0; lines.media.len()],
            luminophores: vec![LuminophoreLine::default(); lines.luminophores.len()],
            lines: Arc::clone(lines),
        }
    }

    /// All powers, in the order in which checkpoints keep them.
    pub(crate) fn powers(&mut self) -> impl Iterator<Item = &mut f64> {
        let whole = [&mut self.emitted, &mut self.escaped_up, &mut self.escaped_down];
        let surfaces = self.surfaces.iter_mut();
        let surfaces = surfaces.flat_map(|l| [&mut l.absorbed, &mut l.outward, &mut l.inward]);
        let luminophores = self.luminophores.iter_mut();
        let luminophores =
            luminophores.flat_map(|l| [&mut l.absorbed, &mut l.quantum_loss, &mut l.stokes_loss]);
        let lines = surfaces.chain(&mut self.media).chain(luminophores);
        whole.into_iter().chain(&mut self.lost).chain(lines)
    }

    /// All powers times `factor`.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.powers().for_each(|power| *power *= factor);
    }

    /// Adds all powers of another ledger, whose lines have the same names but other numbers.
    pub(crate) fn add_by_name(&mut self, other: &Self) {
        self.emitted += other.emitted;
        self.escaped_up += other.escaped_up;
        self.escaped_down += other.escaped_down;
        self.lost.iter_mut().zip(other.lost).for_each(|(lost, more)| *lost += more);
        let (lines, theirs) = (Arc::clone(&self.lines), &other.lines);
        let at = |all: &[String], name: &str| all.iter().position(|known| known == name);
        let skins = theirs.surfaces.iter().zip(&theirs.skin).zip(&other.surfaces);
        for ((name, skin), more) in skins {
            let mut all = lines.surfaces.iter().zip(&lines.skin);
            if let Some(line) = all.position(|(known, is_skin)| known == name && is_skin == skin) {
                let line = &mut self.surfaces[line];
                line.absorbed += more.absorbed;
                line.outward += more.outward;
                line.inward += more.inward;
            }
        }
        for (name, more) in theirs.media.iter().zip(&other.media) {
            if let Some(line) = at(&lines.media, name) {
                self.media[line] += more;
            }
        }
        for (name, more) in theirs.luminophores.iter().zip(&other.luminophores) {
            if let Some(line) = at(&lines.luminophores, name) {
                let line = &mut self.luminophores[line];
                line.absorbed += more.absorbed;
                line.quantum_loss += more.quantum_loss;
                line.stokes_loss += more.stokes_loss;
            }
        }
    }

    /// self · a + other · b, line by line.
    pub(crate) fn combine(&mut self, a: f64, other: &Self, b: f64) {
        for (power, other) in self.powers().zip(other.clone().powers()) {
            *power = *power * a + *other * b;
        }
    }

    /// The line of a named part.
    pub fn surface(&self, name: &str) -> Option<&SurfaceLine> {
        let line = self.lines.surfaces.iter().position(|known| known == name)?;
        Some(&self.surfaces[line])
    }

    /// All surface lines with their names.
    pub fn named_surfaces(&self) -> impl Iterator<Item = (&str, &SurfaceLine)> {
        self.lines.surfaces.iter().map(String::as_str).zip(&self.surfaces)
    }

    /// Power absorbed by surfaces and media, and lost by conversion, W.
    pub fn absorbed(&self) -> f64 {
        let lost = |line: &LuminophoreLine| line.quantum_loss + line.stokes_loss;
        self.surfaces.iter().map(|line| line.absorbed).sum::<f64>()
            + self.media.iter().sum::<f64>()
            + self.luminophores.iter().map(lost).sum::<f64>()
    }

    /// Power given up, all causes, W.
    pub fn lost_total(&self) -> f64 {
        self.lost.iter().sum()
    }

    /// Power that left the scene, W.
    pub fn escaped(&self) -> f64 {
        self.escaped_up + self.escaped_down
    }

    /// emitted - escaped - absorbed - lost, W: rounding only.
    pub fn imbalance(&self) -> f64 {
        self.emitted - self.escaped() - self.absorbed() - self.lost_total()
    }

    /// Extraction: what passes from bodies into the world less what enters again, per emitted
    /// power. What is absorbed outside afterwards counts as extracted. Meaningful where all sources
    /// lie inside bodies.
    pub fn extraction(&self) -> f64 {
        let skin = self.surfaces.iter().zip(&self.lines.skin).filter(|(_, skin)| **skin);
        skin.map(|(line, _)| line.outward - line.inward).sum::<f64>() / self.emitted
    }
}
