// SPDX-License-Identifier: MIT OR Apache-2.0
//! Batches of evaluations that several processes share.
//!
//! Every shard runs the same search, whose candidates follow from values told before. Of each batch
//! a shard judges the candidates dealt to it, keeps each outcome as a piece of the job, and reads
//! those of the others. An outcome depends on the candidate, paths and seed alone, so a shard that
//! has waited too long for another judges its candidates too: a shard that is dead, or not started
//! yet, costs time and no result.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt::{self, Display};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use serde_json::json;

use runtime::key::Key;
use runtime::progress::Progress;
use runtime::run_context::RunContext;
use runtime::store::{Entries, Store};
use search::Point;
use simulate::shard::ShardChoice;

use super::outcome::Outcome;

/// A shard is waited for so many times as long as the slowest candidate took.
const PATIENCE: f64 = 4.0;
/// And at least so long: programs start, and files of other machines appear, with delay.
const LEAST_PATIENCE: Duration = Duration::from_secs(4);
/// Time between two looks for pieces, as a share of the time waited so far, and its limits.
const POLL: f64 = 0.1;
const SHORTEST_POLL: Duration = Duration::from_millis(5);
const LONGEST_POLL: Duration = Duration::from_secs(1);

/// Evaluations that follow from what is known, and may be made in any order.
pub(super) struct Batch<'a> {
    /// Which one of the search, for people; no other has this name.
    pub name: String,
    /// Number of evaluations.
    pub count: usize,
    /// Points from which they follow.
    pub points: &'a [Point],
    /// Paths of each.
    pub paths: u64,
    /// Told of every one that is known.
    pub progress: &'a Progress,
}

/// An outcome with what it took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct TracedOutcome {
    pub outcome: Outcome,
    /// Tables of orders that were solved for it.
    pub tables: usize,
}

/// Evaluations of one search by the shards of a job.
pub(super) struct SharedEvaluations<'a> {
    /// Key of the search.
    search: String,
    pieces: &'a Store,
    /// The shards of this process; none where everything is there.
    shards: Option<&'a ShardChoice>,
    least_patience: Duration,
    state: RefCell<State>,
}

/// Knowledge of a shard beside the pieces.
#[derive(Debug, Default)]
struct State {
    /// Shards that have been waited for in vain, and whose candidates are judged here.
    absent: BTreeSet<usize>,
    /// Longest time of a candidate in the last batch, for each path.
    seconds_for_path: f64,
    /// Candidates judged here, and their paths.
    judged: u64,
    paths: u64,
}

/// Evaluations that are missing where all should be there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MissingEvaluations {
    /// Name of the batch.
    pub batch: String,
    /// Their numbers in it.
    pub numbers: Vec<usize>,
}

impl Display for MissingEvaluations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "expected the evaluations of {} among the pieces of the job, found {} missing",
            self.batch,
            self.numbers.len()
        )
    }
}

impl std::error::Error for MissingEvaluations {}

/// An outcome as it is kept.
#[derive(Debug, Serialize, Deserialize)]
struct StoredOutcome {
    /// Shard that made it.
    shard: usize,
    seconds: f64,
    evaluation: TracedOutcome,
}

impl<'a> SharedEvaluations<'a> {
    /// Evaluations of the search of this key among the pieces of `context`, by `shards`; without shards
    /// all are read.
    ///
    /// # Errors
    /// A context without pieces.
    pub fn new(
        search: &str,
        shards: Option<&'a ShardChoice>,
        context: RunContext<'a>,
    ) -> Result<Self> {
        Ok(Self {
            search: search.to_owned(),
            pieces: context.checkpoints.context("expected pieces of a job")?,
            shards,
            least_patience: LEAST_PATIENCE,
            state: RefCell::default(),
        })
    }

    /// Candidates judged by this process, and their paths.
    pub fn judged(&self) -> (u64, u64) {
        let state = self.state.borrow();
        (state.judged, state.paths)
    }

    /// The evaluations of `batch`, of which `judge` makes one by its number.
    ///
    /// # Errors
    /// Errors of `judge`; pieces that cannot be kept; an interrupt; [`MissingEvaluations`] where all
    /// should be there.
    pub fn evaluate(
        &self,
        batch: &Batch,
        context: RunContext,
        judge: &mut dyn FnMut(usize) -> Result<TracedOutcome>,
    ) -> Result<Vec<TracedOutcome>> {
        let mut known = KnownEvaluations::new(batch, self.pieces.entries(batch.key(&self.search)));
        let Some(shards) = self.shards else {
            known.read_all();
            return known.all();
        };
        let mut judge = |number| {
            context.interrupt.check()?;
            judge(number)
        };
        for number in 0..batch.count {
            let owner = number % shards.count;
            if shards.numbers.contains(&owner) {
                self.judge(number, owner, &mut known, &mut judge)?;
            }
        }
        let mut wait = Wait::new(shards.count);
        loop {
            self.look(&mut known, &mut wait);
            if known.missing().next().is_none() {
                break;
            }
            context.interrupt.check()?;
            self.note_absent(shards, &known, &wait);
            match self.next_of_absent(shards, &known) {
                Some(number) => self.judge(number, shards.numbers[0], &mut known, &mut judge)?,
                None => wait.pause(),
            }
        }
        self.state.borrow_mut().seconds_for_path = known.seconds / batch.paths as f64;
        known.all()
    }

    /// Looks for the pieces of others.
    fn look(&self, known: &mut KnownEvaluations, wait: &mut Wait) {
        for number in known.missing().collect::<Vec<_>>() {
            if let Some(maker) = known.look(number) {
                self.state.borrow_mut().absent.remove(&maker);
                wait.begin(maker);
            }
        }
    }

    /// Notes shards that have been waited for too long.
    fn note_absent(&self, shards: &ShardChoice, known: &KnownEvaluations, wait: &Wait) {
        let mut state = self.state.borrow_mut();
        let before = state.seconds_for_path * known.batch.paths as f64;
        let patience = Duration::try_from_secs_f64(PATIENCE * before.max(known.seconds));
        let patience = patience.unwrap_or(Duration::MAX).max(self.least_patience);
        let owners = known.missing().map(|number| number % shards.count);
        let late = owners.filter(|&shard| wait.is_over(shard, patience));
        state.absent.extend(late);
    }

    /// A candidate that is missing of the shards that do not come. Shards that are there begin at
    /// different ones.
    fn next_of_absent(&self, shards: &ShardChoice, known: &KnownEvaluations) -> Option<usize> {
        let absent = &self.state.borrow().absent;
        let late = |number: &usize| absent.contains(&(number % shards.count));
        let late: Vec<usize> = known.missing().filter(late).collect();
        let there = (0..shards.count).filter(|shard| !absent.contains(shard));
        let before = there.clone().filter(|shard| *shard < shards.numbers[0]);
        let begin = late.len() * before.count() / there.count().max(1);
        late.get(begin).or(late.first()).copied()
    }

    /// Judges a candidate in the name of a shard, and keeps what came of it, unless that is there
    /// already.
    fn judge(
        &self,
        number: usize,
        shard: usize,
        known: &mut KnownEvaluations,
        judge: &mut dyn FnMut(usize) -> Result<TracedOutcome>,
    ) -> Result<()> {
        if known.look(number).is_some() {
            return Ok(());
        }
        let begin = Instant::now();
        let evaluation = judge(number)?;
        let stored = StoredOutcome { shard, seconds: begin.elapsed().as_secs_f64(), evaluation };
        known.entries.keep_value(number as u64, &stored)?;
        known.add(number, stored);
        let mut state = self.state.borrow_mut();
        state.judged += 1;
        state.paths += known.batch.paths;
        Ok(())
    }
}

impl Batch<'_> {
    /// Key of its pieces.
    fn key(&self, search: &str) -> Key {
        let bits = |point: &Point| point.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        Key::of(&json!({
            "search": search,
            "batch": self.name,
            "paths": self.paths,
            "points": self.points.iter().map(bits).collect::<Vec<_>>(),
        }))
    }
}

/// Known evaluations of a batch.
struct KnownEvaluations<'a, 'b> {
    batch: &'a Batch<'a>,
    entries: Entries<'b>,
    evaluations: Vec<Option<TracedOutcome>>,
    /// Longest time of one.
    seconds: f64,
}

impl<'a, 'b> KnownEvaluations<'a, 'b> {
    fn new(batch: &'a Batch, entries: Entries<'b>) -> Self {
        Self { batch, entries, evaluations: vec![None; batch.count], seconds: 0.0 }
    }

    fn missing(&self) -> impl Iterator<Item = usize> {
        let known = self.evaluations.iter().enumerate();
        let missing = known.filter(|(_, evaluation)| evaluation.is_none());
        missing.map(|(number, _)| number)
    }

    /// Looks for a piece, and returns the shard that made it.
    fn look(&mut self, number: usize) -> Option<usize> {
        let stored: StoredOutcome = self.entries.find_value(number as u64)?;
        let shard = stored.shard;
        self.add(number, stored);
        Some(shard)
    }

    /// Reads all pieces that are there.
    fn read_all(&mut self) {
        // To look for one that is not would be a fault of the merge.
        let missing = self.entries.missing(0..self.batch.count as u64);
        for number in 0..self.batch.count {
            if !missing.contains(&(number as u64)) {
                self.look(number);
            }
        }
    }

    fn add(&mut self, number: usize, stored: StoredOutcome) {
        self.seconds = self.seconds.max(stored.seconds);
        self.evaluations[number] = Some(stored.evaluation);
        self.batch.progress.inc(1);
    }

    /// All evaluations in their order.
    fn all(self) -> Result<Vec<TracedOutcome>> {
        let numbers = self.missing().collect();
        let batch = self.batch.name.clone();
        let all = self.evaluations.into_iter().collect::<Option<Vec<_>>>();
        all.ok_or_else(|| MissingEvaluations { batch, numbers }.into())
    }
}

/// Since when each shard is waited for.
struct Wait {
    since: Vec<Instant>,
    start: Instant,
}

impl Wait {
    fn new(shards: usize) -> Self {
        let start = Instant::now();
        Self { since: vec![start; shards], start }
    }

    /// Begins anew with a shard, which has left a piece.
    fn begin(&mut self, shard: usize) {
        // A job that was dealt anew has pieces of shards that are no more.
        if let Some(since) = self.since.get_mut(shard) {
            *since = Instant::now();
        }
    }

    fn is_over(&self, shard: usize, patience: Duration) -> bool {
        self.since[shard].elapsed() > patience
    }

    fn pause(&self) {
        let pause = self.start.elapsed().mul_f64(POLL);
        std::thread::sleep(pause.clamp(SHORTEST_POLL, LONGEST_POLL));
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::optimise::objective::Evaluation;
    use crate::paired_sum::PairedSum;
    use results::paired_figure::PairedFigure;
    use runtime::interrupt::Interrupt;

    const COUNT: usize = 7;

    fn evaluation(number: usize) -> TracedOutcome {
        let value = [0.1, f64::NAN, -0.0, 1e-310, f64::INFINITY, 3.0, -2.5][number];
        let judged = Evaluation {
            objective: PairedSum {
                value,
                without: vec![value, 0.3],
                without_package: vec![value, -0.0],
                hidden_error: 0.25,
                common_error: 0.0,
            },
            miss: 0.0,
            figures: vec![("f".to_owned(), PairedFigure::new(1.0 / 3.0, vec![value, 0.7]))],
        };
        TracedOutcome {
            outcome: match number {
                3 => Outcome::Refused("too dark".to_owned()),
                _ => Outcome::Evaluated(judged),
            },
            tables: number,
        }
    }

    /// What `shards` make of two batches, and how many evaluations are theirs.
    fn two_batches(
        cache: &Path,
        shards: Option<&ShardChoice>,
        patience: Duration,
    ) -> (Result<Vec<String>>, u64) {
        let interrupt = Interrupt::default();
        let context = RunContext::quiet(&interrupt, 1);
        let merging = shards.is_none();
        let pieces = Store::of_job(cache, "job", merging, context.console);
        let context = context.storing(Some(&pieces));
        let shared = SharedEvaluations {
            least_patience: patience,
            ..SharedEvaluations::new("key", shards, context).expect("pieces")
        };
        let progress = Progress::hidden();
        let batch = |number: usize| {
            let batch = Batch {
                name: format!("batch {number}"),
                count: COUNT,
                points: &[vec![0.5]],
                paths: 10,
                progress: &progress,
            };
            let all = shared.evaluate(&batch, context, &mut |number| Ok(evaluation(number)))?;
            Ok(format!("{all:?}"))
        };
        let all = (1..=2).map(batch).collect();
        (all, shared.judged().0)
    }

    fn shard(text: &str) -> ShardChoice {
        text.parse().expect("shards")
    }

    #[test]
    fn shards_at_once_judge_each_candidate_once_and_agree_to_the_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = folder.path();
        let expected = format!("{:?}", (0..COUNT).map(evaluation).collect::<Vec<_>>());
        let expected = vec![expected; 2];
        let patience = Duration::from_mins(1);
        let judged = std::thread::scope(|scope| {
            let shards = ["0/4", "1,3/4", "2/4"].map(shard);
            let shards =
                shards.map(|shard| scope.spawn(move || two_batches(cache, Some(&shard), patience)));
            shards.map(|shard| shard.join().expect("no panic"))
        });
        for ((all, judged), expected_judged) in judged.into_iter().zip([4, 6, 4]) {
            assert_eq!(all.expect("evaluations"), expected);
            assert_eq!(judged, expected_judged);
        }
        let (all, judged) = two_batches(cache, None, patience);
        assert_eq!((all.expect("evaluations"), judged), (expected, 0));
    }

    #[test]
    fn a_shard_that_does_not_come_is_replaced_and_finds_its_pieces() {
        let folder = tempfile::tempdir().expect("a folder");
        let patience = Duration::from_secs(2);
        let begin = Instant::now();
        let (all, judged) = two_batches(folder.path(), Some(&shard("1/3")), patience);
        assert!(all.is_ok());
        assert_eq!(judged, 2 * COUNT as u64);
        // It is waited for once.
        let waited = begin.elapsed();
        assert!(waited >= patience && waited < 2 * patience, "{waited:?}");
        let (all, judged) = two_batches(folder.path(), Some(&shard("0/3")), patience);
        assert!(all.is_ok());
        assert_eq!(judged, 0);
    }

    #[test]
    fn what_is_missing_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let patience = Duration::ZERO;
        let (all, _) = two_batches(folder.path(), Some(&shard("0/1")), patience);
        assert!(all.is_ok());
        let pieces = |batch: u32| {
            let fields = json!({
                "search": "key", "batch": format!("batch {batch}"), "paths": 10,
                "points": [[0.5f64.to_bits()]],
            });
            folder.path().join("jobs/job").join(Key::of(&fields).hex())
        };
        for number in [2, 5] {
            let piece = pieces(2).join(format!("{number}.group"));
            std::fs::remove_file(piece).expect("removed");
        }
        let (all, _) = two_batches(folder.path(), None, patience);
        let error = all.expect_err("two are missing");
        let missing = error.downcast::<MissingEvaluations>().expect("what is missing");
        assert_eq!(missing.batch, "batch 2");
        assert_eq!(missing.numbers, [2, 5]);
    }
}
