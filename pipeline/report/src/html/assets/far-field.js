// SPDX-License-Identifier: MIT OR Apache-2.0
// Reads the far field under the pointer.

part("far-field", () => {
  const host = byId("plot-far");
  const readout = host.querySelector(".readout");
  const ready = new Set();
  const HINT = "Point at the curves to read them.";
  let shown = null;
  copies("csv-far", () => {
    const { cut, scale, reach } = shown.dataset;
    const models = data.models.filter((m) => m.design === shown.dataset.design && shown.labels.includes(m.label));
    const curves = models.map((m) => {
      const named = (name) => m.farField.curves.find((c) => c.name === name);
      const [curve, left] = [named(cut), named(m.farField.opposite[cut])];
      const full = scale === "relative" ? Math.max(...curve.value, ...(left ? left.value : [])) : 1;
      return { label: m.label, curve, left, full };
    });
    const head = curves.flatMap(({ label }) => [`${label} (${scale === "relative" ? "1" : models[0].farField.unit})`, `${label} standard error`]);
    const theta = models.length ? models[0].farField.theta : [];
    const row = (t, i, left) => [left ? -t : t, ...curves.flatMap((c) => {
      const of = left ? c.left : c.curve;
      return of ? [of.value[i] / c.full, of.error[i] / c.full].map((v) => Number(v.toPrecision(6))) : ["", ""];
    })];
    const reached = theta.map((t, i) => [t, i]).filter(([t]) => t <= Number(reach));
    const lefts = curves.some((c) => c.left) ? reached.map(([t, i]) => row(t, i, true)).reverse() : [];
    return [["theta_deg", ...head], ...lefts, ...reached.map(([t, i]) => row(t, i, false))];
  });
  pictures("far-field", (chosen, labels) => {
    readout.replaceChildren(el("span", { class: "hint" }, labels.length ? HINT : "No curve is chosen."));
    const figure = host.querySelector("figure:not([hidden])");
    if (!figure) return;
    figure.labels = labels;
    shown = figure;
    if (ready.has(figure)) return;
    ready.add(figure);
    const { design, cut, scale } = figure.dataset;
    const image = figure.querySelector("svg");
    const [panel] = panels(image);
    const line = cursor(image, panel, false);
    const models = data.models.filter((m) => m.design === design);
    const theta = models[0].farField.theta.filter((t) => t <= panel.x.high);
    let at = -1;
    let side = 1;
    const show = (i) => {
      at = clamp(i, 0, theta.length - 1);
      line(side * theta[at]);
      const item = (m) => {
        const named = (name) => m.farField.curves.find((c) => c.name === name);
        // Left of the axis lies the opposite half-plane, where it is another.
        const curve = (side < 0 && named(m.farField.opposite[cut])) || named(cut);
        if (!curve || !figure.labels.includes(m.label)) return null;
        const full = scale === "relative" ? Math.max(...curve.value) : 1;
        return el("span", { class: "item" }, `${m.label} `, el("b", {}, withError(curve.value[at] / full, curve.error[at] / full)));
      };
      readout.replaceChildren(el("span", { class: "item" }, `θ = ${digits(side * theta[at])}°:`), ...models.map(item).filter(Boolean));
    };
    reads(image, panel, (x) => {
      side = x < 0 ? -1 : 1;
      show(nearest(theta, Math.abs(x)));
    }, (dx) => show(at < 0 ? 0 : at + side * dx));
  });
});
