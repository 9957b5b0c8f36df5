// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures 3, 4 and 6 of the paper: far fields of single elements, and one ring by rays and by
//! RCWA.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use bsdf::{Bsdf, Polarisation, Transport, UnitCell};
use glam::DVec3;

use design::Design;
use files::atomic_file::write_bytes;
use files::run_context::RunContext;
use metrics::quantity::{Curve, Quantity, Unit};
use report::plots::{
    FarField, Heading, LineColours, LobeSide, PlaneLobe, element_far_fields, grating_lobes,
};
use results::schema::{CurveEntry, CurvesEntry, LobeEntry, LobesEntry, PaperFigures};
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
) -> Result<PaperFigures> {
    let [d1, d2, d3] = designs else {
        return Err(anyhow!("figures need the three designs, got {}", designs.len()));
    };
    let folder = out.join(FOLDER);
    let third =
        third(d1, context.seed).map(|curve| curve.trace(context)).collect::<Result<Vec<_>>>()?;
    elements(
        &folder.join(FILES[0]),
        &Heading::new("Figure 3: single elements", "S1 to S6 as OS1, all others absorbing"),
        &third,
        LineColours::Ordered,
    )?;
    let fourth = fourth([d1, d2, d3], context.seed).map(|curve| curve.trace(context));
    let fourth = fourth.into_iter().collect::<Result<Vec<_>>>()?;
    elements(
        &folder.join(FILES[1]),
        &Heading::new(
            "Figure 4: shapes of one element",
            "S6 as OS1, OS2, OS3, all others absorbing",
        ),
        &fourth,
        LineColours::Ordered,
    )?;
    let band = tables
        .bands
        .get(FIGURE_6 - 1)
        .and_then(Option::as_ref)
        .with_context(|| format!("D1 has no relief in band {FIGURE_6}"))?;
    let sixth = ring(&folder.join(FILES[2]), band)?;

    let describe = |curves: &[Curve]| {
        let curve = |c: &Curve| CurveEntry {
            label: c.label().to_owned(),
            theta_deg: c.x().to_vec(),
            intensity_w_per_sr: c.value().to_vec(),
            standard_error_w_per_sr: c.standard_error().to_vec(),
        };
        let curves = curves.iter().map(curve).collect();
        Some(CurvesEntry { curves })
    };
    Ok(PaperFigures {
        figure_3: describe(&third),
        figure_4: describe(&fourth),
        figure_6: Some(sixth),
    })
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

    fn trace(&self, context: RunContext) -> Result<Curve> {
        let surface = self.plan.surface(None)?;
        let seen = self.plan.observe(&surface, context)?;
        seen.azimuthal_mean(&self.label)
    }
}

fn elements(path: &Path, heading: &Heading, curves: &[Curve], colours: LineColours) -> Result<()> {
    let quantity = Quantity::new("intensity", Unit::WattPerSteradian);
    let mirrored = curves.iter().map(Curve::mirrored).collect::<Result<Vec<_>>>()?;
    write_bytes(
        path,
        &element_far_fields(&FarField {
            heading,
            quantity: &quantity,
            curves: &mirrored,
            colours,
            numbers: &[],
            peaks: &[],
        })?
        .png()?,
    )
}

/// Normal incidence from the silicone on the ring of `band`: lobes of its unit cell by rays, orders
/// by RCWA.
fn ring(path: &Path, band: &BandTable) -> Result<LobesEntry> {
    let cell = &band.cell;
    let rays = by_rays(band)?;
    let orders = by_waves(band)?;
    let subtitle = format!(
        "S{FIGURE_6}, ring {}, period {:.2} µm, height {:.2} µm, normal incidence",
        cell.ring, cell.period_um, cell.depth_um
    );
    let plane: Vec<PlaneLobe> = orders.iter().map(|(_, lobe)| *lobe).collect();
    write_bytes(
        path,
        &grating_lobes(&Heading::new("Figure 6: rays and waves", subtitle), &rays, &plane)?
            .png()?,
    )?;
    let side = |s: LobeSide| {
        if s == LobeSide::Reflected { "reflected" } else { "transmitted" }
    };
    let lobe = |l: &PlaneLobe, order: Option<i32>| LobeEntry {
        side: side(l.side).to_owned(),
        theta_deg: l.angle_deg,
        share: l.power,
        order,
    };
    Ok(LobesEntry {
        band: FIGURE_6,
        ring: cell.ring,
        rays: rays.iter().map(|l| lobe(l, None)).collect(),
        rcwa: orders.iter().map(|(m, l)| lobe(l, Some(*m))).collect(),
    })
}

fn by_rays(band: &BandTable) -> Result<Vec<PlaneLobe>> {
    let cell = UnitCell::new(&outline(&band.cell))?;
    let lobes = cell.lobes(-DVec3::Z, Polarisation::Unpolarised).into_iter().map(|l| PlaneLobe {
        side: if l.lobe.transport == Transport::Reflection {
            LobeSide::Reflected
        } else {
            LobeSide::Transmitted
        },
        angle_deg: l.wo.x.atan2(l.wo.z.abs()).to_degrees(),
        power: l.power,
    });
    Ok(lobes.collect())
}

/// Orders at exactly normal incidence, solved at the table's resolution: normal incidence lies
/// between the nodes of a table.
fn by_waves(band: &BandTable) -> Result<Vec<(i32, PlaneLobe)>> {
    let interface = simulate::tables::interface(&band.cell, band.table.grid().wavelength)?;
    let header = band.table.header();
    let plan = interface.relief.slice_plan(header.slices).refined(2);
    let solved = rcwa::solve(
        &interface.stack(&plan)?,
        rcwa::Bloch::new(0.0, 0.0),
        rcwa::Truncation::new(header.truncation)?,
    )?;
    let sides = [
        (rcwa::Side::Top, LobeSide::Reflected, interface.n_top.re),
        (rcwa::Side::Bottom, LobeSide::Transmitted, interface.n_bottom.re),
    ];
    let spacing = interface.order_spacing();
    let mut lobes = Vec::new();
    for (side, lobe_side, index) in sides {
        for order in solved.orders(side) {
            let power = rcwa::Pol::BOTH
                .iter()
                .map(|&p| 0.5 * solved.efficiency((rcwa::Side::Top, 0, p), (side, order)))
                .sum();
            let angle_deg = (f64::from(order) * spacing / index).asin().to_degrees();
            lobes.push((order, PlaneLobe { side: lobe_side, angle_deg, power }));
        }
    }
    Ok(lobes)
}
