"""What a figure has drawn, to compare with the numbers that it was drawn from."""

import numpy as np
from matplotlib.collections import QuadMesh

from geomech import plots


def drawn(module, numbers, folder):
    """Draw a figure of `figures` and write it to a file, which lays it out and reads
    its formulas."""
    figure = module.draw(numbers)
    plots.save(figure, folder / "figure.png")
    return figure


def curve(ax, label):
    """Return the data (2, N) of the one line with a label."""
    (line,) = (x for x in ax.lines if x.get_label() == label)
    return np.transpose(line.get_xydata())


def curves(ax):
    """Return the data (N, 2) of all lines of several points, in the order in which they
    were drawn."""
    return [x.get_xydata() for x in ax.lines if len(x.get_xdata()) > 2]


def only(ax, kind):
    """Return the one collection of a kind."""
    (found,) = (x for x in ax.collections if isinstance(x, kind))
    return found


def mesh(ax):
    """Return (alpha_1, alpha_2, values) at the corners or centres of the one mesh."""
    drawn = only(ax, QuadMesh)
    x, y = np.moveaxis(drawn.get_coordinates(), -1, 0)
    if x.size > drawn.get_array().size:  # cells about the points
        x, y = ((c[1:, 1:] + c[:-1, :-1]) / 2 for c in (x, y))
    return x, y, np.reshape(drawn.get_array(), x.shape)
