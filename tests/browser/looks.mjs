// What a page looks like to a script: pictures and their colours, and when they change.

import { inflateSync } from "node:zlib";

// Whether an address is the program's own.
export const near = (url, address) => url.startsWith(new URL(address).origin) || /^(blob|data):/.test(url);

export const median = (values) => (values.length ? Math.round([...values].sort((a, b) => a - b)[Math.floor(values.length / 2)]) : "no");

// A picture of the views, PNG.
export async function picture(page) {
  const box = await page.locator("#scene").boundingBox();
  return page.screenshot({ clip: box });
}

// How many pixels of a PNG have which colour (8 bits a channel, not interlaced, as a browser writes it) between two shares of its width, from a share
// of its height on.
export function looks(png, from, to, top = 0) {
  const [width, height] = [png.readUInt32BE(16), png.readUInt32BE(20)];
  const bytes = { 2: 3, 6: 4 }[png[25]];
  if (png[24] !== 8 || !bytes || png[28] !== 0) throw new Error("not the PNG that a browser writes");
  const packed = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at)) {
    if (png.toString("latin1", at + 4, at + 8) === "IDAT") packed.push(png.subarray(at + 8, at + 8 + png.readUInt32BE(at)));
  }
  const rows = inflateSync(Buffer.concat(packed));
  const wide = width * bytes;
  let above = new Uint8Array(wide);
  const colours = new Map();
  for (let y = 0; y < height; y += 1) {
    const kind = rows[y * (wide + 1)];
    const row = Uint8Array.from(rows.subarray(y * (wide + 1) + 1, (y + 1) * (wide + 1)));
    for (let i = 0; i < wide; i += 1) {
      const [left, up, corner] = [i < bytes ? 0 : row[i - bytes], above[i], i < bytes ? 0 : above[i - bytes]];
      const [a, b, c] = [Math.abs(up - corner), Math.abs(left - corner), Math.abs(left + up - 2 * corner)];
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      row[i] += [0, left, up, (left + up) >> 1, paeth][kind];
    }
    for (let x = Math.floor(from * width); y >= top * height && x < Math.floor(to * width); x += 1) {
      const colour = (row[x * bytes] << 16) | (row[x * bytes + 1] << 8) | row[x * bytes + 2];
      colours.set(colour, (colours.get(colour) ?? 0) + 1);
    }
    above = row;
  }
  return colours;
}

// Runs in the page: `watchNext()` starts a clock at the next move of the pointer, and `nextSeen` tells when that was and when, ms later,
// the answer to the first edit after it had come and a piece was handed to the viewer (null: not within some seconds).
export function watchPieces() {
  window.watchNext = () => {
    window.nextSeen = new Promise((done) => {
      let moved = 0;
      const finish = (piece) => {
        const edits = performance.getEntriesByType("resource");
        const edit = edits.find((entry) => entry.name.includes("gesture") && entry.startTime >= moved);
        done({ began: performance.timeOrigin + moved, answer: edit ? edit.responseEnd - moved : null, piece });
      };
      addEventListener("pointermove", (event) => (moved = event.timeStamp), { once: true, capture: true });
      addEventListener("piece", function piece() {
        if (!moved) return;
        removeEventListener("piece", piece);
        finish(performance.now() - moved);
      });
      setTimeout(() => finish(null), 10000);
    });
    performance.clearResourceTimings();
  };
}

// Every picture that the browser shows: when its frame began and when it had come here, drawn and packed, ms since 1970. The list is to
// be emptied by who reads it.
export async function shownFrames(page) {
  const frames = [];
  const cdp = await page.context().newCDPSession(page);
  cdp.on("Page.screencastFrame", ({ data, metadata, sessionId }) => {
    frames.push({ png: Buffer.from(data, "base64"), at: 1000 * metadata.timestamp, came: Date.now() });
    cdp.send("Page.screencastFrameAck", { sessionId }).catch(() => {});
  });
  await cdp.send("Page.startScreencast", { format: "png", everyNthFrame: 1 });
  return frames;
}

// What the first view shows in a picture of the page at 1280 by 800.
export const firstView = (png) => JSON.stringify([...looks(png, 0, 0.22, 0.1)].sort((a, b) => a[0] - b[0]));
