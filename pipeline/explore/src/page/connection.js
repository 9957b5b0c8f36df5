// SPDX-License-Identifier: MIT OR Apache-2.0
// Requests, and the newest state and frame. Every script of this page builds on this one.

let state = null;
let frame = null;
const listeners = { state: [], frame: [] };
const onState = (listener) => listeners.state.push(listener);
const onFrame = (listener) => listeners.frame.push(listener);
const tell = (kind) => listeners[kind].forEach((listener) => listener());

function say(words) {
  byId("message").hidden = !words;
  byId("message").textContent = words || "";
}
// Takes a state, unless a newer one is there.
function take(next) {
  if (state && next.number < state.number) return;
  state = next;
  seen.state = Math.max(seen.state, next.number);
  tell("state");
}
// What a refusal says.
async function refusal(answer) {
  const words = await answer.text();
  let said = null;
  try { said = JSON.parse(words).error.message; } catch { /* it is plain text */ }
  return Object.assign(new Error(said || words || answer.statusText), { status: answer.status });
}
async function ask(address) {
  const answer = await fetch(address, { cache: "no-store" });
  if (answer.status === 204) return null;
  if (!answer.ok) throw await refusal(answer);
  return answer.json();
}

// Requests that change something, in the order in which the user acted; one at a time is under way.
const queue = { waiting: [], underWay: null, sent: 0, begun: [], settled: [] };
const isSettled = () => !queue.underWay && queue.waiting.length === 0;
// Calls `sendIt` before any other request: it sends what the user has begun and not yet sent.
const beginsWith = (sendIt) => queue.begun.push(sendIt);
const sendBegun = () => queue.begun.forEach((sendIt) => sendIt());
// Done when all that the user did is answered.
function settle() {
  sendBegun();
  return isSettled() ? Promise.resolve() : new Promise((done) => { queue.settled.push(done); });
}
// Puts a request into the queue. A `body` that is a function is asked when its turn comes.
function post(address, body = {}) {
  return new Promise((done, refuse) => {
    queue.waiting.push({ address, body, done, refuse });
    work();
  });
}
async function work() {
  if (queue.underWay) return;
  while (queue.waiting.length > 0) {
    const request = queue.waiting.shift();
    queue.underWay = request;
    queue.sent += 1;
    try {
      request.done(await answerTo(request));
    } catch (error) {
      request.refuse(error);
      if (error.isSaid) queue.waiting.splice(0).forEach((other) => other.refuse(error));
    }
    // Who waits for the answer acts before the next request.
    await null;
    queue.underWay = null;
  }
  queue.settled.splice(0).forEach((done) => done());
  tell("state");
  follow();
}
async function answerTo({ address, body }) {
  const content = typeof body === "function" ? body() : body;
  let answer;
  try {
    answer = await fetch(address, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content) });
  } catch {
    say(ENDED);
    throw Object.assign(new Error(ENDED), { isSaid: true });
  }
  if (!answer.ok) throw await refusal(answer);
  const next = await answer.json();
  say("");
  // With another text every number may be other than it was.
  if (address !== "set" && next.text !== state.text) faults.clear();
  take(next);
  return next;
}
// Refused values by the path that was set: the message, and what the design keeps.
const faults = new Map();
// Sends after all that was begun.
function send(address, body) {
  sendBegun();
  return post(address, body);
}
// The same, with a refusal below the bar.
const sendOrSay = (address, body) => send(address, body).catch((error) => { if (!error.isSaid) say(error.message); });

// What the user chose, by the file.
const memory = {
  key: (name) => `batwing-explore ${state.file} ${name}`,
  read(name, otherwise) {
    try { return JSON.parse(localStorage.getItem(this.key(name))) ?? otherwise; } catch { return otherwise; }
  },
  write(name, value) {
    try { localStorage.setItem(this.key(name), JSON.stringify(value)); } catch { /* it is forgotten */ }
  },
};

// Numbers of the newest state and frame as the server tells them, and of those that the page has.
let told = { state: 0, frame: 0 };
let seen = { state: 0, frame: 0 };
let isFollowing = false;
async function follow() {
  if (isFollowing) return;
  isFollowing = true;
  try {
    // While a change is under way, its answer is the next state.
    while ((told.state > seen.state && isSettled()) || told.frame > seen.frame) {
      const now = told;
      if (now.frame > seen.frame) {
        frame = (await ask("frame")) || frame;
        seen.frame = now.frame;
        if (frame) tell("frame");
      }
      if (now.state > seen.state && isSettled()) {
        const { sent } = queue;
        const next = await ask("state");
        if (sent === queue.sent && isSettled()) take(next);
      }
    }
  } catch (error) {
    say(error.message);
  }
  isFollowing = false;
}
const ENDED = "The server has ended; the pictures stay. Start batwing explore again.";
const events = new EventSource("events");
events.onmessage = (message) => {
  told = JSON.parse(message.data);
  follow();
};
events.onopen = () => {
  seen = { state: 0, frame: 0 };
  if (byId("message").textContent === ENDED) say("");
};
events.onerror = () => say(ENDED);
