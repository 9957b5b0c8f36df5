// SPDX-License-Identifier: MIT OR Apache-2.0
//! The live view: its figures are those of `run`, its file changes when it is saved, and nobody but
//! its own page can reach it.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::binary::{self, batwing};
use crate::zone_colours::coloured;

/// A running `batwing explore` on a design of its own folder.
struct Live {
    folder: TempDir,
    child: Child,
    /// `127.0.0.1:PORT`, and what every address begins with.
    host: String,
    secret: String,
}

impl Live {
    fn start(text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("own.toml"), text).expect("written");
        Self::start_by(Command::new(binary::PATH), folder)
    }

    /// Starts it on the design in `folder` by `command`, which runs the binary.
    fn start_by(mut command: Command, folder: TempDir) -> Self {
        let mut child = command
            .args(["explore", "own.toml", "--no-open", "--quiet"])
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("starts");
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().expect("piped")).read_line(&mut line).expect("a line");
        let address = line.trim().strip_prefix("http://").expect("an address");
        let (host, secret) = address.split_once('/').expect("a secret");
        let (host, secret) = (host.to_owned(), format!("/{}", secret.trim_end_matches('/')));
        Self { folder, child, host, secret }
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("own.toml")
    }

    /// Status and body of a request with these lines of its head.
    fn ask(&self, method: &str, path: &str, head: &[(&str, &str)], body: &str) -> (u16, String) {
        let mut to = TcpStream::connect(&self.host).expect("connects");
        to.set_read_timeout(Some(Duration::from_mins(1))).expect("a time limit");
        let head: Vec<String> =
            head.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        let head = head.concat();
        let length = body.len();
        let words = format!(
            "{method} {path} HTTP/1.1\r\nConnection: close\r\n{head}Content-Length: {length}\r\n\r\n{body}"
        );
        to.write_all(words.as_bytes()).expect("sent");
        let mut answer = Vec::new();
        to.read_to_end(&mut answer).expect("an answer");
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
        let status = head.split(' ').nth(1).and_then(|code| code.parse().ok()).expect("a status");
        (status, body.to_owned())
    }

    fn get(&self, address: &str) -> (u16, String) {
        self.ask("GET", &format!("{}/{address}", self.secret), &[("Host", &self.host)], "")
    }

    fn post(&self, address: &str, body: &Value) -> (u16, Value) {
        let origin = format!("http://{}", self.host);
        let head = [("Host", &*self.host), ("Origin", &*origin)];
        let path = format!("{}/{address}", self.secret);
        let (status, text) = self.ask("POST", &path, &head, &body.to_string());
        (status, serde_json::from_str(&text).expect("JSON"))
    }

    /// The stream of a page that looks on.
    fn look(&self) -> TcpStream {
        let mut to = TcpStream::connect(&self.host).expect("connects");
        let words = format!("GET {}/events HTTP/1.1\r\nHost: {}\r\n\r\n", self.secret, self.host);
        to.write_all(words.as_bytes()).expect("sent");
        to
    }

    /// The last frame of what is shown now.
    fn last_frame(&self) -> Value {
        let (_, state) = self.get("state");
        let state: Value = serde_json::from_str(&state).expect("JSON");
        let until = Instant::now() + Duration::from_mins(2);
        while Instant::now() < until {
            let (status, text) = self.get("frame");
            if status == 200 {
                let frame: Value = serde_json::from_str(&text).expect("JSON");
                if frame["state"] == state["state"] && frame["last"] == true {
                    return frame;
                }
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("no last frame: {state}");
    }

    /// What a client hears that sends these words and nothing more.
    fn say(&self, words: &str) -> String {
        let mut to = TcpStream::connect(&self.host).expect("connects");
        to.set_read_timeout(Some(Duration::from_secs(20))).expect("a time limit");
        // A server that has heard enough hangs up.
        let _ = to.write_all(words.as_bytes());
        let mut answer = Vec::new();
        let _ = to.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn state(&self) -> Value {
        serde_json::from_str(&self.get("state").1).expect("JSON")
    }

    /// Ends it; true where that went well, with what it said.
    fn end(mut self) -> (bool, String) {
        let id = self.child.id().to_string();
        Command::new("kill").args(["-INT", &id]).status().expect("signalled");
        let mut said = String::new();
        let mut messages = self.child.stderr.take().expect("piped");
        messages.read_to_string(&mut said).expect("read");
        (self.child.wait().expect("ends").success(), said)
    }

    /// Ends it, in silence.
    fn ends(self) -> bool {
        let (ended, said) = self.end();
        assert_eq!(said, "");
        ended
    }
}

fn own() -> String {
    design::NEW_DESIGN.replace("NAME", "own").replace("paths = 2_000_000", "paths = 20_480")
}

/// Figures of a model in `results.json`, by key.
fn figures_of_run(at: &Path) -> Value {
    let run = ["run", "own.toml", "--model", "geometric", "--out", "results"];
    batwing(at).args(run).arg("--quiet").assert().success();
    let text = std::fs::read_to_string(at.join("results/results.json")).expect("read");
    let results: Value = serde_json::from_str(&text).expect("JSON");
    let models = results["designs"]["own"].as_object().expect("models");
    models.values().next().expect("a model").clone()
}

#[test]
fn figures_are_those_of_a_run_to_the_bit() {
    let live = Live::start(&own());
    let _page = live.look();
    live.last_frame();
    let (status, _) = live.post("set", &json!({"path": "array.pitch_mm", "value": 5.5}));
    assert_eq!(status, 200);
    let frame = live.last_frame();
    assert_eq!(frame["paths"], 20_480);
    let (status, _) = live.post("save", &json!({}));
    assert_eq!(status, 200);
    let of_run = figures_of_run(live.folder.path());
    let figures = frame["figures"].as_array().expect("figures");
    let mut compared = 0;
    for figure in figures {
        let key = figure["key"].as_str().expect("a key");
        if let Some(expected) = of_run.get(key) {
            assert_eq!(figure["value"], expected["value"], "{key}");
            assert_eq!(figure["standard_error"], expected["standard_error"], "{key}");
            compared += 1;
        }
    }
    assert!(compared > 10, "{compared}");
    let pictures = frame["pictures"].as_array().expect("pictures").iter();
    let ids: Vec<&str> = pictures.filter_map(|picture| picture["id"].as_str()).collect();
    assert_eq!(ids, ["package", "map", "map_log", "cross_section", "far_field", "far_field_polar"]);
    assert!(live.ends());
}

/// The power of all sources of a channel is its level: the colour of the plane follows it.
#[test]
fn powers_of_channels_turn_the_colour_of_the_plane() {
    let live = Live::start(&coloured().replace("paths = 40_000", "paths = 8192"));
    let _page = live.look();
    let u_prime = |frame: &Value| -> f64 {
        let mut figures = frame["figures"].as_array().expect("figures").iter();
        let figure = figures.find(|figure| figure["key"] == "plane_u_prime").expect("a colour");
        figure["value"].as_f64().expect("a number")
    };
    let before = live.last_frame();
    let mut pictures = before["pictures"].as_array().expect("pictures").iter();
    assert!(pictures.any(|picture| picture["id"] == "map_colours"));
    let (status, _) = live.post("set", &json!({"path": "channels.red.power", "value": 4.0}));
    assert_eq!(status, 200);
    let after = live.last_frame();
    let [before, after] = [&before, &after].map(u_prime);
    assert!(after > before + 0.02, "{before} {after}");
    // The draft was not saved.
    assert!(live.end().0);
}

#[test]
fn a_kept_state_stands_beside_with_paired_changes() {
    let live = Live::start(&own());
    let _page = live.look();
    live.post("keep", &json!({}));
    let frame = live.last_frame();
    // The same design by the same random numbers: nothing changed.
    let figure = |frame: &Value, key: &str| {
        let mut all = frame["figures"].as_array().expect("figures").iter();
        all.find(|figure| figure["key"] == key).expect("a figure").clone()
    };
    let same = figure(&frame, "extraction_efficiency");
    assert_eq!((&same["beside"], &same["verdict"]), (&same["text"], &json!("unchanged")));
    live.post("set", &json!({"path": "led.reflectance", "value": 0.4}));
    let darker = figure(&live.last_frame(), "extraction_efficiency");
    assert_eq!(darker["verdict"], "WORSE", "{darker}");
    let frame = live.last_frame();
    let pictures = frame["pictures"].as_array().expect("pictures");
    assert!(pictures.iter().any(|picture| picture["id"] == "difference"));
    let (ended, said) = live.end();
    assert!(ended && said.contains("own.toml: the draft was not saved"), "{said}");
}

#[test]
fn nobody_but_its_page_reaches_it() {
    let live = Live::start(&own());
    let (host, secret) = (&*live.host, &*live.secret);
    let own_origin = format!("http://{host}");
    let state = format!("{secret}/state");
    let set = format!("{secret}/set");
    let body = json!({"path": "array.pitch_mm", "value": 9}).to_string();
    for (method, path, head, expected) in [
        ("GET", "/state", vec![("Host", host)], 404),
        ("GET", "/", vec![("Host", host)], 404),
        ("GET", "/0123456789abcdef0123456789abcdef/state", vec![("Host", host)], 404),
        ("GET", &state, vec![("Host", "evil.example")], 403),
        ("GET", &state, vec![], 403),
        ("GET", &state, vec![("Host", host), ("Origin", "http://evil.example")], 403),
        ("GET", &state, vec![("Host", host), ("Sec-Fetch-Site", "cross-site")], 403),
        ("POST", &set, vec![("Host", host)], 403),
        ("POST", &set, vec![("Host", host), ("Origin", "null")], 403),
        ("POST", &set, vec![("Host", host), ("Origin", "http://evil.example")], 403),
        ("PUT", &set, vec![("Host", host), ("Origin", &*own_origin)], 405),
        ("GET", &format!("{secret}/../../etc/passwd"), vec![("Host", host)], 404),
        ("GET", &format!("{secret}/export?format=../x"), vec![("Host", host)], 400),
        ("GET", &format!("{secret}/export"), vec![("Host", host)], 400),
    ] {
        let (status, _) = live.ask(method, path, &head, if method == "GET" { "" } else { &body });
        assert_eq!(status, expected, "{method} {path} {head:?}");
    }
    let before = live.get("state").1;
    let own_head = [("Host", host), ("Origin", &*own_origin)];
    for (body, expected) in [
        ("", 400),
        ("[]", 400),
        ("{\"path\": 3}", 400),
        (&*json!({"path": "array.pitch_mm", "value": "far"}).to_string(), 400),
        (&*json!({"path": "array.pitch_mm", "value": -3}).to_string(), 400),
        (&*json!({"path": "no.such", "value": 3}).to_string(), 400),
        (&*"x".repeat(5 << 20), 413),
    ] {
        let (status, said) = live.ask("POST", &set, &own_head, body);
        assert_eq!(status, expected, "{said}");
    }
    assert_eq!(live.get("state").1, before);
    assert!(live.get("").1.starts_with("<!doctype html>"));
    assert_eq!(std::fs::read_to_string(live.file()).expect("read"), own());
    assert!(live.ends());
}

#[test]
fn exports_and_reports_are_those_of_the_commands() {
    let live = Live::start(&own());
    let (status, ies) = live.get("export?format=ies");
    assert_eq!((status, ies.starts_with("IESNA")), (200, true), "{ies}");
    let at = live.folder.path();
    batwing(at).args(["export", "own.toml", "--out", "own.ies", "-q"]).assert().success();
    assert_eq!(ies, std::fs::read_to_string(at.join("own.ies")).expect("read"));
    let (status, page) = live.get("report");
    assert_eq!((status, page.contains("What was simulated")), (200, true));
    // Light is not traced in another model than the page shows.
    live.post("model", &json!({"model": "control"}));
    let (status, said) = live.get("export?format=ies");
    assert!(status == 400 && said.contains("not in control"), "{said}");
    let (status, _) = live.get("export?format=stl");
    assert_eq!(status, 200);
    live.post("text", &json!({"text": "[led"}));
    let (status, said) = live.get("report");
    assert!(status == 400 && said.starts_with("line 1"), "{said}");
    live.post("undo", &json!({}));
    // Nothing of it stays.
    assert_eq!(std::fs::read_dir(at).expect("a folder").count(), 2);
    assert!(live.ends());
}

/// A search for more uniform light by pitch and height.
fn search(pitch_mm: [f64; 2], generations: usize) -> Value {
    json!({
        "goals": [{"figure": "uniformity", "goal": "maximise"},
            {"figure": "extraction_efficiency", "goal": "target", "target": 0.9, "scale": 0.01}],
        "constraints": [{"figure": "extraction_efficiency", "at_least": 0.5}],
        "variables": [{"key": "array.pitch_mm", "from": pitch_mm[0], "to": pitch_mm[1]},
            {"key": "dome.height_mm", "from": 0.9, "to": 1.2}],
        "generations": generations,
    })
}

impl Live {
    /// The first candidates of its search, once there are so many.
    fn candidates(&self, count: usize) -> Vec<Value> {
        let until = Instant::now() + Duration::from_mins(4);
        while Instant::now() < until {
            let all: Value = serde_json::from_str(&self.get("candidates?from=0").1).expect("JSON");
            let all = all["candidates"].as_array().expect("candidates");
            if all.len() >= count {
                return all[..count].to_vec();
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("no candidates: {}", self.state()["search"]);
    }
}

#[test]
fn candidates_come_as_they_are_found_and_a_stop_keeps_the_best() {
    let live = Live::start(&own());
    let before = live.state();
    let (status, said) = live.post("optimise", &search([6.0, 5.0], 2));
    let expected = "array.pitch_mm: from, to: expected a number and a larger one, got 6 and 5";
    assert_eq!((status, &said["error"]["message"]), (400, &json!(expected)));
    let mut of_file = search([4.0, 6.0], 2);
    of_file["goals"][0]["file"] = "/etc/passwd".into();
    assert_eq!(live.post("optimise", &of_file).0, 400);
    let explored = live.folder.path().join("explored");
    assert!(!explored.exists() && live.state() == before);
    assert_eq!(live.post("optimise", &search([4.0, 6.0], 1000)).0, 200);
    assert_eq!(live.post("optimise", &search([4.0, 6.0], 2)).0, 400);
    // The first generation is not yet whole.
    assert!(live.candidates(3).iter().all(|one| one["feasible"] == true));
    live.candidates(20);
    live.post("optimise/stop", &json!({}));
    let until = Instant::now() + Duration::from_mins(1);
    while live.state()["search"]["running"] == true && Instant::now() < until {
        std::thread::sleep(Duration::from_millis(50));
    }
    let state = live.state();
    let best = state["search"]["best"].as_u64().expect("a best candidate") as usize;
    let all = live.candidates(state["search"]["candidates"].as_u64().expect("a number") as usize);
    let value = |one: &Value| one["value"].as_f64().unwrap_or(f64::INFINITY);
    assert!(all.iter().all(|one| value(one) >= value(&all[best])), "{best}: {all:?}");
    let kept: toml::Table = state["text"].as_str().expect("a text").parse().expect("TOML");
    let at = [&kept["array"]["pitch_mm"], &kept["dome"]["height_mm"]].map(toml::Value::as_float);
    assert_eq!(json!(at), all[best]["at"], "{}", state["search"]);
    live.post("undo", &json!({}));
    assert_eq!(live.state()["text"], before["text"]);
    assert!(live.ends());
}

#[test]
fn the_same_seed_has_the_same_candidates_and_the_end_of_the_server_ends_a_search() {
    let searched = || {
        let live = Live::start(&own());
        live.post("optimise", &search([4.0, 6.0], 1000));
        let first = live.candidates(18);
        let folder = live.folder.path().join("explored/own-search-1");
        let own_files = BTreeSet::from(["log.jsonl", "problem.toml"].map(str::to_owned));
        let names = || {
            let files = std::fs::read_dir(&folder).expect("a folder");
            let names = files.map(|file| file.expect("a file").file_name().into_string());
            names.collect::<Result<BTreeSet<_>, _>>().expect("names")
        };
        assert_eq!(names(), own_files);
        // The folder goes with what runs in it.
        let id = live.child.id().to_string();
        Command::new("kill").args(["-INT", &id]).status().expect("signalled");
        let mut live = live;
        assert!(live.child.wait().expect("ends").success());
        assert_eq!(names(), own_files);
        assert_eq!(std::fs::read_to_string(live.file()).expect("read"), own());
        first
    };
    assert_eq!(searched(), searched());
}

#[test]
fn two_pages_do_not_write_over_each_other() {
    let live = Live::start(&own());
    let state = || serde_json::from_str::<Value>(&live.get("state").1).expect("JSON");
    let seen = state();
    let mut text = seen["text"].as_str().expect("a text").to_owned();
    text.push_str("# more\n");
    live.post("set", &json!({"path": "array.pitch_mm", "value": 6}));
    let mine = json!({"text": text, "edition": seen["edition"]});
    assert_eq!(live.post("text", &mine).0, 409);
    assert!(state()["text"].as_str().is_some_and(|text| text.contains("pitch_mm = 6.0")));
    let mine = json!({"text": text, "edition": state()["edition"]});
    assert_eq!(live.post("text", &mine), (200, state()));
    live.post("save", &json!({}));
    assert_eq!(std::fs::read_to_string(live.file()).expect("read"), text);
    assert!(live.ends());
}

/// Resident memory of a process, MB.
#[cfg(target_os = "linux")]
fn memory_mb(process: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("read");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("a size");
    let size = line.split_whitespace().nth(1).and_then(|size| size.parse::<f64>().ok());
    size.expect("a number") * 1e-3
}

#[test]
#[ignore = "nightly: 1000 changes: about a minute"]
#[cfg(target_os = "linux")]
fn nightly_a_thousand_changes_leave_the_memory_as_it_was() {
    let live = Live::start(&own());
    let _page = live.look();
    live.last_frame();
    for change in 0..1000_u32 {
        let pitch = 5.0 + 0.002 * f64::from(change % 500);
        live.post("set", &json!({"path": "array.pitch_mm", "value": pitch}));
        if change % 50 == 0 {
            live.last_frame();
        }
    }
    live.last_frame();
    let used = memory_mb(live.child.id());
    assert!(used < 500.0, "{used} MB");
    live.end();
}

#[test]
fn what_a_client_claims_is_not_believed() {
    let live = Live::start(&own());
    let (host, secret) = (&live.host, &live.secret);
    for length in ["100000000000", "1000000000000000", "18446744073709551615", "-1", "1e3"] {
        let answer = live.say(&format!("POST / HTTP/1.1\r\nContent-Length: {length}\r\n\r\n"));
        assert!(answer.starts_with("HTTP/1.1 4"), "{length}: {answer}");
    }
    // Its own page has no more than others.
    let own_head = format!(
        "POST {secret}/set HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: 100000000000\r\n\r\n"
    );
    assert!(live.say(&own_head).starts_with("HTTP/1.1 413"));
    for head in ["x: y\r\n".repeat(100_000), format!("x: {}\r\n", "y".repeat(1 << 20))] {
        let answer = live.say(&format!("GET / HTTP/1.1\r\n{head}\r\n"));
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 431"), "{answer}");
    }
    assert_eq!(live.get("state").0, 200);
    assert!(live.ends());
}

#[test]
#[cfg(unix)]
fn idle_connections_neither_end_it_nor_keep_its_page_out() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("own.toml"), own()).expect("written");
    let mut limited = Command::new("sh");
    limited.args(["-c", "ulimit -n 40; exec \"$0\" \"$@\"", binary::PATH]);
    let live = Live::start_by(limited, folder);
    let idle = || {
        let mut to = TcpStream::connect(&live.host).expect("connects");
        // One that was closed to make room refuses it.
        let _ = to.write_all(b"GET /");
        to
    };
    let connections: Vec<TcpStream> = (0..200).map(|_| idle()).collect();
    let asked = Instant::now();
    assert_eq!(live.get("state").0, 200);
    assert!(asked.elapsed() < Duration::from_secs(4), "{:?}", asked.elapsed());
    drop(connections);
    assert!(live.ends());
}

#[test]
#[ignore = "slow: waits for the time limit of a head (5 s)"]
fn a_slow_head_is_hung_up_on() {
    let live = Live::start(&own());
    let begun = Instant::now();
    live.say("GET / HTTP/1.1\r\nHost: ");
    assert!((4.0..15.0).contains(&begun.elapsed().as_secs_f64()), "{:?}", begun.elapsed());
    assert!(live.ends());
}

#[test]
#[cfg(unix)]
fn a_draft_survives_whatever_ends_the_server() {
    let mut live = Live::start(&own());
    live.post("set", &json!({"path": "array.pitch_mm", "value": 6}));
    live.child.kill().expect("killed");
    live.child.wait().expect("ended");
    let draft = live.folder.path().join(".own.toml.draft");
    let text = std::fs::read_to_string(&draft).expect("a draft");
    assert_eq!(text, own().replace("pitch_mm = 5.0", "pitch_mm = 6.0"));
    let live = Live::start_by(Command::new(binary::PATH), live.folder);
    assert_eq!(
        (&live.state()["text"], &live.state()["offers_draft"]),
        (&json!(own()), &json!(true))
    );
    // It is not lost by a word about something else.
    let edit = json!({"path": "array.pitch_mm", "value": 7});
    assert_eq!(live.post("set", &edit).0, 409);
    assert_eq!(live.post("draft/take", &json!({})).1["text"], text);
    live.post("save", &json!({}));
    assert_eq!(std::fs::read_to_string(live.file()).expect("read"), text);
    assert!(!draft.exists());
    live.post("set", &edit);
    // A draft that is not saved outlives an ordinary end, too.
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::copy(&draft, folder.path().join(".own.toml.draft")).expect("copied");
    let (ended, said) = live.end();
    assert!(ended && said.contains("own.toml.draft` keeps it"), "{said}");
    std::fs::write(folder.path().join("own.toml"), own()).expect("written");
    let live = Live::start_by(Command::new(binary::PATH), folder);
    assert_eq!(live.post("draft/discard", &json!({})).1["offers_draft"], false);
    assert!(!live.folder.path().join(".own.toml.draft").exists());
    assert!(live.ends());
}

#[test]
fn what_cannot_be_shown_is_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let explore = |arguments: &[&str]| {
        let mut command = batwing(folder.path());
        let output = command.arg("explore").args(arguments).arg("--no-open").output();
        let output = output.expect("runs");
        assert!(!output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let missing = explore(&["none.toml"]);
    assert!(
        missing.contains("none.toml: cannot be read") && missing.lines().count() == 1,
        "{missing}"
    );
    std::fs::write(folder.path().join("bad.toml"), own().replace("= 5.0", "= -5.0"))
        .expect("written");
    let bad = explore(&["bad.toml"]);
    assert!(bad.contains("bad.toml: array.pitch_mm = -5") && bad.lines().count() == 1, "{bad}");
    if cfg!(unix) {
        let device = explore(&["/dev/zero"]);
        assert!(device.contains("got a pipe or a device"), "{device}");
    }
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("bound").port().to_string();
    std::fs::write(folder.path().join("own.toml"), own()).expect("written");
    let busy = explore(&["own.toml", "--port", &port]);
    assert!(
        busy.contains("--port: expected a port that is free") && busy.lines().count() == 1,
        "{busy}"
    );
}
