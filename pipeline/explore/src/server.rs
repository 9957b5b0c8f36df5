// SPDX-License-Identifier: MIT OR Apache-2.0
//! The server on the loopback address: who may ask, what is answered.
//!
//! Every address begins with a secret that the page's own address holds. Requests for another host
//! (a name that was made to point here) and from pages of another origin are refused, bodies are
//! bounded, and nothing that a page sends names a file.

use std::fmt::Write as _;
use std::net::TcpListener;
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use hyper::Method;
use hyper::header::{CONTENT_DISPOSITION, HeaderValue};
use hyper::http::request::Parts;
use serde_json::{Value, json};
use tokio::sync::mpsc;

use runtime::run_context::RunContext;
use runtime::serde_messages::key_text;

use crate::fault::Fault;
use crate::http::{self, Answer, MAX_BODY, Request, Server, plain, whole};
use crate::search::Search;
use crate::session::Session;
use crate::tracer_thread::trace_jobs;
use crate::{Actions, Options, page, search_thread};

/// Port where none is asked for.
pub const PORT: u16 = 4747;
/// Time between signs of life of a stream, and between looks at the file.
const BEAT: Duration = Duration::from_millis(500);
/// Shows the design until `context` is interrupted; `ready` is told the address.
///
/// # Errors
/// A file that is no design; a port that is not free.
pub fn serve(
    options: &Options,
    actions: &dyn Actions,
    context: RunContext,
    ready: impl FnOnce(&str) -> Result<()>,
) -> Result<()> {
    let session = Session::open(&options.design)?;
    let open = |port: u16| TcpListener::bind(("127.0.0.1", port));
    let listener = match options.port {
        // What a browser remembers of the page belongs to its port.
        None => open(PORT).or_else(|_| open(0)).map_err(|error| anyhow!("no port: {error}"))?,
        Some(port) => open(port).map_err(|error| {
            anyhow!("--port: expected a port that is free, or 0 for any, got {port}: {error}")
        })?,
    };
    let port = listener.local_addr().context("expected an address of this machine")?.port();
    let token = token()?;
    let address = format!("http://127.0.0.1:{port}/{token}/");
    let server = Server::start(listener, move |head: &Parts| admitted(head, port, &token))?;
    let host = Host { session: &session, options, actions, context };
    ready(&address)?;
    std::thread::scope(|scope| {
        scope.spawn(|| trace_jobs(&session, &options.cache, context));
        scope.spawn(|| {
            while session.wait([u64::MAX; 2], Duration::ZERO).is_some() {
                std::thread::sleep(BEAT);
                session.watch();
                search_thread::follow(&session);
            }
        });
        let mut heard = Ok(());
        while heard.is_ok() && !context.interrupt.is_raised() {
            heard = server.next(BEAT / 2).map(|request| {
                if let Some(request) = request {
                    let host = &host;
                    scope.spawn(move || host.answer(request));
                }
            });
        }
        session.end();
        // Who waits to tell a page something need not.
        drop(server);
        heard.context("no more requests can be heard")
    })?;
    if session.is_unsaved() {
        let (file, draft) = (options.design.display(), session.draft_path().display());
        let fate = session
            .unkept()
            .unwrap_or_else(|| format!("`{draft}` keeps it, and the next start offers it"));
        context.console.warn(&format!("{file}: the draft was not saved; {fate}"));
    }
    Ok(())
}

/// A secret of 128 bits.
fn token() -> Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| anyhow!("no random numbers: {error}"))?;
    let mut text = String::new();
    for byte in bytes {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    Ok(text)
}

/// The address below the secret, of a request that may be made.
fn admitted(head: &Parts, port: u16, token: &str) -> Result<String, Box<Answer>> {
    let header = |name: &str| head.headers.get(name).map(HeaderValue::as_bytes);
    let host = header("Host").unwrap_or_default();
    let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}"));
    if !hosts.iter().any(|own| own.as_bytes() == host) {
        return Err(Box::new(plain(403, "expected a request for this machine")));
    }
    let is_own = |origin: &[u8]| origin.strip_prefix(b"http://") == Some(host);
    let posts = head.method == Method::POST;
    if header("Origin").map_or(posts, |origin| !is_own(origin)) {
        return Err(Box::new(plain(403, "expected a request from the page itself")));
    }
    let address = head.uri.path_and_query().map_or("", |address| address.as_str());
    let below = address.strip_prefix('/').and_then(|address| address.strip_prefix(token));
    match below.and_then(|below| below.strip_prefix('/')) {
        Some("") => Ok(String::new()),
        Some(_) if header("Sec-Fetch-Site") == Some(b"cross-site") => {
            Err(Box::new(plain(403, "expected a request from the page itself")))
        }
        Some(address) => Ok(address.to_owned()),
        None => Err(Box::new(plain(404, "nothing is here"))),
    }
}

struct Host<'a> {
    session: &'a Session,
    options: &'a Options,
    actions: &'a dyn Actions,
    context: RunContext<'a>,
}

impl Host<'_> {
    fn answer(&self, request: Request) {
        let answer = match (&request.method, &*request.address) {
            (&Method::GET, "events") => return self.stream(request),
            (&Method::GET, address) => self.get(address),
            (&Method::POST, "optimise") => return self.search(request),
            (&Method::POST, address) => self.post(address, request.body.as_deref()),
            _ => plain(405, "expected GET or POST"),
        };
        request.respond(answer);
    }

    fn get(&self, address: &str) -> Answer {
        let (path, query) = address.split_once('?').unwrap_or((address, ""));
        match path {
            "" => whole(200, "text/html; charset=utf-8", page::HTML),
            "page.js" => whole(200, "text/javascript; charset=utf-8", page::script()),
            "page.css" => whole(200, "text/css; charset=utf-8", page::style()),
            "state" => of_json(200, &self.session.to_json()),
            "frame" => match self.session.frame() {
                Some(frame) => of_json(200, &frame),
                None => whole(204, "application/json", ""),
            },
            "candidates" => {
                let from = query.strip_prefix("from=").and_then(|from| from.parse::<usize>().ok());
                of_json(200, &self.session.peek(|search| search.candidates(from.unwrap_or(0))))
            }
            "export" => self.export(query).unwrap_or_else(|fault| refused(&fault)),
            "report" => {
                self.report().unwrap_or_else(|fault| plain(fault.status(), fault.message()))
            }
            _ => plain(404, "nothing is here"),
        }
    }

    fn post(&self, address: &str, body: Option<&[u8]>) -> Answer {
        match object(body).map(|body| self.change(address, &body)) {
            Ok(Some(Ok(()))) => of_json(200, &self.session.to_json()),
            Ok(Some(Err(fault))) => refused(&fault),
            Ok(None) => plain(404, "nothing is here"),
            Err(answer) => *answer,
        }
    }

    /// Begins a search, answers, and searches.
    fn search(&self, request: Request) {
        let session = self.session;
        let begun = object(request.body.as_deref()).and_then(|body| {
            let asked = serde_path_to_error::deserialize(body)
                .map_err(|e| format!("{}: {}", key_text(e.path()), e.inner()))
                .map_err(|said| Fault::new(said.trim_start_matches(": ")));
            let begun =
                asked.and_then(|asked| search_thread::begin(session, &asked, &self.options.out));
            begun.map_err(|fault| Box::new(refused(&fault)))
        });
        let (answer, begun) = match begun {
            Ok(begun) => (of_json(200, &session.to_json()), Some(begun)),
            Err(answer) => (*answer, None),
        };
        request.respond(answer);
        if let Some(begun) = begun {
            begun.run(session, self.actions, self.context);
        }
    }

    /// Does what `address` asks for; `None` of an address that is not there.
    fn change(&self, address: &str, body: &Value) -> Option<Result<(), Fault>> {
        let session = self.session;
        let text = |key: &str| {
            let text = body[key].as_str();
            text.ok_or_else(|| Fault::new(format!("{key}: expected a text")))
        };
        let id = || body["id"].as_u64().ok_or_else(|| Fault::new("id: expected a number"));
        Some(match address {
            "set" => text("path")
                .and_then(|path| session.set(path, Some(&body["value"]), body["part"] == true)),
            "unset" => text("path").and_then(|path| session.set(path, None, false)),
            "text" => text("text").and_then(|text| session.write(text, body["edition"].as_u64())),
            "undo" | "redo" => {
                session.step(address == "redo");
                Ok(())
            }
            "model" => text("model").and_then(|word| session.choose(word)),
            "save" => session.save(body["over"] == true),
            "reload" => session.reload(),
            "draft/take" | "draft/discard" => {
                session.answer_offer(address == "draft/take");
                Ok(())
            }
            "keep" => session.keep(),
            "beside" => session.put_beside(body["id"].as_u64()),
            "restore" => id().and_then(|id| session.restore(id)),
            "forget" => id().map(|id| session.forget(id)),
            "optimise/stop" => {
                session.search(Search::stop);
                Ok(())
            }
            "optimise/take" => search_thread::take(session),
            _ => return None,
        })
    }

    fn export(&self, query: &str) -> Result<Answer, Fault> {
        let word = query.strip_prefix("format=").unwrap_or_default();
        let writer = formats::WRITERS.iter().find(|writer| writer.word == word);
        let writer = writer.ok_or_else(|| Fault::new(format!("no format is called {word:?}")))?;
        let (design, model, _) = self.session.present()?;
        let name = format!("{}.{}", design.name, writer.endings[0]);
        let written = self.in_scratch(|folder, context| {
            let out = folder.join(&name);
            self.actions.export(&design, word, model, &out, context)?;
            Ok(std::fs::read(&out)?)
        })?;
        let mut answer = whole(200, "application/octet-stream", written);
        let attached = http::header_value(&format!("attachment; filename=\"{name}\""));
        answer.headers_mut().insert(CONTENT_DISPOSITION, attached);
        Ok(answer)
    }

    fn report(&self) -> Result<Answer, Fault> {
        let (design, model, _) = self.session.present()?;
        let page = self
            .in_scratch(|folder, context| self.actions.report(&design, model, folder, context))?;
        Ok(http::report(page))
    }

    /// What `work` makes in a folder that goes afterwards, unless its page goes first.
    fn in_scratch<T>(
        &self,
        work: impl FnOnce(&std::path::Path, RunContext) -> Result<T>,
    ) -> Result<T, Fault> {
        let command = self.session.begin_command()?;
        let context = RunContext { interrupt: &command.interrupt, ..self.context.mute() };
        let made = tempfile::tempdir().context("no scratch folder");
        let done = made.and_then(|folder| work(folder.path(), context));
        done.map_err(|error| Fault::new(format!("{error:#}")))
    }

    /// Tells a page of new states and frames until it goes.
    fn stream(&self, request: Request) {
        let (to, parts) = mpsc::channel(1);
        request.respond(http::events(parts));
        let _viewer = self.session.enter();
        let mut seen = [0; 2];
        while let Some(now) = self.session.wait(seen, BEAT) {
            let words = if now == seen {
                ": alive\n\n".to_owned()
            } else {
                format!("data: {{\"state\": {}, \"frame\": {}}}\n\n", now[0], now[1])
            };
            seen = now;
            if to.blocking_send(words.into()).is_err() {
                break;
            }
        }
    }
}

/// The body of a request as an object of JSON.
fn object(body: Option<&[u8]>) -> Result<Value, Box<Answer>> {
    let Some(body) = body else {
        let fault = Fault::new(format!("expected at most {MAX_BODY} bytes, without a break"));
        return Err(Box::new(with_status(413, &fault)));
    };
    match serde_json::from_slice(body) {
        Ok(body @ Value::Object(_)) => Ok(body),
        _ => Err(Box::new(refused(&Fault::new("expected an object of JSON")))),
    }
}

fn of_json(status: u16, value: &Value) -> Answer {
    whole(status, "application/json", value.to_string())
}

fn refused(fault: &Fault) -> Answer {
    with_status(fault.status(), fault)
}

fn with_status(status: u16, fault: &Fault) -> Answer {
    of_json(status, &json!({"error": fault}))
}
