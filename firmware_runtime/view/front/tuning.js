"use strict";
/* Gains and limits as sliders: try them on the last run, take them up, undo, save a copy of board.toml. */

async function tuning(section, isLive) {
  let sliders;
  try { sliders = await ask("sliders"); } catch { return; } // a run without gains
  if (!sliders.length) return;
  const past = [];
  const chosen = new Map(sliders.map((each) => [each.key, each.value]));
  const inForce = new Map(chosen);
  const fields = new Map();
  const changed = () => Object.fromEntries([...chosen].filter(([key, value]) => value !== inForce.get(key)));
  const tried = element("div", { class: "tried", "aria-live": "polite" });
  const history = element("ol", { class: "quiet" });
  const put = (key, value) => { chosen.set(key, value); fields.get(key).forEach((each) => { if (Number(each.value) !== value) each.value = value; }); };

  const row = (each) => {
    const meaning = element("td", { class: "quiet" }, each.unit ?? "", " ", each.text), head = element("th", { scope: "row" }, each.key);
    if (typeof each.value === "boolean") {
      const box = element("input", { type: "checkbox", checked: each.value, "aria-label": each.key, onchange: () => chosen.set(each.key, box.checked) });
      fields.set(each.key, []);
      return element("tr", {}, head, element("td", {}, box), element("td"), meaning);
    }
    if (typeof each.value !== "number") return null;
    const size = Math.abs(each.value) || 1;
    const [least, most] = [Math.max(each.least ?? -Infinity, Math.min(0, each.value - 2 * size)), Math.min(each.most ?? Infinity, each.value + 2 * size)];
    const set = (event) => put(each.key, Number(event.target.value));
    const slider = element("input", { type: "range", min: least, max: most, step: "any", value: each.value, "aria-label": each.key, oninput: set });
    const number = element("input", { type: "number", min: each.least, max: each.most, step: "any", value: each.value, "aria-label": `${each.key} as a number`, oninput: set });
    fields.set(each.key, [slider, number]);
    return element("tr", {}, head, element("td", {}, slider), element("td", {}, number), meaning);
  };

  const take = async (values) => {
    const before = Object.fromEntries(Object.keys(values).map((key) => [key, inForce.get(key)]));
    const answer = await ask("set", { values });
    for (const key of Object.keys(values)) { inForce.set(key, answer.values[key]); put(key, answer.values[key]); }
    return before;
  };
  const attempt = (words, does) => element("button", { type: "button", onclick: async (event) => {
    event.target.disabled = true;
    try { await does(); } catch (error) { say(`${words}: ${error.message}`); } finally { event.target.disabled = false; }
  } }, words);

  section.append(element("h2", {}, isLive ? "Tune" : "What if"), element("div", { class: "scroll" }, element("table", { class: "words" }, element("tbody", {}, sliders.map(row)))),
    element("p", { class: "acts" },
      attempt(isLive ? "Try on the last run first" : "Try on this run", async () => tried.replaceChildren(...(await ask("try", { values: changed() })).map((each) => render(each)))),
      !isLive ? null : attempt("Take up", async () => {
        const values = changed(), before = await take(values);
        past.push(before);
        history.prepend(element("li", {}, Object.entries(values).map(([key, value]) => `${key} ${numberText(before[key])} → ${numberText(value)}`).join(", ")));
        say("taken up until the run ends", "good");
      }),
      !isLive ? null : attempt("Undo", async () => { if (past.length) { await take(past.pop()); history.firstChild?.remove(); } }),
      attempt("Save a copy of board.toml", async () => {
        await download(`board-file?values=${encodeURIComponent(JSON.stringify(Object.fromEntries(chosen)))}`, "board.toml");
      })),
    history, tried);
}
