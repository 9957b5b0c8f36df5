// SPDX-License-Identifier: MIT OR Apache-2.0
// Pictures, figures and ledger of the newest frame.

const choices = { map: "map", far: "far_field" };
const NAMES = { map: "linear", map_log: "logarithmic", difference: "now less kept", far_field: "straight", far_field_polar: "polar" };

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
function showChoices(host, place, ids) {
  if (!ids.includes(choices[place])) [choices[place]] = ids;
  const button = (id) => el("button", { type: "button", "aria-pressed": String(choices[place] === id), onclick: () => { choices[place] = id; showLight(); } }, NAMES[id]);
  byId(host).replaceChildren(...ids.flatMap((id) => [button(id), " "]));
}
function showLight() {
  const of = (id) => frame.pictures.find((picture) => picture.id === id);
  showPicture("package", of("package"));
  showPicture("cross_section", of("cross_section"));
  for (const [host, place, ids] of [["of-map", "map", ["map", "map_log", "difference"]], ["of-far", "far", ["far_field", "far_field_polar"]]]) {
    const there = ids.filter(of);
    const focused = byId(host).contains(document.activeElement) && document.activeElement.textContent;
    showChoices(host, place, there);
    if (focused) [...byId(host).children].filter((one) => one.textContent === focused).forEach((one) => one.focus());
    showPicture(place, of(choices[place]));
  }
}
function showFigures() {
  const main = frame.figures.filter((figure) => figure.main);
  byId("largest").replaceChildren(...main.map((figure) => el("div", {}, figure.label, el("b", { class: figure.resolved ? null : "open" }, figure.text),
    figure.change && el("span", {}, figure.change.startsWith(figure.verdict) ? figure.change : `${figure.change}, ${figure.verdict}`))));
  const compares = frame.figures.some((figure) => figure.beside !== null);
  for (const head of document.querySelectorAll(".compared")) head.hidden = !compares;
  const cell = (label, text) => el("td", { "data-label": label }, el("span", { class: "value" }, text ?? "–"));
  const row = (figure) => el("tr", {}, el("th", { scope: "row" }, figure.label), cell("now", figure.text),
    compares && [cell("kept", figure.beside), cell("change", figure.change), cell("beyond errors", figure.verdict)]);
  byId("figures").replaceChildren(...frame.figures.map(row));
  byId("ledger").replaceChildren(...frame.ledger.flatMap((one) => {
    const bar = el("dd", {}, one.text);
    bar.style.setProperty("--share", `${100 * one.share}%`);
    return [el("dt", {}, one.label), bar];
  }));
  byId("warnings").replaceChildren(...frame.warnings.map((words) => el("li", {}, words)));
}
function showProgress() {
  if (!state) return;
  const isOld = frame && (frame.state < state.state || state.error);
  byId("pictures").classList.toggle("stale", Boolean(isOld));
  byId("pictures").classList.toggle("refused", Boolean(frame && state.error));
  byId("stale").hidden = !(frame && state.error);
  byId("stale").textContent = state.error ? `The pictures are those of the last good design. ${state.error.message}` : "";
  const traced = frame ? `${frame.label}: ${frame.paths_text} paths, ${isOld ? "of the state before" : frame.last ? "done" : "going on"}` : "tracing";
  const waves = frame && !isOld && frame.waves;
  byId("progress").textContent = waves ? `${traced}; ${waves.words}` : traced;
  byId("waves").hidden = !waves || waves.solved === waves.rings;
  if (waves) [byId("waves").max, byId("waves").value] = [waves.rings, waves.solved];
}
onFrame(() => { showLight(); showFigures(); showProgress(); });
onState(showProgress);
