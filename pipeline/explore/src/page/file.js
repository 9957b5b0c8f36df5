// SPDX-License-Identifier: MIT OR Apache-2.0
// The bar, the text of the design, and kept states.

const on = (id, act) => byId(id).addEventListener("click", act);
on("undo", () => sendOrSay("undo"));
on("redo", () => sendOrSay("redo"));
on("keep", () => sendOrSay("keep"));
on("save", save);
on("reload", () => sendOrSay("reload"));
on("take-draft", () => sendOrSay("draft/take"));
on("discard-draft", () => sendOrSay("draft/discard"));
byId("model").addEventListener("change", () => sendOrSay("model", { model: byId("model").value }));

// True once the server has all that the user did; else says what it has not.
async function isReady() {
  await settle();
  if (!text.isUnsent) return true;
  byId("fold-text").open = true;
  say(text.isRefused ? "Choose first which text is to stay." : "The server has not taken the text of the design.");
  return false;
}
// True where the next Save replaces what another program wrote.
let saysOver = false;
async function save() {
  if (!(await isReady())) return;
  try {
    await send("save", { over: saysOver });
    const without = [...faults.keys()];
    if (state.error) say("Saved, but the text is no design yet.");
    else if (without.length) say(`Saved without what was refused: ${without.join(", ")}.`);
  } catch (error) {
    if (error.isSaid) return;
    say(error.message);
    if (error.status !== 409) return;
    saysOver = true;
    await ask("state").then(take, () => {});
  }
}
async function exportAs(word) {
  byId("export").open = false;
  byId("export").firstElementChild.focus();
  if (!(await isReady())) return;
  say(`Writing ${word} …`);
  try {
    const answer = await fetch(`export?format=${encodeURIComponent(word)}`);
    if (!answer.ok) throw await refusal(answer);
    const name = /filename="([^"]*)"/.exec(answer.headers.get("Content-Disposition") || "");
    const link = el("a", { href: URL.createObjectURL(await answer.blob()), download: name ? name[1] : word });
    link.click();
    URL.revokeObjectURL(link.href);
    say("");
  } catch (error) {
    say(error.status ? error.message : ENDED);
  }
}
on("report", async (event) => {
  event.preventDefault();
  if (!(await isReady())) return;
  if (state.error) say(state.error.message);
  else window.open(byId("report").href, "_blank", "noopener");
});
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
  else if (writes) return;
  else if ((event.ctrlKey || event.metaKey) && key === "z") { event.preventDefault(); sendOrSay(event.shiftKey ? "redo" : "undo"); }
  else if (key === "k" && !event.ctrlKey && !event.metaKey && !event.altKey) sendOrSay("keep");
});

// The text of the pane: the edition of the draft that it began from, true where the server has not taken it, what is under way,
// and true where the server refused it because the draft has moved. Until it is taken, no other text takes its place.
const text = { edition: undefined, isUnsent: false, underWay: null, isRefused: false, timer: null };
function sendText() {
  const typed = byId("text").value;
  clearTimeout(text.timer);
  if (!text.isUnsent || text.isRefused || text.underWay === typed) return;
  text.underWay = typed;
  post("text", () => ({ text: typed, edition: text.edition })).then((next) => {
    if (next.text === typed) text.edition = next.edition;
    if (byId("text").value === typed) text.isUnsent = false;
  }, (error) => {
    text.isRefused = error.status === 409;
    if (text.isRefused) byId("fold-text").open = true;
    byId("moved-words").textContent = `Your text is not in the draft: ${error.message}.`;
    if (!text.isRefused && !error.isSaid) say(error.message);
  }).then(() => { if (text.underWay === typed) text.underWay = null; });
}
beginsWith(sendText);
byId("text").addEventListener("input", () => {
  text.isUnsent = true;
  clearTimeout(text.timer);
  // A moment after the last key.
  text.timer = setTimeout(sendText, 400);
  showLines();
});
byId("text").addEventListener("blur", sendText);
on("take-mine", () => {
  text.isRefused = false;
  text.edition = state.edition;
  sendText();
  showText();
});
on("take-other", () => {
  text.isRefused = text.isUnsent = false;
  showText();
});
function showText() {
  if (text.isUnsent && byId("text").value === state.text && !text.underWay) text.isUnsent = text.isRefused = false;
  if (!text.isUnsent) {
    if (byId("text").value !== state.text) byId("text").value = state.text;
    text.edition = state.edition;
  }
  byId("moved").hidden = !text.isRefused;
  showLines();
  const { error } = state;
  byId("line").className = error ? "fault" : "";
  byId("line").textContent = error ? error.message : "";
}
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
    select.replaceChildren(...list.map(([word, label, title]) => el("option", { value: word, title }, label)));
  }
  select.value = value;
}

onState(() => {
  byId("file").textContent = `${state.file}${state.saved ? "" : " •"}`;
  byId("file").title = state.saved ? "saved" : "not saved";
  byId("file").setAttribute("aria-label", `${state.file}, ${byId("file").title}`);
  document.title = `${state.name}: batwing explore`;
  options(byId("model"), state.models.map((model) => [model.word, model.label, model.meaning]), state.model);
  byId("model").title = state.models.find((model) => model.word === state.model).meaning;
  if (!byId("formats").childElementCount) {
    byId("formats").append(...state.formats.map((format) => el("button", { type: "button", "data-format": format.word, onclick: () => exportAs(format.word) }, el("b", {}, format.word), ` ${format.label}`)));
  }
  byId("undo").disabled = !state.can_undo;
  byId("redo").disabled = !state.can_redo;
  byId("save").disabled = state.saved;
  byId("reload").hidden = !state.file_changed;
  saysOver &&= state.file_changed;
  byId("offer").hidden = !state.offers_draft;
  const disk = [state.unkept && `${state.unkept}${state.saved ? "" : "; until it is saved it ends with the server"}.`,
    state.file_gone && "The file is gone; Save writes it anew.",
    state.file_changed && `Another program changed the file. Read it again, or Save${saysOver ? " once more, which replaces it" : ", which asks once more before it replaces it"}.`].filter(Boolean);
  byId("disk").hidden = !disk.length;
  byId("disk").textContent = disk.join(" ");
  showText();
  const kept = (one) => el("li", {}, `${one.label} (${one.model}) `,
    el("span", { class: "buttons" },
      el("button", { type: "button", "aria-pressed": String(one.beside), onclick: () => sendOrSay("beside", { id: one.beside ? null : one.id }) }, "beside"),
      el("button", { type: "button", onclick: () => sendOrSay("restore", { id: one.id }) }, "restore"),
      el("button", { type: "button", onclick: () => sendOrSay("forget", { id: one.id }) }, "forget")));
  byId("kept").replaceChildren(...(state.kept.length ? state.kept.map(kept) : [el("li", {}, "None yet: Keep puts the present state beside what follows.")]));
});

// The height of the bar, below which the columns stand.
new ResizeObserver(() => document.documentElement.style.setProperty("--bar", `${byId("bar").offsetHeight}px`)).observe(byId("bar"));
