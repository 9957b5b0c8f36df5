// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of diffraction orders kept between runs, under a name that says everything they depend
//! on.
//!
//! The key is the SHA-256 of relief, indices, wavelength, grid, tolerance and version of the solver
//! as JSON, so that nothing needs to be invalidated: another design has other keys. Files are
//! written whole or not at all, and each holds its key; one that is damaged all the same, or that
//! is another table's, is reported, and computed anew.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Result;
use bsdf::OrderTable;
use runtime::key::Key;

use crate::order_tables::{EXTENSION, read_table, write_table};

/// State of the cache under a key.
#[derive(Debug)]
pub enum CacheEntry {
    /// The table.
    Table(Box<OrderTable>),
    /// Nothing.
    Nothing,
    /// A file that cannot be used, and why.
    Unusable(String),
}

/// Key in the header of a table, under which the cache holds it.
pub const HEADER_KEY: &str = "cache_key";

/// A directory of tables.
#[derive(Debug, Clone)]
pub struct Cache {
    directory: PathBuf,
    /// Keys stored by this process, through any clone.
    stored: Arc<Mutex<BTreeSet<Key>>>,
}

impl Cache {
    /// A cache in `directory`, which is made when the first table is stored.
    pub fn new(directory: PathBuf) -> Self {
        Self { directory, stored: Arc::default() }
    }

    /// The directory beside `out` that serves when none is given.
    pub fn beside(out: &Path) -> Self {
        let parent = match out.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
            _ => PathBuf::from("."),
        };
        Self::new(parent.join(".batwing-cache"))
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    fn path(&self, key: &Key) -> PathBuf {
        self.directory.join(format!("{}.{EXTENSION}", key.hex()))
    }

    /// Looks for the table of `key`.
    pub fn find(&self, key: &Key) -> CacheEntry {
        let path = self.path(key);
        if !path.exists() {
            return CacheEntry::Nothing;
        }
        let table = match read_table(&path) {
            Ok(table) => table,
            Err(error) => return CacheEntry::Unusable(format!("{error:#}")),
        };
        let stored = table.header().more.get(HEADER_KEY);
        let stored = stored.and_then(serde_json::Value::as_str).unwrap_or("none");
        if stored != key.hex() {
            return CacheEntry::Unusable(format!(
                "`{}`: expected the table of this key, got that of key {stored}",
                path.display()
            ));
        }
        CacheEntry::Table(Box::new(table))
    }

    /// True if there is a file under `key`, usable or not.
    pub fn holds(&self, key: &Key) -> bool {
        self.path(key).exists()
    }

    /// Keeps `table`, whose header states `key`, under it.
    pub fn store(&self, key: &Key, table: &OrderTable) -> Result<()> {
        write_table(&self.path(key), table)?;
        self.stored.lock().unwrap_or_else(PoisonError::into_inner).insert(key.clone());
        Ok(())
    }

    /// True if the table of `key` was computed and stored by this process, and not only found.
    pub fn has_stored(&self, key: &Key) -> bool {
        self.stored.lock().unwrap_or_else(PoisonError::into_inner).contains(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bsdf::{Grid, OrderEfficiency, SmoothInterface, TableHeader};
    use serde_json::json;

    fn table(key: &Key) -> OrderTable {
        let grid = Grid {
            period: 1.0,
            wavelength: 0.55,
            index_inner: 1.41,
            index_outer: 1.0,
            kx_per_zone: 1,
            ky: Grid::ky_nodes(1.41, 1.0, 3),
        };
        let smooth = SmoothInterface::new(1.41, 1.0).expect("valid");
        let rows: Vec<_> = grid
            .rows(|side, kx, ky, polarisation| {
                let n = grid.index(side);
                let z = (n * n - kx * kx - ky * ky).sqrt()
                    * if side == bsdf::Side::Inner { -1.0 } else { 1.0 };
                let wi = glam::DVec3::new(-kx, -ky, z) / n;
                let albedo = bsdf::Bsdf::albedo(&smooth, wi, polarisation);
                let other =
                    if side == bsdf::Side::Inner { bsdf::Side::Outer } else { bsdf::Side::Inner };
                vec![
                    OrderEfficiency::new(side, 0, albedo.reflected),
                    OrderEfficiency::new(other, 0, albedo.transmitted),
                ]
            })
            .collect();
        OrderTable::build(
            TableHeader {
                length_unit: "um".to_owned(),
                more: serde_json::Map::from_iter([(HEADER_KEY.to_owned(), key.hex().into())]),
                ..TableHeader::default()
            },
            grid,
            rows,
        )
        .expect("valid")
    }

    #[test]
    fn keys_follow_every_ingredient() {
        let a = Key::of(&json!({"period_um": 10.0}));
        assert_eq!(a, Key::of(&json!({"period_um": 10.0})));
        assert_ne!(a, Key::of(&json!({"period_um": 10.000_000_000_000_002})));
        assert_eq!(a.hex().len(), 64);
    }

    #[test]
    fn a_stored_table_comes_back_and_a_damaged_one_is_reported() {
        let directory = tempfile::tempdir().expect("a directory");
        let cache = Cache::new(directory.path().join("cache"));
        let key = Key::of(&json!(1));
        assert!(matches!(cache.find(&key), CacheEntry::Nothing));
        let table = table(&key);
        assert!(!cache.has_stored(&key));
        cache.store(&key, &table).expect("stored");
        assert!(cache.clone().has_stored(&key));
        assert!(!Cache::new(directory.path().join("cache")).has_stored(&key));
        let CacheEntry::Table(back) = cache.find(&key) else { panic!("the table is there") };
        assert_eq!((back.header(), back.entry_count()), (table.header(), table.entry_count()));

        let path = cache.path(&key);
        let bytes = std::fs::read(&path).expect("a file");
        for damaged in [bytes[..bytes.len() / 2].to_vec(), Vec::new(), {
            let mut b = bytes.clone();
            let last = b.len() - 40;
            b[last] ^= 1;
            b
        }] {
            std::fs::write(&path, damaged).expect("written");
            assert!(matches!(cache.find(&key), CacheEntry::Unusable(_)));
        }

        // Under the name of another key, even a whole table is refused.
        let other = Key::of(&json!(2));
        std::fs::write(cache.path(&other), bytes).expect("written");
        let CacheEntry::Unusable(why) = cache.find(&other) else {
            panic!("the table of another key was taken")
        };
        assert!(why.contains(other.hex()) && why.contains(key.hex()), "{why}");
    }

    #[test]
    fn default_directory_lies_beside_the_results() {
        assert_eq!(Cache::beside(Path::new("results")).directory, Path::new("./.batwing-cache"));
        assert_eq!(Cache::beside(Path::new("/a/b")).directory, Path::new("/a/.batwing-cache"));
    }
}
