"""Cost of a balance of forces: microseconds per sample against the size of a batch, by
both back ends, on one core and on all, compared with a loop of SciPy's fsolve; and time
against links, directions and phases, with fitted exponents."""

from __future__ import annotations

import functools
import os
import timeit
from collections.abc import Callable

import numpy as np

from figures import main, style
from figures.peers import one_scipy_solve
from geomech import plots
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry import connection
from geomech.mathematics.tiers.direct import direct
from rft import CATALOGUE, Chain, body_velocity
from rft.balance import backend

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
NAMES = {"numpy": "NumPy", "numba": "compiled"}
LOOKS = {"NumPy": (style.BLUE, "o"), "compiled": (style.VERMILION, "s")}
REPEATS = 3


def backends() -> list[str]:
    """Return the names of NumPy and, where numba is installed, of compiled code."""
    if backend.installed():
        return ["numpy", "numba"]
    return ["numpy"]


def shortest_time(f: Callable, repeats: int = REPEATS) -> float:
    """Return the seconds that the quickest of several calls takes."""
    return min(timeit.repeat(f, number=1, repeat=repeats))


def random_samples(links: int, count: int):
    """Return shapes and rates (count, links - 1) within what such a body can bend."""
    rng = np.random.default_rng(links)
    spread = 2.5 / np.sqrt(links / 3)
    alpha = rng.uniform(-spread, spread, (count, links - 1))
    alphadot = rng.normal(size=(count, links - 1))
    return alpha, alphadot


def chain_velocity(name: str, threads: int | None = None) -> Callable:
    """Return the velocity of a chain in loose glass by a backend, as a function of
    shapes and rates; threads None: all."""

    def velocity(alpha, alphadot):
        chain = Chain((1,) * (np.shape(alpha)[-1] + 1))
        balance = body_velocity(
            GLASS, chain, alpha, alphadot, backend=name, threads=threads
        )
        return balance.checked().xi

    return velocity


def compute(scale: int = 1) -> dict:
    """Return {axis: {"x": [...], "seconds": {series: [...]}, "exponent": p}}, where the
    exponent is that of NumPy over the larger half.

    The axis "samples" also has "loop", the seconds of a sample in SciPy's loop. scale:
    divides all sizes.
    """

    def solve_samples(velocity, links):
        velocity(*random_samples(links, 2000 // scale))

    def fit_connection(velocity, directions):
        connection.fit(velocity, connection.grid(2, 31 // scale), directions)

    def run_cycle(velocity, phases):
        direct(velocity, Circle(), phases=phases)

    phases = [n // scale for n in (500, 2000, 8000, 32000)]
    return {
        "samples": batch_times(scale),
        "links": times_by_size([3, 6, 12, 25, 50, 100], solve_samples),
        "directions": times_by_size([4, 8, 16, 32, 64], fit_connection),
        "phases": times_by_size(phases, run_cycle),
    }


def batch_times(scale: int) -> dict:
    """Return the seconds of batches by backend and cores, and the seconds of a sample
    in SciPy's loop."""
    sizes = [max(1, n // scale) for n in (1, 8, 64, 512, 4096, 32768)]

    def solve_batch(velocity, size):
        velocity(*random_samples(3, size))

    seconds = {}
    for name in backends():
        for threads, cores in ((1, "one core"), (None, f"{os.cpu_count()} cores")):
            velocity = chain_velocity(name, threads)
            solve_batch(velocity, 2)  # compiles and loads what later calls need
            times = series(solve_batch, velocity, sizes)
            seconds[f"{NAMES[name]}, {cores}"] = times

    samples = list(zip(*random_samples(3, 40 // scale + 1)))

    def solve_in_loop():
        for alpha, alphadot in samples:
            one_scipy_solve(alpha, alphadot)

    return {
        "x": sizes,
        "seconds": seconds,
        "loop": shortest_time(solve_in_loop) / len(samples),
        "exponent": exponent(sizes, seconds),
    }


def times_by_size(sizes: list[int], run: Callable) -> dict:
    """Return the seconds of run(velocity, size) for each size, by backend on all
    cores."""
    seconds = {}
    for name in backends():
        seconds[NAMES[name]] = series(run, chain_velocity(name), sizes)
    return {"x": sizes, "seconds": seconds, "exponent": exponent(sizes, seconds)}


def series(run: Callable, velocity: Callable, sizes: list[int]) -> list[float]:
    """Return the seconds of run(velocity, size) for each size."""
    return [shortest_time(functools.partial(run, velocity, size)) for size in sizes]


def exponent(sizes: list[int], seconds: dict) -> float:
    """Return the slope of log seconds of the first series over log size, over the
    larger half of the sizes."""
    first = next(iter(seconds.values()))
    start = len(sizes) // 2 - 1
    slope = np.polyfit(np.log(sizes[start:]), np.log(first[start:]), 1)[0]
    return float(slope)


@plots.styled
def draw(numbers: dict):
    """Draw microseconds per sample at the left, and seconds against the other sizes."""
    fig, axes = plots.figure(10.6, 3.0, 4, width_ratios=(1.7, 1, 1, 1))
    for ax, (axis, times) in zip(axes[0], numbers.items()):
        if axis == "samples":
            draw_batches(ax, times)
        else:
            draw_series(ax, times, 1.0)
            ax.set(xlabel=axis, ylabel="seconds")
            ax.set_title(f"exponent {times['exponent']:.2f}")
    axes[0, 0].legend(loc="center right", bbox_to_anchor=(1.0, 0.56))
    return fig


def draw_batches(ax, times: dict) -> None:
    """Draw microseconds per sample against the size of a batch, and SciPy's loop."""
    size = np.array(times["x"], float)
    draw_series(ax, times, size / 1e6)
    loop = 1e6 * times["loop"]
    ax.axhline(loop, **style.GUIDE, ls=":")
    note = {"ha": "right", "va": "bottom", "fontsize": 8}
    ax.text(size[-1], 1.1 * loop, "a loop of scipy.optimize.fsolve", **note)
    ax.set(xlabel="samples in a batch", ylabel="microseconds a sample")
    ax.set(title="Cost of a balance of forces")
    ax.set_ylim(top=10 * loop)


def draw_series(ax, times: dict, unit) -> None:
    """Draw the seconds of each series over a unit, one number or one for each size."""
    x = np.array(times["x"], float)
    for name, seconds in times["seconds"].items():
        colour, marker = LOOKS[name.partition(",")[0]]
        look = {"color": colour, "marker": marker, "label": name}
        if name.endswith("one core"):
            look |= {"ls": "--", "mfc": "white"}
        ax.loglog(x, np.array(seconds) / unit, **look)
    # All of a few sizes, every second of many.
    step = 1 if len(x) < 5 else 2
    ticks = x[::step]
    style.set_named_ticks(ax, ticks, [f"{size:,.0f}" for size in ticks])
    style.draw_grid(ax)


if __name__ == "__main__":
    main("cost_scaling", compute, draw)
