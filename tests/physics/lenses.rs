// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lenses that are not round: ovals by two meridians and solids under height maps.
//!
//! Sources: Snell's law at the ellipsoid and at the sphere in closed form, rays in the plane of one
//! meridian by its arcs, the same dome as a mesh of level lines, the round solid.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use tempfile::tempdir;
use tracer::{
    Emission, Emitter, Fate, Interaction, Medium, Observer, Prototype, Ray, Region, SceneBuilder,
    Settings, Shape, Source, Surface, SurfaceModel, random, trace_observed,
};

use batwing_tests::judgement::{PATHS, account, alike};
use design::Design;
use metrics::jackknife;
use runtime::interrupt::Interrupt;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::observation::Observation;
use simulate::trace::observe;

const INDEX: f64 = 1.5;
const DOMED: &str = include_str!("../../data/designs/bare-dome.toml");
/// The sphere of that design.
const SPHERE: &str = "sphere_radius_mm = 2.0\nheight_mm = 1.0\nwidth_mm = 3.4\n";

fn parse(text: &str, folder: &Path) -> Design {
    design::parse("lens.toml", text, folder).unwrap_or_else(|error| panic!("{error}"))
}

fn seen(design: &Design) -> Observation {
    let interrupt = Interrupt::default();
    let env = RunContext::quiet(&interrupt, 31);
    let surface = dome_surface(design, Model::Geometric, None).expect("a surface");
    observe(design, &surface, PATHS, "", env).expect("a trace")
}

/// The bare dome with the solid of these keys 20 mm above it.
fn with_lens(keys: &str) -> String {
    format!(
        "{DOMED}\n[[solids]]\nname = \"lens\"\nposition_mm = [0.0, 0.0, 20.0]\nmedium = {{ index = {INDEX} }}\n{keys}\n"
    )
}

/// That solid in its own coordinates.
fn lens(keys: &str, folder: &Path) -> Shape {
    let mut form = parse(&with_lens(keys), folder).solids[0].form.clone();
    assert!(form.deviation.is_some() == form.meridian.is_none());
    form.placement.origin = DVec3::ZERO;
    form.shape(0.0).expect("a shape")
}

/// Keeps the direction in which light that went in and out left, with its ray.
#[derive(Default)]
struct Through {
    began: Option<Ray>,
    met: usize,
    seen: Vec<(Ray, DVec3)>,
}

impl Observer for Through {
    fn begins(&mut self, ray: &Ray) {
        (self.began, self.met) = (Some(*ray), 0);
    }

    fn meets(&mut self, _meeting: &Interaction) {
        self.met += 1;
    }

    fn ends(&mut self, ray: &Ray, fate: Fate, _weight: f64) {
        if self.met == 2 && matches!(fate, Fate::EscapedUp | Fate::EscapedDown) {
            self.seen.extend(self.began.map(|began| (began, ray.direction)));
        }
    }
}

/// Root mean square and largest difference of the directions behind a lens from those expected.
fn errors(shape: Shape, rays: &[Ray], expected: impl Fn(&Ray) -> Option<DVec3>) -> [f64; 2] {
    let lens = Prototype {
        media: vec![Medium::clear("glass", INDEX)],
        surfaces: vec![Surface::new(
            "lens",
            shape,
            Region::Body(0),
            Region::World,
            &SurfaceModel::Interface,
        )],
        sources: Vec::new(),
    };
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(lens);
    scene.place(id, DVec3::ZERO);
    let far = DVec3::new(0.0, 0.0, -50.0);
    scene.source(Source::new("lamp", far, Region::World, Emitter::Point, Emission::Isotropic));
    let scene = scene.build().expect("a scene");
    let mut through = Through::default();
    let mut all = rays.iter().cycle();
    let aim = |ray: Ray| all.next().copied().unwrap_or(ray);
    trace_observed(&scene, &Settings::new(rays.len() as u64, 3), aim, &mut through)
        .expect("traced");
    let off = |(ray, direction): &(Ray, DVec3)| {
        expected(ray).map(|expected| (*direction - expected).length())
    };
    let all: Vec<f64> = through.seen.iter().filter_map(off).collect();
    assert!(all.len() > rays.len() / 2, "{} of {}", all.len(), rays.len());
    let square = all.iter().map(|off| off * off).sum::<f64>() / all.len() as f64;
    [square.sqrt(), all.into_iter().fold(0.0, f64::max)]
}

/// Snell's law in vectors, from index `from` to `to`; the normal may point either way.
fn refracted(direction: DVec3, normal: DVec3, [from, to]: [f64; 2]) -> Option<DVec3> {
    let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
    let (ratio, cos) = (from / to, -normal.dot(direction));
    let square = 1.0 - ratio * ratio * (1.0 - cos * cos);
    (square > 0.0).then(|| ratio * direction + (ratio * cos - square.sqrt()) * normal)
}

/// Rows of a quarter or half of the ellipse with semi-axes `r` and `c` from its top, by arcs.
fn half_ellipse(r: f64, c: f64, pieces: usize) -> String {
    let at = |k: f64| {
        let (sin, cos) = (PI * k / pieces as f64).sin_cos();
        [r * sin, c * cos]
    };
    let mut rows = format!("[0.0, {c:?}]");
    for k in 1..=pieces {
        let [from, middle, to] = [-1.0, -0.5, 0.0].map(|before| at(k as f64 + before));
        let chord = [to[0] - from[0], to[1] - from[1]];
        let half = [middle[0] - from[0], middle[1] - from[1]];
        // The sagitta over half the chord, below 0 for clockwise.
        let turn = half[0] * chord[1] - half[1] * chord[0];
        let bulge = 2.0 * turn / (chord[0] * chord[0] + chord[1] * chord[1]);
        let r = if k == pieces { 0.0 } else { to[0] };
        let _ = write!(rows, ", [{r:?}, {:?}, {bulge:?}]", to[1]);
    }
    rows
}

/// An ellipsoid of three axes by two half-ellipses bends rays as Snell's law says.
#[test]
fn two_half_ellipses_are_the_ellipsoid() {
    let axes = DVec3::new(1.2, 0.8, 0.6);
    let [x, y] = [axes.x, axes.y].map(|r| half_ellipse(r, axes.z, 120));
    let oval = |x: &str, y: &str| {
        let keys = format!("kind = \"meridian\"\nmeridian_mm = [{x}]\nmeridian_y_mm = [{y}]");
        lens(&keys, Path::new(""))
    };
    let mut rng = random::stream(5, 0);
    let rays: Vec<Ray> = (0..4000)
        .map(|_| {
            let target = 0.8 * axes * random::isotropic(&mut rng) * random::unit(&mut rng);
            let direction = random::isotropic(&mut rng);
            Ray { origin: target - 5.0 * direction, direction }
        })
        .collect();
    // As the unit ball in stretched space; normals are gradients.
    let meets = |ray: &Ray, is_inside: bool| {
        let (o, d) = (ray.origin / axes, ray.direction / axes);
        let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
        let root = (b * b - a * c).max(0.0).sqrt();
        let at = ray.at((if is_inside { root - b } else { -b - root }) / a);
        (at, (at / axes / axes).normalize())
    };
    let expected = |ray: &Ray| {
        let (at, normal) = meets(ray, false);
        let inside = Ray { origin: at, direction: refracted(ray.direction, normal, [1.0, INDEX])? };
        let (_, normal) = meets(&inside, true);
        refracted(inside.direction, normal, [INDEX, 1.0])
    };
    let [rms, most] = errors(oval(&x, &y), &rays, expected);
    assert!(rms < 5e-4 && most < 0.05, "{rms} {most}");
    // Controls: the axes exchanged, and the round solid of one meridian.
    for other in [oval(&y, &x), oval(&x, &x)] {
        let [rms, _] = errors(other, &rays, expected);
        assert!(rms > 0.05, "{rms}");
    }
}

/// Curves in the plane of a meridian: circles (centre, radius) that count between two distances from
/// the axis, below the centre the first, above it the second.
type Arcs = [([f64; 2], f64, [f64; 2]); 2];

/// Direction of a ray through the flat bottom z = 0 and the upper one of two arcs, in their plane.
fn in_plane(ray: &Ray, axis: DVec3, arcs: &Arcs) -> Option<DVec3> {
    let inside = refracted(ray.direction, DVec3::Z, [1.0, INDEX])?;
    let foot = ray.origin - ray.direction * (ray.origin.z / ray.direction.z);
    let (u, du) = (foot.dot(axis), inside.dot(axis));
    let meet = |number: usize, side: f64| {
        let ([r, z], radius, [near, far]) = arcs[number];
        // |(u + t du - side r, t dz - z)| = radius
        let (a, b) = ([u - side * r, -z], [du, inside.z]);
        let (half, rest) = (a[0] * b[0] + a[1] * b[1], a[0] * a[0] + a[1] * a[1] - radius * radius);
        let root = (half * half - rest).max(0.0).sqrt();
        let within = move |t: &f64| {
            let out = side * (u + t * du);
            let is_above = a[1] + t * b[1] > 0.0;
            (near..far).contains(&out)
                && is_above == (number == 1)
                && half * half > rest
                && *t > 0.0
        };
        let times = [-half - root, -half + root].into_iter().filter(within);
        times.map(move |t| (t, axis * (a[0] + t * b[0]) + DVec3::Z * (a[1] + t * b[1])))
    };
    let all = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)].into_iter().flat_map(|(k, s)| meet(k, s));
    let (_, normal) = all.min_by(|a, b| a.0.total_cmp(&b.0))?;
    refracted(inside, normal.normalize(), [INDEX, 1.0])
}

/// In the planes of its meridians an oval lens with a dip is the section.
#[test]
fn rays_in_the_plane_of_a_meridian_stay_there_and_see_it() {
    // Hollow about a centre on the axis, then a shoulder that falls upright to the bottom.
    let curve = |at: f64, low: f64, top: f64, radius: f64, far: f64| {
        // From [0, low] to the point [at, top] above the middle of the shoulder, then down.
        let hollow = (at * at + (top - low) * (top - low)) / (2.0 * (top - low));
        let rows = format!(
            "[0.0, {low:?}], [{at:?}, {top:?}, 0.0, {:?}], [{far:?}, {:?}, {at:?}, {:?}], [{far:?}, 0.0], [0.0, 0.0]",
            low + hollow,
            top - radius,
            top - radius
        );
        let arcs: Arcs =
            [([0.0, low + hollow], hollow, [0.0, at]), ([at, top - radius], radius, [at, far])];
        (rows, arcs)
    };
    let (x, of_x) = curve(0.8, 1.2, 1.4, 1.0, 1.8);
    let (y, of_y) = curve(0.5, 1.2, 1.4, 0.7, 1.2);
    let keys = format!("kind = \"meridian\"\nmeridian_mm = [{x}]\nmeridian_y_mm = [{y}]");
    let oval = lens(&keys, Path::new(""));
    for (axis, own, other) in [(DVec3::X, of_x, of_y), (DVec3::Y, of_y, of_x)] {
        let reach = own[1].2[1];
        let rays: Vec<Ray> = (0..1000)
            .map(|k| {
                let (u, tilt) =
                    (f64::from(k % 100) / 100.0 - 0.5, f64::from(k / 100) / 20.0 - 0.23);
                let direction = axis * tilt.sin() + DVec3::Z * tilt.cos();
                Ray { origin: axis * (1.2 * u * reach) - direction, direction }
            })
            .collect();
        let [rms, most] = errors(oval.clone(), &rays, |ray| in_plane(ray, axis, &own));
        assert!(rms < 1e-3 && most < 0.05, "{axis}: {rms} {most}");
        let [rms, _] = errors(oval.clone(), &rays, |ray| in_plane(ray, axis, &other));
        assert!(rms > 0.02, "{axis}: {rms}");
    }
}

/// Distances from the axis of the dome at height z, along x and along y.
fn radii(z: f64) -> [f64; 2] {
    let foot = z.max(4f64.sqrt() * 0.526_782_687_642_637 - 1.0);
    [(4.0 - (foot + 1.0) * (foot + 1.0)).sqrt(), (2.25 - (foot + 0.5) * (foot + 0.5)).sqrt()]
}

/// Ellipses at many heights, in flat triangles.
fn write_level_lines(path: &Path) {
    let (levels, sides) = (150, 480);
    let mut text = String::new();
    for level in 0..=levels {
        // Even in the angle of the larger sphere, with the foot of the arcs among the levels.
        let share = (f64::from(level) / f64::from(levels - 1)).min(1.0);
        let z = if level == levels { 0.0 } else { 2.0 * (0.85f64.asin() * share).cos() - 1.0 };
        let [x, y] = if level == 0 { [0.0; 2] } else { radii(z) };
        for side in 0..sides {
            let (sin, cos) = (TAU * f64::from(side) / f64::from(sides)).sin_cos();
            let _ = writeln!(text, "v {:?} {:?} {z:?}", x * cos, y * sin);
        }
    }
    let _ = writeln!(text, "v 0 0 0");
    let at = |level: i32, side: i32| level * sides + side % sides + 1;
    for side in 0..sides {
        let _ = writeln!(text, "f {} {} {}", 1, at(1, side), at(1, side + 1));
        for level in 1..levels {
            let [a, b] = [side, side + 1].map(|side| at(level, side));
            let [c, d] = [side, side + 1].map(|side| at(level + 1, side));
            let _ = writeln!(text, "f {a} {c} {b}\nf {b} {c} {d}");
        }
        let centre = at(levels, sides - 1) + 1;
        let _ = writeln!(text, "f {centre} {} {}", at(levels, side + 1), at(levels, side));
    }
    std::fs::write(path, text).expect("written");
}

#[test]
fn an_oval_dome_is_the_mesh_of_its_level_lines() {
    let folder = tempdir().expect("a folder");
    write_level_lines(&folder.path().join("dome.obj"));
    let [x, y] = radii(0.0);
    let foot = 4f64.sqrt() * 0.526_782_687_642_637 - 1.0;
    let rows = |r: f64, centre: f64| {
        format!("[[0.0, 1.0], [{r:?}, {foot:?}, 0.0, {centre:?}], [{r:?}, 0.0]]")
    };
    let round = format!("meridian_mm = {}\n", rows(x, -1.0));
    let oval = format!("{round}meridian_y_mm = {}\n", rows(y, -0.5));
    let mesh = "mesh = \"dome.obj\"\nmesh_unit = \"mm\"\n";
    let far = "\n[[receivers]]\nname = \"far\"\nkind = \"far_field\"\ntheta_bin_deg = 15.0\nphi_bin_deg = 30.0\n";
    assert!(DOMED.contains(SPHERE));
    let [round, oval, mesh] = [&*round, &*oval, mesh]
        .map(|dome| seen(&parse(&format!("{}{far}", DOMED.replace(SPHERE, dome)), folder.path())));
    alike("extraction", account(&oval, "escaped_up"), account(&mesh, "escaped_up"));
    let bin = |of: &Observation, bin: usize| jackknife(&of.receivers[0], |all| all[bin]);
    let apart = |a: &Observation, k: usize| {
        let (a, b) = (bin(a, k), bin(&mesh, k));
        (a.value - b.value).abs() / a.standard_error.hypot(b.standard_error).max(1e-12)
    };
    // Upward bins alone: the mirror sends none down.
    for k in 0..72 {
        assert!(apart(&oval, k) < 4.5, "bin {k}: {}", apart(&oval, k));
    }
    // The round dome is another one.
    let squares: f64 = (0..72).map(|k| apart(&round, k).powi(2)).sum();
    assert!(squares > 200.0, "{squares}");
}

/// Equal meridians are the round solid to the last bit, as a dome and as a solid.
#[test]
fn equal_meridians_are_the_round_solid() {
    let rows = "[[0.0, 0.7], [0.8, 1.1, 0.0, 1.7], [1.8, 0.6, 1.0, 0.25], [1.6, 0.0]]";
    let round = format!("meridian_mm = {rows}\n");
    let twice = format!("{round}meridian_y_mm = {rows}\n");
    let other = twice.replace("[1.6, 0.0]]\nm", "[1.7, 0.0]]\nm");
    let [round, twice, other] = [round, twice, other]
        .map(|dome| seen(&parse(&DOMED.replace(SPHERE, &dome), Path::new(""))));
    assert_eq!((&round.far_field, &round.powers), (&twice.far_field, &twice.powers));
    assert_ne!(round.powers, other.powers);
    let rows = "meridian_mm = [[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]";
    let both = format!("kind = \"meridian\"\n{rows}\n{}", rows.replace("_mm", "_y_mm"));
    let unequal = both.replace("y_mm = [[0.0, 1.0], [1.0", "y_mm = [[0.0, 1.0], [0.9");
    for (keys, is_round) in [(&both, true), (&unequal, false)] {
        let design = parse(&with_lens(keys), Path::new(""));
        assert_eq!(design.solids[0].form.meridian.is_some(), is_round, "{keys}");
    }
}

/// A part of a ball as a height map bends upright light as the sphere does.
#[test]
fn a_map_of_a_sphere_is_the_sphere() {
    let folder = tempdir().expect("a folder");
    let (radius, half, nodes) = (3.0_f64, 0.9, 31);
    let height = |x: f64, y: f64| (radius * radius - x * x - y * y).sqrt() - 2.0;
    let place = |k: usize| half * (2.0 * k as f64 / (nodes - 1) as f64 - 1.0);
    let mut heights = Vec::new();
    let mut text = String::new();
    for row in (0..nodes).rev() {
        let line: Vec<f64> = (0..nodes).map(|k| height(place(k) - 0.2, place(row) + 0.1)).collect();
        let words: Vec<String> = line.iter().map(|z| format!("{z:?}")).collect();
        let _ = writeln!(text, "{}", words.join(","));
        heights.extend(line);
    }
    std::fs::write(folder.path().join("ball.csv"), text).expect("written");
    let mut array = Vec::new();
    arrays::npy::write(&mut array, &[nodes, nodes], &heights).expect("an array");
    std::fs::write(folder.path().join("ball.npy"), array).expect("written");
    let map = |file: &str, scale: f64| {
        let keys = format!(
            "kind = \"height_map\"\nsize_mm = [1.8, 1.8]\nmap_file = {file:?}\nscale_mm = {scale}\nbase_mm = 0.1"
        );
        lens(&keys, folder.path())
    };
    let mut rng = random::stream(8, 0);
    let rays: Vec<Ray> = (0..4000)
        .map(|_| {
            let [x, y] = [0, 1].map(|_| half * 0.999 * (2.0 * random::unit(&mut rng) - 1.0));
            Ray { origin: DVec3::new(x, y, -1.0), direction: DVec3::Z }
        })
        .collect();
    let expected = |ray: &Ray| {
        let [x, y] = [ray.origin.x - 0.2, ray.origin.y + 0.1];
        let normal = DVec3::new(x, y, height(x, y) + 2.0) / radius;
        refracted(DVec3::Z, normal, [INDEX, 1.0])
    };
    for file in ["ball.csv", "ball.npy"] {
        let [rms, most] = errors(map(file, 1.0), &rays, expected);
        assert!(rms < 1e-4 && most < 1e-3, "{file}: {rms} {most}");
    }
    let [rms, _] = errors(map("ball.csv", 1.1), &rays, expected);
    assert!(rms > 0.01, "{rms}");
}
