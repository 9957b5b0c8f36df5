// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing explore`: a design seen live in a page on the user's own machine.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use clap::{Args, Parser};

use design::Design;
use experiment::optimise::search_results::missed_constraints;
use explore::{Actions, Options, server};
use formats::{WRITERS, Writes};
use results::optimisation::OptimisationFile;
use results::sealed_file::SealedFile;
use runtime::progress::Console;
use runtime::run_context::RunContext;
use simulate::model::Model;

use super::arguments::{cache, whole};
use super::export::{self, ExportArgs};
use super::optimise::OptimiseArgs;
use super::report::{self, ReportArgs};
use super::run::{self, RunArgs};
use super::shardable::Shardable;

/// `batwing explore`.
#[derive(Debug, Args)]
pub struct ExploreArgs {
    /// Design file, which the page edits and saves
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// Port on 127.0.0.1, 0 for one that is free [default: 4747, or a free one]
    #[arg(long, value_name = "N", value_parser = whole(0..=u16::MAX))]
    pub port: Option<u16>,
    /// Print the address and open no browser
    #[arg(long)]
    pub no_open: bool,
    /// Directory for searches that the page starts
    #[arg(long, value_name = "DIR", default_value = "explored")]
    pub out: PathBuf,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the searches]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// Serves the page until Ctrl-C.
pub fn run(arguments: &ExploreArgs, context: RunContext) -> Result<()> {
    let options = Options {
        design: arguments.design.clone(),
        port: arguments.port,
        cache: cache(arguments.cache.as_deref(), &arguments.out),
        out: arguments.out.clone(),
    };
    context.interrupt.note(": the page is closed");
    let actions = Commands { cache: options.cache.directory().to_owned() };
    server::serve(&options, &actions, context, |address| {
        Console::print(address)?;
        context.console.say("the page is shown in a browser on this machine; Ctrl-C ends it");
        if !arguments.no_open && !opens(address) {
            context.console.say("no browser could be opened: open the address above in one");
        }
        Ok(())
    })
}

/// Opens the browser of the system; false where there is none.
fn opens(address: &str) -> bool {
    let (program, words): (_, &[&str]) = match std::env::consts::OS {
        "windows" => ("cmd", &["/C", "start", ""]),
        "macos" => ("open", &[]),
        _ => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(words).arg(address);
    let quiet = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    quiet.spawn().is_ok()
}

/// The commands that the page starts.
struct Commands {
    cache: PathBuf,
}

/// Arguments of a command with their defaults.
#[derive(Debug, Parser)]
struct Words<A: Args> {
    #[command(flatten)]
    arguments: A,
}

impl Commands {
    /// Arguments of a command on `input`, with the output `out` and the options `more`.
    fn arguments<A: Args>(&self, input: &Path, out: &Path, more: &[&str]) -> Result<A> {
        let words = [OsString::new(), input.into(), "--out".into(), out.into()];
        let cache = ["--cache".into(), self.cache.clone().into()];
        let words = words.into_iter().chain(cache).chain(more.iter().map(Into::into));
        Ok(Words::try_parse_from(words)?.arguments)
    }
}

impl Actions for Commands {
    fn export(
        &self,
        design: &Design,
        word: &str,
        model: Model,
        out: &Path,
        context: RunContext,
    ) -> Result<()> {
        let writer = WRITERS.iter().find(|writer| writer.word == word);
        let is_light =
            writer.is_some_and(|one| matches!(one.writes, Writes::FarField(_) | Writes::Rays(_)));
        let model = match model {
            Model::Hybrid => "hybrid",
            Model::Fine | Model::Control if is_light => bail!(
                "{word}: far fields and rays are traced in the models geometric and hybrid, not in {}: choose one of these two",
                model.word()
            ),
            _ => "geometric",
        };
        let more = ["--format", word, "--model", model];
        let input = Path::new(&design.provenance.file);
        let arguments: ExportArgs = self.arguments(input, out, &more)?;
        export::of_design(design, &arguments, context)
    }

    fn report(
        &self,
        design: &Design,
        model: Model,
        out: &Path,
        context: RunContext,
    ) -> Result<String> {
        let input = Path::new(&design.provenance.file);
        let arguments: RunArgs = self.arguments(input, out, &["--model", model.word()])?;
        run::of_design(design.clone(), &arguments, context)?;
        let page = out.join("report.html");
        let arguments =
            ReportArgs { results: out.to_owned(), out: Some(page.clone()), tables: None };
        let tables = (model == Model::Hybrid).then(|| self.cache.clone());
        report::run(&ReportArgs { tables, ..arguments }, context)?;
        std::fs::read_to_string(&page).with_context(|| format!("`{}`", page.display()))
    }

    fn optimise(
        &self,
        problem: &Path,
        (file, text): (&str, &str),
        out: &Path,
        context: RunContext,
    ) -> Result<(String, Vec<String>)> {
        let mut arguments: OptimiseArgs = self.arguments(problem, out, &[])?;
        arguments.texts.insert(file.to_owned(), text.to_owned());
        arguments.run(context)?;
        let found = out.join("design.toml");
        let text = std::fs::read_to_string(&found);
        let text = text.with_context(|| format!("`{}`", found.display()))?;
        let file = OptimisationFile::read(out)?;
        Ok((text, file.iter().flat_map(missed_constraints).collect()))
    }
}
