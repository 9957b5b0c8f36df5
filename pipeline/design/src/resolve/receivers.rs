// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[receivers]]`, checked: what each looks at, and which light.

use tracer::glam::DVec3;
use tracer::receiver::{Angles, DetectorRectangle, Facing, Layout};
use tracer::{Detector, Filter, Measurement};

use super::MAX_SPOT_BINS;
use crate::check::{Context, MIN_LENGTH_MM, whole_division};
use crate::error::ConfigError;
use crate::resolved::files::SourceFile;
use crate::resolved::receivers::CheckedReceiver;
use crate::resolved::sources::{self, CheckedSource};
use crate::schema;
use crate::schema::receivers::{AngularReceiver, Only, ReceiverForm, StatedRectangle};
use geometry::profile::Elements;
use metrics::kinds::Carrying;
use runtime::serde_arrays::List;

/// Most bins of all receivers together: 64 groups of them in double precision are two gigabytes.
pub(super) const MAX_BINS: f64 = 4e6;

/// Longest rectangle, and its farthest place, mm: a thousand kilometres, for what is far away.
const MAX_SIZE_MM: f64 = 1e9;

/// Least width of a bin of directions, degrees.
const MIN_BIN_DEG: f64 = 1e-6;

/// Most bins of a rectangle along u or v.
const MAX_ALONG_AXIS: usize = 20_000;

/// What the filters of receivers choose from.
#[derive(Clone, Copy)]
pub(crate) struct FilteredLight<'a> {
    pub elements: &'a Elements,
    pub sources: &'a [CheckedSource],
    /// Number of packages.
    pub packages: usize,
    /// `[files.source]`.
    pub file: Option<&'a SourceFile>,
}

/// The receivers of `raw`.
pub(crate) fn resolve(
    raw: &schema::Design,
    light: FilteredLight,
    at: &Context,
) -> Result<Vec<CheckedReceiver>, ConfigError> {
    let mut checked: Vec<CheckedReceiver> = Vec::new();
    let mut bins = 0.0;
    for (number, receiver) in raw.receivers.iter().enumerate() {
        let table = format!("receivers[{}].", number + 1);
        let at = &Context { file: at.file, prefix: &table };
        let stated = &receiver.shared.name;
        at.file_name("name", stated)?;
        let name = stated.to_lowercase();
        if checked.iter().any(|c| c.name().to_lowercase() == name) {
            let expected = "no name twice: it names output files";
            return Err(at.value("name", format!("{stated:?}"), expected));
        }
        let measurement = measurement(&receiver.kind, at)?;
        let filter = filter(receiver.shared.only.as_ref(), light, at)?;
        let mut detector = Detector::new(stated, measurement).filtered(filter);
        if receiver.kind.stokes() {
            if raw.light.polarization != Carrying::Carried {
                let expected = "no such key without light.polarization = \"carried\"";
                return Err(at.value("stokes", true, expected));
            }
            detector = detector.stokes();
        }
        bins += detector.bins() as f64;
        if bins > MAX_BINS {
            let expected = format!("at most {MAX_BINS:e} bins of all receivers together");
            return Err(at.value("bins", format!("{bins:e} so far"), &expected));
        }
        checked.push(CheckedReceiver { stated: receiver.clone(), detector });
    }
    Ok(checked)
}

/// Target of a receiver of this kind.
fn measurement(kind: &ReceiverForm, at: &Context) -> Result<Measurement, ConfigError> {
    let rectangle = || rectangle(kind.rectangle().unwrap_or_default(), at);
    let sphere = |angular: &AngularReceiver, layout| {
        let make = |theta, phi| Angles::sphere(layout, theta, phi);
        angles([angular.theta_bin_deg, angular.phi_bin_deg], 180.0, make, at)
    };
    Ok(match kind {
        ReceiverForm::Plane(_) => Measurement::Plane(rectangle()?),
        ReceiverForm::FarField(stated) => Measurement::FarField(sphere(stated, Layout::Between)?),
        ReceiverForm::CGamma(stated) => Measurement::FarField(sphere(stated, Layout::About)?),
        ReceiverForm::Luminance(stated) => {
            let widths = [stated.theta_bin_deg, stated.phi_bin_deg];
            let end_deg = stated.theta_max_deg.unwrap_or(90.0);
            let view = stated.view_deg.map_or([0.0; 2], |List(view)| view);
            for (angle, high) in view.into_iter().zip([90.0 - MIN_BIN_DEG, 360.0]) {
                let low = if high < 90.0 { 0.0 } else { -high };
                at.within("view_deg", angle, low, high)?;
            }
            let max_deg = 90.0 - view[0];
            at.within("theta_max_deg", end_deg, MIN_BIN_DEG, max_deg)?;
            let make = |theta, phi| Angles::cone(end_deg, theta, phi)?.about(view);
            let angles = angles(widths, end_deg, make, at)?;
            Measurement::Luminance(rectangle()?, angles)
        }
        ReceiverForm::Surface(stated) => Measurement::Flux(stated.surface.clone()),
    })
}

fn rectangle(stated: StatedRectangle, at: &Context) -> Result<DetectorRectangle, ConfigError> {
    let StatedRectangle { position_mm, size_mm, bins, normal, spot_mm } = stated;
    for value in position_mm {
        at.within("position_mm", value, -MAX_SIZE_MM, MAX_SIZE_MM)?;
    }
    let facing = normal.facing();
    let centre = DVec3::from_array(position_mm);
    let flat = matches!(facing, Facing::Z(_));
    let low = centre.z - if flat { 0.0 } else { 0.5 * size_mm[1] };
    if low < 0.0 || (low == 0.0 && flat) {
        let expected =
            format!("a rectangle above the bottom, z = 0, not one that begins at z = {low} mm");
        let got = format!("{position_mm:?}");
        return Err(at.value("position_mm", got, &expected));
    }
    for length in size_mm {
        at.within("size_mm", length, MIN_LENGTH_MM, MAX_SIZE_MM)?;
    }
    for count in bins {
        at.count("bins", count, 1, MAX_ALONG_AXIS)?;
    }
    if let Some(spot_mm) = spot_mm {
        let most = [0, 1].map(|k| size_mm[k] / (bins[k] as f64 / MAX_SPOT_BINS).max(3.0));
        at.within("spot_mm", spot_mm, 1e-3, most[0].min(most[1]))?;
    }
    DetectorRectangle::new(facing, centre, size_mm, bins).map_err(|error| {
        let expected = format!("one that fits: {error}");
        at.value("size_mm", format!("{size_mm:?}"), &expected)
    })
}

/// Bins of these widths, those of the polar angle up to `polar`, in degrees.
fn angles(
    widths: [f64; 2],
    polar: f64,
    make: impl Fn(f64, f64) -> Result<Angles, tracer::Error>,
    at: &Context,
) -> Result<Angles, ConfigError> {
    let names = ["theta_bin_deg", "phi_bin_deg"];
    for ((name, width), whole) in names.into_iter().zip(widths).zip([polar, 360.0]) {
        at.within(name, width, MIN_BIN_DEG, whole)?;
        whole_division(at, name, whole, width)?;
    }
    // Widths divide their ranges by now.
    make(widths[0], widths[1]).map_err(|error| {
        let of_phi = matches!(error, tracer::Error::BinWidth { range, .. } if range > 180.0);
        let which = usize::from(of_phi);
        let expected = format!("fewer bins: {error}");
        at.value(names[which], widths[which], &expected)
    })
}

fn filter(raw: Option<&Only>, light: FilteredLight, at: &Context) -> Result<Filter, ConfigError> {
    let Some(raw) = raw else {
        return Ok(Filter::default());
    };
    let table = format!("{}only.", at.prefix);
    let at = &Context { file: at.file, prefix: &table };
    let last_radii_mm = raw
        .last_elements
        .map(|List([first, last])| {
            let count = light.elements.shapes.len();
            if !(1 <= first && first <= last && last <= count) {
                let expected = format!("first and last of {count} elements");
                let got = format!("[{first}, {last}]");
                return Err(at.value("last_elements", got, &expected));
            }
            // The riser at the outer end of an element stands exactly on its border, rounding
            // aside.
            let width_mm = light.elements.width_mm;
            let slack = 1e-6 * width_mm;
            let end = |elements: usize| elements as f64 * width_mm + slack;
            Ok([if first == 1 { -1.0 } else { end(first - 1) }, end(last)])
        })
        .transpose()?;
    let bounces = [raw.min_bounces.unwrap_or(0), raw.max_bounces.unwrap_or(u32::MAX)];
    if bounces[0] > bounces[1] {
        let expected = format!("at least min_bounces, {}", bounces[0]);
        return Err(at.value("max_bounces", bounces[1], &expected));
    }
    Ok(Filter {
        last_surface: raw.last_surface.clone(),
        last_radii_mm,
        bounces,
        sources: light_of(raw, light, at)?,
    })
}

/// Numbers of the sources whose light is read, package by package; none for all.
fn light_of(
    raw: &Only,
    FilteredLight { sources: all, packages, file, .. }: FilteredLight,
    at: &Context,
) -> Result<Option<Vec<usize>>, ConfigError> {
    if raw.packages.is_none() && raw.sources.is_none() {
        return Ok(None);
    }
    if raw.packages.as_ref().is_some_and(Vec::is_empty) {
        let expected = "at least one package, or no such key for all";
        return Err(at.value("packages", "[]", expected));
    }
    if raw.sources.as_ref().is_some_and(Vec::is_empty) {
        let expected = "the name of one source at least, or no such key for all";
        return Err(at.value("sources", "[]", expected));
    }
    let emitters = file.map_or_else(|| sources::per_package(all), |file| file.parts.len());
    for package in raw.packages.iter().flatten() {
        at.count("packages", *package, 1, packages)?;
    }
    let mut chosen: Vec<usize> = Vec::new();
    for name in raw.sources.iter().flatten() {
        let found = sources::numbers(all, name).ok_or_else(|| {
            let known = all.iter().map(|s| format!("{:?}", s.name()));
            let known = known.collect::<Vec<_>>().join(", ");
            let expected = if known.is_empty() {
                "no such key without [[sources]], of which there are none".to_owned()
            } else {
                format!("names of [[sources]], of which there are: {known}")
            };
            at.value("sources", format!("{name:?}"), &expected)
        })?;
        chosen.extend(found);
    }
    if raw.sources.is_none() {
        chosen = (0..emitters).collect();
    }
    let packages = match &raw.packages {
        Some(packages) => packages.iter().map(|package| package - 1).collect(),
        None => (0..packages).collect::<Vec<_>>(),
    };
    let of = |package: usize| chosen.iter().map(move |number| package * emitters + number);
    Ok(Some(packages.into_iter().flat_map(of).collect()))
}
