// SPDX-License-Identifier: MIT OR Apache-2.0
//! Stopped runs go on from the groups that were kept, to the same bits as whole ones.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::package::Dome;
use crate::common::*;
use tracer::run::run_with;
use tracer::{CheckpointStore, Control, Error, FarField, Outcome, PlaneMap, Settings, run};

/// Bytes by group.
type Groups = BTreeMap<u64, Vec<u8>>;

/// Gives groups and takes others; stops the run once there are enough.
struct Shelf {
    given: Groups,
    taken: Mutex<Groups>,
    enough: usize,
    cancel: AtomicBool,
}

impl Shelf {
    fn new(given: Groups, enough: usize) -> Self {
        Self { given, taken: Mutex::default(), enough, cancel: AtomicBool::new(false) }
    }

    fn taken(self) -> Groups {
        self.taken.into_inner().unwrap()
    }
}

impl CheckpointStore for Shelf {
    fn find(&self, group: u64) -> Option<Vec<u8>> {
        self.given.get(&group).cloned()
    }

    fn keep(&self, group: u64, bytes: &[u8]) {
        let mut taken = self.taken.lock().unwrap();
        assert_eq!(taken.insert(group, bytes.to_vec()), None);
        if taken.len() >= self.enough {
            self.cancel.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn a_stopped_run_goes_on_to_the_same_bits() {
    let package = package(N, Dome::relief(staircase(17)), 0.95, 0.86);
    let scene = array(&package, 2, 8.3).build().unwrap();
    let far = FarField::default();
    let plane = PlaneMap::centred(3.0, 0.25, 40, 40).unwrap();
    let settings = Settings::new(64_000, 5);
    let whole = run(&scene, &[&far, &plane], &settings).unwrap();
    let trace = |shelf: &Shelf, threads: usize| -> Result<Outcome, Error> {
        let control =
            Control { cancel: Some(&shelf.cancel), checkpoints: Some(shelf), ..Control::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| run_with(&scene, &[&far, &plane], &settings, control))
    };
    for (before, after) in [(1, 3), (3, 1)] {
        let shelf = Shelf::new(Groups::new(), 7);
        assert_eq!(trace(&shelf, before), Err(Error::Cancelled));
        let mut kept = shelf.taken();
        assert!((7..7 + before).contains(&kept.len()), "{}", kept.len());

        // Of these, one is cut short and one has a number too many: both are traced again, and with
        // them what is missing.
        for (bytes, change) in kept.values_mut().zip([-8, 8]) {
            bytes.resize((bytes.len() as i64 + change) as usize, 0);
        }
        let traced = 64 - kept.len() + 2;
        let shelf = Shelf::new(kept, usize::MAX);
        assert_eq!(trace(&shelf, after).unwrap(), whole);
        assert_eq!(shelf.taken().len(), traced);
    }
}
