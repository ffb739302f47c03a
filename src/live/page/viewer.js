// Rerun's viewer in the page, and the pieces that it reads from the server.

import { fail, run, show } from "./program.js";
import { ask } from "./session.js";

const [message, canvas, scene] = ["message", "viewer", "scene"].map((id) => document.getElementById(id));
const CHANNEL = "session";
// Frames drawn before the canvas is shown: until the layout arrives, the viewer shows its default layout.
const COVERED = 3;

// The viewer reads a piece in slices and yields between them: a small piece would overtake the large one it builds on, and be drawn
// without its triangles. Here each piece is read without yielding.
(window.scheduler ??= {}).yield = () => Promise.resolve();
const turn = () => new Promise((done) => setTimeout(done));

const failed = (error) => fail(error?.message ?? String(error), "All else on this page works without it.");

// Starts the viewer; `picked(view, position)` is called for each click on a mesh.
export async function start(picked) {
  try {
    const handle = await run(
      {
        url: [],
        persist: false,
        theme: "system",
        panel_state_overrides: { top: "Hidden", blueprint: "Hidden", selection: "Hidden", time: "Hidden" },
        on_viewer_event: (json) => heard(JSON.parse(json), picked),
      },
      failed,
    );
    leaveByTab();
    withoutHover();
    handle.open_channel(CHANNEL, "session");
    viewer = handle;
    message.textContent = "Waiting for the garment …";
    await feed(handle);
  } catch (error) {
    failed(error);
  }
}

// The viewer takes the Tab key for its own fields and would never give the focus back; here the browser moves it on.
function leaveByTab() {
  // The viewer's hidden text field is skipped by Tab.
  const texts = scene.querySelector(":scope > input");
  if (texts) texts.tabIndex = -1;
  const leave = (event) => {
    if (event.key !== "Tab" || ![canvas, texts].includes(document.activeElement)) return;
    event.stopImmediatePropagation();
    // From the hidden field as from the canvas.
    canvas.focus();
  };
  for (const kind of ["keydown", "keyup"]) window.addEventListener(kind, leave, { capture: true });
}

// How long the pointer may rest, ms: a little later the viewer describes its own data in a box, which is of no use here.
const RESTING = 200;

// Frames in which the viewer finds what is under the pointer. A press before that would select nothing.
const FINDING = 6;

async function frames(count) {
  for (let i = 0; i < count; i += 1) await new Promise((done) => requestAnimationFrame(done));
}

// Takes the pointer from the viewer while it rests, and gives it back when it moves, presses or turns the wheel.
function withoutHover() {
  let timer = null;
  let taken = false;
  let held = null;
  const hold = (event) => {
    event.stopImmediatePropagation();
    held.push(event);
  };
  // Presses one after another: a second one may come while the viewer still looks for what is under the first.
  let pressed = Promise.resolve();
  const press = (event) => {
    const own = (held = []);
    hold(event);
    pressed = pressed.then(async () => {
      // A pointer that rests draws no frames.
      for (let i = 0; i < FINDING; i += 1) {
        hover(event);
        await frames(1);
      }
      // Press and release in one frame: where frames take a second, a click would else be a long press, which selects nothing.
      for (const next of own) canvas.dispatchEvent(new PointerEvent(next.type, next));
      if (held === own) held = null;
      // The pointer rests again where it was released.
      rest(own.at(-1));
    });
  };
  const rest = (event) => {
    clearTimeout(timer);
    if (event.buttons !== 0) return;
    timer = setTimeout(() => {
      taken = true;
      canvas.dispatchEvent(new MouseEvent("mouseleave"));
    }, RESTING);
  };
  const hover = ({ clientX, clientY }) => canvas.dispatchEvent(new MouseEvent("mousemove", { clientX, clientY, bubbles: true }));
  const back = (event) => {
    if (!event.isTrusted || !taken) return;
    taken = false;
    hover(event);
  };
  const on = (kind, act) => scene.addEventListener(kind, (event) => event.target === canvas && act(event), { capture: true, passive: true });
  on("pointerdown", (event) => {
    if (!event.isTrusted || !taken) return;
    clearTimeout(timer);
    back(event);
    press(event);
  });
  on("pointerup", (event) => {
    if (event.isTrusted && held) hold(event);
  });
  for (const kind of ["pointermove", "pointerdown", "pointerup", "wheel"]) {
    on(kind, (event) => {
      back(event);
      rest(event);
    });
  }
}

// Releases what the viewer has selected: it outlines the garment as a whole.
function release() {
  for (const kind of ["keydown", "keyup"]) canvas.dispatchEvent(new KeyboardEvent(kind, { key: "Escape", code: "Escape" }));
}

let viewer = null;

// Draws what the server answers, in addition to the pieces; returns the answer's headers, or null if there was nothing to draw.
export async function draw(path) {
  const response = await ask(path).catch(() => null);
  if (!response?.ok || !viewer) return null;
  viewer.send_rrd_to_channel(CHANNEL, new Uint8Array(await response.arrayBuffer()));
  return response.headers;
}

function heard(event, picked) {
  if (event.type !== "selection_change") return;
  const item = (event.items ?? []).find((i) => i.position && i.entity_path);
  const view = item?.entity_path.split("/").find((name) => name !== "");
  if (!["parts", "preview", "rest"].includes(view)) return;
  picked(view, item.position);
  // The viewer takes no keys while it tells of a selection.
  setTimeout(release);
}

// Shows the canvas some frames after the first piece.
let uncover = () => {
  uncover = () => {};
  let drawn = 0;
  const count = () => ((drawn += 1) < COVERED ? requestAnimationFrame(count) : show());
  requestAnimationFrame(count);
};

// Passes the server's pieces to the viewer; reconnects after an error.
async function feed(handle) {
  for (let wait = 250; ; wait = Math.min(2 * wait, 5000)) {
    try {
      const response = await ask("api/stream");
      if (!response.ok) throw new Error(`the server answers ${response.status}`);
      wait = 250;
      for await (const piece of pieces(response.body.getReader())) {
        handle.send_rrd_to_channel(CHANNEL, piece);
        uncover();
        await turn();
        window.dispatchEvent(new CustomEvent("piece", { detail: piece.length }));
      }
    } catch {
      // The status line shows that the session is lost.
    }
    await new Promise((done) => setTimeout(done, wait));
  }
}

// Each piece follows its length in four little-endian bytes.
async function* pieces(reader) {
  let rest = new Uint8Array(0);
  const take = async (count) => {
    const parts = [];
    let length = 0;
    for (;;) {
      if (rest.length > 0) {
        const part = rest.subarray(0, count - length);
        parts.push(part);
        length += part.length;
        rest = rest.subarray(part.length);
      }
      if (length === count) break;
      const { value, done } = await reader.read();
      if (done) return null;
      rest = value;
    }
    const whole = new Uint8Array(count);
    let offset = 0;
    for (const part of parts) {
      whole.set(part, offset);
      offset += part.length;
    }
    return whole;
  };
  for (;;) {
    const head = await take(4);
    if (!head) return;
    const length = new DataView(head.buffer).getUint32(0, true);
    if (length === 0) continue;
    const piece = await take(length);
    if (!piece) return;
    yield piece;
  }
}
