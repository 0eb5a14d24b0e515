"""The cost of a balance of forces: microseconds a sample against the size of a batch,
by both back ends, on one core and on all, beside the usual loop of SciPy's; and time
against links, directions and phases, with fitted exponents."""

from __future__ import annotations

import os
import timeit
from collections.abc import Callable

import numpy as np
from scipy.optimize import fsolve

from figures import main, style
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
TAN2 = np.tan(np.radians(13.8)) ** 2
C = 1.8


def one_scipy_solve(alpha, alphadot, segments=20):
    """Solve one balance as one would by hand: midpoint segments in the middle link's
    frame, Eqs. 2-3 as printed, fsolve."""
    half = 1 / 6
    s = ((np.arange(segments) + 0.5) / segments * 2 - 1) * half
    headings = np.array([-alpha[0], 0.0, alpha[1]])
    turns = np.array([-alphadot[0], 0.0, alphadot[1]])
    t = np.stack([np.cos(headings), np.sin(headings)], -1)[:, None]
    n = np.stack([-t[..., 1], t[..., 0]], -1)
    joints = np.array([[-half, 0.0], [0.0, 0.0], [half, 0.0]])[:, None]
    arms = (s + np.array([-half, 0.0, half])[:, None])[..., None] * t
    place = joints + arms

    def force(xi):
        spin = xi[2] * np.stack([-place[..., 1], place[..., 0]], -1)
        swing = turns[:, None, None] * np.stack([-arms[..., 1], arms[..., 0]], -1)
        v = xi[:2] + spin + swing
        v = v / (np.sqrt((v**2).sum(-1, keepdims=True)) + 1e-12)
        vn = (v * n).sum(-1, keepdims=True)
        vt = (v * t).sum(-1, keepdims=True)
        f = (1 + C / np.sqrt(TAN2 + vn**2)) * vn * n + vt * t
        moment = place[..., 0] * f[..., 1] - place[..., 1] * f[..., 0]
        return [f[..., 0].sum(), f[..., 1].sum(), moment.sum()]

    return fsolve(
        force, [0.02, 0.01, 0.1], full_output=True
    )  # off zero, where a link may stand still


def backends() -> list[str]:
    """Return the names of NumPy and, where numba is installed, of compiled code."""
    return ["numpy", *(["numba"] * backend.installed())]


def quickest(f: Callable, repeats: int = REPEATS) -> float:
    """Return the seconds that the quickest of several calls takes."""
    return min(timeit.repeat(f, number=1, repeat=repeats))


def random_samples(links: int, count: int):
    """Return shapes and rates (count, links - 1) within what such a body can bend."""
    rng = np.random.default_rng(links)
    spread = 2.5 / np.sqrt(links / 3)
    return rng.uniform(-spread, spread, (count, links - 1)), rng.normal(
        size=(count, links - 1)
    )


def solver(how: str, threads: int | None = None) -> Callable:
    """Return the velocity of a chain in loose glass by a back end, None for all
    threads."""

    def velocity(alpha, alphadot):
        chain = Chain((1,) * (np.shape(alpha)[-1] + 1))
        return (
            body_velocity(GLASS, chain, alpha, alphadot, backend=how, threads=threads)
            .checked()
            .xi
        )

    return velocity


def batches(scale: int) -> dict:
    """Return the seconds of a batch, by back end and cores, and of SciPy's loop the
    seconds of a sample."""
    sizes = [max(1, n // scale) for n in (1, 8, 64, 512, 4096, 32768)]
    series = {}
    for how in backends():
        for threads, cores in ((1, "one core"), (None, f"{os.cpu_count()} cores")):
            velocity = solver(how, threads)
            velocity(*random_samples(3, 2))  # loads what is loaded once
            series[f"{NAMES[how]}, {cores}"] = [
                quickest(lambda n=n: velocity(*random_samples(3, n))) for n in sizes
            ]
    samples = list(zip(*random_samples(3, 40 // scale + 1)))
    return {
        "x": sizes,
        "seconds": series,
        "loop": quickest(lambda: [one_scipy_solve(*s) for s in samples]) / len(samples),
    }


def compute(scale: int = 1) -> dict:
    """Return {axis: {"x": [...], "seconds": {series: [...]}, "exponent": p}}, the
    exponent being NumPy's over the larger half.

    The axis "samples" has "loop", too. scale: divides all sizes.
    """
    sizes = {
        "links": (
            [3, 6, 12, 25, 50, 100],
            lambda f, n: f(*random_samples(n, 2000 // scale)),
        ),
        "directions": (
            [4, 8, 16, 32, 64],
            lambda f, n: connection.fit(f, connection.grid(2, 31 // scale), n),
        ),
        "phases": (
            [n // scale for n in (500, 2000, 8000, 32000)],
            lambda f, n: direct(f, Circle(), phases=n),
        ),
    }
    out = {"samples": batches(scale)}
    for axis, (x, run) in sizes.items():
        series = {
            NAMES[how]: [quickest(lambda n=n: run(solver(how), n)) for n in x]
            for how in backends()
        }
        out[axis] = {"x": x, "seconds": series}
    for found in out.values():
        half, (seconds, *_) = len(found["x"]) // 2, found["seconds"].values()
        x = np.log(found["x"][half - 1 :])
        found["exponent"] = float(np.polyfit(x, np.log(seconds[half - 1 :]), 1)[0])
    return out


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(10.6, 3.0, 4, width_ratios=(1.7, 1, 1, 1))
    for ax, (axis, found) in zip(axes[0], numbers.items()):
        x = np.array(found["x"], float)
        loop = found.get("loop")
        per = x / 1e6 if loop else np.ones_like(x)  # microseconds a sample, or seconds
        for name, seconds in found["seconds"].items():
            colour, marker = LOOKS[name.partition(",")[0]]
            look = {"ls": "--", "mfc": "white"} if name.endswith("one core") else {}
            ax.loglog(x, seconds / per, color=colour, marker=marker, label=name, **look)
        if loop:
            ax.axhline(1e6 * loop, **style.GUIDE, ls=":")
            ax.text(
                x[-1],
                1.1e6 * loop,
                "a loop of scipy.optimize.fsolve",
                ha="right",
                va="bottom",
                fontsize=8,
            )
            ax.set(
                xlabel="samples in a batch",
                ylabel="microseconds a sample",
                title="Cost of a balance of forces",
            )
            ax.set_ylim(top=1e7 * loop)
        else:
            ax.set(
                xlabel=axis, ylabel="seconds", title=f"exponent {found['exponent']:.2f}"
            )
        ticks = x[:: 1 if len(x) < 5 else 2]
        style.named_ticks(ax, ticks, [f"{v:,.0f}" for v in ticks])
        style.grid(ax)
    axes[0, 0].legend(loc="center right", bbox_to_anchor=(1.0, 0.56))
    return fig


if __name__ == "__main__":
    main("cost_scaling", compute, draw)
