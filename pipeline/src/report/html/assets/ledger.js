// SPDX-License-Identifier: MIT OR Apache-2.0
// Where the power goes that does not escape upwards, as bars.

part("ledger", () => {
  const figure = byId("plot-ledger");
  const lost = (name) => /^(absorbed_|lost_|escaped_down)/.test(name);
  const accounts = [...new Set(data.models.flatMap((m) => m.ledger.filter(([name, v]) => lost(name) && v > 5e-7).map(([name]) => name)))];
  const total = (m) => m.ledger.filter(([name]) => lost(name)).reduce((a, [, v]) => a + v, 0);
  const most = Math.max(1e-9, ...data.models.map(total));
  const { body, update } = captioned(figure, () => (accounts.length
    ? "Shares of the emitted power that do not escape upwards; the rest does. The numbers stand in the tables below."
    : "All emitted power escapes upwards."));
  responsive(figure, (width) => {
    const step = 24;
    const left = Math.min(190, width * 0.42);
    const height = data.models.length * step + 46;
    const x = (v) => left + (v / (most * 1.04)) * (width - left - 16);
    const image = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", width, height, "aria-label": `Power that does not escape: ${data.models.map((m) => `${m.design} ${m.label} ${digits(100 * total(m))} %`).join("; ")}` });
    const marks = ticks(0, 100 * most * 1.04, Math.floor((width - left) / 70));
    for (const t of marks) {
      image.append(svg("line", { class: "grid", x1: x(t / 100), x2: x(t / 100), y1: 0, y2: height - 40 }),
        svg("text", { class: "soft", x: x(t / 100), y: height - 24, "text-anchor": "middle" }, tickName(marks)(t)));
    }
    image.append(svg("text", { x: (left + width) / 2, y: height - 5, "text-anchor": "middle" }, "share of the emitted power (%)"));
    data.models.forEach((m, i) => {
      const y = i * step + 3;
      let from = 0;
      image.append(svg("text", { x: 0, y: y + 13 }, `${m.design} ${m.label}`));
      accounts.forEach((account, k) => {
        const found = m.ledger.find(([name]) => name === account);
        if (!found || found[1] <= 0) return;
        image.append(svg("rect", { x: x(from), y, width: Math.max(0.5, x(from + found[1]) - x(from)), height: step - 7, fill: colour(k), stroke: "var(--page)", "stroke-width": 0.5 },
          svg("title", {}, `${m.design}, ${m.label}, ${account.replaceAll("_", " ")}: ${withError(100 * found[1], 100 * found[2])} %`)));
        from += found[1];
      });
    });
    const key = (account, k) => el("span", { class: "item" }, el("span", { class: "key", style: `border-top-width:.7rem;width:.9rem;border-color:${colour(k)};margin-right:.35rem` }), account.replaceAll("_", " "));
    body.replaceChildren(image, el("p", { class: "legend" }, accounts.map(key)));
    update();
  });
});
