// SPDX-License-Identifier: MIT OR Apache-2.0
//! The list of commands in the reference, generated from the definitions that the help comes from.
//!
//! A page holds it between `<!-- commands -->` and `<!-- end -->`.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Arg, Command, CommandFactory};
use pipeline::cli::Cli;

const BEGIN: &str = "<!-- commands -->";
const END: &str = "<!-- end -->";

/// Fills the place of the list; `None` of a page without one.
fn fill(page: &str, cli: &Command) -> Option<String> {
    let (before, place) = page.split_once(BEGIN)?;
    let (_, after) = place.split_once(END)?;
    let mut list = table("Options of all commands", cli.get_arguments().collect());
    for command in cli.get_subcommands().filter(|command| command.get_name() != "help") {
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        let example = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let example = example.strip_prefix("Example: ").unwrap_or_default();
        let own = command.get_arguments().filter(|argument| !argument.is_global_set());
        let table = table(command.get_name(), own.collect());
        let (heading, rows) = table.split_once("\n\n")?;
        write!(list, "{heading}\n\n{about}.\n\n    {example}\n\n{rows}").ok()?;
    }
    Some(format!("{before}{BEGIN}\n\n{}\n{END}{after}", list.trim_end()))
}

/// A heading with the arguments below it, those without a name first.
fn table(name: &str, mut arguments: Vec<&Arg>) -> String {
    arguments.retain(|argument| !argument.is_hide_set() && argument.get_id() != "help");
    arguments.sort_by_key(|argument| !argument.is_positional());
    let mut text = format!("## {name}\n\n| argument | meaning | default |\n|---|---|---|\n");
    for argument in arguments {
        let values = argument.get_possible_values();
        let mut meaning = argument.get_help().map(ToString::to_string).unwrap_or_default();
        // A default in words stands at the end of the help.
        let (help, mut default) = match meaning.rsplit_once(" [default: ") {
            Some((help, default)) => (help.to_owned(), default.trim_end_matches(']').to_owned()),
            None => (meaning.clone(), String::new()),
        };
        meaning = help;
        if !values.is_empty() && argument.get_action().takes_values() {
            let words = values.iter().map(|value| format!("`{}`", value.get_name()));
            write!(meaning, ": {}", words.collect::<Vec<_>>().join(", ")).expect("a text");
        }
        if let Some(value) = argument.get_default_values().first() {
            let value = value.to_string_lossy();
            if argument.get_action().takes_values() {
                default = format!("`{value}`");
            }
        }
        let meaning = meaning.replace('|', "\\|").replace('\n', " ");
        writeln!(text, "| `{}` | {meaning} | {default} |", words(argument)).expect("a text");
    }
    text + "\n"
}

/// How an argument is written: `--paths N`, `DESIGN.toml`.
fn words(argument: &Arg) -> String {
    let names = argument.get_value_names().unwrap_or_default();
    let value = names.iter().map(clap::builder::Str::as_str).collect::<Vec<_>>().join(" ");
    let takes_value = argument.get_action().takes_values() && !value.is_empty();
    let value = if takes_value { format!(" {value}") } else { String::new() };
    match (argument.get_long(), argument.get_short()) {
        (Some(long), Some(short)) => format!("--{long}, -{short}{value}"),
        (Some(long), None) => format!("--{long}{value}"),
        _ => value.trim_start().to_owned(),
    }
}

/// Rewrites the page where `BATWING_BLESS` is set.
#[test]
fn commands_of_the_reference_are_fresh() {
    let page = "../docs/reference/command-line.md";
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(page);
    let text = std::fs::read_to_string(&path).expect("a page");
    let mut cli = Cli::command();
    cli.build();
    let fresh = fill(&text, &cli).expect("a place");
    if std::env::var_os("BATWING_BLESS").is_some() {
        std::fs::write(&path, fresh).expect("written");
    } else {
        assert!(text == fresh, "{page}: stale: test once with BATWING_BLESS=1");
    }
}
