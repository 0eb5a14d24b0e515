"""How good resistive force theory is in a fluid, and what more accuracy costs: circles
of three equal links by four models.

Left: displacement against the radius of the circle at slenderness 48, length of the
body over its diameter. Two models take the force on a link from its own velocity, with
a ratio of 2 of the drag across and along, or with that of a straight cylinder; in the
other two all parts of the body feel each other's flow. Middle: displacement on the
circle of 1 rad against the slenderness. Right: on that circle at slenderness 198, the
difference from touching beads, which are the reference, against the CPU time of one
cycle of 64 phases. The difference of the Stokeslets is one of the models, as a row of
beads drags like a thinner cylinder. The dashed line is their numerical error with 2 to
32 segments on each link, against 48.
"""

from __future__ import annotations

import time

import numpy as np

from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Circle
from geomech.mathematics.systems import BeadSwimmer, StokesletSwimmer, Swimmer
from geomech.runs.threads import one_blas_thread
from rft import Chain, Viscous

SLENDERNESS = 48.0  # 16 beads on each link
AMPLITUDES = np.linspace(0.1, 2.0, 20)  # rad
SLENDERNESSES = (12.0, 24.0, 48.0, 99.0, 198.0)
SLENDER = 198.0  # of the comparison of times
SEGMENTS = (2, 3, 4, 6, 8, 12, 16, 24, 32)  # on each link
FINE_SEGMENTS = 48
PHASES = 64
RUNS = 5  # of which the shortest counts
LOOKS = {
    "ratio 2": {"color": style.FLUID, "marker": "s"},
    "ratio of a cylinder": {"color": style.GREEN, "marker": "D"},
    "Stokeslets": {"color": style.BLUE, "marker": "o"},
    "touching beads": {"color": style.BLACK, "marker": "^"},
}


def model(name: str, slenderness: float):
    """Return the swimmer of a model."""
    if name == "ratio 2":
        return Swimmer(Viscous(2.0), Chain())
    if name == "ratio of a cylinder":
        return Swimmer(Viscous(slenderness=slenderness), Chain())
    if name == "Stokeslets":
        return StokesletSwimmer(slenderness=slenderness)
    return BeadSwimmer(slenderness=slenderness)


def distances(system, amplitudes=(1.0,)) -> np.ndarray:
    """Return the net distances (A,), body lengths, of circles."""
    cycle = Circle().cycle(PHASES, np.asarray(amplitudes, float))
    return np.hypot(*system.run(*cycle).net[:, :2].T)


def seconds(system, runs: int) -> float:
    """Return the CPU seconds of one cycle, the shortest of some runs."""
    alpha, alphadot = Circle().cycle(PHASES, np.ones(1))
    taken = []
    with one_blas_thread():
        for _ in range(runs):
            start = time.process_time()
            system.run(alpha, alphadot)
            taken.append(time.process_time() - start)
    return min(taken)


def compute(
    amplitudes=AMPLITUDES,
    slendernesses=SLENDERNESSES,
    segments=SEGMENTS,
    runs: int = RUNS,
) -> dict:
    """Return {"amplitudes", "by_amplitude": {model: (A,)}, "slendernesses",
    "by_slenderness": {model: (P,)}, "cost": {model: (seconds, difference)}, "segments":
    {"seconds", "error"}}.

    Distances are in body lengths; differences and errors are relative."""
    by_amplitude = {}
    by_slenderness = {}
    for name in LOOKS:
        by_amplitude[name] = distances(model(name, SLENDERNESS), amplitudes)
        found = [distances(model(name, p))[0] for p in slendernesses]
        by_slenderness[name] = np.array(found)

    cost = {}
    reference = distances(model("touching beads", SLENDER))[0]
    for name in LOOKS:
        system = model(name, SLENDER)
        share = distances(system)[0] / reference - 1
        cost[name] = (seconds(system, runs), share)

    rows = []
    finest = StokesletSwimmer(slenderness=SLENDER, segments=FINE_SEGMENTS)
    limit = distances(finest)[0]
    for count in segments:
        system = StokesletSwimmer(slenderness=SLENDER, segments=count)
        rows.append((seconds(system, runs), distances(system)[0] / limit - 1))
    names = ("seconds", "error")
    return {
        "amplitudes": np.asarray(amplitudes),
        "by_amplitude": by_amplitude,
        "slendernesses": np.asarray(slendernesses),
        "by_slenderness": by_slenderness,
        "cost": cost,
        "segments": dict(zip(names, np.array(rows).T)),
    }


@plots.styled
def draw(numbers: dict):
    """Draw displacement against radius and slenderness, and difference against time."""
    fig, axes = plots.figure(10.2, 3.4, 3)
    left, middle, right = axes[0]
    for name, look in LOOKS.items():
        left.plot(
            numbers["amplitudes"],
            numbers["by_amplitude"][name],
            label=name,
            **look,
            ms=4,
            markevery=3,
        )
        middle.plot(
            numbers["slendernesses"], numbers["by_slenderness"][name], **look, ms=4
        )
    left.set(
        xlabel="radius of the circle (rad)",
        ylabel="displacement per cycle (BL)",
        xlim=(0, None),
        ylim=(0, None),
    )
    style.draw_legend_above(left, 2)
    middle.set(
        xscale="log",
        xlabel="length over diameter",
        ylabel="displacement per cycle (BL)",
        ylim=(0, None),
    )
    style.set_named_ticks(
        middle, numbers["slendernesses"], [f"{p:g}" for p in numbers["slendernesses"]]
    )
    draw_cost(right, numbers)
    return fig


def draw_cost(ax, numbers: dict) -> None:
    """Draw the difference from beads against seconds."""
    for name, (taken, share) in numbers["cost"].items():
        if name == "touching beads":
            ax.axvline(1e3 * taken, **style.GUIDE)
            ax.text(1e3 * taken, 0.9, "beads ", **style.NOTE, ha="right")
        else:
            ax.plot(1e3 * taken, abs(share), **LOOKS[name], ls="", ms=6)
    found = numbers["segments"]
    ax.plot(
        1e3 * found["seconds"],
        np.abs(found["error"]),
        color=LOOKS["Stokeslets"]["color"],
        ls="--",
        label="Stokeslets, by the number of segments",
    )
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="CPU time of a cycle (ms)",
        ylabel="relative difference from beads",
        ylim=(1e-4, 2),
    )
    style.draw_legend_above(ax)


def lines(numbers: dict) -> str:
    """Return the numbers of the circle of 1 rad as text."""
    rows = []
    for name, values in numbers["by_slenderness"].items():
        rows.append((name, *(f"{x:.4f}" for x in values)))
    heads = ["displacement (BL) at slenderness"]
    heads += [f"{p:g}" for p in numbers["slendernesses"]]
    times = []
    for name, (taken, share) in numbers["cost"].items():
        times.append((name, f"{1e3 * taken:.2f}", f"{share:+.1%}"))
    return "\n\n".join(
        [
            style.table(heads, rows),
            style.table(("model", "ms", "difference from beads"), times),
        ]
    )


if __name__ == "__main__":
    main("fluid_models", compute, draw, lines)
