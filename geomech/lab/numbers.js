// Numbers: splines, Fourier transforms, planar motions. The formulas are those of geomech.mathematics.geometry; nothing here knows a page.

const TAU = 2 * Math.PI;

/** Return the single-precision numbers of a base64 text. */
function decoded(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
}

/** Write the degree + 1 B-splines that are not zero at x, and return the index of the first (The NURBS Book, A2.2). */
function basis(knots, degree, x, values) {
  let low = degree, high = knots.length - degree - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (x < knots[middle]) high = middle; else low = middle;
  }
  values[0] = 1;
  for (let d = 1; d <= degree; d++) {
    let carried = 0;
    for (let r = 0; r < d; r++) {
      const right = knots[low + r + 1], left = knots[low + r + 1 - d], part = values[r] / (right - left);
      values[r] = carried + (right - x) * part;
      carried = (x - left) * part;
    }
    values[d] = carried;
  }
  return low - degree;
}

/** A tensor-product spline of `width` components over two variables; coefficients (n1, n2, width). */
class Spline {
  constructor(knots, degrees, coefficients) {
    Object.assign(this, { knots, degrees, coefficients });
    this.sizes = [0, 1].map((k) => knots[k].length - degrees[k] - 1);
    this.width = coefficients.length / this.sizes[0] / this.sizes[1];
    this.values = [new Float64Array(8), new Float64Array(8)];
  }

  /** Write the components at a shape, and return them. */
  at(a, b, out) {
    const [u, v] = this.values, { width, coefficients } = this, columns = this.sizes[1];
    const i0 = basis(this.knots[0], this.degrees[0], a, u), j0 = basis(this.knots[1], this.degrees[1], b, v);
    out.fill(0, 0, width);
    for (let i = 0; i <= this.degrees[0]; i++) {
      for (let j = 0; j <= this.degrees[1]; j++) {
        const weight = u[i] * v[j];
        let place = ((i0 + i) * columns + j0 + j) * width;
        for (let k = 0; k < width; k++) out[k] += weight * coefficients[place++];
      }
    }
    return out;
  }

  /** Return the antiderivative along the first variable, from its lower end. */
  antiderivative() {
    const [rows, columns] = this.sizes, knots = this.knots[0], degree = this.degrees[0], row = columns * this.width;
    const sums = new Float64Array((rows + 1) * row);
    for (let i = 0; i < rows; i++) {
      const step = (knots[i + degree + 1] - knots[i]) / (degree + 1);
      for (let k = 0; k < row; k++) sums[(i + 1) * row + k] = sums[i * row + k] + step * this.coefficients[i * row + k];
    }
    const longer = [knots[0], ...knots, knots[knots.length - 1]];
    return new Spline([longer, this.knots[1]], [degree + 1, this.degrees[1]], sums);
  }
}

/** Values (n1, n2, width) on a grid of equal steps, interpolated linearly. */
class Grid {
  constructor(axes, values) {
    Object.assign(this, { axes, values, width: values.length / axes[0].length / axes[1].length });
  }

  at(a, b, out) {
    const columns = this.axes[1].length, { width, values } = this;
    const [[i, u], [j, v]] = [a, b].map((x, k) => {
      const axis = this.axes[k], cells = axis.length - 1;
      const place = Math.min(cells, Math.max(0, (x - axis[0]) / (axis[cells] - axis[0]) * cells));
      const cell = Math.min(cells - 1, Math.floor(place));
      return [cell, place - cell];
    });
    for (let k = 0; k < width; k++) {
      const at = (p, q) => values[((i + p) * columns + j + q) * width + k];
      out[k] = (1 - u) * ((1 - v) * at(0, 0) + v * at(0, 1)) + u * ((1 - v) * at(1, 0) + v * at(1, 1));
    }
    return out;
  }
}

/** Transform re + i im in place: sum over n of f_n exp(sign 2 pi i k n / N), N a power of two. */
function transform(re, im, sign) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [re[i], re[j]] = [re[j], re[i]];
      [im[i], im[j]] = [im[j], im[i]];
    }
  }
  const [cos, sin] = roots(n);
  for (let size = 2; size <= n; size <<= 1) {
    const half = size >> 1, step = n / size;
    for (let first = 0; first < n; first += size) {
      for (let k = 0; k < half; k++) {
        const c = cos[k * step], s = sign * sin[k * step], p = first + k, q = p + half;
        const x = re[q] * c - im[q] * s, y = re[q] * s + im[q] * c;
        re[q] = re[p] - x;
        im[q] = im[p] - y;
        re[p] += x;
        im[p] += y;
      }
    }
  }
}

const ROOTS = new Map();

/** Return cos and sin of 2 pi k / n for k below n / 2. */
function roots(n) {
  if (!ROOTS.has(n)) ROOTS.set(n, [Math.cos, Math.sin].map((f) => Float64Array.from({ length: n / 2 }, (_, k) => f(TAU * k / n))));
  return ROOTS.get(n);
}

const sinc = (x) => (Math.abs(x) < 1e-9 ? 1 : Math.sin(x) / x);

/** Return the pose after a body velocity of so much, held for a unit of time. */
function exponential([x, y, turn]) {
  const along = sinc(turn), across = Math.sin(turn / 2) * sinc(turn / 2);
  return [along * x - across * y, across * x + along * y, turn];
}

function compose(g, h) {
  const c = Math.cos(g[2]), s = Math.sin(g[2]);
  return [g[0] + c * h[0] - s * h[1], g[1] + s * h[0] + c * h[1], g[2] + h[2]];
}

function inverse(g) {
  const c = Math.cos(g[2]), s = Math.sin(g[2]);
  return [-c * g[0] - s * g[1], s * g[0] - c * g[1], -g[2]];
}

/**
 * Return the net pose of a cycle of body velocities xi (3 N), and its poses (3 (N + 1)) where `whole` is true: exact for the
 * trigonometric polynomials through the samples, as `geomech.mathematics.geometry.reconstruct`. N is a power of two.
 */
function reconstruct(xi, whole) {
  const n = xi.length / 3, half = n / 2;
  const { mean, swing } = heading(xi);
  const re = new Float64Array(n), im = new Float64Array(n);
  for (let i = 0; i < n; i++) {
    const c = Math.cos(swing[i] - swing[0]) / n, s = Math.sin(swing[i] - swing[0]) / n;
    re[i] = c * xi[3 * i] - s * xi[3 * i + 1];
    im[i] = s * xi[3 * i] + c * xi[3 * i + 1];
  }
  transform(re, im, -1);
  const wave = (k) => (Math.abs(k) === half ? 0.5 : 1);  // the highest wave is shared by both signs
  const net = [0, 0, TAU * mean];
  for (let k = -half; k <= half; k++) {
    const i = (k + n) % n, turns = mean + k, reach = TAU * wave(k) * sinc(Math.PI * turns);
    const c = reach * Math.cos(Math.PI * turns), s = reach * Math.sin(Math.PI * turns);
    net[0] += re[i] * c - im[i] * s;
    net[1] += re[i] * s + im[i] * c;
  }
  return whole ? { net, poses: poses(re, im, mean, swing) } : { net };
}

/** Return the mean of xi_theta, and the heading less its mean growth at the phases. */
function heading(xi) {
  const n = xi.length / 3, re = new Float64Array(n), im = new Float64Array(n);
  let mean = 0;
  for (let i = 0; i < n; i++) mean += (re[i] = xi[3 * i + 2]) / n;
  transform(re, im, -1);
  for (let i = 0; i < n; i++) {
    const k = i < n / 2 ? i : i - n, skip = k === 0 || i === n / 2;
    [re[i], im[i]] = skip ? [0, 0] : [im[i] / k / n, -re[i] / k / n];
  }
  transform(re, im, 1);
  return { mean, swing: re };
}

/** Return the poses at all phases from the Fourier coefficients of exp(i swing) (xi_x + i xi_y). */
function poses(re, im, mean, swing) {
  const n = re.length, half = n / 2, x = new Float64Array(n), y = new Float64Array(n), slow = [];
  for (let k = -half; k <= half; k++) {
    const i = (k + n) % n, share = Math.abs(k) === half ? 0.5 : 1, turns = mean + k;
    if (Math.abs(turns) < 0.5) slow.push([share * re[i], share * im[i], turns]);  // its integral is no quotient
    else { x[i] += share * im[i] / turns; y[i] -= share * re[i] / turns; }
  }
  transform(x, y, 1);
  const out = new Float64Array(3 * (n + 1));
  for (let m = 0; m <= n; m++) {
    const i = m % n, t = TAU * m / n, c = Math.cos(mean * t), s = Math.sin(mean * t);
    let u = x[i] * c - y[i] * s - x[0], v = x[i] * s + y[i] * c - y[0];
    for (const [a, b, turns] of slow) {
      const reach = t * sinc(turns * t / 2), p = reach * Math.cos(turns * t / 2), q = reach * Math.sin(turns * t / 2);
      u += a * p - b * q;
      v += a * q + b * p;
    }
    out.set([u, v, mean * t + swing[i] - swing[0]], 3 * m);
  }
  return out;
}
