// SPDX-License-Identifier: MIT OR Apache-2.0
// Lists of numbers and of points as curves that are drawn with the mouse or moved with the keys.

const PLOT = { width: 340, height: 190, left: 42, right: 10, top: 10, bottom: 20 };
const curves = { dragged: null };

// Points [x, y] of a curve; of a list of numbers, x counts its entries.
const pointsOf = (curve) => (curve.points || curve.values.map((value, i) => [i + 1, value])).map((point) => [...point]);
function extent(list) {
  const [low, high] = [Math.min(...list), Math.max(...list)];
  const room = 0.12 * (high - low) || 0.1 * Math.max(1, Math.abs(high));
  return [low - room, high + room];
}

function editor(curve) {
  const points = pointsOf(curve);
  const isList = Boolean(curve.values);
  const [x0, x1] = extent(points.map((p) => p[0]));
  const [y0, y1] = extent(points.map((p) => p[1]));
  const px = (x) => PLOT.left + ((x - x0) / (x1 - x0)) * (PLOT.width - PLOT.left - PLOT.right);
  const py = (y) => PLOT.height - PLOT.bottom - ((y - y0) / (y1 - y0)) * (PLOT.height - PLOT.top - PLOT.bottom);
  const line = svg("polyline", {});
  const dots = points.map((_, i) => svg("circle", {
    r: points.length > 30 ? 4 : 5, tabindex: 0, role: "slider", "aria-label": `${curve.label}, point ${i + 1}`,
    onkeydown: (event) => {
      const step = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowRight: [1, 0], ArrowLeft: [-1, 0] }[event.key];
      if (!step || (isList && step[0])) return;
      event.preventDefault();
      points[i][0] += step[0] * 0.01 * (x1 - x0);
      points[i][1] += step[1] * 0.01 * (y1 - y0);
      draw();
      change(false, i);
    },
  }));
  const readout = el("span", { class: "unit" });
  const image = svg("svg", { viewBox: `0 0 ${PLOT.width} ${PLOT.height}`, role: "group", "aria-label": curve.path },
    [y0, 0.5 * (y0 + y1), y1].map((y) => svg("text", { x: PLOT.left - 4, y: py(y) + 4, "text-anchor": "end" }, String(Number(y.toPrecision(3))))),
    line, dots);
  function draw() {
    line.setAttribute("points", points.map(([x, y]) => `${px(x)},${py(y)}`).join(" "));
    dots.forEach((dot, i) => {
      dot.setAttribute("cx", px(points[i][0]));
      dot.setAttribute("cy", py(points[i][1]));
      dot.setAttribute("aria-valuenow", Number(points[i][1].toPrecision(4)));
    });
  }
  function change(part, i) {
    const short = (x) => Number(x.toPrecision(5));
    readout.textContent = `point ${i + 1}: ${isList ? "" : `${short(points[i][0])}, `}${short(points[i][1])} ${curve.unit}`;
    turn(curve.path, isList ? points.map((p) => short(p[1])) : points.map((p) => p.map(short)), part);
  }
  const at = (event) => {
    const box = image.getBoundingClientRect();
    const [u, v] = [((event.clientX - box.left) / box.width) * PLOT.width, ((event.clientY - box.top) / box.height) * PLOT.height];
    return [x0 + ((u - PLOT.left) / (PLOT.width - PLOT.left - PLOT.right)) * (x1 - x0), y0 + ((PLOT.height - PLOT.bottom - v) / (PLOT.height - PLOT.top - PLOT.bottom)) * (y1 - y0)];
  };
  const near = (x) => points.reduce((best, p, i) => (Math.abs(p[0] - x) < Math.abs(points[best][0] - x) ? i : best), 0);
  let last = 0;
  function follow(event, part) {
    const [x, y] = at(event);
    // A list is drawn over; a point is dragged.
    if (isList) last = near(x);
    else points[last][0] = x;
    points[last][1] = y;
    draw();
    change(part, last);
  }
  image.addEventListener("pointerdown", (event) => {
    event.preventDefault();
    image.setPointerCapture(event.pointerId);
    curves.dragged = curve.path;
    last = near(at(event)[0]);
    follow(event, true);
  });
  image.addEventListener("pointermove", (event) => { if (curves.dragged === curve.path) follow(event, true); });
  image.addEventListener("pointerup", (event) => {
    if (curves.dragged !== curve.path) return;
    curves.dragged = null;
    follow(event, false);
  });
  draw();
  const fault = numbers.faults.get(curve.path);
  return el("div", { class: "curve-editor" }, el("p", {}, `${curve.label} `, el("span", { class: "unit" }, curve.unit ? `(${curve.unit}) ` : "", curve.path), " ", readout), image, fault && el("p", { class: "fault", role: "alert" }, fault));
}

onState(() => {
  byId("fold-curves").hidden = state.curves.length === 0;
  const shown = JSON.stringify(state.curves) + JSON.stringify([...numbers.faults]);
  // What is being drawn or moved stays.
  if (curves.dragged || curves.shown === shown || byId("curves").contains(document.activeElement)) return;
  curves.shown = shown;
  byId("curves").replaceChildren(...state.curves.map(editor));
});
