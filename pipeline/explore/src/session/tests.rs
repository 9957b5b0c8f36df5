// SPDX-License-Identifier: MIT OR Apache-2.0

use super::*;

fn session() -> (tempfile::TempDir, Session) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("own.toml");
    std::fs::write(&path, design::NEW_DESIGN.replace("NAME", "own")).expect("written");
    let session = Session::open(&path).expect("a session");
    (folder, session)
}

#[test]
fn the_file_changes_when_it_is_saved_and_keeps_its_comments() {
    let (_folder, session) = session();
    let stored = || std::fs::read_to_string(session.path()).expect("read");
    let before = stored();
    session.set("array.pitch_mm", Some(&json!(6)), false).expect("set");
    assert_eq!((stored(), &session.to_json()["saved"]), (before.clone(), &json!(false)));
    session.save(false).expect("saved");
    assert_eq!(stored(), before.replace("pitch_mm = 5.0", "pitch_mm = 6.0"));
    assert_eq!(session.to_json()["saved"], true);
    // What others write is never replaced without a word.
    std::fs::write(session.path(), &before).expect("written");
    session.set("array.pitch_mm", Some(&json!(7)), false).expect("set");
    assert!(session.save(false).is_err() && stored() == before);
    session.save(true).expect("saved");
    assert!(stored().contains("pitch_mm = 7.0"));
}

#[test]
fn refused_values_change_nothing_and_refused_texts_are_kept() {
    let (_folder, session) = session();
    let before = session.to_json();
    let fault = session.set("array.pitch_mm", Some(&json!(-1)), false).expect_err("refused");
    assert_eq!(json!(fault)["key"], "array.pitch_mm");
    assert_eq!(session.to_json(), before);
    session.write("[led", None).expect("taken");
    let broken = session.to_json();
    assert_eq!((&broken["text"], &broken["error"]["line"]), (&json!("[led"), &json!(1)));
    // The last good design stays.
    assert_eq!((&broken["fields"], &broken["state"]), (&before["fields"], &before["state"]));
    session.step(false);
    assert_eq!(
        (&session.to_json()["text"], &session.to_json()["error"]),
        (&before["text"], &Value::Null)
    );
}

#[test]
fn a_drag_that_ends_in_a_refusal_has_ended() {
    let (_folder, session) = session();
    session.set("array.pitch_mm", Some(&json!(5.1)), true).expect("set");
    assert!(session.set("array.pitch_mm", Some(&json!(-1)), false).is_err());
    let dragged = session.to_json()["text"].clone();
    session.set("led.height_mm", Some(&json!(0.25)), false).expect("set");
    session.step(false);
    assert_eq!(session.to_json()["text"], dragged);
}

#[test]
fn a_drag_is_one_step_of_the_history() {
    let (_folder, session) = session();
    let first = session.to_json()["text"].clone();
    for pitch in [5.1, 5.2, 5.3] {
        session.set("array.pitch_mm", Some(&json!(pitch)), true).expect("set");
    }
    session.set("array.pitch_mm", Some(&json!(5.4)), false).expect("set");
    let last = session.to_json()["text"].clone();
    session.step(false);
    assert_eq!(session.to_json()["text"], first);
    session.step(true);
    assert_eq!(session.to_json()["text"], last);
}

#[test]
fn kept_states_say_what_differs_and_come_back() {
    let (_folder, session) = session();
    session.set("array.pitch_mm", Some(&json!(6)), false).expect("set");
    session.keep().expect("kept");
    session.set("array.pitch_mm", Some(&json!(8)), false).expect("set");
    let state = session.to_json();
    assert_eq!(state["kept"][0]["label"], "1: array.pitch_mm 5.0 → 6.0");
    assert_eq!(state["kept"][0]["beside"], true);
    session.restore(1).expect("there");
    assert!(session.to_json()["text"].as_str().is_some_and(|text| text.contains("pitch_mm = 6.0")));
    session.forget(1);
    assert!(session.restore(1).is_err() && session.put_beside(Some(1)).is_err());
    // What was restored can be undone.
    session.step(false);
    assert!(session.to_json()["text"].as_str().is_some_and(|text| text.contains("pitch_mm = 8.0")));
}

#[test]
fn kept_states_are_refused_where_they_are_many_and_never_dropped() {
    let (_folder, session) = session();
    for _ in 0..MAX_KEPT {
        session.keep().expect("kept");
    }
    assert!(session.keep().is_err());
    assert!(session.put_beside(Some(1)).is_ok());
    let state = session.to_json();
    assert_eq!(state["kept"][1]["label"], "2: nothing changed");
}

#[test]
fn what_is_set_again_is_no_change() {
    let (_folder, session) = session();
    let pitch = || session.set("array.pitch_mm", Some(&json!(5)), false).expect("set");
    pitch();
    let before = session.to_json();
    assert_eq!((&before["can_undo"], &before["state"]), (&json!(false), &json!(1)));
    // Nor is it in place of a text that is no design.
    session.write("[led", None).expect("taken");
    assert!(session.set("array.pitch_mm", Some(&json!(5)), false).is_err());
}

#[test]
fn a_text_by_an_older_draft_is_refused() {
    let (_folder, session) = session();
    let seen = session.to_json()["edition"].as_u64();
    let text = session.to_json()["text"].as_str().expect("a text").to_owned();
    session.set("array.pitch_mm", Some(&json!(6)), false).expect("set");
    let refused = session.write(&format!("{text}# more\n"), seen).expect_err("refused");
    assert_eq!(refused.status(), 409);
    let now = session.to_json()["edition"].as_u64();
    session.write(&format!("{text}# more\n"), now).expect("taken");
}

#[test]
fn lines_of_windows_stay_and_what_cannot_be_read_is_not_replaced() {
    let (_folder, session) = session();
    let text = std::fs::read_to_string(session.path()).expect("read");
    let windows = text.replace('\n', "\r\n");
    std::fs::write(session.path(), &windows).expect("written");
    session.watch();
    // The draft is the same text.
    assert_eq!(session.to_json()["text"], text);
    session.set("array.pitch_mm", Some(&json!(6)), false).expect("set");
    session.save(false).expect("saved");
    let saved = std::fs::read_to_string(session.path()).expect("read");
    assert_eq!(saved, windows.replace("pitch_mm = 5.0", "pitch_mm = 6.0"));
    // Bytes that are no text are others' work, too.
    std::fs::write(session.path(), b"\xff").expect("written");
    session.watch();
    assert_eq!(session.to_json()["file_changed"], true);
    session.set("array.pitch_mm", Some(&json!(7)), false).expect("set");
    assert_eq!(session.save(false).expect_err("refused").status(), 409);
    std::fs::remove_file(session.path()).expect("removed");
    session.watch();
    assert_eq!(session.to_json()["file_gone"], true);
    session.save(false).expect("saved");
}

#[test]
fn a_failed_trace_is_told_until_the_next_and_stops_no_command() {
    let (_folder, session) = session();
    let _viewer = session.enter();
    let job = session.next_job().expect("a job");
    session.fail(&job, Fault::new("broke off"));
    assert_eq!(session.to_json()["failed"]["message"], "broke off");
    assert!(session.present().is_ok());
    session.set("array.pitch_mm", Some(&json!(6)), false).expect("set");
    assert_eq!(session.to_json()["failed"], Value::Null);
}

#[test]
fn one_command_runs_at_a_time_and_ends_with_its_page() {
    let (_folder, session) = session();
    let viewer = session.enter();
    let command = session.begin_command().expect("free");
    assert_eq!(session.begin_command().expect_err("busy").status(), 409);
    drop(viewer);
    assert!(command.interrupt.is_raised());
    drop(command);
    assert!(session.begin_command().is_ok());
}

#[test]
fn without_viewers_nothing_is_traced() {
    let (_folder, session) = session();
    let viewer = session.enter();
    let job = session.next_job().expect("a job");
    drop(viewer);
    assert!(job.interrupt.is_raised());
    session.traced(&job);
    let _viewer = session.enter();
    // The same again, since it was stopped.
    assert_eq!(session.next_job().expect("a job").number, job.number);
    session.end();
    assert!(session.next_job().is_none());
}

#[test]
#[cfg(unix)]
fn saving_keeps_mode_names_and_links() {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    let (folder, session) = session();
    let path = session.path().to_owned();
    let mode = |mode: u32| fs::set_permissions(&path, Permissions::from_mode(mode)).expect("set");
    let turned = |pitch: f64| {
        session.set("array.pitch_mm", Some(&json!(pitch)), false).expect("set");
        let draft = fs::metadata(folder.path().join(".own.toml.draft")).expect("a draft");
        (session.save(false), draft.mode() & 0o777)
    };
    mode(0o600);
    let (saved, of_draft) = turned(6.0);
    assert_eq!((saved, of_draft), (Ok(()), 0o600));
    assert_eq!(fs::metadata(&path).expect("there").mode() & 0o777, 0o600);
    mode(0o444);
    let (refused, _) = turned(7.0);
    assert!(json!(refused.expect_err("refused"))["message"].to_string().contains("read-only"));
    mode(0o640);
    let other = folder.path().join("other.toml");
    fs::hard_link(&path, &other).expect("linked");
    assert_eq!(turned(8.0).0, Ok(()));
    assert_eq!(fs::read(&other).expect("read"), fs::read(&path).expect("read"));
    assert!(fs::read_to_string(&other).expect("read").contains("pitch_mm = 8.0"));
    // A link whose file is gone gets its file again.
    fs::remove_file(&other).expect("removed");
    let real = folder.path().join("real.toml");
    fs::rename(&path, &real).expect("moved");
    std::os::unix::fs::symlink("real.toml", &path).expect("linked");
    fs::remove_file(&real).expect("removed");
    session.set("array.pitch_mm", Some(&json!(9)), false).expect("set");
    session.save(false).expect("saved");
    assert!(path.symlink_metadata().expect("there").is_symlink());
    assert!(fs::read_to_string(&real).expect("read").contains("pitch_mm = 9.0"));
    let names = fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(names, 2, "a draft stays");
}

#[test]
#[cfg(unix)]
fn a_link_stays_and_its_file_is_saved() {
    let (folder, session) = session();
    let link = folder.path().join("link.toml");
    std::os::unix::fs::symlink(session.path(), &link).expect("linked");
    let linked = Session::open(&link).expect("a session");
    linked.set("array.pitch_mm", Some(&json!(6)), false).expect("set");
    linked.save(false).expect("saved");
    assert!(link.symlink_metadata().expect("there").is_symlink());
    let saved = std::fs::read_to_string(session.path()).expect("read");
    assert!(saved.contains("pitch_mm = 6.0"), "{saved}");
}

#[test]
fn a_draft_that_cannot_be_read_is_refused_by_name() {
    let (folder, session) = session();
    std::fs::write(folder.path().join(".own.toml.draft"), b"\xff").expect("written");
    let refused = Session::open(session.path()).expect_err("refused");
    assert!(format!("{refused:#}").contains(".own.toml.draft"), "{refused:#}");
}

#[test]
fn drafts_that_are_not_kept_or_not_removed_are_told_apart() {
    let (folder, session) = session();
    std::fs::create_dir(folder.path().join(".own.toml.draft")).expect("in the way");
    session.set("array.pitch_mm", Some(&json!(6)), false).expect("set");
    let unkept = session.unkept().expect("told");
    assert!(unkept.contains("cannot be kept"), "{unkept}");
    session.save(false).expect("saved");
    let unkept = session.unkept().expect("told");
    assert!(unkept.contains("an old draft stays"), "{unkept}");
}
