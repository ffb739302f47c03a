// The viewer's program, for both pages around it: it sends nothing to other hosts, and logs no debug output.

// The viewer sends statistics to its makers and loads news from them. The server's Content-Security-Policy forbids both; this
// answers such requests, so that they do not fail either.
const plain = window.fetch.bind(window);
window.fetch = (what, how) => {
  const address = new URL(what instanceof Request ? what.url : what, location.href);
  const near = address.origin === location.origin || ["blob:", "data:"].includes(address.protocol);
  return near ? plain(what, how) : Promise.resolve(new Response(null, { status: 204 }));
};

// Its shader compiler logs each step, a hundred thousand lines before the first picture.
console.debug = () => {};

const message = document.getElementById("message");
const canvas = document.getElementById("viewer");

// Shows why the viewer does not run, and the remedy.
export function fail(reason, remedy) {
  canvas.style.visibility = "hidden";
  message.hidden = false;
  message.textContent =
    `The viewer cannot run: ${reason}\n\nIt needs a browser of 2024 or later with WebGL; adding ?renderer=webgl to the ` +
    `address may help. ${remedy}`;
}

// The viewer's program; shows the share that has arrived.
async function program() {
  const response = await plain("re_viewer_bg.wasm");
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

// Runs the viewer in the page's canvas, with these options beside those of both pages, and returns its handle.
export async function run(options, failed) {
  await wasm_bindgen({ module_or_path: program() });
  const handle = new wasm_bindgen.WebHandle({
    manifest_url: null,
    render_backend: new URLSearchParams(location.search).get("renderer"),
    video_decoder: null,
    hide_welcome_screen: true,
    enable_history: false,
    notebook: false,
    fallback_token: null,
    login: { signed_in_url: location.origin, signed_out_url: location.origin },
    ...options,
  });
  const watch = () => (handle.has_panicked() ? failed(handle.panic_message()) : setTimeout(watch, 1000));
  watch();
  await handle.start(canvas);
  return handle;
}

// Uncovers the canvas.
export function show() {
  message.hidden = true;
  canvas.style.visibility = "visible";
}
