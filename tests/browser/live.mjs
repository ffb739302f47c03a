// `partwise live` in a real browser: loads the page, drags a bound, types, undoes, pins; looks that nothing else is asked and no
// error is told; takes pictures.
//
//     npm install --prefix target/browser playwright-core
//     node tests/browser/live.mjs target/release/partwise [FOLDER for pictures]
//
// CHROMIUM names the browser (default /usr/bin/chromium). It draws without a graphics card, so times are those of a slow machine.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createHash } from "node:crypto";
import { createRequire } from "node:module";
import { mkdirSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";

const require = createRequire(resolve(process.env.NODE_PATH ?? "target/browser/node_modules", "x"));
const { chromium } = require("playwright-core");
const [program = "target/release/partwise", pictures] = process.argv.slice(2);
const DRAGS = Number(process.env.DRAGS ?? 10);
const garment = process.env.GARMENT ?? "low-cut-dress";

const server = spawn(program, ["live", "--garment", garment, "--port", "0"], { stdio: ["ignore", "pipe", "inherit"] });
const address = await new Promise((found, lost) => {
  server.stdout.on("data", (text) => found(String(text).trim()));
  server.on("exit", (code) => lost(new Error(`the program ended with ${code}`)));
});
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run",
    "--disable-background-networking", "--disable-gpu-sandbox"],
});
const faults = [];
const begun = Date.now();
const said = (text) => console.log(`${((Date.now() - begun) / 1000).toFixed(1).padStart(6)} s  ${text}`);

async function open(size, theme, more = {}) {
  const context = await browser.newContext({ viewport: size, colorScheme: theme, ...more });
  const page = await context.newPage();
  page.on("console", (message) => message.type() === "error" && faults.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => faults.push(`page: ${error}`));
  page.on("request", (request) => {
    const near = request.url().startsWith(address) || /^(blob|data):/.test(request.url());
    if (!near) faults.push(`asked for ${request.url()}`);
  });
  await page.goto(`${address}?renderer=webgl`);
  await page.waitForFunction(() => document.getElementById("message").hidden, null, { timeout: 120000 });
  return page;
}

const state = async (page) => page.evaluate(async () => (await fetch("api/state")).json());
async function until(page, true_of) {
  for (const start = Date.now(); ; ) {
    if (true_of(await state(page))) return;
    assert.ok(Date.now() - start < 180000, `never came: ${true_of}`);
    await page.waitForTimeout(200);
  }
}
const idle = (page) => until(page, (now) => now.idle);
const number = (page, name) => page.locator(`#numbers dd[data-name="${name}"]`).textContent();
const picture = async (page) => {
  const box = await page.locator("#scene").boundingBox();
  return createHash("sha1").update(await page.screenshot({ clip: box })).digest("hex");
};

// The middle of a bound's grip.
async function grip(page, index) {
  const box = await page.locator(`[data-bound="${index}"] .grip`).boundingBox();
  return [box.x + box.width / 2, box.y + box.height / 2];
}

try {
  const page = await open({ width: 1280, height: 800 }, "light");
  await idle(page);
  await page.waitForTimeout(1500);
  said("the page shows the garment");
  const before = await state(page);
  assert.equal(await number(page, "PARTs"), String(before.parts.count));
  const blank = await page.evaluate(() => getComputedStyle(document.getElementById("viewer")).visibility);
  assert.equal(blank, "visible");
  const seen = await picture(page);

  const bounds = await page.locator("[data-bound]").count();
  const dragged = bounds - 4;
  const [x, y] = await grip(page, dragged);
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= 12; i += 1) await page.mouse.move(x + 1.5 * i, y, { steps: 2 });
  await page.mouse.up();
  await idle(page);
  await page.waitForTimeout(800);
  const after = await state(page);
  assert.ok(after.state > before.state, "a drag makes states");
  assert.notDeepEqual(after.job.table.levels, before.job.table.levels);
  assert.equal(after.undo, 1, "a drag is one step");
  assert.equal(await number(page, "PARTs"), String(after.parts.count));
  assert.notEqual(await picture(page), seen, "the picture follows");
  said(`dragged: state ${before.state} to ${after.state}, ${before.parts.count} to ${after.parts.count} PARTs`);

  await page.locator(`[data-bound="${dragged}"]`).focus();
  for (let i = 0; i < 3; i += 1) await page.keyboard.press("ArrowLeft");
  await idle(page);
  const keyed = await state(page);
  assert.notDeepEqual(keyed.job.table.levels, after.job.table.levels);
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute("role")), "slider", "the focus stays");
  said("moved by keys");

  await page.locator("#levels-box summary").click();
  await page.locator('input[aria-label="Level 2, from, cm"]').fill("0.5");
  await page.keyboard.press("Tab");
  await page.waitForSelector("#alert:not([hidden])");
  said(`a bound that overlaps is refused: ${(await page.locator("#alert").textContent()).slice(0, 90)}`);
  await page.locator("#levels-box summary").click();

  await page.locator("#m-waist").fill("76");
  await page.keyboard.press("Enter");
  await page.keyboard.press("Tab");
  await until(page, (now) => now.job.measurements.waist === 76);
  await idle(page);
  assert.equal((await state(page)).garment.generation, 2);
  said("typed a measurement: another form, the garment fitted to it");
  await page.locator("#undo").click();
  await until(page, (now) => now.job.measurements.waist === 72);
  await idle(page);
  said("taken back");

  await page.locator("#pin").click();
  await page.waitForSelector("#pins tbody tr");
  const pinned = await page.locator("#pins tbody tr").textContent();
  await page.locator("#fabric").selectOption("ponte");
  await until(page, (now) => now.job.fabric === "ponte");
  await idle(page);
  await page.waitForTimeout(800);
  assert.equal(await page.locator("#pins tbody tr").textContent(), pinned, "what is pinned stays");
  said(`pinned: ${pinned}`);

  // A PART is picked where the garment is in the middle of the first view.
  const scene = await page.locator("#scene").boundingBox();
  for (const [across, down] of [[0.1, 0.45], [0.12, 0.5], [0.13, 0.4], [0.125, 0.6]]) {
    // A slow machine draws the pointer's way before it hears of the click.
    await page.mouse.move(scene.x + across * scene.width, scene.y + down * scene.height);
    await page.waitForTimeout(600);
    await page.mouse.down();
    await page.waitForTimeout(200);
    await page.mouse.up();
    await page.waitForTimeout(1500);
    if (await page.locator('#part dd[data-name="level"]').count()) break;
  }
  const part = await page.locator("#part").textContent();
  assert.match(part, /level/, "a click tells of a PART");
  said(`picked: ${part.replace(/\s+/g, " ")}`);

  // What stands in the canvas is the viewer's own.
  const unnamed = await page.evaluate(() =>
    [...document.querySelectorAll(":is(header, aside) :is(button, input, select, a, [role=slider])")]
      .filter((e) => !(e.textContent.trim() || e.getAttribute("aria-label") || e.labels?.length))
      .map((e) => e.outerHTML.slice(0, 80)),
  );
  assert.deepEqual(unnamed, [], "every control has a name");

  // From an input to a changed picture: of the numbers, and of the viewer, whose screenshot costs as much as it says itself.
  const idlePicture = Date.now();
  for (let i = 0; i < 5; i += 1) await picture(page);
  const screenshot = (Date.now() - idlePicture) / 5;
  const [toPiece, toPixels] = [[], []];
  for (let i = 0; i < DRAGS; i += 1) {
    await idle(page);
    await page.waitForTimeout(300);
    const still = await picture(page);
    const [gx, gy] = await grip(page, dragged);
    await page.mouse.move(gx, gy);
    await page.mouse.down();
    await page.evaluate(() => {
      window.pieceAt = new Promise((done) => {
        let moved = 0;
        addEventListener("pointermove", () => (moved ||= performance.now()), { once: true, capture: true });
        const heard = () => {
          if (!moved) return;
          removeEventListener("piece", heard);
          done(performance.now() - moved);
        };
        addEventListener("piece", heard);
        setTimeout(() => done(null), 10000);
      });
    });
    const start = Date.now();
    await page.mouse.move(gx + (i % 2 ? -6 : 6), gy);
    let changed = false;
    while (!changed && Date.now() - start < 10000) changed = (await picture(page)) !== still;
    if (changed) toPixels.push(Date.now() - start);
    const piece = await page.evaluate(() => window.pieceAt);
    if (piece !== null) toPiece.push(piece);
    await page.mouse.up();
  }
  assert.ok(toPiece.length > 0 && toPixels.length > 0, "drags reach the viewer");
  const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];
  said(
    `${toPixels.length} of ${DRAGS} drags: input to the first piece at the viewer ${median(toPiece).toFixed(0)} ms, to changed pixels ` +
      `${median(toPixels).toFixed(0)} ms (medians; a screenshot alone takes ${screenshot.toFixed(0)} ms)`,
  );
  await page.context().close();

  const touch = await open({ width: 1024, height: 768 }, "dark", { hasTouch: true, isMobile: true });
  await idle(touch);
  const atFirst = await state(touch);
  await touch.locator(`[data-bound="${dragged}"]`).scrollIntoViewIfNeeded();
  const [tx, ty] = await grip(touch, dragged);
  const cdp = await touch.context().newCDPSession(touch);
  await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [{ x: tx, y: ty }] });
  for (let i = 1; i <= 8; i += 1) {
    await cdp.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: [{ x: tx - 2 * i, y: ty }] });
  }
  await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await idle(touch);
  assert.ok((await state(touch)).state > atFirst.state, "a finger drags too");
  said("dragged by touch on a tablet");
  await touch.context().close();

  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    for (const [width, height] of [[1280, 800], [1920, 1080]]) {
      for (const theme of ["light", "dark"]) {
        const shown = await open({ width, height }, theme);
        await idle(shown);
        await shown.waitForTimeout(2500);
        writeFileSync(join(pictures, `live-${width}-${theme}.png`), await shown.screenshot());
        await shown.context().close();
      }
    }
    said(`pictures in ${pictures}`);
  }
  assert.deepEqual(faults, [], "no error is told and nothing else is asked");
  said("all as it should be");
} finally {
  await browser.close();
  server.kill("SIGINT");
}
