// Numbers and lines: PARTs by level, times, residual, error and bound, the trail, pins, the selected PART.

import { cm, node } from "./dial.js";

const at = (id) => document.getElementById(id);
const digits = (value, n = 3) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(n))));
const ms = (value) => (value === null || value === undefined ? "–" : value < 10 ? `${digits(value, 2)} ms` : `${Math.round(value)} ms`);

function list(id, rows) {
  const drawn = rows.flatMap(([name, value, old]) => {
    const [term, told] = [document.createElement("dt"), document.createElement("dd")];
    term.textContent = name;
    told.textContent = value;
    told.dataset.name = name;
    told.classList.toggle("old", Boolean(old));
    return [term, told];
  });
  at(id).replaceChildren(...drawn);
}

export function showNumbers(state) {
  const { parts, preview, rest, figures, garment } = state;
  const old = (found) => found && found.state !== state.state;
  const error = figures?.preview_error_mm;
  const bound = figures?.bound_mm;
  list("numbers", [
    ["PARTs", parts ? `${parts.count}${preview && preview.count !== parts.count ? `, cut to ${preview.count}` : ""}` : "–", old(parts)],
    ["stage one", ms(parts?.segment_ms), old(parts)],
    ["strongest force on a PART", parts?.force_max_n ? `${digits(parts.force_max_n)} N` : "–", old(parts)],
    ["two stages", preview ? `${ms(preview.ms)}${preview.warm ? " (going on)" : ""}` : "–", old(preview)],
    ["at rest", rest ? (rest.kept ? "as before" : `${rest.steps} steps, ${ms(rest.ms)}`) : "–", old(rest)],
    ["residual over weight", rest ? rest.residual_over_weight.toExponential(1) : "–", old(rest)],
    ["two stages from rest", error === null || error === undefined ? "–" : `${digits(error)} mm RMS`, old(figures)],
    ["PARTs could hold it to", bound === null || bound === undefined ? "–" : `${digits(bound)} mm`, old(figures)],
    ["strain, 95 % / most", figures?.strain_p95 ? `${digits(100 * figures.strain_p95)} / ${digits(100 * figures.strain_max)} %` : "–", old(figures)],
    ["inside the body", figures ? `${figures.penetrating_vertices} vertices` : "–", old(figures)],
  ]);
  const warnings = [...(figures?.warnings ?? garment?.warnings ?? [])];
  at("warnings").replaceChildren(...warnings.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  perLevel(parts?.levels ?? [], parts?.colours ?? []);
  spark(state.trail ?? []);
}

function perLevel(levels, colours) {
  const svg = at("per-level");
  const [width, height] = [svg.clientWidth || 370, 44];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const most = Math.max(1, ...levels.map((level) => level.parts));
  const wide = width / Math.max(1, levels.length);
  svg.replaceChildren(
    ...levels.flatMap((level, i) => {
      const tall = (level.parts / most) * 24;
      const at = { x: i * wide + 1, y: 36 - tall, width: Math.max(1, wide - 2), height: tall };
      const bar = node("rect", { class: "parts-bar", fill: colours[i], ...at });
      const upper = level.upper_cm === null ? "∞" : cm(level.upper_cm);
      bar.append(node("title", {}, `level ${i + 1}, ${cm(level.lower_cm)} to ${upper} cm: ${level.parts} PARTs, ${level.vertices} vertices`));
      const middle = { x: (i + 0.5) * wide, "text-anchor": "middle" };
      const labels = wide > 14 ? [node("text", { ...middle, y: 33 - tall }, level.parts), node("text", { ...middle, y: 44 }, i + 1)] : [];
      return [bar, ...labels];
    }),
  );
  svg.setAttribute("aria-label", `PARTs of each level: ${levels.map((level) => level.parts).join(", ")}`);
}

// PARTs and time of the two stages over the edits, each to its own height.
function spark(trail) {
  const svg = at("spark");
  const [width, height] = [svg.clientWidth || 370, 64];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const drawn = [];
  const lines = [
    ["spark-parts", "PARTs", (point) => point.parts, 0],
    ["spark-time", "two stages, ms", (point) => point.two_stages_ms, 32],
  ];
  for (const [kind, name, value, top] of lines) {
    const points = trail.map((point, i) => [i, value(point)]).filter(([, v]) => v !== null && v !== undefined);
    const most = Math.max(1e-9, ...points.map(([, v]) => v));
    const place = ([i, v]) => `${((i + 0.5) / Math.max(1, trail.length)) * (width - 136)},${top + 28 - (v / most) * 24}`;
    drawn.push(node("polyline", { class: kind, points: points.map(place).join(" ") }));
    for (const point of points.slice(-1)) {
      const [cx, cy] = place(point).split(",");
      drawn.push(node("circle", { class: kind, cx, cy, r: 2.5 }));
    }
    const last = points.at(-1);
    drawn.push(node("text", { x: width - 130, y: top + 18 }, `${name}: ${last ? digits(last[1]) : "–"}`));
  }
  svg.replaceChildren(...drawn);
}

export function showPins(state, letGo) {
  const rows = state.pins.map((pin) => {
    const row = document.createElement("tr");
    const { parts, two_stages_ms, preview_error_mm, bound_mm } = pin.numbers;
    const label = `${pin.label}: ${pin.garment}, ${pin.fabric}, ${pin.table}`;
    for (const text of [label, parts, digits(two_stages_ms), `${digits(preview_error_mm)} / ${digits(bound_mm)}`]) {
      row.insertCell().textContent = text;
    }
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: "✕", title: "Let go" });
    button.setAttribute("aria-label", `Let ${pin.label} go`);
    button.addEventListener("click", () => letGo(pin.id));
    row.insertCell().append(button);
    row.dataset.pin = pin.id;
    return row;
  });
  at("pins").tBodies[0].replaceChildren(...rows);
  at("pins").hidden = rows.length === 0;
  at("save-sweep").hidden = rows.length === 0;
  at("no-pins").hidden = rows.length > 0;
}

export function showPart(part) {
  if (!part) {
    const hint = Object.assign(document.createElement("div"), { className: "hint", textContent: "Click a PART in a view." });
    at("part").replaceChildren(hint);
    return;
  }
  const upper = part.upper_cm === null ? "∞" : cm(part.upper_cm);
  const size = (v) => (v ? `${digits(Math.hypot(...v))} mm` : "–");
  list("part", [
    ["PART", `${part.part + 1} of state ${part.state}`],
    ["level", `${part.level + 1}, ${cm(part.lower_cm)} to ${upper} cm`],
    ["vertices", String(part.vertices)],
    ["area", `${digits(part.area_cm2)} cm²`],
    ["force of the body", part.force_size_n === null ? "–" : `${digits(part.force_size_n)} N`],
    ["moved by two stages", size(part.preview_displacement_mm)],
    ["moved to rest", size(part.rest_displacement_mm)],
  ]);
}
