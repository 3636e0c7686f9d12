"use strict";
/* Places on a plane, with equal scales: the world from above, and curves of y over x. Up is up.
   A plane has: `element`, `set(values)`: port -> value, which moves its bodies. */

const TRAIL = 2000;
let clips = 0;

/** The number that a bound names among values of ports; null if it is not there. */
function numberOf(bound, values) {
  if (!bound) return 0;
  let value = values[bound.port];
  if (bound.field) value = value?.[bound.field];
  if (typeof value === "number") return value * (bound.scale ?? 1) + (bound.offset ?? 0);
  return bound.otherwise ? numberOf(bound.otherwise, values) : null;
}

/** Corners of the box around places, with room. */
function around(places, room) {
  const xs = places.map(([x]) => x), ys = places.map(([, y]) => y);
  return [Math.min(...xs) - room, Math.max(...xs) + room, Math.min(...ys) - room, Math.max(...ys) + room];
}

function coveredBy(each) {
  if (each.form !== "circle" && each.form !== "sector") return each.points;
  const [[x, y]] = each.points, r = each.radius;
  return [[x - r, y - r], [x + r, y + r]];
}

/** A round step, so that there are eight of them at most. */
function stepOf(span) {
  const power = 10 ** Math.floor(Math.log10(span / 8));
  return [1, 2, 5, 10].map((each) => each * power).find((each) => span / each <= 8);
}

/** A grid in round steps with its numbers; `scale` is how long a unit is drawn upwards. */
function gridOf([west, east, south, north], across, up, scale) {
  const [wide, high] = [east - west, (north - south) / scale];
  const [step, rise] = scale === 1 ? Array(2).fill(stepOf(Math.max(wide, high))) : [stepOf(wide), stepOf(high)];
  const size = Math.max(wide, north - south) / 38, group = shape("g", { class: "grid" });
  for (let n = Math.ceil(west / step); n * step <= east; n++) {
    const x = n * step;
    group.append(shape("line", { x1: x, x2: x, y1: -south, y2: -north }),
      shape("text", { x, y: -south + size * 1.5, "text-anchor": "middle", "font-size": size }, numberText(x, 4)));
  }
  for (let n = Math.ceil(south / scale / rise); n * rise * scale <= north; n++) {
    const y = n * rise * scale;
    group.append(shape("line", { x1: west, x2: east, y1: -y, y2: -y }),
      shape("text", { x: west - size / 2, y: -y + size / 3, "text-anchor": "end", "font-size": size }, numberText(n * rise, 4)));
  }
  group.append(
    shape("text", { x: (west + east) / 2, y: -south + size * 3, "text-anchor": "middle", "font-size": size }, across),
    shape("text", { x: west - size * 3.5, y: -(south + north) / 2, "text-anchor": "middle", "font-size": size, transform: `rotate(-90 ${west - size * 3.5} ${-(south + north) / 2})` }, up));
  return [group, size];
}

const SHAPES = {
  circle: ({ points: [[x, y]], radius }) => shape("circle", { cx: x, cy: -y, r: radius }),
  polygon: ({ points }) => shape("polygon", { points: points.map(([x, y]) => `${x},${-y}`).join(" ") }),
  line: ({ points }) => shape("polyline", { points: points.map(([x, y]) => `${x},${-y}`).join(" ") }),
  sector: ({ points: [apex], radius, direction_rad = 0, half_rad = 0 }) => shape("path", { d: sector(apex, radius, direction_rad, half_rad) }),
};

function sector([x, y], radius, direction, half) {
  const [left, right] = [direction + half, direction - half].map((angle) => `${x + radius * Math.cos(angle)},${-(y + radius * Math.sin(angle))}`);
  return `M${x},${-y} L${left} A${radius},${radius} 0 0 1 ${right} Z`;
}

function figure(each) {
  const made = SHAPES[each.form](each);
  made.setAttribute("class", `${each.form} ${each.look ?? "thing"}`);
  if (each.colour) made.style.setProperty("--own", `var(--${each.colour})`);
  if (each.name) made.append(shape("title", {}, each.name));
  return made;
}

/** The picture in its frame. */
function board(part, box, across, up, scale = 1) {
  const [west, east, south, north] = box;
  const [grid, size] = gridOf(box, across, up, scale);
  const left = west - size * 5, top = -north - size, width = east - left + size, height = north - south + size * 5;
  const clip = `clip${clips++}`;
  const inside = shape("g", { "clip-path": `url(#${clip})` });
  const svg = shape("svg", { viewBox: `${left} ${top} ${width} ${height}`, role: "img", "aria-label": part.said ? `${part.title}. ${part.said}` : part.title, class: "plane" },
    shape("clipPath", { id: clip }, shape("rect", { x: west, y: -north, width: east - west, height: north - south })), grid, inside);
  return { svg, inside, size };
}

function squared([west, east, south, north], most) {
  const [wide, high] = [east - west, north - south];
  const [x, y] = [Math.max(wide, high / most) / 2, Math.max(high, wide / most) / 2];
  const [cx, cy] = [(west + east) / 2, (south + north) / 2];
  return [cx - x, cx + x, cy - y, cy + y];
}

/** The world from above. */
function planeOf(part) {
  const bodies = part.bodies ?? [], shapes = part.shapes ?? [];
  const places = [...shapes.flatMap(coveredBy), ...bodies.flatMap((each) => each.shapes.flatMap(coveredBy))];
  const reach = Math.max(0.01, ...bodies.flatMap((each) => each.shapes.flatMap(coveredBy)).map(([x, y]) => Math.hypot(x, y)));
  const [west, east, south, north] = around(places.length ? places : [[-1, -1], [1, 1]], bodies.length ? reach * 0.6 : 0.1);
  const box = squared([...(part.across_ends ?? [west, east]), ...(part.up_ends ?? [south, north])], 1.8);
  const { svg, inside, size } = board(part, box, `x (${part.unit ?? "m"})`, `y (${part.unit ?? "m"})`);
  inside.append(...shapes.map(figure));
  const moved = bodies.map((body) => bodyOf(body, inside, size));
  const said = element("p", { class: "quiet", "aria-live": "off" });
  return {
    element: element("figure", { class: "plane" }, element("figcaption", {}, part.title), svg, keyOf(shapes, bodies), bodies.length ? said : null),
    set(values) {
      const words = moved.map((each) => each(values)).filter(Boolean);
      said.textContent = words.join("; ");
    },
  };
}

function bodyOf(body, inside, size) {
  const group = shape("g", { class: "moving" }, ...body.shapes.map(figure));
  const trail = body.has_trail ? shape("polyline", { class: "line path trail" }) : null;
  const arrows = (body.arrows ?? []).map((each) => {
    const line = shape("line", { class: "arrow" }, each.name ? shape("title", {}, each.name) : null);
    group.append(line);
    return [each, line];
  });
  const rays = (body.rays ?? []).map((each) => {
    const path = shape("path", { class: "sector ray" }, each.name ? shape("title", {}, each.name) : null);
    group.prepend(path);
    return [each, path];
  });
  if (trail) inside.append(trail);
  inside.append(group);
  const way = [];
  return (values) => {
    const [x, y, heading] = [body.x, body.y, body.heading_rad].map((each) => numberOf(each, values));
    group.classList.toggle("unknown", x === null || y === null || heading === null);
    if (x === null || y === null || heading === null) return `${body.name}: place not known`;
    group.setAttribute("transform", `translate(${x} ${-y}) rotate(${(-heading * 180) / Math.PI})`);
    for (const [arrow, line] of arrows) {
      const length = numberOf(arrow.length, values), [ax, ay] = arrow.at;
      line.classList.toggle("unknown", length === null);
      const end = [ax + (length ?? 0) * Math.cos(arrow.direction_rad), ay + (length ?? 0) * Math.sin(arrow.direction_rad)];
      for (const [name, value] of Object.entries({ x1: ax, y1: -ay, x2: end[0], y2: -end[1] })) line.setAttribute(name, value);
    }
    for (const [ray, path] of rays) {
      const length = ray.length ? numberOf(ray.length, values) : ray.reach;
      const isMet = length !== null && length < ray.reach;
      path.setAttribute("class", isMet ? "sector echo" : "sector ray");
      path.setAttribute("d", sector(ray.at, isMet ? length : ray.reach, numberOf(ray.direction_rad, values) ?? 0, ray.half_rad));
    }
    const last = way[way.length - 1];
    if (trail && (!last || Math.hypot(x - last[0], y - last[1]) > size / 8)) {
      way.push([x, y]);
      if (way.length > TRAIL) way.shift();
      trail.setAttribute("points", way.map(([a, b]) => `${a},${-b}`).join(" "));
    }
    return `${body.name}: x ${numberText(x, 3)}, y ${numberText(y, 3)}, ${numberText((heading * 180) / Math.PI, 3)}°`;
  };
}

function keyOf(shapes, bodies) {
  const named = new Map();
  for (const each of [...shapes, ...bodies.flatMap((body) => body.shapes)]) if (each.name && !named.has(each.name)) named.set(each.name, each);
  const looks = [...named.values()].slice(0, 14);
  return element("ul", { class: "legend" }, looks.map((each) => {
    const swatch = element("span", { class: `swatch look ${each.look ?? "thing"}`, "aria-hidden": "true" });
    if (each.colour) swatch.style.setProperty("--own", `var(--${each.colour})`);
    return element("li", {}, swatch, each.name);
  }));
}

/** Curves of y over x, or dots, with axes of their own ends. */
function crossPlot(part) {
  const points = part.curves.flatMap((each) => each.x.map((x, n) => [x, each.y[n]]).filter(([x, y]) => x !== null && y !== null));
  let [west, east, south, north] = around(points.length ? points : [[0, 0], [1, 1]], 0);
  [west, east] = part.across_ends ?? [west, east];
  [south, north] = part.up_ends ?? [south, north];
  const [wide, high] = [east - west || 1, north - south || 1];
  // without equal scales both axes are drawn as long as the picture
  const scale = part.has_equal_scales ? 1 : (0.6 * wide) / high;
  const box = [west - wide * 0.04, east + wide * 0.04, scale * (south - high * 0.04), scale * (north + high * 0.04)];
  const fitted = part.has_equal_scales ? squared(box, 1.6) : box;
  const { svg, inside } = board(part, fitted, part.across, part.up, scale);
  part.curves.forEach((each, place) => {
    const own = `var(--${each.colour || (each.style === "dashed" ? "quiet" : nameOfCurve(place))})`;
    const drawn = each.x.map((x, n) => [x, each.y[n] === null ? null : each.y[n] * scale]).filter(([x, y]) => x !== null && y !== null);
    const made = each.style === "dots"
      ? shape("g", { class: "dots" }, ...drawn.map(([x, y]) => shape("circle", { cx: x, cy: -y, r: (fitted[1] - fitted[0]) / (part.is_small ? 130 : 260) })))
      : figure({ form: "line", points: drawn, look: each.style === "dashed" ? "path dashed" : "path" });
    made.style.setProperty("--own", own);
    inside.append(made);
  });
  const legend = element("ul", { class: "legend" }, part.curves.map((each, place) => element("li", {},
    element("span", { class: "swatch", style: `background:var(--${each.colour || (each.style === "dashed" ? "quiet" : nameOfCurve(place))})`, "aria-hidden": "true" }), each.name)));
  return { element: element("figure", { class: part.is_small ? "small" : "" }, element("figcaption", {}, part.title), svg, legend, ...(part.numbers?.length ? [folded("Numbers", part.numbers)] : [])) };
}
