// Starts the Rerun viewer on the recording that this program serves.

import { fail, run, show } from "./program.js";

const failed = (error) => fail(error?.message ?? String(error), "Reload the page to try again.");
const here = document.documentElement.dataset;
const theme = new URLSearchParams(location.search).get("theme");
const recording = `rerun+${location.protocol}//${location.host}/proxy`;
run({ url: [recording], persist: true, theme }, failed).then(show, failed);

// Polls the program. After a restart it has another recording, and may be of another version: the page is then reloaded.
const lost = document.getElementById("lost");
lost.textContent = `The program behind this page has ended. Run it again with --web-port ${location.port}, and this page shows it.`;
for (let wait = 1000; ; ) {
  await new Promise((done) => setTimeout(done, wait));
  try {
    const answer = await fetch("run", { cache: "no-store", signal: AbortSignal.timeout(5000) });
    if (!answer.ok) throw new Error("something else answers");
    if ((await answer.text()) !== here.run) location.reload();
    lost.hidden = true;
    wait = 1000;
  } catch {
    lost.hidden = false;
    wait = Math.min(1.5 * wait, 5000);
  }
}
