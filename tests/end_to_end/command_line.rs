// SPDX-License-Identifier: MIT OR Apache-2.0
//! The command line as the program reads it: options, examples, messages, exit codes.

use std::path::Path;

use anyhow::Context;
use clap::{CommandFactory, Parser};

use experiment::checked_file::Texts;
use pipeline::cli::{Cli, Command};
use pipeline::{cli_errors, exit};
use runtime::interrupt::{Interrupt, Stopped};
use runtime::progress::Closed;

fn said(line: &str) -> String {
    let words = std::iter::once("batwing").chain(line.split_whitespace());
    cli_errors::message(&Cli::try_parse_from(words).expect_err(line), &Cli::command())
}

#[test]
fn every_mistake_has_its_line() {
    for (line, expected) in [
        ("run d.toml --threads 0", "--threads: expected a whole number from 1 to 1024, got \"0\""),
        (
            "--threads two run d.toml",
            "--threads: expected a whole number from 1 to 1024, got \"two\"",
        ),
        (
            "run d.toml --seed -1",
            "--seed: expected a whole number from 0 to 18446744073709551615, got \"-1\"",
        ),
        (
            "run d.toml --paths 10",
            "--paths: expected a whole number from 1000 to 1000000000000, such as 1000000, 1_000_000 or 1e6, got \"10\"",
        ),
        (
            "run d.toml --paths -5",
            "--paths: expected a whole number from 1000 to 1000000000000, such as 1000000, 1_000_000 or 1e6, got \"-5\"",
        ),
        (
            "run d.toml --model hybird",
            "--model: expected geometric, fine, control, hybrid or all, got \"hybird\"; did you mean hybrid?",
        ),
        ("run d.toml --paths", "--paths: expected N, got nothing"),
        ("run d.toml --out --quiet", "--out: expected DIR, got nothing"),
        (
            "run d.toml --thread 2",
            "expected options that `batwing run --help` lists, got --thread; did you mean --threads?",
        ),
        (
            "run d.toml more.toml",
            "expected no more than `batwing run --help` lists, got \"more.toml\"",
        ),
        ("run d.toml --quiet=no", "--quiet: expected no value, got \"no\""),
        ("run d.toml --seed 1 --seed 2", "--seed: expected once, got more than once"),
        ("run", "run: expected DESIGN.toml, got nothing of it"),
        ("converge", "converge: expected --ring N and DESIGN.toml, got nothing of it"),
        (
            "run d.toml --most-paths 5000",
            "run: expected --until-error FIGURE=ERROR, got nothing of it",
        ),
        ("zones d.toml --levels max", "zones: expected --picture FILE, got nothing of it"),
        (
            "zones d.toml --pattern p.csv --white -0.3,0.3",
            "--white: expected x and y with a sum below 1, such as 0.3127,0.3290, or a temperature from 1000K to 25000K, got \"-0.3,0.3\"",
        ),
        (
            "run d.toml --until-error uniformity=-1%",
            "--until-error: expected an error above 0, got \"-1\"",
        ),
        (
            "bsdf d.toml --no-cache --cache c",
            "--no-cache: expected no such option beside --cache, got both",
        ),
        (
            "bsdf d.toml --rings 0",
            "--rings: expected `representatives`, `all` or ring numbers from 1 such as `5,75,165`, got `0`",
        ),
        (
            "near-field d.toml --ring 7 --theta-deg 95",
            "--theta-deg: expected an angle above -90 and below 90 degrees, got \"95\"",
        ),
        (
            "rum d.toml",
            "expected one of the commands new, reproduce, run, bsdf, study, optimise, tolerance, explore, converge, near-field, full-wave, zones, plan, submit, merge, grating, export, import, schema, report, rays, check, completions or man, got \"rum\"; did you mean run?",
        ),
    ] {
        assert_eq!(said(line), expected, "batwing {line}");
    }
    assert!(said("--quiet").ends_with("completions or man, got none"));
}

/// Whatever is given to whatever argument of whatever command: one line that names it.
#[test]
fn every_value_of_every_argument_is_refused_in_one_line() {
    let mut tried = 0;
    for command in Cli::command().get_subcommands() {
        for argument in command.get_arguments() {
            let Some(long) = argument.get_long().filter(|long| *long != "help") else {
                continue;
            };
            for value in ["", "=", "=-1", "=x y", "=1e999", "=%"] {
                let flag = format!("--{long}{value}");
                let line = ["batwing", command.get_name(), "d.toml", &flag];
                let Err(error) = Cli::try_parse_from(line) else {
                    continue;
                };
                let said = cli_errors::message(&error, &Cli::command());
                assert!(said.contains("expected ") && !said.contains('\n'), "{line:?}: {said}");
                assert!(!said.starts_with("error:"), "{line:?}: {said}");
                tried += 1;
            }
        }
    }
    assert!(tried > 50, "{tried}");
}

#[test]
fn every_command_has_one_example() {
    let cli = Cli::command();
    cli.clone().debug_assert();
    for command in cli.get_subcommands() {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        assert_eq!(help.matches("batwing ").count(), 1, "help of {}: {help}", command.get_name());
        assert!(help.contains(command.get_name()));
    }
}

#[test]
fn a_design_that_is_no_file_keeps_the_name_it_is_given() {
    let text = pipeline::commands::new::text("mine", pipeline::commands::new::Template::default())
        .expect("a good name");
    let check = |text: &str, command: &str| {
        let line = ["batwing", command, "stated.toml", "--quiet"];
        let cli = Cli::try_parse_from(line).expect("valid");
        let texts = Texts::from([("stated.toml".to_owned(), text.to_owned())]);
        cli.run_texts(texts, Path::new(""), &Interrupt::default())
    };
    check(&text, "check").expect("a good design");
    let error = check("name = 3", "check").expect_err("a name that is no text");
    assert!(error.to_string().starts_with("stated.toml: "), "{error}");
    let error = check(&text, "study").expect_err("a design is no study");
    assert!(error.to_string().starts_with("stated.toml"), "{error}");
    let error = check(&text, "grating").expect_err("no command on a design");
    assert!(error.to_string().contains("takes no text"), "{error}");
}

#[test]
fn tolerances_out_of_range_and_rings_that_are_none_are_refused() {
    for (argument, value, good) in [
        ("--tolerance", "1e-3", true),
        ("--tolerance", "0", false),
        ("--tolerance", "0.2", false),
        ("--tolerance", "nan", false),
        ("--rings", "5,75,165", true),
        ("--rings", "all", true),
        ("--rings", "0", false),
        ("--rings", "some", false),
    ] {
        let line = ["batwing", "bsdf", "d.toml", argument, value];
        assert_eq!(Cli::try_parse_from(line).is_ok(), good, "{line:?}");
    }
    for (theta, good) in [("-40", true), ("90", false), ("nan", false)] {
        let line = ["batwing", "near-field", "d.toml", "--ring", "7", "--theta-deg", theta];
        assert_eq!(Cli::try_parse_from(line).is_ok(), good, "{line:?}");
    }
    let both = ["batwing", "bsdf", "d.toml", "--no-cache", "--cache", "c"];
    assert!(Cli::try_parse_from(both).is_err());
}

#[test]
fn common_arguments_go_before_and_after_the_command() {
    for line in [
        ["batwing", "--seed", "7", "--json", "check", "d.toml"],
        ["batwing", "check", "d.toml", "--seed", "7", "--json"],
    ] {
        let cli = Cli::try_parse_from(line).expect("valid");
        assert_eq!((cli.common.seed, cli.common.json), (7, true));
    }
}

/// Numbers of paths as people write them.
#[test]
fn numbers_of_paths_are_written_as_people_write_them() {
    let paths = |text: &str| {
        Cli::try_parse_from(["batwing", "full-wave", "d.toml", &format!("--paths={text}")])
    };
    for (text, number) in
        [("640000", 640_000), ("1_000_000", 1_000_000), ("1e6", 1_000_000), ("2.5e6", 2_500_000)]
    {
        let Ok(Cli { command: Command::FullWave(of), .. }) = paths(text) else {
            panic!("{text}: refused");
        };
        assert_eq!(of.paths, number, "{text}");
    }
    for text in ["", "0", "-5", "1.5", "1e300", "nan", "many", "1e-3", "0x10"] {
        let said = said(&format!("full-wave d.toml --paths={text}"));
        assert!(said.contains("expected a whole number from "), "{text}: {said}");
    }
}

#[test]
fn a_cause_is_printed_once() {
    let missing = std::fs::File::open("no/such/file").unwrap_err();
    let text = missing.to_string();
    let nested = tempfile::Builder::new().tempfile_in("no/such").unwrap_err();
    let said = exit::message(&anyhow::Error::new(nested).context("cannot write"));
    assert_eq!(said.matches(&text).count(), 1, "{said}");
    let said = exit::message(&anyhow::Error::new(missing).context("x.toml: cannot read it"));
    assert_eq!(said, format!("x.toml: cannot read it: {text}"));
}

#[test]
fn exit_codes_follow_the_cause() {
    assert_eq!(exit::report(&anyhow::anyhow!("no such file")), 1);
    let terminated = Stopped { line: "interrupted".to_owned(), exit_code: 143 };
    assert_eq!(exit::report(&terminated.into()), 143);
    let closed = Err::<(), _>(Closed).context("while printing").unwrap_err();
    assert_eq!(exit::report(&closed), 141);
}
