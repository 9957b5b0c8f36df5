// SPDX-License-Identifier: MIT OR Apache-2.0
//! A package, paths of its light and its far field as the 3-D view of a page reads them, with the
//! style and the scripts that draw them.

use serde_json::{Value, json};

use results::package::{PackageDrawing, Path3d, Paths3d};
use results::ray_paths::PathEnd;

use super::pack::{base64_of_numbers, linear};
use crate::plots::palette;

/// Script of elements and numbers, on which the others build.
pub const ELEMENTS: &str = include_str!("assets/elements.js");
/// Script of lines and faces by WebGL.
pub const WEBGL: &str = include_str!("assets/webgl.js");
/// Script of the view, which builds on both.
pub const VIEW: &str = include_str!("assets/scene_3d.js");
/// Style of the 3-D view.
pub const STYLE: &str = include_str!("assets/view_3d.css");

/// Radius of the view, in widths of the package or distances of neighbours.
const RADIUS: f64 = 0.75;

/// A far field by bins of directions, polar angle after polar angle.
#[derive(Debug)]
pub struct FarFieldBins {
    /// Bins of azimuth at each polar angle.
    pub azimuths: usize,
    /// Intensities, in any unit.
    pub value: Vec<f64>,
    /// Standard errors of them.
    pub standard_error: Vec<f64>,
}

/// Fates, in words and with the variables of their colours.
pub fn fates() -> Value {
    let fate = |end: PathEnd| json!({"words": end.words(), "colour": palette::fate_variable(end)});
    PathEnd::ALL.into_iter().map(fate).collect()
}

/// The scene of a package: at most `max_paths` of `paths_3d`, and the far field in the colour of the
/// model with this key.
pub fn scene(
    drawing: &PackageDrawing,
    paths_3d: &Paths3d,
    far_field: &FarFieldBins,
    model_key: &str,
    max_paths: usize,
) -> Value {
    let radius = view_radius(drawing);
    let paths = &paths_3d.paths[..paths_3d.paths.len().min(max_paths)];
    let points: Vec<Vec<[f64; 3]>> = paths.iter().map(|path| drawn(path, radius)).collect();
    let quantised =
        |p: &[f64; 3]| p.map(|x| linear(x.clamp(-radius, radius) + radius, 2.0 * radius));
    let packed: Vec<u16> = points.iter().flatten().flat_map(quantised).collect();
    let solid = |s: &results::package::SolidDrawing| json!({"name": s.name, "bounds": s.bounds_mm});
    let top = drawing.dome_mm.iter().flatten().map(|[_, z]| *z);
    let top = drawing.led_corners().map(|[.., z]| z).into_iter().chain(top).fold(0.0, f64::max);
    let reach = drawing.radius_mm;
    let sized = |[x, y]: [f64; 2]| {
        let [_, size] = drawing.turn_and_scale([x, y]);
        [x, y, size]
    };
    let boxed = |[x, y, size]: [f64; 3]| {
        let [reach, top] = [size * reach, size * top];
        let bounds = [[x - reach, y - reach, 0.0], [x + reach, y + reach, top]];
        json!({"name": "package", "bounds": bounds})
    };
    // Of domes without rings; those of others are drawn by their rings.
    let is_boxed = drawing.rings.is_empty();
    let within = radius + drawing.largest_radius_mm();
    let neighbours: Vec<[f64; 3]> = drawing.neighbours(within).map(sized).collect();
    let others = neighbours.iter().copied().filter(|_| is_boxed).map(boxed);
    let number = |place: Option<usize>| place.map_or(-1, |place| place as i64);
    json!({
        "radius": radius,
        "colour": palette::model_variable(palette::model_number(model_key).unwrap_or(0)),
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
        "fates": paths.iter().map(|path| path.fate as usize).collect::<Vec<_>>(),
        "pathRings": paths.iter().map(|path| number(path.ring)).collect::<Vec<_>>(),
        "pathFaces": paths.iter().map(|path| number(path.face)).collect::<Vec<_>>(),
        "bins": paths.iter().map(|path| number(bin(path, paths_3d.bin_deg))).collect::<Vec<_>>(),
        "traced": paths_3d.traced,
        "binDeg": paths_3d.bin_deg,
        "byRing": paths_3d.by_ring,
        "byFace": paths_3d.by_face,
        "lobe": lobe(far_field),
    })
}

/// Radius about the middle of the package that is drawn, mm: with all that is about a single one.
fn view_radius(drawing: &PackageDrawing) -> f64 {
    let is_single = drawing.axes_mm.len() == 1;
    let [reach, top] = drawing.reach_mm(|solid| is_single || solid.each);
    let width = drawing.pitch_mm.unwrap_or(4.0 * drawing.radius_mm);
    let width = width.clamp(3.0 * drawing.radius_mm, 8.0 * drawing.radius_mm);
    let width = width.max(1.5 * reach.hypot(top) / RADIUS);
    (RADIUS * width).max(1.15 * drawing.plane_mm.min(3.0 * width))
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
fn lobe(far_field: &FarFieldBins) -> Value {
    let FarFieldBins { azimuths, value, standard_error } = far_field;
    let rows = value.chunks(*azimuths).zip(standard_error.chunks(*azimuths));
    let smooth: Vec<f64> = rows.flat_map(|(v, e)| averaged(v, e)).collect();
    let most = smooth.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let shares: Vec<u16> = smooth.iter().map(|v| linear(*v, most)).collect();
    let polar = value.len() / azimuths.max(&1);
    json!({"polar": polar, "azimuths": azimuths, "share": base64_of_numbers(&shares)})
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
