// SPDX-License-Identifier: MIT OR Apache-2.0
//! The part of the page on the section of a dome by full wave, where the folder holds one.

use std::path::Path;

use anyhow::Result;
use serde_json::{Value, json};

use metrics::digits::thousands;
use results::full_wave::{Distance, FullWaveFile};

use super::folder::SealedFolder;
use super::pictures::Album;
use crate::full_wave::far_field_picture;

/// The part of the page on the comparison in `directory`, where there is one.
///
/// # Errors
/// A file that is missing or altered; far fields that cannot be drawn.
pub(super) fn found(album: &mut Album, directory: &Path) -> Result<Option<Value>> {
    let folder = SealedFolder::<FullWaveFile>::open(directory)?;
    folder.map(|folder| full_wave(album, &folder.file)).transpose()
}

/// Verdict, table and picture of `file` for the template.
///
/// # Errors
/// Far fields that cannot be drawn.
pub fn full_wave(album: &mut Album, file: &FullWaveFile) -> Result<Value> {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let row = |dome: &str, d: &Distance| {
        json!({
            "model": format!("{dome}{}", d.model.name()),
            "bins": format!("{}°", d.bin_deg),
            "beyond": d.beyond_noise(),
            "noise": percent(d.noise),
            "largest": percent(d.largest),
            "l1": percent(d.l1),
        })
    };
    let caption = format!(
        "Far field of the section of {} by full wave and rays: {}. Bands are two standard errors wide to each side, by the scatter among sets of sources.",
        file.design,
        file.size()
    );
    Ok(json!({
        "design": file.design,
        "size": file.size(),
        "sources": file.sources,
        "paths": thousands(file.paths as u64),
        "nodes": file.nodes_per_wavelength,
        "balance": format!("{:.0e}", file.comparison.balance),
        "taken": file.taken,
        "verdict": file.verdict(),
        "rows": file
            .parts()
            .flat_map(|(dome, part)| part.distances.iter().map(move |d| row(dome, d)))
            .collect::<Vec<_>>(),
        "picture": album.fixed(&far_field_picture(file)?, &caption),
    }))
}
