// SPDX-License-Identifier: MIT OR Apache-2.0
//! The bodies of a package as closed triangle meshes, for export.

use anyhow::Result;

use design::Design;
use files::formats::mesh::{Mesh, cuboid, revolved};

/// The bodies of one package: the dome with its relief (if it has one), then the LED box.
///
/// # Errors
/// If the relief cannot be built, or the chord error is none.
pub fn bodies(design: &Design, error_mm: f64) -> Result<Vec<Mesh>> {
    let mut bodies = Vec::new();
    if design.dome.is_some() {
        bodies.push(revolved("dome", &design.outline()?, error_mm)?);
    }
    let led = design.led.at(design.led.place(0));
    let corners = led.corners(0.0).map(|corner| corner.to_array());
    bodies.push(cuboid("led", corners));
    Ok(bodies)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_of_every_design_are_closed_and_face_outwards() {
        for (name, _) in design::EMBEDDED {
            let design = design::embedded(name).expect("valid");
            for mesh in bodies(&design, 5e-4).expect("a mesh") {
                assert!(mesh.is_closed(), "{name} {}", mesh.name);
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
