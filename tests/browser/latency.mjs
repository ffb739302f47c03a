// Times from an edit to its results on the wire, by kind of edit, beside a cold run with the same parameters.
//
//     node tests/browser/latency.mjs target/release/partwise [EDITS] [GARMENT] [SEED] [COLD RUNS of each kind]
//
// Every edit waits until the one before is finished. `parts`: PARTs and forces, in the answer to PATCH; `preview`: the first event with a
// preview of the state; `balanced`: the garment whose forces balance; `at rest`: the same looked at that it lasts; `all`: the two stages
// from the undraped garment and the figures too. A fabric that the garment was in before (`again`) hangs as it did; waists are of tenths of a
// centimetre, so that hardly any form was made before.

import { execFile, spawn } from "node:child_process";
import { promisify } from "node:util";

const run = promisify(execFile);
const [program = "target/release/partwise", edits = "100", garment = "long-sleeved-dress@10861", seed = "1", colds = "3"] =
  process.argv.slice(2);
let random = BigInt(seed);
function next(n) {
  // SplitMix64.
  random = BigInt.asUintN(64, random + 0x9e3779b97f4a7c15n);
  let z = random;
  z = BigInt.asUintN(64, (z ^ (z >> 30n)) * 0xbf58476d1ce4e5b9n);
  z = BigInt.asUintN(64, (z ^ (z >> 27n)) * 0x94d049bb133111ebn);
  return Number((z ^ (z >> 31n)) % BigInt(n));
}

const server = spawn(program, ["live", "--garment", garment], { stdio: ["ignore", "pipe", "inherit"] });
const base = await new Promise((found) => server.stdout.once("data", (text) => found(String(text).trim())));
let newest = await (await fetch(`${base}api/state`)).json();
const waiting = new Set();
(async () => {
  const events = await fetch(`${base}api/events`);
  let text = "";
  for await (const bytes of events.body.pipeThrough(new TextDecoderStream())) {
    text += bytes;
    const whole = text.split("\n\n");
    text = whole.pop();
    for (const event of whole.filter((e) => e.startsWith("event"))) {
      newest = JSON.parse(event.slice(event.indexOf("data: ") + 6));
      for (const look of waiting) look(newest);
    }
  }
})().catch(() => {});
const when = (true_of) =>
  new Promise((done) => {
    const look = (state) => {
      if (!true_of(state)) return;
      waiting.delete(look);
      done(performance.now());
    };
    waiting.add(look);
    look(newest);
  });
await when((state) => state.idle);

const KINDS = {
  bound: () => {
    const levels = newest.job.table.levels.map((row) => [...row]);
    const i = 8 + next(levels.length - 9);
    const share = 0.2 + 0.06 * next(11);
    const far = levels[i][1] === "inf" ? levels[i][0] + 4 : levels[i][1];
    const to = Number((levels[i - 1][0] + share * (far - levels[i - 1][0])).toFixed(3));
    levels[i - 1][1] = to;
    levels[i][0] = to;
    return { table: { name: "edited", levels } };
  },
  extents: () => ({ max_extent_cm: [[], [24], [18], [12]].filter((e) => String(e) !== String(newest.job.max_extent_cm))[next(3)] }),
  "fabric, knit": () => {
    const others = ["interlock", "jersey", "rib-knit", "ponte"].filter((name) => name !== newest.job.fabric);
    return { fabric: others[next(others.length)] };
  },
  measurement: () => ({ measurements: { waist: 68 + next(120) / 10 } }),
};
const order = ["bound", "bound", "bound", "bound", "bound", "fabric, knit", "fabric, knit", "extents", "extents", "measurement"];
const times = {};
for (let i = 0; i < Number(edits); i += 1) {
  let kind = order[next(order.length)];
  const edit = KINDS[kind]();
  const began = performance.now();
  const answer = await fetch(`${base}api/state`, {
    method: "PATCH",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(edit),
  });
  const state = await answer.json();
  if (!answer.ok) throw new Error(`${JSON.stringify(edit)}: ${state.error}`);
  const answered = performance.now();
  const n = state.state;
  const there = state.parts?.state === n ? Promise.resolve(answered) : when((s) => s.parts?.state === n);
  const kept = state.rest?.state === n && state.rest.done ? answered : null;
  if (kind.startsWith("fabric") && kept) kind = "fabric, again";
  const [parts, preview, balanced, rest, all] = await Promise.all([
    there,
    when((s) => s.preview?.state === n),
    kept ?? when((s) => s.rest?.state === n && (s.rest.balanced || s.rest.done)),
    kept ?? when((s) => s.rest?.state === n && s.rest.done),
    when((s) => s.state === n && s.idle),
  ]);
  const row = { parts, preview, balanced, rest, all };
  times[kind] ??= { parts: [], preview: [], balanced: [], rest: [], all: [], jobs: [] };
  for (const key of Object.keys(row)) times[kind][key].push(row[key] - began);
  times[kind].jobs.push(newest.job);
}

// A cold run of the last few of each kind.
server.kill("SIGINT");
const { appendFileSync, mkdtempSync, writeFileSync } = await import("node:fs");
const { tmpdir } = await import("node:os");
const { join } = await import("node:path");
const folder = mkdtempSync(join(tmpdir(), "latency-"));
const quantile = (values, share) => [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(share * values.length))];
console.log(`${garment}, ${edits} edits, seed ${seed}; ms, median (95th percentile)`);
console.log("kind              n   parts        preview        balanced       at rest        all            cold run");
for (const [kind, { jobs, ...measured }] of Object.entries(times)) {
  const cold = [];
  for (const job of jobs.slice(-Number(colds) || jobs.length)) {
    const table = join(folder, "table.toml");
    const rows = job.table.levels.map((row) => `[${row.join(", ")}]`).join(", ");
    writeFileSync(table, `name = "t"\nunit = "cm"\ngap = "${job.table.gap}"\nlevels = [${rows}]\n`);
    const args = ["--garment", job.garment, "--table", table, "--fabric", job.fabric, "--format", "json", "--no-save"];
    if (job.max_extent_cm.length > 0) args.push("--max-extent", job.max_extent_cm.join(","));
    args.push("--waist", String(job.measurements.waist));
    const began = performance.now();
    await run(program, args, { maxBuffer: 1 << 26 });
    cold.push(performance.now() - began);
  }
  const cell = (values) => `${quantile(values, 0.5).toFixed(0)} (${quantile(values, 0.95).toFixed(0)})`.padEnd(15);
  const cells = [measured.parts, measured.preview, measured.balanced, measured.rest, measured.all].map(cell);
  cells[0] = cells[0].trimEnd().padEnd(13);
  console.log(`${kind.padEnd(16)} ${String(jobs.length).padStart(3)}   ${cells.join("")}${quantile(cold, 0.5).toFixed(0)}`);
  // For who joins several runs.
  if (process.env.RAW) appendFileSync(process.env.RAW, `${JSON.stringify({ kind, ...measured, cold })}\n`);
}
