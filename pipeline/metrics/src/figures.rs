// SPDX-License-Identifier: MIT OR Apache-2.0
//! The registry of figures of merit: key, names, meaning, unit, sums that a figure is read from, and how
//! it is compared.
//!
//! Results, targets of studies, objectives, stopping rules, terminal and page take all of this from
//! here. A form of uniformity over a region is a line of [`FORMS`] beside its formula, and is
//! registered by that line. Figures of a receiver are keyed `<figure>.<receiver>`; shares of the
//! accounts of the ledger have the key of the account.

use std::borrow::Cow;

use super::extraction::is_end;
use super::quantity::Unit;
use super::uniformity_forms::{FORMS, Form, RegionForm};

/// Sums that a figure is read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Far field.
    FarField,
    /// Illuminance map between neighbours.
    Map,
    /// Flows through the surfaces of the domes.
    Domes,
    /// Tristimulus values of cell, map and far field.
    Colours,
    /// Accounts of the power ledger.
    Ledger,
    /// Illuminance map, in the units of the light.
    Illuminance,
    /// Bins of a receiver of `[[receivers]]`.
    Receiver,
    /// Tristimulus values of a receiver.
    ReceiverColours,
    /// The same behind the sub-pixels of the panel.
    PanelColours,
}

impl Source {
    /// True of figures of `[[receivers]]`.
    pub fn is_of_receiver(self) -> bool {
        matches!(self, Self::Receiver | Self::ReceiverColours | Self::PanelColours)
    }

    /// True of figures of colours, which need light of several wavelengths.
    pub fn is_of_colours(self) -> bool {
        matches!(self, Self::Colours | Self::ReceiverColours | Self::PanelColours)
    }
}

/// True of a figure whose larger values are better; `None` where it depends on the purpose.
type Better = Option<bool>;
const LARGER: Better = Some(true);
const SMALLER: Better = Some(false);
const NEITHER: Better = None;

/// Definition of a figure of merit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Definition {
    /// Key in `results.json`; of accounts its beginning, of receivers what stands before the name.
    pub key: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// Heading in the table of figures shown first; `None` of a figure that is not there.
    pub heading: Option<&'static str>,
    /// Unit of the stored value; of a figure in absolute units the radiometric one.
    pub unit: Unit,
    /// Sums that it is read from.
    pub source: Source,
    /// True where the larger of two values is better, false where the smaller is; `None` where
    /// neither is.
    pub larger_is_better: Option<bool>,
    /// Default scale of its misses in studies; without one the study states it.
    pub scale: Option<f64>,
    /// True if its change decides whether wavelengths are added.
    pub adds_wavelengths: bool,
    /// True if it is in the units of the light that the design states.
    pub is_absolute: bool,
    /// Sentence for people who meet it for the first time; empty of a form, which says it itself. Exact
    /// definitions: `docs/reference/results-schema.md`.
    meaning: &'static str,
}

impl Definition {
    /// Largest value that a target may have, and the words for its unit.
    pub fn largest_target(&self) -> (f64, &'static str) {
        match self.unit {
            Unit::Degree if self.heading.is_none() => (360.0, "degrees"),
            Unit::Degree => (180.0, "degrees"),
            Unit::Fraction | Unit::Relative => (1.0, "a fraction"),
            Unit::Ratio => (1e30, "a fraction"),
            _ => (1e30, "a number"),
        }
    }

    /// True of powers and of means and extremes of them, which are 0 where no path arrives.
    pub fn is_sum(&self) -> bool {
        match self.source {
            Source::Ledger => true,
            Source::Receiver => self.key == "flux" || self.unit == Unit::WattPerSquareMillimetre,
            _ => false,
        }
    }

    /// True if it stands among the figures of a model in `results.json`; others stand there in
    /// the ledger, with the receivers or with the absolute figures.
    pub fn is_main(&self) -> bool {
        !self.is_absolute && self.source != Source::Ledger && !self.source.is_of_receiver()
    }

    /// The figure of the receiver called `name`.
    pub fn of_receiver(self, name: &str) -> NamedFigure {
        NamedFigure {
            key: format!("{}.{name}", self.key).into(),
            label: format!("{name}, {}", self.label).into(),
            definition: self,
        }
    }

    /// The share of an account of the ledger, where it is an end of light.
    pub fn of_account(account: &str) -> Option<NamedFigure> {
        Some(NamedFigure {
            key: account.to_owned().into(),
            label: account.replace('_', " ").into(),
            definition: ledger(account)?,
        })
    }

    /// Meaning in a sentence.
    pub fn meaning(&self) -> Cow<'static, str> {
        let form = FORMS.into_iter().find(|form| form.key == self.key);
        form.map_or(self.meaning.into(), |form| form.meaning().into())
    }

    const fn means(self, meaning: &'static str) -> Self {
        Self { meaning, ..self }
    }

    const fn scaled(self, scale: f64) -> Self {
        Self { scale: Some(scale), ..self }
    }

    const fn absolute(self) -> Self {
        Self { is_absolute: true, ..self }
    }

    const fn adding_wavelengths(self) -> Self {
        Self { adds_wavelengths: true, ..self }
    }
}

/// A figure of one design: of receivers and accounts each has a name of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedFigure {
    /// Definition.
    pub definition: Definition,
    /// Whole key.
    pub key: Cow<'static, str>,
    /// Name for people.
    pub label: Cow<'static, str>,
}

impl From<Definition> for NamedFigure {
    fn from(definition: Definition) -> Self {
        Self { key: definition.key.into(), label: definition.label.into(), definition }
    }
}

/// Scale of the forms of uniformity: that of valley/peak.
const FORM_SCALE: f64 = 0.03;
/// Scale of angles, degrees.
const ANGLE_SCALE: f64 = 5.0;
/// Scale of shares of flux.
const SHARE_SCALE: f64 = 0.01;

/// A figure shown after the first ones.
const fn figure(
    key: &'static str,
    label: &'static str,
    unit: Unit,
    source: Source,
    better: Better,
) -> Definition {
    Definition {
        key,
        label,
        heading: None,
        unit,
        source,
        larger_is_better: better,
        scale: None,
        adds_wavelengths: false,
        is_absolute: false,
        meaning: "",
    }
}

const fn of_far_field(key: &'static str, label: &'static str, unit: Unit) -> Definition {
    figure(key, label, unit, Source::FarField, NEITHER)
}

const fn illuminance(key: &'static str, label: &'static str, better: Better) -> Definition {
    figure(key, label, Unit::WattPerSquareMillimetre, Source::Illuminance, better).absolute()
}

/// A figure shown first; its scale is about the precision of published figures.
const fn shown_first(
    key: &'static str,
    [label, heading]: [&'static str; 2],
    (unit, source): (Unit, Source),
    better: Better,
    scale: f64,
) -> Definition {
    let heading = Some(heading);
    Definition { heading, ..figure(key, label, unit, source, better) }
        .scaled(scale)
        .adding_wavelengths()
}

/// Polar angle of the largest intensity.
pub const PEAK_ANGLE: Definition = shown_first(
    "peak_angle_deg",
    ["peak angle"; 2],
    (Unit::Degree, Source::FarField),
    NEITHER,
    ANGLE_SCALE,
)
.means("Angle from the vertical at which the intensity, averaged over azimuth, is largest.");
/// Intensity on the axis over the largest.
pub const CENTRE_TO_PEAK: Definition = shown_first(
    "centre_to_peak",
    ["centre/peak", "centre / peak"],
    (Unit::Fraction, Source::FarField),
    NEITHER,
    0.06,
)
.means("Intensity straight up over the largest of the mean over azimuth: small where the lens sends light aside.");
/// Peak angle between bins, of designs that read it as the middle of a bin.
pub const PARABOLA: Definition = of_far_field(
    "peak_angle_parabola_deg",
    "peak angle, parabola",
    Unit::Degree,
)
.means(
    "The peak angle of the mean over azimuth between bins, by a parabola through the largest ones.",
);
/// Angle between the directions at which the intensity falls to half of the largest.
pub const BEAM_ANGLE: Definition =
    of_far_field("beam_angle_deg", "beam angle, half of peak", Unit::Degree)
        .scaled(ANGLE_SCALE)
        .means(
            "Full angle between the directions at which the intensity, averaged over azimuth, falls to half of its peak.",
        );
/// Angle between the directions at which the intensity falls to a tenth of the largest.
pub const FIELD_ANGLE: Definition = of_far_field(
    "field_angle_deg",
    "field angle, tenth of peak",
    Unit::Degree,
)
.scaled(ANGLE_SCALE)
.means("Full angle between the directions at which the intensity, averaged over azimuth, falls to a tenth of its peak.");
/// Intensity on the axis.
pub const INTENSITY_CENTRE: Definition =
    of_far_field("intensity_centre", "intensity, centre", Unit::WattPerSteradian)
        .absolute()
        .means("Intensity straight up.");
/// Largest intensity.
pub const INTENSITY_PEAK: Definition =
    of_far_field("intensity_peak", "intensity, peak", Unit::WattPerSteradian)
        .absolute()
        .means("Largest intensity of the mean over azimuth.");
/// Largest intensity for 1000 lm emitted.
pub const INTENSITY_PER_KILOLUMEN: Definition = of_far_field(
    "intensity_peak_cd_per_klm",
    "intensity, peak, of 1000 lm",
    Unit::CandelaPerKilolumen,
)
.absolute()
.means("Largest intensity of the mean over azimuth for each 1000 lm that are emitted.");
/// Uniformity on a logarithmic scale, along rows and columns.
pub const UNIFORMITY: Definition =
    shown_first("uniformity", ["uniformity"; 2], (Unit::Fraction, Source::Map), LARGER, 0.02).means("Evenness of the light on the receiver plane between neighbouring LEDs, on a logarithmic scale: 100 % where the darkest place is as bright as the brightest.");
/// Uniformity on a logarithmic scale, across the diagonal of four LEDs.
pub const UNIFORMITY_DIAGONAL: Definition = Definition {
    adds_wavelengths: false,
    ..shown_first(
        "uniformity_diagonal",
        ["uniformity, diagonal"; 2],
        (Unit::Fraction, Source::Map),
        LARGER,
        0.02,
    )
}
.means("The uniformity with the darkest place on the diagonals of four LEDs.");
/// Darkest place between neighbours over the largest illuminance.
pub const VALLEY_TO_PEAK: Definition = Definition {
    adds_wavelengths: false,
    ..shown_first(
        "illuminance_valley_to_peak",
        ["illuminance valley/peak", "illuminance valley / peak"],
        (Unit::Fraction, Source::Map),
        LARGER,
        FORM_SCALE,
    )
}
.means("Illuminance of the darkest place between neighbouring LEDs over the largest.");
/// Power that leaves the silicone for good, per power emitted.
pub const EXTRACTION: Definition = shown_first(
    "extraction_efficiency",
    ["extraction"; 2],
    (Unit::Fraction, Source::Domes),
    LARGER,
    SHARE_SCALE,
)
.means("Share of the emitted power that leaves the silicone of the domes for good.");
const fn colour(key: &'static str, label: &'static str) -> Definition {
    figure(key, label, Unit::Relative, Source::Colours, NEITHER)
}

const fn colour_difference(key: &'static str, label: &'static str) -> Definition {
    Definition { larger_is_better: SMALLER, ..colour(key, label) }
}

const fn temperature(key: &'static str, label: &'static str) -> Definition {
    Definition { unit: Unit::Kelvin, ..colour(key, label) }
}

/// Largest distance between the chromaticities of two of the nine points of the cell.
pub const COLOUR_DIFFERENCE: Definition =
    colour_difference("cell_colour_difference", "colour difference Δu'v', cell").means("Largest colour difference between two of nine points of the rectangle between the outermost LEDs.");
/// Largest distance between the chromaticities of two parts of the cell.
pub const PARTS_DIFFERENCE: Definition = colour_difference(
    "cell_colour_difference_parts",
    "colour difference Δu'v', parts of cell",
)
.means("Largest colour difference between two parts of the rectangle between the outermost LEDs.");
/// Largest distance between the chromaticities of two directions.
pub const ANGLE_DIFFERENCE: Definition = colour_difference(
    "far_field_colour_difference",
    "colour difference Δu'v', directions of far field",
)
.means("Largest colour difference between two directions.");

/// Figures of the colour of a region, or their values.
#[derive(Debug, Clone, Copy)]
pub struct ColourFigures<T = Definition> {
    /// Chromaticity u'.
    pub u_prime: T,
    /// Chromaticity v'.
    pub v_prime: T,
    /// Correlated colour temperature.
    pub cct_k: T,
    /// Distance from black bodies.
    pub duv: T,
}

impl<T: Copy> ColourFigures<T> {
    /// In the order in which they are shown.
    pub const fn all(&self) -> [T; 4] {
        [self.u_prime, self.v_prime, self.cct_k, self.duv]
    }
}

/// Colour of the map.
pub const PLANE_COLOUR: ColourFigures = ColourFigures {
    u_prime: colour("plane_u_prime", "u', map").adding_wavelengths().means("Chromaticity u' of all light on the receiver plane."),
    v_prime: colour("plane_v_prime", "v', map").adding_wavelengths().means("Chromaticity v' of all light on the receiver plane."),
    cct_k: temperature("plane_cct_k", "correlated colour temperature, map").means("Colour temperature of all light on the receiver plane."),
    duv: colour("plane_duv", "Duv, map").means("Distance of the colour on the receiver plane from that of a black body: greenish above 0, pinkish below."),
};
/// Colour of the far field upwards.
pub const FAR_FIELD_COLOUR: ColourFigures = ColourFigures {
    u_prime: colour("far_field_u_prime", "u', far field").adding_wavelengths().means("Chromaticity u' of all light that leaves upwards."),
    v_prime: colour("far_field_v_prime", "v', far field").adding_wavelengths().means("Chromaticity v' of all light that leaves upwards."),
    cct_k: temperature("far_field_cct_k", "correlated colour temperature, far field").means("Colour temperature of all light that leaves upwards."),
    duv: colour("far_field_duv", "Duv, far field").means("Distance of the colour of the light upwards from that of a black body: greenish above 0, pinkish below."),
};

/// Figures of colours: differences, then the colours of the map and of the far field upwards.
pub fn colours() -> impl Iterator<Item = Definition> {
    let differences = [COLOUR_DIFFERENCE, PARTS_DIFFERENCE, ANGLE_DIFFERENCE].into_iter();
    differences.chain(PLANE_COLOUR.all()).chain(FAR_FIELD_COLOUR.all())
}

/// Power that leaves upwards, per power emitted.
pub const ESCAPED_UP: Definition =
    figure("escaped_up", "escaped up", Unit::Fraction, Source::Ledger, LARGER)
        .scaled(SHARE_SCALE)
        .adding_wavelengths()
        .means("Share of the emitted power that leaves upwards.");
/// Power that leaves downwards, per power emitted.
pub const ESCAPED_DOWN: Definition =
    figure("escaped_down", "escaped down", Unit::Fraction, Source::Ledger, NEITHER)
        .scaled(SHARE_SCALE)
        .means("Share of the emitted power that leaves downwards.");
/// Power in any other account of the ledger, per power emitted.
const ENDED: Definition = figure("", "absorbed or lost", Unit::Fraction, Source::Ledger, SMALLER)
    .scaled(SHARE_SCALE)
    .means("Share of the emitted power that ends there.");
/// Flux that leaves upwards.
pub const FLUX_UP: Definition = figure("flux_up", "flux, up", Unit::Watt, Source::Ledger, LARGER)
    .absolute()
    .means("Flux that leaves upwards.");
/// Flux that leaves downwards.
pub const FLUX_DOWN: Definition =
    figure("flux_down", "flux, down", Unit::Watt, Source::Ledger, NEITHER)
        .absolute()
        .means("Flux that leaves downwards.");
/// Mean illuminance above the LEDs.
pub const ABOVE_LEDS: Definition =
    illuminance("illuminance_above_leds", "illuminance, above LEDs", NEITHER)
        .means("Mean illuminance of the places above the LEDs.");
/// Largest illuminance.
pub const ILLUMINANCE_PEAK: Definition =
    illuminance("illuminance_peak", "illuminance, peak", NEITHER)
        .means("Largest illuminance on the receiver plane.");
/// Mean illuminance of the cell.
pub const CELL_MEAN: Definition =
    illuminance("illuminance_cell_mean", "illuminance, cell mean", LARGER)
        .means("Mean illuminance of the rectangle between the outermost LEDs.");

/// Figures of a far field, in the order in which they are shown.
pub const FAR_FIELD: [Definition; 8] = [
    PEAK_ANGLE,
    CENTRE_TO_PEAK,
    PARABOLA,
    BEAM_ANGLE,
    FIELD_ANGLE,
    INTENSITY_CENTRE,
    INTENSITY_PEAK,
    INTENSITY_PER_KILOLUMEN,
];
/// Figures of the map between neighbours, above the zero of the design.
pub const BETWEEN_NEIGHBOURS: [Definition; 3] = [UNIFORMITY, UNIFORMITY_DIAGONAL, VALLEY_TO_PEAK];
/// Figures of the map in absolute units, in the order in which they are shown.
pub const ILLUMINANCE: [Definition; 3] = [ABOVE_LEDS, ILLUMINANCE_PEAK, CELL_MEAN];

const fn of_bins(key: &'static str, label: &'static str, better: Better) -> Definition {
    figure(key, label, Unit::WattPerSquareMillimetre, Source::Receiver, better)
}

const fn angle_of_bins(key: &'static str, label: &'static str) -> Definition {
    Definition { unit: Unit::Degree, ..of_bins(key, label, NEITHER) }.scaled(ANGLE_SCALE)
}

const fn ratio_of_bins(key: &'static str, label: &'static str) -> Definition {
    Definition { unit: Unit::Fraction, ..of_bins(key, label, LARGER) }.scaled(FORM_SCALE)
}

/// Figures of receivers that have one flux.
pub mod receiver {
    use super::{
        Definition, LARGER, NEITHER, SHARE_SCALE, Unit, angle_of_bins, of_bins, ratio_of_bins,
    };

    /// Share of the emitted flux.
    pub const FLUX: Definition =
        Definition { unit: Unit::Fraction, ..of_bins("flux", "flux", LARGER) }
            .scaled(SHARE_SCALE)
            .adding_wavelengths()
            .means("Share of the emitted power that reaches the receiver; of converted light in lumens, of 683 lm for each watt.");
    /// Mean of its quantity.
    pub const MEAN: Definition =
        of_bins("mean", "mean", LARGER).means("Mean over the bins of the receiver.");
    /// Smallest bin.
    pub const MIN: Definition =
        of_bins("min", "min", NEITHER).means("Smallest bin of the receiver.");
    /// Largest bin.
    pub const MAX: Definition =
        of_bins("max", "max", NEITHER).means("Largest bin of the receiver.");
    /// Smallest over largest bin.
    pub const MIN_TO_MAX: Definition =
        ratio_of_bins("min_to_max", "min/max").means("Smallest over largest bin of the receiver.");
    /// Smallest over largest of nine points of a display.
    pub const NINE_POINTS: Definition = ratio_of_bins("nine_points", "nine points, min/max")
        .means("Smallest over largest of nine points of the receiver, as displays are measured.");
    /// Smallest over largest of thirteen points of a display.
    pub const THIRTEEN_POINTS: Definition =
        ratio_of_bins("thirteen_points", "thirteen points, min/max").means(
            "Smallest over largest of thirteen points of the receiver, as displays are measured.",
        );
    /// Luminance about the normal, over the whole rectangle.
    pub const AXIAL: Definition =
        of_bins("axial", "axial", LARGER).means("Luminance seen along the normal of the receiver.");
    /// Angle between the directions in the plane of u at which luminance falls to half of its peak.
    pub const WIDTH_U: Definition =
        angle_of_bins("fwhm_u_deg", "full width at half luminance along u").means(
            "Full angle between the directions along u at which the luminance falls to half of its peak, outwards from it.",
        );
    /// The same in the plane of v.
    pub const WIDTH_V: Definition =
        angle_of_bins("fwhm_v_deg", "full width at half luminance along v").means(
            "Full angle between the directions along v at which the luminance falls to half of its peak, outwards from it.",
        );
}

/// Figures of every receiver that has one flux, in the order in which they are shown: its share of
/// the emitted flux, then mean and extremes of its quantity; of rectangles with three bins along each
/// side the points of a display; then luminance by the angle to the normal.
pub const OF_RECEIVER: [Definition; 10] = [
    receiver::FLUX,
    receiver::MEAN,
    receiver::MIN,
    receiver::MAX,
    receiver::MIN_TO_MAX,
    receiver::NINE_POINTS,
    receiver::THIRTEEN_POINTS,
    receiver::AXIAL,
    receiver::WIDTH_U,
    receiver::WIDTH_V,
];

/// Fluxes on the surfaces of a receiver, as shares of the emitted flux: what comes from each side, and
/// what of it is absorbed and goes through.
pub const OF_SURFACE: [Definition; 6] = [
    of_side("from_inside", "from inside"),
    of_side("from_inside_absorbed", "from inside, absorbed"),
    of_side("from_inside_passed", "from inside, passed"),
    of_side("from_outside", "from outside"),
    of_side("from_outside_absorbed", "from outside, absorbed"),
    of_side("from_outside_passed", "from outside, passed"),
];

const fn of_side(key: &'static str, label: &'static str) -> Definition {
    Definition { unit: Unit::Fraction, ..of_bins(key, label, NEITHER) }
        .scaled(SHARE_SCALE)
        .adding_wavelengths()
        .means("Share of the emitted power on a surface by the side that it comes from; each time that it comes counts. Of converted light in lumens, of 683 lm for each watt.")
}

/// Former names of figures of receivers, each with the name of today.
const FORMER: [[&str; 2]; 2] =
    [["half_angle_u_deg", receiver::WIDTH_U.key], ["half_angle_v_deg", receiver::WIDTH_V.key]];

/// Endings that make the former name before them that of a file.
const FILES: [&str; 3] = ["csv", "json", "toml"];

/// `text` of a user with the names of figures of today in place of former ones, and a warning for each
/// that was in it.
pub fn with_names_of_today(text: &str) -> (Cow<'_, str>, Vec<String>) {
    let mut text = Cow::Borrowed(text);
    let mut warnings = Vec::new();
    for [former, now] in FORMER {
        // The name of a receiver follows.
        let dotted = format!("{former}.");
        let mut parts = text.split(&dotted[..]);
        let mut of_today = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let ends = |c: char| !(c.is_alphanumeric() || "-_".contains(c));
            let next = part.split(ends).next().unwrap_or_default();
            of_today.push_str(if FILES.contains(&next) { former } else { now });
            of_today.push('.');
            of_today.push_str(part);
        }
        if of_today != *text {
            text = of_today.into();
            warnings.push(format!("{former} is called {now}, and read as that"));
        }
    }
    (text, warnings)
}

const fn of_receiver(colour: Definition) -> Definition {
    Definition { source: Source::ReceiverColours, ..colour }
}

/// Colour of every receiver that has one flux.
pub const RECEIVER_COLOUR: ColourFigures = ColourFigures {
    u_prime: of_receiver(colour("u_prime", "u'")).adding_wavelengths().means("Chromaticity u' of all light on the receiver."),
    v_prime: of_receiver(colour("v_prime", "v'")).adding_wavelengths().means("Chromaticity v' of all light on the receiver."),
    cct_k: of_receiver(temperature("cct_k", "correlated colour temperature")).means("Colour temperature of all light on the receiver."),
    duv: of_receiver(colour("duv", "Duv")).means("Distance of the colour on the receiver from that of a black body: greenish above 0, pinkish below."),
};
const fn behind_panel(colour: Definition) -> Definition {
    Definition { source: Source::PanelColours, ..colour }
}

const fn coverage(key: &'static str, label: &'static str) -> Definition {
    let colour = behind_panel(colour(key, label)).scaled(SHARE_SCALE);
    Definition { unit: Unit::Fraction, larger_is_better: LARGER, ..colour }
        .means("Share of a standard's gamut that the sub-pixels reach before the light on the receiver, each open with the others closed.")
}

/// Colour that the open panel makes of the light of a receiver.
pub const PANEL_WHITE: ColourFigures = ColourFigures {
    u_prime: behind_panel(colour("white_u_prime", "u', white of panel")).means("Chromaticity u' of the light on the receiver behind the open panel."),
    v_prime: behind_panel(colour("white_v_prime", "v', white of panel")).means("Chromaticity v' of the light on the receiver behind the open panel."),
    cct_k: behind_panel(temperature("white_cct_k", "correlated colour temperature, white of panel")).means("Colour temperature of the light on the receiver behind the open panel."),
    duv: behind_panel(colour("white_duv", "Duv, white of panel")).means("Distance of the colour behind the open panel from that of a black body: greenish above 0, pinkish below."),
};
/// Gamut of the panel before the light of a receiver, in the order of [`crate::gamut::coverages`].
pub const COVERAGE: [Definition; 6] = [
    coverage("coverage_bt2020_xy", "coverage of BT.2020 in x, y"),
    coverage("coverage_bt2020_uv", "coverage of BT.2020 in u', v'"),
    coverage("coverage_dci_p3_xy", "coverage of DCI-P3 in x, y"),
    coverage("coverage_dci_p3_uv", "coverage of DCI-P3 in u', v'"),
    coverage("coverage_bt709_xy", "coverage of BT.709 in x, y"),
    coverage("coverage_bt709_uv", "coverage of BT.709 in u', v'"),
];

/// Colours of every receiver that has one flux, in the order in which they are shown.
pub fn colours_of_receiver() -> impl Iterator<Item = Definition> {
    RECEIVER_COLOUR.all().into_iter().chain(PANEL_WHITE.all()).chain(COVERAGE)
}

/// All figures of receivers.
pub fn of_receivers() -> impl Iterator<Item = Definition> {
    OF_RECEIVER.into_iter().chain(colours_of_receiver()).chain(OF_SURFACE)
}

/// The figure of a form of uniformity.
pub fn of_form(form: RegionForm) -> Definition {
    let (unit, better) = match form.form {
        Form::Variation => (Unit::Ratio, SMALLER),
        _ => (Unit::Fraction, LARGER),
    };
    figure(form.key, form.label, unit, Source::Map, better).scaled(FORM_SCALE)
}

/// All figures whose key needs no name: those of the far field, of the map, extraction, the other
/// forms of uniformity, colours, and those of flux and illuminance.
pub fn all() -> impl Iterator<Item = Definition> {
    let forms = FORMS.into_iter().map(of_form);
    let read = FAR_FIELD.into_iter().chain(BETWEEN_NEIGHBOURS).chain([EXTRACTION]);
    let flux = [ESCAPED_UP, ESCAPED_DOWN, FLUX_UP, FLUX_DOWN];
    read.chain(forms).chain(colours()).chain(flux).chain(ILLUMINANCE)
}

/// The figure under `key`, with the name of an account or of a receiver in it.
pub fn find(key: &str) -> Option<Definition> {
    let named = key.split_once('.').filter(|(_, name)| !name.is_empty());
    let of_receiver = |(figure, _)| of_receivers().find(|known| known.key == figure);
    let whole = || all().find(|figure| figure.key == key);
    named.and_then(of_receiver).or_else(whole).or_else(|| ledger(key))
}

/// The share of `account`, where it is an end of light.
fn ledger(account: &str) -> Option<Definition> {
    let escaped = [ESCAPED_UP, ESCAPED_DOWN].into_iter().find(|known| known.key == account);
    let ended = is_end(account) && !account.starts_with("escaped_") && !account.ends_with('_');
    escaped.or_else(|| ended.then_some(ENDED))
}

/// Keys of all figures, with placeholders for the names of receivers and accounts.
pub fn keys() -> String {
    keys_of(|_| true)
}

/// Those of the figures that are `wanted`, and of accounts.
pub fn keys_of(wanted: impl Fn(&Definition) -> bool) -> String {
    let of_receiver = of_receivers().filter(&wanted);
    let of_receiver = of_receiver.map(|figure| format!("{}.RECEIVER", figure.key));
    let all = all().filter(&wanted).map(|figure| figure.key.to_owned()).chain(of_receiver);
    let accounts = ["absorbed_by_SURFACE", "absorbed_in_MEDIUM", "lost_CAUSE"].map(str::to_owned);
    all.chain(accounts).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::collections::BTreeSet;

    #[test]
    fn keys_are_unique() {
        let keys: BTreeSet<&str> = all().map(|figure| figure.key).collect();
        assert_eq!(keys.len(), all().count());
    }

    #[test]
    fn names_of_receivers_and_accounts_are_part_of_keys() {
        let key = |key: &str| find(key).map(|figure| figure.key);
        assert_eq!(key("flux.plate.2"), Some("flux"));
        assert_eq!(key("from_inside_absorbed.sheet"), Some("from_inside_absorbed"));
        assert_eq!(key("nine_points.plate"), Some("nine_points"));
        assert_eq!(key("half_angle_u_deg.plate"), None);
        let (text, warnings) = with_names_of_today("\"half_angle_u_deg.plate\" = 90");
        assert_eq!((&text[..], warnings.len()), ("\"fwhm_u_deg.plate\" = 90", 1));
        for same in ["half_angle = 1", "table = \"half_angle_u_deg.csv\""] {
            assert_eq!(with_names_of_today(same), (Cow::Borrowed(same), Vec::new()));
        }
        assert_eq!(key("absorbed_by_led_top"), Some(""));
        assert_eq!(key("escaped_up"), Some("escaped_up"));
        for none in ["flux.", "flux", "glow.plate", "absorbed_by_", "escaped_left", "emitted"] {
            assert_eq!(key(none), None, "{none}");
        }
        let named = receiver::MEAN.of_receiver("plate");
        assert_eq!((&named.key[..], &named.label[..]), ("mean.plate", "plate, mean"));
    }

    #[test]
    fn the_reference_names_every_figure() {
        let text = include_str!("../../../docs/reference/results-schema.md");
        let rows = text.lines().filter_map(|line| line.strip_prefix("| "));
        let first_cells: Vec<&str> = rows.filter_map(|row| row.split(" | ").next()).collect();
        let named = |word: &str| {
            let quoted = format!("`{word}`");
            first_cells.iter().any(|cell| cell.contains(&quoted))
        };
        for figure in all() {
            // Forms of uniformity stand there as `<region>_<form>`.
            let parts = figure.key.split_once('_').map(|(region, form)| [region, form]);
            let by_parts = parts.is_some_and(|parts| parts.into_iter().all(named));
            assert!(named(figure.key) || by_parts, "{}", figure.key);
        }
    }

    #[test]
    fn every_figure_says_what_it_means() {
        for figure in all().chain(of_receivers()).chain([ENDED]) {
            let words = figure.meaning();
            assert!(words.ends_with('.') && words.len() > 15, "{}: {words}", figure.key);
        }
        assert_eq!(
            find("cell_min_to_mean").expect("a form").meaning(),
            "Smallest over mean illuminance (U0 of EN 12464-1) on the rectangle between the outermost LEDs."
        );
    }
}
