// SPDX-License-Identifier: MIT OR Apache-2.0
// Pictures, figures and ledger of the newest frame.

// Pictures that the user chose; where one is missing, the first of its place is shown.
const choices = { map: "map", far: "far_field" };
const NAMES = { map: "linear", map_log: "logarithmic", map_colours: "colours", difference: "now less kept", far_field: "straight", far_field_polar: "polar" };

const drawn = {};
async function showPicture(place, picture) {
  const host = byId(place);
  host.hidden = !picture;
  if (!picture || drawn[place] === picture.svg) return;
  drawn[place] = picture.svg;
  const next = el("div");
  next.innerHTML = picture.svg;
  // Maps are decoded first: the picture before stays until then.
  await Promise.all([...next.querySelectorAll("image")].map((one) => Object.assign(new Image(), { src: one.getAttribute("href") }).decode().catch(() => {})));
  if (drawn[place] === picture.svg) host.replaceChildren(next, el("figcaption", {}, picture.caption));
}
function showChoices(host, place, ids, chosen) {
  const button = (id) => el("button", { type: "button", "aria-pressed": String(chosen === id), onclick: () => { choices[place] = id; showLight(); } }, NAMES[id]);
  byId(host).replaceChildren(...ids.flatMap((id) => [button(id), " "]));
}
function showLight() {
  const of = (id) => frame.pictures.find((picture) => picture.id === id);
  showPicture("package", of("package"));
  showPicture("cross_section", of("cross_section"));
  for (const [host, place, ids] of [["of-map", "map", ["map", "map_log", "map_colours", "difference"]], ["of-far", "far", ["far_field", "far_field_polar"]]]) {
    const there = ids.filter(of);
    const focused = byId(host).contains(document.activeElement) && document.activeElement.textContent;
    const chosen = there.includes(choices[place]) ? choices[place] : there[0];
    showChoices(host, place, there, chosen);
    if (focused) [...byId(host).children].filter((one) => one.textContent === focused).forEach((one) => one.focus());
    showPicture(place, of(chosen));
  }
}
// A change with its sign.
const signed = (text) => {
  const words = text.replace(/(^|[\s(])-(?=\d)/g, "$1\u2212");
  return /^\(?\d/.test(words) && !/ to |^0(?![.\d])/.test(words) ? words.replace(/^\(?/, "$&+") : words;
};
// Figures whose meaning stands beside them, by place and key.
const explained = new Set();
// The name of a figure with what it means, which a button shows.
function named(figure, place) {
  const id = `${place} ${figure.key}`;
  const isShown = explained.has(id);
  const toggle = () => {
    if (!explained.delete(id)) explained.add(id);
    showFigures();
  };
  const more = el("button", { type: "button", class: "what", "data-what": id, "aria-label": `What ${figure.label} means`, "aria-expanded": String(isShown), title: figure.meaning, onclick: toggle }, "?");
  return [el("span", { title: figure.meaning }, figure.label), " ", figure.meaning && more, isShown && el("span", { class: "doc" }, figure.meaning)];
}
function showFigures() {
  const what = document.activeElement?.dataset.what;
  const main = frame.headline.flatMap((key) => frame.figures.filter((figure) => figure.key === key));
  byId("largest").replaceChildren(...main.map((figure) => el("div", {}, named(figure, "largest"), el("b", { class: figure.resolved ? null : "open" }, figure.text),
    figure.change && el("span", {}, figure.change.startsWith(figure.verdict) ? figure.change : `${signed(figure.change)}, ${figure.verdict}`))));
  const compares = frame.figures.some((figure) => figure.beside !== null);
  for (const head of document.querySelectorAll(".compared")) head.hidden = !compares;
  const cell = (label, text) => el("td", { "data-label": label }, el("span", { class: "value" }, text ?? "–"));
  const row = (figure) => el("tr", {}, el("th", { scope: "row" }, named(figure, "table")), cell("now", figure.text),
    compares && [cell("kept", figure.beside), cell("change", figure.change && signed(figure.change)), cell("beyond errors", figure.verdict)]);
  byId("figures").replaceChildren(...frame.figures.map(row));
  if (what) document.querySelector(`[data-what="${CSS.escape(what)}"]`)?.focus();
  byId("ledger").replaceChildren(...frame.ledger.flatMap((one) => {
    const bar = el("dd", {}, one.text);
    bar.style.setProperty("--share", `${100 * one.share}%`);
    return [el("dt", {}, one.label), bar];
  }));
  byId("warnings").replaceChildren(...frame.warnings.map((words) => el("li", {}, words)));
}
// Why the pictures are not those of the newest text; nothing where they are or will be.
function trouble() {
  const { error, failed } = state;
  if (error) return `${frame ? "The pictures are those of the last good design." : "The text is no design."} ${error.message}`;
  if (!failed) return "";
  if (!frame) return `The design could not be traced: ${failed.message}`;
  return `The design could not be traced${frame.state < state.state ? "; the pictures are those of the state before" : " to its end"}: ${failed.message}`;
}
function showProgress() {
  if (!state) return;
  const words = trouble();
  const isOld = frame && (frame.state < state.state || state.error);
  byId("pictures").classList.toggle("stale", Boolean(isOld));
  byId("pictures").classList.toggle("refused", Boolean(isOld && words));
  byId("stale").hidden = !words;
  byId("stale").textContent = words;
  const now = words ? "not traced to its end" : "going on";
  const traced = frame ? `${frame.label}: ${frame.paths_text} paths, ${isOld ? "of the state before" : frame.last ? "done" : now}` : words ? "not traced" : "tracing";
  const waves = frame && !isOld && frame.waves;
  byId("progress").textContent = waves ? `${traced}; ${waves.words}` : traced;
  byId("waves").hidden = !waves || waves.solved === waves.rings;
  if (waves) [byId("waves").max, byId("waves").value] = [waves.rings, waves.solved];
}
onFrame(() => { showLight(); showFigures(); showProgress(); });
onState(showProgress);
