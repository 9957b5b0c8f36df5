// SPDX-License-Identifier: MIT OR Apache-2.0
//! Counts of things in messages: "1 line", "2 lines".

/// `number` and the `thing`, in the plural unless it is one: "1 line", "2 lines".
pub fn count(number: impl std::fmt::Display, thing: &str) -> String {
    let number = number.to_string();
    let plural = if number == "1" { "" } else { "s" };
    format!("{number} {thing}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_a_kind_has_no_plural() {
        assert_eq!(count(0, "line"), "0 lines");
        assert_eq!(count(1_usize, "line"), "1 line");
        assert_eq!(count(1_u64, "order"), "1 order");
        assert_eq!(count(12, "spectral table"), "12 spectral tables");
    }
}
