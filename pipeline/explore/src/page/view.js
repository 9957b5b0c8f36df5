// SPDX-License-Identifier: MIT OR Apache-2.0
// The package in three dimensions with paths and far field of the newest frame, drawn while its fold is open.

const solid = { view: null, scene: null, shown: null };
function showView() {
  if (!byId("fold-view").open || !frame) return;
  // Paths come a moment after the first frame of a design: those before stay until then.
  byId("scene-3d").classList.toggle("old", !frame.view);
  if (!frame.view || solid.shown === frame.view) return;
  solid.shown = frame.view;
  const { error, scene, fates, model } = frame.view;
  if (!error) solid.view ??= sceneView(byId("canvas-3d"), byId("labels-3d"), fates);
  const isDrawn = !error && solid.view.isDrawn;
  byId("without-3d").hidden = isDrawn;
  byId("without-3d").textContent = error ? `The package cannot be drawn: ${error}` : "This browser draws no WebGL; the section above shows the package.";
  byId("scene-3d").hidden = !isDrawn;
  if (!isDrawn) return;
  solid.view.forget(solid.scene);
  scene.paths = unfoldPaths(scene);
  solid.scene = scene;
  solid.view.open(scene);
  const box = (name, label, colour) => {
    const before = byId("parts-3d").querySelector(`[data-part="${name}"]`);
    return el("label", {}, el("input", { type: "checkbox", "data-part": name, checked: !before || before.checked, onchange: showParts }),
      colour && el("span", { class: "key", style: `border-color:var(${colour})` }), label);
  };
  const met = fates.map((fate, i) => [fate, i]).filter(([, i]) => scene.fates.includes(i));
  const boxes = [box("package", "package"), box("far-field", "far field"), ...met.map(([fate, i]) => box(i, fate.words, fate.colour))];
  const focused = document.activeElement.dataset?.part;
  byId("parts-3d").replaceChildren(...boxes);
  if (focused) byId("parts-3d").querySelector(`[data-part="${focused}"]`)?.focus();
  const words = `${scene.paths.length} paths of one package that alone shines, by ${model}`;
  byId("readout-3d").textContent = `${words}; drag or use the arrow keys to turn.`;
  byId("canvas-3d").setAttribute("aria-label", `The package in three dimensions with its far field as a surface: ${words}.`);
  showParts();
}
function showParts() {
  const ticked = new Set([...byId("parts-3d").querySelectorAll("input:checked")].map((box) => box.dataset.part));
  const list = solid.scene.fates.map((_, i) => i).filter((i) => ticked.has(String(solid.scene.fates[i])));
  solid.view.show(list, { hasPackage: ticked.has("package"), hasFarField: ticked.has("far-field"), ring: null });
}
byId("fold-view").addEventListener("toggle", showView);
onFrame(showView);
