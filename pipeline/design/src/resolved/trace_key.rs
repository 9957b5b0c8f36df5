// SPDX-License-Identifier: MIT OR Apache-2.0
//! Dependencies of the traces of a design, by name: from this follow the keys under which finished
//! traces and groups of paths are stored.
//!
//! Every struct of the design is taken apart without `..`, so that a new field does not compile
//! before it is listed here as one that changes a trace or as one that does not. What a design
//! holds beside its fields as written follows from them, and is left out:
//!
//! - `Medium::stated`, `Films::stated` and `CheckedSolid::surface` give indices and reflectors at
//!   other wavelengths. Index, absorption and scattering at the wavelength of the trace are fields
//!   of their own; a trace of many wavelengths depends on the tables as written and on the content
//!   of the files that they name, whose hashes are listed.
//! - Forms, symmetries, detectors, emitters and lights follow from the tables as written and from
//!   the same hashes. Only the weights of emitters are listed, which say what shines.

use serde_json::{Value, json};

use geometry::Meridian;
use geometry::profile::{Elements, Rounding, SphericalDome};
use runtime::provenance::{FileRecord, Provenance};

use super::array::{Array, PackagePositions};
use super::at_wavelength::LitSources;
use super::dome::{Dome, DomeMesh};
use super::files::{Files, UsedFile};
use super::led::{BoxPlace, Led};
use super::medium::Medium;
use super::panel::SubPixel;
use super::receivers::CheckedReceiver;
use super::solids::CheckedSolid;
use super::sources::CheckedSource;
use super::{Design, Housing, Mirror};
use crate::schema::{self, FilmTracing, is_default};

/// Takes a struct apart and lists the fields before `;` by name; those after it change no trace.
macro_rules! fields {
    ($value:expr => $type:path { $($listed:ident),* $(; $($omitted:ident),*)? }) => {{
        let $type { $($listed,)* $($($omitted: _),*)? } = $value;
        json!({ $(stringify!($listed): $listed),* })
    }};
}

/// Optical surface of the dome, by which it depends on the settings of `[hybrid]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReliefModel {
    /// The elements themselves.
    Elements,
    /// The elements in steps of the rings' width.
    Rings,
    /// Bands that scatter by tables of ray optics.
    RayTables,
    /// Bands that scatter by tables of diffraction orders.
    OrderTables,
}

impl Design {
    /// Names and values of all fields on which a trace depends.
    pub fn trace_fields(&self, relief: ReliefModel) -> Value {
        let Self {
            name: _,
            description: _,
            provenance,
            dome,
            elements,
            silicone,
            mirror,
            led,
            array,
            housing,
            wavelength_nm,
            spectrum,
            converts_in_lumens,
            lights: _,
            // Readings are scaled where they are written.
            emitted: _,
            // Which models there are, not what one of them is.
            without_bands: _,
            lit,
            receiver,
            far_field,
            receivers,
            sources,
            solids,
            prints,
            // Light meets it after all else, but what is kept of converted light is weighted by its filters.
            panel: _,
            hybrid,
            trace,
            files,
            films,
            step_nm,
            polarization,
        } = self;
        let coated = films.is_some() || solids.iter().any(CheckedSolid::is_coated);
        // Rays depend on indices, which are listed, and not on the wavelength by itself.
        let by_wavelength = relief == ReliefModel::OrderTables || coated;
        let mut fields = json!({
            "named_files": named_files(provenance),
            "dome": dome.as_ref().map(dome_fields),
            "elements": element_fields(elements),
            "silicone": medium_fields(silicone),
            "mirror": fields!(mirror => Mirror { reflector, extent }),
            "led": led_fields(led),
            "array": array_fields(array),
            "housing": housing.as_ref().map(housing_fields),
            "wavelength_nm": by_wavelength.then_some(wavelength_nm),
            "spectrum": spectrum,
            "shared_by_nm": lit.as_ref().map(|LitSources { sources: _, shared_by_nm }| shared_by_nm),
            "receiver": fields!(receiver => schema::Receiver {
                plane_height_mm, bin_mm, smoothing_sigma_mm, margin_mm, average;
                read_bin_mm, full_scale, zero, area_mm, area_centre_mm, spot_mm
            }),
            "far_field": fields!(far_field => schema::FarFieldReceiver {
                bin_deg, azimuth_bin_deg;
                centre_deg, peak, peak_fit_deg, read_bin_deg, read_bins, cut_deg
            }),
            "receivers": receivers.iter().map(receiver_fields).collect::<Vec<_>>(),
            "sources": sources.iter().map(source_fields).collect::<Vec<_>>(),
            "solids": solids.iter().map(solid_fields).collect::<Vec<_>>(),
            "hybrid": hybrid_fields(hybrid, relief),
            "trace": fields!(trace => schema::Trace {
                paths, max_interactions, sampling, ledger_by_source; films
            }),
            "files": files_fields(files),
            "films": films,
            "polarization": polarization,
        });
        // Other designs have the fields of those that cannot say otherwise.
        if !prints.is_empty() {
            fields["prints"] = json!(prints);
        }
        if trace.films == FilmTracing::Table && solids.iter().any(CheckedSolid::is_film) {
            fields["trace"]["films"] = json!(trace.films);
        }
        if self.converts() {
            let nodes = self.traced_nm();
            let emitted = self.emitted_at(&nodes);
            fields["converted"] =
                json!({"step_nm": step_nm, "nm": nodes, "emitted": emitted, "photons": true});
            // What is kept of a trace is weighted.
            let rows = |of: &SubPixel| json!([of.wavelength_nm, of.transmittance]);
            if !self.sub_pixels().is_empty() {
                fields["converted"]["filters"] = self.sub_pixels().iter().map(rows).collect();
            }
            if *converts_in_lumens {
                fields["converted"]["lumens"] = json!(true);
            }
            if relief == ReliefModel::OrderTables {
                fields["converted"]["tables_nm"] = json!(self.tables_nm());
            }
        }
        fields
    }

    /// Names and values of all fields on which outcomes of a table of the films depend, beside the
    /// heights of films and what media are at several wavelengths.
    pub fn film_fields(&self) -> Value {
        let films = self.solids.iter().filter(|solid| solid.is_film()).map(|film| {
            let CheckedSolid { stated_faces, medium, face_coats, files, .. } = film;
            json!({
                "name": film.name(),
                "faces": stated_faces,
                "medium": medium.as_ref().map(medium_fields),
                "coats": face_coats,
                "files": files.iter().map(hash).collect::<Vec<_>>(),
            })
        });
        json!({
            "films": films.collect::<Vec<_>>(),
            "wavelength_nm": self.wavelength_nm,
            "polarization": self.polarization,
            "max_interactions": self.trace.max_interactions,
        })
    }

    /// Names and values of the fields that say how figures are read from a trace.
    pub fn reading_fields(&self) -> Value {
        json!({
            "receiver": fields!(&self.receiver => schema::Receiver {
                read_bin_mm, full_scale, zero, area_mm, area_centre_mm, spot_mm;
                plane_height_mm, bin_mm, smoothing_sigma_mm, margin_mm, average
            }),
            "far_field": fields!(&self.far_field => schema::FarFieldReceiver {
                centre_deg, peak, peak_fit_deg, read_bin_deg, read_bins, cut_deg;
                bin_deg, azimuth_bin_deg
            }),
        })
    }
}

fn named_files(provenance: &Provenance) -> Vec<&str> {
    // A design's own text is what all other fields were made of, and files of the panel are in its rows.
    let Provenance { file: _, sha256: _, named, of_panel: _ } = provenance;
    named.iter().map(hash).collect()
}

fn hash(FileRecord { file: _, sha256 }: &FileRecord) -> &str {
    sha256
}

fn dome_fields(dome: &Dome) -> Value {
    match dome {
        Dome::Sphere(sphere) => fields!(sphere => SphericalDome {
            sphere_radius_mm, height_mm, radius_mm
        }),
        Dome::Meridian(meridian) => fields!(meridian => Meridian { pieces }),
        Dome::Mesh(mesh) => {
            let mut fields = fields!(mesh.as_ref() => DomeMesh {
                sha256, height_mm, radius_mm;
                smooth_deg, file, triangles, deviation, shape
            });
            // Flat faces have the fields of designs that cannot say otherwise.
            if let Some(smooth_deg) = mesh.smooth_deg {
                fields["smooth_deg"] = json!(smooth_deg);
            }
            fields
        }
    }
}

/// A medium that does not scatter and whose absorption is one number has the fields of designs that
/// cannot say otherwise.
fn medium_fields(medium: &Medium) -> Value {
    let mut fields = fields!(medium => Medium {
        index, absorption_per_mm; scattering, luminophores, stated
    });
    if let Some(scattering) = &medium.scattering {
        fields["scattering"] = json!(scattering);
    }
    if let Some(stated) = &medium.stated.spectral {
        fields["stated"] = json!(stated);
    }
    fields
}

/// Sharp relief has the fields of designs that cannot say otherwise.
fn element_fields(elements: &Elements) -> Value {
    let mut fields = fields!(elements => Elements { width_mm, shapes; rounding });
    let Rounding { tip_mm, valley_mm } = elements.rounding;
    if !elements.rounding.is_sharp() {
        fields["tip_mm"] = json!(tip_mm);
        fields["valley_mm"] = json!(valley_mm);
    }
    fields
}

/// A box that stands level about the axis has the fields of designs that cannot say otherwise.
fn led_fields(led: &Led) -> Value {
    let mut fields = fields!(led => Led {
        size_mm, height_mm, reflector; sides, offset_mm, tilt_deg, offsets_mm, tilts_deg
    });
    if let Some(sides) = led.sides {
        fields["sides"] = json!(sides);
    }
    if !led.is_centred() {
        let places = led.stated_places();
        let (offsets, tilts): (Vec<[f64; 2]>, Vec<[f64; 2]>) =
            places.map(|BoxPlace { offset_mm, tilt_deg }| (offset_mm, tilt_deg)).unzip();
        fields["offsets_mm"] = json!(offsets);
        fields["tilts_deg"] = json!(tilts);
    }
    fields
}

/// Packages at full drive have the fields of designs that cannot say otherwise.
fn array_fields(array: &Array) -> Value {
    let Array {
        positions,
        pitch_mm,
        crossing,
        drives,
        offsets_mm,
        turns_deg: _,
        scales: _,
        stated_scales: _,
    } = array;
    let positions = match positions {
        PackagePositions::Grid { columns, rows, arrangement } => {
            json!({"columns": columns, "rows": rows, "arrangement": arrangement})
        }
        PackagePositions::List { positions_mm, .. } => json!(positions_mm),
    };
    let mut fields = json!({"positions": positions, "pitch_mm": pitch_mm, "crossing": crossing});
    if let Some(drives) = drives {
        fields["drives"] = json!(drives);
    }
    if array.is_offset() {
        fields["offsets_mm"] = json!(offsets_mm);
    }
    if array.is_turned() {
        let turns = (0..array.count()).map(|package| array.turn_deg(package));
        fields["turns_deg"] = json!(turns.collect::<Vec<f64>>());
    }
    if array.is_scaled() {
        let scales = (0..array.count()).map(|package| array.scale(package));
        fields["scales"] = json!(scales.collect::<Vec<f64>>());
    }
    fields
}

fn housing_fields(housing: &Housing) -> Value {
    fields!(housing => Housing { distance_mm, inner_size_mm, height_mm, thickness_mm, reflector, floor })
}

fn receiver_fields(receiver: &CheckedReceiver) -> Value {
    fields!(receiver => CheckedReceiver { stated; detector })
}

fn source_fields(source: &CheckedSource) -> Value {
    let CheckedSource { stated, file_sha256, emitters, symmetry: _ } = source;
    let weights: Vec<f64> = emitters.iter().map(|emitter| emitter.source.weight).collect();
    json!({"stated": stated, "file_sha256": file_sha256, "weights": weights})
}

fn solid_fields(solid: &CheckedSolid) -> Value {
    let CheckedSolid {
        table: _,
        stated,
        stated_faces,
        medium,
        coats,
        face_coats,
        files,
        form,
        symmetry: _,
        surface: _,
    } = solid;
    let mut fields = json!({
        "stated": stated,
        "faces": stated_faces,
        "medium": medium.as_ref().map(medium_fields),
        "coats": coats,
        "files": files.iter().map(hash).collect::<Vec<_>>(),
        // A package that is traced by itself moves the solids of the array.
        "origin_mm": form.placement.origin.to_array(),
    });
    // Solids without such faces have the fields of designs that cannot say otherwise.
    if !is_default(face_coats) {
        fields["face_coats"] = json!(face_coats);
    }
    fields
}

fn hybrid_fields(hybrid: &schema::Hybrid, relief: ReliefModel) -> Value {
    match relief {
        ReliefModel::Elements => Value::Null,
        ReliefModel::Rings => json!({"element_width_um": hybrid.element_width_um}),
        ReliefModel::RayTables | ReliefModel::OrderTables => fields!(hybrid => schema::Hybrid {
            element_width_um, rings_per_band, representative, kx_per_zone, ky_count, tolerance,
            orders, stairs_um, tables, polarization;
            memory_gib, tables_nm
        }),
    }
}

fn files_fields(files: &Files) -> Value {
    let used = |used: &UsedFile| fields!(used => UsedFile { sha256; file, flux_used });
    let shares: Vec<f64> = files.parts().iter().map(|part| part.share).collect();
    let Files { stated, used: all, bands: _, mirror: _, mirror_turns: _, source: _ } = files;
    let all: Vec<Value> = all.iter().map(used).collect();
    json!({"stated": stated, "used": all, "shares": shares})
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::prints::CheckedPrint;
    use super::super::reflector::Reflector;
    use super::*;

    #[test]
    fn traces_depend_on_what_changes_them_and_on_nothing_else() {
        type Change = fn(&mut Design);
        let of = |change: Change, relief| {
            let mut design = crate::embedded("d2.toml").expect("valid");
            change(&mut design);
            (design.trace_fields(relief), design.reading_fields())
        };
        let all = ReliefModel::OrderTables;
        let base = of(|_| {}, all);
        let tolerance: Change = |d| d.hybrid.tolerance = 1e-3;
        let wavelength: Change = |d| d.wavelength_nm = 551.0;
        let traced: [Change; 20] = [
            |d| d.led.height_mm = 0.3,
            |d| d.elements.rounding.tip_mm = 1e-3,
            |d| d.elements.rounding.valley_mm = 1e-3,
            |d| d.led.offset_mm = [0.01, 0.0],
            |d| d.led.tilt_deg = [0.0, 1.0],
            |d| d.led.offsets_mm = vec![[0.0; 2], [0.01, 0.0]],
            |d| d.led.tilts_deg = vec![[0.0; 2], [0.0, 1.0]],
            |d| d.receiver.bin_mm = 0.05,
            |d| d.array.positions = PackagePositions::SINGLE,
            |d| d.array.offsets_mm = vec![[0.01, 0.0]; 4],
            |d| d.array.turns_deg = vec![1.0; 4],
            |d| d.array.scales = vec![1.0, 1.0, 1.0, 1.1],
            |d| d.array.stated_scales = vec![1.1; 4],
            |d| d.array.drives = Some(vec![1.0, 0.5, 1.0, 0.0]),
            tolerance,
            wavelength,
            |d| d.silicone.absorption_per_mm = 1e-3,
            |d| d.silicone = milky("g = 0.5"),
            |d| d.led.sides = Some(Reflector::Absorbing),
            |d| (d.prints, d.provenance.named) = (printed(), Vec::new()),
        ];
        for change in traced {
            let changed = of(change, all);
            assert!(changed.0 != base.0 && changed.1 == base.1);
        }
        assert_eq!(of(|d| d.name.push('x'), all), base);
        let zeros: Change =
            |d| (d.array.offsets_mm, d.array.turns_deg) = (vec![[0.0; 2]; 4], vec![0.0; 4]);
        assert_eq!(of(zeros, all), base);
        let ones: Change =
            |d| (d.array.scales, d.array.stated_scales) = (vec![0.5; 4], vec![2.0; 4]);
        assert_eq!(of(ones, all), base);
        let changed = of(|d| d.far_field.centre_deg = 7.5, all);
        assert!(changed.0 == base.0 && changed.1 != base.1);
        // Rays on the elements know neither tables nor, without films, the wavelength.
        let rays = of(|_| {}, ReliefModel::Elements);
        for change in [tolerance, wavelength] {
            assert_eq!(of(change, ReliefModel::Elements), rays);
        }
    }

    /// The medium of D2 with these keys of its table more.
    fn milky(keys: &str) -> Medium {
        let text = crate::EMBEDDED.iter().find(|(name, _)| *name == "d2.toml").expect("D2").1;
        let more = format!("index = 1.41\nscattering_per_mm = 1.0\n{keys}");
        let text = text.replacen("index = 1.41", &more, 1);
        crate::parse("d2.toml", &text, Path::new("")).expect("valid").silicone
    }

    /// Ink on the mirror of D2.
    fn printed() -> Vec<CheckedPrint> {
        let text = crate::EMBEDDED.iter().find(|(name, _)| *name == "d2.toml").expect("D2").1;
        let ink = "[[prints]]\non = \"mirror\"\nreflected = 0.5\n\
                   dots = { pitch_mm = 1.0, radius_mm = [[0.0, 0.3]] }\n";
        crate::parse("d2.toml", &format!("{text}\n{ink}"), Path::new("")).expect("valid").prints
    }

    /// What a medium does at another wavelength counts too.
    #[test]
    fn traces_depend_on_scattering_at_all_wavelengths() {
        let all = ["g = 0.5", "g = [[500, 0.5], [550, 0.5]]", "g = [[500, 0.1], [550, 0.5]]"];
        let fields: Vec<Value> = all.iter().map(|keys| medium_fields(&milky(keys))).collect();
        assert!(fields[0] != fields[1] && fields[1] != fields[2]);
    }

    /// The same of filters: light that is converted has wavelengths of its own.
    #[test]
    fn traces_depend_on_filters_at_all_wavelengths() {
        let text = crate::EMBEDDED.iter().find(|(name, _)| *name == "d2.toml").expect("D2").1;
        let of = |table: &str, rows: &str| {
            let mut stated: toml::Table = toml::from_str(text).expect("TOML");
            let law = format!(
                "kind = \"specular\"\nreflectance = 1.0\nfilter = {{ reflectance = {rows} }}"
            );
            let law: toml::Table = toml::from_str(&law).expect("TOML");
            if table == "led.sides" {
                let led = stated["led"].as_table_mut().expect("a table");
                led.insert("sides".to_owned(), law.into());
            } else {
                let mut own = stated[table].as_table().expect("a table").clone();
                for key in ["kind", "reflection"] {
                    own.remove(key);
                }
                let kind = if table == "led" { "reflection" } else { "kind" };
                own.insert(kind.to_owned(), "specular".into());
                own.insert("filter".to_owned(), law["filter"].clone());
                stated.insert(table.to_owned(), own.into());
            }
            let design = crate::parse("d2.toml", &stated.to_string(), Path::new(""));
            design.expect("valid").trace_fields(ReliefModel::Elements)
        };
        let rows = "[[450, 0, 0.9], [550, 0, 0.9], [620, 0, 0.9]]";
        for table in ["mirror", "led", "led.sides"] {
            let base = of(table, rows);
            assert_eq!(of(table, rows), base);
            assert_ne!(of(table, &rows.replace("620, 0, 0.9", "620, 0, 0.5")), base, "{table}");
        }
    }

    /// Filters of the panel come after the responses; a file that is also the spectrum of a die counts.
    #[test]
    fn traces_do_not_depend_on_filters_of_the_panel() {
        let text = crate::NEW_RGB_BACKLIGHT;
        let (before, rest) = text.split_once("[[panel.sub_pixels]]").expect("a panel");
        let (_, after) = rest.split_once("[light]").expect("a light");
        let filter = |name: &str| format!("[[panel.sub_pixels]]\nfile = \"filter_{name}.csv\"\n\n");
        let filters = ["red", "green", "blue"].map(filter).concat();
        let text = format!("{before}{filters}[light]{after}");
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, rows: &str| {
            std::fs::write(folder.path().join(name), rows).expect("written");
        };
        let of = |text: &str| {
            let design = crate::parse("rgb.toml", text, folder.path()).expect("valid");
            (design.trace_fields(ReliefModel::Elements), design.provenance.inputs())
        };
        for colour in ["red", "green", "blue"] {
            write(&format!("filter_{colour}.csv"), "380,0.2\n780,0.2\n");
        }
        let base = of(&text);
        assert_eq!(base.1.len(), 4);
        write("filter_red.csv", "380,0.2\n780,0.3\n");
        let changed = of(&text);
        assert!(base.0 == changed.0 && base.1 != changed.1);
        // Control: the same file as the light of the design.
        let (before, die) = text.split_once("[sources.spectrum]").expect("a die");
        let (_, after) = die.split_once("[[sources]]").expect("another");
        let spectrum = "kind = \"table\"\nsamples = 1\nfile = \"filter_red.csv\"";
        let lit = format!("{before}[sources.spectrum]\n{spectrum}\n\n[[sources]]{after}");
        let base = of(&lit);
        assert_eq!(base.1.len(), 4);
        write("filter_red.csv", "380,0.2\n780,0.4\n");
        assert_ne!(base.0, of(&lit).0);
    }

    #[test]
    fn traces_depend_on_the_turns_of_a_file() {
        let of = |turns: [f64; 2]| {
            let mut design = crate::embedded("d2.toml").expect("valid");
            design.array.positions = PackagePositions::List {
                positions_mm: vec![[0.0; 2], [9.0, 0.0]],
                turns_deg: turns.to_vec(),
                file: "p.txt".to_owned(),
            };
            design.trace_fields(ReliefModel::Elements)
        };
        assert_eq!(of([0.0, 30.0]), of([0.0, 30.0]));
        assert_ne!(of([0.0, 30.0]), of([0.0, -30.0]));
        assert_ne!(of([0.0, 30.0]), of([0.0; 2]));
    }

    #[test]
    fn files_of_other_programs_count_as_they_are_used() {
        let mut design = crate::embedded("d2.toml").expect("valid");
        let base = design.trace_fields(ReliefModel::Elements);
        design.files.stated.mirror = Some(schema::files::FileMirror {
            file: "mirror.bsdf".to_owned(),
            between: bsdf::LobeMotion::default(),
        });
        assert_ne!(design.trace_fields(ReliefModel::Elements), base);
    }
}
