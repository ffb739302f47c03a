// `partwise live` in a real browser: loads the page, drags a bound, types, undoes, pins, saves and loads; looks that nothing else is
// asked and no error is told; takes pictures.
//
//     npm install --prefix target/browser playwright-core
//     node tests/browser/live.mjs target/release/partwise [FOLDER for pictures]
//
// CHROMIUM names the browser (default /usr/bin/chromium). It draws without a graphics card, so times are those of a slow machine.
// DRAGS: how many are timed (default 10).

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createRequire } from "node:module";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { firstView, looks, median, near, picture, shownFrames, watchPieces } from "./looks.mjs";

const require = createRequire(resolve(process.env.NODE_PATH ?? "target/browser/node_modules", "x"));
const { chromium } = require("playwright-core");
const [program = "target/release/partwise", pictures] = process.argv.slice(2);
const DRAGS = Number(process.env.DRAGS ?? 10);
const garment = process.env.GARMENT ?? "low-cut-dress";
const TOKEN = "for-the-test-alone-0123456789";

const servers = [];
// The program's address, and what it says besides until then.
async function serve(...more) {
  const server = spawn(program, ["live", "--port", "0", ...more], { stdio: ["ignore", "pipe", "pipe"] });
  servers.push(server);
  let said = "";
  server.stderr.on("data", (text) => (said += text));
  const address = await new Promise((found, lost) => {
    server.stdout.on("data", (text) => found(String(text).trim()));
    server.on("exit", (code) => lost(new Error(`the program ended with ${code}: ${said}`)));
  });
  return { address, said: () => said };
}

// The first group of what it says, once it has.
async function until_said(server, words) {
  for (const start = Date.now(); Date.now() - start < 10000; ) {
    const found = words.exec(server.said());
    if (found) return found[1];
    await new Promise((done) => setTimeout(done, 50));
  }
  throw new Error(`never said ${words}: ${server.said()}`);
}

const { address } = await serve("--garment", garment);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-first-run",
    "--disable-background-networking", "--disable-gpu-sandbox"],
});
const faults = [];
const begun = Date.now();
const said = (text) => console.log(`${((Date.now() - begun) / 1000).toFixed(1).padStart(6)} s  ${text}`);

async function open(size, theme, { at = address, ...more } = {}) {
  const context = await browser.newContext({ viewport: size, colorScheme: theme, ...more });
  const page = await context.newPage();
  // The viewer's own remarks on a browser without a graphics card and on wishes a page cannot fulfil are no faults of the page.
  const known = /egui_wgpu|Software rasterizer|Unhandled egui viewport command|performance warning: READ-usage|No available adapters/;
  page.on("console", (message) => {
    const fault = message.type() === "error" || (message.type() === "warning" && !known.test(message.text()));
    if (fault) faults.push(`console: ${message.text()}`);
  });
  page.on("pageerror", (error) => faults.push(`page: ${error}`));
  page.on("request", (request) => near(request.url(), at) || faults.push(`asked for ${request.url()}`));
  const url = new URL(at);
  url.searchParams.set("renderer", "webgl");
  await page.goto(url.href);
  await page.waitForFunction(() => document.getElementById("message").hidden, null, { timeout: 120000 });
  return page;
}

// Tokens stay in the page: what a script asks for goes through the page's own module.
const state = (page) => page.evaluate(async () => (await (await import("./session.js")).ask("api/state")).json());
async function until(page, true_of) {
  for (const start = Date.now(); ; ) {
    if (true_of(await state(page))) return;
    assert.ok(Date.now() - start < 180000, `never came: ${true_of}`);
    await page.waitForTimeout(200);
  }
}
const idle = (page) => until(page, (now) => now.idle);
const number = (page, name) => page.locator(`#numbers dd[data-name="${name}"]`).textContent();

// Some pictures later.
const drawn = (page, pictures) =>
  page.evaluate(async (n) => {
    for (let i = 0; i < n; i += 1) await new Promise((done) => requestAnimationFrame(done));
  }, pictures);

// The middle of a bound's grip.
async function grip(page, index) {
  const box = await page.locator(`[data-bound="${index}"] .grip`).boundingBox();
  return [box.x + box.width / 2, box.y + box.height / 2];
}

// What a link saves.
async function saved(page, id) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator(`#${id}`).click()]);
  return readFileSync(await download.path(), "utf8");
}

try {
  const page = await open({ width: 1280, height: 800 }, "light");
  await idle(page);
  await page.waitForTimeout(1500);
  said("the page shows the garment");
  const before = await state(page);
  assert.equal(await number(page, "PARTs"), String(before.parts.count));
  assert.equal(await page.evaluate(() => getComputedStyle(document.getElementById("viewer")).visibility), "visible");
  const seen = await picture(page);
  for (const [view, name] of ["PARTs and forces", "two stages", "at rest"].entries()) {
    const colours = looks(seen, view / 3, (view + 1) / 3);
    assert.ok(colours.size > 40, `${name}: ${colours.size} colours`);
  }

  // The colour that most of the views' pixels have, of 0 (black) to 1.
  const lightness = async () => {
    const colours = [...looks(await picture(page), 0, 1, 0.2)].sort((a, b) => b[1] - a[1]);
    return (colours[0][0] & 0xff) / 0xff;
  };
  assert.ok((await lightness()) > 0.8, "the views have the page's light theme");
  for (const [dark, presses] of [[true, 2], [false, 2]]) {
    for (let i = 0; i < presses; i += 1) await page.locator("#theme").click();
    await page.waitForTimeout(1500);
    assert.equal((await lightness()) < 0.2, dark, `dark: ${dark}`);
  }
  said("the views change their theme with the page");

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
  assert.ok(!(await picture(page)).equals(seen), "the picture follows");
  said(`dragged: state ${before.state} to ${after.state}, ${before.parts.count} to ${after.parts.count} PARTs`);

  await page.locator(`[data-bound="${dragged}"]`).focus();
  for (let i = 0; i < 3; i += 1) await page.keyboard.press("ArrowLeft");
  await idle(page);
  const keyed = await state(page);
  assert.notDeepEqual(keyed.job.table.levels, after.job.table.levels);
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute("role")), "slider", "the focus stays");
  said("moved by keys");

  const levels = async () => (await state(page)).job.table.levels.length;
  const had = await levels();
  const dial = await page.locator("#dial").boundingBox();
  await page.mouse.dblclick(dial.x + 0.93 * dial.width, dial.y + 0.7 * dial.height);
  await until(page, (now) => now.job.table.levels.length === 20);
  assert.equal(await levels(), had + 1, "a double-click splits a level");
  await page.locator(`[data-bound="${bounds}"]`).focus();
  await page.keyboard.press("Delete");
  await until(page, (now) => now.job.table.levels.length === 19);
  await idle(page);
  said("split by a double-click, joined by a key");

  await page.locator("#levels-box summary").click();
  assert.deepEqual(faults, []);
  await page.locator('input[aria-label="Level 2, from, cm"]').fill("0.5");
  await page.keyboard.press("Tab");
  await page.waitForSelector("#level-1-0-error");
  const level = page.locator("#level-1-0");
  assert.equal(await level.getAttribute("aria-invalid"), "true");
  assert.equal(await level.inputValue(), "0.5", "what was typed stays, marked");
  said(`a bound that overlaps is refused at its field: ${(await page.locator("#level-1-0-error").textContent()).slice(0, 90)}`);
  // The browser itself writes down that a request was refused.
  await page.waitForTimeout(300);
  const refusals = faults.splice(0);
  assert.ok(refusals.length === 1 && refusals[0].includes("status of 400"), String(refusals));
  await level.focus();
  await page.keyboard.press("Escape");
  assert.notEqual(await level.inputValue(), "0.5", "Escape restores the bound");
  assert.equal(await page.locator("[aria-invalid]").count(), 0);
  await page.locator("#levels-box summary").click();
  await page.locator("#m-waist").fill("wide");
  await page.keyboard.press("Tab");
  assert.match(await page.locator("#m-waist-error").textContent(), /“wide”.*number of centimetres.*72/);
  assert.deepEqual(faults, [], "letters are no request");
  said("letters are refused as letters");

  // Each stop of a walk by Tab from the first control, and back out of the viewer.
  const focused = () => page.evaluate(() => document.activeElement.closest("aside, header, #views, #scene, .skip")?.tagName ?? "none");
  await page.locator("#theme").focus();
  const stops = [];
  for (let i = 0; i < 60 && stops.at(-1) !== "SECTION"; i += 1) {
    await page.keyboard.press("Tab");
    stops.push(await focused());
  }
  assert.ok(stops.length > 20 && stops.slice(0, -1).every((stop) => ["ASIDE", "DIV"].includes(stop)) && stops.at(-1) === "SECTION", String(stops));
  await page.keyboard.press("Tab");
  assert.notEqual(await focused(), "SECTION", "Tab leaves the viewer");
  await page.locator("#viewer").focus();
  await page.keyboard.press("Shift+Tab");
  assert.equal(await focused(), "DIV", "Shift+Tab leaves the viewer for the buttons above it");
  said("by keyboard alone: controls, then the viewer, and out of it");

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

  const table = await saved(page, "save-table");
  const [edited, parts] = [(await state(page)).job.table.levels, (await state(page)).parts.count];
  await page.locator("#preset").selectOption("table-3");
  await until(page, (now) => now.job.table.name === "Table 3" && now.idle);
  assert.notDeepEqual((await state(page)).job.table.levels, edited, "a preset replaces the table");
  await page.locator("#load").setInputFiles({ name: "table.toml", mimeType: "application/toml", buffer: Buffer.from(table) });
  await until(page, (now) => JSON.stringify(now.job.table.levels) === JSON.stringify(edited) && now.idle);
  assert.equal((await state(page)).parts.count, parts);
  assert.match(await saved(page, "save-job"), /\[settings/);
  assert.match(await saved(page, "save-obj"), /^v /m);
  said("a preset chosen; the table saved before loaded again");
  await page.locator("#preset").selectOption("low-cut-dress-levels-and-extents");
  await until(page, (now) => now.job.table.name === "low-cut-dress, levels and extents" && now.idle);
  // The page shows a state later than the interface tells it.
  await page.waitForFunction(() => document.querySelector("#level-1-2").value === "31.9");
  assert.equal(await page.locator("#preset").inputValue(), "low-cut-dress-levels-and-extents", "one name for one table");
  const fields = await page.locator("#levels input").evaluateAll((inputs) => inputs.map((input) => input.value));
  assert.deepEqual([fields[2], fields[17], fields.at(-2)], ["", "15.5 × 19.1", "∞"]);
  await page.locator("#undo").click();
  await until(page, (now) => JSON.stringify(now.job.table.levels) === JSON.stringify(edited) && now.idle);
  said("extents of levels: cut, and not cut");

  await page.locator("#pin").click();
  await page.waitForSelector("#pins tbody tr");
  const pinned = await page.locator("#pins tbody tr").textContent();
  await page.locator("#fabric").selectOption("ponte");
  await until(page, (now) => now.job.fabric === "ponte");
  await idle(page);
  await page.waitForTimeout(800);
  assert.equal(await page.locator("#pins tbody tr").textContent(), pinned, "what is pinned stays");
  assert.match(await saved(page, "save-sweep"), /^\[\[points\]\]$/m);
  assert.equal(await page.locator("#columns > div").count(), 3, "newest, pinned, at rest");
  assert.match(await page.locator("#columns").textContent(), /pinned: .*PARTs/);
  said(`pinned: ${pinned}`);

  // The sides: all three views change, and change back.
  const settled = async () => {
    await page.waitForTimeout(2500);
    return picture(page);
  };
  const front = await settled();
  const shots = { front };
  for (const side of ["side", "back"]) {
    await page.locator(`#eye-${side}`).click();
    shots[side] = await settled();
    assert.ok(!shots[side].equals(front), `${side} shows another side`);
  }
  assert.ok(!shots.side.equals(shots.back));
  said("turned to the side and the back by buttons");

  // One eye for all while Alt is held: a drag in the last view turns the first one too.
  await page.locator("#eye-front").click();
  const still = firstView(await settled());
  const box = await page.locator("#viewer").boundingBox();
  const [fromX, fromY] = [box.x + 0.9 * box.width, box.y + 0.5 * box.height];
  await page.keyboard.down("Alt");
  await page.mouse.move(fromX, fromY);
  await page.mouse.down();
  for (let i = 1; i <= 8; i += 1) await page.mouse.move(fromX - 12 * i, fromY - 4 * i);
  await page.mouse.up();
  await page.keyboard.up("Alt");
  const turned = await settled();
  assert.notEqual(firstView(turned), still, "a drag with Alt in one view turns the others");
  said("one eye for all views while Alt is held");
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    for (const [side, png] of Object.entries({ ...shots, turned })) writeFileSync(join(pictures, `live-${side}.png`), png);
  }
  await page.locator("#eye-front").click();

  // The fit colours the garment at rest, and cloth takes the colours off.
  const cloth = await settled();
  await page.locator("#fit").selectOption("strain");
  await page.waitForSelector("#fit-key:not([hidden])");
  assert.match(await page.locator("#fit-key").textContent(), /^\d+(\.\d+)? %$/);
  const strain = await settled();
  assert.ok(!strain.equals(cloth), "the fit is seen");
  if (pictures) writeFileSync(join(pictures, "live-strain.png"), await page.screenshot());
  await page.locator("#fit").selectOption("none");
  await settled();
  assert.equal(await page.locator("#fit-key").isVisible(), false);
  said("strain on the garment at rest, and off again");

  // A second table beside the first, which stays the edited one.
  const one = await state(page);
  await page.locator("#beside").selectOption("5 quantile levels");
  await until(page, (now) => now.pins.length === one.pins.length + 1 && now.idle);
  const two = await state(page);
  assert.deepEqual(two.job.table, one.job.table, "the first table is edited further");
  assert.equal(two.pins.at(-1).label, "5 quantile levels");
  // Newest, two pinned, at rest.
  await page.waitForFunction(() => document.querySelectorAll("#columns > div").length === 4, null, { timeout: 20000 });
  said("a second table beside the first");
  if (pictures) writeFileSync(join(pictures, "live-beside.png"), await page.screenshot());
  await page.locator("#pins tbody tr button").last().click();
  await until(page, (now) => now.pins.length === one.pins.length && now.idle);

  // A PART is picked where the garment is in the middle of the first view.
  const scene = await page.locator("#scene").boundingBox();
  for (const [across, down] of [[0.1, 0.45], [0.12, 0.5], [0.13, 0.4], [0.125, 0.6], [0.1, 0.55], [0.12, 0.55]]) {
    // The viewer looks for what is under the pointer while it draws, which takes a slow machine a second; a click is no click to it if
    // the button is held for longer than that.
    await page.mouse.move(scene.x + across * scene.width, scene.y + down * scene.height);
    await drawn(page, 6);
    await page.mouse.down();
    await page.mouse.up();
    const told = page.waitForSelector('#part dd[data-name="level"]', { timeout: 20000 });
    if (await told.then(() => true, () => false)) break;
  }
  const part = await page.locator("#part").textContent();
  assert.match(part, /level/, "a click tells of a PART");
  const card = await page.locator("#part-card").boundingBox();
  assert.ok(card.x >= scene.x && card.y + card.height <= 800, "the answer is in sight");
  assert.doesNotMatch(await page.evaluate(() => document.body.innerText), /\b0\.0\d* N\b/, "small forces are millinewtons");
  said(`picked: ${part.replace(/\s+/g, " ")}`);
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    await page.locator("#part").scrollIntoViewIfNeeded();
    writeFileSync(join(pictures, "live-picked.png"), await page.screenshot());
  }

  // What stands in the canvas is the viewer's own.
  const unnamed = await page.evaluate(() =>
    [...document.querySelectorAll(":is(header, aside) :is(button, input, select, a, [role=slider])")]
      .filter((e) => !(e.textContent.trim() || e.getAttribute("aria-label") || e.labels?.length))
      .map((e) => e.outerHTML.slice(0, 80)),
  );
  assert.deepEqual(unnamed, [], "every control has a name");
  await page.context().close();

  // From an input to changed pixels, as the browser shows them.
  const timed = await open({ width: 1280, height: 800 }, "light");
  await timed.evaluate(watchPieces);
  await idle(timed);
  await timed.waitForTimeout(3000);
  const frames = await shownFrames(timed);
  const [toAnswer, toPiece, toFrame, toPixels] = [[], [], [], []];
  for (let i = 0; i < DRAGS; i += 1) {
    const [gx, gy] = await grip(timed, dragged);
    await timed.mouse.move(gx, gy);
    await timed.mouse.down();
    await timed.waitForTimeout(500);
    for (const start = Date.now(); frames.length === 0 && Date.now() - start < 30000; ) await timed.waitForTimeout(100);
    const still = firstView(frames.at(-1).png);
    frames.length = 0;
    await timed.evaluate(() => window.watchNext());
    await timed.mouse.move(gx + (i % 2 ? -6 : 6), gy);
    const { began, answer, piece } = await timed.evaluate(() => window.nextSeen);
    await timed.mouse.up();
    await idle(timed);
    await timed.waitForTimeout(3000);
    const changed = frames.find(({ png, at }) => at > began && firstView(png) !== still);
    if (answer !== null) toAnswer.push(answer);
    if (piece !== null) toPiece.push(piece);
    if (changed) toFrame.push(changed.at - began);
    if (changed) toPixels.push(changed.came - began);
  }
  said(
    `${DRAGS} drags, medians: from the input to the answer ${median(toAnswer)} ms, to the piece handed to the viewer ` +
      `${median(toPiece)} ms, to the start of the frame that shows it ${median(toFrame)} ms, to its pixels ${median(toPixels)} ms ` +
      `(${toPixels.length} seen)`,
  );
  assert.ok(toPiece.length > 0.8 * DRAGS && toPixels.length > 0.8 * DRAGS, "drags reach the viewer");
  await timed.context().close();

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
  await until(touch, (now) => now.state > atFirst.state && now.idle);
  said("dragged by touch on a tablet");
  if (pictures) writeFileSync(join(pictures, "live-tablet.png"), await touch.screenshot());
  await touch.context().close();

  // Who looks on sees all and changes nothing.
  const shared = await serve("--garment", "flared-skirt@900", "--token", TOKEN);
  const link = await until_said(shared, /read-only access: (\S+)/);
  const looker = await open({ width: 1280, height: 800 }, "light", { at: link });
  await idle(looker);
  await looker.waitForTimeout(800);
  assert.ok(!looker.url().includes("token"), "the token leaves the address");
  assert.ok(await looker.locator("#undo").isDisabled() && (await looker.locator("#pin").isDisabled()));
  const unmoved = await state(looker);
  await looker.locator(`[data-bound="${dragged}"]`).focus();
  await looker.keyboard.press("ArrowLeft");
  await looker.locator("#fabric").selectOption("denim", { force: true }).catch(() => {});
  await looker.waitForTimeout(800);
  assert.deepEqual((await state(looker)).job, unmoved.job, "an onlooker changes nothing");
  assert.deepEqual(faults, [], "and is not let try");
  said("an onlooker's link shows and does not steer");
  await looker.context().close();

  if (pictures) {
    for (const [width, height] of [[1280, 800], [1920, 1080], [768, 1024]]) {
      for (const theme of ["light", "dark"]) {
        const shown = await open({ width, height }, theme);
        await idle(shown);
        await shown.waitForTimeout(4000);
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
  for (const server of servers) server.kill("SIGINT");
}
