// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays of files as arrays, and arrays as files of rays.

use std::path::PathBuf;

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use tracer::RayRecord;

use formats::ray_files::{self, HeaderWavelengths, RayMetadata};
use formats::{Holds, Writes, words};

use crate::job;
use crate::rcwa::array;

type Array<'py, T> = Bound<'py, numpy::PyArrayDyn<T>>;

/// Rows x, y, z, direction, flux, wavelength; whether flux is in W; one wavelength of all.
type Rays<'py> = (Array<'py, f32>, bool, Option<f32>);

/// Reads a ray file of any format.
#[pyfunction]
pub fn read_rays(py: Python<'_>, path: PathBuf) -> PyResult<Rays<'_>> {
    let light = job::run(py, None, move |_| ray_files::with_wavelengths(&path))?;
    let one = match light.stated {
        HeaderWavelengths::One(nm) => Some(nm),
        _ => None,
    };
    let count = light.rays.len();
    let row = |ray: &RayRecord| {
        let [x, y, z] = ray.position;
        let [u, v, w] = ray.direction;
        [x, y, z, u, v, w, ray.flux, ray.wavelength]
    };
    let values = light.rays.iter().flat_map(row).collect();
    Ok((array(py, values, vec![count, 8])?, light.radiant, one))
}

/// Words of the formats of rays with the endings of their files.
#[pyfunction]
pub fn ray_endings() -> Vec<(&'static str, Vec<&'static str>)> {
    let rays = formats::WRITERS.iter().filter(|writer| writer.holds() == Holds::Rays);
    rays.map(|writer| (writer.word, writer.endings.to_vec())).collect()
}

/// Writes rows x, y, z, direction, flux, wavelength into a ray file of a format.
#[pyfunction]
pub fn write_rays(
    py: Python<'_>,
    path: PathBuf,
    format: String,
    rows: PyReadonlyArray2<'_, f32>,
    wavelength_nm: Option<f64>,
) -> PyResult<(u64, f64)> {
    let Some(Writes::Rays(format)) = formats::writer(&format).map(|writer| writer.writes) else {
        return Err(crate::errors::refused(py, "format", &words(&[Holds::Rays]), &format));
    };
    let rows = rows.as_array();
    if rows.ncols() != 8 {
        let got = format!("{} columns", rows.ncols());
        return Err(crate::errors::refused(py, "rows", "8 columns", &got));
    }
    let rays: Vec<RayRecord> = rows
        .rows()
        .into_iter()
        .map(|row| RayRecord {
            position: [row[0], row[1], row[2]],
            direction: [row[3], row[4], row[5]],
            flux: row[6],
            wavelength: row[7],
        })
        .collect();
    let about = RayMetadata {
        name: "batwing".to_owned(),
        operation: "rays from arrays".to_owned(),
        wavelength_nm: wavelength_nm.unwrap_or(f64::NAN),
        per_ray: wavelength_nm.is_none() && rays.iter().all(|ray| ray.wavelength.is_finite()),
        lumens_per_watt: f64::NAN,
        radiant: true,
    };
    job::run(py, None, move |_| {
        ray_files::write(&path, format, &about, |push| rays.iter().try_for_each(push))
    })
}
