// SPDX-License-Identifier: MIT OR Apache-2.0
//! A job: what a command computes, as pieces that several processes share.
//!
//! Pieces are tables of rings and parts of tasks. A process computes its share of them and leaves
//! each in the cache, where the command finds it afterwards. Where a task needs a table that another
//! shard is to solve, it waits for it twice as long as that shard should take, by the pace of its own
//! tables. Then it is late, and is solved here too, unless it appears in the cache meanwhile.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::Thread;
use std::time::{Duration, Instant};

use anyhow::Result;

use arrays::cache::{Cache, CacheEntry};
use design::Design;
use runtime::interrupt::Interrupt;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;

use super::tables::{Ring, solve_rings};
use crate::shard::{self, ShardChoice, Share, TaskPieces};

/// Multiply-adds of a table that one core does in a second, with the search for its resolution;
/// measured, and of use for the proportion of costs.
const OPERATIONS_PER_SECOND: f64 = 1.5e9;
/// Seconds that a table takes beside them.
const TABLE_SECONDS: f64 = 0.4;
/// Paths that one core traces in a second.
const PATHS_PER_SECOND: f64 = 2e6;
/// Seconds that a piece of a task takes beside its paths: its files.
const PIECE_SECONDS: f64 = 0.002;
/// A table of another shard is late when it takes so many times as long as the slowest shard should.
const LATE: f64 = 2.0;
/// Time between two looks for a table that another process is to solve.
const POLL: Duration = Duration::from_millis(200);

/// Seconds that `pieces` pieces take on one core, about, with `paths` paths altogether.
pub fn seconds_of_paths(pieces: u64, paths: u64) -> f64 {
    pieces as f64 * PIECE_SECONDS + paths as f64 / PATHS_PER_SECOND
}

/// Something computed in pieces, each of which is kept by itself.
pub trait Task {
    /// Label for people.
    fn label(&self) -> &str;

    /// Number of pieces.
    fn pieces(&self) -> u64;

    /// Paths of a piece.
    fn paths(&self) -> u64;

    /// The design whose tables it needs, if it needs some.
    fn tables_of(&self) -> Option<&Design>;

    /// Cost of the tables that every piece needs for itself alone.
    fn own_tables(&self) -> Cost {
        Cost::default()
    }

    /// Pieces that are missing or unusable.
    ///
    /// # Errors
    /// A task that cannot be told from others.
    fn missing(&self, cache: &Cache, context: RunContext) -> Result<Vec<u64>>;

    /// Computes those of `pieces` that are missing, and keeps each.
    ///
    /// # Errors
    /// Errors of the solver, the tracer and the files; an interrupt.
    fn compute(&self, pieces: Range<u64>, cache: &Cache, context: RunContext) -> Result<()>;
}

/// The work of a command in pieces, for several processes to share.
pub trait SharedWork {
    /// Files that the command reads.
    fn inputs(&self) -> &[FileRecord];

    /// Most shards that have something to do at the same time.
    fn most_shards(&self) -> usize;

    /// What each of `count` shards costs.
    fn costs(&self, count: usize) -> Vec<Cost>;

    /// Computes what the cache lacks of the shards of `choice`, and says what they cost.
    ///
    /// # Errors
    /// Errors of the solver, the tracer and the files; an interrupt.
    fn compute(&self, choice: &ShardChoice, cache: &Cache, context: RunContext) -> Result<Cost>;

    /// What the cache lacks, by shard of `count`.
    ///
    /// # Errors
    /// Work that cannot be told from other work.
    fn missing(
        &self,
        count: usize,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Vec<MissingPieces>>;
}

/// Pieces that are known before any of them is computed.
pub struct Job {
    /// Tables, each once.
    pub rings: Vec<Ring>,
    /// Tasks; those that need tables come last.
    pub tasks: Vec<Box<dyn Task>>,
    /// Files that the command reads.
    pub inputs: Vec<FileRecord>,
}

/// What is missing of one shard: where it names nothing, all that follows from pieces that another
/// one lacks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingPieces {
    /// Number of the shard.
    pub shard: usize,
    /// Missing tables, by label.
    pub tables: Vec<String>,
    /// Tasks with missing pieces, each with their number.
    pub tasks: Vec<(String, u64)>,
}

/// Cost of a share.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cost {
    /// Pieces.
    pub pieces: u64,
    /// Tables that are solved, as pieces of their own or for others.
    pub tables: u64,
    /// Complex multiply-adds of these tables, about.
    pub operations: f64,
    /// Paths.
    pub paths: u64,
    /// Seconds on one core, about.
    pub seconds: f64,
}

impl Cost {
    /// The cost of solving the tables of `rings`.
    pub fn of_tables<'a>(rings: impl IntoIterator<Item = &'a Ring>) -> Self {
        let (mut tables, mut operations) = (0_u64, 0.0);
        for ring in rings {
            tables += 1;
            operations += ring.operations();
        }
        let seconds = tables as f64 * TABLE_SECONDS + operations / OPERATIONS_PER_SECOND;
        Self { tables, operations, seconds, ..Self::default() }
    }
}

impl std::ops::Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            pieces: self.pieces + other.pieces,
            tables: self.tables + other.tables,
            operations: self.operations + other.operations,
            paths: self.paths + other.paths,
            seconds: self.seconds + other.seconds,
        }
    }
}

impl Job {
    /// The job of `tasks` with the tables that they need and those of `rings`.
    pub fn new(rings: Vec<Ring>, mut tasks: Vec<Box<dyn Task>>, inputs: Vec<FileRecord>) -> Self {
        let needed = tasks
            .iter()
            .filter_map(|task| task.tables_of())
            .flat_map(|design| Ring::of_design(design, None));
        let all = rings.into_iter().chain(needed);
        let distinct: BTreeMap<_, _> = all.map(|ring| (ring.key.clone(), ring)).collect();
        tasks.sort_by_key(|task| task.tables_of().is_some());
        Self { rings: distinct.into_values().collect(), tasks, inputs }
    }

    /// The shares of `count` shards.
    fn partition(&self, count: usize) -> Vec<Share> {
        let seconds = |ring: &Ring| Cost::of_tables([ring]).seconds;
        let tables: Vec<f64> = self.rings.iter().map(seconds).collect();
        let tasks = self.tasks.iter().map(|task| TaskPieces {
            count: task.pieces(),
            cost: seconds_of_paths(1, task.paths()) + task.own_tables().seconds,
        });
        shard::partition(&tables, &tasks.collect::<Vec<_>>(), count)
    }

    /// Tables of `share`.
    fn rings_of<'a>(&'a self, share: &'a Share) -> impl Iterator<Item = &'a Ring> {
        share.tables.iter().map(|&ring| &self.rings[ring])
    }

    /// Cost of `share`.
    fn cost(&self, share: &Share) -> Cost {
        let dealt = Cost::of_tables(self.rings_of(share));
        let mut tasks = Cost::default();
        for (task, pieces) in &share.tasks {
            let (task, count) = (&self.tasks[*task], pieces.end - pieces.start);
            let own = task.own_tables();
            tasks.pieces += count;
            tasks.tables += count * own.tables;
            tasks.operations += count as f64 * own.operations;
            tasks.paths += count * task.paths();
        }
        let all = Cost { pieces: dealt.tables, ..dealt } + tasks;
        Cost { seconds: share.cost, ..all }
    }

    /// Solves the tables of `own` that the cache lacks. Returns when those of the other shards of
    /// `all` are late: by the time that the slowest of them should take at the same pace.
    ///
    /// # Errors
    /// Errors of the solver and the files; an interrupt.
    fn solve_own(
        &self,
        own: &[&Share],
        all: &[Share],
        cache: &Cache,
        context: RunContext,
    ) -> Result<Instant> {
        let own: Vec<&Ring> = own.iter().flat_map(|share| self.rings_of(share)).collect();
        let missing = own.iter().filter(|ring| !cache.holds(&ring.key));
        let expected = Cost::of_tables(missing.copied()).seconds;
        let begun = Instant::now();
        solve_rings(&own, cache, context)?;
        let pace = if expected > 0.0 { begun.elapsed().as_secs_f64() / expected } else { 1.0 };
        let slowest = all.iter().map(|share| Cost::of_tables(self.rings_of(share)).seconds);
        Ok(begun + Duration::from_secs_f64(LATE * pace * slowest.fold(0.0, f64::max)))
    }

    /// Computes the pieces of tasks that the cache lacks of `share`, with the tables that they need.
    ///
    /// # Errors
    /// Errors of the solver, the tracer and the files; an interrupt.
    fn share(
        &self,
        share: &Share,
        late: Instant,
        cache: &Cache,
        context: RunContext,
    ) -> Result<()> {
        // Shards begin their search for tables of others at different places.
        let begin = share.tasks.first().map_or(0, |(_, pieces)| pieces.start as usize);
        for (task, pieces) in &share.tasks {
            context.interrupt.check()?;
            let task = &self.tasks[*task];
            if let Some(design) = task.tables_of() {
                let rings = Ring::of_design(design, None);
                while rings.iter().any(|ring| !cache.holds(&ring.key)) && Instant::now() < late {
                    context.interrupt.check()?;
                    std::thread::sleep(POLL);
                }
                let from = begin % rings.len().max(1);
                for ring in rings[from..].iter().chain(&rings[..from]) {
                    if !cache.holds(&ring.key) {
                        solve_unless_found(ring, cache, context)?;
                    }
                }
            }
            task.compute(pieces.clone(), cache, context)?;
        }
        Ok(())
    }
}

impl SharedWork for Job {
    fn inputs(&self) -> &[FileRecord] {
        &self.inputs
    }

    fn most_shards(&self) -> usize {
        let pieces: u64 = self.tasks.iter().map(|task| task.pieces()).sum();
        self.rings.len() + pieces as usize
    }

    fn costs(&self, count: usize) -> Vec<Cost> {
        let shares = self.partition(count);
        shares.iter().map(|share| self.cost(share)).collect()
    }

    fn compute(&self, choice: &ShardChoice, cache: &Cache, context: RunContext) -> Result<Cost> {
        let shares = self.partition(choice.count);
        let own: Vec<&Share> = choice.numbers.iter().map(|&number| &shares[number]).collect();
        let late = self.solve_own(&own, &shares, cache, context)?;
        let mut cost = Cost::default();
        for share in own {
            self.share(share, late, cache, context)?;
            cost = cost + self.cost(share);
        }
        Ok(cost)
    }

    fn missing(
        &self,
        count: usize,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Vec<MissingPieces>> {
        let shares = self.partition(count);
        let usable = |ring: &Ring| matches!(cache.find(&ring.key), CacheEntry::Table(_));
        let rings: Vec<bool> = self.rings.iter().map(usable).collect();
        let missing: Vec<Vec<u64>> =
            self.tasks.iter().map(|task| task.missing(cache, context)).collect::<Result<_>>()?;
        let of = |(shard, share): (usize, &Share)| {
            let tables = share.tables.iter().filter(|ring| !rings[**ring]);
            let tasks = share.tasks.iter().map(|(task, pieces)| {
                let count = missing[*task].iter().filter(|piece| pieces.contains(piece));
                (self.tasks[*task].label().to_owned(), count.count() as u64)
            });
            MissingPieces {
                shard,
                tables: tables.map(|&ring| self.rings[ring].label.clone()).collect(),
                tasks: tasks.filter(|(_, count)| *count > 0).collect(),
            }
        };
        let all = shares.iter().enumerate().map(of);
        Ok(all.filter(|shard| !shard.tables.is_empty() || !shard.tasks.is_empty()).collect())
    }
}

/// Ends a watch when it is dropped.
struct EndOfWatch<'a> {
    done: &'a AtomicBool,
    watch: &'a Thread,
}

impl Drop for EndOfWatch<'_> {
    fn drop(&mut self) {
        self.done.store(true, Ordering::SeqCst);
        self.watch.unpark();
    }
}

/// Solves the table of `ring`; stops when another process stores it first.
fn solve_unless_found(ring: &Ring, cache: &Cache, context: RunContext) -> Result<()> {
    let stop = Interrupt::default();
    let done = AtomicBool::new(false);
    let solved = std::thread::scope(|scope| {
        let watch = scope.spawn(|| {
            while !done.load(Ordering::SeqCst) {
                if context.interrupt.is_raised() || cache.holds(&ring.key) {
                    stop.flag().store(true, Ordering::SeqCst);
                    return;
                }
                std::thread::park_timeout(POLL);
            }
        });
        let inner = RunContext { interrupt: &stop, ..context };
        // Ends the watch after a panic too: the scope waits for it.
        let _end = EndOfWatch { done: &done, watch: watch.thread() };
        solve_rings(&[ring], cache, inner)
    });
    context.interrupt.check()?;
    if stop.is_raised() { Ok(()) } else { solved }
}
