// SPDX-License-Identifier: MIT OR Apache-2.0
// The package, its paths and its far field in three dimensions: turned by dragging, filtered by fate, ring, surface and polar angle.
// Shares are counted in all paths traced; those drawn are the first of them that pass the filters.

part("view-3d", () => {
  const form = byId("controls-3d");
  if (!form) return;
  // Rays drawn before all are asked for.
  const FEW = 60;
  const canvas = byId("canvas-3d");
  let bin = null; // chosen polar angle
  let scene = null;
  // A click chooses the polar angle of that direction.
  const view = sceneView(canvas, byId("labels-3d"), data.fates, (theta) => {
    const next = Math.min(scene.byRing.length - 1, Math.floor(theta / scene.binDeg));
    bin = bin === next ? null : next;
    update();
  });
  byId("without-3d").hidden = view.isDrawn;
  const [ring, face] = ["ring", "face"].map((name) => form.elements[name]);
  const status = byId("readout-3d");

  // Fates that no path of the model has are hidden.
  const checked = (name) => [...form.querySelectorAll(`input[name=${name}]:checked`)].filter((box) => !box.parentElement.hidden).map((box) => Number(box.value));
  const chosen = (select) => (select.value === "" ? null : Number(select.value));

  // Numbers of the paths that pass all filters.
  function passing() {
    const fates = checked("fate");
    const [r, f] = [chosen(ring), chosen(face)];
    return scene.paths.map((_, i) => i).filter((i) => fates.includes(scene.fates[i])
      && (r === null || scene.pathRings[i] === r) && (f === null || scene.pathFaces[i] === f) && (bin === null || scene.bins[i] === bin));
  }

  // Intensity by polar angle as buttons, one for each bin as far as light goes.
  const sum = (list) => list.reduce((a, b) => a + b, 0);
  function angles() {
    const totals = scene.byRing.map(sum);
    const solid = (i) => Math.cos(radians(i * scene.binDeg)) - Math.cos(radians((i + 1) * scene.binDeg));
    const intensity = totals.map((n, i) => n / solid(i));
    const most = Math.max(...intensity, 1e-9);
    const last = Math.max(totals.reduce((end, n, i) => (n > 0 ? i : end), 0), Math.round(90 / scene.binDeg) - 1);
    byId("angles-3d").replaceChildren(...totals.slice(0, last + 1).map((n, i) => {
      const label = `${i * scene.binDeg} to ${(i + 1) * scene.binDeg}°: ${digits((100 * n) / scene.traced, 2)} % of the light, intensity ${digits((100 * intensity[i]) / most, 2)} % of the largest`;
      const button = el("button", { type: "button", "aria-label": label, "aria-pressed": String(bin === i), title: label });
      button.append(el("span", { style: `height:${(100 * intensity[i]) / most}%` }));
      button.addEventListener("click", () => { bin = bin === i ? null : i; update(); });
      return button;
    }));
    const end = (last + 1) * scene.binDeg;
    byId("scale-3d").replaceChildren(...[0, end / 2, end].map((t) => el("span", {}, `${t}°`)));
  }

  // The rings, and the surfaces met last, by their shares of what leaves into the chosen angles.
  function ranking(host, rows, names, select, none) {
    const of = names.map((_, k) => sum((bin === null ? rows : [rows[bin]]).map((row) => row[k])));
    const total = sum((bin === null ? rows : [rows[bin]]).map(sum)) || 1;
    const order = of.map((n, k) => [n, k]).filter(([n]) => n > 0).sort((a, b) => b[0] - a[0]).slice(0, 8);
    host.replaceChildren(...order.map(([n, k]) => {
      const p = n / total;
      const text = `${names[k]}: ${withError(100 * p, 100 * Math.sqrt((p * (1 - p)) / total))} %`;
      const button = el("button", { type: "button", "aria-pressed": String(chosen(select) === k) }, el("span", { class: "bar", style: `width:${100 * p}%` }), el("span", {}, text));
      button.addEventListener("click", () => { select.value = chosen(select) === k ? "" : String(k); update(); });
      return el("li", {}, button);
    }));
    if (!order.length) host.replaceChildren(el("li", {}, none));
  }

  function update() {
    if (!scene) return;
    const all = passing();
    const list = checked("show").includes(2) ? all : all.slice(0, FEW);
    angles();
    const where = bin === null ? "all directions" : `${bin * scene.binDeg} to ${(bin + 1) * scene.binDeg}°`;
    byId("ranking-where").textContent = `Light into ${where}`;
    ranking(byId("ranking-rings"), scene.byRing, scene.ringNames, ring, "No light left the dome into these angles.");
    ranking(byId("ranking-faces"), scene.byFace, scene.faceNames, face, "No light into these angles met a surface.");
    const words = checked("fate").length ? `${list.length} of ${all.length} paths drawn, ${where}.` : "No fate is ticked: no path is drawn.";
    status.textContent = words;
    canvas.setAttribute("aria-label", `The package in three dimensions with its far field as a surface. ${words}`);
    const parts = checked("show");
    view.show(list, { hasPackage: parts.includes(0), hasFarField: parts.includes(1), ring: chosen(ring) });
  }

  function open() {
    scene = data.models[choice.model].view3d;
    byId("empty-3d").hidden = Boolean(scene);
    byId("body-3d").hidden = !scene;
    if (!scene) return;
    scene.paths ??= unfoldPaths(scene);
    view.open(scene);
    bin = null;
    for (const box of form.querySelectorAll("input[name=fate]")) box.parentElement.hidden = !scene.fates.includes(Number(box.value));
    const options = (names) => [el("option", { value: "" }, "any"), ...names.map((name, k) => el("option", { value: k }, name))];
    for (const node of document.querySelectorAll("#view-3d .of-dome")) node.hidden = !scene.ringNames.length;
    ring.replaceChildren(...options(scene.ringNames));
    face.replaceChildren(...options(scene.faceNames));
    update();
  }

  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("change", update);
  choice.follow(() => { if (scene || !byId("empty-3d").hidden) open(); });
  byId("reset-3d").addEventListener("click", () => { bin = null; [ring.value, face.value] = ["", ""]; update(); });


  // Nothing is drawn before it comes near the screen or goes to paper.
  const begin = () => { if (!scene) open(); };
  new IntersectionObserver((entries) => { if (entries.some((entry) => entry.isIntersecting)) begin(); }, { rootMargin: "300px" }).observe(byId("body-3d"));
  window.addEventListener("beforeprint", begin);
});
