// Starts the Rerun viewer on the recording that this program serves.
"use strict";

// Nothing leaves this machine. The viewer would send its statistics and look for news at its makers'; the server's
// Content-Security-Policy forbids it, and here such a request is answered, so that it is no error either.
const ask = window.fetch.bind(window);
window.fetch = (what, how) => {
  const address = new URL(what instanceof Request ? what.url : what, location.href);
  const near =
    address.origin === location.origin ||
    ["127.0.0.1", "localhost"].includes(address.hostname) ||
    ["blob:", "data:"].includes(address.protocol);
  return near ? ask(what, how) : Promise.resolve(new Response(null, { status: 204 }));
};

const message = document.getElementById("message");
const canvas = document.getElementById("viewer");

function fail(reason) {
  canvas.style.visibility = "hidden";
  message.hidden = false;
  message.textContent =
    `The viewer cannot run: ${reason}\n\nIt needs a browser of 2023 or later with WebGL; adding ?renderer=webgl to ` +
    "the address may help. Reload the page to try again.";
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
  const headers = { "Content-Type": "application/wasm" };
  return new Response(response.body.pipeThrough(counted), { headers });
}

async function start() {
  await wasm_bindgen({ module_or_path: program() });
  const query = new URLSearchParams(location.search);
  const asked = query.getAll("url");
  const handle = new wasm_bindgen.WebHandle({
    url: asked.length > 0 ? asked : [document.documentElement.dataset.recording],
    manifest_url: null,
    render_backend: query.get("renderer"),
    video_decoder: null,
    hide_welcome_screen: true,
    enable_history: false,
    notebook: false,
    persist: true,
    fallback_token: null,
    theme: query.get("theme"),
    login: { signed_in_url: location.origin, signed_out_url: location.origin },
  });
  const watch = () => (handle.has_panicked() ? fail(handle.panic_message()) : setTimeout(watch, 1000));
  watch();
  await handle.start(canvas);
  message.hidden = true;
  canvas.style.visibility = "visible";
}

start().catch(fail);
