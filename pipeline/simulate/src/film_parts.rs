// SPDX-License-Identifier: MIT OR Apache-2.0
//! Outcomes of film stacks that groups of paths have drawn, kept for later traces: in the memory of
//! this process, where searches trace the same stack again and again, and in the cache.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use tracer::CheckpointStore;

use runtime::key::Key;
use runtime::store::Entries;

/// Bytes that are kept in memory, at most.
const MAX_BYTES: usize = 1 << 30;

/// The part of one group of one stack.
type PartKey = (String, u64);

/// Parts in memory, the oldest first.
#[derive(Default)]
struct Memory {
    parts: HashMap<PartKey, Arc<Vec<u8>>>,
    ages: VecDeque<PartKey>,
    bytes: usize,
}

static MEMORY: Mutex<Option<Memory>> = Mutex::new(None);

impl Memory {
    fn with<T>(act: impl FnOnce(&mut Self) -> T) -> T {
        let mut memory = MEMORY.lock().unwrap_or_else(PoisonError::into_inner);
        act(memory.get_or_insert_default())
    }

    fn put(&mut self, key: PartKey, part: Vec<u8>) {
        self.bytes += part.len();
        match self.parts.insert(key.clone(), Arc::new(part)) {
            Some(before) => self.bytes -= before.len(),
            None => self.ages.push_back(key),
        }
        while self.bytes > MAX_BYTES
            && let Some(oldest) = self.ages.pop_front()
        {
            self.bytes -= self.parts.remove(&oldest).map_or(0, |part| part.len());
        }
    }
}

/// Parts of one stack and seed.
pub struct FilmParts<'a> {
    key: Key,
    cache: Option<Entries<'a>>,
}

impl<'a> FilmParts<'a> {
    /// Those of `key`, which `cache` keeps too.
    pub fn new(key: Key, cache: Option<Entries<'a>>) -> Self {
        Self { key, cache }
    }
}

impl CheckpointStore for FilmParts<'_> {
    fn find(&self, group: u64) -> Option<Vec<u8>> {
        let key = (self.key.hex().to_owned(), group);
        if let Some(known) = Memory::with(|memory| memory.parts.get(&key).cloned()) {
            return Some(known.to_vec());
        }
        let part = self.cache.as_ref()?.find(group)?;
        Memory::with(|memory| memory.put(key, part.clone()));
        Some(part)
    }

    fn keep(&self, group: u64, bytes: &[u8]) {
        Memory::with(|memory| memory.put((self.key.hex().to_owned(), group), bytes.to_vec()));
        if let Some(cache) = &self.cache {
            cache.keep(group, bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_parts_make_room() {
        let mut memory = Memory::default();
        for group in 0..5 {
            memory.put(("a".to_owned(), group), vec![0; MAX_BYTES / 4]);
            memory.put(("a".to_owned(), group), vec![0; MAX_BYTES / 4]);
        }
        assert_eq!(memory.bytes, MAX_BYTES);
        assert!(!memory.parts.contains_key(&("a".to_owned(), 0)) && memory.parts.len() == 4);
    }
}
