// SPDX-License-Identifier: MIT OR Apache-2.0
//! LightTools tables: absolute angles, one block for each incidence, side and type. *Front* is our outer side.

use super::{Resolution, Smearing, averaged, between, discrete, of_transport, steps};
use crate::angular_basis::AngularBasis;
use crate::bsdf::{Bsdf, Transport};
use crate::direction::{Side, spherical};
use crate::error::Error;
use crate::formats::lighttools::{Face, LightToolsBlock, LightToolsBsdf, Tristimulus};
use crate::formats::zemax::ScatterType;
use crate::measured::{CellDistribution, IncidentNode, LobeMotion, MeasuredBsdf, ScatterTable};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

const TYPES: [(ScatterType, Transport); 2] = [
    (ScatterType::Brdf, Transport::Reflection),
    (ScatterType::Btdf, Transport::Transmission),
];

fn face(side: Side) -> Face {
    match side {
        Side::Inner => Face::Back,
        Side::Outer => Face::Front,
    }
}

/// The table of `surface` for light from both sides at a resolution; `wavelength_nm` is noted in every block.
///
/// # Errors
/// If the resolution is none, or the surface has a diffuse lobe.
pub fn to_lighttools(
    surface: &dyn Bsdf,
    wavelength_nm: f64,
    resolution: &Resolution,
) -> Result<(LightToolsBsdf, Smearing), Error> {
    resolution.check(2)?;
    discrete(surface)?;
    let step = resolution.scatter_deg;
    let mut bsdf = LightToolsBsdf {
        comments: Vec::new(),
        plane_symmetrical: false,
        azimuths: steps(360.0, step, 0.0),
        radials: steps(90.0, step, 0.5 * step),
        blocks: Vec::new(),
    };
    let cells = AngularBasis::around(&bsdf.azimuths, &bsdf.radials, 90.0).turned(-FRAC_PI_2);
    let mut smearing = Smearing::new();
    smearing.width_deg = (0..cells.len())
        .map(|c| cells.width(c))
        .fold(0.0, f64::max)
        .to_degrees();
    for side in [Side::Outer, Side::Inner] {
        for phi in resolution.azimuths() {
            let incidences = resolution.incidences();
            let reaches = between(&incidences);
            for (theta, reach) in incidences.into_iter().zip(reaches) {
                let wi = spherical(theta.to_radians(), phi.to_radians());
                let lobes = averaged(surface, side, wi, reach, resolution);
                for (scatter, transport) in TYPES {
                    let lobes = of_transport(&lobes, transport);
                    smearing.neighbours(&lobes);
                    let (values, tis) = binned(&cells, &lobes, &mut smearing, |loss| {
                        loss.side = side;
                        loss.transport = transport;
                        loss.theta_deg = theta;
                        loss.phi_deg = phi;
                    });
                    bsdf.blocks.push(LightToolsBlock {
                        incidence: theta,
                        plane: phi,
                        face: face(side),
                        wavelength: wavelength_nm,
                        scatter,
                        tristimulus: None,
                        tis,
                        values,
                    });
                }
            }
        }
    }
    Ok((bsdf, smearing))
}

/// BSDF of every cell and the sum of the shares; notes what was lost.
fn binned(
    cells: &AngularBasis,
    lobes: &[&crate::OutgoingLobe],
    smearing: &mut Smearing,
    name: impl Fn(&mut super::IncidenceLoss),
) -> (Vec<f64>, f64) {
    let mut shares = vec![0.0; cells.len()];
    let mut orders = vec![0_u8; cells.len()];
    let mut before = 0.0;
    for lobe in lobes {
        before += lobe.power;
        if let Some(cell) = cells.locate(lobe.wo) {
            shares[cell] += lobe.power;
            orders[cell] = orders[cell].saturating_add(1);
            smearing.shifted(lobe.power, cells.middle(cell).angle_between(lobe.wo));
        }
    }
    let merged = shares
        .iter()
        .zip(&orders)
        .filter(|(_, n)| **n > 1)
        .map(|(s, _)| s)
        .sum();
    let values: Vec<f64> = shares
        .iter()
        .enumerate()
        .map(|(cell, share)| {
            if *share > 0.0 {
                share / cells.projected(cell)
            } else {
                0.0
            }
        })
        .collect();
    let after = values
        .iter()
        .enumerate()
        .filter(|v| *v.1 > 0.0)
        .map(|(cell, value)| value * cells.projected(cell))
        .sum();
    let mut loss = super::IncidenceLoss {
        side: Side::Outer,
        transport: Transport::Reflection,
        theta_deg: 0.0,
        phi_deg: 0.0,
        before,
        after,
        merged,
    };
    name(&mut loss);
    smearing.incidences.push(loss);
    (values, after)
}

/// The content of a file as a surface between media of refractive index `indices` (inner, outer). Shares are scaled to the power that
/// each block states.
///
/// # Errors
/// If blocks are missing or double, azimuths cover half a circle only, or a power exceeds 1.
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
    let cells = Arc::new(AngularBasis::around(azimuths, &bsdf.radials, 90.0).turned(-FRAC_PI_2));
    let mut responses = Vec::new();
    for side in Side::BOTH {
        for (scatter, transport) in TYPES {
            let blocks: Vec<&LightToolsBlock> = bsdf
                .blocks
                .iter()
                .filter(|b| (b.face, b.scatter) == (face(side), scatter))
                .filter(|b| b.tristimulus.is_none_or(|t| t == Tristimulus::Y))
                .collect();
            if !blocks.is_empty() {
                responses.push((side, transport, response(&blocks, &cells)?));
            }
        }
    }
    MeasuredBsdf::new(indices, motion, responses)
}

fn response(blocks: &[&LightToolsBlock], cells: &Arc<AngularBasis>) -> Result<ScatterTable, Error> {
    let distinct = |of: fn(&LightToolsBlock) -> f64| {
        let mut list: Vec<f64> = blocks.iter().map(|b| of(b)).collect();
        list.sort_by(f64::total_cmp);
        list.dedup();
        list
    };
    let (thetas, phis) = (
        distinct(|b| b.incidence),
        distinct(|b| b.plane.rem_euclid(360.0)),
    );
    if thetas.len() * phis.len() != blocks.len() {
        return Err(Error::Measured(format!(
            "{} {}: expected one block for each of {} AOI x {} POI, got {}",
            blocks[0].face.word(),
            blocks[0].scatter.word(),
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
            cloud: CellDistribution::new(
                cells,
                None,
                block.values.iter().copied(),
                Some(block.tis),
            ),
        })
        .collect();
    let radians = |list: &[f64]| list.iter().map(|d| d.to_radians()).collect();
    Ok(ScatterTable::Grid {
        thetas: radians(&thetas),
        phis: if phis.len() == 1 {
            vec![origin.to_radians()]
        } else {
            radians(&phis)
        },
        nodes,
        end: FRAC_PI_2,
    })
}
