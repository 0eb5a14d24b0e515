// The state as files and lines for Python, and loops from files.

const LONGEST_FILE = 1e6, MOST_TERMS = 200;  // characters of a scene, harmonics of a loop in it
const SEEN = 1e-3;  // rad: of the width of a line on the map
const literal = (x) => (/^-?\d+$/.test(String(x)) ? `${x}.0` : String(x));
const row = (values) => `[${values.map(literal).join(", ")}]`;
const rows = (values) => `[${values.map(row).join(", ")}]`;

/** Return kind, and the keys and values that describe the unit curve, as scenes and geomech.mathematics.gaits name them. */
function described() {
  if (state.loop === "circle" || state.loop === "butterfly") return [state.loop, {}];
  const loop = loopOf();
  return loop.points ? ["points", { points: rows(loop.points) }] : ["fourier", { cos: rows(loop.cos), sin: rows(loop.sin) }];
}

/** Return the scene with this loop as a file. */
function asToml() {
  const chart = chartOf(), [kind, own] = described();
  const keys = { kind: `"${kind}"`, ...own, amplitude: literal(state.amplitude), centre: row(state.centre), reverse: String(state.reverse) };
  if (state.frequency !== null) keys.frequency = literal(state.frequency);
  const lines = Object.entries(keys).map(([name, value]) => `${name} = ${value}`);
  const rest = chart.family ? chart.toml.join(literal(state.value)) : chart.toml[0];
  return `${rest}\n[gait]\n${lines.join("\n")}\n`;
}

/** Return a text as a string of Python, in which all that is no ASCII is an escape. */
function quoted(text) {
  return JSON.stringify(text).replace(/[^ -~]/g, (letter) => `\\u${letter.charCodeAt(0).toString(16).padStart(4, "0")}`);
}

/** Return lines of Python that repeat what the page shows, and the force balance beside it. */
function asPython() {
  const [kind, own] = described(), name = kind[0].toUpperCase() + kind.slice(1);
  const sizes = { ...own, amplitude: literal(state.amplitude), centre: row(state.centre), reverse: state.reverse ? "True" : "False" };
  const call = Object.entries(sizes).map(([key, value]) => `${key}=${value}`).join(", ");
  const chart = chartOf(), varied = chart.family && state.value !== chart.family.own;
  return [
    "import geomech",
    `from geomech.mathematics.gaits import ${name}`,
    varied ? `study = geomech.study("loop.toml")  # the saved scene: ${chart.family.key} = ${state.value}` : `study = geomech.study(${quoted(chart.name)})`,
    ...(state.frame === chart.frame ? [] : [`study = study.in_frame(${quoted(state.frame)})`]),
    `gait = ${name}(${call})`,
    "print(study.displacement(gait=gait))",
  ].join("\n");
}

/** Return a command that does the same with the saved scene. */
const asCommand = () => "geomech run loop.toml";

/** Return the numbers that are shown: net poses by tier, then shape and pose by phase. */
function asCsv() {
  const { prediction, loop } = shown, unit = chartOf().unit, lines = [`# ${addressOf(state)}`];
  lines.push(`tier,x (${unit}),y (${unit}),heading (rad),error (${unit}),error of heading (rad)`);
  for (const tier of TIERS) lines.push([tier, ...prediction[tier].net, ...prediction[tier].error].join(","));
  lines.push("", `phase (rad),alpha_1,alpha_2,x (${unit}),y (${unit}),theta (rad)`);
  for (let i = 0; i <= PHASES; i++) {
    const k = 2 * (i % PHASES), pose = prediction.poses.subarray(3 * i, 3 * i + 3);
    lines.push([TAU * i / PHASES, loop.alpha[k], loop.alpha[k + 1], ...pose].join(","));
  }
  return lines.join("\n") + "\n";
}

/**
 * Return the state with the loop of a file, and what the page changes in it, in words. An Error says what is wrong.
 */
function opened(text) {
  const tables = tablesOf(text);
  if (tables.gait === undefined) throw new Error("no [gait] in it");
  const [kind, keys] = gaitOf(tables.gait), s = JSON.parse(JSON.stringify(state));
  const { amplitude, centre, reverse } = keys;
  Object.assign(s, { loop: kind, points: [], amplitude, reverse, centre: centre.length ? centre : [0, 0] });
  s.frequency = keys.frequency ?? state.frequency;
  if (s.centre.length !== 2) throw new Error("centre has two angles");
  let change = "";
  if (kind === "points") s.points = checkPoints(withoutRepeat(keys.points));
  if (kind === "ellipse" || kind === "fourier") {
    const series = kind === "ellipse" ? ellipse(keys) : checkedSeries(keys), name = nameOf(series);
    s.loop = name || "points";
    if (!name) [s.points, change] = around(series, amplitude);
  }
  return [s, change];
}

/** Return points without the last where it is the first again. */
function withoutRepeat(points) {
  const last = points.length - 1;
  return last > 0 && JSON.stringify(points[0]) === JSON.stringify(points[last]) ? points.slice(0, last) : points;
}

/** Return the name of the loop of this page that a series is, if it is one. */
function nameOf(series) {
  const { cos, sin } = chartOf().gait, same = JSON.stringify({ cos, sin }) === JSON.stringify(series);
  return presetOf(series) || (same ? "own" : null);
}

/** Return points of a series, and how far the spline through them is from it, in words where that is seen. */
function around(series, amplitude) {
  const count = Math.min(MOST_POINTS, Math.max(24, 10 * series.cos[0].length)), at = curve(series);
  const points = checkPoints(Array.from({ length: count }, (_, i) => at(TAU * i / count).slice(0, 2)));
  const spline = sampled({ points }, 8 * count, false).alpha, truth = sampled(series, 8 * Math.max(count, series.cos[0].length), false).alpha;
  const off = distance(truth, spline) * Math.abs(amplitude);
  return [points, off > SEEN ? ` It is a spline through ${count} points here, which leaves the curve by up to ${off.toPrecision(1)} rad.` : ""];
}

/** Return the largest distance of the points of one closed line, (2 N), from another. */
function distance(line, other) {
  let largest = 0;
  for (let i = 0; i < line.length; i += 2) {
    let least = Infinity;
    for (let k = 0; k < other.length; k += 2) {
      const next = (k + 2) % other.length, [u, v] = [other[next] - other[k], other[next + 1] - other[k + 1]], [a, b] = [line[i] - other[k], line[i + 1] - other[k + 1]];
      const share = Math.min(1, Math.max(0, (a * u + b * v) / (u * u + v * v || 1)));
      least = Math.min(least, Math.hypot(a - share * u, b - share * v));
    }
    largest = Math.max(largest, least);
  }
  return largest;
}

function ellipse({ semi_axes: [a, b], tilt }) {
  const c = Math.cos(tilt), s = Math.sin(tilt);
  return { cos: [[a * c], [a * s]], sin: [[-b * s], [b * c]] };
}

function checkedSeries({ cos, sin }) {
  const rows = [...cos, ...sin], terms = rows.length ? rows[0].length : 0;
  if (cos.length !== 2 || sin.length !== 2 || !terms || rows.some((row) => row.length !== terms)) throw new Error("cos and sin have two rows of one length");
  if (terms > MOST_TERMS) throw new Error(`cos and sin have at most ${MOST_TERMS} terms here`);
  return { cos, sin };
}

/** Return the kind of a [gait], and all keys that its declaration has: those given, checked, in radians, else their defaults. */
function gaitOf(table) {
  if (!isTable(table)) throw new Error("[gait] is no table");
  const { kind } = table, kinds = Object.keys(PAGE.gaits);
  if (!kinds.includes(kind)) throw new Error(`a loop is one of ${kinds.join(", ")}, not ${shortly(kind)}`);
  const declared = PAGE.gaits[kind], keys = {};
  for (const [spelling, value] of Object.entries(table)) {
    if (spelling === "kind") continue;
    const name = Object.keys(declared).find((one) => one === spelling || (declared[one].degrees && `${one}_deg` === spelling));
    if (name === undefined) throw new Error(`cannot use ${shortly(spelling)}: a ${kind} has ${Object.keys(declared).join(", ")}`);
    if (Object.hasOwn(keys, name)) throw new Error(`${name} is given twice`);
    keys[name] = checkedValue(spelling === name ? value : inRadians(value), declared[name].schema, name);
  }
  for (const [name, { required, default: usual }] of Object.entries(declared)) {
    if (Object.hasOwn(keys, name)) continue;
    if (required) throw new Error(`a ${kind} has no ${name}`);
    keys[name] = usual;
  }
  return [kind, keys];
}

const isTable = (value) => typeof value === "object" && !Array.isArray(value) && !(value instanceof Moment);
const shortly = (value) => (JSON.stringify(value) ?? "nothing").slice(0, 40);

function inRadians(value) {
  if (Array.isArray(value)) return value.map(inRadians);
  return typeof value === "number" ? value * Math.PI / 180 : value;
}

/** Return a value of a key; an Error unless it is of the type and within the bounds of its JSON Schema. */
function checkedValue(value, schema, name) {
  const { type, minimum = -PAGE.largest, maximum = PAGE.largest } = schema;
  if (type === "number" && !(typeof value === "number" && minimum <= value && value <= maximum)) {
    throw new Error(`${name} is a number from ${minimum} to ${maximum}, not ${typeof value === "number" ? value : shortly(value)}`);
  }
  if (type === "boolean" && typeof value !== "boolean") throw new Error(`${name} is true or false, not ${shortly(value)}`);
  if (type !== "array") return value;
  const { minItems = 0, maxItems = Infinity, prefixItems, items } = schema;
  if (!Array.isArray(value) || value.length < minItems || value.length > maxItems) throw new Error(`${name} is a list${prefixItems ? ` of ${prefixItems.length}` : ""}, not ${shortly(value)}`);
  return value.map((one, k) => checkedValue(one, prefixItems ? prefixItems[k] : items, name));
}

/** Let the browser save a text or a blob. */
function save(name, content, type) {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type })), link = document.createElement("a");
  Object.assign(link, { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
