// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of the rings for light in the plane of the section.

use crate::dome::Section;
use anyhow::Result;
use bsdf::{Grid, OrderTable, Polarisation, TableHeader};
use full_wave::Polarisation as Field;
use gratings::interface::{directions, efficiency_rows, interface};
use rayon::prelude::*;
use rcwa::accuracy::converge_hemisphere;
use rcwa::hemisphere::hemisphere;
use rcwa::no_progress;

/// Accuracy of tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableRequest {
    /// Nodes of the Bloch wavevector in one Brillouin zone; by default those of [`kx_per_zone`].
    pub kx_per_zone: Option<usize>,
    /// Largest error of transmittance.
    pub tolerance: f64,
}

impl Default for TableRequest {
    fn default() -> Self {
        Self { kx_per_zone: None, tolerance: 2e-3 }
    }
}

/// Tables by ring from the axis, for TE and TM; `None` for a smooth ring.
#[derive(Clone, Debug)]
pub struct Tables {
    rings: Vec<Option<[OrderTable; 2]>>,
}

impl Tables {
    /// Solves all rings.
    ///
    /// # Errors
    /// Those of the solver.
    pub fn solve(section: &Section, request: TableRequest) -> Result<Self> {
        let rings = (1..=section.rings())
            .into_par_iter()
            .map(|ring| solve_ring(section, request, ring))
            .collect::<Result<_>>()?;
        Ok(Self { rings })
    }

    /// Table of a ring, from 1.
    pub fn ring(&self, ring: usize, field: Field) -> Option<&OrderTable> {
        let tables = self.rings.get(ring.checked_sub(1)?)?.as_ref()?;
        Some(&tables[usize::from(field == Field::Tm)])
    }
}

/// Nodes of the Bloch wavevector in one Brillouin zone of a ring whose period is so many wavelengths:
/// 8, and beyond 24 wavelengths 6, 4 or 2, so that they keep their distance. With rings of 20 µm (36
/// wavelengths) 2, 4 and 8 nodes give far fields alike to 0.2 % of the largest bin of 2.5°.
pub fn kx_per_zone(period: f64) -> usize {
    2 * (72.0 / period).ceil().clamp(1.0, 4.0) as usize
}

fn solve_ring(
    section: &Section,
    request: TableRequest,
    ring: usize,
) -> Result<Option<[OrderTable; 2]>> {
    let Some(cell) = section.cell(ring)? else {
        return Ok(None);
    };
    let interface = interface(&cell, section.wavelength_um)?;
    let (resolution, _) = converge_hemisphere(&interface, request.tolerance, &no_progress)?;
    let grid = Grid {
        period: cell.period_um,
        wavelength: section.wavelength_um,
        index_inner: section.index[0],
        index_outer: section.index[1],
        kx_per_zone: request
            .kx_per_zone
            .unwrap_or_else(|| kx_per_zone(cell.period_um / section.wavelength_um)),
        ky: vec![0.0],
    };
    let solved = hemisphere(&interface, &directions(&grid), &resolution, &no_progress)?;
    let rows = efficiency_rows(solved.incidences);
    let table = OrderTable::build(TableHeader::default(), grid, rows)?;
    // The electric field along y is s in this plane.
    Ok(Some([table.for_polarisation(Polarisation::S)?, table.for_polarisation(Polarisation::P)?]))
}
