// SPDX-License-Identifier: MIT OR Apache-2.0
//! Formulas in a design: `inner_size_mm = "5 * array.pitch_mm"`.
//!
//! No key of the schema takes both numbers and texts. So a text at a key of numbers, or of a list of
//! so many numbers, is a formula: a sum of products of numbers and keys. Formulas become numbers
//! before keys are read by their types, and after studies and searches have set keys.

use std::collections::BTreeMap;

use toml::{Table, Value};

use crate::dotted_keys::{get, number, numbered, texts};
use crate::json_schema::{list_lengths, number_kind};

/// Most formulas one behind the other.
const MAX_DEPTH: usize = 32;

/// A formula that stands for no number: its key, and the message.
pub(crate) type Fault = (String, String);

/// What a key stands for: one number or those of a list, and the formulas on the way to it.
#[derive(Debug, Clone, Default)]
struct Known {
    numbers: Vec<f64>,
    depth: usize,
}

/// One factor of a product.
enum Factor<'a> {
    Number(f64),
    Key(&'a str),
}

struct Formulas<'a> {
    design: &'a Table,
    known: BTreeMap<String, Known>,
    /// Keys whose formulas wait for others.
    trail: Vec<String>,
}

/// The keys of all formulas of `design`, and the numbers that they stand for, as TOML.
///
/// # Errors
/// The first formula that stands for none.
pub(crate) fn numbers(design: &Table) -> Result<Vec<(String, String)>, Fault> {
    let mut formulas = Formulas::new(design);
    let mut all = Vec::new();
    for key in texts(design).into_iter().filter(|key| takes_numbers(key)) {
        if let Some(Known { numbers, .. }) = formulas.value(&key)? {
            let toml = match &numbers[..] {
                [one] => format!("{one:?}"),
                list => format!("{list:?}"),
            };
            all.push((key, toml));
        }
    }
    Ok(all)
}

/// The number at the dotted `key`, stated or by a formula.
pub fn number_at(design: &Table, key: &str) -> Option<f64> {
    match &Formulas::new(design).value(key).ok()??.numbers[..] {
        [one] => Some(*one),
        _ => None,
    }
}

fn takes_numbers(key: &str) -> bool {
    number_kind(key).is_some() || !list_lengths(key).is_empty()
}

impl<'a> Formulas<'a> {
    fn new(design: &'a Table) -> Self {
        Self { design, known: BTreeMap::new(), trail: Vec::new() }
    }

    /// What `key` stands for; `None` without a number there.
    fn value(&mut self, key: &str) -> Result<Option<Known>, Fault> {
        let (design, key) = (self.design, numbered(self.design, key));
        match get(design, &key) {
            Some(Value::String(text)) if takes_numbers(&key) => self.formula(&key, text).map(Some),
            Some(Value::Array(list)) if list_lengths(&key).contains(&list.len()) => {
                let mut all = Known::default();
                for entry in 1..=list.len() {
                    let Some(known) = self.value(&format!("{key}[{entry}]"))? else {
                        return Ok(None);
                    };
                    all.numbers.extend(known.numbers);
                    all.depth = all.depth.max(known.depth);
                }
                Ok(Some(all))
            }
            Some(value) => Ok(number(value).map(|one| Known { numbers: vec![one], depth: 0 })),
            None => self.entry(&key),
        }
    }

    /// An entry of a list that one formula stands for.
    fn entry(&mut self, key: &str) -> Result<Option<Known>, Fault> {
        let Some((list, entry)) = key.strip_suffix(']').and_then(|key| key.rsplit_once('[')) else {
            return Ok(None);
        };
        if !matches!(get(self.design, list), Some(Value::String(_))) {
            return Ok(None);
        }
        let known = self.value(list)?.filter(|known| known.numbers.len() > 1);
        Ok(known.and_then(|Known { numbers, depth }| {
            let one = *numbers.get(entry.parse::<usize>().ok()?.checked_sub(1)?)?;
            Some(Known { numbers: vec![one], depth })
        }))
    }

    /// What the formula `text` of `key` stands for.
    fn formula(&mut self, key: &str, text: &str) -> Result<Known, Fault> {
        if let Some(known) = self.known.get(key) {
            return Ok(known.clone());
        }
        let refuse = |why: &str| {
            let message = format!(
                "expected a number, or a sum of products of numbers and keys such as \
                 \"5 * array.pitch_mm + 2\", got {text:?}{why}"
            );
            (key.to_owned(), message)
        };
        if self.trail.iter().any(|waiting| waiting == key) {
            return Err(refuse(&format!(", which leads back to {key}")));
        }
        let is_deep = |depth: usize| depth >= MAX_DEPTH;
        let too_deep = format!(", which leads through more than {MAX_DEPTH} formulas");
        if is_deep(self.trail.len()) {
            return Err(refuse(&too_deep));
        }
        self.trail.push(key.to_owned());
        let unlike = || refuse(", which joins lists of several lengths");
        let (mut sum, mut depth) = (vec![0.0], 0);
        for product in products(text).ok_or_else(|| refuse(""))? {
            let mut value = vec![1.0];
            for factor in product {
                let numbers = match factor {
                    Factor::Number(one) => vec![one],
                    Factor::Key(name) => {
                        let known = self.value(name)?;
                        let none = || refuse(&format!("; the design states no number at {name}"));
                        let known = known.ok_or_else(none)?;
                        depth = depth.max(known.depth);
                        known.numbers
                    }
                };
                value = joined(&value, &numbers, |a, b| a * b).ok_or_else(unlike)?;
            }
            sum = joined(&sum, &value, |a, b| a + b).ok_or_else(unlike)?;
        }
        if let Some(one) = sum.iter().find(|one| !one.is_finite()) {
            return Err(refuse(&format!(", which is {one}")));
        }
        if is_deep(depth) {
            return Err(refuse(&too_deep));
        }
        self.trail.pop();
        let lengths = list_lengths(key);
        if let (&[one], &[length], None) = (&sum[..], &lengths[..], number_kind(key)) {
            sum = vec![one; length];
        }
        let known = Known { numbers: sum, depth: depth + 1 };
        self.known.insert(key.to_owned(), known.clone());
        Ok(known)
    }
}

/// Two numbers or lists of as many, entry by entry; one number goes with every entry of a list.
fn joined(a: &[f64], b: &[f64], join: fn(f64, f64) -> f64) -> Option<Vec<f64>> {
    let entry = |list: &[f64], k: usize| list.get(if list.len() == 1 { 0 } else { k }).copied();
    (0..a.len().max(b.len())).map(|k| Some(join(entry(a, k)?, entry(b, k)?))).collect()
}

/// The products whose sum `text` is; a minus between blanks takes one away.
fn products(text: &str) -> Option<Vec<Vec<Factor<'_>>>> {
    let mut products = Vec::new();
    for plus in text.split('+') {
        for (place, product) in plus.split(" - ").enumerate() {
            let sign = (place > 0).then_some(Some(Factor::Number(-1.0)));
            let factors = sign.into_iter().chain(product.split('*').map(factor));
            products.push(factors.collect::<Option<_>>()?);
        }
    }
    Some(products)
}

fn factor(text: &str) -> Option<Factor<'_>> {
    let text = text.trim();
    if text.starts_with(|first: char| first.is_ascii_alphabetic()) {
        let is_of_key = |c: char| c.is_ascii_alphanumeric() || "_-.[]".contains(c);
        return text.chars().all(is_of_key).then_some(Factor::Key(text));
    }
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_number = digits.starts_with(|first: char| first.is_ascii_digit());
    text.parse().ok().filter(|_| is_number).map(Factor::Number)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;
    use crate::{NEW_BACKLIGHT, parse};

    /// The backlight of `batwing new` with some lines changed, and what it resolves to but for the
    /// hash of its text.
    fn resolved(edits: &[(&str, &str)]) -> Result<String, String> {
        let text = edits.iter().fold(NEW_BACKLIGHT.replace("NAME", "own"), |text, (old, new)| {
            assert_eq!(text.matches(old).count(), 1, "{old}");
            text.replace(old, new)
        });
        let mut design = parse("own.toml", &text, Path::new("")).map_err(|e| e.to_string())?;
        design.provenance.sha256.clear();
        // Numbers with all their digits.
        Ok(format!("{design:?}"))
    }

    /// Each line of the backlight, with numbers and with formulas for them.
    const LINES: [(&str, &str, &str); 9] = [
        ("columns = 4", "columns = 4", "columns = \"array.rows + 1\""),
        ("pitch_mm = 8.0", "pitch_mm = [8, 7.25]", "pitch_mm = [\"16*led.size_mm[1]\", 7.25]"),
        (
            "inner_size_mm = [32.0, 24.0]",
            "inner_size_mm = [40, 36.25]",
            "inner_size_mm = \"5 * array.pitch_mm\"",
        ),
        (
            "height_mm = 8.0",
            "height_mm = 8.0",
            "height_mm = \"films.plate.z_mm + 2 * films[1].thickness_mm\"",
        ),
        (
            "gap_mm = 0.01 ",
            "gap_mm = 0.0625 ",
            "gap_mm = \"films.upper_prisms.thickness_mm * 2.5 * -1 + housing.height_mm - 7.4375\" ",
        ),
        ("bin_mm = 0.5", "bin_mm = 0.25", "bin_mm = \"-0.5 * -0.5\""),
        (
            "size_mm = [32.0, 24.0]\nbins = [16",
            "size_mm = [30, 26.25]\nbins = [16",
            "size_mm = [\"housing.inner_size_mm[1] - 10\", \"receivers.display.size_mm[1] - 3.75\"]\nbins = [16",
        ),
        ("bins = [16, 12]", "bins = [12, 12]", "bins = \"4 * array.rows\""),
        ("plane_height_mm = 7.5", "plane_height_mm = 7.5", "plane_height_mm = \"75e-1\""),
    ];

    #[test]
    fn a_design_with_formulas_is_that_with_numbers() {
        let numbers = LINES.map(|(old, numbers, _)| (old, numbers));
        let formulas = LINES.map(|(old, _, formulas)| (old, formulas));
        let expected = resolved(&numbers).expect("valid");
        assert_eq!(resolved(&formulas).expect("valid"), expected);
        assert_ne!(resolved(&[]).expect("valid"), expected);
        // Products are rounded as numbers of double precision are.
        let [stated, computed] = ["0.30000000000000004", "\"3 * 0.1\""]
            .map(|value| resolved(&[("bin_mm = 0.5", &format!("bin_mm = {value}"))]));
        assert_eq!(computed.expect("valid"), stated.expect("valid"));
    }

    #[test]
    fn what_is_no_formula_is_refused_with_its_place() {
        let pitch =
            |formula: &str| resolved(&[("pitch_mm = 8.0", &format!("pitch_mm = {formula}"))]);
        let at =
            "own.toml: line 23, column 12: array.pitch_mm: expected a number, or a sum of products";
        for (formula, why) in [
            ("16 / 2", "got \"16 / 2\""),
            ("2 * (led.height_mm + 1)", "got \"2 * (led.height_mm + 1)\""),
            ("", "got \"\""),
            ("2 *", "got \"2 *\""),
            ("2 ** 3", "got"),
            ("8 mm", "got"),
            ("+8", "got"),
            ("1_000", "got"),
            ("led.height_mm -1", "got"),
            ("wide", "the design states no number at wide"),
            ("inf", "no number at inf"),
            ("led.hight_mm", "no number at led.hight_mm"),
            ("2 * name", "no number at name"),
            ("led", "no number at led"),
            ("led.reflection", "no number at led.reflection"),
            ("receiver.margin_mm", "no number at receiver.margin_mm"),
            ("films.panel.thickness_mm", "no number at films.panel.thickness_mm"),
            ("films[4].thickness_mm", "no number at films[4].thickness_mm"),
            ("array.pitch_mm", "which leads back to array.pitch_mm"),
            ("1e200 * 1e200", "which is inf"),
            ("led.size_mm * receivers.display.position_mm", "lists of several lengths"),
        ] {
            let said = pitch(&format!("{formula:?}")).expect_err(formula);
            assert!(said.starts_with(at) && said.contains(why), "{said}");
            assert!(!said.contains('\n'), "{said}");
        }
        for (old, new, words) in [
            (
                "size_mm = [0.5, 0.5]",
                "size_mm = [0.5, \"led.height_mm\"]\noffset_mm = \"0 * led.tilt_deg\"\ntilt_deg = \"led.offset_mm\"",
                "which leads back to led.offset_mm",
            ),
            (
                "size_mm = [0.5, 0.5]",
                "size_mm = [0.5, \"led.heigth_mm\"]",
                "line 14, column 17: led.size_mm[2]: expected a number, or",
            ),
            (
                "size_mm = [0.5, 0.5]",
                "size_mm = \"receivers.display.position_mm\"",
                "led.size_mm: expected a list of 2",
            ),
            ("height_mm = 0.15", "height_mm = \"led.size_mm\"", "led.height_mm: expected a number"),
            ("rows = 3", "rows = \"1.5\"", "array.rows: expected a whole number from 0, got 1.5"),
            ("bin_mm = 0.5", "bin_mm = \"0 * led.height_mm\"", "receiver.bin_mm = 0: expected"),
        ] {
            let said = resolved(&[(old, new)]).expect_err(new);
            assert!(said.contains(words), "{said}");
        }
    }

    /// Texts of other keys stay texts, and long chains end.
    #[test]
    fn chains_of_formulas_have_an_end() {
        let chain = |length: usize| {
            let keys = (1..=length).map(|k| match k {
                1 => "[[films]]\ngap_mm = 1.5\n".to_owned(),
                k => format!("[[films]]\nname = \"1\"\ngap_mm = \"films[{}].gap_mm\"\n", k - 1),
            });
            let text = keys.collect::<String>();
            let table: Table = text.parse().expect("TOML");
            numbers(&table).map(|all| all.len())
        };
        assert_eq!(chain(MAX_DEPTH + 1), Ok(MAX_DEPTH));
        let (key, message) = chain(MAX_DEPTH + 2).expect_err("long");
        assert!(
            key.starts_with("films[") && message.contains("more than 32 formulas"),
            "{message}"
        );
        assert!(chain(5000).is_err());
    }

    #[test]
    fn no_key_takes_numbers_and_texts() {
        type Types<'a> = BTreeMap<String, BTreeSet<&'a str>>;
        fn collect<'a>(schema: &'a serde_json::Value, path: &str, types: &mut Types<'a>) {
            let own = schema["type"].as_str().or(schema["const"].as_str().and(Some("string")));
            types.entry(path.to_owned()).or_default().extend(own);
            for (key, below) in schema["properties"].as_object().into_iter().flatten() {
                collect(below, &format!("{path}.{key}"), types);
            }
            let kinds = ["anyOf", "oneOf"].map(|key| schema[key].as_array().into_iter().flatten());
            kinds.into_iter().flatten().for_each(|kind| collect(kind, path, types));
            if let Some(entry) = schema.get("items") {
                collect(entry, &format!("{path}[]"), types);
            }
        }
        let (schema, mut types) = (crate::json_schema::of_designs(), BTreeMap::new());
        collect(&schema, "", &mut types);
        let takes = |path: &str, name: &str| types.get(path).is_some_and(|all| all.contains(name));
        let is_number = |path: &str| takes(path, "number") || takes(path, "integer");
        assert!(is_number(".array.pitch_mm") && is_number(".films[].thickness_mm"));
        for path in types.keys().filter(|path| takes(path, "string")) {
            assert!(!is_number(path) && !is_number(&format!("{path}[]")), "{path}");
        }
    }
}
