// SPDX-License-Identifier: MIT OR Apache-2.0
//! The server on the loopback address: who may ask, what is answered.
//!
//! Every address begins with a secret that the page's own address holds. Requests for another host
//! (a name that was made to point here) and from pages of another origin are refused, bodies are
//! bounded, and nothing that a page sends names a file.

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use serde_json::{Value, json};
use tiny_http::{Header, Method, Request, Response, Server};

use files::run_context::RunContext;

use crate::fault::Fault;
use crate::search::Search;
use crate::session::Session;
use crate::tracer_thread::trace_jobs;
use crate::{Actions, Options, page, search_thread};

/// Port where none is asked for.
pub const PORT: u16 = 4747;
/// Bytes that a body may have.
const MAX_BODY: u64 = 4 << 20;
/// Time between signs of life of a stream, and between looks at the file.
const BEAT: Duration = Duration::from_millis(500);
/// Content that the page may hold.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'self' http://localhost:* http://127.0.0.1:* https://localhost:* vscode-webview:";
/// The same of a report, whose scripts stand within it: it runs apart from the page.
const REPORT_POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; sandbox allow-scripts allow-modals";

type Answer = Response<std::io::Cursor<Vec<u8>>>;

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
    let open = |port: u16| Server::http(("127.0.0.1", port));
    let server = match options.port {
        // What a browser remembers of the page belongs to its port.
        None => open(PORT).or_else(|_| open(0)).map_err(|error| anyhow!("no port: {error}"))?,
        Some(port) => open(port).map_err(|error| {
            anyhow!("--port: expected a port that is free, or 0 for any, got {port}: {error}")
        })?,
    };
    let address = server.server_addr().to_ip().context("expected an address of this machine")?;
    let port = address.port();
    let host = Host { port, token: token()?, session: &session, options, actions, context };
    ready(&format!("http://127.0.0.1:{port}/{}/", host.token))?;
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
            heard = server.recv_timeout(BEAT / 2).map(|request| {
                if let Some(request) = request {
                    let host = &host;
                    scope.spawn(move || host.answer(request));
                }
            });
        }
        session.end();
        heard.context("no more requests can be heard")
    })?;
    if session.is_unsaved() {
        let file = options.design.display();
        context
            .console
            .warn(&format!("{file}: the draft was not saved; its page still shows the text"));
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

struct Host<'a> {
    port: u16,
    token: String,
    session: &'a Session,
    options: &'a Options,
    actions: &'a dyn Actions,
    context: RunContext<'a>,
}

impl Host<'_> {
    fn answer(&self, mut request: Request) {
        let answer = match self.address(&request) {
            Err(refused) => refused,
            Ok(address) => match (request.method().clone(), &*address) {
                (Method::Get, "events") => return self.stream(request),
                (Method::Get, address) => self.get(address),
                (Method::Post, "optimise") => return self.search(request),
                (Method::Post, address) => self.post(address, &mut request),
                _ => plain(405, "expected GET or POST"),
            },
        };
        // Who has gone away needs no answer.
        let _ = request.respond(answer);
    }

    /// The address below the secret, of a request that may be made.
    fn address(&self, request: &Request) -> Result<String, Answer> {
        let header = |name: &'static str| {
            let mut all = request.headers().iter();
            all.find(|header| header.field.equiv(name)).map(|header| header.value.as_str())
        };
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let host = header("Host").unwrap_or_default();
        if !hosts.iter().any(|own| own == host) {
            return Err(plain(403, "expected a request for this machine"));
        }
        let is_own = |origin: &str| origin == format!("http://{host}");
        let posts = *request.method() == Method::Post;
        let origin = header("Origin");
        if origin.map_or(posts, |origin| !is_own(origin)) {
            return Err(plain(403, "expected a request from the page itself"));
        }
        let below = request.url().strip_prefix('/').and_then(|url| url.strip_prefix(&*self.token));
        match below.and_then(|below| below.strip_prefix('/')) {
            Some("") => Ok(String::new()),
            Some(_) if header("Sec-Fetch-Site") == Some("cross-site") => {
                Err(plain(403, "expected a request from the page itself"))
            }
            Some(address) => Ok(address.to_owned()),
            None => Err(plain(404, "nothing is here")),
        }
    }

    fn get(&self, address: &str) -> Answer {
        let (path, query) = address.split_once('?').unwrap_or((address, ""));
        match path {
            "" => bytes(200, "text/html; charset=utf-8", page::HTML.into()),
            "page.js" => bytes(200, "text/javascript; charset=utf-8", page::script().into()),
            "page.css" => bytes(200, "text/css; charset=utf-8", page::style().into()),
            "state" => of_json(200, &self.session.to_json()),
            "frame" => match self.session.frame() {
                Some(frame) => of_json(200, &frame),
                None => bytes(204, "application/json", Vec::new()),
            },
            "export" => self.export(query).unwrap_or_else(|fault| refused(&fault)),
            "report" => {
                self.report().unwrap_or_else(|fault| plain(fault.status(), fault.message()))
            }
            _ => plain(404, "nothing is here"),
        }
    }

    fn post(&self, address: &str, request: &mut Request) -> Answer {
        let body = match body(request) {
            Ok(body) => body,
            Err(answer) => return answer,
        };
        match self.change(address, &body) {
            Some(Ok(())) => of_json(200, &self.session.to_json()),
            Some(Err(fault)) => refused(&fault),
            None => plain(404, "nothing is here"),
        }
    }

    /// Begins a search, answers, and searches.
    fn search(&self, mut request: Request) {
        let session = self.session;
        let begun = body(&mut request).and_then(|body| {
            let asked = serde_json::from_value(body).map_err(|e| Fault::new(e.to_string()));
            let begun =
                asked.and_then(|asked| search_thread::begin(session, asked, &self.options.out));
            begun.map_err(|fault| refused(&fault))
        });
        let (answer, begun) = match begun {
            Ok(begun) => (of_json(200, &session.to_json()), Some(begun)),
            Err(answer) => (answer, None),
        };
        let _ = request.respond(answer);
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
            "keep" => session.keep(),
            "beside" => session.put_beside(body["id"].as_u64()),
            "restore" => id().and_then(|id| session.restore(id)),
            "forget" => id().map(|id| session.forget(id)),
            "optimise/stop" => {
                session.peek(Search::stop);
                Ok(())
            }
            "optimise/take" => search_thread::take(session),
            _ => return None,
        })
    }

    fn export(&self, query: &str) -> Result<Answer, Fault> {
        let word = query.strip_prefix("format=").unwrap_or_default();
        let writer = files::formats::WRITERS.iter().find(|writer| writer.word == word);
        let writer = writer.ok_or_else(|| Fault::new(format!("no format is called {word:?}")))?;
        let (design, model, _) = self.session.present()?;
        let name = format!("{}.{}", design.name, writer.endings[0]);
        let written = self.in_scratch(|folder, context| {
            let out = folder.join(&name);
            self.actions.export(&design, word, model, &out, context)?;
            Ok(std::fs::read(&out)?)
        })?;
        let answer = bytes(200, "application/octet-stream", written);
        let attached = format!("attachment; filename=\"{name}\"");
        Ok(answer.with_header(header("Content-Disposition", &attached)))
    }

    fn report(&self) -> Result<Answer, Fault> {
        let (design, model, _) = self.session.present()?;
        let page = self
            .in_scratch(|folder, context| self.actions.report(&design, model, folder, context))?;
        Ok(with_policy(200, "text/html; charset=utf-8", page.into(), REPORT_POLICY))
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
        let mut to = request.into_writer();
        let _viewer = self.session.enter();
        let head = "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n";
        let mut told = to.write_all(head.as_bytes()).and_then(|()| to.flush());
        let mut seen = [0; 2];
        while told.is_ok() {
            let Some(now) = self.session.wait(seen, BEAT) else { break };
            let words = if now == seen {
                ": alive\n\n".to_owned()
            } else {
                format!("data: {{\"state\": {}, \"frame\": {}}}\n\n", now[0], now[1])
            };
            seen = now;
            told = to.write_all(words.as_bytes()).and_then(|()| to.flush());
        }
    }
}

/// The body of a request: an object of JSON.
fn body(request: &mut Request) -> Result<Value, Answer> {
    let mut body = Vec::new();
    let read = request.as_reader().take(MAX_BODY + 1).read_to_end(&mut body);
    if read.is_err() || body.len() as u64 > MAX_BODY {
        let fault = Fault::new(format!("expected at most {MAX_BODY} bytes"));
        return Err(with_status(413, &fault));
    }
    match serde_json::from_slice(&body) {
        Ok(body @ Value::Object(_)) => Ok(body),
        _ => Err(refused(&Fault::new("expected an object of JSON"))),
    }
}

/// A header of printable ASCII; other letters are left out.
fn header(name: &str, value: &str) -> Header {
    let value: String = value.chars().filter(|c| (' '..='~').contains(c)).collect();
    Header::from_bytes(name, value).expect("printable ASCII")
}

fn of_json(status: u16, value: &Value) -> Answer {
    bytes(status, "application/json", value.to_string().into())
}

fn refused(fault: &Fault) -> Answer {
    with_status(fault.status(), fault)
}

fn with_status(status: u16, fault: &Fault) -> Answer {
    of_json(status, &json!({"error": fault}))
}

fn plain(status: u16, words: &str) -> Answer {
    bytes(status, "text/plain; charset=utf-8", words.into())
}

fn bytes(status: u16, kind: &str, content: Vec<u8>) -> Answer {
    with_policy(status, kind, content, POLICY)
}

fn with_policy(status: u16, kind: &str, content: Vec<u8>, policy: &str) -> Answer {
    // The length of what is there is known.
    let answer = Response::from_data(content).with_chunked_threshold(usize::MAX);
    let answer = answer.with_status_code(status);
    [
        ("Content-Type", kind),
        ("Content-Security-Policy", policy),
        ("Cache-Control", "no-store"),
        ("X-Content-Type-Options", "nosniff"),
        ("Referrer-Policy", "no-referrer"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
    ]
    .into_iter()
    .fold(answer, |answer, (name, value)| answer.with_header(header(name, value)))
}
