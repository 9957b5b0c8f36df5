// SPDX-License-Identifier: MIT OR Apache-2.0
// Numbers of the design: sliders of pinned ones, fields of all.

const numbers = { pins: null, moving: null };

const isPinned = (field) => numbers.pins.includes(field.path);
function pin(field) {
  numbers.pins = isPinned(field) ? numbers.pins.filter((path) => path !== field.path) : [...numbers.pins, field.path];
  memory.write("pins", numbers.pins);
  showNumbers();
}

// What the newest good design has at a path, to be compared.
function keptAt(path) {
  const found = [...state.fields, ...state.curves].find((one) => one.path === path);
  return JSON.stringify(found && (found.value ?? found.values ?? found.points));
}
const isTurning = (path) => [queue.underWay, ...queue.waiting].some((one) => one && one.address === "set" && one.body.path === path);
// Sets a value, `part` while a slider moves. Of those that wait one after the other, the newest of each path is sent.
function turn(path, value, part) {
  sendBegun();
  const { waiting } = queue;
  for (let i = waiting.length - 1; i >= 0 && waiting[i].address === "set"; i -= 1) {
    const { body } = waiting[i];
    // The end of a drag stays apart from the next one.
    if (body.path === path && (body.part || !part)) waiting.splice(i, 1);
  }
  post("set", { path, value, part }).then(() => faults.delete(path), (error) => {
    if (!error.isSaid) faults.set(path, { message: error.message.replace(/\.$/, ""), kept: keptAt(path) });
  });
}
onState(() => {
  for (const [path, { kept }] of faults) if (kept !== keptAt(path)) faults.delete(path);
});

// Positions of a slider: even steps of a round size or, over wide ranges, even ratios.
const RATIOS = 1000;
function scale(field) {
  const { low, high, whole } = field;
  if (low > 0 && high / low > 100 && !whole) {
    return {
      most: RATIOS,
      at: (value) => (RATIOS * Math.log(value / low)) / Math.log(high / low),
      value: (at) => Number((low * (high / low) ** (at / RATIOS)).toPrecision(3)),
    };
  }
  const power = whole ? 0 : Math.floor(Math.log10((high - low) / 200));
  const step = 10 ** power;
  const first = Math.ceil(low / step - 1e-9);
  return {
    most: Math.floor(high / step + 1e-9) - first,
    at: (value) => value / step - first,
    value: (at) => Number(((first + Number(at)) * step).toFixed(Math.max(0, -power))),
  };
}
// What an arrow key adds to a number.
function stepOf(field) {
  if (field.whole) return 1;
  return 10 ** Math.floor(Math.log10(field.value === 0 ? (field.high - field.low) / 20 : Math.abs(field.value) / 10));
}

// The row of a number; its parts follow `update`.
function row(path, slides) {
  let field = null;
  let isTyping = false;
  const id = `${slides ? "slider" : "number"}-${path}`;
  const unit = el("span", { class: "unit" });
  const name = el("span");
  const words = el("span");
  const unset = el("button", { type: "button", onclick: () => sendOrSay("unset", { path }) }, "Back to the default");
  const doc = el("p", { class: "doc", id: `${id}-doc`, hidden: true }, words, " ", unset);
  const fault = el("p", { class: "fault", role: "alert", id: `${id}-fault` });
  const set = (value, part) => {
    number.value = value;
    isTyping = false;
    turn(path, value, part);
  };
  const number = el("input", {
    type: "number", id, step: "any", "aria-describedby": `${id}-fault ${id}-doc`,
    oninput: () => { isTyping = true; },
    onchange: () => { if (number.value !== "") set(Number(number.value), false); },
    onblur: () => { isTyping = false; showNumbers(); },
    onkeydown: (event) => {
      const sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (!sign) return;
      event.preventDefault();
      set(Number((Number(number.value) + sign * stepOf(field)).toPrecision(10)), false);
    },
  });
  beginsWith(() => { if (isTyping && number.value !== "") set(Number(number.value), false); });
  const range = slides && el("input", {
    type: "range", min: 0, step: 1, "aria-labelledby": `${id}-name`,
    oninput: () => {
      numbers.moving = path;
      set(scale(field).value(range.value), true);
      range.setAttribute("aria-valuetext", `${number.value} ${field.unit}`);
    },
    onchange: () => {
      numbers.moving = null;
      set(scale(field).value(range.value), false);
    },
  });
  const more = el("button", { type: "button", class: "pin", "aria-label": `What ${path} means`, "aria-expanded": "false", title: "what it means", onclick: () => {
    doc.hidden = !doc.hidden;
    more.setAttribute("aria-expanded", String(!doc.hidden));
  } }, "?");
  const pins = el("button", { type: "button", class: "pin", onclick: () => pin(field) });
  const node = el("div", { class: "slider", "data-path": path },
    el("label", { class: "name", for: id, id: `${id}-name` }, name, " ", unit, el("small", {}, path)), number, more, pins, range, doc, fault);
  return {
    node,
    update(now, label) {
      // A slider keeps its range until its value reaches an end.
      const keeps = field && (numbers.moving === path || (now.value > field.low && now.value < field.high));
      field = keeps ? { ...now, low: field.low, high: field.high } : now;
      name.textContent = label;
      unit.textContent = field.unit;
      words.textContent = `${field.doc}${field.written ? "" : " This is the default: the file does not state it."}`;
      unset.hidden = !field.written || path.endsWith("]");
      node.title = field.doc;
      node.classList.toggle("default", !field.written);
      pins.textContent = isPinned(field) ? "×" : "+";
      pins.title = `${isPinned(field) ? "Take the slider from" : "Give a slider to"} ${path}`;
      pins.setAttribute("aria-label", pins.title);
      const said = faults.get(path);
      fault.textContent = said ? `${said.message}; the design keeps ${Number(field.value.toPrecision(7))} ${field.unit}`.trimEnd() : "";
      number.setAttribute("aria-invalid", String(Boolean(said)));
      if (isTyping || isTurning(path) || said || numbers.moving === path) return;
      number.value = Number(field.value.toPrecision(7));
      if (!range) return;
      range.max = scale(field).most;
      range.value = scale(field).at(field.value);
      range.setAttribute("aria-valuetext", `${number.value} ${field.unit}`);
    },
  };
}

const rows = { sliders: new Map(), numbers: new Map() };
// The label of a field; beside others of the same name with the table before it.
function labelAmong(fields, field) {
  if (fields.every((other) => other === field || other.label !== field.label)) return field.label;
  const table = field.path.slice(0, field.path.lastIndexOf(".")).replace(/[.[\]_]+/g, " ").trim();
  return `${table} ${field.label}`;
}
// Puts the rows of `fields` into `host`; what has the focus keeps it.
function place(host, known, fields, slides) {
  const nodes = fields.map((field) => {
    if (!known.has(field.path)) known.set(field.path, row(field.path, slides));
    known.get(field.path).update(field, labelAmong(fields, field));
    return known.get(field.path).node;
  });
  if (nodes.length !== host.childElementCount || nodes.some((node, i) => node !== host.children[i])) {
    const { activeElement } = document;
    host.replaceChildren(...nodes);
    if (host.contains(activeElement)) activeElement.focus();
  }
}
function showNumbers() {
  if (!state) return;
  if (!numbers.pins) numbers.pins = memory.read("pins", state.fields.filter((field) => field.pinned).map((field) => field.path));
  place(byId("sliders"), rows.sliders, state.fields.filter(isPinned), true);
  const tables = [...new Set(state.fields.map((field) => field.table))];
  const shown = [...byId("numbers").children].map((node) => node.dataset.table);
  if (tables.join() !== shown.join()) {
    byId("numbers").replaceChildren(...tables.map((table) => el("details", { "data-table": table }, el("summary", {}, table), el("div"))));
  }
  for (const node of byId("numbers").children) {
    place(node.lastChild, rows.numbers, state.fields.filter((field) => field.table === node.dataset.table), false);
  }
}
byId("search").addEventListener("input", () => {
  const words = byId("search").value.trim().toLowerCase();
  for (const table of byId("numbers").children) {
    const all = [...table.lastChild.children];
    for (const node of all) node.hidden = !`${node.dataset.path} ${node.title}`.toLowerCase().includes(words);
    table.hidden = all.every((node) => node.hidden);
    table.open = words !== "" && !table.hidden;
  }
});
onState(showNumbers);

// Folds stay as the user left them.
onState(() => {
  if (numbers.folds) return;
  numbers.folds = memory.read("folds", {});
  for (const fold of document.querySelectorAll("details[id^=fold]")) {
    fold.open = numbers.folds[fold.id] ?? fold.open;
    fold.addEventListener("toggle", () => {
      numbers.folds[fold.id] = fold.open;
      memory.write("folds", numbers.folds);
    });
  }
});
