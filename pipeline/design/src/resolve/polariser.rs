// SPDX-License-Identifier: MIT OR Apache-2.0
//! Polarising faces and filters, checked: shares of two axes, or of unpolarised light.

use super::form::SolidTable;
use crate::check::Context;
use crate::error::ConfigError;
use crate::resolved::polariser::{PolarisingFace, SharesByAngle, StatedShares};
use crate::schema::films::{ByAngle, FilterKeys};
use crate::schema::solids::PolariserKeys;
use runtime::serde_arrays::List;

/// What a table of shares needs.
const SHARES: &str = "`transmittance` or `reflectance`";

/// The polariser that the table `table` states.
pub(super) fn resolve(
    stated: &PolariserKeys,
    table: &str,
    read: &SolidTable,
) -> Result<PolarisingFace, ConfigError> {
    let at = read.at;
    let key = |name: &str| format!("{table}.{name}");
    let PolariserKeys { axis_deg, pass, block, transmittance, reflectance } = stated;
    let sums = [("transmittance", transmittance), ("reflectance", reflectance)];
    if let Some((name, _)) = sums.into_iter().find(|(_, stated)| stated.is_some()) {
        let expected = "no such key of a polariser, but of its tables `pass` and `block`: shares of \
            unpolarised light are a face of kind = \"filter\"";
        return Err(at.value(&key(name), "given", expected));
    }
    let Some(pass) = pass else {
        let expected = "this table; shares of unpolarised light are a face of kind = \"filter\"";
        return Err(at.value(&key("pass"), "missing", expected));
    };
    if !read.is_polarised {
        let expected = "light that carries polarisation (light.polarization = \"carried\"), or \
            kind = \"filter\" with the shares of unpolarised light";
        return Err(at.value(&key("pass"), "given in unpolarised light", expected));
    }
    if *pass == FilterKeys::default() {
        return Err(at.value(&key("pass"), "an empty table", SHARES));
    }
    let axis_deg = at.within(&key("axis_deg"), axis_deg.unwrap_or_default(), -360.0, 360.0)?;
    let block = block.clone().unwrap_or_default();
    let shares =
        Box::new([shares_of(&key("pass"), pass, at)?, shares_of(&key("block"), &block, at)?]);
    Ok(PolarisingFace::Axes { shares, axis_deg })
}

/// The filter that the table `table` states.
pub(super) fn filter(
    stated: &FilterKeys,
    table: &str,
    at: &Context,
) -> Result<PolarisingFace, ConfigError> {
    filter_shares(stated, table, at).map(PolarisingFace::Unpolarised)
}

/// The shares of unpolarised light that the table `table` states.
pub(super) fn filter_shares(
    stated: &FilterKeys,
    table: &str,
    at: &Context,
) -> Result<StatedShares, ConfigError> {
    if *stated == FilterKeys::default() {
        return Err(at.value(table, "a filter without shares", SHARES));
    }
    shares_of(table, stated, at)
}

/// Transmittance and reflectance of the table `table`; neither is more than the other leaves of 1.
fn shares_of(table: &str, stated: &FilterKeys, at: &Context) -> Result<StatedShares, ConfigError> {
    let of = |name: &str, stated: Option<&ByAngle>| by_angle(format!("{table}.{name}"), stated, at);
    let shares = StatedShares {
        transmittance: of("transmittance", stated.transmittance.as_ref())?,
        reflectance: of("reflectance", stated.reflectance.as_ref())?,
    };
    // Between stated wavelengths sums are linear, and only within both ranges is there light.
    let curves = [&shares.transmittance, &shares.reflectance];
    let is_stated = |nm: f64| {
        curves.iter().filter(|of| of.is_spectral()).all(|of| {
            let ends = [of.curves.first(), of.curves.last()].map(|c| c.map_or(nm, |(nm, _)| *nm));
            (ends[0]..=ends[1]).contains(&nm)
        })
    };
    let mut all: Vec<f64> = shares.wavelengths_nm().filter(|nm| is_stated(*nm)).collect();
    // Shares that are the same at all wavelengths are checked at any.
    if !curves.iter().any(|of| of.is_spectral()) {
        all.push(0.0);
    }
    all.into_iter().try_for_each(|nm| shares.at(nm, at).map(|_| ()))?;
    Ok(shares)
}

/// A share over wavelength and angle.
fn by_angle(
    key: String,
    stated: Option<&ByAngle>,
    at: &Context,
) -> Result<SharesByAngle, ConfigError> {
    let refuse = |row: &[f64], expected: &str| Err(at.value(&key, format!("{row:?}"), expected));
    let mut curves: Vec<(f64, Vec<[f64; 2]>)> = Vec::new();
    match stated {
        None => curves.push((0.0, vec![[0.0, 0.0]])),
        Some(ByAngle::Constant(share)) => curves.push((0.0, vec![[0.0, *share]])),
        Some(ByAngle::Angles(rows)) => {
            curves.push((0.0, rows.iter().map(|List(row)| *row).collect()));
        }
        Some(ByAngle::Spectral(rows)) => {
            for List([nm, angle, share]) in rows {
                match curves.last_mut() {
                    Some((last, curve)) if last.to_bits() == nm.to_bits() => {
                        curve.push([*angle, *share]);
                    }
                    last => {
                        let before = last.map_or(0.0, |(last, _)| *last);
                        if !(*nm > before && nm.is_finite()) {
                            let expected = "wavelengths in nm, above 0 and ascending";
                            return refuse(&[*nm, *angle, *share], expected);
                        }
                        curves.push((*nm, vec![[*angle, *share]]));
                    }
                }
            }
        }
    }
    if curves.iter().all(|(_, rows)| rows.is_empty()) {
        return refuse(&[], "a number or rows of angles and shares");
    }
    for (_, rows) in &curves {
        for row in rows {
            at.within(&key, row[1], 0.0, 1.0)?;
            if !(0.0..=90.0).contains(&row[0]) {
                return refuse(row, "an angle of incidence from 0 to 90 degrees");
            }
        }
        if let Some(k) = (1..rows.len()).find(|k| rows[k - 1][0] >= rows[*k][0]) {
            return refuse(&rows[k], "angles of incidence that ascend");
        }
    }
    Ok(SharesByAngle { key, curves })
}
