// SPDX-License-Identifier: MIT OR Apache-2.0
// A search from the present design: goals, constraints and variables, and its candidates in a map.

// What is seen, no part of the design that is built.
const OBSERVES = /^(receivers?|far_field|channels|trace|hybrid|files|light\.step_nm|light\.spectrum\.(samples|tolerance))\b/;
const search = { number: 0, candidates: [], asked: false, added: [], variables: new Map() };

// Figures that the design has, as problem files name them; first those at the top of the page.
const figuresHere = () => (frame ? [...frame.headline.flatMap((first) => frame.figures.filter(({ key }) => key === first)), ...frame.figures.filter(({ key }) => !frame.headline.includes(key)), ...frame.ledger.map(({ key, label, share, error }) => ({ key, label: `ledger: ${label}`, value: share, standard_error: error, larger_is_better: null, scale: null }))] : []);
const numberBox = (label, attributes) => el("input", { type: "number", step: "any", "aria-label": label, ...attributes });
// The entry of a number; nothing where it is empty.
const entry = (input) => (input.value === "" ? undefined : Number(input.value));

// A row of a figure; `more` makes the rest of it and is told when another figure is chosen.
function figureRow(host, label, key, more) {
  const select = el("select", { class: "figure", "aria-label": label });
  const node = el("div", { class: "search-row" }, select);
  const here = figuresHere();
  let wanted = here.length && here.every((figure) => figure.key !== key) ? here[0].key : key;
  const refresh = () => {
    const list = figuresHere().map((figure) => [figure.key, figure.label, figure.meaning]);
    // What was chosen stays, also where this frame lacks it.
    options(select, list.some(([word]) => word === wanted) ? list : [...list, [wanted, `${wanted} (not here)`]], wanted);
  };
  refresh();
  const parts = more(() => figuresHere().find((figure) => figure.key === wanted));
  select.addEventListener("change", () => {
    wanted = select.value;
    parts.chosen();
  });
  node.append(...parts.nodes, el("button", { type: "button", class: "pin", "aria-label": `take this ${label} away`, onclick: () => node.remove() }, "×"));
  Object.assign(node, { refresh, read: () => ({ figure: select.value, ...parts.read() }) });
  host.append(node);
  parts.chosen();
}
const addGoal = (key) => figureRow(byId("search-goals"), "goal", key, (figure) => {
  const way = el("select", { "aria-label": "way of the goal" });
  options(way, [["maximise", "to grow"], ["minimise", "to fall"], ["target", "near"]], "maximise");
  const target = numberBox("target");
  const scale = numberBox("difference that counts as 1");
  const show = () => { target.hidden = way.value !== "target"; };
  way.addEventListener("change", show);
  return {
    nodes: [way, target, el("label", {}, "a difference counts as 1: ", scale)],
    chosen() {
      const { value, larger_is_better: larger, scale: usual } = figure() || { value: 1, larger_is_better: true };
      way.value = larger === null ? "target" : larger ? "maximise" : "minimise";
      target.value = short(value);
      // A hundredth, where the figure has no scale of its own.
      scale.value = usual ?? (Number(Math.abs(value / 100).toPrecision(1)) || 1);
      show();
    },
    read: () => ({ goal: way.value, target: target.hidden ? undefined : entry(target), scale: entry(scale) }),
  };
});
const addConstraint = () => figureRow(byId("search-constraints"), "constraint", "extraction_efficiency", (figure) => {
  const [least, most] = [numberBox("at least"), numberBox("at most")];
  return {
    nodes: [el("label", {}, "at least ", least), el("label", {}, "at most ", most)],
    chosen() {
      const { value, standard_error: error, larger_is_better: larger } = figure() || { value: 0, standard_error: 0, larger_is_better: true };
      // The present design keeps it.
      const slack = Math.max(0.01 * Math.abs(value), 3 * error);
      [least.value, most.value] = larger === false ? ["", short(value + slack)] : [short(value - slack), ""];
    },
    read: () => ({ at_least: entry(least), at_most: entry(most) }),
  };
});
// The first figure of the page that is no goal yet.
on("add-goal", () => addGoal(figuresHere().map(({ key }) => key).find((key) => [...byId("search-goals").children].every((node) => node.read().figure !== key)) ?? "uniformity"));
on("add-constraint", addConstraint);

// Numbers offered at first: those of pitch, lens and films, and what has a slider or was added.
const isOffered = (field) => !OBSERVES.test(field.path) && (field.pinned || isPinned(field) || search.added.includes(field.path));
function variableRow(field, isTicked) {
  const tick = el("input", { type: "checkbox", "data-varied": field.path, checked: isTicked });
  const bound = (side, words) => numberBox(`${field.path} ${words}`, { value: short(field[side]), "data-side": side });
  const [low, high] = [bound("low", "from"), bound("high", "to")];
  const now = el("span", { class: "unit" });
  let start;
  const node = el("div", { class: "search-row" }, el("label", {}, tick, " ", field.path, " ", now), el("label", {}, "from ", low), el("label", {}, "to ", high));
  return { node, tick, update({ value, unit }) {
    start = value;
    now.textContent = `now ${short(value)} ${unit}`;
  }, read: () => ({ key: field.path, from: entry(low), to: entry(high), start }) };
}
function showVariables() {
  const offered = state.fields.filter(isOffered);
  // The lens, or all where there is none.
  const isLens = (field) => /^(dome|elements)\b/.test(field.path) && !field.whole;
  const hasLens = offered.some(isLens);
  for (const field of offered) {
    const isTicked = search.added.includes(field.path) || (field.pinned && (isLens(field) || !hasLens));
    if (!search.variables.has(field.path)) search.variables.set(field.path, variableRow(field, isTicked));
    search.variables.get(field.path).update(field);
  }
  const nodes = offered.map((field) => search.variables.get(field.path).node);
  const host = byId("search-variables");
  if (nodes.length !== host.childElementCount || nodes.some((node, i) => node !== host.children[i])) host.replaceChildren(...nodes);
  const others = state.fields.filter((field) => !isOffered(field) && !OBSERVES.test(field.path));
  options(byId("add-variable"), [["", "choose a number"], ...others.map((field) => [field.path, field.path, field.doc])], "");
}
byId("add-variable").addEventListener("change", () => {
  search.added.push(byId("add-variable").value);
  showVariables();
});

// The rows as the problem file takes them; a range without a number at both ends is refused.
function asked() {
  const read = (host) => [...byId(host).children].map((node) => node.read());
  const ticked = [...search.variables.values()].filter(({ node, tick }) => node.isConnected && tick.checked);
  const variables = ticked.map((row) => row.read());
  const open = variables.find(({ from, to }) => from === undefined || to === undefined);
  if (open) throw new Error(`${open.key}: expected a number at both ends`);
  return { goals: read("search-goals"), constraints: read("search-constraints"), variables, generations: Number(byId("search-generations").value) };
}
const complain = (words) => { byId("search-error").textContent = words; };
const inSearch = (address, body) => send(address, body).then(() => complain(""), (error) => complain(error.message));
byId("search-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  try {
    // The search starts from what the server has.
    if (await isReady()) await inSearch("optimise", asked());
    else complain(byId("message").textContent);
  } catch (error) {
    complain(error.message);
  }
});
on("search-stop", () => inSearch("optimise/stop"));
on("search-take", () => inSearch("optimise/take"));
on("optimise", () => {
  byId("fold-search").open = true;
  byId("fold-search").scrollIntoView({ block: "start" });
});

// Candidates, of which each has a number on either axis, unless it was refused.
const axes = () => [...state.search.keys, ...state.search.figures, "objective", "number of the candidate"];
function placeOn(candidate, i, axis) {
  const { keys } = state.search;
  if (axis === "objective") return candidate.objective;
  if (axis === "number of the candidate") return i + 1;
  return keys.includes(axis) ? candidate.at[keys.indexOf(axis)] : candidate.figures[axis]?.value;
}
function sayCandidate(i) {
  const { keys, best } = state.search;
  const candidate = search.candidates[i];
  const at = keys.map((key, k) => `${key} ${short(candidate.at[k])}`).join(", ");
  const figures = Object.entries(candidate.figures).map(([key, { text }]) => `${key} ${text}`).join(", ");
  const words = candidate.refused ? `refused: ${candidate.refused}` : `${figures}${candidate.feasible ? "" : "; misses a constraint"}`;
  byId("candidate").textContent = `Candidate ${i + 1}${i === best ? ", the best" : ""}: ${at}; ${words}`;
}
function drawMap() {
  const { figures, keys, best } = state.search;
  search.best = best;
  const [across, up] = [["map-across", keys[0]], ["map-up", figures[0]]].map(([id, usual]) => {
    const select = byId(id);
    const chosen = axes().includes(select.value) ? select.value : usual;
    options(select, axes().map((axis) => [axis, axis]), chosen);
    return chosen;
  });
  const points = search.candidates.map((candidate, i) => ({ candidate, i, x: placeOn(candidate, i, across), y: placeOn(candidate, i, up) }));
  const isNumber = (v) => Number.isFinite(v);
  const scaled = (name, from, to) => {
    const seen = points.map((point) => point[name]).filter(isNumber);
    const [low, high] = extent(seen.length ? seen : [0, 1]);
    return { low, high, place: (v) => from + ((v - low) / (high - low)) * (to - from) };
  };
  const [x, y] = [scaled("x", 70, 470), scaled("y", 265, 15)];
  const name = (at, anchor, words) => svg("text", { ...at, "text-anchor": anchor }, words);
  const circle = (point, r, of) => svg("circle", { cx: x.place(point.x), cy: y.place(point.y), r, class: of, onpointerenter: () => sayCandidate(point.i) }, svg("title", {}, `candidate ${point.i + 1}`));
  const marks = points.filter((point) => isNumber(point.x)).map((point) => {
    if (isNumber(point.y)) return circle(point, 4, point.candidate.feasible ? "feasible" : "missing");
    const [u, v] = [x.place(point.x), 262];
    return svg("path", { class: "refused", d: `M${u - 3} ${v - 3}l6 6m0 -6l-6 6`, onpointerenter: () => sayCandidate(point.i) });
  });
  const bests = points.filter((point) => point.i === best && isNumber(point.x) && isNumber(point.y)).map((point) => circle(point, 8, "best"));
  byId("candidates").replaceChildren(
    name({ x: 70, y: 283 }, "start", String(short(x.low))), name({ x: 470, y: 283 }, "end", String(short(x.high))), name({ x: 270, y: 296 }, "middle", across),
    name({ x: 64, y: 265 }, "end", String(short(y.low))), name({ x: 64, y: 24 }, "end", String(short(y.high))), name({ x: 76, y: 14 }, "start", `${up} (filled: feasible; cross: refused)`),
    ...marks, ...bests);
  byId("candidates").setAttribute("aria-label", `${search.candidates.length} candidates: ${up} over ${across}`);
  if (best !== null && search.candidates[best]) sayCandidate(best);
}
["map-across", "map-up"].forEach((id) => byId(id).addEventListener("change", drawMap));

// Asks for the candidates that the page has not.
async function followCandidates() {
  if (search.asked) return;
  search.asked = true;
  try {
    while (state.search && (search.number !== state.search.number || search.candidates.length < state.search.candidates)) {
      if (search.number !== state.search.number) [search.number, search.candidates] = [state.search.number, []];
      const { number, candidates } = await ask(`candidates?from=${search.candidates.length}`);
      if (number !== search.number || !candidates) break;
      search.candidates.push(...candidates);
      drawMap();
    }
  } catch (error) {
    complain(error.message);
  }
  search.asked = false;
}
function showSearch() {
  showVariables();
  const now = state.search;
  byId("search-start").disabled = Boolean(now && now.running);
  byId("search-stop").disabled = !(now && now.running);
  byId("search-take").disabled = !(now && now.found);
  byId("optimise").textContent = now && now.running ? "Optimising …" : "Optimise from here";
  byId("search-map").hidden = !now;
  if (!now) return;
  const end = now.note || (now.running ? "searching" : now.found ? "a design was found and traced anew; Take puts its values into the draft, whatever else changed meanwhile, and Undo takes it back" : "ended");
  byId("search-status").textContent = `${now.candidates} candidates, ${now.generations} generations: ${end}`;
  if (search.number === now.number && search.best !== now.best) drawMap();
  followCandidates();
}
onState(showSearch);
onFrame(() => {
  for (const host of ["search-goals", "search-constraints"]) for (const node of byId(host).children) node.refresh();
  if (!search.hasBegun) addGoal("uniformity");
  search.hasBegun = true;
});
