// SPDX-License-Identifier: MIT OR Apache-2.0
//! The session of one design: draft of its text, history, kept states, choice of the model, and the
//! newest frame. The file changes when it is saved, and not before.

mod file;

use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::{Context, Result};
use serde_json::{Value, json};

use design::Design;
use formats::{WRITERS, Writes};
use runtime::interrupt::Interrupt;
use simulate::model::Model;
use simulate::scene_check;

use crate::design_file::DesignFile;
use crate::draft;
use crate::fault::Fault;
use crate::fields::fields;
use crate::search::Search;

use self::file::{Disk, Saved};

/// Entries of the history of undo.
const MAX_HISTORY: usize = 200;
/// States that are kept.
const MAX_KEPT: usize = 50;

/// A trace to be made.
#[derive(Debug)]
pub struct Job {
    /// Number of the choice of design, model and what stands beside.
    number: u64,
    /// The design.
    pub design: Design,
    /// How it is traced.
    pub model: Model,
    /// What stands beside.
    pub beside: Option<(Design, Model)>,
    /// Raised where the choice is another, or nobody looks.
    pub interrupt: Interrupt,
}

/// A state of the draft that was kept.
#[derive(Debug)]
struct Kept {
    id: u64,
    label: String,
    text: String,
    design: Design,
    model: Model,
}

#[derive(Debug)]
struct State {
    /// Grows with every change that the page shows.
    number: u64,
    draft: String,
    /// Grows with every change of the draft.
    edition: u64,
    saved: Saved,
    /// The newest text that is a design, that design, and its fields and curves.
    good: String,
    design: Design,
    shown: (Vec<Value>, Vec<Value>),
    /// Why the draft is no design.
    fault: Option<Fault>,
    /// Why the design could not be traced.
    failed: Option<Fault>,
    model: Model,
    undo: Vec<String>,
    redo: Vec<String>,
    /// True while a slider moves.
    is_moving: bool,
    kept: Vec<Kept>,
    next_kept: u64,
    beside: Option<u64>,
    job: u64,
    traced: u64,
    running: Interrupt,
    frame: Option<(u64, Value)>,
    frames: u64,
    viewers: usize,
    has_ended: bool,
    search: Search,
    /// Stops the export or report under way.
    command: Option<Interrupt>,
}

/// The session of one design.
#[derive(Debug)]
pub struct Session {
    file: DesignFile,
    /// The path of the file, as messages name it.
    name: String,
    /// Held while something reads the draft or the file to change one of them; the draft that is
    /// kept beside the file.
    edits: Mutex<Option<String>>,
    state: Mutex<State>,
    changed: Condvar,
}

impl Session {
    /// The session of the design file at `path`, by rays.
    ///
    /// # Errors
    /// A file that cannot be read or is no design; a draft that cannot be read.
    pub fn open(path: &Path) -> Result<Self> {
        let (file, name) = (DesignFile::new(path)?, path.display().to_string());
        let draft = file.draft()?;
        let read = file.read().with_context(|| format!("{name}: cannot be read"));
        let parsed = read.and_then(|(text, has_crlf)| {
            Ok((scene_check::parse(&name, &text, folder(path))?, text, has_crlf))
        });
        let (design, text, has_crlf) = match draft {
            None => parsed?,
            Some(_) => parsed.with_context(|| {
                format!("`{}` keeps a draft of an earlier session", file.draft_path().display())
            })?,
        };
        let offered = draft.clone().filter(|draft| *draft != text);
        let saved =
            Saved { text: text.clone(), has_crlf, disk: Disk::Known, offered, unkept: None };
        let state = State {
            number: 1,
            draft: text.clone(),
            edition: 1,
            saved,
            shown: fields(&text, folder(path)),
            good: text,
            design,
            fault: None,
            failed: None,
            model: Model::Geometric,
            undo: Vec::new(),
            redo: Vec::new(),
            is_moving: false,
            kept: Vec::new(),
            next_kept: 1,
            beside: None,
            job: 1,
            traced: 0,
            running: Interrupt::default(),
            frame: None,
            frames: 0,
            viewers: 0,
            has_ended: false,
            search: Search::default(),
            command: None,
        };
        let (edits, state, changed) = (Mutex::new(draft), Mutex::new(state), Condvar::new());
        Ok(Self { file, name, edits, state, changed })
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state, and tells all who wait for it.
    fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        let mut state = self.lock();
        let outcome = change(&mut state);
        state.number += 1;
        drop(state);
        self.changed.notify_all();
        outcome
    }

    fn parse(&self, text: &str) -> Result<Design, Fault> {
        scene_check::parse(&self.name, text, self.folder())
            .map_err(|error| Fault::of_design(&error, &self.name))
    }

    /// Sets the key at `path` of the draft, or removes it where there is no `value`; `part` while a
    /// slider moves.
    ///
    /// # Errors
    /// A key or a value that the design does not take: nothing changes.
    pub fn set(&self, path: &str, value: Option<&Value>, part: bool) -> Result<(), Fault> {
        let _edit = self.edit_draft()?;
        let draft = self.lock().draft.clone();
        let edited = match value {
            Some(value) => draft::set(&draft, path, value),
            None => draft::unset(&draft, path),
        };
        let edited = edited.map_err(|e| Fault::new(format!("{e:#}")));
        let parsed = edited.and_then(|edited| Ok((self.parse(&edited)?, edited)));
        let (design, edited) = parsed.map_err(|fault| {
            // A drag that ends in a refusal has ended.
            self.lock().is_moving &= part;
            fault.about(path)
        })?;
        if edited == draft {
            // Nothing that a page shows.
            self.lock().is_moving = part;
            return Ok(());
        }
        self.change(|state| {
            if !state.is_moving {
                state.remember();
            }
            state.is_moving = part;
            state.take(edited, Ok(design), self.folder());
        });
        Ok(())
    }

    /// Takes a whole text as the draft, also one that is no design. A text with an `edition` is an
    /// edit of the draft that had it.
    ///
    /// # Errors
    /// A draft that changed meanwhile.
    pub fn write(&self, text: &str, edition: Option<u64>) -> Result<(), Fault> {
        let _edit = self.edit_draft()?;
        if edition.is_some_and(|edition| edition != self.lock().edition) {
            return Err(Fault::conflict("the design was changed elsewhere while this was written"));
        }
        self.take_text(text.replace("\r\n", "\n"));
        Ok(())
    }

    /// Takes what `edit` makes of the draft.
    ///
    /// # Errors
    /// Those of `edit`, and a text before or after it that is no design.
    pub(crate) fn rewrite(&self, edit: impl FnOnce(String) -> Result<String>) -> Result<(), Fault> {
        let _edit = self.edit_draft()?;
        let (.., draft) = self.present()?;
        let text = edit(draft).map_err(|error| Fault::new(format!("{error:#}")))?;
        self.parse(&text)?;
        self.take_text(text);
        Ok(())
    }

    /// Takes a text as the draft, while edits wait.
    fn take_text(&self, text: String) {
        if self.lock().draft == text {
            return;
        }
        let design = self.parse(&text);
        self.change(|state| {
            state.is_moving = false;
            state.remember();
            state.take(text, design, self.folder());
        });
    }

    /// Goes back (or, with `forth`, forward) in the history.
    pub fn step(&self, forth: bool) {
        let _edit = self.edit();
        let next = {
            let mut state = self.lock();
            state.is_moving = false;
            let State { undo, redo, draft, .. } = &mut *state;
            let (from, to) = if forth { (redo, undo) } else { (undo, redo) };
            let Some(next) = from.pop() else { return };
            to.push(draft.clone());
            next
        };
        let design = self.parse(&next);
        self.change(|state| state.take(next, design, self.folder()));
    }

    /// Chooses the model called `word`.
    ///
    /// # Errors
    /// A model that the design does not have.
    pub fn choose(&self, word: &str) -> Result<(), Fault> {
        let _edit = self.edit();
        let model = Model::all_of(&self.lock().design).into_iter().find(|m| m.word() == word);
        let model =
            model.ok_or_else(|| Fault::new(format!("this design has no model {word:?}")))?;
        self.change(|state| {
            if state.model != model {
                state.model = model;
                state.renew();
            }
        });
        Ok(())
    }

    /// Keeps the newest design, and puts it beside what follows.
    ///
    /// # Errors
    /// As many states as are kept at most.
    pub fn keep(&self) -> Result<(), Fault> {
        let _edit = self.edit();
        if self.lock().kept.len() >= MAX_KEPT {
            let words = format!("expected at most {MAX_KEPT} kept states: forget one first");
            return Err(Fault::new(words));
        }
        self.change(|state| {
            let id = state.next_kept;
            state.next_kept += 1;
            let before = state.kept.last().map_or(&state.saved.text, |kept| &kept.text);
            let label = format!("{id}: {}", differences(before, &state.good, self.folder()));
            state.kept.push(Kept {
                id,
                label,
                text: state.good.clone(),
                design: state.design.clone(),
                model: state.model,
            });
            state.beside = Some(id);
            state.renew();
        });
        Ok(())
    }

    /// Puts a kept state beside the present one, or none.
    ///
    /// # Errors
    /// A state that is not there.
    pub fn put_beside(&self, id: Option<u64>) -> Result<(), Fault> {
        let _edit = self.edit();
        id.map_or(Ok(()), |id| self.is_kept(id))?;
        self.change(|state| {
            state.beside = id;
            state.renew();
        });
        Ok(())
    }

    /// Takes a kept state as the draft.
    ///
    /// # Errors
    /// A state that is not there.
    pub fn restore(&self, id: u64) -> Result<(), Fault> {
        let _edit = self.edit_draft()?;
        self.is_kept(id)?;
        self.change(|state| {
            let Some(kept) = state.kept.iter().find(|kept| kept.id == id) else { return };
            let (text, design, model) = (kept.text.clone(), kept.design.clone(), kept.model);
            state.is_moving = false;
            if state.draft != text {
                state.remember();
            }
            state.model = model;
            state.take(text, Ok(design), self.folder());
        });
        Ok(())
    }

    /// Forgets a kept state.
    pub fn forget(&self, id: u64) {
        let _edit = self.edit();
        self.change(|state| {
            state.kept.retain(|kept| kept.id != id);
            if state.beside == Some(id) {
                state.beside = None;
                state.renew();
            }
        });
    }

    fn is_kept(&self, id: u64) -> Result<(), Fault> {
        let is_there = self.lock().kept.iter().any(|kept| kept.id == id);
        is_there.then_some(()).ok_or_else(|| Fault::new("this kept state is no longer there"))
    }

    /// The newest design and the model, for commands on it.
    ///
    /// # Errors
    /// A draft that is no design.
    pub fn present(&self) -> Result<(Design, Model, String), Fault> {
        let state = self.lock();
        match &state.fault {
            Some(fault) => Err(fault.clone()),
            None => Ok((state.design.clone(), state.model, state.draft.clone())),
        }
    }

    /// Works on the search.
    pub(crate) fn search<T>(&self, work: impl FnOnce(&mut Search) -> T) -> T {
        self.change(|state| {
            let done = work(&mut state.search);
            if state.has_ended {
                // One that begins meanwhile ends, too.
                raise(&state.search.interrupt);
            }
            done
        })
    }

    /// Looks at the search.
    pub(crate) fn peek<T>(&self, look: impl FnOnce(&Search) -> T) -> T {
        look(&self.lock().search)
    }

    /// The file, as messages name it.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// The folder of the file, and of those that the design names.
    fn folder(&self) -> &Path {
        folder(self.path())
    }

    /// Waits for the next trace; `None` at the end.
    pub fn next_job(&self) -> Option<Job> {
        let mut state = self.lock();
        loop {
            if state.has_ended {
                return None;
            }
            if state.viewers > 0 && state.job != state.traced {
                state.running = Interrupt::default();
                let beside = state.kept.iter().find(|kept| Some(kept.id) == state.beside);
                return Some(Job {
                    number: state.job,
                    design: state.design.clone(),
                    model: state.model,
                    beside: beside.map(|kept| (kept.design.clone(), kept.model)),
                    interrupt: state.running.clone(),
                });
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Notes that `job` was traced, unless it was stopped.
    pub fn traced(&self, job: &Job) {
        let mut state = self.lock();
        if !job.interrupt.is_raised() {
            state.traced = job.number;
        }
    }

    /// Shows a frame of `job`, unless another has begun.
    pub fn publish(&self, job: &Job, frame: Value) {
        let mut state = self.lock();
        if state.job == job.number {
            state.frame = Some((job.number, frame));
            state.frames += 1;
            drop(state);
            self.changed.notify_all();
        }
    }

    /// Shows why `job` could not be traced.
    pub fn fail(&self, job: &Job, fault: Fault) {
        self.change(|state| {
            if state.job == job.number {
                state.failed = Some(fault);
            }
        });
    }

    /// Counts a viewer until it is dropped; without any the trace rests.
    pub fn enter(&self) -> Viewer<'_> {
        self.change(|state| state.viewers += 1);
        Viewer(self)
    }

    /// Begins an export or a report.
    ///
    /// # Errors
    /// Another one is under way.
    pub fn begin_command(&self) -> Result<Command<'_>, Fault> {
        let mut state = self.lock();
        if state.command.is_some() {
            return Err(Fault::conflict("an export or a report is under way; wait for its end"));
        }
        let interrupt = Interrupt::default();
        state.command = Some(interrupt.clone());
        Ok(Command { session: self, interrupt })
    }

    /// Ends all that waits.
    pub fn end(&self) {
        self.change(|state| {
            state.has_ended = true;
            state.stop();
            raise(&state.search.interrupt);
            state.stop_command();
        });
    }

    /// Numbers of state and frame once one differs from those `seen` or the time is over; `None` at
    /// the end.
    pub fn wait(&self, seen: [u64; 2], time: Duration) -> Option<[u64; 2]> {
        let state = self.lock();
        let same = |state: &mut State| !state.has_ended && [state.number, state.frames] == seen;
        let waited = self.changed.wait_timeout_while(state, time, same);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        (!state.has_ended).then_some([state.number, state.frames])
    }

    /// The newest frame, as the page reads it.
    pub fn frame(&self) -> Option<Value> {
        let state = self.lock();
        let (job, frame) = state.frame.as_ref()?;
        let mut frame = frame.clone();
        (frame["state"], frame["frame"]) = ((*job).into(), state.frames.into());
        Some(frame)
    }

    /// The state, as the page reads it.
    pub fn to_json(&self) -> Value {
        let state = self.lock();
        let (fields, curves) = &state.shown;
        let model = |model: Model| {
            json!({"word": model.word(), "label": model.label(&state.design),
                "meaning": model.meaning()})
        };
        let kept = |kept: &Kept| {
            json!({"id": kept.id, "label": kept.label, "model": kept.model.word(),
                "beside": Some(kept.id) == state.beside})
        };
        json!({
            "number": state.number,
            "state": state.job,
            "file": self.path().file_name().map(|name| name.to_string_lossy()),
            "name": state.design.name,
            "text": state.draft,
            "edition": state.edition,
            "saved": !state.is_unsaved(),
            "file_changed": state.saved.disk == Disk::Changed,
            "file_gone": state.saved.disk == Disk::Gone,
            "offers_draft": state.saved.offered.is_some(),
            "unkept": state.saved.unkept,
            "error": state.fault,
            "failed": state.failed,
            "fields": fields,
            "curves": curves,
            "models": Model::all_of(&state.design).into_iter().map(model).collect::<Vec<_>>(),
            "model": state.model.word(),
            "can_undo": !state.undo.is_empty(),
            "can_redo": !state.redo.is_empty(),
            "kept": state.kept.iter().map(kept).collect::<Vec<_>>(),
            "formats": formats(),
            "search": state.search.to_json(),
        })
    }
}

impl State {
    /// True where the draft is other than the file.
    fn is_unsaved(&self) -> bool {
        self.draft != self.saved.text || self.saved.disk == Disk::Gone
    }

    /// Puts the draft into the history.
    fn remember(&mut self) {
        self.undo.push(self.draft.clone());
        if self.undo.len() > MAX_HISTORY {
            self.undo.remove(0);
        }
        self.redo.clear();
    }

    fn take(&mut self, text: String, design: Result<Design, Fault>, folder: &Path) {
        self.draft = text;
        self.edition += 1;
        match design {
            Ok(design) => {
                self.good.clone_from(&self.draft);
                self.design = design;
                self.shown = fields(&self.good, folder);
                self.fault = None;
                let models = Model::all_of(&self.design);
                if !models.contains(&self.model) {
                    self.model = Model::Geometric;
                }
                self.renew();
            }
            Err(fault) => self.fault = Some(fault),
        }
    }

    /// Asks for another trace.
    fn renew(&mut self) {
        self.job += 1;
        self.failed = None;
        self.stop();
    }

    fn stop(&self) {
        raise(&self.running);
    }

    fn stop_command(&self) {
        self.command.iter().for_each(raise);
    }
}

fn raise(interrupt: &Interrupt) {
    interrupt.flag().store(true, Ordering::SeqCst);
}

/// A page that looks on.
#[derive(Debug)]
pub struct Viewer<'a>(&'a Session);

impl Drop for Viewer<'_> {
    fn drop(&mut self) {
        self.0.change(|state| {
            state.viewers -= 1;
            if state.viewers == 0 {
                state.stop();
                state.stop_command();
            }
        });
    }
}

/// An export or a report under way.
#[derive(Debug)]
pub struct Command<'a> {
    session: &'a Session,
    /// Raised where its page is gone.
    pub interrupt: Interrupt,
}

impl Drop for Command<'_> {
    fn drop(&mut self) {
        self.session.lock().command = None;
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// Numbers and curves that differ between two texts, in words.
fn differences(before: &str, now: &str, folder: &Path) -> String {
    if before == now {
        return "nothing changed".to_owned();
    }
    let [(old_fields, old_curves), (new_fields, new_curves)] =
        [before, now].map(|text| fields(text, folder));
    let of = |all: &[Value], path: &Value| all.iter().find(|one| one["path"] == *path).cloned();
    let numbers = new_fields.iter().filter_map(|field| {
        let old = of(&old_fields, &field["path"])?;
        let name = field["path"].as_str()?;
        let is_other = old["value"] != field["value"];
        is_other.then(|| format!("{name} {} → {}", old["value"], field["value"]))
    });
    let curves = new_curves.iter().filter_map(|curve| {
        let name = curve["path"].as_str()?;
        (of(&old_curves, &curve["path"])? != *curve).then(|| format!("{name} drawn anew"))
    });
    let changed: Vec<String> = numbers.chain(curves).collect();
    match &changed[..] {
        [] => "text changed".to_owned(),
        [one] => one.clone(),
        [one, more @ ..] => format!("{one} and {} more", more.len()),
    }
}

/// Formats that a design can be written in.
fn formats() -> Vec<Value> {
    let of_designs = WRITERS.iter().filter(|writer| {
        let is_of_table = matches!(writer.writes, Writes::Cells { .. } | Writes::Orders(_));
        !is_of_table
    });
    let format = of_designs.map(
        |writer| json!({"word": writer.word, "ending": writer.endings[0], "label": writer.help}),
    );
    format.collect()
}

#[cfg(test)]
mod tests;
