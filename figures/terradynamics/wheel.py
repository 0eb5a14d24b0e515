"""A wheel on sand: drawbar pull and sinkage against slip, slow and fast, with and
without the inertia of the grains (Sec. IV C).

Without inertia the forces do not depend on how fast the wheel turns. The wheel of 0.1 m
carries 20 N in loose poppy seeds; all sizes are assumed. lambda = 1 (published values
are 1 to 4) and the density is 638 kg/m^3 (Agarwal et al. 2021).
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from rft.terradynamics.ground import GrainInertia
from rft.terradynamics.plates import VERTICAL, Wheel
from rft.terradynamics.walking import rolling

RATES = (1.0, 10.0, 30.0, 60.0)  # rad/s
WHEELS = {"smooth": Wheel(0.1, 0.1), "12 lugs": Wheel(0.1, 0.1, 12, 0.015, 0.006)}


def compute(slips: int = 23, load: float = 20.0, strength: float = 1.0) -> dict:
    """Return slip (N,), the load, N, and "wheels": for each {rate: Rolling}, with
    the rate 0 for the law without inertia."""
    slip = np.linspace(-0.2, 0.9, slips)
    stress = VERTICAL["poppy-seeds-loose"].stress
    inertia = [GrainInertia(strength)]
    wheels = {}
    for name, wheel in WHEELS.items():
        wheels[name] = {0.0: rolling(stress, wheel, load, 1.0, slip)}
        for rate in RATES:
            wheels[name][rate] = rolling(stress, wheel, load, rate, slip, inertia)
    return {"slip": slip, "load": load, "wheels": wheels}


@plots.styled
def draw(numbers: dict):
    """Draw a column for each wheel: pull above, sinkage below."""
    fig, axes = plots.figure(7.4, 5.0, 2, 2)
    colours = (style.BLACK, *style.shades(len(RATES)))
    for (pull_ax, sinkage_ax), (name, lines) in zip(axes.T, numbers["wheels"].items()):
        for (rate, line), colour in zip(lines.items(), colours):
            look = {"color": colour, "lw": 1.0, "label": f"{rate:g} rad/s"}
            if rate == 0:
                look |= {"lw": 2.0, "label": "no inertia, any rate"}
            pull_ax.plot(numbers["slip"], line.pull / numbers["load"], **look)
            sinkage_ax.plot(numbers["slip"], 1e3 * line.sinkage, **look)
        style.draw_zero_line(pull_ax)
        pull_ax.set(title=name, ylabel="drawbar pull / load")
        sinkage_ax.set(xlabel="slip", ylabel="sinkage (mm)")
        sinkage_ax.invert_yaxis()
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside right center")
    return fig


if __name__ == "__main__":
    main("wheel", compute, draw)
