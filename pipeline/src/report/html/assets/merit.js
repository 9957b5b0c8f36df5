// SPDX-License-Identifier: MIT OR Apache-2.0
// Figures of merit as dots with error bars, the published ones as crosses: one panel a figure.

part("merit", () => {
  const figure = byId("plot-merit");
  const compared = data.models.filter((m) => m.figures.some((f) => f.published !== null));
  const shown = compared.length ? data.models.filter((m) => compared.some((c) => c.design === m.design)) : data.models;
  const labels = [...new Set((compared.length ? compared : shown).flatMap((m) => m.figures.filter((f) => (compared.length ? f.published !== null : !f.onAxis)).map((f) => f.label)))];
  const { body, update } = captioned(figure, () => (compared.length
    ? "Computed (dot, bar of two standard errors to each side) and published (cross). Bars shorter than the dot do not show."
    : "Computed, with bars of two standard errors to each side."));
  update();
  const host = el("div", {});
  body.append(host);

  function panel(label, width, named) {
    const rows = shown.map((m) => ({ m, f: m.figures.find((f) => f.label === label) }));
    const values = rows.flatMap(({ f }) => (f ? [f.published, f.onAxis ? null : f.value - 2 * f.error, f.onAxis ? null : f.value + 2 * f.error] : [])).filter((v) => v !== null);
    const unit = rows.find(({ f }) => f)?.f.unit || "";
    const step = 20;
    const top = 24;
    const left = named ? 160 : 8;
    const height = top + rows.length * step + 30;
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const margin = 0.08 * (high - low || 1);
    const x = (v) => left + ((v - low + margin) / (high - low + 2 * margin)) * (width - left - 12);
    const image = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", width, height,
      "aria-label": `${label}: ${rows.map(({ m, f }) => `${m.design} ${m.label} ${f ? digits(f.value, 4) : "none"}${f && f.published !== null ? `, published ${digits(f.published, 4)}` : ""}`).join("; ")}` });
    image.append(svg("text", { x: left, y: 14, "font-weight": 600 }, `${label} (${unit})`));
    const marks = ticks(low - margin, high + margin, Math.max(2, Math.floor((width - left) / 60)));
    for (const t of marks) {
      image.append(svg("line", { class: "grid", x1: x(t), x2: x(t), y1: top, y2: height - 22 }),
        svg("text", { class: "soft", x: x(t), y: height - 7, "text-anchor": "middle" }, tickName(marks)(t)));
    }
    rows.forEach(({ m, f }, i) => {
      const y = top + (i + 0.5) * step;
      if (i && m.design !== rows[i - 1].m.design) image.append(svg("line", { class: "frame", x1: 0, x2: width, y1: y - step / 2, y2: y - step / 2, opacity: 0.5 }));
      if (named) image.append(svg("text", { x: 0, y: y + 4 }, `${m.design} ${m.label}`));
      if (!f) return;
      const c = colour(modelIndex(m.key));
      if (!f.onAxis) {
        image.append(svg("line", { x1: x(f.value - 2 * f.error), x2: x(f.value + 2 * f.error), y1: y, y2: y, stroke: c, "stroke-width": 2 }),
          svg("circle", { cx: x(f.value), cy: y, r: 4, fill: c }, svg("title", {}, `${m.design}, ${m.label}: ${withError(f.value, f.error)} ${unit}`)));
      }
      if (f.published !== null) {
        const p = x(f.published);
        image.append(svg("path", { d: `M${p - 5},${y - 5} l10,10 m0,-10 l-10,10`, stroke: "var(--ink)", "stroke-width": 2, fill: "none" },
          svg("title", {}, `${m.design}, ${m.label}: published ${digits(f.published, 4)} ${unit}`)));
      }
    });
    return image;
  }

  responsive(figure, (width) => {
    const perRow = width > 900 ? 4 : width > 560 ? 2 : 1;
    const columns = Math.min(perRow, labels.length);
    const names = 152;
    const each = (width - names - 16 * (columns - 1)) / columns;
    host.replaceChildren();
    for (let i = 0; i < labels.length; i += columns) {
      const row = el("div", { style: `display:flex;gap:16px;margin-bottom:.5rem` });
      labels.slice(i, i + columns).forEach((label, k) => {
        const own = each + (k === 0 ? names : 0);
        row.append(el("div", { style: `flex:0 1 ${own}px;min-width:0` }, panel(label, own, k === 0)));
      });
      host.append(row);
    }
  });
});
