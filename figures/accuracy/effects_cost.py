"""Cost of effects: computing time of one cycle of the sandfish with each effect
switched on alone, over the time without effects.

All times are from one run, with seven amplitudes in a batch. If an effect depends on
the past or gives the body mass, the phases are computed one after the other, and the
cycle is repeated until the motion repeats. This is the cost of the engine, not of the
effect.
"""

from __future__ import annotations

import time

import numpy as np

import rft
from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft import (
    BodyInertia,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    SkinFriction,
    Transient,
)

ALGEBRAIC = {
    "skin friction": SkinFriction(),
    "end caps": EndCaps(radius=0.06, tail=0.0),
    "depth profile": DepthProfile(along=(0.8, 1.2)),
    "grain inertia": GrainInertia(frequency=3.0, length=0.1, depth=0.05),
}
MARCHING = {
    "sloping surface": DepthProfile(slope=0.1),
    "transient": Transient(travel=0.03),
    "disturbed ground": DisturbedGround(radius=0.06, weakening=0.2),
    "body inertia": BodyInertia(mass=0.016, frequency=3.0, length=0.1, drag=2.1),
}
SETS = {
    "none": (),
    **{name: (effect,) for name, effect in ALGEBRAIC.items()},
    "these four": tuple(ALGEBRAIC.values()),
    **{name: (effect,) for name, effect in MARCHING.items()},
    "all but the slope": (
        *ALGEBRAIC.values(),
        MARCHING["transient"],
        MARCHING["disturbed ground"],
        MARCHING["body inertia"],
    ),
}
ENGINES = {
    "algebraic": (style.BLUE, ""),
    "time stepping": (style.VERMILION, "///"),
    "dynamic": (style.GREEN, "..."),
}


def compute(phases: int = 64, repeats: int = 5, cycles: int | None = None) -> dict:
    """Return {name: {"ratio", "engine", "cycles"}}, where the ratio is the median over
    rounds of time over plain time.

    cycles: of time stepping; None: as many as it takes to reach the limit cycle.
    """
    fish = load("sandfish-loose").with_numerics(cycles=cycles)
    scenes = {name: fish.changed(effects=effects) for name, effects in SETS.items()}
    engines = {}
    for name, scene in scenes.items():
        engines[name] = rft.effects.engine(scene.system.effects)
    amplitudes = np.linspace(0.1, 0.4, 7)
    seconds: dict = {name: [] for name in SETS}
    n_cycles = {}
    for repeat in range(repeats + 1):  # the first round warms up
        for name, scene in scenes.items():
            # Other engines are slow enough for one timing to be exact, and the
            # algebraic one has warmed up what they need.
            if repeat != 1 and engines[name] != "algebraic":
                continue
            start = time.perf_counter()
            run = scene.cycle(amplitudes=amplitudes, phases=phases)
            duration = time.perf_counter() - start
            n_cycles[name] = run.cycles
            if repeat:
                seconds[name].append(duration)
    without = np.array(seconds["none"])
    costs = {}
    for name, times in seconds.items():
        costs[name] = {
            "ratio": float(np.median(np.array(times) / without[: len(times)])),
            "engine": engines[name],
            "cycles": n_cycles[name],
        }
    return costs


@plots.styled
def draw(numbers: dict):
    """Draw a bar for each set of effects, with the number of cycles where there are
    several."""
    fig, axes = plots.figure(5.6, 3.4)
    ax = axes[0, 0]
    names = list(numbers)[::-1]
    ratios = np.array([numbers[name]["ratio"] for name in names])
    engines = np.array([numbers[name]["engine"] for name in names])
    for engine, (colour, hatch) in ENGINES.items():
        rows = np.flatnonzero(engines == engine)
        look = {"color": colour, "hatch": hatch, "edgecolor": "white", "height": 0.6}
        ax.barh(rows, ratios[rows], label=engine, **look)
    for row, name in enumerate(names):
        label = f"{ratios[row]:.3g}"
        cycles = numbers[name]["cycles"]
        if cycles > 1:
            label += f", {cycles} cycles"
        ax.text(1.08 * ratios[row], row, label, va="center", fontsize=8)
    ax.set_yticks(range(len(names)), names)
    ax.axvline(1.0, **style.GUIDE)
    ax.set(xlabel="time / time with no effect", xscale="log")
    ax.set(xlim=(0.5, 5 * max(ratios)))
    style.draw_legend_above(ax, 3, title="engine")
    return fig


if __name__ == "__main__":
    main("effects_cost", compute, draw)
