// SPDX-License-Identifier: MIT OR Apache-2.0
//! Gratings for Python: `batwing._native.Interface`.

use std::sync::{Arc, Mutex, PoisonError};

use anyhow::ensure;
use gratings::methods::{choose, directions_by_integrals, missed};
use num_complex::Complex64;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use rcwa::accuracy::{
    NOTHING_KNOWN, check_tolerance, converge_hemisphere, first_resolution, unsettled,
};
use rcwa::field::{Grid, field};
use rcwa::hemisphere::{Directions, Resolution, hemisphere};
use rcwa::lines::{Direction, DirectionOrders, LinesRequest, SolvedDirections, ToleranceRequest};
use rcwa::lines::{converge_directions, error_of_directions, solve_directions};
use rcwa::relief::floating::{Ridges, floating_words};
use rcwa::relief::{Polygon, Relief};
use rcwa::{Bloch, Side, Stack, Truncation};

use crate::errors::to_python;
use crate::job::{self, Job};

/// Polygon as Python hands it over: index and corners.
type PolygonParts = (Complex64, Vec<[f64; 2]>);
/// Array of numbers with its shape.
type Array<'py, T> = Bound<'py, numpy::PyArrayDyn<T>>;

/// One stack, or two that are extrapolated, by the number of slices.
type Stacks = (usize, Arc<(Stack, Option<Stack>)>);

/// Bits of a tolerance, and the resolution of a table, where slices follow walls.
type TableResolution = (u64, Option<Resolution>);

/// A relief between two half-spaces at one wavelength.
#[pyclass(frozen, module = "batwing._native")]
pub struct Interface {
    /// The solver's own interface.
    pub inner: rcwa::hemisphere::Interface,
    /// The stack of the last resolution.
    last: Arc<Mutex<Option<Stacks>>>,
    /// The tolerance and the resolution that the last search over directions began with.
    table: Arc<Mutex<Option<TableResolution>>>,
}

fn side(top: bool) -> Side {
    if top { Side::Top } else { Side::Bottom }
}

/// An array of `shape` that takes over `values`.
pub fn array<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: Vec<usize>,
) -> PyResult<Array<'_, T>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Orders of one half-space: the first relative order and values over (direction, order, ...).
struct Dense<T> {
    first: i32,
    orders: usize,
    values: Vec<T>,
}

/// Values of a half-space, four for each direction and order, from lists of orders.
fn dense<T: Copy + Default>(
    all: &[DirectionOrders],
    list: impl Fn(&DirectionOrders) -> &[(Side, i32, [[T; 2]; 2])],
    half_space: Side,
) -> Dense<T> {
    let there = || {
        let orders = all.iter().flat_map(&list);
        orders.filter(|o| o.0 == half_space).map(|o| o.1)
    };
    let (Some(first), Some(last)) = (there().min(), there().max()) else {
        return Dense { first: 0, orders: 0, values: Vec::new() };
    };
    let orders = (last - first + 1) as usize;
    let mut values = vec![T::default(); all.len() * orders * 4];
    for (direction, found) in all.iter().enumerate() {
        for (number, order, value) in list(found) {
            if *number == half_space {
                let at = (direction * orders + (order - first) as usize) * 4;
                values[at..at + 4].copy_from_slice(value.as_flattened());
            }
        }
    }
    Dense { first, orders, values }
}

fn efficiencies(all: &[DirectionOrders]) -> [Dense<f64>; 2] {
    Side::BOTH.map(|half_space| dense(all, |o| &o.efficiencies, half_space))
}

impl<T: numpy::Element> Dense<T> {
    fn into_python(self, py: Python<'_>, count: usize) -> PyResult<(i32, Array<'_, T>)> {
        let shape = vec![count, self.orders, 2, 2];
        Ok((self.first, array(py, self.values, shape)?))
    }
}

/// Orders of one half-space for Python.
type Half<'py, T> = (i32, Array<'py, T>);
/// Efficiencies of both half-spaces, Jones matrices of both, |R + T - 1|, problems; highest order and
/// slices (0 by boundary integrals), nodes (0 by orders) and estimated error, the latter where it is
/// asked for; warning.
type Solution<'py> = (
    Half<'py, f64>,
    Half<'py, f64>,
    Option<(Half<'py, Complex64>, Half<'py, Complex64>)>,
    f64,
    usize,
    ResolutionParts,
    Option<String>,
);
/// Electric and magnetic field, index, flux, R, T.
type Field<'py> = (
    Array<'py, Complex64>,
    Array<'py, Complex64>,
    Array<'py, Complex64>,
    Array<'py, f64>,
    f64,
    f64,
);
/// Side, kx, ky of every node; efficiencies of both half-spaces; |R + T - 1|; problems.
type Nodes<'py> = (
    Array<'py, bool>,
    Array<'py, f64>,
    Array<'py, f64>,
    Half<'py, f64>,
    Half<'py, f64>,
    f64,
    usize,
);

/// The resolution of so many orders and slices.
pub fn resolution(
    interface: &rcwa::hemisphere::Interface,
    orders: usize,
    slices: usize,
) -> Result<Resolution, rcwa::Error> {
    let truncation = Truncation::new(orders)?;
    Ok(Resolution { truncation, plan: interface.relief.slice_plan(slices) })
}

/// The value that `last` holds for `key`, or else the one that `make` gives, which it holds then.
fn held<K: PartialEq, V: Clone>(
    last: &Mutex<Option<(K, V)>>,
    key: K,
    make: impl FnOnce() -> Result<V, rcwa::Error>,
) -> Result<V, rcwa::Error> {
    let locked = || last.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, value)) = locked().as_ref().filter(|(at, _)| *at == key) {
        return Ok(value.clone());
    }
    let value = make()?;
    *locked() = Some((key, value.clone()));
    Ok(value)
}

/// Highest order and slices, nodes, error.
type ResolutionParts = (usize, usize, usize, Option<f64>);
/// Orders of both half-spaces as arrays, their Jones matrices, |R + T - 1|, problems, resolution.
type Halves = ([Dense<f64>; 2], Option<[Dense<Complex64>; 2]>, f64, usize, ResolutionParts);

fn halves(solved: &SolvedDirections, jones: bool, resolution: ResolutionParts) -> Halves {
    let all = &solved.orders;
    let matrices = jones.then(|| Side::BOTH.map(|half_space| dense(all, |o| &o.jones, half_space)));
    (efficiencies(all), matrices, solved.balance, solved.problems, resolution)
}

/// Highest order and slices of a resolution, with the error.
fn parts(at: &Resolution, error: Option<f64>) -> ResolutionParts {
    (at.truncation.highest(), at.plan.count(), 0, error)
}

#[pymethods]
impl Interface {
    #[new]
    fn new(
        py: Python<'_>,
        period: f64,
        depth: f64,
        background: Complex64,
        polygons: Vec<PolygonParts>,
        wavelength: f64,
        n_top: Complex64,
        n_bottom: Complex64,
    ) -> PyResult<Self> {
        let polygons = polygons.into_iter();
        let polygons = polygons.map(|(index, points)| Polygon { index, points });
        let build = || -> anyhow::Result<Self> {
            let relief = Relief::new(period, depth, background, polygons.collect())?;
            // Checks the wavelength and the half-spaces.
            Stack::new(wavelength, period, n_top, n_bottom, Vec::new())?;
            let inner = rcwa::hemisphere::Interface { relief, wavelength, n_top, n_bottom };
            Ok(Self { inner, last: Arc::default(), table: Arc::default() })
        };
        build().map_err(|error| to_python(py, &error))
    }

    /// Highest order that propagates from any direction on either side.
    fn highest_order(&self) -> usize {
        self.inner.highest_order()
    }

    /// True where one slice between kinks is exact.
    fn is_exact(&self) -> bool {
        self.inner.relief.slice_plan(1).is_exact()
    }

    /// Orders and slices for a tolerance over both hemispheres, and the estimated error.
    fn converge(
        &self,
        py: Python<'_>,
        tolerance: f64,
        threads: Option<usize>,
    ) -> PyResult<(usize, usize, f64)> {
        let interface = self.inner.clone();
        job::run(py, threads, move |job| {
            let (found, error) = converge_hemisphere(&interface, tolerance, &job.watch())?;
            Ok((found.truncation.highest(), found.plan.count(), error))
        })
    }

    /// Efficiencies (and Jones matrices) of a list of directions, at given orders and slices, with
    /// the error if `estimate`, or to a tolerance.
    #[pyo3(signature = (top, kx, ky, azimuth, orders, slices, estimate, tolerance, jones, threads))]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        top: bool,
        kx: PyReadonlyArray1<'py, f64>,
        ky: PyReadonlyArray1<'py, f64>,
        azimuth: PyReadonlyArray1<'py, f64>,
        orders: usize,
        slices: usize,
        estimate: bool,
        tolerance: Option<f64>,
        jones: bool,
        threads: Option<usize>,
    ) -> PyResult<Solution<'py>> {
        let (kx, ky, azimuth) = (kx.as_array(), ky.as_array(), azimuth.as_array());
        let directions: Vec<Direction> = kx
            .iter()
            .zip(ky)
            .zip(azimuth)
            .map(|((&kx, &ky), &azimuth)| Direction { kx, ky, azimuth })
            .collect();
        let (interface, last) = (self.inner.clone(), Arc::clone(&self.last));
        let table = Arc::clone(&self.table);
        let (count, side) = (directions.len(), side(top));
        let work = move |job: &Job| {
            let index = if top { interface.n_top } else { interface.n_bottom };
            ensure!(
                index.im == 0.0 && index.re > 0.0,
                "side: expected a half-space of real index, since light comes from it, got [{}, {}]",
                index.re,
                index.im
            );
            let is_extrapolated =
                !interface.follows_walls() && !interface.relief.slice_plan(1).is_exact();
            ensure!(
                !jones || !is_extrapolated,
                "jones: expected a relief of vertical walls or of dielectrics, got one that is extrapolated from two runs, whose phases differ"
            );
            let mut warning = None;
            let (at, known_error) = if let Some(tolerance) = tolerance {
                check_tolerance(tolerance)?;
                let watch = &job.watch();
                let integrals = || {
                    let incident = (side, (!jones).then_some(directions.as_slice())?);
                    let found = directions_by_integrals(&interface, incident, tolerance, watch);
                    let (solved, nodes, error) = found?;
                    let said = missed(tolerance, nodes, error);
                    Some((error, (solved, (0, 0, nodes, Some(error)), None, said)))
                };
                let by_orders = || {
                    let first = || first_resolution(&interface, tolerance, watch);
                    let request = ToleranceRequest {
                        interface: &interface,
                        side,
                        directions: &directions,
                        tolerance,
                        first: held(&table, tolerance.to_bits(), first)?,
                    };
                    let mut found = converge_directions(&request, watch)?;
                    let error = found.errors.sum();
                    if error >= NOTHING_KNOWN {
                        found = found.within(tolerance)?;
                    }
                    let said = found.missed(tolerance, found.resolution.plan.count());
                    let parts = parts(&found.resolution, Some(error));
                    Ok((error, (found.answer, parts, Some(found.resolution), said)))
                };
                let found = choose::<_, rcwa::Error>(&interface, tolerance, integrals, by_orders)?;
                let (error, (solved, parts, at, said)) = found;
                warning = said;
                match at.filter(|_| jones) {
                    Some(at) => (at, Some(error)),
                    None => return Ok((halves(&solved, false, parts), warning)),
                }
            } else {
                (resolution(&interface, orders, slices)?, None)
            };
            let stacks = match tolerance {
                None => held(&last, slices, || Ok(Arc::new(interface.stacks(&at)?)))?,
                Some(_) => Arc::new(interface.stacks(&at)?),
            };
            let request = LinesRequest { stacks: &stacks, truncation: at.truncation, side, jones };
            let steps = |count| job.expect(count);
            let solved = solve_directions(request, &directions, &steps, &job.watch())?;
            let error = if estimate && known_error.is_none() {
                let incident = (side, directions.as_slice());
                let watch = &job.watch();
                let error = error_of_directions(&interface, incident, &at, &solved, &steps, watch)?;
                warning = unsettled(error, at.truncation.highest());
                Some(error)
            } else {
                known_error
            };
            Ok((halves(&solved, jones, parts(&at, error)), warning))
        };
        let (([upper, lower], matrices, balance, problems, resolution), warning) =
            job::run(py, threads, work)?;
        let matrices = matrices
            .map(|[upper, lower]| {
                PyResult::Ok((upper.into_python(py, count)?, lower.into_python(py, count)?))
            })
            .transpose()?;
        Ok((
            upper.into_python(py, count)?,
            lower.into_python(py, count)?,
            matrices,
            balance,
            problems,
            resolution,
            warning,
        ))
    }

    /// All directions of both hemispheres on a grid of wavevectors.
    fn hemisphere<'py>(
        &self,
        py: Python<'py>,
        kx_per_zone: usize,
        ky: PyReadonlyArray1<'py, f64>,
        orders: usize,
        slices: usize,
        threads: Option<usize>,
    ) -> PyResult<Nodes<'py>> {
        let interface = self.inner.clone();
        let spacing = interface.order_spacing();
        let directions = Directions { kx_per_zone, ky: ky.as_array().to_vec() };
        let work = move |job: &Job| {
            let resolution = resolution(&interface, orders, slices)?;
            job.expect(rcwa::hemisphere::work(&interface, &directions, &resolution));
            let solved = hemisphere(&interface, &directions, &resolution, &job.watch())?;
            let mut incidences = solved.incidences;
            incidences.sort_by_key(|i| (i.side == Side::Bottom, i.ky_index, i.kx_index, i.pol));
            let (mut from_top, mut kx, mut ky) = (Vec::new(), Vec::new(), Vec::new());
            let mut all = Vec::new();
            for pair in incidences.chunks_exact(2) {
                from_top.push(pair[0].side == Side::Top);
                kx.push(directions.node(pair[0].kx_index) * spacing);
                ky.push(directions.ky[pair[0].ky_index]);
                // Shares are summed over the polarisation that leaves; kept as that of the first.
                let mut orders = DirectionOrders::default();
                for (s, p) in pair[0].efficiencies.iter().zip(&pair[1].efficiencies) {
                    orders.efficiencies.push((s.0, s.1, [[s.2, 0.0], [p.2, 0.0]]));
                }
                all.push(orders);
            }
            Ok((from_top, kx, ky, efficiencies(&all), solved.worst_balance, solved.problems))
        };
        let (from_top, kx, ky, [upper, lower], balance, problems) = job::run(py, threads, work)?;
        let count = kx.len();
        Ok((
            array(py, from_top, vec![count])?,
            array(py, kx, vec![count])?,
            array(py, ky, vec![count])?,
            upper.into_python(py, count)?,
            lower.into_python(py, count)?,
            balance,
            problems,
        ))
    }

    /// The field of one wave on a grid of points.
    fn field<'py>(
        &self,
        py: Python<'py>,
        top: bool,
        wavevector: [f64; 3],
        amplitudes: [Complex64; 2],
        x: PyReadonlyArray1<'py, f64>,
        z: PyReadonlyArray1<'py, f64>,
        orders: usize,
        slices: usize,
        threads: Option<usize>,
    ) -> PyResult<Field<'py>> {
        let interface = self.inner.clone();
        let grid = Grid { x: x.as_array().to_vec(), z: z.as_array().to_vec() };
        let shape = [grid.z.len(), grid.x.len()];
        let work = move |job: &Job| {
            let stack = interface.stack(&interface.relief.slice_plan(slices))?;
            let bloch =
                Bloch { kx0: wavevector[0], ky: wavevector[1], azimuth_at_normal: wavevector[2] };
            let incident = rcwa::field::Incident { side: side(top), order: 0, amplitudes };
            let truncation = Truncation::new(orders)?;
            Ok(field(&stack, bloch, truncation, &incident, grid, &job.watch())?)
        };
        let found = job::run(py, threads, work)?;
        let vectors = |of: fn(&rcwa::field::Sample) -> [Complex64; 3]| {
            let all: Vec<Complex64> = found.samples.iter().flat_map(of).collect();
            array(py, all, vec![shape[0], shape[1], 3])
        };
        let index: Vec<Complex64> = found.samples.iter().map(|s| s.index).collect();
        Ok((
            vectors(|s| s.electric)?,
            vectors(|s| s.magnetic)?,
            array(py, index, shape.to_vec())?,
            array(py, found.flux.clone(), vec![shape[0]])?,
            found.reflected,
            found.transmitted,
        ))
    }
}

/// A case of `batwing grating` as JSON text, solved; JSON text of the result and warnings.
#[pyfunction]
pub fn solve_case(
    py: Python<'_>,
    name: String,
    text: String,
    threads: Option<usize>,
) -> PyResult<String> {
    job::run(py, threads, move |job| {
        let case = gratings::grating_case::Case::parse(&name, &text)?;
        let solved = gratings::grating::solve(&case, &job.watch())?;
        let mut json = solved.to_json();
        let warnings = case.doubts().into_iter().chain(solved.warnings());
        json["warnings"] = warnings.collect::<Vec<_>>().into();
        Ok(json.to_string())
    })
}

/// The half-spaces of whose material ridges are that stand on none of them, and a warning; of
/// materials by number: background, top, bottom, and those of the polygons, with their names.
#[pyfunction]
pub fn floating_ridges(
    period: f64,
    depth: f64,
    around: [usize; 3],
    polygons: Vec<(usize, String, Vec<[f64; 2]>)>,
) -> Option<(Vec<&'static str>, String)> {
    let [background, top, bottom] = &around;
    let outlines: Vec<_> = polygons.iter().map(|p| (p.0, p.2.as_slice())).collect();
    let ridges =
        Ridges { period, depth, background, polygons: &outlines, half_spaces: [top, bottom] };
    let (number, sides) = ridges.floating()?;
    let words = floating_words(&polygons[number].1, &sides);
    Some((sides.into_iter().map(Side::name).collect(), words))
}

/// Index n + ik at wavelengths in micrometres from the text of a material file.
#[pyfunction]
pub fn material_indices(
    py: Python<'_>,
    text: &str,
    wavelengths_um: Vec<f64>,
) -> PyResult<Vec<Complex64>> {
    let read = || -> anyhow::Result<Vec<Complex64>> {
        let material = rcwa::material::Material::from_text(text, None)?;
        let indices = wavelengths_um.iter().map(|&w| Ok(material.index_at(w)?.complex()));
        indices.collect()
    };
    read().map_err(|error| to_python(py, &error))
}
