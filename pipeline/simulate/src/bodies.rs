// SPDX-License-Identifier: MIT OR Apache-2.0
//! The bodies of a design for export: exactly, as closed triangle meshes, and as generating curves.

use std::collections::BTreeMap;

use anyhow::Result;
use tracer::Shape;
use tracer::glam::{DMat3, DVec3};

use design::Design;
use design::resolved::array::Pose;
use design::resolved::dome::Dome;
use design::resolved::led::BoxPlace;
use design::resolved::solids::CheckedSolid;
use design::schema::Extent;
use design::schema::solids::{Flat, Per, SolidForm};
use formats::body::{Body, DOME, Form};
use formats::mesh::Mesh;
use geometry::Meridian;
use runtime::serde_arrays::List;

use crate::scene::mirror_half_mm;

/// Name of the LED box.
const LED: &str = "led";
/// Name of the mirror.
const MIRROR: &str = "mirror";

/// All bodies of the design, exactly, with the places of their copies: domes, boxes, solids and
/// sheets, mirror, walls and floor of a housing.
///
/// # Errors
/// If the relief cannot be built.
pub fn whole(design: &Design) -> Result<Vec<Body>> {
    let axes = design.array.axes_mm().into_iter();
    let axes: Vec<DVec3> = axes.map(|[x, y]| DVec3::new(x, y, 0.0)).collect();
    // One for each turn and size of a package, in the order in which they appear.
    let mut poses: Vec<(Pose, Vec<DVec3>)> = Vec::new();
    let mut known: BTreeMap<[u64; 2], usize> = BTreeMap::new();
    for (package, axis) in axes.iter().enumerate() {
        let pose = design.array.pose(package);
        let key = [pose.turn_deg, pose.scale].map(f64::to_bits);
        let number = *known.entry(key).or_insert(poses.len());
        if number == poses.len() {
            poses.push((pose, Vec::new()));
        }
        poses[number].1.push(*axis);
    }
    let copied = |body: Body| -> Vec<Body> {
        let copies = poses.iter().zip(1..).map(|((pose, axes), number)| {
            let name =
                if poses.len() > 1 { format!("{} {number}", body.name) } else { body.name.clone() };
            Body { name, ..posed(&body, *pose, axes) }
        });
        copies.collect()
    };
    let mut bodies: Vec<Body> = dome(design)?.map(copied).into_iter().flatten().collect();
    let (kinds, numbers) = design.package_kinds();
    for (kind, (place, pose)) in kinds.iter().enumerate() {
        let of_kind = axes.iter().zip(&numbers).filter(|(_, number)| **number == kind);
        let axes: Vec<DVec3> = of_kind.map(|(axis, _)| *axis).collect();
        let mut body = posed(&led(design, *place), *pose, &axes);
        if kinds.len() > 1 {
            body.name = format!("{} {}", body.name, kind + 1);
        }
        bodies.push(body);
    }
    for stated in &design.solids {
        let body = solid(stated)?;
        match stated.per() {
            Per::Package => bodies.extend(copied(body)),
            Per::Array => bodies.push(body),
        }
    }
    if let Some(mirror) = mirror(design)? {
        match design.mirror.extent {
            Extent::Package => bodies.extend(copied(mirror)),
            Extent::Array => bodies.push(mirror),
        }
    }
    bodies.extend(housing(design));
    Ok(bodies)
}

/// A body of packages that are scaled, and turned about their `axes`.
fn posed(body: &Body, Pose { turn_deg, scale }: Pose, axes: &[DVec3]) -> Body {
    let mut posed = body.clone().scaled(scale);
    if turn_deg != 0.0 {
        let rotation = DMat3::from_rotation_z(turn_deg.to_radians());
        posed.rotation = rotation * posed.rotation;
        posed.places[0] = rotation * posed.places[0];
    }
    posed.places = axes.iter().map(|axis| *axis + posed.places[0]).collect();
    posed
}

/// The bodies of one package within `error_mm` of their surfaces: the dome with its relief (if it
/// has one), the LED box, then solids. It is the package as stated; one that is alone has its turn and
/// size, and the solids of the array beside it.
///
/// # Errors
/// If the relief cannot be built, or the chord error is none.
pub fn bodies(design: &Design, error_mm: f64) -> Result<Vec<Mesh>> {
    let box_of_led = led(design, design.led.place(0));
    let bodies = of_package(design, Some(box_of_led))?;
    let meshes = bodies.iter().filter_map(|body| body.mesh(error_mm).transpose());
    meshes.collect()
}

/// The dome, `more` and the solids of the package of [`bodies`].
fn of_package(design: &Design, more: Option<Body>) -> Result<Vec<Body>> {
    let placed = |body: Body| {
        let alone = design.array.count() == 1;
        let pose = alone.then(|| design.array.pose(0));
        pose.map_or_else(|| body.clone(), |pose| posed(&body, pose, &[DVec3::ZERO]))
    };
    let mut bodies: Vec<Body> = dome(design)?.into_iter().chain(more).map(placed).collect();
    for stated in design.solids.iter().filter(|stated| is_of_package(design, stated)) {
        let body = solid(stated)?;
        bodies.push(if stated.per() == Per::Package { placed(body) } else { body });
    }
    Ok(bodies)
}

/// Names of the solids and sheets that [`bodies`] leaves out.
pub fn without_mesh(design: &Design) -> Vec<&str> {
    let left =
        |stated: &&CheckedSolid| stated.stated.kind.is_sheet() || !is_of_package(design, stated);
    design.solids.iter().filter(left).map(CheckedSolid::name).collect()
}

/// Generating curves about the axis of a package, each with its name: that of the dome with its
/// relief, then those of solids.
///
/// # Errors
/// If the relief cannot be built.
pub fn meridians(design: &Design) -> Result<Vec<(String, Meridian)>> {
    let about_axis = of_package(design, None)?.into_iter().filter_map(
        |Body { name, form, rotation, places }| {
            let is_upright = rotation.z_axis == DVec3::Z && places[0].truncate().length() <= 0.0;
            match form {
                Form::Revolved(curve) if is_upright => Some((name, curve.lifted(places[0].z))),
                _ => None,
            }
        },
    );
    Ok(about_axis.collect())
}

/// True for a solid of every package, or of the array where it is one package on the axis.
fn is_of_package(design: &Design, stated: &CheckedSolid) -> bool {
    stated.per() == Per::Package || design.array.axes_mm() == [[0.0; 2]]
}

/// The name of a body that the design does not name, apart from those of solids.
fn free_name(design: &Design, name: &str) -> String {
    let is_taken = design.solids.iter().any(|solid| solid.name() == name);
    if is_taken { format!("{name} (package)") } else { name.to_owned() }
}

/// A body where its form is.
fn unmoved(name: &str, form: Form) -> Body {
    Body { name: name.to_owned(), form, rotation: DMat3::IDENTITY, places: vec![DVec3::ZERO] }
}

fn dome(design: &Design) -> Result<Option<Body>> {
    Ok(match &design.dome {
        None => None,
        Some(Dome::Mesh(mesh)) => Some(unmoved(DOME, triangles(DOME, &mesh.shape)?)),
        Some(Dome::Sphere(_) | Dome::Meridian(_)) => {
            Some(unmoved(DOME, Form::Revolved(design.outline()?)))
        }
    })
}

fn led(design: &Design, place: BoxPlace) -> Body {
    unmoved(&free_name(design, LED), Form::Box(design.led.at(place).corners(0.0)))
}

fn triangles(name: &str, shape: &Shape) -> Result<Form> {
    let Shape::Mesh(mesh) = shape else {
        anyhow::bail!("{name}: expected triangles");
    };
    let (vertices, triangles) = mesh.solid();
    let vertices = vertices.iter().map(tracer::glam::DVec3::to_array).collect();
    Ok(Form::Mesh(Mesh { name: name.to_owned(), vertices, triangles }))
}

/// A solid or a sheet in its package or in the array.
fn solid(stated: &CheckedSolid) -> Result<Body> {
    let (name, form) = (stated.name(), &stated.form);
    let exact = match &stated.stated.kind {
        SolidForm::Box(Flat { size_mm: List(size), .. }) => {
            let half = 0.5 * DVec3::from_array(*size);
            Form::cuboid(-half, half)
        }
        SolidForm::Cylinder(cylinder) => {
            Form::cylinder(cylinder.radius_mm, 0.5 * cylinder.height_mm)
        }
        SolidForm::Sphere(ball) => Form::ball(ball.radius_mm),
        SolidForm::Meridian(_) | SolidForm::Mesh(_) | SolidForm::HeightMap(_) => {
            match &form.meridian {
                Some(meridian) => Form::Revolved(meridian.clone()),
                None => triangles(name, &form.pieces[0])?,
            }
        }
        SolidForm::Rectangle(Flat { size_mm: List(size), .. }) => {
            Form::Rectangle(size.map(|length| 0.5 * length))
        }
        SolidForm::Disc(disc) => Form::Disc(disc.radius_mm),
    };
    let (rotation, places) = (form.placement.rotation, vec![form.placement.origin]);
    Ok(Body { name: name.to_owned(), form: exact, rotation, places })
}

/// The mirror in z = 0, of a package or under the array within its walls; triangles of a dome in
/// z = 0 are no body of their own.
fn mirror(design: &Design) -> Result<Option<Body>> {
    let form = match (design.mirror.extent, &design.dome) {
        (Extent::Array, _) => {
            let (half, inner) = (mirror_half_mm(design), design.housing_half_mm());
            Form::Rectangle([0, 1].map(|k| inner.map_or(half[k], |inner| half[k].min(inner[k]))))
        }
        (Extent::Package, Some(Dome::Sphere(_) | Dome::Meridian(_))) => {
            Form::Disc(design.outline()?.end_mm()[0])
        }
        (Extent::Package, Some(Dome::Mesh(_)) | None) => return Ok(None),
    };
    Ok(Some(unmoved(&free_name(design, MIRROR), form)))
}

/// Walls, and the floor between them and the mirror.
fn housing(design: &Design) -> Vec<Body> {
    let (Some(housing), Some([x, y])) = (&design.housing, design.housing_half_mm()) else {
        return Vec::new();
    };
    let (far_x, far_y) = (x + housing.thickness_mm, y + housing.thickness_mm);
    let walls = [
        ([x, -far_y], [far_x, far_y]),
        ([-far_x, -far_y], [-x, far_y]),
        ([-x, y], [x, far_y]),
        ([-x, -far_y], [x, -y]),
    ];
    let wall = |(number, ([x, y], [to_x, to_y])): (usize, ([f64; 2], [f64; 2]))| {
        let (low, high) = (DVec3::new(x, y, 0.0), DVec3::new(to_x, to_y, housing.height_mm));
        unmoved(&format!("wall {number}"), Form::cuboid(low, high))
    };
    let walls = walls.into_iter().filter(|_| !design.is_periodic());
    let mut bodies: Vec<Body> = (1..).zip(walls).map(wall).collect();
    let [a, b] = match design.mirror.extent {
        Extent::Array => mirror_half_mm(design),
        Extent::Package => [0.0; 2],
    };
    let (a, b) = (a.min(x), b.min(y));
    let strips = [([-x, b], [x, y]), ([-x, -y], [x, -b]), ([a, -b], [x, b]), ([-x, -b], [-a, b])];
    let strips = strips.into_iter().filter(|(low, high)| high[0] > low[0] && high[1] > low[1]);
    bodies.extend((1..).zip(strips).map(|(number, (low, high)): (usize, _)| {
        let half = [0, 1].map(|k| 0.5 * (high[k] - low[k]));
        let middle = [0, 1].map(|k| 0.5 * (high[k] + low[k]));
        let floor = unmoved(&format!("housing floor {number}"), Form::Rectangle(half));
        Body { places: vec![DVec3::new(middle[0], middle[1], 0.0)], ..floor }
    }));
    bodies
}

#[cfg(test)]
mod tests {
    use super::*;

    /// True if every edge belongs to two triangles that run along it in opposite directions.
    fn is_closed(mesh: &Mesh) -> bool {
        let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let mut edges: Vec<(u32, u32)> = edges.collect();
        edges.sort_unstable();
        let once = edges.windows(2).all(|w| w[0] != w[1]);
        once && edges.iter().all(|(a, b)| edges.binary_search(&(*b, *a)).is_ok())
    }

    #[test]
    fn bodies_of_every_design_are_closed_and_face_outwards() {
        for (name, _) in design::EMBEDDED {
            let design = design::embedded(name).expect("valid");
            for mesh in bodies(&design, 5e-4).expect("a mesh") {
                assert!(is_closed(&mesh), "{name} {}", mesh.name);
                assert!(mesh.volume() > 0.0, "{name} {}", mesh.name);
                let [w, l] = design.led.size_mm;
                if mesh.name == "led" {
                    let volume = w * l * design.led.height_mm;
                    assert!((mesh.volume() / volume - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_smooth_dome_is_met_to_the_chord_error_and_in_volume() {
        let design = design::embedded("bare-dome.toml").expect("valid");
        let dome = design.sphere().expect("a sphere");
        for error in [1e-2, 1e-3, 1e-4] {
            let mesh = bodies(&design, error).expect("a mesh").remove(0);
            let mut worst = 0.0_f64;
            for triangle in &mesh.triangles {
                let at = |k: usize| glam::DVec3::from_array(mesh.vertices[triangle[k] as usize]);
                let middle = (at(0) + at(1) + at(2)) / 3.0;
                let r = middle.truncate().length();
                if middle.z > 0.06 {
                    let centre = glam::DVec3::Z * dome.centre_mm();
                    worst = worst.max(((middle - centre).length() - dome.sphere_radius_mm).abs());
                } else if middle.z > 1e-6 && r > 1.6 {
                    worst = worst.max(dome.radius_mm - r);
                }
            }
            assert!(worst <= error && worst > 0.01 * error, "{error}: {worst}");
            // Spherical segment of the cap from its rim, and the cylinder below.
            let (rim, z) = (dome.radius_mm, dome.height_at(dome.radius_mm));
            let cap = dome.height_mm - z;
            let pi = std::f64::consts::PI;
            let exact = pi * cap * (3.0 * rim * rim + cap * cap) / 6.0 + pi * rim * rim * z;
            let off = 1.0 - mesh.volume() / exact;
            assert!(off > 0.0 && off < 4.0 * error, "{error}: {off}");
        }
        assert!(bodies(&design, 0.0).is_err() && bodies(&design, 1e-13).is_err());
    }
}
