// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files of another kind than their ending says, files that would be written over, and files that
//! are odd and can be used.

use crate::bad_files::{complaint, folder, text_of, write};
use crate::support::binary::batwing;

#[test]
fn a_file_of_another_kind_is_named() {
    let (_keep, at) = folder();
    let file = |name: &str| std::fs::read(at.join(name)).expect("a file");
    for (name, bytes, expected) in [
        (
            "a.ies",
            file("small.ldt"),
            "expected IES LM-63, as its ending says, got what seems to be EULUMDAT: the ending .ldt reads it",
        ),
        ("a.ldt", file("small.ies"), "got what seems to be IES LM-63: the ending .ies reads it"),
        (
            "a.xml",
            file("small.zemax.bsdf"),
            "got what seems to be a Zemax tabular BSDF: the ending .bsdf reads it",
        ),
        (
            "a.bsdf",
            file("small.klems.xml"),
            "expected a LightTools BSDF or a Zemax tabular BSDF, as its ending says, got what seems to be a WINDOW/Radiance BSDF",
        ),
        (
            "a.tm25ray",
            file("plain.ray"),
            "got what seems to be a LightTools ray file: the ending .ray reads it",
        ),
        (
            "a.ray",
            file("colour.sdf"),
            "got what seems to be a Zemax ray file: the ending .dat reads it",
        ),
        (
            "a.npz",
            file("far_field.npy"),
            "expected a NumPy archive, got what seems to be a single NumPy array",
        ),
        (
            "a.ies",
            b"\x89PNG\r\n\x1a\n".to_vec(),
            "expected IES LM-63, got what seems to be a PNG picture",
        ),
        ("a.doc", b"%PDF-1.4".to_vec(), "expected a file ending in .bworders, .json, .npz"),
        (
            "a.bsdf180",
            b"OPTIS BSDF180".to_vec(),
            "got what seems to be a Speos file of another kind",
        ),
        (
            "a.anisotropicbsdf",
            b"OPTIS - Anisotropic BSDF surface file v8.0\n1\n\0\0".to_vec(),
            "line 2: expected 0 (text): the layout of mode 1 (binary) is not public",
        ),
    ] {
        write(&at, name, &bytes);
        let got = complaint(&at, &["import", name]);
        assert!(got.contains(expected) && got.contains(name), "{name}: {got}");
    }
    // An ending that says nothing is no obstacle.
    write(&at, "led.IES_OLD", file("small.ies"));
    batwing(&at).args(["import", "led.IES_OLD"]).assert().success();
}

#[test]
fn a_file_is_never_written_over_itself() {
    let (_keep, at) = folder();
    std::fs::copy(at.join("small.zemax.bsdf"), at.join("z-outer-brdf.bsdf")).expect("copied");
    for arguments in [
        &["import", "small.ies", "--out", "small.ies"][..],
        &["import", "small.ies", "--out", "./small.ies"],
        &["import", "plain.ray", "--out", "plain.ray"],
        &["import", "small.json", "--out", "small.json"],
        &["export", "small.json", "--out", "small.json"],
        &["import", "z-outer-brdf.bsdf", "--format", "zemax", "--out", "z.bsdf"],
    ] {
        let before = std::fs::read(at.join(arguments[1])).expect("a file");
        let got = complaint(&at, arguments);
        assert!(got.contains("--out: expected another file than the one that is read"), "{got}");
        assert_eq!(std::fs::read(at.join(arguments[1])).expect("a file"), before);
    }
}

#[test]
fn what_is_odd_is_read_with_a_warning() {
    let (_keep, at) = folder();
    let ldt = text_of("small.ldt").replacen("\n190", "\n190e6", 1);
    let gain = text_of("small.lighttools.bsdf").replacen("TIS 0.25", "TIS 0.79", 1);
    for (name, text, expected) in [
        (
            "a.ies",
            text_of("small.ies").replacen("1 1000 2", "1 200 2", 1),
            "a.ies: the intensities add up to",
        ),
        ("a.ldt", ldt, "lm, more than the 1000 lm that the file states for its lamps"),
        (
            "b.ies",
            text_of("small.ies").replacen("LM-63-1995", "LM-63-2030", 1),
            "b.ies: line 1: version `IESNA:LM-63-2030` is not known here",
        ),
        ("sets.ldt", text_of("sets.ldt"), "sets.ldt: 2 sets of lamps, the first is taken"),
        ("a.bsdf", gain, "adds up to 1.04"),
        ("small.brdf", text_of("small.brdf"), "tables for 2 wavelengths; that for 560 nm is taken"),
    ] {
        write(&at, name, text);
        let out =
            if name.ends_with("bsdf") { &["--format", "klems", "--out", "k.xml"][..] } else { &[] };
        let output = batwing(&at).args(["import", name]).args(out).output().expect("runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{name}: {said}");
        assert!(
            said.contains(expected) && said.starts_with("batwing: warning: "),
            "{name}: {said}"
        );
    }
    let got = complaint(&at, &["import", "sets.ldt", "--lamp-set", "3"]);
    assert!(got.contains("line 26: expected a set of lamps from 1 to 2, got 3"), "{got}");
    let got = complaint(&at, &["import", "small.ies", "--lamp-set", "2"]);
    assert!(got.contains("--lamp-set: expected an EULUMDAT file, got IES LM-63"), "{got}");
}
