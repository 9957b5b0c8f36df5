// SPDX-License-Identifier: MIT OR Apache-2.0
// The map of the receiver plane: colours, a cross that reads values, profiles through it.

part("illuminance", () => {
  // Stops of a map of colours from black through red and yellow to white; its lightness rises all the way.
  const STOPS = [[0, 0, 0], [48, 9, 66], [114, 21, 92], [178, 40, 75], [227, 84, 42], [248, 148, 29], [250, 214, 80], [255, 255, 225]];
  const colourOf = (share) => {
    const place = clamp(share, 0, 1) * (STOPS.length - 1);
    const i = Math.min(STOPS.length - 2, Math.floor(place));
    return STOPS[i].map((v, k) => Math.round(v + (place - i) * (STOPS[i + 1][k] - v)));
  };
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

  const redraw = [];
  const changed = () => redraw.forEach((draw) => draw());
  let at = null;
  const design = choose("Design", designs.map((d) => [d, d]), () => {
    refresh();
    changed();
  });
  const model = choose("Model", [], changed);
  const scale = oneOf("Scale", [["linear", "linear"], ["log", "logarithmic, down to 1/256 of the largest"]], "linear", changed);
  const refresh = () => model.setOptions(modelsOf(design.value()).map((m) => [m.key, m.label]));
  refresh();
  byId("controls-map").append(design.node, model.node, scale.node);
  const current = () => unfold(modelsOf(design.value()).find((m) => m.key === model.value()));
  const LEAST = 1 / 256;
  const share = (v) => (scale.value() === "log" ? 1 - Math.log(Math.max(v, LEAST)) / Math.log(LEAST) : v);

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

  const figure = captioned(byId("plot-map"), () => {
    const m = current();
    const bin = m.merged > 1 ? `; ${m.merged} × ${m.merged} bins of the file are one here` : "";
    return `${design.value()}, ${model.text()}: ${m.quantity}, bins of ${digits(m.bin[0])} × ${digits(m.bin[1])} mm${bin}`;
  });
  const readout = el("p", { class: "readout", role: "status" });
  const box = el("div", { class: "mapbox" });
  figure.body.append(box, readout);

  let move = () => {};
  function drawMap(width) {
    const m = current();
    const most = m.fullValue;
    const low = [m.first[0] - 0.5 * m.bin[0], m.first[1] - 0.5 * m.bin[1]];
    const high = [low[0] + m.columns * m.bin[0], low[1] + m.rows * m.bin[1]];
    const bar = 78;
    const inner = Math.min(width - 60 - bar, 460);
    const height = Math.round((inner * (high[1] - low[1])) / (high[0] - low[0])) + 52;
    const f = frame({ width: inner + 60, height, x: { min: low[0], max: high[0], label: "x (mm)" }, y: { min: low[1], max: high[1], label: "y (mm)" } });
    const canvas = el("canvas", { width: m.columns, height: m.rows, "aria-hidden": "true" });
    const pixels = new ImageData(m.columns, m.rows);
    for (let r = 0; r < m.rows; r += 1) {
      for (let c = 0; c < m.columns; c += 1) {
        const k = 4 * ((m.rows - 1 - r) * m.columns + c);
        pixels.data.set([...colourOf(share(m.value[r * m.columns + c] / most)), 255], k);
      }
    }
    canvas.getContext("2d").putImageData(pixels, 0, 0);
    const total = inner + 60 + bar;
    const percent = (v, of) => `${((100 * v) / of).toFixed(3)}%`;
    canvas.style.cssText = `left:${percent(f.box.left, total)};top:${percent(f.box.top, height)};width:${percent(f.box.right - f.box.left, total)};height:${percent(f.box.bottom - f.box.top, height)}`;
    f.image.setAttribute("viewBox", `0 0 ${total} ${height}`);
    f.image.setAttribute("width", total);
    f.image.setAttribute("tabindex", "0");
    box.style.maxWidth = `${total}px`;
    f.image.querySelectorAll(".grid").forEach((line) => line.remove());
    // Key of the colours.
    const x = inner + 64;
    const count = 32;
    for (let i = 0; i < count; i += 1) {
      const h = (f.box.bottom - f.box.top) / count;
      f.image.append(svg("rect", { x, y: f.box.bottom - (i + 1) * h, width: 12, height: h + 0.5, fill: `rgb(${colourOf((i + 0.5) / count)})` }));
    }
    const marks = scale.value() === "log" ? [1, 0.25, 1 / 16, 1 / 64, LEAST] : [1, 0.75, 0.5, 0.25, 0];
    for (const mark of marks) {
      const y = f.box.bottom - share(mark) * (f.box.bottom - f.box.top);
      f.image.append(svg("text", { class: "soft", x: x + 17, y: y + 4 }, digits(mark * most, 2)));
    }
    const across = svg("line", { class: "cursor", x1: f.box.left, x2: f.box.right, style: "stroke:#7fe0ff" });
    const along = svg("line", { class: "cursor", y1: f.box.top, y2: f.box.bottom, style: "stroke:#7fe0ff" });
    f.image.append(across, along);
    const mark = () => {
      const [c, r] = place(m);
      const [xx, yy] = [m.first[0] + c * m.bin[0], m.first[1] + r * m.bin[1]];
      across.setAttribute("y1", f.py(yy));
      across.setAttribute("y2", f.py(yy));
      along.setAttribute("x1", f.px(xx));
      along.setAttribute("x2", f.px(xx));
      const k = r * m.columns + c;
      readout.replaceChildren(
        el("span", { class: "item" }, `x = ${digits(xx, 4)} mm, y = ${digits(yy, 4)} mm:`),
        el("span", { class: "item" }, el("b", {}, `${withError(m.value[k], m.error[k])} ${m.unit}`)),
        el("span", { class: "item" }, `${digits((100 * m.value[k]) / most, 3)} % of the largest`));
    };
    move = (point) => {
      at = [clamp(point[0], low[0], high[0]), clamp(point[1], low[1], high[1])];
      mark();
      drawProfile();
    };
    for (const touch of ["pointermove", "pointerdown"]) {
      f.image.addEventListener(touch, (event) => {
        const [x0, y0] = pointer(f.image, event);
        if (x0 >= f.box.left && x0 <= f.box.right && y0 >= f.box.top && y0 <= f.box.bottom) move([f.toX(x0), f.toY(y0)]);
      });
    }
    f.image.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      move([at[0] + step[0] * m.bin[0], at[1] + step[1] * m.bin[1]]);
    });
    f.image.setAttribute("aria-label", `Map of ${design.value()}, ${model.text()}; largest ${digits(most)} ${m.unit}`);
    box.replaceChildren(canvas, f.image);
    mark();
    figure.update();
  }

  const profile = captioned(byId("plot-profile"), () => {
    const m = current();
    const [c, r] = place(m);
    return `Profiles through x = ${digits(m.first[0] + c * m.bin[0], 4)} mm, y = ${digits(m.first[1] + r * m.bin[1], 4)} mm`;
  });
  const profileHost = el("div", {});
  const profileRead = el("p", { class: "readout", role: "status" });
  profile.body.append(profileHost, profileRead);
  function drawProfile() {
    const m = current();
    const [c, r] = place(m);
    const log = scale.value() === "log";
    const row = Array.from({ length: m.columns }, (_, i) => r * m.columns + i);
    const column = Array.from({ length: m.rows }, (_, i) => i * m.columns + c);
    const take = (list, values) => list.map((k) => values[k]);
    const curves = [
      { name: "along x", index: 0, x: row.map((_, i) => m.first[0] + i * m.bin[0]), y: take(row, m.value), e: take(row, m.error) },
      { name: "along y", index: 1, x: column.map((_, i) => m.first[1] + i * m.bin[1]), y: take(column, m.value), e: take(column, m.error) },
    ];
    const ends = curves.flatMap((k) => [k.x[0], k.x[k.x.length - 1]]);
    lines(profileHost, profileRead, {
      x: { min: Math.min(...ends), max: Math.max(...ends), label: "position (mm)" },
      y: log ? { min: m.fullValue * LEAST, max: m.fullValue * 1.2, log: true, label: `${m.quantity} (${m.unit})` } : { min: 0, max: m.fullValue * 1.06, label: `${m.quantity} (${m.unit})` },
      curves, aria: `Profiles of ${design.value()}, ${model.text()} along x and y`, read: (x) => `${digits(x, 4)} mm`,
    });
    profileHost.append(legend(curves));
    profile.update();
  }
  redraw.push(responsive(byId("plot-map"), drawMap), responsive(byId("plot-profile"), drawProfile));
});
