// SPDX-License-Identifier: MIT OR Apache-2.0
// Scattering explorer: one band, one incident angle, every order that leaves.

part("bsdf", () => {
  const list = data.orders.list;
  if (!list.length) return;
  const opened = new Map();
  // Lines of a table with the place of every node in its shares.
  function table(hash) {
    if (!opened.has(hash)) {
      const t = data.orders.tables[hash];
      const open = t.lines.map((line) => {
        let first = 0;
        const nodes = line.kx.map((kx, i) => {
          const span = line.spans.slice(4 * i, 4 * i + 4);
          const node = { kx, low: [span[0], span[2]], count: [span[1], span[3]], first };
          first += 2 * (span[1] + span[3]);
          return node;
        });
        return { ...line, nodes };
      });
      opened.set(hash, { ...t, lines: open });
    }
    return opened.get(hash);
  }
  // What a dome stands in may be a solid.
  const outside = () => (current().index[1] > 1.001 ? "the outside" : "air");
  const sideOf = (side) => (side === 0 ? "silicone" : outside());
  const opposite = (side) => 1 - side;

  const cache = new Map();
  const redraw = [];
  const changed = () => redraw.forEach((draw) => draw());
  // Tables of the design that the page shows.
  const design = () => choice.design;
  const none = () => !list.some((e) => e.design === design());
  const follow = () => {
    byId("empty-bsdf").hidden = !none();
    byId("body-bsdf").hidden = none();
    if (none()) return;
    refreshBands();
    reset();
  };
  choice.follow(follow);
  const band = choose("Band", () => reset());
  const side = oneOf("Light from", [["0", "silicone"], ["1", "outside"]], "0", () => reset());
  const polarisation = oneOf("Polarisation", [["u", "unpolarised"], ["s", "s"], ["p", "p"]], "u", () => {
    cache.clear();
    changed();
  });
  const ky = choose("ky", () => reset());
  const scale = oneOf("Shares", [["root", "root"], ["linear", "linear"], ["log", "logarithmic"]], "root", changed);

  const bands = () => list.filter((e) => e.design === (none() ? list[0].design : design()));
  function refreshBands() {
    band.setOptions(bands().map((e, i) => [i, `${e.band}: ring ${e.ring}, ${digits(e.period, 4)} × ${digits(e.depth)} µm${e.nm ? `, ${digits(e.nm, 4)} nm` : ""}`]));
  }
  refreshBands();
  // A band in the middle shows more than the flat first one.
  band.set(String(Math.floor(bands().length / 2)));
  const entry = () => bands()[Number(band.value())] || bands()[0];
  const current = () => table(entry().table);
  const from = () => Number(side.value());
  const line = () => {
    const own = current().lines.filter((l) => l.side === from() && l.nodes.length);
    return own.find((l) => String(l.ky) === ky.value()) || own[0];
  };
  const inPlane = (kx, kyValue, index) => degrees(Math.asin(clamp(kx / Math.sqrt(Math.max(1e-12, index ** 2 - kyValue ** 2)), -1, 1)));
  function describeAngle(i) {
    const l = line();
    const node = l && l.nodes[i];
    return node ? `${minus(inPlane(node.kx, l.ky, current().index[from()]).toFixed(1))}°` : "";
  }
  const angle = slider("Incident angle", { min: 0, max: 1, step: 1, value: 0, format: (i) => describeAngle(i) }, changed);
  const smear = slider("Lobe smeared over (standard deviation)", { min: 0.5, max: 8, step: 0.5, value: 2, format: (v) => `${v}°` }, changed);
  byId("controls-bsdf").append(band.node, side.node, polarisation.node, ky.node, scale.node, angle.node, smear.node);
  function reset() {
    cache.clear();
    const own = current().lines.filter((l) => l.side === from() && l.nodes.length);
    ky.setOptions(own.map((l) => [String(l.ky), digits(l.ky)]));
    ky.node.hidden = own.length < 2;
    const kx = line().nodes.map((n) => n.kx);
    angle.range(0, kx.length - 1, nearest(kx, 0));
    changed();
  }

  // Orders at node `i` of the line: [{ to, order, share, theta }].
  function orders(i) {
    if (cache.has(i)) return cache.get(i);
    const [t, l] = [current(), line()];
    l.unpacked = l.unpacked || unpack(l.shares);
    const node = l.nodes[i];
    const total = node.count[0] + node.count[1];
    const list = [];
    const value = (k) => (l.unpacked[k] / STEPS) ** 2;
    for (const to of [0, 1]) {
      for (let j = 0; j < node.count[to]; j += 1) {
        const k = node.first + (to ? node.count[0] : 0) + j;
        const [s, p] = [value(k), value(k + total)];
        const order = node.low[to] + j;
        const kx = node.kx + order * t.zone;
        const share = { u: 0.5 * (s + p), s, p }[polarisation.value()];
        list.push({ to, order, s, p, share, theta: inPlane(kx, l.ky, t.index[to]) });
      }
    }
    cache.set(i, list);
    return list;
  }
  const sum = (list, to, key = "share") => list.filter((o) => o.to === to).reduce((a, o) => a + o[key], 0);
  const words = { u: "unpolarised", s: "s", p: "p" };
  const described = () => `${entry().design}, band ${entry().band} (ring ${entry().ring}), ${describeAngle(angle.value())} from ${sideOf(from())}, ${words[polarisation.value()]}`;
  const sideColour = (to) => (to === from() ? 1 : 0);
  const sideName = (to) => `${to === from() ? "reflected" : "transmitted"} into ${sideOf(to)}`;
  const LEAST = 1e-5;
  const height = (share) => ({ root: Math.sqrt, linear: (v) => v, log: (v) => 1 - Math.log10(Math.max(v, LEAST)) / Math.log10(LEAST) })[scale.value()](share);
  const back = (h) => ({ root: (v) => v * v, linear: (v) => v, log: (v) => 10 ** ((1 - v) * Math.log10(LEAST)) })[scale.value()](h);

  // Bars.
  const bars = captioned(byId("plot-orders"), () => `Order efficiencies: ${described()}. A bar's title holds its numbers.`);
  const barHost = el("div", {});
  const numbers = el("tbody", {});
  bars.body.append(barHost, el("details", { class: "noprint" }, el("summary", {}, "The twenty largest as numbers"),
    el("div", { class: "scroll" }, el("table", { class: "plain" }, el("thead", {}, el("tr", {}, ["order", "leaves into", "angle (°)", "s", "p", "shown"].map((t) => el("th", { scope: "col" }, t)))), numbers))));
  redraw.push(responsive(byId("plot-orders"), () => {
    const all = orders(angle.value());
    const low = Math.min(...all.map((o) => o.order)) - 1;
    const high = Math.max(...all.map((o) => o.order)) + 1;
    const width = Math.max(280, widthOf(barHost));
    const largest = Math.max(...all.map((o) => o.share));
    const top = scale.value() === "log" ? 1 : height(largest) * 1.06;
    const ROOTS = [0, 0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1];
    const steps = { log: () => logTicks(LEAST, 1), linear: () => ticks(0, top, 6), root: () => ROOTS.filter((t) => height(t) <= top) }[scale.value()]();
    const f = frame({
      width, height: 330, x: { min: low, max: high, label: "relative diffraction order" },
      y: { min: 0, max: top, label: "share of the incident power", ticks: steps.map(height), name: (h) => (scale.value() === "log" ? powerName(back(h)) : digits(Number(back(h).toPrecision(3)))) },
    });
    const step = (f.box.right - f.box.left) / (high - low);
    const wide = Math.max(1, 0.42 * step);
    for (const o of all) {
      const y = f.py(Math.max(0, height(o.share)));
      f.inside.append(svg("rect", {
        x: f.px(o.order) + (o.to === from() ? 0 : -wide), y, width: wide, height: Math.max(0, f.box.bottom - y), fill: colour(sideColour(o.to)), "data-order": o.order, "data-share": o.share.toPrecision(4),
      }, svg("title", {}, `order ${o.order}, ${sideName(o.to)}, ${o.theta.toFixed(1)}°: ${digits(100 * o.share)} %`)));
    }
    f.image.setAttribute("aria-label", `${bars.body.nextSibling.textContent} ${sideName(opposite(from()))} ${digits(100 * sum(all, opposite(from())))} %`);
    barHost.replaceChildren(f.image, legend([opposite(from()), from()].map((to) => ({ name: sideName(to), index: sideColour(to) }))));
    const largestFirst = [...all].sort((a, b) => b.share - a.share).slice(0, 20);
    numbers.replaceChildren(...largestFirst.map((o) => el("tr", {}, [o.order, sideOf(o.to), minus(o.theta.toFixed(1)), digits(o.s), digits(o.p), digits(o.share)].map((v) => el("td", {}, minus(String(v)))))));
    bars.update();
    angle.show();
    const shares = [opposite(from()), from()].map((to) => `${sideName(to)} ${digits(100 * sum(all, to), 4)} %`);
    const zero = all.find((o) => o.order === 0 && o.to !== from());
    const smooth = zero ? `order 0 transmitted ${digits(100 * zero.share)} %` : "order 0 is not transmitted";
    byId("readout-bsdf").replaceChildren(...[`${describeAngle(angle.value())}, kx = ${minus(line().nodes[angle.value()].kx.toFixed(4))}, ky = ${digits(line().ky)}:`, ...shares, smooth, `${all.length} orders`].map((t) => el("span", { class: "item" }, t)));
  }));

  // Lobe: sticks for the orders, and their power smeared over angle.
  const lobe = captioned(byId("plot-lobe"), () => `Lobes of the same: a stick for each order, the outline with ${smear.value()}° of smearing, scaled to its own largest value. Silicone is below; the arrow is the incident light.`);
  redraw.push(responsive(byId("plot-lobe"), (width) => {
    const all = orders(angle.value());
    const radius = Math.min((width - 80) / 2, 200);
    const [cx, cy] = [width / 2, radius + 30];
    const image = svg("svg", { viewBox: `0 0 ${width} ${2 * cy}`, role: "img", "aria-label": `Scattering lobes of ${described()}`, width, height: 2 * cy });
    const most = scale.value() === "log" ? 1 : Math.max(...all.map((o) => o.share));
    const rings = [0.25, 0.5, 0.75, 1];
    polarGrid(image, { cx, cy, radius, rings, name: (ring) => (ring < 0.5 && radius < 150 ? "" : digits(back(ring * height(most)), 2)) });
    image.append(
      svg("line", { class: "frame", x1: cx - radius, x2: cx + radius, y1: cy, y2: cy }),
      svg("text", { class: "soft", x: 0, y: cy - 24 }, sideOf(1)),
      svg("text", { class: "soft", x: 0, y: cy + 32 }, sideOf(0)));
    const direction = (theta, to) => [Math.sin(radians(theta)), to ? -Math.cos(radians(theta)) : Math.cos(radians(theta))];
    const width2 = 2 * smear.value() ** 2;
    const outline = [0, 1].map((to) => {
      const own = all.filter((o) => o.to === to);
      const thetas = Array.from({ length: 181 }, (_, i) => i - 90);
      return thetas.map((theta) => [theta, to, own.reduce((a, o) => a + o.share * Math.exp(-((theta - o.theta) ** 2) / width2), 0)]);
    });
    const densest = Math.max(1e-12, ...outline.flat().map((p) => p[2]));
    outline.forEach((side2, to) => {
      const path = side2.map(([theta, , v]) => {
        const r = radius * Math.min(1, height(v / densest));
        const [dx, dy] = direction(theta, to);
        return [cx + r * dx, cy + r * dy];
      });
      image.append(svg("polygon", { points: points([[cx, cy], ...path]), fill: colour(sideColour(to)), opacity: 0.2 }),
        svg("polyline", { points: points(path), class: "curve", stroke: colour(sideColour(to)), "stroke-width": 1.2 }));
    });
    for (const o of all) {
      const r = (radius * Math.max(0, height(o.share))) / height(most);
      if (r < 0.5) continue;
      const [dx, dy] = direction(o.theta, o.to);
      image.append(svg("line", { x1: cx, y1: cy, x2: cx + r * dx, y2: cy + r * dy, stroke: colour(sideColour(o.to)), "stroke-width": 2 }));
    }
    const theta = inPlane(line().nodes[angle.value()].kx, line().ky, current().index[from()]);
    const [dx, dy] = direction(theta, opposite(from()));
    const tip = (r, across) => `${(cx - r * dx - across * dy).toFixed(1)},${(cy - r * dy + across * dx).toFixed(1)}`;
    image.append(
      svg("line", { x1: cx - radius * dx, y1: cy - radius * dy, x2: cx - 10 * dx, y2: cy - 10 * dy, stroke: "var(--ink)", "stroke-width": 1.5 }),
      svg("polygon", { points: `${tip(3, 0)} ${tip(13, 4)} ${tip(13, -4)}`, fill: "var(--ink)" }));
    lobe.body.replaceChildren(image);
    lobe.update();
  }));

  // Transmitted share over the incident angle.
  const albedo = captioned(byId("plot-albedo"), () => `Share that passes into the other medium over the incident angle, ${entry().design}, band ${entry().band}, from ${sideOf(from())}, ky = ${digits(line().ky)}; the line marks the angle above.`);
  const albedoRead = el("p", { class: "readout", role: "status" });
  const albedoHost = el("div", {});
  albedo.body.append(albedoHost, albedoRead);
  redraw.push(responsive(byId("plot-albedo"), () => {
    const l = line();
    const index = current().index[from()];
    const x = l.nodes.map((n) => inPlane(n.kx, l.ky, index));
    const passed = (key) => l.nodes.map((_, i) => sum(orders(i), opposite(from()), key));
    const curves = [{ name: "s", index: 3, y: passed("s") }, { name: "p", index: 4, y: passed("p") }];
    curves.push({ name: "unpolarised", index: 2, y: x.map((_, i) => 0.5 * (curves[0].y[i] + curves[1].y[i])) });
    const f = frame({
      width: Math.max(280, widthOf(albedoHost)), height: 260, x: { min: -90, max: 90, ticks: [-90, -60, -30, 0, 30, 60, 90], label: `incident angle from ${sideOf(from())} (°)` },
      y: { min: 0, max: 1, label: "share transmitted" },
    });
    for (const c of curves) {
      f.inside.append(svg("polyline", { class: "curve", stroke: colour(c.index), points: points(x.map((v, i) => [f.px(v), f.py(c.y[i])])) }));
    }
    const here = angle.value();
    f.image.append(svg("line", { class: "cursor", x1: f.px(x[here]), x2: f.px(x[here]), y1: f.box.top, y2: f.box.bottom }));
    f.image.setAttribute("aria-label", `Share transmitted over the incident angle, band ${entry().band}, from ${sideOf(from())}`);
    albedoHost.replaceChildren(f.image, legend(curves));
    const item = (c) => el("span", { class: "item" }, `${c.name} `, el("b", {}, digits(c.y[here])));
    albedoRead.replaceChildren(el("span", { class: "item" }, `${describeAngle(here)}:`), ...curves.map(item));
    albedo.update();
  }));
  copies("csv-orders", () => [
    ["order", "into", "angle_deg", "s", "p", "unpolarised"],
    ...orders(angle.value()).map((o) => [o.order, sideOf(o.to), o.theta.toFixed(3), o.s.toPrecision(5), o.p.toPrecision(5), (0.5 * (o.s + o.p)).toPrecision(5)]),
  ]);
  follow();
});
