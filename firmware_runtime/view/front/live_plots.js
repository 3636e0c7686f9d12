"use strict";
/* Plots that grow with the run: what has come of each leaf, and the plots that are chosen. */

const STATES_EVERY = 4; // frames: they change seldom
const KEPT = 120_000, WINDOWS = [5, 10, 30, 60, 300];

const BLOCK = 16;

/** One number over time, and the least and greatest of each block of points; NaN where there is none. */
class Line {
  constructor(times = [], values = []) {
    this.times = times;
    this.values = values.map((each) => each ?? NaN);
    this.low = [];
    this.high = [];
    this.summarize();
  }

  add(times, values) {
    for (let n = 0; n < times.length; n++) { this.times.push(times[n]); this.values.push(values[n] ?? NaN); }
    if (this.times.length > KEPT) {
      this.times.splice(0, KEPT / 4);
      this.values.splice(0, KEPT / 4);
      this.low.length = this.high.length = 0;
    }
    this.summarize();
  }

  /** Sum up the blocks that are full and have not been. */
  summarize() {
    while ((this.low.length + 1) * BLOCK <= this.times.length) {
      const first = this.low.length * BLOCK;
      let [low, high] = [Infinity, -Infinity];
      for (let n = first; n < first + BLOCK; n++) { const value = this.values[n]; if (value < low) low = value; if (value > high) high = value; }
      this.low.push(low);
      this.high.push(high);
    }
  }

  /** The least and greatest between two places; Infinity where there is no number. */
  ends(first, last) {
    let [low, high] = [Infinity, -Infinity], n = first;
    while (n < last) {
      if (n % BLOCK === 0 && n + BLOCK <= last && n / BLOCK < this.low.length) {
        const block = n / BLOCK;
        if (this.low[block] < low) low = this.low[block];
        if (this.high[block] > high) high = this.high[block];
        n += BLOCK;
      } else {
        const value = this.values[n++];
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    return [low, high];
  }
}

/** What has come: a line by leaf, states by model. */
class Store {
  constructor() {
    this.lines = new Map();
    this.stays = new Map();
    this.values = {};
    this.at = 0;
  }

  take(frame) {
    this.at = frame.at;
    this.values = frame.values;
    for (const [leaf, [times, values]] of Object.entries(frame.points ?? {})) {
      if (!this.lines.has(leaf)) this.lines.set(leaf, new Line());
      this.lines.get(leaf).add(times, values);
    }
    for (const [name, entries] of Object.entries(frame.stays ?? {})) {
      const all = this.stays.get(name) ?? this.stays.set(name, []).get(name);
      for (const entry of entries) if (!all.length || entry[0] > all[all.length - 1][0] || entry[1] !== all[all.length - 1][1]) all.push(entry);
      if (all.length > 5000) all.splice(0, 1000);
    }
  }

  /** Put what was fetched of the past in place of what is there. */
  replace(leaf, times, values) { this.lines.set(leaf, new Line(times, values)); }
}

/** The first place whose number is not below. */
function placeOf(numbers, at) {
  let [low, high] = [0, numbers.length];
  while (low < high) { const middle = (low + high) >> 1; if (numbers[middle] < at) low = middle + 1; else high = middle; }
  return low;
}

const orNull = (value) => (Number.isFinite(value) ? value : null);

/** Lines of one port between two instants, over one x; what `isHeld` is so until the end. */
function visible(lines, begin, end, pieces, isHeld) {
  const [xs, ...ys] = thinnedLines(lines, begin, end, pieces);
  if (isHeld && xs[xs.length - 1] < end) {
    xs.push(end);
    ys.forEach((each) => each.push(each[each.length - 1]));
  }
  return [xs, ...ys];
}

/** Of each of so many pieces both ends. */
function thinnedLines(lines, begin, end, pieces) {
  const longest = lines.reduce((one, other) => (other.times.length > one.times.length ? other : one)), { times } = longest;
  const [from, until] = [Math.max(placeOf(times, begin) - 1, 0), Math.min(placeOf(times, end) + 1, times.length)];
  const isAlike = (line) => line.times.length === times.length;
  if (until - from <= 2 * pieces) {
    const xs = times.slice(from, until);
    return [xs, ...lines.map((each) => (isAlike(each) ? each.values.slice(from, until).map(orNull) : xs.map((x) => orNull(each.values[placeOf(each.times, x)]))))];
  }
  const span = (end - begin) / pieces, xs = [], ys = lines.map(() => []);
  const number = Math.ceil(times[from] / span); // of spans since 0, so a piece stays the same as time goes on
  for (let piece = 0, first = from; piece <= pieces + 1; piece++) {
    const place = placeOf(times, (number + piece) * span), last = Math.min(place - first > 4 * BLOCK ? place - (place % BLOCK) : place, until);
    if (last <= first) continue;
    xs.push(times[first], last - 1 > first ? times[last - 1] : times[first] + 1e-9);
    lines.forEach((line, row) => {
      const [a, b] = isAlike(line) ? [first, last] : [placeOf(line.times, times[first]), placeOf(line.times, times[last - 1])];
      const [low, high] = line.ends(a, b), isRising = line.values[a] <= (low + high) / 2;
      ys[row].push(orNull(isRising ? low : high), orNull(isRising ? high : low));
    });
    first = last;
  }
  return [xs, ...ys];
}

/** The leaves of one plot: a port's own value, or the numbers of one of its fields. */
const groupOf = (leaf) => leaf.replace(/\.\d+$/, "");

const NO_LINE = new Line();

class Plots {
  constructor(model, store) {
    this.store = store;
    this.model = model;
    this.isPaused = false;
    this.window = 10;
    this.shown = new Map(); // group -> plot
    this.list = element("div", { class: "chosen" });
    this.seen = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) for (const { plot } of this.shown.values()) if (plot.element === target) plot.isSeen = isIntersecting;
      this.draw(this.at ?? this.store.at);
    }, { rootMargin: "100px" }); // what is not on the screen is not drawn
    this.pause = element("button", { type: "button", "aria-pressed": "false", onclick: () => this.togglePause() }, "Pause");
    this.choice = element("select", { "aria-label": "port to plot", onchange: () => { this.add(this.choice.value); this.choice.value = ""; } });
    this.spans = element("select", { "aria-label": "seconds shown", onchange: () => { this.window = Number(this.spans.value); this.ends = null; this.draw(this.store.at); } },
      WINDOWS.map((each) => element("option", { value: each, selected: each === this.window }, `${each} s`)));
    this.element = element("section", { id: "plots" }, element("h2", {}, "Over time"),
      element("p", { class: "acts" }, this.pause, this.spans, this.choice, this.exports()), this.list, this.lanes());
    this.fill(model.leaves);
    for (const leaf of model.shown) this.add(leaf);
    addEventListener("beforeprint", () => this.drawPlots([...this.shown.values()])); // no frame comes before it prints
    document.addEventListener("keydown", (event) => {
      if (event.key === " " && event.target === document.body) { event.preventDefault(); this.togglePause(); }
    });
  }

  /** Offer these to be plotted. */
  fill(leaves) {
    this.model.leaves = leaves;
    const groups = [...new Set(leaves.map(groupOf))];
    this.choice.replaceChildren(element("option", { value: "" }, "plot …"), ...groups.map((each) => element("option", { value: each }, each)));
  }

  exports() {
    const link = (ending) => element("button", { type: "button", onclick: () => this.export(ending) }, ending);
    return element("span", {}, " save what is seen as ", ["csv", "parquet", "mcap"].map(link));
  }

  async export(ending) {
    const [begin, end] = this.span();
    const ports = new Set([...this.shown.keys()].map((group) => this.model.ports.map(({ path }) => path).find((path) => group === path || group.startsWith(`${path}.`))).filter(Boolean));
    const query = new URLSearchParams([["ending", ending], ["begin_s", begin], ["end_s", end], ["ports", [...ports].join(" ")]]);
    try { await download(`export?${query}`, `${this.model.board}.${ending}`); } catch (error) { say(`export: ${error.message}`); }
  }

  /** Plot a port, or a field of it. */
  add(path) {
    const groups = [...new Set(this.model.leaves.filter((each) => each === path || each.startsWith(`${path}.`) || groupOf(each) === path).map(groupOf))];
    for (const group of groups.slice(0, 3)) this.addGroup(group);
  }

  addGroup(group) {
    if (this.shown.has(group)) return this.shown.get(group).plot.element.scrollIntoView({ block: "nearest" });
    const leaves = this.model.leaves.filter((each) => groupOf(each) === group);
    const isHeld = this.model.ports.some(({ path, type }) => path === group && ["int", "bool"].includes(type)); // and sent when it changes
    const part = { title: group, across: "s", up: "", is_small: true, curves: leaves.map((each) => ({ name: each === group ? "value" : each.slice(group.length + 1), x: [], y: [], style: isHeld ? "steps" : "line" })) };
    const plot = seriesPlot(part);
    plot.element.querySelector("figcaption").append(" ", element("button", { type: "button", class: "close", "aria-label": `close ${group}`, onclick: () => this.remove(group) }, "×"));
    const zoom = plot.zoom.bind(plot);
    plot.zoom = (ends) => { this.ends = ends; zoom(ends); this.fetchPast(); this.draw(this.store.at); };
    plot.isSeen = true;
    this.seen.observe(plot.element);
    this.shown.set(group, { plot, leaves, isHeld });
    this.list.append(plot.element);
    this.watch(this.socket);
    if (this.socket) this.fetchPast().then(() => this.draw(this.at ?? this.store.at));
  }

  remove(group) {
    const { plot } = this.shown.get(group);
    this.seen.unobserve(plot.element);
    plot.element.remove();
    plot.library.destroy();
    groups.get("s")?.delete(plot);
    this.shown.delete(group);
    this.watch(this.socket);
  }

  watch(socket) {
    this.socket = socket;
    const leaves = [...this.shown.values()].flatMap((each) => each.leaves);
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ watch: leaves }));
  }

  togglePause(isPaused = !this.isPaused) {
    this.isPaused = isPaused;
    this.pausedAt = this.store.at;
    this.pause.textContent = isPaused ? "Go on" : "Pause";
    this.pause.setAttribute("aria-pressed", isPaused);
    if (!isPaused) this.ends = null;
  }

  /** From when to when is shown. */
  span() {
    if (this.ends) return this.ends;
    const now = this.isPaused ? this.pausedAt : this.at ?? this.store.at;
    return [now - this.window, now];
  }

  /** Fetch a stretch of the past that has not come. */
  async fetchPast() {
    const [begin, end] = this.span();
    const leaves = [...this.shown.values()].flatMap((each) => each.leaves);
    const first = Math.max(...leaves.map((each) => this.store.lines.get(each)?.times[0] ?? Infinity));
    if (begin >= first - 1e-6 || !leaves.length) return;
    const query = new URLSearchParams([["from", begin], ["until", Math.max(end, this.store.at)], ["most", 8000], ...leaves.map((each) => ["leaf", each])]);
    const answer = await ask(`range?${query}`);
    for (const [leaf, [times, values]] of Object.entries(answer.points)) this.store.replace(leaf, times, values);
  }

  lanes() {
    this.laneFrame = element("div", { class: "lanes" });
    return this.laneFrame;
  }

  draw(at) {
    this.at = at;
    if (this.isDrawing) return;
    this.isDrawing = true;
    requestAnimationFrame(() => {
      this.isDrawing = false;
      this.drawPlots([...this.shown.values()].filter(({ plot }) => plot.isSeen));
      this.frames = (this.frames ?? 0) + 1;
      if (this.ends || this.isPaused || this.frames % STATES_EVERY === 0) this.drawStates(...this.span());
    });
  }

  drawPlots(shown) {
    const [begin, end] = this.span();
    for (const { plot, leaves, isHeld } of shown) {
      const curves = leaves.map((each) => this.store.lines.get(each) ?? NO_LINE);
      const data = curves.some(({ times }) => times.length) ? visible(curves, begin, end, Math.round(plot.library.bbox.width), isHeld) : [[begin, end], ...leaves.map(() => [null, null])];
      plot.library.batch(() => { plot.library.setData(data, false); plot.library.setScale("x", { min: begin, max: end }); });
      if (rewind?.isAway) plot.moveTo(this.at);
    }
  }

  drawStates(begin, end) {
    const paths = [...this.store.stays.keys()].filter((each) => this.store.stays.get(each).length > 1).slice(0, 12);
    if (!paths.length) return;
    const lanes = paths.map((name) => {
      const all = this.store.stays.get(name);
      const stays = [];
      for (let n = 0; n < all.length; n++) {
        const until = all[n + 1]?.[0] ?? Math.max(end, this.store.at);
        if (until >= begin && all[n][0] <= end) stays.push({ state: all[n][1], begin: Math.max(all[n][0], begin), end: Math.min(until, end) });
      }
      return { name, stays };
    });
    if (this.states?.paths.join() !== paths.join()) {
      this.states = { paths, plot: lanesPlot({ title: "States", lanes: structuredClone(lanes), across: "s", ends: [begin, end] }) };
      this.laneFrame.replaceChildren(this.states.plot.element);
    }
    this.states.plot.setLanes(lanes, [begin, end]);
  }
}
