// SPDX-License-Identifier: MIT OR Apache-2.0
// Lists of numbers and of points as curves that are drawn with the mouse or moved with the keys.

const PLOT = { width: 340, height: 190, left: 46, right: 10, top: 12, bottom: 24 };
// Distance from a point within which it is grasped, in pixels of the screen.
const GRASP = 18;
const short = (x) => Number(x.toPrecision(5));
function extent(list) {
  const [low, high] = [Math.min(...list), Math.max(...list)];
  const room = 0.12 * (high - low) || 0.1 * Math.max(1, Math.abs(high));
  return [low - room, high + room];
}

function editor({ path, label, unit, values }) {
  const isList = Boolean(values);
  let points = [];
  let held = []; // by the design
  let x = null;
  let y = null;
  let dots = [];
  let dragged = -1;
  let grip = null; // from the pointer to the point that is dragged, and true once it has moved
  const axis = ([low, high], from, to) => ({
    low, high, place: (v) => from + ((v - low) / (high - low)) * (to - from), number: (p) => low + ((p - from) / (to - from)) * (high - low),
  });
  const line = svg("polyline");
  const names = svg("g");
  const circles = svg("g");
  const image = svg("svg", { viewBox: `0 0 ${PLOT.width} ${PLOT.height}`, role: "group", "aria-label": path }, names, line, circles);
  const readout = el("span", { role: "status" });
  const fault = el("p", { class: "fault", role: "alert" });
  const origin = el("small");
  const node = el("div", { class: "curve-editor", "data-path": path },
    el("p", {}, label, el("span", { class: "unit" }, unit && ` ${unit}`), " ", readout, el("small", {}, path), origin), image, fault);

  function draw() {
    line.setAttribute("points", points.map((p) => `${x.place(p[0])},${y.place(p[1])}`).join(" "));
    dots.forEach((dot, i) => {
      dot.setAttribute("cx", x.place(points[i][0]));
      dot.setAttribute("cy", y.place(points[i][1]));
      dot.setAttribute("aria-valuenow", short(points[i][1]));
      dot.setAttribute("aria-valuetext", (isList ? [points[i][1]] : points[i]).map(short).join(", "));
    });
  }
  function rescale() {
    x = axis(extent(points.map((p) => p[0])), PLOT.left, PLOT.width - PLOT.right);
    y = axis(extent(points.map((p) => p[1])), PLOT.height - PLOT.bottom, PLOT.top);
    const name = (at, anchor, words) => svg("text", { ...at, "text-anchor": anchor }, words);
    const ends = (list) => [Math.min(...list), Math.max(...list)].filter((v, i, both) => i === 0 || v !== both[0]);
    names.replaceChildren(
      ...ends(points.map((p) => p[1])).map((v) => name({ x: PLOT.left - 6, y: y.place(v) + 4 }, "end", String(Number(v.toPrecision(3))))),
      ...ends(points.map((p) => p[0])).map((v) => name({ x: x.place(v), y: PLOT.height - 7 }, "middle", String(Number(v.toPrecision(3))))));
    for (const dot of dots) {
      dot.setAttribute("aria-valuemin", short(y.low));
      dot.setAttribute("aria-valuemax", short(y.high));
    }
    draw();
  }
  function change(i, part) {
    draw();
    readout.textContent = `${i + 1}: ${(isList ? [points[i][1]] : points[i]).map(short).join(", ")}`;
    // What was not touched keeps its digits.
    const same = (p, k) => held[k] && p.every((value, n) => value === held[k][n]);
    const values = points.map((p, k) => (same(p, k) ? p : p.map(short)));
    turn(path, isList ? values.map((p) => p[1]) : values, part);
  }
  function press(event, i) {
    const step = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowRight: [1, 0], ArrowLeft: [-1, 0] }[event.key];
    if (!step || (isList && step[0])) return;
    event.preventDefault();
    points[i][0] += step[0] * 0.01 * (x.high - x.low);
    points[i][1] += step[1] * 0.01 * (y.high - y.low);
    change(i, false);
  }
  const pointer = (event) => {
    const box = image.getBoundingClientRect();
    return [((event.clientX - box.left) / box.width) * PLOT.width, ((event.clientY - box.top) / box.height) * PLOT.height];
  };
  // The entry of a list below the pointer, or the point nearest to it.
  const nearest = ([u, v]) => {
    const away = points.map((p) => Math.hypot(x.place(p[0]) - u, isList ? 0 : y.place(p[1]) - v));
    return away.indexOf(Math.min(...away));
  };
  function follow([u, v], part) {
    if (isList) {
      // A list is drawn over; entries that the pointer leapt over lie between.
      const to = nearest([u, v]);
      const [first, value] = [points[dragged][1], y.number(v)];
      for (let k = dragged; k !== to;) {
        k += Math.sign(to - dragged);
        points[k][1] = first + ((value - first) * (k - dragged)) / (to - dragged);
      }
      points[to][1] = value;
      dragged = to;
    } else points[dragged] = [x.number(u), y.number(v), ...points[dragged].slice(2)];
    change(dragged, part);
  }
  const placeOf = (point) => [x.place(point[0]), y.place(point[1])];
  image.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    const at = pointer(event);
    const near = nearest(at);
    const away = placeOf(points[near]).map((p, k) => p - at[k]);
    const reach = (GRASP * PLOT.width) / image.getBoundingClientRect().width;
    if (!isList && Math.hypot(...away) > reach) return;
    image.setPointerCapture(event.pointerId);
    dragged = near;
    dots[dragged].focus();
    // A list takes the value under the pointer; a point goes as far as the pointer does.
    grip = { away: isList ? [0, 0] : away, from: at, moved: isList };
    if (isList) follow(at, true);
  });
  image.addEventListener("mousedown", (event) => event.preventDefault());
  const gripped = (event) => pointer(event).map((p, k) => p + grip.away[k]);
  image.addEventListener("pointermove", (event) => {
    if (dragged < 0) return;
    grip.moved ||= Math.hypot(...pointer(event).map((p, k) => p - grip.from[k])) > 2;
    if (grip.moved) follow(gripped(event), true);
  });
  for (const end of ["pointerup", "pointercancel"]) {
    image.addEventListener(end, (event) => {
      if (dragged < 0) return;
      if (grip.moved) follow(end === "pointerup" ? gripped(event) : placeOf(points[dragged]), false);
      dragged = -1;
      rescale();
    });
  }
  node.addEventListener("focusout", () => { if (dragged < 0) rescale(); });
  return {
    node,
    update(curve) {
      const said = faults.get(path);
      fault.textContent = said ? `${said.message}; the design keeps the curve before` : "";
      if (dragged >= 0 || isTurning(path) || said) return;
      // Not below a drag: the plane would move under the pointer.
      origin.textContent = curve.file ? `of ${curve.file}; what is dragged stands in the design in its place, and the file stays` : "";
      const next = (curve.points || curve.values.map((value, i) => [i + 1, value])).map((point) => [...point]);
      held = next.map((point) => [...point]);
      // The axes stay where what is seen stays.
      const isSame = next.length === points.length && next.every((p, i) => p.every((value, k) => short(value) === short(points[i][k] ?? NaN)));
      points = next;
      if (dots.length !== points.length) {
        dots = points.map((_, i) => svg("circle", {
          r: points.length > 30 ? 3.5 : 5, tabindex: 0, role: "slider", "aria-label": `${label}, point ${i + 1}`, onkeydown: (event) => press(event, i),
        }));
        circles.replaceChildren(...dots);
      }
      if (isSame) draw();
      else rescale();
    },
  };
}

const editors = new Map();
onState(() => {
  byId("fold-curves").hidden = state.curves.length === 0;
  const nodes = state.curves.map((curve) => {
    if (!editors.has(curve.path)) editors.set(curve.path, editor(curve));
    editors.get(curve.path).update(curve);
    return editors.get(curve.path).node;
  });
  if (nodes.length !== byId("curves").childElementCount || nodes.some((node, i) => node !== byId("curves").children[i])) byId("curves").replaceChildren(...nodes);
});
