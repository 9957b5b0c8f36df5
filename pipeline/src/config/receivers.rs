// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[receivers]]`, checked: what each looks at, and which light.

use serde::{Deserialize, Serialize};
use tracer::glam::DVec3;
use tracer::receiver::{Angles, DetectorRectangle, Facing, Layout, Sense};
use tracer::{Detector, Filter, Measurement};

use super::ConfigError;
use super::check::{Context, shown, whole_division};
use super::design::Design;
use super::schema::{Carrying, is_default};
use super::sources::{self, Checked as Source};
use crate::formats::keys::Shining;

/// Most bins of all receivers together: 64 groups of them in double precision are two gigabytes.
const MOST_BINS: f64 = 4e6;

/// Most bins of a rectangle along u or v.
const MOST_ALONG_AXIS: usize = 20_000;

/// `[[receivers]]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Receiver {
    /// Names its files.
    pub name: String,
    /// What it looks at.
    pub kind: Kind,
    /// Plane, luminance: middle of the rectangle, mm.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub position_mm: Option<[f64; 3]>,
    /// Plane, luminance: lengths along u and v, mm.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub size_mm: Option<[f64; 2]>,
    /// Plane, luminance: bins along u and v.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub bins: Option<[usize; 2]>,
    /// Plane, luminance: the direction in which light passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<Normal>,
    /// Far field, luminance: bin of the polar angle, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub theta_bin_deg: Option<f64>,
    /// Far field, luminance: bin of the azimuth, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phi_bin_deg: Option<f64>,
    /// Surface: its name in the ledger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
    /// Whether it reads I, Q, U and V.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stokes: bool,
    /// Which light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub only: Option<Only>,
}

/// Kinds of receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Irradiance on a rectangle.
    Plane,
    /// Intensity over polar angle and azimuth, bins between multiples of their widths.
    FarField,
    /// Intensity on C-γ planes, bins about them.
    CGamma,
    /// Radiance on a rectangle by place and direction.
    Luminance,
    /// Flux on surfaces.
    Surface,
}

/// Directions along the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
pub enum Normal {
    /// Upwards.
    #[default]
    #[serde(rename = "+z")]
    Up,
    /// Downwards.
    #[serde(rename = "-z")]
    Down,
    /// Along x.
    #[serde(rename = "+x")]
    AlongX,
    /// Against x.
    #[serde(rename = "-x")]
    AgainstX,
    /// Along y.
    #[serde(rename = "+y")]
    AlongY,
    /// Against y.
    #[serde(rename = "-y")]
    AgainstY,
}

impl Normal {
    fn facing(self) -> Facing {
        match self {
            Self::Up => Facing::Z(Sense::Plus),
            Self::Down => Facing::Z(Sense::Minus),
            Self::AlongX => Facing::X(Sense::Plus),
            Self::AgainstX => Facing::X(Sense::Minus),
            Self::AlongY => Facing::Y(Sense::Plus),
            Self::AgainstY => Facing::Y(Sense::Minus),
        }
    }

    /// Names of u and v.
    pub fn axes(self) -> [&'static str; 2] {
        match self {
            Self::Up | Self::Down => ["x", "y"],
            Self::AlongX | Self::AgainstX => ["y", "z"],
            Self::AlongY | Self::AgainstY => ["x", "z"],
        }
    }
}

/// `[receivers.only]`: all of what is given must hold.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Only {
    /// Name in the ledger of the surface met last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_surface: Option<String>,
    /// First and last element, from 1, within whose radii the last surface was met.
    #[serde(
        deserialize_with = "crate::config::serde_arrays::exact_if_any",
        skip_serializing_if = "Option::is_none"
    )]
    pub last_elements: Option<[usize; 2]>,
    /// Least number of surfaces met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_bounces: Option<u32>,
    /// Largest number of surfaces met.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_bounces: Option<u32>,
    /// Packages from which the light comes, from 1, row by row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packages: Option<Vec<usize>>,
    /// Names of the sources from which the light comes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sources: Option<Vec<String>>,
}

/// A receiver of a checked design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// As written.
    pub stated: Receiver,
    /// As the tracer takes it; its sources are those of the first package, then those of the second, and so on.
    #[serde(skip)]
    pub detector: Detector,
}

/// What the receivers are checked against.
pub(super) struct Scale<'a> {
    /// Radial width of an element, mm; 0 without elements.
    pub(super) element_mm: f64,
    /// Number of elements.
    pub(super) elements: usize,
    /// Number of packages.
    pub(super) packages: usize,
    /// Sources of a package; none for the top of the box.
    pub(super) sources: &'a [Source],
    /// Number of the tracer's sources in a package.
    pub(super) emitters: usize,
    /// Whether rays carry their polarisation.
    pub(super) carried: bool,
}

impl<'a> Scale<'a> {
    /// That of a design, whose `[files.source]` emits what `file` says.
    pub(super) fn of(design: &'a Design, file: Option<&Shining>) -> Self {
        Self {
            element_mm: design.elements.width_mm,
            elements: design.elements.shapes.len(),
            packages: design.array.columns * design.array.rows,
            sources: &design.sources,
            emitters: match file {
                Some(file) => file.parts.len(),
                None => sources::per_package(&design.sources),
            },
            carried: design.polarization == Carrying::Carried,
        }
    }
}

pub(super) fn resolve(
    raw: &[Receiver],
    scale: &Scale<'_>,
    at: &Context,
) -> Result<Vec<Checked>, ConfigError> {
    let mut checked: Vec<Checked> = Vec::new();
    let mut bins = 0.0;
    for (number, receiver) in raw.iter().enumerate() {
        let key = |name: &str| format!("receivers[{}].{name}", number + 1);
        at.file_name(&key("name"), &receiver.name)?;
        let name = receiver.name.to_lowercase();
        if checked.iter().any(|c| c.stated.name.to_lowercase() == name) {
            let expected = "no name twice: it names output files";
            return Err(at.value(&key("name"), format!("{:?}", receiver.name), expected));
        }
        foreign(receiver, &key, at)?;
        let sight = sight(receiver, &key, at)?;
        let filter = filter(receiver.only.as_ref(), scale, &key, at)?;
        let mut detector = Detector::new(&receiver.name, sight).filtered(filter);
        if receiver.stokes {
            if !scale.carried {
                let expected = "no such key without light.polarization = \"carried\"";
                return Err(at.value(&key("stokes"), true, expected));
            }
            detector = detector.stokes();
        }
        bins += detector.bins() as f64;
        if bins > MOST_BINS {
            let expected = format!("at most {MOST_BINS:e} bins of all receivers together");
            return Err(at.value(&key("bins"), format!("{bins:e} so far"), &expected));
        }
        checked.push(Checked {
            stated: receiver.clone(),
            detector,
        });
    }
    Ok(checked)
}

/// Keys of other kinds are refused: they would be overlooked.
fn foreign(raw: &Receiver, key: &impl Fn(&str) -> String, at: &Context) -> Result<(), ConfigError> {
    let rectangle = matches!(raw.kind, Kind::Plane | Kind::Luminance);
    let angles = matches!(raw.kind, Kind::FarField | Kind::CGamma | Kind::Luminance);
    let given = [
        ("position_mm", shown(raw.position_mm.as_ref()), rectangle),
        ("size_mm", shown(raw.size_mm.as_ref()), rectangle),
        ("bins", shown(raw.bins.as_ref()), rectangle),
        ("normal", shown(raw.normal.as_ref()), rectangle),
        ("theta_bin_deg", shown(raw.theta_bin_deg.as_ref()), angles),
        ("phi_bin_deg", shown(raw.phi_bin_deg.as_ref()), angles),
        (
            "surface",
            shown(raw.surface.as_ref()),
            raw.kind == Kind::Surface,
        ),
        (
            "stokes",
            shown(raw.stokes.then_some(&true)),
            raw.kind != Kind::Surface,
        ),
    ];
    at.of_kind(key, &given, &["normal", "stokes"])
}

fn sight(
    raw: &Receiver,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<Measurement, ConfigError> {
    let patch = || {
        let facing = raw.normal.unwrap_or_default().facing();
        let centre = DVec3::from_array(raw.position_mm.unwrap_or_default());
        let (size, bins) = (
            raw.size_mm.unwrap_or_default(),
            raw.bins.unwrap_or_default(),
        );
        let low = centre.z
            - match facing {
                Facing::Z(_) => 0.0,
                Facing::X(_) | Facing::Y(_) => 0.5 * size[1],
            };
        if low < 0.0 || (low == 0.0 && matches!(facing, Facing::Z(_))) {
            let expected =
                format!("a rectangle above the bottom, z = 0, not one that begins at z = {low} mm");
            let got = format!("{:?}", centre.to_array());
            return Err(at.value(&key("position_mm"), got, &expected));
        }
        for length in size {
            at.length(&key("size_mm"), length)?;
        }
        for count in bins {
            at.count(&key("bins"), count, 1, MOST_ALONG_AXIS)?;
        }
        DetectorRectangle::new(facing, centre, size, bins).map_err(|error| {
            let expected = format!("one that fits: {error}");
            at.value(&key("size_mm"), format!("{size:?}"), &expected)
        })
    };
    let widths = (
        raw.theta_bin_deg.unwrap_or_default(),
        raw.phi_bin_deg.unwrap_or_default(),
    );
    if matches!(raw.kind, Kind::FarField | Kind::CGamma | Kind::Luminance) {
        let whole = if raw.kind == Kind::Luminance {
            90.0
        } else {
            180.0
        };
        for (name, whole, width) in [
            ("theta_bin_deg", whole, widths.0),
            ("phi_bin_deg", 360.0, widths.1),
        ] {
            at.length(&key(name), width)?;
            whole_division(at, &key(name), whole, width)?;
        }
    }
    // Widths divide their ranges by now.
    let refuse_angles = |error| {
        let of_phi = matches!(error, tracer::Error::BinWidth { range, .. } if range > 180.0);
        let (name, got) = if of_phi {
            ("phi_bin_deg", widths.1)
        } else {
            ("theta_bin_deg", widths.0)
        };
        at.value(&key(name), got, &format!("fewer bins: {error}"))
    };
    let sphere = |layout| Angles::sphere(layout, widths.0, widths.1).map_err(refuse_angles);
    Ok(match raw.kind {
        Kind::Plane => Measurement::Plane(patch()?),
        Kind::FarField => Measurement::FarField(sphere(Layout::Between)?),
        Kind::CGamma => Measurement::FarField(sphere(Layout::About)?),
        Kind::Luminance => {
            let angles = Angles::hemisphere(widths.0, widths.1).map_err(refuse_angles)?;
            Measurement::Luminance(patch()?, angles)
        }
        Kind::Surface => Measurement::Flux(raw.surface.clone().unwrap_or_default()),
    })
}

fn filter(
    raw: Option<&Only>,
    scale: &Scale<'_>,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<Filter, ConfigError> {
    let Some(raw) = raw else {
        return Ok(Filter::default());
    };
    let key = |name: &str| key(&format!("only.{name}"));
    let last_radii_mm = raw
        .last_elements
        .map(|[first, last]| {
            if !(1 <= first && first <= last && last <= scale.elements) {
                let expected = format!("first and last of {} elements", scale.elements);
                let got = format!("[{first}, {last}]");
                return Err(at.value(&key("last_elements"), got, &expected));
            }
            // The riser at the outer end of an element stands exactly on its border, rounding aside.
            let slack = 1e-6 * scale.element_mm;
            let end = |elements: usize| elements as f64 * scale.element_mm + slack;
            Ok([if first == 1 { -1.0 } else { end(first - 1) }, end(last)])
        })
        .transpose()?;
    let bounces = [
        raw.min_bounces.unwrap_or(0),
        raw.max_bounces.unwrap_or(u32::MAX),
    ];
    if bounces[0] > bounces[1] {
        let expected = format!("at least min_bounces, {}", bounces[0]);
        return Err(at.value(&key("max_bounces"), bounces[1], &expected));
    }
    Ok(Filter {
        last_surface: raw.last_surface.clone(),
        last_radii_mm,
        bounces,
        sources: light_of(raw, scale, &key, at)?,
    })
}

/// Numbers of the sources whose light is read, package by package; none for all.
fn light_of(
    raw: &Only,
    scale: &Scale<'_>,
    key: &impl Fn(&str) -> String,
    at: &Context,
) -> Result<Option<Vec<usize>>, ConfigError> {
    if raw.packages.is_none() && raw.sources.is_none() {
        return Ok(None);
    }
    if raw.packages.as_ref().is_some_and(Vec::is_empty) {
        let expected = "at least one package, or no such key for all";
        return Err(at.value(&key("packages"), "[]", expected));
    }
    if raw.sources.as_ref().is_some_and(Vec::is_empty) {
        let expected = "the name of one source at least, or no such key for all";
        return Err(at.value(&key("sources"), "[]", expected));
    }
    for package in raw.packages.iter().flatten() {
        at.count(&key("packages"), *package, 1, scale.packages)?;
    }
    let each = scale.emitters;
    let mut chosen: Vec<usize> = Vec::new();
    for name in raw.sources.iter().flatten() {
        let found = sources::numbers(scale.sources, name).ok_or_else(|| {
            let known = scale.sources.iter().map(|s| format!("{:?}", s.stated.name));
            let known = known.collect::<Vec<_>>().join(", ");
            let expected = if known.is_empty() {
                "no such key without [[sources]], of which there are none".to_owned()
            } else {
                format!("names of [[sources]], of which there are: {known}")
            };
            at.value(&key("sources"), format!("{name:?}"), &expected)
        })?;
        chosen.extend(found);
    }
    if raw.sources.is_none() {
        chosen = (0..each).collect();
    }
    let packages = match &raw.packages {
        Some(packages) => packages.iter().map(|package| package - 1).collect(),
        None => (0..scale.packages).collect::<Vec<_>>(),
    };
    let of = |package: usize| chosen.iter().map(move |number| package * each + number);
    Ok(Some(packages.into_iter().flat_map(of).collect()))
}
