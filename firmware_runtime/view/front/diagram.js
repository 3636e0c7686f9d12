"use strict";
/* A model's diagram: drawn elsewhere, here its models light up by their state, wires by their values.
   A diagram has: `element`, `set({states, values})`. */

const DARK = /@media \(prefers-color-scheme: dark\) \{([^@]*)\}\s*$/;
const ALIVE = ".active { stroke-width: 3 } [data-port] { cursor: pointer }";

/** The drawing's own style sheet, by the colours of this page, whatever the system prefers. */
function ownStyle(svg) {
  const style = svg.querySelector("style"), [, dark = ""] = style?.textContent.match(DARK) ?? [];
  const light = (style?.textContent ?? "").replace(DARK, "") + ALIVE;
  const choose = () => { if (style) style.textContent = light + (isDark() ? dark : ""); };
  repaints.add(choose);
  choose();
}

function diagramOf(part, onPort) {
  const parsed = new DOMParser().parseFromString(part.svg, "image/svg+xml").documentElement;
  const svg = document.importNode(parsed, true);
  svg.querySelectorAll("script, foreignObject").forEach((each) => each.remove());
  svg.style.maxWidth = "100%";
  svg.style.height = "auto";
  ownStyle(svg);
  const frame = element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": part.title });
  frame.attachShadow({ mode: "open" }).append(svg); // its classes are its own
  const byData = (name) => {
    const found = new Map();
    svg.querySelectorAll(`[data-${name}]`).forEach((each) => {
      const key = each.getAttribute(`data-${name}`);
      if (!found.has(key)) found.set(key, []);
      found.get(key).push(each);
    });
    return found;
  };
  const states = byData("state-of"), wires = byData("port"), boxes = byData("model");
  if (onPort) for (const [path, all] of wires) all.forEach((each) => each.addEventListener("click", () => onPort(path)));
  const seen = new Map();
  return {
    element: element("figure", { class: "diagram" }, element("figcaption", {}, part.title), frame),
    set({ states: now = {}, values = {} }) {
      for (const [path, state] of Object.entries(now)) {
        states.get(path)?.forEach((each) => setText(each, state));
        const isChanged = seen.get(path) !== state;
        seen.set(path, state);
        boxes.get(path)?.forEach((each) => each.classList.toggle("active", isChanged));
      }
      for (const [path, value] of Object.entries(values)) {
        wires.get(path)?.forEach((each) => {
          const title = each.querySelector("title");
          if (!title) return;
          each.dataset.name ??= title.textContent;
          setText(title, `${each.dataset.name}: ${shortText(value)}`);
        });
      }
    },
  };
}

/** A value in few letters. */
function shortText(value) {
  if (value === null || typeof value !== "object") return numberText(value, 4);
  const inside = Array.isArray(value) ? value.map(shortText) : Object.entries(value).map(([name, each]) => `${name} ${shortText(each)}`);
  return inside.join(", ");
}
