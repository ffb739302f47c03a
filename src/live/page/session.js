// The session: its newest state by server-sent events, and edits by PATCH, one at a time.

const given = new URLSearchParams(location.search).get("token");
if (given !== null) {
  // Removed from the address, which users copy and show; kept for a reload of this tab.
  sessionStorage.setItem("token", given);
  history.replaceState(null, "", location.pathname);
}
const token = sessionStorage.getItem("token");

export function ask(path, options = {}) {
  const headers = { ...options.headers };
  if (token !== null) headers.Authorization = `Bearer ${token}`;
  return fetch(path, { ...options, headers });
}

export class Session extends EventTarget {
  state = null;
  #waiting = null;
  #busy = false;
  // Called with each new state.
  #look = () => {};

  // Dispatches each state for as long as the page is open.
  async follow() {
    for (let wait = 250; ; wait = Math.min(2 * wait, 5000)) {
      try {
        const first = await ask("api/state");
        if (!first.ok) throw new Error((await first.json()).error);
        const now = await first.json();
        // After a restart of the program its states count from 1, and its version may differ.
        if (this.state && this.state.run !== now.run) return location.reload();
        this.#take(now);
        this.dispatchEvent(new Event("connected"));
        wait = 250;
        await this.#events();
      } catch (error) {
        this.#tell("lost", error.message);
      }
      await new Promise((done) => setTimeout(done, wait));
    }
  }

  async #events() {
    const response = await ask("api/events");
    if (!response.ok) throw new Error((await response.json()).error);
    const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
    let text = "";
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      text += value;
      const events = text.split("\n\n");
      text = events.pop();
      // Only the newest counts.
      const newest = events.filter((e) => e.startsWith("event: state")).pop();
      if (newest) this.#take(JSON.parse(newest.slice(newest.indexOf("data: ") + 6)));
    }
  }

  #take(state) {
    if (this.state && this.state.serial > state.serial && this.state.state >= state.state) return;
    const trail = state.trail ?? this.#longer(state.trail_end);
    const histogram = state.histogram ?? this.state?.histogram;
    const may_steer = state.may_steer ?? this.state?.may_steer;
    const run = state.run ?? this.state?.run;
    this.state = { ...state, trail, histogram, may_steer, run };
    this.#look();
    this.dispatchEvent(new Event("state"));
  }

  // Until both stages of the newest state are here, or a quarter of a second.
  #stages() {
    return new Promise((done) => {
      const late = setTimeout(done, 250);
      this.#look = () => {
        if (this.state.preview?.state !== this.state.state) return;
        clearTimeout(late);
        done();
      };
      this.#look();
    });
  }

  #longer(end) {
    const trail = (this.state?.trail ?? []).filter((point) => point.state !== end?.state);
    if (end) trail.push(end);
    return trail.slice(-300);
  }

  // Sends an edit, merged with one that still waits, so that a drag does not queue up. `field` is the input that the edit comes from.
  edit(change, { gesture, field } = {}) {
    this.#waiting = { change: { ...this.#waiting?.change, ...change }, gesture, field };
    if (!this.#busy) this.#send();
  }

  async #send() {
    this.#busy = true;
    while (this.#waiting) {
      const { change, gesture, field } = this.#waiting;
      this.#waiting = null;
      const path = gesture === undefined ? "api/state" : `api/state?gesture=${gesture}`;
      await this.send(path, "PATCH", JSON.stringify(change), "application/json", field);
      // The next edit of a drag would break off stage two of this one, and the drape would stand still until the pointer does.
      if (gesture !== undefined) await this.#stages();
    }
    this.#busy = false;
  }

  // Sends a change; the answer is the new state or an error.
  async send(path, method, body, kind, field) {
    if (this.state?.may_steer === false) {
      this.#tell("refused", { sentence: "This address is read-only; the one with the token for control can edit.", field });
      return;
    }
    try {
      const response = await ask(path, { method, body, headers: kind ? { "Content-Type": kind } : {} });
      const answer = await response.json();
      if (response.ok) {
        this.#take(answer);
        this.#tell("accepted", field);
      } else {
        this.#tell("refused", { sentence: answer.error, field });
      }
    } catch (error) {
      this.#tell("lost", error.message);
    }
  }

  #tell(what, detail) {
    this.dispatchEvent(new CustomEvent(what, { detail }));
  }
}
