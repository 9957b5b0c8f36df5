// SPDX-License-Identifier: MIT OR Apache-2.0
// Reads the far field under the pointer.

part("far-field", () => {
  const host = byId("plot-far");
  const readout = host.querySelector(".readout");
  const ready = new Set();
  const HINT = "Point at the curves to read them.";
  pictures("controls-far", (chosen, labels) => {
    readout.replaceChildren(el("span", { class: "hint" }, labels.length ? HINT : "No curve is chosen."));
    const figure = host.querySelector("figure:not([hidden])");
    if (!figure) return;
    figure.labels = labels;
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
