// The two other ways of working, in one picture: an editor on the file that `--watch` follows, and curl beside the page of `live`. What
// stands in the terminals is what was typed and answered, and the pictures beside them are the web viewer's after it.
//
//     node recordings/gallery/ways.mjs PARTWISE PICTURE
//
// Needs playwright-core and Chromium as tests/browser/live.mjs does, curl, and python3 with Pillow for fewer colours.

import { execFile, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { promisify } from "node:util";

const run = promisify(execFile);
const require = createRequire(resolve(process.env.NODE_PATH ?? "target/browser/node_modules", "x"));
const { chromium } = require("playwright-core");
const [program, picture] = process.argv.slice(2);
const [binary, out] = [resolve(program), resolve(picture)];
const folder = mkdtempSync(join(tmpdir(), "ways-"));
const sleep = (ms) => new Promise((done) => setTimeout(done, ms));
const GARMENT = "low-cut-dress";

// A program in `folder`, and all that it has said.
function start(...args) {
  const child = spawn(binary, args, { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
  let said = "";
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (text) => (said += text));
  return { child, said: () => said };
}
async function until(what, wait = 120000) {
  for (const since = Date.now(); Date.now() - since < wait; await sleep(100)) {
    const found = await what();
    if (found) return found;
  }
  throw new Error("never came");
}
const address = (text) => /http:\S+/.exec(text)?.[0];

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run"],
});
async function look(at, size) {
  const page = await browser.newPage({ viewport: size, colorScheme: "dark" });
  await page.goto(at, { timeout: 120000 });
  await sleep(Number(process.env.SETTLE ?? 20000));
  const png = (await page.screenshot()).toString("base64");
  await page.close();
  return png;
}

// The editor: a file, saved once with one bound moved.
const rows = (bound) => [
  'name = "mine"',
  'unit = "cm"',
  'gap = "extend-lower"',
  "levels = [",
  "  [0.0, 0.5],",
  `  [0.5, ${bound}],`,
  `  [${bound}, 6.0, 12.0],`,
  "  [6.0, inf, 8.0, 24.0],",
  "]",
];
const file = join(folder, "mine.toml");
writeFileSync(file, `${rows("2.0").join("\n")}\n`);
const watching = ["--garment", GARMENT, "--table", "mine.toml", "--refine", "0", "--serve", "--watch"];
const editor = start(...watching);
await until(() => /milliseconds/.test(editor.said()));
const before = editor.said().length;
writeFileSync(file, `${rows("3.5").join("\n")}\n`);
await until(() => /PARTs/.test(editor.said().slice(before)));
await sleep(2000);
const served = address(editor.said());
const answers = editor.said().slice(before).trim().split("\n").slice(0, 3);
const editorView = await look(served, { width: 1000, height: 560 });
editor.child.kill("SIGINT");

// A script: edits by curl, as they are typed.
const live = start("live", "--garment", GARMENT, "--port", "0");
const base = (await until(() => address(live.said()))).replace(/\/$/, "");
const state = async () => (await fetch(`${base}/api/state`)).json();
await until(async () => (await state()).idle);
const typed = [];
async function curl(shown, words, tell) {
  const { stdout } = await run("curl", ["-s", ...words]);
  typed.push(`$ curl ${shown}`, ...tell(stdout));
}
const json = ["-H", "Content-Type: application/json"];
const numbers = (text) => {
  const now = JSON.parse(text);
  return [`{"state": ${now.state}, "parts": {"count": ${now.parts.count}}, "job": {"fabric": "${now.job.fabric}", …}, …}`];
};
await curl(`-X PATCH $BASE/api/state -d '{"fabric": "ponte"}' $JSON`, ["-X", "PATCH", `${base}/api/state`, ...json, "-d", '{"fabric": "ponte"}'], numbers);
const table = '{"table": {"levels": [[0,0.5],[0.5,2],[2,6,12],[6,"inf",8,24]]}}';
await curl(`-X PATCH $BASE/api/state -d '${table}' $JSON`, ["-X", "PATCH", `${base}/api/state`, ...json, "-d", table], numbers);
await until(async () => (await state()).idle);
await curl(`$BASE/api/drape.obj | head -2`, [`${base}/api/drape.obj`], (text) => text.split("\n").slice(0, 2));
await curl(`"$BASE/api/part?number=7"`, [`${base}/api/part?number=7`], (text) => {
  const part = JSON.parse(text);
  return [`{"part": 7, "level": ${part.level}, "vertices": ${part.vertices}, "area_cm2": ${part.area_cm2.toFixed(1)}, …}`];
});
const pageView = await look(`${base}/`, { width: 1000, height: 560 });
live.child.kill("SIGINT");

const safe = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;");
const changed = rows("3.5").map((line, i) => (line === rows("2.0")[i] ? safe(line) : `<b>${safe(line)}</b>`));
const wide = (text) => safe(text.length > 104 ? `${text.slice(0, 103)}…` : text);
const html = `<style>
  body { margin: 0; padding: 8px; width: 1184px; background: #15171b; font: 12px/1.42 "DejaVu Sans Mono", monospace; color: #cfd3da }
  section { display: grid; grid-template-columns: 560px 616px; gap: 8px; margin-bottom: 8px }
  h2 { font: bold 12px "DejaVu Sans", sans-serif; margin: 0 0 6px; color: #9aa3b2 }
  pre { margin: 0; white-space: pre-wrap; overflow-wrap: anywhere } b { color: #ffd479 } .box { background: #1f2227; padding: 9px 11px; height: 327px }
  .told { color: #8fd19e } hr { border: 0; border-top: 1px solid #3a3f48 } img { width: 616px; height: 345px; display: block }
</style><body>
<section><div class="box"><h2>an editor: mine.toml, saved with another bound</h2><pre>${changed.join("\n")}</pre><hr>
<pre>$ partwise ${watching.join(" ")}\n<span class="told">${answers.map(wide).join("\n")}</span></pre></div><img src="data:image/png;base64,${editorView}"></section>
<section><div class="box"><h2>a script: curl, and the page beside it</h2><pre>${typed.map((line) => (line.startsWith("$") ? safe(line) : `<span class="told">${wide(line)}</span>`)).join("\n")}</pre></div><img src="data:image/png;base64,${pageView}"></section>`;
const page = await browser.newPage({ viewport: { width: 1200, height: 714 } });
await page.setContent(html);
const whole = join(folder, "whole.png");
await page.screenshot({ path: whole });
await browser.close();
const few = "import sys; from PIL import Image; Image.open(sys.argv[1]).convert('RGB').quantize(112, method=0, dither=0).save(sys.argv[2], optimize=True)";
await run(process.env.PYTHON ?? "python3", ["-c", few, whole, out]);
console.log(`${out}: ${readFileSync(out).length} bytes`);
