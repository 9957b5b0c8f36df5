// SPDX-License-Identifier: MIT OR Apache-2.0
//! Meaning of each colour, in every picture and on the page: models, fates of light, directions of
//! scattering, objects.
//!
//! Lines are in the colours of [Okabe Ito 2008] and in others that lie apart from them. The page
//! takes them as variables ([`style_sheet`]), with lighter ones on a dark ground.

use std::fmt::Write as _;

use results::ray_paths::PathEnd;

use super::colour::Colour;

/// A colour by name, on white and on a dark ground.
#[derive(Clone, Copy, Debug)]
struct Tone {
    name: &'static str,
    light: Colour,
    dark: Colour,
}

const fn tone(name: &'static str, light: [u8; 3], dark: [u8; 3]) -> Tone {
    const fn colour([red, green, blue]: [u8; 3]) -> Colour {
        Colour::new(red, green, blue)
    }
    Tone { name, light: colour(light), dark: colour(dark) }
}

/// Models, as curves: rays on the relief, rays on finer rings, rays in unit cells, waves.
const MODELS: [Tone; 4] = [
    tone("geometric", [0, 114, 178], [77, 163, 224]),
    tone("fine", [86, 180, 233], [155, 215, 247]),
    tone("control", [0, 158, 115], [63, 208, 160]),
    tone("hybrid", [213, 94, 0], [240, 138, 69]),
];
/// Directions of scattering: through the surface, back from it.
const SIDES: [Tone; 2] = [
    tone("transmitted", [204, 121, 167], [231, 163, 199]),
    tone("reflected", [60, 60, 60], [180, 180, 186]),
];
/// Fates of light, in the order of [`PathEnd`].
const FATES: [Tone; PathEnd::ALL.len()] = [
    tone("escaped-up", [230, 159, 0], [245, 192, 74]),
    tone("escaped-down", [122, 73, 20], [196, 140, 80]),
    tone("absorbed-mirror", [117, 80, 180], [176, 146, 232]),
    tone("absorbed-led", [190, 20, 80], [244, 98, 146]),
    tone("absorbed-surface", [112, 122, 28], [190, 200, 92]),
    tone("absorbed-medium", [84, 112, 140], [140, 172, 204]),
    tone("lost", [20, 20, 20], [240, 240, 240]),
];
/// Objects: fills and edges.
const OBJECTS: [Tone; 11] = [
    tone("led", [64, 224, 208], [64, 224, 208]),
    tone("led-edge", [0, 98, 92], [150, 244, 232]),
    tone("led-ground", [221, 246, 243], [24, 62, 60]),
    tone("silicone", [232, 241, 248], [32, 44, 56]),
    tone("silicone-edge", [69, 107, 140], [132, 172, 208]),
    tone("medium", [220, 234, 217], [36, 52, 36]),
    tone("medium-edge", [79, 122, 71], [136, 190, 126]),
    tone("body", [215, 211, 206], [70, 66, 62]),
    tone("body-edge", [91, 81, 72], [178, 168, 158]),
    tone("mirror", [138, 151, 163], [138, 151, 163]),
    tone("receiver", [168, 40, 40], [236, 120, 120]),
];
/// Errors of different origin, told apart by dashes first.
const NEUTRAL: [Tone; 3] = [
    tone("neutral-1", [32, 32, 36], [228, 228, 232]),
    tone("neutral-2", [110, 110, 118], [160, 160, 168]),
    tone("neutral-3", [160, 160, 168], [112, 112, 120]),
];

const fn object(number: usize) -> Colour {
    OBJECTS[number].light
}

/// An LED.
pub const LED: Colour = object(0);
/// Edge and name of it.
pub const LED_EDGE: Colour = object(1);
/// The stretch of an axis over an LED.
pub const LED_GROUND: Colour = object(2);
/// Fill and edge of the dome.
pub const SILICONE: [Colour; 2] = [object(3), object(4)];
/// Fill and edge of other bodies that light enters.
pub const MEDIUM: [Colour; 2] = [object(5), object(6)];
/// Fill and edge of bodies and sheets that it does not.
pub const BODY: [Colour; 2] = [object(7), object(8)];
/// The mirror.
pub const MIRROR: Colour = object(9);
/// The receiver plane.
pub const RECEIVER: Colour = object(10);

/// Steps of the relief, µm, below which rays count as those on finer rings.
const FINE_UM: f64 = 50.0;

/// Number of the colour of a model by its key or its name for people; `None` of other names.
pub fn model_number(name: &str) -> Option<usize> {
    let digits: String = name.chars().filter(|c| c.is_ascii_digit() || *c == '.').collect();
    let fine = digits.parse::<f64>().is_ok_and(|um| um < FINE_UM);
    let kinds = [("geometric", usize::from(fine)), ("control", 2), ("hybrid", 3)];
    let found = kinds.into_iter().find(|(kind, _)| name.starts_with(kind));
    found.map(|(_, number)| number)
}

/// Rays and waves, where a picture compares just these.
pub const RAYS_WAVES: [Colour; 2] = [MODELS[0].light, MODELS[3].light];

/// The colour of the model under this number.
pub fn model(number: usize) -> Colour {
    MODELS[number % MODELS.len()].light
}

/// The variable of the page that holds the colour of the model under this number.
pub fn model_variable(number: usize) -> String {
    format!("--{}", MODELS[number % MODELS.len()].name)
}

/// Colours of errors of different origin.
pub fn neutral(number: usize) -> Colour {
    NEUTRAL[number % NEUTRAL.len()].light
}

/// The colour of a fate.
pub fn fate(end: PathEnd) -> Colour {
    FATES[end as usize].light
}

/// The variable of the page that holds the colour of a fate.
pub fn fate_variable(end: PathEnd) -> String {
    format!("--{}", FATES[end as usize].name)
}

/// The fate that an account of the power ledger counts, by its key.
pub fn fate_of_account(account: &str) -> PathEnd {
    match account {
        "escaped_up" => PathEnd::EscapedUp,
        "escaped_down" => PathEnd::EscapedDown,
        _ if account.starts_with("absorbed_in_") => PathEnd::AbsorbedMedium,
        _ => match account.strip_prefix("absorbed_by_") {
            Some(surface) => PathEnd::at_surface(&surface.replace('_', " ")),
            None => PathEnd::Lost,
        },
    }
}

fn all() -> impl Iterator<Item = &'static Tone> {
    let lines = MODELS.iter().chain(&SIDES).chain(&FATES);
    lines.chain(&OBJECTS).chain(&NEUTRAL)
}

/// Hexadecimal digits of a colour.
fn hex(colour: Colour) -> String {
    let [r, g, b] = colour.rgb;
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The colours as variables of a style sheet, and rules that put them into pictures.
pub fn style_sheet() -> String {
    let root = |of: fn(&Tone) -> Colour| {
        let variables = all().map(|tone| format!("--{}: {};", tone.name, hex(of(tone))));
        format!(":root {{ {} }}", variables.collect::<Vec<_>>().join(" "))
    };
    let (light, dark) = (root(|tone| tone.light), root(|tone| tone.dark));
    let mut text = format!(
        "{light}\n@media (prefers-color-scheme: dark) {{ {dark} }}\n@media print {{ {light} }}\n"
    );
    for tone in all() {
        for what in ["fill", "stroke"] {
            let (name, light) = (tone.name, hex(tone.light));
            let _ = writeln!(text, ".sheet [{what}=\"{light}\"] {{ {what}: var(--{name}); }}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_colour_means_one_thing() {
        let tones: Vec<&Tone> = all().collect();
        for (k, a) in tones.iter().enumerate() {
            for b in &tones[k + 1..] {
                assert_ne!(a.light.rgb, b.light.rgb, "{} {}", a.name, b.name);
                assert_ne!(a.name, b.name);
            }
        }
        // Lines of one picture differ clearly.
        for family in [&MODELS[..], &FATES, &SIDES] {
            for (k, a) in family.iter().enumerate() {
                for b in &family[k + 1..] {
                    let apart = (0..3)
                        .map(|i| (i32::from(a.light.rgb[i]) - i32::from(b.light.rgb[i])).abs());
                    assert!(apart.sum::<i32>() > 60, "{} {}", a.name, b.name);
                }
            }
        }
    }

    #[test]
    fn models_are_known_by_key_and_by_name() {
        for (name, number) in [
            ("geometric", Some(0)),
            ("geometric_100um", Some(0)),
            ("geometric, 10 µm", Some(1)),
            ("control_10um", Some(2)),
            ("hybrid, 10 µm", Some(3)),
            ("S6", None),
        ] {
            assert_eq!(model_number(name), number, "{name}");
        }
    }

    #[test]
    fn accounts_have_the_colours_of_their_fates() {
        for (account, end) in [
            ("absorbed_by_ground_mirror", PathEnd::AbsorbedMirror),
            ("absorbed_by_box_top", PathEnd::AbsorbedLed),
            ("absorbed_by_fence", PathEnd::AbsorbedSurface),
            ("absorbed_in_silicone", PathEnd::AbsorbedMedium),
            ("lost_to_leaks", PathEnd::Lost),
        ] {
            assert_eq!(fate_of_account(account), end, "{account}");
        }
        assert_eq!(fate_variable(PathEnd::AbsorbedLed), "--absorbed-led");
        assert!(style_sheet().contains("--hybrid: #d55e00;"));
    }
}
