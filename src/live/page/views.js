// The views: the side that all of them show, one eye for all while Alt is held, and the fit on the garment at rest.

import { draw } from "./viewer.js";

const at = (id) => document.getElementById(id);
const canvas = at("viewer");
const ELEVATION = 7;
const SIDES = { "eye-front": 0, "eye-side": 90, "eye-back": 180 };
// Degrees by which a drag of one pixel turns the eye.
const TURN = 0.4;
const UNITS = { strain: "%", pressure: "kPa" };

// Azimuth and elevation of the eye, degrees; null until a button or a drag sets them.
let eye = null;
let busy = false;
let waiting = false;

// Sends the eye to the viewer; of those that come while one is on its way, the last.
async function turn() {
  waiting = true;
  if (busy) return;
  busy = true;
  while (waiting) {
    waiting = false;
    await draw(`api/eye?azimuth=${eye.azimuth}&elevation=${eye.elevation}`);
  }
  busy = false;
}

for (const [id, azimuth] of Object.entries(SIDES)) {
  at(id).addEventListener("click", () => {
    eye = { azimuth, elevation: ELEVATION };
    turn();
  });
}

// While Alt is held, a drag in any view turns all of them; the viewer hears nothing of it.
let drag = null;
const mine = (event) => event.altKey && event.target === canvas;
const take = (event) => {
  event.stopImmediatePropagation();
  event.preventDefault();
};
window.addEventListener("pointerdown", (event) => {
  if (!mine(event) || event.button !== 0) return;
  take(event);
  eye ??= { azimuth: 0, elevation: ELEVATION };
  drag = { x: event.clientX, y: event.clientY, ...eye };
}, { capture: true });
window.addEventListener("pointermove", (event) => {
  document.body.classList.toggle("turning", mine(event));
  if (!drag) return;
  take(event);
  const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
  const azimuth = (drag.azimuth - TURN * dx) % 360;
  eye = { azimuth, elevation: Math.max(-85, Math.min(85, drag.elevation + TURN * dy)) };
  turn();
}, { capture: true });
window.addEventListener("pointerup", (event) => {
  if (!drag) return;
  take(event);
  drag = null;
}, { capture: true });
for (const kind of ["mousedown", "mousemove", "mouseup"]) {
  window.addEventListener(kind, (event) => (drag || mine(event)) && take(event), { capture: true });
}
// Alt alone would open the browser's menu.
window.addEventListener("keyup", (event) => event.key === "Alt" && event.preventDefault(), { capture: true });

let shown = { fit: "none", serial: null, layout: null };

async function fit(of) {
  const headers = await draw(`api/fit?of=${of}`);
  const key = at("fit-key");
  key.hidden = !headers || of === "none";
  if (key.hidden) return;
  const high = Number(Number(headers.get("Fit-High")).toPrecision(3));
  key.replaceChildren(document.createElement("i"), `${high} ${UNITS[of]}`);
}

at("fit").addEventListener("change", () => {
  shown.fit = at("fit").value;
  shown.serial = null;
  fit(shown.fit);
});

// After a new layout the eye is that of the server again, and a new drape has no colours yet.
export function showViews(state) {
  const layout = `${state.garment?.generation} ${state.pins?.length}`;
  if (layout !== shown.layout) {
    shown.layout = layout;
    if (eye) setTimeout(turn, 300);
  }
  if (shown.fit !== "none" && state.idle && shown.serial !== state.serial) {
    shown.serial = state.serial;
    fit(shown.fit);
  }
}
