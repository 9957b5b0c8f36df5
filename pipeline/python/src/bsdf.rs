// SPDX-License-Identifier: MIT OR Apache-2.0
//! BSDFs for Python: `batwing._native.Surface`.

use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, anyhow, bail};
use bsdf::angular_basis::{AngularBasis, OrientedBasis};
use bsdf::direction::spherical;
use bsdf::measured::{CellDistribution, IncidentNode, ScatterTable};
use bsdf::native;
use bsdf::{
    Bsdf, Grid, LobeKind, LobeMotion, MeasuredBsdf, OrderTable, Polarisation, Side, TableHeader,
    Transport,
};
use formats::convert::Resolution;
use glam::DVec3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use rcwa::accuracy::converge_hemisphere;
use rcwa::hemisphere::{Directions, Hemisphere, Incidence, hemisphere};
use rcwa::incidence_grid::{GridRequest, solve_adaptive};

use arrays::order_tables::{EXTENSION, read_table, write_table};
use design::resolved::incidence_grid::{FIRST_KX, MAX_KX, MAX_KY, first_ky};
use formats::content::{self, Content, ScatterFile};
use formats::tables::{self, CellTable, Fineness};
use formats::{Holds, Writes, words};
use gratings::interface::efficiency_rows;
use pipeline::commands::file_formats::nanometres;
use runtime::atomic_file::write_atomic;

use crate::command::with_warnings;
use crate::errors::to_python;
use crate::job::{self, Job};
use crate::rcwa::{Interface, array, resolution};

/// Directions that share one stream of random numbers.
const CHUNK: usize = 4096;
/// Order of a lobe that is no order.
const NO_ORDER: i32 = i32::MIN;

type Array<'py, T> = Bound<'py, numpy::PyArrayDyn<T>>;

/// A surface that scatters light.
#[pyclass(frozen, module = "batwing._native")]
pub struct Surface {
    bsdf: Arc<dyn Bsdf>,
    table: Option<Arc<OrderTable>>,
}

/// Lobes of many directions, those of one after another: number before each direction, then for
/// every lobe its direction, powers in s and p, order and whether it is transmitted.
type Lobes<'py> =
    (Array<'py, i64>, Array<'py, f64>, Array<'py, f64>, Array<'py, i32>, Array<'py, bool>);
/// Directions, weights, orders, whether transmitted.
type Samples<'py> = (Array<'py, f64>, Array<'py, f64>, Array<'py, i32>, Array<'py, bool>);

fn directions(wi: &PyReadonlyArray2<'_, f64>) -> Vec<DVec3> {
    let rows = wi.as_array();
    rows.rows().into_iter().map(|row| DVec3::new(row[0], row[1], row[2])).collect()
}

fn order(kind: LobeKind) -> i32 {
    match kind {
        LobeKind::Order(order) => order,
        _ => NO_ORDER,
    }
}

impl Surface {
    fn of_table(table: OrderTable) -> Self {
        let table = Arc::new(table);
        Self { bsdf: Arc::clone(&table) as Arc<dyn Bsdf>, table: Some(table) }
    }

    fn orders(&self) -> anyhow::Result<&Arc<OrderTable>> {
        self.table.as_ref().ok_or_else(|| {
            anyhow!("surface: expected a table of diffraction orders, got measured cells")
        })
    }
}

fn read(path: &Path, indices: [f64; 2], shifted: bool, inner: bool) -> anyhow::Result<Surface> {
    if path.extension().is_some_and(|e| e == EXTENSION) {
        return Ok(Surface::of_table(read_table(path)?));
    }
    let content = content::read(path)?;
    if let Content::Orders(table) = content {
        return Ok(Surface { bsdf: Arc::clone(&table) as Arc<dyn Bsdf>, table: Some(table) });
    }
    let side = if inner { Side::Inner } else { Side::Outer };
    let bsdf = content.bsdf(&path.display().to_string(), indices, motion(shifted), side)?;
    Ok(Surface { bsdf, table: None })
}

fn motion(shifted: bool) -> LobeMotion {
    if shifted { LobeMotion::Shifted } else { LobeMotion::Fixed }
}

/// Light from the inner side, transmitted; polar angles and azimuths of `wi`, and for all their
/// combinations polar angles and azimuths of `wo` and the BSDF over them, 1/sr, azimuth by azimuth.
/// Polar angles are those to the normal of the side; all are in degrees and ascend.
type Part<'py> =
    (bool, bool, Vec<f64>, Vec<f64>, Vec<(Vec<f64>, Vec<f64>, PyReadonlyArray1<'py, f64>)>);

fn scatter_table(
    (inner, transmitted, thetas, phis, values): &Part<'_>,
) -> (Side, Transport, ScatterTable) {
    let [thetas, phis] =
        [thetas, phis].map(|a| a.iter().map(|d| d.to_radians()).collect::<Vec<_>>());
    let incidences = thetas.iter().flat_map(|theta| phis.iter().map(move |phi| (*theta, *phi)));
    let nodes = incidences.zip(values).map(|((theta, phi), (polar, azimuths, values))| {
        let cells = Arc::new(AngularBasis::around_points(azimuths, polar, 90.0));
        let basis = OrientedBasis::about_normal(&cells);
        let values = values.as_array();
        let distribution = CellDistribution::new(basis, values.iter().copied(), None);
        IncidentNode { wi: spherical(theta, phi), distribution }
    });
    let nodes = nodes.collect();
    let side = if *inner { Side::Inner } else { Side::Outer };
    let transport = if *transmitted { Transport::Transmission } else { Transport::Reflection };
    (side, transport, ScatterTable::Grid { thetas, phis, nodes, end: FRAC_PI_2 })
}

#[pymethods]
impl Surface {
    /// Reads a file of any format that the program reads.
    #[staticmethod]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        indices: [f64; 2],
        shifted: bool,
        inner: bool,
    ) -> PyResult<Self> {
        with_warnings(py, None, &[], move |_| read(&path, indices, shifted, inner))
    }

    /// From the BSDF over cells of direction, by side and transport; checked as that of files.
    #[staticmethod]
    fn from_cells(
        py: Python<'_>,
        parts: Vec<Part<'_>>,
        indices: [f64; 2],
        shifted: bool,
    ) -> PyResult<Self> {
        let tables: Vec<_> = parts.iter().map(scatter_table).collect();
        with_warnings(py, None, &[], move |_| {
            let surface =
                move |indices, between| MeasuredBsdf::new(indices, between, tables.iter().cloned());
            let file = Content::Scatter(ScatterFile::two_sided("values", surface));
            let bsdf = file.bsdf("values", indices, motion(shifted), Side::Outer);
            Ok(Self { bsdf: bsdf.context("values")?, table: None })
        })
    }

    /// From the bytes of the native format.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        let table = native::read(bytes).context("bytes of a table");
        Ok(Self::of_table(table.map_err(|error| to_python(py, &error))?))
    }

    /// The bytes of the native format.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        self.orders()
            .and_then(|table| Ok(native::write(table, &mut bytes)?))
            .map_err(|error| to_python(py, &error))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Header and grid as JSON; none for a measured surface.
    fn header(&self) -> Option<String> {
        let table = self.table.as_ref()?;
        let grid = table.grid();
        let json = serde_json::json!({
            "header": table.header(),
            "grid": grid,
            "nodes": table.node_count(),
            "entries": table.entry_count(),
        });
        Some(json.to_string())
    }

    /// Index of the inner and of the outer side.
    fn indices(&self) -> [f64; 2] {
        Side::BOTH.map(|side| self.bsdf.index(side))
    }

    /// All lobes of light from each of the directions.
    fn lobes<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        threads: Option<usize>,
    ) -> PyResult<Lobes<'py>> {
        let (bsdf, wi) = (Arc::clone(&self.bsdf), directions(&wi));
        let work = move |job: &Job| {
            let of = |wi: &DVec3| {
                job.interrupt.check()?;
                let s = bsdf.lobes(*wi, Polarisation::S);
                let p = bsdf.lobes(*wi, Polarisation::P);
                anyhow::ensure!(s.len() == p.len(), "lobes: expected as many in s as in p");
                Ok(s.into_iter().zip(p).collect::<Vec<_>>())
            };
            wi.par_iter().map(of).collect::<anyhow::Result<Vec<_>>>()
        };
        let all = job::run(py, threads, work)?;
        let mut offsets = vec![0_i64];
        offsets.extend(all.iter().scan(0, |sum, lobes| {
            *sum += lobes.len() as i64;
            Some(*sum)
        }));
        let lobes: Vec<_> = all.into_iter().flatten().collect();
        let (count, starts) = (lobes.len(), offsets.len());
        let wo = lobes.iter().flat_map(|(s, _)| s.wo.to_array()).collect();
        let power = lobes.iter().flat_map(|(s, p)| [s.power, p.power]).collect();
        let orders = lobes.iter().map(|(s, _)| order(s.lobe.kind)).collect();
        let through = lobes.iter().map(|(s, _)| s.lobe.transport == Transport::Transmission);
        Ok((
            array(py, offsets, vec![starts])?,
            array(py, wo, vec![count, 3])?,
            array(py, power, vec![count, 2])?,
            array(py, orders, vec![count])?,
            array(py, through.collect(), vec![count])?,
        ))
    }

    /// Power reflected and transmitted, in s and in p: (direction, [R, T], [s, p]).
    fn albedo<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        threads: Option<usize>,
    ) -> PyResult<Array<'py, f64>> {
        let (bsdf, wi) = (Arc::clone(&self.bsdf), directions(&wi));
        let count = wi.len();
        let work = move |job: &Job| {
            let of = |wi: &DVec3| {
                job.interrupt.check()?;
                let [s, p] = [Polarisation::S, Polarisation::P].map(|q| bsdf.albedo(*wi, q));
                Ok([s.reflected, p.reflected, s.transmitted, p.transmitted])
            };
            wi.par_iter().map(of).collect::<anyhow::Result<Vec<[f64; 4]>>>()
        };
        let values = job::run(py, threads, work)?.concat();
        array(py, values, vec![count, 2, 2])
    }

    /// Draws one outgoing direction for each incident one.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        wi: PyReadonlyArray2<'py, f64>,
        seed: u64,
        threads: Option<usize>,
    ) -> PyResult<Samples<'py>> {
        let (bsdf, wi) = (Arc::clone(&self.bsdf), directions(&wi));
        let count = wi.len();
        let work = move |job: &Job| {
            let parts: Vec<Vec<_>> = wi
                .par_chunks(CHUNK)
                .enumerate()
                .map(|(number, part)| {
                    job.interrupt.check()?;
                    let mut rng = Pcg64::seed_from_u64(seed);
                    // A stream of its own for each chunk, far from those of the others.
                    rng.advance((number as u128) << 64);
                    Ok(part.iter().map(|wi| bsdf.sample(*wi, &mut rng)).collect())
                })
                .collect::<anyhow::Result<_>>()?;
            Ok(parts.concat())
        };
        let all = job::run(py, threads, work)?;
        let wo = all.iter().flat_map(|s| s.map_or([0.0; 3], |s| s.wo.to_array())).collect();
        let weight = all.iter().map(|s| s.map_or(0.0, |s| s.weight)).collect();
        let orders = all.iter().map(|s| s.map_or(NO_ORDER, |s| order(s.lobe.kind))).collect();
        let through = all
            .iter()
            .map(|s| s.is_some_and(|s| s.lobe.transport == Transport::Transmission))
            .collect();
        Ok((
            array(py, wo, vec![count, 3])?,
            array(py, weight, vec![count])?,
            array(py, orders, vec![count])?,
            array(py, through, vec![count])?,
        ))
    }

    /// Writes the surface; returns the files, and what each lost as JSON.
    #[pyo3(signature = (path, format, incidence_deg, azimuth_deg, scatter_deg, samples, tree_log2, wavelength_nm, threads))]
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        format: String,
        incidence_deg: f64,
        azimuth_deg: f64,
        scatter_deg: f64,
        samples: usize,
        tree_log2: u32,
        wavelength_nm: Option<f64>,
        threads: Option<usize>,
    ) -> PyResult<Vec<(PathBuf, String)>> {
        let (bsdf, table) = (Arc::clone(&self.bsdf), self.table.clone());
        let fineness = Fineness {
            resolution: Resolution { incidence_deg, azimuth_deg, scatter_deg, samples },
            tree_log2,
        };
        job::run(py, threads, move |_| {
            let orders = || {
                table.as_ref().ok_or_else(|| {
                    let cells = words(&[Holds::Cells]);
                    anyhow!("format: expected {cells} for measured cells, got {format:?}")
                })
            };
            let whole = |()| vec![(path.clone(), "{}".to_owned())];
            let of_table = table.as_deref().map(nanometres);
            let wavelength_nm = wavelength_nm.map(Ok).or(of_table).transpose()?;
            if format == EXTENSION {
                return write_table(&path, orders()?).map(whole);
            }
            match formats::writer(&format).map(|writer| writer.writes) {
                Some(Writes::Orders(write)) => {
                    let table = orders()?;
                    write_atomic(&path, |file| write(table, file)).map(whole)
                }
                Some(Writes::Cells { write, .. }) => {
                    let cells =
                        CellTable { surface: bsdf.as_ref(), fineness: &fineness, wavelength_nm };
                    let written = write(&cells, &path)?;
                    let files = written.iter();
                    Ok(files.map(|w| (w.path.clone(), tables::describe(w).to_string())).collect())
                }
                _ => {
                    let known = words(&[Holds::Cells, Holds::Orders]).replace(" or ", ", ");
                    bail!("format: expected {known} or {EXTENSION}, got {format:?}")
                }
            }
        })
    }
}

/// Largest |R + T - 1|; with loss what R + T exceeds 1 by.
fn energy_residual(interface: &rcwa::hemisphere::Interface, solved: &Hemisphere) -> f64 {
    let inside = interface.relief.polygons().iter().map(|polygon| polygon.index);
    if inside.chain([interface.relief.background()]).all(|index| index.im == 0.0) {
        return solved.worst_balance;
    }
    let total = |wave: &Incidence| wave.efficiencies.iter().map(|order| order.2).sum::<f64>();
    solved.incidences.iter().map(|wave| total(wave) - 1.0).fold(0.0, f64::max)
}

/// Builds a table; orders and slices, and nodes of kx to a zone and of ky, are those that the
/// tolerance takes where they are not given.
fn build(
    interface: &rcwa::hemisphere::Interface,
    tolerance: f64,
    given: Option<(usize, usize)>,
    kx_per_zone: Option<usize>,
    ky: Option<Vec<f64>>,
    job: &Job,
) -> anyhow::Result<OrderTable> {
    let watch = job.watch();
    let lossless = [interface.n_top, interface.n_bottom].iter().all(|n| n.im == 0.0);
    anyhow::ensure!(lossless, "grating: expected half-spaces without loss, got an absorbing one");
    let (resolution, estimated_error) = match given {
        None => converge_hemisphere(interface, tolerance, &watch)?,
        Some((orders, slices)) => (resolution(interface, orders, slices)?, 0.0),
    };
    let [n_inner, n_outer] = [interface.n_top.re, interface.n_bottom.re];
    let mut grid = Grid {
        period: interface.relief.period(),
        wavelength: interface.wavelength,
        index_inner: n_inner,
        index_outer: n_outer,
        kx_per_zone: kx_per_zone.unwrap_or(FIRST_KX),
        ky: Grid::ky_nodes(n_inner, n_outer, first_ky(tolerance)),
    };
    let solved: Hemisphere = if let Some(ky) = ky {
        grid.ky = ky;
        let directions = Directions { kx_per_zone: grid.kx_per_zone, ky: grid.ky.clone() };
        hemisphere(interface, &directions, &resolution, &watch)?
    } else {
        let request = GridRequest {
            kx_per_zone: grid.kx_per_zone,
            max_kx: kx_per_zone.is_none().then_some(MAX_KX),
            ky: grid.ky.clone(),
            critical_ky: grid.critical_ky(),
            tolerance,
            max_ky: MAX_KY,
        };
        let found = solve_adaptive(interface, &request, &resolution, &watch)?;
        grid.kx_per_zone = found.directions.kx_per_zone;
        grid.ky = found.directions.ky;
        found.solved
    };
    let header = TableHeader {
        length_unit: "um".to_owned(),
        truncation: resolution.truncation.highest(),
        slices: resolution.plan.count(),
        estimated_error,
        energy_residual: energy_residual(interface, &solved),
        ..TableHeader::default()
    };
    let rows = efficiency_rows(solved.incidences);
    Ok(OrderTable::build(header, grid, rows)?)
}

/// Solves a grating for both hemispheres and makes a table of it.
#[pyfunction]
#[pyo3(signature = (interface, tolerance, resolution, kx_per_zone, ky, threads))]
pub fn build_table(
    py: Python<'_>,
    interface: &Interface,
    tolerance: f64,
    resolution: Option<(usize, usize)>,
    kx_per_zone: Option<usize>,
    ky: Option<PyReadonlyArray1<'_, f64>>,
    threads: Option<usize>,
) -> PyResult<Surface> {
    let interface = interface.inner.clone();
    let ky = ky.map(|ky| ky.as_array().to_vec());
    let work = move |job: &Job| build(&interface, tolerance, resolution, kx_per_zone, ky, job);
    job::run(py, threads, work).map(Surface::of_table)
}

/// Unit cell of a ring of a design: period, depth, index of the background and of the inner side,
/// polygons, and the wavelength, lengths in micrometres.
type CellParts = (f64, f64, f64, f64, Vec<(f64, Vec<[f64; 2]>)>, f64);

/// The unit cell of ring `ring`, from 1, of the design `text`; files that it names lie in `folder`.
#[pyfunction]
pub fn design_cell(
    py: Python<'_>,
    name: String,
    text: String,
    folder: PathBuf,
    ring: usize,
) -> PyResult<CellParts> {
    let names = [name.clone()];
    with_warnings(py, None, &names, move |_| {
        let design = simulate::scene_check::parse(&name, &text, &folder)?;
        let cell = simulate::cells::ring(&design, ring)?;
        Ok((
            cell.period_um,
            cell.depth_um,
            cell.background_index,
            cell.inner_index,
            vec![(cell.inner_index, cell.points_um)],
            1e-3 * design.wavelength_nm,
        ))
    })
}
