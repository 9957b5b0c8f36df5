// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shards of a job and their merge: the bytes of the whole command, whatever is lost on the way.
//!
//! Source: `docs/guide/cluster.md`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

use runtime::content_hash::sealed;

use crate::optimise::PROBLEM;
use crate::support::binary::batwing;
use crate::support::runs::{contents, files, partial, signalled, small};

const RUN: [&str; 4] = ["run", "small.toml", "--paths", "30000"];

const STUDY: &str = r#"
name = "two"
designs = ["small.toml"]
models = ["geometric", "hybrid"]
paths = 6400

[[factors]]
name = "box"
key = "led.reflectance"
values = [0.5, 0.9]
"#;

const TOLERANCE: &str = r#"
name = "mirror"
design = "small.toml"
samples = 8
paths = 4096
figures = ["extraction_efficiency"]

[[tolerances]]
key = "mirror.reflectance"
distribution = "uniform"
half_width = 0.04
"#;

/// A search whose paths are doubled.
fn doubling() -> String {
    let paths = "paths = 4096\nmost_paths = 4096";
    PROBLEM.replace(paths, "paths = 8192\nmost_paths = 16384")
}

/// Exit code and standard error.
fn says(folder: &Path, words: &[&str]) -> (Option<i32>, String) {
    let output = batwing(folder).args(words).arg("--quiet").output().expect("it runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.code(), said)
}

fn does(folder: &Path, words: &[&str]) {
    assert_eq!(says(folder, words), (Some(0), String::new()), "{words:?}");
}

/// `command` in the folder `at` with results in its `out` and a cache beside them.
fn in_place<'a>(command: &[&'a str], at: &'a [String; 2], more: &[&'a str]) -> Vec<&'a str> {
    [command, &["--out", &at[0], "--cache", &at[1]], more].concat()
}

fn place(name: &str) -> [String; 2] {
    ["out", "cache"].map(|folder| format!("{name}/{folder}"))
}

fn whole(folder: &Path, command: &[&str]) -> BTreeMap<PathBuf, Vec<u8>> {
    let at = place("whole");
    does(folder, &in_place(command, &at, &[]));
    contents(&folder.join("whole"))
}

/// What [`RUN`] leaves as one command, in a folder of its own.
fn whole_run() -> &'static BTreeMap<PathBuf, Vec<u8>> {
    static WHOLE: OnceLock<BTreeMap<PathBuf, Vec<u8>>> = OnceLock::new();
    WHOLE.get_or_init(|| whole(small().path(), &RUN))
}

/// Computes `count` shards of `command` in `name`, the last first.
fn shards(folder: &Path, command: &[&str], name: &str, count: usize) {
    let at = place(name);
    for shard in (0..count).rev() {
        let shard = format!("{shard}/{count}");
        does(folder, &in_place(command, &at, &["--shard", &shard]));
    }
}

fn merge(folder: &Path, name: &str) -> (Option<i32>, String) {
    says(folder, &["merge", &format!("{name}/out")])
}

fn groups(folder: &Path) -> Vec<PathBuf> {
    let mut groups = files(folder);
    groups.retain(|path| path.extension().is_some_and(|ending| ending == "group"));
    groups.sort();
    groups
}

#[test]
#[ignore = "slow: 22 s"]
fn any_number_of_shards_leaves_what_one_command_leaves() {
    let folder = small();
    let folder = folder.path();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("written");
    write("study.toml", STUDY);
    write("tolerance.toml", TOLERANCE);
    let commands: [&[&str]; 4] = [
        &RUN,
        &["bsdf", "small.toml", "--rings", "5,15", "--tolerance", "0.05"],
        &["study", "study.toml"],
        &["tolerance", "tolerance.toml"],
    ];
    for command in commands {
        let expected = whole(folder, command);
        assert!(!expected.is_empty());
        // Those of one shard are those of the command itself; a run alone shows it.
        let counts: &[usize] = if command == RUN { &[1, 5] } else { &[5] };
        for &count in counts {
            shards(folder, command, "shared", count);
            // Repeated, a shard finds everything.
            let at = place("shared");
            does(folder, &in_place(command, &at, &["--shard", &format!("0/{count}")]));
            assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
            let merged = contents(&folder.join("shared"));
            assert!(
                merged == expected,
                "{command:?}, {count} shards: {:?} {:?}",
                merged.keys(),
                expected.keys()
            );
            std::fs::remove_dir_all(folder.join("shared")).expect("removed");
        }
        std::fs::remove_dir_all(folder.join("whole")).expect("removed");
    }
}

#[test]
fn shards_side_by_side_and_twice_at_once_leave_the_same() {
    let folder = small();
    let folder = folder.path();
    let at = place("shared");
    std::thread::scope(|scope| {
        for shard in ["0/3", "1/3", "2/3", "1/3"] {
            let words = in_place(&RUN, &at, &["--shard", shard, "--threads", "1"]);
            scope.spawn(move || does(folder, &words));
        }
    });
    assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
    assert!(contents(&folder.join("shared")) == *whole_run());
}

#[test]
#[ignore = "slow: 4 s"]
fn a_merge_names_what_is_missing_and_the_command_that_computes_it() {
    let folder = small();
    let folder = folder.path();
    shards(folder, &RUN, "shared", 4);
    let cache = folder.join("shared/cache");
    let all = groups(&cache);
    assert_eq!(all.len(), 4 * 64);
    // One is missing, one altered, one that of another place; and a table is missing.
    std::fs::remove_file(&all[0]).expect("removed");
    let mut bytes = std::fs::read(&all[1]).expect("a group");
    bytes[100] ^= 1;
    std::fs::write(&all[1], bytes).expect("written");
    std::fs::copy(&all[3], &all[2]).expect("copied");
    let table = files(&cache)
        .into_iter()
        .find(|path| path.extension().is_some_and(|ending| ending == "bworders"));
    std::fs::remove_file(table.expect("a table")).expect("removed");
    let before = contents(&folder.join("shared/out"));

    let (code, said) = merge(folder, "shared");
    assert_eq!(code, Some(75), "{said}");
    assert!(said.contains("the table of small, ring "), "{said}");
    assert!(said.contains("3 of small "), "{said}");
    assert_eq!(contents(&folder.join("shared/out")), before);
    let command = said.split('`').nth(1).expect("a command");
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    assert!(words.contains(&"--shard"), "{command}");
    let (code, said) = says(folder, &words);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
    assert!(contents(&folder.join("shared")) == *whole_run());

    let (code, said) = merge(folder, "shared");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("merged already"), "{said}");
}

#[test]
fn an_interrupted_shard_is_worth_repeating() {
    let folder = small();
    let folder = folder.path();
    let at = place("shared");
    let words = in_place(&RUN, &at, &["--shard", "0/1", "--threads", "1"]);
    let ready = || !files(&folder.join("shared/cache")).is_empty();
    let (code, said) = signalled("-TERM", folder, &words, ready);
    assert_eq!(code, Some(75), "{said}");
    assert!(said.contains("the same command goes on from there"), "{said}");
    does(folder, &words);
    assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
    assert!(contents(&folder.join("shared")) == *whole_run());
    assert!(partial(&folder.join("shared")).is_empty());
}

#[test]
fn another_job_is_refused_and_named() {
    let folder = small();
    let folder = folder.path();
    let geometric = [&RUN[..], &["--model", "geometric"]].concat();
    shards(folder, &geometric, "shared", 2);
    let at = place("shared");
    let refused = |command: &[&str], more: &[&str], expected: &[&str]| {
        let (code, said) = says(folder, &in_place(command, &at, more));
        assert_eq!(code, Some(1), "{said}");
        for part in expected {
            assert!(said.contains(part), "{part} in {said}");
        }
    };
    let first = ["--shard", "0/2"];
    let beyond = ["expected shards from 0 to 1, got 2"];
    refused(&geometric, &["--shard", "2/2"], &beyond);
    let dealt = ["expected shards of 2", "remove that file to deal the job anew"];
    refused(&geometric, &["--shard", "0/3"], &dealt);
    let line = "`batwing run small.toml --model geometric --paths 30000 --seed 1`";
    refused(&RUN, &first, &["job.json", "command", line, "--model all"]);
    let seed = ["--shard", "0/2", "--seed", "7"];
    refused(&geometric, &seed, &[line, "--seed 7"]);
    let elsewhere = [&geometric[..], &first, &["--out", "shared/out", "--cache", "other"]].concat();
    let (code, said) = says(folder, &elsewhere);
    assert_eq!(code, Some(1), "{said}");
    for part in ["job.json", "cache: expected", "shared/cache`", "other`"] {
        assert!(said.contains(part), "{part} in {said}");
    }
    let until = ["--until-error", "uniformity=1%", "--shard", "0/2"];
    refused(&geometric, &until, &["--until-error: expected a number of paths"]);
}

#[test]
fn another_design_program_or_solver_is_refused() {
    let folder = small();
    let folder = folder.path();
    let geometric = [&RUN[..], &["--model", "geometric"]].concat();
    shards(folder, &geometric, "shared", 2);
    let at = place("shared");
    let path = folder.join("shared/out/job.json");
    let record = std::fs::read_to_string(&path).expect("a record");
    let json: Value = serde_json::from_str(&record).expect("JSON");
    let refused = |expected: &str| {
        for (code, said) in
            [merge(folder, "shared"), says(folder, &in_place(&geometric, &at, &["--shard", "0/2"]))]
        {
            assert_eq!(code, Some(1), "{said}");
            assert!(said.contains(expected), "{expected} in {said}");
        }
    };
    for (key, value, expected) in [
        ("program_sha256", "0".repeat(64).into(), "program: expected batwing"),
        ("solver_version", 8.into(), "solver: expected version 8, "),
        ("shards", 1_000_000_000.into(), "shards: expected from 1 to 100000, got 1000000000"),
    ] {
        let mut other = json.clone();
        other[key] = value;
        let other = sealed(other).expect("JSON");
        let text = serde_json::to_string_pretty(&other).expect("JSON") + "\n";
        std::fs::write(&path, text).expect("written");
        refused(expected);
    }
    std::fs::write(&path, record.replace("\"seed\": 1", "\"seed\": 2")).expect("written");
    refused("altered");
    std::fs::write(&path, &record).expect("written");

    let design = folder.join("small.toml");
    let text = std::fs::read_to_string(&design).expect("a design");
    std::fs::write(&design, format!("{text}\n# A remark.\n")).expect("written");
    refused("file: expected small.toml with SHA-256");
    std::fs::write(&design, text).expect("written");
    assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
}

#[test]
fn a_plan_writes_nothing_and_scripts_run_the_shards_of_a_job() {
    let folder = small();
    let folder = folder.path();
    let at = place("shared");
    let words = in_place(&RUN, &at, &[]);
    let plan = [&["plan", "--shards", "3", "--json", "--"][..], &words].concat();
    let output = batwing(folder).args(plan).output().expect("it runs");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let shards = json["shards"].as_array().expect("shards");
    assert_eq!(shards.len(), 3);
    for key in ["pieces", "tables", "paths"] {
        let sum: u64 = shards.iter().filter_map(|s| s[key].as_u64()).sum();
        assert_eq!(Some(sum), json["all"][key].as_u64(), "{key}");
    }
    let [pieces, tables] = ["pieces", "tables"].map(|key| json["all"][key].as_u64());
    assert_eq!(pieces, tables.map(|tables| 4 * 64 + tables));

    assert!(!folder.join("shared").exists());
    let options = "--time=10 --partition=short";
    let submit = ["submit", "--slurm", "--shards", "3", "--sbatch", options, "--"];
    let submit = [&submit[..], &words].concat();
    let output = batwing(folder).args(submit).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let script = |name: &str| folder.join("shared/out/slurm").join(name);
    let text = std::fs::read_to_string(script("shards.sh")).expect("a script");
    assert!(text.contains("#SBATCH --array=0-2\n"), "{text}");
    assert!(text.contains(&format!("#SBATCH {options}\n")), "{text}");
    let run = |name: &str, shard: &str| {
        let status = std::process::Command::new("sh")
            .arg(script(name))
            .env("SLURM_ARRAY_TASK_ID", shard)
            .current_dir(folder)
            .output()
            .expect("a shell");
        let said = String::from_utf8(status.stderr).expect("UTF-8");
        (status.status.code(), said)
    };
    assert_eq!(run("shards.sh", "0"), (Some(0), String::new()));
    assert_eq!(run("shards.sh", "2"), (Some(0), String::new()));
    let (code, said) = run("merge.sh", "");
    assert_eq!(code, Some(75), "{said}");
    assert!(said.contains("`sbatch --array=1 shared/out/slurm/shards.sh`"), "{said}");
    // A script of another number of shards would be refused.
    let three = text.replace("_ID/3", "_ID/4");
    std::fs::write(script("shards.sh"), three).expect("written");
    let (_, said) = run("merge.sh", "");
    assert!(said.contains("--shard 1/3`"), "{said}");
    std::fs::write(script("shards.sh"), &text).expect("written");
    assert_eq!(run("shards.sh", "1"), (Some(0), String::new()));
    assert_eq!(run("merge.sh", ""), (Some(0), String::new()));
    std::fs::remove_dir_all(folder.join("shared/out/slurm")).expect("removed");
    assert!(contents(&folder.join("shared")) == *whole_run());
}

/// The files of a search, its log without what depends on the processes: times, and tables that
/// two of them solved at once.
fn searched(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = contents(folder);
    let log = all.get_mut(Path::new("out/log.jsonl")).expect("a log");
    let text = String::from_utf8(std::mem::take(log)).expect("UTF-8");
    for line in text.lines() {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        if line["kind"] == "generation" {
            for key in ["seconds", "tables"] {
                assert!(line[key].take().is_number(), "{key}");
            }
        }
        log.extend(line.to_string().into_bytes());
    }
    all
}

/// Tables are dealt as pieces where all samples share them, and counted with each sample otherwise.
#[test]
#[ignore = "nightly: 9 s"]
fn nightly_samples_by_waves_share_tables_or_count_their_own() {
    let folder = small();
    let folder = folder.path();
    let hybrid = TOLERANCE.replace("samples = 8", "samples = 8\nmodel = \"hybrid\"");
    let own = hybrid.replace("mirror.reflectance", "silicone.index");
    let command = ["tolerance", "tolerance.toml"];
    let planned = |text: &str| -> [u64; 2] {
        std::fs::write(folder.join("tolerance.toml"), text).expect("written");
        let at = place("planned");
        let words = in_place(&command, &at, &[]);
        let plan = [&["plan", "--shards", "2", "--json", "--"][..], &words].concat();
        let output = batwing(folder).args(plan).output().expect("it runs");
        let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert!(!folder.join("planned").exists());
        ["pieces", "tables"].map(|key| json["all"][key].as_u64().expect("a number"))
    };
    let [pieces, rings] = planned(&hybrid);
    // 16 traces without deviations, and the samples.
    assert!(rings > 0 && pieces == rings + 16 + 8, "{pieces} {rings}");
    assert_eq!(planned(&own), [pieces, 9 * rings]);

    let expected = whole(folder, &command);
    shards(folder, &command, "shared", 2);
    assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
    assert_eq!(contents(&folder.join("shared")), expected);
}

/// A folder with a problem, and what one command makes of it.
fn problem(text: &str) -> (TempDir, BTreeMap<PathBuf, Vec<u8>>) {
    let folder = small();
    let at = folder.path();
    let data = batwing_tests::workspace().join("data/designs/bare-dome.toml");
    std::fs::copy(data, at.join("bare-dome.toml")).expect("copied");
    std::fs::write(at.join("problem.toml"), text).expect("written");
    std::fs::write(at.join("tolerance.toml"), TOLERANCE).expect("written");
    let whole = place("whole");
    does(at, &in_place(&SEARCH, &whole, &["--threads", "1"]));
    let expected = searched(&at.join("whole"));
    assert!(expected.contains_key(Path::new("out/optimise.json")));
    (folder, expected)
}

const SEARCH: [&str; 2] = ["optimise", "problem.toml"];

/// Computes `count` shards of the search at once.
fn search_at_once(folder: &Path, count: usize) {
    let at = place("shared");
    std::thread::scope(|scope| {
        for number in 0..count {
            let shard = format!("{number}/{count}");
            let at = &at;
            scope.spawn(move || {
                let more = ["--threads", "1", "--shard", &shard];
                does(folder, &in_place(&SEARCH, at, &more));
            });
        }
    });
}

#[test]
#[ignore = "slow: 9 s"]
fn shards_of_a_search_leave_what_one_search_leaves() {
    let (folder, expected) = problem(&doubling());
    let folder = folder.path();
    for count in [1, 3] {
        search_at_once(folder, count);
        assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
        let merged = searched(&folder.join("shared"));
        assert!(merged == expected, "{count}: {:?}", merged.keys());
        std::fs::remove_dir_all(folder.join("shared")).expect("removed");
    }
    for (more, expected) in [
        (["--budget", "90s"], "--budget: expected a number of evaluations"),
        (["--resume", "--threads=1"], "--resume, --evaluate: expected neither"),
    ] {
        let at = place("shared");
        let words = in_place(&SEARCH, &at, &more);
        let (code, said) = says(folder, &[&words[..], &["--shard", "0/2"]].concat());
        assert!(code == Some(1) && said.contains(expected), "{said}");
    }
}

/// The shard that is left goes on alone, and the merge names what the dead one leaves undone.
#[test]
#[ignore = "nightly: 9 s"]
fn nightly_a_killed_shard_of_a_search_costs_time_and_no_result() {
    // Long enough to be killed in the middle.
    let long = doubling().replace("8192", "65536").replace("16384", "65536");
    let (folder, expected) = problem(&long);
    let folder = folder.path();
    let at = place("shared");
    let pieces = || groups(&folder.join("shared/cache")).len();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let words = in_place(&SEARCH, &at, &["--threads", "1", "--shard", "0/2"]);
            does(folder, &words);
        });
        let words = in_place(&SEARCH, &at, &["--threads", "1", "--quiet", "--shard", "1/2"]);
        let (code, said) = signalled("-KILL", folder, &words, || pieces() >= 8);
        assert_eq!(code, None, "{said}");
    });
    let (code, said) = merge(folder, "shared");
    assert_eq!(code, Some(75), "{said}");
    let command = said.split('`').nth(1).expect("a command");
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    assert!(command.ends_with("--shard 1/2"), "{command}");
    assert!(said.contains(" of closer "), "{said}");

    // Candidates in the middle of the search are missing too.
    let piece = groups(&folder.join("shared/cache")).into_iter().next();
    std::fs::remove_file(piece.expect("a piece")).expect("removed");
    let (code, said) = merge(folder, "shared");
    assert_eq!(code, Some(75), "{said}");

    does(folder, &words);
    let (_, said) = merge(folder, "shared");
    if !said.is_empty() {
        let command = said.split('`').nth(1).expect("a command");
        does(folder, &command.split(' ').skip(1).collect::<Vec<_>>());
        assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
    }
    assert!(searched(&folder.join("shared")) == expected);
    assert!(partial(&folder.join("shared")).is_empty());
}

/// A front, and an objective over tolerances by waves: tables are shared too.
#[test]
#[ignore = "nightly: 12 s"]
fn nightly_shards_of_other_searches_leave_what_one_search_leaves() {
    let front = doubling()
        .replace(
            "figure = \"uniformity\"",
            "figure = \"illuminance_valley_to_peak\"\n\n[[objective.terms]]\nfigure = \"design.array.pitch_mm\"",
        )
        .replace("restarts = 2\npopulation = 6", "method = \"nsga2\"\npopulation = 8");
    let tolerances = doubling()
        .replace("bare-dome.toml", "small.toml")
        .replace(
            "array.pitch_mm\"\nfrom = 4.5\nto = 12.0",
            "mirror.reflectance\"\nfrom = 0.5\nto = 0.9",
        )
        .replace(
            "uniformity\"",
            "extraction_efficiency\"\n\n[objective]\ntolerances = \"tolerance.toml\"\nsamples = 3",
        )
        .replace(
            "evaluations = 24\nrestarts = 2",
            "evaluations = 8\nrestarts = 1\nmodel = \"hybrid\"",
        );
    for text in [front, tolerances] {
        let (folder, expected) = problem(&text);
        let folder = folder.path();
        search_at_once(folder, 2);
        assert_eq!(merge(folder, "shared"), (Some(0), String::new()));
        let merged = searched(&folder.join("shared"));
        assert!(merged == expected, "{:?}", merged.keys());
    }
}
