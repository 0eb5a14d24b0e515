"""What a balance of forces costs: microseconds a sample against the size of a batch, by both back ends, on one core and on
all, beside the usual loop of SciPy's; and time against links, directions and phases, with fitted exponents."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import fsolve

from figures import main
from geomech import connection
from geomech.gaits import Circle
from geomech.output import plots
from geomech.tiers.direct import direct
from rft import CATALOGUE, Chain, backend, body_velocity

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
NAMES, COLOURS = {"numpy": "NumPy", "numba": "compiled"}, {"numpy": "tab:blue", "numba": "tab:red"}
REPEATS = 3
TAN2, C = np.tan(np.radians(13.8)) ** 2, 1.8


def one_scipy_solve(alpha, alphadot, segments=20):
    """What a user writes today: midpoint segments in the middle link's frame, Eqs. 2-3 as printed, fsolve."""
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
        vn, vt = (v * n).sum(-1, keepdims=True), (v * t).sum(-1, keepdims=True)
        f = (1 + C / np.sqrt(TAN2 + vn**2)) * vn * n + vt * t
        moment = place[..., 0] * f[..., 1] - place[..., 1] * f[..., 0]
        return [f[..., 0].sum(), f[..., 1].sum(), moment.sum()]

    return fsolve(force, [0.02, 0.01, 0.1], full_output=True)  # off zero, where a link may stand still


def backends() -> list[str]:
    """NumPy, and compiled code where numba is installed."""
    return ["numpy", *(["numba"] * backend.installed())]


def quickest(f: Callable, repeats: int = REPEATS) -> float:
    """Seconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        f()
        times.append(time.perf_counter() - start)
    return min(times)


def _random(links: int, count: int):
    rng, spread = np.random.default_rng(links), 2.5 / np.sqrt(links / 3)
    return rng.uniform(-spread, spread, (count, links - 1)), rng.normal(size=(count, links - 1))


def _solver(how: str, threads: int | None = None) -> Callable:
    def velocity(alpha, alphadot):
        chain = Chain((1,) * (np.shape(alpha)[-1] + 1))
        return body_velocity(GLASS, chain, alpha, alphadot, backend=how, threads=threads).checked().xi

    return velocity


def _batches(scale: int) -> dict:
    """Seconds a batch, by back end and cores, and of the loop of SciPy's a sample."""
    sizes, series = [max(1, n // scale) for n in (1, 8, 64, 512, 4096, 32768)], {}
    for how in backends():
        for threads, cores in ((1, "one core"), (None, f"{os.cpu_count()} cores")):
            velocity = _solver(how, threads)
            velocity(*_random(3, 2))  # loads what is loaded once
            series[f"{NAMES[how]}, {cores}"] = [quickest(lambda n=n: velocity(*_random(3, n))) for n in sizes]
    some = list(zip(*_random(3, 40 // scale + 1)))
    return {"x": sizes, "seconds": series, "loop": quickest(lambda: [one_scipy_solve(*s) for s in some]) / len(some)}


def compute(scale: int = 1) -> dict:
    """{axis: {"x": [...], "seconds": {series: [...]}, "exponent": p}}; the exponent is NumPy's, of the larger half; axis
    "samples" has "loop", too. scale: shrinks all."""
    sizes = {
        "links": ([3, 6, 12, 25, 50, 100], lambda f, n: f(*_random(n, 2000 // scale))),
        "directions": ([4, 8, 16, 32, 64], lambda f, n: connection.fit(f, connection.grid(2, 31 // scale), n)),
        "phases": ([n // scale for n in (500, 2000, 8000, 32000)], lambda f, n: direct(f, Circle(), phases=n)),
    }
    out = {"samples": _batches(scale)}
    for axis, (x, run) in sizes.items():
        series = {NAMES[how]: [quickest(lambda n=n: run(_solver(how), n)) for n in x] for how in backends()}
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
        x, loop = np.array(found["x"], float), found.get("loop")
        per = x / 1e6 if loop else np.ones_like(x)  # microseconds a sample, or seconds
        for name, seconds in found["seconds"].items():
            how = next(k for k, told in NAMES.items() if name.startswith(told))
            one = name.endswith("one core")
            ax.loglog(
                x, seconds / per, "--o" if one else "-o", color=COLOURS[how], mfc="white" if one else None, label=name
            )
        if loop:
            ax.axhline(1e6 * loop, color="0.3", lw=0.8, ls=":")
            ax.text(x[-1], 1.1e6 * loop, "a loop of scipy.optimize.fsolve", ha="right", va="bottom", fontsize=8)
            ax.set(xlabel="samples in a batch", ylabel="microseconds a sample", title="Cost of a balance of forces")
            ax.set_ylim(top=1e7 * loop)
        else:
            ax.set(xlabel=axis, ylabel="seconds", title=f"exponent {found['exponent']:.2f}")
        shown = x[:: 1 if len(x) < 5 else 2]
        ax.set_xticks(shown, [f"{v:,.0f}" for v in shown])
        ax.minorticks_off()
        ax.grid(True, which="major", lw=0.3, color="0.85")
    axes[0, 0].legend(loc="center right", bbox_to_anchor=(1.0, 0.56))
    return fig


if __name__ == "__main__":
    main("cost_scaling", compute, draw)
