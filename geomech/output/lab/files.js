// The state as files and lines for Python, and loops from files.

const literal = (x) => (Number.isInteger(x) ? `${x}.0` : String(x));
const row = (values) => `[${values.map(literal).join(", ")}]`;
const rows = (values) => `[${values.map(row).join(", ")}]`;

/** Return kind, and the keys and values that describe the unit curve, as scenes and geomech.gaits name them. */
function described() {
  if (state.loop === "circle" || state.loop === "butterfly") return [state.loop, {}];
  const loop = loopOf();
  return loop.points ? ["points", { points: rows(loop.points) }] : ["fourier", { cos: rows(loop.cos), sin: rows(loop.sin) }];
}

/** Return the scene with this loop as a file. */
function asToml() {
  const chart = chartOf(), [kind, own] = described();
  const keys = { kind: `"${kind}"`, ...own, amplitude: literal(state.amplitude), centre: row(state.centre), reverse: String(state.reverse) };
  if (player.stated) keys.frequency = literal(player.frequency);
  const lines = Object.entries(keys).map(([name, value]) => `${name} = ${value}`);
  return `${chart.family ? withValue(chart.toml, chart.family.key, state.value) : chart.toml}\n[gait]\n${lines.join("\n")}\n`;
}

/** Return the text of a scene with another value of the key of a section. */
function withValue(text, name, value) {
  const [section, key] = name.split("."), start = text.indexOf(`[${section}]`), place = text.indexOf(`\n${key} = `, start) + 1;
  return `${text.slice(0, place)}${key} = ${literal(value)}${text.slice(text.indexOf("\n", place))}`;
}

/** Return lines of Python that repeat what the page shows, and the force balance beside it. */
function asPython() {
  const [kind, own] = described(), name = kind[0].toUpperCase() + kind.slice(1);
  const sizes = { ...own, amplitude: literal(state.amplitude), centre: row(state.centre), reverse: state.reverse ? "True" : "False" };
  const call = Object.entries(sizes).map(([key, value]) => `${key}=${value}`).join(", ");
  const chart = chartOf(), varied = chart.family && state.value !== chart.family.own;
  return [
    "import geomech",
    `from geomech.gaits import ${name}`,
    varied ? `study = geomech.study("loop.toml")  # the saved scene: ${chart.family.key} = ${state.value}` : `study = geomech.study(${JSON.stringify(chart.name)})`,
    ...(state.frame === chart.frame ? [] : [`study = study.in_frame(${JSON.stringify(state.frame)})`]),
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

/** Return the state with the loop of a file, and the frequency that it gives or null. An Error says what is wrong. */
function opened(text) {
  if (text.length > 1e6) throw new Error("the file is too long for a scene");
  const keys = gaitOf(text), s = JSON.parse(JSON.stringify(state));
  const allowed = { circle: [], butterfly: [], ellipse: ["semi_axes", "tilt"], fourier: ["cos", "sin"], points: ["points"] };
  if (!Object.hasOwn(allowed, keys.kind)) throw new Error(`a loop is one of ${Object.keys(allowed).join(", ")}, not ${JSON.stringify(keys.kind)}`);
  for (const key of Object.keys(keys)) {
    if (!["kind", "amplitude", "centre", "reverse", "frequency", ...allowed[keys.kind]].includes(key)) {
      throw new Error(`cannot use ${key}: give angles in radians, and keys of a ${keys.kind}`);
    }
  }
  s.amplitude = number(keys.amplitude ?? 1);
  s.centre = (keys.centre ?? [0, 0]).map((x) => number(x));
  if (s.centre.length !== 2) throw new Error("centre has two angles");
  s.reverse = keys.reverse === true;
  [s.loop, s.points] = [keys.kind, []];
  if (keys.kind === "points") s.points = checkPoints((keys.points ?? []).map((p) => p.map((x) => number(x))));
  if (keys.kind === "ellipse" || keys.kind === "fourier") {
    const series = keys.kind === "ellipse" ? ellipse(keys) : checkedSeries(keys);
    [s.loop, s.points] = nameOf(series) ? [nameOf(series), []] : ["points", around(series)];
  }
  return [s, keys.frequency === undefined ? null : number(keys.frequency, 1e4)];
}

/** Return the name of the loop of this page that a series is, if it is one. */
function nameOf(series) {
  const { cos, sin } = chartOf().gait, same = JSON.stringify({ cos, sin }) === JSON.stringify(series);
  return presetOf(series) || (same ? "own" : null);
}

/** Return points of a series, close enough for the spline through them to be that curve to 1e-4 of its size. */
function around(series) {
  const count = Math.min(MOST_POINTS, Math.max(24, 10 * series.cos[0].length)), at = curve(series);
  return Array.from({ length: count }, (_, i) => at(TAU * i / count).slice(0, 2));
}

function ellipse({ semi_axes = [1, 0.5], tilt = 0 }) {
  const [a, b] = semi_axes.map((x) => number(x)), c = Math.cos(number(tilt)), s = Math.sin(number(tilt));
  return { cos: [[a * c], [a * s]], sin: [[-b * s], [b * c]] };
}

function checkedSeries({ cos, sin }) {
  const good = (x) => Array.isArray(x) && x.length === 2 && x.every((r) => Array.isArray(r) && r.length === cos[0].length && r.length);
  if (!good(cos) || !good(sin)) throw new Error("cos and sin have two rows of one length");
  return { cos: cos.map((r) => r.map((x) => number(x))), sin: sin.map((r) => r.map((x) => number(x))) };
}

/** Return the keys of the [gait] of a scene. Its values are numbers, words, true, false, and lists of numbers. */
function gaitOf(text) {
  const lines = text.split(/\r?\n/), start = lines.findIndex((line) => /^\s*\[gait\]\s*(#.*)?$/.test(line));
  if (start < 0) throw new Error("no [gait] in it");
  const length = lines.slice(start + 1).findIndex((line) => /^\s*\[{1,2}[a-z]/i.test(line));
  const body = lines.slice(start + 1, length < 0 ? undefined : start + 1 + length).map((line) => line.replace(/#.*$/, ""));
  const keys = {};
  for (const [, key, value] of body.join("\n").matchAll(/^\s*([A-Za-z_]\w*)\s*=\s*([\s\S]*?)(?=^\s*[A-Za-z_]\w*\s*=|$(?![\s\S]))/gm)) {
    keys[key] = valueOf(key, value.trim());
  }
  return keys;
}

function valueOf(key, text) {
  const json = text.replace(/'/g, '"').replace(/,(\s*\])/g, "$1").replace(/\+(?=[\d.])/g, "").replace(/(^|[[,\s-])\.(?=\d)/g, "$10.");
  try {
    return JSON.parse(json.replace(/(\d)\.(?=[\s,\]eE]|$)/g, "$1.0").replace(/(\d)_(?=\d)/g, "$1"));
  } catch {
    throw new Error(`cannot read the value of ${key}`);
  }
}

/** Let the browser save a text or a blob. */
function save(name, content, type) {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type })), link = document.createElement("a");
  Object.assign(link, { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
