// SPDX-License-Identifier: MIT OR Apache-2.0
//! The plain data that reports are made of.
//!
//! Every value carries its unit and its standard error. Values are checked when they are made:
//! lengths agree, edges ascend, numbers are finite; the writers and pictures trust them.

use anyhow::{Result, ensure};

/// Unit of a stored or drawn number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Degrees of angle.
    Degree,
    /// Millimetres.
    Millimetre,
    /// Micrometres.
    Micrometre,
    /// Nanometres.
    Nanometre,
    /// Watts.
    Watt,
    /// Watts per steradian (radiant intensity).
    WattPerSteradian,
    /// Watts per square millimetre (irradiance).
    WattPerSquareMillimetre,
    /// Shares per steradian (intensity per emitted flux).
    PerSteradian,
    /// Candelas (luminous intensity).
    Candela,
    /// Candelas for 1000 lumens emitted.
    CandelaPerKilolumen,
    /// Lux (illuminance).
    Lux,
    /// Watts per square metre and steradian (radiance).
    WattPerSquareMetreSteradian,
    /// Candelas per square metre (luminance).
    CandelaPerSquareMetre,
    /// Lumens (luminous flux).
    Lumen,
    /// Kelvins (colour temperature).
    Kelvin,
    /// A share from 0 to 1; shown to people as a percentage in tables.
    Fraction,
    /// A ratio from 0 without an upper end, stored and shown as a share is.
    Ratio,
    /// A number relative to a reference that the label names, for example the maximum of a curve.
    Relative,
}

impl Unit {
    /// Units that have a name: ending of a column or key, and symbol for labels.
    const NAMED: [(Self, &str, &str); 15] = [
        (Self::Degree, "deg", "°"),
        (Self::Millimetre, "mm", "mm"),
        (Self::Micrometre, "um", "µm"),
        (Self::Nanometre, "nm", "nm"),
        (Self::Watt, "w", "W"),
        (Self::WattPerSteradian, "w_per_sr", "W/sr"),
        (Self::WattPerSquareMillimetre, "w_per_mm2", "W/mm²"),
        (Self::PerSteradian, "per_sr", "1/sr"),
        (Self::Candela, "cd", "cd"),
        (Self::CandelaPerKilolumen, "cd_per_klm", "cd/klm"),
        (Self::Lux, "lx", "lx"),
        (Self::WattPerSquareMetreSteradian, "w_per_m2_sr", "W/(m² sr)"),
        (Self::CandelaPerSquareMetre, "cd_per_m2", "cd/m²"),
        (Self::Lumen, "lm", "lm"),
        (Self::Kelvin, "k", "K"),
    ];

    /// The unit that a file names by suffix or symbol.
    pub fn from_name(name: &str) -> Option<Self> {
        let mut named = Self::NAMED.into_iter();
        named.find(|(_, suffix, symbol)| [*suffix, *symbol].contains(&name)).map(|(unit, ..)| unit)
    }

    fn names(self) -> [&'static str; 2] {
        let named = Self::NAMED.into_iter().find(|(unit, ..)| *unit == self);
        named.map_or([""; 2], |(_, suffix, symbol)| [suffix, symbol])
    }

    /// Ending of a column or key, without the underscore; empty for pure numbers.
    pub fn suffix(self) -> &'static str {
        self.names()[0]
    }

    /// Symbol for labels; empty for pure numbers.
    pub fn symbol(self) -> &'static str {
        self.names()[1]
    }

    /// True if people see it as a percentage.
    pub fn is_percentage(self) -> bool {
        matches!(self, Self::Fraction | Self::Ratio)
    }
}

/// What a number measures: a lower-case name such as `intensity` or `emission angle`, and its unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Quantity {
    name: String,
    unit: Unit,
}

impl Quantity {
    /// A quantity of this name and unit.
    pub fn new(name: impl Into<String>, unit: Unit) -> Self {
        Self { name: name.into(), unit }
    }

    /// Name as given.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Unit of the stored numbers.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Column name or key: `emission_angle_deg`.
    pub fn key(&self) -> String {
        let name = self.name.to_lowercase().replace([' ', '-', '/'], "_");
        match self.unit.suffix() {
            "" => name,
            suffix => format!("{name}_{suffix}"),
        }
    }

    /// Label of an axis: `Emission angle (°)`; single letters stay as they are.
    pub fn label(&self) -> String {
        let mut letters = self.name.chars();
        let name = match (letters.next(), letters.as_str()) {
            (Some(first), rest) if !rest.is_empty() => {
                format!("{}{rest}", first.to_uppercase())
            }
            _ => self.name.clone(),
        };
        match self.unit.symbol() {
            "" => name,
            symbol => format!("{name} ({symbol})"),
        }
    }
}

/// One axis of a map, cut into bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    quantity: Quantity,
    edges: Vec<f64>,
}

impl Axis {
    /// An axis from its bin edges: ascending, finite, one more than there are bins.
    ///
    /// # Errors
    /// Fewer than two edges, or edges that do not ascend.
    pub fn new(quantity: Quantity, edges: Vec<f64>) -> Result<Self> {
        ensure!(
            edges.len() >= 2,
            "axis `{}`: expected at least two bin edges, got {}",
            quantity.name,
            edges.len()
        );
        ensure!(
            edges.iter().all(|edge| edge.is_finite()) && edges.windows(2).all(|w| w[0] < w[1]),
            "axis `{}`: expected finite bin edges in ascending order",
            quantity.name
        );
        Ok(Self { quantity, edges })
    }

    /// An axis of `bins` equal bins from `low` to `high`.
    ///
    /// # Errors
    /// No bins, or `low >= high`.
    pub fn uniform(quantity: Quantity, low: f64, high: f64, bins: usize) -> Result<Self> {
        let step = (high - low) / bins as f64;
        let mut edges: Vec<f64> = (0..bins).map(|i| step.mul_add(i as f64, low)).collect();
        edges.push(high);
        Self::new(quantity, edges)
    }

    /// Name and unit.
    pub fn quantity(&self) -> &Quantity {
        &self.quantity
    }

    /// Bin edges, ascending.
    pub fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.edges.len() - 1
    }

    /// Middle of every bin.
    pub fn centres(&self) -> Vec<f64> {
        self.edges.windows(2).map(|w| f64::midpoint(w[0], w[1])).collect()
    }

    /// First and last edge.
    pub fn range(&self) -> [f64; 2] {
        [self.edges[0], self.edges[self.edges.len() - 1]]
    }
}

/// A quantity over two binned axes, row by row: bin (row, column) is at
/// `row * columns.bins() + column`.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    quantity: Quantity,
    rows: Axis,
    columns: Axis,
    value: Vec<f64>,
    standard_error: Vec<f64>,
}

impl Map {
    /// A map with one value and one standard error in every bin.
    ///
    /// # Errors
    /// Lengths other than rows × columns, numbers that are not finite, negative standard errors.
    pub fn new(
        quantity: Quantity,
        rows: Axis,
        columns: Axis,
        value: Vec<f64>,
        standard_error: Vec<f64>,
    ) -> Result<Self> {
        let bins = rows.bins() * columns.bins();
        ensure!(
            value.len() == bins && standard_error.len() == bins,
            "map of {}: expected {} x {} = {bins} bins, got {} values and {} standard errors",
            quantity.name,
            rows.bins(),
            columns.bins(),
            value.len(),
            standard_error.len()
        );
        check_values(&quantity.name, &value, &standard_error)?;
        Ok(Self { quantity, rows, columns, value, standard_error })
    }

    /// Name and unit of the values.
    pub fn quantity(&self) -> &Quantity {
        &self.quantity
    }

    /// Axis along which rows follow each other (θ, or y).
    pub fn rows(&self) -> &Axis {
        &self.rows
    }

    /// Axis along a row (φ, or x).
    pub fn columns(&self) -> &Axis {
        &self.columns
    }

    /// Values, row by row.
    pub fn value(&self) -> &[f64] {
        &self.value
    }

    /// Standard errors, row by row.
    pub fn standard_error(&self) -> &[f64] {
        &self.standard_error
    }
}

/// One curve of a picture: values with standard errors over ascending positions.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    label: String,
    x: Vec<f64>,
    value: Vec<f64>,
    standard_error: Vec<f64>,
}

impl Curve {
    /// A curve with its name in the legend.
    ///
    /// # Errors
    /// Fewer than two points, lengths that differ, positions that do not ascend, numbers that are
    /// not finite.
    pub fn new(
        label: impl Into<String>,
        x: Vec<f64>,
        value: Vec<f64>,
        standard_error: Vec<f64>,
    ) -> Result<Self> {
        let label = label.into();
        ensure!(
            x.len() >= 2 && x.len() == value.len() && x.len() == standard_error.len(),
            "curve `{label}`: expected at least two points and equal lengths, got {} positions, {} values, {} standard errors",
            x.len(),
            value.len(),
            standard_error.len()
        );
        ensure!(
            x.iter().all(|x| x.is_finite()) && x.windows(2).all(|w| w[0] < w[1]),
            "curve `{label}`: expected finite positions in ascending order"
        );
        check_values(&label, &value, &standard_error)?;
        Ok(Self { label, x, value, standard_error })
    }

    /// The curve continued to negative positions by symmetry: the azimuthal mean over θ = 0..90°
    /// drawn over -90..90°.
    ///
    /// # Errors
    /// A position below zero.
    pub fn mirrored(&self) -> Result<Self> {
        self.beside(self)
    }

    /// The curve continued to negative positions by `opposite`: a cross-section through both
    /// half-planes.
    ///
    /// # Errors
    /// A position below zero.
    pub fn beside(&self, opposite: &Self) -> Result<Self> {
        for x in [self.x[0], opposite.x[0]] {
            ensure!(
                x >= 0.0,
                "curve `{}`: only positions from 0 upwards can be mirrored, got {x}",
                self.label
            );
        }
        let skip = usize::from(self.x[0] == 0.0 && opposite.x[0] == 0.0);
        let both = |left: &[f64], right: &[f64], sign: f64| -> Vec<f64> {
            let left = left[skip..].iter().rev().map(|v| sign * v);
            left.chain(right.iter().copied()).collect()
        };
        Self::new(
            self.label.clone(),
            both(&opposite.x, &self.x, -1.0),
            both(&opposite.value, &self.value, 1.0),
            both(&opposite.standard_error, &self.standard_error, 1.0),
        )
    }

    /// The curve on at most `most` points: means over equal runs of points, with independent
    /// errors.
    ///
    /// # Errors
    /// Fewer than two points.
    pub fn thinned(&self, most: usize) -> Result<Self> {
        let run = self.x.len().div_ceil(most);
        let mean = |list: &[f64]| -> Vec<f64> {
            let runs = list.chunks(run);
            runs.map(|r| r.iter().sum::<f64>() / r.len() as f64).collect()
        };
        let errors = self.standard_error.chunks(run);
        let error = |r: &[f64]| r.iter().map(|e| e * e).sum::<f64>().sqrt() / r.len() as f64;
        Self::new(self.label.clone(), mean(&self.x), mean(&self.value), errors.map(error).collect())
    }

    /// The curve divided by `reference`, for example its own maximum.
    ///
    /// # Errors
    /// A reference that is zero, negative or not finite.
    pub fn relative_to(&self, reference: f64) -> Result<Self> {
        ensure!(
            reference.is_finite() && reference > 0.0,
            "curve `{}`: expected a positive reference to divide by, got {reference}",
            self.label
        );
        let divide = |list: &[f64]| list.iter().map(|v| v / reference).collect();
        Self::new(
            self.label.clone(),
            self.x.clone(),
            divide(&self.value),
            divide(&self.standard_error),
        )
    }

    /// The same curve under another name.
    #[must_use]
    pub fn labelled(self, label: impl Into<String>) -> Self {
        Self { label: label.into(), ..self }
    }

    /// Name in the legend.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Positions, ascending.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Values.
    pub fn value(&self) -> &[f64] {
        &self.value
    }

    /// Standard errors.
    pub fn standard_error(&self) -> &[f64] {
        &self.standard_error
    }

    /// Largest value.
    pub fn maximum(&self) -> f64 {
        self.value.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

fn check_values(name: &str, value: &[f64], standard_error: &[f64]) -> Result<()> {
    if let Some(index) = value.iter().position(|v| !v.is_finite()) {
        anyhow::bail!("{name}: expected finite values, got {} at index {index}", value[index]);
    }
    if let Some(index) = standard_error.iter().position(|e| !(e.is_finite() && *e >= 0.0)) {
        anyhow::bail!(
            "{name}: expected finite standard errors of at least 0, got {} at index {index}",
            standard_error[index]
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_labels_name_the_unit() {
        let angle = Quantity::new("emission angle", Unit::Degree);
        assert_eq!(angle.key(), "emission_angle_deg");
        assert_eq!(angle.label(), "Emission angle (°)");
        assert_eq!(Quantity::new("x", Unit::Millimetre).label(), "x (mm)");
        for name in ["cd/m²", "cd_per_m2"] {
            assert_eq!(Unit::from_name(name), Some(Unit::CandelaPerSquareMetre));
        }
        assert_eq!(Unit::from_name("1"), None);
        assert_eq!(Quantity::new("share", Unit::Fraction).key(), "share");
    }

    #[test]
    fn axis_refuses_edges_that_do_not_ascend() {
        let x = || Quantity::new("x", Unit::Millimetre);
        assert!(Axis::new(x(), vec![0.0, 1.0, 1.0]).is_err());
        assert!(Axis::new(x(), vec![0.0]).is_err());
        assert!(Axis::uniform(x(), 1.0, 0.0, 4).is_err());
        assert!(Axis::uniform(x(), 0.0, 1.0, 0).is_err());
        let axis = Axis::uniform(x(), -1.0, 1.0, 4).unwrap();
        assert_eq!(axis.edges(), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(axis.centres(), [-0.75, -0.25, 0.25, 0.75]);
    }

    #[test]
    fn map_refuses_wrong_lengths_and_nan() {
        let axis = |name: &str, bins| {
            Axis::uniform(Quantity::new(name, Unit::Millimetre), 0.0, 1.0, bins).unwrap()
        };
        let quantity = || Quantity::new("illuminance", Unit::WattPerSquareMillimetre);
        let map = |value, error| Map::new(quantity(), axis("y", 2), axis("x", 3), value, error);
        assert!(map(vec![1.0; 6], vec![0.0; 6]).is_ok());
        assert!(map(vec![1.0; 5], vec![0.0; 6]).is_err());
        assert!(map(vec![f64::NAN; 6], vec![0.0; 6]).is_err());
        assert!(map(vec![1.0; 6], vec![-1.0; 6]).is_err());
    }

    #[test]
    fn mirrored_curve_keeps_one_point_at_zero() {
        let curve = Curve::new("a", vec![0.0, 1.0, 2.0], vec![3.0, 4.0, 5.0], vec![0.1; 3])
            .unwrap()
            .mirrored()
            .unwrap();
        assert_eq!(curve.x(), [-2.0, -1.0, 0.0, 1.0, 2.0]);
        assert_eq!(curve.value(), [5.0, 4.0, 3.0, 4.0, 5.0]);
        let bins = Curve::new("b", vec![1.0, 3.0], vec![3.0, 4.0], vec![0.1; 2]).unwrap();
        assert_eq!(bins.mirrored().unwrap().x(), [-3.0, -1.0, 1.0, 3.0]);
    }

    #[test]
    fn a_thinned_curve_has_means_of_its_points() {
        let whole = |n: u32, f: fn(f64) -> f64| (0..n).map(|k| f(f64::from(k))).collect();
        let curve = Curve::new("a", whole(9, |k| k), whole(9, |k| 2.0 * k), vec![0.3; 9]).unwrap();
        let thin = curve.thinned(3).unwrap();
        assert_eq!(thin.x(), [1.0, 4.0, 7.0]);
        assert_eq!(thin.value(), [2.0, 8.0, 14.0]);
        assert!((thin.standard_error()[0] - 0.3 / 3.0f64.sqrt()).abs() < 1e-15);
        assert_eq!(curve.thinned(9).unwrap(), curve);
    }
}
