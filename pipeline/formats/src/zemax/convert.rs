// SPDX-License-Identifier: MIT OR Apache-2.0
//! Zemax tables: one side and scatter type a file, angles about the specular direction. Rotating
//! the sample by ρ rotates the incidence by -ρ in its frame.

use super::layout::{Channel, Symmetry, ZemaxBsdf};
use crate::convert::{
    Resolution, Smearing, averaged, bin_lobes, check_discrete, halfway, of_transport, steps,
};
use bsdf::Error;
use bsdf::angular_basis::{AngularBasis, OrientedBasis};
use bsdf::direction::{Side, spherical};
use bsdf::measured::{CellDistribution, IncidentNode, LobeMotion, MeasuredBsdf, ScatterTable};
use bsdf::{Bsdf, Transport};
use glam::DVec3;
use std::sync::Arc;

/// Incident and specular direction (both in the upper hemisphere) for a specular angle and a
/// rotation of the sample, in degrees. `ratio` is the index on the side of the specular ray over
/// that on the side of incidence. `None` if no incidence has that specular ray.
fn directions(specular_deg: f64, rotation_deg: f64, ratio: f64) -> Option<(DVec3, DVec3)> {
    let azimuth = -rotation_deg.to_radians();
    let (sin, cos) = specular_deg.to_radians().sin_cos();
    let sin_i = sin * ratio;
    if sin_i >= 1.0 {
        return None;
    }
    let wi = spherical(sin_i.asin(), azimuth);
    let specular = DVec3::new(-sin * azimuth.cos(), -sin * azimuth.sin(), cos);
    Some((wi, specular))
}

/// Cells about the specular direction.
fn about_specular(
    cells: &Arc<AngularBasis>,
    wi: DVec3,
    specular: DVec3,
    rotation_deg: f64,
) -> OrientedBasis {
    let azimuth = -rotation_deg.to_radians();
    let zero = if wi.truncate().length() > 1e-12 {
        DVec3::new(wi.x, wi.y, 0.0)
    } else {
        DVec3::new(azimuth.cos(), azimuth.sin(), 0.0)
    };
    OrientedBasis::about(cells, specular, zero)
}

/// Ratio of the index on the side of the specular ray to that on the side of incidence.
fn ratio(indices: [f64; 2], side: Side, transport: Transport) -> f64 {
    indices[transport.exit_side(side).index()] / indices[side.index()]
}

/// The table of `surface` for light from `side`, reflected or transmitted. Incidences beyond the
/// critical angle have no specular transmission, so a BTDF from the denser side leaves them out.
///
/// # Errors
/// If the resolution is invalid, or the surface has a diffuse lobe.
pub fn to_zemax(
    surface: &dyn Bsdf,
    side: Side,
    transport: Transport,
    resolution: &Resolution,
) -> Result<(ZemaxBsdf, Smearing), Error> {
    resolution.check(1)?;
    check_discrete(surface)?;
    let ratio = ratio(Side::BOTH.map(|s| surface.index(s)), side, transport);
    let step = resolution.scatter_deg;
    let incidences: Vec<f64> = resolution
        .incidences()
        .into_iter()
        .filter(|a| directions(*a, 0.0, ratio).is_some())
        .collect();
    let mut bsdf = ZemaxBsdf {
        comments: Vec::new(),
        transport,
        symmetry: Symmetry::Asymmetrical4D,
        rotations: resolution.azimuths(),
        incidences,
        azimuths: steps(360.0, step, 0.0),
        radials: steps(180.0, step, 0.0),
        channels: Vec::new(),
    };
    let cells = Arc::new(AngularBasis::around_points(&bsdf.azimuths, &bsdf.radials, 180.0));
    let mut smearing = Smearing::new(cells.widest());
    let mut channel =
        Channel { tis: Vec::new(), values: Vec::with_capacity(bsdf.values_per_channel()) };
    let angles: Vec<f64> = bsdf
        .incidences
        .iter()
        .filter_map(|a| directions(*a, 0.0, ratio))
        .map(|(wi, _)| wi.z.clamp(-1.0, 1.0).acos().to_degrees())
        .collect();
    let mut reaches = halfway(&angles);
    // Beyond the critical angle there is no node.
    if let Some(last) = reaches.last_mut() {
        last[1] = last[1].min(ratio.min(1.0).asin().to_degrees());
    }
    for rotation in &bsdf.rotations {
        for (specular_deg, reach) in bsdf.incidences.iter().zip(&reaches) {
            let Some((wi, specular)) = directions(*specular_deg, *rotation, ratio) else {
                continue;
            };
            let basis = about_specular(&cells, wi, specular, *rotation);
            let all = averaged(surface, side, wi, *reach, resolution);
            let lobes = of_transport(&all, transport);
            let (values, balance) = bin_lobes(&basis, &lobes, &mut smearing);
            channel.values.extend(values);
            channel.tis.push(balance.before);
            let theta_deg = wi.z.clamp(-1.0, 1.0).acos().to_degrees();
            let angles = [theta_deg, (-rotation).rem_euclid(360.0)];
            let loss = balance.at_angles(side, transport, angles);
            smearing.incidences.push(loss);
        }
    }
    bsdf.channels.push(channel);
    Ok((bsdf, smearing))
}

/// The contents of files, each with its side of incidence, as one surface between media of
/// refractive index `indices` (inner, outer). Powers are scaled to the stated total scatter.
/// Specular angles that no incidence leads to are left out.
///
/// # Errors
/// If two files are for one side and scatter type, or a power exceeds 1.
pub fn from_zemax(
    files: &[(Side, &ZemaxBsdf)],
    indices: [f64; 2],
    motion: LobeMotion,
) -> Result<MeasuredBsdf, Error> {
    MeasuredBsdf::new(indices, motion, zemax_tables(files, indices)?)
}

/// The tables of [`from_zemax`].
///
/// # Errors
/// If no incidence leads to any specular angle of a file.
pub fn zemax_tables(
    files: &[(Side, &ZemaxBsdf)],
    indices: [f64; 2],
) -> Result<Vec<(Side, Transport, ScatterTable)>, Error> {
    let table = |(side, bsdf): &(Side, &ZemaxBsdf)| {
        let ratio = ratio(indices, *side, bsdf.transport);
        Ok((*side, bsdf.transport, scatter_table(bsdf, ratio)?))
    };
    files.iter().map(table).collect()
}

fn scatter_table(bsdf: &ZemaxBsdf, ratio: f64) -> Result<ScatterTable, Error> {
    let mirrored = bsdf.symmetry == Symmetry::PlaneSymmetrical;
    let last = bsdf.azimuths[bsdf.azimuths.len() - 1];
    if mirrored && last > 180.0 {
        return Err(Error::Measured(format!(
            "expected azimuths up to 180 degrees in a plane symmetrical table, got {last}"
        )));
    }
    // Azimuths with the index of the row of their values.
    let mut rows: Vec<(f64, usize)> = bsdf.azimuths.iter().copied().zip(0..).collect();
    if mirrored {
        let others =
            rows.iter().rev().filter(|r| r.0 > 0.0 && r.0 < 180.0).map(|r| (360.0 - r.0, r.1));
        let others: Vec<_> = others.collect();
        rows.extend(others);
    }
    let azimuths: Vec<f64> = rows.iter().map(|r| r.0).collect();
    let cells = Arc::new(AngularBasis::around_points(&azimuths, &bsdf.radials, 180.0));
    let turns = bsdf.symmetry == Symmetry::Asymmetrical4D && bsdf.rotations.len() > 1;
    // Nodes by polar angle, then by azimuth of incidence ascending.
    let mut rotations: Vec<(f64, usize)> = if turns {
        bsdf.rotations.iter().copied().zip(0..).collect()
    } else {
        vec![(bsdf.rotations[0], 0)]
    };
    let azimuth = |rotation: f64| (-rotation).rem_euclid(360.0);
    rotations.sort_by(|a, b| azimuth(a.0).total_cmp(&azimuth(b.0)));
    rotations.dedup_by(|a, b| (azimuth(a.0) - azimuth(b.0)).abs() < 1e-9);
    let (mut thetas, mut nodes): (Vec<f64>, Vec<IncidentNode>) = (Vec::new(), Vec::new());
    let block = bsdf.azimuths.len() * bsdf.radials.len();
    let channel = bsdf.power_channel();
    for (incidence, specular_deg) in bsdf.incidences.iter().enumerate() {
        let Some((wi, _)) = directions(*specular_deg, 0.0, ratio) else {
            continue;
        };
        thetas.push(wi.z.clamp(-1.0, 1.0).acos());
        for (rotation, row) in &rotations {
            let Some((wi, specular)) = directions(*specular_deg, *rotation, ratio) else {
                continue;
            };
            let number = row * bsdf.incidences.len() + incidence;
            let values = &channel.values[number * block..(number + 1) * block];
            let spread = rows
                .iter()
                .flat_map(|(_, row)| &values[row * bsdf.radials.len()..][..bsdf.radials.len()])
                .copied();
            let basis = about_specular(&cells, wi, specular, *rotation);
            let tis = Some(channel.tis[number]);
            nodes
                .push(IncidentNode { wi, distribution: CellDistribution::new(basis, spread, tis) });
        }
    }
    if thetas.is_empty() {
        return Err(Error::Measured(
            "expected a specular angle that some incidence leads to, got none between these media"
                .to_owned(),
        ));
    }
    Ok(ScatterTable::Grid {
        thetas,
        phis: rotations.iter().map(|r| azimuth(r.0).to_radians()).collect(),
        nodes,
        end: ratio.min(1.0).asin(),
    })
}
