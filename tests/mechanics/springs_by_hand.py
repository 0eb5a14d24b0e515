"""A chain of links with springs in dry sand, integrated by SciPy's Radau with a rounded
law: shares no code with the package.

Forces are sums over Gauss points of Eqs. 2-3, with the speed squared of each point
increased by rounding^2. The rates of shape and frame at a time follow from the balance
by Newton's method, and the shape by an ordinary differential equation."""

import numpy as np
from scipy.integrate import solve_ivp

NODES, WEIGHTS = np.polynomial.legendre.leggauss(160)


def solved(residual, y, rounding):
    """Return the zero of a balance by damped Newton steps from y; None if there is
    none nearby."""
    value, slope = residual(y, rounding)
    for _ in range(60):
        size = np.abs(value).max()
        if size < 1e-11:
            return y
        step = np.linalg.solve(slope, -value)
        factor = 1.0
        while True:
            new = residual(y + factor * step, rounding)
            if np.abs(new[0]).max() < size:
                break
            factor /= 2
            if factor < 1e-4:
                return y if size < 1e-9 else None
        y = y + factor * step
        value, slope = new
    return None


class SpringChain:
    """lengths: of the links, their sum 1. stiffness, low, high: of each joint, infinite
    stiffness where the gait prescribes it. damping: of every joint, without which
    torques beyond the yield of the sand would have no rates. C, gamma0: of Eq. 3.
    rounding: speed."""

    def __init__(self, lengths, stiffness, low, high, damping, C, gamma0, rounding):
        self.lengths = np.array(lengths)
        self.stiffness = np.array(stiffness)
        self.free = np.flatnonzero(np.isfinite(self.stiffness))
        self.low = np.array(low)
        self.high = np.array(high)
        self.damping = damping
        self.C = C
        self.gamma0 = gamma0
        self.rounding = rounding
        self.guess = None

    def columns(self, alpha):
        """Return the velocity of each Gauss point, along and across its link, per unit
        of the velocity of link 1's tail, its turning, and each joint's rate."""
        count = len(self.lengths)
        heading = np.concatenate([[0.0], np.cumsum(alpha)])
        unit = np.exp(1j * heading)
        tails = np.concatenate([[0.0], np.cumsum(self.lengths * unit)])[:-1]
        points = tails[:, None] + (unit * self.lengths)[:, None] * (NODES + 1) / 2
        columns = [np.ones_like(points), 1j * np.ones_like(points), 1j * points]
        for joint in range(count - 1):
            behind = np.arange(count) > joint
            pivot = tails[joint + 1]
            columns.append(np.where(behind[:, None], 1j * (points - pivot), 0.0))
        local = np.array(columns) * unit.conj()[:, None]
        weight = (self.lengths[:, None] / 2 * WEIGHTS).ravel()
        both = np.stack([local.real, local.imag]).reshape(2, len(columns), -1)
        return both, weight

    def forces(self, rounding, v):
        """Return the drag (2, n) at velocities (2, n), and its slopes (2, 2, n)."""
        v_t, v_n = v
        e2 = rounding**2
        R = np.sqrt(v_t**2 + v_n**2 + e2)
        s2 = np.sin(self.gamma0) ** 2
        Q = np.sqrt(s2 * v_t**2 + v_n**2 + e2)
        k = self.C * np.cos(self.gamma0)
        force = np.stack([v_t / R, v_n / R + k * v_n / Q])
        cross = -v_t * v_n / R**3
        slopes = np.array(
            [
                [1 / R - v_t**2 / R**3, cross],
                [
                    cross - k * s2 * v_t * v_n / Q**3,
                    1 / R - v_n**2 / R**3 + k * (1 / Q - v_n**2 / Q**3),
                ],
            ]
        )
        return force, slopes

    def rates(self, t, free_angles, gait):
        """Return the velocity of link 1's tail in its frame and all joint rates."""
        command, command_rate = gait(t)
        alpha = command.copy()
        alpha[self.free] = free_angles
        columns, weight = self.columns(alpha)
        unknown = np.concatenate([[0, 1, 2], 3 + self.free])
        deviation = alpha - command
        excess = deviation - np.clip(deviation, self.low, self.high)
        torque = (self.stiffness[self.free]) * excess[self.free]
        fixed = np.concatenate([np.zeros(3), command_rate])
        fixed[unknown] = 0.0
        v_fixed = np.einsum("apn,p->an", columns, fixed)
        D = columns[:, unknown]

        def residual(y, rounding):
            force, slopes = self.forces(
                rounding, v_fixed + np.einsum("apn,p->an", D, y)
            )
            value = np.einsum("apn,an,n->p", D, force, weight)
            value[3:] += torque + self.damping * y[3:]
            slope = np.einsum("apn,abn,bqn,n->pq", D, slopes, D, weight)
            slope[3:, 3:] += self.damping * np.eye(len(self.free))
            return value, slope

        y = None
        if self.guess is not None:
            y = solved(residual, self.guess, self.rounding)
        if y is None:  # from wide rounding to the one that is asked for
            y = np.zeros(len(unknown))
            for rounding in np.geomspace(10.0, self.rounding, 30):
                better = solved(residual, y, rounding)
                y = y if better is None else better
        if np.abs(residual(y, self.rounding)[0]).max() > 1e-8:
            raise RuntimeError(f"no balance at t = {t}")
        self.guess = y
        full = fixed
        full[unknown] = y
        return full

    def swim(self, gait, cycles, tolerance=1e-9):
        """Return the shape (d,) and the pose of link 1's tail, x, y, heading, at the
        start of each cycle, (cycles + 1, d + 3), from the commanded shape."""

        def derivative(t, state):
            full = self.rates(t, state[3:], gait)
            z = (full[0] + 1j * full[1]) * np.exp(1j * state[2])
            return np.concatenate([[z.real, z.imag, full[2]], full[3 + self.free]])

        start = np.concatenate([np.zeros(3), gait(0.0)[0][self.free]])
        solution = solve_ivp(
            derivative,
            (0.0, 2 * np.pi * cycles),
            start,
            "Radau",
            2 * np.pi * np.arange(cycles + 1),
            rtol=tolerance,
            atol=tolerance,
        )
        return solution.y.T
