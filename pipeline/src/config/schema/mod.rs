// SPDX-License-Identifier: MIT OR Apache-2.0
//! The design file as it is written: one field a key, names with their units, nothing checked yet.
//!
//! Unknown keys are refused. Tables that say *what is built* have no defaults, except that leaving
//! out `[dome]` means a bare package and leaving out `[elements]` a smooth dome; tables that say
//! *how it is observed and computed* may be left out key by key. The reference is
//! `docs/reference/design-file.md`.

use serde::{Deserialize, Serialize};

use super::serde_arrays::List;
use super::tagged::{Kinds, Tagged, TaggedTable};
use crate::geometry::profile::Reference;
use crate::metrics::far_field::{BinPlacement, PeakMethod};
use crate::spectrum::Weighting;

pub mod files;
pub mod films;
pub mod receivers;
pub mod reflectors;
pub mod solids;
pub mod sources;

pub use reflectors::{Extent, Floor, Housing, Led, Mirror};

/// A whole design file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
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
pub(super) fn tagged_tables() -> [TaggedTable; 12] {
    use receivers::{ReceiverForm, ReceiverKeys};
    use reflectors::{HousingKeys, Law, LedKeys, LedLaw, Metal, MirrorKeys, Reflectance};
    use solids::{SolidForm, SolidKeys, SurfaceLaw};
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
        TaggedTable::new::<SolidKeys, SolidForm>(&["solids"]),
        TaggedTable::new::<ReceiverKeys, ReceiverForm>(&["receivers"]),
    ]
}

/// `[dome]`: truncated sphere on a short cylinder, a curve point by point, or a mesh.
pub type Dome = Tagged<DomeKeys, DomeForm>;

/// Keys of all domes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DomeKeys {
    /// Thin layers on it, from the silicone outwards.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coating: Vec<films::Layer>,
}

/// Kinds of dome, which are told by their keys.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DomeForm {
    /// A truncated sphere on a cylinder.
    Sphere(SphereDome),
    /// A generating curve in the design.
    Meridian(MeridianDome),
    /// A generating curve in a file.
    MeridianFile(MeridianFileDome),
    /// A closed mesh.
    Mesh(MeshDome),
}

impl Kinds for DomeForm {
    // No key of a table.
    const TAG: &'static str = "";

    fn untagged(keys: &dyn Fn(&str) -> bool) -> Option<&'static str> {
        let kinds = [
            ("meridian_mm", "meridian"),
            ("meridian_file", "meridian_file"),
            ("mesh", "mesh"),
        ];
        let told = kinds.into_iter().find(|(key, _)| keys(key));
        Some(told.map_or("sphere", |(_, kind)| kind))
    }
}

/// Keys of a sphere on a cylinder.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SphereDome {
    /// Radius of the sphere, mm.
    pub sphere_radius_mm: f64,
    /// Height of the pole above the bottom, mm.
    pub height_mm: f64,
    /// Overall width (diameter), mm.
    pub width_mm: f64,
}

/// Keys of a generating curve.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MeridianDome {
    /// The curve from the axis outwards and down: rows [r, z], [r, z, bulge] or
    /// [r, z, centre r, centre z], mm.
    pub meridian_mm: Vec<Vec<f64>>,
}

/// Keys of a generating curve in a file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MeridianFileDome {
    /// A file of rows as of `meridian_mm`, relative to the design file.
    pub meridian_file: String,
}

/// Keys of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MeshDome {
    /// A closed mesh, STL or OBJ, relative to the design file.
    pub mesh: String,
    /// The unit of its lengths.
    pub mesh_unit: MeshUnit,
}

/// Units of the lengths of a mesh, whose file does not say its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MeshUnit {
    /// Micrometre.
    Um,
    /// Millimetre.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Inch.
    Inch,
}

impl MeshUnit {
    /// The unit in mm.
    pub fn mm(self) -> f64 {
        match self {
            Self::Um => 1e-3,
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::M => 1e3,
            Self::Inch => 25.4,
        }
    }
}

/// `[elements]`: concentric rings of relief, numbered from the axis outwards.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Elements {
    /// Number of elements.
    pub count: usize,
    /// Radial width of each, µm.
    pub width_um: f64,
    /// Which shape stands where.
    pub shapes: Vec<Shape>,
}

/// `[[elements.shapes]]`: the shape of the elements `from..=to`.
pub type Shape = Tagged<ShapeKeys, ShapeForm>;

/// Keys of all shapes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ShapeKeys {
    /// First element, from 1.
    pub from: usize,
    /// Last element, included.
    pub to: usize,
}

/// Kinds of cross-section.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeForm {
    /// Horizontal tread and vertical riser.
    #[serde(rename = "OS1")]
    Os1(NoKeys),
    /// Triangle standing on the chord of the element.
    Triangle(TriangleShape),
    /// Any open polygon standing on the chord.
    Polyline(PolylineShape),
    /// The sphere as it is.
    Smooth(NoKeys),
}

impl Kinds for ShapeForm {
    const TAG: &'static str = "type";
}

/// There are no keys of the kind, or none that all kinds share.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NoKeys {}

/// Keys of a triangle: two of its three angles.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TriangleShape {
    /// Interior angle at the base corner nearer the axis, degrees.
    pub inner_base_angle_deg: Option<f64>,
    /// Interior angle at the apex, degrees.
    pub apex_angle_deg: Option<f64>,
    /// Interior angle at the base corner farther out, degrees.
    pub outer_base_angle_deg: Option<f64>,
    /// The line from which angles at the base are measured.
    #[serde(default)]
    pub reference: Reference,
}

/// Keys of a polygon.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PolylineShape {
    /// Vertices between the base corners, (along the chord, above it), in chords.
    pub points_chords: Vec<List<f64, 2>>,
}

/// `[silicone]`: either `index` or `material_file`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
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
    #[expect(
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature serde asks for"
    )]
    fn is_square(&self) -> bool {
        *self == Self::Square
    }
}

/// `[array]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
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

/// `[light]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Vacuum wavelength, nm; this or `spectrum`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_nm: Option<f64>,
    /// Power over the wavelength.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
    /// With `wavelength_nm`: what figures are weighted by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weighting: Option<Weighting>,
    /// Whether rays carry their polarisation.
    #[serde(default, skip_serializing_if = "is_default")]
    pub polarization: Carrying,
}

/// What rays know of their polarisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Carrying {
    /// Nothing: every surface sees unpolarised light.
    #[default]
    Unpolarised,
    /// What smooth surfaces made of it.
    Carried,
}

/// `[light.spectrum]`, and `spectrum` of a source.
pub type Spectrum = Tagged<SpectrumKeys, SpectrumForm>;

/// Keys of all spectra.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SpectrumKeys {
    /// What figures are weighted by; of a source as of the design.
    pub weighting: Option<Weighting>,
    /// Largest change of a figure from one number of wavelengths to the next.
    pub tolerance: Option<f64>,
    /// Number of wavelengths.
    pub samples: Option<usize>,
}

/// Kinds of spectrum.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SpectrumForm {
    /// Blue die and phosphor.
    WhiteLed(WhiteLed),
    /// Power at wavelengths, linear between them.
    Table(SpectrumRows),
    /// Single wavelengths.
    Lines(SpectrumRows),
}

impl Kinds for SpectrumForm {
    const TAG: &'static str = "kind";
}

/// Keys of a white LED.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WhiteLed {
    /// Peak of the blue die, nm.
    pub blue_nm: f64,
    /// Full width of that peak at half its height, nm.
    pub blue_fwhm_nm: f64,
    /// Peak of the phosphor, nm.
    pub phosphor_nm: f64,
    /// Full width of that peak at half its height, nm.
    pub phosphor_fwhm_nm: f64,
    /// Share of the radiant power that is blue.
    pub blue_part: f64,
}

/// Keys of a table and of lines.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SpectrumRows {
    /// Wavelengths, nm.
    pub wavelength_nm: Option<Vec<f64>>,
    /// Power at each.
    pub power: Option<Vec<f64>>,
    /// A file of two columns instead, relative to the design file.
    pub file: Option<String>,
}

/// `[receiver]`: the plane on which uniformity is judged.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Average {
    /// Its images under the symmetries that the array, the packages and the files have in common.
    #[default]
    Symmetries,
    /// Nothing: bins as they were filled.
    None,
}

/// What is 0 after illuminances were normalised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
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

/// `[hybrid]`: rings, bands and tables of the wave/ray hybrid and its control.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Hybrid {
    /// Radial width of a ring, µm; must divide the width of an element.
    pub element_width_um: f64,
    /// Neighbouring rings that share one table.
    pub rings_per_band: usize,
    /// Which ring of a band its table is computed for, from 1.
    pub representative: usize,
    /// Nodes of the Bloch wavevector in one Brillouin zone; chosen for the tolerance if absent, but
    /// where `ky_count` is given.
    pub kx_per_zone: Option<usize>,
    /// Nodes of the wavevector along the grooves, 0 to the largest; chosen for the tolerance if
    /// absent.
    pub ky_count: Option<usize>,
    /// No direction's share may move by more than this when slices are halved or a third more
    /// orders kept.
    pub tolerance: f64,
    /// Highest diffraction order to keep; found for the tolerance if absent.
    pub orders: Option<usize>,
    /// A table that would take more memory than this while it is solved is refused, GiB.
    pub memory_gib: f64,
    /// Slanted sides become stairs of this height before they are solved, µm; as they are if
    /// absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stairs_um: Option<f64>,
    /// What tables keep of their orders.
    #[serde(skip_serializing_if = "is_default")]
    pub tables: TableContent,
    /// Polarisation whose shares the bands scatter by.
    #[serde(skip_serializing_if = "is_default")]
    pub polarization: Polarization,
    /// Which incidences of a table are used.
    #[serde(skip_serializing_if = "is_default")]
    pub incidence: Incidence,
    /// Which part of the light that bands scatter is kept.
    #[serde(skip_serializing_if = "is_default")]
    pub scattering: Scattering,
    /// Orders are spread over cells of direction this wide, degrees; 0 leaves them sharp.
    #[serde(skip_serializing_if = "is_default")]
    pub spread_deg: f64,
}

pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// What tables keep of their orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TableContent {
    /// Shares of the power.
    #[default]
    Shares,
    /// Jones matrices beside them.
    Matrices,
}

/// Polarisation of the light that meets a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Polarization {
    /// Half s, half p.
    #[default]
    Unpolarised,
    /// E across the plane of incidence.
    S,
    /// H across the plane of incidence.
    P,
}

/// Which incidences of a table are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Incidence {
    /// All of both hemispheres.
    #[default]
    Conical,
    /// Those in the plane across the grooves; light from elsewhere is scattered in its own plane of
    /// incidence, as that at the same angle is.
    InPlane,
    /// Those of light that travels away from the axis; other light is scattered as their mirror
    /// images.
    Outwards,
    /// Those of light that travels towards the axis; other light is scattered as their mirror
    /// images.
    Inwards,
    /// All, but with the relief turned by half a turn.
    HalfTurn,
    /// The mean over the azimuth of incidence.
    AzimuthMean,
}

/// Which part of the light that bands scatter is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scattering {
    /// All of it.
    #[default]
    Whole,
    /// What is transmitted; reflected light is absorbed.
    Transmission,
    /// All of it, but what is reflected leaves in the specular direction.
    SpecularReflection,
    /// What comes from the silicone; light from the air is absorbed.
    FromInside,
}

impl Default for Hybrid {
    fn default() -> Self {
        Self {
            element_width_um: 10.0,
            rings_per_band: 10,
            representative: 5,
            kx_per_zone: None,
            ky_count: None,
            tolerance: 2e-3,
            orders: None,
            memory_gib: 4.0,
            stairs_um: None,
            tables: TableContent::default(),
            polarization: Polarization::default(),
            incidence: Incidence::default(),
            scattering: Scattering::default(),
            spread_deg: 0.0,
        }
    }
}

/// `[trace]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Trace {
    /// Paths started by the sources together.
    pub paths: u64,
    /// A path is ended, and counted as lost, after this many surfaces.
    pub max_interactions: u32,
    /// How the beginnings of paths are drawn.
    #[serde(skip_serializing_if = "Sampling::is_random")]
    pub sampling: Sampling,
    /// Parts into which a path divides at the first surface that lets light through.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub split: Option<u32>,
    /// Whether every source is traced by itself, so that each has a ledger of its own.
    #[serde(skip_serializing_if = "is_default")]
    pub ledger_by_source: bool,
}

/// How the beginnings of paths are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
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
            split: None,
            ledger_by_source: false,
        }
    }
}
