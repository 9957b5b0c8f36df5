// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks of a design that need its scene, before anything is solved, traced or written.
//!
//! It refuses solids that cut each other, rays of a file that start in the wrong place, and
//! receivers that name no surface or cut one. Messages use the words of the design file. The scene
//! of rays on the relief has the surfaces of all models and needs no table.

use std::path::Path;

use anyhow::{Result, ensure};
use tracer::Error;

use design::resolved::array::{Array, PackagePositions};
use design::resolved::receivers::CheckedReceiver;
use design::resolved::solids::CheckedSolid;
use design::schema::receivers::Normal;
use design::schema::solids::{Per, SolidForm};
use design::{ConfigError, Design};
use geometry::Cell;
use metrics::digits::shortest;

use super::cells::band_cells;
use super::dome_surface::dome_surface;
use super::model::Model;
use super::observation::bins;
use super::scene::{self, DomeSurface};
use super::solids::refused;
use super::trace::{GROUPS, plane};

/// Radius of a dome, in widths of the package, beyond which rounding may spoil its sphere.
const FLATTEST: f64 = 500.0;
/// Name of the walls of the housing, as in the ledger.
const WALL: &str = "wall";
/// Rounding of places, mm.
const ROUNDING_MM: f64 = 1e-9;
/// Memory of a run beside its bins, bytes.
const BESIDES: usize = 32 << 20;

/// Reads the design file at `path` and checks it, its scene as well.
///
/// # Errors
/// Errors of [`design::load`] and [`check`].
pub fn load(path: &Path) -> Result<Design> {
    let design = design::load(path)?;
    check(&design)?;
    Ok(design)
}

/// Checks the text of a design, its scene as well. `file` names it in messages and results; files
/// that it names lie in `folder`.
///
/// # Errors
/// Errors of [`design::parse`] and [`check`].
pub fn parse(file: &str, text: &str, folder: &Path) -> Result<Design> {
    let design = design::parse(file, text, folder)?;
    check(&design)?;
    Ok(design)
}

/// Refuses designs whose scene cannot be built, and receivers that name no surface of it or cut a
/// package or wall.
///
/// # Errors
/// File, key, what was found and what was expected.
pub fn check(design: &Design) -> Result<()> {
    has_room(design)?;
    cell_holds(design)?;
    stands_within(design)?;
    let surface = dome_surface(design, Model::Geometric, None)?;
    let scene = scene::build(design, &surface).map_err(|error| match error.downcast_ref() {
        Some(wrong) => unbuilt(design, wrong).into(),
        None => error,
    })?;
    scene::check_gaps(design, &surface)?;
    scatters_at_all_wavelengths(design, &surface)?;
    tables_fit(design)?;
    if let Err(error) = scene.admits(&plane(design)?) {
        let scaled = scaled(design);
        let expected = format!("a plane above the packages that cuts no solid: {error}{scaled}");
        let got = design.receiver.plane_height_mm.to_string();
        return Err(refused(design, "receiver.plane_height_mm", got, expected).into());
    }
    for (number, receiver) in design.receivers.iter().enumerate() {
        if let Err(error) = scene.admits(&receiver.detector) {
            return Err(refusal(design, number, receiver, error).into());
        }
    }
    Ok(())
}

/// Refuses a cell that repeats and is lower than films and receivers, above which light no longer goes
/// round, and packages that would not see those of the next cell.
fn cell_holds(design: &Design) -> Result<()> {
    let Some(housing) = design.housing.as_ref().filter(|_| design.is_periodic()) else {
        return Ok(());
    };
    if !design.array.crossing {
        let expected = "true in a cell that repeats: its packages see those of the next cell";
        return Err(refused(design, "array.crossing", "false", expected).into());
    }
    let films = design.solids.iter().filter_map(|film| {
        let ([_, top_mm], _) = film.film_mm()?;
        Some((format!("the top of film {:?}", film.name()), top_mm))
    });
    let plane = ("receiver.plane_height_mm".to_owned(), design.receiver.plane_height_mm);
    let receivers = design.receivers.iter().filter_map(|receiver| {
        let z_mm = receiver.stated.kind.rectangle()?.position_mm[2];
        Some((format!("receiver {:?}", receiver.name()), z_mm))
    });
    let above = films.chain([plane]).chain(receivers).find(|(_, z)| *z > housing.height_mm);
    above.map_or(Ok(()), |(what, z_mm)| {
        let expected =
            format!("at least {} mm, {what}: above it no light goes round", shortest(z_mm));
        let got = shortest(housing.height_mm);
        Err(refused(design, "housing.height_mm", got, expected).into())
    })
}

/// Refuses packages that stand beyond the walls, sources below their edge, and solids and receivers beyond
/// the borders of a cell that repeats, where no light is.
fn stands_within(design: &Design) -> Result<()> {
    let (Some(housing), Some(half_mm)) = (&design.housing, design.housing_half_mm()) else {
        return Ok(());
    };
    let axes = design.array.axes_mm();
    // Half lengths of what reaches around its place; in every package, or once.
    let beyond = |[x, y]: [f64; 2], reach_mm: [f64; 2], per: Per| {
        let axes = if per == Per::Package { &axes[..] } else { &[[0.0; 2]] };
        let mut places = axes.iter().map(|axis| [axis[0] + x, axis[1] + y]);
        places.find(|place| (0..2).any(|k| place[k].abs() - reach_mm[k] > half_mm[k] + ROUNDING_MM))
    };
    let mut outside =
        beyond([0.0; 2], [0.0; 2], Per::Package).map(|at| ("a package".to_owned(), at));
    let is_turned = design.array.is_turned() || design.array.is_scaled();
    for source in design.sources.iter().filter(|_| !is_turned) {
        let place = source.stated.kind.place().map(|(place, _)| place);
        let walled = place.filter(|[.., z]| design.is_periodic() || *z < housing.height_mm);
        let at = walled.and_then(|[x, y, _]| beyond([x, y], [0.0; 2], Per::Package));
        outside = outside.or_else(|| at.map(|at| (format!("source {:?}", source.name()), at)));
    }
    if design.is_periodic() {
        // A mesh may lie anywhere about its origin.
        let is_mesh = |solid: &&CheckedSolid| matches!(solid.stated.kind, SolidForm::Mesh(_));
        for solid in design.solids.iter().filter(|solid| !is_mesh(solid)) {
            let [x, y, _] = solid.stated.shared.position_mm.0;
            let at = beyond([x, y], [0.0; 2], solid.per());
            outside = outside.or_else(|| at.map(|at| (format!("solid {:?}", solid.name()), at)));
        }
        for receiver in &design.receivers {
            let level = receiver.stated.kind.rectangle();
            let level = level.filter(|of| matches!(of.normal, Normal::Up | Normal::Down));
            let at = level.and_then(|stated| {
                let [x, y, _] = stated.position_mm;
                beyond([x, y], stated.size_mm.map(|length| 0.5 * length), Per::Array)
            });
            outside =
                outside.or_else(|| at.map(|at| (format!("receiver {:?}", receiver.name()), at)));
        }
    }
    outside.map_or(Ok(()), |(what, at)| {
        let (key, got) = housing_key(design);
        let [x, y] = at.map(shortest);
        let around = if design.is_periodic() { "a cell" } else { "walls" };
        let expected = format!("{around} around all that it holds, {what} at ({x}, {y}) mm too");
        Err(refused(design, key, got, expected).into())
    })
}

/// Refuses bins for which the system has no memory, before it allocates them group by group.
fn has_room(design: &Design) -> Result<()> {
    let bins = bins(design);
    let bytes = size_of::<f64>() * bins * (GROUPS + 1) + BESIDES;
    ensure!(
        Vec::<u8>::new().try_reserve_exact(bytes).is_ok(),
        "{}: {bins} bins of the map, the far field and [[receivers]]: expected {:.2} GiB of memory for them, which the system does not give; larger bins take less",
        design.provenance.file,
        bytes as f64 / f64::from(1 << 30)
    );
    Ok(())
}

/// Refuses solids whose scattering tables hold for one pair of indices, if the indices differ at
/// the ends or the median of a light.
fn scatters_at_all_wavelengths(design: &Design, surface: &DomeSurface) -> Result<()> {
    let (Some(lights), true) =
        (design.all_lights(), design.solids.iter().any(CheckedSolid::scatters))
    else {
        return Ok(());
    };
    for light in &lights.lights {
        let [first, last] = light.light.range_nm();
        for nm in [first, light.light.median_nm(), last] {
            scene::build(&design.at(nm)?, surface)?;
        }
    }
    Ok(())
}

/// Checks the tables of domes within a solid: they can be solved, and no file gives one, which
/// would be for air.
fn tables_fit(design: &Design) -> Result<()> {
    let around = scene::index_about_domes(design)?;
    if around.to_bits() == 1.0f64.to_bits() {
        return Ok(());
    }
    let cells = band_cells(design);
    if (0..cells.len()).any(|band| design.files.covers(band)) {
        let expected = format!(
            "no such table for domes in a medium of index {around}: those of files are for air around the dome"
        );
        return Err(refused(design, "files.bands", "given", expected).into());
    }
    let cells: Vec<Cell> = cells.into_iter().flatten().collect();
    Ok(design::resolve::tables::fit(design, &cells)?)
}

/// The key and the position of the last solid with one of these names.
fn solid<'a>(
    design: &Design,
    names: impl IntoIterator<Item = &'a str>,
) -> Option<(String, String)> {
    let numbers = names.into_iter().filter_map(|name| {
        let mut solids = design.solids.iter();
        solids.position(|solid| solid.name() == name)
    });
    Some(design.solids[numbers.max()?].place())
}

/// The widest solid of the packages, where it reaches beyond half the distance to the next package.
fn too_wide(design: &Design, error: &Error) -> Option<ConfigError> {
    let &Error::Overlap { distance_mm, .. } = error else {
        return None;
    };
    let of_package = |solid: &&CheckedSolid| solid.per() == Per::Package;
    let reached = design.solids.iter().filter(of_package).filter_map(|solid| {
        let around = solid.form.shape(0.0).ok()?.bounds();
        let span = around.size();
        let reach = around.low.abs().max(around.high.abs());
        Some((solid, reach.x.max(reach.y), [span.x, span.y, span.z]))
    });
    let (widest, reach_mm, size) = reached.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let [_, scale] = design.array.scale_range();
    let (reach_mm, size) = (scale * reach_mm, size.map(|length| scale * length));
    if 2.0 * reach_mm <= distance_mm {
        return None;
    }
    let (key, got) = widest.size();
    let [x, y, z] = size.map(shortest);
    let expected = format!(
        "a solid in each package that does not overlap those of its neighbours: {:?} measures {x} x {y} x {z} mm and reaches {} mm from the axis, the next package stands at {} mm ({})",
        widest.name(),
        shortest(reach_mm),
        shortest(distance_mm),
        design.array.distance_key(),
    );
    Some(refused(design, key, got, expected))
}

/// The key that says where the walls stand, and its value.
fn housing_key(design: &Design) -> (&'static str, String) {
    let housing = design.housing.as_ref();
    if let Some(size) = housing.and_then(|housing| housing.inner_size_mm) {
        return ("housing.inner_size_mm", format!("{size:?}"));
    }
    let distance_mm = housing.and_then(|housing| housing.distance_mm);
    ("housing.distance_mm", distance_mm.map_or(String::new(), |mm| mm.to_string()))
}

/// Ways out of an overlap of two surfaces by `depth_mm` along an axis, in words.
fn ways_out(design: &Design, [first, second]: [&str; 2], (depth_mm, axis): (f64, &str)) -> String {
    // Rounded up, so that bodies moved by it do not overlap.
    let depth = shortest((1e5 * depth_mm - 1e-6).ceil() / 1e5);
    let move_by = format!("by {depth} mm along {axis} or shrink it");
    let names = [first, second];
    if let (Some(half), true) = (design.housing_half_mm(), names.contains(&WALL)) {
        let other = if first == WALL { second } else { first };
        let solid = design.solids.iter().find(|solid| solid.name() == other);
        let around = solid.and_then(|solid| Some(solid.form.shape(0.0).ok()?.bounds()));
        let inner = half.map(|half| shortest(2.0 * half));
        let needed = around.map_or(String::new(), |around| {
            let reach = around.low.abs().max(around.high.abs());
            let (axes, scale) = if solid.is_some_and(|solid| solid.per() == Per::Package) {
                (design.half_extent_mm(), design.array.scale_range()[1])
            } else {
                ([0.0; 2], 1.0)
            };
            let more = (0..2).map(|k| axes[k] + scale * reach[k] - half[k]).fold(0.0, f64::max);
            format!(" by more than {} mm", shortest(more))
        });
        return format!(
            "keep {other:?} within the walls, which stand {} x {} mm apart, or set them farther out ({}){needed}",
            inner[0],
            inner[1],
            housing_key(design).0,
        );
    }
    let is_solid = |name: &str| design.solids.iter().any(|solid| solid.name() == name);
    let is_film =
        |name: &str| design.solids.iter().any(|solid| solid.is_film() && solid.name() == name);
    if let Some(film) = names.into_iter().find(|name| is_film(name)) {
        let other = if film == first { second } else { first };
        return format!("move {film:?} by {depth} mm along {axis}, or {other:?}");
    }
    if names.into_iter().all(is_solid) {
        return format!(
            "move {first:?} {move_by}, or {second:?}; or name one under optical_contact of the other, which it displaces"
        );
    }
    let [solid, other] = if is_solid(first) { [first, second] } else { [second, first] };
    let other = if other.starts_with("box ") { "the LED's box" } else { other };
    format!("move {solid:?} {move_by}, or change {other}")
}

/// The keys by which packages have other sizes, in words; empty where they have none.
fn scaled(design: &Design) -> &'static str {
    match (design.array.is_scaled(), design.array.has_own_scales()) {
        (false, _) => "",
        (true, true) => "; array.scales change the sizes of packages",
        (true, false) => "; array.positions_file changes the sizes of packages",
    }
}

/// True of a design whose scene can be built.
fn builds(design: &Design) -> bool {
    dome_surface(design, Model::Geometric, None)
        .is_ok_and(|surface| scene::build(design, &surface).is_ok())
}

/// The key and the position of the solid of the array without which the scene can be built: of one that
/// is opaque the crossing names the package alone.
fn hidden(design: &Design) -> Option<(String, String)> {
    let opaque = design.solids.iter().filter(|solid| solid.medium.is_none());
    let mut of_array = opaque.filter(|solid| solid.per() == Per::Array);
    let is_cause = |solid: &&CheckedSolid| {
        let mut without = design.clone();
        without.solids.retain(|other| other.name() != solid.name());
        builds(&without)
    };
    of_array.find(is_cause).map(CheckedSolid::place)
}

/// A list of packages: whether it is stated, its key and what it makes of packages, and how it is left out.
type PackageList = (bool, (&'static str, &'static str), fn(&mut Array));

/// The error of packages that fit without one of the lists by which each is scaled, turned and moved, or
/// without all of them.
fn moved(design: &Design, error: &Error) -> Option<ConfigError> {
    let (Error::Overlap { .. }
    | Error::IntoWall { .. }
    | Error::Crossing { .. }
    | Error::Straddles { .. }) = error
    else {
        return None;
    };
    let array = &design.array;
    let lists: [PackageList; 3] = [
        (array.has_own_scales(), ("array.scales", "packages of other sizes"), |array| {
            array.scales.clear();
        }),
        (array.has_own_turns(), ("array.turns_deg", "turned packages"), |array| {
            array.turns_deg.clear();
        }),
        (array.is_offset(), ("array.offsets_mm", "packages off their places"), |array| {
            array.offsets_mm.clear();
        }),
    ];
    let stated: Vec<_> = lists.into_iter().filter(|(is_stated, ..)| *is_stated).collect();
    let builds_without = |lists: &[PackageList]| {
        let mut still = design.clone();
        for (_, _, clear) in lists {
            clear(&mut still.array);
        }
        !lists.is_empty() && builds(&still)
    };
    let (key, got) = match stated.chunks(1).find(|one| builds_without(one)) {
        Some([(_, (key, got), _)]) => ((*key).to_owned(), (*got).to_owned()),
        _ if stated.len() > 1 && builds_without(&stated) => {
            let words = stated.iter().map(|(_, words, _)| *words);
            let (keys, found): (Vec<_>, Vec<_>) = words.unzip();
            (keys.join(" and "), found.join(" and "))
        }
        _ => return None,
    };
    let expected = format!("packages that clear each other, walls and solids: {error}");
    Some(refused(design, key, got, expected))
}

/// The error of a solid that overlaps something else.
fn misfit(design: &Design, error: &Error) -> Option<ConfigError> {
    if let Some(wide) = too_wide(design, error) {
        return Some(wide);
    }
    let (key, got) = match error {
        Error::Crossing { first, second, .. } => {
            solid(design, [&**first, second]).or_else(|| hidden(design))
        }
        Error::Straddles { regions, .. } => solid(design, regions.iter().map(String::as_str)),
        Error::Overlap { .. } | Error::BelowGround { .. } | Error::IntoWall { .. } => {
            // The package without solids was checked with its own keys.
            let of_package = |s: &&CheckedSolid| s.per() == Per::Package;
            let widest = design.solids.iter().filter(of_package).max_by(|a, b| {
                let reach =
                    |s: &CheckedSolid| s.form.shape(0.0).ok().and_then(|shape| shape.radius());
                reach(a).unwrap_or(0.0).total_cmp(&reach(b).unwrap_or(0.0))
            })?;
            solid(design, [widest.name()])
        }
        Error::SheetInFace { sheet, .. } => solid(design, [&**sheet]),
        _ => None,
    }?;
    let ways = match error {
        Error::SheetInFace { .. } => {
            "; move it by 0.001 mm towards the side from which it is seen".to_owned()
        }
        Error::Crossing { first, second, depth_mm: Some(depth_mm), .. } => {
            format!("; {}", ways_out(design, [first, second], *depth_mm))
        }
        _ => String::new(),
    };
    let expected = format!("a place where the solid cuts nothing: {error}{ways}");
    Some(refused(design, key, got, expected))
}

/// The error of a scene that cannot be built, by the key most likely to be wrong.
fn unbuilt(design: &Design, error: &Error) -> ConfigError {
    let led = &design.led;
    let sphere_mm = design.sphere().map_or(0.0, |s| s.sphere_radius_mm);
    let misplaced = misplaced(design, error).or_else(|| moved(design, error));
    if let Some(refused) = misplaced.or_else(|| misfit(design, error)) {
        return refused;
    }
    let (key, got) = match error {
        _ if sphere_mm > FLATTEST * design.package_width_mm() => {
            ("dome.sphere_radius_mm", sphere_mm.to_string())
        }
        Error::Crossing { first, second, .. } => {
            let is_box = |name: &String| name.starts_with("box ");
            if is_box(first) || is_box(second) {
                if !led.is_centred() {
                    return off_axis(design, error);
                }
                let [x, y] = led.size_mm;
                ("led.size_mm", format!("[{x}, {y}] and {} mm high", led.height_mm))
            } else {
                ("dome", "solids that cut each other".to_owned())
            }
        }
        Error::RayOutside { .. } => {
            let file = design.files.source_file().unwrap_or_default();
            ("files.source.file", format!("{file:?}"))
        }
        Error::Overlap { .. } if design.dome.is_none() && !led.is_centred() => {
            return off_axis(design, error);
        }
        Error::Overlap { .. } => (
            design.array.distance_key(),
            match design.array.positions {
                PackagePositions::Grid { .. } if !design.array.is_offset() => {
                    design.array.pitch_mm.to_string()
                }
                _ => "packages that overlap".to_owned(),
            },
        ),
        Error::IntoWall { .. } => {
            let (key, got) = housing_key(design);
            let expected = format!("walls that stand outside of all packages: {error}");
            return refused(design, key, got, expected);
        }
        Error::SourceOutside { .. } | Error::SourceInSurface { .. } | Error::OpenBody { .. } => {
            ("led.height_mm", led.height_mm.to_string())
        }
        other => {
            return ConfigError::Files {
                file: design.provenance.file.clone(),
                message: other.to_string(),
            };
        }
    };
    refused(design, key, got, format!("a package that can be built: {error}"))
}

/// The error of a box that does not fit where it was moved to.
fn off_axis(design: &Design, error: &Error) -> ConfigError {
    let led = &design.led;
    let (key, got) = if !led.tilts_deg.is_empty() {
        let rows = format!("{} rows, beside tilt_deg = {:?}", led.tilts_deg.len(), led.tilt_deg);
        ("led.tilts_deg", rows)
    } else if !led.offsets_mm.is_empty() {
        let rows = format!("{} rows, beside offset_mm = {:?}", led.offsets_mm.len(), led.offset_mm);
        ("led.offsets_mm", rows)
    } else if led.place(0).is_on_axis() {
        ("led.tilt_deg", format!("{:?}", led.tilt_deg))
    } else {
        ("led.offset_mm", format!("{:?}", led.offset_mm))
    };
    refused(design, key, got, format!("a package that can be built: {error}"))
}

/// The error of a source outside the medium it names.
fn misplaced(design: &Design, error: &Error) -> Option<ConfigError> {
    let (Error::SourceOutside { source_name, .. }
    | Error::SourceInSurface { source_name, .. }
    | Error::OpenBody { source_name, .. }
    | Error::RayOutside { source_name, .. }) = error
    else {
        return None;
    };
    let mut sources = design.sources.iter();
    let number = sources.position(|source| source.name() == source_name)?;
    let stated = &design.sources[number].stated;
    let key = format!("sources[{}].position_mm", number + 1);
    let (place, inside) = stated.kind.place().unwrap_or_default();
    // It stands in the silicone of a dome unless it says otherwise.
    let inside = match (inside, &design.dome) {
        (None, Some(_)) => "; `inside` states another medium around it than silicone",
        _ => "",
    };
    let expected = format!("a place where the source may stand: {error}{inside}");
    Some(refused(design, key, format!("{place:?}"), expected))
}

/// The error of a receiver, by its key in the design.
fn refusal(
    design: &Design,
    number: usize,
    receiver: &CheckedReceiver,
    error: Error,
) -> ConfigError {
    let stated = &receiver.stated;
    let last = stated.shared.only.as_ref().and_then(|o| o.last_surface.as_ref());
    let place = || {
        let rectangle = stated.kind.rectangle().unwrap_or_default();
        format!("{:?}", rectangle.position_mm)
    };
    let off = |apart_mm: f64, what: &str, place: &str| {
        format!(
            "a rectangle more than {apart_mm:.1e} mm off all {what}, not one in {place}, where rounding would decide what {:?} counts",
            receiver.name()
        )
    };
    let (key, got, expected) = match error {
        Error::NoSurface { surface, known, .. } => {
            let key = if last == Some(&surface) { "only.last_surface" } else { "surface" };
            let expected = format!("one of the surfaces of the scene: {known}");
            (key, format!("{surface:?}"), expected)
        }
        Error::ReceiverCuts { low_mm, high_mm, .. } => (
            "position_mm",
            place(),
            format!(
                "a rectangle that cuts nothing, not one through what stands from {low_mm:?} to {high_mm:?} mm{}",
                scaled(design)
            ),
        ),
        Error::ReceiverInFace { surface, apart_mm, .. } => {
            let plane = format!("the plane of {surface:?}");
            ("position_mm", place(), off(apart_mm, "faces that it overlaps", &plane))
        }
        Error::ReceiverInSource { source_name, apart_mm, .. } => {
            let emits = format!("which source {source_name:?} does");
            ("position_mm", place(), off(apart_mm, "that emits", &emits))
        }
        other => ("name", format!("{:?}", receiver.name()), other.to_string()),
    };
    refused(design, format!("receivers[{}].{key}", number + 1), got, expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: &str =
        "kind = \"plane\"\nposition_mm = [0.0, 0.0, 3.0]\nsize_mm = [20.0, 10.0]\nbins = [4, 2]";

    fn said(of: &str, receivers: &str) -> String {
        let (_, text) = design::EMBEDDED.iter().find(|(name, _)| *name == of).expect("a design");
        let text = format!("{text}\n{receivers}\n");
        let design = design::parse("a.toml", &text, Path::new("")).expect("valid by itself");
        check(&design).map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn unknown_names_are_refused_with_those_that_exist() {
        let flux = |name: &str| {
            format!("[[receivers]]\nname = \"a\"\nkind = \"surface\"\nsurface = {name:?}")
        };
        for known in [
            "dome",
            "side",
            "bottom",
            "box top",
            "box_top",
            "box side",
            "box_side",
            "ground mirror",
            "ground_mirror",
            "floor",
        ] {
            assert_eq!(said("d1.toml", &flux(known)), "", "{known}");
        }
        assert_eq!(
            said("d1.toml", &flux("domes")),
            "a.toml: receivers[1].surface = \"domes\": expected one of the surfaces of the scene: \
             side, bottom, box_side, box_top, dome, ground_mirror, floor"
        );
        let last =
            format!("[[receivers]]\nname = \"a\"\n{PLANE}\nonly = {{ last_surface = \"Dome\" }}");
        let two = format!("{}\n{}", flux("dome"), last.replace("\"a\"", "\"b\""));
        let refused = said("d1.toml", &two);
        let begins =
            "a.toml: receivers[2].only.last_surface = \"Dome\": expected one of the surfaces";
        assert!(refused.starts_with(begins), "{refused}");
        // Walls exist where there is a housing.
        let walled = format!(
            "{}\n[housing]\ndistance_mm = 5.0\nheight_mm = 2.0\nkind = \"specular\"\nreflectance = 0.9",
            flux("wall")
        );
        assert_eq!(said("d1.toml", &walled), "");
        assert!(said("d1.toml", &flux("wall")).contains("receivers[1].surface = \"wall\""));
    }

    #[test]
    fn rectangles_through_packages_are_refused_by_their_place() {
        let at = |z: &str| format!("[[receivers]]\nname = \"a\"\n{}", PLANE.replace("3.0]", z));
        assert_eq!(said("d1.toml", &at("3.0]")), "");
        let refused = said("d1.toml", &at("0.5]"));
        let begins = "a.toml: receivers[1].position_mm = [0.0, 0.0, 0.5]: expected a rectangle that cuts nothing";
        assert!(refused.starts_with(begins), "{refused}");
    }
}
