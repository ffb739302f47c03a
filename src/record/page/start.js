// Starts the Rerun viewer on the recording that this program serves.

import { fail, run, show } from "./program.js";

const failed = (error) => fail(error?.message ?? String(error), "Reload the page to try again.");
const query = new URLSearchParams(location.search);
const asked = query.getAll("url");
run(
  {
    url: asked.length > 0 ? asked : [document.documentElement.dataset.recording],
    persist: true,
    theme: query.get("theme"),
  },
  failed,
).then(show, failed);
