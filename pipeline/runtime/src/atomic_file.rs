// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files that exist whole or not at all.
//!
//! A file is written beside its destination under a hidden temporary name, flushed to the disk and
//! renamed, which the file system does in one step. A failed writer removes its temporary file;
//! after an interrupt [`close`] lets no more files appear, and [`discard_pending`] removes those of
//! writers that the end of the process cuts short.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};

/// Buffered file that [`write_atomic`] hands to the writer.
pub trait Sink: Write + Seek {}

impl<T: Write + Seek> Sink for T {}

const A_DAY: Duration = Duration::from_hours(24);

static PENDING: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
/// Directories that this process has written to.
static WRITTEN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
static NEXT: AtomicU64 = AtomicU64::new(0);
static CLOSED: AtomicBool = AtomicBool::new(false);

/// Writes the file at `path` through `fill`, creating missing directories, and replaces an older
/// file of that name.
///
/// # Errors
/// An error of `fill`, a failing directory, file or rename, or [`close`] before the end; then
/// nothing new is left and an older file stays.
pub fn write_atomic(path: &Path, fill: impl FnOnce(&mut dyn Sink) -> Result<()>) -> Result<()> {
    temporary(path, Flush::Now, None, fill)?.rename(path)
}

/// Writes `bytes` to the file at `path` as [`write_bytes`] does, with these permissions.
///
/// # Errors
/// A failing directory, file or rename.
pub fn replace(
    path: &Path,
    bytes: &[u8],
    flush: Flush,
    permissions: Option<Permissions>,
) -> Result<()> {
    temporary(path, flush, permissions, |file| Ok(file.write_all(bytes)?))?.rename(path)
}

/// Writes `bytes` to the file at `path`, which keeps its permissions, its owner and its other
/// names: as [`replace`] where that keeps them, else in place, as in a folder that is read-only.
///
/// # Errors
/// A file that may not be written; a failing directory, file or rename.
pub fn rewrite(path: &Path, bytes: &[u8]) -> Result<()> {
    let may_not = || format!("`{}` cannot be written", path.display());
    let about = fs::metadata(path).with_context(may_not)?;
    ensure!(about.is_file(), "{}: it is no file", may_not());
    let permissions = about.permissions();
    ensure!(!permissions.readonly(), "{}: its mode is read-only", may_not());
    let mut file = OpenOptions::new().write(true).open(path).with_context(may_not)?;
    let denies = |error: &std::io::Error| error.kind() == std::io::ErrorKind::PermissionDenied;
    match temporary(path, Flush::Now, Some(permissions), |file| Ok(file.write_all(bytes)?)) {
        Ok(written) => {
            if is_alike(&about, &fs::metadata(&written.path)?) {
                return written.rename(path);
            }
        }
        Err(error) if file_errors(&error).any(denies) => {}
        Err(error) => return Err(error),
    }
    file.set_len(0).and_then(|()| file.write_all(bytes)).and_then(|()| file.sync_all())?;
    Ok(())
}

/// True where a file of one name can stand for another.
#[cfg(unix)]
fn is_alike(old: &fs::Metadata, new: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    old.nlink() == 1 && [old.uid(), old.gid(), old.mode()] == [new.uid(), new.gid(), new.mode()]
}

#[cfg(not(unix))]
fn is_alike(_: &fs::Metadata, _: &fs::Metadata) -> bool {
    true
}

/// Files of one set, which are written whole and get their names together.
#[derive(Default)]
pub struct FileSet {
    written: Vec<(Pending, PathBuf)>,
}

impl FileSet {
    /// Writes the file that [`FileSet::publish`] puts at `path`.
    ///
    /// # Errors
    /// As of [`write_atomic`].
    pub fn write(
        &mut self,
        path: &Path,
        fill: impl FnOnce(&mut dyn Sink) -> Result<()>,
    ) -> Result<()> {
        self.written.push((temporary(path, Flush::Now, None, fill)?, path.to_path_buf()));
        Ok(())
    }

    /// Removes the files of an older set at `targets` and puts all files in place.
    ///
    /// # Errors
    /// A file that cannot be removed or moved.
    pub fn publish(self, targets: &[PathBuf]) -> Result<()> {
        for target in targets {
            supersede(target)?;
        }
        self.written.into_iter().try_for_each(|(file, path)| file.rename(&path))
    }
}

/// When bytes reach the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flush {
    /// Before the file gets its name.
    Now,
    /// When the system likes.
    Later,
}

/// Writes `value` as [`write_json`] does where no file of that name exists; returns whether it did.
/// Of several processes one succeeds,
/// where the file system has hard links.
///
/// # Errors
/// A failing directory, file or rename.
pub fn write_new_json(path: &Path, value: &serde_json::Value) -> Result<bool> {
    let text = serde_json::to_string_pretty(value)? + "\n";
    let written = temporary(path, Flush::Now, None, |file| Ok(file.write_all(text.as_bytes())?))?;
    // Unlike a rename, a link replaces nothing.
    match fs::hard_link(&written.path, path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => Ok(false),
        // A file system without links: the last of them stays.
        Err(_) => written.rename(path).map(|()| true),
    }
}

/// A temporary file beside `path` that is filled and may be moved into place.
fn temporary(
    path: &Path,
    flush: Flush,
    permissions: Option<Permissions>,
    write: impl FnOnce(&mut dyn Sink) -> Result<()>,
) -> Result<Pending> {
    let name = path
        .file_name()
        .with_context(|| format!("expected the path of a file, got `{}`", path.display()))?;
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let open = || {
        ensure!(!is_closed(), "stopped before `{}` was written", path.display());
        Ok(())
    };
    open()?;
    fs::create_dir_all(directory)
        .with_context(|| format!("cannot create the directory `{}`", directory.display()))?;
    lock(&WRITTEN).insert(directory.to_path_buf());

    let unique = NEXT.fetch_add(1, Ordering::Relaxed);
    let temporary = directory.join(format!(
        ".{}.{}-{}-{unique}.partial",
        name.to_string_lossy(),
        host_id(),
        std::process::id()
    ));
    let guard = Pending::new(temporary);
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .create_new(true)
        .open(&guard.path)
        .with_context(|| format!("cannot create `{}`", guard.path.display()))?;
    let permitted = permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions));
    permitted.with_context(|| format!("cannot set the mode of `{}`", guard.path.display()))?;
    fill(file, write, flush).with_context(|| format!("cannot write `{}`", path.display()))?;
    open()?;
    Ok(guard)
}

/// Errors of the file system in the chain of `error`.
pub fn file_errors(error: &anyhow::Error) -> impl Iterator<Item = &std::io::Error> {
    error.chain().filter_map(|cause| cause.downcast_ref())
}

/// True if `error` is one of the file system, and says nothing of what is computed.
pub fn is_of_files(error: &anyhow::Error) -> bool {
    file_errors(error).next().is_some()
}

/// True once [`close`] was called.
pub fn is_closed() -> bool {
    CLOSED.load(Ordering::SeqCst)
}

/// Writes `bytes` to a file that is worth nothing after a failure of power, and whose reader checks
/// it: as [`write_bytes`], without waiting for the disk.
///
/// # Errors
/// A failing directory, file or rename.
pub fn write_scratch(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, bytes, Flush::Later, None)
}

/// Lets no more files of this process appear: every [`write_atomic`] from here on fails, running
/// ones too.
pub fn close() {
    CLOSED.store(true, Ordering::SeqCst);
}

/// Writes `bytes` to the file at `path` as [`write_atomic`] does.
///
/// # Errors
/// A failing directory, file or rename.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomic(path, |file| Ok(file.write_all(bytes)?))
}

/// Writes `value` as indented JSON with a line break at its end, as [`write_atomic`] does.
///
/// # Errors
/// A failing directory, file or rename.
pub fn write_json(path: &Path, value: &serde_json::Value) -> Result<()> {
    let text = serde_json::to_string_pretty(value)? + "\n";
    write_bytes(path, text.as_bytes())
}

/// Removes the file at `path`, which lists others beside it by their hashes, before the first of
/// them is replaced: it would stand beside files that it does not list. And what writers in its
/// folder left that were cut short.
///
/// # Errors
/// A file that cannot be removed.
pub fn supersede(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove `{}`", path.display()))
        }
        _ => {
            path.parent().map(discard_abandoned);
            Ok(())
        }
    }
}

/// Removes every temporary file that a running [`write_atomic`] of this process has open, and
/// returns how many there were.
///
/// Meant for the handler of an interrupt that is about to end the process: the writers that lose
/// their file report an error.
pub fn discard_pending() -> usize {
    discard(|_| true)
}

/// Removes the temporary files in `directory` whose process is no more: one that was killed could
/// not. Of other machines, and where it is not known which processes there are, those older than a
/// day. A file that cannot be removed stays.
pub fn discard_abandoned(directory: &Path) {
    let Ok(entries) = fs::read_dir(directory) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        if let Some(writer) = name.to_str().and_then(writer)
            && !is_running(writer, &entry)
        {
            // It is hidden and belongs to nobody: nothing depends on it.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// As [`discard_abandoned`] in every directory that this process has written to.
pub fn discard_abandoned_beside() {
    let directories = lock(&WRITTEN).clone();
    for directory in &directories {
        discard_abandoned(directory);
    }
}

/// A number of this machine, its start and its list of processes: processes of equal number on
/// machines that share a file system are told apart by it.
fn host_id() -> u32 {
    static ID: LazyLock<u32> = LazyLock::new(|| {
        let start = fs::read("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        let processes = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        let hash = Sha256::digest([&start, processes.as_os_str().as_encoded_bytes()].concat());
        u32::from_le_bytes([hash[0], hash[1], hash[2], hash[3]])
    });
    *ID
}

/// Host and process that a temporary file of this name belongs to, if it is one.
fn writer(name: &str) -> Option<(u32, u32)> {
    let (name, numbers) = name.strip_prefix('.')?.strip_suffix(".partial")?.rsplit_once('.')?;
    let numbers: Vec<&str> = numbers.split('-').collect();
    let digits = |text: &&str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let [host, process, _] = numbers[..] else {
        return None;
    };
    (!name.is_empty() && numbers.iter().all(digits)).then_some(())?;
    Some((host.parse().ok()?, process.parse().ok()?))
}

/// True if the writer of a temporary file may still be there.
fn is_running((at, process): (u32, u32), file: &fs::DirEntry) -> bool {
    if at == host_id() && process == std::process::id() {
        return true;
    }
    let processes = Path::new("/proc");
    if at == host_id() && processes.join("self").exists() {
        return processes.join(process.to_string()).exists();
    }
    let written = file.metadata().and_then(|about| about.modified());
    let age = written.ok().and_then(|written| written.elapsed().ok());
    age.is_none_or(|age| age < A_DAY)
}

fn discard(chosen: impl Fn(&Path) -> bool) -> usize {
    let mut pending = lock(&PENDING);
    let before = pending.len();
    // A file that cannot be removed stays on the list for its own writer to try.
    pending.retain(|path| !(chosen(path) && fs::remove_file(path).is_ok()));
    before - pending.len()
}

fn fill(file: File, write: impl FnOnce(&mut dyn Sink) -> Result<()>, flush: Flush) -> Result<()> {
    let mut buffered = BufWriter::with_capacity(1 << 16, file);
    write(&mut buffered)?;
    let file = buffered.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    if flush == Flush::Now {
        file.sync_all()?;
    }
    Ok(())
}

fn lock(paths: &'static Mutex<BTreeSet<PathBuf>>) -> MutexGuard<'static, BTreeSet<PathBuf>> {
    paths.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary file that is removed unless it is renamed.
struct Pending {
    path: PathBuf,
}

impl Pending {
    fn new(path: PathBuf) -> Self {
        lock(&PENDING).insert(path.clone());
        Self { path }
    }

    fn rename(self, to: &Path) -> Result<()> {
        // The lock keeps an interrupt from removing the file between the rename and its leaving the
        // list.
        let mut pending = lock(&PENDING);
        fs::rename(&self.path, to)
            .with_context(|| format!("cannot move `{}` into place", to.display()))?;
        pending.remove(&self.path);
        Ok(())
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        if lock(&PENDING).remove(&self.path) {
            // Failing to remove it leaves a hidden file, which is all that can be done while an
            // error is on its way.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(directory)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn the_file_appears_whole_and_alone() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("deep/er/a.txt");
        write_bytes(&path, b"one").unwrap();
        write_bytes(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(names(path.parent().unwrap()), ["a.txt"]);
    }

    #[test]
    #[cfg(unix)]
    fn a_file_in_a_folder_that_is_read_only_is_rewritten() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        fs::write(&path, b"older").unwrap();
        let mode = |mode| fs::set_permissions(directory.path(), Permissions::from_mode(mode));
        mode(0o555).unwrap();
        let outcome = rewrite(&path, b"new");
        mode(0o755).unwrap();
        outcome.unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(directory.path()), ["a.txt"]);
    }

    #[test]
    fn a_failing_writer_leaves_the_older_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        let error = write_atomic(&path, |file| {
            file.write_all(b"half")?;
            anyhow::bail!("no more numbers")
        })
        .unwrap_err();
        assert!(format!("{error:#}").contains("no more numbers"), "{error:#}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(directory.path()), ["a.txt"]);
    }

    #[test]
    fn a_set_of_files_is_complete_or_absent() {
        let directory = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a.txt", "b.txt", "c.txt"].map(|name| directory.path().join(name));
        write_bytes(&c, b"old").unwrap();
        let mut set = FileSet::default();
        set.write(&a, |file| Ok(file.write_all(b"1")?)).unwrap();
        assert!(set.write(&b, |_| anyhow::bail!("no more numbers")).is_err());
        drop(set);
        assert_eq!(names(directory.path()), ["c.txt"]);
        let mut set = FileSet::default();
        for path in [&a, &b] {
            set.write(path, |file| Ok(file.write_all(b"1")?)).unwrap();
            assert!(!path.exists());
        }
        set.publish(&[a, b, c]).unwrap();
        assert_eq!(names(directory.path()), ["a.txt", "b.txt"]);
    }

    #[test]
    fn an_interrupt_removes_what_is_being_written() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        let result = write_atomic(&path, |file| {
            file.write_all(b"half")?;
            assert_eq!(names(directory.path()).len(), 1);
            // Only this test's own file: other tests are writing theirs.
            assert_eq!(discard(|path| path.starts_with(directory.path())), 1);
            Ok(())
        });
        assert!(result.is_err());
        assert!(names(directory.path()).is_empty());
    }

    #[test]
    fn what_a_dead_process_left_is_removed_and_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        // No process has a number so large.
        let of = |host: u32, process: u32| format!(".map.npy.{host}-{process}-3.partial");
        let dead = of(host_id(), u32::MAX);
        let own = of(host_id(), std::process::id());
        // Of another machine, whose processes are not known.
        let far = of(host_id().wrapping_add(1), u32::MAX);
        let others = ["a.partial", ".b.x-1-1.partial", ".c.1-4294967295-3", "map.npy"];
        let kept = others.map(str::to_owned).into_iter();
        let kept: Vec<String> = kept.chain([own, far]).collect();
        for name in kept.iter().chain([&dead]) {
            fs::write(directory.path().join(name), b"half").unwrap();
        }
        let old = directory.path().join(&dead);
        let long_ago = std::time::SystemTime::now() - 2 * A_DAY;
        let file = File::options().write(true).open(old).unwrap();
        file.set_modified(long_ago).unwrap();
        discard_abandoned(directory.path());
        let mut kept = kept;
        kept.sort();
        assert_eq!(names(directory.path()), kept);
        discard_abandoned(&directory.path().join("none"));
    }

    #[test]
    fn errors_of_files_are_told_from_others() {
        let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
        assert!(is_of_files(&anyhow::Error::from(full()).context("cannot write `a.txt`")));
        assert!(!is_of_files(&anyhow::anyhow!("no figure could be read")));
    }

    #[test]
    fn of_many_writers_of_a_new_file_one_succeeds() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("deep/a.json");
        let write = |number: u32| write_new_json(&path, &number.into()).unwrap();
        let written: Vec<u32> = std::thread::scope(|scope| {
            let writers = (0..8).map(|number| (number, scope.spawn(move || write(number))));
            let writers: Vec<_> = writers.collect();
            let written = writers
                .into_iter()
                .filter_map(|(number, writer)| writer.join().unwrap().then_some(number));
            written.collect()
        });
        assert_eq!(written.len(), 1);
        assert_eq!(fs::read_to_string(&path).unwrap(), format!("{}\n", written[0]));
        assert!(!write(8));
        assert_eq!(names(path.parent().unwrap()), ["a.json"]);
    }

    #[test]
    fn a_directory_is_no_file() {
        assert!(write_bytes(Path::new("/"), b"x").is_err());
    }
}
