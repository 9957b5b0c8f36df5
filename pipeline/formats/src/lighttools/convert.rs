// SPDX-License-Identifier: MIT OR Apache-2.0
//! LightTools tables: absolute angles, one block for each incidence, side and scatter type.

use super::layout::{LightToolsBlock, LightToolsBsdf, Tristimulus, side_word};
use crate::convert::{
    Resolution, Smearing, averaged, bin_lobes, check_discrete, halfway, of_transport, steps,
};
use crate::text::scatter_type;
use bsdf::Error;
use bsdf::angular_basis::{AngularBasis, OrientedBasis};
use bsdf::direction::{Side, spherical};
use bsdf::measured::{CellDistribution, IncidentNode, LobeMotion, MeasuredBsdf, ScatterTable};
use bsdf::{Bsdf, Transport};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// The table of `surface` for light from both sides; every block states `wavelength_nm`.
///
/// # Errors
/// If the resolution is invalid, or the surface has a diffuse lobe.
pub fn to_lighttools(
    surface: &dyn Bsdf,
    wavelength_nm: f64,
    resolution: &Resolution,
) -> Result<(LightToolsBsdf, Smearing), Error> {
    resolution.check(2)?;
    check_discrete(surface)?;
    let step = resolution.scatter_deg;
    let mut bsdf = LightToolsBsdf {
        comments: Vec::new(),
        plane_symmetrical: false,
        azimuths: steps(360.0, step, 0.0),
        radials: steps(90.0, step, 0.5 * step),
        blocks: Vec::new(),
    };
    let cells = cells(&bsdf.azimuths, &bsdf.radials);
    let mut smearing = Smearing::new(cells.widest());
    let basis = OrientedBasis::about_normal(&cells);
    for side in [Side::Outer, Side::Inner] {
        for phi in resolution.azimuths() {
            let incidences = resolution.incidences();
            let reaches = halfway(&incidences);
            for (theta, reach) in incidences.into_iter().zip(reaches) {
                let wi = spherical(theta.to_radians(), phi.to_radians());
                let lobes = averaged(surface, side, wi, reach, resolution);
                for transport in Transport::BOTH {
                    let lobes = of_transport(&lobes, transport);
                    let (values, balance) = bin_lobes(&basis, &lobes, &mut smearing);
                    let loss = balance.at_angles(side, transport, [theta, phi]);
                    smearing.incidences.push(loss);
                    bsdf.blocks.push(LightToolsBlock {
                        incidence: theta,
                        plane: phi,
                        side,
                        wavelength: wavelength_nm,
                        transport,
                        tristimulus: None,
                        tis: balance.after,
                        values,
                    });
                }
            }
        }
    }
    Ok((bsdf, smearing))
}

/// Cells around the scatter angles; azimuth 0 of a file is at -90° here.
fn cells(azimuths: &[f64], radials: &[f64]) -> Arc<AngularBasis> {
    Arc::new(AngularBasis::around_points(azimuths, radials, 90.0).rotated(-FRAC_PI_2))
}

/// The content of a file as a surface between media of refractive index `indices` (inner, outer).
/// Powers are scaled to the total scatter of each block.
///
/// # Errors
/// If blocks are missing or double, azimuths cover half a circle, or a power exceeds 1.
pub fn from_lighttools(
    bsdf: &LightToolsBsdf,
    indices: [f64; 2],
    motion: LobeMotion,
) -> Result<MeasuredBsdf, Error> {
    let azimuths = &bsdf.azimuths;
    if azimuths.len() > 1 && azimuths[azimuths.len() - 1] - azimuths[0] <= 180.0 {
        return Err(Error::Measured(format!(
            "expected scatter azimuths around the whole circle, got {} to {} degrees: to which half a shorter range belongs is not known",
            azimuths[0],
            azimuths[azimuths.len() - 1]
        )));
    }
    let basis = OrientedBasis::about_normal(&cells(azimuths, &bsdf.radials));
    let mut tables = Vec::new();
    for side in Side::BOTH {
        for transport in Transport::BOTH {
            let blocks: Vec<&LightToolsBlock> = bsdf
                .blocks
                .iter()
                .filter(|b| (b.side, b.transport) == (side, transport))
                .filter(|b| b.tristimulus.is_none_or(|t| t == Tristimulus::Y))
                .collect();
            if !blocks.is_empty() {
                tables.push((side, transport, scatter_table(&blocks, &basis)?));
            }
        }
    }
    MeasuredBsdf::new(indices, motion, tables)
}

fn scatter_table(
    blocks: &[&LightToolsBlock],
    basis: &OrientedBasis,
) -> Result<ScatterTable, Error> {
    let distinct = |of: fn(&LightToolsBlock) -> f64| {
        let mut list: Vec<f64> = blocks.iter().map(|b| of(b)).collect();
        list.sort_by(f64::total_cmp);
        list.dedup();
        list
    };
    let (thetas, phis) = (distinct(|b| b.incidence), distinct(|b| b.plane.rem_euclid(360.0)));
    if thetas.len() * phis.len() != blocks.len() {
        return Err(Error::Measured(format!(
            "{} {}: expected one block for each of {} AOI x {} POI, got {}",
            side_word(blocks[0].side),
            scatter_type(blocks[0].transport),
            thetas.len(),
            phis.len(),
            blocks.len()
        )));
    }
    // One plane of incidence stands for all.
    let origin = if phis.len() == 1 { phis[0] } else { 0.0 };
    let mut sorted = blocks.to_vec();
    let key = |b: &LightToolsBlock| (b.incidence, b.plane.rem_euclid(360.0));
    sorted.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let nodes = sorted
        .iter()
        .map(|block| IncidentNode {
            wi: spherical(block.incidence.to_radians(), block.plane.to_radians()),
            distribution: CellDistribution::new(
                basis.clone(),
                block.values.iter().copied(),
                Some(block.tis),
            ),
        })
        .collect();
    let radians = |list: &[f64]| list.iter().map(|d| d.to_radians()).collect();
    Ok(ScatterTable::Grid {
        thetas: radians(&thetas),
        phis: if phis.len() == 1 { vec![origin.to_radians()] } else { radians(&phis) },
        nodes,
        end: FRAC_PI_2,
    })
}
