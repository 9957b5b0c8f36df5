// SPDX-License-Identifier: MIT OR Apache-2.0
//! Parts of a design that are not their own mirror images between walls that mirror.
//!
//! Such walls stand for an endless array where the planes x = 0 and y = 0 mirror each package, and
//! the whole array, on themselves. Anything else is turned into its image from cell to cell. Light
//! that carries its polarisation must meet no plate that ends at a wall: its edges reflect totally,
//! with phases that turn one polarisation into another.

use tracer::glam::DVec3;
use tracer::shape::{Bounds, Reach, Sides};
use tracer::{Emission, Emitter, Ray, Shape, Source};

use design::Design;
use design::resolved::array::PackagePositions;
use design::resolved::dome::Dome;
use design::resolved::files::is_own_image;
use design::resolved::reflector::Reflector;
use design::resolved::solids::CheckedSolid;
use design::schema::solids::Per;
use metrics::illuminance::Symmetry;
use metrics::kinds::Carrying;

use super::solids::surface_points;
use super::symmetry;

/// Minimum reflectance of walls that may stand for an endless array.
const MIRRORS: f64 = 0.9;
/// Largest distance of an image from what it is the image of, as a share of its size.
const SAME: f64 = 1e-3;
/// Share of the points of a surface whose images must lie on it; others may lie at an edge.
const MAJORITY: f64 = 0.9;
/// Maximum number of parts that the warning names.
const MOST: usize = 4;

/// The warning on `design`, if its walls mirror and something is not its own image in them.
pub(super) fn warning(design: &Design) -> Option<String> {
    let housing = design.housing.as_ref()?;
    let (kind, reflectance) = match housing.reflector {
        Reflector::Specular { reflectance } => ("specular", reflectance),
        Reflector::Mixed { reflectance, specular_fraction } => {
            ("mixed", reflectance * specular_fraction)
        }
        Reflector::Lambertian { .. } | Reflector::Absorbing | Reflector::Periodic => return None,
    };
    let parts = if reflectance >= MIRRORS { changed(design) } else { Vec::new() };
    if parts.is_empty() {
        return None;
    }
    let more = match parts.len().saturating_sub(MOST) {
        0 => String::new(),
        more => format!("; and {more} more"),
    };
    Some(format!(
        "{}: housing.kind = \"{kind}\": walls that mirror stand for an endless array only where \
         everything is its own mirror image in x = 0 and in y = 0; here they turn into something \
         else: {}{more}. Right for a housing of such walls; kind = \"periodic\" is an endless array of any cell",
        design.provenance.file,
        parts[..parts.len().min(MOST)].join("; ")
    ))
}

/// Keys of all that walls turn into something else, with what it is.
fn changed(design: &Design) -> Vec<String> {
    let mut parts = Vec::new();
    let mut say = |key: &str, what: &str| parts.push(format!("{key} ({what})"));
    for solid in &design.solids {
        for (key, got) in solid.oriented() {
            say(&format!("{key} = {got}"), "its image has another direction");
        }
    }
    if design.polarization == Carrying::Carried {
        for solid in design.solids.iter().filter(|solid| ends_at_walls(design, solid)) {
            let what = "its edges at the walls reflect totally and change the polarisation that \
                        light carries";
            say(&format!("{} {:?}", solid.table, solid.name()), what);
        }
    }
    if !design.led.is_centred() {
        say("led", "off the axis of its package or tilted");
    }
    if let Some(Dome::Mesh(mesh)) = &design.dome
        && !(0..2).all(|axis| is_image(&mesh.shape, &mesh.shape, axis))
    {
        say("dome.mesh", "not symmetric");
    }
    if symmetry::of_places(&design.array.axes_mm()) == Symmetry::None {
        let key = match design.array.positions {
            _ if design.array.is_offset() => "array.offsets_mm",
            PackagePositions::Grid { .. } => "array.arrangement",
            PackagePositions::List { .. } => "array.positions_file",
        };
        say(key, "rows that are not their own image");
    }
    if design.array.is_turned() {
        let is_own = design.array.has_own_turns();
        let key = if is_own { "array.turns_deg" } else { "array.positions_file" };
        say(key, "packages whose image turns the other way");
    }
    let axes = design.array.places_mm();
    let is_mirrored = |values: &[f64]| {
        let value_at = |at: [f64; 2]| {
            let place = axes.iter().position(|axis| (0..2).all(|k| (axis[k] - at[k]).abs() < SAME));
            place.map(|place| values[place])
        };
        axes.iter().zip(values).all(|([x, y], value)| {
            [[-x, *y], [*x, -y]].into_iter().all(|at| value_at(at) == Some(*value))
        })
    };
    if let Some(drives) = &design.array.drives
        && !is_mirrored(drives)
    {
        say("array.positions_file", "powers that are not their own image");
    }
    let scales = (0..design.array.count()).map(|package| design.array.scale(package));
    if design.array.is_scaled() && !is_mirrored(&scales.collect::<Vec<_>>()) {
        let is_own = design.array.has_own_scales();
        let key = if is_own { "array.scales" } else { "array.positions_file" };
        say(key, "packages whose image has another size");
    }
    for print in design.prints.iter().filter(|print| print.symmetry() == Symmetry::None) {
        say(&print.name(), "a pattern that is not its own image");
    }
    if design.files.symmetry() == Symmetry::None {
        say("files", "a mirror or a source that is not symmetric");
    }
    for (k, source) in design.sources.iter().enumerate() {
        let emitters = || design.sources.iter().flat_map(|other| &other.emitters);
        let has_image = |emitter: &Source, axis: usize| {
            emitters().any(|other| is_image_of_source(emitter, &other.source, axis))
        };
        let mut own = source.emitters.iter().map(|emitter| &emitter.source);
        if !own.all(|emitter| has_image(emitter, 0) && has_image(emitter, 1)) {
            say(&format!("sources[{}] {:?}", k + 1, source.name()), "no source is its image");
        }
    }
    for solid in &design.solids {
        let has_image =
            |axis: usize| design.solids.iter().any(|other| is_image_of_solid(solid, other, axis));
        if !(has_image(0) && has_image(1)) {
            say(&format!("{} {:?}", solid.table, solid.name()), "no solid is its image");
        }
    }
    parts
}

/// True of a solid that light enters and that reaches to the walls.
fn ends_at_walls(design: &Design, solid: &CheckedSolid) -> bool {
    let half = design.housing_half_mm().unwrap_or([f64::INFINITY; 2]);
    let refracts = solid.medium.as_ref().is_some_and(|medium| medium.index > 1.0);
    let Ok(bounds) = solid.form.shape(0.0).map(|shape| shape.bounds()) else { return false };
    let farthest = bounds.low.abs().max(bounds.high.abs());
    refracts
        && solid.per() == Per::Array
        && (0..2).any(|axis| farthest[axis] >= half[axis] * (1.0 - SAME))
}

/// The image of a vector in the plane across an axis.
fn image(at: DVec3, axis: usize) -> DVec3 {
    at - 2.0 * at[axis] * DVec3::AXES[axis]
}

/// True if one shape is the image of the other: the images of points of its surface lie on the other.
fn is_image(one: &Shape, other: &Shape, axis: usize) -> bool {
    let near = SAME * one.bounds().size().max_element();
    let points = surface_points(one);
    let lies_on = |(at, normal): &&(DVec3, DVec3)| {
        let [at, normal] = [*at, *normal].map(|vector| image(vector, axis));
        let ray = Ray { origin: at + normal * near, direction: -normal };
        other.intersect(&ray, Reach { from: 0.0, to: 2.0 * near }, Sides::Both).is_some()
    };
    points.iter().filter(lies_on).count() as f64 >= MAJORITY * points.len() as f64
}

/// True if one solid is the image of the other, of the same stuff.
fn is_image_of_solid(one: &CheckedSolid, other: &CheckedSolid, axis: usize) -> bool {
    let stuff = |solid: &CheckedSolid| {
        let keys = solid.stated.shared.clone();
        (keys.per, keys.medium, keys.coating, keys.scatter, keys.surface)
    };
    let shapes = [one, other].map(|solid| solid.form.shape(0.0));
    let [Ok(shape), Ok(of_other)] = &shapes else { return false };
    let Bounds { low, high } = shape.bounds();
    let [low, high] = [low, high].map(|end| image(end, axis));
    let apart = (low.min(high) - of_other.bounds().low).abs().max_element();
    apart <= SAME * shape.bounds().size().max_element()
        && stuff(one) == stuff(other)
        && one.stated_faces == other.stated_faces
        && is_image(shape, of_other, axis)
}

/// True if one source is the image of the other.
fn is_image_of_source(one: &Source, other: &Source, axis: usize) -> bool {
    let is_near = |a: DVec3, b: DVec3| (a - b).length() <= 1e-9 * (1.0 + a.length());
    let [(u, _), (other_u, _)] = [one.axes(), other.axes()];
    let along = image(u, axis).dot(other_u);
    let is_along = along.abs() > 1.0 - 1e-9;
    let emission = match (&one.emission, &other.emission) {
        // The image turns one of both axes round.
        (Emission::Table(table), Emission::Table(of_other)) => {
            let turned: fn(f64) -> f64 = if along > 0.0 { |phi| -phi } else { |phi| 180.0 - phi };
            table == of_other && is_along && is_own_image(table, turned)
        }
        (Emission::Rays(_), _) | (_, Emission::Rays(_)) => false,
        (one, other) => one == other,
    };
    emission
        && one.emitter == other.emitter
        && (one.weight / other.weight - 1.0).abs() < 1e-9
        && is_near(image(one.position, axis), other.position)
        && is_near(image(one.normal, axis), other.normal)
        && (is_along || !matches!(one.emitter, Emitter::Rectangle { .. }))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// One package in a cell of 5 mm between mirrors.
    const CELL: &str = r#"
name = "cell"
mirror = { kind = "lambertian", reflectance = 0.95, extent = "array" }
led = { size_mm = [0.5, 0.4], height_mm = 0.15, reflection = "lambertian", reflectance = 0.9 }
array = { columns = 1, rows = 1, pitch_mm = 5.0 }
housing = { kind = "specular", reflectance = 1.0, height_mm = 8.0, inner_size_mm = [5.0, 5.0] }
receiver = { plane_height_mm = 7.9, bin_mm = 0.5 }
light = { wavelength_nm = 550.0 }
"#;

    fn said(text: &str) -> String {
        let design = design::parse("a.toml", text, Path::new(""));
        let design = design.unwrap_or_else(|error| panic!("{text}: {error}"));
        warning(&design).unwrap_or_default()
    }

    fn film(face: &str) -> String {
        format!(
            "[[films]]\nname = \"film\"\nz_mm = 2.0\nthickness_mm = 0.2\nmedium = {{ index = 1.586 }}\n\
             {face}\n"
        )
    }

    fn solid(keys: &str) -> String {
        format!("[[solids]]\n{keys}\nsurface = {{ kind = \"absorbing\" }}\n")
    }

    #[test]
    fn what_mirrors_turn_into_something_else_is_named_by_its_key() {
        let post = |name: &str, x: f64| {
            solid(&format!(
                "name = \"{name}\"\nkind = \"cylinder\"\nradius_mm = 0.2\nheight_mm = 1.0\n\
                 position_mm = [{x:?}, 0.0, 0.5]"
            ))
        };
        let lamp = |x: f64, normal: &str| {
            format!(
                "[[sources]]\nname = \"s{x}\"\nkind = \"rectangle\"\nposition_mm = [{x:?}, 0.0, 1.0]\n\
                 size_mm = [0.2, 0.1]\nnormal = {normal}\n"
            )
        };
        let up = "[0.0, 0.0, 1.0]";
        let bar = |axis: &str| {
            solid(&format!(
                "name = \"bar\"\nkind = \"cylinder\"\nradius_mm = 0.2\nheight_mm = 1.0\n\
                 position_mm = [0.0, 0.0, 1.5]\naxis = {axis}"
            ))
        };
        let grooves = |profile: &str, direction: f64| {
            film(&format!(
                "bottom = {{ kind = \"grooves\", direction_deg = {direction:?}, profile_um = {profile} }}"
            ))
        };
        let [roof, saw] = ["[[0, 0], [25, 20], [50, 0]]", "[[0, 0], [49, 20], [50, 0]]"];
        let prisms = |degrees: f64| {
            film(&format!("top = {{ kind = \"prisms\", direction_deg = {degrees:?} }}"))
        };
        let chip = |table: &str| {
            format!(
                "[[sources]]\nname = \"chip\"\nkind = \"chip\"\nface_powers = [0, 1, 1, 1, 1]\n\
                 sides = {{ angle_deg = [-60, 0, 60], {table} }}\n"
            )
        };
        let aslant = |turn: f64| {
            format!(
                "[[sources]]\nname = \"oval\"\nkind = \"table\"\nposition_mm = [0.0, 0.0, 1.0]\n\
                 angle_deg = [0, 60]\nintensity = [1, 0]\nacross = [1, 0.5]\n\
                 rotation_deg = [0, 0, {turn:?}]\n"
            )
        };
        for (more, named) in [
            (String::new(), ""),
            (chip("intensity = [0, 1, 0], across = [1, 1, 1]"), ""),
            (chip("intensity = [0, 1, 0], across = [0, 1, 1]"), ""),
            (chip("intensity = [0, 1, 1]"), "sources[1] \"chip\" (no source is its image)"),
            (aslant(0.0), ""),
            (aslant(90.0), ""),
            (aslant(30.0), "sources[1] \"oval\""),
            (prisms(0.0), ""),
            (prisms(90.0), ""),
            (prisms(10.0), "films[1].top.direction_deg = 10 (its image has another direction)"),
            (grooves(roof, 90.0), ""),
            (grooves(roof, 45.0), "films[1].bottom.direction_deg = 45"),
            (grooves(saw, 0.0), "films[1].bottom.profile_um"),
            (post("a", 1.0), "solids[1] \"a\" (no solid is its image)"),
            (post("a", 1.0) + &post("b", -1.0), ""),
            (post("a", 1.0) + &post("b", -1.1), "solids[2] \"b\""),
            (bar("[1.0, 0.0, 0.0]"), ""),
            (bar("[1.0, 1.0, 0.0]"), "solids[1] \"bar\""),
            (lamp(0.0, up), ""),
            (lamp(1.0, up), "sources[1] \"s1\" (no source is its image)"),
            (lamp(1.0, up) + &lamp(-1.0, up), ""),
            (lamp(0.0, "[0.1, 0.0, 1.0]"), "sources[1]"),
            (lamp(1.0, "[0.1, 0.0, 1.0]") + &lamp(-1.0, "[-0.1, 0.0, 1.0]"), ""),
        ] {
            let words = said(&format!("{CELL}{more}"));
            assert_eq!(words.is_empty(), named.is_empty(), "{more} {words}");
            assert!(words.contains(named), "{more} {words}");
            // Walls that scatter stand for no array.
            let scatters = CELL.replace("kind = \"specular\"", "kind = \"lambertian\"");
            assert_eq!(said(&format!("{scatters}{more}")), "", "{more}");
        }
        let led = CELL.replace("height_mm = 0.15", "height_mm = 0.15, offset_mm = [0.1, 0.0]");
        assert!(said(&led).contains("led (off the axis of its package or tilted)"));
        let rows = CELL
            .replace("columns = 1, rows = 1", "columns = 2, rows = 2, arrangement = \"hexagonal\"")
            .replace("[5.0, 5.0]", "[12.0, 12.0]");
        assert!(said(&rows).contains("array.arrangement"));
        let turned = CELL.replace("pitch_mm = 5.0", "pitch_mm = 5.0, turns_deg = [10.0]");
        assert!(said(&turned).contains("array.turns_deg (packages whose image"));
        let of_two = CELL
            .replace("columns = 1", "columns = 2")
            .replace("size_mm = [5.0, 5.0]", "size_mm = [10.0, 5.0]");
        let scaled = |scales: &str| {
            said(&of_two.replace("pitch_mm = 5.0", &format!("pitch_mm = 5.0, scales = {scales}")))
        };
        assert!(
            scaled("[1.0, 1.2]").contains("array.scales (packages whose image has another size)")
        );
        assert_eq!(scaled("[1.2, 1.2]"), "");
    }

    #[test]
    fn carried_light_and_plates_that_end_at_walls_are_named() {
        let carried = CELL.replace("550.0 }", "550.0, polarization = \"carried\" }");
        assert!(said(&format!("{carried}{}", film(""))).contains("films[1] \"film\" (its edges"));
        let narrow = film("size_mm = [4.0, 4.0]");
        assert_eq!(said(&format!("{carried}{narrow}")), "");
        let polariser = |axis: f64| {
            let face = format!(
                "top = {{ kind = \"polariser\", axis_deg = {axis:?}, pass = {{ transmittance = 0.9 }} }}"
            );
            film(&face).replace("1.586", "1.0")
        };
        assert_eq!(said(&format!("{carried}{}", polariser(90.0))), "");
        let turned = said(&format!("{carried}{}", polariser(45.0)));
        assert!(turned.contains("films[1].top.axis_deg = 45"), "{turned}");
    }
}
