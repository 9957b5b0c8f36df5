// SPDX-License-Identifier: MIT OR Apache-2.0
//! The far field of a model, read back from a directory of results.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};
use tracer::Distribution;

use arrays::npy;
use formats::photometry::distribution;
use metrics::far_field::{AngularBins, BinPlacement};
use runtime::content_hash::{self, sha256_hex};

use results::FILE;
use results::schema::{STOKES_LOSS, StoppedBy};

/// A far field of a results directory.
pub struct Stored {
    /// The far field for 1 W emitted; a photometric one for 1 lm, of converted light for 1 lm that leaves.
    pub far: Distribution,
    /// Lumens that the sources emit, or that leave converted, where the design states what they emit.
    pub lumens: Option<f64>,
    /// Electrical power of all packages, W, where the design states it.
    pub electrical_w: Option<f64>,
    /// True of converted light, whose lumens are those that leave.
    pub is_converted: bool,
}

/// The far field in `far_field.npy` of a results directory.
///
/// # Errors
/// If there is none or it has another shape, if `results.json` two directories above does not list
/// it as it is, if it is in cd and `results.json` does not say for how many lumens, or if it is one of
/// converted light in watts, whose lumens nothing tells.
pub fn of_results(directory: &Path) -> Result<Stored> {
    let model = model(directory)?;
    let (far, flux) = as_it_stands(directory, &model)?;
    for file in ["far_field.npy", "far_field.csv"] {
        unaltered(directory, file)?;
    }
    let absolute = stated(&model, "/absolute/emitted/emitted_w");
    let electrical_w = stated(&model, "/absolute/electrical_w");
    let is_converted = is_converted(&model);
    if is_converted {
        ensure!(
            is_in_candela(directory),
            "`{}`: the far field of converted light in watts: expected lumens, of a run of the design with weighting = \"photometric\"",
            directory.display()
        );
        let lumens = absolute.map(|_| flux);
        return Ok(Stored { far, lumens, electrical_w, is_converted });
    }
    // The far field of many wavelengths has the shape of its lumens in photometric weighting only.
    let of_spectrum = stated(&model, "/spectrum/emitted/emitted_w");
    let lumens = match of_spectrum {
        Some(_) => "/spectrum/emitted/emitted_lm",
        None => "/absolute/emitted/emitted_lm",
    };
    ensure!(
        of_spectrum.is_none()
            || stated(&model, lumens).is_some()
            || model["spectrum"]["stopped_by"] == json!(StoppedBy::NoDispersion),
        "`{}`: a far field of several wavelengths in watts: expected lumens, of a run of the design with weighting = \"photometric\"",
        directory.display()
    );
    let lumens = absolute.and_then(|_| stated(&model, lumens));
    Ok(Stored { far, lumens, electrical_w, is_converted })
}

/// The far field of a results directory, whether or not a run wrote it so, and the flux that it is one
/// of.
///
/// # Errors
/// A file that cannot be read, light of no flux.
pub fn as_it_stands(directory: &Path, model: &Value) -> Result<(Distribution, f64)> {
    let path = directory.join("far_field.npy");
    let far = read_far_field(&path).with_context(|| path.display().to_string())?;
    let flux = if is_in_candela(directory) && is_converted(model) {
        far.flux()
    } else {
        emitted(directory, model)?
    };
    ensure!(flux > 0.0, "`{}`: expected light, got none", path.display());
    Ok((far.scaled(1.0 / flux), flux))
}

/// Refuses a file of a results directory that is not the one that `results.json` of the run lists,
/// with its hash.
fn unaltered(directory: &Path, file: &str) -> Result<()> {
    let path = directory.join(file);
    let bytes =
        std::fs::read(&path).with_context(|| format!("cannot read `{}`", path.display()))?;
    let whole = directory.canonicalize()?;
    let names: Vec<_> = whole.iter().rev().take(2).map(|n| n.to_string_lossy()).collect();
    let of_run = whole.join("../..").join(FILE);
    let [model, design] = names.as_slice() else {
        bail!("`{}`: expected the directory of a model of a design", whole.display());
    };
    let text = std::fs::read(&of_run).with_context(|| {
        format!(
            "`{}`: expected `{}` two directories above, which a run writes at its end",
            directory.display(),
            FILE
        )
    })?;
    let listed = std::str::from_utf8(&text)
        .ok()
        .filter(|text| content_hash::hashes(text).is_some_and(|(expected, got)| expected == got));
    let json: Value =
        listed.and_then(|text| serde_json::from_str(text).ok()).with_context(|| {
            format!("`{}`: expected it as the run wrote it, got an altered one", of_run.display())
        })?;
    let name = format!("{design}/{model}/{file}");
    let entries = json["files"].as_array().into_iter().flatten();
    let mut hashes = entries.filter(|e| e["file"] == *name).filter_map(|e| e["sha256"].as_str());
    let expected = hashes
        .next()
        .with_context(|| format!("`{}`: files: expected `{name}`, got none", of_run.display()))?;
    let got = sha256_hex(&bytes);
    ensure!(
        expected == got,
        "`{}` was altered after the run that wrote it: expected SHA-256 {expected}, got {got}",
        path.display()
    );
    Ok(())
}

/// Flux that the sources emit, in the unit of the intensities of a results directory: lumens where they
/// are in cd, watts where they are in W/sr, as `results.json` of the run says. Without it 1 W.
fn emitted(directory: &Path, model: &Value) -> Result<f64> {
    if !is_in_candela(directory) {
        return Ok(stated(model, "/absolute/emitted/emitted_w").unwrap_or(1.0));
    }
    stated(model, "/spectrum/emitted/emitted_lm").with_context(|| {
        format!(
            "`{}`: intensities in cd: expected emitted_lm of this model in `{}` two directories above, got none",
            directory.display(),
            FILE
        )
    })
}

/// True if the heading of `far_field.csv` names candelas.
fn is_in_candela(directory: &Path) -> bool {
    let heading = File::open(directory.join("far_field.csv"))
        .and_then(|file| {
            let mut line = String::new();
            // Longer than any heading.
            BufReader::new(file.take(4096)).read_line(&mut line)?;
            Ok(line)
        })
        .unwrap_or_default();
    heading.contains("intensity_cd")
}

/// True if light was converted: its losses have accounts of their own.
fn is_converted(model: &Value) -> bool {
    let accounts = model["power_ledger"].as_object();
    accounts.is_some_and(|all| all.keys().any(|account| account.ends_with(STOKES_LOSS)))
}

/// A flux above 0 under `pointer` of a model of `results.json`.
fn stated(model: &Value, pointer: &str) -> Option<f64> {
    let found = model.pointer(pointer).and_then(Value::as_f64);
    found.filter(|flux| flux.is_finite() && *flux > 0.0)
}

/// The model whose results directory this is, in `results.json` of the run; null where it is not there.
///
/// # Errors
/// A directory or a `results.json` that cannot be read.
pub fn model(directory: &Path) -> Result<Value> {
    let directory = directory.canonicalize()?;
    let names: Vec<_> = directory.iter().rev().take(2).collect();
    let found = || -> Option<Value> {
        let text = std::fs::read(directory.join("../..").join(FILE)).ok()?;
        let json: Value = serde_json::from_slice(&text).ok()?;
        let &[model, design] = names.as_slice() else {
            return None;
        };
        ["designs", "references"]
            .into_iter()
            .find_map(|group| json[group].get(design.to_str()?)?.get(model.to_str()?).cloned())
    };
    Ok(found().unwrap_or_default())
}

fn read_far_field(path: &Path) -> Result<Distribution> {
    let bytes = std::fs::read(path).context("expected the far field of a run, cannot read it")?;
    let (shape, values) = npy::read::<f64>(&bytes)?;
    let &[2, polar, azimuths] = shape.as_slice() else {
        bail!("expected the shape (2, polar, azimuths), got {shape:?}");
    };
    ensure!(polar > 0 && azimuths > 0, "expected the shape (2, polar, azimuths), got {shape:?}");
    let sphere =
        AngularBins { bin_deg: 180.0 / polar as f64, polar, azimuths, bins: BinPlacement::Between };
    let mut powers = Vec::with_capacity(polar * azimuths);
    for (number, value) in values[..polar * azimuths].iter().enumerate() {
        let i = number / azimuths;
        ensure!(
            value.is_finite() && *value >= 0.0,
            "value {number}: expected an intensity of 0 or more, got {value}"
        );
        powers.push(value * sphere.ring_sr(i) / azimuths as f64);
    }
    distribution(&powers, &sphere)
}
