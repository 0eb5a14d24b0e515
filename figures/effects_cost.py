"""What effects cost: time of the sandfish's force balance with effects switched on one at a time, over that with none."""

from __future__ import annotations

import dataclasses
import time

import numpy as np

from figures import main
from geomech import plots
from geomech.scenes import load
from rft import EndCaps, GrainInertia, SkinFriction

SETS = {
    "none": (),
    "skin friction": (SkinFriction(),),
    "end caps": (EndCaps(radius=0.06, tail=0.0),),
    "grain inertia": (GrainInertia(frequency=3.0, length=0.1, depth=0.05),),
    "all": (SkinFriction(), EndCaps(radius=0.06, tail=0.0), GrainInertia(frequency=3.0, length=0.1, depth=0.05)),
}


def compute(phases: int = 64, repeats: int = 5) -> dict:
    """{name: {"ratio": median of time over the plain time in the same round, "iterations": mean solver steps}}."""
    fish = load("sandfish-loose")
    scenes = {name: dataclasses.replace(fish, effects=effects) for name, effects in SETS.items()}
    alpha, alphadot = fish.gait.cycle(phases, np.linspace(0.1, 0.4, 7))
    seconds = {name: [] for name in SETS}
    iterations = {
        name: float(scene.solve(alpha, alphadot).checked().iterations.mean()) for name, scene in scenes.items()
    }
    for _ in range(repeats):
        for name, scene in scenes.items():
            start = time.perf_counter()
            scene.solve(alpha, alphadot)
            seconds[name].append(time.perf_counter() - start)
    plain = np.array(seconds["none"])
    return {
        k: {"ratio": float(np.median(np.array(t) / plain)), "iterations": iterations[k]} for k, t in seconds.items()
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(4.8, 2.2)
    ax, names = axes[0, 0], list(numbers)[::-1]
    ratios = [numbers[n]["ratio"] for n in names]
    ax.barh(names, ratios, color="#0072B2", height=0.6)
    for k, name in enumerate(names):
        ax.text(ratios[k] + 0.03, k, f"{numbers[name]['iterations']:.1f} steps", va="center", fontsize=8)
    ax.axvline(1.0, color="0.6", lw=0.8)
    ax.set(xlabel="time / time with no effect", xlim=(0, 1.25 * max(ratios)))
    return fig


if __name__ == "__main__":
    main("effects_cost", compute, draw)
