// SPDX-License-Identifier: MIT OR Apache-2.0
//! The work of an optimisation that several processes share: candidates, batch by batch, and the
//! traces of both designs at the end.

use anyhow::{Error, Result};

use arrays::cache::Cache;
use design::Design;
use runtime::key::Key;
use runtime::provenance::FileRecord;
use runtime::run_context::RunContext;
use simulate::job::{Cost, Job, MissingPieces, SharedWork, Task, seconds_of_paths};
use simulate::shard::ShardChoice;

use super::log::Log;
use super::problem::Problem;
use super::recipe::Recipe;
use super::shared_evaluations::{MissingEvaluations, SharedEvaluations};
use super::verification_run::VerificationRun;

/// The work of one optimisation.
pub struct SharedSearch {
    problem: Problem,
    seed: u64,
    /// Traces of the design of the problem.
    runs: Job,
}

impl SharedSearch {
    /// The work of `problem`, with the seed of `context`.
    ///
    /// # Errors
    /// Wavelengths that follow from what has been traced.
    pub fn new(problem: Problem, context: RunContext) -> Result<Self> {
        Ok(Self { runs: runs(&problem, &[&problem.design], context)?, seed: context.seed, problem })
    }

    /// Key of the search.
    fn key(&self) -> Key {
        self.problem.key(self.seed)
    }

    /// The traces of the design of the problem and of the one found.
    fn runs(&self, found: &Design, context: RunContext) -> Result<Job> {
        runs(&self.problem, &[&self.problem.design, found], context)
    }

    fn recipe<'a>(&'a self, cache: &'a Cache, shared: &'a SharedEvaluations) -> Recipe<'a> {
        Recipe { shared: Some(shared), ..Recipe::new(&self.problem, cache, None) }
    }
}

/// Missing pieces by shard of `count`, where `error` says so; with `follows`, all of them have
/// pieces that follow from it.
fn named(error: Error, count: usize, follows: bool) -> Result<Vec<MissingPieces>> {
    let missing = error.downcast::<MissingEvaluations>()?;
    let of = |shard| {
        let numbers = missing.numbers.iter();
        let own = numbers.filter(|number| *number % count == shard).count();
        let own = (own > 0).then(|| (missing.batch.clone(), own as u64));
        (follows || own.is_some()).then(|| MissingPieces {
            shard,
            tables: Vec::new(),
            tasks: own.into_iter().collect(),
        })
    };
    Ok((0..count).filter_map(of).collect())
}

/// The traces of `designs` in all models of the verification.
fn runs(problem: &Problem, designs: &[&Design], context: RunContext) -> Result<Job> {
    let seed = VerificationRun::seed(context.seed);
    let context = RunContext { seed, ..context };
    let designs = designs.iter();
    let plans = designs.map(|design| VerificationRun::new(problem, design).plans(context));
    let plans = plans.collect::<Result<Vec<_>>>()?.into_iter().flatten();
    let tasks = plans.map(|plan| Box::new(plan) as Box<dyn Task>);
    Ok(Job::new(Vec::new(), tasks.collect(), Vec::new()))
}

impl SharedWork for SharedSearch {
    fn inputs(&self) -> &[FileRecord] {
        &self.problem.inputs
    }

    fn most_shards(&self) -> usize {
        let populations = self.problem.stages.iter().map(|stage| stage.population);
        populations.max().unwrap_or(1)
    }

    /// Candidates with the paths that a stage begins with, and the traces of two designs alike.
    fn costs(&self, count: usize) -> Vec<Cost> {
        let stages = self.problem.stages.iter();
        let candidates = stages.flat_map(|stage| (0..stage.evaluations).map(|_| stage.paths));
        let mut costs = self.runs.costs(count);
        for cost in &mut costs {
            *cost = *cost + *cost;
        }
        for (number, paths) in candidates.enumerate() {
            let cost = &mut costs[number % count];
            *cost = *cost
                + Cost { pieces: 1, paths, seconds: seconds_of_paths(1, paths), ..Cost::default() };
        }
        costs
    }

    fn compute(&self, choice: &ShardChoice, cache: &Cache, context: RunContext) -> Result<Cost> {
        let seed = self.seed;
        let context = RunContext { seed, ..context };
        let shared = SharedEvaluations::new(self.key().hex(), Some(choice), context)?;
        let mut recipe = self.recipe(cache, &shared);
        recipe.pilot(context)?;
        let found = recipe.search(&mut Log::none(), context)?;
        let designs = recipe.designs(&found)?;
        // Tables of these runs serve the verification too.
        let runs = self.runs(&designs[0].design, context)?;
        let cost = runs.compute(choice, cache, context)?;
        recipe.verify(&found, &designs, context)?;
        let (pieces, paths) = shared.judged();
        let candidates =
            Cost { pieces, paths, seconds: seconds_of_paths(pieces, paths), ..Cost::default() };
        Ok(cost + candidates)
    }

    fn missing(
        &self,
        count: usize,
        cache: &Cache,
        context: RunContext,
    ) -> Result<Vec<MissingPieces>> {
        let seed = self.seed;
        let context = RunContext { seed, ..context.silent() };
        let shared = SharedEvaluations::new(self.key().hex(), None, context)?;
        let recipe = self.recipe(cache, &shared);
        let found = match recipe.search(&mut Log::none(), context) {
            Ok(found) => found,
            Err(error) => return named(error, count, true),
        };
        let designs = recipe.designs(&found)?;
        let runs = self.runs(&designs[0].design, context)?;
        let missing = runs.missing(count, cache, context)?;
        if !missing.is_empty() {
            return Ok(missing);
        }
        let verified = recipe.verify(&found, &designs, context);
        verified.map_or_else(|error| named(error, count, false), |_| Ok(Vec::new()))
    }
}
