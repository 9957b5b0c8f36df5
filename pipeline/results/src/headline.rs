// SPDX-License-Identifier: MIT OR Apache-2.0
//! The figures that stand first on a page: those that the design was made for.

use std::collections::BTreeMap;

use metrics::figures::receiver::{AXIAL, MAX, MEAN, MIN_TO_MAX, NINE_POINTS, WIDTH_U, WIDTH_V};
use metrics::figures::{ESCAPED_UP, EXTRACTION, FLUX_UP, RECEIVER_COLOUR};
use metrics::kinds::ReceiverKind;

use crate::schema::ReceiverEntry;

/// Figures that a design that is looked at is asked for beside its luminance.
const OF_ALL_LIGHT: [&str; 3] = [ESCAPED_UP.key, EXTRACTION.key, FLUX_UP.key];

/// Keys of the figures that stand first. What is looked at from a side is known by the luminance on
/// its axis, its widths, colour and uniformity; then no figure of `general` counts that is a mean
/// over all directions. Means of luminance over all directions never do.
pub fn headline(
    general: &[&str],
    receivers: Option<&BTreeMap<String, ReceiverEntry>>,
) -> Vec<String> {
    let is_luminance = |receiver: &&ReceiverEntry| receiver.kind == ReceiverKind::Luminance;
    let is_wide = |receiver: &ReceiverEntry| {
        [WIDTH_U, WIDTH_V].iter().any(|width| receiver.figures.contains_key(width.key))
    };
    let of_all = || receivers.into_iter().flatten();
    let has_luminance = of_all().any(|(_, receiver)| is_luminance(&receiver));
    let narrow = || of_all().filter(|(_, receiver)| is_luminance(receiver) && !is_wide(receiver));
    let has_narrow = narrow().next().is_some();
    let has_axial = narrow().any(|(_, receiver)| receiver.figures.contains_key(AXIAL.key));
    let of_receivers = of_all().flat_map(|(name, receiver)| {
        let points = [NINE_POINTS, MIN_TO_MAX];
        let uniformity = points.into_iter().find(|f| receiver.figures.contains_key(f.key));
        let figures = match receiver.kind {
            ReceiverKind::Luminance if has_narrow && is_wide(receiver) => {
                // The luminance on the axis stands once.
                [AXIAL, WIDTH_U, WIDTH_V].into_iter().skip(usize::from(has_axial)).collect()
            }
            ReceiverKind::Luminance => {
                let colour = [RECEIVER_COLOUR.u_prime, RECEIVER_COLOUR.v_prime];
                let read = [AXIAL, WIDTH_U, WIDTH_V].into_iter().chain(colour);
                read.chain(uniformity).collect()
            }
            ReceiverKind::Plane => [MEAN].into_iter().chain(uniformity).collect(),
            ReceiverKind::FarField | ReceiverKind::CGamma => vec![MAX],
            ReceiverKind::Surface => Vec::new(),
        };
        let read = figures.into_iter().filter(|f| receiver.figures.contains_key(f.key));
        read.map(move |figure| format!("{}.{name}", figure.key))
    });
    let counts = |key: &&str| !has_luminance || OF_ALL_LIGHT.contains(key);
    let general = general.iter().copied().filter(counts).map(str::to_owned);
    if has_luminance {
        of_receivers.chain(general).collect()
    } else {
        general.chain(of_receivers).collect()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use metrics::figures::{PEAK_ANGLE, UNIFORMITY};

    fn receivers(entries: &Value) -> BTreeMap<String, ReceiverEntry> {
        let entry = |(name, of): (&String, &Value)| {
            let figure = |key: &Value| {
                let key = key.as_str().expect("a key").to_owned();
                (key, json!({"value": 1.0, "standard_error": 0.1}))
            };
            let mut entry = json!({"kind": of[0], "quantity": "x", "unit": "W", "files": []});
            let figures = of[1].as_array().expect("keys").iter().map(figure);
            entry.as_object_mut().expect("an object").extend(figures);
            (name.clone(), serde_json::from_value(entry).expect("a receiver"))
        };
        entries.as_object().expect("receivers").iter().map(entry).collect()
    }

    #[test]
    fn a_display_is_known_by_its_axis_and_not_by_means_over_directions() {
        let general = [EXTRACTION, UNIFORMITY, PEAK_ANGLE].map(|figure| figure.key);
        let [axial, width] = [AXIAL.key, WIDTH_U.key];
        let of = |entries: Value| headline(&general, Some(&receivers(&entries)));
        let keys = ["mean", "min_to_max", "nine_points", axial, "u_prime"];
        let views = json!({"a": ["luminance", ["mean", axial, width, "u_prime"]],
            "b": ["luminance", keys]});
        let shown = [&format!("{width}.a"), &format!("{axial}.b"), "u_prime.b", "nine_points.b"];
        assert_eq!(of(views)[..4], shown);
        let ends = json!({"a": ["luminance", [axial, width]], "b": ["luminance", ["u_prime"]]});
        assert_eq!(of(ends)[..3], [&format!("{axial}.a"), &format!("{width}.a"), "u_prime.b"]);
        let alone = json!({"a": ["luminance", ["mean", axial, width, "u_prime"]]});
        let shown = [&format!("{axial}.a"), &format!("{width}.a"), "u_prime.a", EXTRACTION.key];
        assert_eq!(of(alone), shown);
        let wall = json!({"wall": ["plane", ["mean", "min_to_max"]], "far": ["far_field", ["max", "mean"]]});
        let shown = [EXTRACTION.key, UNIFORMITY.key, PEAK_ANGLE.key, "max.far", "mean.wall"];
        assert_eq!(of(wall)[..5], shown);
        assert_eq!(headline(&general, None), general);
    }
}
