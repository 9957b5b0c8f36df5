// SPDX-License-Identifier: MIT OR Apache-2.0
//! Work on threads of our own while Python's thread waits and answers signals.
//!
//! Python serves signals on its main thread alone, so the caller waits in slices of [`SLICE`] and
//! asks for them between two. After Ctrl-C the flag that the work polls is raised, and the caller
//! goes on after [`GRACE`] at most; work that has not stopped by then ends at its next safe point,
//! on threads that no later call waits for.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::anyhow;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use runtime::interrupt::Interrupt;

use crate::errors::{internal, to_python};

/// Time between two looks at signals.
const SLICE: Duration = Duration::from_millis(50);
/// Longest wait for work that was asked to stop.
const GRACE: Duration = Duration::from_millis(700);
/// Most threads, as of the command line.
pub const MOST_THREADS: usize = 1024;
/// As that of a main thread.
const STACK_BYTES: usize = 8 << 20;

/// Time before the first report of progress.
const SHORT: Duration = Duration::from_millis(500);

/// What reports of progress go to: a Python function of the steps done, of all steps (0 where that
/// is unknown), and of whether the work has ended.
static LISTENER: Mutex<Option<Py<PyAny>>> = Mutex::new(None);

fn listener() -> MutexGuard<'static, Option<Py<PyAny>>> {
    LISTENER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Sets what reports of progress go to.
pub fn set_listener(function: Option<Py<PyAny>>) {
    *listener() = function;
}

/// What work is given: the interrupt to poll, and where to count its steps.
#[derive(Clone, Default)]
pub struct Job {
    /// The flag that Ctrl-C raises.
    pub interrupt: Interrupt,
    done: Arc<AtomicUsize>,
    all: Arc<AtomicUsize>,
}

impl Job {
    /// States the number of steps that come.
    pub fn expect(&self, steps: usize) {
        self.all.fetch_add(steps, Ordering::Relaxed);
    }

    /// Counts steps, and stops a solver between two of them after Ctrl-C.
    pub fn watch(&self) -> impl Fn(usize) -> ControlFlow<()> + Sync + '_ {
        let stop = self.interrupt.watch();
        move |steps| {
            self.done.fetch_add(steps, Ordering::Relaxed);
            stop(steps)
        }
    }

    /// Reports progress, if anybody listens.
    fn report(&self, py: Python<'_>, ended: bool) -> PyResult<()> {
        let function = listener().as_ref().map(|function| function.clone_ref(py));
        let Some(function) = function else {
            return Ok(());
        };
        let [done, all] = [&self.done, &self.all].map(|count| count.load(Ordering::Relaxed));
        function.call1(py, (done, all, ended)).map(drop)
    }
}

/// Threads where a call states none; 0 for all processors.
static THREADS: AtomicUsize = AtomicUsize::new(0);

/// Pools by their number of threads, of one process: threads do not survive a fork.
#[derive(Default)]
struct Pools {
    process: u32,
    by_threads: BTreeMap<usize, Arc<ThreadPool>>,
}

static POOLS: Mutex<Option<Pools>> = Mutex::new(None);

/// Sets the number of threads of calls that state none; `None` for all processors.
pub fn set_threads(threads: Option<usize>) {
    THREADS.store(threads.unwrap_or(0), Ordering::Relaxed);
}

/// Threads of calls that state none.
pub fn default_threads() -> usize {
    match THREADS.load(Ordering::Relaxed) {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        set => set,
    }
}

fn pool(threads: usize) -> anyhow::Result<Arc<ThreadPool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if pools.as_ref().is_some_and(|p| p.process != process) {
        // Dropping a pool waits for its threads, which a forked process does not have.
        std::mem::forget(pools.take());
    }
    let pools = pools.get_or_insert_with(|| Pools { process, ..Pools::default() });
    if let Some(pool) = pools.by_threads.get(&threads) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK_BYTES)
        .thread_name(|i| format!("batwing-{i}"))
        .build()?;
    let pool = Arc::new(pool);
    pools.by_threads.insert(threads, Arc::clone(&pool));
    Ok(pool)
}

/// Forgets `pool`, whose threads end with their work: later calls get threads of their own.
fn abandon(pool: &Arc<ThreadPool>) {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pools) = pools.as_mut() {
        pools.by_threads.retain(|_, known| !Arc::ptr_eq(known, pool));
    }
}

/// Runs `work` on `threads` threads with Python's lock released. The work polls the interrupt that
/// it is given.
///
/// # Errors
/// Those of the work, as Python exceptions; what a signal handler raises; a panic of the work as an
/// internal error.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&Job) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    let pool = pool(threads.unwrap_or_else(default_threads))
        .map_err(|error| to_python(py, &error.context("cannot start the threads")))?;
    let job = Job::default();
    let (done, result) = channel();
    let result = Mutex::new(result);
    // One thread waits; the lock lets Python's other threads run meanwhile.
    let wait = || {
        let result = result.lock().unwrap_or_else(PoisonError::into_inner);
        result.recv_timeout(SLICE)
    };
    let watched = job.clone();
    pool.spawn(move || {
        let outcome = catch_unwind(AssertUnwindSafe(|| work(&watched)));
        // Nobody waits any more after an interrupt.
        let _ = done.send(outcome);
    });
    let began = Instant::now();
    let mut reported = false;
    let mut stopped: Option<(Instant, PyErr)> = None;
    loop {
        match py.detach(wait) {
            Ok(_) if stopped.is_some() => break,
            Ok(Ok(outcome)) => {
                if reported {
                    job.report(py, true)?;
                }
                return outcome.map_err(|error| to_python(py, &error));
            }
            Ok(Err(panic)) => return Err(internal(py, panic.as_ref())),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(to_python(py, &anyhow!("a thread ended before its work")));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        match &stopped {
            None => {
                if began.elapsed() > SHORT {
                    reported = true;
                }
                let looked = if reported { job.report(py, false) } else { Ok(()) };
                if let Err(signal) = py.check_signals().and(looked) {
                    job.interrupt.flag().store(true, Ordering::SeqCst);
                    stopped = Some((Instant::now(), signal));
                }
            }
            Some((since, _)) if since.elapsed() > GRACE => {
                abandon(&pool);
                break;
            }
            Some(_) => {}
        }
    }
    if reported {
        job.report(py, true)?;
    }
    let (_, signal) = stopped.expect("the loop ends after a signal alone");
    Err(signal)
}
