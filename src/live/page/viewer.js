// Rerun's viewer in the page: its program, and the pieces that the server sends it.

import { ask } from "./session.js";

// Nothing leaves the server's own address. The viewer would send its statistics and look for news at its makers'; the server's
// Content-Security-Policy forbids it, and here such a request is answered, so that it is no error either.
const plain = window.fetch.bind(window);
window.fetch = (what, how) => {
  const address = new URL(what instanceof Request ? what.url : what, location.href);
  const near = address.origin === location.origin || ["blob:", "data:"].includes(address.protocol);
  return near ? plain(what, how) : Promise.resolve(new Response(null, { status: 204 }));
};

const message = document.getElementById("message");
const canvas = document.getElementById("viewer");
const CHANNEL = "session";

function fail(reason) {
  canvas.style.visibility = "hidden";
  message.hidden = false;
  message.textContent =
    `The viewer cannot run: ${reason}\n\nIt needs a browser of 2024 or later with WebGL; adding ?renderer=webgl to the ` +
    "address may help. All else on this page works without it.";
}

// The viewer's program, with the share of it that has come.
async function program() {
  const response = await fetch("re_viewer_bg.wasm");
  if (!response.ok) throw new Error(`the server answers ${response.status}`);
  const whole = Number(response.headers.get("rerun-final-length"));
  let loaded = 0;
  const counted = new TransformStream({
    transform(bytes, controller) {
      loaded += bytes.byteLength;
      message.textContent = `Loading the viewer … ${Math.round((100 * loaded) / whole)} %`;
      controller.enqueue(bytes);
    },
  });
  return new Response(response.body.pipeThrough(counted), { headers: { "Content-Type": "application/wasm" } });
}

// Starts the viewer; `picked(view, position)` is told where somebody clicked.
export async function start(theme, picked) {
  try {
    await wasm_bindgen({ module_or_path: program() });
    const handle = new wasm_bindgen.WebHandle({
      url: [],
      manifest_url: null,
      render_backend: new URLSearchParams(location.search).get("renderer"),
      video_decoder: null,
      hide_welcome_screen: true,
      enable_history: false,
      notebook: false,
      persist: false,
      fallback_token: null,
      theme,
      panel_state_overrides: { top: "Hidden", blueprint: "Hidden", selection: "Hidden", time: "Hidden" },
      on_viewer_event: (json) => heard(JSON.parse(json), picked),
      login: { signed_in_url: location.origin, signed_out_url: location.origin },
    });
    const watch = () => (handle.has_panicked() ? fail(handle.panic_message()) : setTimeout(watch, 1000));
    watch();
    await handle.start(canvas);
    handle.open_channel(CHANNEL, "session");
    canvas.style.visibility = "visible";
    message.textContent = "Waiting for the garment …";
    await feed(handle);
  } catch (error) {
    fail(error?.message ?? String(error));
  }
}

function heard(event, picked) {
  if (event.type !== "selection_change") return;
  const item = (event.items ?? []).find((i) => i.position && i.entity_path);
  const view = item?.entity_path.split("/").find((name) => name !== "");
  if (["parts", "preview", "rest"].includes(view)) picked(view, item.position);
}

// Hands on the server's pieces; after a break it begins anew.
async function feed(handle) {
  for (let wait = 250; ; wait = Math.min(2 * wait, 5000)) {
    try {
      const response = await ask("api/stream");
      if (!response.ok) throw new Error(`the server answers ${response.status}`);
      wait = 250;
      for await (const piece of pieces(response.body.getReader())) {
        handle.send_rrd_to_channel(CHANNEL, piece);
        message.hidden = true;
        window.dispatchEvent(new CustomEvent("piece", { detail: piece.length }));
      }
    } catch {
      // The status line says that the session is lost.
    }
    await new Promise((done) => setTimeout(done, wait));
  }
}

// Each piece follows its length in four bytes, the least first.
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
