// SPDX-License-Identifier: MIT OR Apache-2.0
//! What commands have in common whose work several processes may share.

use std::path::Path;

use anyhow::Result;
use clap::Args;

use super::arguments;
use crate::cache::Cache;
use crate::run_context::RunContext;
use crate::shard::ShardChoice;
use crate::stages::job::Job;

/// Options of a command whose work may be shared.
#[derive(Debug, Clone, Args)]
pub struct Sharing {
    /// Compute the pieces of shard I of N alone, from 0, and leave them in the cache for `batwing
    /// merge`
    #[arg(long, value_name = "I/N", allow_negative_numbers = true)]
    pub shard: Option<ShardChoice>,
}

/// A command whose work may be shared.
pub trait Shardable {
    /// The shards asked for; none for all of the work.
    fn shard(&self) -> Option<&ShardChoice>;

    /// The command line without the program and without `--seed`, `--out`, `--cache` and `--shard`.
    fn words(&self) -> Vec<String>;

    /// Directory for results.
    fn out(&self) -> &Path;

    /// Directory of the cache, if it is given.
    fn cache_given(&self) -> Option<&Path>;

    /// The pieces of the work.
    ///
    /// # Errors
    /// What the command refuses; work whose parts follow from one another.
    fn job(&self, context: RunContext) -> Result<Job>;

    /// Runs the command, which finds in the cache whatever is there.
    ///
    /// # Errors
    /// Those of the command.
    fn run(&self, context: RunContext) -> Result<()>;

    /// The cache.
    fn cache(&self) -> Cache {
        arguments::cache(self.cache_given(), self.out())
    }
}
