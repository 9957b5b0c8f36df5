// SPDX-License-Identifier: MIT OR Apache-2.0
// The bar, the text of the design, and kept states.

const on = (id, act) => byId(id).addEventListener("click", act);
on("undo", () => sendOrSay("undo"));
on("redo", () => sendOrSay("redo"));
on("keep", () => sendOrSay("keep"));
on("save", save);
on("reload", () => sendOrSay("reload"));
byId("model").addEventListener("change", () => sendOrSay("model", { model: byId("model").value }));

let saysOver = false;
async function save() {
  try {
    await send("save", { over: saysOver });
    saysOver = false;
    if (state.error) say("Saved, but the text is no design yet.");
  } catch (error) {
    saysOver = true;
    if (!error.isSaid) say(error.message);
  }
}
async function exportAs(word) {
  byId("export").open = false;
  byId("export").firstElementChild.focus();
  say(`Writing ${word} …`);
  const answer = await fetch(`export?format=${encodeURIComponent(word)}`);
  if (!answer.ok) {
    say((await answer.json()).error.message);
    return;
  }
  const name = /filename="([^"]*)"/.exec(answer.headers.get("Content-Disposition") || "");
  const link = el("a", { href: URL.createObjectURL(await answer.blob()), download: name ? name[1] : word });
  link.click();
  URL.revokeObjectURL(link.href);
  say("");
}
// The menu closes where something else is done.
document.addEventListener("click", (event) => { if (!byId("export").contains(event.target)) byId("export").open = false; });
byId("export").addEventListener("focusout", (event) => { if (event.relatedTarget && !byId("export").contains(event.relatedTarget)) byId("export").open = false; });
byId("export").addEventListener("keydown", (event) => {
  if (event.key !== "Escape") return;
  byId("export").open = false;
  byId("export").firstElementChild.focus();
});

document.addEventListener("keydown", (event) => {
  const writes = event.target.matches("textarea, select, input[type=number], input[type=search]");
  const key = event.key.toLowerCase();
  if ((event.ctrlKey || event.metaKey) && key === "s") { event.preventDefault(); save(); }
  else if (writes || byId("search-dialog").open) return;
  else if ((event.ctrlKey || event.metaKey) && key === "z") { event.preventDefault(); sendOrSay(event.shiftKey ? "redo" : "undo"); }
  else if (key === "k" && !event.ctrlKey && !event.metaKey && !event.altKey) sendOrSay("keep");
});

// The text goes to the server a moment after the last key; until it is there, no other text takes its place.
let typing = null;
byId("text").addEventListener("input", () => {
  clearTimeout(typing);
  const timer = setTimeout(async () => {
    await sendOrSay("text", { text: byId("text").value });
    if (typing === timer) typing = null;
  }, 400);
  typing = timer;
  showLines();
});
byId("text").addEventListener("scroll", () => { byId("line-numbers").scrollTop = byId("text").scrollTop; });
// Numbers of the lines; the one of the error is marked.
function showLines() {
  const count = byId("text").value.split("\n").length;
  const wrong = state && state.error && state.error.line;
  const shown = `${count} ${wrong}`;
  if (byId("line-numbers").dataset.shown === shown) return;
  byId("line-numbers").dataset.shown = shown;
  byId("line-numbers").replaceChildren(...Array.from({ length: count }, (_, i) => el(i + 1 === wrong ? "b" : "span", {}, `${i + 1}\n`)));
  byId("line-numbers").scrollTop = byId("text").scrollTop;
}

function options(select, list, value) {
  const wanted = JSON.stringify(list);
  if (select.dataset.list !== wanted) {
    select.dataset.list = wanted;
    select.replaceChildren(...list.map(([word, label]) => el("option", { value: word }, label)));
  }
  select.value = value;
}

onState(() => {
  byId("file").textContent = `${state.file}${state.saved ? "" : " •"}`;
  byId("file").title = state.saved ? "saved" : "not saved";
  byId("file").setAttribute("aria-label", `${state.file}, ${byId("file").title}`);
  document.title = `${state.name}: batwing explore`;
  options(byId("model"), state.models.map((model) => [model.word, model.label]), state.model);
  if (!byId("formats").childElementCount) {
    byId("formats").append(...state.formats.map((format) => el("button", { type: "button", "data-format": format.word, onclick: () => exportAs(format.word) }, el("b", {}, format.word), ` ${format.label}`)));
  }
  byId("undo").disabled = !state.can_undo;
  byId("redo").disabled = !state.can_redo;
  byId("save").disabled = state.saved;
  byId("reload").hidden = !state.file_changed;
  if (state.file_changed) say("Another program changed the file. Read it again; or Save, which asks once more before it replaces it.");
  if (state.file_gone) say("The file is gone; Save writes it anew.");
  if (!typing && byId("text").value !== state.text) byId("text").value = state.text;
  showLines();
  const { error } = state;
  byId("line").className = error ? "fault" : "";
  byId("line").textContent = error ? error.message : "";
  const kept = (one) => el("li", {}, `${one.label} (${one.model}) `,
    el("span", { class: "buttons" },
      el("button", { type: "button", "aria-pressed": String(one.beside), onclick: () => sendOrSay("beside", { id: one.beside ? null : one.id }) }, "beside"),
      el("button", { type: "button", onclick: () => sendOrSay("restore", { id: one.id }) }, "restore"),
      el("button", { type: "button", onclick: () => sendOrSay("forget", { id: one.id }) }, "forget")));
  byId("kept").replaceChildren(...(state.kept.length ? state.kept.map(kept) : [el("li", {}, "None yet: Keep puts the present state beside what follows.")]));
});

// The height of the bar, below which the columns stand.
new ResizeObserver(() => document.documentElement.style.setProperty("--bar", `${byId("bar").offsetHeight}px`)).observe(byId("bar"));
