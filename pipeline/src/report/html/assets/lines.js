// SPDX-License-Identifier: MIT OR Apache-2.0
// Curves with bands of two standard errors and a cursor that reads them.

const HINT = "Point at the curves to read them.";

// Draws into `host`. spec: { x, y, height, curves: [{ name, x, y, e, index }], marks: [{ x, text, index }], title, aria, unit }.
function lines(host, readout, spec) {
  const width = Math.max(280, widthOf(host));
  const f = frame({ width, height: spec.height || Math.round(clamp(width * 0.62, 240, 420)), x: spec.x, y: spec.y, title: spec.title });
  for (const c of spec.curves) {
    if (c.e) {
      const upper = c.x.map((x, i) => [f.px(x), f.py(c.y[i] + 2 * c.e[i])]);
      const lower = c.x.map((x, i) => [f.px(x), f.py(c.y[i] - 2 * c.e[i])]).reverse();
      f.inside.append(svg("polygon", { class: "band", fill: colour(c.index), points: points([...upper, ...lower]) }));
    }
    f.inside.append(svg("polyline", {
      class: "curve", stroke: colour(c.index), "stroke-dasharray": dash(c.index), "data-curve": c.name,
      points: points(c.x.map((x, i) => [f.px(x), f.py(c.y[i])])),
    }));
    if (c.dots) c.x.forEach((x, i) => f.inside.append(svg("circle", { cx: f.px(x), cy: f.py(c.y[i]), r: 3, fill: colour(c.index) })));
  }
  for (const m of spec.marks || []) {
    const x = f.px(m.x);
    f.image.append(svg("path", { d: `M${x - 6},${f.box.top - 9} h12 l-6,10 z`, fill: colour(m.index) }, svg("title", {}, m.text)));
  }
  f.image.setAttribute("aria-label", spec.aria);
  host.replaceChildren(f.image);
  if (readout) readout.replaceChildren(el("span", { class: "hint" }, spec.curves.length ? HINT : "No curve is chosen."));
  if (readout && spec.curves.length) cursor(f, readout, spec);
  return f;
}

// A vertical line that follows the pointer or the arrow keys; what it meets stands in `readout`.
function cursor(f, readout, spec) {
  const line = svg("line", { class: "cursor", y1: f.box.top, y2: f.box.bottom, visibility: "hidden" });
  f.image.append(line);
  f.image.setAttribute("tabindex", "0");
  const grid = spec.curves[0].x;
  let at = -1;
  const show = (i) => {
    at = clamp(i, 0, grid.length - 1);
    const x = grid[at];
    line.setAttribute("x1", f.px(x));
    line.setAttribute("x2", f.px(x));
    line.setAttribute("visibility", "visible");
    const item = (c) => {
      const k = c.x === grid ? at : nearest(c.x, x);
      const text = c.e ? withError(c.y[k], c.e[k]) : digits(c.y[k]);
      return el("span", { class: "item" }, `${c.name} `, el("b", {}, text));
    };
    readout.replaceChildren(el("span", { class: "item" }, `${spec.read(x)}:`), ...spec.curves.map(item));
  };
  for (const touch of ["pointermove", "pointerdown"]) {
    f.image.addEventListener(touch, (event) => show(nearest(grid, f.toX(pointer(f.image, event)[0]))));
  }
  f.image.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    show(at < 0 ? 0 : at + step);
  });
}

// The names of the curves below a plot that has no check boxes of its own.
function legend(curves) {
  const block = (c) => svg("rect", { x: 7, y: 0, width: 12, height: 10, fill: colour(c.index) });
  const stroke = (c) => svg("line", { x1: 0, x2: 26, y1: 5, y2: 5, stroke: colour(c.index), "stroke-width": 3, "stroke-dasharray": dash(c.index) });
  const key = (c) => el("span", { class: "item" },
    svg("svg", { width: 26, height: 10, "aria-hidden": "true", style: "width:26px;display:inline-block;margin-right:.35rem" },
      c.block ? block(c) : stroke(c)),
    c.name);
  return el("p", { class: "legend" }, curves.map(key));
}
