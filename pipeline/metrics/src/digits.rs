// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers for people: a value and its standard error to as many digits as the error leaves
//! meaning to [JCGM 100:2008, 7.2.6].

/// `75.31 ± 0.12`: the error to two significant digits, the value to the same decimal; very large
/// and very small numbers with a common power of ten, `(1.234 ± 0.012)e-9`.
///
/// An error of exactly 0 shows as `± 0`, an unknown one (NaN) as `± ?`, a value that is not finite
/// as `n/a`.
pub fn format_value_with_error(value: f64, error: f64) -> String {
    let digits = Digits::new(value, error);
    if digits.error.is_empty() {
        return digits.value;
    }
    match digits.power {
        0 => format!("{} ± {}", digits.value, digits.error),
        power => format!("({} ± {})e{power}", digits.value, digits.error),
    }
}

/// A value and its standard error written to the same decimal.
pub struct Digits {
    /// The value.
    pub value: String,
    /// Its error; empty where the value is not finite.
    pub error: String,
    /// Power of ten that both are to be multiplied by.
    pub power: i32,
    /// Decimals of the value, where numbers beside it should have as many.
    pub decimals: usize,
}

impl Digits {
    /// The error to two significant digits, the value to the same decimal.
    pub fn new(value: f64, error: f64) -> Self {
        if !value.is_finite() {
            return Self { value: "n/a".into(), error: String::new(), power: 0, decimals: 0 };
        }
        let size = value.abs().max(if error.is_finite() { error } else { 0.0 });
        let power = if size > 0.0 && !(1e-4..1e7).contains(&size) { exponent(size, 1) } else { 0 };
        let [value, error] = [value, error].map(|number| over_power(number, power));
        if error > 0.0 && error.is_finite() {
            let decimals = 1 - exponent(error, 1);
            return Self {
                value: fixed(value, decimals),
                error: fixed(error, decimals),
                power,
                decimals: decimals.max(0) as usize,
            };
        }
        let value = shortest(value);
        Self {
            decimals: value.split_once('.').map_or(0, |(_, d)| d.len()),
            value,
            error: if error == 0.0 { "0" } else { "?" }.into(),
            power,
        }
    }
}

/// A number to two significant digits.
pub fn significant(value: f64) -> String {
    let Digits { error, power, .. } = Digits::new(value, value);
    if power == 0 { error } else { format!("{error}e{power}") }
}

/// Decimal exponent of a positive number after rounding to `digits + 1` significant digits.
fn exponent(number: f64, digits: usize) -> i32 {
    let text = format!("{number:.digits$e}");
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// `number` to so many decimals; negative decimals round before the point.
pub fn fixed(number: f64, decimals: i32) -> String {
    let text = if decimals >= 0 {
        format!("{number:.*}", decimals as usize)
    } else {
        let unit = 10f64.powi(-decimals);
        format!("{:.0}", (number / unit).round() * unit)
    };
    // A value that rounds to zero has no sign.
    if text.chars().all(|c| matches!(c, '-' | '0' | '.')) {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// `number` over a power of ten, which may be beyond the range of numbers.
fn over_power(number: f64, power: i32) -> f64 {
    let half = power / 2;
    number * 10f64.powi(-half) * 10f64.powi(half - power)
}

/// A number that is known without an error: six significant digits without trailing zeros; very
/// large and very small ones with a power of ten, `1.5e-12`.
pub fn shortest(number: f64) -> String {
    if number == 0.0 {
        return "0".into();
    }
    if number.is_finite() && !(1e-5..1e15).contains(&number.abs()) {
        let power = exponent(number.abs(), 5);
        return format!("{}e{power}", shortest(over_power(number, power)));
    }
    let text = fixed(number, 5 - exponent(number.abs(), 5));
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A whole number with commas between thousands.
pub fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_two_digits_and_values_as_many_decimals() {
        let cases = [
            ((75.312_34, 0.1234), "75.31 ± 0.12"),
            ((75.312_34, 0.0996), "75.31 ± 0.10"),
            ((75.0, 12.7), "75 ± 13"),
            ((1234.5, 123.0), "1230 ± 120"),
            ((0.591, 0.0042), "0.5910 ± 0.0042"),
            ((-0.0001, 0.12), "0.00 ± 0.12"),
            ((-2.5, 0.4), "-2.50 ± 0.40"),
            ((1.2345e-9, 1.2e-11), "(1.234 ± 0.012)e-9"),
            ((3.0e9, 2.0e7), "(3.000 ± 0.020)e9"),
            ((0.0, 3.4e-8), "(0.0 ± 3.4)e-8"),
            ((20.0, 0.0), "20 ± 0"),
            ((20.125, f64::NAN), "20.125 ± ?"),
            ((f64::NAN, 0.1), "n/a"),
            ((0.0, 0.0), "0 ± 0"),
            ((1.2345e-310, 1.2e-312), "(1.234 ± 0.012)e-310"),
            ((1.5e300, 0.0), "(1.5 ± 0)e300"),
        ];
        for ((value, error), expected) in cases {
            assert_eq!(format_value_with_error(value, error), expected);
        }
    }

    #[test]
    fn numbers_beyond_reading_have_a_power_of_ten() {
        for (number, text) in [
            (1e-300, "1e-300"),
            (-2.345_678_9e-12, "-2.34568e-12"),
            (3.0e15, "3e15"),
            (1.5e-9, "1.5e-9"),
            (2e-5, "0.00002"),
            (123_456_789.0, "123457000"),
        ] {
            assert_eq!(shortest(number), text);
        }
    }

    #[test]
    fn commas_stand_between_thousands() {
        for (number, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(thousands(number), text);
        }
    }

    #[test]
    fn small_numbers_keep_their_power_of_ten() {
        for (value, text) in [(0.0123, "0.012"), (5e-6, "5.0e-6"), (1.24e8, "1.2e8"), (0.0, "0")] {
            assert_eq!(significant(value), text);
        }
    }
}
