// SPDX-License-Identifier: MIT OR Apache-2.0
// Pictures of the page: which of a section's pictures is shown, which of its curves, what lies under the pointer.

// Calls `shown` after every choice of the page or in the form of the section `id`, and once now.
function pictures(id, shown) {
  const section = byId(id);
  const form = section.querySelector("form.pictures");
  const figures = [...section.querySelectorAll("figure.picture")];
  const boxes = form ? [...form.querySelectorAll("input[name=curve]")] : [];
  const cut = form && form.elements.cut;
  const update = () => {
    // Cuts that the design does not have.
    for (const option of cut ? cut.options : []) {
      option.disabled = !figures.some((figure) => figure.dataset.design === choice.design && figure.dataset.cut === option.value);
    }
    if (cut && cut.selectedOptions[0].disabled) cut.value = [...cut.options].find((option) => !option.disabled).value;
    const own = form ? [...new FormData(form)].filter(([name]) => name !== "curve") : [];
    const chosen = [["model", String(choice.model)], ["design", choice.design], ...own];
    for (const figure of figures) {
      figure.hidden = chosen.some(([name, value]) => name in figure.dataset && figure.dataset[name] !== value);
    }
    const visible = figures.filter((figure) => !figure.hidden);
    for (const box of boxes) {
      const groups = visible.flatMap((figure) => [...figure.querySelectorAll("[data-curve]")]).filter((g) => g.dataset.curve === box.value);
      box.parentElement.hidden = groups.length === 0;
      for (const group of groups) group.style.display = box.checked ? "" : "none";
    }
    const labels = boxes.filter((box) => box.checked && !box.parentElement.hidden).map((box) => box.value);
    const none = boxes.length ? labels.length === 0 : visible.length === 0;
    if (none) figures.forEach((figure) => { figure.hidden = true; });
    for (const empty of section.querySelectorAll(".empty")) empty.hidden = !none;
    shown(Object.fromEntries(chosen), labels);
  };
  choice.follow(update);
  if (form) {
    form.addEventListener("change", update);
    form.addEventListener("submit", (event) => event.preventDefault());
  }
  update();
}

// The axes of a picture's panels: { box, x, y } with `place` and `number` from numbers to the picture's units and back.
function panels(image) {
  const axis = ([low, high], from, to, log) => {
    const f = log ? Math.log : (v) => v;
    const back = log ? Math.exp : (v) => v;
    return {
      low, high,
      place: (v) => from + ((f(log ? Math.max(v, low * 1e-3) : v) - f(low)) / (f(high) - f(low))) * (to - from),
      number: (p) => back(f(low) + ((p - from) / (to - from)) * (f(high) - f(low))),
    };
  };
  return [...image.querySelectorAll("[data-panel]")].map((node) => {
    const numbers = (name) => node.dataset[name].split(" ").map(Number);
    const [left, top, right, bottom] = numbers("panel");
    const log = (name) => node.dataset[name].endsWith(" log");
    return {
      node, box: { left, top, right, bottom },
      x: axis(numbers("x"), left, right, log("x")), y: axis(numbers("y"), bottom, top, log("y")),
    };
  });
}

part("simulated", () => pictures("simulated", () => {}));

// Position of a pointer in the units of the image's viewBox.
function pointer(image, event) {
  const place = image.getBoundingClientRect();
  const view = image.viewBox.baseVal;
  return [((event.clientX - place.left) * view.width) / place.width, ((event.clientY - place.top) * view.height) / place.height];
}

const points = (list) => list.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");

// A line across a panel, at numbers given later.
function cursor(image, panel, across) {
  const { left, top, right, bottom } = panel.box;
  const line = svg("line", { class: "cursor", x1: left, x2: right, y1: top, y2: bottom, visibility: "hidden" });
  image.append(line);
  const [axis, ends] = across ? [panel.y, ["y1", "y2"]] : [panel.x, ["x1", "x2"]];
  return (number) => {
    for (const end of ends) line.setAttribute(end, axis.place(number));
    line.setAttribute("visibility", "visible");
  };
}

// Calls `move` with numbers where the pointer is over the panel, `step` with the direction of an arrow key.
function reads(image, panel, move, step) {
  const { left, top, right, bottom } = panel.box;
  image.setAttribute("tabindex", "0");
  for (const touch of ["pointermove", "pointerdown"]) {
    image.addEventListener(touch, (event) => {
      const [x, y] = pointer(image, event);
      if (x >= left && x <= right && y >= top && y <= bottom) move(panel.x.number(x), panel.y.number(y));
    });
  }
  image.addEventListener("keydown", (event) => {
    const direction = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!direction) return;
    event.preventDefault();
    step(...direction);
  });
}
