// SPDX-License-Identifier: MIT OR Apache-2.0
// Elements, numbers, angles: what every page and script builds on.

const byId = (id) => document.getElementById(id);

// Sets attributes, listeners of events (`on...`) and children; what is null, undefined or false is left out.
function fill(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat().filter((child) => child !== undefined && child !== null && child !== false));
  return node;
}
const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
const svg = (tag, attributes, ...children) => fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

// Sixteen-bit numbers from base 64.
function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Uint16Array.from({ length: bytes.length >> 1 }, (_, i) => view.getUint16(2 * i, true));
}
const STEPS = 65535;

const minus = (text) => text.replace("-", "\u2212");
// A number to so many significant digits, without the power of ten where it reads well without.
function digits(x, count = 3) {
  if (!Number.isFinite(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size < 1e-3 || size >= 1e5) {
    const [mantissa, power] = x.toExponential(count - 1).split("e");
    return `${minus(String(Number(mantissa)))}·10${superscript(Number(power))}`;
  }
  return minus(String(Number(x.toPrecision(count))));
}
const superscript = (n) => [...String(n)].map((c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("");

const radians = (degrees) => (degrees * Math.PI) / 180;
const degrees = (angle) => (angle * 180) / Math.PI;
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
