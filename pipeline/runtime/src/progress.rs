// SPDX-License-Identifier: MIT OR Apache-2.0
//! Progress, messages and results, each on its stream: progress and messages on standard error,
//! results on standard output.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use crate::control_characters::{bounded, printable};

/// Warnings that [`warn_once`] has given.
static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Sizes of the warnings that [`is_news`] has let through.
static LARGEST: Mutex<BTreeMap<String, f64>> = Mutex::new(BTreeMap::new());

/// Warnings of callers that print none themselves, and the number of these callers at work.
static COLLECTED: Mutex<(usize, Vec<String>)> = Mutex::new((0, Vec::new()));

fn collected() -> MutexGuard<'static, (usize, Vec<String>)> {
    COLLECTED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A caller at work, also of work that panics.
struct Caller;

impl Drop for Caller {
    fn drop(&mut self) {
        let mut collected = collected();
        collected.0 -= 1;
        if collected.0 == 0 {
            collected.1.clear();
        }
    }
}

/// Does `work` and returns the warnings given meanwhile, each once, instead of printing them. Those
/// of callers at work at once go to the first who ends.
pub fn collecting<T>(work: impl FnOnce() -> T) -> (T, Vec<String>) {
    // What an earlier caller was told is news to this one.
    SAID.lock().unwrap_or_else(PoisonError::into_inner).clear();
    LARGEST.lock().unwrap_or_else(PoisonError::into_inner).clear();
    collected().0 += 1;
    let _caller = Caller;
    let result = work();
    let warnings = std::mem::take(&mut collected().1);
    (result, warnings)
}

/// Prints a warning, or hands it to the caller who collects them.
fn give(line: &str) {
    let mut collected = collected();
    let (callers, lines) = &mut *collected;
    if *callers == 0 {
        let _ = writeln!(std::io::stderr(), "batwing: warning: {}", printable(&bounded(line)));
    } else if !lines.iter().any(|given| given == line) {
        lines.push(line.to_owned());
    }
}

/// True of the first warning called `name` in a process, and of one of twice the size of the last
/// that was: a search traces thousands of designs that share a fault.
pub fn is_news(name: &str, size: f64) -> bool {
    let mut largest = LARGEST.lock().unwrap_or_else(PoisonError::into_inner);
    let is_news = largest.get(name).is_none_or(|last| size >= 2.0 * last);
    if is_news {
        largest.insert(name.to_owned(), size);
    }
    is_news
}

/// Prints a warning about a file on standard error, the same one once in a process: studies read
/// their files for every design.
pub fn warn_once(line: &str) {
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if said.insert(line.to_owned()) {
        give(line);
    }
}

/// The error of a closed standard output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("standard output was closed")]
pub struct Closed;

/// Output of a command.
#[derive(Debug, Clone, Copy)]
pub struct Console {
    /// No progress, no messages; only what was asked for and errors.
    pub quiet: bool,
    /// Results as JSON on standard output.
    pub json: bool,
    /// Warnings, also when quiet.
    pub warns: bool,
}

impl Console {
    /// Progress of `length` steps on standard error: a bar on a terminal, lines of text elsewhere,
    /// nothing when quiet.
    pub fn progress(&self, length: u64, what: &str) -> Progress {
        let shown = (!self.quiet).then(|| {
            let is_bar = std::io::stderr().is_terminal();
            Mutex::new(Shown::new(length, what, is_bar))
        });
        Progress(shown)
    }

    /// Does `work` of unknown length and says every now and then that it goes on, on standard
    /// error.
    pub fn waiting<T>(&self, what: &str, work: impl FnOnce() -> T) -> T {
        if self.quiet {
            return work();
        }
        let (done, ended) = mpsc::channel::<()>();
        std::thread::scope(|scope| {
            scope.spawn(move || {
                let (started, mut wait) = (Instant::now(), SHORTEST);
                while ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                    self.say(&format!("{what}: {:.0} s", started.elapsed().as_secs_f64()));
                    wait = LONGEST;
                }
            });
            let result = work();
            drop(done);
            result
        })
    }

    /// Prints a message on standard error, unless quiet.
    pub fn say(&self, line: &str) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{}", printable(line));
        }
    }

    /// Prints a warning on standard error, also when quiet: it may explain a result.
    pub fn warn(&self, line: &str) {
        if self.warns {
            give(line);
        }
    }

    /// Prints the result on standard output: `json` if JSON is wanted, else `text` unless quiet.
    pub fn result(&self, json: &serde_json::Value, text: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            Self::print(&serde_json::to_string_pretty(json)?)
        } else if self.quiet {
            Ok(())
        } else {
            Self::print(&text())
        }
    }

    /// Prints `text` and a line break on standard output.
    pub fn print(text: &str) -> Result<()> {
        match writeln!(std::io::stdout(), "{}", printable(text.trim_end())) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Closed.into()),
            other => other.context("cannot write to standard output"),
        }
    }
}

/// Progress of one job, from any thread.
#[derive(Debug)]
pub struct Progress(Option<Mutex<Shown>>);

impl Progress {
    /// Progress that nobody sees.
    pub const fn hidden() -> Self {
        Self(None)
    }

    /// Counts `steps` as done.
    pub fn inc(&self, steps: u64) {
        self.show(|shown| shown.advance(steps, Instant::now()));
    }

    /// Names what is being done.
    pub fn set_message(&self, what: &str) {
        self.show(|shown| {
            what.clone_into(&mut shown.what);
            (shown.is_bar && shown.suspended == 0).then(|| shown.draw(Instant::now()))
        });
    }

    /// Takes a bar away while `f` prints.
    pub fn suspend<T>(&self, f: impl FnOnce() -> T) -> T {
        self.show(|shown| {
            shown.suspended += 1;
            shown.clear()
        });
        let result = f();
        self.show(|shown| {
            shown.suspended -= 1;
            None
        });
        result
    }

    /// Takes a bar away.
    pub fn finish_and_clear(&self) {
        self.show(Shown::clear);
    }

    /// Prints on standard error what `f` returns.
    fn show(&self, f: impl FnOnce(&mut Shown) -> Option<String>) {
        if let Some(shown) = &self.0 {
            let mut shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(text) = f(&mut shown) {
                let _ = write!(std::io::stderr(), "{text}");
            }
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish_and_clear();
    }
}

/// Progress as a bar, at most every [`REDRAW`], or as lines of text: at every tenth of the work, no
/// more often than [`SHORTEST`], and at least every [`LONGEST`].
#[derive(Debug)]
struct Shown {
    what: String,
    length: u64,
    done: u64,
    started: Instant,
    is_bar: bool,
    is_drawn: bool,
    /// Number of those who print meanwhile; nothing is shown until they have.
    suspended: usize,
    /// Time and number of tenths of the last line.
    last: (Instant, u64),
}

/// Minimum time between two states of a bar.
const REDRAW: Duration = Duration::from_millis(100);
/// Minimum time between lines.
const SHORTEST: Duration = Duration::from_secs(2);
/// Time after which a line comes before the next tenth is done.
const LONGEST: Duration = Duration::from_secs(10);
/// Characters of a bar, and of the line that holds it: the narrowest usual terminal.
const BAR: usize = 16;
const LINE: usize = 79;
/// Control sequence that empties the line of a terminal.
const EMPTY_LINE: &str = "\r\x1b[2K";

impl Shown {
    fn new(length: u64, what: &str, is_bar: bool) -> Self {
        let now = Instant::now();
        let (what, last) = (what.to_owned(), (now, 0));
        let (done, started, is_drawn, suspended) = (0, now, false, 0);
        Self { what, length, done, started, is_bar, is_drawn, suspended, last }
    }

    /// The text to print once `steps` more are done, if it is time for one.
    fn advance(&mut self, steps: u64, now: Instant) -> Option<String> {
        self.done = self.done.saturating_add(steps).min(self.length);
        if self.length == 0 || self.done == self.length {
            return None;
        }
        let fraction = self.done as f64 / self.length as f64;
        let tenths = (10.0 * fraction) as u64;
        let since = now.saturating_duration_since(self.last.0);
        let is_due = if self.is_bar {
            since >= REDRAW
        } else {
            since >= LONGEST || (since >= SHORTEST && tenths > self.last.1)
        };
        if !is_due || self.suspended > 0 {
            return None;
        }
        self.last.1 = tenths;
        Some(self.draw(now))
    }

    /// The text that shows what is done.
    fn draw(&mut self, now: Instant) -> String {
        self.last.0 = now;
        let fraction = self.done as f64 / self.length.max(1) as f64;
        let elapsed = now.saturating_duration_since(self.started).as_secs_f64();
        let is_begun = self.done > 0;
        let left = |open: &str, close: &str| {
            let left = elapsed * (1.0 / fraction - 1.0);
            if is_begun { format!("{open}about {left:.0} s left{close}") } else { String::new() }
        };
        let (what, percent) = (printable(&self.what), 100.0 * fraction);
        if !self.is_bar {
            return format!("{what}: {percent:.0} %, {elapsed:.0} s{}\n", left(", ", ""));
        }
        self.is_drawn = true;
        let bar = "=".repeat((BAR as f64 * fraction) as usize) + ">";
        let left = left(" (", ")");
        let line = format!("{what:28} [{bar:BAR$}] {percent:>3.0} %  {elapsed:.0} s{left}");
        EMPTY_LINE.to_owned() + &line.chars().take(LINE).collect::<String>()
    }

    /// The text that takes a bar away.
    fn clear(&mut self) -> Option<String> {
        std::mem::take(&mut self.is_drawn).then(|| EMPTY_LINE.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_at_tenths_and_after_long_waits() {
        let mut lines = Shown::new(100, "rays", false);
        let start = lines.started;
        let mut at =
            |steps: u64, seconds: u64| lines.advance(steps, start + Duration::from_secs(seconds));
        assert_eq!(at(15, 1), None, "a line in the first two seconds");
        assert_eq!(at(5, 4).as_deref(), Some("rays: 20 %, 4 s, about 16 s left\n"));
        assert_eq!(at(20, 5), None, "a second after the last");
        assert_eq!(at(0, 6).as_deref(), Some("rays: 40 %, 6 s, about 9 s left\n"));
        assert_eq!(at(2, 15), None, "neither a tenth nor ten seconds");
        assert_eq!(at(1, 16).as_deref(), Some("rays: 43 %, 16 s, about 21 s left\n"));
        assert_eq!(at(57, 30), None, "the result says that all is done");
        assert_eq!(lines.clear(), None);
        let mut lines = Shown::new(100, "rays", false);
        let late = lines.started + LONGEST;
        lines.suspended = 1;
        assert_eq!(lines.advance(0, late), None, "another prints");
        lines.suspended = 0;
        assert_eq!(lines.advance(0, late).as_deref(), Some("rays: 0 %, 10 s\n"));
    }

    #[test]
    fn a_panic_ends_the_collecting() {
        let broken = std::panic::catch_unwind(|| collecting::<()>(|| panic!("broken")));
        assert!(broken.is_err());
        assert_eq!(*collected(), (0, Vec::new()));
    }

    #[test]
    fn a_bar_fits_a_terminal_and_goes() {
        let mut bar = Shown::new(4, &"rays of a long name ".repeat(2), true);
        let start = bar.started;
        assert_eq!(bar.advance(1, start), None, "two states within the shortest time");
        let text = bar.advance(1, start + Duration::from_secs(8)).expect("time for a state");
        let line = text.strip_prefix(EMPTY_LINE).expect("over the last state");
        assert!(line.contains("[========>       ]  50 %"), "{line}");
        assert_eq!(line.chars().count(), LINE);
        assert_eq!(bar.clear().as_deref(), Some(EMPTY_LINE));
        assert_eq!(bar.clear(), None);
    }
}
