// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a hostile user does to `batwing export` and `batwing import`: files in which lines end in two ways, headers that promise too much, power from nothing,
//! places that cannot be written, formats that do not fit, Ctrl-C. Each ends in one line that names the file and what was expected, and leaves nothing behind.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use crate::support::binary::batwing;
use crate::support::runs::{interrupted, partial};
use batwing_tests::{read, workspace};

const CORPUS: &str = "tests/formats/corpus";

/// Runs and returns the one line of complaint.
fn complaint(at: &Path, arguments: &[&str]) -> String {
    let output = batwing(at).args(arguments).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    text
}

/// A directory with the corpus in it.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a directory");
    let path = folder.path().to_path_buf();
    for entry in std::fs::read_dir(workspace().join(CORPUS)).expect("the corpus") {
        let entry = entry.expect("an entry");
        std::fs::copy(entry.path(), path.join(entry.file_name())).expect("copied");
    }
    (folder, path)
}

fn write(at: &Path, name: &str, bytes: impl AsRef<[u8]>) {
    std::fs::write(at.join(name), bytes).expect("written");
}

fn names(at: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(at)
        .expect("a directory")
        .map(|e| {
            e.expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
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
fn text_of(name: &str) -> String {
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
            (
                "\n",
                "\r\n",
                "expected every line to end in LF, as line 1 does, got CR LF",
            ),
            (
                "\r\n",
                "\n",
                "expected every line to end in CR LF, as line 1 does, got LF",
            ),
            (
                "\n",
                "\r",
                "expected every line to end in LF, as line 1 does, got CR",
            ),
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
            (
                marked,
                "offset 0: expected text in UTF-8 or ASCII, got text in UTF-16",
            ),
            (
                wide,
                "offset 1: expected text in UTF-8 or ASCII, got a zero byte",
            ),
            (Vec::new(), "expected"),
            (text.as_bytes()[..text.len() / 2].to_vec(), "expected"),
        ] {
            write(&at, name, &bytes);
            let got = complaint(&at, &["import", name]);
            // JSON that ends early says where in words of its own.
            let place = got.contains("line 1") || got.contains("line ") || got.contains("offset ");
            let json = name == "pretty.json" && got.contains("EOF");
            assert!(
                got.contains(name) && (json || got.contains(expected) && place),
                "{got}"
            );
        }
    }
    for name in [
        "small.bworders",
        "stored.npz",
        "wavelengths.tm25ray",
        "plain.ray",
    ] {
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
    // An archive whose array `s` claims a trillion values, and one in which a megabyte of zeros stands packed where 100 belong.
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
                to.write_all(&npy("<f4", shape, &vec![0; values]))
                    .expect("written");
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
    assert!(
        got.contains("bytes in all (18446744073709551615 rays of 32), got 36672"),
        "{got}"
    );
    std::fs::create_dir(at.join("results")).expect("made");
    write(
        &at,
        "results/far_field.npy",
        npy("<f8", "2, 90, 4000000000", &[0; 8]),
    );
    let got = complaint(
        &at,
        &["export", "results", "--format", "ies", "--out", "x.ies"],
    );
    assert!(
        got.contains("far_field.npy: offset ") && got.contains("[2, 90, 4000000000]"),
        "{got}"
    );
}

#[test]
fn power_from_nothing_and_blocks_that_contradict_are_refused() {
    let (_keep, at) = folder();
    for (from, name, old, new, expected) in [
        (
            "small.ies",
            "a.ies",
            "1 1000 2 3 3",
            "1 200 2 3 3",
            "line 9: expected lamps with at least the flux of the intensities",
        ),
        (
            "small.ies",
            "a.ies",
            "3 3 1 2",
            "3 3 3 2",
            "line 9: expected photometric type: 1 (C",
        ),
        (
            "small.ldt",
            "a.ldt",
            "\n190",
            "\n190e6",
            "line 29: expected lamps with at least the flux",
        ),
        (
            "small.klems.xml",
            "a.xml",
            "\n7 0",
            "\n70 0",
            "expected a power of at most 1 from incidence 1",
        ),
        (
            "small.isotropic.xml",
            "a.xml",
            "version=\"1.0\"",
            "version=\"2.0\"",
            "line 1: expected version 1 of XML, got `2.0`",
        ),
        (
            "small.lighttools.bsdf",
            "a.bsdf",
            "TIS 0.25",
            "TIS 1.25",
            "expected TIS: a power from 0 to 1, got `1.25`",
        ),
        (
            "small.lighttools.bsdf",
            "a.bsdf",
            "AOI 0\n",
            "AOI 45\n",
            "expected one block for Front BRDF, AOI 45, POI 0, got a second one",
        ),
        (
            "small.lighttools.bsdf",
            "a.bsdf",
            "POI 0\n",
            "POI 17\n",
            "expected one block for each of 2 AOI x 3 POI",
        ),
        (
            "small.lighttools.bsdf",
            "a.bsdf",
            "Wavelength 550\n",
            "Wavelength 500\n",
            "expected one wavelength in the whole file, 500 nm, got 550",
        ),
        (
            "small.zemax.bsdf",
            "a.bsdf",
            "AngleOfIncidence  2",
            "AngleOfIncidence  2 2",
            "line 9: expected AngleOfIncidence angle: an angle above 2",
        ),
        (
            "small.zemax.bsdf",
            "a.bsdf",
            "BRDF",
            "BSDF",
            "line 5: expected BRDF or BTDF, got `BSDF`",
        ),
    ] {
        let text = text_of(from);
        assert!(text.contains(old), "{from} {old}");
        write(&at, name, text.replacen(old, new, 1));
        let got = complaint(&at, &["import", name]);
        assert!(got.contains(expected) && got.contains(name), "{got}");
    }
    // Half reflected and more than half transmitted: each alone is possible.
    let text = text_of("small.lighttools.bsdf").replace("TIS 0.25", "TIS 0.75");
    write(&at, "a.bsdf", text);
    let got = complaint(&at, &["import", "a.bsdf"]);
    assert!(
        got.contains("a.bsdf: ") && got.contains("expected shares that sum to at most 1, got 1.5"),
        "{got}"
    );
}

/// Command lines, and what is said of them.
const REFUSED: [(&str, &str); 16] = [
    (
        "export DESIGN --format ies --paths MANY --out file/x.ies",
        "--out: cannot write into `file`: expected a directory, got the file `file`",
    ),
    (
        "export DESIGN --format tm25 --paths MANY --out file/x.tm25ray",
        "--out: cannot write into `file`",
    ),
    (
        "export DESIGN --format ies --paths MANY --out folder.ies",
        "--out: cannot write `folder.ies`: expected a file or nothing, got a directory",
    ),
    (
        "export DESIGN --format klems --paths MANY --out x.xml",
        "is a design: expected --format stl, obj, dxf, svg",
    ),
    (
        "export small.bworders --format tm25 --paths MANY --out x.tm25ray",
        "is a table: expected --format zemax",
    ),
    (
        "export small.bworders --format klems --out x.txt",
        "expected a file ending in .xml",
    ),
    (
        "export small.ies --format ldt --out x.ldt",
        "expected a design, a table of orders or a directory of results, got IES LM-63",
    ),
    (
        "export missing --format ies --out x.ies",
        "missing: expected a table, a far field, rays or scattering, cannot open it",
    ),
    (
        "export folder.ies --format ies --out x.ies",
        "far_field.npy: expected the far field of a run",
    ),
    (
        "export DESIGN --format stl --chord-error 1e-9 --out x.stl",
        "--chord-error: 0.000000001 um: expected one that 2e7 triangles reach",
    ),
    (
        "export small.bworders --format zemax --scatter-step 7 --out x.bsdf",
        "resolution of a file: step of scatter: expected degrees that divide 90, got 7",
    ),
    (
        "import small.ies --format klems --out x.xml",
        "x.xml`: expected a file ending in .ies or .ldt",
    ),
    (
        "import small.klems.xml --format ies --out x.ies",
        "expected zemax, lighttools, klems or tensortree for WINDOW/Radiance BSDF XML, got ies",
    ),
    (
        "import small.klems.xml --out x.xml",
        "expected zemax, lighttools, klems or tensortree for WINDOW/Radiance BSDF XML, got none",
    ),
    (
        "import wavelengths.tm25ray --out x.ray",
        "expected one wavelength for all rays, got",
    ),
    (
        "import columns.tm25ray --out x.ray",
        "expected rays with flux in W, got lm",
    ),
];

#[test]
fn what_cannot_be_written_or_does_not_fit_is_refused_before_any_work() {
    let (_keep, at) = folder();
    std::fs::copy(workspace().join("data/designs/d1.toml"), at.join("d1.toml")).expect("copied");
    write(&at, "file", "x");
    std::fs::create_dir(at.join("folder.ies")).expect("made");
    let before = names(&at);
    for (line, expected) in REFUSED {
        // So many paths would take weeks.
        let line = line
            .replace("DESIGN", "d1.toml")
            .replace("MANY", "1000000000000");
        let got = complaint(&at, &line.split(' ').collect::<Vec<_>>());
        assert!(got.contains(expected), "{line}: {got}");
        assert_eq!(names(&at), before, "{line}");
    }
}

#[test]
fn a_directory_that_is_missing_is_made() {
    let (_keep, at) = folder();
    let arguments = [
        "export",
        "small.bworders",
        "--format",
        "json",
        "--out",
        "new/er/x.json",
    ];
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
            entries
                .flatten()
                .any(|e| size(&PathBuf::from(e.file_name())) > 2_000_000)
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
