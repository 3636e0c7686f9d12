"use strict";
/* The past of a run: any instant of it, step by step and event by event, forward and back. */

const BEYOND = 9e15; // ns, later than any run

class Rewind {
  constructor(model) {
    this.model = model;
    this.isAway = false; // from the present of a run
    this.event = -1;
  }

  layOut(section) {
    this.slider = element("input", { type: "range", min: 0, max: 1, step: "any", value: 1, "aria-label": "instant of the run", oninput: () => this.slide() });
    this.at = element("output", { class: "at" }, "");
    const button = (words, title, does) => element("button", { type: "button", title, "aria-label": title, onclick: does }, words);
    this.now = this.model.is_live ? element("button", { type: "button", class: "now", onclick: () => this.toNow() }, "Now") : null;
    this.seen = element("div", { class: "instant-seen" });
    section.append(element("h2", {}, this.model.is_live ? "Rewind" : "The recording"),
      element("p", { class: "acts" },
        button("|◀", "step back", () => this.step("previous")), button("◀", "event back", () => this.stepEvent(-1)),
        button("▶", "event forward", () => this.stepEvent(1)), button("▶|", "step forward", () => this.step("next")),
        this.now, this.at),
      this.slider, this.seen);
    if (!this.model.is_live) this.goTo(BEYOND); // its end
  }

  /** The slider's ends are those of what was recorded. */
  slide() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.goTo(Number(this.slider.value)), 40);
  }

  /** Go to an instant, ns; of several asked for, to the last one. */
  async goTo(at) {
    const asked = this.asked = (this.asked ?? 0) + 1;
    this.isAway = true;
    try {
      const snapshot = this.instant === undefined || this.model.is_live && !this.instant ? "&snapshot=1" : "";
      const instant = await ask(`instant?at=${Math.max(0, Math.round(at))}${snapshot}`);
      if (asked === this.asked) this.take(instant);
    } catch (error) { say(`rewind: ${error.message}`); }
  }

  take(instant) {
    this.instant = instant;
    this.event = instant.events.length - 1;
    this.slider.min = instant.begin_ns;
    this.slider.max = instant.end_ns;
    this.slider.value = instant.at;
    this.now?.classList.add("away");
    this.draw();
  }

  step(where) {
    if (!this.instant) return this.goTo(store.at * 1e9);
    if (this.instant[where] !== null) this.goTo(this.instant[where]);
  }

  stepEvent(by) {
    if (!this.instant) return this.goTo(store.at * 1e9);
    const event = this.event + by;
    if (event < 0) return this.step("previous");
    if (event >= this.instant.events.length) return this.step("next");
    this.event = event;
    this.draw();
  }

  toNow() {
    this.asked = (this.asked ?? 0) + 1; // what is still asked for comes too late
    this.isAway = false;
    this.instant = null;
    this.seen.replaceChildren();
    this.at.textContent = "";
    this.now.classList.remove("away");
    plots.togglePause(false);
  }

  draw() {
    const { instant } = this, at = instant.at / 1e9;
    this.at.textContent = `${at.toFixed(6)} s${instant.lateness_us ? `, ${durationText(instant.lateness_us * 1e3)} late` : ""}`;
    show(instant.values, instant.states, at);
    plots.ends = [at - plots.window / 2, at + plots.window / 2];
    plots.fetchPast().then(() => plots.draw(at));
    const events = instant.events.map((each, place) => element("li", { class: place === this.event ? "here" : place > this.event ? "later" : "" },
      element("button", { class: "instant", type: "button", onclick: () => { this.event = place; this.draw(); } }, `${each.model} ${each.function}`),
      each.sent.map(([port, value]) => element("div", { class: "sent" }, `${port} ! ${shortText(value)}`))));
    const here = instant.events[this.event];
    const parts = [
      instant.note ? { kind: "text", text: instant.note, look: "warning" } : null,
      instant.entered?.length ? { kind: "table", title: "Entered", head: ["port", "value"], rows: instant.entered.map(([port, value]) => [port, shortText(value)]) } : null,
      instant.marks.length ? { kind: "bullets", items: instant.marks.map((each) => each.what) } : null,
      here?.raised ? { kind: "text", text: `${here.model} ${here.function} raised ${here.raised}`, look: "warning" } : null,
      here ? { kind: "table", title: `${here.model} after ${here.function}`, head: ["attribute", "value", ""], rows: Object.entries(here.state).map(([name, value]) => [name, shortText(value), here.changed.includes(name) ? "changed" : ""]), is_words: true } : null,
      instant.transfers.length ? { kind: "table", title: "On the lines", head: ["at", "line", "device", "written", "read", "error"], rows: instant.transfers.map((each) => [durationText(each.at - instant.at), each.line, each.device ?? String(each.address), each.written ?? "", each.read ?? "", each.error ?? ""]), is_words: true } : null,
    ].filter(Boolean);
    this.seen.replaceChildren(element("ol", { class: "events", "aria-label": "events of this instant" }, events), element("div", {}, parts.map((each) => render(each))));
  }
}
