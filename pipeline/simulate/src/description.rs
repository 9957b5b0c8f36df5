// SPDX-License-Identifier: MIT OR Apache-2.0
//! A design in words, for people: what `check` prints and what the page says was simulated.

use design::Design;
use design::resolved::EmittedFlux;
use design::resolved::array::PackagePositions;
use design::resolved::dome::Dome;
use design::resolved::films::Coats;
use design::resolved::led::{BoxPlace, Led};
use design::resolved::luminescence::MediumLuminophore;
use design::resolved::medium::Medium;
use design::resolved::prints::CheckedPrint;
use design::resolved::receivers::CheckedReceiver;
use design::resolved::reflector::Reflector;
use design::resolved::scattering::MediumScattering;
use design::resolved::solids::CheckedSolid;
use design::schema::Arrangement;
use design::schema::prints::Print;
use design::schema::receivers::ReceiverForm;
use design::schema::solids::{Per, Prisms, Relief, ReliefCells, ScatterLaw, SolidForm};
use design::spectrum::Sampling;
use design::spectrum::lights::Light;
use metrics::digits::shortest;
use metrics::illuminance::Symmetry;
use metrics::layout::{Area, Layout};
use metrics::plural::count;
use metrics::uniformity_forms::{PHASES, cell, sees_one_phase};
use results::package::MAP;

use super::cells::band_cells;
use super::film_table::treatment;
use super::model::copies_um;
use super::observation::layout;
use super::symmetry::{broken_by, of_maps};

/// Names and words, from the dome to the receiver plane.
pub fn description(design: &Design) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    let mut line = |key: &'static str, value: String| lines.push((key, value));
    line("dome", dome(design));
    if design.has_relief() {
        line(
            "elements",
            format!(
                "{} of {} µm",
                design.elements.shapes.len(),
                shortest(design.elements.width_mm * 1e3)
            ),
        );
        let cells: Vec<_> = band_cells(design).into_iter().flatten().collect();
        if !cells.is_empty() && !design.is_coated() {
            line("rings", rings(design));
        }
        let range = |f: fn(&geometry::Cell) -> f64| {
            let (low, high) =
                cells.iter().map(f).fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
            format!("{low:.2} to {high:.2} µm")
        };
        if !cells.is_empty() {
            let tables = count(cells.len(), "table");
            let [periods, heights] = [range(|c| c.period_um), range(|c| c.depth_um)];
            line("cells", format!("{tables}, periods {periods}, heights {heights}"));
        }
    }
    if let Some(words) = spectrum(design) {
        line("spectrum", words);
    }
    if design.converts() {
        line("converted", converted(design));
    }
    line("array", array(design));
    if let Some(words) = neighbours(design) {
        line("neighbours", words);
    }
    let l = &design.led;
    line(
        "LED",
        format!(
            "{} x {} x {} mm, {}{}{}",
            shortest(l.size_mm[0]),
            shortest(l.size_mm[1]),
            shortest(l.height_mm),
            reflecting(l.reflector, design.films.as_ref().map(|films| &films.led_top)),
            sides(design),
            moved(l)
        ),
    );
    if let Some(flux) = design.emitted {
        line("emits", emitted(&flux));
    }
    for (key, words) in sources(design) {
        line(key, words);
    }
    for solid in &design.solids {
        line(if solid.is_film() { "film" } else { "solid" }, self::solid(solid));
    }
    let m = &design.mirror;
    line(
        "mirror",
        match design.files.mirror() {
            Some(_) => "by a file".to_owned(),
            None => reflecting(m.reflector, design.films.as_ref().map(|films| &films.mirror)),
        },
    );
    for print in &design.prints {
        line(if print.is_density() { "density" } else { "ink" }, pattern(print));
    }
    let around = [("film stack", treatment(design).describe()), ("housing", housing(design))];
    for (key, words) in around.into_iter().filter_map(|(key, words)| Some((key, words?))) {
        line(key, words);
    }
    if let Some(part) = broken_by(design) {
        line(
            "symmetry",
            format!("none ({part}): far fields in four half-planes, maps not averaged over images"),
        );
    }
    if let Some(words) = points(design) {
        line("nine and thirteen points", words);
    }
    let plane = &design.receiver;
    line(
        "plane",
        format!(
            "{} mm above the bottom, bins of {} mm",
            shortest(plane.plane_height_mm),
            shortest(plane.read_bin_mm.unwrap_or(plane.bin_mm))
        ),
    );
    line(MAP, map(design));
    for receiver in &design.receivers {
        line("receiver", self::receiver(receiver));
    }
    lines
}

/// Watts and lumens that each package emits, and the electrical watts that it takes, where stated.
fn emitted(flux: &EmittedFlux) -> String {
    let [w, lm] = [flux.radiant_w, flux.luminous_lm].map(shortest);
    let input =
        flux.electrical_w.map_or_else(String::new, |w| format!(" of {} W electrical", shortest(w)));
    format!("{w} W, {lm} lm{input}, each package")
}

/// What the map of the plane is made of, in words.
fn map(design: &Design) -> String {
    let averaged = match of_maps(design) {
        Symmetry::Square => "averaged over its mirror images in x, y and x = y",
        Symmetry::Rectangle => "averaged over its mirror images in x and y",
        Symmetry::None => "not averaged over images",
    };
    match design.receiver.smoothing_sigma_mm {
        0.0 => format!("{averaged}, not smoothed"),
        sigma => format!("{averaged}, smoothed with a deviation of {} mm", shortest(sigma)),
    }
}

/// A receiver in words.
fn receiver(receiver: &CheckedReceiver) -> String {
    let kind = match &receiver.stated.kind {
        ReceiverForm::Plane(_) => "illuminance".to_owned(),
        ReceiverForm::Luminance(of) => {
            let view = of.view_deg.map_or("the normal".to_owned(), |view| {
                let [theta, phi] = view.0.map(shortest);
                format!("{theta}° to the normal, azimuth {phi}°")
            });
            match of.theta_max_deg {
                Some(end) => format!("luminance within {}° of {view}", shortest(end)),
                None => "luminance".to_owned(),
            }
        }
        ReceiverForm::FarField(_) => "far field".to_owned(),
        ReceiverForm::CGamma(_) => "far field on C-γ planes".to_owned(),
        ReceiverForm::Surface(of) => format!("flux on {}", of.surface),
    };
    let place = receiver.stated.kind.rectangle().map_or(String::new(), |rectangle| {
        let [x, y, z] = rectangle.position_mm.map(shortest);
        let [width, depth] = rectangle.size_mm.map(shortest);
        let [columns, rows] = rectangle.bins;
        format!(", {width} x {depth} mm about ({x}, {y}, {z}) mm, {columns} x {rows} bins")
    });
    let part =
        if receiver.stated.shared.only.is_some() { ", part of the light (only)" } else { "" };
    format!("{}: {kind}{place}{part}", receiver.name())
}

/// Where nine and thirteen points are read, in words.
fn points(design: &Design) -> Option<String> {
    let (layout, receiver) = (layout(design), &design.receiver);
    let is_rectangle = |[low, high]: &Area| (0..2).all(|k| high[k] > low[k]);
    let cell = cell(&layout).filter(is_rectangle);
    let cell = cell.map(|corners| ("the cell between LED axes".to_owned(), corners));
    let area = receiver.area_corners_mm().map(|[low, high]| {
        let [x, y] = [0, 1].map(|k| shortest(high[k] - low[k]));
        (format!("the area of {x} x {y} mm"), [low, high])
    });
    let one = |(words, corners): (String, Area)| {
        if !sees_one_phase(&layout, corners) {
            return format!("of {words}");
        }
        format!("of {words}, at one place of the pitch, so each is read at {PHASES} places of it")
    };
    let words: Vec<String> = cell.into_iter().chain(area).map(one).collect();
    let spots = match receiver.spot_mm {
        Some(spot_mm) => format!("spots of {} mm", shortest(spot_mm)),
        None => "read from the map".to_owned(),
    };
    (!words.is_empty()).then(|| format!("{spots}, {}", words.join("; ")))
}

/// Place and law of the walls, in words.
fn housing(design: &Design) -> Option<String> {
    let (housing, half) = (design.housing.as_ref()?, design.housing_half_mm()?);
    let [x, y] = half.map(|half| shortest(2.0 * half));
    let from = housing.distance_mm.map_or(String::new(), |mm| {
        let bodies = [0, 1].map(|axis| design.outermost(axis).1);
        let body = if bodies[0] == bodies[1] { bodies[0] } else { "the outermost bodies" };
        format!(", {} mm from {body} of the outermost packages", shortest(mm))
    });
    if housing.reflector == Reflector::Periodic {
        let height = shortest(housing.height_mm);
        return Some(format!(
            "no walls: a cell of {x} x {y} mm{from} that repeats without end, up to {height} mm"
        ));
    }
    Some(format!(
        "{x} x {y} mm between the walls{from}; {} mm high, {} mm thick, reflectance {}",
        shortest(housing.height_mm),
        shortest(housing.thickness_mm),
        reflects(housing.reflector)
    ))
}

/// Rings that the hybrid solves, in words.
fn rings(design: &Design) -> String {
    let elements = shortest(design.elements.width_mm * 1e3);
    match copies_um(design) {
        None => format!("solved as designed, {elements} µm wide"),
        Some(um) => format!(
            "solved as copies of {} µm (hybrid.element_width_um) in place of those of {elements} µm",
            shortest(um)
        ),
    }
}

/// Place of the box, in words; empty for a level one about the axis.
fn moved(led: &Led) -> String {
    let pair = |[x, y]: [f64; 2]| format!("({}, {})", shortest(x), shortest(y));
    let place = BoxPlace { offset_mm: led.offset_mm, tilt_deg: led.tilt_deg };
    let mut words = Vec::new();
    if !place.is_on_axis() {
        words.push(format!(", {} mm off the axis", pair(place.offset_mm)));
    }
    if !place.is_level() {
        words.push(format!(", tilted by {}° about x and y", pair(place.tilt_deg)));
    }
    let own = [("offset", &led.offsets_mm), ("tilt", &led.tilts_deg)];
    let is_own = |rows: &[[f64; 2]]| rows.iter().flatten().any(|part| *part != 0.0);
    for (name, _) in own.iter().filter(|(_, rows)| is_own(rows)) {
        words.push(format!(", and its own {name} in each package"));
    }
    words.concat()
}

/// Sources, their lights and channels, and the panel.
fn sources(design: &Design) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    if !design.sources.is_empty() {
        let names = design.sources.iter().map(|s| s.name().to_owned());
        lines.push(("sources", names.collect::<Vec<_>>().join(", ")));
        lines.extend(lights(design).into_iter().map(|light| ("light", light)));
    }
    if design.channels().len() > 1 {
        lines.push(("channels", design.channels().join(", ")));
    }
    let has_colours = design.channels().len() > 1 || !design.sub_pixels().is_empty();
    let mut all = design.colours().into_iter().flat_map(|lights| lights.lights);
    let by_tolerance =
        |light: Light| matches!(light.light.sampling(), Some(Sampling::Tolerance(_)));
    if has_colours && all.any(by_tolerance) {
        let words =
            "three wavelengths of each light with a `tolerance`, whose error is not estimated";
        lines.push(("zones", words.to_owned()));
    }
    if let Some(panel) = &design.panel {
        let filters = count(panel.sub_pixels.len(), "sub-pixel");
        lines.push(("panel", format!("contrast {}, {filters}", shortest(panel.contrast))));
    }
    lines
}

/// A line for each light, where sources have spectra of their own.
fn lights(design: &Design) -> Vec<String> {
    let lights = design.colours().into_iter().flat_map(|lights| lights.lights);
    let one = |light: Light| {
        let (names, share) = (light.sources.join(", "), 100.0 * light.emitted_w);
        format!("{names}: {share:.1} % of the power: {}", light.light.describe())
    };
    lights.map(one).collect()
}

/// The array in words.
fn array(design: &Design) -> String {
    let array = &design.array;
    let places = match &array.positions {
        PackagePositions::List { positions_mm, turns_deg, file } => {
            let packages = count(positions_mm.len(), "package");
            let [x, y] = extent(&layout(design)).map(shortest);
            let turns = if turns_deg.is_empty() { "" } else { ", turns" };
            let sizes = if array.stated_scales.is_empty() { "" } else { ", sizes" };
            let powers = if array.drives.is_some() { " and powers" } else { "" };
            format!(
                "{packages} at the positions{turns}{sizes}{powers} of {file}, {x} x {y} mm between outermost axes"
            )
        }
        PackagePositions::Grid { columns, rows, arrangement } => {
            let hexagonal = match arrangement {
                Arrangement::Square => "",
                Arrangement::Hexagonal => ", hexagonal",
            };
            format!("{columns} x {rows} at {} mm{hexagonal}", array.pitch_mm)
        }
    };
    let offset = if array.is_offset() { ", each off its place" } else { "" };
    let turned = if array.has_own_turns() { ", each with a turn of its own" } else { "" };
    format!("{places}{offset}{turned}{}", scaled(design))
}

/// Sizes of packages, in words; empty where all are as stated.
fn scaled(design: &Design) -> String {
    if !design.array.is_scaled() {
        return String::new();
    }
    let [least, most] = design.array.scale_range().map(shortest);
    let sizes = if least == most { least } else { format!("{least} to {most}") };
    let relief = if design.has_relief() {
        "; their elements scale with them, their bands keep the BSDF of the relief as stated"
    } else {
        ""
    };
    format!(", packages of {sizes} times the stated size{relief}")
}

/// Sides of the rectangle between the outermost axes, mm.
fn extent(layout: &Layout) -> [f64; 2] {
    let [low, high] = cell(layout).unwrap_or_default();
    [0, 1].map(|k| high[k] - low[k])
}

/// Neighbours that uniformity is read between, in words.
fn neighbours(design: &Design) -> Option<String> {
    let (ends, pairs) = layout(design).distances_mm()?;
    let [least, most] = ends.map(shortest);
    let apart = if least == most { least } else { format!("{least} to {most}") };
    Some(format!("{}, {apart} mm apart; uniformity is read between all", count(pairs, "pair")))
}

/// A solid in words.
fn solid(solid: &CheckedSolid) -> String {
    let made = match (&solid.medium, solid.stated.kind.is_sheet()) {
        (Some(of), _) => medium(of),
        (None, true) => "sheet".to_owned(),
        (None, false) => "opaque".to_owned(),
    };
    let per = match solid.per() {
        Per::Package => "in each package",
        Per::Array => "once",
    };
    let kind = solid.stated.kind_name();
    let scatter = solid.stated.shared.scatter.as_ref();
    let scatter = scatter.map_or(String::new(), |scatter| format!(", {}", scatters(&scatter.kind)));
    if solid.is_film() {
        return film(solid, &made);
    }
    let surface = match (solid.form.deviation, &solid.stated.kind) {
        (Some(deviation), _) => format!(", traced as {deviation}"),
        (None, SolidForm::Mesh(mesh)) => smooth(mesh.smooth_deg),
        _ => String::new(),
    };
    format!("{}: {kind}{surface}, {made}, {per}{scatter}", solid.name())
}

/// A film in words.
fn film(solid: &CheckedSolid, made: &str) -> String {
    let around = solid.form.upright_box();
    let place = around.map_or(String::new(), |around| {
        let [x, y, z] = around.size().to_array().map(about);
        let low = about(around.low.z);
        format!("{x} x {y} x {z} mm from z = {low} mm, ")
    });
    let faces = ["top", "bottom"].into_iter().zip(&solid.stated_faces);
    let faces = faces.filter_map(|(name, face)| {
        face.as_ref().map(|face| format!(", {name}: {}", scatters(&face.kind)))
    });
    let faces = faces.collect::<Vec<_>>().concat();
    let joined = &solid.stated.shared.optical_contact.0;
    let joined = joined.iter().map(|other| format!(", in optical contact with {other}"));
    format!("{}: {place}{made}{faces}{}", solid.name(), joined.collect::<String>())
}

/// A length without rounding of sums.
fn about(length_mm: f64) -> String {
    shortest((length_mm * 1e9).round() * 1e-9)
}

/// Index, scattering and luminescence of a medium in words.
fn medium(medium: &Medium) -> String {
    let index = format!("index {}", shortest(medium.index));
    let scattering =
        medium.scattering.as_ref().map(|MediumScattering { per_mm, optics, .. }| {
            let [per_mm, g] = [*per_mm, optics.phase.mean_cosine()].map(|x| format!("{x:.4}"));
            format!("scatters {per_mm} per mm with a mean cosine of {g}")
        });
    let of_luminophore = |of: &MediumLuminophore| {
        let percent = shortest((of.quantum_yield * 1e4).round() / 100.0);
        let MediumLuminophore { name, absorption_per_mm, .. } = of;
        format!("{name} absorbs {absorption_per_mm:.4} per mm and emits {percent} % of the photons")
    };
    let luminophores = medium.luminophores.iter().map(of_luminophore);
    let words: Vec<String> = std::iter::once(index).chain(scattering).chain(luminophores).collect();
    words.join(", ")
}

/// The spectrum of the light, in words.
fn spectrum(design: &Design) -> Option<String> {
    let spectrum = design.spectrum.as_ref()?;
    let converts = design.converts();
    Some(if converts { spectrum.describe_converted() } else { spectrum.describe() })
}

/// The wavelengths of a design that converts light, in words.
fn converted(design: &Design) -> String {
    let nm = design.traced_nm();
    let names: Vec<&str> = design.luminophores().map(|of| of.name.as_str()).collect();
    let counted = if design.converts_in_lumens { "lumens" } else { "watts" };
    format!(
        "by {}, counted in {counted}; {} from {} to {} nm in one trace (light.step_nm), indices and coefficients here at {} nm",
        names.join(", "),
        count(nm.len(), "wavelength"),
        shortest(nm[0]),
        shortest(nm[nm.len() - 1]),
        shortest(design.wavelength_nm)
    )
}

/// Effect of a surface on light from either side, in words.
fn scatters(law: &ScatterLaw) -> String {
    let shares = |transmitted: f64, reflected: f64| {
        let rest = 1.0 - transmitted - reflected;
        let absorbed = shortest(if rest > 4.0 * f64::EPSILON { rest } else { 0.0 });
        format!("{transmitted} transmitted, {reflected} reflected, {absorbed} absorbed")
    };
    match law {
        ScatterLaw::File(_) => "scatters by files".to_owned(),
        ScatterLaw::Prisms(stated) => {
            let tip = stated.tip_radius_um.filter(|radius| *radius > 0.0);
            let tip = tip.map_or(String::new(), |radius| format!(" of tip radius {radius} um"));
            format!(
                "prisms of {}°{tip} along {}°{}",
                stated.apex_deg.unwrap_or(Prisms::APEX_DEG),
                stated.direction_deg.unwrap_or_default(),
                in_glue(law)
            )
        }
        ScatterLaw::Grooves(stated) => {
            format!(
                "grooves of {} points along {}°{}",
                stated.profile_um.len(),
                stated.direction_deg.unwrap_or_default(),
                in_glue(law)
            )
        }
        ScatterLaw::Microlenses(stated) => relief("microlenses", stated),
        ScatterLaw::Pyramids(stated) => relief("pyramids", stated),
        ScatterLaw::Cones(stated) => relief("cones", stated),
        ScatterLaw::Polariser(stated) => {
            format!("polariser with its pass axis along {}°", stated.axis_deg.unwrap_or_default())
        }
        ScatterLaw::Filter(_) => "filter, by its shares of unpolarised light".to_owned(),
        ScatterLaw::Haze(stated) => format!(
            "diffuser of {} haze and {} total transmittance of the sheet in air",
            stated.haze, stated.total_transmittance
        ),
        ScatterLaw::Coated(face) => format!("coated, {}", count(face.coating.len(), "layer")),
        ScatterLaw::Lambertian(stated) => {
            format!("Lambertian diffuser: {}", shares(stated.transmitted, stated.reflected))
        }
        ScatterLaw::Gaussian(stated) => {
            let back = stated
                .reflected_width_deg
                .map_or(String::new(), |width| format!(" ({width}° in reflection)"));
            format!(
                "Gaussian diffuser of {}° full width at half maximum{back}: {}",
                stated.width_deg,
                shares(stated.transmitted, stated.reflected)
            )
        }
    }
}

/// Lenses, pyramids or cones of a face, in words.
fn relief(kind: &str, stated: &Relief) -> String {
    let cell = match stated.cell {
        ReliefCells::Square => "square",
        ReliefCells::Hexagonal => "hexagonal",
    };
    let pressed = if stated.pressed_in { ", pressed in" } else { "" };
    format!(
        "{kind} in {cell} cells of {} um along {}°{pressed}",
        shortest(stated.pitch_um()),
        stated.direction_deg.unwrap_or_default()
    )
}

/// The dome in words.
fn dome(design: &Design) -> String {
    let silicone = medium(&design.silicone);
    let Some(dome) = &design.dome else {
        return "none".to_owned();
    };
    let height = shortest(dome.height_mm());
    let width = match dome {
        Dome::Mesh(mesh) if mesh.deviation.is_some() => {
            [0, 1].map(|axis| shortest(2.0 * dome.reach_mm(axis, 0.0))).join(" x ")
        }
        _ => shortest(2.0 * dome.radius_mm()),
    };
    let form = match dome {
        Dome::Mesh(mesh) => mesh.deviation.map_or_else(
            || {
                let triangles = count(mesh.triangles, "triangle");
                format!("mesh of {triangles}{}", smooth(mesh.smooth_deg))
            },
            |deviation| format!("oval surface, traced as {deviation}"),
        ),
        Dome::Meridian(curve) => format!("curve of {}", count(curve.pieces.len(), "piece")),
        Dome::Sphere(sphere) => {
            format!("sphere of radius {} mm", shortest(sphere.sphere_radius_mm))
        }
    };
    format!("{form}, {height} mm high, {width} mm wide, {silicone}")
}

/// Where the normals of a mesh are smooth, in words.
fn smooth(smooth_deg: Option<f64>) -> String {
    smooth_deg.map_or(String::new(), |angle| {
        format!(", smooth where faces turn by up to {} degrees", shortest(angle))
    })
}

/// A reflector in words, which may be of metal.
fn reflecting(reflector: Reflector, coats: Option<&Coats>) -> String {
    if coats.is_some_and(|coats| coats.reflectance.is_some()) {
        return format!("reflectance by a table, {} of it", reflector.reflectance());
    }
    if coats.is_some_and(|coats| coats.substrate.is_some()) {
        return format!("thin films on metal, {} of what they reflect", reflector.reflectance());
    }
    format!("reflectance {}", reflects(reflector))
}

/// Depth of tips in glue in words.
fn in_glue(law: &ScatterLaw) -> String {
    let depth = law.tips_um().map(|tips_um| format!(", {} um deep in glue", shortest(tips_um)));
    depth.unwrap_or_default()
}

/// Ink or density over the place in words.
fn pattern(print: &CheckedPrint) -> String {
    let Print { on, reflected, transmitted, dots, picture_file } = &print.stated;
    let form = match (dots, picture_file) {
        (Some(dots), _) => format!("dots {} mm apart", shortest(dots.pitch_mm)),
        (None, file) => format!("by {}", file.as_deref().unwrap_or_default()),
    };
    let share = 100.0 * print.coverage;
    match reflected {
        None => format!("of {on}: {form}, {share:.1} % of the stated one on the mean"),
        Some(reflected) => format!(
            "on {on}: {form}, {share:.1} % of the area; {reflected} reflected, {transmitted} transmitted"
        ),
    }
}

/// The sides of the LED, where they are not as its top.
fn sides(design: &Design) -> String {
    let coats = design.films.as_ref().map(|films| &films.led_sides);
    let sides = design.led.sides.map(|sides| format!("; sides {}", reflecting(sides, coats)));
    sides.unwrap_or_default()
}

/// Reflectance and law of reflection in words.
fn reflects(reflector: Reflector) -> String {
    match reflector {
        Reflector::Specular { reflectance } => format!("{reflectance}, specular"),
        Reflector::Lambertian { reflectance } => format!("{reflectance}, Lambertian"),
        Reflector::Absorbing => "0, absorbing".to_owned(),
        Reflector::Periodic => "none, light goes round".to_owned(),
        Reflector::Mixed { reflectance, specular_fraction } => format!(
            "{reflectance}, of which {} % specular, the rest Lambertian",
            100.0 * specular_fraction
        ),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Words on the map of the new design with these keys of its receiver.
    fn map_of(keys: &str) -> String {
        let own = design::NEW_DESIGN.replace("NAME", "own");
        let plane = "plane_height_mm = 3.0\n";
        assert!(own.contains(plane));
        let text = own.replace(plane, &format!("{plane}{keys}"));
        let parsed = design::parse("own.toml", &text, Path::new(""));
        map(&parsed.unwrap_or_else(|error| panic!("{keys}: {error}")))
    }

    #[test]
    fn a_map_is_said_to_be_averaged_and_smoothed_as_it_is() {
        let images = "averaged over its mirror images in x, y and x = y";
        assert_eq!(map_of(""), format!("{images}, smoothed with a deviation of 0.1 mm"));
        assert_eq!(
            map_of("average = \"none\"\nsmoothing_sigma_mm = 0.0\n"),
            "not averaged over images, not smoothed"
        );
    }
}
