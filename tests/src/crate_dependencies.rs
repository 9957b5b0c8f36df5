// SPDX-License-Identifier: MIT OR Apache-2.0
//! Dependencies between the crates of the workspace, read from its manifests.
//!
//! Solver, tables and tracer know nothing of each other, so that a table may come from a
//! measurement or from another solver; pictures are drawn from results. Dependencies of benches
//! and builds obey the same table. Versions are pinned once, in the workspace.

use toml::{Table, Value};

/// The Python package, which cargo builds where it is named, since it needs Python.
pub const PYTHON: &str = "pipeline/python";

/// Packages of the workspace by folder, and the packages of ours that each may use.
pub const ALLOWED: [(&str, &str, &[&str]); 19] = [
    ("rcwa", "batwing-rcwa", &[]),
    ("bsdf", "batwing-bsdf", &[]),
    ("tracer", "batwing-tracer", &["batwing-bsdf"]),
    ("pipeline/search", "batwing-search", &["batwing-tracer"]),
    ("pipeline/full_wave", "batwing-full-wave", &[]),
    ("pipeline/section", "batwing-section", &FOR_SECTION),
    ("pipeline/metrics", "batwing-metrics", &["batwing-tracer"]),
    ("pipeline/geometry", "batwing-geometry", &["batwing-tracer"]),
    ("pipeline/files", "batwing-files", &FOR_FILES),
    ("pipeline/design", "batwing-design", &FOR_DESIGN),
    ("pipeline/results", "batwing-results", &FOR_RESULTS),
    ("pipeline/simulate", "batwing-simulate", &FOR_SIMULATE),
    ("pipeline/report", "batwing-report", &FOR_REPORT),
    ("pipeline/output", "batwing-output", &FOR_OUTPUT),
    ("pipeline/experiment", "batwing-experiment", &FOR_EXPERIMENT),
    ("pipeline/explore", "batwing-explore", &FOR_EXPLORE),
    ("pipeline", "batwing", &FOR_BINARY),
    (PYTHON, "batwing-python", &FOR_ALL),
    ("tests", "batwing-tests", &FOR_ALL),
];

const FOR_FILES: [&str; 4] =
    ["batwing-bsdf", "batwing-tracer", "batwing-metrics", "batwing-geometry"];
const FOR_DESIGN: [&str; 6] = [
    "batwing-rcwa",
    "batwing-bsdf",
    "batwing-tracer",
    "batwing-metrics",
    "batwing-geometry",
    "batwing-files",
];
const FOR_RESULTS: [&str; 5] =
    ["batwing-bsdf", "batwing-tracer", "batwing-metrics", "batwing-files", "batwing-design"];
const FOR_SIMULATE: [&str; 8] = [
    "batwing-rcwa",
    "batwing-bsdf",
    "batwing-tracer",
    "batwing-metrics",
    "batwing-geometry",
    "batwing-files",
    "batwing-design",
    "batwing-results",
];
/// Three models of one section, of which full wave knows nothing of the others.
const FOR_SECTION: [&str; 6] = [
    "batwing-rcwa",
    "batwing-bsdf",
    "batwing-geometry",
    "batwing-results",
    "batwing-simulate",
    "batwing-full-wave",
];
/// Pictures are drawn from results: nothing is simulated for them.
const FOR_REPORT: [&str; 5] =
    ["batwing-bsdf", "batwing-metrics", "batwing-files", "batwing-design", "batwing-results"];
const FOR_EXPERIMENT: [&str; 8] = [
    "batwing-tracer",
    "batwing-search",
    "batwing-metrics",
    "batwing-geometry",
    "batwing-files",
    "batwing-design",
    "batwing-results",
    "batwing-simulate",
];
const FOR_OUTPUT: [&str; 7] = [
    "batwing-tracer",
    "batwing-metrics",
    "batwing-files",
    "batwing-design",
    "batwing-results",
    "batwing-simulate",
    "batwing-report",
];
const FOR_EXPLORE: [&str; 7] = [
    "batwing-metrics",
    "batwing-files",
    "batwing-design",
    "batwing-results",
    "batwing-simulate",
    "batwing-report",
    "batwing-output",
];
const FOR_BINARY: [&str; 16] = [
    "batwing-rcwa",
    "batwing-bsdf",
    "batwing-tracer",
    "batwing-full-wave",
    "batwing-section",
    "batwing-search",
    "batwing-metrics",
    "batwing-geometry",
    "batwing-files",
    "batwing-design",
    "batwing-results",
    "batwing-simulate",
    "batwing-report",
    "batwing-output",
    "batwing-experiment",
    "batwing-explore",
];
const FOR_ALL: [&str; 17] = [
    "batwing-rcwa",
    "batwing-bsdf",
    "batwing-tracer",
    "batwing-full-wave",
    "batwing-section",
    "batwing-search",
    "batwing-metrics",
    "batwing-geometry",
    "batwing-files",
    "batwing-design",
    "batwing-results",
    "batwing-simulate",
    "batwing-report",
    "batwing-output",
    "batwing-experiment",
    "batwing-explore",
    "batwing",
];

/// The one further dependency that is allowed to tests: package, section, what it may use. Only
/// tests of package `batwing` learn from cargo where the binary lies.
const ALLOWED_IN_TESTS: (&str, &str, &str) = ("batwing", "dev-dependencies", "batwing-tests");

/// One dependency of a manifest.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependency {
    /// Key in the manifest.
    pub key: String,
    /// Name of the package, renaming undone.
    pub package: String,
    /// Section it stands in, such as `dev-dependencies`.
    pub section: String,
    /// Whether it is taken from the workspace's list.
    pub from_workspace: bool,
}

/// All dependencies of a manifest: normal, dev, build, and those of single targets.
pub fn dependencies(manifest: &Table, workspace: &Table) -> Vec<Dependency> {
    let mut found = sections("", manifest, workspace);
    for (target, table) in manifest.get("target").and_then(Value::as_table).into_iter().flatten() {
        if let Some(table) = table.as_table() {
            found.extend(sections(&format!("target.{target}."), table, workspace));
        }
    }
    found
}

fn sections(prefix: &str, table: &Table, workspace: &Table) -> Vec<Dependency> {
    let mut found = Vec::new();
    for section in ["dependencies", "dev-dependencies", "build-dependencies"] {
        for (key, value) in table.get(section).and_then(Value::as_table).into_iter().flatten() {
            let from_workspace = value.get("workspace").and_then(Value::as_bool) == Some(true);
            let definition = if from_workspace {
                shared(workspace).and_then(|list| list.get(key))
            } else {
                Some(value)
            };
            found.push(Dependency {
                key: key.clone(),
                package: package(key, definition),
                section: format!("{prefix}{section}"),
                from_workspace,
            });
        }
    }
    found
}

/// The name of the package that a dependency called `key` means.
fn package(key: &str, definition: Option<&Value>) -> String {
    let text = |name: &str| {
        definition.and_then(|d| d.get(name)).and_then(Value::as_str).map(str::to_owned)
    };
    let by_path = || {
        let path = text("path")?;
        let folder = path.trim_end_matches('/').rsplit('/').next()?;
        ALLOWED
            .iter()
            .find(|member| member.0.rsplit('/').next() == Some(folder))
            .map(|member| member.1.to_owned())
    };
    text("package").or_else(by_path).unwrap_or_else(|| key.to_owned())
}

/// The workspace's list of dependencies.
pub fn shared(workspace: &Table) -> Option<&Table> {
    workspace.get("workspace")?.get("dependencies").and_then(Value::as_table)
}

/// Arrows that break the table.
pub fn forbidden(manifest: &Table, workspace: &Table) -> Vec<String> {
    let name = name(manifest);
    let Some((_, _, allowed)) = ALLOWED.iter().find(|member| member.1 == name) else {
        return vec![format!("{name}: is in no row of the table of crates")];
    };
    let ours = |package: &str| ALLOWED.iter().any(|member| member.1 == package);
    dependencies(manifest, workspace)
        .into_iter()
        .filter(|d| ours(&d.package) && !allowed.contains(&d.package.as_str()))
        .filter(|d| (&*name, &*d.section, &*d.package) != ALLOWED_IN_TESTS)
        .map(|d| format!("{name}: {} must not name {}", d.section, d.package))
        .collect()
}

/// Dependencies that are not taken from the workspace's list, and lints that are not.
pub fn not_inherited(manifest: &Table, workspace: &Table) -> Vec<String> {
    let name = name(manifest);
    let mut found: Vec<String> = dependencies(manifest, workspace)
        .into_iter()
        .filter(|d| !d.from_workspace)
        .map(|d| format!("{name}: {} of {} is not the workspace's", d.section, d.key))
        .collect();
    let lints = manifest.get("lints").and_then(|l| l.get("workspace")).and_then(Value::as_bool);
    if lints != Some(true) {
        found.push(format!("{name}: lints are not the workspace's"));
    }
    found
}

/// External dependencies of the workspace whose version neither the list nor the lock file fixes.
pub fn unpinned(workspace: &Table, lock: &Table) -> Vec<String> {
    let locked = |name: &str, wanted: &str| {
        lock.get("package")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .filter(|p| p.get("name").and_then(Value::as_str) == Some(name))
            .filter_map(|p| p.get("version").and_then(Value::as_str))
            .any(|version| version == wanted || version.starts_with(&format!("{wanted}.")))
    };
    let mut found = Vec::new();
    for (key, value) in shared(workspace).into_iter().flatten() {
        if value.get("path").is_some() {
            continue;
        }
        let version = value.as_str().or_else(|| value.get("version").and_then(Value::as_str));
        let Some(version) = version else {
            found.push(format!("{key}: has no version"));
            continue;
        };
        let number = version.trim_start_matches('=');
        let plain = !number.is_empty() && number.chars().all(|c| c.is_ascii_digit() || c == '.');
        if !plain {
            found.push(format!("{key}: `{version}` is no version but a range"));
        } else if !locked(&package(key, Some(value)), number) {
            found.push(format!("{key}: the lock file has no version {version}"));
        }
    }
    found
}

/// The name of the package of a manifest.
pub fn name(manifest: &Table) -> String {
    let name = manifest.get("package").and_then(|p| p.get("name"));
    name.and_then(Value::as_str).unwrap_or("(a manifest without a name)").to_owned()
}
