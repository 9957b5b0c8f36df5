// SPDX-License-Identifier: MIT OR Apache-2.0
//! What commands have in common whose work several processes may share.

use std::fmt::Display;
use std::path::Path;

use anyhow::Result;
use clap::Args;

use arrays::cache::Cache;
use runtime::run_context::RunContext;
use simulate::job::SharedWork;
use simulate::shard::ShardChoice;

use super::arguments;

/// Options of a command whose work may be shared.
#[derive(Debug, Clone, Args)]
pub struct Sharing {
    /// Compute the pieces of shard I of N alone, from 0, and leave them in the cache for `batwing
    /// merge`
    #[arg(long, value_name = "I/N", allow_negative_numbers = true)]
    pub shard: Option<ShardChoice>,
}

/// Options of a job: where it leaves results and pieces, and the shards asked for.
#[derive(Debug, Clone, Copy)]
pub struct JobOptions<'a> {
    /// Directory for results.
    pub out: &'a Path,
    /// Directory of the cache, if it is given.
    pub cache_given: Option<&'a Path>,
    /// The shards asked for; none for all of the work.
    pub shard: Option<&'a ShardChoice>,
}

impl<'a> JobOptions<'a> {
    /// Options of a command with these arguments.
    pub fn new(out: &'a Path, cache_given: Option<&'a Path>, sharing: &'a Sharing) -> Self {
        Self { out, cache_given, shard: sharing.shard.as_ref() }
    }

    /// The cache.
    pub fn cache(&self) -> Cache {
        arguments::cache(self.cache_given, self.out)
    }
}

/// The words of a command line.
#[derive(Debug)]
pub struct CommandLine(Vec<String>);

impl CommandLine {
    /// The words of `command` on `file`.
    pub fn new(command: &str, file: &Path) -> Self {
        Self(vec![command.to_owned(), file.display().to_string()])
    }

    /// The same with an option, if it has a value.
    #[must_use]
    pub fn option(mut self, name: &str, value: Option<impl Display>) -> Self {
        let value = value.into_iter();
        let words = value.flat_map(|value| [name.to_owned(), value.to_string()]);
        self.0.extend(words);
        self
    }

    /// All of them.
    pub fn all(self) -> Vec<String> {
        self.0
    }
}

/// A command whose work may be shared.
pub trait Shardable {
    /// Options of the command as a job.
    fn job_options(&self) -> JobOptions<'_>;

    /// The command line without the program and without `--seed`, `--out`, `--cache` and `--shard`.
    fn words(&self) -> Vec<String>;

    /// The pieces of the work.
    ///
    /// # Errors
    /// Refusals of the command; work whose parts follow from one another.
    fn work(&self, context: RunContext) -> Result<Box<dyn SharedWork>>;

    /// Runs the command, which finds in the cache whatever is there.
    ///
    /// # Errors
    /// Errors of the command.
    fn run(&self, context: RunContext) -> Result<()>;
}
