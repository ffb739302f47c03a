// Numbers and lines: PARTs by level, times, residual, error and bound, the trail, pins, the selected PART.

import { cm, node } from "./dial.js";

const at = (id) => document.getElementById(id);
const digits = (value, n = 3) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(n))));
const ms = (value) => {
  if (value === null || value === undefined) return "–";
  if (value >= 1e4) return `${digits(1e-3 * value)} s`;
  return value < 10 ? `${digits(value, 2)} ms` : `${Math.round(value)} ms`;
};

// A force with the unit in which it has few digits.
export function force(newtons) {
  if (newtons === null || newtons === undefined) return "–";
  if (newtons >= 0.1) return `${digits(newtons)} N`;
  if (newtons === 0) return "none";
  return newtons >= 1e-5 ? `${digits(1e3 * newtons)} mN` : "under 0.01 mN";
}

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
  const mm = (value) => (value === null || value === undefined ? "–" : `${digits(value)} mm RMS`);
  const cut = parts && parts.table_count !== undefined && parts.table_count !== parts.count;
  list("numbers", [
    ["PARTs", parts ? `${parts.count}${cut ? `, cut from ${parts.table_count}` : ""}` : "–", old(parts)],
    ["stage one", ms(parts?.segment_ms), old(parts)],
    ["strongest force on a PART", force(parts?.force_max_n), old(parts)],
    ["two stages", preview ? ms(preview.ms) : "–", old(preview)],
    ["at rest", rest ? (rest.kept ? "as before" : `${rest.steps} steps, ${ms(rest.ms)}`) : "–", old(rest)],
    ["residual over weight", rest ? rest.residual_over_weight.toExponential(1) : "–", old(rest)],
    ["two stages, distance to this rest", mm(figures?.preview_error_mm), old(figures)],
    ["best maps of these PARTs, the same", mm(figures?.bound_mm), old(figures)],
    ["strain, 95th percentile / largest", figures?.strain_p95 ? `${digits(100 * figures.strain_p95)} / ${digits(100 * figures.strain_max)} %` : "–", old(figures)],
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

// PARTs and time of the two stages over the states, each on its own axis from 0 to a round number.
function spark(trail) {
  const svg = at("spark");
  const [width, height] = [svg.clientWidth || 370, 136];
  const [left, right, tall] = [44, 6, 34];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const drawn = [];
  const x = (i) => left + ((i + 0.5) / Math.max(1, trail.length)) * (width - left - right);
  const plots = [
    ["spark-parts", "PARTs", (point) => point.parts, 16],
    ["spark-time", "two stages, ms", (point) => point.two_stages_ms, 80],
  ];
  for (const [kind, name, value, top] of plots) {
    const points = trail.map((point, i) => [i, value(point)]).filter(([, v]) => v !== null && v !== undefined);
    const most = rounded(Math.max(...points.map(([, v]) => v), 1e-3));
    const floor = top + tall;
    const y = (v) => floor - (v / most) * tall;
    drawn.push(node("text", { class: "plot-name", x: left, y: top - 5 }, name));
    for (const [v, at] of [[most, top], [0, floor]]) {
      drawn.push(node("line", { class: "axis", x1: left, x2: width - right, y1: at, y2: at }));
      drawn.push(node("text", { x: left - 5, y: at + 3, "text-anchor": "end" }, digits(v)));
    }
    drawn.push(node("polyline", { class: kind, points: points.map(([i, v]) => `${x(i)},${y(v)}`).join(" ") }));
    for (const [i, v] of points.slice(-1)) {
      drawn.push(node("circle", { class: kind, cx: x(i), cy: y(v), r: 2.5 }));
      const label = { x: width - right, y: top - 5, "text-anchor": "end" };
      drawn.push(node("text", label, `state ${trail[i].state}: ${digits(v)}`));
    }
  }
  if (trail.length > 0) {
    const ends = trail.length > 1 ? [0, trail.length - 1] : [0];
    ends.forEach((i) => drawn.push(node("text", { x: x(i), y: height - 4, "text-anchor": "middle" }, trail[i].state)));
    if (trail.length > 1) drawn.push(node("text", { x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, "state"));
  }
  svg.replaceChildren(...drawn);
}

// The least of 1, 2, 5, 10, ... that is not below a value.
function rounded(value) {
  const ten = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((n) => n * ten).find((n) => n >= value * (1 - 1e-9));
}

export function showPins(state, remove) {
  const rows = state.pins.map((pin) => {
    const row = document.createElement("tr");
    const { parts, two_stages_ms, preview_error_mm, bound_mm } = pin.numbers;
    const cut = pin.max_extent_cm?.length ? `, cut to ${pin.max_extent_cm.join(", ")} cm` : "";
    const table = pin.table === pin.label ? "" : `, ${pin.table}`;
    const label = `${pin.label}: ${pin.garment}, ${pin.fabric}${table}${cut}`;
    for (const text of [label, parts, digits(two_stages_ms), `${digits(preview_error_mm)} / ${digits(bound_mm)}`]) {
      row.insertCell().textContent = text;
    }
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: "✕", title: "Remove" });
    button.setAttribute("aria-label", `Remove the pin ${pin.label}`);
    button.addEventListener("click", () => remove(pin.id));
    row.insertCell().append(button);
    row.dataset.pin = pin.id;
    return row;
  });
  at("pins").tBodies[0].replaceChildren(...rows);
  at("pins").hidden = rows.length === 0;
  at("save-sweep").hidden = rows.length === 0;
  at("no-pins").hidden = rows.length > 0;
  at("some-pins").hidden = rows.length < 3;
  showColumns(state);
}

// Contents of the columns of views while pinned states have columns: the newest state, the pins, and the drape at rest.
function showColumns(state) {
  const shown = state.pins.filter((pin) => pin.shown);
  const parts = (count) => (count === undefined ? "" : `, ${count} PARTs`);
  const texts = [
    `newest: state ${state.state}${parts(state.parts?.count)}`,
    ...shown.map((pin) => `pinned: ${pin.label}${parts(pin.numbers.parts)}`),
    `at rest: state ${state.rest?.state ?? "–"}`,
  ];
  const cells = texts.map((text) => Object.assign(document.createElement("div"), { textContent: text, title: text }));
  at("columns").hidden = shown.length === 0;
  at("columns").replaceChildren(...cells);
}

export function showPart(part) {
  at("part-card").hidden = !part;
  if (!part) return;
  const upper = part.upper_cm === null ? "∞" : cm(part.upper_cm);
  const size = (v) => (v ? `${digits(Math.hypot(...v))} mm` : "–");
  list("part", [
    ["PART", `${part.part} of state ${part.state}`],
    ["level", `${part.level}, ${cm(part.lower_cm)} to ${upper} cm`],
    ["vertices", String(part.vertices)],
    ["area", `${digits(part.area_cm2)} cm²`],
    ["force of the body", force(part.force_size_n)],
    ["moved by two stages", size(part.preview_displacement_mm)],
    ["moved to rest", size(part.rest_displacement_mm)],
  ]);
}
