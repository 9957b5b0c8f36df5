// SPDX-License-Identifier: MIT OR Apache-2.0
// A package, paths of its light and its far field in three dimensions: turned by dragging and by the arrow keys.

// Paths of a packed scene as lists of points, mm.
function unfoldPaths(s) {
  const raw = unpack(s.points);
  let next = 0;
  return s.sizes.map((count) => {
    const path = Array.from({ length: count }, (_, i) => [0, 1, 2].map((k) => ((2 * raw[3 * (next + i) + k]) / STEPS - 1) * s.radius));
    next += count;
    return path;
  });
}

// A view of scenes in `canvas`, with the names of the axes in `labels`, and `fates` with their colours by number. `clicked` is told
// the polar angle of a click, in degrees. Without WebGL `isDrawn` is false and nothing is drawn.
function sceneView(canvas, labels, fates, clicked = () => {}) {
  const view = viewOf(canvas);
  canvas.hidden = !view;
  const camera = { azimuth: -0.9, elevation: 0.35, radius: 1, middle: 0 };
  const known = new Map(); // meshes of scenes
  let scene = null;
  let lines = [];
  let shown = { hasPackage: true, hasFarField: true, ring: null };

  const tint = (name, opacity) => {
    const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    return [...[1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255), opacity];
  };

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
    labels.replaceChildren(...["x", "y", "z"].flatMap((name, k) => {
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
      neighbours: view.mesh("lines", s.neighbours.flatMap(([x, y, size]) => s.rings.flatMap((line) => moved(circle(...line[line.length - 1].map((along) => size * along), 48), x, y)))),
      axes: view.mesh("lines", [0, 1, 2].flatMap((k) => [0, 0, 0, ...axisEnd(s, k)])),
      solids: view.mesh("lines", s.solids.flatMap((solid) => edges(held(solid.bounds)))),
      plane: view.mesh("lines", [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].slice(0, 4).flatMap(([x, y], k, all) => [
        x * square, y * square, s.plane, all[(k + 1) % 4][0] * square, all[(k + 1) % 4][1] * square, s.plane])),
      lobe: view.mesh("triangles", surface),
      grid: view.mesh("lines", mesh),
    };
  }

  function rays(list) {
    lines.forEach(([mesh]) => view.forget(mesh));
    const ends = fates.map((fate, number) => [number, fate.colour]);
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
    const m = known.get(scene);
    const dome = m.rings.map((mesh, i) => [mesh, i === shown.ring ? tint("--accent", 0.75) : tint("--silicone-edge", i % 2 ? 0.16 : 0.26)]);
    const packed = [[m.ground, tint("--mirror", 0.35)], [m.led, tint("--led", 0.95)], ...dome, [m.creases, tint("--silicone-edge", 0.3)],
      [m.neighbours, tint("--silicone-edge", 0.3)], [m.solids, tint("--medium-edge", 0.8)], [m.plane, tint("--receiver", 0.8)]];
    const far = [[m.lobe, tint(scene.colour, 0.07)], [m.grid, tint(scene.colour, 0.4)]];
    const light = lines.map(([mesh, name, opacity]) => [mesh, tint(name, opacity)]);
    const axes = [m.axes, tint("--ink", 0.9)];
    view.draw(camera, [...(shown.hasPackage ? packed : []), ...light, ...(shown.hasFarField ? far : []), axes]);
    nameAxes();
  }

  // Dragging turns.
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
    const isClick = grip && !grip.moved;
    grip = null;
    // Seen from nearly above, a place says nothing of the polar angle.
    if (!isClick || !scene || camera.elevation > 1.2) return;
    // In the plane of the z axis and the screen's horizontal: x = r sin θ, y = r cos θ cos(elevation).
    const box = canvas.getBoundingClientRect();
    const scale = (2 * camera.radius) / Math.min(box.width, box.height);
    const x = (event.clientX - box.left - box.width / 2) * scale;
    const y = (box.top + box.height / 2 - event.clientY) * scale + camera.middle * Math.cos(camera.elevation);
    clicked(degrees(Math.atan2(Math.abs(x), y / Math.max(0.05, Math.cos(camera.elevation)))));
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

  return {
    isDrawn: Boolean(view),
    // Shows a scene from the side from which the one before was seen.
    open(next) {
      scene = next;
      if (view && !known.has(scene)) known.set(scene, meshes(scene));
      [camera.radius, camera.middle] = [0.86 * scene.radius, 0.4 * scene.radius];
    },
    // Draws the paths of these numbers with the parts that are shown, among them one ring by its number.
    show(list, parts) {
      shown = parts;
      if (view) rays(list);
      draw();
    },
    forget(old) {
      if (known.has(old)) Object.values(known.get(old)).flat().forEach(view.forget);
      known.delete(old);
    },
  };
}
