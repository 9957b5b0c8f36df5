// SPDX-License-Identifier: MIT OR Apache-2.0
//! One store of what was computed, under explicit keys and to the bit: groups of paths, figures of
//! traces, candidates of a search.
//!
//! A [`Key`] is the hash of all that a value depends on. The values of a key are numbered, and lie in
//! a folder of its name, each in a file: a mark, the SHA-256 of what follows, key and number, and the
//! bytes of the value. They are written whole or not at all. A file that is damaged or that belongs
//! elsewhere is reported, and its value is computed anew.
//!
//! | made by | folder in the cache | lasts |
//! |---|---|---|
//! | [`Store::of_program`] | `checkpoints/<program>` | until the results are written, at most a week without use, and no longer than the program |
//! | [`Store::of_job`] | `jobs/<job>` | until the shards of the job are merged |
//! | [`Store::lasting`] | as named | until somebody removes it |

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
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use crate::content_hash::sha256_hex;
use crate::key::Key;
use crate::progress::Console;
use crate::{atomic_file, program};

/// Paths below which a trace is too short to be worth keeping in parts: about a second.
pub const MIN_PATHS: u64 = 1_000_000;

/// Folder of what commands keep until their results are written.
const FOLDER: &str = "checkpoints";
/// Folder of jobs.
const JOBS: &str = "jobs";
/// First bytes of a file.
const MARK: &[u8; 8] = b"bwgroup2";
/// Offset of key and number: after the mark and the hash.
const HEAD: usize = MARK.len() + 32;
/// Time for which values of an unfinished command are kept.
const KEPT: Duration = Duration::from_hours(7 * 24);

/// A folder of values by key, as one command sees it.
#[derive(Debug)]
pub struct Store {
    /// The directory of the cache.
    cache: PathBuf,
    /// The folder in it.
    folder: PathBuf,
    console: Console,
    /// Folders of keys that this command has asked for.
    used: Mutex<BTreeSet<PathBuf>>,
    /// Purpose of the values.
    purpose: Purpose,
    /// True once the console has said that nothing can be kept.
    refused: AtomicBool,
    /// Reason why a value could not be kept, or is missing where all are merged.
    failure: Mutex<Option<anyhow::Error>>,
    /// Files that a merge has compared with their hashes, as they were then.
    verified: Mutex<BTreeMap<PathBuf, FileState>>,
}

/// State of a file, which changes with every change of it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FileState {
    length: u64,
    modified: SystemTime,
}

impl FileState {
    /// `None` where the file system keeps no times.
    fn new(file: &Metadata) -> Option<Self> {
        Some(Self { length: file.len(), modified: file.modified().ok()? })
    }
}

/// Use of the values of a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// To go on after an interrupt.
    Resuming,
    /// To be merged: whatever is not kept is lost.
    Sharding,
    /// All are there.
    Merging,
    /// For later commands.
    Lasting,
}

impl Store {
    /// The store of a command of this program in the directory `cache`, for a repetition after an
    /// interrupt; removes what is outdated there.
    ///
    /// # Errors
    /// A program that cannot be read.
    pub fn of_program(cache: &Path, console: Console) -> Result<Self> {
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
        Ok(Self::new(cache, folder, Purpose::Resuming, console))
    }

    /// The store of the shards of `job` in the directory `cache`; when `merging`, all values are
    /// there, and nothing is computed.
    pub fn of_job(cache: &Path, job: &str, merging: bool, console: Console) -> Self {
        let purpose = if merging { Purpose::Merging } else { Purpose::Sharding };
        Self::new(cache, cache.join(JOBS).join(job), purpose, console)
    }

    /// The store in the folder `name` of the directory `cache`, which lasts.
    pub fn lasting(cache: &Path, name: &str, console: Console) -> Self {
        Self::new(cache, cache.join(name), Purpose::Lasting, console)
    }

    /// The store in the folder `name` of the same cache, which lasts; keys that have not been written
    /// for the longest time are removed where all hold more than `max_bytes`.
    #[must_use]
    pub fn lasting_beside(&self, name: &str, max_bytes: u64) -> Self {
        let store = Self::lasting(&self.cache, name, self.console);
        let mut keys: Vec<(SystemTime, u64, PathBuf)> = entries(&store.folder)
            .into_iter()
            .filter_map(|folder| {
                let files = entries(&folder);
                let sizes = files.iter().filter_map(|file| Some(fs::metadata(file).ok()?.len()));
                Some((fs::metadata(&folder).ok()?.modified().ok()?, sizes.sum(), folder))
            })
            .collect();
        keys.sort();
        let mut bytes: u64 = keys.iter().map(|(_, bytes, _)| bytes).sum();
        for (_, of_key, folder) in keys {
            if bytes > max_bytes {
                remove(&folder);
                bytes -= of_key;
            }
        }
        store
    }

    fn new(cache: &Path, folder: PathBuf, purpose: Purpose, console: Console) -> Self {
        Self {
            cache: cache.to_path_buf(),
            folder,
            console,
            used: Mutex::default(),
            purpose,
            refused: AtomicBool::new(false),
            failure: Mutex::default(),
            verified: Mutex::default(),
        }
    }

    /// True where groups of a trace of `paths` paths are kept.
    pub fn keeps(&self, paths: u64) -> bool {
        self.purpose != Purpose::Resuming || paths >= MIN_PATHS
    }

    /// True where all values are there, so that nothing may be computed.
    pub fn is_merging(&self) -> bool {
        self.purpose == Purpose::Merging
    }

    fn fail(&self, error: anyhow::Error) {
        let failure = self.failure.lock();
        let mut failure = failure.unwrap_or_else(PoisonError::into_inner);
        failure.get_or_insert(error);
    }

    /// Takes the first error of a value that could not be kept, or is missing in a merge.
    ///
    /// # Errors
    /// The first error.
    pub fn take_error(&self) -> Result<()> {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.take().map_or(Ok(()), Err)
    }

    /// Removes all values of the job, and folders that are empty then.
    pub fn discard_job(&self) {
        remove(&self.folder);
        // Fails where another job keeps something, as it should.
        let _ = fs::remove_dir(self.cache.join(JOBS));
        let _ = fs::remove_dir(&self.cache);
    }

    /// The values of `key`.
    pub fn entries(&self, key: Key) -> Entries<'_> {
        let folder = self.folder.join(key.hex());
        self.used.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.clone());
        Entries { store: self, key, folder }
    }

    /// Removes the values of `key`.
    pub fn discard(&self, key: Key) {
        remove(&self.entries(key).folder);
    }

    /// Folders of the keys asked for so far.
    pub fn snapshot(&self) -> BTreeSet<PathBuf> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Removes the values of keys asked for since a snapshot.
    pub fn discard_newer(&self, snapshot: &BTreeSet<PathBuf>) {
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        for folder in used.difference(snapshot) {
            remove(folder);
        }
        used.clone_from(snapshot);
    }

    /// Removes the values of this command, and folders that are empty then.
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

/// The values of one key.
#[derive(Debug)]
pub struct Entries<'a> {
    store: &'a Store,
    key: Key,
    folder: PathBuf,
}

impl Entries<'_> {
    /// The value `number`; `None` where there is none that can be used.
    pub fn find_value<T: DeserializeOwned>(&self, number: u64) -> Option<T> {
        ciborium::from_reader(self.find(number)?.as_slice()).ok()
    }

    /// Keeps the value `number`.
    ///
    /// # Errors
    /// A value that cannot be kept, where it would be lost.
    pub fn keep_value(&self, number: u64, value: &impl Serialize) -> Result<()> {
        let mut bytes = Vec::new();
        ciborium::into_writer(value, &mut bytes)?;
        self.keep(number, &bytes);
        self.store.take_error()
    }

    /// The ones of `numbers` without a value that can be used.
    pub fn missing(&self, numbers: Range<u64>) -> Vec<u64> {
        let is_there = |number: u64| matches!(self.look(number), Some((_, Ok(_))));
        numbers.into_par_iter().filter(|&number| !is_there(number)).collect()
    }

    fn path(&self, number: u64) -> PathBuf {
        self.folder.join(format!("{number}.group"))
    }

    /// Key and number of a value, as its file states them.
    fn header(&self, number: u64) -> Vec<u8> {
        [self.key.hex().as_bytes(), &number.to_le_bytes()].concat()
    }

    /// The file of a value and the bytes in it; `None` without one.
    fn look(&self, number: u64) -> Option<(PathBuf, Result<Vec<u8>, &'static str>)> {
        let path = self.path(number);
        let mut file = File::open(&path).ok()?;
        let metadata = file.metadata().ok()?;
        let mut bytes = Vec::with_capacity(metadata.len() as usize + 1);
        file.read_to_end(&mut bytes).ok()?;
        let content = self.unpack(number, &path, bytes, FileState::new(&metadata));
        Some((path, content))
    }

    /// The bytes of a value from those of its file.
    fn unpack(
        &self,
        number: u64,
        path: &Path,
        mut file: Vec<u8>,
        state: Option<FileState>,
    ) -> Result<Vec<u8>, &'static str> {
        if file.len() < HEAD || file[..MARK.len()] != *MARK || !self.is_complete(path, &file, state)
        {
            return Err("is damaged");
        }
        let header = self.header(number);
        if !file[HEAD..].starts_with(&header) {
            return Err("holds paths of another trace or group");
        }
        file.drain(..HEAD + header.len());
        Ok(file)
    }

    /// True where the content of a file has the hash that it states. A merge reads a file twice, to see that
    /// all are there and to add them up, and hashes it once unless it has changed.
    fn is_complete(&self, path: &Path, file: &[u8], state: Option<FileState>) -> bool {
        let merging = self.store.is_merging();
        let verified = || {
            let verified = self.store.verified.lock();
            verified.unwrap_or_else(PoisonError::into_inner)
        };
        if merging && state.is_some() && verified().get(path) == state.as_ref() {
            return true;
        }
        let complete = file[MARK.len()..HEAD] == *Sha256::digest(&file[HEAD..]);
        if let Some(state) = state.filter(|_| merging && complete) {
            verified().insert(path.to_path_buf(), state);
        }
        complete
    }
}

impl Entries<'_> {
    /// The bytes kept under `number`; a file that cannot be used is reported, and where all are merged
    /// a missing one is a failure.
    pub fn find(&self, number: u64) -> Option<Vec<u8>> {
        let looked = self.look(number);
        if self.store.is_merging() && !matches!(looked, Some((_, Ok(_)))) {
            self.store.fail(anyhow!(
                "expected `{}` among the pieces of the job, found none that can be used",
                self.path(number).display()
            ));
        }
        let (path, content) = looked?;
        content
            .map_err(|why| {
                let name = path.display();
                let said = format!("`{name}` {why}; its paths are traced anew");
                self.store.console.warn(&said);
            })
            .ok()
    }

    /// Keeps bytes under `number`; where that fails the console says so once.
    pub fn keep(&self, number: u64, bytes: &[u8]) {
        let content = [&self.header(number), bytes].concat();
        let file = [&MARK[..], &Sha256::digest(&content), &content].concat();
        let store = self.store;
        let write = match store.purpose {
            Purpose::Lasting => atomic_file::write_bytes,
            _ => atomic_file::write_scratch,
        };
        let Err(error) = write(&self.path(number), &file) else {
            return;
        };
        if matches!(store.purpose, Purpose::Sharding | Purpose::Lasting) {
            store.fail(error);
        } else if !atomic_file::is_closed() && !store.refused.swap(true, Ordering::Relaxed) {
            // After Ctrl-C no more files appear, which needs no word.
            store.console.warn(&format!(
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

/// Removes a folder. One that cannot be removed costs space and nothing else.
fn remove(folder: &Path) {
    let _ = fs::remove_dir_all(folder);
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const QUIET: Console = Console { quiet: true, json: false, warns: true };

    #[test]
    fn groups_come_back_whole_or_not_at_all_and_leave_nothing() {
        let directory = tempfile::tempdir().expect("a folder");
        let cache = directory.path().join("cache");
        let open = || Store::of_program(&cache, QUIET).expect("readable");
        let first = open();
        let groups = first.entries(Key::of(&json!({"seed": 1})));
        assert_eq!(groups.find(3), None);
        groups.keep(3, b"some bytes");
        groups.keep(4, b"");

        // Another command of the same program finds them, under the same fields only.
        let second = open();
        let same = second.entries(Key::of(&json!({"seed": 1})));
        assert_eq!(same.find(3).as_deref(), Some(&b"some bytes"[..]));
        assert_eq!(same.find(4).as_deref(), Some(&b""[..]));
        let other = second.entries(Key::of(&json!({"seed": 2})));
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
    fn values_come_back_to_the_bit_from_a_store_that_lasts() {
        let directory = tempfile::tempdir().expect("a folder");
        let open = || Store::lasting(directory.path(), "values", QUIET);
        let key = || Key::of(&json!(1));
        let values = [0.1, -0.0, 1e-310, f64::INFINITY, f64::NAN, 1.0 / 3.0];
        let kept: Result<Vec<f64>, String> = Ok(values.to_vec());
        open().entries(key()).keep_value(0, &kept).expect("kept");
        let found = open().entries(key()).find_value::<Result<Vec<f64>, String>>(0);
        let bits = |all: &[f64]| all.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found.expect("a value").expect("numbers")), bits(&values));
        assert_eq!(open().entries(key()).find_value::<Vec<String>>(0), None);
    }

    #[test]
    fn a_merge_sees_a_file_that_changed_after_it_was_verified() {
        let directory = tempfile::tempdir().expect("a folder");
        let open = |merging| Store::of_job(directory.path(), "job", merging, QUIET);
        let fields = json!({"seed": 1});
        open(false).entries(Key::of(&fields)).keep(0, b"some bytes");
        let merge = open(true);
        let groups = merge.entries(Key::of(&fields));
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
        assert!(merge.take_error().is_err());
    }

    #[test]
    fn what_another_program_left_is_removed() {
        let directory = tempfile::tempdir().expect("a folder");
        let old = directory.path().join(FOLDER).join("0123456789abcdef/key");
        fs::create_dir_all(&old).expect("made");
        fs::write(old.join("0.group"), b"old").expect("written");
        fs::write(directory.path().join("table.bworders"), b"stays").expect("written");
        let store = Store::of_program(directory.path(), QUIET).expect("readable");
        assert!(!old.exists());
        store.finish();
        assert!(directory.path().join("table.bworders").exists());
        assert!(!directory.path().join(FOLDER).exists());
    }
}
