// SPDX-License-Identifier: MIT OR Apache-2.0
// The bar, the text of the design, and kept states.

const on = (id, act) => byId(id).addEventListener("click", act);
on("undo", () => sendOrSay("undo"));
on("redo", () => sendOrSay("redo"));
on("keep", () => sendOrSay("keep"));
on("save", save);
on("reload", () => sendOrSay("reload"));
on("report", () => window.open("report", "_blank", "noopener"));
byId("model").addEventListener("change", () => sendOrSay("model", { model: byId("model").value }));

let saysOver = false;
async function save() {
  try {
    await send("save", { over: saysOver });
    saysOver = false;
  } catch (error) {
    saysOver = true;
    if (!error.isSaid) say(error.message);
  }
}
byId("export").addEventListener("change", async () => {
  const [select, word] = [byId("export"), byId("export").value];
  select.value = "";
  if (!word) return;
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
});

document.addEventListener("keydown", (event) => {
  const writes = event.target.matches("textarea, input[type=number], input[type=search]");
  const key = event.key.toLowerCase();
  if ((event.ctrlKey || event.metaKey) && key === "s") { event.preventDefault(); save(); }
  else if (writes || byId("search-dialog").open) return;
  else if ((event.ctrlKey || event.metaKey) && key === "z") { event.preventDefault(); sendOrSay(event.shiftKey ? "redo" : "undo"); }
  else if (key === "k" && !event.ctrlKey && !event.metaKey && !event.altKey) sendOrSay("keep");
});

// The text goes to the server a moment after the last key.
let typing = null;
byId("text").addEventListener("input", () => {
  clearTimeout(typing);
  typing = setTimeout(() => { typing = null; sendOrSay("text", { text: byId("text").value }); }, 400);
});

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
  document.title = `${state.name}: batwing explore`;
  options(byId("model"), state.models.map((model) => [model.word, model.label]), state.model);
  options(byId("export"), [["", "Export …"], ...state.formats.map((format) => [format.word, `${format.word}: ${format.label}`])], "");
  byId("undo").disabled = !state.can_undo;
  byId("redo").disabled = !state.can_redo;
  byId("save").disabled = state.saved;
  byId("reload").hidden = !state.file_changed;
  if (state.file_changed) say("Another program changed the file. Save replaces it; or read it again.");
  if (state.file_gone) say("The file is gone; Save writes it anew.");
  if (!typing && byId("text").value !== state.text) byId("text").value = state.text;
  const { error } = state;
  byId("line").className = error ? "fault" : "";
  byId("line").textContent = error ? `${error.line ? `line ${error.line}: ${state.text.split("\n")[error.line - 1] || ""} — ` : ""}${error.message}` : "";
  const kept = (one) => el("li", {}, `${one.label} (${one.model}) `,
    el("span", { class: "buttons" },
      el("button", { type: "button", "aria-pressed": String(one.beside), onclick: () => sendOrSay("beside", { id: one.beside ? null : one.id }) }, "beside"),
      el("button", { type: "button", onclick: () => sendOrSay("restore", { id: one.id }) }, "restore"),
      el("button", { type: "button", onclick: () => sendOrSay("forget", { id: one.id }) }, "forget")));
  byId("kept").replaceChildren(...(state.kept.length ? state.kept.map(kept) : [el("li", {}, "None yet: Keep puts the present state beside what follows.")]));
});
