// The page: controls make edits, and the session's state is shown.

import { Dial, cm } from "./dial.js";
import { acceptAll, centimetres, isRefused, onTyped, refuse, several } from "./fields.js";
import { showNumbers, showPart, showPins } from "./numbers.js";
import { Session, ask } from "./session.js";
import "./theme.js";
import { draw, start } from "./viewer.js";
import { showViews } from "./views.js";

const at = (id) => document.getElementById(id);
const session = new Session();
const dial = new Dial(at("dial"), (edit, from) => session.edit(edit, from));
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

// Writes a field, unless it is being edited or holds what was refused.
function write(field, text) {
  if (document.activeElement !== field && !isRefused(field)) field.value = text;
}

// The last valid value of a field.
const kept = {
  measure: (name) => cm(session.state.job.measurements[name]),
  extent: () => session.state.job.max_extent_cm.join(", "),
  level: (i, column) => {
    const [lower, upper, ...extent] = dial.levels[i];
    return [cm(lower), cm(upper), extent.some(Number.isFinite) ? extent.map(cm).join(" × ") : ""][column];
  },
};

// The name under which a table is offered: "Table 3" is `table-3`.
const presetOf = (name) => choices.tables.find((known) => known === name.toLowerCase().replace(/[ ,]+/g, "-"));

function showChoices(state) {
  const { job } = state;
  const [garment, vertices] = job.garment.split("@");
  options(at("garment"), choices.garments, garment);
  const sizes = choices.sizes[choices.garments.indexOf(garment)] ?? [];
  options(at("vertices"), ["as is", ...sizes.map(String)], vertices ?? "as is");
  at("size").textContent = state.garment ? `${state.garment.vertices} vertices` : "";
  options(at("fabric"), choices.fabrics, typeof job.fabric === "string" ? job.fabric : job.fabric.name);
  const name = job.table.name ?? `${job.table.quantile} quantile levels`;
  const tables = [...choices.tables, "5 quantile levels", "10 quantile levels", "20 quantile levels"];
  options(at("preset"), tables, presetOf(name) ?? name);
  options(at("beside"), ["no table", ...tables], at("beside").value || "no table");
  if (document.activeElement !== at("gap")) at("gap").value = job.table.gap ?? "extend-lower";
  write(at("extent"), kept.extent());
  for (const measure of MEASURES) {
    const field = at(`m-${measure}`);
    write(field, kept.measure(measure));
    field.disabled = job.body !== "form";
  }
}

function showLevels(state) {
  const body = at("levels").tBodies[0];
  const counts = state.parts?.levels ?? [];
  at("levels-title").textContent = `Levels: ${dial.levels.length}, numbers and extents`;
  const inputs = [...body.querySelectorAll("input")];
  if (inputs.some(isRefused)) return;
  if (body.contains(document.activeElement) && body.rows.length === dial.levels.length) {
    inputs.forEach((input, n) => write(input, kept.level(Math.floor(n / 3), n % 3)));
    dial.levels.forEach((_, i) => (body.rows[i].cells[4].textContent = counts[i]?.parts ?? "–"));
    return;
  }
  const rows = dial.levels.map((_, i) => {
    const row = document.createElement("tr");
    row.insertCell().textContent = i + 1;
    ["from", "to", "cut to"].forEach((label, column) => {
      const input = Object.assign(document.createElement("input"), {
        type: "text",
        inputMode: "decimal",
        id: `level-${i}-${column}`,
        value: kept.level(i, column),
        placeholder: column === 2 ? "not cut" : "",
      });
      input.setAttribute("aria-label", `Level ${i + 1}, ${label}, cm`);
      onTyped(input, (text) => typedLevel(input, i, column, text), () => kept.level(i, column));
      row.insertCell().append(input);
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

function typedLevel(input, i, column, text) {
  if (column === 2) {
    const extent = several(text, /[x×,;]/, true);
    if (extent === null || extent.length > 2) return refuse(input, expected(text, "one or two extents in cm such as 8 × 24"), kept.level(i, 2));
    return dial.set(i, 2, extent, input);
  }
  const value = centimetres(text, true);
  if (value === null) return refuse(input, expected(text, "a number of centimetres, or ∞ (inf)"), kept.level(i, column));
  dial.set(i, column, value, input);
}

const expected = (text, what) => `Found ${text === "" ? "nothing" : `“${text}”`}, expected ${what}`;

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
    `state ${state.state} · PARTs ${parts?.count ?? "–"} ${done(parts)} · two stages ${done(preview)} · ` +
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
  showViews(state);
  showPins(state, (id) => session.send(`api/pins/${id}`, "DELETE"));
  if (!selected) return;
  // The outline lies on each shape, which moves until the state is complete.
  const newer = selected.state !== state.state && parts?.state === state.state;
  if (newer || (state.idle && selected.drawn !== state.serial)) {
    selected.drawn = state.serial;
    pick(selected.query);
  }
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
session.addEventListener("accepted", () => {
  alertWith("");
  acceptAll();
});
session.addEventListener("refused", (event) => {
  const { sentence, field } = event.detail;
  if (session.state) dial.show(session.state);
  if (!field?.isConnected) return alertWith(sentence);
  const [, i, column] = /^level-(\d+)-(\d)$/.exec(field.id) ?? [];
  const before = i !== undefined ? kept.level(Number(i), Number(column)) : field.id === "extent" ? kept.extent() : kept.measure(field.id.slice(2));
  refuse(field, sentence, before);
});
session.addEventListener("lost", (event) => {
  at("status").textContent = `The session cannot be reached (${event.detail}); trying again …`;
});

async function pick(query) {
  const response = await ask(`api/part?${query}`);
  if (!response.ok) return;
  const part = await response.json();
  selected = { state: part.state, query, drawn: selected?.drawn };
  showPart(part);
  await draw(`api/outline?number=${part.part}`);
}

for (const measure of MEASURES) {
  const label = document.createElement("label");
  const input = Object.assign(document.createElement("input"), { id: `m-${measure}`, type: "text", inputMode: "decimal" });
  const take = (text) => {
    const value = centimetres(text);
    if (value === null) return refuse(input, expected(text, "a number of centimetres"), kept.measure(measure));
    session.edit({ measurements: { [measure]: value } }, { field: input });
  };
  onTyped(input, take, () => kept.measure(measure));
  const unit = Object.assign(document.createElement("span"), { className: "unit" });
  unit.append(input);
  label.append(measure, unit);
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
const tableOf = (name) => {
  const quantile = /^(\d+) quantile levels$/.exec(name);
  return quantile ? { quantile: Number(quantile[1]) } : name;
};
at("preset").addEventListener("change", () => session.edit({ table: tableOf(at("preset").value) }));

// Resolves once the two stages of the newest state are done.
const previewed = () =>
  new Promise((done) => {
    const look = () => {
      const { state, preview } = session.state;
      if (preview?.state !== state || preview.warm || preview.done === false) return;
      session.removeEventListener("state", look);
      done();
    };
    session.addEventListener("state", look);
    look();
  });

// A second table beside the first: its state is pinned, and the first one is the newest again.
at("beside").addEventListener("change", async () => {
  const name = at("beside").value;
  if (name === "no table") return;
  at("beside").disabled = true;
  const before = session.state.state;
  await session.send("api/state", "PATCH", JSON.stringify({ table: tableOf(name) }), "application/json");
  const changed = session.state.state !== before;
  if (changed) await previewed();
  await session.send("api/pins", "POST", JSON.stringify({ label: name }), "application/json");
  if (changed) await session.send("api/undo", "POST");
  at("beside").disabled = false;
  at("beside").value = "no table";
});
const extent = (text) => {
  const given = several(text, /[,;\s]+/);
  if (given === null) return refuse(at("extent"), expected(text, "extents in cm such as 24, 12, or nothing"), kept.extent());
  session.edit({ max_extent_cm: given }, { field: at("extent") });
};
onTyped(at("extent"), extent, kept.extent);
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

ask("api/choices")
  .then((response) => response.json())
  .then((found) => {
    choices = found;
    if (session.state) show();
  })
  .catch(() => {});
session.follow();
at("part-close").addEventListener("click", () => {
  selected = null;
  showPart(null);
  draw("api/outline");
});
start((view, position) => pick(`on=${view}&at=${position.join(",")}`));
