// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jones matrices of a case, for `batwing grating`.
//!
//! On slices, amplitudes are extrapolated like efficiencies, each by itself.

use num_complex::Complex64;
use rcwa::jones::{Jones, Matrix};
use rcwa::relief::extrapolate;
use rcwa::{Error, Side, Stack, Truncation};
use serde_json::{Map, Value, json};

use super::{OrderEfficiency, Problem, Runs};

impl Problem<'_> {
    /// Matrices of all orders, top before bottom, by ascending order.
    pub(super) fn jones(
        &self,
        (coarse, fine): &Runs,
        truncation: Truncation,
    ) -> Result<Vec<Matrix>, Error> {
        let solve = |stack: &Stack| -> Result<Vec<Jones>, Error> {
            let scattering = rcwa::solve(stack, self.bloch(stack), truncation)?;
            scattering.jones_of_all((Side::Top, 0))
        };
        let coarse = solve(coarse)?;
        let Some((fine, n)) = fine else {
            return Ok(coarse.iter().map(|j| j.matrix).collect());
        };
        let extrapolated = |(c, f): (&Jones, &Jones)| {
            [0, 1].map(|q| [0, 1].map(|p| extrapolate(c.matrix[q][p], f.matrix[q][p], *n)))
        };
        Ok(coarse.iter().zip(&solve(fine)?).map(extrapolated).collect())
    }
}

/// {"order": [[ss, sp], [ps, pp]]} of one side, a row for each outgoing polarisation, elements [re,
/// im].
pub(super) fn to_json(orders: &[OrderEfficiency], matrices: &[Matrix], side: Side) -> Value {
    let element = |z: &Complex64| json!([z.re, z.im]);
    let row = |row: &[Complex64; 2]| row.iter().map(element).collect::<Value>();
    let entries = orders.iter().zip(matrices).filter(|(o, _)| o.side == side);
    entries
        .map(|(o, matrix)| (o.order.to_string(), matrix.iter().map(row).collect()))
        .collect::<Map<String, Value>>()
        .into()
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::super::tests::solved;

    #[test]
    fn jones_matrices_are_printed_on_request_and_give_the_efficiencies() {
        let case = |pol: &str, jones: &str| {
            format!(
                r#"{{"wavelength": 0.55, "period": 0.9, "n_top": [1.41, 0], "n_bottom": [1, 0], "relief": {{"depth": 0.3, "background": [1, 0],
                "polygons": [{{"n": [1.41, 0], "points": [[0, 0], [0.7, 0.3], [0.9, 0]]}}]}}, "theta_deg": 20, "phi_deg": 35, "pol": "{pol}", "N": 9{jones}}}"#
            )
        };
        let plain = solved(&case("s", "")).to_json();
        assert!(plain.get("JR").is_none() && plain.get("JT").is_none());
        let s = solved(&case("s", r#", "jones": true"#)).to_json();
        let p = solved(&case("p", r#", "jones": true"#)).to_json();
        assert_eq!(s["T"], plain["T"]);
        let (kx, ky) = (
            1.41 * 20f64.to_radians().sin() * 35f64.to_radians().cos(),
            1.41 * 20f64.to_radians().sin() * 35f64.to_radians().sin(),
        );
        let incident = 1.41 * 20f64.to_radians().cos();
        // Amplitudes and shares are extrapolated each by themselves, on as many slices as the
        // incident polarisation takes.
        let error = |json: &Value| json["estimated_error"].as_f64().expect("a number");
        let allowed = error(&s) + error(&p) + 1e-5;
        let mut conversion = 0.0_f64;
        for (json, other, column) in [(&s, &p, 0), (&p, &s, 1)] {
            for (key, parts, n) in [("JR", ["RTE", "RTM"], 1.41), ("JT", ["TTE", "TTM"], 1.0)] {
                let matrices = json[key].as_object().expect("orders");
                assert!(matrices.len() >= 2);
                for (order, matrix) in matrices {
                    let m: f64 = order.parse().expect("an order");
                    let kz = (n * n - (kx + m * 0.55 / 0.9).powi(2) - ky * ky).sqrt();
                    for (row, part) in parts.into_iter().enumerate() {
                        let z = &matrix[row][column];
                        let [re, im] = [0, 1].map(|i| z[i].as_f64().expect("a number"));
                        let share = kz / incident * (re * re + im * im);
                        let expected = json[part][order].as_f64().expect("a share");
                        for (i, got) in [re, im].into_iter().enumerate() {
                            let same = other[key][order][row][column][i].as_f64();
                            assert!((got - same.expect("a number")).abs() < allowed);
                        }
                        assert!(
                            (share - expected).abs() < allowed,
                            "{part} {order}: {share}, {expected}"
                        );
                        conversion = conversion.max(if row == column { 0.0 } else { share });
                    }
                }
            }
        }
        assert!(conversion > 1e-4, "a conical mount turns s into p: {conversion}");
    }
}
