"""Cost that grows as it should: solver time against samples, links, directions and phases, with fitted exponents."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from figures import main
from geomech import connection
from geomech.gaits import Circle
from geomech.output import plots
from geomech.tiers.direct import direct
from rft import CATALOGUE, Chain, body_velocity

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
REPEATS = 3


def _quickest(f: Callable) -> float:
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        f()
        times.append(time.perf_counter() - start)
    return min(times)


def _random(links: int, count: int):
    rng, spread = np.random.default_rng(links), 2.5 / np.sqrt(links / 3)
    return rng.uniform(-spread, spread, (count, links - 1)), rng.normal(size=(count, links - 1))


def _velocity(alpha, alphadot):
    return body_velocity(GLASS, Chain(), alpha, alphadot).checked().xi


def compute(scale: int = 1) -> dict:
    """{axis: {"x": [...], "seconds": [...], "exponent": p}}; the exponent is that of the larger half. scale: shrinks all."""
    sizes = {
        "samples": (
            [n // scale for n in (1000, 4000, 16000, 64000)],
            lambda n: body_velocity(GLASS, Chain(), *_random(3, n)),
        ),
        "links": ([3, 6, 12, 25, 50, 100], lambda n: body_velocity(GLASS, Chain((1,) * n), *_random(n, 2000 // scale))),
        "directions": ([4, 8, 16, 32, 64], lambda n: connection.fit(_velocity, connection.grid(2, 31 // scale), n)),
        "phases": (
            [n // scale for n in (500, 2000, 8000, 32000)],
            lambda n: direct(_velocity, Circle(), phases=n),
        ),
    }
    out = {}
    for axis, (x, run) in sizes.items():
        seconds = [_quickest(lambda n=n: run(n)) for n in x]
        half = len(x) // 2
        exponent = np.polyfit(np.log(x[half - 1 :]), np.log(seconds[half - 1 :]), 1)[0]
        out[axis] = {"x": x, "seconds": seconds, "exponent": float(exponent)}
    return out


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(9.6, 2.8, 4)
    for ax, (axis, line) in zip(axes[0], numbers.items()):
        x, seconds = np.array(line["x"], float), np.array(line["seconds"])
        ax.loglog(x, seconds, "o", color="black", ms=4)
        ax.loglog(x, seconds[-1] * (x / x[-1]), color="0.6", lw=0.8, ls="--")
        ax.set(xlabel=f"{axis}", ylabel="seconds", title=f"exponent {line['exponent']:.2f}; dashed: 1")
        ax.set_xticks(x[:: 1 if len(x) < 5 else 2], [f"{v:,.0f}" for v in x[:: 1 if len(x) < 5 else 2]])
        ax.minorticks_off()
        ax.grid(True, which="major", lw=0.3, color="0.85")
    return fig


if __name__ == "__main__":
    main("cost_scaling", compute, draw)
