"use strict";
/* Plots on uPlot: curves over time, histograms, states over time. Plots with the same axis across share
   cursor and zoom. A plot has: `element`, `library`, `show(ends)`, `moveTo(x)`. */

const groups = new Map(); // plots by the label of their axis across
const SMALL = 190, LARGE = 260, LANE = 26, NEAR = 12;
const STEEP = 4; // pixels that a line goes up and down in each column, from which on it is drawn as bars

/** Give every plot that shares an axis these ends; null: what its curves have. */
function zoomAll(across, ends, but) {
  for (const plot of groups.get(across) ?? []) if (plot !== but) plot.show(ends);
}

/** Points that lie at the same place are a hair apart: the library wants x to grow. */
function growing(xs) {
  let last = -Infinity;
  return xs.map((x) => (last = x === null ? last : x > last ? x : last + 1e-9 * Math.max(1, Math.abs(last))));
}

/** Curves of their own x as the library's table of one x. */
function aligned(curves) {
  if (curves.length === 0) return [[0], [null]];
  const tables = curves.map((each) => [growing(each.x), each.y]);
  if (tables.length === 1) return tables[0];
  const first = tables[0][0];
  const areEqual = tables.every(([xs]) => xs === first || (xs.length === first.length && xs.every((x, n) => x === first[n])));
  return areEqual ? [first, ...tables.map(([, ys]) => ys)] : uPlot.join(tables);
}

const lineOf = uPlot.paths.linear();

/** A line; one that goes far up and down within columns of pixels is drawn as bars, many times as fast. */
const orBars = (path) => (plot, number, from, until) => {
  const bars = barsOf(plot, number, from, until);
  plot.series[number].bars = bars;
  return bars ? null : path(plot, number, from, until);
};

/** Bars from the highest to the lowest point of each column, joined to the one before: x, top, bottom, width. */
function barsOf(plot, number, from, until) {
  const [xs, ys] = [plot.data[0], plot.data[number]], { scale } = plot.series[number], bars = [];
  const [left, right] = [from, until].map((n) => plot.valToPos(xs[n], "x", true)), slope = (right - left) / (xs[until] - xs[from]);
  if (until - from < right - left) return null;
  let bar = null, last = null, height = 0;
  for (let n = from; n <= until; n++) {
    if (ys[n] === null || ys[n] === undefined) { last = null; continue; }
    const x = Math.round(left + slope * (xs[n] - xs[from])), y = Math.round(plot.valToPos(ys[n], scale, true));
    if (bar?.[0] !== x) {
      if (last !== null && x > bar[0] + 1) bars.push([bar[0] + 1, last, last, x - bar[0] - 1]);
      bars.push(bar = [x, last ?? y, last ?? y, 1]);
    }
    bar[1] = Math.min(bar[1], y);
    bar[2] = Math.max(bar[2], y);
    height += Math.abs(y - (last ?? y));
    last = y;
  }
  return height > STEEP * bars.length ? bars : null;
}

function drawBars(plot, number) {
  const { bars } = plot.series[number], { ctx, bbox } = plot, thick = Math.round(2 * devicePixelRatio);
  if (!bars) return;
  ctx.fillStyle = colour(plot.series[number].colour);
  for (const [x, top, bottom, width] of bars) if (x >= bbox.left && x < bbox.left + bbox.width) ctx.fillRect(x, top, width, bottom - top + thick);
}

const PATHS = {
  line: () => orBars(lineOf),
  dashed: () => lineOf,
  steps: () => orBars(uPlot.paths.stepped({ align: 1 })),
  columns: () => columnPath,
  dots: () => () => null,
};

/** Columns from each point to the next, from the axis up. */
function columnPath(plot, number, from, until) {
  const fill = new Path2D(), [xs, ys] = [plot.data[0], plot.data[number]];
  const scale = plot.series[number].scale, floor = plot.valToPos(Math.max(plot.scales[scale].min, 0), scale, true);
  for (let n = from; n <= until; n++) {
    if (ys[n] === null || ys[n] === undefined || ys[n] <= 0) continue;
    const left = plot.valToPos(xs[n], "x", true);
    const right = n + 1 < xs.length ? plot.valToPos(xs[n + 1], "x", true) : left + 4;
    const top = plot.valToPos(ys[n], scale, true);
    fill.rect(left, top, Math.max(right - left - 0.6, 1), floor - top);
  }
  return { fill, stroke: null, clip: null };
}

function optionsOf(curve, place, part) {
  const name = curve.colour || (curve.style === "dashed" ? "quiet" : nameOfCurve(place));
  const style = curve.style ?? "line";
  const thinner = part.is_nested ? part.curves.length - place - 1 : 0;
  return {
    label: curve.name,
    colour: name,
    stroke: () => colour(name),
    fill: style === "columns" ? () => colour(name) : undefined,
    width: style === "columns" || style === "dots" ? 0 : 1.6 + thinner,
    dash: style === "dashed" ? [5, 4] : undefined,
    paths: PATHS[style](),
    points: { show: style === "dots" || ((_, __, from, until) => until - from < 2), size: 4, width: 0, fill: () => colour(name) }, // what is too short for a line
    spanGaps: false, // null is a gap; what is undefined is only of another curve
    value: (_, value) => valueText(value, part.up),
  };
}

function axis(label, unit, isAcross, isSmall) {
  return {
    label: isAcross && unit !== "ns" ? label : undefined, labelSize: 18, labelFont: "12px system-ui", font: "11px system-ui",
    size: isAcross ? 32 : 62, space: isAcross ? 70 : 34, gap: 4,
    stroke: () => colour("quiet"), grid: { stroke: () => colour("line"), width: 1 }, ticks: { show: false },
    values: (_, marks) => marks.map((each) => (each === null ? "" : valueText(each, unit))),
  };
}

/** Shaded spans behind the curves, levels and their words above them. */
function drawSpans(plot, spans) {
  const { ctx, bbox } = plot;
  for (const span of spans) {
    const [left, right] = [span.begin, span.end].map((at) => Math.min(Math.max(plot.valToPos(at, "x", true), bbox.left), bbox.left + bbox.width));
    if (right <= left) continue;
    ctx.save();
    ctx.globalAlpha = 0.18;
    ctx.fillStyle = colour("doubtful");
    ctx.fillRect(left, bbox.top, right - left, bbox.height);
    ctx.restore();
    write(plot, span.name ?? "", (left + right) / 2, bbox.top + 12 * devicePixelRatio, "center", "quiet");
  }
}

function write(plot, words, x, y, align, name) {
  const { ctx } = plot;
  ctx.save();
  ctx.font = `${12 * devicePixelRatio}px system-ui`;
  ctx.textAlign = align;
  ctx.lineWidth = 4 * devicePixelRatio;
  ctx.lineJoin = "round";
  ctx.strokeStyle = colour("paper");
  ctx.fillStyle = colour(name);
  ctx.strokeText(words, x, y);
  ctx.fillText(words, x, y);
  ctx.restore();
}

function drawLevels(plot, levels, unit, isUpright) {
  const { ctx, bbox } = plot;
  const places = levels.map((each) => [plot.valToPos(Math.max(each.value, plot.scales[isUpright ? "x" : "y"].min), isUpright ? "x" : "y", true), each]);
  const rows = [...places].sort(([one], [other]) => one - other);
  rows.forEach(([at, level], row) => {
    const name = level.is_limit ? "doubtful" : "ink";
    const [begin, end] = isUpright ? [bbox.left, bbox.left + bbox.width] : [bbox.top, bbox.top + bbox.height];
    if (at < begin - 1 || at > end + 1) return;
    ctx.save();
    ctx.strokeStyle = colour(name);
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash(level.is_limit ? [5 * devicePixelRatio, 4 * devicePixelRatio] : []);
    ctx.beginPath();
    if (isUpright) { ctx.moveTo(at, bbox.top); ctx.lineTo(at, bbox.top + bbox.height); }
    else { ctx.moveTo(bbox.left, at); ctx.lineTo(bbox.left + bbox.width, at); }
    ctx.stroke();
    ctx.restore();
    const words = `${level.name} ${valueText(level.value, unit)}`, pad = 5 * devicePixelRatio;
    if (!isUpright) return write(plot, words, bbox.left + pad, at - pad, "left", name);
    const isRight = at > (begin + end) / 2;
    const y = bbox.top + (14 * (isRight ? rows.length - row : row + 1)) * devicePixelRatio;
    write(plot, words, at + (isRight ? -pad : pad), y, isRight ? "right" : "left", name);
  });
}

/** A square of the curve's colour, also where it is drawn as dots. */
const MARKERS = { width: 0, fill: (plot, place) => `var(--${plot.series[place].colour})` };

/** The figure of a plot: caption, picture, numbers; `options` are the library's. */
class Plot {
  constructor(part, options, data, { isShared = true, height } = {}) {
    this.across = part.across;
    this.height = height ?? (part.is_small ? SMALL : LARGE);
    this.frame = element("div", { class: "plot", tabindex: 0, role: "group", "aria-label": part.said ? `${part.title}. ${part.said}` : part.title });
    this.element = element("figure", { class: part.is_small ? "small" : "" },
      element("figcaption", {}, part.title), this.frame, ...(part.numbers?.length ? [folded("Numbers", part.numbers)] : []));
    this.isShared = isShared && !part.has_equal_scales;
    const hooks = { ...options.hooks, setSelect: [(plot) => this.selected(plot)], setCursor: [(plot) => this.onCursor?.(plot)] };
    this.options = {
      ...options, hooks, width: 600, height: this.height, legend: { show: true, live: true, markers: MARKERS, ...options.legend },
      cursor: { drag: { x: true, y: false, setScale: false }, sync: this.isShared ? { key: part.across, setSeries: false } : undefined, points: { size: 6 }, ...options.cursor },
    };
    this.library = new uPlot(this.options, data, this.frame);
    this.frame.addEventListener("keydown", (event) => this.key(event));
    this.frame.addEventListener("dblclick", () => this.zoom(null));
    new ResizeObserver(() => this.fit()).observe(this.frame);
    repaints.add(() => this.library.redraw(false, true));
    if (this.isShared) {
      if (!groups.has(part.across)) groups.set(part.across, new Set());
      groups.get(part.across).add(this);
    }
  }

  fit() {
    const width = Math.floor(this.frame.clientWidth);
    if (width > 0 && width !== this.library.width) this.library.setSize({ width, height: this.height });
  }

  /** Show these ends, or all. */
  show(ends) {
    this.ends = ends;
    const xs = this.library.data[0];
    const [min, max] = ends ?? this.whole ?? [xs[0], xs[xs.length - 1]];
    if (min < max) this.library.setScale("x", { min, max });
  }

  zoom(ends) {
    this.show(ends);
    if (this.isShared) zoomAll(this.across, ends, this);
  }

  selected(plot) {
    const { left, width } = plot.select;
    if (width < 4) return;
    this.zoom([plot.posToVal(left, "x"), plot.posToVal(left + width, "x")]);
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  }

  moveTo(x) {
    this.library.setCursor({ left: this.library.valToPos(x, "x"), top: 10 });
  }

  /** Arrows move the cursor, + and - zoom, 0 or Escape shows all. */
  key(event) {
    const plot = this.library, { min, max } = plot.scales.x, width = plot.bbox.width / devicePixelRatio;
    const left = plot.cursor.left >= 0 ? plot.cursor.left : width / 2, at = plot.posToVal(left, "x");
    const half = (max - min) / 2;
    const around = (size) => this.zoom([at - size * (at - min), at + size * (max - at)]);
    const acts = {
      ArrowLeft: () => plot.setCursor({ left: Math.max(left - width / 100, 0), top: 10 }),
      ArrowRight: () => plot.setCursor({ left: Math.min(left + width / 100, width), top: 10 }),
      PageUp: () => this.zoom([min - half, max - half]), PageDown: () => this.zoom([min + half, max + half]),
      "+": () => around(0.5), "=": () => around(0.5), "-": () => around(2), 0: () => this.zoom(null), Escape: () => this.zoom(null),
    };
    if (!acts[event.key]) return;
    event.preventDefault();
    acts[event.key]();
  }
}

/** Curves over a common axis. */
function seriesPlot(part) {
  const curves = part.curves ?? [];
  if (part.has_equal_scales || (curves.length && curves.every((each) => each.style === "dots"))) return crossPlot(part);
  const [low, high] = part.up_ends ?? [null, null];
  const options = {
    scales: {
      x: { time: false, ...(part.across_ends ? { range: (_, min, max) => (plot?.ends ? [min, max] : part.across_ends) } : {}) },
      y: part.is_log ? { distr: 3 } : { range: part.up_ends ? [low, high] : { min: { pad: 0.08, soft: 0, mode: 2 }, max: { pad: 0.08 } } },
    },
    axes: [axis(part.across, part.across, true), axis(part.up, part.up, false)],
    series: [{ label: part.across, value: (_, value) => valueText(value, part.across) }, ...(curves.length ? curves : [{ name: "nothing", x: [], y: [] }]).map((each, place) => optionsOf(each, place, part))],
    hooks: {
      drawAxes: [(each) => drawSpans(each, part.spans ?? [])],
      drawSeries: [drawBars],
      draw: [(each) => drawLevels(each, part.levels ?? [], part.up, false)],
    },
  };
  let plot = null;
  const positive = (value) => (part.is_log && value !== null && value <= 0 ? null : value);
  const data = aligned(curves).map((ys, place) => (place && part.is_log ? ys.map(positive) : ys));
  plot = new Plot(part, options, data);
  plot.whole = part.across_ends;
  plot.frame.prepend(element("span", { class: "unit" }, part.up === "ns" ? "" : part.up));
  return plot;
}

/** Marks of a logarithmic axis: powers of ten, between them 2 and 5 where there are few. */
const DECADES = {
  splits: (_, __, min, max) => {
    const steps = Math.log10(max / min) > 3.5 ? [1] : [1, 2, 5], found = [];
    for (let power = Math.floor(Math.log10(min)); power <= Math.log10(max); power++) {
      for (const step of steps) if (step * 10 ** power >= min && step * 10 ** power <= max) found.push(step * 10 ** power);
    }
    return found;
  },
  filter: (_, marks) => marks,
};

/** Samples in bars between edges. */
function histogramPlot(part) {
  const least = (value) => (part.is_log ? Math.max(value, 1) : value);
  const edges = part.edges.map(least);
  const ys = [...part.counts.map((each) => (each > 0 ? each : null)), null];
  const values = [...edges, ...(part.levels ?? []).map((each) => least(each.value))];
  const decade = (value, round) => (part.is_log ? 10 ** round(Math.log10(value)) : value);
  const whole = [decade(Math.min(...values), Math.floor), decade(Math.max(...values) * 1.001, Math.ceil)];
  const options = {
    scales: {
      x: { time: false, distr: part.is_log ? 3 : 1, range: (_, min, max) => (plot?.ends ? [min, max] : whole) },
      y: part.is_log ? { distr: 3, range: (_, min, max) => [0.6, Math.max(max ?? 1, 10)] } : { range: (_, min, max) => [0, (max ?? 1) * 1.05] },
    },
    axes: [{ ...axis(part.across, part.across, true), ...(part.is_log ? DECADES : {}) }, axis("", "", false)],
    series: [{ label: part.across, value: (_, value) => valueText(value, part.across) }, {
      label: "samples", colour: "blue", stroke: () => colour("blue"), fill: () => colour("blue"), width: 0, paths: columnPath, points: { show: false },
      value: (_, value) => numberText(value),
    }],
    hooks: { draw: [(each) => drawLevels(each, part.levels ?? [], part.across, true)] },
  };
  let plot = null;
  plot = new Plot(part, options, [edges, ys], { isShared: false });
  return plot;
}

/** States over time: a lane a model, the name of a state where it has room; marks, which say what they are. */
function lanesPlot(part) {
  const height = (part.height ?? LANE) * part.lanes.length + 62;
  const stays = part.lanes.flatMap((each) => each.stays ?? []), marks = part.lanes.flatMap((each) => each.marks ?? []);
  const instants = [...stays.flatMap((each) => [each.begin, each.end]), ...marks.map((each) => each.at)];
  const end = (found, each) => Math.max(found, each);
  const whole = part.ends ?? [instants.reduce((found, each) => Math.min(found, each), 0), instants.reduce(end, 1e-9)];
  const lasted = new Map();
  for (const each of stays) lasted.set(each.state, (lasted.get(each.state) ?? 0) + each.end - each.begin);
  const names = [...lasted].sort(([, one], [, other]) => other - one).map(([name]) => name);
  const options = {
    scales: { x: { time: false, range: (_, min, max) => (plot?.ends ? [min, max] : whole) }, y: { range: [0, part.lanes.length] } },
    axes: [axis(part.across, part.across, true), { ...axis("", "", false), size: 170, grid: { show: false }, splits: part.lanes.map((_, row) => part.lanes.length - row - 0.5), values: () => part.lanes.map(({ name }) => (name.length > 26 ? `…${name.slice(-25)}` : name)) }],
    series: [{ label: part.across, value: (_, value) => valueText(value, part.across) }, { label: "states", show: true, stroke: "transparent", points: { show: false }, value: (_, __, ___, index) => "" }],
    legend: { show: false },
    hooks: { draw: [(each) => drawLanes(each, part.lanes, names), (each) => drawMarks(each, part.lanes)] },
  };
  let plot = null;
  plot = new Plot(part, options, [whole, [null, null]], { height });
  plot.setLanes = (lanes, [min, max]) => {
    part.lanes = lanes;
    for (const { state } of lanes.flatMap((each) => each.stays ?? [])) if (!names.includes(state)) names.push(state);
    plot.ends = [min, max];
    plot.library.setScale("x", { min, max });
    plot.library.redraw(false, false);
  };
  plot.whole = whole;
  const said = element("p", { class: "quiet lane-said", "aria-live": "polite" }, " ");
  plot.onCursor = (each) => {
    if (each.cursor.left < 0) return;
    const at = each.posToVal(each.cursor.left, "x");
    if (marks.length) return isHeld || sayMark(said, nearestMark(each, part.lanes));
    const now = part.lanes.map((lane) => [lane.name, (lane.stays ?? []).find((stay) => stay.begin <= at && at < stay.end)?.state ?? "–"]);
    said.textContent = `${numberText(at, 6)} ${part.across}: ${now.map(([name, state]) => `${name} ${state}`).join(", ")}`;
  };
  plot.frame.after(said, legendOf(part.colours ?? {}));
  let isHeld = false;
  plot.frame.addEventListener("click", () => {
    isHeld = marks.length > 0 && sayMark(said, nearestMark(plot.library, part.lanes));
  });
  return plot;
}

/** What colours mean. */
const legendOf = (colours) => element("ul", { class: "legend" }, Object.entries(colours).map(([words, name]) =>
  element("li", {}, element("span", { class: "swatch", style: `background:var(--${name})`, "aria-hidden": "true" }), words)));

/** Where a mark is drawn, in pixels of the page. */
function placeOfMark(plot, mark, row, rows) {
  return [plot.valToPos(mark.at, "x"), plot.valToPos(rows - row - 1 + 0.1 + 0.8 * (mark.height ?? 0.5), "y")];
}

/** The mark that is next to the cursor and near it. */
function nearestMark(plot, lanes) {
  let found = null, least = NEAR;
  lanes.forEach((lane, row) => (lane.marks ?? []).forEach((mark) => {
    const [left, top] = placeOfMark(plot, mark, row, lanes.length);
    const far = Math.hypot(left - plot.cursor.left, top - plot.cursor.top);
    if (far < least) [found, least] = [mark, far];
  }));
  return found;
}

/** Say what a mark is, how it is shown again, and where it stands; return whether there is one. */
function sayMark(said, mark) {
  const more = mark === null ? ["\u00a0"] : [mark.words, mark.command ? [" ", cell({ kind: "code", text: mark.command })] : [], mark.href ? [" ", cell({ text: "more", href: mark.href })] : []];
  said.replaceChildren(...more.flat());
  return mark !== null;
}

function drawMarks(plot, lanes) {
  const { ctx } = plot, size = 4 * devicePixelRatio;
  const { left, top, width, height } = plot.bbox;
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  lanes.forEach((lane, row) => (lane.marks ?? []).forEach((mark) => {
    const [x, y] = placeOfMark(plot, mark, row, lanes.length);
    ctx.fillStyle = colour(mark.colour || "good");
    ctx.fillRect(left + x * devicePixelRatio - size / 2, top + y * devicePixelRatio - size / 2, size, size);
  }));
  ctx.restore();
}

function drawLanes(plot, lanes, names) {
  const { ctx, bbox } = plot;
  lanes.forEach((lane, row) => {
    const [top, bottom] = [lanes.length - row, lanes.length - row - 1].map((y) => plot.valToPos(y, "y", true));
    for (const stay of lane.stays ?? []) {
      const [left, right] = [stay.begin, stay.end].map((x) => Math.min(Math.max(plot.valToPos(x, "x", true), bbox.left), bbox.left + bbox.width));
      if (right < left || (right === left && (stay.end < plot.scales.x.min || stay.begin > plot.scales.x.max))) continue;
      ctx.fillStyle = colour(nameOfCurve(names.indexOf(stay.state)));
      ctx.fillRect(left, top + 2, Math.max(right - left - 0.5, 1), bottom - top - 4);
      ctx.font = `${11 * devicePixelRatio}px system-ui`;
      if (ctx.measureText(stay.state).width + 8 < right - left) {
        ctx.fillStyle = colour("paper");
        ctx.textAlign = "center";
        ctx.fillText(stay.state, (left + right) / 2, (top + bottom) / 2 + 4 * devicePixelRatio);
      }
    }
  });
}
