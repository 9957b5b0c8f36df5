// SPDX-License-Identifier: MIT OR Apache-2.0
//! Speos tables: light from one side, angles about the normal from the direction in which light
//! travels.
//!
//! The anisotropy vector lies along x. Turned by ρ, it stands at azimuth ρ from the direction of
//! travel, which therefore has azimuth -ρ here, and `wi` azimuth 180° - ρ. The sense of ρ is our
//! reading of the vendor's figure; it shows in anisotropic tables without mirror symmetry only.

use super::layout::{SpeosBsdf, SpeosPart, SpeosTable, Values};
use crate::convert::{
    PowerBalance, Resolution, Smearing, averaged, bin_lobes, check_discrete, halfway, of_transport,
    steps,
};
use bsdf::Error;
use bsdf::analytic::linear;
use bsdf::angular_basis::{AngularBasis, OrientedBasis};
use bsdf::direction::{Side, spherical};
use bsdf::measured::{CellDistribution, IncidentNode, LobeMotion, MeasuredBsdf, ScatterTable};
use bsdf::{Bsdf, Transport};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Azimuth of `wi` for a rotation of the sample, degrees.
fn azimuth(rotation: f64) -> f64 {
    (180.0 - rotation).rem_euclid(360.0)
}

/// Cells around scatter angles, turned with the sample.
fn cells(azimuths: &[f64], thetas: &[f64], rotation: f64) -> Arc<AngularBasis> {
    let cells = AngularBasis::around_points(azimuths, thetas, 90.0);
    Arc::new(cells.rotated(-rotation.to_radians()))
}

/// The contents of files, each with its side of incidence, as one surface between media of
/// refractive index `indices` (inner, outer).
///
/// # Errors
/// Same as [`speos_tables`]; if two files are for one side and transport, or a power exceeds 1.
pub fn from_speos(
    files: &[(Side, &SpeosBsdf)],
    indices: [f64; 2],
    motion: LobeMotion,
) -> Result<MeasuredBsdf, Error> {
    MeasuredBsdf::new(indices, motion, speos_tables(files)?)
}

/// The tables of [`from_speos`].
///
/// # Errors
/// If azimuths cover half a circle, rotations have different incidences, or a spectrum belongs to
/// an incidence at which the tables scatter nothing.
pub fn speos_tables(
    files: &[(Side, &SpeosBsdf)],
) -> Result<Vec<(Side, Transport, ScatterTable)>, Error> {
    let mut tables = Vec::new();
    for (side, bsdf) in files {
        for part in &bsdf.parts {
            tables.push((*side, part.transport, scatter_table(part, bsdf.values)?));
        }
    }
    Ok(tables)
}

fn scatter_table(part: &SpeosPart, values: Values) -> Result<ScatterTable, Error> {
    let mut incidences: Vec<f64> = part.tables.iter().map(|t| t.incidence).collect();
    incidences.sort_by(f64::total_cmp);
    incidences.dedup();
    // A whole turn is no turn.
    let mut rotations: Vec<f64> = part.tables.iter().map(|t| t.rotation).collect();
    rotations.retain(|rotation| *rotation < 360.0);
    rotations.sort_by(|a, b| azimuth(*a).total_cmp(&azimuth(*b)));
    rotations.dedup();
    let mut nodes = Vec::new();
    for incidence in &incidences {
        for rotation in &rotations {
            let same = |t: &&SpeosTable| {
                t.incidence.to_bits() == incidence.to_bits()
                    && t.rotation.to_bits() == rotation.to_bits()
            };
            let table = part.tables.iter().find(same).ok_or_else(|| {
                Error::Measured(format!(
                    "expected the same angles of incidence at every anisotropy angle, got none of {incidence} degrees at {rotation}"
                ))
            })?;
            nodes.push(node(table, values)?);
        }
    }
    if let Some([at, share]) = part.reference {
        let row = rotations.iter().position(|r| *r == 0.0).unwrap_or(0);
        let unturned = nodes.iter().skip(row).step_by(rotations.len());
        let totals: Vec<[f64; 2]> = incidences
            .iter()
            .zip(unturned)
            .map(|(incidence, node)| [*incidence, node.distribution.total()])
            .collect();
        let total = linear(&totals, at);
        if share > 0.0 && total <= 0.0 {
            return Err(Error::Measured(format!(
                "expected scattering at {at} degrees, where the spectrum states {share} of the power, got none"
            )));
        }
        let factor = if share > 0.0 { share / total } else { 0.0 };
        for node in &mut nodes {
            node.distribution = node.distribution.clone().scaled(factor);
        }
    }
    Ok(ScatterTable::Grid {
        thetas: incidences.iter().map(|a| a.to_radians()).collect(),
        phis: rotations.iter().map(|r| azimuth(*r).to_radians()).collect(),
        nodes,
        end: FRAC_PI_2,
    })
}

/// The node of one table.
fn node(table: &SpeosTable, values: Values) -> Result<IncidentNode, Error> {
    let azimuths = &table.azimuths;
    let last = azimuths[azimuths.len() - 1];
    if azimuths.len() > 1 && last - azimuths[0] <= 180.0 {
        return Err(Error::Measured(format!(
            "expected phi angles around the whole circle, got {} to {last} degrees: to which half a shorter range belongs is not known",
            azimuths[0]
        )));
    }
    let cells = cells(azimuths, &table.thetas, table.rotation);
    let columns = azimuths.len();
    let rows = table.thetas.len();
    let bsdf = (0..columns * rows).map(|cell| {
        let value = table.values[cell % rows * columns + cell / rows];
        match values {
            Values::Bsdf => value,
            // The power of a cell is its intensity times its solid angle.
            Values::Intensity => {
                let projected = cells.projected_solid_angle(cell);
                if projected > 0.0 { value * cells.solid_angle(cell) / projected } else { 0.0 }
            }
        }
    });
    Ok(IncidentNode {
        wi: spherical(table.incidence.to_radians(), azimuth(table.rotation).to_radians()),
        distribution: CellDistribution::new(
            OrientedBasis::about_normal(&cells),
            bsdf.collect::<Vec<f64>>(),
            table.total,
        ),
    })
}

/// The table of `surface` for light from `side`, reflected and transmitted; what scatters nothing
/// is left out.
///
/// # Errors
/// If the resolution is invalid, or the surface has a diffuse lobe.
pub fn to_speos(
    surface: &dyn Bsdf,
    side: Side,
    resolution: &Resolution,
) -> Result<(SpeosBsdf, Smearing), Error> {
    resolution.check(2)?;
    check_discrete(surface)?;
    let step = resolution.scatter_deg;
    let azimuths = steps(360.0, step, 0.0);
    let mut thetas = steps(90.0, step, 0.0);
    thetas.push(90.0);
    let mut smearing = Smearing::new(cells(&azimuths, &thetas, 0.0).widest());
    let incidences = resolution.incidences();
    let reaches = halfway(&incidences);
    let mut tables = [const { Vec::new() }; 2];
    for rotation in resolution.azimuths() {
        let cells = cells(&azimuths, &thetas, rotation);
        let basis = OrientedBasis::about_normal(&cells);
        for (incidence, reach) in incidences.iter().zip(&reaches) {
            let wi = spherical(incidence.to_radians(), azimuth(rotation).to_radians());
            let lobes = averaged(surface, side, wi, *reach, resolution);
            for transport in Transport::BOTH {
                let lobes = of_transport(&lobes, transport);
                let (values, balance) = bin_lobes(&basis, &lobes, &mut smearing);
                let angles = [*incidence, azimuth(rotation)];
                let loss = balance.at_angles(side, transport, angles);
                smearing.incidences.push(loss);
                let table = closed(&azimuths, &thetas, &values);
                tables[transport.index()]
                    .push((SpeosTable { rotation, incidence: *incidence, ..table }, balance));
            }
        }
    }
    let parts = Transport::BOTH
        .into_iter()
        .zip(tables)
        .filter_map(|(transport, tables)| part(transport, tables))
        .collect();
    let bsdf =
        SpeosBsdf { comment: String::new(), values: Values::Bsdf, parts, warnings: Vec::new() };
    Ok((bsdf, smearing))
}

/// A table of the values of cells, closed at 360 degrees: the format's tables are.
fn closed(azimuths: &[f64], thetas: &[f64], values: &[f64]) -> SpeosTable {
    let rows = thetas.len();
    let columns = (0..azimuths.len()).chain([0]);
    let all =
        (0..rows).flat_map(|row| columns.clone().map(move |column| values[column * rows + row]));
    SpeosTable {
        rotation: 0.0,
        incidence: 0.0,
        total: None,
        azimuths: azimuths.iter().copied().chain([360.0]).collect(),
        thetas: thetas.to_vec(),
        values: all.collect(),
    }
}

/// The tables of a transport; its spectrum belongs to the incidence with the most power, unturned.
fn part(transport: Transport, tables: Vec<(SpeosTable, PowerBalance)>) -> Option<SpeosPart> {
    let unturned = tables.iter().filter(|(table, _)| table.rotation == 0.0);
    let (table, balance) = unturned.max_by(|a, b| a.1.after.total_cmp(&b.1.after))?;
    let reference = [table.incidence, balance.after];
    (reference[1] > 0.0).then(|| SpeosPart {
        transport,
        reference: Some(reference),
        tables: tables.into_iter().map(|(table, _)| table).collect(),
    })
}
