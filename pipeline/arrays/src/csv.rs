// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables for programs: arrays as `.npy` and columns as CSV.
//!
//! In: numbers with their quantity. Out: files whose column names carry the unit and whose numbers
//! are the shortest text that reads back to the same `f64`.

use std::path::Path;

use anyhow::{Result, ensure};

use metrics::quantity::{Curve, Map, Quantity};

use super::npy;
use runtime::atomic_file::write_atomic;

/// One column of a CSV table.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Heading, with the unit at its end: `theta_deg`.
    pub name: String,
    /// One number a row. NaN stands for a missing value and leaves its field empty.
    pub values: Vec<f64>,
    /// True of whole numbers, which stand there without a point.
    pub is_whole: bool,
}

impl Column {
    /// A column of plain numbers.
    pub fn plain(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), values, is_whole: false }
    }

    /// A column of whole numbers.
    pub fn whole(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { is_whole: true, ..Self::plain(name, values) }
    }

    /// A column headed by the quantity's name and unit.
    pub fn new(quantity: &Quantity, values: impl Into<Vec<f64>>) -> Self {
        Self::plain(quantity.key(), values.into())
    }

    /// A column of standard errors of `quantity`: `intensity_standard_error_w_per_sr`.
    pub fn standard_error(quantity: &Quantity, values: impl Into<Vec<f64>>) -> Self {
        let name = format!("{} standard error", quantity.name());
        Self::new(&Quantity::new(name, quantity.unit()), values)
    }
}

/// Writes `columns` side by side under their names.
///
/// # Errors
/// No columns, lengths that differ, a name that is empty, appears twice or needs quoting, an
/// infinite value, or a file that cannot be written.
pub fn write_csv(path: &Path, columns: &[Column]) -> Result<()> {
    write_beside(path, None, columns)
}

/// Writes `columns` beside a first one of texts, which are quoted where they need it.
///
/// # Errors
/// Those of [`write_csv`]; another number of texts.
pub fn write_named_csv(
    path: &Path,
    heading: &str,
    names: &[String],
    columns: &[Column],
) -> Result<()> {
    write_beside(path, Some((heading, names)), columns)
}

fn write_beside(path: &Path, texts: Option<(&str, &[String])>, columns: &[Column]) -> Result<()> {
    let Some(first) = columns.first() else {
        anyhow::bail!("a table needs at least one column");
    };
    for (index, column) in columns.iter().enumerate() {
        let name = &column.name;
        ensure!(
            !name.is_empty() && !name.contains([',', '"', '\n', '\r']),
            "column {index}: expected a name without commas, quotes and line ends, got {name:?}"
        );
        ensure!(columns[..index].iter().all(|c| c.name != *name), "column `{name}` appears twice");
        ensure!(
            column.values.len() == first.values.len(),
            "column `{name}`: expected {} values as in `{}`, got {}",
            first.values.len(),
            first.name,
            column.values.len()
        );
        ensure!(
            !column.values.iter().any(|v| v.is_infinite()),
            "column `{name}` holds an infinite value"
        );
    }
    if let Some((heading, texts)) = texts {
        ensure!(
            texts.len() == first.values.len(),
            "column `{heading}`: expected {} values as in `{}`, got {}",
            first.values.len(),
            first.name,
            texts.len()
        );
    }
    write_atomic(path, |file| {
        let names = columns.iter().map(|c| c.name.clone());
        let heading = texts.map(|(heading, _)| quoted(heading));
        writeln!(file, "{}", heading.into_iter().chain(names).collect::<Vec<_>>().join(","))?;
        for row in 0..first.values.len() {
            let field = |column: &Column| match (column.values[row], column.is_whole) {
                (value, true) if value.is_finite() => format!("{value:.0}"),
                (value, _) => shortest(value),
            };
            let text = texts.map(|(_, texts)| quoted(&texts[row]));
            let fields: Vec<String> = text.into_iter().chain(columns.iter().map(field)).collect();
            writeln!(file, "{}", fields.join(","))?;
        }
        Ok(())
    })
}

/// Writes lines of text fields under `headings`; both are quoted where they need it (RFC 4180).
///
/// # Errors
/// A line that has not as many fields as there are headings, or a file that cannot be written.
pub fn write_text_csv(path: &Path, headings: &[&str], lines: &[Vec<String>]) -> Result<()> {
    for (index, line) in lines.iter().enumerate() {
        ensure!(
            line.len() == headings.len(),
            "line {index}: expected {} fields, got {}",
            headings.len(),
            line.len()
        );
    }
    let row =
        |fields: &mut dyn Iterator<Item = &str>| fields.map(quoted).collect::<Vec<_>>().join(",");
    write_atomic(path, |file| {
        writeln!(file, "{}", row(&mut headings.iter().copied()))?;
        for line in lines {
            writeln!(file, "{}", row(&mut line.iter().map(String::as_str)))?;
        }
        Ok(())
    })
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// Writes curves over the same positions as one table: the position, then value and standard error
/// of each curve, whose label becomes part of its column names.
///
/// # Errors
/// Curves at different positions, and those of [`write_csv`].
pub fn write_curves_csv(
    path: &Path,
    position: &Quantity,
    quantity: &Quantity,
    curves: &[Curve],
) -> Result<()> {
    let Some(first) = curves.first() else {
        anyhow::bail!("a table of curves needs at least one curve");
    };
    let mut columns = vec![Column::new(position, first.x())];
    for curve in curves {
        ensure!(
            curve.x() == first.x(),
            "curve `{}` has other positions than `{}`; write them to separate tables",
            curve.label(),
            first.label()
        );
        let named = if curves.len() == 1 {
            quantity.clone()
        } else {
            Quantity::new(
                format!("{} {}", column_of(curve.label()), quantity.name()),
                quantity.unit(),
            )
        };
        columns.push(Column::new(&named, curve.value()));
        columns.push(Column::standard_error(&named, curve.standard_error()));
    }
    write_csv(path, &columns)
}

/// Writes `values` as a C-ordered `.npy` array of f64 with this shape.
///
/// # Errors
/// A shape whose product is not the number of values, or a file that cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f64]) -> Result<()> {
    write_atomic(path, |file| npy::write(file, shape, values))
}

/// Writes a map as a `.npy` array of shape (2, rows, columns): values, then standard errors.
///
/// # Errors
/// A file that cannot be written.
pub fn write_map_npy(path: &Path, map: &Map) -> Result<()> {
    let both: Vec<f64> = [map.value(), map.standard_error()].concat();
    write_npy(path, &[2, map.rows().bins(), map.columns().bins()], &both)
}

/// Writes a curve as a `.npy` array of shape (3, points): positions, values, standard errors.
///
/// # Errors
/// A file that cannot be written.
pub fn write_curve_npy(path: &Path, curve: &Curve) -> Result<()> {
    let all: Vec<f64> = [curve.x(), curve.value(), curve.standard_error()].concat();
    write_npy(path, &[3, curve.x().len()], &all)
}

/// Shortest text that reads back to the same number; empty for NaN.
fn shortest(value: f64) -> String {
    if value.is_nan() { String::new() } else { format!("{value:?}") }
}

/// Beginning of the columns of a curve with this label, by which [`write_curves_csv`] tells curves
/// apart: letters and digits, words joined by underscores.
pub fn column_of(label: &str) -> String {
    let words: Vec<String> = label
        .replace('µ', "u")
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    words.join("_")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    use metrics::quantity::{Axis, Unit};

    fn intensity() -> Quantity {
        Quantity::new("intensity", Unit::WattPerSteradian)
    }

    fn theta() -> Quantity {
        Quantity::new("theta", Unit::Degree)
    }

    #[test]
    fn csv_names_units_and_numbers_read_back_exactly() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("cut.csv");
        let values = vec![0.1 + 0.2, 1e-300, -2.5e17, f64::MIN_POSITIVE, 1.0 / 3.0];
        let columns = [
            Column::new(&theta(), vec![0.0, 1.0, 2.0, 3.0, 4.0]),
            Column::new(&intensity(), values.clone()),
            Column::standard_error(&intensity(), vec![f64::NAN; 5]),
        ];
        write_csv(&path, &columns).unwrap();
        let text = fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        assert_eq!(
            lines.next(),
            Some("theta_deg,intensity_w_per_sr,intensity_standard_error_w_per_sr")
        );
        for (line, value) in lines.zip(&values) {
            let fields: Vec<&str> = line.split(',').collect();
            assert_eq!(fields[1].parse::<f64>().unwrap().to_bits(), value.to_bits());
            assert_eq!(fields[2], "");
        }
        assert!(text.contains("0.30000000000000004") && text.contains("1e-300"));
    }

    #[test]
    fn text_and_headings_are_quoted_where_they_need_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("text.csv");
        let line = ["1, 2", "plain", "b\nc"].map(str::to_owned).to_vec();
        write_text_csv(&path, &["inner, beta", "\"x\"", "y"], &[line]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "\"inner, beta\",\"\"\"x\"\"\",y\n\"1, 2\",plain,\"b\nc\"\n");
    }

    #[test]
    fn whole_numbers_have_no_point() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("whole.csv");
        let values = vec![1.0, f64::NAN, 120.0];
        let columns = [Column::whole("row", values.clone()), Column::plain("drive", values)];
        write_csv(&path, &columns).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "row,drive\n1,1.0\n,\n120,120.0\n");
    }

    #[test]
    fn csv_refuses_ragged_doubled_and_infinite_columns() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("bad.csv");
        let column = |name: &str, values: &[f64]| Column::plain(name, values.to_vec());
        let a = column("a", &[1.0, 2.0]);
        assert!(write_csv(&path, &[]).is_err());
        assert!(write_csv(&path, &[a.clone(), column("b", &[1.0])]).is_err());
        assert!(write_csv(&path, &[a.clone(), a.clone()]).is_err());
        assert!(write_csv(&path, &[a.clone(), column("b,c", &[1.0, 2.0])]).is_err());
        assert!(write_csv(&path, &[a, column("b", &[1.0, f64::INFINITY])]).is_err());
        assert!(!path.exists());
    }

    #[test]
    fn curves_share_one_position_column() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("curves.csv");
        let curve = |label: &str, x: Vec<f64>| {
            Curve::new(label, x, vec![1.0, 2.0], vec![0.1, 0.2]).unwrap()
        };
        let curves = [curve("D1, 10 µm", vec![0.0, 1.0]), curve("D2", vec![0.0, 1.0])];
        write_curves_csv(&path, &theta(), &intensity(), &curves).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(
            text.lines().next().unwrap(),
            "theta_deg,d1_10_um_intensity_w_per_sr,d1_10_um_intensity_standard_error_w_per_sr,\
             d2_intensity_w_per_sr,d2_intensity_standard_error_w_per_sr"
        );
        assert_eq!(text.lines().nth(1), Some("0.0,1.0,0.1,1.0,0.1"));
        let apart = [curves[0].clone(), curve("D3", vec![0.0, 2.0])];
        assert!(write_curves_csv(&path, &theta(), &intensity(), &apart).is_err());
    }

    #[test]
    fn npy_keeps_shape_order_and_bits() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("map.npy");
        let y = Axis::uniform(Quantity::new("y", Unit::Millimetre), 0.0, 1.0, 2).unwrap();
        let x = Axis::uniform(Quantity::new("x", Unit::Millimetre), 0.0, 1.0, 3).unwrap();
        let value: Vec<f64> = (0..6).map(|i| f64::from(i) / 7.0).collect();
        let map = Map::new(intensity(), y, x, value, vec![0.5; 6]).unwrap();
        write_map_npy(&path, &map).unwrap();
        let (shape, back) = npy::read::<f64>(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(shape, [2, 2, 3]);
        assert_eq!([back[5].to_bits(), back[6].to_bits()], [5.0 / 7.0, 0.5].map(f64::to_bits));
    }

    #[test]
    fn npy_refuses_a_shape_that_does_not_fit() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.npy");
        assert!(write_npy(&path, &[2, 2], &[1.0; 3]).is_err());
        write_npy(&path, &[3], &[1.0, 2.0, 3.0]).unwrap();
        let (_, back) = npy::read::<f64>(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(back, [1.0, 2.0, 3.0]);
    }
}
