// The range table as a bar over the histogram of distances: bounds are handles for mouse, touch and keyboard.

const SVG = "http://www.w3.org/2000/svg";
const STEP = 0.05;
const LEAST = 0.005;
const TOP = 18;
// Half the width of a handle's touch area, pixels.
const REACH = 7;
const BOTTOM = 16;

export function node(name, attributes = {}, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

export const cm = (value) => (value === Infinity ? "∞" : String(Math.round(value * 1000) / 1000));
const open = (value) => value === "inf" || value === Infinity;

// A table's rows with numbers for all bounds.
const plain = (levels) => levels.map((row) => row.map((v) => (open(v) ? Infinity : v)));
const written = (levels) => levels.map((row) => row.map((v) => (v === Infinity ? "inf" : v)));

export class Dial {
  #svg;
  #change;
  #levels = [];
  #name = "";
  #gap = "extend-lower";
  #histogram = null;
  #counts = [];
  #colours = [];
  #held = null;
  #gestures = Date.now();

  // `change(edit, { gesture, field })` is called for each move; `field` is the input of a typed bound.
  constructor(svg, change) {
    this.#svg = svg;
    this.#change = change;
    new ResizeObserver(() => this.#draw()).observe(svg);
    svg.addEventListener("dblclick", (event) => this.split(this.#cm(event.clientX)));
  }

  // Takes the session's state; a handle that is being dragged stays at the pointer.
  show(state) {
    this.#histogram = state.histogram;
    this.#counts = state.parts?.levels ?? [];
    this.#colours = state.parts?.colours ?? [];
    const table = state.job.table;
    if (!this.#held) {
      const quantile = table.quantile !== undefined;
      const rows = quantile ? this.#counts.map((l) => [l.lower_cm, l.upper_cm ?? Infinity]) : plain(table.levels);
      this.#levels = rows;
      this.#name = table.name ?? `${table.quantile} quantile levels`;
      this.#gap = table.gap ?? "extend-lower";
    }
    this.#draw();
  }

  get levels() {
    return this.#levels;
  }

  #far() {
    const h = this.#histogram;
    const far = h ? h.edges_cm[h.edges_cm.length - 1] : 10;
    const last = this.#levels.at(-1) ?? [0, far];
    return Math.max(far, last[0] * 1.05, last[1] === Infinity ? 0 : last[1]);
  }

  // Levels are thin near the body, so the axis is the root of the distance.
  #x(value) {
    return Math.sqrt(Math.min(value, this.#far()) / this.#far()) * this.#width();
  }

  #width() {
    return this.#svg.clientWidth || 370;
  }

  #cm(clientX) {
    const share = (clientX - this.#svg.getBoundingClientRect().left) / this.#width();
    return Math.max(0, Math.min(1, share)) ** 2 * this.#far();
  }

  // The colour of PARTs at this distance in the views; a dragged bound is ahead of the session's state.
  #colour(value) {
    const ahead = this.#counts.length === this.#levels.length;
    const lower = ahead ? this.#levels.map((row) => row[0]) : this.#counts.map((level) => level.lower_cm);
    const level = lower.findLastIndex((bound) => bound <= value);
    return this.#colours[Math.max(level, 0)];
  }

  // The bounds that can move, each with its neighbours and its effect on the rows.
  #bounds() {
    const found = [];
    this.#levels.forEach((row, i) => {
      const before = this.#levels[i - 1];
      const joined = before && before[1] === row[0];
      if (i > 0 || row[0] > 0) {
        const least = before ? (joined ? before[0] : before[1]) : 0;
        const rows = joined ? [[i - 1, 1], [i, 0]] : [[i, 0]];
        const name = joined ? `between levels ${i} and ${i + 1}` : `start of level ${i + 1}`;
        found.push({ value: row[0], least: joined ? least + LEAST : least, most: row[1] - LEAST, rows, name });
      }
      const next = this.#levels[i + 1];
      if ((next && next[0] !== row[1]) || (!next && row[1] !== Infinity)) {
        const most = next ? next[0] : Infinity;
        found.push({ value: row[1], least: row[0] + LEAST, most, rows: [[i, 1]], name: `end of level ${i + 1}` });
      }
    });
    return found;
  }

  #move(index, value, gesture) {
    const bound = this.#bounds()[index];
    const to = Math.round(Math.max(bound.least, Math.min(bound.most, value)) * 1000) / 1000;
    if (to === bound.value || to < bound.least - 1e-9 || to > bound.most + 1e-9) return;
    for (const [row, end] of bound.rows) this.#levels[row][end] = to;
    this.#tell({ gesture });
    this.#draw();
  }

  #tell(from) {
    const name = this.#name.endsWith(", edited") ? this.#name : `${this.#name}, edited`;
    this.#name = name;
    this.#change({ table: { name, gap: this.#gap, levels: written(this.#levels) } }, from);
  }

  // Cuts the level at a distance in two.
  split(at) {
    const i = this.#levels.findIndex((row) => row[0] < at && at < row[1]);
    if (i < 0) return;
    const row = this.#levels[i];
    const middle = Math.round(at * 1000) / 1000;
    if (middle - row[0] < LEAST || row[1] - middle < LEAST) return;
    this.#levels.splice(i, 1, [row[0], middle, ...row.slice(2)], [middle, row[1], ...row.slice(2)]);
    this.#tell();
    this.#draw();
  }

  splitLevel(i) {
    const [lower, upper] = this.#levels[i];
    const to = upper === Infinity ? Math.max(this.#far(), lower * 1.2 + 0.2) : upper;
    this.split((lower + to) / 2);
  }

  // Joins a level with the next.
  merge(i) {
    const next = this.#levels[i + 1];
    if (!next) return;
    this.#levels.splice(i, 2, [this.#levels[i][0], next[1], ...this.#levels[i].slice(2)]);
    this.#tell();
    this.#draw();
  }

  // Takes a typed bound (`column` 0 or 1) or extent (2) from an input.
  set(i, column, value, field) {
    const row = [...this.#levels[i]];
    if (column === 2) {
      row.length = 2;
      row.push(...value);
    } else {
      const old = row[column];
      row[column] = value;
      const beside = column === 0 ? this.#levels[i - 1] : this.#levels[i + 1];
      if (beside && beside[1 - column] === old) beside[1 - column] = value;
    }
    this.#levels[i] = row;
    this.#tell({ field });
    this.#draw();
  }

  #key(event, index) {
    const bound = this.#bounds()[index];
    const step = event.shiftKey ? 10 * STEP : STEP;
    const to = {
      ArrowLeft: bound.value - step,
      ArrowDown: bound.value - step,
      ArrowRight: bound.value + step,
      ArrowUp: bound.value + step,
      PageDown: bound.value - 10 * STEP,
      PageUp: bound.value + 10 * STEP,
      Home: bound.least,
      End: Math.min(bound.most, this.#far()),
    }[event.key];
    if (to !== undefined) {
      this.#move(index, to, this.#gestures);
    } else if (event.key === "Delete" && bound.rows.length === 2) {
      this.merge(bound.rows[0][0]);
    } else {
      return;
    }
    event.preventDefault();
  }

  #take(event, index) {
    event.preventDefault();
    const handle = this.#svg.querySelector(`[data-bound="${index}"]`);
    handle.focus();
    this.#svg.setPointerCapture(event.pointerId);
    this.#held = { index, gesture: ++this.#gestures };
    let chosen = false;
    const move = (e) => {
      const way = Math.sign(e.clientX - event.clientX);
      if (!chosen && way !== 0) {
        chosen = true;
        this.#held.index = this.#free(index, way);
      }
      this.#move(this.#held.index, this.#cm(e.clientX), this.#held.gesture);
    };
    const drop = () => {
      this.#held = null;
      this.#gestures += 1;
      this.#svg.removeEventListener("pointermove", move);
      this.#draw();
    };
    this.#svg.addEventListener("pointermove", move);
    this.#svg.addEventListener("lostpointercapture", drop, { once: true });
    this.#draw();
  }

  // Of several bounds at one place, the one that can move in this direction.
  #free(index, way) {
    const bounds = this.#bounds();
    const room = ({ value, least, most }) => Math.abs(this.#x(way < 0 ? least : most) - this.#x(value));
    for (let i = index; bounds[i] && Math.abs(this.#x(bounds[i].value) - this.#x(bounds[index].value)) < REACH; i += way) {
      if (room(bounds[i]) >= 2) return i;
    }
    return index;
  }

  #draw() {
    const focused = document.activeElement?.dataset?.bound;
    const svg = this.#svg;
    const [width, height] = [this.#width(), svg.clientHeight || 132];
    const floor = height - BOTTOM;
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const drawn = [];
    this.#levels.forEach(([lower, upper], i) => {
      const [from, to] = [this.#x(lower), this.#x(upper)];
      drawn.push(node("rect", { class: i % 2 ? "band odd" : "band", x: from, y: TOP, width: Math.max(0, to - from), height: floor - TOP }));
      const next = this.#levels[i + 1];
      if (next && next[0] > upper) {
        drawn.push(node("rect", { class: "band hole", x: to, y: TOP, width: this.#x(next[0]) - to, height: floor - TOP }));
      }
    });
    const h = this.#histogram;
    if (h) {
      // Density over the axis as drawn, so that areas are numbers of vertices.
      const bars = h.counts.map((count, i) => {
        const [from, to] = [this.#x(h.edges_cm[i]), this.#x(h.edges_cm[i + 1])];
        const fill = this.#colour((h.edges_cm[i] + h.edges_cm[i + 1]) / 2);
        return { from, wide: to - from, dense: count / Math.max(to - from, 1e-6), fill };
      });
      const most = Math.max(...bars.map((bar) => bar.dense), 1e-9);
      for (const { from, wide, dense, fill } of bars) {
        const tall = (dense / most) * (floor - TOP - 4);
        const at = { x: from, y: floor - tall, width: Math.max(wide - 0.5, 0.5), height: tall };
        drawn.push(node("rect", { class: "histogram", ...(fill && { fill }), ...at }));
      }
    }
    drawn.push(node("line", { class: "axis", x1: 0, x2: width, y1: floor, y2: floor }));
    for (const tick of [0.1, 0.5, 1, 2, 4, 8, 16, 32].filter((t) => t < this.#far())) {
      drawn.push(node("text", { x: this.#x(tick), y: height - 3, "text-anchor": "middle" }, cm(tick)));
    }
    drawn.push(node("text", { x: width, y: height - 3, "text-anchor": "end" }, "cm"));
    this.#bounds().forEach((bound, index) => {
      const held = this.#held?.index === index;
      const handle = node("g", {
        class: held ? "handle held" : "handle",
        "data-bound": index,
        tabindex: 0,
        role: "slider",
        "aria-label": `Bound ${bound.name}`,
        "aria-valuemin": cm(bound.least),
        "aria-valuemax": cm(Math.min(bound.most, this.#far())),
        "aria-valuenow": cm(bound.value),
        "aria-valuetext": `${cm(bound.value)} centimetres`,
        transform: `translate(${this.#x(bound.value)} 0)`,
      });
      const side = this.#x(bound.value) > width - 30 ? "end" : this.#x(bound.value) < 30 ? "start" : "middle";
      handle.append(
        node("line", { x1: 0, x2: 0, y1: TOP, y2: floor }),
        node("rect", { class: "reach", x: -REACH, y: TOP, width: 2 * REACH, height: floor - TOP }),
        node("rect", { class: "grip", x: -4, y: index % 2 ? TOP + 16 : TOP, width: 8, height: 14, rx: 3 }),
        node("text", { x: 0, y: 12, "text-anchor": side }, cm(bound.value)),
      );
      handle.addEventListener("pointerdown", (event) => this.#take(event, index));
      handle.addEventListener("keydown", (event) => this.#key(event, index));
      drawn.push(handle);
    });
    svg.replaceChildren(...drawn);
    if (focused !== undefined) svg.querySelector(`[data-bound="${focused}"]`)?.focus();
  }
}
