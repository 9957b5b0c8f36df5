// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures 3, 4 and 6 of the paper: far fields of single elements, and one ring by rays and by
//! RCWA.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use bsdf::{Bsdf, Polarisation, Transport, UnitCell};
use glam::DVec3;

use design::Design;
use report::paper_figures::{ELEMENTS, elements_picture};
use report::plots::{Heading, grating_lobes};
use results::schema::{CurveEntry, CurvesEntry, DomeParts, LobeEntry, LobesEntry};
use runtime::atomic_file::write_bytes;
use runtime::run_context::RunContext;
use simulate::cells::outline;
use simulate::tables::{BandTable, DesignTables};
use simulate::trace_plan::{DomeChoice, TracePlan};

/// Folder of the pictures, under the directory of results.
pub const FOLDER: &str = "figures";
/// The pictures.
pub const FILES: [&str; 3] = ["figure_3.png", "figure_4.png", "figure_6.png"];

/// Elements of Figure 3.
const FIGURE_3: std::ops::RangeInclusive<usize> = 1..=6;
/// The element of Figure 4.
const FIGURE_4: usize = 6;
/// The layer of Figure 6.
const FIGURE_6: usize = 8;
/// Paths of a whole design for each path of one element: no figure of merit is read from an
/// element.
const SHARE_OF_PATHS: u64 = 8;

/// Computes and draws all three; `designs` are D1, D2, D3, `tables` those of D1.
pub fn all(
    designs: &[Design],
    tables: &DesignTables,
    out: &Path,
    context: RunContext,
) -> Result<DomeParts> {
    let [d1, d2, d3] = designs else {
        return Err(anyhow!("figures need the three designs, got {}", designs.len()));
    };
    let folder = out.join(FOLDER);
    let draw = |k: usize, curves| -> Result<CurvesEntry> {
        let figure = CurvesEntry { curves };
        let picture = elements_picture(&figure, ELEMENTS[k])?;
        write_bytes(&folder.join(FILES[k]), &picture.png()?)?;
        Ok(figure)
    };
    let third = third(d1, context.seed).map(|curve| curve.trace(context));
    let third = draw(0, third.collect::<Result<_>>()?)?;
    let fourth = fourth([d1, d2, d3], context.seed).map(|curve| curve.trace(context));
    let fourth = draw(1, fourth.into_iter().collect::<Result<_>>()?)?;
    let band = tables
        .bands
        .get(FIGURE_6 - 1)
        .and_then(Option::as_ref)
        .with_context(|| format!("D1 has no relief in band {FIGURE_6}"))?;
    let sixth = ring(&folder.join(FILES[2]), band)?;
    Ok(DomeParts { elements: Some(third), shapes: Some(fourth), ring: Some(sixth) })
}

/// The traces of Figures 3 and 4; `designs` are D1, D2, D3.
pub fn plans(designs: &[Design], seed: u64) -> Vec<TracePlan> {
    let [d1, d2, d3] = designs else {
        return Vec::new();
    };
    let curves = third(d1, seed).chain(fourth([d1, d2, d3], seed));
    curves.map(|curve| curve.plan).collect()
}

/// Far field of one element alone, averaged over azimuth.
struct ElementCurve {
    plan: TracePlan,
    label: String,
}

fn third(d1: &Design, seed: u64) -> impl Iterator<Item = ElementCurve> {
    FIGURE_3.map(move |k| ElementCurve::new(d1, k, format!("S{k}"), seed))
}

fn fourth([d1, d2, d3]: [&Design; 3], seed: u64) -> [ElementCurve; 3] {
    let shapes = [(d1, "OS1"), (d2, "OS2"), (d3, "OS3")];
    shapes.map(|(design, shape)| {
        ElementCurve::new(design, FIGURE_4, format!("S{FIGURE_4} {shape}"), seed)
    })
}

impl ElementCurve {
    fn new(design: &Design, element: usize, label: String, seed: u64) -> Self {
        let plan = TracePlan {
            design: design.clone(),
            dome: DomeChoice::Element(element),
            paths: (design.trace.paths / SHARE_OF_PATHS).max(1000),
            what: format!("{label} alone"),
            seed,
        };
        Self { plan, label }
    }

    fn trace(&self, context: RunContext) -> Result<CurveEntry> {
        let surface = self.plan.surface(None)?;
        let mean = self.plan.observe(&surface, context)?.azimuthal_mean(&self.label)?;
        Ok(CurveEntry {
            label: mean.label().to_owned(),
            theta_deg: mean.x().to_vec(),
            intensity_w_per_sr: mean.value().to_vec(),
            standard_error_w_per_sr: mean.standard_error().to_vec(),
        })
    }
}

/// Normal incidence from the silicone on the ring of `band`: lobes of its unit cell by rays, orders
/// by RCWA.
fn ring(path: &Path, band: &BandTable) -> Result<LobesEntry> {
    let cell = &band.cell;
    let subtitle = format!(
        "S{FIGURE_6}, ring {}, period {:.2} µm, height {:.2} µm, normal incidence",
        cell.ring, cell.period_um, cell.depth_um
    );
    let (rays, rcwa) = (by_rays(band)?, by_waves(band)?);
    let heading = Heading::new("Figure 6: rays and waves", subtitle);
    write_bytes(path, &grating_lobes(&heading, &rays, &rcwa)?.png()?)?;
    Ok(LobesEntry { band: FIGURE_6, ring: cell.ring, rays, rcwa })
}

fn by_rays(band: &BandTable) -> Result<Vec<LobeEntry>> {
    let cell = UnitCell::new(&outline(&band.cell))?;
    let lobes = cell.lobes(-DVec3::Z, Polarisation::Unpolarised).into_iter().map(|l| {
        let is_reflected = l.lobe.transport == Transport::Reflection;
        LobeEntry {
            side: if is_reflected { "reflected" } else { "transmitted" }.to_owned(),
            theta_deg: l.wo.x.atan2(l.wo.z.abs()).to_degrees(),
            share: l.power,
            order: None,
        }
    });
    Ok(lobes.collect())
}

/// Orders at exactly normal incidence, solved at the table's resolution: normal incidence lies
/// between the nodes of a table.
fn by_waves(band: &BandTable) -> Result<Vec<LobeEntry>> {
    let interface = gratings::interface::interface(&band.cell, band.table.grid().wavelength)?;
    let header = band.table.header();
    let plan = interface.relief.slice_plan(header.slices).refined(2);
    let solved = rcwa::solve(
        &interface.stack(&plan)?,
        rcwa::Bloch::new(0.0, 0.0),
        rcwa::Truncation::new(header.truncation)?,
    )?;
    let sides = [
        (rcwa::Side::Top, "reflected", interface.n_top.re),
        (rcwa::Side::Bottom, "transmitted", interface.n_bottom.re),
    ];
    let spacing = interface.order_spacing();
    let mut lobes = Vec::new();
    for (side, name, index) in sides {
        for order in solved.orders(side) {
            let share = rcwa::Pol::BOTH
                .iter()
                .map(|&p| 0.5 * solved.efficiency((rcwa::Side::Top, 0, p), (side, order)))
                .sum();
            let theta_deg = (f64::from(order) * spacing / index).asin().to_degrees();
            lobes.push(LobeEntry { side: name.to_owned(), theta_deg, share, order: Some(order) });
        }
    }
    Ok(lobes)
}
