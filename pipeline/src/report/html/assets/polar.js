// SPDX-License-Identifier: MIT OR Apache-2.0
// Polar plots: the half above the package for far fields, both halves for light at a surface.

// Rings and rays of a polar plot with the centre at (cx, cy). `whole` draws the lower half as well; `name` turns a radius share into text.
function polarGrid(image, { cx, cy, radius, whole, rings, name }) {
  const arc = (r) => (whole
    ? `M${cx - r},${cy} a${r},${r} 0 1 1 ${2 * r},0 a${r},${r} 0 1 1 ${-2 * r},0`
    : `M${cx - r},${cy} a${r},${r} 0 0 1 ${2 * r},0`);
  for (const ring of rings) image.append(svg("path", { class: "grid", fill: "none", d: arc(radius * ring) }));
  const last = whole ? 180 : 90;
  for (let angle = -last + (whole ? 30 : 0); angle <= last; angle += 30) {
    const [s, c] = [Math.sin(radians(angle)), Math.cos(radians(angle))];
    image.append(svg("line", { class: "grid", x1: cx, y1: cy, x2: cx + radius * s, y2: cy - radius * c }));
    const shown = whole && Math.abs(angle) > 90 ? Math.sign(angle) * (180 - Math.abs(angle)) : angle;
    image.append(svg("text", {
      class: "soft", "text-anchor": "middle", x: cx + (radius + 15) * s, y: cy - (radius + 13) * c + 4,
    }, `${minus(String(shown === -0 ? 0 : shown))}°`));
  }
  for (const ring of rings) {
    if (!name(ring)) continue;
    image.append(svg("text", { class: "soft", x: cx + radius * ring - 3, y: cy + 14, "text-anchor": "end" }, name(ring)));
  }
}

// Curves over -90 to 90°. spec: { max, curves: [{ name, theta, y, index }], unit, aria }.
function polarCurves(host, spec) {
  const width = Math.max(260, widthOf(host));
  const radius = Math.min((width - 70) / 2, 330);
  const [cx, cy] = [width / 2, radius + 34];
  const height = cy + 30;
  const image = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": spec.aria, width, height });
  const steps = ticks(0, spec.max, 4).filter((t) => t > 0 && t <= spec.max * 1.001);
  polarGrid(image, { cx, cy, radius, whole: false, rings: [...steps.map((t) => t / spec.max), 1], name: (ring) => (ring < 1 ? tickName(steps)(ring * spec.max) : "") });
  for (const c of spec.curves) {
    const place = (theta, value) => {
      const r = (radius * clamp(value, 0, spec.max)) / spec.max;
      return [cx + r * Math.sin(radians(theta)), cy - r * Math.cos(radians(theta))];
    };
    const right = c.theta.map((t, i) => [t, c.y[i]]).filter(([t]) => t <= 90);
    const all = [...right.map(([t, v]) => place(-t, v)).reverse(), ...right.map(([t, v]) => place(t, v))];
    image.append(svg("polyline", { class: "curve", stroke: colour(c.index), "stroke-dasharray": dash(c.index), points: points(all) }));
  }
  image.append(svg("text", { class: "soft", x: cx + radius, y: cy + 28, "text-anchor": "end" }, spec.unit));
  host.replaceChildren(image);
}
