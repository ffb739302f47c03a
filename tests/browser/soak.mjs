// A session under edits for a long time: viewers come, go, and one never reads; memory must stay as it is.
//
//     node tests/browser/soak.mjs target/release/partwise [SECONDS] [GARMENT]

import { spawn } from "node:child_process";
import { readFileSync } from "node:fs";
import { connect } from "node:net";

const [program = "target/release/partwise", seconds = "600", garment = "flared-skirt@1500"] = process.argv.slice(2);
const server = spawn(program, ["live", "--garment", garment], { stdio: ["ignore", "pipe", "inherit"] });
const base = await new Promise((found) => server.stdout.once("data", (text) => found(String(text).trim())));
const { hostname, port } = new URL(base);
const resident = () => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${server.pid}/status`, "utf8"))[1]) / 1024;
const api = async (path, options) => (await fetch(`${base}api/${path}`, options)).json();
const patch = (edit) =>
  api("state", { method: "PATCH", headers: { "Content-Type": "application/json" }, body: JSON.stringify(edit) });

// One that never reads.
const silent = connect(Number(port), hostname);
silent.write(`GET /api/stream HTTP/1.1\r\nHost: ${hostname}:${port}\r\n\r\n`);
silent.pause();
silent.on("error", () => {});
let bytes = 0;
let restarts = 0;
async function viewer(signal) {
  const stream = await fetch(`${base}api/stream`, { signal });
  for await (const piece of stream.body) bytes += piece.length;
}
let stop = new AbortController();
const attach = () => viewer(stop.signal).catch(() => {});
attach();
attach();

const began = Date.now();
let [edits, last] = [0, null];
const memory = [];
const FABRICS = ["interlock", "ponte", "rib-knit"];
while (Date.now() - began < 1000 * Number(seconds)) {
  const bound = Number((1 + 3 * Math.abs(Math.sin(edits / 7))).toFixed(3));
  last = { table: { name: "soak", levels: [[0, 0.5], [0.5, bound], [bound, "inf"]] } };
  if (edits % 50 === 49) last.fabric = FABRICS[(edits / 50) % 3 | 0];
  const state = await patch(last);
  if (state.error) throw new Error(state.error);
  if (state.job.table.levels[1][1] !== bound) throw new Error("an edit was lost");
  edits += 1;
  if (edits % 500 === 0) {
    stop.abort();
    restarts += 1;
    stop = new AbortController();
    attach();
    attach();
  }
  if (edits % 250 === 0) memory.push(resident());
}
let state = await api("state");
while (!state.idle) {
  await new Promise((done) => setTimeout(done, 100));
  state = await api("state");
}
if (state.job.table.levels[1][1] !== last.table.levels[1][1]) throw new Error("the last edit was lost");
const told = memory.filter((_, i) => i % Math.max(1, Math.floor(memory.length / 12)) === 0).map((mb) => mb.toFixed(0));
console.log(
  `${edits} edits in ${seconds} s, ${state.superseded} overtaken, two viewers restarted ${restarts} times, ` +
    `${(bytes / 1e6).toFixed(0)} MB sent; resident, MB, over time: ${told.join(" ")}, at the end ${resident().toFixed(0)}`,
);
stop.abort();
silent.destroy();
server.kill("SIGINT");
