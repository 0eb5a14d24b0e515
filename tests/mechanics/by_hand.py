"""Chains laid out in the plane and moved by differences: nothing of `rft` but their
lengths."""

import numpy as np


def laid_out(body, alpha):
    """Ends of the elements as complex numbers in the frame of centre and mean heading,
    and their directions."""
    heading = np.concatenate([[0.0], np.cumsum(alpha)])
    along = np.exp(1j * (heading - body.fractions @ heading))
    ends = np.concatenate([[0.0], np.cumsum(body.fractions * along)])
    return ends - body.fractions @ (ends[1:] + ends[:-1]) / 2, along


def points(body, alpha, alphadot, xi, share):
    """Places of points at shares (K) of each element's length, their velocities and the
    directions of their elements, (n, K), as the body moves with xi."""
    ends = [laid_out(body, alpha + h * alphadot)[0] for h in (-1e-6, 0, 1e-6)]
    before, place, after = (x[:-1, None] + share * np.diff(x)[:, None] for x in ends)
    velocity = (after - before) / 2e-6 + xi[0] + 1j * xi[1] + 1j * xi[2] * place
    return place, velocity, laid_out(body, alpha)[1][:, None] + 0 * place


def middles(count):
    """Shares at the middles of equal parts of an element."""
    return (np.arange(count) + 0.5) / count


def drag(medium, velocity, along, rounding=0.0):
    """Force on the ground of points with velocities and directions, complex as they
    are."""
    own = velocity * along.conj()
    f_t, f_n = medium.traction(own.real, own.imag, rounding)
    return (f_t + 1j * f_n) * along
