// SPDX-License-Identifier: MIT OR Apache-2.0
//! Round trips through every format: energy is conserved and directions stay within their cells.

use super::*;
use crate::lighttools::convert::{from_lighttools, to_lighttools};
use crate::lighttools::layout as lighttools;
use crate::speos::convert::{from_speos, to_speos};
use crate::speos::layout as speos;
use crate::window::convert::{from_window, to_klems, to_tree};
use crate::window::layout as window;
use crate::zemax::convert::{from_zemax, to_zemax};
use crate::zemax::layout as zemax;
use bsdf::measured::LobeMotion;
use bsdf::{Grid, MeasuredBsdf, OrderEfficiency, OrderTable, TableHeader};
use rand::SeedableRng;
use rand_pcg::Pcg64;

const INDICES: [f64; 2] = [1.41, 1.0];

/// A lossless table with five orders on either side, lopsided so that no mistaken sign goes unseen.
fn table() -> OrderTable {
    let grid = Grid {
        period: 2.75,
        wavelength: 0.55,
        index_inner: INDICES[0],
        index_outer: INDICES[1],
        kx_per_zone: 2,
        ky: vec![0.0, 0.3, 0.6, 0.9, 0.99, 1.2, 1.38],
    };
    let rows = grid.rows(|side, kx, ky, _| {
        let zone = 0.2;
        let mut orders = Vec::new();
        for to in Side::BOTH {
            for order in -2..=2 {
                let (n, kx) = (grid.index(to), kx + f64::from(order) * zone);
                if kx * kx + ky * ky < n * n {
                    let weight = 1.0 + 0.3 * f64::from(order) + if to == side { 0.5 } else { 0.0 };
                    orders.push((to, order, weight.max(0.05)));
                }
            }
        }
        let sum: f64 = orders.iter().map(|o| o.2).sum();
        orders
            .into_iter()
            .map(|o: (Side, i32, f64)| OrderEfficiency::new(o.0, o.1, o.2 / sum))
            .collect()
    });
    OrderTable::build(TableHeader::default(), grid.clone(), rows).unwrap()
}

fn coarse() -> Resolution {
    Resolution { incidence_deg: 22.5, azimuth_deg: 45.0, scatter_deg: 2.0, samples: 1 }
}

/// Text of what `write` writes.
fn text(write: impl FnOnce(&mut Vec<u8>) -> std::io::Result<()>) -> String {
    let mut bytes = Vec::new();
    write(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// Power-weighted mean direction of the light from `wi` that leaves by `transport`, and its power.
fn mean(surface: &dyn Bsdf, wi: DVec3, transport: Transport) -> (DVec3, f64) {
    let lobes = surface.lobes(wi, Polarisation::Unpolarised);
    lobes
        .iter()
        .filter(|l| l.lobe.transport == transport)
        .fold((DVec3::ZERO, 0.0), |(sum, power), l| (sum + l.wo * l.power, power + l.power))
}

/// Compares where light goes with the table, at incidences given in degrees, for one side and type.
fn agrees(back: &MeasuredBsdf, side: Side, transport: Transport, at: &[[f64; 2]], off: f64) {
    let table = table();
    for [theta, phi] in at {
        let up = spherical(theta.to_radians(), phi.to_radians());
        let wi = DVec3::new(up.x, up.y, side.sign() * up.z);
        let (expected, got) = (mean(&table, wi, transport), mean(back, wi, transport));
        assert!(
            (expected.1 - got.1).abs() < 1e-6,
            "power from {side} at {theta}, {phi}: {} {}",
            expected.1,
            got.1
        );
        let distance = (expected.0 - got.0).length();
        assert!(distance < off, "{side} {transport:?} at {theta}, {phi}: {distance}");
    }
}

const BOTH: [Transport; 2] = [Transport::Reflection, Transport::Transmission];

#[test]
fn a_lighttools_file_holds_the_table() {
    let (content, smearing) = to_lighttools(&table(), 550.0, &coarse()).unwrap();
    assert!(smearing.worst_energy() < 1e-9 && smearing.mean_shift_deg < 1.5, "{smearing:?}");
    assert!(smearing.width_deg >= 2.0 && smearing.width_deg < 2.1);
    let written = text(|w| lighttools::write(&content, w));
    let read = lighttools::read(&written).unwrap();
    assert_eq!(text(|w| lighttools::write(&read, w)), written);
    assert_eq!(read.azimuths, content.azimuths);
    for between in [LobeMotion::Fixed, LobeMotion::Shifted] {
        let back = from_lighttools(&read, INDICES, between).unwrap();
        for side in Side::BOTH {
            for transport in BOTH {
                let nodes = [[22.5, 0.0], [45.0, 90.0], [67.5, 225.0], [0.0, 135.0]];
                agrees(&back, side, transport, &nodes, 0.01);
            }
        }
        assert!((back.largest_power() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_speos_file_holds_the_table_of_its_side() {
    let mut files = Vec::new();
    for side in Side::BOTH {
        let (content, smearing) = to_speos(&table(), side, &coarse()).unwrap();
        assert!(smearing.worst_energy() < 1e-9 && smearing.mean_shift_deg < 1.5, "{smearing:?}");
        let written = text(|w| speos::write(&content, w));
        let read = speos::read(written.as_bytes()).unwrap();
        assert_eq!(text(|w| speos::write(&read, w)), written);
        files.push((side, read));
    }
    let files: Vec<_> = files.iter().map(|(side, file)| (*side, file)).collect();
    let back = from_speos(&files, INDICES, LobeMotion::Fixed).unwrap();
    for side in Side::BOTH {
        for transport in BOTH {
            let nodes = [[22.5, 0.0], [45.0, 90.0], [67.5, 225.0], [0.0, 135.0]];
            agrees(&back, side, transport, &nodes, 0.01);
        }
    }
    assert!((back.largest_power() - 1.0).abs() < 1e-6);
}

#[test]
fn speos_files_of_the_converter_are_normalised_as_the_help_says() {
    let at = |degrees: f64| spherical(f64::to_radians(degrees), 0.3);
    // Both incidences have the same values, so the spectrum at 0 degrees is the share of both.
    let file = include_bytes!("../../../../tests/formats/corpus/small.anisotropicbsdf");
    let file = speos::read(file).unwrap();
    assert_eq!(file.warnings.len(), 1, "{:?}", file.warnings);
    let back = from_speos(&[(Side::Outer, &file)], [1.0, 1.0], LobeMotion::Fixed).unwrap();
    // Transmission falls from 50 to 40 % between 360 and 830 nm.
    let transmitted = 0.5 - 0.1 * (550.0 - 360.0) / (830.0 - 360.0);
    for incidence in [0.0, 30.0, 60.0] {
        let albedo = back.albedo(at(incidence), Polarisation::Unpolarised);
        assert!((albedo.reflected - 0.3).abs() < 1e-9, "{albedo:?}");
        assert!((albedo.transmitted - transmitted).abs() < 1e-9, "{albedo:?}");
    }
    // The table for 560 nm, 40 %.
    let file = include_bytes!("../../../../tests/formats/corpus/small.brdf");
    let file = speos::read(file).unwrap();
    let back = from_speos(&[(Side::Outer, &file)], [1.0, 1.0], LobeMotion::Fixed).unwrap();
    let albedo = back.albedo(at(30.0), Polarisation::Unpolarised);
    assert!((albedo.reflected - 0.4).abs() < 1e-9 && albedo.transmitted == 0.0);
}

#[test]
fn a_mirror_of_a_speos_file_lies_where_light_goes_on() {
    // One cell about the specular direction at 45 degrees, azimuth 0.
    let text = "OPTIS - Anisotropic BSDF surface file v8.0\n0\n\n0\n\n1\t0\t0\n1\t0\n1\n1\n0\n1\n45\n\
                45\t0\n\n1\n550\t80\n4 5\n\t0\t10\t120\t240\t350\n\
                0\t0\t0\t0\t0\t0\n40\t0\t0\t0\t0\t0\n45\t1\t0\t0\t0\t0\n50\t0\t0\t0\t0\t0\nEnd of file\n";
    let file = speos::read(text.as_bytes()).unwrap();
    let back = from_speos(&[(Side::Outer, &file)], [1.0, 1.0], LobeMotion::Fixed).unwrap();
    for phi in [0.0, 1.0, 4.0] {
        let wi = spherical(45_f64.to_radians(), phi);
        let (sum, power) = mean(&back, wi, Transport::Reflection);
        assert!((power - 0.8).abs() < 1e-9, "{power}");
        let mirror = DVec3::new(-wi.x, -wi.y, wi.z);
        assert!(sum.normalize().angle_between(mirror) < 0.02, "{sum:?}");
    }
}

#[test]
fn speos_files_that_are_wrong_are_named() {
    let good = "OPTIS - brdf surface file v8.0\n0\nx\n0\n\n1\t0\n1\n1\t1\n0\n550\n40\n2 3\n\t0 120 240\n0 1 1 1\n90 1 1 1\n";
    assert!(speos::read(good.as_bytes()).is_ok());
    for (from, to, message) in [
        ("OPTIS - brdf", "OPTIS - bsdf180", "line 1: expected `OPTIS - Anisotropic BSDF"),
        (
            "\n0\nx",
            "\n1\nx",
            "line 2: expected 0 (text): the layout of mode 1 (binary) is not public",
        ),
        ("\n1\t0\n", "\n0\t0\n", "expected reflection or transmission or both, got neither"),
        ("\n40\n", "\n140\n", "line 11: expected a percentage: 0 to 100, got `140`"),
        ("\n0\n\n1", "\n900\n\n1", "expected 900 characters of text"),
        ("90 1 1 1", "90 1 -1 1", "line 15: expected a value of the BSDF: 0 or more, got `-1`"),
        ("90 1 1 1", "90 1 1", "expected a value of the BSDF, got the end of the file"),
        ("90 1 1 1", "0 1 1 1", "line 15: expected theta: ascending"),
        ("2 3\n", "2 3000000000\n", "number of phi angles: a whole number from 1 to"),
        (
            "90 1 1 1\n",
            "90 1 1 1\n7\n",
            "expected the end of the file after the last table, got `7`",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let got = speos::read(good.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(got.to_string().contains(message), "{from}: {got}");
    }
    let half = good.replace("0 120 240", "0 90 180");
    let file = speos::read(half.as_bytes()).unwrap();
    let got = from_speos(&[(Side::Outer, &file)], [1.0, 1.0], LobeMotion::Fixed).unwrap_err();
    assert!(got.to_string().contains("around the whole circle, got 0 to 180"), "{got}");
}

#[test]
fn shifting_between_nodes_finds_the_orders_that_fixed_lobes_miss() {
    let finer =
        Resolution { incidence_deg: 11.25, azimuth_deg: 22.5, scatter_deg: 3.0, samples: 1 };
    let (content, _) = to_lighttools(&table(), 550.0, &finer).unwrap();
    let table = table();
    let incidences = [0.1, 0.3, 0.5, 0.6, 0.8, 0.9].map(|polar| spherical(polar, 0.2));
    let off = |between| {
        let back = from_lighttools(&content, INDICES, between).unwrap();
        let each = incidences.map(|wi| {
            let expected = mean(&table, wi, Transport::Reflection).0;
            (mean(&back, wi, Transport::Reflection).0 - expected).length()
        });
        each.iter().sum::<f64>() / each.len() as f64
    };
    let (fixed, shifted) = (off(LobeMotion::Fixed), off(LobeMotion::Shifted));
    assert!(shifted < 0.01 && fixed > 1.2 * shifted, "{fixed} {shifted}");
}

#[test]
fn zemax_files_hold_the_table_where_they_can() {
    let table = table();
    let mut contents = Vec::new();
    for side in Side::BOTH {
        for scatter in [Transport::Reflection, Transport::Transmission] {
            let (content, smearing) = to_zemax(&table, side, scatter, &coarse()).unwrap();
            assert!(smearing.worst_energy() < 1e-3, "{}", smearing.worst_energy());
            let written = text(|w| zemax::write(&content, w));
            let read = zemax::read(&written).unwrap();
            assert_eq!(text(|w| zemax::write(&read, w)), written);
            contents.push((side, read));
        }
    }
    let back = |transport: Transport| {
        let files: Vec<_> = contents
            .iter()
            .filter(|(_, b)| b.transport == transport)
            .map(|(s, b)| (*s, b))
            .collect();
        from_zemax(&files, INDICES, LobeMotion::Fixed).unwrap()
    };
    let (reflected, passed) = (back(Transport::Reflection), back(Transport::Transmission));
    for side in Side::BOTH {
        let nodes = [[22.5, 45.0], [45.0, 270.0], [67.5, 180.0], [0.0, 90.0]];
        agrees(&reflected, side, Transport::Reflection, &nodes, 0.01);
    }
    // Transmission is listed by the angle behind the surface: 22.5 degrees in air come from 15.74
    // in silicone.
    let inside = |deg: f64| (deg.to_radians().sin() / 1.41).asin().to_degrees();
    let nodes = [[inside(22.5), 45.0], [inside(45.0), 270.0]];
    agrees(&passed, Side::Inner, Transport::Transmission, &nodes, 0.01);
    // Beyond the critical angle such a table knows nothing.
    let beyond = spherical(std::f64::consts::PI - 0.9, 0.0);
    assert!(mean(&passed, beyond, Transport::Transmission).1 == 0.0);
    assert!(mean(&table, beyond, Transport::Transmission).1 > 0.1);
    // Both types of one side together never give out more than comes in.
    let files: Vec<_> = contents.iter().map(|(s, b)| (*s, b)).collect();
    let all = from_zemax(&files, INDICES, LobeMotion::Fixed).unwrap();
    let albedo = all.albedo(spherical(std::f64::consts::PI - 0.78, 0.3), Polarisation::S);
    assert!(all.largest_power() > 1.0 && albedo.total() <= 1.0 + 1e-12);
    // From air, a specular ray in silicone at 45 degrees comes from 85.6 degrees; that at 67.5 from
    // nowhere.
    let outer =
        contents.iter().find(|(s, b)| *s == Side::Outer && b.transport == Transport::Transmission);
    assert_eq!(outer.map(|(_, b)| b.incidences.clone()), Some(vec![0.0, 22.5, 45.0]));
}

#[test]
fn klems_matrices_and_trees_keep_the_energy_of_every_incidence() {
    let table = table();
    for (content, smearing) in [to_klems(&table, 9).unwrap(), to_tree(&table, 4, 4).unwrap()] {
        assert!(smearing.worst_energy() < 1e-6, "{}", smearing.worst_energy());
        let written = text(|w| window::write(&content, w));
        let read = window::read(&written).unwrap();
        assert_eq!(text(|w| window::write(&read, w)), written);
        let back = from_window(&read, INDICES, LobeMotion::Fixed).unwrap();
        assert!((back.largest_power() - 1.0).abs() < 1e-5, "{}", back.largest_power());
        // Sums over whole cells of incidence, which are 10 degrees and more wide.
        for side in Side::BOTH {
            for transport in BOTH {
                let mut rng = Pcg64::seed_from_u64(2);
                let wi = DVec3::new(0.31, -0.22, side.sign() * 0.925).normalize();
                let (expected, got) = (mean(&table, wi, transport), mean(&back, wi, transport));
                assert!((expected.0 - got.0).length() < 0.12, "{expected:?} {got:?}");
                let mut drawn = DVec3::ZERO;
                for _ in 0..20_000 {
                    if let Some(s) = back.sample(wi, &mut rng)
                        && s.lobe.transport == transport
                    {
                        drawn += s.wo / 20_000.0;
                    }
                }
                // Middles of Klems cells stand for wide cells.
                assert!((drawn - got.0).length() < 0.05, "{drawn:?} {got:?}");
            }
        }
    }
}

#[test]
fn isotropic_files_turn_with_the_light() {
    let text = "Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\nScatterType BRDF\n\
                SampleRotation 1\n0\nAngleOfIncidence 2\n0 60\nScatterAzimuth 3\n0 90 180\nScatterRadial 3\n0 5 10\n\n\
                Monochrome\nDataBegin\nTIS 0.5\n9 1 0\n9 1 0\n9 1 0\nTIS 0.7\n9 2 0\n9 1 0\n9 0 0\nDataEnd\n";
    let file = zemax::read(text).unwrap();
    let back = from_zemax(&[(Side::Outer, &file)], [1.0, 1.0], LobeMotion::Shifted).unwrap();
    for phi in [0.0, 1.0, 4.0] {
        for theta in [0.3_f64, 0.8] {
            let wi = spherical(theta, phi);
            let (sum, power) = mean(&back, wi, Transport::Reflection);
            let weight = theta.to_degrees() / 60.0;
            assert!((power - (0.5 + 0.2 * weight)).abs() < 1e-9, "{power}");
            let mirror = DVec3::new(-wi.x, -wi.y, wi.z);
            assert!(sum.normalize().angle_between(mirror) < 0.04, "{sum:?}");
        }
    }
}

#[test]
fn resolutions_that_are_none_and_diffuse_surfaces_are_refused() {
    let table = table();
    for bad in [
        Resolution { scatter_deg: 0.7, ..coarse() },
        Resolution { incidence_deg: 0.0, ..coarse() },
        Resolution { azimuth_deg: f64::NAN, ..coarse() },
        Resolution { incidence_deg: 0.1, azimuth_deg: 0.1, scatter_deg: 0.1, samples: 1 },
    ] {
        assert!(to_lighttools(&table, 550.0, &bad).is_err(), "{bad:?}");
        assert!(to_zemax(&table, Side::Inner, Transport::Reflection, &bad).is_err());
    }
    let matt = bsdf::Lambertian::new(0.8, 1.0).unwrap();
    assert!(to_klems(&matt, 4).is_err() && to_klems(&table, 0).is_err());
    assert!(to_tree(&table, 0, 1).is_err() && to_tree(&table, 8, 1).is_err());
}

#[test]
fn averaging_moves_orders_to_the_node_and_keeps_power() {
    let table = table();
    let averaged = Resolution { samples: 24, ..coarse() };
    let (content, smearing) = to_lighttools(&table, 550.0, &averaged).unwrap();
    assert!(smearing.worst_energy() < 1e-9 && smearing.mean_shift_deg < 1.5);
    let back = from_lighttools(&content, INDICES, LobeMotion::Fixed).unwrap();
    assert!((back.largest_power() - 1.0).abs() < 1e-6);
    // Means over 22.5 degrees and more differ from the node, but the orders have not moved: as many
    // cells with power as before, or those of orders that propagate nearby only.
    let (alone, _) = to_lighttools(&table, 550.0, &coarse()).unwrap();
    for (a, b) in content.blocks.iter().zip(&alone.blocks) {
        let strong = |block: &lighttools::LightToolsBlock| {
            block.values.iter().enumerate().filter(|v| *v.1 > 1e-3).map(|v| v.0).collect::<Vec<_>>()
        };
        let missing = strong(b).iter().filter(|c| a.values[**c] == 0.0).count();
        assert!(missing <= 1, "{missing} at {} {}", b.incidence, b.plane);
    }
}
