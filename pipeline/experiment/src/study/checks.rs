// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks of a study file against the designs of its base.

use anyhow::{Context, Result, ensure};

use design::Design;
use design::resolved::check_paths;
use simulate::model::Model;
use simulate::observation::check_figure;

use super::file::{Probe, StudyFile};
use super::targets::Targets;
use crate::checked_file::is_file_name;
use crate::design_file::DesignFile;

/// Checks name, models, designs and paths.
pub(super) fn head(file: &StudyFile, paths: Option<u64>) -> Result<()> {
    ensure!(
        is_file_name(&file.name),
        "name: expected letters, digits, '-', '_' and '.', got {:?}",
        file.name
    );
    ensure!(!file.models.is_empty(), "models: expected at least one, got none");
    ensure!(!file.designs.is_empty(), "designs: expected at least one file, got none");
    if let Some(paths) = paths {
        check_paths("paths", paths)?;
    }
    Ok(())
}

/// Checks that designs have different names, which tell results apart.
pub(super) fn sources(sources: &[DesignFile]) -> Result<()> {
    for (number, source) in sources.iter().enumerate() {
        let twice = sources[..number].iter().find(|s| s.name == source.name);
        ensure!(
            twice.is_none(),
            "designs: expected a name of its own for each, got {:?} twice, the second time in `{}`",
            source.name,
            source.path.display()
        );
    }
    Ok(())
}

/// Checks targets: each target in the study itself, and at least one of a shared file, belongs to a
/// trace of the study.
pub(super) fn targets(
    file: &StudyFile,
    figures: &Targets,
    designs: &[Design],
    models: &[Model],
) -> Result<()> {
    let traced = |design: &str, model: &str| {
        let design = designs.iter().find(|d| d.name == design);
        design.is_some_and(|d| models.iter().any(|m| m.key(d) == model))
    };
    let known = || {
        let all = designs.iter().flat_map(|d| {
            let of = move |m: &Model| format!("{}.{}", d.name, m.key(d));
            models.iter().map(of)
        });
        all.collect::<Vec<_>>().join(", ")
    };
    let named = || {
        let designs = figures.figures.iter();
        designs.flat_map(|(design, of)| of.keys().map(move |model| (design, model)))
    };
    if file.targets.is_some() {
        for (design, model) in named() {
            ensure!(
                traced(design, model),
                "targets.{design}.{model}: expected a design and a model of the study: {}",
                known()
            );
            let of_design = designs.iter().filter(|known| known.name == *design);
            for (checked, key) in of_design.flat_map(|checked| {
                figures.figures[design][model].keys().map(move |key| (checked, key))
            }) {
                check_figure(checked, key)
                    .with_context(|| format!("targets.{design}.{model}.{key}"))?;
            }
        }
        ensure!(named().next().is_some(), "targets: expected at least one target, got none");
    }
    ensure!(
        file.targets_file.is_none() || named().any(|(design, model)| traced(design, model)),
        "targets_file: expected a target of one of {}, got none",
        known()
    );
    Ok(())
}

/// Checks that every design has the models of the study.
pub(super) fn designs(designs: &[Design], models: &[Model]) -> Result<()> {
    for design in designs {
        for model in models {
            model.available(design).context("models")?;
        }
    }
    Ok(())
}

/// Checks element, ranges of angles, target and scale of a probe.
pub(super) fn probe(probe: &Probe, designs: &[Design]) -> Result<()> {
    let design = designs.iter().find(|d| d.name == probe.design);
    let elements = design.map_or(0, |d| d.elements.shapes.len());
    ensure!(
        (1..=elements).contains(&probe.element),
        "probes: expected an element of a design of the study, got element {} of {:?}",
        probe.element,
        probe.design
    );
    let angles: Vec<f64> = probe.ranges_deg.iter().flat_map(|range| range.0).collect();
    let rising = angles.chunks(2).all(|r| r[0] < r[1]) && angles.is_sorted();
    ensure!(
        rising && angles.iter().all(|a| (0.0..=180.0).contains(a)) && !angles.is_empty(),
        "probes.ranges_deg: expected ranges of angles from 0 to 180 degrees, one after the other, got {:?}",
        probe.ranges_deg
    );
    if let Some(target) = probe.target {
        ensure!(
            (0.0..=1.0).contains(&target),
            "probes.target: expected a share from 0 to 1, got {target}"
        );
    }
    ensure!(
        probe.scale.is_finite() && probe.scale > 0.0,
        "probes.scale: expected a number above 0, got {}",
        probe.scale
    );
    Ok(())
}
