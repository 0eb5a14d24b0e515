// The swimmer on its track, in real time, by the harmonic tier.

const player = { phase: 0, cycle: 0, start: [0, 0, 0], playing: true, frequency: 0.5, last: 0 };
const USUAL = 0.5;  // Hz, where nobody gives a frequency
const HEIGHT = 280, SHOWN = 2.9;  // body lengths across

/** Return the pose of the scene's frame at a phase of the cycle, in [0, 2 pi). */
function poseAt(phase) {
  const { poses } = shown.prediction, place = phase / TAU * PHASES, k = Math.min(PHASES - 1, Math.floor(place)), u = place - k;
  return [0, 1, 2].map((d) => (1 - u) * poses[3 * k + d] + u * poses[3 * k + 3 + d]);
}

/** Return the ends of the links [[x, y], ...] in the world at a phase. */
function bodyAt(phase, start) {
  const chart = chartOf(), [a, b] = toShape(curveNow(phase)), ends = chart.outline.at(a, b, new Float64Array(chart.outline.width));
  const g = compose(start, poseAt(phase));
  return Array.from({ length: ends.length / 2 }, (_, k) => compose(g, [ends[2 * k], ends[2 * k + 1], 0]).slice(0, 2));
}

/** Return the point of the unit curve at a phase. */
const curveNow = (phase) => shown.curve((state.reverse ? -1 : 1) * phase).slice(0, 2);

const world = { trail: [], ghosts: [], width: 560 };

/** Begin again at the origin. */
function restart() {
  Object.assign(player, { phase: 0, cycle: 0, start: [0, 0, 0] });
  Object.assign(world, { trail: [], ghosts: [], eye: null });
}

/** Go on by so many seconds. */
function advance(seconds) {
  player.phase += TAU * player.frequency * Math.min(seconds, 0.1);
  while (player.phase >= TAU) {
    player.phase -= TAU;
    player.cycle += 1;
    world.ghosts.push(bodyAt(0, player.start));
    if (world.ghosts.length > 12) world.ghosts.shift();
    player.start = compose(player.start, shown.prediction.own);
  }
}

/** Draw the body where it is, and bodies where its last cycles began. */
function drawWorld() {
  const svg = world.svg || newWorld(), chart = chartOf();
  if (!shown.prediction) {
    for (const part of ["ghosts", "body", "head", "trail"]) world[part + "Part"].setAttribute("d", "");
    return;
  }
  const body = bodyAt(player.phase, player.start), here = compose(player.start, poseAt(player.phase));
  world.trail.push(here.slice(0, 2));
  if (world.trail.length > 900) world.trail.shift();
  const { width } = world, per = width / (SHOWN * chart.length), eye = world.eye || here.slice(0, 2);
  world.eye = eye.map((x, d) => x + 0.04 * (here[d] - x));  // the view follows smoothly
  const place = ([x, y]) => `${(width / 2 + (x - world.eye[0]) * per).toFixed(1)} ${(HEIGHT / 2 - (y - world.eye[1]) * per).toFixed(1)}`;
  const line = (points) => (points.length ? `M${points.map(place).join("L")}` : "");
  world.ghostsPart.setAttribute("d", world.ghosts.map(line).join(""));
  world.trailPart.setAttribute("d", line(world.trail));
  world.bodyPart.setAttribute("d", line(body));
  world.headPart.setAttribute("d", `${line([body[body.length - 1]])}h.01`);
  world.dotsPart.setAttribute("d", dots(per));
  const [x, y] = toMap(toShape(curveNow(player.phase)));
  map.parts.now.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
  const turns = minus((here[2] * 180 / Math.PI).toFixed(0));
  world.text.textContent = `x ${fixed(here[0], 2)}  y ${fixed(here[1], 2)} ${chart.unit}, heading ${turns}°, cycle ${player.cycle + 1}`;
  if (svg.dataset.unit !== `${chart.length}${chart.unit}`) labelScale(svg, chart, per);
}

/** Return the path of dots that stand still in the world, half a body length apart. */
function dots(per) {
  const chart = chartOf(), gap = chart.length / 2, { width } = world;
  let path = "";
  const first = (eye, size) => Math.ceil((eye - size / per / 2) / gap) * gap, last = (eye, size) => eye + size / per / 2;
  for (let x = first(world.eye[0], width); x < last(world.eye[0], width); x += gap) {
    for (let y = first(world.eye[1], HEIGHT); y < last(world.eye[1], HEIGHT); y += gap) {
      path += `M${(width / 2 + (x - world.eye[0]) * per).toFixed(1)} ${(HEIGHT / 2 - (y - world.eye[1]) * per).toFixed(1)}h.01`;
    }
  }
  return path;
}

function labelScale(svg, chart, per) {
  svg.dataset.unit = `${chart.length}${chart.unit}`;
  const size = ticks(0, chart.length, 2)[1];
  world.scalePart.setAttribute("d", `M12 ${HEIGHT - 14}v4h${size * per}v-4`);
  world.scaleText.textContent = `${tickText(size)} ${chart.unit}`;
  world.scaleText.setAttribute("x", 12 + size * per / 2);
}

function newWorld() {
  const box = document.getElementById("world");
  world.width = Math.max(280, box.clientWidth);
  const svg = drawn("svg", { viewBox: `0 0 ${world.width} ${HEIGHT}`, role: "img", "aria-label": "The body on its way, seen from above" });
  const stroke = { fill: "none", "stroke-linecap": "round", "stroke-linejoin": "round" };
  world.dotsPart = drawn("path", { ...stroke, stroke: "var(--dots)", "stroke-width": 2.5 });
  world.ghostsPart = drawn("path", { ...stroke, stroke: "var(--body)", "stroke-opacity": 0.16, "stroke-width": 6 });
  world.trailPart = drawn("path", { ...stroke, stroke: "var(--trail)", "stroke-width": 1.4 });
  world.bodyPart = drawn("path", { ...stroke, stroke: "var(--body)", "stroke-width": 8 });
  world.headPart = drawn("path", { ...stroke, stroke: "var(--head)", "stroke-width": 12 });
  world.scalePart = drawn("path", { fill: "none", stroke: "var(--axis)" });
  world.scaleText = drawn("text", { y: HEIGHT - 18, "text-anchor": "middle" });
  world.text = drawn("text", { x: world.width - 10, y: 18, "text-anchor": "end" });
  svg.append(world.dotsPart, world.ghostsPart, world.trailPart, world.bodyPart, world.headPart, world.scalePart, world.scaleText, world.text);
  box.replaceChildren(svg);
  world.svg = svg;
  return svg;
}
