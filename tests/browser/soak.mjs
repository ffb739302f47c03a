// A session under edits for a long time: viewers come, go, and one never reads; memory must stay as it is, no edit is lost, and what it
// ends with is what a fresh run makes.
//
//     node tests/browser/soak.mjs target/release/partwise [EDITS] [GARMENT] [--cold]
//
// Two pages are open in Chromium, where playwright-core and CHROMIUM are found as in live.mjs (else two readers of their streams); a third
// reader of the stream, a viewer to the program, is cut off and comes back 20 times. RERUN names a native viewer (the program itself, not a
// script that starts it), which is attached by --connect and killed half way: what is sent to it ends there, which is said.

import assert from "node:assert/strict";
import { execFile, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { connect } from "node:net";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { promisify } from "node:util";

const run = promisify(execFile);
const cold = process.argv.includes("--cold");
const [program = "target/release/partwise", asked = "20000", garment = "flared-skirt@1500"] = process.argv
  .slice(2)
  .filter((word) => word !== "--cold");
const EDITS = Number(asked);
const RESTARTS = 20;
const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

// The viewer that is killed.
const at = 19876;
const native = process.env.RERUN;
const folder = mkdtempSync(join(tmpdir(), "soak-"));
const viewer = () =>
  spawn(native, ["--headless", "--bind", "127.0.0.1", "--port", String(at), "--memory-limit", "500MB"], {
    stdio: "ignore",
    env: { ...process.env, XDG_RUNTIME_DIR: folder, RUST_LOG: "off" },
  });
const shown = native && viewer();
if (native) await sleep(4000);

const args = ["live", "--garment", garment, ...(cold ? ["--cold"] : [])];
if (native) args.push("--connect", `rerun+http://127.0.0.1:${at}/proxy`);
const server = spawn(program, args, { stdio: ["ignore", "pipe", "inherit"] });
const base = await new Promise((found) => server.stdout.once("data", (text) => found(String(text).trim())));
const { hostname, port } = new URL(base);
const resident = () => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${server.pid}/status`, "utf8"))[1]) / 1024;
const api = async (path, options) => (await fetch(`${base}api/${path}`, options)).json();
const patch = (edit) =>
  api("state", { method: "PATCH", headers: { "Content-Type": "application/json" }, body: JSON.stringify(edit) });
async function idle() {
  for (;;) {
    const state = await api("state");
    if (state.idle) return state;
    await sleep(50);
  }
}

// One that never reads.
const silent = connect(Number(port), hostname);
silent.write(`GET /api/stream HTTP/1.1\r\nHost: ${hostname}:${port}\r\n\r\n`);
silent.pause();
silent.on("error", () => {});

let bytes = 0;
const readers = [];
function reader() {
  const stop = new AbortController();
  const read = async () => {
    const stream = await fetch(`${base}api/stream`, { signal: stop.signal });
    for await (const piece of stream.body) bytes += piece.length;
  };
  read().catch(() => {});
  return stop;
}
let pages = [];
let browser = null;
const faults = [];
try {
  const require = createRequire(resolve(process.env.NODE_PATH ?? "target/browser/node_modules", "x"));
  const { chromium } = require("playwright-core");
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run"],
  });
  for (let i = 0; i < 2; i += 1) {
    const page = await browser.newPage({ viewport: { width: 640, height: 480 } });
    page.on("pageerror", (error) => faults.push(String(error)));
    await page.goto(base, { timeout: 120000 });
    pages.push(page);
  }
} catch (error) {
  console.log(`no browser (${String(error).split("\n")[0]}): two readers stand for its pages`);
  readers.push(reader(), reader());
}
let killed = reader();

const FABRICS = ["interlock", "ponte", "rib-knit"];
let [restarts, last] = [0, { fabric: "interlock", waist: 72 }];
const memory = [];
await idle();
const before = (await api("state")).state;
const began = Date.now();
for (let i = 0; i < EDITS; i += 1) {
  // Never twice the same in a row: an edit that changes nothing makes no state.
  const bound = Number((1 + ((37 * i) % 3000) / 1000).toFixed(3));
  const edit = { table: { name: "soak", levels: [[0, 0.5], [0.5, bound], [bound, "inf"]] } };
  if (i % 50 === 49) edit.fabric = FABRICS[((i + 1) / 50) % 3];
  // Not at the very end: another form begins anew, and what the end is to be compared with is a drape that went on from others.
  if (i % 1000 === 499) edit.measurements = { waist: 70 + (((i + 501) / 1000) % 5) };
  const state = await patch(edit);
  if (state.error) throw new Error(state.error);
  last = { ...last, bound, fabric: edit.fabric ?? last.fabric, waist: edit.measurements?.waist ?? last.waist };
  const { table, fabric, measurements } = state.job;
  assert.deepEqual([state.state, table.levels[1][1], fabric, measurements.waist], [before + i + 1, bound, last.fabric, last.waist]);
  // A burst, as a drag is; then a moment; now and then until all is done.
  if (i % 20 === 19) await sleep(100);
  if (i % 500 === 499) await idle();
  if ((i + 1) % Math.floor(EDITS / RESTARTS) === 0) {
    restarts += 1;
    if (restarts === RESTARTS / 2 && native) shown.kill("SIGKILL");
    killed.abort();
    killed = reader();
  }
  if ((i + 1) % Math.floor(EDITS / 40) === 0) memory.push(resident());
}
const took = (Date.now() - began) / 1000;
const state = await idle();
assert.equal(state.state, before + EDITS);
assert.ok(pages.every((page) => !page.isClosed()) && faults.length === 0, String(faults));
const drape = await (await fetch(`${base}api/drape.obj`)).text();
const mb = (all) => all.map((value) => value.toFixed(0)).join(" ");
const seen = pages.length ? "two pages" : `two readers (${(bytes / 1e6).toFixed(0)} MB)`;
console.log(
  `${EDITS} edits in ${took.toFixed(0)} s${cold ? ", cold" : ""}, ${state.superseded} overtaken, ${seen} open, one that never reads, ` +
    `a viewer cut off and back ${restarts} times${native ? ", a native one killed" : ""}; resident, MB, after every fortieth: ` +
    `${mb(memory)}, at the end ${resident().toFixed(0)}`,
);
const [warm, end] = [memory.slice(10, 20), memory.slice(-10)].map((some) => some.reduce((a, b) => a + b, 0) / some.length);
console.log(`mean of the second quarter ${warm.toFixed(1)} MB, of the last ${end.toFixed(1)} MB`);

// What it ends with, and what a fresh run makes of the same.
const table = join(folder, "soak.toml");
const { levels, gap } = state.job.table;
writeFileSync(table, `name = "soak"\nunit = "cm"\ngap = "${gap}"\nlevels = [${levels.map((row) => `[${row.join(", ")}]`).join(", ")}]\n`);
const fresh = join(folder, "fresh.obj");
const spread = cold ? [] : ["--accuracy", "--spread", "5"];
const words = ["--garment", garment, "--table", table, "--fabric", last.fabric, "--waist", String(last.waist), "--no-save"];
const { stdout } = await run(program, [...words, "--export", fresh, "--format", "json", ...spread], { maxBuffer: 1 << 26 });
const vertices = (text) =>
  text.split("\n").filter((line) => line.startsWith("v ")).map((line) => line.split(" ").slice(1, 4).map(Number));
const [a, b] = [vertices(drape), vertices(readFileSync(fresh, "utf8"))];
assert.equal(a.length, b.length);
const squares = a.map((p, i) => p.reduce((sum, x, k) => sum + (x - b[i][k]) ** 2, 0));
const rms = 1000 * Math.sqrt(squares.reduce((sum, x) => sum + x, 0) / a.length);
if (cold) {
  assert.equal(drape, readFileSync(fresh, "utf8"), "the same bytes as a fresh run's");
  console.log("the drape is a fresh run's, byte for byte");
} else {
  const spread = JSON.parse(stdout).canonical_spread_mm;
  console.log(`RMS to a fresh run's drape ${rms.toFixed(2)} mm, between drapes from five perturbed starts ${spread.toFixed(2)} mm`);
  assert.ok(rms < 1.5 * spread, "within the spread");
}
readers.forEach((each) => each.abort());
killed.abort();
silent.destroy();
if (browser) await browser.close();
server.kill("SIGINT");
if (native) shown.kill("SIGKILL");
