// SPDX-License-Identifier: MIT OR Apache-2.0
// Data of the page, its parts, and numbers with their errors.

const data = JSON.parse(document.getElementById("data").textContent);

// Colours of light that surfaces let through and send back, as in every picture, and of errors: s, p and both together.
const COLOURS = ["transmitted", "reflected", "neutral-1", "neutral-2", "neutral-3"];
const colour = (i) => `var(--${COLOURS[i]})`;

// Value ± error, the error to two digits, the value to the same decimal.
function withError(value, error) {
  if (!(error > 0)) return digits(value, 4);
  const size = Math.max(Math.abs(value), error);
  const power = size < 1e-3 || size >= 1e5 ? Math.floor(Math.log10(size)) : 0;
  const scale = 10 ** -power;
  const decimals = Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(error * scale))));
  const text = `${minus((value * scale).toFixed(decimals))} ± ${(error * scale).toFixed(decimals)}`;
  return power ? `(${text})·10${superscript(power)}` : text;
}

// Round steps over a range.
function ticks(low, high, most) {
  const raw = (high - low) / Math.max(1, most);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw * 0.75);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
}
function logTicks(low, high, most = 8) {
  const first = Math.ceil(Math.log10(low) - 1e-9);
  const last = Math.floor(Math.log10(high) + 1e-9);
  const step = Math.max(1, Math.ceil((last - first) / most));
  const list = [];
  for (let power = first; power <= last; power += step) list.push(10 ** power);
  return list;
}
// Names of evenly spaced ticks: as many decimals as their step has.
function tickName(list) {
  const step = list.length > 1 ? Math.abs(list[1] - list[0]) : Math.abs(list[0]);
  const most = Math.max(...list.map(Math.abs));
  if (!(step > 0) || most < 1e-3 || most >= 1e5) return (t) => digits(t);
  const decimals = Math.max(0, Math.ceil(-Math.log10(step * 1.001)));
  return (t) => minus((Math.abs(t) < step / 2 ? 0 : t).toFixed(decimals));
}
const powerName = (t) => (t < 1e-3 || t >= 1e4 ? `10${superscript(Math.round(Math.log10(t)))}` : digits(t));
// Index of the entry of an ascending list that is nearest to x.
function nearest(list, x) {
  let best = 0;
  for (let i = 1; i < list.length; i += 1) if (Math.abs(list[i] - x) < Math.abs(list[best] - x)) best = i;
  return best;
}

// One section of the page: should its script fail, it says so and the others go on.
function part(section, run) {
  try {
    run();
  } catch (error) {
    console.error(error);
    byId(section).append(el("p", { class: "quick" }, `This part could not be drawn: ${error.message}`));
  }
}

// Width to draw for: that of the screen's layout or, on the way to paper, that of A4 between its margins.
const PAPER = { whole: 688, half: 336 };
let printing = false;
function widthOf(host) {
  if (!printing) return host.clientWidth;
  return host.closest(".pair") ? PAPER.half : PAPER.whole;
}

// Draws now, and again whenever the place for it changes its width: letters keep their size on every screen and on paper.
function responsive(host, draw) {
  let width = 0;
  const measure = () => {
    const now = Math.round(widthOf(host));
    if (now > 0 && now !== width) {
      width = now;
      draw(width);
    }
  };
  measure();
  new ResizeObserver(() => {
    if (!printing && !window.matchMedia("print").matches) measure();
  }).observe(host);
  for (const [event, paper] of [["beforeprint", true], ["afterprint", false]]) {
    window.addEventListener(event, () => {
      printing = paper;
      measure();
    });
  }
  return () => { if (width > 0) draw(width); };
}
