// The state of the page: which scene, which loop, what is shown. Undo, the address and saved files hold this and nothing else.

const PAGE = JSON.parse(document.getElementById("data").textContent);
const CHARTS = PAGE.scenes.map((scene) => new Chart(scene, PAGE.tables, PAGE.shares));
const COMPONENTS = ["x", "y", "heading"], DIRECTIONS = ["forward", "sideways", "turning"];
const PHASES = 256, MOST_UNDONE = 200;
const DIGITS = /^[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?$/;
const REST = 1e-3;  // amplitude below which a point is not found from its shape

let state = initial(0);
const chartOf = (s = state) => CHARTS[s.scene];

/** Return the state in which a scene is first shown: its own gait. */
function initial(scene) {
  const { gait, frame, family } = CHARTS[scene];
  return {
    scene, loop: presetOf(gait) || "own", points: presetOf(gait) === "points" ? gait.points : [], amplitude: gait.amplitude, centre: [...gait.centre],
    reverse: gait.reverse, frequency: gait.frequency, component: 0, frame, value: family ? family.own : null,
  };
}

/** Return the name of the preset that a gait is, if it is one. */
function presetOf(gait) {
  if (gait.points) return gait.points.length > MOST_POINTS ? undefined : "points";
  return Object.keys(PRESETS).find((name) => JSON.stringify(PRESETS[name]) === JSON.stringify({ cos: gait.cos, sin: gait.sin }));
}

/** Return the unit curve of a state. */
function loopOf(s = state) {
  return s.loop === "points" ? { points: s.points } : s.loop === "own" ? CHARTS[s.scene].gait : PRESETS[s.loop];
}

// The address ------------------------------------------------------------------------------------------------------------------

function addressOf(s) {
  const parts = { scene: CHARTS[s.scene].name, loop: s.loop };
  if (s.loop === "points") parts.points = s.points.map((p) => p.join(",")).join(";");
  Object.assign(parts, {
    amplitude: s.amplitude, centre: s.centre.join(","), reverse: Number(s.reverse), component: COMPONENTS[s.component], frame: s.frame,
  });
  if (s.value !== null) parts.value = s.value;
  if (s.frequency !== null) parts.frequency = s.frequency;
  const plain = (text) => encodeURIComponent(wellFormed(text)).replace(/%2C/g, ",").replace(/%3B/g, ";");
  return Object.entries(parts).map(([name, value]) => `${name}=${plain(value)}`).join("&");
}

/** Return a text without halves of letters, which a name of a file may have and no address can. */
const wellFormed = (text) => String(text).replace(/[\uD800-\uDFFF]/gu, "\uFFFD");

function number(text, most = PAGE.largest) {
  const value = DIGITS.test(text) ? Number(text) : NaN;
  if (!(Math.abs(value) <= most)) throw new Error(`${JSON.stringify(text.slice(0, 20))} is no number from -${most} to ${most}`);
  return value;
}

function pair(text) {
  const values = text.split(",").map((x) => number(x));
  if (values.length !== 2) throw new Error("a shape has two angles");
  return values;
}

/** Return the state of an address. Unknown names in it are left out; an Error says what cannot be read. */
function stateOf(address) {
  const given = new URLSearchParams(address.replace(/\+/g, "%2B")), name = given.get("scene");
  const scene = name === null ? 0 : CHARTS.findIndex((chart) => wellFormed(chart.name) === name);
  if (scene < 0) throw new Error(`no scene ${JSON.stringify(name.slice(0, 40))} in this page`);
  const s = initial(scene), { frames, family } = CHARTS[scene];
  if (given.has("loop")) s.loop = chosen(given.get("loop"), ["own", "points", ...Object.keys(PRESETS)], "loop");
  if (s.loop === "points" && given.has("points")) s.points = given.get("points").split(";").map(pair);
  if (s.loop === "points") checkPoints(s.points);
  if (given.has("amplitude")) s.amplitude = number(given.get("amplitude"));
  if (given.has("centre")) s.centre = pair(given.get("centre"));
  if (given.has("reverse")) s.reverse = chosen(given.get("reverse"), ["0", "1"], "reverse") === "1";
  if (given.has("component")) s.component = COMPONENTS.indexOf(chosen(given.get("component"), COMPONENTS, "component"));
  if (given.has("frame")) s.frame = chosen(given.get("frame"), Object.keys(frames), "frame");
  if (family && given.has("value")) s.value = withinFamily(family, number(given.get("value"), Number.MAX_VALUE));
  if (given.has("frequency")) s.frequency = checkedValue(number(given.get("frequency")), PAGE.gaits.circle.frequency.schema, "frequency");
  return s;
}

function chosen(text, known, what) {
  if (!known.includes(text)) throw new Error(`no ${what} ${JSON.stringify(text.slice(0, 20))}: one of ${known.join(", ")}`);
  return text;
}

const withinFamily = ({ values }, x) => Math.min(values[values.length - 1], Math.max(values[0], x));

let addressing;

/** Write the state into the address, at most five times per second. */
function showAddress() {
  clearTimeout(addressing);
  addressing = setTimeout(() => history.replaceState(null, "", "#" + addressOf(state)), 200);
}

// Undo -------------------------------------------------------------------------------------------------------------------------

const past = [], future = [];
let running = "";

/** Remember the state `before` a change, if it has changed. Changes of one `kind` that follow each other are taken back together. */
function remember(before, kind = "") {
  if (before === JSON.stringify(state)) return;
  if (kind && kind === running) return;
  running = kind;
  past.push(before);
  if (past.length > MOST_UNDONE) past.shift();
  future.length = 0;
}

/** Go back to the last remembered state, or forth again. */
function step(from, to) {
  if (!from.length) return;
  to.push(JSON.stringify(state));
  state = JSON.parse(from.pop());
  running = "";
}

// Handles ----------------------------------------------------------------------------------------------------------------------

/** Return the points by which the loop is dragged, of the unit curve. */
function handles() {
  if (state.loop === "points") return state.points;
  const at = curve(loopOf()), count = HANDLES[state.loop] || 16;
  return Array.from({ length: count }, (_, i) => at(TAU * i / count).slice(0, 2).map((x) => rounded(x, Math.abs(state.amplitude))));
}

/** Return a number to 1e-4, and one of the unit curve to as much of an angle. */
const rounded = (x, size = 1) => Number(x.toFixed(4 + Math.max(0, Math.ceil(Math.log10(size)))));
const toShape = (p) => p.map((x, d) => state.centre[d] + state.amplitude * x);

/** Return the point of the unit curve that is at a shape; an Error at rest, where all points are. */
function toPoint(shape) {
  const size = Math.abs(state.amplitude);
  if (size < REST) throw new Error("all points lie at the centre: raise the amplitude first");
  return shape.map((x, d) => rounded((x - state.centre[d]) / state.amplitude, size));
}

/** Take points for those of the loop, and make it one through points; an Error, and the loop as it was, unless they make one. */
function takePoints(points) {
  Object.assign(state, { points: checkPoints(points), loop: "points" });
}
