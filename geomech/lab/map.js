// The map: the CCF of one component in colours, its zero line, where its sign is not known, and the loop with its handles.

const SVG = "http://www.w3.org/2000/svg", FINE = 121;
const MARGIN = { left: 50, right: 84, top: 26, bottom: 42 };

/** Return a new element of SVG. */
function drawn(name, attributes = {}, text = undefined) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

const minus = (text) => text.replace("-", "\u2212");

/** Return round numbers from low to high, about so many. */
function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 2.5, 5, 10].find((x) => x * power >= 0.999 * rough);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
}

const tickText = (x) => minus(String(Number(x.toFixed(6))));

/** Return the colour of a value from 0 to 1. */
function colour(x) {
  const last = PAGE.colours.length - 1, place = Math.min(1, Math.max(0, x)) * last, k = Math.min(last - 1, Math.floor(place));
  return PAGE.colours[k].map((c, d) => c + (place - k) * (PAGE.colours[k + 1][d] - c));
}

const map = { size: 400, parts: {}, known: new Map() };

/** Return {url, zero, hatched, top, empty}: the picture of a component, its paths on FINE by FINE points, the end of its scale. */
function picture(chart, frame, component) {
  const key = [chart.name, chart.value, frame, component].join("|");
  if (!map.known.has(key)) {
    if (map.known.size > 40) map.known.clear();
    map.known.set(key, newPicture(chart, chart.frames[frame], component));
  }
  return map.known.get(key);
}

function newPicture(chart, { ccf, error }, component) {
  const values = new Float64Array(FINE * FINE), errors = new Float64Array(FINE * FINE), out = new Float64Array(3);
  let largest = 0;
  const place = (d, i) => chart.low[d] + i / (FINE - 1) * (chart.high[d] - chart.low[d]);
  for (let i = 0; i < FINE; i++) {
    for (let j = 0; j < FINE; j++) {
      ccf.at(place(0, i), place(1, j), out);
      values[i * FINE + j] = out[component];
      largest = Math.max(largest, ...out.map(Math.abs));
      errors[i * FINE + j] = error.at(place(0, i), place(1, j), out)[component];
    }
  }
  const sizes = Float64Array.from(values, Math.abs).sort(), empty = sizes[sizes.length - 1] < 1e-9 * largest;
  if (empty) values.fill(0);
  const top = empty ? 1 : sizes[Math.floor(0.995 * (sizes.length - 1))];  // single points next to kinks set no scale
  const unknown = (i, j) => !empty && errors[i * FINE + j] > Math.abs(values[i * FINE + j]);
  return { url: painted(values, top), zero: empty ? "" : zeroLine(values, unknown), hatched: cells(unknown), top, empty };
}

function painted(values, top) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = FINE;
  const context = canvas.getContext("2d"), image = context.createImageData(FINE, FINE);
  for (let i = 0; i < FINE; i++) {
    for (let j = 0; j < FINE; j++) image.data.set([...colour(0.5 + values[i * FINE + j] / top / 2), 255], 4 * ((FINE - 1 - j) * FINE + i));
  }
  context.putImageData(image, 0, 0);
  return canvas.toDataURL();
}

/** Return the path of the cells that a test picks out, joined along rows. */
function cells(picked) {
  const last = FINE - 1, within = (x) => Math.min(last, Math.max(0, x));
  let path = "";
  for (let j = 0; j < FINE; j++) {
    for (let i = 0; i < FINE; i++) {
      if (!picked(i, j)) continue;
      const first = i;
      while (i + 1 < FINE && picked(i + 1, j)) i++;
      path += `M${within(first - 0.5)} ${last - within(j + 0.5)}H${within(i + 0.5)}V${last - within(j - 0.5)}H${within(first - 0.5)}Z`;
    }
  }
  return path;
}

/** Return the path of the zero line by marching squares, but for squares whose sign is nowhere known. */
function zeroLine(values, unknown) {
  const last = FINE - 1;
  let path = "";
  for (let i = 0; i < last; i++) {
    for (let j = 0; j < last; j++) {
      const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
      if (corners.every(([p, q]) => unknown(p, q))) continue;
      const cuts = [];
      corners.forEach((a, k) => {
        const b = corners[(k + 1) % 4], u = values[a[0] * FINE + a[1]], v = values[b[0] * FINE + b[1]];
        if ((u < 0) === (v < 0)) return;
        const [x, y] = a.map((p, d) => p + u / (u - v) * (b[d] - p));
        cuts.push(`${x.toFixed(2)} ${(last - y).toFixed(2)}`);
      });
      for (let k = 0; k + 1 < cuts.length; k += 2) path += `M${cuts[k]}L${cuts[k + 1]}`;
    }
  }
  return path;
}

/** Return where a shape is on the picture, and the shape at a place. */
function toMap([a, b]) {
  const { low, high } = chartOf();
  return [MARGIN.left + (a - low[0]) / (high[0] - low[0]) * map.size, MARGIN.top + (high[1] - b) / (high[1] - low[1]) * map.size];
}
function fromMap(x, y) {
  const { low, high } = chartOf();
  return [low[0] + (x - MARGIN.left) / map.size * (high[0] - low[0]), high[1] - (y - MARGIN.top) / map.size * (high[1] - low[1])];
}

/** Draw the map anew: picture, axes, scale. */
function drawMap() {
  const chart = chartOf(), box = document.getElementById("map"), width = Math.max(280, Math.min(box.clientWidth, 620));
  map.size = width - MARGIN.left - MARGIN.right;
  const height = map.size + MARGIN.top + MARGIN.bottom, found = picture(chart, state.frame, state.component), k = map.size / (FINE - 1);
  const label = `Map of the CCF, ${DIRECTIONS[state.component]}, with the loop`;
  const svg = drawn("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "group", "aria-label": label, xmlns: SVG });
  svg.append(definitions(k), drawn("image", { href: found.url, x: MARGIN.left, y: MARGIN.top, width: map.size, height: map.size, preserveAspectRatio: "none" }));
  const inner = drawn("g", { transform: `translate(${MARGIN.left} ${MARGIN.top}) scale(${k})` });
  inner.append(drawn("path", { d: found.hatched, fill: "url(#hatch)" }), drawn("path", { d: found.zero, fill: "none", stroke: "#333", "stroke-width": 1 / k }));
  svg.append(inner, frameOf(), ...axes(chart, height), ...scale(chart, found));
  drawLoopParts(svg);
  box.replaceChildren(svg);
  map.svg = svg;
}

function definitions(k) {
  const all = drawn("defs"), hatch = drawn("pattern", { id: "hatch", width: 4.5, height: 8, patternUnits: "userSpaceOnUse", patternTransform: `scale(${1 / k})` });
  hatch.append(drawn("path", { d: "M1 0V8", stroke: "#222", "stroke-width": 0.7 }));
  const colours = drawn("linearGradient", { id: "colours", x1: 0, y1: 1, x2: 0, y2: 0 }), last = PAGE.colours.length - 1;
  PAGE.colours.forEach((c, i) => colours.append(drawn("stop", { offset: i / last, "stop-color": `rgb(${c})` })));
  const inside = drawn("clipPath", { id: "inside" });
  inside.append(drawn("rect", { x: MARGIN.left, y: MARGIN.top, width: map.size, height: map.size }));
  all.append(hatch, colours, inside);
  return all;
}

const frameOf = () => drawn("rect", { x: MARGIN.left, y: MARGIN.top, width: map.size, height: map.size, fill: "none", stroke: "#555", class: "axis" });

function axes(chart, height) {
  const bottom = MARGIN.top + map.size, middle = map.size / 2;
  const marks = ticks(chart.low[0], chart.high[0], 6).flatMap((t) => {
    const [x] = toMap([t, 0]);
    return [drawn("path", { d: `M${x} ${bottom}v4`, stroke: "#555", class: "axis" }), drawn("text", { x, y: bottom + 17, "text-anchor": "middle" }, tickText(t))];
  });
  marks.push(...ticks(chart.low[1], chart.high[1], 6).flatMap((t) => {
    const [, y] = toMap([0, t]);
    return [drawn("path", { d: `M${MARGIN.left} ${y}h-4`, stroke: "#555", class: "axis" }), drawn("text", { x: MARGIN.left - 8, y: y + 4, "text-anchor": "end" }, tickText(t))];
  }));
  const below = drawn("text", { x: MARGIN.left + middle, y: height - 6, "text-anchor": "middle" }, shapeName(chart, 0));
  const beside = drawn("text", { transform: `translate(14 ${MARGIN.top + middle}) rotate(-90)`, "text-anchor": "middle" }, shapeName(chart, 1));
  return [...marks, below, beside];
}

/** Return the name of a shape variable with its unit, with Greek letters and lowered numbers. */
function shapeName(chart, k) {
  const [name, unit] = chart.labels[k], lowered = (digits) => [...digits].map((d) => "₀₁₂₃₄₅₆₇₈₉"[d]).join("");
  return `${name.replace("alpha", "α").replace(/_(\d+)/, (_, digits) => lowered(digits))} (${unit})`;
}

function scale(chart, { top, empty }) {
  const left = MARGIN.left + map.size + 14, unit = state.component === 2 ? "rad" : chart.unit;
  const marks = (empty ? [0] : ticks(-top, top, 8)).flatMap((t) => {
    const y = MARGIN.top + map.size * (0.5 - t / top / 2);
    return [drawn("path", { d: `M${left + 12} ${y}h3`, stroke: "#555", class: "axis" }), drawn("text", { x: left + 18, y: y + 4 }, tickText(t))];
  });
  const name = empty ? "CCF: zero by symmetry" : `CCF, ${DIRECTIONS[state.component]} (${unit}/rad²)`;
  const bar = drawn("rect", { x: left, y: MARGIN.top, width: 12, height: map.size, fill: "url(#colours)", stroke: "#555", class: "axis" });
  return [bar, ...marks, drawn("text", { x: left + 12, y: 16, "text-anchor": "end" }, name)];
}

function drawLoopParts(svg) {
  const group = drawn("g", { "clip-path": "url(#inside)" });
  map.parts = {
    halo: drawn("path", { fill: "none", stroke: "#fff", "stroke-opacity": 0.8, "stroke-width": 5, "stroke-linejoin": "round" }),
    line: drawn("path", { fill: "none", stroke: "#111", "stroke-width": 2, "stroke-linejoin": "round" }),
    arrow: drawn("path", { fill: "#111", d: "M8 0L-6 -6L-3 0L-6 6Z" }),
    target: drawn("path", { class: "target" }),
    now: drawn("circle", { r: 6.5, fill: "#d1495b", stroke: "#fff", "stroke-width": 1.8, "pointer-events": "none" }),
    handles: drawn("g"),
  };
  const { halo, line, arrow, target, now, handles: group_of_handles } = map.parts;
  group.append(halo, line, arrow, target);
  svg.append(group, now, group_of_handles);
}

/** Draw the loop and its handles, which keep the focus. */
function drawLoop(loop) {
  const points = [];
  for (let i = 0; i < PHASES; i++) points.push(toMap([loop.alpha[2 * i], loop.alpha[2 * i + 1]]));
  const path = `M${points.map((p) => p.map((x) => x.toFixed(1)).join(" ")).join("L")}Z`, { parts } = map;
  for (const part of [parts.halo, parts.line, parts.target]) part.setAttribute("d", path);
  const k = 40, [p, q] = [points[k], points[k + 1]], turn = Math.atan2(q[1] - p[1], q[0] - p[0]) * 180 / Math.PI;
  parts.arrow.setAttribute("transform", `translate(${p}) rotate(${turn})`);
  const places = handles().map((point) => toMap(toShape(point)));
  while (parts.handles.children.length > places.length + 1) parts.handles.lastChild.remove();
  while (parts.handles.children.length < places.length + 1) parts.handles.append(newHandle(parts.handles.children.length));
  [toMap(state.centre), ...places].forEach(([x, y], i) => parts.handles.children[i].setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`));
}

/** Return a handle: number 0 is the centre of the loop, the others its points. */
function newHandle(k) {
  const label = k ? `point ${k} of the loop: arrows move it, Insert adds one, Delete removes it` : "centre of the loop: arrows move it";
  const handle = drawn("g", { class: "handle", tabindex: 0, role: "button", "aria-label": label, "data-handle": k ? k - 1 : "centre" });
  handle.append(drawn("circle", { class: "hit", r: 15 }));
  if (k) handle.append(drawn("circle", { class: "ring", r: 5.5 }));
  else handle.append(drawn("path", { d: "M-8 0H8M0 -8V8", stroke: "#fff", "stroke-width": 4.5, "pointer-events": "none" }), drawn("path", { class: "ring", d: "M-7 0H7M0 -7V7" }));
  return handle;
}
