// SPDX-License-Identifier: MIT OR Apache-2.0
//! Readers under fire: files from a corpus, altered at random by a seed, given to every reader of files of other programs.
//!
//! What a reader must not do whatever it is given: panic, take long, or allocate out of proportion to its input. Whatever it accepts must be usable: scattering can be
//! sampled and gives out no more than comes in, far fields have a flux, rays are unit vectors.

use std::io::Cursor;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use bsdf::direction::spherical;
use bsdf::format::text::utf8;
use bsdf::format::{lighttools, orders, window, zemax};
use bsdf::{Between, Scatter, Side, convert};
use pipeline::exchange::npz;
use tracer::format::rays::RayRecord;
use tracer::format::{eulumdat, ies, ltray, photometric_text, tm25};
use tracer::{Distribution, random};

use crate::tables::smooth;

/// One reader with the valid files that its inputs are made of.
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Valid files.
    pub corpus: Vec<Vec<u8>>,
    /// Reads, and uses what was read; returns whether it was accepted.
    pub read: fn(&[u8]) -> bool,
}

/// Files of the corpus with this ending.
fn corpus(ending: &str) -> Vec<Vec<u8>> {
    let folder = crate::workspace().join("tests/exchange/corpus");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("the corpus")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.to_string_lossy().ends_with(ending))
        .collect();
    paths.sort();
    let files: Vec<_> = paths
        .iter()
        .map(|p| std::fs::read(p).expect("a file of the corpus"))
        .collect();
    assert!(!files.is_empty(), "no file of the corpus ends in {ending}");
    files
}

/// Draws from a surface that a reader accepted.
fn used(surface: Result<bsdf::Measured, bsdf::Error>) -> bool {
    let Ok(surface) = surface else { return false };
    let mut rng = random::stream(1, 0);
    for k in 0..16 {
        let wi = spherical(0.2 * f64::from(k) + 0.01, 0.7 * f64::from(k));
        let albedo = surface.albedo(wi, bsdf::Polarization::Unpolarized).total();
        assert!((0.0..=1.0 + 1e-9).contains(&albedo), "albedo {albedo}");
        if let Some(sample) = surface.sample(wi, &mut rng) {
            assert!((sample.wo.length() - 1.0).abs() < 1e-6);
        }
    }
    true
}

fn lit(table: Result<Distribution, tracer::Error>) -> bool {
    let Ok(table) = table else { return false };
    assert!(table.flux() >= 0.0);
    let mut rng = random::stream(1, 0);
    assert!((table.sample(&mut rng).length() - 1.0).abs() < 1e-6);
    true
}

fn rays(mut next: impl FnMut() -> Option<RayRecord>) -> bool {
    let mut any = false;
    while let Some(ray) = next() {
        let length = ray.direction.iter().map(|d| d * d).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-4 && ray.flux >= 0.0);
        any = true;
    }
    any
}

fn records() -> Vec<RayRecord> {
    let mut rng = random::stream(2, 0);
    (0..40)
        .map(|k| {
            let d = random::isotropic(&mut rng);
            RayRecord {
                position: [k as f32, 0.0, 1.0],
                direction: d.to_array().map(|v| v as f32),
                flux: 0.5,
                wavelength: f32::NAN,
            }
        })
        .collect()
}

/// Every reader.
///
/// # Panics
/// If the corpus cannot be read.
pub fn targets() -> Vec<Target> {
    let table = smooth(1.1, 1, vec![0.0, 0.6, 1.2]);
    let (mut json, mut archive) = (Vec::new(), Cursor::new(Vec::new()));
    orders::write(&table, &mut json).expect("written");
    npz::write(&table, &mut archive).expect("written");
    let about = tm25::About {
        wavelength: 550.0,
        lumens_per_watt: 600.0,
        date: "2020-01-01".to_owned(),
        descriptions: Default::default(),
    };
    let (mut tm25_file, mut ltray_file) = (Cursor::new(Vec::new()), Cursor::new(Vec::new()));
    let mut tm25_writer = tm25::Writer::new(&mut tm25_file, &about).expect("written");
    let mut ltray_writer = ltray::Writer::new(&mut ltray_file).expect("written");
    for ray in records() {
        tm25_writer.write(&ray).expect("written");
        ltray_writer.write(&ray).expect("written");
    }
    tm25_writer.finish().expect("written");
    ltray_writer.finish().expect("written");
    let target = |name, corpus, read| Target { name, corpus, read };
    vec![
        target("zemax", corpus(".zemax.bsdf"), |bytes| {
            utf8(bytes).is_ok_and(|text| {
                zemax::read(text).is_ok_and(|file| {
                    used(convert::from_zemax(
                        &[(Side::Outer, &file)],
                        [1.41, 1.0],
                        Between::Shifted,
                    ))
                })
            })
        }),
        target("lighttools", corpus(".lighttools.bsdf"), |bytes| {
            utf8(bytes).is_ok_and(|text| {
                lighttools::read(text).is_ok_and(|file| {
                    used(convert::from_lighttools(
                        &file,
                        [1.41, 1.0],
                        Between::Shifted,
                    ))
                })
            })
        }),
        target("window", corpus(".xml"), |bytes| {
            utf8(bytes).is_ok_and(|text| {
                window::read(text).is_ok_and(|file| {
                    used(convert::from_window(&file, [1.41, 1.0], Between::Fixed))
                })
            })
        }),
        target("orders json", vec![json], |bytes| {
            utf8(bytes).is_ok_and(|text| orders::read(text).is_ok())
        }),
        target("orders npz", vec![archive.into_inner()], |bytes| {
            npz::read(Cursor::new(bytes)).is_ok()
        }),
        target("ies", corpus(".ies"), |bytes| {
            photometric_text(bytes)
                .is_ok_and(|text| ies::read(&text).is_ok_and(|file| lit(file.distribution())))
        }),
        target("eulumdat", corpus(".ldt"), |bytes| {
            photometric_text(bytes)
                .is_ok_and(|text| eulumdat::read(&text).is_ok_and(|file| lit(file.distribution())))
        }),
        target("tm25", vec![tm25_file.into_inner()], |bytes| {
            tm25::Reader::new(bytes, None)
                .is_ok_and(|mut reader| rays(|| reader.next_ray().ok().flatten()))
        }),
        target("ltray", vec![ltray_file.into_inner()], |bytes| {
            ltray::Reader::new(bytes)
                .is_ok_and(|mut reader| rays(|| reader.next_ray().ok().flatten()))
        }),
    ]
}

/// Words that readers stumble over.
const WORDS: [&str; 24] = [
    "0",
    "-1",
    "1e309",
    "nan",
    "-inf",
    "4294967296",
    "99999999999999999999",
    "1,5",
    "\r",
    "\n",
    "\n\r",
    " ",
    "{",
    "}",
    "<",
    "&#0;",
    "#",
    "[",
    "\"",
    "TIS",
    "DataEnd",
    "\u{1a}",
    "1e-320",
    "360",
];

/// Input number `number` of a corpus: a file of it with up to eight alterations.
#[must_use]
pub fn altered(corpus: &[Vec<u8>], number: u64) -> Vec<u8> {
    let mut rng = random::stream(0x00f0_22ed, number);
    let mut draw = |n: usize| (random::unit(&mut rng) * n as f64) as usize;
    let mut bytes = corpus[draw(corpus.len())].clone();
    let most = 1 + draw(8);
    for _ in 0..=draw(most) {
        if bytes.is_empty() {
            break;
        }
        // Half of the places in the first kilobyte, where headers stand.
        let reach = if draw(2) == 0 {
            bytes.len().min(1024)
        } else {
            bytes.len()
        };
        let at = draw(reach);
        let most = if draw(4) == 0 { 4096 } else { 12 };
        let end = (at + 1 + draw(most)).min(bytes.len());
        match draw(8) {
            0 => bytes[at] ^= 1 << draw(8),
            1 => bytes[at] = draw(256) as u8,
            2 => drop(bytes.drain(at..end)),
            3 => bytes.truncate(at),
            4 => {
                let copy = bytes[at..end].to_vec();
                let to = draw(bytes.len());
                bytes.splice(to..to, copy);
            }
            5 => {
                let word = WORDS[draw(WORDS.len())].bytes();
                bytes.splice(at..end, word);
            }
            6 => {
                let word = WORDS[draw(WORDS.len())].bytes();
                bytes.splice(at..at, word);
            }
            _ => {
                let value = [0, 1, u32::MAX, 0x7f80_0000, 0x7fc0_0000, 1 << 31][draw(6)];
                for (slot, byte) in bytes[at..].iter_mut().zip(value.to_le_bytes()) {
                    *slot = byte;
                }
            }
        }
    }
    bytes
}

/// What a bombardment showed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Report {
    /// Inputs accepted.
    pub accepted: u64,
    /// Longest time for one input.
    pub slowest: Duration,
}

/// Gives a reader the inputs `numbers`.
///
/// # Panics
/// If the reader does, with the number of the input.
pub fn bombard(target: &Target, numbers: std::ops::Range<u64>) -> Report {
    let mut report = Report::default();
    for number in numbers {
        let bytes = altered(&target.corpus, number);
        let begin = Instant::now();
        let outcome = std::panic::catch_unwind(|| (target.read)(&bytes));
        report.slowest = report.slowest.max(begin.elapsed());
        assert!(
            outcome.is_ok(),
            "reader {} panicked at input {number}",
            target.name
        );
        report.accepted += u64::from(outcome.is_ok_and(|accepted| accepted));
    }
    report
}

/// Largest memory that this process has held, MB; `None` where the system does not say.
#[must_use]
pub fn peak_megabytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1e-3)
}
