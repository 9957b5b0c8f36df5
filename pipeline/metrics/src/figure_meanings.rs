// SPDX-License-Identifier: MIT OR Apache-2.0
//! What every figure of merit means, in a sentence for people who meet it for the first time.
//!
//! Exact definitions: `docs/reference/results-schema.md`.

use super::figures::{self, Source};
use super::uniformity_forms::{FORMS, Form, Region, RegionForm};

/// Meaning of the figure under `key`, with the name of a receiver or of an account in it; `None` of
/// a key that is not registered.
pub fn meaning(key: &str) -> Option<String> {
    let figure = figures::find(key)?;
    if let Some(form) = FORMS.into_iter().find(|form| form.key == figure.key) {
        return Some(of_form(form));
    }
    let words = match figure.source {
        Source::Receiver | Source::ReceiverColours => of_receiver(figure.key),
        _ => of_design(figure.key),
    };
    words.map(str::to_owned)
}

fn of_design(key: &str) -> Option<&'static str> {
    Some(match key {
        "peak_angle_deg" => {
            "Angle from the vertical at which the intensity, averaged over azimuth, is largest."
        }
        "peak_angle_parabola_deg" => {
            "The peak angle between bins, by a parabola through the largest ones."
        }
        "centre_to_peak" => {
            "Intensity straight up over the largest intensity: small where the lens sends light aside."
        }
        "beam_angle_deg" => {
            "Full angle between the directions at which the intensity falls to half of its peak."
        }
        "field_angle_deg" => {
            "Full angle between the directions at which the intensity falls to a tenth of its peak."
        }
        "intensity_centre" => "Intensity straight up.",
        "intensity_peak" => "Largest intensity.",
        "intensity_peak_cd_per_klm" => "Largest intensity for each 1000 lm that are emitted.",
        "uniformity" => {
            "Evenness of the light on the receiver plane between neighbouring LEDs, on a logarithmic scale: 100 % where the darkest place is as bright as the brightest."
        }
        "uniformity_diagonal" => {
            "The uniformity with the darkest place on the diagonals of four LEDs."
        }
        "illuminance_valley_to_peak" => {
            "Illuminance of the darkest place between neighbouring LEDs over the largest."
        }
        "extraction_efficiency" => {
            "Share of the emitted power that leaves the silicone of the domes for good."
        }
        "cell_colour_difference" => {
            "Largest colour difference between two of nine points of the rectangle between the outermost LEDs."
        }
        "cell_colour_difference_parts" => {
            "Largest colour difference between two parts of the rectangle between the outermost LEDs."
        }
        "far_field_colour_difference" => "Largest colour difference between two directions.",
        "plane_u_prime" => "Chromaticity u' of all light on the receiver plane.",
        "plane_v_prime" => "Chromaticity v' of all light on the receiver plane.",
        "plane_cct_k" => "Colour temperature of all light on the receiver plane.",
        "plane_duv" => {
            "Distance of the colour on the receiver plane from that of a black body: greenish above 0, pinkish below."
        }
        "far_field_u_prime" => "Chromaticity u' of all light that leaves upwards.",
        "far_field_v_prime" => "Chromaticity v' of all light that leaves upwards.",
        "far_field_cct_k" => "Colour temperature of all light that leaves upwards.",
        "far_field_duv" => {
            "Distance of the colour of the light upwards from that of a black body: greenish above 0, pinkish below."
        }
        "escaped_up" => "Share of the emitted power that leaves upwards.",
        "escaped_down" => "Share of the emitted power that leaves downwards.",
        "flux_up" => "Flux that leaves upwards.",
        "flux_down" => "Flux that leaves downwards.",
        "illuminance_above_leds" => "Mean illuminance of the places above the LEDs.",
        "illuminance_peak" => "Largest illuminance on the receiver plane.",
        "illuminance_cell_mean" => "Mean illuminance of the rectangle between the outermost LEDs.",
        // Accounts of the ledger.
        "" => "Share of the emitted power that ends there.",
        _ => return None,
    })
}

fn of_receiver(figure: &str) -> Option<&'static str> {
    Some(match figure {
        "flux" => "Share of the emitted power that reaches the receiver.",
        "mean" => "Mean over the bins of the receiver.",
        "min" => "Smallest bin of the receiver.",
        "max" => "Largest bin of the receiver.",
        "min_to_max" => "Smallest over largest bin of the receiver.",
        "nine_points" => {
            "Smallest over largest of nine points of the receiver, as displays are measured."
        }
        "thirteen_points" => {
            "Smallest over largest of thirteen points of the receiver, as displays are measured."
        }
        "axial" => "Luminance seen along the normal of the receiver.",
        "half_angle_u_deg" => {
            "Angle between the directions along u at which the luminance falls to half of its peak."
        }
        "half_angle_v_deg" => {
            "Angle between the directions along v at which the luminance falls to half of its peak."
        }
        "u_prime" => "Chromaticity u' of all light on the receiver.",
        "v_prime" => "Chromaticity v' of all light on the receiver.",
        "cct_k" => "Colour temperature of all light on the receiver.",
        "duv" => {
            "Distance of the colour on the receiver from that of a black body: greenish above 0, pinkish below."
        }
        _ => return None,
    })
}

fn of_form(RegionForm { region, form, .. }: RegionForm) -> String {
    let form = match form {
        Form::ValleyToPeak => "Smallest over largest illuminance",
        Form::MinToMean => "Smallest over mean illuminance (U0 of EN 12464-1)",
        Form::Variation => "Standard deviation over mean of the illuminance",
        Form::Logarithmic => "Smallest over largest illuminance on a logarithmic scale",
    };
    let region = match region {
        Region::Segment => "the straight lines between LEDs next to each other",
        Region::Diagonal => "the diagonals of four LEDs",
        Region::Cell => "the rectangle between the outermost LEDs",
        Region::NinePoints => "nine points of the rectangle between the outermost LEDs",
        Region::ThirteenPoints => "thirteen points of the rectangle between the outermost LEDs",
        Region::Area => "the area that the design states",
        Region::AreaNinePoints => "nine points of the area that the design states",
        Region::AreaThirteenPoints => "thirteen points of the area that the design states",
    };
    format!("{form} on {region}.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_registered_figure_has_a_meaning() {
        let whole = figures::all().map(|figure| figure.key.to_owned());
        let of_receivers = figures::of_receivers().map(|figure| format!("{}.plate", figure.key));
        let accounts = ["absorbed_by_led_top", "lost_to_bounces"].map(str::to_owned);
        for key in whole.chain(of_receivers).chain(accounts) {
            let words = meaning(&key).unwrap_or_else(|| panic!("{key} has no meaning"));
            assert!(words.ends_with('.'), "{key}: {words}");
        }
        assert_eq!(meaning("glow"), None);
        assert_eq!(
            meaning("cell_min_to_mean").as_deref(),
            Some(
                "Smallest over mean illuminance (U0 of EN 12464-1) on the rectangle between the outermost LEDs."
            )
        );
    }
}
