// SPDX-License-Identifier: MIT OR Apache-2.0
//! HTTP on the loopback address: one request a connection, with bounds on all that a client can make
//! the server hold or wait for.
//!
//! hyper reads and writes on a thread of its own. A request that was admitted is answered elsewhere,
//! by [`Request::respond`].

use std::convert::Infallible;
use std::future::poll_fn;
use std::io;
use std::net::TcpListener;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::task::{Context, Poll};
use std::thread::JoinHandle;
use std::time::Duration;

use hyper::body::{Body, Bytes, Frame, Incoming, SizeHint};
use hyper::header::HeaderValue;
use hyper::http::request::Parts;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{Notify, oneshot};
use tokio::time::{sleep, timeout};

/// Connections at a time; a page needs one for its events and some for a moment.
const MAX_CONNECTIONS: usize = 32;
/// Headers of a request, and bytes of its head.
const MAX_HEADERS: usize = 64;
const MAX_HEAD: usize = 32 << 10;
/// Bytes that a body may have, and bytes that are heard before a longer one is refused.
pub const MAX_BODY: usize = 4 << 20;
const MAX_HEARD: usize = 8 * MAX_BODY;
/// Time in which a head has to arrive, and a body; and in which an answer has to be taken.
const ARRIVAL: Duration = Duration::from_secs(5);
const DELIVERY: Duration = Duration::from_mins(1);
/// Pause after a connection that could not be accepted.
const PAUSE: Duration = Duration::from_millis(100);

/// An answer.
pub type Answer = Response<Content>;

/// Content of an answer.
#[derive(Debug)]
pub enum Content {
    /// Bytes of known length.
    Whole(Bytes),
    /// Parts that follow one another until their sender is dropped.
    Stream(tokio::sync::mpsc::Receiver<Bytes>),
}

impl Body for Content {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        let next = match self.get_mut() {
            Self::Whole(bytes) => Poll::Ready((!bytes.is_empty()).then(|| std::mem::take(bytes))),
            Self::Stream(parts) => parts.poll_recv(context),
        };
        next.map(|part| part.map(|part| Ok(Frame::data(part))))
    }

    fn size_hint(&self) -> SizeHint {
        match self {
            Self::Whole(bytes) => SizeHint::with_exact(bytes.len() as u64),
            Self::Stream(_) => SizeHint::default(),
        }
    }
}

/// A request that was admitted.
#[derive(Debug)]
pub struct Request {
    /// The method.
    pub method: Method,
    /// The address that the gate made of the head.
    pub address: String,
    /// The body; `None` of one that is too long or did not arrive.
    pub body: Option<Vec<u8>>,
    answer: oneshot::Sender<Answer>,
}

impl Request {
    /// Answers.
    pub fn respond(self, answer: Answer) {
        // Who has gone away needs no answer.
        let _ = self.answer.send(answer);
    }
}

/// The address of a request that may be made, or the answer to another.
pub trait Gate: Fn(&Parts) -> Result<String, Box<Answer>> + Send + Sync + 'static {}

impl<T: Fn(&Parts) -> Result<String, Box<Answer>> + Send + Sync + 'static> Gate for T {}

/// A running server; it ends when it is dropped.
#[derive(Debug)]
pub struct Server {
    requests: Receiver<Request>,
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Serves `listener`; bodies are read of requests that `gate` admits, and of no others.
    ///
    /// # Errors
    /// A system without threads or events.
    pub fn start(listener: TcpListener, gate: impl Gate) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let (admitted, requests) = mpsc::channel();
        let (end, ended) = oneshot::channel();
        let serve = move |runtime: Runtime| {
            runtime.block_on(async {
                if let Ok(listener) = tokio::net::TcpListener::from_std(listener) {
                    tokio::spawn(accept(listener, Arc::new(gate), admitted));
                    let _ = ended.await;
                }
            });
        };
        let thread = std::thread::Builder::new().name("http".to_owned());
        let thread = thread.spawn(|| serve(runtime))?;
        Ok(Self { requests, end: Some(end), thread: Some(thread) })
    }

    /// The next request within `time`.
    ///
    /// # Errors
    /// The server has broken off.
    pub fn next(&self, time: Duration) -> io::Result<Option<Request>> {
        match self.requests.recv_timeout(time) {
            Ok(request) => Ok(Some(request)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.end.take());
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// A connection; true where its request is being answered.
struct Connection {
    is_served: Arc<AtomicBool>,
    task: tokio::task::JoinHandle<()>,
}

/// Accepts connections, whatever becomes of any of them.
async fn accept(listener: tokio::net::TcpListener, gate: Arc<impl Gate>, to: Sender<Request>) {
    let mut connections: Vec<Connection> = Vec::new();
    loop {
        let accepted = listener.accept().await;
        connections.retain(|connection| !connection.task.is_finished());
        if connections.len() >= MAX_CONNECTIONS || accepted.is_err() {
            // The oldest that has asked for nothing makes room.
            let idle = connections.iter().position(|one| !one.is_served.load(Ordering::Relaxed));
            match idle.map(|oldest| connections.remove(oldest).task) {
                Some(oldest) => {
                    oldest.abort();
                    let _ = oldest.await;
                }
                None => sleep(PAUSE).await,
            }
        }
        let accepted = accepted.ok().filter(|_| connections.len() < MAX_CONNECTIONS);
        if let Some((stream, _)) = accepted {
            let is_served = Arc::new(AtomicBool::new(false));
            let served = serve(stream, Arc::clone(&gate), to.clone(), Arc::clone(&is_served));
            connections.push(Connection { is_served, task: tokio::spawn(served) });
        }
    }
}

/// Serves a connection to its end.
async fn serve(
    stream: tokio::net::TcpStream,
    gate: Arc<impl Gate>,
    to: Sender<Request>,
    is_served: Arc<AtomicBool>,
) {
    let answered = Notify::new();
    let (gate, to, is_served, is_answered) = (&*gate, &to, &*is_served, &answered);
    let service = service_fn(|request| async move {
        let answer = answer(request, gate, to, is_served).await;
        if matches!(answer.body(), Content::Whole(_)) {
            is_answered.notify_one();
        }
        Ok::<_, Infallible>(answer)
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(ARRIVAL).keep_alive(false);
    http.max_headers(MAX_HEADERS).max_buf_size(MAX_HEAD);
    let mut connection = pin!(http.serve_connection(TokioIo::new(stream), service));
    let mut is_late = pin!(async {
        answered.notified().await;
        sleep(DELIVERY).await;
    });
    poll_fn(|context| match connection.as_mut().poll(context) {
        Poll::Ready(_) => Poll::Ready(()),
        Poll::Pending => is_late.as_mut().poll(context),
    })
    .await;
}

async fn answer(
    request: hyper::Request<Incoming>,
    gate: &impl Gate,
    to: &Sender<Request>,
    is_served: &AtomicBool,
) -> Answer {
    let (head, body) = request.into_parts();
    let address = match gate(&head) {
        Ok(address) => address,
        Err(refused) => return *refused,
    };
    is_served.store(true, Ordering::Relaxed);
    let body = timeout(ARRIVAL, read(body)).await.ok().flatten();
    let (answer, answered) = oneshot::channel();
    // A server that ends, and an answer that breaks off, are the same to a client.
    let _ = to.send(Request { method: head.method, address, body, answer });
    answered.await.unwrap_or_else(|_| plain(500, "the answer broke off"))
}

/// A body of at most [`MAX_BODY`] bytes.
async fn read(mut body: Incoming) -> Option<Vec<u8>> {
    let (mut bytes, mut heard) = (Vec::new(), 0);
    // A length is a claim: nothing is set aside for it.
    if body.size_hint().lower() > MAX_HEARD as u64 {
        return None;
    }
    while let Some(frame) = poll_fn(|context| Pin::new(&mut body).poll_frame(context)).await {
        let data = frame.ok()?.into_data().unwrap_or_default();
        heard += data.len();
        if heard > MAX_HEARD {
            return None;
        }
        // The client hears the refusal of more once it has sent all.
        if heard <= MAX_BODY {
            bytes.extend_from_slice(&data);
        }
    }
    (heard <= MAX_BODY).then_some(bytes)
}

/// Content that the page may hold.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'self' http://localhost:* http://127.0.0.1:* https://localhost:* vscode-webview:";
/// The same of a report, whose scripts stand within it: it runs apart from the page.
const REPORT_POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; sandbox allow-scripts allow-modals";

/// An answer of plain words.
pub fn plain(status: u16, words: &str) -> Answer {
    whole(status, "text/plain; charset=utf-8", words.to_owned())
}

/// An answer of this content.
pub fn whole(status: u16, kind: &str, content: impl Into<Bytes>) -> Answer {
    with_headers(status, kind, Content::Whole(content.into()), POLICY)
}

/// A page of results.
pub fn report(page: String) -> Answer {
    let page = Content::Whole(page.into());
    with_headers(200, "text/html; charset=utf-8", page, REPORT_POLICY)
}

/// A stream of events.
pub fn events(parts: tokio::sync::mpsc::Receiver<Bytes>) -> Answer {
    with_headers(200, "text/event-stream", Content::Stream(parts), POLICY)
}

fn with_headers(status: u16, kind: &str, content: Content, policy: &str) -> Answer {
    let headers = [
        ("Content-Type", kind),
        ("Content-Security-Policy", policy),
        ("Cache-Control", "no-store"),
        ("X-Content-Type-Options", "nosniff"),
        ("Referrer-Policy", "no-referrer"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
    ];
    let answer = Response::builder().status(status);
    let answer = headers
        .into_iter()
        .fold(answer, |answer, (name, value)| answer.header(name, header_value(value)));
    answer.body(content).expect("a known status and known headers")
}

/// A value of printable ASCII; other letters are left out.
pub fn header_value(value: &str) -> HeaderValue {
    let value: String = value.chars().filter(|c| (' '..='~').contains(c)).collect();
    HeaderValue::from_str(&value).expect("printable ASCII")
}
