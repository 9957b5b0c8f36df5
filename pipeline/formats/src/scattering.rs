// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering of surfaces by files: what lets light through, for which the indices on both sides
//! must be known, and reflectors.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use bsdf::{Bsdf, LobeMotion, MeasuredBsdf, Polarisation, Side};

use super::content::{self, Content, ScatterFile};
use runtime::bounded_text::{MAX_TABLES, bounded_bytes};
use runtime::provenance::FileRecord;

/// Files that say what a surface does to light from either side.
pub struct Scattering {
    held: Held,
    between: LobeMotion,
    /// The files, in the order in which they were given.
    pub files: Vec<FileRecord>,
}

/// Content of the files.
enum Held {
    /// A file that says itself which side is meant, and its name.
    Whole(Box<Content>, String),
    /// Files for light from one side each, with that side.
    Sides(Vec<(Side, ScatterFile)>),
}

/// Surface of one-sided files between media of these indices.
fn of_sides(
    files: &[(Side, ScatterFile)],
    indices: [f64; 2],
    between: LobeMotion,
) -> Result<MeasuredBsdf, bsdf::Error> {
    let mut tables = Vec::new();
    for found in files.iter().filter_map(|(side, file)| file.tables(*side, indices)) {
        tables.extend(found?);
    }
    MeasuredBsdf::new(indices, between, tables)
}

impl std::fmt::Debug for Scattering {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scattering").field("files", &self.files).finish_non_exhaustive()
    }
}

/// Reads a file in `folder` and notes it.
pub fn open(name: &str, folder: &Path, files: &mut Vec<FileRecord>) -> Result<Content> {
    let path = folder.join(name);
    let bytes = bounded_bytes(&path, MAX_TABLES)
        .with_context(|| format!("{}: expected scattering, cannot read it", path.display()))?;
    files.push(FileRecord::new(name, &bytes));
    content::read(&path)
}

impl Scattering {
    /// Reads `file`, or the one-sided files for light from the `inner` and the `outer` side.
    ///
    /// # Errors
    /// Both or neither; a file that cannot be read, or is not of such a kind.
    pub fn load(
        file: Option<&str>,
        sides: [&[String]; 2],
        between: LobeMotion,
        folder: &Path,
    ) -> Result<Self> {
        let mut files = Vec::new();
        let none = sides.iter().all(|list| list.is_empty());
        let held = if let Some(name) = file {
            ensure!(none, "expected `file`, or `inner` and `outer`, got both");
            let content = open(name, folder, &mut files)?;
            ensure!(
                !matches!(&content, Content::Scatter(file) if file.is_one_sided()),
                "`{name}`: such a file does not say from which side its light comes: expected it under `inner` or `outer`"
            );
            Held::Whole(Box::new(content), name.to_owned())
        } else {
            ensure!(!none, "expected `file`, or `inner` and `outer`, got neither");
            let mut contents = Vec::new();
            for (side, list) in Side::BOTH.into_iter().zip(sides) {
                for name in list {
                    match open(name, folder, &mut files)? {
                        Content::Scatter(file) if file.is_one_sided() => {
                            contents.push((side, file));
                        }
                        other => bail!(
                            "`{name}`: expected a Zemax or Speos file under `{side}`, got {}",
                            other.format()
                        ),
                    }
                }
            }
            Held::Sides(contents)
        };
        Ok(Self { held, between, files })
    }

    /// Surface between media of these indices, inner and outer.
    ///
    /// # Errors
    /// A table made for others; one of more power than comes in.
    pub fn bsdf(&self, indices: [f64; 2]) -> Result<Arc<dyn Bsdf>> {
        match &self.held {
            Held::Whole(content, name) => {
                let bsdf = content.bsdf(name, indices, self.between, Side::Outer)?;
                for (side, expected) in Side::BOTH.into_iter().zip(indices) {
                    let got = bsdf.index(side);
                    ensure!(
                        (got / expected - 1.0).abs() < 1e-6,
                        "`{name}`: expected a table for index {expected} on the {side} side, got {got}"
                    );
                }
                Ok(bsdf)
            }
            Held::Sides(contents) => {
                let measured = of_sides(contents, indices, self.between)?.reciprocal();
                let names: Vec<&str> = self.files.iter().map(|f| f.file.as_str()).collect();
                content::warn(&names.join(", "), &measured);
                Ok(Arc::new(measured))
            }
        }
    }

    /// True for scattering that turns with the incidence.
    pub fn is_isotropic(&self) -> bool {
        match &self.held {
            Held::Whole(content, _) => content.is_isotropic([1.0, 1.0]).unwrap_or(false),
            Held::Sides(tables) => {
                let measured = of_sides(tables, [1.0, 1.0], self.between);
                measured.is_ok_and(|m| m.tables().all(|(_, _, r)| r.is_isotropic()))
            }
        }
    }
}

/// The reflector that the file `name` holds, for light from its outer (front) side, and whether
/// scattering turns with the incidence.
///
/// # Errors
/// A file that holds no scattering, or none from that side.
pub fn reflector(
    content: &Content,
    name: &str,
    between: LobeMotion,
) -> Result<(Arc<dyn Bsdf>, bool)> {
    let bsdf = content.reflector(name, between)?;
    let turns = content.is_isotropic([1.0, 1.0])?;
    let albedo = bsdf.albedo(glam::DVec3::Z, Polarisation::Unpolarised);
    ensure!(
        albedo.reflected > 0.0,
        "`{name}`: expected reflection of light from the outer (front) side, got none"
    );
    Ok((bsdf, turns))
}
