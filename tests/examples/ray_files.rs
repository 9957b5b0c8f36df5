// SPDX-License-Identifier: MIT OR Apache-2.0
//! Time and memory of ray files: `cargo run --release -p batwing-tests --example ray_files [RAYS]
//! [FOLDER]` writes and reads ten million rays in each format.

#![expect(clippy::print_stdout, reason = "the table is what the program is run for")]

use std::fs::File;
use std::path::PathBuf;
use std::time::Instant;

use batwing_tests::fuzz::peak_megabytes;
use formats::lighttools_rays::layout as lighttools_rays;
use formats::rays::RayFileError;
use formats::tm25::layout as tm25;
use tracer::RayRecord;
use tracer::random;

fn rays(count: u64) -> impl Iterator<Item = RayRecord> {
    let mut rng = random::stream(1, 0);
    (0..count).map(move |k| RayRecord {
        position: [0.1, 0.2, 1.0],
        direction: random::isotropic(&mut rng).to_array().map(|v| v as f32),
        flux: 1e-7 * (1 + k % 3) as f32,
        wavelength: 550.0,
    })
}

fn main() -> Result<(), RayFileError> {
    let mut arguments = std::env::args().skip(1);
    let count: u64 = arguments.next().map_or(10_000_000, |n| n.parse().expect("a number of rays"));
    let folder = arguments.next().map_or_else(std::env::temp_dir, PathBuf::from);
    let report = |what: &str, begin: Instant, flux: f64, stated: f64| {
        println!(
            "{what}: {:.2} s, flux {flux:.6} W, header {stated:.6} W, peak {:.0} MB",
            begin.elapsed().as_secs_f64(),
            peak_megabytes().unwrap_or(f64::NAN)
        );
    };

    let path = folder.join("batwing-rays.tm25ray");
    let begin = Instant::now();
    let about = tm25::Tm25Metadata {
        wavelength: 550.0,
        per_ray: false,
        lumens_per_watt: f32::NAN,
        date: String::new(),
        descriptions: Default::default(),
    };
    let mut writer = tm25::Tm25Writer::new(File::create(&path)?, &about)?;
    for ray in rays(count) {
        writer.write(&ray)?;
    }
    let (_, flux) = writer.finish()?;
    report("TM-25 written", begin, flux, flux);
    let begin = Instant::now();
    let mut reader = tm25::Tm25Reader::new(File::open(&path)?, None)?;
    while reader.next_ray()?.is_some() {}
    let stated = f64::from(reader.header().radiant_flux);
    report("TM-25 read", begin, reader.sum(), stated);
    std::fs::remove_file(&path)?;

    let path = folder.join("batwing-rays.ray");
    let begin = Instant::now();
    let mut writer = lighttools_rays::LightToolsWriter::new(File::create(&path)?)?;
    for ray in rays(count) {
        writer.write(&ray)?;
    }
    let (_, flux) = writer.finish()?;
    report("LightTools written", begin, flux, flux);
    let begin = Instant::now();
    let mut reader = lighttools_rays::LightToolsReader::new(File::open(&path)?)?;
    while reader.next_ray()?.is_some() {}
    let stated = f64::from(reader.header().flux);
    report("LightTools read", begin, reader.sum(), stated);
    std::fs::remove_file(&path)?;
    Ok(())
}
