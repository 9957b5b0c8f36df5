// SPDX-License-Identifier: MIT OR Apache-2.0
//! A folder of results as one page of HTML that needs nothing else: no network, no other file.
//!
//! In: a folder that [`folder`] has checked, and the tables that its hybrids list. Out: the text of
//! the page. Its template takes tables of numbers ([`tables`]) and pictures ([`pictures`]); what
//! its scripts read under the pointer or look up stands in the page as JSON, quantised where it is
//! large ([`pack`], [`models`], [`orders`]). The same folder gives the same bytes.

pub mod before_after;
pub mod film;
pub mod film_stack;
pub mod folder;
pub mod full_wave;
pub mod maps;
pub mod models;
pub mod optimisation;
pub mod orders;
pub mod pack;
pub mod package;
pub mod pictures;
pub mod scene_3d;
pub mod study;
pub mod tables;
pub mod tolerance;
pub mod verdict;
pub mod zones;

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Result, ensure};
use folder::{Folder, SealedFolder, is_one_of};
use maps::shared_range;
use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior};
use models::{Contents, FarFieldTable, Model, Plane};
use orders::Source;
use pictures::{Album, cuts, designs};
use serde_json::{Value, json};

use results::film_stack::FilmStackFile;
use results::full_wave::FullWaveFile;
use results::schema::DomeParts;
use results::sealed_file::SealedFile;
use results::study::StudyFile;
use results::tolerance::ToleranceResultsFile;
use results::zones::ZonesFile;
use runtime::provenance::FileRecord;

use super::paper_figures::{ELEMENTS, elements_picture};
use super::plots::{glow, palette};

/// Largest page in bytes.
pub const LIMIT: usize = 6_000_000;
/// Letters that all maps together may take; beyond that neighbouring bins are merged.
const MAPS_BUDGET: usize = 1_000_000;

/// Macros that every template begins with.
const MACROS: [&str; 3] = [
    include_str!("assets/macros.html"),
    include_str!("assets/tolerance.html"),
    include_str!("assets/full_wave.html"),
];
/// Template of the page of results.
const TEMPLATE: &str = include_str!("assets/page.html");
const STYLES: [&str; 6] = [
    include_str!("assets/base.css"),
    include_str!("assets/first.css"),
    include_str!("assets/parts.css"),
    include_str!("assets/pictures.css"),
    scene_3d::STYLE,
    include_str!("assets/print.css"),
];
const SCRIPTS: [&str; 12] = [
    scene_3d::ELEMENTS,
    include_str!("assets/core.js"),
    include_str!("assets/choice.js"),
    include_str!("assets/controls.js"),
    include_str!("assets/axes.js"),
    include_str!("assets/pictures.js"),
    include_str!("assets/far-field.js"),
    include_str!("assets/map.js"),
    scene_3d::WEBGL,
    scene_3d::VIEW,
    include_str!("assets/view_3d.js"),
    include_str!("assets/bsdf.js"),
];

/// A folder of which a page is made.
pub trait PageFolder {
    /// True if `path` is one of its files.
    fn holds(&self, path: &Path) -> bool;

    /// The page, with the tables that `source` holds.
    ///
    /// # Errors
    /// Results of another layout, files that cannot be drawn, a page beyond [`LIMIT`].
    fn page(&self, source: &Source) -> Result<Page>;
}

impl PageFolder for Folder {
    fn holds(&self, path: &Path) -> bool {
        is_one_of(self.directory(), &self.results().files, results::FILE, path)
    }

    fn page(&self, source: &Source) -> Result<Page> {
        page(self, source)
    }
}

/// A sealed file of which a page is made.
trait PageFile: SealedFile {
    /// Template of the page.
    const TEMPLATE: &'static str;
    /// Name of the version of the layout, where the page states it.
    const LAYOUT: Option<&'static str> = None;

    /// Name of what it shows, version of the program that wrote it, seed, and files that went in.
    fn head(&self) -> (&str, &str, u64, &[FileRecord]);

    /// Values of the template besides those of the head.
    fn values(folder: &SealedFolder<Self>, album: &mut Album) -> Result<Value>;
}

impl<T: PageFile> PageFolder for SealedFolder<T> {
    fn holds(&self, path: &Path) -> bool {
        is_one_of(self.directory(), self.file.files(), T::FILE, path)
    }

    fn page(&self, _: &Source) -> Result<Page> {
        let (name, version, seed, inputs) = self.file.head();
        let mut values = T::values(self, &mut Album::default())?;
        values["title"] = format!("batwing: {name}").into();
        values["style"] = style().into();
        values["version"] = version.into();
        values["seed"] = seed.into();
        let mut lines = vec![
            ("computed by", format!("batwing {version}")),
            ("page written by", format!("batwing {}", env!("CARGO_PKG_VERSION"))),
        ];
        lines.extend(T::LAYOUT.map(|name| (name, T::VERSION.to_string())));
        lines.push(("seed", seed.to_string()));
        values["provenance"] =
            json!({"lines": lines, "inputs": inputs, "files": self.file.files()});
        Ok(Page { html: rendered(T::TEMPLATE, &values, self.directory())?, tables: (0, 0) })
    }
}

/// The folder in `directory`: of results, beside which the others may stand, or of one of these.
///
/// # Errors
/// No results, results of another layout, a file that is missing or altered.
pub fn open(directory: &Path) -> Result<Box<dyn PageFolder>> {
    fn sealed<T: PageFile + 'static>(directory: &Path) -> Result<Option<Box<dyn PageFolder>>> {
        let folder = SealedFolder::<T>::open(directory)?;
        Ok(folder.map(|folder| Box::new(folder) as Box<dyn PageFolder>))
    }
    if !directory.join(results::FILE).exists() {
        let openers = [
            sealed::<ToleranceResultsFile>,
            sealed::<StudyFile>,
            sealed::<FullWaveFile>,
            sealed::<ZonesFile>,
            sealed::<FilmStackFile>,
        ];
        for open in openers {
            if let Some(folder) = open(directory)? {
                return Ok(folder);
            }
        }
    }
    Ok(Box::new(Folder::open(directory)?))
}

/// A page and what is in it.
#[derive(Debug)]
pub struct Page {
    /// The page.
    pub html: String,
    /// Number of tables found, and of those that the results list.
    pub tables: (usize, usize),
}

/// The page of `folder`, with the tables that `source` holds.
///
/// # Errors
/// Results of another layout, tables that are not the ones listed, a page beyond [`LIMIT`].
pub fn page(folder: &Folder, source: &Source) -> Result<Page> {
    let results = folder.results();
    let models = models::models(folder)?;
    models.iter().try_for_each(|model| model.complete(folder))?;
    let listed = orders::listed(&models, folder);
    let (orders, found) = orders::embed(&listed, source)?;
    let fields = models
        .iter()
        .map(|model| FarFieldTable::read(model, folder))
        .collect::<Result<Vec<_>>>()?;
    let mut maps =
        models.iter().map(|model| Plane::read(model, folder)).collect::<Result<Vec<_>>>()?;
    while maps.iter().map(Plane::letters).sum::<usize>() > MAPS_BUDGET {
        maps.iter_mut().for_each(Plane::halve);
    }
    let packages = models.iter().map(|model| model.package(folder));
    let packages = packages.collect::<Result<Vec<_>>>()?;
    let of = Contents { models: &models, fields: &fields, maps: &maps, packages: &packages };
    let views = models.iter().zip(&packages);
    let views = views
        .map(|(model, package)| package::view_3d(model, package.as_ref(), folder, models.len()));
    let views = views.collect::<Result<Vec<_>>>()?;
    let of_model = |((model, field), (map, view)): ((&Model, &FarFieldTable), (&Plane, &Value))| {
        json!({
            "design": model.design, "label": model.label(),
            "farField": field.to_json(), "map": map.to_json(shared_range(model, of)), "view3d": view,
        })
    };
    let of_models = models.iter().zip(&fields).zip(maps.iter().zip(&views));
    let data = json!({
        "models": of_models.map(of_model).collect::<Vec<_>>(),
        "fates": scene_3d::fates(),
        "orders": orders,
        "palette": palette(),
    });

    let (mut album, mut pictures) = (Album::default(), models::Pictures::new(folder));
    let [far, far_polar] = album.far_fields(of)?;
    let sections = album.sections(of);
    let [map, profile] = album.maps(of)?;
    let single = single_elements(&mut album, &results.parts)?;
    let mut labels: Vec<String> = models.iter().map(Model::label).collect();
    labels.sort();
    labels.dedup();
    let note = results.quick_note.as_deref().map(sentence);
    checked_note(folder)?;

    let search = optimisation::read(folder)?;
    let tolerance = SealedFolder::<ToleranceResultsFile>::open(folder.directory())?;
    let tolerance = tolerance.map(|found| tolerance::tolerance(&mut album, &found.file));
    let pictures_of_colours = pictures.of_colours(&models)?;
    let mut values = json!({
        "title": format!("batwing: {}", designs(&models)),
        "style": style(),
        "script": SCRIPTS.concat(),
        "data": script_json(&data),
        "version": results.program.version,
        "seeds": tables::seeds(&models, results.seed),
        "quick_note": note.filter(|_| results.quick),
        "models": models.iter().map(|m| [m.design.to_owned(), m.label()]).collect::<Vec<_>>(),
        "verdicts": models.iter().map(|m| verdict::verdict(m, search.as_ref())).collect::<Vec<_>>(),
        "labels": labels,
        "cuts": cuts(&fields),
        "overview": package::overview(of),
        "sections": sections,
        "has_view_3d": views.iter().any(|view| !view.is_null()),
        "fates": scene_3d::fates(),
        "spectra": tables::spectra(&models),
        "results": tables::results(&models),
        "others": tables::others(&models),
        "uniformity": tables::uniformity(&models),
        "receivers": tables::receivers(&models),
        "receiver_pictures": pictures.of_receivers(&models)?,
        "merit": album.merit(&models)?,
        "far": far,
        "far_polar": far_polar,
        "map": map,
        "profile": profile,
        "bsdf_note": bsdf_note(found, &orders),
        "tables_found": found.0,
        "tables_listed": found.1,
        "before_after": album.before_after(search.as_ref(), of)?,
        "optimisation": optimisation::optimisation(&mut album, search.as_ref(), &models)?,
        "tolerance": tolerance.transpose()?,
        "full_wave": full_wave::found(&mut album, folder.directory())?,
        "studies": album.studies(folder.directory())?,
        "table_errors": album.table_errors(&listed)?,
        "table_heads": tables::TABLE_HEADS,
        "tables": tables::orders(&listed),
        "losses": album.losses(&models)?,
        "ledger": tables::ledger(&models),
        "single": single,
        "provenance": tables::provenance(folder, &models),
    });
    values["map_words"] = maps::words(of).into();
    values["colours"] =
        json!({"tables": tables::colours(&models), "pictures": pictures_of_colours});
    Ok(Page { html: rendered(TEMPLATE, &values, folder.directory())?, tables: found })
}

impl PageFile for ToleranceResultsFile {
    const TEMPLATE: &'static str = include_str!("assets/tolerance_page.html");
    const LAYOUT: Option<&'static str> = Some("schema of tolerance.json");

    fn head(&self) -> (&str, &str, u64, &[FileRecord]) {
        (&self.name, &self.program.version, self.seed, &self.inputs)
    }

    fn values(folder: &SealedFolder<Self>, album: &mut Album) -> Result<Value> {
        Ok(json!({
            "tolerance": tolerance::tolerance(album, &folder.file)?,
            "full_wave": full_wave::found(album, folder.directory())?,
        }))
    }
}

impl PageFile for StudyFile {
    const TEMPLATE: &'static str = include_str!("assets/study_page.html");

    fn head(&self) -> (&str, &str, u64, &[FileRecord]) {
        (&self.name, &self.version, self.seed, &self.inputs)
    }

    fn values(folder: &SealedFolder<Self>, album: &mut Album) -> Result<Value> {
        Ok(json!({
            "study": study::study(album, &folder.file)?,
            "full_wave": full_wave::found(album, folder.directory())?,
        }))
    }
}

impl PageFile for FullWaveFile {
    const TEMPLATE: &'static str = include_str!("assets/full_wave_page.html");

    fn head(&self) -> (&str, &str, u64, &[FileRecord]) {
        (&self.design, &self.version, self.seed, &self.inputs)
    }

    fn values(folder: &SealedFolder<Self>, album: &mut Album) -> Result<Value> {
        Ok(json!({"full_wave": full_wave::full_wave(album, &folder.file)?}))
    }
}

impl PageFile for FilmStackFile {
    const TEMPLATE: &'static str = include_str!("assets/film_stack_page.html");

    fn head(&self) -> (&str, &str, u64, &[FileRecord]) {
        (&self.design, &self.version, self.seed, &self.inputs)
    }

    fn values(folder: &SealedFolder<Self>, album: &mut Album) -> Result<Value> {
        Ok(json!({"stack": film_stack::film_stack(album, &folder.file)?}))
    }
}

impl PageFile for ZonesFile {
    const TEMPLATE: &'static str = include_str!("assets/zones_page.html");

    fn head(&self) -> (&str, &str, u64, &[FileRecord]) {
        (&self.design, &self.version, self.seed, &self.inputs)
    }

    fn values(folder: &SealedFolder<Self>, album: &mut Album) -> Result<Value> {
        Ok(json!({"zones": zones::zones(album, folder)?, "film": film::film(album, folder)?}))
    }
}

/// The note on a quick run as a sentence that does not begin with its own heading.
fn sentence(note: &str) -> String {
    let text = note.strip_prefix("quick run: ").unwrap_or(note).trim_end_matches('.');
    let mut letters = text.chars();
    let first = letters.next().map(char::to_uppercase);
    first.into_iter().flatten().chain(letters).chain(['.']).collect()
}

fn style() -> String {
    palette::style_sheet() + &STYLES.concat()
}

/// Style of tables and pictures, for other pages that hold them.
pub fn style_of_pictures() -> String {
    let [base, _, parts, pictures, ..] = STYLES;
    palette::style_sheet() + base + parts + pictures
}

/// The page that `template` makes of `values`, of the results in `directory`.
fn rendered(template: &str, values: &Value, directory: &Path) -> Result<String> {
    let template = MACROS.concat() + template;
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.add_template("page.html", &template)?;
    let template = environment.get_template("page.html")?;
    // The template engine drops the last newline.
    let html = template.render(Serde(values))? + "\n";
    ensure!(
        html.len() <= LIMIT,
        "`{}`: the page would take {} bytes, more than {LIMIT}; results of fewer designs at a time take less",
        directory.display(),
        html.len()
    );
    Ok(html)
}

/// Refuses a quick run that does not say what that means.
fn checked_note(folder: &Folder) -> Result<()> {
    let results = folder.results();
    ensure!(
        !results.quick || results.quick_note.is_some(),
        "{}: expected a value, got none",
        folder.place("quick_note")
    );
    Ok(())
}

/// Pictures of the paper's Figures 3, 4 and 6.
fn single_elements(album: &mut Album, parts: &DomeParts) -> Result<Vec<Value>> {
    let mut single = Vec::new();
    for (figure, words) in [&parts.elements, &parts.shapes].into_iter().zip(ELEMENTS) {
        if let Some(figure) = figure {
            let picture = elements_picture(figure, words)?;
            let words = words.join("; ");
            let caption = format!("{words}; azimuthal means with two standard errors.");
            single.push(album.fixed(&picture, &caption));
        }
    }
    if let Some(figure) = &parts.ring {
        single.push(album.lobes(figure)?);
    }
    Ok(single)
}

/// `value` as JSON that may stand within a `script` element: nothing in it can end the element or
/// begin a comment.
fn script_json(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// Colours of maps from the least to the largest share, six hexadecimal digits each.
fn palette() -> String {
    let mut text = String::new();
    for step in 0..=u8::MAX {
        let [r, g, b] = glow(f64::from(step) / 255.0).rgb;
        let _ = write!(text, "{r:02x}{g:02x}{b:02x}");
    }
    text
}

/// Sentence on the part of the tables that the page holds.
fn bsdf_note((found, listed): (usize, usize), json: &Value) -> String {
    let missing = match listed - found {
        0 => String::new(),
        count => format!(" {count} of {listed} tables were not found and are left out."),
    };
    let every = |stride: &Value| match stride.as_i64() {
        None | Some(1) => "every node of kx".to_owned(),
        Some(stride) => format!("one node of kx in {stride}"),
    };
    let mut kept = format!("the lowest ky with {}", every(&json["stride"]));
    if let Some(more @ 1..) = json["moreKy"].as_u64() {
        let _ = write!(kept, ", {more} more ky with {}", every(&json["moreStride"]));
    }
    format!(
        "In this page: {found} tables, {kept}; both sides, s and p. Roots of shares are kept in 16 bits: a share x is exact to √x / 65 535.{missing}"
    )
}

#[cfg(test)]
mod tests;
