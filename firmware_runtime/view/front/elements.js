"use strict";
/* Elements of a page, and how numbers and times are written. Text is put in as text, never as markup. */

/** Make an element; `on...` attributes are listeners, false, null and undefined are left out. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.flat(Infinity).filter((each) => each !== null && each !== undefined));
  return made;
}

/** Make an element of SVG. */
function shape(tag, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined && value !== "") made.setAttribute(name, value);
  }
  made.append(...children.filter(Boolean));
  return made;
}

/** Put words in an element; the same ones again would have the page laid out again. */
function setText(made, words) {
  if (made.textContent !== words) made.textContent = words;
}

/** A cell of a table or a list: words, a link or code. */
function cell(content) {
  if (typeof content !== "object" || content === null) return String(content ?? "");
  if (content.kind === "code") return element("code", {}, content.text);
  return element("a", { href: safe(content.href) }, content.text);
}

/** An address beside the page or on it; anything else leads nowhere. */
function safe(href) {
  return /^(#|[\w.-]+(\/[\w.-]+)*(#.*)?$)/.test(href) ? href : "#";
}

const colours = new Map(); // by name; looked up once, for that takes the time of a plot

/** The present colour of that name; `colour0` is that of the first curve. */
function colour(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`));
  return colours.get(name);
}
const CURVES = 8;
const nameOfCurve = (place) => `colour${place % CURVES}`;

/** A number with so many digits, without zeros that say nothing; a dash for none. */
function numberText(value, digits = 6) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "boolean") return value ? "true" : "false";
  if (typeof value !== "number") return String(value);
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return (value + 0).toLocaleString("en");
  return String(Number(value.toPrecision(digits)) + 0);
}

const SPANS = [[1, "ns"], [1e3, "µs"], [1e6, "ms"], [1e9, "s"]];

/** A span of time in ns, in the unit that fits. */
function durationText(ns, digits = 3) {
  const [size, unit] = [...SPANS].reverse().find(([each]) => Math.abs(ns) >= each) ?? SPANS[0];
  return `${Number((ns / size).toPrecision(digits))} ${unit}`;
}

/** The text of a value in the unit of an axis. */
const valueText = (value, unit) =>
  unit === "ns" && typeof value === "number" ? durationText(value) : numberText(value);

/** Everything that is drawn anew when colours change: functions without arguments. */
const repaints = new Set();
const repaint = () => { colours.clear(); repaints.forEach((each) => each()); };
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
addEventListener("beforeprint", repaint);
addEventListener("afterprint", repaint);

/** Whether the page is dark now: by its button, else by what the system prefers; paper is light. */
const isDark = () => !matchMedia("print").matches
  && (document.documentElement.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";

/** Have the browser save a file. */
function keep(blob, name) {
  const url = URL.createObjectURL(blob);
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

/** A button that goes from light to dark and back. */
function themeButton() {
  return element("button", {
    class: "theme", type: "button", title: "light or dark", "aria-label": "light or dark",
    onclick: () => { document.documentElement.dataset.theme = isDark() ? "light" : "dark"; repaint(); },
  }, "◐");
}
