// SPDX-License-Identifier: MIT OR Apache-2.0
// Maps of the receiver plane: paints their bins, reads them at a cross, draws profiles through it.

part("illuminance", () => {
  const open = new Map();
  function unfold(model) {
    if (!open.has(model)) {
      const m = model.map;
      const mirror = (i, count, kept) => (i < kept ? i : count - 1 - i);
      const all = (text, full) => {
        const raw = unpack(text);
        const out = new Float64Array(m.rows * m.columns);
        for (let r = 0; r < m.rows; r += 1) {
          for (let c = 0; c < m.columns; c += 1) {
            out[r * m.columns + c] = (full * raw[mirror(r, m.rows, m.keptRows) * m.keptColumns + mirror(c, m.columns, m.keptColumns)]) / STEPS;
          }
        }
        return out;
      };
      open.set(model, { ...m, value: all(m.value, m.fullValue), error: all(m.error, m.fullError) });
    }
    return open.get(model);
  }
  const palette = data.palette.match(/../g).map((pair) => parseInt(pair, 16));
  // From 0 on the linear scale, from the low end of the picture's own on the logarithmic one.
  const share = (v, scale, [low, high]) => (scale === "linear" ? v / high : Math.log(Math.max(v, low) / low) / Math.log(high / low));

  function paint(m, panel, scale, range) {
    const canvas = el("canvas", { width: m.columns, height: m.rows });
    const pixels = new ImageData(m.columns, m.rows);
    m.value.forEach((v, k) => {
      const at = 4 * ((m.rows - 1 - Math.floor(k / m.columns)) * m.columns + (k % m.columns));
      const colour = 3 * Math.round(255 * clamp(share(v, scale, range), 0, 1));
      pixels.data.set([...palette.slice(colour, colour + 3), 255], at);
    });
    canvas.getContext("2d").putImageData(pixels, 0, 0);
    const { left, top, right, bottom } = panel.box;
    panel.node.after(svg("image", {
      x: left, y: top, width: right - left, height: bottom - top, preserveAspectRatio: "none", style: "image-rendering:pixelated", href: canvas.toDataURL(),
    }));
  }

  let at = null; // of the cross, mm
  const place = (m) => {
    if (!at) {
      let best = 0;
      m.value.forEach((v, k) => { if (v > m.value[best]) best = k; });
      at = [m.first[0] + (best % m.columns) * m.bin[0], m.first[1] + Math.floor(best / m.columns) * m.bin[1]];
    }
    return [
      clamp(Math.round((at[0] - m.first[0]) / m.bin[0]), 0, m.columns - 1),
      clamp(Math.round((at[1] - m.first[1]) / m.bin[1]), 0, m.rows - 1),
    ];
  };

  const readout = byId("plot-map").querySelector(".readout");
  const shown = (id) => byId(id).querySelector("figure:not([hidden]) svg");
  function drawProfiles(m, c, r) {
    const line = (count, start, step, first, bin) => Array.from({ length: count }, (_, i) => [first + i * bin, m.value[start + i * step], m.error[start + i * step]]);
    const curves = {
      "along x": line(m.columns, r * m.columns, 1, m.first[0], m.bin[0]),
      "along y": line(m.rows, c, m.columns, m.first[1], m.bin[1]),
    };
    lines = curves;
    const image = shown("plot-profile");
    const axes = panels(image);
    for (const [name, list] of Object.entries(curves)) {
      const within = (tag) => [...image.querySelectorAll(`[clip-path] [data-curve="${name}"] ${tag}`)];
      const edge = ({ x, y }, errors) => list.map(([p, v, e]) => [x.place(p), y.place(v + errors * e)]);
      within("polygon").forEach((band, i) => band.setAttribute("points", points([...edge(axes[i], 2), ...edge(axes[i], -2).reverse()])));
      within("polyline").forEach((curve, i) => curve.setAttribute("points", points(edge(axes[i], 0))));
    }
  }

  const ready = new Map();
  let lines = {};
  copies("csv-profile", () => {
    const m = data.models[choice.model].map;
    const rows = Object.entries(lines).flatMap(([name, list]) => list.map(([p, v, e]) => [name, p.toFixed(4), v.toPrecision(6), e.toPrecision(3)]));
    return [["profile", "position_mm", `${m.quantity} (${m.unit})`, "standard_error"], ...rows];
  });
  pictures("illuminance", ({ model }) => {
    const m = unfold(data.models[Number(model)]);
    const images = [...byId("plot-map").querySelectorAll("figure:not([hidden])")].map((figure) => [figure.querySelector("svg"), figure.dataset.scale]);
    for (const [image, scale] of images) {
      if (ready.has(image)) continue;
      const [panel] = panels(image);
      paint(m, panel, scale, m.range);
      ready.set(image, [cursor(image, panel, false), cursor(image, panel, true)]);
      reads(image, panel, (x, y) => { at = [x, y]; mark(); }, (dx, dy) => { at = [at[0] + dx * m.bin[0], at[1] + dy * m.bin[1]]; mark(); });
    }
    function mark() {
      const [c, r] = place(m);
      at = [m.first[0] + c * m.bin[0], m.first[1] + r * m.bin[1]];
      for (const [image] of images) ready.get(image).forEach((line, axis) => line(at[axis]));
      const k = r * m.columns + c;
      readout.replaceChildren(
        el("span", { class: "item" }, `x = ${digits(at[0], 4)} mm, y = ${digits(at[1], 4)} mm:`),
        el("span", { class: "item" }, el("b", {}, `${withError(m.value[k], m.error[k])} ${m.unit}`)),
        el("span", { class: "item" }, `${digits((100 * m.value[k]) / m.fullValue, 3)} % of the largest`));
      drawProfiles(m, c, r);
    }
    mark();
  });
});
