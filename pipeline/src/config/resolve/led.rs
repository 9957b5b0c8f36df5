// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[led]`: the box, and where it stands in every package.

use tracer::glam::DVec3;

use super::package::reflector;
use crate::config::check::{Context, LEAST_LENGTH_MM, MOST_LENGTH_MM};
use crate::config::design::dome::Dome;
use crate::config::design::led::Led;
use crate::config::error::ConfigError;
use crate::config::schema;
use crate::config::schema::reflectors::LedLaw;
use crate::config::serde_arrays::List;
use crate::config::tagged::Tagged;
use crate::geometry::outline::into_cylinder;

/// Largest rotation about x or y, degrees.
const MOST_TILT_DEG: f64 = 10.0;

/// The box of `raw`, inside `dome` in every package.
pub(in crate::config) fn resolve(
    raw: &schema::Led,
    dome: Option<&Dome>,
    at: &Context,
) -> Result<Led, ConfigError> {
    let Tagged {
        shared: keys,
        kind: LedLaw(law),
    } = raw;
    let size_mm = keys.size_mm.0;
    for v in size_mm {
        at.length("led.size_mm", v)?;
    }
    let height_mm = at.length("led.height_mm", keys.height_mm)?;
    let corner = 0.5 * size_mm[0].hypot(size_mm[1]);
    let outside = |height_mm: f64| match dome {
        None => false,
        Some(Dome::Sphere(sphere)) => {
            corner >= sphere.radius_mm || height_mm >= sphere.height_at(corner)
        }
        Some(Dome::Meridian(meridian)) => into_cylinder(meridian, corner, height_mm).is_some(),
        Some(Dome::Mesh(mesh)) => !mesh.holds_box(size_mm, height_mm),
    };
    if outside(height_mm) {
        let expected = "a box whose corners lie inside the dome";
        return Err(if outside(LEAST_LENGTH_MM) {
            at.value("led.size_mm", format!("{size_mm:?}"), expected)
        } else {
            at.value("led.height_mm", height_mm, expected)
        });
    }
    let shifts = |key: &str, stated: List<f64, 2>| {
        for v in stated.0 {
            at.within(key, v, -MOST_LENGTH_MM, MOST_LENGTH_MM)?;
        }
        Ok(stated.0)
    };
    for v in keys.tilt_deg.0 {
        at.within("led.tilt_deg", v, -MOST_TILT_DEG, MOST_TILT_DEG)?;
    }
    let own = keys.offsets_mm.iter().zip(1..);
    let offsets_mm = own.map(|(stated, k)| shifts(&format!("led.offsets_mm[{k}]"), *stated));
    let led = Led {
        size_mm,
        height_mm,
        reflector: reflector("led", law, at)?,
        offset_mm: shifts("led.offset_mm", keys.offset_mm)?,
        tilt_deg: keys.tilt_deg.0,
        offsets_mm: offsets_mm.collect::<Result<_, _>>()?,
    };
    if let (Some(dome), false) = (dome, led.is_centred()) {
        stands_inside(&led, dome, at)?;
    }
    Ok(led)
}

/// Refuses a box that leaves the dome in one of the packages.
fn stands_inside(led: &Led, dome: &Dome, at: &Context) -> Result<(), ConfigError> {
    let centred = Led {
        offset_mm: [0.0; 2],
        offsets_mm: Vec::new(),
        ..led.clone()
    };
    let leaves = |led: &Led, package: usize| {
        let corners = led.at(led.place(package)).corners(0.0);
        corners.into_iter().any(|corner| !holds(dome, corner))
    };
    let expected = "a box that stays inside the dome";
    if leaves(&centred, 0) {
        let got = format!("{:?}", led.tilt_deg);
        return Err(at.value("led.tilt_deg", got, expected));
    }
    let packages = 0..led.offsets_mm.len().max(1);
    let Some(package) = packages.into_iter().find(|k| leaves(led, *k)) else {
        return Ok(());
    };
    let stated = format!("{:?}", led.offset_mm);
    Err(match led.offsets_mm.get(package) {
        None => at.value("led.offset_mm", stated, expected),
        Some(own) => {
            let key = format!("led.offsets_mm[{}]", package + 1);
            at.value(
                &key,
                format!("{own:?} beside led.offset_mm = {stated}"),
                expected,
            )
        }
    })
}

/// Whether a corner of the box lies inside the dome; on the bottom of a mesh the scene tells.
fn holds(dome: &Dome, corner: DVec3) -> bool {
    let r = corner.x.hypot(corner.y);
    match dome {
        Dome::Sphere(sphere) => r < sphere.radius_mm && corner.z < sphere.height_at(r),
        Dome::Meridian(meridian) => {
            into_cylinder(meridian, r, corner.z.max(LEAST_LENGTH_MM)).is_none()
        }
        Dome::Mesh(mesh) => corner.z <= LEAST_LENGTH_MM || mesh.shape.holds(corner),
    }
}

/// Refuses offsets that are not those of `packages` packages.
pub(in crate::config) fn one_for_each(
    led: &Led,
    packages: usize,
    at: &Context,
) -> Result<(), ConfigError> {
    let rows = led.offsets_mm.len();
    if rows == 0 || rows == packages {
        return Ok(());
    }
    let expected = format!("a row [x, y] for each of the {packages} packages, or none");
    Err(at.value("led.offsets_mm", format!("{rows} rows"), &expected))
}
