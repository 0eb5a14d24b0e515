"""The cost of effects: time of one cycle of the sandfish with effects switched on one
at a time, over that with none.

All from one run, seven amplitudes side by side. Effects that remember, or that give the
body mass, take the phases one after the other and the cycle several times over until it
repeats: that is the cost of the engine, not of the effect.
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
    "all but the slope": (*ALGEBRAIC.values(), *list(MARCHING.values())[1:]),
}
ENGINES = {
    "algebraic": (style.BLUE, ""),
    "time stepping": (style.VERMILION, "///"),
    "dynamic": (style.GREEN, "..."),
}


def compute(phases: int = 64, repeats: int = 5, cycles: int | None = None) -> dict:
    """Return {name: {"ratio", "engine", "cycles"}}, the ratio being the median over
    rounds of time over plain time.

    cycles: of time stepping; None: as many as it takes to reach the limit cycle.
    """
    fish = load("sandfish-loose").with_numerics(cycles=cycles)
    scenes = {name: fish.changed(effects=effects) for name, effects in SETS.items()}
    amplitudes = np.linspace(0.1, 0.4, 7)
    seconds = {name: [] for name in SETS}
    runs = {}
    for repeat in range(repeats + 1):  # the first round warms up
        for name, scene in scenes.items():
            if repeat != 1 and rft.effects.engine(scene.system.effects) != "algebraic":
                # long enough for one timing to tell, and nothing to warm up that the
                # others have not
                continue
            start = time.perf_counter()
            runs[name] = scene.cycle(amplitudes=amplitudes, phases=phases)
            if repeat:
                seconds[name].append(time.perf_counter() - start)
    without = np.array(seconds["none"])
    return {
        name: {
            "ratio": float(np.median(np.array(taken) / without[: len(taken)])),
            "engine": rft.effects.engine(scenes[name].system.effects),
            "cycles": runs[name].cycles,
        }
        for name, taken in seconds.items()
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(5.6, 3.4)
    ax = axes[0, 0]
    names = list(numbers)[::-1]
    ratios = [numbers[name]["ratio"] for name in names]
    for engine, (colour, hatch) in ENGINES.items():
        rows = [k for k, name in enumerate(names) if numbers[name]["engine"] == engine]
        ax.barh(
            rows,
            [ratios[k] for k in rows],
            color=colour,
            hatch=hatch,
            edgecolor="white",
            height=0.6,
            label=engine,
        )
    for k, name in enumerate(names):
        cycles = numbers[name]["cycles"]
        passes = f", {cycles} cycles" if cycles > 1 else ""
        ax.text(
            ratios[k] * 1.08, k, f"{ratios[k]:.3g}{passes}", va="center", fontsize=8
        )
    ax.set_yticks(range(len(names)), names)
    ax.axvline(1.0, **style.GUIDE)
    ax.set(
        xlabel="time / time with no effect", xscale="log", xlim=(0.5, 5 * max(ratios))
    )
    style.legend_above(ax, 3, title="engine")
    return fig


if __name__ == "__main__":
    main("effects_cost", compute, draw)
