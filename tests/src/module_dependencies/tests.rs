// SPDX-License-Identifier: MIT OR Apache-2.0
use super::*;

/// What is wrong in a made-up crate of these files.
fn wrong(files: &[(&str, &str)], floors: &str) -> Vec<String> {
    let text = format!("```floors made_up\n{floors}\n```\n");
    let floors = super::floors(&text, "made_up").expect("a block");
    let read = |path: &str| {
        let file = files.iter().find(|(name, _)| path == format!("src/{name}"));
        file.map(|(_, text)| (*text).to_owned())
    };
    let violations = Crate::read("src", &read).violations(&floors);
    violations.iter().map(Violation::to_string).collect()
}

#[test]
fn floors_are_read_from_their_block() {
    let text = "# Floors\n```floors a\none two\n\nthree\n```\n```floors b\nfour\n```\n";
    assert_eq!(
        floors(text, "a"),
        Some(vec![vec!["one".to_owned(), "two".into()], vec!["three".into()]])
    );
    assert_eq!(floors(text, "b"), Some(vec![vec!["four".to_owned()]]));
    assert_eq!(floors(text, "c"), None);
}

#[test]
fn arrows_upwards_and_sideways_are_found() {
    let files = [
        ("lib.rs", "pub mod high;\nmod low;\nmod side;\nmod base;"),
        ("high.rs", "use crate::{low::Low, base};\nuse std::fs;"),
        ("low.rs", "use crate::side::Side;\npub struct Low;"),
        ("side.rs", "pub struct Side;\nfn f() { crate::base::f(); }"),
        ("base.rs", "pub fn f() {\n    let x = super::high::g();\n}"),
    ];
    let found = wrong(&files, "high\nlow side\nbase");
    assert_eq!(
        found,
        [
            "src/base.rs:2: base -> high: upwards, base stands below high",
            "src/low.rs:1: low -> side: sideways, low and side stand on one floor",
        ]
    );
}

#[test]
fn the_list_and_the_modules_agree() {
    let files =
        [("lib.rs", "mod a;\nmod b;\n#[cfg(test)]\nmod testing;"), ("a.rs", ""), ("b/mod.rs", "")];
    assert_eq!(
        wrong(&files, "a\nc\na"),
        [
            "a: stands on two floors",
            "b: stands on no floor",
            "c: stands on a floor, but there is no such module",
        ]
    );
    assert!(wrong(&files, "b\na").is_empty());
}

#[test]
fn cycles_are_found_at_any_depth_and_descendants_are_free() {
    let files = [
        ("lib.rs", "mod a;"),
        ("a.rs", "mod b; mod c; use b::B; pub struct A;"),
        ("a/b.rs", "mod d; use super::{A, c::C}; pub struct B;"),
        ("a/b/d.rs", "use crate::a::{A, b::B};"),
        ("a/c.rs", "\nuse crate::a::b::d; pub struct C;"),
    ];
    assert_eq!(
        wrong(&files, "a"),
        [
            "src/a/b.rs:1: a::b -> a::c: a cycle in a, b -> c -> b",
            "src/a/c.rs:2: a::c -> a::b::d: a cycle in a, c -> b -> c",
        ]
    );
}

#[test]
fn re_exports_and_imported_names_are_followed() {
    let files = [
        ("lib.rs", "mod low;\nmod high;\npub use high::High as Top;\npub use high::more::*;"),
        ("high.rs", "pub mod more; pub struct High;"),
        ("high/more.rs", "pub struct More;"),
        (
            "low.rs",
            "use crate::Top;\nuse crate as all;\nmod inner {\n    fn f(_: super::super::More) {}\n}\nfn g() { all::high::h(); }",
        ),
    ];
    let found = wrong(&files, "high\nlow");
    assert_eq!(
        found,
        [
            "src/low.rs:1: low -> high: upwards, low stands below high",
            "src/low.rs:4: low::inner -> high::more: upwards, low stands below high",
        ]
    );
    let through = [
        ("lib.rs", "mod low;\nmod high;"),
        ("high.rs", "pub fn h() {}"),
        ("low.rs", "use crate as all;\nfn g() { all::high::h(); }"),
    ];
    assert_eq!(
        wrong(&through, "high\nlow"),
        ["src/low.rs:2: low -> high: upwards, low stands below high"]
    );
}

#[test]
fn tests_and_comments_are_left_out() {
    let files = [
        ("lib.rs", "mod a;\nmod b;"),
        (
            "a.rs",
            "//! See [`crate::b`].\n#[cfg(test)]\nuse crate::{b::One, b::Two};\n#[cfg(test)]\nconst X: B = B { x: crate::b::X };\n\
             #[cfg(all(test, unix))]\npub(crate) fn f() -> [u8; 3] { crate::b::f() }\nconst Y: &str = \"crate::b\"; // crate::b\n\
             #[cfg(test)]\nmod tests {\n    use crate::b;\n}\n#[cfg(not(test))]\nuse crate::b::g;\n",
        ),
        ("b.rs", ""),
    ];
    assert_eq!(wrong(&files, "b\na"), ["src/a.rs:14: a -> b: upwards, a stands below b"]);
}
