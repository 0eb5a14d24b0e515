"""A wheel on sand: drawbar pull and sinkage against slip, slow and fast, with and without the inertia of grains (Sec. IV C).

Without inertia the law does not know how fast the wheel turns. A wheel of 0.1 m under 20 N in loose poppy seeds, all sizes
assumed; lambda = 1 (1 to 4 are known) and 638 kg/m^3 (Agarwal et al. 2021).
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
    """Return slip (N,), the load, and "found": for each wheel {rate, or 0 without inertia: Rolling}."""
    slip, stress = np.linspace(-0.2, 0.9, slips), VERTICAL["poppy-seeds-loose"].stress
    inertia = [GrainInertia(strength)]
    found = {
        name: {0.0: rolling(stress, wheel, load, 1.0, slip)}
        | {rate: rolling(stress, wheel, load, rate, slip, inertia) for rate in RATES}
        for name, wheel in WHEELS.items()
    }
    return {"slip": slip, "load": load, "found": found}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.4, 5.0, 2, 2)
    for column, (name, lines) in zip(axes.T, numbers["found"].items()):
        for (rate, found), colour in zip(
            lines.items(), (style.BLACK, *style.shades(len(RATES)))
        ):
            label = "no inertia, any rate" if rate == 0 else f"{rate:g} rad/s"
            look = {"color": colour, "lw": 2.0 if rate == 0 else 1.0, "label": label}
            column[0].plot(numbers["slip"], found.pull / numbers["load"], **look)
            column[1].plot(numbers["slip"], 1e3 * found.sinkage, **look)
        style.zero_line(column[0])
        column[0].set(title=name, ylabel="drawbar pull / load")
        column[1].set(xlabel="slip", ylabel="sinkage (mm)")
        column[1].invert_yaxis()
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside right center")
    return fig


if __name__ == "__main__":
    main("wheel", compute, draw)
