// SPDX-License-Identifier: MIT OR Apache-2.0
//! Groups of paths that an interrupted command had finished, kept beside the tables until its
//! results are written.
//!
//! A trace has a folder under `checkpoints` in the cache, named by the hash of all that its groups
//! depend on: this very program, the resolved design, the surface of the dome, paths and seed. A
//! group is one file: a mark, the SHA-256 of what follows, the name of the trace, the number of the
//! group, and the bytes that [`tracer::checkpoint`] makes of it. A file that is damaged or that
//! belongs elsewhere is reported, and its paths are traced anew; folders of other programs, and
//! those that nobody has touched for a week, are removed when a command begins, its own when its
//! results are written.
//!
//! The shards of a job keep theirs under `jobs/<job>` in the cache instead, traces of any length,
//! where no other command looks; a job is of one program. Merging reads them and traces nothing.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, Metadata};
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, SystemTime};

use anyhow::{Context, Result, anyhow};
use rayon::prelude::*;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tracer::CheckpointStore;

use crate::cache::Key;
use crate::content_hash::sha256_hex;
use crate::progress::Console;
use crate::{atomic_file, program};

/// Paths below which a trace is too short to be worth keeping in parts: about a second.
pub const LEAST_PATHS: u64 = 1_000_000;

/// Folder under the cache.
const FOLDER: &str = "checkpoints";
/// Folder of the groups of jobs under the cache.
const JOBS: &str = "jobs";
/// How a file begins.
const MARK: &[u8; 8] = b"bwgroup2";
/// Where the name of the trace begins: after the mark and the hash.
const HEAD: usize = MARK.len() + 32;
/// How long an unfinished trace is kept.
const KEPT: Duration = Duration::from_hours(7 * 24);

/// The checkpoints of one command.
#[derive(Debug)]
pub struct Checkpoints {
    /// The directory of the cache.
    cache: PathBuf,
    /// `checkpoints/<program>` in it.
    folder: PathBuf,
    console: Console,
    /// Folders of traces of this command.
    used: Mutex<BTreeSet<PathBuf>>,
    /// What they are for.
    purpose: Purpose,
    /// Whether it was said that nothing can be kept.
    refused: AtomicBool,
    /// Why a group could not be kept, or that one is missing where all are merged.
    failure: Mutex<Option<anyhow::Error>>,
    /// Files that a merge has compared with their hashes, as they were then.
    verified: Mutex<BTreeMap<PathBuf, FileState>>,
}

/// What changes with every change of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FileState {
    length: u64,
    modified: SystemTime,
}

impl FileState {
    /// `None` where the file system keeps no times.
    fn of(file: &Metadata) -> Option<Self> {
        Some(Self { length: file.len(), modified: file.modified().ok()? })
    }
}

/// What groups are kept for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// To go on after an interrupt.
    Resuming,
    /// To be merged: whatever is not kept is lost.
    Sharding,
    /// All are there.
    Merging,
}

impl Checkpoints {
    /// Those of a command of this program in the directory `cache`; removes what is outdated there.
    ///
    /// # Errors
    /// A program that cannot be read.
    pub fn open(cache: &Path, console: Console) -> Result<Self> {
        let program = program_sha256()?;
        let root = cache.join(FOLDER);
        let folder = root.join(&program[..16]);
        for old in entries(&root) {
            if old != folder {
                remove(&old);
            }
        }
        for old in entries(&folder) {
            let age = fs::metadata(&old).and_then(|m| m.modified());
            let age = age.ok().and_then(|time| time.elapsed().ok());
            if age.is_some_and(|age| age > KEPT) {
                remove(&old);
            }
        }
        Ok(Self {
            cache: cache.to_path_buf(),
            folder,
            console,
            used: Mutex::default(),
            purpose: Purpose::Resuming,
            refused: AtomicBool::new(false),
            failure: Mutex::default(),
            verified: Mutex::default(),
        })
    }

    /// Those that the shards of `job` keep in the directory `cache`; when `merging` they are
    /// complete, and nothing is traced.
    pub fn of_job(cache: &Path, job: &str, merging: bool, console: Console) -> Self {
        Self {
            cache: cache.to_path_buf(),
            folder: cache.join(JOBS).join(job),
            console,
            used: Mutex::default(),
            purpose: if merging { Purpose::Merging } else { Purpose::Sharding },
            refused: AtomicBool::new(false),
            failure: Mutex::default(),
            verified: Mutex::default(),
        }
    }

    /// Whether a trace of `paths` paths is kept in groups.
    pub fn keeps(&self, paths: u64) -> bool {
        self.purpose != Purpose::Resuming || paths >= LEAST_PATHS
    }

    /// Whether everything is there, so that nothing may be computed.
    pub fn is_merging(&self) -> bool {
        self.purpose == Purpose::Merging
    }

    fn fail(&self, error: anyhow::Error) {
        let failure = self.failure.lock();
        let mut failure = failure.unwrap_or_else(PoisonError::into_inner);
        failure.get_or_insert(error);
    }

    /// Refuses to go on where a group of a shard could not be kept, or one that is merged was
    /// missing.
    ///
    /// # Errors
    /// Why, of the first of them.
    pub fn is_whole(&self) -> Result<()> {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.take().map_or(Ok(()), Err)
    }

    /// Removes everything that the shards of the job kept, and folders that are empty then.
    pub fn discard_job(&self) {
        remove(&self.folder);
        // Fails where another job keeps something, as it should.
        let _ = fs::remove_dir(self.cache.join(JOBS));
        let _ = fs::remove_dir(&self.cache);
    }

    /// The groups of the trace that depends on `fields` and on nothing else.
    pub fn of(&self, fields: &Value) -> Groups<'_> {
        let key = Key::of(&json!({"trace": fields}));
        let folder = self.folder.join(key.hex());
        self.used.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.clone());
        Groups { checkpoints: self, key, folder }
    }

    /// Folders of traces of this command so far.
    pub fn mark(&self) -> BTreeSet<PathBuf> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Removes what traces kept that began since a mark.
    pub fn drop_since(&self, mark: &BTreeSet<PathBuf>) {
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        for folder in used.difference(mark) {
            remove(folder);
        }
        used.clone_from(mark);
    }

    /// Removes those of this command, and folders that are empty then.
    pub fn finish(&self) {
        let used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        for folder in used.iter() {
            remove(folder);
        }
        for folder in [&self.folder, &self.cache.join(FOLDER), &self.cache] {
            // Fails where another command keeps something, as it should.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Hexadecimal SHA-256 of this very program.
///
/// # Errors
/// A program that cannot be read.
pub fn program_sha256() -> Result<String> {
    static HASH: OnceLock<String> = OnceLock::new();
    if let Some(known) = HASH.get() {
        return Ok(known.clone());
    }
    let file = program::current()?.file;
    let bytes = fs::read(file).context("cannot read the program itself")?;
    Ok(HASH.get_or_init(|| sha256_hex(&bytes)).clone())
}

/// The groups of one trace.
#[derive(Debug)]
pub struct Groups<'a> {
    checkpoints: &'a Checkpoints,
    key: Key,
    folder: PathBuf,
}

impl Groups<'_> {
    fn path(&self, group: u64) -> PathBuf {
        self.folder.join(format!("{group}.group"))
    }

    /// What a file says of itself: its trace and its number there.
    fn header(&self, group: u64) -> Vec<u8> {
        [self.key.hex().as_bytes(), &group.to_le_bytes()].concat()
    }

    /// Those of `groups` that are missing or unusable.
    pub fn missing(&self, groups: Range<u64>) -> Vec<u64> {
        let is_there = |group: u64| matches!(self.look(group), Some((_, Ok(_))));
        let groups = groups.into_par_iter();
        groups.filter(|&group| !is_there(group)).collect()
    }

    /// The file of a group and what it holds; `None` without one.
    fn look(&self, group: u64) -> Option<(PathBuf, Result<Vec<u8>, &'static str>)> {
        let path = self.path(group);
        let mut file = File::open(&path).ok()?;
        let metadata = file.metadata().ok()?;
        let mut bytes = Vec::with_capacity(metadata.len() as usize + 1);
        file.read_to_end(&mut bytes).ok()?;
        let content = self.unpack(group, &path, bytes, FileState::of(&metadata));
        Some((path, content))
    }

    /// The bytes of a group from those of its file.
    fn unpack(
        &self,
        group: u64,
        path: &Path,
        mut file: Vec<u8>,
        state: Option<FileState>,
    ) -> Result<Vec<u8>, &'static str> {
        if file.len() < HEAD || file[..MARK.len()] != *MARK || !self.is_whole(path, &file, state) {
            return Err("is damaged");
        }
        let header = self.header(group);
        if !file[HEAD..].starts_with(&header) {
            return Err("holds paths of another trace or group");
        }
        file.drain(..HEAD + header.len());
        Ok(file)
    }

    /// Whether the content of a file is that of its hash. A merge reads a file twice, to see that
    /// all are there and to add them up, and hashes it once unless it has changed.
    fn is_whole(&self, path: &Path, file: &[u8], state: Option<FileState>) -> bool {
        let merging = self.checkpoints.is_merging();
        let verified = || {
            let verified = self.checkpoints.verified.lock();
            verified.unwrap_or_else(PoisonError::into_inner)
        };
        if merging && state.is_some() && verified().get(path) == state.as_ref() {
            return true;
        }
        let whole = file[MARK.len()..HEAD] == *Sha256::digest(&file[HEAD..]);
        if let Some(state) = state.filter(|_| merging && whole) {
            verified().insert(path.to_path_buf(), state);
        }
        whole
    }
}

impl CheckpointStore for Groups<'_> {
    fn find(&self, group: u64) -> Option<Vec<u8>> {
        let looked = self.look(group);
        if self.checkpoints.is_merging() && !matches!(looked, Some((_, Ok(_)))) {
            self.checkpoints.fail(anyhow!(
                "expected `{}` among the pieces of the job, found none that can be used",
                self.path(group).display()
            ));
        }
        let (path, content) = looked?;
        content
            .map_err(|why| {
                let name = path.display();
                let said = format!("`{name}` {why}; its paths are traced anew");
                self.checkpoints.console.warn(&said);
            })
            .ok()
    }

    fn keep(&self, group: u64, bytes: &[u8]) {
        let content = [&self.header(group), bytes].concat();
        let file = [&MARK[..], &Sha256::digest(&content), &content].concat();
        let Err(error) = atomic_file::write_scratch(&self.path(group), &file) else {
            return;
        };
        let checkpoints = self.checkpoints;
        if checkpoints.purpose == Purpose::Sharding {
            checkpoints.fail(error);
        } else if !atomic_file::is_closed() && !checkpoints.refused.swap(true, Ordering::Relaxed) {
            // After Ctrl-C no more files appear, which needs no word.
            checkpoints.console.warn(&format!(
                "finished paths cannot be kept ({error:#}); an interrupted run would begin anew"
            ));
        }
    }
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    entries.filter_map(|e| Some(e.ok()?.path())).collect()
}

/// What cannot be removed costs space and nothing else.
fn remove(folder: &Path) {
    let _ = fs::remove_dir_all(folder);
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET: Console = Console { quiet: true, json: false };

    #[test]
    fn groups_come_back_whole_or_not_at_all_and_leave_nothing() {
        let directory = tempfile::tempdir().expect("a folder");
        let cache = directory.path().join("cache");
        let open = || Checkpoints::open(&cache, QUIET).expect("readable");
        let first = open();
        let groups = first.of(&json!({"seed": 1}));
        assert_eq!(groups.find(3), None);
        groups.keep(3, b"some bytes");
        groups.keep(4, b"");

        // Another command of the same program finds them, under the same fields only.
        let second = open();
        let same = second.of(&json!({"seed": 1}));
        assert_eq!(same.find(3).as_deref(), Some(&b"some bytes"[..]));
        assert_eq!(same.find(4).as_deref(), Some(&b""[..]));
        let other = second.of(&json!({"seed": 2}));
        assert_eq!(other.find(3), None);

        // Copied under another trace or another number, a whole file is refused.
        fs::create_dir_all(&other.folder).expect("made");
        for copy in [other.path(3), same.path(5)] {
            fs::copy(same.path(3), copy).expect("copied");
        }
        assert_eq!((other.find(3), same.find(5)), (None, None));

        let path = same.path(3);
        let bytes = fs::read(&path).expect("a file");
        let mut turned = bytes.clone();
        turned[HEAD + 2] ^= 1;
        for damaged in [&bytes[..bytes.len() - 1], &bytes[..5], &[], &turned] {
            fs::write(&path, damaged).expect("written");
            assert_eq!(same.find(3), None);
        }
        second.finish();
        assert!(!cache.exists());
    }

    #[test]
    fn a_merge_sees_a_file_that_changed_after_it_was_verified() {
        let directory = tempfile::tempdir().expect("a folder");
        let open = |merging| Checkpoints::of_job(directory.path(), "job", merging, QUIET);
        let fields = json!({"seed": 1});
        open(false).of(&fields).keep(0, b"some bytes");
        let merge = open(true);
        let groups = merge.of(&fields);
        assert_eq!(groups.missing(0..2), [1]);
        assert_eq!(groups.find(0).as_deref(), Some(&b"some bytes"[..]));
        let path = groups.path(0);
        let mut bytes = fs::read(&path).expect("a file");
        *bytes.last_mut().expect("bytes") ^= 1;
        fs::write(&path, bytes).expect("written");
        let file = File::options().write(true).open(&path).expect("a file");
        // Not within the resolution of the clock of files.
        let later = SystemTime::now() + Duration::from_secs(1);
        file.set_modified(later).expect("set");
        assert_eq!(groups.find(0), None);
        assert!(merge.is_whole().is_err());
    }

    #[test]
    fn what_another_program_left_is_removed() {
        let directory = tempfile::tempdir().expect("a folder");
        let old = directory.path().join(FOLDER).join("0123456789abcdef/key");
        fs::create_dir_all(&old).expect("made");
        fs::write(old.join("0.group"), b"old").expect("written");
        fs::write(directory.path().join("table.bworders"), b"stays").expect("written");
        let checkpoints = Checkpoints::open(directory.path(), QUIET).expect("readable");
        assert!(!old.exists());
        checkpoints.finish();
        assert!(directory.path().join("table.bworders").exists());
        assert!(!directory.path().join(FOLDER).exists());
    }
}
