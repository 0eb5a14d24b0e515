// Loops in shape space: alpha = centre + amplitude unit(t), as geomech.mathematics.gaits. A loop is a Fourier series {cos, sin}, two rows
// each, or the periodic cubic spline through {points}.

const TILT = Math.SQRT1_2;
const PRESETS = {
  circle: { cos: [[1], [0]], sin: [[0], [1]] },
  ellipse: { cos: [[TILT], [TILT]], sin: [[-0.5 * TILT], [0.5 * TILT]] },
  butterfly: {
    cos: [[1.0908, 0, -0.2508, 0, -0.18], [1.0908, 0, -0.2508, 0, -0.18]],
    sin: [[1.052, 0, 0.0859, 0, 0], [-1.052, 0, -0.0859, 0, 0]],
  },
  "figure-eight": { cos: [[0, 0], [0, 0]], sin: [[1, 0], [0, 1]] },
};
const HANDLES = { circle: 8, ellipse: 8, butterfly: 16, "figure-eight": 12 };
const MOST_POINTS = 60;
const SAME = 1e-12;  // of a loop's length: points within it are one

/** Return a function t -> [alpha_1, alpha_2, and their rates] of the unit curve. */
function curve(loop) {
  return loop.points ? splined(loop.points) : (t) => summed(loop, t);
}

function summed({ cos, sin }, t) {
  const out = [0, 0, 0, 0];
  for (let k = 1; k <= cos[0].length; k++) {
    const c = Math.cos(k * t), s = Math.sin(k * t);
    for (let j = 0; j < 2; j++) {
      out[j] += cos[j][k - 1] * c + sin[j][k - 1] * s;
      out[2 + j] += k * (sin[j][k - 1] * c - cos[j][k - 1] * s);
    }
  }
  return out;
}

/** Return the periodic cubic spline through points, with phase running as the length of the chords. */
function splined(points) {
  const n = points.length, chords = points.map((p, i) => Math.hypot(...p.map((x, d) => points[(i + 1) % n][d] - x)));
  const total = chords.reduce((a, b) => a + b), steps = chords.map((c) => TAU * c / total);
  const starts = [0];
  for (const step of steps) starts.push(starts[starts.length - 1] + step);
  const slopes = slopesOf(points, steps);
  return (t) => {
    t -= TAU * Math.floor(t / TAU);
    let i = 0;
    while (i < n - 1 && t >= starts[i + 1]) i++;
    const h = steps[i], u = (t - starts[i]) / h, next = (i + 1) % n, out = [0, 0, 0, 0];
    for (let d = 0; d < 2; d++) {
      const p = points[i][d], rise = points[next][d] - p, m = h * slopes[i][d], w = h * slopes[next][d];
      const square = 3 * rise - 2 * m - w, cube = m + w - 2 * rise;
      out[d] = p + u * (m + u * (square + u * cube));
      out[2 + d] = (m + u * (2 * square + 3 * u * cube)) / h;
    }
    return out;
  };
}

/** Return the slopes at the points for which the second derivative is continuous: a cyclic, diagonally dominant system. */
function slopesOf(points, steps) {
  const n = points.length, rows = points.map((p, i) => {
    const before = (i + n - 1) % n, after = (i + 1) % n, row = new Float64Array(n + 2), [g, h] = [steps[before], steps[i]];
    row[before] += h;
    row[i] += 2 * (g + h);
    row[after] += g;
    for (let d = 0; d < 2; d++) row[n + d] = 3 * (h * (p[d] - points[before][d]) / g + g * (points[after][d] - p[d]) / h);
    return row;
  });
  for (let i = 0; i < n; i++) {
    for (let r = 0; r < n; r++) {
      const factor = r === i ? 0 : rows[r][i] / rows[i][i];
      if (factor) for (let c = i; c < n + 2; c++) rows[r][c] -= factor * rows[i][c];
    }
  }
  return rows.map((row, i) => [row[n] / row[i], row[n + 1] / row[i]]);
}

/** Return {alpha, rate}, (2 N) each, of a unit curve at N phases. */
function sampled(loop, count, reverse) {
  const at = curve(loop), sign = reverse ? -1 : 1, alpha = new Float64Array(2 * count), rate = new Float64Array(2 * count);
  for (let i = 0; i < count; i++) {
    const [a, b, u, v] = at(sign * TAU * i / count);
    alpha.set([a, b], 2 * i);
    rate.set([sign * u, sign * v], 2 * i);
  }
  return { alpha, rate };
}

/** Return a sampled unit curve about a centre, times an amplitude. */
function scaled({ alpha, rate }, amplitude, centre) {
  return { alpha: alpha.map((x, i) => centre[i & 1] + amplitude * x), rate: rate.map((x) => amplitude * x) };
}

/** Throw an Error unless these are the points of a loop. */
function checkPoints(points) {
  if (!Array.isArray(points) || points.length < 3 || points.length > MOST_POINTS) {
    throw new Error(`a loop has 3 to ${MOST_POINTS} points`);
  }
  if (points.some((p) => !Array.isArray(p) || p.length !== 2)) throw new Error("a point has two angles");
  const steps = points.map((p, i) => Math.hypot(...points[(i + 1) % points.length].map((x, d) => x - p[d])));
  const length = steps.reduce((a, b) => a + b);
  if (!steps.every((step) => step > SAME * length)) throw new Error("neighbouring points are the same");
  return points;
}
