// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scripts of a job for SLURM: an array of its shards, and the merge after it.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use runtime::{atomic_file, program};

use super::job_record::{JobRecord, shell_line};
use super::outputs::refuse_control;

/// Folder of the scripts and of what the tasks say, in the directory of results.
const FOLDER: &str = "slurm";

/// The script of the array of shards of the job in `out`.
pub fn script_of_shards(out: &Path) -> PathBuf {
    out.join(FOLDER).join("shards.sh")
}

/// True where the script in `out` is that of an array of `shards` shards.
pub fn is_script_of(shards: usize, out: &Path) -> bool {
    let text = std::fs::read_to_string(script_of_shards(out));
    text.is_ok_and(|text| text.contains(&choice_of_task(shards)))
}

/// The option `--shard` of a task of the array.
fn choice_of_task(shards: usize) -> String {
    format!("--shard \"$SLURM_ARRAY_TASK_ID/{shards}\"")
}

/// The script of its merge.
fn script_of_merge(out: &Path) -> PathBuf {
    out.join(FOLDER).join("merge.sh")
}

/// Writes both scripts; `options` are further options of sbatch.
///
/// # Errors
/// Options that are no single line, files that cannot be written.
pub fn write_scripts(record: &JobRecord, out: &Path, options: Option<&str>) -> Result<()> {
    let options = options.unwrap_or_default();
    ensure!(
        !options.contains(['\n', '\r']),
        "--sbatch: expected options on one line, got {options:?}"
    );
    // A line break would end the comment that holds an option of sbatch.
    for path in [out, record.directory.as_path()] {
        refuse_control("path of the job", path)?;
    }
    let program = shell_line(&program::current()?.words);
    let last = record.shards - 1;
    let shard = choice_of_task(record.shards);
    let words = shell_line(&record.words_in(out));
    let shards = format!("{program} {words} {shard}");
    let array = format!("#SBATCH --array=0-{last}\n");
    let merge = format!("{program} merge {}", shell_line(&[out.into()]));
    write(&script_of_shards(out), record, out, &[&array, options, "%A_%a", &shards])?;
    write(&script_of_merge(out), record, out, &["", options, "merge_%j", &merge])
}

fn write(
    path: &Path,
    record: &JobRecord,
    out: &Path,
    [array, options, log, command]: &[&str; 4],
) -> Result<()> {
    let log = out.join(FOLDER).join(format!("{log}.log"));
    let options = if options.is_empty() { String::new() } else { format!("#SBATCH {options}\n") };
    let text = format!(
        "#!/bin/sh\n#SBATCH --job-name=batwing\n{array}#SBATCH --output={}\n#SBATCH --chdir={}\n{options}\
         exec {command} --threads \"${{SLURM_CPUS_PER_TASK:-1}}\" --quiet\n",
        shell_line(&[log.into()]),
        shell_line(&[record.directory.clone().into()]),
    );
    atomic_file::write_bytes(path, text.as_bytes())
}

/// Submits both scripts; returns the numbers of the array and of the merge, which begins once all
/// tasks of the array have ended, however they did.
///
/// # Errors
/// Errors of sbatch.
pub fn submit(out: &Path) -> Result<[String; 2]> {
    let array = sbatch(&[], &script_of_shards(out))?;
    let after = format!("--dependency=afterany:{array}");
    let merge = sbatch(&[&after], &script_of_merge(out))?;
    Ok([array, merge])
}

fn sbatch(options: &[&str], script: &Path) -> Result<String> {
    let output = Command::new("sbatch")
        .arg("--parsable")
        .args(options)
        .arg(script)
        .output()
        .context("--go: expected the program `sbatch` of SLURM")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "sbatch: {}", said.trim());
    // With several clusters, the name of one follows.
    let number = String::from_utf8_lossy(&output.stdout);
    let number = number.trim().split(';').next().unwrap_or_default();
    Ok(number.to_owned())
}

/// Command that submits both by hand.
pub fn by_hand(out: &Path) -> String {
    let line = |script: PathBuf| shell_line(&[script.into()]);
    let (shards, merge) = (line(script_of_shards(out)), line(script_of_merge(out)));
    format!("sbatch --dependency=afterany:$(sbatch --parsable {shards}) {merge}")
}
