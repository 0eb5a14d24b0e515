// Numbers of a cycle by every tier, and displacement against amplitude.

const STYLES = { harmonic: ["var(--harmonic)", ""], path: ["var(--path)", "9 3 2 3"], area: ["var(--area)", "5 4"] };
const AMPLITUDES = 16, COARSE = 64;  // of the curves, and phases of each
const CURVE = { height: 250, left: 58, right: 12, top: 12, bottom: 40 };

/** Return a number with so many decimals, and no minus before zero. */
const fixed = (x, digits) => minus((Math.abs(x) < 0.5 * 10 ** -digits ? 0 : x).toFixed(digits));

/** Return the decimals down to the first digit of an error. */
const decimals = (error) => Math.min(8, Math.max(0, -Math.floor(Math.log10(Math.max(error, 1e-8)))));

/** Return a value with its error in words that claim no more than they know. */
function withError(value, error) {
  const digits = decimals(error);
  return `${fixed(value, digits)} ± ${error.toFixed(digits)}`;
}

function drawNumbers() {
  const { prediction } = shown, chart = chartOf(), body = document.querySelector("#numbers tbody");
  document.querySelectorAll("#numbers [data-unit]").forEach((cell) => { cell.textContent = `${cell.dataset.unit} (${chart.unit})`; });
  body.replaceChildren(...TIERS.map((tier) => {
    const line = document.createElement("tr"), head = document.createElement("th"), [stroke, dashes] = STYLES[tier];
    const key = drawn("svg", { class: "key", viewBox: "0 0 28 8", "aria-hidden": "true" });
    key.append(drawn("path", { d: "M0 4H28", stroke, "stroke-width": 2.2, "stroke-dasharray": dashes }));
    head.append(key, tier);
    head.scope = "row";
    const p = prediction && prediction[tier], cells = p ? [0, 1, 2].map((d) => withError(p.net[d], p.error[d < 2 ? 0 : 1])) : ["–", "–", "–"];
    line.append(head, ...cells.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
    if (tier === "harmonic") line.className = "best";
    return line;
  }));
  const verdict = document.getElementById("verdict");
  verdict.textContent = prediction ? judged(prediction, chart) : `The loop leaves the map, which ends at ${chart.low.map((x) => fixed(x, 2))} and ${chart.high.map((x) => fixed(x, 2))}: make it smaller.`;
  verdict.classList.toggle("wrong", !prediction);
}

function judged({ harmonic, path, area }, chart) {
  const far = Math.hypot(harmonic.net[0], harmonic.net[1]), off = (p) => Math.hypot(p.net[0] - harmonic.net[0], p.net[1] - harmonic.net[1]);
  const share = (p) => (far > 3 * harmonic.error[0] ? ` (${(100 * off(p) / far).toFixed(0)} % of the way)` : "");
  const distance = (p) => `${off(p).toPrecision(2)} ${chart.unit}${share(p)}`;
  return `The harmonic tier is the number. The path tier ends ${distance(path)} from it, the area tier ${distance(area)}: they are pictures of where displacement comes from.`;
}

/** Draw the chosen component against amplitude by all tiers, with the present loop on the curves. */
function drawCurve() {
  const chart = chartOf(), unit = sampled(loopOf(), COARSE, state.reverse), most = largest(unit, chart), c = state.component;
  const rowsOf = Object.fromEntries(TIERS.map((tier) => [tier, []]));
  for (let k = 0; k <= AMPLITUDES; k++) {
    const amplitude = most * k / AMPLITUDES, p = chart.predict(scaled(unit, amplitude, state.centre), state.frame, false);
    if (p) for (const tier of TIERS) rowsOf[tier].push([amplitude, p[tier].net[c], p[tier].error[c < 2 ? 0 : 1]]);
  }
  const { left, right, top, bottom } = CURVE, box = document.getElementById("curve"), width = Math.max(280, box.clientWidth), height = CURVE.height;
  const all = [...TIERS.flatMap((tier) => rowsOf[tier].map((p) => p[1])), ...rowsOf.harmonic.flatMap(([, v, e]) => [v - e, v + e])];
  let low = Math.min(0, ...all), high = Math.max(0, ...all);
  if (high - low < 1e-9) [low, high] = [-1e-3, 1e-3];
  [low, high] = [low - 0.08 * (high - low), high + 0.08 * (high - low)];
  const x = (a) => left + a / most * (width - left - right), y = (v) => top + (high - v) / (high - low) * (height - top - bottom);
  const at = (a, v) => `${x(a).toFixed(1)} ${y(v).toFixed(1)}`, svg = drawn("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": "Displacement against amplitude" });
  for (const t of ticks(low, high, 4)) {
    svg.append(drawn("path", { d: `M${left} ${y(t)}H${width - right}`, stroke: Math.abs(t) < 1e-12 ? "var(--zero)" : "var(--grid)" }), drawn("text", { x: left - 8, y: y(t) + 4, "text-anchor": "end" }, tickText(t)));
  }
  for (const t of ticks(0, most, 6)) svg.append(drawn("path", { d: `M${x(t)} ${height - bottom}v4`, stroke: "var(--axis)" }), drawn("text", { x: x(t), y: height - bottom + 18, "text-anchor": "middle" }, tickText(t)));
  const names = `${COMPONENTS[c]} a cycle (${c < 2 ? chart.unit : "rad"})`;
  svg.append(drawn("text", { x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, "amplitude"), drawn("text", { transform: `translate(13 ${(top + height - bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, names));
  const band = [...rowsOf.harmonic.map(([a, v, e]) => at(a, v + e)), ...rowsOf.harmonic.map(([a, v, e]) => at(a, v - e)).reverse()];
  if (band.length) svg.append(drawn("path", { d: `M${band.join("L")}Z`, fill: STYLES.harmonic[0], "fill-opacity": 0.18 }));
  svg.append(drawn("path", { d: `M${x(Math.abs(state.amplitude))} ${top}V${height - bottom}`, stroke: "var(--zero)", "stroke-dasharray": "2 4" }));
  for (const tier of [...TIERS].reverse()) {
    const [stroke, dashes] = STYLES[tier], points = rowsOf[tier].map(([a, v]) => at(a, v));
    if (points.length) svg.append(drawn("path", { d: `M${points.join("L")}`, fill: "none", stroke, "stroke-width": 2, "stroke-dasharray": dashes }));
    if (shown.prediction && state.amplitude >= 0) svg.append(drawn("circle", { cx: x(state.amplitude), cy: y(shown.prediction[tier].net[c]), r: 4.5, fill: tier === "harmonic" ? stroke : "var(--page)", stroke, "stroke-width": 1.8 }));
  }
  box.replaceChildren(svg);
}

/** Return the amplitude up to which a unit curve stays on the chart. */
function largest({ alpha }, chart) {
  let most = 1e6;
  alpha.forEach((x, i) => {
    const room = x > 0 ? chart.high[i & 1] - state.centre[i & 1] : state.centre[i & 1] - chart.low[i & 1];
    if (Math.abs(x) > 1e-9) most = Math.min(most, room / Math.abs(x));
  });
  return Math.max(most, 1e-3) * (1 - 1e-9);
}
