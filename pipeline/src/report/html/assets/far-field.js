// SPDX-License-Identifier: MIT OR Apache-2.0
// Far fields: cartesian and polar, one design at a time, models switched on and off.

part("far-field", () => {
  const redraw = [];
  const changed = () => redraw.forEach((draw) => draw());
  const design = choose("Design", designs.map((d) => [d, d]), () => {
    refreshModels();
    changed();
  });
  const models = anyOf("Models", changed);
  const names = [...new Set(data.models.flatMap((m) => m.farField.curves.map((c) => c.name)))];
  const cut = choose("Cut", names.map((n) => [n, n]), changed);
  const scale = oneOf("Scale", [["absolute", "absolute"], ["relative", "each to its maximum"]], "absolute", changed);
  const reach = oneOf("Angles", [["90", "0 to 90°"], ["180", "0 to 180°"]], "90", changed);
  byId("controls-far").append(design.node, cut.node, models.node, scale.node, reach.node);

  let off = new Set();
  function refreshModels() {
    models.setItems(modelsOf(design.value()).map((m) => ({ value: m.key, text: m.label, index: modelIndex(m.key) })), (key) => !off.has(key));
  }
  refreshModels();

  function chosen() {
    const on = models.values();
    off = new Set(modelsOf(design.value()).map((m) => m.key).filter((key) => !on.includes(key)));
    const relative = scale.value() === "relative";
    return modelsOf(design.value()).filter((m) => on.includes(m.key)).flatMap((m) => {
      const c = m.farField.curves.find((curve) => curve.name === cut.value());
      if (!c) return [];
      const full = relative ? Math.max(...c.value) : 1;
      const theta = m.farField.theta;
      const count = reach.value() === "90" ? theta.filter((t) => t <= 90).length : theta.length;
      return [{
        name: m.label, index: modelIndex(m.key), model: m, theta, x: theta.slice(0, count),
        y: c.value.slice(0, count).map((v) => v / full), e: c.error.slice(0, count).map((v) => v / full),
      }];
    });
  }
  const unitOf = () => (scale.value() === "relative" ? "share of the maximum" : `intensity (${data.models[0].farField.unit})`);
  const described = () => `${design.value()}, ${cut.value()}, ${scale.text()}`;
  const top = (curves) => Math.max(1e-12, ...curves.flatMap((c) => c.y)) * 1.06;

  const far = captioned(byId("plot-far"), described);
  const readout = el("p", { class: "readout", role: "status" });
  const host = el("div", {});
  far.body.append(host, readout);
  redraw.push(responsive(byId("plot-far"), () => {
    const curves = chosen();
    const marks = curves.flatMap((c) => {
      const peak = c.model.figures.find((f) => f.label === "peak angle");
      return peak && peak.published !== null ? [{ x: peak.published, index: c.index, text: `${c.name}: published peak at ${peak.published}°` }] : [];
    });
    lines(host, readout, {
      x: { min: 0, max: Number(reach.value()), label: "polar angle θ (°)", ticks: reach.value() === "90" ? [0, 15, 30, 45, 60, 75, 90] : [0, 30, 60, 90, 120, 150, 180] },
      y: { min: 0, max: top(curves), label: unitOf() },
      curves, marks, aria: `Far field of ${described()}: ${curves.map((c) => `${c.name}, largest at ${c.x[c.y.indexOf(Math.max(...c.y))]}°`).join("; ")}`,
      read: (x) => `θ = ${digits(x)}°`,
    });
    host.append(legend(curves));
    far.update();
  }));

  const round = captioned(byId("plot-far-polar"), () => `The same over the angle; 0° is the axis of the package.`);
  redraw.push(responsive(byId("plot-far-polar"), () => {
    const curves = chosen();
    polarCurves(round.body, { max: top(curves), curves, unit: unitOf(), aria: `Far field of ${described()} as a polar plot` });
    round.update();
  }));
});
