// The chart of a scene: what geomech.studies.maps.charts holds, and its three tiers.

const TIERS = ["harmonic", "path", "area"];

class Chart {
  /** data: of a scene. tables: texts of all tables by their names; `shares` of what the series leaves are errors. */
  constructor(data, tables, shares) {
    Object.assign(this, data, { shares });
    this.low = this.axes.map((axis) => axis[0]);
    this.high = this.axes.map((axis) => axis[axis.length - 1]);
    this.stacks = [];
    const table = (name) => this.stacked(decoded(tables[name]));
    const spline = (name) => new Spline(this.knots, [this.degree, this.degree], table(name));
    this.harmonics = spline(data.harmonics);
    this.outline = spline(data.outline);
    this.residual = new Grid(this.axes, table(data.residual));
    this.frames = {};
    for (const [name, f] of Object.entries(data.frames)) {
      const error = new Grid(this.axes, table(f.ccf_error));
      this.frames[name] = { A: spline(f.A), ccf: spline(f.ccf), error, pose: f.pose ? spline(f.pose) : null };
    }
    this.value = undefined;
    this.choose(this.family ? this.family.own : null);
  }

  /** Return a table for use; of a family remember all members' and return room for one. */
  stacked(all) {
    if (!this.family) return all;
    const one = new Float64Array(all.length / this.family.values.length);
    this.stacks.push([all, one]);
    return one;
  }

  /** Take the member of the family at a value of its parameter: splines along it. */
  choose(value) {
    if (value === this.value) return;
    this.value = value;
    if (this.family) {
      const { values, knots, degree } = this.family, weights = new Float64Array(8);
      const first = basis(knots, degree, Math.min(values[values.length - 1], Math.max(values[0], value)), weights);
      for (const [all, one] of this.stacks) {
        one.fill(0);
        for (let j = 0; j <= degree; j++) {
          for (let i = 0, k = (first + j) * one.length; i < one.length; i++, k++) one[i] += weights[j] * all[k];
        }
      }
    }
    for (const frame of Object.values(this.frames)) frame.potential = frame.ccf.antiderivative();
  }

  /** Return whether all shapes lie on the chart. */
  holds({ alpha }) {
    const slack = 1e-9 * (this.high[0] - this.low[0]);
    return alpha.every((x, i) => x >= this.low[i & 1] - slack && x <= this.high[i & 1] + slack);
  }

  /** Return body velocities (3 N) by the harmonics, in the scene's frame. */
  harmonicVelocity({ alpha, rate }) {
    const n = alpha.length / 2, terms = this.harmonics.width / 3, series = new Float64Array(3 * terms);
    const xi = new Float64Array(3 * n);
    for (let i = 0; i < n; i++) {
      const u = rate[2 * i], v = rate[2 * i + 1], speed = Math.hypot(u, v);
      if (!speed) continue;
      this.harmonics.at(alpha[2 * i], alpha[2 * i + 1], series);
      let c = u / speed, s = v / speed;
      const c2 = c * c - s * s, s2 = 2 * c * s;
      for (let k = 0; k < terms; k += 2) {
        for (let d = 0; d < 3; d++) xi[3 * i + d] += speed * (series[d * terms + k] * c + series[d * terms + k + 1] * s);
        [c, s] = [c * c2 - s * s2, c * s2 + s * c2];  // two harmonics on
      }
    }
    return xi;
  }

  /** Return body velocities (3 N) by the connection in a frame. */
  pathVelocity({ alpha, rate }, frame) {
    const n = alpha.length / 2, A = new Float64Array(6), xi = new Float64Array(3 * n);
    for (let i = 0; i < n; i++) {
      this.frames[frame].A.at(alpha[2 * i], alpha[2 * i + 1], A);
      for (let d = 0; d < 3; d++) xi[3 * i + d] = A[2 * d] * rate[2 * i] + A[2 * d + 1] * rate[2 * i + 1];
    }
    return xi;
  }

  /** Return exp of the CCF's integral over the area enclosed. */
  areaPose({ alpha, rate }, frame) {
    const n = alpha.length / 2, out = new Float64Array(3), sum = [0, 0, 0];
    for (let i = 0; i < n; i++) {
      this.frames[frame].potential.at(alpha[2 * i], alpha[2 * i + 1], out);
      for (let d = 0; d < 3; d++) sum[d] += out[d] * rate[2 * i + 1] * TAU / n;
    }
    return exponential(sum);
  }

  /** Return the error of the harmonic tier, of position and heading. */
  errorLeft({ alpha, rate }) {
    const n = alpha.length / 2, rms = new Float64Array(3), { family } = this;
    const error = [family && !family.values.includes(this.value) ? family.error * this.length : 0, 0];
    for (let i = 0; i < n; i++) {
      this.residual.at(alpha[2 * i], alpha[2 * i + 1], rms);
      const step = Math.hypot(rate[2 * i], rate[2 * i + 1]) * TAU / n;
      error[0] += step * (this.shares[0] * Math.hypot(rms[0], rms[1]) + this.grid_error[0]);
      error[1] += step * (this.shares[1] * rms[2] + this.grid_error[1]);
    }
    return error;
  }

  /**
   * Return {harmonic, path, area}, {net, error} each, of a sampled loop in a frame, with the poses of the scene's own frame by the
   * harmonic tier; null for a loop that leaves the chart.
   */
  predict(loop, frame, whole) {
    if (!this.holds(loop)) return null;
    const run = reconstruct(this.harmonicVelocity(loop), whole), error = this.errorLeft(loop), { pose } = this.frames[frame];
    const h = pose ? [...pose.at(loop.alpha[0], loop.alpha[1], new Float64Array(3))] : null;
    const net = h ? compose(inverse(h), compose(run.net, h)) : run.net;
    const beside = (x) => ({ net: x, error: [error[0] + Math.hypot(x[0] - net[0], x[1] - net[1]), error[1] + Math.abs(x[2] - net[2])] });
    const path = reconstruct(this.pathVelocity(loop, frame)).net;
    return { harmonic: { net, error }, path: beside(path), area: beside(this.areaPose(loop, frame)), poses: run.poses, own: run.net };
  }
}
