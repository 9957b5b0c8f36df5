// SPDX-License-Identifier: MIT OR Apache-2.0
//! Paths per CPU-second of one scene: `cargo run --release -p batwing-tests --example throughput
//! SCENE [PATHS] [TABLES]`. Prints one line of JSON.
//!
//! With `--threads N` it measures the speed-up of N threads in seven rounds and counts the fastest;
//! the processor must be idle otherwise.
//!
//! - `ratio`: speed-up by the clock.
//! - `cpu_ratio`: CPU time of N threads over that of one, the least of seven: loss that is no
//!   waiting.
//! - `processes`: speed-up of N processes of one thread each, which share only the machine.
//! - `beside`: N threads over N processes, the median of the rounds.
//!
//! Scenes, all with a far field of 1° × 5°:
//!
//! - `smooth`: a cap of radius 2 about z = -1 over a mirror of 0.95 at z = 0, and a 1 × 1
//!   Lambertian source at z = 0.35.
//! - `mesh`: the same as one closed mesh of 200,000 triangles.
//! - `stepped-17`, `stepped-170`: the package of the paper with its box and real steps.
//! - `hybrid`: the package with 17 bands that scatter by the tables in the folder TABLES, as
//!   `batwing bsdf` writes them, sorted by name.
//! - `array`: 2 × 2 packages with 17 steps over a mirror, and a plane receiver.
//! - `walled`: the cap of `smooth` over its mirror with an isotropic point at z = 0.35, on a
//!   Lambertian floor of 0.8 within four Lambertian walls of 0.7, 3 mm from the axis and 1.5 mm
//!   high.
//! - `nested`: a ball of radius 2 and index 1.41 that absorbs 0.2 per mm; in it a ball of radius
//!   0.8 about (0, 0, 0.4) of index 1.8 that absorbs 0.05 per mm; in that an isotropic point at
//!   (0.3, 0, 0.6); below, a Lambertian disc of 0.7 and radius 6 at z = -2.5.
//!
//! CPU time is that of this thread where Linux tells it, else the clock's.

#![expect(clippy::print_stdout, reason = "the line is what the program is run for")]

#[path = "../../tracer/tests/common/mod.rs"]
mod common;

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

use bsdf::Bsdf;
use common::package::Dome;
use common::{CAP, N, staircase};
use tracer::glam::DVec3;
use tracer::housing::Housing;
use tracer::{
    Emission, Emitter, FarField, Medium, Patch, PlaneMap, Prototype, Receiver, Region, Scene,
    SceneBuilder, Settings, Shape, Source, Surface, SurfaceModel, run,
};

/// Runs of each number of threads.
const ROUNDS: usize = 7;

/// CPU seconds of this thread.
fn cpu_seconds(begin: Instant) -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split_whitespace().next().and_then(|n| n.parse().ok());
    nanoseconds.map_or_else(|| begin.elapsed().as_secs_f64(), |n: f64| n * 1e-9)
}

/// The tables of a folder as 17 bands of the dome.
fn hybrid(folder: &Path) -> Result<Dome, Box<dyn std::error::Error>> {
    let mut files: Vec<_> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    files.retain(|path| path.extension().is_some_and(|e| e == "bworders"));
    files.sort();
    let mut zones = Vec::new();
    for (band, file) in files.iter().enumerate() {
        let table = bsdf::native::read(std::fs::File::open(file)?)?;
        let table: Arc<dyn Bsdf> = Arc::new(table);
        let outer = CAP.rim * (band + 1) as f64 / files.len() as f64;
        zones.push((outer, Patch::new("dome", SurfaceModel::Scatter(table))));
    }
    Ok(Dome::Zones(zones))
}

fn scene(name: &str, tables: &str) -> Result<Scene, Box<dyn std::error::Error>> {
    let package =
        |dome| common::single(common::package(N, dome, 0.95, 0.86).prototype().expect("a package"));
    Ok(match name {
        "smooth" => common::single(common::mirrored_cap(Emission::LAMBERTIAN)),
        "mesh" => common::single(common::meshed_cap(200_000, Emission::LAMBERTIAN)),
        "stepped-17" => package(Dome::relief(staircase(17))),
        "stepped-170" => package(Dome::relief(staircase(170))),
        "hybrid" => package(hybrid(Path::new(tables))?),
        "array" => {
            common::array(&common::package(N, Dome::relief(staircase(17)), 0.95, 0.86), 2, 8.3)
                .build()?
        }
        "walled" => walled()?,
        "nested" => nested()?,
        _ => return Err(format!("no scene '{name}'").into()),
    })
}

/// A dome between Lambertian walls.
fn walled() -> Result<Scene, tracer::Error> {
    let mut prototype = common::mirrored_cap(Emission::Isotropic);
    prototype.sources[0].emitter = Emitter::Point;
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(prototype);
    scene.place(id, DVec3::ZERO);
    let housing = Housing {
        half: [3.0; 2],
        height: 1.5,
        thickness: 1.0,
        walls: SurfaceModel::Lambertian { reflectance: 0.7 },
        floor: SurfaceModel::Lambertian { reflectance: 0.8 },
        mirror: None,
    };
    for surface in housing.surfaces()? {
        scene.surface(surface);
    }
    scene.build()
}

/// An absorbing ball in an absorbing ball over a Lambertian disc.
fn nested() -> Result<Scene, tracer::Error> {
    let (outer, inner) = (Region::Body(0), Region::Body(1));
    let (ball, core) = (Shape::sphere(0.0, 2.0)?, Shape::sphere(0.4, 0.8)?);
    let surfaces = vec![
        Surface::new("ball", ball, outer, Region::World, &SurfaceModel::Interface),
        Surface::new("core", core, inner, outer, &SurfaceModel::Interface),
    ];
    let source =
        Source::new("LED", DVec3::new(0.3, 0.0, 0.6), inner, Emitter::Point, Emission::Isotropic);
    let mut scene = SceneBuilder::new(Medium::air());
    let id = scene.prototype(Prototype {
        media: vec![
            Medium::clear("ball", N).absorbing(0.2),
            Medium::clear("core", 1.8).absorbing(0.05),
        ],
        surfaces,
        sources: vec![source],
    });
    scene.place(id, DVec3::ZERO);
    scene.surface(Surface::new(
        "floor",
        Shape::annulus(-2.5, 0.0, 6.0)?,
        Region::Opaque,
        Region::World,
        &SurfaceModel::Lambertian { reflectance: 0.7 },
    ));
    scene.build()
}

/// CPU seconds of all threads of the process, where Linux tells them.
fn all_cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let seconds = tasks.flatten().filter_map(|task| {
        let stat = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        stat.split_whitespace().next()?.parse::<f64>().ok()
    });
    seconds.sum::<f64>() * 1e-9
}

/// Seconds by the clock and of CPU time that a run takes on the threads of a pool.
fn seconds_on(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
    pool: &rayon::ThreadPool,
) -> Result<[f64; 2], Box<dyn std::error::Error>> {
    let (begin, cpu) = (Instant::now(), all_cpu_seconds());
    pool.install(|| run(scene, receivers, settings))?;
    Ok([begin.elapsed().as_secs_f64(), all_cpu_seconds() - cpu])
}

/// Programs like this one that trace their share of the paths with one thread each, whenever they
/// are told to.
struct Others {
    children: Vec<Child>,
    answers: Vec<BufReader<ChildStdout>>,
}

impl Others {
    /// Waits until each has made its scene.
    fn start(
        count: usize,
        (name, tables): (&str, &str),
        paths: u64,
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let mut others = Self { children: Vec::new(), answers: Vec::new() };
        for number in 0..count {
            let mut child = Command::new(std::env::current_exe()?)
                .args([name, &paths.div_ceil(count as u64).to_string(), tables])
                .args(["--turns", &(number + 1).to_string()])
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()?;
            let answers = child.stdout.take().ok_or("a child without output")?;
            others.answers.push(BufReader::new(answers));
            others.children.push(child);
        }
        others.wait()?;
        Ok(others)
    }

    /// A line from each.
    fn wait(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        for answers in &mut self.answers {
            if answers.read_line(&mut String::new())? == 0 {
                return Err("a process ended early".into());
            }
        }
        Ok(())
    }

    /// Seconds by the clock in which all have traced their paths.
    fn seconds(&mut self) -> Result<f64, Box<dyn std::error::Error>> {
        let begin = Instant::now();
        for child in &mut self.children {
            let mut input = child.stdin.as_ref().ok_or("a child without input")?;
            writeln!(input)?;
        }
        self.wait()?;
        Ok(begin.elapsed().as_secs_f64())
    }
}

impl Drop for Others {
    fn drop(&mut self) {
        for child in &mut self.children {
            // The end of its input is the end of the child.
            drop(child.stdin.take());
            if child.wait().is_err() {
                return;
            }
        }
    }
}

/// Traces the paths at every line of the input, and answers with one.
fn take_turns(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
) -> Result<(), Box<dyn std::error::Error>> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    println!("ready");
    for line in std::io::stdin().lines() {
        line?;
        one.install(|| run(scene, receivers, settings))?;
        println!("done");
    }
    Ok(())
}

/// Prints how much faster `threads` threads are than one.
fn compare(
    scene: &Scene,
    receivers: &[&dyn Receiver],
    settings: &Settings,
    threads: usize,
    mut others: Others,
) -> Result<(), Box<dyn std::error::Error>> {
    // Kept to the end: the CPU time of threads that are gone is not told.
    let pool = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = [pool(1)?, pool(threads)?];
    let mut least = [f64::INFINITY; 3];
    let mut cpu = [f64::INFINITY; 2];
    let mut beside = Vec::new();
    for _ in 0..ROUNDS {
        let mut clocks = [0.0; 3];
        for (which, pool) in pools.iter().enumerate() {
            let used;
            [clocks[which], used] = seconds_on(scene, receivers, settings, pool)?;
            cpu[which] = cpu[which].min(used);
        }
        clocks[2] = others.seconds()?;
        least = std::array::from_fn(|which| least[which].min(clocks[which]));
        beside.push(clocks[2] / clocks[1]);
    }
    beside.sort_by(f64::total_cmp);
    println!(
        "{{\"threads\": {threads}, \"paths\": {}, \"seconds_one\": {:.4}, \"seconds\": {:.4}, \"ratio\": {:.3}, \"cpu_ratio\": {:.3}, \"processes\": {:.3}, \"beside\": {:.3}}}",
        settings.paths,
        least[0],
        least[1],
        least[0] / least[1],
        cpu[1] / cpu[0],
        least[0] / least[2],
        beside[ROUNDS / 2]
    );
    Ok(())
}

/// Takes a flag and its number out of the arguments.
fn flag(
    arguments: &mut Vec<String>,
    name: &str,
) -> Result<Option<usize>, Box<dyn std::error::Error>> {
    let Some(place) = arguments.iter().position(|argument| argument == name) else {
        return Ok(None);
    };
    let number = arguments.drain(place..(place + 2).min(arguments.len())).nth(1);
    let number = number.ok_or_else(|| format!("{name} takes a number"))?;
    Ok(Some(number.parse()?))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut all: Vec<String> = std::env::args().skip(1).collect();
    let (threads, turns) = (flag(&mut all, "--threads")?, flag(&mut all, "--turns")?);
    let name = all.first().cloned().unwrap_or_else(|| "smooth".to_owned());
    let paths: u64 = all.get(1).map_or(Ok(10_000_000), |n| n.parse())?;
    let tables = all.get(2).cloned().unwrap_or_default();
    let scene = scene(&name, &tables)?;
    let far = FarField::default();
    let plane = PlaneMap::centred(3.0, 0.1, 240, 240)?;
    let both: [&dyn Receiver; 2] = [&far, &plane];
    let receivers = if name == "array" { &both[..] } else { &both[..1] };
    if let Some(seed) = turns {
        return take_turns(&scene, receivers, &Settings::new(paths, seed as u64));
    }
    if let Some(threads) = threads {
        let others = Others::start(threads, (&name, &tables), paths)?;
        return compare(&scene, receivers, &Settings::new(paths, 1), threads, others);
    }
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()?;
    let clock = Instant::now();
    let begin = cpu_seconds(clock);
    let outcome = one.install(|| run(&scene, receivers, &Settings::new(paths, 1)))?;
    let seconds = cpu_seconds(clock) - begin;
    let ledger = &outcome.total.ledger;
    let up = outcome.mean(|totals| totals.ledger.escaped_up);
    // Power by polar angle, in 18 rows of 10 degrees, and its errors.
    let per_row = far.bins() / 18;
    let rows: Vec<tracer::Estimate> = (0..18)
        .map(|row| {
            let of = row * per_row..(row + 1) * per_row;
            outcome.mean(|totals| totals.readings[0][of.clone()].iter().sum())
        })
        .collect();
    let values: Vec<f64> = rows.iter().map(|row| row.value).collect();
    let errors: Vec<f64> = rows.iter().map(|row| row.standard_error).collect();
    println!(
        "{{\"rows\": {values:?}, \"row_errors\": {errors:?}, \"scene\": \"{name}\", \"paths\": {}, \"cpu_seconds\": {seconds:.4}, \"paths_per_cpu_second\": {:.4e}, \"hits_per_path\": {:.4}, \"escaped_up\": {:.6}, \"escaped_up_error\": {:.6}, \"lost\": {:e}, \"imbalance\": {:e}}}",
        outcome.paths,
        outcome.paths as f64 / seconds,
        outcome.hits as f64 / outcome.paths as f64,
        up.value,
        up.standard_error,
        ledger.lost_total(),
        ledger.imbalance(),
    );
    Ok(())
}
