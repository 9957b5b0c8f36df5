// SPDX-License-Identifier: MIT OR Apache-2.0
//! The session and its file: who edits, what is saved, read again, and kept beside it.

use std::io::ErrorKind;
use std::path::Path;
use std::sync::{MutexGuard, PoisonError};

use super::Session;
use crate::fault::Fault;

/// State of the file on the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Disk {
    /// The content last read or written.
    Known,
    /// Content that others wrote.
    Changed,
    /// Nothing.
    Gone,
}

/// The file, as far as the session knows.
#[derive(Debug)]
pub(super) struct Saved {
    /// The content as last read or written.
    pub text: String,
    /// True of a file whose lines end as on Windows; texts here end them by `\n` alone.
    pub has_crlf: bool,
    pub disk: Disk,
    /// The draft of an earlier session, until it is taken or discarded.
    pub offered: Option<String>,
    /// The reason why the draft cannot be kept beside the file, or an old one not be removed.
    pub unkept: Option<String>,
}

/// An edit of the draft or the file, while others wait. At its end what is unsaved is kept beside
/// the file.
pub(super) struct Edit<'a> {
    session: &'a Session,
    kept: MutexGuard<'a, Option<String>>,
}

impl Drop for Edit<'_> {
    fn drop(&mut self) {
        let (unsaved, is_moving) = {
            let state = self.session.lock();
            if state.saved.offered.is_some() {
                return;
            }
            (state.is_unsaved().then(|| state.draft.clone()), state.is_moving)
        };
        if unsaved == *self.kept {
            return;
        }
        let kept = self.session.file.keep(unsaved.as_deref(), is_moving);
        let unkept = kept.err().map(|error| match unsaved {
            Some(_) => format!("the draft cannot be kept: {error:#}"),
            None => format!("an old draft stays, and the next start may offer it: {error:#}"),
        });
        // A folder that refuses it is asked again with the next draft.
        *self.kept = unsaved;
        if self.session.lock().saved.unkept != unkept {
            self.session.change(|state| state.saved.unkept = unkept);
        }
    }
}

impl Session {
    pub(super) fn edit(&self) -> Edit<'_> {
        Edit { session: self, kept: self.edits.lock().unwrap_or_else(PoisonError::into_inner) }
    }

    /// An edit of the draft.
    pub(super) fn edit_draft(&self) -> Result<Edit<'_>, Fault> {
        let edit = self.edit();
        if self.lock().saved.offered.is_some() {
            return Err(Fault::conflict(
                "a draft of an earlier session is offered: take it or discard it first",
            ));
        }
        Ok(edit)
    }

    /// Writes the draft into the file; one that was changed by others only where `over`.
    ///
    /// # Errors
    /// A file that was changed or cannot be written.
    pub fn save(&self, over: bool) -> Result<(), Fault> {
        let _edit = self.edit_draft()?;
        let (draft, stored, mut has_crlf) = {
            let state = self.lock();
            (state.draft.clone(), state.saved.text.clone(), state.saved.has_crlf)
        };
        let is_of_others = match self.file.read() {
            Ok((now, crlf)) => {
                has_crlf = crlf;
                now != stored && now != draft
            }
            Err(error) => error.kind() != ErrorKind::NotFound,
        };
        if is_of_others && !over {
            self.change(|state| state.saved.disk = Disk::Changed);
            return Err(Fault::conflict(
                "the file was changed by another program; save again to replace it",
            ));
        }
        let lines = if has_crlf { draft.replace('\n', "\r\n") } else { draft.clone() };
        self.file.write(&lines).map_err(|error| Fault::new(format!("{error:#}")))?;
        self.change(|state| (state.saved.text, state.saved.disk) = (draft, Disk::Known));
        Ok(())
    }

    /// Takes the draft that an earlier session left, or discards it.
    pub fn answer_offer(&self, takes: bool) {
        let _edit = self.edit();
        let offered = self.change(|state| state.saved.offered.take());
        if let Some(text) = offered.filter(|_| takes) {
            self.take_text(text);
        }
    }

    /// Takes the content of the file as the draft.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn reload(&self) -> Result<(), Fault> {
        let _edit = self.edit();
        let file = self.file.read();
        let file = file.map_err(|error| Fault::new(format!("{}: {error}", self.name)))?;
        self.take_file(file);
        Ok(())
    }

    fn take_file(&self, (text, has_crlf): (String, bool)) {
        self.take_text(text.clone());
        self.change(|state| {
            let saved = &mut state.saved;
            (saved.text, saved.has_crlf, saved.disk) = (text, has_crlf, Disk::Known);
        });
    }

    /// Looks at the file: what others wrote into it is the draft, unless that is unsaved.
    pub fn watch(&self) {
        let _edit = self.edit();
        let file = self.file.read();
        let (now, before, is_saved) = {
            let state = self.lock();
            let now = match &file {
                Ok((text, _)) if *text == state.saved.text => Disk::Known,
                Err(error) if error.kind() == ErrorKind::NotFound => Disk::Gone,
                _ => Disk::Changed,
            };
            (now, state.saved.disk, state.draft == state.saved.text)
        };
        match file {
            Ok(file) if now == Disk::Changed && is_saved => self.take_file(file),
            _ if now != before => self.change(|state| state.saved.disk = now),
            _ => {}
        }
    }

    /// True where the draft is other than the file.
    pub fn is_unsaved(&self) -> bool {
        self.lock().is_unsaved()
    }

    /// The reason why the draft is not kept beside the file.
    pub fn unkept(&self) -> Option<String> {
        self.lock().saved.unkept.clone()
    }

    /// The file of the draft, as messages name it.
    pub fn draft_path(&self) -> &Path {
        self.file.draft_path()
    }
}
