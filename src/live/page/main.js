// The page: controls make edits, and the session's state is shown.

import { Dial, cm } from "./dial.js";
import { showNumbers, showPart, showPins } from "./numbers.js";
import { Session, ask } from "./session.js";
import { start } from "./viewer.js";

const at = (id) => document.getElementById(id);
const session = new Session();
const dial = new Dial(at("dial"), (edit, gesture) => session.edit(edit, gesture));
const MEASURES = ["stature", "bust", "underbust", "waist", "hip"];
let choices = { tables: [], fabrics: [], garments: [], sizes: [] };
let selected = null;

function options(select, names, chosen) {
  const all = names.includes(chosen) || chosen === undefined ? names : [...names, chosen];
  if (select.dataset.names !== all.join()) {
    select.dataset.names = all.join();
    select.replaceChildren(...all.map((name) => new Option(name, name)));
  }
  if (document.activeElement !== select) select.value = chosen ?? "";
}

function showChoices(state) {
  const { job } = state;
  const [garment, vertices] = job.garment.split("@");
  options(at("garment"), choices.garments, garment);
  const sizes = choices.sizes[choices.garments.indexOf(garment)] ?? [];
  options(at("vertices"), ["as is", ...sizes.map(String)], vertices ?? "as is");
  at("size").textContent = state.garment ? `${state.garment.vertices} vertices` : "";
  options(at("fabric"), choices.fabrics, typeof job.fabric === "string" ? job.fabric : job.fabric.name);
  const name = job.table.name ?? `${job.table.quantile} quantile levels`;
  const preset = choices.tables.find((known) => known === name || (known === "table-3" && name.toLowerCase() === "table 3"));
  options(at("preset"), [...choices.tables, "5 quantile levels", "10 quantile levels", "20 quantile levels"], preset ?? name);
  if (document.activeElement !== at("gap")) at("gap").value = job.table.gap ?? "extend-lower";
  if (document.activeElement !== at("extent")) at("extent").value = job.max_extent_cm.join(", ");
  for (const measure of MEASURES) {
    const field = at(`m-${measure}`);
    if (document.activeElement !== field) field.value = cm(job.measurements[measure]);
    field.disabled = job.body !== "form";
  }
}

function showLevels(state) {
  const body = at("levels").tBodies[0];
  const counts = state.parts?.levels ?? [];
  at("levels-title").textContent = `Levels: ${dial.levels.length}, numbers and extents`;
  if (body.contains(document.activeElement) && body.rows.length === dial.levels.length) {
    dial.levels.forEach((_, i) => (body.rows[i].cells[4].textContent = counts[i]?.parts ?? "–"));
    return;
  }
  const rows = dial.levels.map((level, i) => {
    const row = document.createElement("tr");
    row.insertCell().textContent = i + 1;
    const field = (value, label, take) => {
      const input = Object.assign(document.createElement("input"), { type: "text", inputMode: "decimal", value });
      input.setAttribute("aria-label", `Level ${i + 1}, ${label}, cm`);
      input.addEventListener("change", () => take(input.value.trim()));
      row.insertCell().append(input);
    };
    const number = (text) => (["inf", "∞"].includes(text) ? Infinity : Number(text));
    field(cm(level[0]), "from", (text) => dial.set(i, 0, number(text)));
    field(level[1] === Infinity ? "inf" : cm(level[1]), "to", (text) => dial.set(i, 1, number(text)));
    field(level.slice(2).join(" × "), "cut to", (text) => {
      dial.set(i, 2, text === "" ? [] : text.split(/[x×,]/).map((t) => number(t.trim())).slice(0, 2));
    });
    // Levels that the gap rule adds count too, so the numbers differ from the rows.
    row.insertCell().textContent = counts.length === dial.levels.length ? counts[i].parts : "";
    const change = row.insertCell();
    const button = (text, label, act) => {
      const made = Object.assign(document.createElement("button"), { type: "button", textContent: text, title: label });
      made.setAttribute("aria-label", `${label} (level ${i + 1})`);
      made.addEventListener("click", act);
      change.append(made);
    };
    button("÷", "Split in two", () => dial.splitLevel(i));
    if (i + 1 < dial.levels.length) button("+", "Join with the next", () => dial.merge(i));
    return row;
  });
  body.replaceChildren(...rows);
}

function alertWith(sentence) {
  at("alert").hidden = sentence === "";
  at("alert").textContent = sentence;
}

let shown = null;
function show() {
  const state = session.state;
  const { parts, preview, rest } = state;
  const done = (what) => (what?.state === state.state && what.done !== false ? "✓" : "…");
  const lasts = rest?.state === state.state && rest.balanced && !rest.done ? "✓, looking whether it lasts" : done(rest);
  at("status").textContent =
    `state ${state.state} · PARTs ${parts?.count ?? "–"} ${done(parts)} · two stages ${preview?.warm ? "…" : done(preview)} · ` +
    `at rest ${lasts}${state.idle ? "" : " · working"}`;
  document.body.classList.toggle("read-only", state.may_steer === false);
  at("undo").disabled = state.undo === 0 || state.may_steer === false;
  at("redo").disabled = state.redo === 0 || state.may_steer === false;
  at("pin").disabled = state.may_steer === false;
  if (state.refused && state.refused.state !== shown) {
    shown = state.refused.state;
    alertWith(state.refused.error);
  }
  dial.show(state);
  showChoices(state);
  showLevels(state);
  showNumbers(state);
  showPins(state, (id) => session.send(`api/pins/${id}`, "DELETE"));
  if (selected && selected.state !== state.state && parts?.state === state.state) pick(selected.query);
}

let due = false;
session.addEventListener("state", () => {
  // At most one update for each animation frame.
  if (due) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    show();
  });
});
session.addEventListener("accepted", () => alertWith(""));
session.addEventListener("refused", (event) => {
  alertWith(event.detail);
  if (session.state) dial.show(session.state);
});
session.addEventListener("lost", (event) => {
  at("status").textContent = `The session cannot be reached (${event.detail}); trying again …`;
});

async function pick(query) {
  const response = await ask(`api/part?${query}`);
  if (!response.ok) return;
  const part = await response.json();
  selected = { state: part.state, query };
  showPart(part);
}

for (const measure of MEASURES) {
  const label = document.createElement("label");
  const input = Object.assign(document.createElement("input"), { id: `m-${measure}`, type: "number", step: "0.5" });
  input.addEventListener("change", () => session.edit({ measurements: { [measure]: Number(input.value) } }));
  label.append(measure, input);
  at("measurements").append(label);
}
const garment = () => {
  const vertices = at("vertices").value;
  session.edit({ garment: vertices === "as is" ? at("garment").value : `${at("garment").value}@${vertices}` });
};
at("garment").addEventListener("change", () => {
  at("vertices").value = "as is";
  garment();
});
at("vertices").addEventListener("change", garment);
at("fabric").addEventListener("change", () => session.edit({ fabric: at("fabric").value }));
at("gap").addEventListener("change", () => session.edit({ gap: at("gap").value }));
at("preset").addEventListener("change", () => {
  const quantile = /^(\d+) quantile levels$/.exec(at("preset").value);
  session.edit({ table: quantile ? { quantile: Number(quantile[1]) } : at("preset").value });
});
at("extent").addEventListener("change", () => {
  const given = at("extent").value.split(/[,;\s]+/).filter((text) => text !== "");
  session.edit({ max_extent_cm: given.map(Number) });
});
at("undo").addEventListener("click", () => session.send("api/undo", "POST"));
at("redo").addEventListener("click", () => session.send("api/redo", "POST"));
at("pin").addEventListener("click", () => session.send("api/pins", "POST"));
document.addEventListener("keydown", (event) => {
  const typing = ["INPUT", "SELECT"].includes(document.activeElement?.tagName);
  if (typing || !(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
  event.preventDefault();
  at(event.shiftKey ? "redo" : "undo").click();
});
at("load").addEventListener("change", async () => {
  const [file] = at("load").files;
  if (file) await session.send("api/state", "PATCH", await file.text(), "application/toml");
  at("load").value = "";
});
// Links carry no token, so downloads are fetched here.
const SAVED = { "save-table": "table.toml", "save-job": "job.toml", "save-obj": "drape.obj", "save-sweep": "sweep.toml" };
for (const [id, name] of Object.entries(SAVED)) {
  const path = `api/${name}`;
  const link = at(id);
  link.href = path;
  link.addEventListener("click", async (event) => {
    event.preventDefault();
    const response = await ask(path);
    if (!response.ok) return alertWith((await response.json()).error);
    const made = Object.assign(document.createElement("a"), { download: link.download });
    made.href = URL.createObjectURL(await response.blob());
    made.click();
    setTimeout(() => URL.revokeObjectURL(made.href), 1000);
  });
}

const THEMES = ["system", "light", "dark"];
function theme(name) {
  localStorage.setItem("theme", name);
  document.documentElement.dataset.theme = name;
  at("theme").textContent = `Theme: ${name}`;
  return name;
}
const chosen = theme(localStorage.getItem("theme") ?? "system");
at("theme").addEventListener("click", () => {
  theme(THEMES[(THEMES.indexOf(document.documentElement.dataset.theme) + 1) % THEMES.length]);
});
const dark = chosen === "dark" || (chosen === "system" && matchMedia("(prefers-color-scheme: dark)").matches);

ask("api/choices")
  .then((response) => response.json())
  .then((found) => {
    choices = found;
    if (session.state) show();
  })
  .catch(() => {});
session.follow();
start(dark ? "dark" : "light", (view, position) => pick(`on=${view}&at=${position.join(",")}`));
