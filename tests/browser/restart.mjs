// A page that is open when its program ends says so, and shows what the program serves once it is run again on the port: the page of
// `partwise live` and the one of `partwise view`.
//
//     node tests/browser/restart.mjs target/release/partwise [FOLDER for pictures]
//
// As live.mjs otherwise.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import { mkdirSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { near } from "./looks.mjs";

const require = createRequire(resolve(process.env.NODE_PATH ?? "target/browser/node_modules", "x"));
const { chromium } = require("playwright-core");
const [program = "target/release/partwise", pictures] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "partwise-"));
const PATIENCE = 180000;

let running = null;
async function serve(...line) {
  running = spawn(program, line, { stdio: ["ignore", "pipe", "pipe"] });
  let said = "";
  running.stderr.on("data", (text) => (said += text));
  return new Promise((found, lost) => {
    running.stdout.on("data", (text) => found(String(text).trim()));
    running.on("exit", (code) => lost(new Error(`the program ended with ${code}: ${said}`)));
  });
}
async function end() {
  const ended = new Promise((done) => running.once("exit", done));
  running.kill("SIGINT");
  await ended;
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run",
    "--disable-background-networking", "--disable-gpu-sandbox"],
});
const begun = Date.now();
const said = (text) => console.log(`${((Date.now() - begun) / 1000).toFixed(1).padStart(6)} s  ${text}`);
const shown = (page) => page.waitForFunction(() => document.getElementById("message").hidden, null, { timeout: PATIENCE });

async function open(address) {
  const page = await (await browser.newContext({ viewport: { width: 1280, height: 800 } })).newPage();
  page.on("request", (request) => assert.ok(near(request.url(), address) || request.url().startsWith("http://127.0.0.1:"), request.url()));
  page.on("pageerror", (error) => assert.fail(`page: ${error}`));
  await page.goto(`${address}?renderer=webgl`);
  await shown(page);
  return page;
}
async function photo(page, name) {
  if (!pictures) return;
  mkdirSync(pictures, { recursive: true });
  await page.waitForTimeout(2500);
  writeFileSync(join(pictures, `restart-${name}.png`), await page.screenshot());
}

try {
  // A session: some edits, so that its states are further than those of the one after it.
  const live = await serve("live", "--garment", "flared-skirt@900");
  const page = await open(live);
  const edit = (levels) =>
    page.evaluate(async (levels) => {
      const { ask } = await import("./session.js");
      const how = { method: "PATCH", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ table: { levels } }) };
      await ask("api/state", how);
    }, levels);
  for (let i = 0; i < 5; i += 1) await edit([[0, 1 + i], [1 + i, "inf"]]);
  await page.waitForFunction(() => /^state 6 /.test(document.getElementById("status").textContent), null, { timeout: PATIENCE });
  await end();
  await page.waitForFunction(() => document.getElementById("status").textContent.includes("cannot be reached"), null, { timeout: PATIENCE });
  said("the session's page says that its program is gone");
  await photo(page, "live-gone");
  const again = await serve("live", "--garment", "pullover-1", "--port", String(new URL(live).port));
  assert.equal(again, live);
  await page.waitForFunction(() => document.getElementById("garment")?.value === "pullover-1", null, { timeout: PATIENCE });
  await page.waitForFunction(() => /^state 1 .*at rest ✓/.test(document.getElementById("status").textContent), null, { timeout: PATIENCE });
  await shown(page);
  said("and shows the one that was started again");
  await photo(page, "live-again");
  await page.context().close();
  await end();

  const record = (garment) => {
    const path = join(folder, `${garment}.rrd`);
    const made = spawnSync(program, ["--garment", garment, "--refine", "0", "--save", path]);
    assert.equal(made.status, 0, String(made.stderr));
    return path;
  };
  const [first, second] = ["flared-skirt@900", "pullover-1"].map(record);
  const served = await serve("view", first);
  const viewed = await open(served);
  const before = await viewed.evaluate(() => document.documentElement.dataset.run);
  await photo(viewed, "view");
  await end();
  await viewed.waitForFunction(() => !document.getElementById("lost").hidden, null, { timeout: PATIENCE });
  said("the recording's page says that its program is gone");
  await photo(viewed, "view-gone");
  assert.equal(await serve("view", second, "--web-port", String(new URL(served).port)), served);
  await viewed.waitForFunction((run) => document.documentElement.dataset.run !== run, before, { timeout: PATIENCE });
  await shown(viewed);
  assert.ok(await viewed.evaluate(() => document.getElementById("lost").hidden));
  said("and shows the recording that is served there now");
  await photo(viewed, "view-again");
} finally {
  await browser.close();
  running?.kill("SIGINT");
}
