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
// Sends a change; the error of a refusal has the key that it is about.
async function send(address, body = {}) {
  let answer;
  try {
    answer = await fetch(address, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  } catch {
    say("The server has ended; start batwing explore again.");
    throw Object.assign(new Error("The server has ended."), { isSaid: true });
  }
  const said = await answer.json();
  if (!answer.ok) throw Object.assign(new Error(said.error.message), { key: said.error.key });
  say("");
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

let seen = { state: 0, frame: 0 };
let asking = Promise.resolve();
const events = new EventSource("events");
events.onmessage = (message) => {
  const now = JSON.parse(message.data);
  asking = asking.then(async () => {
    if (now.state > seen.state) take(await ask("state"));
    if (now.frame > seen.frame) {
      const next = await ask("frame");
      if (next) { frame = next; tell("frame"); }
    }
    seen = now;
  }).catch((error) => say(error.message));
};
events.onopen = () => { seen = { state: 0, frame: 0 }; say(""); };
events.onerror = () => say("The server has ended; the pictures stay. Start batwing explore again.");
