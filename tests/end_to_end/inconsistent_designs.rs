// SPDX-License-Identifier: MIT OR Apache-2.0
//! Designs whose files contradict the package: rays that start outside, meshes that intersect.
//!
//! `check` and `run` refuse them with file and key before they write anything.

use std::fs::File;
use std::path::Path;

use formats::lighttools_rays::layout as lighttools_rays;
use tempfile::tempdir;
use tracer::RayRecord;

use formats::stl;
use simulate::bodies::bodies;

use crate::support::binary::batwing;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/designs");

fn design(name: &str) -> String {
    std::fs::read_to_string(Path::new(FOLDER).join(name)).expect("the design")
}

/// The smooth dome as a solid in `dome.stl`, and a design that uses it.
fn with_mesh(folder: &Path) -> String {
    let bare = design::load(&Path::new(FOLDER).join("bare-dome.toml")).expect("valid");
    let mut dome = bodies(&bare, 1e-2).expect("a mesh");
    dome.truncate(1);
    let mut bytes = Vec::new();
    stl::write(&dome, "dome", &mut bytes).expect("written");
    std::fs::write(folder.join("dome.stl"), bytes).expect("written");
    let sphere = "sphere_radius_mm = 2.0\nheight_mm = 1.0\nwidth_mm = 3.4\n";
    let (bare, mesh) = (design("bare-dome.toml"), "mesh = \"dome.stl\"\nmesh_unit = \"mm\"\n");
    assert!(bare.contains(sphere));
    bare.replace(sphere, mesh)
}

/// Both commands refuse the text in one line that says all of this, and leave nothing behind.
fn refused(folder: &Path, text: &str, says: &[&str]) {
    std::fs::write(folder.join("bad.toml"), text).expect("written");
    for command in [&["check", "bad.toml"][..], &["run", "bad.toml", "--out", "out"]] {
        let output = batwing(folder).args(command).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{command:?} accepts {text}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        for word in ["bad.toml: "].iter().chain(says) {
            assert!(said.contains(word), "{said} lacks {word}");
        }
        assert!(!folder.join("out").exists() && !folder.join(".batwing-cache").exists());
    }
}

fn write_rays(path: &Path, rays: &[RayRecord]) {
    let mut writer = lighttools_rays::LightToolsWriter::new(File::create(path).expect("created"))
        .expect("begun");
    for ray in rays {
        writer.write(ray).expect("written");
    }
    writer.finish().expect("finished");
}

#[test]
fn a_ray_that_starts_outside_is_named_by_file_and_number() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let ray = |position: [f32; 3], z: f32| RayRecord {
        position,
        direction: [(1.0 - z * z).sqrt(), 0.0, z],
        flux: 1.0,
        wavelength: 550.0,
    };
    let source = "\n[files.source]\nfile = \"led.ray\"\n";
    let d1 = design("d1.toml") + source;
    // Positions are measured from the middle of the top of the box, 0.35 mm high; the dome ends 1
    // mm above the bottom. One ray goes down and is not used.
    let good = || -> Vec<RayRecord> {
        let place = |k: u32| [0.001 * (k % 400) as f32, 0.3, 0.01];
        let mut rays: Vec<RayRecord> = (0..3000).map(|k| ray(place(k), 0.8)).collect();
        rays[7] = ray([0.0, 0.0, 0.01], -0.8);
        rays
    };
    write_rays(&at.join("led.ray"), &good());
    std::fs::write(at.join("good.toml"), &d1).expect("written");
    let output = batwing(at).args(["check", "good.toml"]).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for place in [[0.0, 0.0, 0.9], [1.9, 0.0, 0.0], [0.0, 4.2, 0.1]] {
        let mut rays = good();
        rays[2000] = ray(place, 0.8);
        write_rays(&at.join("led.ray"), &rays);
        let says = [
            "files.source.file = \"led.ray\": expected",
            "ray 2001 starts at [",
            "expected a start in silicone, got one from which",
        ];
        refused(at, &d1, &says);
    }
}

#[test]
fn parts_that_cut_each_other_are_refused() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let meshed = with_mesh(at);
    // A box whose corners the mesh holds, but with a dent from the pole into its top.
    let mut dented = std::fs::read(at.join("dome.stl")).expect("the mesh");
    for triangle in dented[84..].chunks_exact_mut(50) {
        for corner in triangle[12..48].chunks_exact_mut(12) {
            let z = f32::from_le_bytes(corner[8..].try_into().expect("four bytes"));
            if z > 0.9999 {
                corner[8..].copy_from_slice(&0.1_f32.to_le_bytes());
            }
        }
    }
    std::fs::write(at.join("dented.stl"), dented).expect("written");
    let says = ["led.size_mm = [1, 1] and 0.35 mm high", "'dome'", "cut each other near ["];
    refused(at, &meshed.replace("dome.stl", "dented.stl"), &says);

    // Two domes in one file, one half into the other.
    let bytes = std::fs::read(at.join("dome.stl")).expect("the mesh");
    let count = u32::from_le_bytes(bytes[80..84].try_into().expect("four bytes"));
    let mut twice = bytes[..80].to_vec();
    twice.extend((2 * count).to_le_bytes());
    twice.extend(&bytes[84..]);
    for triangle in bytes[84..].chunks_exact(50) {
        let mut triangle = triangle.to_vec();
        for value in triangle[12..48].chunks_exact_mut(4) {
            let scaled = f32::from_le_bytes(value.try_into().expect("four bytes")) * 0.9;
            value.copy_from_slice(&scaled.to_le_bytes());
        }
        for corner in 0..3 {
            let x = 12 + 12 * corner;
            let value = f32::from_le_bytes(triangle[x..x + 4].try_into().expect("four bytes"));
            triangle[x..x + 4].copy_from_slice(&(value + 0.168).to_le_bytes());
            let z = x + 8;
            let value = f32::from_le_bytes(triangle[z..z + 4].try_into().expect("four bytes"));
            triangle[z..z + 4].copy_from_slice(&(value + 0.05).to_le_bytes());
        }
        twice.extend(triangle);
    }
    std::fs::write(at.join("twice.stl"), twice).expect("written");
    let says = ["dome.mesh", "twice.stl", "triangles ", "cut each other at ["];
    refused(at, &meshed.replace("dome.stl", "twice.stl"), &says);
}

#[test]
fn paths_through_a_mesh_are_drawn_with_its_section() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("mesh.toml"), with_mesh(at)).expect("written");
    let arguments = ["rays", "mesh.toml", "--count", "60", "--out", "out", "--quiet"];
    let output = batwing(at).args(arguments).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let picture =
        std::fs::read_to_string(at.join("out/bare-dome-geometric-rays.svg")).expect("drawn");
    // What lies beside the plane is a line of its own.
    let lines = picture.matches("stroke-opacity").count();
    assert!((61..=120).contains(&lines) && picture.contains("beside the plane"), "{lines}");
    // The outline of the solid: many straight stretches, closed.
    let outline = picture.lines().find(|line| line.contains("#e8f1f8")).expect("a dome");
    assert!(outline.matches(" L ").count() > 20 && outline.contains("Z\""), "{outline}");
}
