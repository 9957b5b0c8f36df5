// SPDX-License-Identifier: MIT OR Apache-2.0
//! The package in words and as a section with rays, total efficiency and uniformity; and, for the
//! page's 3-D view, the package, paths and the far field.

use anyhow::Result;
use metrics::figures::{FLUX_UP, UNIFORMITY};
use serde_json::{Value, json};

use files::formats::exr;
use metrics::plural::count;
use metrics::quantity::Unit;
use results::package::{PackageDrawing, PackageFile, Path3d};
use results::ray_paths::PathEnd;
use results::shown;

use super::models::Model;
use super::pack::{base64_of_numbers, linear};
use super::pictures::Album;
use super::tables::{percent, thousands};
use crate::html::folder::Folder;
use crate::path_picture::compact_picture;
use crate::plots::{Heading, palette};

/// Paths of all models together that the page holds.
const MAX_PATHS: usize = 9_000;
/// Paths of a section on the first screen.
pub(super) const FEW: usize = 24;
/// Radius of the view, in widths of the package or distances of neighbours.
const VIEW: f64 = 0.75;

impl Album {
    /// A section with rays for each model that has paths.
    pub fn sections(&mut self, models: &[Model], packages: &[Option<PackageFile>]) -> Vec<Value> {
        let mut all = Vec::new();
        for (i, (model, package)) in models.iter().zip(packages).enumerate() {
            let Some(package) = package else {
                continue;
            };
            let paths = &package.section_paths[..package.section_paths.len().min(FEW)];
            let title = format!("{}, {}", model.design, model.label());
            let subtitle = format!("plane y = 0, {}", count(paths.len(), "path"));
            let heading = Heading::new(&title, &subtitle);
            let picture = compact_picture(&package.drawing, &heading, paths, &[]);
            let caption = format!(
                "{title}: section of the package nearest to the middle with {}; it alone shines.",
                count(paths.len(), "path")
            );
            let shown = all.is_empty();
            all.push(self.add(&picture, &caption, &json!({"model": i.to_string()}), shown));
        }
        all
    }
}

/// Packages in words, models, total efficiency and uniformity, design by design.
pub fn overview(models: &[Model], packages: &[Option<PackageFile>]) -> Vec<Value> {
    let all: Vec<(&Model, &Option<PackageFile>)> = models.iter().zip(packages).collect();
    let of_design = |design: &[(&Model, &Option<PackageFile>)]| {
        let words = design.iter().find_map(|(_, package)| package.as_ref());
        let row = |(model, _): &(&Model, &Option<PackageFile>)| {
            let ledger = &model.entry.power_ledger;
            let flux = model.entry.figure(FLUX_UP.key);
            let uniformity = model.entry.figures.get(UNIFORMITY.key);
            json!({
                "flux": flux.map(|(flux, unit)| shown::text(&flux, unit)),
                "model": model.label(),
                "paths": thousands(model.entry.paths),
                "efficiency": percent(ledger.account("escaped_up")),
                "uniformity": uniformity.map(|entry| shown::number(entry, Unit::Fraction)),
            })
        };
        let has = |key: &str| design.iter().any(|(model, _)| model.entry.figure(key).is_some());
        json!({
            "design": design[0].0.design,
            "simulated": words.map_or(&[][..], |package| &package.simulated),
            "has_flux": has(FLUX_UP.key),
            "has_uniformity": has(UNIFORMITY.key),
            "rows": design.iter().map(row).collect::<Vec<_>>(),
        })
    };
    let designs = all.chunk_by(|a, b| a.0.design == b.0.design);
    designs.map(of_design).collect()
}

/// Fates, in words and with the variables of their colours.
pub fn fates() -> Value {
    let fate = |end: PathEnd| json!({"words": end.words(), "colour": palette::fate_variable(end)});
    PathEnd::ALL.into_iter().map(fate).collect()
}

/// The scene of a model for the 3-D view; null of results without paths.
///
/// # Errors
/// A far field that cannot be read.
pub fn view_3d(
    model: &Model,
    package: Option<&PackageFile>,
    folder: &Folder,
    models: usize,
) -> Result<Value> {
    let Some(PackageFile { drawing, paths_3d, .. }) = package else {
        return Ok(Value::Null);
    };
    let radius = view_radius(drawing);
    let kept = paths_3d.paths.len().min(MAX_PATHS / models.max(1));
    let paths = &paths_3d.paths[..kept];
    let points: Vec<Vec<[f64; 3]>> = paths.iter().map(|path| drawn(path, radius)).collect();
    let quantised =
        |p: &[f64; 3]| p.map(|x| linear(x.clamp(-radius, radius) + radius, 2.0 * radius));
    let packed: Vec<u16> = points.iter().flatten().flat_map(quantised).collect();
    let solid = |s: &results::package::SolidDrawing| json!({"name": s.name, "bounds": s.bounds_mm});
    let top = drawing.dome_mm.iter().flatten().map(|[_, z]| *z);
    let top = drawing.led_corners().map(|[.., z]| z).into_iter().chain(top).fold(0.0, f64::max);
    let reach = drawing.radius_mm;
    let boxed = |[x, y]: [f64; 2]| {
        let bounds = [[x - reach, y - reach, 0.0], [x + reach, y + reach, top]];
        json!({"name": "package", "bounds": bounds})
    };
    // Of domes without rings; those of others are drawn by their rings.
    let is_boxed = drawing.rings.is_empty();
    let others = drawing.neighbours(radius + reach).filter(|_| is_boxed).map(boxed);
    let neighbours: Vec<[f64; 2]> = drawing.neighbours(radius + reach).collect();
    let number = |place: Option<usize>| place.map_or(-1, |place| place as i64);
    Ok(json!({
        "radius": radius,
        "colour": palette::model_variable(palette::model_number(model.key).unwrap_or(0)),
        "rings": drawing.rings.iter().map(|ring| &ring.points_mm).collect::<Vec<_>>(),
        "ringNames": paths_3d.rings,
        "faceNames": paths_3d.faces,
        "led": drawing.led_corners(),
        "mirror": drawing.mirror_half_mm,
        "plane": drawing.plane_mm,
        "neighbours": neighbours,
        "solids": drawing.solids.iter().map(solid).chain(others).collect::<Vec<_>>(),
        "sizes": points.iter().map(Vec::len).collect::<Vec<_>>(),
        "points": base64_of_numbers(&packed),
        "fates": paths.iter().map(|path| place_of(path.fate)).collect::<Vec<_>>(),
        "pathRings": paths.iter().map(|path| number(path.ring)).collect::<Vec<_>>(),
        "pathFaces": paths.iter().map(|path| number(path.face)).collect::<Vec<_>>(),
        "bins": paths.iter().map(|path| number(bin(path, paths_3d.bin_deg))).collect::<Vec<_>>(),
        "traced": paths_3d.traced,
        "binDeg": paths_3d.bin_deg,
        "byRing": paths_3d.by_ring,
        "byFace": paths_3d.by_face,
        "lobe": lobe(model, folder)?,
    }))
}

/// Radius about the middle of the package that is drawn, mm.
fn view_radius(drawing: &PackageDrawing) -> f64 {
    let width = drawing.pitch_mm.unwrap_or(4.0 * drawing.radius_mm);
    let width = width.clamp(3.0 * drawing.radius_mm, 8.0 * drawing.radius_mm);
    (VIEW * width).max(1.15 * drawing.plane_mm.min(3.0 * width))
}

fn place_of(end: PathEnd) -> usize {
    let place = PathEnd::ALL.iter().position(|other| *other == end);
    place.unwrap_or(0)
}

/// Number of the polar angle that a path escaped to.
fn bin(path: &Path3d, bin_deg: f64) -> Option<usize> {
    let escaped = matches!(path.fate, PathEnd::EscapedUp | PathEnd::EscapedDown);
    let [_, _, z] = path.leaves_along.filter(|_| escaped)?;
    let last = (180.0 / bin_deg).round() as usize - 1;
    Some(((z.clamp(-1.0, 1.0).acos().to_degrees() / bin_deg) as usize).min(last))
}

/// Points of a path within the view, with the one where it leaves it.
fn drawn(path: &Path3d, radius: f64) -> Vec<[f64; 3]> {
    let length = |p: &[f64; 3]| p.iter().map(|x| x * x).sum::<f64>();
    let inside = path.points_mm.iter();
    let mut points: Vec<[f64; 3]> =
        inside.take_while(|p| length(p) < radius * radius).copied().collect();
    let beyond = path.points_mm.get(points.len());
    if let Some(last) = points.last().copied() {
        let along = match (beyond, path.leaves_along) {
            (Some(next), _) => Some([0, 1, 2].map(|k| next[k] - last[k])),
            (None, along) => along,
        };
        points.extend(along.map(|d| {
            // |last + s d| = radius
            let a = length(&d).max(f64::MIN_POSITIVE);
            let b: f64 = (0..3).map(|k| last[k] * d[k]).sum();
            let s = ((b * b + a * (radius * radius - length(&last))).sqrt() - b) / a;
            [0, 1, 2].map(|k| last[k] + s * d[k])
        }));
    }
    points
}

/// The far field over polar angle and azimuth, as shares of its largest value.
fn lobe(model: &Model, folder: &Folder) -> Result<Value> {
    let path = model.file(folder, "far_field.exr")?;
    let contents = exr::read_map(&path)?;
    let polar = contents.description.rows.edges.len() - 1;
    let azimuths = contents.description.columns.edges.len() - 1;
    let values: Vec<f64> = contents.value.iter().copied().map(f64::from).collect();
    let errors: Vec<f64> = contents.standard_error.iter().copied().map(f64::from).collect();
    let rows = values.chunks(azimuths).zip(errors.chunks(azimuths));
    let smooth: Vec<f64> = rows.flat_map(|(v, e)| averaged(v, e)).collect();
    let most = smooth.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let shares: Vec<u16> = smooth.iter().map(|v| linear(*v, most)).collect();
    Ok(json!({"polar": polar, "azimuths": azimuths, "share": base64_of_numbers(&shares)}))
}

/// Error of the mean of neighbouring azimuths, beside it, that the 3-D view leaves.
const SMOOTH: f64 = 0.06;

/// The values of one polar angle, averaged over as many neighbouring azimuths as their errors ask
/// for.
fn averaged(values: &[f64], errors: &[f64]) -> Vec<f64> {
    let count = values.len();
    let noise = errors.iter().sum::<f64>() / values.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let enough = |n: &usize| count.is_multiple_of(*n) && noise <= SMOOTH * (*n as f64).sqrt();
    let together = (1..=count).find(enough).unwrap_or(count);
    let means = values.chunks(together).flat_map(|group| {
        let mean = group.iter().sum::<f64>() / group.len() as f64;
        std::iter::repeat_n(mean, group.len())
    });
    means.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noisy_angles_are_averaged_over_azimuth() {
        let values = [1.0, 3.0, 5.0, 7.0];
        assert_eq!(averaged(&values, &[0.1; 4]), values);
        assert_eq!(averaged(&values, &[0.3; 4]), [2.0, 2.0, 6.0, 6.0]);
        assert_eq!(averaged(&values, &[9.0; 4]), [4.0; 4]);
        assert_eq!(averaged(&[0.0; 4], &[0.0; 4]), [0.0; 4]);
    }

    #[test]
    fn paths_end_on_the_sphere_of_the_view() {
        let path = |points_mm: &[[f64; 3]], leaves_along| Path3d {
            fate: PathEnd::EscapedUp,
            ring: None,
            face: None,
            points_mm: points_mm.to_vec(),
            leaves_along,
        };
        let away = |p: [f64; 3]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
        let leaves = path(&[[0.0; 3], [1.0, 0.0, 1.0]], Some([0.0, 0.6, 0.8]));
        let points = drawn(&leaves, 3.0);
        assert_eq!(points.len(), 3);
        assert!((away(points[2]) - 3.0).abs() < 1e-12);
        // A bend outside the view is left out, its direction is not.
        let far = path(&[[0.0; 3], [0.0, 0.0, 9.0]], None);
        assert_eq!(drawn(&far, 3.0), [[0.0; 3], [0.0, 0.0, 3.0]]);
        assert_eq!(bin(&leaves, 5.0), Some(7));
        assert_eq!(bin(&far, 5.0), None);
    }
}
