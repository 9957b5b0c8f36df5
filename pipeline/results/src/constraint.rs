// SPDX-License-Identifier: MIT OR Apache-2.0
//! Constraints of a search on figures in any state.

use metrics::Bounds;

use crate::figure_entry::FigureEntry;
use crate::shown;

/// How far `figure` is from keeping `bounds` by so many standard errors, relative to the bound; 0
/// where it keeps them. With a margin both ends keep them of a figure that is known between two.
pub fn miss(bounds: Bounds, margin: f64, figure: &FigureEntry) -> f64 {
    match figure.ends().filter(|_| margin > 0.0) {
        Some(ends) => ends.map(|end| bounds.miss(end, 0.0)).into_iter().fold(0.0, f64::max),
        None => bounds.miss(figure.value, margin * figure.standard_error),
    }
}

/// The bound that the figure under `key` misses and by how much, for people; `None` where it keeps
/// them.
pub fn missed(key: &str, bounds: Bounds, margin: f64, figure: &FigureEntry) -> Option<String> {
    let reach = margin * figure.standard_error;
    let ends = figure.ends().filter(|_| margin > 0.0);
    let [low, high] = ends.unwrap_or([figure.value - reach, figure.value + reach]);
    let below = bounds.at_least.map_or(0.0, |least| least - low);
    let (_, unit) = shown::named(key);
    let by = shown::spread(below.max(bounds.at_most.map_or(0.0, |most| high - most)), unit);
    let with = if margin > 0.0 { format!(" by {margin} standard errors") } else { String::new() };
    (miss(bounds, margin, figure) > 0.0).then(|| {
        let (reached, expected) = (shown::text(figure, unit), shown::bounds(bounds, unit));
        format!("{key} is {reached}, expected {expected}{with}: missed by {by}")
    })
}

#[cfg(test)]
mod tests {
    use metrics::Estimate;

    use super::*;

    #[test]
    fn a_miss_is_said_with_its_amount_and_ends_count() {
        let bounds = |least| Bounds { at_least: Some(least), at_most: None };
        let plain = FigureEntry::new(Estimate::new(0.7294, 0.0009));
        let said = missed("flux.plate", bounds(0.73), 2.0, &plain).expect("missed");
        assert_eq!(
            said,
            "flux.plate is 72.940 ± 0.090 %, expected at least 73 % by 2 standard errors: missed by \
             0.24 points"
        );
        assert_eq!(missed("flux.plate", bounds(0.72), 2.0, &plain), None);
        // A bin of 20° that is known without an error keeps 19° by its value, not by its lower end.
        let bin = FigureEntry {
            interval: Some([17.5, 22.5]),
            ..FigureEntry::new(Estimate::new(20.0, 0.0))
        };
        let said = missed("peak_angle_deg", bounds(19.0), 2.0, &bin).expect("missed");
        assert!(
            said.contains("is 17.5 to 22.5 °, ") && said.ends_with("missed by 1.5 °"),
            "{said}"
        );
        assert!(miss(bounds(19.0), 0.0, &bin) <= 0.0 && miss(bounds(17.0), 2.0, &bin) <= 0.0);
        // Three paths may lie in what none reached.
        let none = FigureEntry::new(Estimate::new(0.0, 1e-4));
        let at_most = |most| Bounds { at_least: None, at_most: Some(most) };
        assert!(miss(at_most(2e-4), 2.0, &none) > 0.0 && miss(at_most(4e-4), 2.0, &none) <= 0.0);
    }
}
