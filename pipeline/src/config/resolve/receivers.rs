// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[receivers]]`, checked: what each looks at, and which light.

use tracer::glam::DVec3;
use tracer::receiver::{Angles, DetectorRectangle, Facing, Layout};
use tracer::{Detector, Filter, Measurement};

use crate::config::check::{Context, shown, whole_division};
use crate::config::design::Design;
use crate::config::design::files::Shining;
use crate::config::design::receivers::CheckedReceiver;
use crate::config::design::sources::{self, CheckedSource};
use crate::config::error::ConfigError;
use crate::config::schema::Carrying;
use crate::config::schema::receivers::{Only, Receiver, ReceiverKind};

/// Most bins of all receivers together: 64 groups of them in double precision are two gigabytes.
const MOST_BINS: f64 = 4e6;

/// Most bins of a rectangle along u or v.
const MOST_ALONG_AXIS: usize = 20_000;

/// What the receivers are checked against.
pub(in crate::config) struct Scale<'a> {
    /// Radial width of an element, mm; 0 without elements.
    pub(in crate::config) element_mm: f64,
    /// Number of elements.
    pub(in crate::config) elements: usize,
    /// Number of packages.
    pub(in crate::config) packages: usize,
    /// Sources of a package; none for the top of the box.
    pub(in crate::config) sources: &'a [CheckedSource],
    /// Number of the tracer's sources in a package.
    pub(in crate::config) emitters: usize,
    /// Whether rays carry their polarisation.
    pub(in crate::config) carried: bool,
}

impl<'a> Scale<'a> {
    /// That of a design, whose `[files.source]` emits what `file` says.
    pub(in crate::config) fn of(design: &'a Design, file: Option<&Shining>) -> Self {
        Self {
            element_mm: design.elements.width_mm,
            elements: design.elements.shapes.len(),
            packages: design.array.count(),
            sources: &design.sources,
            emitters: match file {
                Some(file) => file.parts.len(),
                None => sources::per_package(&design.sources),
            },
            carried: design.polarization == Carrying::Carried,
        }
    }
}

pub(in crate::config) fn resolve(
    raw: &[Receiver],
    scale: &Scale<'_>,
    at: &Context,
) -> Result<Vec<CheckedReceiver>, ConfigError> {
    let mut checked: Vec<CheckedReceiver> = Vec::new();
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
        checked.push(CheckedReceiver {
            stated: receiver.clone(),
            detector,
        });
    }
    Ok(checked)
}

/// Keys of other kinds are refused: they would be overlooked.
fn foreign(raw: &Receiver, key: &impl Fn(&str) -> String, at: &Context) -> Result<(), ConfigError> {
    let rectangle = matches!(raw.kind, ReceiverKind::Plane | ReceiverKind::Luminance);
    let angles = matches!(
        raw.kind,
        ReceiverKind::FarField | ReceiverKind::CGamma | ReceiverKind::Luminance
    );
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
            raw.kind == ReceiverKind::Surface,
        ),
        (
            "stokes",
            shown(raw.stokes.then_some(&true)),
            raw.kind != ReceiverKind::Surface,
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
    if matches!(
        raw.kind,
        ReceiverKind::FarField | ReceiverKind::CGamma | ReceiverKind::Luminance
    ) {
        let whole = if raw.kind == ReceiverKind::Luminance {
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
        ReceiverKind::Plane => Measurement::Plane(patch()?),
        ReceiverKind::FarField => Measurement::FarField(sphere(Layout::Between)?),
        ReceiverKind::CGamma => Measurement::FarField(sphere(Layout::About)?),
        ReceiverKind::Luminance => {
            let angles = Angles::hemisphere(widths.0, widths.1).map_err(refuse_angles)?;
            Measurement::Luminance(patch()?, angles)
        }
        ReceiverKind::Surface => Measurement::Flux(raw.surface.clone().unwrap_or_default()),
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
