// SPDX-License-Identifier: MIT OR Apache-2.0
// Axes of the scattering explorer, whose plots follow its controls: straight and polar ones.

const LETTER = 6.6; // mean width of a letter of 12 px

// spec: { width, height, x, y }, an axis: { min, max, label, ticks, name } with `name` turning a tick into text.
function frame({ width, height, x, y }) {
  const fill = (axis, most) => ({ ...axis, ticks: axis.ticks || ticks(axis.min, axis.max, most) });
  const vertical = fill(y, Math.max(3, Math.floor(height / 55)));
  const name = (axis, list) => axis.name || tickName(list);
  const names = vertical.ticks.map(name(y, vertical.ticks));
  const left = Math.max(...names.map((n) => n.length), 2) * LETTER + 28;
  const box = { left, right: width - 14, top: 10, bottom: height - 42 };
  const horizontal = fill(x, Math.max(3, Math.floor((box.right - box.left) / 70)));
  const scale = ({ min, max }, low, high) => (v) => low + ((v - min) / (max - min)) * (high - low);
  const px = scale(horizontal, box.left, box.right);
  const py = scale(vertical, box.bottom, box.top);
  const image = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", width, height });
  const middle = (box.top + box.bottom) / 2;
  let taken = -Infinity; // right end of the last name written
  for (const t of horizontal.ticks) {
    image.append(svg("line", { class: "grid", x1: px(t), x2: px(t), y1: box.top, y2: box.bottom }));
    const text = name(x, horizontal.ticks)(t);
    const half = (text.length * LETTER) / 2;
    if (px(t) - half < taken + 4) continue;
    taken = px(t) + half;
    image.append(svg("text", { class: "soft", x: px(t), y: box.bottom + 16, "text-anchor": "middle" }, text));
  }
  vertical.ticks.forEach((t, i) => {
    image.append(
      svg("line", { class: "grid", x1: box.left, x2: box.right, y1: py(t), y2: py(t) }),
      svg("text", { class: "soft", x: box.left - 6, y: py(t) + 4, "text-anchor": "end" }, names[i]));
  });
  image.append(svg("text", { x: (box.left + box.right) / 2, y: height - 6, "text-anchor": "middle" }, x.label));
  image.append(svg("text", { x: 0, y: 0, "text-anchor": "middle", transform: `translate(12 ${middle}) rotate(-90)` }, y.label));
  image.append(svg("rect", { class: "frame", x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top }));
  const clipId = newId();
  const inside = svg("g", { "clip-path": `url(#${clipId})` });
  image.append(
    svg("clipPath", { id: clipId }, svg("rect", { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top })),
    inside);
  return { image, inside, box, px, py };
}

// Rings and rays of a polar plot with the centre at (cx, cy); `name` turns a radius share into text.
function polarGrid(image, { cx, cy, radius, rings, name }) {
  const arc = (r) => `M${cx - r},${cy} a${r},${r} 0 1 1 ${2 * r},0 a${r},${r} 0 1 1 ${-2 * r},0`;
  for (const ring of rings) image.append(svg("path", { class: "grid", fill: "none", d: arc(radius * ring) }));
  for (let angle = -150; angle <= 180; angle += 30) {
    const [s, c] = [Math.sin(radians(angle)), Math.cos(radians(angle))];
    image.append(svg("line", { class: "grid", x1: cx, y1: cy, x2: cx + radius * s, y2: cy - radius * c }));
    const shown = Math.abs(angle) > 90 ? Math.sign(angle) * (180 - Math.abs(angle)) : angle;
    image.append(svg("text", {
      class: "soft", "text-anchor": "middle", x: cx + (radius + 15) * s, y: cy - (radius + 13) * c + 4,
    }, `${minus(String(shown === -0 ? 0 : shown))}°`));
  }
  for (const ring of rings) {
    if (!name(ring)) continue;
    image.append(svg("text", { class: "soft", x: cx + radius * ring - 3, y: cy + 14, "text-anchor": "end" }, name(ring)));
  }
}

// The names of colours below a plot: { name, index }.
function legend(items) {
  const key = ({ name, index }) => el("span", { class: "item" },
    svg("svg", { width: 26, height: 10, "aria-hidden": "true", style: "width:26px;display:inline-block;margin-right:.35rem" },
      svg("rect", { x: 7, y: 0, width: 12, height: 10, fill: colour(index) })),
    name);
  return el("p", { class: "legend" }, items.map(key));
}
