// SPDX-License-Identifier: MIT OR Apache-2.0
// Errors that tables state of themselves, and studies of `batwing converge` where the folder holds some.

part("convergence", () => {
  const host = byId("studies");
  const NAMES = ["largest of any order", "largest of any direction", "99 % of directions", "rms of directions", "mean of directions by flux"];
  if (!data.studies.length) {
    host.append(el("p", {}, "The folder holds no study of ", el("code", {}, "batwing converge"), "; written into it (", el("code", {}, "--out DIR"), "), its error against orders and slices is drawn here."));
  }
  for (const study of data.studies) {
    const pair = el("div", { class: "pair" });
    host.append(pair);
    const sweeps = [
      ["by_orders", "highest order kept", `Orders, on ${study.fixed_slices} slices, against ±${study.reference_orders}`],
      ["by_slices", "slices", `Slices, with orders up to ±${study.fixed_orders}, against ${study.reference_slices} slices`],
    ];
    for (const [key, label, caption] of sweeps) {
      const list = study[key].filter((p) => p.errors.some((e) => e > 0));
      if (list.length < 2) continue;
      const figure = el("figure", {});
      pair.append(figure);
      const { body, update } = captioned(figure, () => `${study.design}, ring ${study.ring} (period ${digits(study.period_um, 4)} µm, depth ${digits(study.depth_um)} µm). ${caption}. The tolerance asked for is ${digits(study.tolerance)}.`);
      const place = el("div", {});
      const readout = el("p", { class: "readout", role: "status" });
      body.append(place, readout);
      const x = list.map((p) => p.at);
      const curves = NAMES.map((name, i) => ({ name, index: i, x, y: list.map((p) => p.errors[i]), dots: true }));
      const all = curves.flatMap((c) => c.y).filter((v) => v > 0).concat(study.tolerance);
      responsive(figure, () => {
        const f = lines(place, readout, {
          x: { min: x[0] / 1.08, max: x[x.length - 1] * 1.08, log: true, label, ticks: x, name: (v) => String(v) },
          y: { min: 10 ** Math.floor(Math.log10(Math.min(...all))), max: 10 ** Math.ceil(Math.log10(Math.max(...all))), log: true, label: "error of a share" },
          curves, aria: `${study.design}, ring ${study.ring}: error over ${label}`, read: (v) => `${label} ${v}`,
        });
        const y = f.py(study.tolerance);
        f.image.append(svg("line", { class: "cursor", x1: f.box.left, x2: f.box.right, y1: y, y2: y }));
        place.append(legend(curves));
        update();
      });
    }
  }

  const errors = data.tableErrors;
  const figure = byId("plot-errors");
  if (!errors.length) {
    figure.previousElementSibling.remove();
    return;
  }
  const names = [...new Set(errors.map((e) => e.design))];
  const { body, update } = captioned(figure, () => "Filled dots: orders and slices. Rings: ky. Crosses: power balance. By band from the axis outwards.");
  responsive(figure, (width) => {
    const values = errors.flatMap((e) => [e.error, e.grid, e.residual]).filter((v) => v > 0);
    const bands = errors.map((e) => e.band);
    const f = frame({
      width, height: 300, x: { min: 0.4, max: Math.max(...bands) + 0.6, label: "band", ticks: [...new Set(bands)].sort((a, b) => a - b), name: String },
      y: { min: 10 ** Math.floor(Math.log10(Math.min(...values))), max: 10 ** Math.ceil(Math.log10(Math.max(...values))), log: true, label: "estimated error" },
    });
    for (const e of errors) {
      const i = names.indexOf(e.design);
      const x = f.px(e.band + (i - (names.length - 1) / 2) * 0.22);
      const title = () => svg("title", {}, `${e.design}, band ${e.band}, ring ${e.ring}: ${digits(e.error)}, ky ${e.grid === null ? "not estimated" : digits(e.grid)}, power balance ${digits(e.residual)}`);
      f.inside.append(svg("circle", { cx: x, cy: f.py(e.error), r: 4, fill: colour(i) }, title()));
      if (e.grid > 0) f.inside.append(svg("circle", { cx: x, cy: f.py(e.grid), r: 4, fill: "none", stroke: colour(i), "stroke-width": 2 }, title()));
      if (e.residual > 0) f.inside.append(svg("path", { d: `M${x - 4},${f.py(e.residual) - 4} l8,8 m0,-8 l-8,8`, stroke: colour(i), "stroke-width": 2 }, title()));
    }
    const largest = Math.max(...errors.map((e) => e.error));
    f.image.setAttribute("aria-label", `Estimated errors of ${errors.length} tables; the largest of orders and slices is ${digits(largest)}`);
    body.replaceChildren(f.image, legend(names.map((name, i) => ({ name, index: i, block: true }))));
    update();
  });
});
