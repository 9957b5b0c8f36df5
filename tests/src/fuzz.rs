// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fuzz targets: files of a corpus, altered by a seeded generator, for every reader.
//!
//! Files with checksums get new ones after the alteration, else the reader would stop there. A
//! reader must not panic, take long, or allocate out of proportion to its input. Whatever it
//! accepts is usable: scattering is sampled and conserves energy, far fields have a flux, rays are
//! unit vectors.

use std::io::Cursor;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use bsdf::direction::spherical;
use bsdf::{Bsdf, LobeMotion, Side, native};
use formats::eulumdat::layout as eulumdat;
use formats::fields::photometric_text;
use formats::ies::layout as ies;
use formats::lighttools::{convert::from_lighttools, layout as lighttools};
use formats::lighttools_rays::layout as lighttools_rays;
use formats::order_json::layout as order_json;
use formats::speos::{convert::from_speos, layout as speos};
use formats::speos_rays::layout as speos_rays;
use formats::text::utf8;
use formats::text_rays;
use formats::tm25::layout as tm25;
use formats::tm33::layout as tm33;
use formats::window::{convert::from_window, layout as window};
use formats::zemax::{convert::from_zemax, layout as zemax};
use formats::zemax_rays::layout as zemax_rays;
use sha2::{Digest, Sha256};
use tracer::RayRecord;
use tracer::{Distribution, random};

use arrays::npy;
use formats::npz;

/// One reader with the valid files that its inputs are made of.
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Valid files.
    pub corpus: Vec<Vec<u8>>,
    /// Reads, and uses what was read; returns whether it was accepted.
    pub read: fn(&[u8]) -> bool,
    /// Sets checksums of an altered file right again, so that alterations get past them.
    mend: fn(&mut [u8]),
}

/// For files without checksums.
fn nothing(_: &mut [u8]) {}

/// A native table: SHA-256 of everything before the last 32 bytes.
fn mend_table(bytes: &mut [u8]) {
    if let Some(end) = bytes.len().checked_sub(32) {
        let (content, sum) = bytes.split_at_mut(end);
        sum.copy_from_slice(&Sha256::digest(content));
    }
}

/// An archive without compression: the CRC of every member, in its own header and in the directory.
fn mend_archive(bytes: &mut [u8]) {
    let number = |bytes: &[u8], at: usize| -> Option<usize> {
        let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(four) as usize)
    };
    let entries =
        (0..bytes.len().saturating_sub(46)).filter(|at| bytes[*at..].starts_with(b"PK\x01\x02"));
    for entry in entries.collect::<Vec<_>>() {
        let sums = || {
            let [size, header] = [number(bytes, entry + 20)?, number(bytes, entry + 42)?];
            let lengths = number(bytes, header + 26)?;
            let start = header + 30 + (lengths & 0xffff) + (lengths >> 16);
            Some((header, crc32(bytes.get(start..start + size)?)))
        };
        if let Some((header, sum)) = sums() {
            bytes[header + 14..header + 18].copy_from_slice(&sum.to_le_bytes());
            bytes[entry + 16..entry + 20].copy_from_slice(&sum.to_le_bytes());
        }
    }
}

/// The checksum of zip files.
fn crc32(bytes: &[u8]) -> u32 {
    let mut sum = u32::MAX;
    for byte in bytes {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg());
        }
    }
    !sum
}

/// Files of the corpus with this ending.
fn corpus(ending: &str) -> Vec<Vec<u8>> {
    let folder = crate::workspace().join("tests/formats/corpus");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("the corpus")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.to_string_lossy().ends_with(ending))
        .collect();
    paths.sort();
    let files: Vec<_> =
        paths.iter().map(|p| std::fs::read(p).expect("a file of the corpus")).collect();
    assert!(!files.is_empty(), "no file of the corpus ends in {ending}");
    files
}

/// All files of the corpus.
fn every_file() -> Vec<Vec<u8>> {
    corpus("")
}

/// Draws from a surface that a reader accepted.
fn used(surface: Result<bsdf::MeasuredBsdf, bsdf::Error>) -> bool {
    let Ok(surface) = surface else { return false };
    let mut rng = random::stream(1, 0);
    for k in 0..16 {
        let wi = spherical(0.2 * f64::from(k) + 0.01, 0.7 * f64::from(k));
        let albedo = surface.albedo(wi, bsdf::Polarisation::Unpolarised).total();
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

fn read_speos(bytes: &[u8]) -> bool {
    speos::read(bytes).is_ok_and(|file| {
        let files = [(Side::Outer, &file)];
        used(from_speos(&files, [1.41, 1.0], LobeMotion::Shifted))
    })
}

/// Every reader.
///
/// # Panics
/// If the corpus cannot be read.
pub fn targets() -> Vec<Target> {
    let target = |name, corpus, read| Target { name, corpus, read, mend: nothing };
    vec![
        target("zemax", corpus(".zemax.bsdf"), |bytes| {
            utf8(bytes).is_ok_and(|text| {
                zemax::read(text).is_ok_and(|file| {
                    used(from_zemax(&[(Side::Outer, &file)], [1.41, 1.0], LobeMotion::Shifted))
                })
            })
        }),
        target("lighttools", corpus(".lighttools.bsdf"), |bytes| {
            utf8(bytes).is_ok_and(|text| {
                lighttools::read(text).is_ok_and(|file| {
                    used(from_lighttools(&file, [1.41, 1.0], LobeMotion::Shifted))
                })
            })
        }),
        target("window", corpus(".xml"), |bytes| {
            utf8(bytes).is_ok_and(|text| {
                window::read(text)
                    .is_ok_and(|file| used(from_window(&file, [1.41, 1.0], LobeMotion::Fixed)))
            })
        }),
        Target {
            mend: mend_table,
            ..target("native", corpus(".bworders"), |bytes| {
                native::read(Cursor::new(bytes)).is_ok()
            })
        },
        target("orders json", corpus(".json"), |bytes| {
            utf8(bytes).is_ok_and(|text| order_json::read(text).is_ok())
        }),
        Target {
            mend: mend_archive,
            ..target("orders npz", corpus(".npz"), |bytes| npz::read(Cursor::new(bytes)).is_ok())
        },
        target("npy", corpus(".npy"), |bytes| {
            npy::read::<f64>(bytes).is_ok_and(|(shape, values)| {
                assert_eq!(shape.iter().product::<usize>(), values.len());
                true
            })
        }),
        target("ies", corpus(".ies"), |bytes| {
            photometric_text(bytes)
                .is_ok_and(|text| ies::read(&text).is_ok_and(|file| lit(file.distribution())))
        }),
        target("eulumdat", corpus(".ldt"), |bytes| {
            photometric_text(bytes)
                .is_ok_and(|text| eulumdat::read(&text).is_ok_and(|file| lit(file.distribution())))
        }),
        target("tm33", corpus(".tm33"), |bytes| {
            photometric_text(bytes)
                .is_ok_and(|text| tm33::read(&text).is_ok_and(|file| lit(file.distribution())))
        }),
        target("lighttools text rays", corpus(".lighttools.txt"), |bytes| {
            text_rays::LightToolsTextReader::new(bytes)
                .is_ok_and(|mut reader| rays(|| reader.next_ray().ok().flatten()))
        }),
        target("zemax text rays", corpus(".zemax.txt"), |bytes| {
            text_rays::ZemaxTextReader::new(bytes)
                .is_ok_and(|mut reader| rays(|| reader.next_ray().ok().flatten()))
        }),
        target("tm25", corpus(".tm25ray"), |bytes| {
            tm25::Tm25Reader::new(bytes, None)
                .is_ok_and(|mut reader| rays(|| reader.next_ray().ok().flatten()))
        }),
        target("speos", corpus("brdf"), read_speos),
        target("speos anisotropic", corpus(".anisotropicbsdf"), read_speos),
        target("speos rays", corpus(".speos.ray"), |bytes| {
            speos_rays::SpeosReader::new(bytes, bytes.len() as u64)
                .is_ok_and(|mut reader| rays(|| reader.next_ray().ok().flatten()))
        }),
        target("zemax rays", [corpus(".sdf"), corpus(".dat")].concat(), |bytes| {
            zemax_rays::ZemaxReader::new(bytes, None)
                .is_ok_and(|mut reader| rays(|| reader.next_ray().ok().flatten()))
        }),
        target("sniff", every_file(), |bytes| {
            formats::sniff::guess(bytes, bytes.len() as u64).is_some()
        }),
        target("lighttools_rays", [corpus("plain.ray"), corpus("colour.ray")].concat(), |bytes| {
            lighttools_rays::LightToolsReader::new(bytes)
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
        let reach = if draw(2) == 0 { bytes.len().min(1024) } else { bytes.len() };
        let at = draw(reach);
        let most = if draw(4) == 0 { 4096 } else { 12 };
        let end = (at + 1 + draw(most)).min(bytes.len());
        match draw(9) {
            8 => {
                let opening = ["<a>", "[", "{", "{\"a\":", "("][draw(5)];
                let deep = opening.repeat(1 << draw(16));
                bytes.splice(at..at, deep.bytes());
            }
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
        let mut bytes = altered(&target.corpus, number);
        (target.mend)(&mut bytes);
        let begin = Instant::now();
        let outcome = std::panic::catch_unwind(|| (target.read)(&bytes));
        report.slowest = report.slowest.max(begin.elapsed());
        assert!(outcome.is_ok(), "reader {} panicked at input {number}", target.name);
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
