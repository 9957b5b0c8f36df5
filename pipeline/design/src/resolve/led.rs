// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[led]`: the box, and where it stands in every package.

use tracer::glam::DVec3;

use geometry::outline::into_cylinder;

use super::package::reflector;
use crate::check::{Context, MAX_LENGTH_MM, MIN_LENGTH_MM};
use crate::error::ConfigError;
use crate::resolved::dome::Dome;
use crate::resolved::led::{BoxPlace, Led};
use crate::schema;
use crate::schema::reflectors::LedLaw;
use crate::tagged::Tagged;
use runtime::serde_arrays::List;

/// Largest rotation about x or y, degrees.
const MAX_TILT_DEG: f64 = 10.0;

/// The box of `raw`, inside `dome` in every package.
pub(crate) fn resolve(
    raw: &schema::Led,
    dome: Option<&Dome>,
    at: &Context,
) -> Result<Led, ConfigError> {
    let Tagged { shared: keys, kind: LedLaw(law) } = raw;
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
        return Err(if outside(MIN_LENGTH_MM) {
            at.value("led.size_mm", format!("{size_mm:?}"), expected)
        } else {
            at.value("led.height_mm", height_mm, expected)
        });
    }
    let pair = |key: &str, stated: List<f64, 2>, most: f64| {
        for v in stated.0 {
            at.within(key, v, -most, most)?;
        }
        Ok(stated.0)
    };
    let rows = |key: &str, stated: &[List<f64, 2>], most: f64| {
        let rows = stated.iter().zip(1..);
        rows.map(|(stated, k)| pair(&format!("{key}[{k}]"), *stated, most))
            .collect::<Result<Vec<_>, _>>()
    };
    let led = Led {
        size_mm,
        height_mm,
        reflector: reflector("led", law, at)?,
        sides: keys.sides.as_ref().map(|law| reflector("led.sides", &law.kind, at)).transpose()?,
        offset_mm: pair("led.offset_mm", keys.offset_mm, MAX_LENGTH_MM)?,
        tilt_deg: pair("led.tilt_deg", keys.tilt_deg, MAX_TILT_DEG)?,
        offsets_mm: rows("led.offsets_mm", &keys.offsets_mm, MAX_LENGTH_MM)?,
        tilts_deg: rows("led.tilts_deg", &keys.tilts_deg, MAX_TILT_DEG)?,
    };
    if let (Some(dome), false) = (dome, led.is_centred()) {
        stands_inside(&led, dome, at)?;
    }
    Ok(led)
}

/// Refuses a box that leaves the dome in one of the packages.
fn stands_inside(led: &Led, dome: &Dome, at: &Context) -> Result<(), ConfigError> {
    let leaves = |place: BoxPlace| {
        let corners = led.at(place).corners(0.0);
        corners.into_iter().any(|corner| !holds(dome, corner))
    };
    let Some((package, place)) = (0..).zip(led.stated_places()).find(|(_, p)| leaves(*p)) else {
        return Ok(());
    };
    let untilted = BoxPlace { tilt_deg: [0.0; 2], ..place };
    // A box that would stay inside without its tilt is out by it.
    let (key, common, own) = if leaves(untilted) {
        let own = led.offsets_mm.get(package);
        (["led.offset_mm", "led.offsets_mm"], led.offset_mm, own)
    } else {
        let own = led.tilts_deg.get(package);
        (["led.tilt_deg", "led.tilts_deg"], led.tilt_deg, own)
    };
    let expected = "a box that stays inside the dome";
    let common = format!("{common:?}");
    Err(match own {
        None => at.value(key[0], common, expected),
        Some(own) => {
            let got = format!("{own:?} beside {} = {common}", key[0]);
            at.value(&format!("{}[{}]", key[1], package + 1), got, expected)
        }
    })
}

/// True if a corner of the box lies inside the dome; on the bottom of a mesh the scene tells.
fn holds(dome: &Dome, corner: DVec3) -> bool {
    let r = corner.x.hypot(corner.y);
    match dome {
        Dome::Sphere(sphere) => r < sphere.radius_mm && corner.z < sphere.height_at(r),
        Dome::Meridian(meridian) => {
            into_cylinder(meridian, r, corner.z.max(MIN_LENGTH_MM)).is_none()
        }
        Dome::Mesh(mesh) => corner.z <= MIN_LENGTH_MM || mesh.shape.holds(corner),
    }
}
