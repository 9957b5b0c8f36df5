// SPDX-License-Identifier: MIT OR Apache-2.0
// Form elements with labels. Each returns the element and ways to read or set it; `changed` is called after every change.

let numbered = 0;
const newId = () => `control-${(numbered += 1)}`;

function choose(label, changed) {
  const id = newId();
  const select = el("select", { id });
  const setOptions = (list) => {
    const before = select.value;
    select.replaceChildren(...list.map(([value, text]) => el("option", { value }, text)));
    if (list.some(([value]) => String(value) === before)) select.value = before;
  };
  select.addEventListener("change", () => changed(select.value));
  return {
    node: el("div", { class: "field" }, el("label", { for: id }, label), select),
    value: () => select.value,
    set: (value) => { select.value = value; },
    setOptions,
  };
}

function slider(label, { min, max, step, value, format }, changed) {
  const id = newId();
  const output = el("output", { for: id });
  const input = el("input", { id, type: "range", min, max, step, value });
  const show = () => {
    output.textContent = format(Number(input.value));
    input.setAttribute("aria-valuetext", output.textContent);
  };
  input.addEventListener("input", () => {
    show();
    changed(Number(input.value));
  });
  show();
  return {
    node: el("div", { class: "field wide" }, el("label", { for: id }, `${label}: `, output), input),
    value: () => Number(input.value),
    range: (low, high, now) => {
      input.min = low;
      input.max = high;
      input.value = now;
      show();
    },
    show,
  };
}

// Radio buttons where one of a few is chosen.
function oneOf(label, options, chosen, changed) {
  const name = newId();
  const inputs = options.map(([value, text]) => {
    const input = el("input", { type: "radio", name, value });
    input.checked = value === chosen;
    input.addEventListener("change", () => changed(value));
    return el("label", {}, input, text);
  });
  const node = el("fieldset", {}, el("legend", {}, label), el("div", { class: "choices" }, inputs));
  return { node, value: () => node.querySelector("input:checked").value };
}

// A caption that says what is shown, on the screen and on paper where the controls are not.
function captioned(figure, describe) {
  const caption = el("figcaption", {});
  const body = el("div", {});
  figure.replaceChildren(body, caption);
  return { body, update: () => { caption.textContent = describe(); } };
}
