// With the network cut off, the pages of `partwise live` and `partwise view` show no error and ask for nothing: they and the browser run
// in a network of their own that has the loopback and nothing else (Linux: `unshare`, `ip`).
//
//     node tests/browser/offline.mjs target/release/partwise [FOLDER for pictures]
//
// As live.mjs otherwise.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import { mkdirSync, mkdtempSync, writeFileSync } from "node:fs";
import { networkInterfaces, tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { near } from "./looks.mjs";

if (!process.env.PARTWISE_OFFLINE) {
  const alone = ["-rn", "sh", "-c", 'ip link set lo up && exec "$0" "$@"', process.execPath, ...process.argv.slice(1)];
  process.exit(spawnSync("unshare", alone, { stdio: "inherit", env: { ...process.env, PARTWISE_OFFLINE: "1" } }).status ?? 1);
}
assert.ok(Object.keys(networkInterfaces()).every((name) => name === "lo"), "this network is not cut off");

const require = createRequire(resolve(process.env.NODE_PATH ?? "target/browser/node_modules", "x"));
const { chromium } = require("playwright-core");
const [program = "target/release/partwise", pictures] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), "partwise-"));
const recording = join(folder, "skirt.rrd");
const faults = [];

const drawn = spawnSync(program, ["--garment", "flared-skirt@900", "--save", recording], { encoding: "utf8" });
assert.equal(drawn.status, 0, drawn.stderr);
const servers = [];
async function serve(...line) {
  const server = spawn(program, line, { stdio: ["ignore", "pipe", "pipe"] });
  servers.push(server);
  let said = "";
  server.stderr.on("data", (text) => (said += text));
  return new Promise((found, lost) => {
    server.stdout.on("data", (text) => found(String(text).trim()));
    server.on("exit", (code) => lost(new Error(`the program ended with ${code}: ${said}`)));
  });
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run",
    "--disable-background-networking", "--disable-gpu-sandbox"],
});
// The viewer's own remarks on a browser without a graphics card and on wishes a page cannot fulfil are no faults of the page.
const known = /egui_wgpu|Software rasterizer|Unhandled egui viewport command|performance warning: READ-usage|No available adapters/;

async function look(name, address, viewport, colorScheme) {
  const page = await (await browser.newContext({ viewport, colorScheme })).newPage();
  const asked = new Set();
  const ask = (url) => {
    asked.add(new URL(url).origin);
    // A recording's data comes from another port of this machine.
    if (!near(url, address) && !/^(http|ws):\/\/127\.0\.0\.1:/.test(url)) faults.push(`${name} asks for ${url}`);
  };
  page.on("request", (request) => ask(request.url()));
  page.on("websocket", (socket) => ask(socket.url()));
  page.on("requestfailed", (request) => faults.push(`${name}: ${request.url()}: ${request.failure()?.errorText}`));
  page.on("pageerror", (error) => faults.push(`${name}: page: ${error}`));
  page.on("console", (message) => {
    const fault = message.type() === "error" || (message.type() === "warning" && !known.test(message.text()));
    if (fault) faults.push(`${name}: console: ${message.text()}`);
  });
  const url = new URL(address);
  url.searchParams.set("renderer", "webgl");
  await page.goto(url.href, { timeout: 180000 });
  await page.waitForFunction(() => document.getElementById("message").hidden, null, { timeout: 180000 });
  // Whoever asks late, or tries again, does so by then.
  await page.waitForTimeout(15000);
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    writeFileSync(join(pictures, `offline-${name}.png`), await page.screenshot());
  }
  console.log(`${name}: asked ${[...asked].join(", ")}`);
  await page.context().close();
}

try {
  const [wide, small] = [{ width: 1920, height: 1080 }, { width: 1280, height: 800 }];
  await look("live", await serve("live", "--port", "0", "--garment", "flared-skirt@900"), small, "light");
  const view = await serve("view", "--web-port", "0", recording);
  await look("view", view, small, "dark");
  await look("view-wide", view, wide, "light");
  assert.deepEqual(faults, []);
} finally {
  await browser.close();
  servers.forEach((server) => server.kill("SIGINT"));
}
