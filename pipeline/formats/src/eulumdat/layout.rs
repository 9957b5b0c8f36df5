// SPDX-License-Identifier: MIT OR Apache-2.0
//! EULUMDAT photometric files (`.ldt`).
//!
//! [`read`] parses a text into an [`Ldt`], [`write()`] does the reverse, and [`Ldt::distribution`]
//! gives the intensities as a [`Distribution`]. The format has one value a line in a fixed order,
//! so an empty line is a value. A text with several kinds of line end is refused.
//!
//! Intensities are in cd per 1000 lm of the lamps. Absolute photometry has a negative number of
//! lamps and cd per 1000 lm of the stated flux. γ is measured from the axis of the luminaire (nadir
//! in the file, +z here), C is the azimuth. Of several sets of lamps one is taken: the intensities
//! belong to all of them, flux and power to each. Their six lines stand set after set, as public
//! programs read them; the description of the format leaves the order open.
//!
//! Layout: the public descriptions of the format of 1990.

use crate::fields::Fields;
use crate::fields::LARGEST;
use crate::ies::layout::significant;
use crate::text::FormatError;
use crate::text::{check_line_ends, quoted};
use tracer::Distribution;
use tracer::Error;

/// The content of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Ldt {
    /// Maker, measurement report, luminaire name, luminaire number, file name, date and user: lines
    /// 1 and 8 to 12.
    pub texts: [String; 6],
    /// Type of source, 1 to 3.
    pub kind: u8,
    /// Symmetry: 0 none, 1 about the axis, 2 about C0-C180, 3 about C90-C270, 4 about both.
    pub symmetry: u8,
    /// C planes around the whole circle, degrees from 0.
    pub planes: Vec<f64>,
    /// Distance of the planes as stated, 0 where they are not equidistant.
    pub plane_step: f64,
    /// γ angles, degrees.
    pub gammas: Vec<f64>,
    /// Distance of the γ angles as stated, 0 where they are not equidistant.
    pub gamma_step: f64,
    /// Lengths in mm: lines 13 to 21.
    pub lengths: [f64; 9],
    /// Downward flux fraction, light output ratio, conversion factor, tilt: lines 22 to 25.
    pub ratios: [f64; 4],
    /// Number of lamps, negative for absolute photometry.
    pub lamps: i32,
    /// Type of lamps, colour appearance, colour rendering group: lines 26b, 26d, 26e.
    pub lamp_texts: [String; 3],
    /// Flux of the lamps, lm.
    pub flux: f64,
    /// Power, W.
    pub watts: f64,
    /// Direct ratios for ten room indices.
    pub direct_ratios: [f64; 10],
    /// Shape (stored plane, γ), cd/klm.
    pub intensities: Vec<f64>,
    /// Number of sets of lamps in the file that was read, of which this is one.
    pub lamp_sets: usize,
    /// Oddities of the file that was read, though it can be used.
    pub warnings: Vec<String>,
}

/// The lamps of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lamps {
    /// Their number, -1 for absolute photometry.
    pub count: i32,
    /// Their flux, lm.
    pub flux: f64,
    /// Their power, W.
    pub watts: f64,
}

/// The fields of a text: its lines, which must all end alike.
fn fields(text: &str) -> Result<Fields<'_>, FormatError> {
    check_line_ends(text)?;
    let ends = ["\r\n", "\n", "\r"];
    let end = ends.into_iter().find(|end| text.contains(end));
    let lines = text.split(end.unwrap_or("\n")).map(str::trim);
    let lines: Vec<(usize, &str)> = (1..).zip(lines).collect();
    let end = lines.len() + 1;
    Ok(Fields::new(lines, end))
}

/// Number of planes that a file stores, of `planes` around the circle.
fn stored(symmetry: u8, planes: usize) -> usize {
    match symmetry {
        1 => 1,
        2 | 3 => planes / 2 + 1,
        4 => planes / 4 + 1,
        _ => planes,
    }
}

/// One set of lamps of a file: lines 26a to 26f.
struct LampSet {
    count: i32,
    texts: [String; 3],
    flux: f64,
    watts: f64,
}

impl LampSet {
    /// Set `number`, from 1, and how many there are.
    fn one_of(fields: &mut Fields<'_>, number: usize) -> Result<(Self, usize), FormatError> {
        let max = fields.left() / 6;
        let count = fields.count("number of sets of lamps", 1, max)?;
        if number == 0 || number > count {
            let expected = format!("a set of lamps from 1 to {count}");
            return Err(FormatError::line(fields.line, expected, number.to_string()));
        }
        let mut sets = Vec::new();
        for _ in 0..count {
            sets.push(Self::read(fields)?);
        }
        Ok((sets.swap_remove(number - 1), count))
    }

    fn read(fields: &mut Fields<'_>) -> Result<Self, FormatError> {
        let count = fields.whole("number of lamps", -10_000, 10_000)?;
        let kind = fields.text("type of lamps")?.to_owned();
        let flux = fields
            .real_that("flux of the lamps", "above 0 up to 1e30", |v| v > 0.0 && v <= LARGEST)?;
        let colour = fields.text("colour appearance")?.to_owned();
        let rendering = fields.text("colour rendering group")?.to_owned();
        let watts = fields.real_that("power", "0 or more", |v| v >= 0.0)?;
        Ok(Self { count, texts: [kind, colour, rendering], flux, watts })
    }
}

/// Reads the text of a file, with its first set of lamps.
///
/// # Errors
/// Same as [`read_lamp_set`].
pub fn read(text: &str) -> Result<Ldt, FormatError> {
    read_lamp_set(text, 1)
}

/// Reads the text of a file, with set `lamp_set` of its lamps, from 1.
///
/// # Errors
/// If it is not of this layout; several kinds of line end; NaN or infinite values, negative
/// intensities, angles out of order; decimal commas; no such set of lamps; no flux. More flux than
/// the lamps have is a [warning](Ldt::warnings).
pub fn read_lamp_set(text: &str, lamp_set: usize) -> Result<Ldt, FormatError> {
    let mut fields = fields(text)?;
    let max = fields.left();
    let maker = fields.text("the maker")?.to_owned();
    let kind = fields.whole("type of source", 0, 3)? as u8;
    let symmetry = fields.whole("symmetry", 0, 4)? as u8;
    let planes = fields.count("number of C planes", 1, max)?;
    let plane_step = fields.real_that("distance of C planes", "0 or more", |v| v >= 0.0)?;
    let gammas = fields.count("number of intensities in a plane", 2, max)?;
    let gamma_step = fields.real_that("distance of intensities", "0 or more", |v| v >= 0.0)?;
    let divisor = match symmetry {
        2 | 3 => 2,
        4 => 4,
        _ => 1,
    };
    if !planes.is_multiple_of(divisor) {
        let expected =
            format!("a number of C planes divisible by {divisor} with symmetry {symmetry}");
        return Err(FormatError::line(4, expected, planes.to_string()));
    }
    let mut texts: [String; 6] = Default::default();
    texts[0] = maker;
    for (slot, what) in texts[1..].iter_mut().zip([
        "the report number",
        "the luminaire name",
        "the luminaire number",
        "the file name",
        "date and user",
    ]) {
        fields.text(what)?.clone_into(slot);
    }
    let mut lengths = [0.0; 9];
    for length in &mut lengths {
        *length = fields.real("a length of the luminaire")?;
    }
    let mut ratios = [0.0; 4];
    for (ratio, (what, low, high)) in ratios.iter_mut().zip([
        ("downward flux fraction", 0.0, 1e3),
        ("light output ratio", 0.0, 1e3),
        ("conversion factor", 0.0, 1e6),
        ("tilt", -360.0, 360.0),
    ]) {
        let expected = format!("{low} to {high}");
        *ratio = fields.real_that(what, &expected, |v| (low..=high).contains(&v))?;
    }
    let (lamps, lamp_sets) = LampSet::one_of(&mut fields, lamp_set)?;
    let mut direct_ratios = [0.0; 10];
    for ratio in &mut direct_ratios {
        *ratio = fields.real("a direct ratio")?;
    }
    let plane_angles = fields.angles("a C angle", planes, 360.0)?;
    let gamma_angles = fields.angles("a gamma angle", gammas, 180.0)?;
    let count = stored(symmetry, planes).saturating_mul(gammas);
    let mut intensities = Vec::new();
    for _ in 0..count {
        let range = 0.0..=LARGEST;
        let expected = "0 or more, up to 1e30";
        intensities.push(fields.real_that("an intensity", expected, |v| range.contains(&v))?);
    }
    let last = fields.line;
    while fields.left() > 0 {
        let rest = fields.text("nothing")?;
        // Some files end in the control character for the end of a text.
        if !rest.is_empty() && rest != "\u{1a}" {
            let expected = format!("the end of the file after {count} intensities");
            return Err(FormatError::line(fields.line, expected, quoted(rest)));
        }
    }
    let mut ldt = Ldt {
        texts,
        kind,
        symmetry,
        planes: plane_angles,
        plane_step,
        gammas: gamma_angles,
        gamma_step,
        lengths,
        ratios,
        lamps: lamps.count,
        lamp_texts: lamps.texts,
        flux: lamps.flux,
        watts: lamps.watts,
        direct_ratios,
        intensities,
        lamp_sets,
        warnings: Vec::new(),
    };
    let stated = (!ldt.is_absolute()).then_some(ldt.flux);
    ldt.warnings.extend(crate::fields::usable(ldt.distribution(), stated, last)?);
    Ok(ldt)
}

impl Ldt {
    /// True if the photometry is absolute.
    pub fn is_absolute(&self) -> bool {
        self.lamps < 0
    }

    /// Row of `intensities` for a plane of the whole circle.
    fn row(&self, plane: usize) -> usize {
        let count = self.planes.len();
        match self.symmetry {
            1 => 0,
            // C0 to C180 are stored.
            2 => plane.min(count - plane),
            // C90 to C270 by way of C180, stored from C270: C270 to C90 by way of C0.
            3 => {
                let from = (plane + count / 4) % count;
                from.min(count - from)
            }
            4 => {
                let half = plane.min(count - plane);
                half.min(count / 2 - half.min(count / 2))
            }
            _ => plane,
        }
    }

    /// Candela around the whole circle.
    ///
    /// # Errors
    /// If there is no intensity at all.
    pub fn distribution(&self) -> Result<Distribution, Error> {
        let factor = self.flux * 1e-3 * if self.ratios[2] > 0.0 { self.ratios[2] } else { 1.0 };
        let row = |plane: usize| {
            let first = self.row(plane) * self.gammas.len();
            self.intensities[first..first + self.gammas.len()].iter()
        };
        let mut planes = self.planes.clone();
        if self.symmetry == 1 {
            planes = vec![0.0];
        } else if planes[planes.len() - 1] >= 360.0 && planes.len() > 1 {
            planes.pop();
        }
        let values = (0..planes.len()).flat_map(row).map(|v| v * factor).collect();
        Distribution::new(&self.gammas, &planes, values)
    }

    /// The file of a distribution in candela, relative to the flux of `lamps`.
    pub fn from_distribution(table: &Distribution, texts: [String; 6], lamps: Lamps) -> Self {
        let Lamps { count, flux, watts } = lamps;
        let (gammas, planes) = (table.thetas_deg(), table.phis_deg());
        let symmetry = u8::from(planes.len() == 1);
        let intensities = (0..planes.len())
            .flat_map(|p| (0..gammas.len()).map(move |g| (p, g)))
            .map(|(p, g)| table.value(p, g) * 1e3 / flux)
            .collect();
        let out = table.flux();
        let down = downward(table);
        let even = |list: &[f64]| {
            let step = if list.len() > 1 { list[1] - list[0] } else { 0.0 };
            let is_even = list.windows(2).all(|w| (w[1] - w[0] - step).abs() < 1e-6);
            if is_even { step } else { 0.0 }
        };
        Self {
            texts,
            kind: 1,
            symmetry,
            plane_step: even(&planes),
            gamma_step: even(&gammas),
            planes,
            gammas,
            lengths: [0.0; 9],
            ratios: [100.0 * down / out, 100.0 * out / flux, 1.0, 0.0],
            lamps: count,
            lamp_texts: ["LED".to_owned(), String::new(), String::new()],
            flux,
            watts,
            direct_ratios: [0.0; 10],
            intensities,
            lamp_sets: 1,
            warnings: Vec::new(),
        }
    }
}

/// Flux below 90 degrees of γ.
fn downward(table: &Distribution) -> f64 {
    let thetas: Vec<f64> = table.thetas_deg();
    let planes = table.phis_deg();
    let below: Vec<usize> = (0..thetas.len()).filter(|t| thetas[*t] <= 90.0).collect();
    let values = (0..planes.len())
        .flat_map(|p| below.iter().map(move |t| (p, *t)))
        .map(|(p, t)| table.value(p, t))
        .collect();
    let thetas: Vec<f64> = below.iter().map(|t| thetas[*t]).collect();
    Distribution::new(&thetas, &planes, values).map_or(0.0, |half| half.flux())
}

/// The text of a file.
pub fn write(ldt: &Ldt) -> String {
    let mut text = String::new();
    let one_line = |t: &str| t.replace(['\r', '\n'], " ");
    let mut put = |line: String| {
        text.push_str(&line);
        text.push_str("\r\n");
    };
    put(one_line(&ldt.texts[0]));
    for value in [
        f64::from(ldt.kind),
        f64::from(ldt.symmetry),
        ldt.planes.len() as f64,
        ldt.plane_step,
        ldt.gammas.len() as f64,
        ldt.gamma_step,
    ] {
        put(value.to_string());
    }
    for line in &ldt.texts[1..] {
        put(one_line(line));
    }
    for value in ldt.lengths.iter().chain(&ldt.ratios) {
        put(significant(*value, 6));
    }
    put("1".to_owned());
    put(ldt.lamps.to_string());
    put(one_line(&ldt.lamp_texts[0]));
    put(ldt.flux.to_string());
    put(one_line(&ldt.lamp_texts[1]));
    put(one_line(&ldt.lamp_texts[2]));
    put(ldt.watts.to_string());
    for ratio in ldt.direct_ratios {
        put(ratio.to_string());
    }
    for list in [&ldt.planes, &ldt.gammas] {
        for value in list {
            put(value.to_string());
        }
    }
    for value in &ldt.intensities {
        put(significant(*value, 7));
    }
    text
}
