"use strict";
/* The page of a run: what it is doing first, what is wrong, then what one sees of it; timing after that. */

const store = new Store();
const state = {}; // as `GET /api/state` says it
let model = null, can = JSON.parse(document.getElementById("data").textContent).can;
let world = null, drawn = null, plots = null, rewind = null;

/** Ask the page's server. Throws what it refuses, as sentences. */
async function ask(name, said) {
  const options = said === undefined ? {} : { method: "POST", body: JSON.stringify(said), headers: { "Content-Type": "application/json" } };
  const response = await fetch(`api/${name}`, options);
  const answer = await response.json().catch(() => ({ refused: [`the server answered ${response.status}`] }));
  const refused = [...(answer.refused ?? []), ...(answer.not_safe ?? [])];
  if (refused.length) throw new Error(refused.join("; "));
  return answer;
}

/** Ask for a file, and have the browser save it. Throws what the server refuses. */
async function download(name, file) {
  const response = await fetch(`api/${name}`);
  if (!response.ok) throw new Error((await response.json()).refused.join("; "));
  keep(await response.blob(), file);
}

/** Say something that went wrong, or went well, where everybody sees it. */
function say(words, judgement = "bad") {
  const line = element("p", { class: `said ${judgement}`, role: judgement === "bad" ? "alert" : "status" }, words, " ",
    element("button", { type: "button", "aria-label": "dismiss", onclick: () => line.remove() }, "×"));
  document.getElementById("said").prepend(line);
  if (judgement !== "bad") setTimeout(() => line.remove(), 6000);
}

/** A button that asks for something, and says what came of it. */
function act(words, name, said = () => ({}), { done = () => `${words}: done`, css = "" } = {}) {
  const button = element("button", { type: "button", class: css, onclick: async () => {
    button.disabled = true;
    try { say(done(await ask(name, said())), "good"); } catch (error) { say(`${words}: ${error.message}`); } finally { button.disabled = false; }
  } }, words);
  return button;
}

const main = document.querySelector("main");
main.classList.add("live");

function layOut() {
  main.replaceChildren(
    element("header", {},
      element("h1", {}, element("span", { id: "badge", class: "verdict open" }, "…"), ` ${model.board}`, themeButton()),
      element("p", { id: "doing", class: "doing", "aria-live": "polite" }, ""),
      element("p", { class: "acts" },
        can.disarm ? act("Safe state", "safe-state", undefined, { css: "danger" }) : null,
        can.disarm ? act("Disarm", "disarm") : null,
        can.arm ? act("Arm", "arm") : null,
        model.is_live ? null : element("span", { class: "quiet" }, `recording ${model.run}`)),
      element("div", { id: "said" }),
      element("ul", { id: "faults", class: "faults" }),
      element("dl", { id: "outputs", class: "figures" })),
    element("div", { class: "see" }, worldFigure(), element("section", { id: "break" })),
    element("section", { id: "rewind" }),
    plots.element,
    element("section", {}, element("h2", {}, "Model"), modelFigure()),
    element("section", {}, element("h2", {}, "Values"), valuesTable()),
    element("section", { id: "tune" }),
    timing());
}

function worldFigure() {
  if (model.no_world) return element("p", { class: "quiet" }, model.no_world);
  if (!model.plane) return null;
  world = planeOf(model.plane);
  return world.element;
}

function modelFigure() {
  drawn = diagramOf(model.diagram, (port) => plots.add(port));
  return drawn.element;
}

const cells = new Map(); // of values, by port

function valuesTable() {
  for (const { path } of model.ports) cells.set(path, element("td", { class: "value" }, "–"));
  const rows = model.ports.map(({ path, type }) => element("tr", {},
    element("th", { scope: "row" }, element("button", { class: "instant", type: "button", title: "plot it", onclick: () => plots.add(path) }, path)),
    element("td", { class: "quiet" }, type), cells.get(path)));
  return element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Values" },
    element("table", { class: "words", id: "values" }, element("thead", {}, element("tr", {}, ["port", "type", "value"].map((each) => element("th", { scope: "col" }, each)))), element("tbody", {}, rows)));
}

/** The timing of the run, read when it is opened. */
function timing() {
  const details = element("details", { id: "timing" }, element("summary", {}, "Timing: lateness, the worst ticks and their causes"));
  const load = async () => {
    try {
      const page = await ask("report");
      const parts = [...(page.opening ?? []), ...(page.parts ?? [])];
      details.replaceChildren(details.firstChild, act("Read again", "state", undefined, { done: () => { load(); return "read again"; } }),
        ...parts.map((each) => render(each, { instant: (at) => rewind.goTo(at) })));
    } catch (error) { say(`timing: ${error.message}`); }
  };
  details.addEventListener("toggle", () => { if (details.open && details.childElementCount === 1) load(); });
  return details;
}

// What comes ---------------------------------------------------------------------------------------

function showState(now) {
  Object.assign(state, now);
  const isRunning = now.state === "running";
  const [judgement, word] = isRunning ? (now.armed ? ["good", "armed"] : ["open", "disarmed"]) : [["failed", "died", "overrun"].includes(now.state) ? "bad" : "open", now.state];
  const badge = document.getElementById("badge");
  badge.className = `verdict ${judgement}`;
  badge.textContent = word;
  document.getElementById("doing").textContent = [now.sentence, now.punctual, now.note].filter(Boolean).join(". ");
  document.getElementById("faults").replaceChildren(...now.faults.map((each) => element("li", {},
    element("button", { class: "instant", type: "button", title: "go to the moment before", onclick: () => rewind.goTo((each.first_s ?? 0) * 1e9 - 1) }, `${numberText(each.first_s, 6)} s`),
    ` ${each.model}: ${each.sentence.replace(`${model.board}.${each.model}: `, "")}${each.count > 1 ? ` (${numberText(each.count)} times, the last at ${numberText(each.last_s, 6)} s)` : ""}`)));
  document.getElementById("outputs").replaceChildren(...Object.entries(now.outputs).map(([name, each]) =>
    element("div", {}, element("dt", {}, name), element("dd", {}, { ALL: "driven as commanded", PART: "driven, limited", NOTHING: "off" }[each] ?? each))));
}

function showValues(values) {
  for (const [path, cell] of cells) if (values[path] !== undefined) setText(cell, shortText(values[path]));
}

function take(frame) {
  if (frame.run && model && frame.run !== model.run) return location.reload();
  store.take(frame);
  if (frame.leaves) plots.fill(frame.leaves);
  if (frame.state) showState(frame.state);
  if (rewind.isAway) plots.draw(plots.at);
  else show(frame.values, frame.states, frame.at);
}

/** Show an instant: of the run as it comes, or of its past. */
function show(values, states, at) {
  world?.set(values);
  drawn?.set({ values, states });
  showValues(values);
  plots.draw(at);
}

function connect() {
  const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`);
  socket.onopen = () => plots.watch(socket);
  socket.onmessage = ({ data }) => take(JSON.parse(data));
  socket.onclose = () => {
    document.getElementById("badge").textContent = "no connection";
    document.getElementById("badge").className = "verdict bad";
    setTimeout(connect, 1000);
  };
}

async function begin() {
  model = await ask("model");
  plots = new Plots(model, store);
  rewind = new Rewind(model);
  layOut();
  rewind.layOut(document.getElementById("rewind"));
  tuning(document.getElementById("tune"), model.is_live);
  breaking(document.getElementById("break"));
  showState(await ask("state"));
  connect();
  document.body.dataset.ready = "true";
}

begin().catch((error) => { main.append(element("p", { class: "said bad" }, `This page cannot begin: ${error.message}`)); });
