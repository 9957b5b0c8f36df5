// SPDX-License-Identifier: MIT OR Apache-2.0
//! The design file as it is written: one field a key, names with their units, nothing checked yet.
//!
//! Unknown keys are refused. Tables that say *what is built* have no defaults, except that leaving
//! out `[dome]` means a bare package and leaving out `[elements]` a smooth dome; tables that say
//! *how it is observed and computed* may be left out key by key. The reference is
//! `docs/reference/design-file.md`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use metrics::digits::shortest;
use metrics::far_field::{BinPlacement, PeakMethod};

use super::tagged::TaggedTable;
use runtime::serde_arrays::List;

pub mod dome;
pub mod files;
pub mod film_stack;
pub mod films;
pub mod hybrid;
pub mod light;
pub mod luminescence;
pub mod panel;
pub mod prints;
pub mod receivers;
pub mod reflectors;
pub mod scattering;
pub mod solids;
pub mod sources;

pub use dome::{Dome, DomeForm, Elements, MeshUnit, Shape, ShapeForm};
pub use hybrid::{Hybrid, Polarization, TableContent};
pub use light::{Light, Spectrum, SpectrumForm};
pub use luminescence::Luminophore;
pub use reflectors::{Extent, Floor, Housing, Led, Mirror};
pub use scattering::{ByWavelength, Particles};

/// A whole design file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Design {
    /// Name of output directories and results: at most 100 letters, digits, `-`, `_`, `.`; no `.`
    /// first.
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
    /// Sources in place of the top of the LED box.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<sources::Source>,
    /// Further solids and sheets.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub solids: Vec<solids::Solid>,
    /// Plates and films over the array, the lowest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub films: Vec<film_stack::Film>,
    /// Ink on the mirror and on faces of films.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prints: Vec<prints::Print>,
    /// Panel that `zones` shows pictures on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panel: Option<panel::Panel>,
    /// Wave/ray hybrid and its tables.
    #[serde(default)]
    pub hybrid: Hybrid,
    /// Monte Carlo.
    #[serde(default)]
    pub trace: Trace,
    /// Bands, mirror and source from files of other programs.
    #[serde(default)]
    pub files: files::Files,
}

/// The tables that are of one of several kinds, those within others first.
pub(super) fn tagged_tables() -> [TaggedTable; 16] {
    use dome::{DomeKeys, ShapeKeys};
    use light::SpectrumKeys;
    use receivers::{ReceiverForm, ReceiverKeys};
    use reflectors::{HousingKeys, Law, LedKeys, LedLaw, Metal, MirrorKeys, Reflectance, Walls};
    use solids::{ScatterLaw, SolidForm, SolidKeys, SurfaceLaw};
    use sources::{SourceForm, SourceKeys};
    [
        TaggedTable::new::<DomeKeys, DomeForm>(&["dome"]),
        TaggedTable::new::<ShapeKeys, ShapeForm>(&["elements", "shapes"]),
        TaggedTable::new::<MirrorKeys, Law<Metal>>(&["mirror"]),
        TaggedTable::new::<NoKeys, Law<Metal>>(&["led", "sides"]),
        TaggedTable::new::<LedKeys, LedLaw>(&["led"]),
        TaggedTable::new::<NoKeys, Law<Reflectance>>(&["housing", "floor"]),
        TaggedTable::new::<HousingKeys, Walls>(&["housing"]),
        TaggedTable::new::<SpectrumKeys, SpectrumForm>(&["light", "spectrum"]),
        TaggedTable::new::<SpectrumKeys, SpectrumForm>(&["sources", "spectrum"]),
        TaggedTable::new::<SourceKeys, SourceForm>(&["sources"]),
        TaggedTable::new::<NoKeys, SurfaceLaw>(&["solids", "surface"]),
        TaggedTable::new::<NoKeys, ScatterLaw>(&["solids", "scatter"]),
        TaggedTable::new::<SolidKeys, SolidForm>(&["solids"]),
        TaggedTable::new::<NoKeys, ScatterLaw>(&["films", "top"]),
        TaggedTable::new::<NoKeys, ScatterLaw>(&["films", "bottom"]),
        TaggedTable::new::<ReceiverKeys, ReceiverForm>(&["receivers"]),
    ]
}

/// No keys: of a kind without any, or of kinds that share none.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoKeys {}

/// `[silicone]`: either `index` or `material_file`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Silicone {
    /// Refractive index, real, above 1, below 10 (of a solid from 0.1); this or `material_file`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<f64>,
    /// Material file: YAML or CSV of refractiveindex.info, or a glass catalogue (`.agf`); index and
    /// absorption over all wavelengths of the design.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material_file: Option<String>,
    /// Glass of a catalogue, in upper or lower case; needed where it has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub glass: Option<String>,
    /// Absorption coefficient for power, 1/mm, added to that of the file; 0 to 10⁶. Here and below
    /// a list stands for one number: rows of wavelength in nm and value, straight lines between.
    #[serde(default)]
    pub absorption_per_mm: ByWavelength,
    /// Scattering coefficient, 1/mm: the reciprocal of the mean free path; 0 to 10⁵. Default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scattering_per_mm: Option<ByWavelength>,
    /// Mean cosine of the scattering angle by Henyey and Greenstein's phase function, -1 to 1;
    /// default 0, all directions alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub g: Option<ByWavelength>,
    /// Phase function in place of `g`: rows of angle in degrees, from 0 to 180, and value per
    /// steradian in any unit, linear in the cosine of the angle between.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_table: Option<Vec<List<f64, 2>>>,
    /// Spheres that scatter by Mie's theory, in place of the three keys before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particles: Option<Particles>,
    /// Substances that convert light, as phosphors and quantum dots do: tables as below.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub luminophores: Vec<Luminophore>,
}

impl Design {
    /// True if a medium converts light to other wavelengths.
    pub(crate) fn converts(&self) -> bool {
        let of_solids = self.solids.iter().filter_map(|solid| solid.shared.medium.as_ref());
        let of_films = self.films.iter().map(|film| &film.medium);
        let mut media = self.silicone.iter().chain(of_solids).chain(of_films);
        media.any(|medium| !medium.luminophores.is_empty())
    }
}

/// Places of the rows of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Arrangement {
    /// Package above package, rows one pitch apart.
    #[default]
    Square,
    /// Every other row half a pitch to the right, rows √3/2 of a pitch apart or as `pitch_mm` states.
    Hexagonal,
}

/// Distances of neighbours, mm.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "a number or [x, y]")]
pub enum Pitch {
    /// One in all directions.
    Same(f64),
    /// Of columns (along x) and of rows (along y).
    Along(List<f64, 2>),
}

impl Pitch {
    /// Of columns and of rows, mm.
    pub fn along(self) -> [f64; 2] {
        match self {
            Self::Same(pitch_mm) => [pitch_mm; 2],
            Self::Along(List(along)) => along,
        }
    }

    /// The smaller of both, mm.
    pub fn min(self) -> f64 {
        let [x, y] = self.along();
        x.min(y)
    }

    /// The larger of both, mm.
    pub fn max(self) -> f64 {
        let [x, y] = self.along();
        x.max(y)
    }
}

/// Numbers in mm, `12 x 11` for two.
impl std::fmt::Display for Pitch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Same(pitch_mm) => shortest(*pitch_mm).fmt(f),
            Self::Along(List([x, y])) => write!(f, "{} x {}", shortest(*x), shortest(*y)),
        }
    }
}

/// `[array]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Array {
    /// Packages along x, 1 to 128; required without `positions_file`.
    #[serde(default)]
    pub columns: usize,
    /// Packages along y, 1 to 128; required without `positions_file`.
    #[serde(default)]
    pub rows: usize,
    /// Distance of neighbours, mm, or `[x, y]` of columns and of rows: from the width of a package
    /// to 2000, of hexagonal rows from where packages of neighbouring rows are clear; with
    /// `positions_file` the least distance allowed.
    pub pitch_mm: Pitch,
    /// Places of the rows; default `"square"`.
    #[serde(default, skip_serializing_if = "is_default")]
    pub arrangement: Arrangement,
    /// Text file of 1 to 20 000 positions in place of `columns`, `rows` and `arrangement`: x and y
    /// a line, mm, within 100 000, and the power of the package in any unit, which shares out the
    /// power of all; commas, semicolons or spaces between numbers, `#` for comments. A first line
    /// of names states columns in any order: `x_mm`, `y_mm`, `turn_deg` (about the axis of the
    /// package, -360 to 360, from x to y: counterclockwise as seen from above), `power`, `scale`
    /// (0.5 to 2).
    pub positions_file: Option<String>,
    /// Rows [x, y] by which packages stand off their places, with all that is in them, mm: one a
    /// package, row after row from the lowest y, along x; of a file its lines. Board, ink and walls
    /// stay.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offsets_mm: Vec<List<f64, 2>>,
    /// Turn of each package about its axis, degrees, in the same order, added to that of the file;
    /// each -360 to 360, counterclockwise as seen from above (from x to y). For deviations: walls by
    /// `distance_mm` do not follow them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub turns_deg: Vec<f64>,
    /// Size of each package, in the same order, times that of the file: all of its lengths about the
    /// foot of its axis times 0.5 to 2, both together 0.25 to 4, its power as before. For deviations:
    /// walls by `distance_mm` do not follow them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scales: Vec<f64>,
    /// False: each package is traced without the others, on the mirror of the whole array, and the
    /// light is added up.
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
    /// Height above the bottom, mm; above the package, at most 10 000.
    pub plane_height_mm: f64,
    /// Side of a square bin, mm; 0.001 to a quarter of the (smaller) pitch, at most a million bins
    /// on the map.
    pub bin_mm: f64,
    /// Standard deviation of the Gaussian that smooths the map, mm; 0 to a quarter of the pitch. It passes
    /// no walls, and goes on in the next cell of one that repeats.
    pub smoothing_sigma_mm: f64,
    /// Bin in which peak and valley are read, mm: a multiple of `bin_mm`, at most a quarter of the
    /// pitch. Default: bins of `bin_mm`, the valley from a fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_bin_mm: Option<f64>,
    /// Distance from the outermost axes to the edge of the map, mm; half a (larger) pitch to 1000.
    /// Default the larger of 6.0 and half a pitch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub margin_mm: Option<f64>,
    /// Level the maximum is scaled to before the logarithm; 2 to 10⁹.
    pub full_scale: f64,
    /// Level that is scaled to 0.
    pub zero: Zero,
    /// Images the map is averaged over; default `"symmetries"`.
    #[serde(skip_serializing_if = "is_default")]
    pub average: Average,
    /// Width and depth of an area on the map, mm, whose uniformity is read beside that of the cell
    /// between LED axes (`area_*`): the active area of a display, or one pitch in its middle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_mm: Option<List<f64, 2>>,
    /// Middle of that area, mm; default the middle of the array.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_centre_mm: Option<List<f64, 2>>,
    /// Diameter of the spots over which nine and thirteen points are averaged, as a luminance meter
    /// does, mm; at most 100 bins, and a third of the area, or of the pitch without one. Default:
    /// points of the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spot_mm: Option<f64>,
}

impl Receiver {
    /// Distance from the outermost LED axes to the edge of the map, mm, at this pitch.
    pub fn margin_mm(&self, pitch: Pitch) -> f64 {
        const MIN: f64 = 6.0;
        self.margin_mm.unwrap_or(MIN.max(0.5 * pitch.max()))
    }

    /// Lower left and upper right corner of the stated area, mm.
    pub fn area_corners_mm(&self) -> Option<[[f64; 2]; 2]> {
        let List(size) = self.area_mm?;
        let List(centre) = self.area_centre_mm.unwrap_or_default();
        Some([-0.5, 0.5].map(|part| [0, 1].map(|k| centre[k] + part * size[k])))
    }

    /// Bins side by side that make one in which peak and valley are read.
    pub fn read_together(&self) -> usize {
        let read = self.read_bin_mm.unwrap_or(self.bin_mm);
        ((read / self.bin_mm).round() as usize).max(1)
    }
}

/// Images a map is averaged over.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Average {
    /// Its mirror images as far as the design has the symmetries.
    #[default]
    Symmetries,
    /// Nothing.
    None,
}

/// Level that is scaled to 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Zero {
    /// No light.
    Dark,
    /// The smallest illuminance on the map, which then depends on `margin_mm`.
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
            area_mm: None,
            area_centre_mm: None,
            spot_mm: None,
        }
    }
}

/// `[far_field]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FarFieldReceiver {
    /// Bin of the polar angle, degrees; 0.1 to 15, divides 90.
    pub bin_deg: f64,
    /// Bin of the azimuth, degrees; 1 to 45, divides 90.
    pub azimuth_bin_deg: f64,
    /// Polar angle below which the centre is averaged, degrees: where a bin that is read ends; at
    /// most 45. Default the first of these from 2.0 on.
    pub centre_deg: f64,
    /// Method of reading the peak. Default `"parabola"`.
    #[serde(skip_serializing_if = "is_default")]
    pub peak: PeakMethod,
    /// Distance from the peak within which the parabola is fitted, degrees; `read_bin_deg` (0 with
    /// `peak = "bin"`) to 45. Default at least `read_bin_deg`.
    pub peak_fit_deg: f64,
    /// Bin of the polar angle in which peak and centre are read, degrees; at most 15, divides 90, a
    /// multiple of `bin_deg` (of twice that about multiples). Default `bin_deg`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_bin_deg: Option<f64>,
    /// Places of the bins that are read. Default `"between"`.
    #[serde(skip_serializing_if = "is_default")]
    pub read_bins: BinPlacement,
    /// Azimuth of the half-plane that the peak is read from, degrees, averaged over the half-planes
    /// that are alike by the symmetries of the design; 0 to 90. Without it the mean over all azimuths
    /// is read.
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

/// True if a value is the default and need not be written.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// `[trace]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Trace {
    /// Paths started by all sources together; 1000 to 10¹².
    pub paths: u64,
    /// Number of surfaces after which a path counts as lost, as it does after 100 times as many
    /// scatterings in media; 10 to 10 000 000.
    pub max_interactions: u32,
    /// Start of the paths; Sobol' is best with `paths` = 64 · 2^m. Default `"random"`.
    #[serde(skip_serializing_if = "is_default")]
    pub sampling: Sampling,
    /// True: each of `[[sources]]` is traced by itself, with `paths` divided by flux (at least 1000
    /// each), and has its ledger (`by_source`).
    #[serde(skip_serializing_if = "is_default")]
    pub ledger_by_source: bool,
    /// Light at `[[films]]`. Default `"table"`, where it applies: `check` says.
    #[serde(skip_serializing_if = "is_default")]
    pub films: FilmTracing,
}

/// Treatment of light that meets a stack of films.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FilmTracing {
    /// It takes an outcome of a table of the whole stack.
    #[default]
    Table,
    /// It is traced film by film.
    Traced,
}

/// Start of paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// Each by itself.
    #[default]
    Random,
    /// Evenly spread over packages, places and directions; not of files.
    Sobol,
}

impl Default for Trace {
    fn default() -> Self {
        Self {
            paths: 20_000_000,
            max_interactions: 10_000,
            sampling: Sampling::Random,
            ledger_by_source: false,
            films: FilmTracing::Table,
        }
    }
}
