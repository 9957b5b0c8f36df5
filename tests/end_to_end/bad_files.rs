// SPDX-License-Identifier: MIT OR Apache-2.0
//! Damaged files of other programs and damaged tables: line ends, encodings, counts in headers,
//! contradictions, Ctrl-C. Each ends in one line that names the file and what was expected, and
//! leaves nothing behind.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use crate::support::binary::batwing;
use crate::support::runs::{interrupted, partial};
use batwing_tests::tables::{on_silicone, order_table, resolution};
use batwing_tests::{read, workspace};
use bsdf::Grid;
use bsdf::native;
use num_complex::Complex64;
use rcwa::relief::Relief;

const CORPUS: &str = "tests/formats/corpus";

/// Runs and returns the one line of complaint.
pub(crate) fn complaint(at: &Path, arguments: &[&str]) -> String {
    let output = batwing(at).args(arguments).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    text
}

/// A directory with the corpus in it.
pub(crate) fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a directory");
    let path = folder.path().to_path_buf();
    for entry in std::fs::read_dir(workspace().join(CORPUS)).expect("the corpus") {
        let entry = entry.expect("an entry");
        std::fs::copy(entry.path(), path.join(entry.file_name())).expect("copied");
    }
    (folder, path)
}

pub(crate) fn write(at: &Path, name: &str, bytes: impl AsRef<[u8]>) {
    std::fs::write(at.join(name), bytes).expect("written");
}

fn names(at: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(at)
        .expect("a directory")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Text formats with a file of each.
const TEXTS: [&str; 7] = [
    "small.zemax.bsdf",
    "small.lighttools.bsdf",
    "small.klems.xml",
    "small.isotropic.xml",
    "small.ies",
    "small.ldt",
    "pretty.json",
];

/// The text of one of them with LF.
pub(crate) fn text_of(name: &str) -> String {
    if name == "pretty.json" {
        let json: serde_json::Value =
            serde_json::from_str(&read(format!("{CORPUS}/small.json"))).expect("JSON");
        return serde_json::to_string_pretty(&json).expect("a text") + "\n";
    }
    read(format!("{CORPUS}/{name}")).replace("\r\n", "\n")
}

#[test]
fn lines_end_alike_or_the_file_is_refused() {
    let (_keep, at) = folder();
    for name in TEXTS {
        let text = text_of(name);
        for end in ["\n", "\r\n", "\r"] {
            write(&at, name, text.replace('\n', end));
            let output = batwing(&at).args(["import", name]).output().expect("runs");
            let error = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{name} {end:?}: {error}");
        }
        for (end, other, said) in [
            ("\n", "\r\n", "expected every line to end in LF, as line 1 does, got CR LF"),
            ("\r\n", "\n", "expected every line to end in CR LF, as line 1 does, got LF"),
            ("\n", "\r", "expected every line to end in LF, as line 1 does, got CR"),
        ] {
            let mut lines: Vec<&str> = text.split('\n').collect();
            let fourth = lines.remove(3);
            let mixed = lines.join(end);
            let start: usize = lines[..3].iter().map(|l| l.len() + end.len()).sum();
            let mixed = format!("{}{fourth}{other}{}", &mixed[..start], &mixed[start..]);
            write(&at, name, mixed);
            let got = complaint(&at, &["import", name]);
            assert!(got.contains(&format!("{name}: line 4: {said}")), "{got}");
        }
    }
}

#[test]
fn other_encodings_and_files_that_end_early_are_named() {
    let (_keep, at) = folder();
    for name in TEXTS {
        let text = text_of(name);
        let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let marked = [&[0xff, 0xfe][..], &wide].concat();
        for (bytes, expected) in [
            (marked, "offset 0: expected text in UTF-8 or ASCII, got text in UTF-16"),
            (wide, "offset 1: expected text in UTF-8 or ASCII, got a zero byte"),
            (Vec::new(), "expected"),
            (text.as_bytes()[..text.len() / 2].to_vec(), "expected"),
        ] {
            write(&at, name, &bytes);
            let got = complaint(&at, &["import", name]);
            // JSON that ends early says where in words of its own.
            let place = got.contains("line 1") || got.contains("line ") || got.contains("offset ");
            let json = name == "pretty.json" && got.contains("EOF");
            assert!(got.contains(name) && (json || got.contains(expected) && place), "{got}");
        }
    }
    for name in ["small.bworders", "stored.npz", "wavelengths.tm25ray", "plain.ray"] {
        let whole = std::fs::read(at.join(name)).expect("a file");
        for length in [0, 3, 30, whole.len() / 2, whole.len() - 1] {
            write(&at, name, &whole[..length]);
            let got = complaint(&at, &["import", name]);
            assert!(got.contains(name) && got.contains("expected"), "{got}");
        }
    }
}

/// A member of an archive without compression.
fn npy(descr: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape},), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values);
    bytes
}

#[test]
fn counts_in_headers_are_not_believed() {
    let (_keep, at) = folder();
    // An archive whose array `s` claims a trillion values, and one in which a megabyte of zeros
    // stands packed where 100 belong.
    for (shape, values, expected) in [
        (
            "1000000000000",
            8,
            "array `s`: offset 80: expected the values of the shape [1000000000000], 4 bytes each, got 8 bytes",
        ),
        ("25000000", 100_000_000, "array `s`: expected at most"),
    ] {
        let whole = std::fs::File::open(at.join("stored.npz")).expect("open");
        let mut from = zip::ZipArchive::new(whole).expect("an archive");
        let mut to = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for number in 0..from.len() {
            let member = from.by_index_raw(number).expect("a member");
            if member.name() == "s.npy" {
                let options = zip::write::SimpleFileOptions::default();
                to.start_file("s.npy", options).expect("started");
                to.write_all(&npy("<f4", shape, &vec![0; values])).expect("written");
            } else {
                to.raw_copy_file(member).expect("copied");
            }
        }
        let bytes = to.finish().expect("finished").into_inner();
        assert!(bytes.len() < 200_000);
        write(&at, "bad.npz", bytes);
        let got = complaint(&at, &["import", "bad.npz"]);
        assert!(got.contains("bad.npz") && got.contains(expected), "{got}");
    }
    let mut rays = std::fs::read(at.join("wavelengths.tm25ray")).expect("rays");
    rays[20..28].copy_from_slice(&u64::MAX.to_le_bytes());
    write(&at, "bad.tm25ray", rays);
    let got = complaint(&at, &["import", "bad.tm25ray"]);
    assert!(got.contains("bytes in all (18446744073709551615 rays of 32), got 36672"), "{got}");
    std::fs::create_dir(at.join("results")).expect("made");
    write(&at, "results/far_field.npy", npy("<f8", "2, 90, 4000000000", &[0; 8]));
    let got = complaint(&at, &["export", "results", "--format", "ies", "--out", "x.ies"]);
    assert!(got.contains("far_field.npy: offset ") && got.contains("[2, 90, 4000000000]"), "{got}");
}

/// File of the corpus, what stands in it, what is put there instead, and the message.
const CONTRADICTIONS: [(&str, &str, &str, &str); 23] = [
    ("small.ies", "3 3 1 2", "3 3 3 2", "line 9: expected photometric type: 1 (C"),
    (
        "sets.ldt",
        "\nLED\n1500",
        "\nLED\nmany",
        "line 35: expected flux of the lamps: a number, got `many`",
    ),
    ("small.klems.xml", "\n7 0", "\n70 0", "expected powers that sum to at most 1, got"),
    (
        "small.isotropic.xml",
        "version=\"1.0\"",
        "version=\"2.0\"",
        "line 1: expected version 1 of XML, got `2.0`",
    ),
    (
        "small.lighttools.bsdf",
        "TIS 0.25",
        "TIS 1.25",
        "expected TIS: a power from 0 to 1, got `1.25`",
    ),
    (
        "small.lighttools.bsdf",
        "AOI 0\n",
        "AOI 45\n",
        "expected one block for Front BRDF, AOI 45, POI 0, got a second one",
    ),
    (
        "small.lighttools.bsdf",
        "POI 0\n",
        "POI 17\n",
        "expected one block for each of 2 AOI x 3 POI",
    ),
    (
        "small.lighttools.bsdf",
        "Wavelength 550\n",
        "Wavelength 500\n",
        "expected one wavelength in the whole file, 500 nm, got 550",
    ),
    (
        "small.zemax.bsdf",
        "AngleOfIncidence  2",
        "AngleOfIncidence  2 2",
        "line 9: expected AngleOfIncidence angle: an angle above 2",
    ),
    ("small.zemax.bsdf", "BRDF", "BSDF", "line 5: expected BRDF or BTDF, got `BSDF`"),
    (
        "small.zemax.bsdf",
        "TIS 0.7",
        "TIS 1.7",
        "line 21: expected TIS: a power from 0 to 1, got `1.7`",
    ),
    (
        "small.zemax.bsdf",
        "9\t2\t0",
        "9\tnan\t0",
        "line 22: expected a BSDF value: a finite number, got `nan`",
    ),
    (
        "small.zemax.bsdf",
        "9\t2\t0",
        "9\t-2\t0",
        "line 22: expected a BSDF value: 0 or more, got `-2`",
    ),
    (
        "small.zemax.bsdf",
        "9\t2\t0",
        "9,0\t2\t0",
        "a number with a decimal point, got `9,0`, with a comma",
    ),
    (
        "small.zemax.bsdf",
        "0\t60",
        "60\t0",
        "line 9: expected AngleOfIncidence angle: an angle above 60",
    ),
    ("small.zemax.bsdf", "DataEnd", "", "expected DataEnd, got the end of the file"),
    (
        "small.zemax.bsdf",
        "Symmetry",
        "Version 9\nSymmetry",
        "a keyword of a Zemax BSDF file, got `Version`",
    ),
    ("small.lighttools.bsdf", "Side Back", "Side Top", "expected Front or Back, got `Top`"),
    ("small.lighttools.bsdf", "AOI 45", "AOI 95", "expected AOI: 0 to 90 degrees, got `95`"),
    (
        "small.isotropic.xml",
        "TensorTree3",
        "TensorTree5",
        "TensorTree3 or TensorTree4, got `TensorTree5`",
    ),
    ("small.isotropic.xml", "Shirley-Chiu", "Klems Full", "expected AngleBasis LBNL/Shirley-Chiu"),
    ("small.isotropic.xml", "0.1 0.1", "0.1", "expected a power of 8 values, got 63"),
    ("small.isotropic.xml", "</Optical>", "", "well-formed XML"),
];

#[test]
fn contradictions_in_files_are_refused() {
    let (_keep, at) = folder();
    let before = names(&at);
    let refused = |name: &str, text: String, expected: &str| {
        write(&at, name, text);
        let got = complaint(&at, &["import", name]);
        assert!(got.contains(expected) && got.contains(name), "{got}");
    };
    for (name, old, new, expected) in CONTRADICTIONS {
        let text = text_of(name);
        assert!(text.contains(old), "{name} {old}");
        refused(name, text.replacen(old, new, 1), expected);
    }
    // Half reflected and more than half transmitted: each alone is possible.
    let text = text_of("small.lighttools.bsdf").replace("TIS 0.25", "TIS 0.75");
    let expected = "expected powers that sum to at most 1, got 1.5";
    refused("small.lighttools.bsdf", text, expected);
    // Ten times the value of a tree that gives 31 %.
    let text = text_of("small.isotropic.xml").replace("0.1", "1.0");
    let expected = "expected powers that sum to at most 1, got 3.14";
    refused("small.isotropic.xml", text, expected);
    assert_eq!(names(&at), before);
}

#[test]
fn nesting_without_end_is_refused() {
    const DEEP: usize = 20_000;
    let (_keep, at) = folder();
    let both = |open: &str, inside: &str, close: &str| {
        format!("{}{inside}{}", open.repeat(DEEP), close.repeat(DEEP))
    };
    let arrays = both("[", "", "]");
    for (command, name, text, expected) in [
        (
            "import",
            "x.xml",
            both("<a>", "", "</a>"),
            "line 1: expected elements nested at most 64 deep, got deeper ones",
        ),
        ("import", "x.json", both("{\"a\":", "1", "}"), "x.json"),
        ("import", "x.json", arrays.clone(), "x.json"),
        ("check", "x.toml", format!("name = {arrays}\n"), "recurs"),
        ("check", "x.toml", format!("name = {}\n", both("{ a = ", "1", "}")), "recurs"),
        ("study", "x.toml", format!("name = {arrays}\n"), "recurs"),
        ("grating", "x.json", arrays.clone(), "recursion limit"),
        (
            "import",
            "x.tree.xml",
            text_of("small.tree.xml").replacen('{', &"{".repeat(DEEP), 1),
            "at most 12 branches deep",
        ),
    ] {
        write(&at, name, &text);
        let got = complaint(&at, &[command, name]);
        assert!(got.contains(expected) && got.contains(name), "{command} {name}: {got}");
    }
}

#[test]
fn damaged_tables_are_refused() {
    let (_keep, at) = folder();
    let path = at.join("t.bworders");
    let relief = Relief::new(2.0, 0.1, Complex64::new(1.2, 0.0), Vec::new()).expect("a relief");
    let interface = on_silicone(relief);
    let resolution = resolution(&interface, 0, 1).expect("a resolution");
    let table =
        order_table(&interface, 2, Grid::ky_nodes(1.41, 1.0, 4), &resolution).expect("a table");
    let mut whole = Vec::new();
    native::write(&table, &mut whole).expect("written");
    std::fs::write(&path, &whole).expect("written");
    batwing(&at).args(["check", "t.bworders"]).assert().success();

    let edited = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    let middle = whole.len() / 2;
    let damaged: [(&str, Vec<u8>, &str); 8] = [
        ("empty", Vec::new(), "truncated"),
        ("cut in its first bytes", whole[..10].to_vec(), "truncated"),
        ("cut in the middle", whole[..middle].to_vec(), "truncated"),
        ("cut by its last byte", whole[..whole.len() - 1].to_vec(), "truncated"),
        ("one bit altered", edited(middle, whole[middle] ^ 1), "altered"),
        ("of another kind", edited(0, b'x'), "not a table of diffraction orders"),
        ("of another version", edited(8, 99), "version 99, expected 2"),
        ("followed by more", [&whole[..], b"more"].concat(), "followed by more bytes"),
    ];
    for (title, bytes, words) in damaged {
        std::fs::write(&path, bytes).expect("written");
        let got = complaint(&at, &["check", "t.bworders"]);
        assert!(got.contains("t.bworders") && got.contains(words), "{title}: {got}");
    }
}

#[test]
fn a_directory_that_is_missing_is_made() {
    let (_keep, at) = folder();
    let arguments = ["export", "small.bworders", "--format", "json", "--out", "new/er/x.json"];
    batwing(&at).args(arguments).assert().success();
    assert_eq!(names(&at.join("new/er")), ["x.json"]);
}

#[test]
fn ctrl_c_while_rays_are_written_leaves_no_file() {
    let (_keep, at) = folder();
    let design = workspace().join("data/designs/bare-dome.toml");
    let design = design.to_str().expect("a path");
    let arguments = [
        "export",
        design,
        "--format",
        "tm25",
        "--paths",
        "1000000000000",
        "--out",
        "rays/x.tm25ray",
    ];
    let begun = || {
        let size =
            |path: &PathBuf| std::fs::metadata(at.join("rays").join(path)).map_or(0, |m| m.len());
        std::fs::read_dir(at.join("rays")).is_ok_and(|entries| {
            entries.flatten().any(|e| size(&PathBuf::from(e.file_name())) > 2_000_000)
        })
    };
    let (code, text) = interrupted(&at, &arguments, begun);
    assert_eq!(code, Some(130), "{text}");
    assert!(text.contains("batwing: interrupted"), "{text}");
    assert!(
        partial(&at).is_empty() && names(&at.join("rays")).is_empty(),
        "{:?}",
        names(&at.join("rays"))
    );
}
