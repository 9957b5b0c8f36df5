// SPDX-License-Identifier: MIT OR Apache-2.0
// The package, its paths and its far field in three dimensions: turned by dragging, filtered by fate, ring, surface and polar angle.
// Shares are counted in all paths traced; those drawn are the first of them that pass the filters.

part("view-3d", () => {
  const form = byId("controls-3d");
  if (!form) return;
  // Rays drawn before all are asked for.
  const FEW = 60;
  const canvas = byId("canvas-3d");
  const [ring, face] = ["ring", "face"].map((name) => form.elements[name]);
  const status = byId("readout-3d");
  const view = viewOf(canvas);
  if (!view) byId("without-3d").hidden = false;
  canvas.hidden = !view;
  const camera = { azimuth: -0.9, elevation: 0.35, radius: 1, middle: 0 };
  let bin = null; // chosen polar angle
  let scene = null;
  let lines = [];
  const cache = new Map();

  const tint = (name, opacity) => {
    const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    return [...[1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255), opacity];
  };

  // Paths of a model as lists of points, mm.
  function unfold(index) {
    if (cache.has(index)) return cache.get(index);
    const s = data.models[index].view3d;
    if (s) {
      const raw = unpack(s.points);
      let next = 0;
      s.paths = s.sizes.map((count) => {
        const path = Array.from({ length: count }, (_, i) => [0, 1, 2].map((k) => ((2 * raw[3 * (next + i) + k]) / STEPS - 1) * s.radius));
        next += count;
        return path;
      });
      if (view) s.meshes = meshes(s);
    }
    cache.set(index, s);
    return s;
  }

  // The far field as a surface: its radius is the intensity.
  function lobe({ polar, azimuths, share }, size) {
    const raw = unpack(share);
    const at = (i, k) => {
      const r = raw[i * azimuths + (k % azimuths)] / STEPS;
      const [theta, phi] = [(Math.PI * (i + 0.5)) / polar, (2 * Math.PI * (k + 0.5)) / azimuths];
      return [Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)].map((x) => x * r * size);
    };
    const [points, mesh] = [[], []];
    for (let i = 0; i + 1 < polar; i += 1) {
      for (let k = 0; k < azimuths; k += 1) {
        const [a, b, c, d] = [at(i, k), at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)];
        points.push(...a, ...b, ...c, ...c, ...b, ...d);
        if (k % 3 === 0) mesh.push(...a, ...b);
        if (i % 2 === 0) mesh.push(...a, ...c);
      }
    }
    return [points, mesh];
  }

  const moved = (list, x, y) => list.map((v, i) => v + [x, y, 0][i % 3]);
  // Length of the axes: a round one, mm.
  const axisLength = (s) => {
    const power = 10 ** Math.floor(Math.log10(0.75 * s.radius));
    return power * [5, 2, 1].find((k) => k * power <= 0.75 * s.radius);
  };
  const axisEnd = (s, k) => [0, 1, 2].map((i) => (i === k ? axisLength(s) : 0));

  // Names of the axes at their ends, as far as they do not stand over each other.
  function nameAxes() {
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    const scale = Math.min(w, h) / (2 * camera.radius);
    const [s, c, v, up] = [Math.sin(camera.azimuth), Math.cos(camera.azimuth), Math.sin(camera.elevation), Math.cos(camera.elevation)];
    const placed = [];
    byId("labels-3d").replaceChildren(...["x", "y", "z"].flatMap((name, k) => {
      const [x, y, z] = axisEnd(scene, k).map((value) => 1.06 * value);
      const at = [w / 2 + (c * y - s * x) * scale, h / 2 - (up * (z - camera.middle) - v * (c * x + s * y)) * scale];
      const apart = placed.every(([a, b]) => Math.abs(a - at[0]) > 60 || Math.abs(b - at[1]) > 22);
      if (!apart || at[0] < 35 || at[0] > w - 35 || at[1] < 12 || at[1] > h - 12) return [];
      placed.push(at);
      return [el("span", { style: `left:${at[0].toFixed(1)}px;top:${at[1].toFixed(1)}px` }, `${name} ${digits(axisLength(scene))} mm`)];
    }));
  }

  function meshes(s) {
    const tall = s.radius;
    const [surface, mesh] = lobe(s.lobe, 0.8 * tall);
    const ground = [[[-1, -1], [1, -1], [-1, 1], [-1, 1], [1, -1], [1, 1]].flatMap(([x, y]) => [x * s.mirror, y * s.mirror, -0.002 * tall])];
    const held = ([low, high]) => [low, high].map((corner) => corner.map((x) => clamp(x, -tall, tall)));
    const square = 0.7 * tall;
    return {
      ground: view.mesh("triangles", ground[0]),
      led: view.mesh("triangles", ...faces(s.led)),
      rings: s.rings.map((line) => view.mesh("triangles", ...revolved(line))),
      creases: view.mesh("lines", s.rings.flatMap((line) => circle(...line[line.length - 1]))),
      // Packages beside this one, at which paths end.
      neighbours: view.mesh("lines", s.neighbours.flatMap(([x, y]) => s.rings.flatMap((line) => moved(circle(...line[line.length - 1], 48), x, y)))),
      axes: view.mesh("lines", [0, 1, 2].flatMap((k) => [0, 0, 0, ...axisEnd(s, k)])),
      solids: view.mesh("lines", s.solids.flatMap((solid) => edges(held(solid.bounds)))),
      plane: view.mesh("lines", [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].slice(0, 4).flatMap(([x, y], k, all) => [
        x * square, y * square, s.plane, all[(k + 1) % 4][0] * square, all[(k + 1) % 4][1] * square, s.plane])),
      lobe: view.mesh("triangles", surface),
      grid: view.mesh("lines", mesh),
    };
  }

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

  function rays(list) {
    lines.forEach(([mesh]) => view.forget(mesh));
    const ends = data.fates.map((fate, number) => [number, fate.colour]);
    const opacity = clamp(9 / Math.sqrt(list.length + 1), 0.16, 0.85);
    lines = ends.map(([number, name]) => {
      const points = list.filter((i) => scene.fates[i] === number).flatMap((i) => {
        const path = scene.paths[i];
        return path.slice(1).flatMap((p, k) => [...path[k], ...p]);
      });
      return [view.mesh("lines", points), name, opacity];
    });
  }

  function draw() {
    if (!view || !scene) return;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    [canvas.width, canvas.height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
    const m = scene.meshes;
    const r = chosen(ring);
    const shown = checked("show");
    const dome = m.rings.map((mesh, i) => [mesh, i === r ? tint("--accent", 0.75) : tint("--silicone-edge", i % 2 ? 0.16 : 0.26)]);
    const packed = [[m.ground, tint("--mirror", 0.35)], [m.led, tint("--led", 0.95)], ...dome, [m.creases, tint("--silicone-edge", 0.3)],
      [m.neighbours, tint("--silicone-edge", 0.3)], [m.solids, tint("--medium-edge", 0.8)], [m.plane, tint("--receiver", 0.8)]];
    const far = [[m.lobe, tint(scene.colour, 0.07)], [m.grid, tint(scene.colour, 0.4)]];
    const light = lines.map(([mesh, name, opacity]) => [mesh, tint(name, opacity)]);
    const axes = [m.axes, tint("--ink", 0.9)];
    view.draw(camera, [...(shown.includes(0) ? packed : []), ...light, ...(shown.includes(1) ? far : []), axes]);
    nameAxes();
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
    if (view) rays(list);
    angles();
    const where = bin === null ? "all directions" : `${bin * scene.binDeg} to ${(bin + 1) * scene.binDeg}°`;
    byId("ranking-where").textContent = `Light into ${where}`;
    ranking(byId("ranking-rings"), scene.byRing, scene.ringNames, ring, "No light left the dome into these angles.");
    ranking(byId("ranking-faces"), scene.byFace, scene.faceNames, face, "No light into these angles met a surface.");
    const words = checked("fate").length ? `${list.length} of ${all.length} paths drawn, ${where}.` : "No fate is ticked: no path is drawn.";
    status.textContent = words;
    canvas.setAttribute("aria-label", `The package in three dimensions with its far field as a surface. ${words}`);
    draw();
  }

  function open() {
    scene = unfold(choice.model);
    byId("empty-3d").hidden = Boolean(scene);
    byId("body-3d").hidden = !scene;
    if (!scene) return;
    bin = null;
    for (const box of form.querySelectorAll("input[name=fate]")) box.parentElement.hidden = !scene.fates.includes(Number(box.value));
    const options = (names) => [el("option", { value: "" }, "any"), ...names.map((name, k) => el("option", { value: k }, name))];
    for (const node of document.querySelectorAll("#view-3d .of-dome")) node.hidden = !scene.ringNames.length;
    ring.replaceChildren(...options(scene.ringNames));
    face.replaceChildren(...options(scene.faceNames));
    [camera.radius, camera.middle] = [0.86 * scene.radius, 0.4 * scene.radius];
    update();
  }

  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("change", update);
  choice.follow(() => { if (scene || !byId("empty-3d").hidden) open(); });
  byId("reset-3d").addEventListener("click", () => { bin = null; [ring.value, face.value] = ["", ""]; update(); });

  // Dragging turns; a click without dragging chooses the polar angle of that direction.
  let grip = null;
  canvas.addEventListener("pointerdown", (event) => {
    grip = { x: event.clientX, y: event.clientY, azimuth: camera.azimuth, elevation: camera.elevation, moved: false };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!grip) return;
    const [dx, dy] = [event.clientX - grip.x, event.clientY - grip.y];
    grip.moved = grip.moved || Math.hypot(dx, dy) > 4;
    camera.azimuth = grip.azimuth - 0.008 * dx;
    camera.elevation = clamp(grip.elevation + 0.008 * dy, -0.3, Math.PI / 2);
    draw();
  });
  canvas.addEventListener("pointerup", (event) => {
    const clicked = grip && !grip.moved;
    grip = null;
    // Seen from nearly above, a place says nothing of the polar angle.
    if (!clicked || camera.elevation > 1.2) return;
    // In the plane of the z axis and the screen's horizontal: x = r sin θ, y = r cos θ cos(elevation).
    const box = canvas.getBoundingClientRect();
    const scale = (2 * camera.radius) / Math.min(box.width, box.height);
    const x = (event.clientX - box.left - box.width / 2) * scale;
    const y = (box.top + box.height / 2 - event.clientY) * scale + camera.middle * Math.cos(camera.elevation);
    const theta = degrees(Math.atan2(Math.abs(x), y / Math.max(0.05, Math.cos(camera.elevation))));
    const next = Math.min(scene.byRing.length - 1, Math.floor(theta / scene.binDeg));
    bin = bin === next ? null : next;
    update();
  });
  canvas.addEventListener("pointercancel", () => (grip = null));
  canvas.addEventListener("keydown", (event) => {
    const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!turn) return;
    event.preventDefault();
    camera.azimuth += turn[0];
    camera.elevation = clamp(camera.elevation + turn[1], -0.3, Math.PI / 2);
    draw();
  });
  new ResizeObserver(draw).observe(canvas);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  // Nothing is drawn before it comes near the screen or goes to paper.
  const begin = () => { if (!scene) open(); };
  new IntersectionObserver((entries) => { if (entries.some((entry) => entry.isIntersecting)) begin(); }, { rootMargin: "300px" }).observe(byId("body-3d"));
  window.addEventListener("beforeprint", begin);
});
