// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bad designs, gratings and command lines: one message (file, key, what was found, what was
//! expected), a non-zero exit, and nothing written.
//!
//! The cases of designs and gratings lie in `tests/bad_input/`; `batwing_tests::bad_input`
//! describes their form.

use std::path::{Path, PathBuf};

use bsdf::Grid;
use bsdf::native;
use tempfile::{TempDir, tempdir};

use arrays::npy;
use batwing_tests::bad_input::{Case, good, json_cases, toml_cases};
use batwing_tests::tables::smooth;
use batwing_tests::tilted_box::write_box;
use batwing_tests::{read, workspace};
use formats::level_image::png_of_rgb;
use formats::stl;
use simulate::bodies::bodies;

use crate::support::binary::batwing;
use crate::support::pictures::png;
use crate::zone_colours::coloured;
use crate::zones::boxed;

const DESIGN: &str = include_str!("../bad_input/design.toml");
const BARE_DOME: &str = include_str!("../bad_input/bare_dome.toml");
const STEPPED_DOME: &str = include_str!("../bad_input/stepped_dome.toml");
const GRATING: &str = include_str!("../bad_input/grating.json");

/// Everything below a folder.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let there = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = there.map(|e| e.expect("an entry").path()).collect();
    for folder in paths.clone().iter().filter(|path| path.is_dir()) {
        paths.extend(entries(folder));
    }
    paths.sort();
    paths
}

/// What is wrong with one refusal: the command must fail, say all `words` on standard error and
/// nothing on standard output, and write nothing.
fn fault(folder: &Path, arguments: &[&str], words: &[impl AsRef<str>]) -> Option<String> {
    let before = entries(folder);
    let output = batwing(folder).args(arguments).output().expect("it runs");
    let (stdout, stderr) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let lacks = words.iter().find(|word| !stderr.contains(word.as_ref()));
    let fault = if !matches!(output.status.code(), Some(1 | 2)) {
        format!("exit {:?}", output.status.code())
    } else if let Some(word) = lacks {
        format!("no `{}`", word.as_ref())
    } else if !stdout.is_empty() {
        format!("standard output {stdout}")
    } else if stderr.contains("panicked") || stderr.lines().count() != 1 && !arguments.is_empty() {
        "not one line".to_owned()
    } else if entries(folder) != before {
        "files".to_owned()
    } else {
        return None;
    };
    let line = arguments.join(" ");
    Some(format!("batwing {line}: {fault}: {stderr}"))
}

/// The good file passes the first command; every case is refused by all of them.
fn all_refused(folder: &Path, file: &str, (good, cases): &(String, Vec<Case>), commands: &[&str]) {
    let path = folder.join(file);
    let commands: Vec<Vec<&str>> = commands.iter().map(|line| line.split(' ').collect()).collect();
    std::fs::write(&path, good).expect("written");
    batwing(folder).args(&commands[0]).assert().success();
    let mut faults = Vec::new();
    for Case { title, words, text } in cases {
        std::fs::write(&path, text).expect("written");
        for command in &commands {
            let fault = fault(folder, command, words);
            faults.extend(fault.map(|fault| format!("{title}: {fault}")));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn bad_designs_are_refused_alike_by_every_command() {
    let folder = tempdir().expect("a folder");
    let cases = toml_cases(DESIGN);
    assert!(cases.1.len() >= 40, "{} cases", cases.1.len());
    let commands = ["check bad.toml", "run bad.toml --out out", "bsdf bad.toml --out out"];
    all_refused(folder.path(), "bad.toml", &cases, &commands);
}

#[test]
fn bad_parts_of_the_bare_dome_are_refused() {
    let folder = tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    };
    write("flat.csv", b"r,z\n0,1\n1,x\n");
    write("dark.csv", b"500,0\n600,0\n");
    write("bent.csv", b"0,1\n# up\n1 1\n0.5 1\n1 0\n");
    write("low.csv", b"0,0.9\n1.7,0\n");
    write("cone.csv", b"0,1\n1.7,0\n");
    for (name, first) in [("even", "1,1,1,1"), ("ragged", "1,1,1"), ("hole", "1,1,nan,1")] {
        write(&format!("{name}.csv"), format!("{first}\n{}", "1,1,1,1\n".repeat(3)).as_bytes());
    }
    write("few.csv", b"1,1,1\n1,1,1\n1,1,1\n");
    let mut line = Vec::new();
    npy::write(&mut line, &[16], &[1.0_f64; 16]).expect("an array");
    write("line.npy", &line);
    let mut large = Vec::new();
    npy::write(&mut large, &[709, 709], &vec![1.0_f64; 709 * 709]).expect("an array");
    write("large.npy", &large);
    write(
        "glass.yml",
        b"DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1.6 2e-5\n        0.8 1.4 0\n",
    );
    write_box(&folder.path().join("box.obj"), [1.0, 0.7, 0.3]);
    let bare = design::embedded("bare-dome.toml").expect("valid");
    let dome = &bodies(&bare, 1e-2).expect("a mesh")[..1];
    let mut bytes = Vec::new();
    stl::write(dome, "dome", &mut bytes).expect("written");
    write("dome.stl", &bytes);
    let cases = toml_cases(BARE_DOME);
    assert!(cases.1.len() >= 100, "{} cases", cases.1.len());
    let commands = ["check bad.toml", "run bad.toml --out out"];
    all_refused(folder.path(), "bad.toml", &cases, &commands);
}

#[test]
fn bad_receivers_and_files_of_a_stepped_dome_are_refused() {
    let folder = tempdir().expect("a folder");
    let mut bytes = Vec::new();
    let table = smooth(2.75, 8, Grid::ky_nodes(1.41, 1.0, 40));
    native::write(&table, &mut bytes).expect("written");
    std::fs::write(folder.path().join("smooth.bworders"), bytes).expect("written");
    let measured = read("tests/formats/corpus/small.zemax.bsdf");
    std::fs::write(folder.path().join("small.zemax.bsdf"), measured).expect("written");
    let cases = toml_cases(STEPPED_DOME);
    assert!(cases.1.len() >= 30, "{} cases", cases.1.len());
    let commands = ["check bad.toml", "run bad.toml --out out"];
    all_refused(folder.path(), "bad.toml", &cases, &commands);
}

#[test]
fn bad_gratings_are_refused() {
    let folder = tempdir().expect("a folder");
    let cases = json_cases(GRATING);
    assert!(cases.1.len() >= 20, "{} cases", cases.1.len());
    all_refused(folder.path(), "bad.json", &cases, &["grating bad.json"]);
}

/// A box without a dome and without neighbours.
const LAMP: &str = r#"
name = "lamp"
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5 }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
light = { wavelength_nm = 550.0 }
trace = { paths = 64_000 }
"#;

/// Command lines and what is said of them, in the folder of [`commands`].
const COMMANDS: &[(&str, &[&str])] = &[
    ("check no/such.toml", &["no/such.toml", "expected a design", "No such file"]),
    ("run no/such.toml --out out", &["no/such.toml", "expected a design", "No such file"]),
    ("bsdf no/such.toml --out out", &["no/such.toml", "expected a design", "No such file"]),
    ("grating no/such.json", &["no/such.json", "expected a case of a grating", "No such file"]),
    (
        "check no/such.bworders",
        &["no/such.bworders", "expected a table of diffraction orders", "No such file"],
    ),
    (
        "import no/such.ies",
        &["no/such.ies", "expected a table, a far field, rays or scattering", "No such file"],
    ),
    ("report no/such", &["no/such", "expected a directory of results", "No such file"]),
    (
        "run good.toml --threads 0",
        &["--threads: expected a whole number from 1 to 1024, got \"0\""],
    ),
    ("run good.toml --threads two", &["--threads", "two"]),
    ("run good.toml --seed -1", &["-1"]),
    ("run good.toml --paths 10", &["--paths", "10", "1000"]),
    ("run good.toml --model magic", &["--model", "magic", "hybrid"]),
    ("run good.toml --paths 2000000000000", &["--paths", "2000000000000", "1000"]),
    ("run good.toml --out file/out", &["file/out", "expected a directory, got the file `file`"]),
    (
        "run good.toml --out taken",
        &["taken/bad/", "expected a directory, got the file `taken/bad`"],
    ),
    ("run good.toml --out old", &["old/results.json", "got a directory"]),
    (
        "run good.toml --out out --cache file",
        &["--cache", "expected a directory, got the file `file`"],
    ),
    ("reproduce --out out --cache file/tables", &["--cache", "file/tables", "got the file `file`"]),
    ("bsdf good.toml --rings 171 --out out", &["--rings", "171", "1 to 170"]),
    ("bsdf good.toml --rings 0 --out out", &["--rings", "0", "representatives"]),
    ("bsdf good.toml --tolerance 0.5 --out out", &["--tolerance", "0.5", "0.1"]),
    ("run good.toml --until-error abc", &["--until-error", "abc", "uniformity"]),
    ("run good.toml --until-error uniformity=0", &["--until-error", "above 0"]),
    ("run good.toml --out", &["--out: expected DIR"]),
    ("run", &["run: expected DESIGN.toml"]),
    ("reproduce --fast", &["--fast", "reproduce --help"]),
    ("reproduce --out file/out", &["file/out"]),
    ("improve", &["improve"]),
    ("check", &["FILE"]),
    ("schema good.toml", &["KIND", "tolerance", "good.toml"]),
    ("", &["Usage"]),
    (
        "export d1.toml --format ies --paths 1000000000000 --out file/x.ies",
        &["--out: cannot write into `file`: expected a directory, got the file `file`"],
    ),
    (
        "export d1.toml --format tm25 --paths 1000000000000 --out file/x.tm25ray",
        &["--out: cannot write into `file`"],
    ),
    (
        "export d1.toml --format ies --paths 1000000000000 --out folder.ies",
        &["--out: cannot write `folder.ies`: expected a file or nothing, got a directory"],
    ),
    (
        "export d1.toml --format klems --paths 1000000000000 --out x.xml",
        &["is a design: expected --format step, stl, obj, dxf, svg"],
    ),
    (
        "export small.bworders --format tm25 --paths 1000000000000 --out x.tm25ray",
        &["is a table: expected --format zemax"],
    ),
    ("export small.bworders --format klems --out x.txt", &["expected a file ending in .xml"]),
    (
        "export small.ies --format ldt --out x.ldt",
        &["expected a design, a table of orders or a directory of results, got IES LM-63"],
    ),
    (
        "export missing --format ies --out x.ies",
        &["missing: expected a table, a far field, rays or scattering, cannot open it"],
    ),
    (
        "export folder.ies --format ies --out x.ies",
        &["far_field.npy: expected the far field of a run"],
    ),
    (
        "export d1.toml --format stl --chord-error 1e-9 --out x.stl",
        &["--chord-error: 0.000000001 um: expected one that 2e7 triangles reach"],
    ),
    (
        "export small.bworders --format zemax --scatter-step 7 --out x.bsdf",
        &["resolution of a file: step of scatter: expected degrees that divide 90, got 7"],
    ),
    (
        "import small.ies --format klems --out x.xml",
        &["--format: expected ies or ldt for `small.ies`, IES LM-63, got klems"],
    ),
    (
        "import small.klems.xml --format ies --out x.ies",
        &[
            "expected zemax, lighttools, speos, klems or tensortree for `small.klems.xml`, WINDOW/Radiance BSDF XML, got ies",
        ],
    ),
    (
        "import small.klems.xml --out x.xml",
        &["--format: expected klems or tensortree for a file ending in .xml, got none"],
    ),
    ("import wavelengths.tm25ray --out x.dat", &["expected a file that ends in .sdf"]),
    ("import columns.tm25ray --out x.tm25ray", &["expected rays with flux in W, got lm"]),
    ("converge d1.toml --ring 171", &["--ring 171", "1 to 170"]),
    ("converge d1.toml --ring 0", &["--ring 0", "1 to 170"]),
    ("converge d1.toml", &["--ring"]),
    ("converge none.toml --ring 5", &["none.toml"]),
    ("converge d1.toml --ring 75 --orders 20", &["--orders", "at least 28", "20"]),
    ("near-field d1.toml --ring 171", &["--ring 171", "1 to 170"]),
    ("near-field d1.toml --ring 0", &["--ring 0", "1 to 170"]),
    ("near-field d1.toml", &["--ring"]),
    ("near-field none.toml --ring 5", &["none.toml"]),
    ("near-field d1.toml --ring 75 --orders 20", &["--orders", "at least 28", "20"]),
    ("converge d1.toml --ring 75 --slices 0", &["--slices", "from 1 to 40000"]),
    ("converge d1.toml --ring 75 --slices 1000000000", &["--slices", "from 1 to 40000"]),
    ("near-field d1.toml --ring 75 --slices 100000000000", &["--slices", "from 1 to 100000"]),
    ("near-field d1.toml --ring 75 --theta-deg 90", &["--theta-deg", "90"]),
    ("near-field d1.toml --ring 75 --theta-deg -90", &["--theta-deg", "-90"]),
    ("near-field d1.toml --ring 75 --theta-deg inf", &["--theta-deg", "inf"]),
    ("near-field d1.toml --ring 75 --theta-deg steep", &["--theta-deg", "steep"]),
    ("near-field d1.toml --ring 75 --margin-um 500", &["--margin-um", "points"]),
    ("full-wave lamp.toml", &["lamp.toml", "dome: expected a dome, got none"]),
    ("full-wave none.toml", &["none.toml"]),
    ("full-wave d1.toml --rings 0", &["--rings", "from 1 to 2000"]),
    (
        "full-wave mesh.toml",
        &["mesh.toml", "dome.mesh: expected a dome with a section, got a mesh"],
    ),
    (
        "full-wave d1.toml --rings 2 --nodes 3",
        &["--nodes: expected 7.0, which a tolerance of 1e-5 needs, to 40, got 3"],
    ),
    (
        "full-wave d1.toml --rings 2 --tolerance 1e-8 --nodes 8",
        &["--nodes: expected 10.0, which a tolerance of 1e-8 needs, to 40, got 8"],
    ),
    ("full-wave d1.toml --tolerance 0", &["--tolerance: expected 1e-10 to 1e-3, got 0"]),
    (
        "full-wave d1.toml --rings 1 --ring-width-um 0.4",
        &["d1.toml: led.size_mm", "source 1 at", "inside the outline and at least", "outside"],
    ),
    (
        "full-wave d1.toml --rings 2 --ring-width-um -1",
        &["d1.toml", "--ring-width-um: expected a number above 0 to 1000, got -1"],
    ),
    (
        "full-wave d1.toml --rings 2 --ring-width-um 1e9",
        &["--ring-width-um: expected a number above 0 to 1000, got 1000000000"],
    ),
    ("full-wave d1.toml --scale 0", &["--scale: expected a number above 0 to 10, got 0"]),
    ("full-wave d1.toml --paths -4", &["--paths", "expected a whole number from"]),
    ("full-wave d1.toml --tolerance -1", &["--tolerance: expected 1e-10 to 1e-3, got -1"]),
    ("full-wave d1.toml --nodes -1", &["--nodes: expected 7.0", "got -1"]),
    ("full-wave d1.toml --memory-gib -1", &["--memory-gib: expected a number above 0", "got -1"]),
    ("full-wave d1.toml --rings 2 --ring-width-um 2 --scale 1", &["--scale"]),
    (
        "full-wave d1.toml --rings 4 --memory-gib 0.001",
        &[
            "d1.toml: --memory-gib, --rings, --ring-width-um or --scale, --nodes, --tolerance: memory: ",
            "expected at most 0.001 GiB",
            "unknowns",
        ],
    ),
    (
        "full-wave d1.toml --memory-gib 0.001",
        &["d1.toml: --memory-gib, --rings", "memory: expected at most 0.001 GiB"],
    ),
    ("full-wave d1.toml --rings 2 --out file", &["cannot write into `file`", "got the file"]),
    (
        "zones boxed.toml --pattern drives.csv --zones 2x2",
        &[
            "boxed.toml: --zones: expected columns and rows that divide 5 x 5 packages evenly, got 2 x 2",
        ],
    ),
    (
        "zones boxed.toml --pattern drives.csv --zones 5x1",
        &["`drives.csv`: --pattern: expected 5 x 1 drives, one for each zone (--zones), got 5 x 5"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --zones -1x5",
        &["--zones: expected columns and rows from 1 to 10000, such as 48x27, got \"-1x5\""],
    ),
    (
        "zones boxed.toml --pattern drives.csv --packages=-9x9",
        &["--packages: expected columns and rows from 1 to 10000, such as 48x27, got \"-9x9\""],
    ),
    (
        "zones boxed.toml --pattern bright.csv",
        &["`bright.csv`: line 2, column 1: expected a number from 0 to 1, got \"1.5\""],
    ),
    (
        "zones boxed.toml --pattern nan.csv",
        &["`nan.csv`: line 1, column 2: expected a number from 0 to 1, got \"NaN\""],
    ),
    (
        "zones boxed.toml --pattern colours.png",
        &["`colours.png`: colour type: expected grey of 8 or 16 bits", "got Rgba of 8 bits"],
    ),
    (
        "zones boxed.toml --pattern dark.csv --zones 1x1",
        &["`dark.csv`: --pattern: expected a drive above 0 in a zone, got none"],
    ),
    (
        "zones boxed.toml --pattern tiny.csv",
        &["`tiny.csv`: --pattern: expected drives of 0 or from 1e-12 to 1, got 1e-300"],
    ),
    ("zones boxed.toml --pattern none.csv", &["none.csv"]),
    ("zones boxed.toml --pattern drives.csv --picture colours.png", &["`colours.png`"]),
    (
        "zones boxed.toml --pattern drives.csv --contrast 0.5",
        &["--contrast", "expected a number of at least 1", "0.5"],
    ),
    ("zones boxed.toml --pattern drives.csv --contrast nan", &["at least 1", "nan"]),
    ("zones boxed.toml --pattern drives.csv --distance 0", &["--distance", "from 10 to 1e6", "0"]),
    (
        "zones boxed.toml --pattern drives.csv --distance 600 --age 200",
        &["--age", "years from 0 to 120", "200"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --distance 600 --pigment 2",
        &["--pigment", "from 0 (black) to 1.2", "2"],
    ),
    ("zones boxed.toml --pattern drives.csv --age 30", &["--distance"]),
    ("zones boxed.toml --pattern drives.csv --zones 5", &["--zones", "such as 48x27"]),
    (
        "zones boxed.toml --pattern drives.csv --packages 4x5",
        &["boxed.toml: --packages: expected 5 columns as in the design or more, got 4"],
    ),
    (
        "zones d1.toml --pattern drives.csv --packages 5x5",
        &["d1.toml: --packages: expected 2 columns", "from 5 columns, got 5"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --receiver back",
        &["--receiver: expected a plane or luminance receiver that faces up (front), got \"back\""],
    ),
    ("zones boxed.toml --pattern drives.csv --model all", &["--model: expected one model"]),
    ("zones boxed.toml --pattern drives.csv --direct --packages 9x9", &["--packages"]),
    ("zones boxed.toml --pattern drives.csv --out file", &["cannot write into `file`"]),
    (
        "zones boxed.toml --pattern drives.csv --white 6504K",
        &["--white: expected a design with several channels", "got `boxed.toml` without"],
    ),
    (
        "zones rgb.toml --pattern full.csv --white 0.1,0.8",
        &[
            "rgb.toml: --white: expected a white within the gamut of the channels, got 0.1000,0.8000",
            "the one of red (",
        ],
    ),
    ("zones rgb.toml --pattern full.csv --white 500K", &["--white", "from 1000K to 25000K"]),
    (
        "zones rgb.toml --pattern cyan=full.csv --pattern red=full.csv",
        &["--pattern: expected a channel of the design (red, green, blue), got \"cyan\""],
    ),
    (
        "zones rgb.toml --pattern red=full.csv --pattern green=full.csv --picture full.csv",
        &["--pattern: expected a file for each channel", "got none for \"blue\""],
    ),
    (
        "zones rgb.toml --pattern red=full.csv --pattern green=full.csv --pattern blue=full.csv",
        &["--picture: expected one beside a pattern for each channel, got none"],
    ),
    (
        "zones rgb.toml --pattern full.csv --picture colours.png",
        &["`colours.png`: colour type: expected grey or RGB of 8 or 16 bits", "got Rgba"],
    ),
    (
        "zones rgb.toml --pattern full.csv --picture frames",
        &["2.png`: --picture: expected 2 x 1 pixels as in the first, got 3 x 1"],
    ),
    (
        "zones rgb.toml --picture frames/1.png --levels max",
        &["1.png`: --levels: expected a pixel or more in every zone of 3 x 3, got 2 x 1 pixels"],
    ),
    ("zones rgb.toml --picture full.csv --levels median", &["--levels", "percentile=P"]),
    (
        "zones rgb.toml --picture full.csv --levels max --power-limit 2",
        &["--power-limit", "a share of full white above 0, up to 1"],
    ),
    (
        "zones rgb.toml --pattern full.csv --transfer pq",
        &["`full.csv`: --transfer: expected srgb, linear or gamma=G where levels are not in cd/m²"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --transfer srgb",
        &["--transfer: expected a design with [panel] sub_pixels, got `boxed.toml` without"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --gamut bt2020",
        &["--gamut: expected a design with [panel] sub_pixels, got `boxed.toml` without"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --test-patterns",
        &["--test-patterns: expected a design with several channels", "got `boxed.toml` without"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --distance 600",
        &["--distance: expected a luminance --receiver", "got \"plane\""],
    ),
    (
        "zones coarse.toml --pattern drives.csv --receiver front",
        &[
            "coarse.toml: --receiver: expected bins with a middle on the panel, x from -15 to 15 mm",
            "got \"front\" with bins of 50 mm",
        ],
    ),
    (
        "zones rgb.toml --pattern full.csv --picture frames/1.png --white 0.2,0.33",
        &[
            "1.png`: --gamut: expected primaries about the white of the panel, 0.2000,0.3300, got BT.709",
        ],
    ),
    (
        "zones rgb.toml --pattern full.csv --picture profile.png",
        &[
            "`profile.png`: colour space: expected sRGB, or cICP of full range, got gAMA or cHRM other than of sRGB",
            "--gamut and --transfer state it",
        ],
    ),
    (
        "zones rgb.toml --pattern full.csv --picture laws",
        &["2.png`: colour space: expected grey, linear as in the first picture, got BT.709, sRGB"],
    ),
    (
        "zones boxed.toml --pattern drives.csv --picture linear-gamma.png",
        &[
            "`linear-gamma.png`: colour space: expected sRGB or linear light on a panel without sub_pixels, got gAMA or cHRM other than of sRGB",
        ],
    ),
    (
        "zones rgb.toml --pattern full.csv --picture linear-gamma.png",
        &[
            "`linear-gamma.png`: colour space: expected sRGB, or cICP of full range, got gAMA",
            "; --transfer states it",
        ],
    ),
    (
        "zones red.toml --pattern full.csv --picture frames/1.png --paths 1000000000",
        &[
            "1.png`: --gamut: expected primaries about the white of the panel,",
            "got BT.709; --white states another white",
        ],
    ),
    ("zones rgb.toml --pattern full.csv --direct", &["--direct: expected none with channels"]),
    ("import f.doc", &["f.doc: expected a table, a far field, rays or scattering, cannot open it"]),
    ("import file", &["expected a file ending in"]),
    (
        "run lamp.toml --until-error uniformity=1% --out r",
        &["lamp.toml: expected a figure", "got uniformity, which compares neighbouring LEDs"],
    ),
    (
        "run lamp.toml --until-error illuminance_valley_to_peak=1% --out r",
        &["lamp.toml: expected a figure", "of which there are none"],
    ),
    (
        "run lamp.toml --until-error extraction_efficiency=1% --out r",
        &["lamp.toml: expected a figure", "there is no dome"],
    ),
    (
        "run lamp.toml --until-error peak_angle_parabola_deg=0.2 --out r",
        &["lamp.toml: expected a figure", "far_field.peak is no bin"],
    ),
    (
        "run lamp.toml --until-error centre_to_peak=1e-9 --most-paths 999",
        &["--most-paths: expected a whole number from 1000"],
    ),
];

/// A folder with good designs, small files of other programs, and folders and files in the way.
fn commands() -> TempDir {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let corpus = workspace().join("tests/formats/corpus");
    for entry in std::fs::read_dir(corpus).expect("the corpus") {
        let entry = entry.expect("an entry");
        std::fs::copy(entry.path(), at.join(entry.file_name())).expect("copied");
    }
    let write = |name: &str, text: &str| std::fs::write(at.join(name), text).expect("written");
    write("good.toml", &good(DESIGN));
    write("d1.toml", &read("data/designs/d1.toml"));
    write("lamp.toml", LAMP);
    write("boxed.toml", &boxed(5));
    write("rgb.toml", &coloured());
    write("full.csv", &"1,1,1\n".repeat(3));
    // Bins whose middles all lie beyond the panel.
    let coarse = boxed(5).replace(
        "size_mm = [30.0, 30.0]\nbins = [30, 30]",
        "size_mm = [100.0, 100.0]\nbins = [2, 2]",
    );
    write("coarse.toml", &coarse);
    std::fs::create_dir(at.join("laws")).expect("a folder");
    std::fs::write(at.join("laws/1.png"), png(png::ColorType::Grayscale, None)).expect("written");
    std::fs::write(at.join("laws/2.png"), png(png::ColorType::Rgb, None)).expect("written");
    std::fs::write(at.join("linear-gamma.png"), png(png::ColorType::Grayscale, Some(1.0)))
        .expect("written");
    // A die that is red alone has no white.
    let red = coloured().replace("[440.0, 455.0, 470.0]", "[612.0, 632.0, 652.0]");
    write("red.toml", &red.replace("[500.0, 530.0, 560.0]", "[614.0, 634.0, 654.0]"));
    std::fs::write(at.join("profile.png"), png(png::ColorType::Rgb, Some(1.0))).expect("written");
    std::fs::create_dir(at.join("frames")).expect("a folder");
    for (name, columns) in [("1", 2), ("2", 3)] {
        let png = png_of_rgb(columns, &vec![90; 3 * columns]).expect("a row");
        std::fs::write(at.join(format!("frames/{name}.png")), png).expect("written");
    }
    write("drives.csv", &"0,1,0,1,0\n".repeat(5));
    write("bright.csv", "0,1\n1.5,0\n");
    write("nan.csv", "0,NaN\n");
    write("dark.csv", "0\n");
    write("tiny.csv", &"0,1,1e-300,1,0\n".repeat(5));
    let colours = workspace().join("docs/images/illuminance-my-package.png");
    std::fs::copy(colours, at.join("colours.png")).expect("copied");
    let by_file = read("data/designs/bare-dome.toml").replace(
        "sphere_radius_mm = 2.0\nheight_mm = 1.0\nwidth_mm = 3.4\n",
        "mesh = \"dome.stl\"\nmesh_unit = \"mm\"\n",
    );
    write("mesh.toml", &by_file);
    write_dome(at);
    write("file", "");
    for made in ["taken", "old/results.json", "folder.ies"] {
        std::fs::create_dir_all(at.join(made)).expect("made");
    }
    write("taken/bad", "");
    folder
}

/// The bare dome as a mesh, `dome.stl`.
fn write_dome(folder: &Path) {
    let design = design::load(&workspace().join("data/designs/bare-dome.toml")).expect("valid");
    let mut dome = bodies(&design, 0.05).expect("a mesh");
    dome.truncate(1);
    let mut bytes = Vec::new();
    stl::write(&dome, "dome", &mut bytes).expect("written");
    std::fs::write(folder.join("dome.stl"), bytes).expect("written");
}

#[test]
fn bad_command_lines_are_refused() {
    let folder = commands();
    let mut faults = Vec::new();
    for (line, words) in COMMANDS {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        faults.extend(fault(folder.path(), &arguments, words));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
