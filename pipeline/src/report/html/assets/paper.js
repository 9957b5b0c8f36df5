// SPDX-License-Identifier: MIT OR Apache-2.0
// Figures 3, 4 and 6 of the paper, where the run has made them.

part("paper", () => {
  const paper = data.paper;
  const elements = (id, list, caption) => {
    if (!list) return;
    const { body, update } = captioned(byId(id), () => caption);
    const host = el("div", {});
    const readout = el("p", { class: "readout", role: "status" });
    body.append(host, readout);
    responsive(byId(id), () => {
      const curves = list.map((c, i) => ({ name: c.label, index: i, x: c.theta, y: c.value, e: c.error }));
      lines(host, readout, {
        x: { min: 0, max: 90, ticks: [0, 15, 30, 45, 60, 75, 90], label: "polar angle θ (°)" },
        y: { min: 0, max: 1.06 * Math.max(...curves.flatMap((c) => c.y)), label: "intensity (W/sr)" },
        curves, aria: caption, read: (x) => `θ = ${digits(x)}°`,
      });
      host.append(legend(curves));
      update();
    });
  };
  elements("plot-fig3", paper.figure_3, "Figure 3: elements one at a time, all others absorbing; azimuthal means with two standard errors.");
  elements("plot-fig4", paper.figure_4, "Figure 4: one element in its three shapes, all others absorbing.");

  const six = paper.figure_6;
  if (six) {
    const { body, update } = captioned(byId("plot-fig6"), () => `Figure 6: band ${six.band}, ring ${six.ring}, normal incidence from the silicone, by rays (orange) and by RCWA (blue). Lengths are roots of shares. Air is above.`);
    responsive(byId("plot-fig6"), (width) => {
      const radius = Math.min((width - 80) / 2, 230);
      const [cx, cy] = [width / 2, radius + 30];
      const image = svg("svg", { viewBox: `0 0 ${width} ${2 * cy}`, role: "img", width, height: 2 * cy, "aria-label": `Lobes of ring ${six.ring}: ${six.rays.length} by rays, ${six.rcwa.length} orders by RCWA` });
      const most = Math.sqrt(Math.max(...[...six.rays, ...six.rcwa].map((l) => l[2])));
      polarGrid(image, { cx, cy, radius, whole: true, rings: [0.25, 0.5, 0.75, 1], name: (ring) => (ring < 0.5 && radius < 150 ? "" : digits((ring * most) ** 2, 2)) });
      image.append(svg("line", { class: "frame", x1: cx - radius, x2: cx + radius, y1: cy, y2: cy }));
      const sticks = (list, index, wide) => {
        for (const [side, theta, share] of list) {
          const r = (radius * Math.sqrt(share)) / most;
          const [dx, dy] = [Math.sin(radians(theta)), (side === "transmitted" ? -1 : 1) * Math.cos(radians(theta))];
          image.append(svg("line", { x1: cx, y1: cy, x2: cx + r * dx, y2: cy + r * dy, stroke: colour(index), "stroke-width": wide, opacity: wide > 3 ? 0.7 : 1 }));
        }
      };
      sticks(six.rays, 1, 6);
      sticks(six.rcwa, 0, 2);
      body.replaceChildren(image);
      update();
    });
  }
  const section = byId("paper");
  if (!paper.figure_3 && !paper.figure_4 && !six) {
    section.remove();
    document.querySelector('nav a[href="#paper"]').parentElement.remove();
  }
});
