// SPDX-License-Identifier: MIT OR Apache-2.0
//! Photometric and ray files: what is written comes back, what others write is understood, what is wrong is named.

use std::f64::consts::PI;
use std::io::Cursor;
use std::sync::Arc;

use tracer::format::rays::RayRecord;
use tracer::format::{eulumdat, ies, ltray, photometric_text, tm25};
use tracer::glam::DVec3;
use tracer::{
    Control, Distribution, Emission, Emitter, FarField, Medium, RaySet, Region, SceneBuilder,
    Settings, Source, random, run, run_rays,
};

/// Lopsided intensities at 10 degrees, to 0.001.
fn table() -> Distribution {
    let thetas: Vec<f64> = (0..=18).map(|k| f64::from(k) * 10.0).collect();
    let phis: Vec<f64> = (0..12).map(|k| f64::from(k) * 30.0).collect();
    let value = |t: f64, p: f64| {
        let (t, p) = (t.to_radians(), p.to_radians());
        let i = 100.0 * (1.0 + t.cos()) * (1.0 + 0.3 * (p - 0.5).cos() * t.sin());
        (i * 1e3).round() / 1e3
    };
    let values = phis
        .iter()
        .flat_map(|p| thetas.iter().map(move |t| value(*t, *p)))
        .collect();
    Distribution::new(&thetas, &phis, values).unwrap()
}

fn differ(a: &Distribution, b: &Distribution) -> f64 {
    let mut rng = random::stream(5, 0);
    (0..2000)
        .map(|_| random::isotropic(&mut rng))
        .map(|d| (a.intensity(d) - b.intensity(d)).abs())
        .fold(0.0, f64::max)
}

#[test]
fn an_ies_file_comes_back_relative_and_absolute() {
    for (lumens, absolute) in [(1500.0, false), (-1.0, true)] {
        let keywords = vec![("TEST".to_owned(), "T 1".to_owned())];
        let written = ies::Ies::from_distribution(&table(), keywords, lumens, 3.5);
        let text = ies::write(&written);
        assert!(text.lines().all(|l| l.len() <= 132));
        let read = ies::read(&text).unwrap();
        assert_eq!(read, written);
        assert_eq!((read.is_absolute(), ies::write(&read)), (absolute, text));
        assert!(differ(&read.distribution().unwrap(), &table()) < 1e-4);
    }
}

#[test]
fn an_ldt_file_comes_back_relative_and_absolute() {
    for (lamps, absolute) in [(1, false), (-1, true)] {
        let texts = ["maker", "1", "dome", "2", "dome.ldt", "today"].map(str::to_owned);
        let written = eulumdat::Ldt::from_distribution(&table(), texts, (lamps, 2000.0, 3.5));
        let text = eulumdat::write(&written);
        let read = eulumdat::read(&text).unwrap();
        assert_eq!(
            (read.is_absolute(), eulumdat::write(&read)),
            (absolute, text)
        );
        let back = read.distribution().unwrap();
        assert!(differ(&back, &table()) < 1e-4);
        let ratio = 100.0 * table().flux() / 2000.0;
        assert!(
            (read.ratios[1] / ratio - 1.0).abs() < 1e-4,
            "{:?}",
            read.ratios
        );
    }
}

/// A file of the layout of LM-63-1995 as luminaire makers write it, in quadrants, with a multiplier and odd line breaks.
const QUADRANTS: &str = "IESNA:LM-63-1995\r\n[TEST] 1\r\n[MANUFAC] x\r\nTILT=INCLUDE\r\n1\r\n2\r\n0 90\r\n1.0 0.9\r\n\
1 1000 2 3 3 1 2 0.1 0.2\r\n0\r\n0.9 1.0 20\r\n0,\t45 90\r\n0 45 90\r\n100 80 0\r\n100 60\r\n0\r\n100 40 10\r\n";

#[test]
fn symmetries_are_unfolded() {
    let table = ies::read(QUADRANTS).unwrap().distribution().unwrap();
    // Multiplier 2, ballast factor 0.9; C45 at gamma 45 in all quadrants.
    for phi in [45.0_f64, 135.0, 225.0, 315.0] {
        let (t, p) = (45_f64.to_radians(), phi.to_radians());
        let d = DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos());
        assert!((table.intensity(d) - 108.0).abs() < 1e-9);
    }
    let side = DVec3::new(0.0, -1.0, 1e-12).normalize();
    assert!((table.intensity(side) - 18.0).abs() < 1e-6);

    // EULUMDAT: intensities that name their plane, in every symmetry.
    for (symmetry, stored) in [
        (0, vec![0, 45, 90, 135, 180, 225, 270, 315]),
        (2, vec![0, 45, 90, 135, 180]),
        (3, vec![270, 315, 0, 45, 90]),
        (4, vec![0, 45, 90]),
        (1, vec![0]),
    ] {
        let mut lines: Vec<String> = ["x", "1"].map(str::to_owned).to_vec();
        lines.extend([
            symmetry.to_string(),
            "8".into(),
            "45".into(),
            "2".into(),
            "90".into(),
        ]);
        lines.extend(["r", "n", "1", "f", "d"].map(str::to_owned));
        lines.extend(vec!["0".to_owned(); 9]);
        lines.extend(
            ["100", "80", "1", "0", "1", "1", "LED", "1000", "", "", "9"].map(str::to_owned),
        );
        lines.extend(vec!["0".to_owned(); 10]);
        lines.extend((0..8).map(|k| (k * 45).to_string()));
        lines.extend(["0".to_owned(), "90".to_owned()]);
        for plane in &stored {
            lines.extend(["50".to_owned(), (100 + plane).to_string()]);
        }
        let file = eulumdat::read(&lines.join("\n")).unwrap();
        let table = file.distribution().unwrap();
        for plane in (0_i32..360).step_by(45) {
            let image = match symmetry {
                0 => plane,
                1 => 0,
                2 => plane.min(360 - plane),
                3 => (180 - plane + 360) % 360,
                _ => plane.min(360 - plane).min((180 - plane).abs()),
            };
            let image = if symmetry == 3 && stored.contains(&plane) {
                plane
            } else {
                image
            };
            let p = f64::from(plane).to_radians();
            let d = DVec3::new(p.cos(), p.sin(), 0.0);
            let got = table.intensity(d);
            assert!(
                (got - f64::from(100 + image)).abs() < 1e-6,
                "{symmetry} {plane}: {got}"
            );
        }
    }
}

#[test]
fn photometric_files_that_are_wrong_are_named() {
    let good = ies::write(&ies::Ies::from_distribution(
        &table(),
        Vec::new(),
        1500.0,
        1.0,
    ));
    for (from, to, message) in [
        (
            "IESNA:LM-63-2002",
            "IESNA:LM-63-2050",
            "line 1: expected a version line",
        ),
        (
            "TILT=NONE",
            "TILT=lamp.tlt",
            "TILT=INCLUDE, got `TILT=lamp.tlt`",
        ),
        (
            "TILT=NONE",
            "",
            "expected a line TILT=NONE, got the end of the file",
        ),
        (
            "1 1500 1",
            "1 1500,5 1",
            "a number with a decimal point, got `1500,5`, with a comma",
        ),
        (
            "1 1500 1",
            "1 nan 1",
            "lumens per lamp: a finite number, got `nan`",
        ),
        (
            "0 10 20",
            "0 20 10",
            "a vertical angle: above 20, at most 180 degrees, got `10`",
        ),
        (
            "\r\n200 ",
            "\r\n-200 ",
            "a candela value: 0 or more, got `-200`",
        ),
        ("\r\n200 ", "\r\n", "candela values (13 x 19), got 246"),
    ] {
        assert!(good.contains(from), "{from}");
        let got = ies::read(&good.replacen(from, to, 1))
            .unwrap_err()
            .to_string();
        assert!(
            got.contains(message) && got.starts_with("line "),
            "{from}: {got}"
        );
    }
    let texts = Default::default();
    let good = eulumdat::write(&eulumdat::Ldt::from_distribution(
        &table(),
        texts,
        (1, 1000.0, 1.0),
    ));
    for (from, to, message) in [
        (
            "\r\n1000\r\n",
            "\r\n1000,0\r\n",
            "line 29: expected flux of the lamps: a number with a decimal point",
        ),
        (
            "\r\n30\r\n60\r\n",
            "\r\n60\r\n30\r\n",
            "a C angle: above 60",
        ),
        ("\r\n30\r\n60\r\n", "\n30\r\n60\r\n", "one kind of line end"),
        (
            "\r\n200\r\n",
            "\r\ninf\r\n",
            "an intensity: a finite number, got `inf`",
        ),
        ("\r\n200\r\n", "\r\n", "an intensity: a number, got ``"),
        (
            "\r\n200\r\n",
            "\r\n200\r\n7\r\n",
            "the end of the file after 228 intensities",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let bad = good.replacen(from, to, 1);
        let got = eulumdat::read(&bad).unwrap_err().to_string();
        assert!(got.contains(message), "{from}: {got}");
    }
    // Older files have names in Latin-1.
    assert_eq!(photometric_text(b"f\xfcr").unwrap(), "für");
    assert!(photometric_text(b"\xff\xfea\0").is_err());
    let other = ies::read(&QUADRANTS.replace("3 3 1 2", "3 3 2 2")).unwrap();
    let message = other.distribution().unwrap_err().to_string();
    assert!(message.contains("expected 1 (C"), "{message}");
}

fn source_power_by_direction(emission: Emission) -> Vec<f64> {
    let far = FarField::new(10.0, 30.0).unwrap();
    let mut scene = SceneBuilder::new(Medium::air());
    let source = Source::new("s", DVec3::ZERO, Region::World, Emitter::Point, emission);
    scene.source(source);
    let outcome = run(&scene.build().unwrap(), &[&far], &Settings::new(200_000, 3)).unwrap();
    outcome.total.readings[0].clone()
}

#[test]
fn a_source_emits_what_its_file_says() {
    let text = ies::write(&ies::Ies::from_distribution(
        &table(),
        Vec::new(),
        1000.0,
        1.0,
    ));
    let read = ies::read(&text).unwrap().distribution().unwrap();
    let watts = source_power_by_direction(Emission::Table(Arc::new(read.clone())));
    let far = FarField::new(10.0, 30.0).unwrap();
    for (bin, got) in watts.iter().enumerate() {
        // Power of the bin by a midpoint sum over 8 x 8 parts, of 1 W in all.
        let mut expected = 0.0;
        for i in 0..8 {
            for j in 0..8 {
                let theta = (far.theta_deg(bin / 12) + (f64::from(i) - 3.5) * 1.25).to_radians();
                let phi = (far.phi_deg(bin % 12) + (f64::from(j) - 3.5) * 3.75).to_radians();
                let d = DVec3::new(
                    theta.sin() * phi.cos(),
                    theta.sin() * phi.sin(),
                    theta.cos(),
                );
                expected += read.intensity(d) * theta.sin();
            }
        }
        expected *= 1.25_f64.to_radians() * 3.75_f64.to_radians() / read.flux();
        let error = (expected / 200_000.0).sqrt().max(5e-6);
        assert!(
            (got - expected).abs() < 5.0 * error + 1e-3 * expected,
            "{bin}: {got} {expected}"
        );
    }
}

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

fn about() -> tm25::About {
    let mut descriptions: [String; 9] = Default::default();
    "dome µ".clone_into(&mut descriptions[0]);
    tm25::About {
        wavelength: 550.0,
        lumens_per_watt: 680.0,
        date: "2020-01-02T03:04:05Z".to_owned(),
        descriptions,
    }
}

fn tm25_file(rays: &[RayRecord]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = tm25::Writer::new(&mut file, &about()).unwrap();
    for ray in rays {
        writer.write(ray).unwrap();
    }
    writer.finish().unwrap();
    file.into_inner()
}

fn ltray_file(rays: &[RayRecord]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = ltray::Writer::new(&mut file).unwrap();
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
    let mut reader = tm25::Reader::new(&bytes[..], Some(bytes.len() as u64)).unwrap();
    let header = reader.header().clone();
    assert_eq!(
        (header.rays, header.spectrum),
        (50_000, tm25::Spectrum::Single(550.0))
    );
    assert_eq!(header.descriptions[0], "dome µ");
    assert!((header.luminous_flux / header.radiant_flux - 680.0).abs() < 1e-3);
    for ray in &rays {
        assert!(near(&reader.next_ray().unwrap().unwrap(), ray));
    }
    assert_eq!(reader.next_ray().unwrap(), None);
    assert!((reader.sum() / sum - 1.0).abs() < 1e-12);
    assert!((f64::from(header.flux().unwrap()) / sum - 1.0).abs() < 1e-6);

    let bytes = ltray_file(&rays);
    let mut reader = ltray::Reader::new(&bytes[..]).unwrap();
    for ray in &rays {
        assert!(near(&reader.next_ray().unwrap().unwrap(), ray));
    }
    assert_eq!(reader.next_ray().unwrap(), None);
    assert_eq!(reader.rays(), 50_000);
    assert!((f64::from(reader.header().flux) / sum - 1.0).abs() < 1e-6);
}

fn tm25_error(bytes: &[u8], length: Option<u64>) -> String {
    let outcome = tm25::Reader::new(bytes, length).and_then(|mut reader| {
        while reader.next_ray()?.is_some() {}
        Ok(())
    });
    outcome.unwrap_err().to_string()
}

fn ltray_error(bytes: &[u8]) -> String {
    let outcome = ltray::Reader::new(bytes).and_then(|mut reader| {
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
        (
            with(0, *b"TM26"),
            "offset 0: expected \"TM25\", got \"TM26\"",
        ),
        (
            with(4, 2020_u32.to_le_bytes()),
            "offset 4: expected version 2013, got 2020",
        ),
        (
            with(60, 9_u32.to_le_bytes()),
            "offset 60: expected spectral identifier: 0 to 4, got 9",
        ),
        (
            with(256, 0_u32.to_le_bytes()),
            "offset 256: expected flag of the position: 1, got 0",
        ),
        (
            with(264, 0_u32.to_le_bytes()),
            "offset 264: expected radiant or luminous flux",
        ),
        (
            with(60, 2_u32.to_le_bytes()),
            "offset 60: expected a column for the spectrum",
        ),
        (
            with(76, (-1_i32).to_le_bytes()),
            "offset 76: expected number of spectral tables: 0 to 65536, got -1",
        ),
        (
            with(36_288, f32::NAN.to_le_bytes()),
            "offset 36288: expected a finite position",
        ),
        (
            with(36_288 + 28 + 12, 3_f32.to_le_bytes()),
            "offset 36328: expected a unit vector",
        ),
        (
            with(36_288 + 24, (-1_f32).to_le_bytes()),
            "offset 36312: expected a flux of 0 or more, got -1",
        ),
        (
            good[..36_288 + 100].to_vec(),
            "expected 10 rays of 28 bytes, got the end after 3 rays",
        ),
        (
            good[..200].to_vec(),
            "offset 4: expected 36284 bytes of a TM-25 header, got 196",
        ),
        (
            [good.clone(), vec![0]].concat(),
            "offset 36568: expected the end after 10 rays, got more bytes",
        ),
    ] {
        let got = tm25_error(&bad, None);
        assert!(got.contains(message), "{message}: {got}");
    }
    let got = tm25_error(&good, Some(good.len() as u64 + 4));
    assert!(
        got.contains("expected 36568 bytes in all (10 rays of 28), got 36572"),
        "{got}"
    );
}

#[test]
fn lighttools_ray_files_that_are_wrong_are_named() {
    let good = ltray_file(&records(10));
    let with = |at: usize, bytes: [u8; 4]| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&bytes);
        bad
    };
    for (bad, message) in [
        (with(0, *b"LTRX"), "offset 0: expected \"LTRF\""),
        (
            with(4, 3_u32.to_le_bytes()),
            "offset 4: expected major version 2, got 3",
        ),
        (
            with(24, 2_u32.to_le_bytes()),
            "offset 24: expected length unit 1 (millimetres), got 2",
        ),
        (
            with(40, f32::INFINITY.to_le_bytes()),
            "offset 40: expected a flux of 0 or more, got inf",
        ),
        (
            with(44 + 28 + 24, f32::NAN.to_le_bytes()),
            "offset 96: expected a flux of 0 or more, got NaN",
        ),
        (
            good[..good.len() - 9].to_vec(),
            "\"LTRFEND\" after whole rays of 28 bytes",
        ),
        (
            [good.clone(), vec![0; 40]].concat(),
            "offset 336: expected a unit vector",
        ),
    ] {
        let got = ltray_error(&bad);
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
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
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
        assert!(
            (got - expected).abs() < 5.0 * error + 1e-9,
            "{ring}: {got} {expected}"
        );
    }
    let none: [RayRecord; 0] = [];
    assert!(RaySet::new(none).is_err());
}
