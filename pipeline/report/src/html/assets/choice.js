// SPDX-License-Identifier: MIT OR Apache-2.0
// The design and model that the whole page shows, parts that are folded, and numbers of curves for other programs.

const choice = {
  model: 0,
  design: data.models[0].design,
  listeners: [],
  // Calls `changed` after every choice.
  follow(changed) { this.listeners.push(changed); },
};

// What belongs to another design or model is hidden, and so is a part of which nothing is left.
function showChosen() {
  for (const node of document.querySelectorAll("main [data-design]:not(option):not(figure)")) node.hidden = node.dataset.design !== choice.design;
  for (const node of document.querySelectorAll(".verdict[data-model], figure.png[data-model]")) node.hidden = node.dataset.model !== String(choice.model);
  for (const section of document.querySelectorAll("section.by-design")) {
    const parts = [...section.querySelectorAll("[data-design], [data-model]")];
    section.hidden = parts.every((node) => node.hidden);
    document.querySelector(`nav a[href="#${section.id}"]`).parentElement.hidden = section.hidden;
  }
}

part("simulated", () => {
  const select = byId("choice").elements.model;
  select.addEventListener("change", () => {
    choice.model = Number(select.value);
    choice.design = data.models[choice.model].design;
    showChosen();
    choice.listeners.forEach((changed) => changed());
  });
  byId("choice").addEventListener("submit", (event) => event.preventDefault());
  showChosen();
});

// A link to a folded part opens it; on paper all parts are open.
const folded = () => [...document.querySelectorAll("details.part:not([open])")];
function unfoldTarget({ hash }) {
  const target = hash.length > 1 && byId(decodeURIComponent(hash.slice(1)));
  const inner = target && target.querySelector("details.part");
  if (inner) inner.open = true;
}
window.addEventListener("hashchange", () => unfoldTarget(location));
for (const link of document.querySelectorAll('a[href^="#"]')) link.addEventListener("click", () => unfoldTarget(link));
unfoldTarget(location);
let unfolded = [];
window.addEventListener("beforeprint", () => {
  unfolded = folded();
  unfolded.forEach((node) => { node.open = true; });
});
window.addEventListener("afterprint", () => unfolded.forEach((node) => { node.open = false; }));

// Copies the lists of `rows()` with a line of heads as CSV when the button `id` is pressed.
function copies(id, rows) {
  const button = byId(id);
  const status = button.parentElement.querySelector("[role=status]");
  button.addEventListener("click", async () => {
    const list = rows();
    const quoted = (cell) => (/[",\n]/.test(cell) ? `"${String(cell).replaceAll('"', '""')}"` : String(cell));
    const text = list.map((row) => row.map(quoted).join(",")).join("\n") + "\n";
    const field = el("textarea", {}, text);
    button.after(field);
    field.select();
    // Pages that are opened as files may not be let to the clipboard otherwise.
    let copied = document.execCommand("copy");
    field.remove();
    if (!copied && navigator.clipboard) copied = await navigator.clipboard.writeText(text).then(() => true, () => false);
    status.textContent = copied ? `${list.length - 1} lines copied` : "This browser does not let pages copy.";
  });
}
