// The page: what is computed and drawn after each change, and all controls.

const $ = (id) => document.getElementById(id);
const shown = { curve: null, loop: null, prediction: null };
const STEP = 0.02, LARGE_STEP = 0.1;  // rad that arrow keys move a handle
const CLIMB_PHASES = 128;

/** Compute and draw all that follows from the loop. */
function update() {
  const chart = chartOf();
  player.frequency = state.frequency ?? USUAL;
  shown.curve = curve(loopOf());
  shown.loop = scaled(sampled(loopOf(), PHASES, state.reverse), state.amplitude, state.centre);
  shown.prediction = chart.predict(shown.loop, state.frame, true);
  drawLoop(shown.loop);
  drawNumbers();
  drawCurve();
  drawWorld();
  showControls();
  showAddress();
}

/** Draw everything anew, as after a change of scene, frame or component. */
function redraw() {
  chartOf().choose(state.value);
  drawMap();
  restart();
  update();
  describeScene();
}

function describeScene() {
  const chart = chartOf(), { family } = chart;
  $("about").textContent = visible(chart.about);
  $("foot").textContent = `geomech ${PAGE.version}. Scene ${visible(chart.name)}, checksum ${chart.checksum}: ${chart.axes.map((axis) => axis.length).join(" × ")} shapes, odd harmonics to ${chart.harmonics.width / 3 - 1}, ${PHASES} phases per cycle.`;
  $("frame").replaceChildren(...Object.keys(chart.frames).map((name) => new Option(name, name, false, name === state.frame)));
  $("family").hidden = !family;
  if (!family) return;
  const { values, key } = family;
  Object.assign($("value"), { min: values[0], max: values[values.length - 1], step: (values[values.length - 1] - values[0]) / 200 });
  $("value-name").textContent = key;
  $("family-note").textContent = `${values.length} members, interpolated between them to ${family.error.toPrecision(1)} BL; the scene's own value is ${family.own}.`;
}

function showControls() {
  const chart = chartOf();
  $("scene").value = String(state.scene);
  $("frame").value = state.frame;
  document.querySelectorAll("#component button").forEach((button, k) => button.setAttribute("aria-pressed", String(k === state.component)));
  document.querySelectorAll("#presets [data-loop]").forEach((button) => button.setAttribute("aria-pressed", String(button.dataset.loop === state.loop)));
  const slider = (id, value, digits, unit) => {
    if (document.activeElement !== $(id) || !running.startsWith(id)) $(id).value = value;
    $(`${id}-shown`).textContent = `${fixed(value, digits)}${unit}`;
  };
  slider("amplitude", state.amplitude, 2, "");
  slider("centre-1", state.centre[0], 2, " rad");
  slider("centre-2", state.centre[1], 2, " rad");
  slider("frequency", player.frequency, 2, " Hz");
  if (chart.family) slider("value", state.value, 3, "");
  $("reverse").checked = state.reverse;
  $("undo").disabled = !past.length;
  $("redo").disabled = !future.length;
  $("play").textContent = player.playing ? "Pause" : "Play";
  $("climb").textContent = climbing ? "Stop" : "Climb";
  $("python").textContent = asPython();
  $("command").textContent = asCommand();
}

/** Return a text that others wrote with escapes in place of letters that are not seen or turn the order of others. */
const visible = (text) => text.replace(/[^\P{C}\t]|[\u2028\u2029]/gu, (letter) => `\\u{${letter.codePointAt(0).toString(16)}}`);

const say = (text) => { $("said").textContent = text; };

/** Change the state, unless that raises an Error, which is said; remember the one before for undo, and draw. */
function change(kind, act, draw = update) {
  stopClimb();
  const before = JSON.stringify(state);
  attempt(act);
  remember(before, kind);
  draw();
}

/** Do something to the state, or say why it cannot be done. */
function attempt(act) {
  try {
    act();
  } catch (error) {
    say(`${error.message[0].toUpperCase()}${error.message.slice(1)}.`);
  }
}

// Dragging ---------------------------------------------------------------------------------------------------------------------

let dragged = null, waiting = false, atStart = "";

function placeOf(event) {
  const box = map.svg.getBoundingClientRect(), k = map.svg.viewBox.baseVal.width / box.width;
  return fromMap((event.clientX - box.x) * k, (event.clientY - box.y) * k);
}

/** Move a handle, or the centre, to a shape within the map. */
function move(handle, shape) {
  const { low, high } = chartOf(), within = shape.map((x, d) => rounded(Math.min(high[d], Math.max(low[d], x))));
  if (handle === "centre") state.centre = within;
  else takePoints(handles().map((p, k) => (k === handle ? toPoint(within) : [...p])));
}

function insert(after, shape) {
  const all = handles();
  takePoints([...all.slice(0, after + 1), toPoint(shape), ...all.slice(after + 1)]);
}

function remove(handle) {
  takePoints(handles().filter((p, k) => k !== handle));
}

/** Return the number of the handle after which a new one comes for a shape next to the line. */
function before(shape) {
  const { alpha } = shown.loop;
  const phaseOf = ([a, b]) => {
    let best = 0, least = Infinity;
    for (let i = 0; i < PHASES; i++) {
      const far = Math.hypot(alpha[2 * i] - a, alpha[2 * i + 1] - b);
      if (far < least) [best, least] = [i, far];
    }
    return state.reverse ? -best : best;
  };
  const here = phaseOf(shape), gaps = handles().map((p) => (here - phaseOf(toShape(p)) + 2 * PHASES) % PHASES);
  return gaps.indexOf(Math.min(...gaps));
}

function startDrag(event) {
  const handle = event.target.closest(".handle"), line = event.target.closest(".target");
  if (!handle && !line) return;
  event.preventDefault();
  map.svg.setPointerCapture(event.pointerId);
  stopClimb();
  atStart = JSON.stringify(state);
  if (handle) {
    dragged = handle.dataset.handle === "centre" ? "centre" : Number(handle.dataset.handle);
    handle.focus();
  } else {
    const shape = placeOf(event), after = before(shape);
    attempt(() => { insert(after, shape); dragged = after + 1; });
    update();
  }
}

function drag(event) {
  if (dragged === null) return;
  attempt(() => move(dragged, placeOf(event)));
  if (!waiting) {
    waiting = true;
    requestAnimationFrame(() => { waiting = false; update(); });
  }
}

function endDrag() {
  if (dragged === null) return;
  dragged = null;
  remember(atStart);
  update();
}

function pressed(event) {
  const handle = event.target.closest(".handle");
  if (!handle) return;
  const name = handle.dataset.handle, k = name === "centre" ? name : Number(name), step = event.shiftKey ? LARGE_STEP : STEP;
  const arrows = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
  if (event.key in arrows) {
    const now = k === "centre" ? state.centre : toShape(handles()[k]);
    change(`arrow ${name}`, () => move(k, now.map((x, d) => x + arrows[event.key][d])));
  } else if (event.key === "Insert" && k !== "centre") {
    change("", () => { const all = handles(), next = all[(k + 1) % all.length]; insert(k, toShape(all[k].map((x, d) => (x + next[d]) / 2))); });
  } else if ((event.key === "Delete" || event.key === "Backspace") && k !== "centre") {
    change("", () => remove(k));
    map.parts.handles.children[Math.min(k + 1, handles().length)].focus();  // the last one may be gone
  }
  else return;
  event.preventDefault();
}

// Climbing ---------------------------------------------------------------------------------------------------------------------

let climbing = null;

/** Return the chosen component of a loop's displacement by the harmonic tier, or -infinity off the map. */
function gained(points, sign) {
  const loop = scaled(sampled({ points }, CLIMB_PHASES, state.reverse), state.amplitude, state.centre), chart = chartOf();
  return chart.holds(loop) ? sign * reconstruct(chart.harmonicVelocity(loop), false).net[state.component] : -Infinity;
}

function toggleClimb() {
  if (climbing) { stopClimb(); return showControls(); }
  if (!shown.prediction) return say("Bring the loop onto the map first.");
  if (Math.abs(state.amplitude) < REST) return say("All points lie at the centre: raise the amplitude first.");
  const before = JSON.stringify(state);
  takePoints(handles().map((p) => [...p]));
  remember(before);
  climbing = { sign: shown.prediction.own[state.component] < 0 ? -1 : 1, step: 0.05 };
  requestAnimationFrame(climb);
}

function stopClimb() { climbing = null; }

/** Move all points a step along the gradient of the displacement, and go on until steps are short. */
function climb() {
  if (!climbing) return;
  const { sign } = climbing, now = gained(state.points, sign), scale = Math.max(1, Math.abs(state.amplitude)), h = 1e-4 / scale;
  const slopes = state.points.map((p, i) => [0, 1].map((d) => {
    const at = (x) => gained(state.points.map((q, j) => (j === i ? q.map((v, e) => v + (e === d ? x : 0)) : q)), sign);
    const [up, down] = [at(h), at(-h)];
    return Number.isFinite(up - down) ? (up - down) / (2 * h) : 0;
  }));
  const size = Math.max(...slopes.flat().map(Math.abs), 1e-12);
  const next = state.points.map((p, i) => p.map((x, d) => rounded(x + climbing.step / scale * slopes[i][d] / size, scale)));
  if (gained(next, sign) > now) {
    state.points = next;
    climbing.step = Math.min(0.1, 1.3 * climbing.step);
  } else climbing.step /= 2;
  if (climbing.step < 2e-4) {
    climbing = null;
    say(`Nothing nearby goes further ${DIRECTIONS[state.component]}; the start decides which summit it is.`);
  }
  update();
  if (climbing) requestAnimationFrame(climb);
}

// Controls ---------------------------------------------------------------------------------------------------------------------

function controls() {
  PAGE.scenes.forEach((scene, k) => $("scene").append(new Option(visible(scene.name), k)));
  $("scene").addEventListener("change", () => change("", () => { state = initial(Number($("scene").value)); }, redraw));
  DIRECTIONS.forEach((direction, k) => {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: direction });
    button.addEventListener("click", () => change("", () => { state.component = k; }, () => { drawMap(); update(); }));
    $("component").append(button);
  });
  $("frame").addEventListener("change", () => change("", () => { state.frame = $("frame").value; }, () => { drawMap(); update(); }));
  for (const button of document.querySelectorAll("#presets [data-loop]")) {
    button.addEventListener("click", () => change("", () => { state.loop = button.dataset.loop; }));
  }
  $("amplitude").addEventListener("input", () => change("amplitude", () => { state.amplitude = Number($("amplitude").value); }));
  [0, 1].forEach((d) => $(`centre-${d + 1}`).addEventListener("input", (event) => change(`centre-${d + 1}`, () => { state.centre[d] = Number(event.target.value); })));
  $("reverse").addEventListener("change", () => change("", () => { state.reverse = $("reverse").checked; }, () => { restart(); update(); }));
  $("frequency").addEventListener("input", () => change("frequency", () => { state.frequency = Number($("frequency").value); }));
  $("value").addEventListener("input", () => change("value", () => { state.value = Number($("value").value); }, () => { chartOf().choose(state.value); drawMap(); update(); }));
  $("undo").addEventListener("click", () => { stopClimb(); step(past, future); redraw(); });
  $("redo").addEventListener("click", () => { stopClimb(); step(future, past); redraw(); });
  $("climb").addEventListener("click", toggleClimb);
  $("play").addEventListener("click", () => { player.playing = !player.playing; showControls(); });
  $("restart").addEventListener("click", () => { restart(); drawWorld(); });
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || !["z", "y"].includes(event.key.toLowerCase())) return;
    event.preventDefault();
    $(event.key.toLowerCase() === "y" || event.shiftKey ? "redo" : "undo").click();
  });
  const box = $("map");
  box.addEventListener("pointerdown", startDrag);
  box.addEventListener("pointermove", drag);
  box.addEventListener("pointerup", endDrag);
  box.addEventListener("pointercancel", endDrag);
  box.addEventListener("keydown", pressed);
  box.addEventListener("dblclick", (event) => { const h = event.target.closest(".handle"); if (h && h.dataset.handle !== "centre") change("", () => remove(Number(h.dataset.handle))); });
  // A passive listener would let a vertical drag scroll the page.
  box.addEventListener("touchstart", (event) => { if (event.target.closest(".handle, .target")) event.preventDefault(); }, { passive: false });
  saving();
  window.addEventListener("hashchange", () => take(location.hash.slice(1)));
  window.addEventListener("resize", () => { world.svg = null; drawMap(); update(); });
}

function saving() {
  $("save-toml").addEventListener("click", () => save("loop.toml", asToml(), "application/toml"));
  $("save-svg").addEventListener("click", () => save("map.svg", mapFile(), "image/svg+xml"));
  $("save-png").addEventListener("click", savePicture);
  $("save-csv").addEventListener("click", () => (shown.prediction ? save("loop.csv", asCsv(), "text/csv") : say("The loop leaves the map.")));
  for (const [button, text] of [["copy-link", () => location.href.split("#")[0] + "#" + addressOf(state)], ["copy-python", asPython], ["copy-command", asCommand]]) {
    $(button).addEventListener("click", () => navigator.clipboard.writeText(text()).then(() => say("Copied."), () => say("The browser does not let this page copy: mark the text.")));
  }
  $("open").addEventListener("change", () => { read($("open").files[0]); $("open").value = ""; });
  document.addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("over"); });
  document.addEventListener("dragleave", () => document.body.classList.remove("over"));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("over");
    if (event.dataTransfer.files.length) read(event.dataTransfer.files[0]);
  });
}

async function read(file) {
  try {
    if (file.size > LONGEST_FILE) throw new Error("the file is too long for a scene");
    const [next, changed] = opened(await file.text());
    change("", () => { state = next; }, redraw);
    say(`Read the loop of ${visible(file.name)}.${changed}`);
  } catch (error) {
    say(`Cannot use ${visible(file.name)}: ${visible(error.message)}.`);
  }
}

/** Return the map as a file of its own, with the state in its description. */
function mapFile() {
  const copy = map.svg.cloneNode(true);
  copy.querySelectorAll(".target, .hit").forEach((part) => part.remove());
  copy.querySelectorAll(".ring").forEach((part) => { part.setAttribute("fill", "#fff"); part.setAttribute("stroke", "#111"); });
  copy.setAttribute("font-family", "sans-serif");
  copy.setAttribute("font-size", "12");
  copy.prepend(drawn("desc", {}, `geomech lab: ${addressOf(state)}`));
  return new XMLSerializer().serializeToString(copy);
}

function savePicture() {
  const image = new Image(), url = URL.createObjectURL(new Blob([mapFile()], { type: "image/svg+xml" }));
  image.addEventListener("load", () => {
    const canvas = document.createElement("canvas"), { width, height } = map.svg.viewBox.baseVal, context = canvas.getContext("2d");
    [canvas.width, canvas.height] = [2 * width, 2 * height];
    context.fillStyle = "#fff";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(image, 0, 0, canvas.width, canvas.height);
    URL.revokeObjectURL(url);
    canvas.toBlob((blob) => save("map.png", blob, "image/png"));
  });
  image.src = url;
}

/** Take the state of an address; one that cannot be read leaves the first scene, and says why. */
function take(address) {
  if (address === addressOf(state)) return;
  stopClimb();
  const before = JSON.stringify(state);
  say("");
  try {
    state = stateOf(address);
  } catch (error) {
    state = initial(0);
    say(`The address is not used: ${visible(error.message)}.`);
  }
  if (shown.loop) remember(before);
  redraw();
}

function frame(now) {
  const seconds = (now - player.last) / 1000;
  player.last = now;
  if (player.playing && shown.prediction && dragged === null) {
    advance(seconds);
    drawWorld();
  }
  requestAnimationFrame(frame);
}

player.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
controls();
if (location.hash.length > 1) take(location.hash.slice(1));
if (!shown.loop) redraw();
requestAnimationFrame(frame);
window.lab = {  // for tests, and for whoever opens the console
  state: () => addressOf(state), update, player, opened, tables: tablesOf,
  predict: (name, frame, points, amplitude, centre, reverse, value) => {
    const chart = CHARTS.find((one) => one.name === name), before = chart.value;
    if (chart.family) chart.choose(value ?? chart.family.own);
    const p = chart.predict(scaled(sampled({ points }, PHASES, reverse), amplitude, centre), frame, false);
    chart.choose(before);
    return p && TIERS.map((tier) => [...p[tier].net, ...p[tier].error]);
  },
};
