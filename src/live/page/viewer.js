// Rerun's viewer in the page, and the pieces that it reads from the server.

import { fail, run, show } from "./program.js";
import { ask } from "./session.js";

const message = document.getElementById("message");
const CHANNEL = "session";
// Frames drawn before the canvas is shown: until the layout arrives, the viewer shows its default layout.
const COVERED = 3;

// The viewer reads a piece in slices and yields between them: a small piece would overtake the large one it builds on, and be drawn
// without its triangles. Here each piece is read without yielding.
(window.scheduler ??= {}).yield = () => Promise.resolve();
const turn = () => new Promise((done) => setTimeout(done));

const failed = (error) => fail(error?.message ?? String(error), "All else on this page works without it.");

// Starts the viewer; `picked(view, position)` is called for each click on a mesh.
export async function start(theme, picked) {
  try {
    const handle = await run(
      {
        url: [],
        persist: false,
        theme,
        panel_state_overrides: { top: "Hidden", blueprint: "Hidden", selection: "Hidden", time: "Hidden" },
        on_viewer_event: (json) => heard(JSON.parse(json), picked),
      },
      failed,
    );
    handle.open_channel(CHANNEL, "session");
    message.textContent = "Waiting for the garment …";
    await feed(handle);
  } catch (error) {
    failed(error);
  }
}

function heard(event, picked) {
  if (event.type !== "selection_change") return;
  const item = (event.items ?? []).find((i) => i.position && i.entity_path);
  const view = item?.entity_path.split("/").find((name) => name !== "");
  if (["parts", "preview", "rest"].includes(view)) picked(view, item.position);
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
