// SPDX-License-Identifier: MIT OR Apache-2.0
//! The surface of the dome in each model: the relief itself, or the smooth dome in bands with a
//! BSDF each.

use std::sync::Arc;

use anyhow::{Context as _, Result, anyhow, ensure};
use bsdf::ray_optics::UnitCell;
use bsdf::{Bsdf, OrderTable};

use design::Design;
use design::schema::Polarization;
use geometry::{BaseSurface, Meridian};

use super::cells::{band_cells, outline};
use super::model::Model;
use super::scene::DomeSurface;
use super::tables::{BandTable, DesignTables};

/// The surface of the dome in `model`; the hybrid needs `tables`.
pub fn dome_surface(
    design: &Design,
    model: Model,
    tables: Option<&DesignTables>,
) -> Result<DomeSurface> {
    if design.dome.is_none() {
        return Ok(DomeSurface::Refracting(design.outline()?));
    }
    let base = || {
        design.base().with_context(|| {
            let label = model.label(design);
            format!("{}: expected a dome that is no mesh for {label}", design.name)
        })
    };
    ensure!(
        !(model.is_banded() && design.is_coated()),
        "{}: expected a model of rays on the relief itself with dome.coating, got {}",
        design.name,
        model.label(design)
    );
    Ok(match model {
        Model::Geometric => DomeSurface::Refracting(design.outline()?),
        Model::Fine => DomeSurface::Refracting(Meridian::stepped(base()?, &design.hybrid_rings())?),
        Model::Control => {
            let cells = band_cells(design);
            let bsdfs = cells.iter().map(|cell| {
                cell.as_ref()
                    .map(|c| Ok(Arc::new(UnitCell::new(&outline(c))?) as Arc<dyn Bsdf>))
                    .transpose()
            });
            banded(design, base()?, bsdfs.collect::<Result<_>>()?)
        }
        Model::Hybrid => {
            let tables =
                tables.ok_or_else(|| anyhow!("the hybrid of {} needs its tables", design.name))?;
            let of_bands = |bands: &[Option<BandTable>]| -> Result<DomeSurface> {
                let bsdfs = bands.iter().enumerate().map(|(band, table)| {
                    let solved = || table.as_ref().map(|t| solved(design, &t.table)).transpose();
                    design.files.band_bsdf(band).map_or_else(solved, |bsdf| Ok(Some(bsdf)))
                });
                Ok(banded(design, base()?, bsdfs.collect::<Result<_>>()?))
            };
            if !design.converts() {
                return of_bands(&tables.bands);
            }
            let all = std::iter::once(&tables.bands).chain(&tables.others);
            let all = design.tables_nm().into_iter().zip(all);
            let all = all.map(|(nm, bands)| Ok((nm, of_bands(bands)?)));
            DomeSurface::ByWavelength(all.collect::<Result<_>>()?, 0)
        }
    })
}

/// A solved table for the polarisation that the design asks for.
fn solved(design: &Design, table: &Arc<OrderTable>) -> Result<Arc<dyn Bsdf>> {
    let polarisation = match design.hybrid.polarization {
        Polarization::Unpolarised => return Ok(Arc::clone(table) as Arc<dyn Bsdf>),
        Polarization::S => bsdf::Polarisation::S,
        Polarization::P => bsdf::Polarisation::P,
    };
    Ok(Arc::new(table.for_polarisation(polarisation)?))
}

fn banded(
    design: &Design,
    base: BaseSurface<'_>,
    bsdfs: Vec<Option<Arc<dyn Bsdf>>>,
) -> DomeSurface {
    let width_mm = design.hybrid.element_width_um * 1e-3 * design.hybrid.rings_per_band as f64;
    let ends: Vec<f64> = (1..=bsdfs.len()).map(|k| k as f64 * width_mm).collect();
    DomeSurface::Banded(Meridian::banded(base, &ends), bsdfs)
}

/// The surface of the dome in `model` without what its bands scatter: a trace is known by it before
/// there are tables.
pub(super) fn without_tables(design: &Design, model: Model) -> Result<DomeSurface> {
    match design.base().filter(|_| model.is_banded()) {
        None => dome_surface(design, model, None),
        Some(base) => Ok(banded(design, base, vec![None; band_cells(design).len()])),
    }
}
