// SPDX-License-Identifier: MIT OR Apache-2.0
// Elements, requests, and the newest state and frame. Every other script builds on this one.

"use strict";
const byId = (id) => document.getElementById(id);
function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}
const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
const svg = (tag, attributes, ...children) => fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

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
function take(next) {
  state = next;
  tell("state");
}
async function ask(address) {
  const answer = await fetch(address, { cache: "no-store" });
  if (answer.status === 204) return null;
  const body = await answer.json();
  if (!answer.ok) throw new Error(body.error ? body.error.message : answer.statusText);
  return body;
}
// Refused values, by the path that was set.
const faults = new Map();
// Changes sent, and those not yet answered.
const sent = { count: 0, underWay: 0 };
async function send(address, body = {}) {
  let answer;
  let said;
  sent.count += 1;
  sent.underWay += 1;
  try {
    answer = await fetch(address, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
    said = await answer.json();
  } catch {
    say(ENDED);
    throw Object.assign(new Error(ENDED), { isSaid: true });
  } finally {
    sent.underWay -= 1;
    setTimeout(follow);
  }
  if (!answer.ok) throw new Error(said.error.message);
  say("");
  // All but one number may be other than it was.
  if (address !== "set") faults.clear();
  take(said);
  return said;
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
    while ((told.state > seen.state && sent.underWay === 0) || told.frame > seen.frame) {
      const now = told;
      if (now.frame > seen.frame) {
        frame = (await ask("frame")) || frame;
        seen.frame = now.frame;
        if (frame) tell("frame");
      }
      if (now.state > seen.state && sent.underWay === 0) {
        const { count } = sent;
        const next = await ask("state");
        if (count === sent.count) {
          seen.state = now.state;
          take(next);
        }
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
