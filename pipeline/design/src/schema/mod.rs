// SPDX-License-Identifier: MIT OR Apache-2.0
//! The design file as it is written: one field a key, names with their units, nothing checked yet.
//!
//! Unknown keys are refused. Tables that say *what is built* have no defaults, except that leaving
//! out `[dome]` means a bare package and leaving out `[elements]` a smooth dome; tables that say
//! *how it is observed and computed* may be left out key by key. The reference is
//! `docs/reference/design-file.md`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use metrics::far_field::{BinPlacement, PeakMethod};

use super::tagged::TaggedTable;

pub mod dome;
pub mod files;
pub mod films;
pub mod hybrid;
pub mod light;
pub mod receivers;
pub mod reflectors;
pub mod solids;
pub mod sources;

pub use dome::{Dome, DomeForm, Elements, MeshUnit, Shape, ShapeForm};
pub use hybrid::{Hybrid, Polarization, TableContent};
pub use light::{Carrying, Light, Spectrum, SpectrumForm};
pub use reflectors::{Extent, Floor, Housing, Led, Mirror};

/// A whole design file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Design {
    /// Short name, used for output files.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Silicone dome; none: the LED stands in air.
    pub dome: Option<Dome>,
    /// Relief on the dome; none: smooth.
    pub elements: Option<Elements>,
    /// Material of the dome.
    pub silicone: Option<Silicone>,
    /// Reflector in the plane z = 0.
    pub mirror: Mirror,
    /// The light source box.
    pub led: Led,
    /// Packages side by side.
    pub array: Array,
    /// Walls around them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub housing: Option<Housing>,
    /// Light.
    pub light: Light,
    /// Plane receiver and uniformity.
    #[serde(default)]
    pub receiver: Receiver,
    /// Far-field receiver.
    #[serde(default)]
    pub far_field: FarFieldReceiver,
    /// Receivers beside these two.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub receivers: Vec<receivers::Receiver>,
    /// What emits, in place of the top of the LED box.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<sources::Source>,
    /// Further solids and sheets.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub solids: Vec<solids::Solid>,
    /// Wave/ray hybrid and its tables.
    #[serde(default)]
    pub hybrid: Hybrid,
    /// Monte Carlo.
    #[serde(default)]
    pub trace: Trace,
    /// What comes from files of other programs.
    #[serde(default)]
    pub files: files::Files,
}

/// The tables that are of one of several kinds, those within others first.
pub(super) fn tagged_tables() -> [TaggedTable; 13] {
    use dome::{DomeKeys, ShapeKeys};
    use light::SpectrumKeys;
    use receivers::{ReceiverForm, ReceiverKeys};
    use reflectors::{HousingKeys, Law, LedKeys, LedLaw, Metal, MirrorKeys, Reflectance};
    use solids::{ScatterLaw, SolidForm, SolidKeys, SurfaceLaw};
    use sources::{SourceForm, SourceKeys};
    [
        TaggedTable::new::<DomeKeys, DomeForm>(&["dome"]),
        TaggedTable::new::<ShapeKeys, ShapeForm>(&["elements", "shapes"]),
        TaggedTable::new::<MirrorKeys, Law<Metal>>(&["mirror"]),
        TaggedTable::new::<LedKeys, LedLaw>(&["led"]),
        TaggedTable::new::<NoKeys, Law<Reflectance>>(&["housing", "floor"]),
        TaggedTable::new::<HousingKeys, Law<Reflectance>>(&["housing"]),
        TaggedTable::new::<SpectrumKeys, SpectrumForm>(&["light", "spectrum"]),
        TaggedTable::new::<SpectrumKeys, SpectrumForm>(&["sources", "spectrum"]),
        TaggedTable::new::<SourceKeys, SourceForm>(&["sources"]),
        TaggedTable::new::<NoKeys, SurfaceLaw>(&["solids", "surface"]),
        TaggedTable::new::<NoKeys, ScatterLaw>(&["solids", "scatter"]),
        TaggedTable::new::<SolidKeys, SolidForm>(&["solids"]),
        TaggedTable::new::<ReceiverKeys, ReceiverForm>(&["receivers"]),
    ]
}

/// There are no keys of the kind, or none that all kinds share.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoKeys {}

/// `[silicone]`: either `index` or `material_file`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Silicone {
    /// Refractive index, real.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<f64>,
    /// Material file in refractiveindex.info's YAML form, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material_file: Option<String>,
    /// Absorption coefficient for power, 1/mm, beside what a material file says.
    #[serde(default)]
    pub absorption_per_mm: f64,
}

/// How the rows of an array stand to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Arrangement {
    /// Package above package, rows one pitch apart.
    #[default]
    Square,
    /// Every other row half a pitch to the right, rows √3/2 of a pitch apart: six neighbours at one
    /// pitch.
    Hexagonal,
}

impl Arrangement {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "the signature serde asks for")]
    fn is_square(&self) -> bool {
        *self == Self::Square
    }
}

/// `[array]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Array {
    /// Packages along x.
    #[serde(default)]
    pub columns: usize,
    /// Packages along y.
    #[serde(default)]
    pub rows: usize,
    /// Distance of neighbours, mm; the least one allowed where a file gives the positions.
    pub pitch_mm: f64,
    /// How rows stand to each other.
    #[serde(default, skip_serializing_if = "Arrangement::is_square")]
    pub arrangement: Arrangement,
    /// A file of positions in place of columns and rows, relative to the design file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub positions_file: Option<String>,
    /// Whether light of one package meets the others.
    #[serde(default = "yes")]
    pub crossing: bool,
}

fn yes() -> bool {
    true
}

/// `[receiver]`: the plane on which uniformity is judged.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Receiver {
    /// Height above the bottom, mm.
    pub plane_height_mm: f64,
    /// Bin, mm.
    pub bin_mm: f64,
    /// Standard deviation of the Gaussian that smooths the map, mm; 0 leaves it as it is.
    pub smoothing_sigma_mm: f64,
    /// Bin in which peak and valley are read, mm; if absent, they are read in bins of `bin_mm`, the
    /// valley from a fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_bin_mm: Option<f64>,
    /// How far the map reaches beyond the outermost LED axes, mm; in a checked design it is there:
    /// by default 6, or half a pitch where that is more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub margin_mm: Option<f64>,
    /// The level the largest illuminance is scaled to before the logarithm.
    pub full_scale: f64,
    /// What is scaled to 0.
    pub zero: Zero,
    /// What the map is averaged over before it is judged.
    #[serde(skip_serializing_if = "is_default")]
    pub average: Average,
}

impl Receiver {
    /// How far the map reaches beyond the outermost LED axes, mm, where neighbours stand `pitch_mm`
    /// apart.
    pub fn margin_mm(&self, pitch_mm: f64) -> f64 {
        const LEAST: f64 = 6.0;
        self.margin_mm.unwrap_or(LEAST.max(0.5 * pitch_mm))
    }

    /// Bins side by side that make one in which peak and valley are read.
    pub fn read_together(&self) -> usize {
        let read = self.read_bin_mm.unwrap_or(self.bin_mm);
        ((read / self.bin_mm).round() as usize).max(1)
    }
}

/// What a map is averaged over.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Average {
    /// Its images under the symmetries that the array, the packages and the files have in common.
    #[default]
    Symmetries,
    /// Nothing: bins as they were filled.
    None,
}

/// What is 0 after illuminances were normalised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Zero {
    /// Darkness: illuminances are divided by the largest.
    Dark,
    /// The smallest illuminance on the receiver, which is subtracted first.
    Smallest,
}

impl Default for Receiver {
    fn default() -> Self {
        Self {
            plane_height_mm: 3.0,
            bin_mm: 0.1,
            smoothing_sigma_mm: 0.1,
            read_bin_mm: None,
            margin_mm: None,
            full_scale: 256.0,
            zero: Zero::Dark,
            average: Average::Symmetries,
        }
    }
}

/// `[far_field]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FarFieldReceiver {
    /// Bin of the polar angle, degrees.
    pub bin_deg: f64,
    /// Bin of the azimuth, degrees.
    pub azimuth_bin_deg: f64,
    /// The centre is the mean below this polar angle, degrees.
    pub centre_deg: f64,
    /// Where the peak is: at the vertex of a parabola, or in the middle of the largest bin.
    #[serde(skip_serializing_if = "is_default")]
    pub peak: PeakMethod,
    /// The parabola is fitted to the bins within this of the largest, degrees.
    pub peak_fit_deg: f64,
    /// Bin of the polar angle in which peak and centre are read, degrees; `bin_deg` if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_bin_deg: Option<f64>,
    /// Whether the bins that are read lie between multiples of their width or about them.
    #[serde(skip_serializing_if = "is_default")]
    pub read_bins: BinPlacement,
    /// Azimuth of the cut that the peak is read from, degrees; from the mean over all azimuths if
    /// absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_deg: Option<f64>,
}

impl FarFieldReceiver {
    /// Bin of the polar angle in which peak and centre are read, degrees.
    pub fn read_bin_deg(&self) -> f64 {
        self.read_bin_deg.unwrap_or(self.bin_deg)
    }
}

impl Default for FarFieldReceiver {
    fn default() -> Self {
        Self {
            bin_deg: 2.0,
            azimuth_bin_deg: 10.0,
            centre_deg: 2.0,
            peak: PeakMethod::default(),
            peak_fit_deg: 6.0,
            read_bin_deg: None,
            read_bins: BinPlacement::default(),
            cut_deg: None,
        }
    }
}

/// Whether a value is the default, and need not be written.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// `[trace]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Trace {
    /// Paths started by the sources together.
    pub paths: u64,
    /// A path is ended, and counted as lost, after this many surfaces.
    pub max_interactions: u32,
    /// How the beginnings of paths are drawn.
    #[serde(skip_serializing_if = "Sampling::is_random")]
    pub sampling: Sampling,
    /// Whether every source is traced by itself, so that each has a ledger of its own.
    #[serde(skip_serializing_if = "is_default")]
    pub ledger_by_source: bool,
}

/// How the beginnings of paths are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// Independent of each other.
    #[default]
    Random,
    /// Scrambled Sobol' points.
    Sobol,
}

impl Sampling {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "asked for so by serde")]
    fn is_random(&self) -> bool {
        *self == Self::Random
    }
}

impl Default for Trace {
    fn default() -> Self {
        Self {
            paths: 20_000_000,
            max_interactions: 10_000,
            sampling: Sampling::Random,
            ledger_by_source: false,
        }
    }
}
