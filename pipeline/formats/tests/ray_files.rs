// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray files: what is written comes back, what is wrong is named, what leaves a scene can be its
//! source again.

use std::f64::consts::PI;
use std::io::Cursor;
use std::sync::Arc;

use crate::common::source_power_by_direction;
use formats::lighttools_rays::layout as lighttools_rays;
use formats::speos_rays::layout as speos_rays;
use formats::tm25::layout as tm25;
use formats::zemax_rays::layout as zemax_rays;
use tracer::RayRecord;
use tracer::glam::DVec3;
use tracer::{
    Control, Emission, Emitter, Medium, RaySet, Region, SceneBuilder, Settings, Source, random,
    run_rays,
};

fn records(count: u32) -> Vec<RayRecord> {
    let mut rng = random::stream(6, 0);
    (0..count)
        .map(|k| {
            let d = random::isotropic(&mut rng);
            RayRecord {
                position: [k as f32, 0.5, -1.0],
                direction: [d.x as f32, d.y as f32, d.z as f32],
                flux: 1e-3 * (1 + k % 3) as f32,
                wavelength: 550.0,
            }
        })
        .collect()
}

fn about() -> tm25::Tm25Metadata {
    let mut descriptions: [String; 9] = Default::default();
    "dome µ".clone_into(&mut descriptions[0]);
    tm25::Tm25Metadata {
        wavelength: 550.0,
        per_ray: false,
        lumens_per_watt: 680.0,
        date: "2020-01-02T03:04:05Z".to_owned(),
        descriptions,
    }
}

fn tm25_file(rays: &[RayRecord]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = tm25::Tm25Writer::new(&mut file, &about()).unwrap();
    for ray in rays {
        writer.write(ray).unwrap();
    }
    writer.finish().unwrap();
    file.into_inner()
}

fn lighttools_file(rays: &[RayRecord]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = lighttools_rays::LightToolsWriter::new(&mut file).unwrap();
    for ray in rays {
        writer.write(ray).unwrap();
    }
    writer.finish().unwrap();
    file.into_inner()
}

fn near(a: &RayRecord, b: &RayRecord) -> bool {
    let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    let same = |a: f32, b: f32| a.to_bits() == b.to_bits();
    a.position.iter().zip(b.position).all(|(a, b)| same(*a, b))
        && close(a.direction, b.direction)
        && same(a.flux, b.flux)
}

#[test]
fn ray_files_come_back_and_their_flux_is_that_of_the_header() {
    // More than one block of a megabyte.
    let rays = records(50_000);
    let sum: f64 = rays.iter().map(|r| f64::from(r.flux)).sum();

    let bytes = tm25_file(&rays);
    assert_eq!(bytes.len(), 36_288 + 28 * rays.len());
    let mut reader = tm25::Tm25Reader::new(&bytes[..], Some(bytes.len() as u64)).unwrap();
    let header = reader.header().clone();
    assert_eq!((header.rays, header.spectrum), (50_000, tm25::Spectrum::Single(550.0)));
    assert_eq!(header.descriptions[0], "dome µ");
    assert!((header.luminous_flux / header.radiant_flux - 680.0).abs() < 1e-3);
    for ray in &rays {
        assert!(near(&reader.next_ray().unwrap().unwrap(), ray));
    }
    assert_eq!(reader.next_ray().unwrap(), None);
    assert!((reader.sum() / sum - 1.0).abs() < 1e-12);
    assert!((f64::from(header.flux().unwrap()) / sum - 1.0).abs() < 1e-6);

    let bytes = lighttools_file(&rays);
    let mut reader = lighttools_rays::LightToolsReader::new(&bytes[..]).unwrap();
    for ray in &rays {
        assert!(near(&reader.next_ray().unwrap().unwrap(), ray));
    }
    assert_eq!(reader.next_ray().unwrap(), None);
    assert!((f64::from(reader.header().flux) / sum - 1.0).abs() < 1e-6);
}

#[test]
fn speos_and_zemax_files_come_back_with_their_wavelengths() {
    let mut rays = records(50_000);
    for (k, ray) in rays.iter_mut().enumerate() {
        ray.wavelength = 400.0 + (k % 300) as f32;
    }
    let sum: f64 = rays.iter().map(|r| f64::from(r.flux)).sum();

    let mut file = Cursor::new(Vec::new());
    let mut writer = speos_rays::SpeosWriter::new(&mut file).unwrap();
    for ray in &rays {
        writer.write(ray, 2.0 * f64::from(ray.flux)).unwrap();
    }
    writer.finish().unwrap();
    let bytes = file.into_inner();
    let length = bytes.len() as u64;
    assert_eq!(bytes.len(), 28 + 32 * rays.len());
    assert!(speos_rays::begins_like_one(&bytes[..64], length));
    let mut reader = speos_rays::SpeosReader::new(&bytes[..], length).unwrap();
    let header = *reader.header();
    assert!((f64::from(header.radiant_flux) / sum - 1.0).abs() < 1e-6);
    assert!((f64::from(header.luminous_flux) / sum - 2.0).abs() < 1e-6);
    for ray in &rays {
        let read = reader.next_ray().unwrap().unwrap();
        assert!(near(&read, ray) && read.wavelength.to_bits() == ray.wavelength.to_bits());
    }
    assert_eq!(reader.next_ray().unwrap(), None);

    for coloured in [true, false] {
        let about = zemax_rays::ZemaxMetadata {
            description: "LED".to_owned(),
            wavelength: 460.0,
            coloured,
            radiant: coloured,
        };
        let mut file = Cursor::new(Vec::new());
        let mut writer = zemax_rays::ZemaxWriter::new(&mut file, &about).unwrap();
        for ray in &rays {
            writer.write(ray).unwrap();
        }
        writer.finish().unwrap();
        let mut bytes = file.into_inner();
        let stride = if coloured { 32 } else { 28 };
        assert_eq!(bytes.len(), 208 + stride * rays.len());
        let length = Some(bytes.len() as u64);
        let mut reader = zemax_rays::ZemaxReader::new(&bytes[..], length).unwrap();
        let header = reader.header().clone();
        assert_eq!((header.rays, header.radiant), (50_000, coloured));
        assert_eq!((&*header.description, header.coloured), ("LED", coloured));
        assert!((f64::from(header.flux) / sum - 1.0).abs() < 1e-6);
        for ray in &rays {
            let read = reader.next_ray().unwrap().unwrap();
            assert!(near(&read, ray));
            if coloured {
                assert!((read.wavelength - ray.wavelength).abs() < 1e-4 * ray.wavelength);
            } else {
                assert!(read.wavelength.is_nan());
            }
        }
        assert_eq!(reader.next_ray().unwrap(), None);
        // The same lengths in inches.
        bytes[136] = 1;
        let mut reader = zemax_rays::ZemaxReader::new(&bytes[..], length).unwrap();
        let first = reader.next_ray().unwrap().unwrap();
        assert!((first.position[1] - 25.4 * rays[0].position[1]).abs() < 1e-5);
    }
}

#[test]
fn speos_and_zemax_files_that_are_wrong_are_named() {
    let mut file = Cursor::new(Vec::new());
    let about = zemax_rays::ZemaxMetadata {
        description: String::new(),
        wavelength: f32::NAN,
        coloured: false,
        radiant: true,
    };
    let mut writer = zemax_rays::ZemaxWriter::new(&mut file, &about).unwrap();
    for ray in &records(10) {
        writer.write(ray).unwrap();
    }
    writer.finish().unwrap();
    let good = file.into_inner();
    let with = |at: usize, value: u32| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&value.to_le_bytes());
        bad
    };
    for (bad, message) in [
        (with(0, 7), "offset 0: expected 1010 or 8675309"),
        (with(4, 11), "offset 208: expected 516 bytes in all (11 rays of 28), got 488"),
        (with(4, u32::MAX), "(4294967295 rays of 28), got 488"),
        (with(136, 9), "offset 136: expected a unit of length"),
        (with(192, 1), "offset 192: expected ray format 0"),
        (with(196, 2), "offset 196: expected flux type 0"),
        (with(208, f32::NAN.to_bits()), "offset 208: expected a finite position"),
        (with(232, (-1.0_f32).to_bits()), "offset 232: expected a flux of 0 or more"),
        (good[..100].to_vec(), "offset 0: expected 208 bytes"),
    ] {
        let length = Some(bad.len() as u64);
        let outcome = zemax_rays::ZemaxReader::new(&bad[..], length).and_then(|mut reader| {
            while reader.next_ray()?.is_some() {}
            Ok(())
        });
        let got = outcome.unwrap_err().to_string();
        assert!(got.contains(message), "{message}: {got}");
    }
    let short = [1.0_f32; 8].map(f32::to_le_bytes).concat();
    let got = speos_rays::SpeosReader::new(&short[..], 32).err().unwrap();
    assert!(got.to_string().contains("whole rays of 32 bytes"), "{got}");
    let mut writer = speos_rays::SpeosWriter::new(Cursor::new(Vec::new())).unwrap();
    let unknown = RayRecord { wavelength: f32::NAN, ..records(1)[0] };
    let got = writer.write(&unknown, 0.0).unwrap_err().to_string();
    assert!(got.contains("a wavelength for every ray, got NaN"), "{got}");
}

fn tm25_error(bytes: &[u8], length: Option<u64>) -> String {
    let outcome = tm25::Tm25Reader::new(bytes, length).and_then(|mut reader| {
        while reader.next_ray()?.is_some() {}
        Ok(())
    });
    outcome.unwrap_err().to_string()
}

fn lighttools_error(bytes: &[u8]) -> String {
    let outcome = lighttools_rays::LightToolsReader::new(bytes).and_then(|mut reader| {
        while reader.next_ray()?.is_some() {}
        Ok(())
    });
    outcome.unwrap_err().to_string()
}

#[test]
fn ray_files_that_are_wrong_are_named() {
    let good = tm25_file(&records(10));
    let with = |at: usize, bytes: [u8; 4]| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&bytes);
        bad
    };
    for (bad, message) in [
        (with(0, *b"TM26"), "offset 0: expected \"TM25\", got \"TM26\""),
        (with(4, 2020_u32.to_le_bytes()), "offset 4: expected version 2013, got 2020"),
        (with(60, 9_u32.to_le_bytes()), "offset 60: expected spectral identifier: 0 to 4, got 9"),
        (with(256, 0_u32.to_le_bytes()), "offset 256: expected flag of the position: 1, got 0"),
        (with(264, 0_u32.to_le_bytes()), "offset 264: expected radiant or luminous flux"),
        (with(60, 2_u32.to_le_bytes()), "offset 60: expected a column for the spectrum"),
        (
            with(76, (-1_i32).to_le_bytes()),
            "offset 76: expected number of spectral tables: 0 to 65536, got -1",
        ),
        (with(36_288, f32::NAN.to_le_bytes()), "offset 36288: expected a finite position"),
        (with(36_288 + 28 + 12, 3_f32.to_le_bytes()), "offset 36328: expected a unit vector"),
        (
            with(36_288 + 24, (-1_f32).to_le_bytes()),
            "offset 36312: expected a flux of 0 or more, got -1",
        ),
        (good[..36_288 + 100].to_vec(), "expected 10 rays of 28 bytes, got the end after 3 rays"),
        (good[..200].to_vec(), "offset 4: expected 36284 bytes of a TM-25 header, got 196"),
        (
            [good.clone(), vec![0]].concat(),
            "offset 36568: expected the end after 10 rays, got more bytes",
        ),
    ] {
        let got = tm25_error(&bad, None);
        assert!(got.contains(message), "{message}: {got}");
    }
    let got = tm25_error(&good, Some(good.len() as u64 + 4));
    assert!(got.contains("expected 36568 bytes in all (10 rays of 28), got 36572"), "{got}");
}

#[test]
fn lighttools_ray_files_that_are_wrong_are_named() {
    let good = lighttools_file(&records(10));
    let with = |at: usize, bytes: [u8; 4]| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&bytes);
        bad
    };
    for (bad, message) in [
        (with(0, *b"LTRX"), "offset 0: expected \"LTRF\""),
        (with(4, 3_u32.to_le_bytes()), "offset 4: expected major version 2, got 3"),
        (
            with(16, 1_u32.to_le_bytes()),
            "offset 16: expected far field 0 (rays with their starts), got 1",
        ),
        (with(20, 1_u32.to_le_bytes()), "got 1 (tristimulus values)"),
        (
            with(24, 0_u32.to_le_bytes()),
            "offset 24: expected a unit of length from 1 (mm) to 7 (nm), got 0",
        ),
        (with(40, f32::INFINITY.to_le_bytes()), "offset 40: expected a flux of 0 or more, got inf"),
        (
            with(44 + 28 + 24, f32::NAN.to_le_bytes()),
            "offset 96: expected a flux of 0 or more, got NaN",
        ),
        (good[..good.len() - 9].to_vec(), "\"LTRFEND\" after whole rays of 28 bytes"),
        ([good.clone(), vec![0; 40]].concat(), "offset 336: expected a unit vector"),
    ] {
        let got = lighttools_error(&bad);
        assert!(got.contains(message), "{message}: {got}");
    }
}

#[test]
fn rays_that_leave_a_scene_carry_its_power_and_can_be_its_source_again() {
    let mut scene = SceneBuilder::new(Medium::air());
    let source = Source::new(
        "s",
        DVec3::new(0.1, 0.2, 0.3),
        Region::World,
        Emitter::Disc { radius: 0.5 },
        Emission::LAMBERTIAN,
    );
    let scene = scene.source(source).power(2.0).build().unwrap();
    let collect = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut rays = Vec::new();
            let settings = Settings::new(60_000, 9);
            let outcome = run_rays(&scene, &settings, Control::default(), |ray, power| {
                rays.push((*ray, power));
                Ok(())
            })
            .unwrap();
            (outcome, rays)
        })
    };
    let (outcome, rays) = collect(1);
    assert!(collect(2).1 == rays);
    let power: f64 = rays.iter().map(|r| r.1).sum();
    assert!((power - 2.0).abs() < 1e-9 && (outcome.total.ledger.escaped() - power).abs() < 1e-9);

    let records = rays.iter().map(|(ray, power)| RayRecord {
        position: ray.origin.to_array().map(|v| v as f32),
        direction: ray.direction.to_array().map(|v| v as f32),
        flux: *power as f32,
        wavelength: f32::NAN,
    });
    let set = RaySet::new(records).unwrap();
    assert_eq!(set.len(), rays.len());
    let watts = source_power_by_direction(Emission::Rays(Arc::new(set)));
    // Lambertian: sin² of the edges of 10-degree rings.
    for (ring, row) in watts.chunks_exact(12).enumerate() {
        let edge = |k: usize| (k.min(9) as f64 * PI / 18.0).sin().powi(2);
        let (got, expected) = (row.iter().sum::<f64>(), edge(ring + 1) - edge(ring));
        // Drawn from 60 000 rays by 200 000 paths.
        let error = (expected / 46_000.0).sqrt();
        assert!((got - expected).abs() < 5.0 * error + 1e-9, "{ring}: {got} {expected}");
    }
    let none: [RayRecord; 0] = [];
    assert!(RaySet::new(none).is_err());
}
