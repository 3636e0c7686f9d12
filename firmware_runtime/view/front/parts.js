"use strict";
/* A page of parts: for each kind what draws it. */

const RENDER = {
  verdict: (part) => element("p", {}, element("strong", { class: `verdict ${part.judgement}` }, part.word), " ", (part.sentences ?? []).join(" ")),
  text: (part) => part.look === "headline" ? element("p", { class: "headline" }, element("code", {}, part.text)) : element("p", { class: part.look ?? "" }, part.text),
  bullets: (part) => element("ul", {}, part.items.map((each) => element("li", {}, cell(each)))),
  glossary: (part) => element("dl", { class: "glossary" }, part.items.map(([word, meaning]) => element("div", {}, element("dt", {}, word), element("dd", {}, meaning)))),
  figures: (part) => element("dl", { class: "figures" }, part.items.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value)))),
  table: (part) => tableOf(part),
  series: (part) => seriesPlot(part).element,
  histogram: (part) => histogramPlot(part).element,
  bars: (part, on) => barsList(part, on.instant),
  lanes: (part) => lanesPlot(part).element,
  plane: (part) => planeOf(part).element,
  diagram: (part) => diagramOf(part).element,
  section: (part, on) => element("section", { id: anchor(part.title) }, element("h2", {}, part.title), part.parts.map((each) => render(each, on))),
  folded: (part, on) => folded(part.title, part.parts, on),
  beside: (part, on) => element("div", { class: "beside" }, part.parts.map((each) => render(each, on))),
  card: (part, on) => element("article", { id: anchor(part.title.text ?? part.title) }, element("h3", {}, cell(part.title), element("span", { class: "quiet" }, part.note ? ` ${part.note}` : "")), part.parts.map((each) => render(each, on))),
};

/** What draws a part; `on.instant(ns)` is called where an instant of the run is clicked. */
function render(part, on = {}) {
  return RENDER[part.kind](part, on);
}

const anchor = (title) => title.toLowerCase().replace(/[^a-z0-9]+/g, "-");

/** Parts that are made when they are opened first. */
function folded(title, parts, on = {}) {
  const details = element("details", {}, element("summary", {}, title));
  const open = () => details.append(...parts.map((each) => render(each, on)));
  details.addEventListener("toggle", open, { once: true });
  addEventListener("beforeprint", () => { details.open = true; }, { once: true });
  return details;
}

function tableOf(part) {
  const rows = part.rows.map(([first, ...cells]) => element("tr", {}, element("th", { scope: "row" }, cell(first)), cells.map((each) => element("td", {}, cell(each)))));
  const table = element("table", { class: part.is_words ? "words" : "numbers" },
    element("thead", {}, element("tr", {}, part.head.map((each) => element("th", { scope: "col" }, each)))), element("tbody", {}, rows));
  return element("div", { class: "table" }, element("p", { class: "caption" }, part.title),
    element("div", { class: "scroll", role: "region", "aria-label": part.title, tabindex: 0 }, table));
}

/** A whole page into the element `main`. */
function renderPage(page, on = {}) {
  document.querySelector("main").append(
    element("header", {}, element("h1", {}, page.title, themeButton()), (page.opening ?? []).map((each) => render(each, on))),
    ...(page.parts ?? []).map((each) => render(each, on)));
}
