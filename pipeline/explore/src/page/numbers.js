// SPDX-License-Identifier: MIT OR Apache-2.0
// Numbers of the design: sliders of pinned ones, fields of all.

const numbers = { faults: new Map(), pins: null, moving: null };

const isPinned = (field) => numbers.pins.includes(field.path);
function pin(field) {
  numbers.pins = isPinned(field) ? numbers.pins.filter((path) => path !== field.path) : [...numbers.pins, field.path];
  memory.write("pins", numbers.pins);
  showNumbers(true);
}

// At most one request of a slider is under way; the newest value is sent when it is back.
const turning = { busy: false, next: null };
async function turn(path, value, part) {
  if (turning.busy) {
    turning.next = [path, value, part];
    return;
  }
  turning.busy = true;
  try {
    await send("set", { path, value, part });
    numbers.faults.delete(path);
  } catch (error) {
    if (!error.isSaid) numbers.faults.set(path, error.message);
    showNumbers(false);
  }
  turning.busy = false;
  const next = turning.next;
  turning.next = null;
  if (next) turn(...next);
}

const isLogarithmic = (field) => field.low > 0 && field.high / field.low > 100;
const STEPS = 1000;
const toSlider = (field, value) => (isLogarithmic(field) ? Math.log(value / field.low) / Math.log(field.high / field.low) : (value - field.low) / (field.high - field.low)) * STEPS;
function fromSlider(field, at) {
  const value = isLogarithmic(field) ? field.low * (field.high / field.low) ** (at / STEPS) : field.low + ((field.high - field.low) * at) / STEPS;
  return field.whole ? Math.round(value) : Number(value.toPrecision(4));
}
const stepOf = (field) => (field.whole ? 1 : 10 ** Math.floor(Math.log10(Math.max(Math.abs(field.value), 1e-9)) - 1));

// The row of a number; its parts follow `update`.
function row(path, slides) {
  let field = null;
  const id = `${slides ? "slider" : "number"}-${path}`;
  const unit = el("span", { class: "unit" });
  const name = el("span");
  const doc = el("p", { class: "doc", hidden: true });
  const number = el("input", { type: "number", id, step: "any", onchange: () => { if (number.value !== "") turn(path, Number(number.value), false); } });
  number.addEventListener("keydown", (event) => {
    if (!["ArrowUp", "ArrowDown"].includes(event.key)) return;
    event.preventDefault();
    const value = Number((Number(number.value) + (event.key === "ArrowUp" ? 1 : -1) * stepOf(field)).toPrecision(10));
    number.value = value;
    turn(path, value, false);
  });
  const range = slides && el("input", {
    type: "range", min: 0, max: STEPS, step: 1, "aria-label": path,
    oninput: () => {
      numbers.moving = path;
      number.value = fromSlider(field, range.value);
      turn(path, Number(number.value), true);
    },
    onchange: () => {
      numbers.moving = null;
      turn(path, Number(number.value), false);
    },
  });
  const more = el("button", { type: "button", class: "pin", "aria-label": `What ${path} means`, title: "what it means", onclick: () => { doc.hidden = !doc.hidden; } }, "?");
  const pins = el("button", { type: "button", class: "pin", onclick: () => pin(field) }, slides ? "×" : "📌");
  const fault = el("p", { class: "fault", role: "alert" });
  const node = el("div", { class: "slider", "data-path": path },
    el("label", { class: "name", for: id }, name, " ", unit, el("small", {}, path)), number, more, pins, range, doc, fault);
  return {
    node,
    update(now) {
      // A slider keeps its range while the value lies within.
      const keeps = field && now.value >= field.low && now.value <= field.high;
      field = keeps ? { ...now, low: field.low, high: field.high } : now;
      name.textContent = field.label;
      unit.textContent = field.unit;
      doc.textContent = field.doc;
      node.title = field.doc;
      node.classList.toggle("default", !field.written);
      pins.setAttribute("aria-label", `${isPinned(field) ? "Take the slider from" : "Give a slider to"} ${path}`);
      pins.setAttribute("aria-pressed", String(isPinned(field)));
      const said = numbers.faults.get(path);
      fault.textContent = said || "";
      number.setAttribute("aria-invalid", String(Boolean(said)));
      if (document.activeElement !== number && !said) number.value = Number(field.value.toPrecision(7));
      if (range && numbers.moving !== path && document.activeElement !== range) {
        range.value = toSlider(field, field.value);
        range.setAttribute("aria-valuetext", `${field.value} ${field.unit}`);
      } else if (range) range.setAttribute("aria-valuetext", `${number.value} ${field.unit}`);
    },
  };
}

const rows = { sliders: new Map(), numbers: new Map() };
function showNumbers(isAnew) {
  if (!numbers.pins) numbers.pins = memory.read("pins", state.fields.filter((field) => field.pinned).map((field) => field.path));
  for (const [place, slides] of [["sliders", true], ["numbers", false]]) {
    const fields = state.fields.filter((field) => !slides || isPinned(field));
    const known = rows[place];
    const paths = fields.map((field) => field.path).join("\n");
    if (isAnew || known.paths !== paths) {
      const focused = document.activeElement && document.activeElement.id;
      const nodes = [];
      let table = null;
      for (const field of fields) {
        if (!known.has(field.path)) known.set(field.path, row(field.path, slides));
        if (!slides && field.table !== table) nodes.push(el("h3", {}, field.table));
        table = field.table;
        nodes.push(known.get(field.path).node);
      }
      byId(place).replaceChildren(...nodes);
      known.paths = paths;
      if (focused && byId(focused)) byId(focused).focus();
    }
    fields.forEach((field) => known.get(field.path).update(field));
  }
  find();
}
function find() {
  const words = byId("search").value.toLowerCase();
  for (const node of byId("numbers").querySelectorAll(".slider")) {
    node.hidden = !`${node.dataset.path} ${node.title}`.toLowerCase().includes(words);
  }
}
byId("search").addEventListener("input", find);
onState(() => showNumbers(false));
