"use strict";
/* Bars made of pieces, each as wide as the page, with their words below. */

const pieceColours = new Map();
function colourOfPiece(piece) {
  if (piece.colour) return piece.colour;
  if (!pieceColours.has(piece.name)) pieceColours.set(piece.name, nameOfCurve(pieceColours.size));
  return pieceColours.get(piece.name);
}

function barsList(part, onInstant) {
  return element("ol", { class: "bars" }, part.rows.map((row) => barRow(row, onInstant)));
}

function barRow(row, onInstant) {
  const whole = Math.max(...row.lanes.map((lane) => lane.reduce((sum, each) => sum + each.value, 0)), 1e-9);
  const title = onInstant && row.at !== undefined
    ? element("button", { class: "instant", type: "button", onclick: () => onInstant(row.at) }, row.title)
    : row.title;
  return element("li", {},
    element("h3", {}, title, element("span", { class: "quiet" }, row.note ? ` ${row.note}` : "")),
    row.lanes.filter((lane) => lane.length).map((lane, place) => [
      element("div", { class: place ? "lane thin" : "lane", "aria-hidden": "true" }, lane.map((piece) =>
        element("span", { style: `width:${(100 * piece.value) / whole}%;background:var(--${colourOfPiece(piece)})`, title: `${piece.name} ${piece.words}` }))),
      element("ul", { class: "legend" }, place ? element("li", { class: "quiet" }, "within it:") : null, lane.map((piece) =>
        element("li", {}, element("span", { class: "swatch", style: `background:var(--${colourOfPiece(piece)})`, "aria-hidden": "true" }), `${piece.name} ${piece.words}`))),
    ]),
    row.why ? element("p", { class: "quiet" }, `because: ${row.why}`) : null);
}
