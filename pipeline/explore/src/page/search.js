// SPDX-License-Identifier: MIT OR Apache-2.0
// A search from the present design, with the pinned numbers as its variables.

byId("optimise").addEventListener("click", () => {
  const pinned = state.fields.filter((field) => isPinned(field) && !field.whole);
  // What the lens is made of; pitch, plane and light are seldom free.
  const isLens = (field) => /^(dome|solids|elements\.shapes)\b/.test(field.path);
  const box = (field) => el("input", { type: "checkbox", "data-varied": field.path, "aria-label": `vary ${field.path}`, checked: isLens(field) || !pinned.some(isLens) });
  const bound = (field, side) => el("input", { type: "number", step: "any", value: field[side], "data-path": field.path, "data-side": side, "aria-label": `${field.path} ${side === "low" ? "from" : "to"}` });
  byId("search-ranges").replaceChildren(...pinned.map((field) => el("tr", {}, el("td", {}, el("label", {}, box(field), " ", field.path)), el("td", {}, bound(field, "low")), el("td", {}, bound(field, "high")))));
  // Of other figures neither the larger nor the smaller value is better.
  const sought = frame ? frame.figures.filter((figure) => figure.larger_is_better !== null) : [];
  const figures = sought.map(({ key, label, larger_is_better, meaning }) => [key, `${label}, to ${larger_is_better ? "grow" : "fall"}`, meaning]);
  options(byId("search-figure"), figures, figures.some(([key]) => key === "uniformity") ? "uniformity" : figures.length ? figures[0][0] : "");
  byId("search-error").textContent = "";
  byId("search-dialog").showModal();
});
byId("search-close").addEventListener("click", () => byId("search-dialog").close());
const inSearch = (address, body) => send(address, body).then(() => true, (error) => {
  byId("search-error").textContent = error.message;
  return false;
});
byId("search-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const ranges = {};
  byId("search-error").textContent = "";
  for (const varied of byId("search-ranges").querySelectorAll("input:checked")) {
    const path = varied.dataset.varied;
    const ends = [...varied.closest("tr").querySelectorAll("input[type=number]")];
    if (ends.some((input) => input.value === "")) {
      byId("search-error").textContent = `${path}: expected a number at both ends`;
      return;
    }
    ranges[path] = ends.map((input) => Number(input.value));
  }
  if (!(await isReady())) {
    byId("search-error").textContent = byId("message").textContent;
    return;
  }
  inSearch("optimise", { figure: byId("search-figure").value, paths: Object.keys(ranges), ranges, generations: Number(byId("search-generations").value) });
});
byId("search-stop").addEventListener("click", () => inSearch("optimise/stop"));
byId("search-take").addEventListener("click", async () => { if (await inSearch("optimise/take")) byId("search-dialog").close(); });
onState(() => {
  const search = state.search || { running: false, found: false, lines: [], error: null };
  byId("search-start").disabled = search.running;
  byId("search-stop").disabled = !search.running;
  byId("search-take").disabled = !search.found;
  const lines = search.running && search.lines.length === 0 ? ["the search has begun"] : search.lines;
  byId("search-lines").replaceChildren(...[...lines, ...(search.found ? ["a design was found"] : [])].map((words) => el("li", {}, words)));
  if (search.error) byId("search-error").textContent = search.error;
  byId("optimise").textContent = search.running ? "Optimising …" : "Optimise from here";
});
