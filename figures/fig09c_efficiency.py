"""Fig. 9(c): what a wave along the body achieves against its curvature: sandfish in loose and close glass, snake in loose.

Left: progress per cycle over the arc length of a wave against the mean relative curvature; dots mark the best waves.
Right: undulation efficiency, progress over the wavelength, against A / lambda. Solid: the whole body, ends and yaw
included. Dashed and dotted: the balance of force along an endless wave, without and with the sandfish's head drag.
"""

from __future__ import annotations

import numpy as np

from figures import main
from geomech import plots, swimmers
from geomech.gaits import Sine
from geomech.scene import load

SCENES = {"sandfish-loose": "#D55E00", "sandfish-close": "#0072B2", "shovel-nosed-snake": "#009E73"}
AMPLITUDES = np.linspace(0.03, 0.6, 39)


def compute(amplitudes=AMPLITUDES) -> dict:
    """For each scene its `swimmers.performance`, "best": {measure: (amplitude, value)}; for the sandfish "endless" and
    "endless_head": efficiencies (B,)."""
    out = {}
    for name in SCENES:
        scene = load(name)
        found = swimmers.performance(scene, amplitudes)
        found["best"] = {k: swimmers.best(amplitudes, found[k]) for k in ("progress", "arc_efficiency")}
        lowest = swimmers.best(amplitudes, -np.log(found["cost_of_transport"]))
        found["best"]["cost_of_transport"] = lowest[0], float(np.exp(-lowest[1]))
        if name.startswith("sandfish"):
            for key, cap in (("endless", None), ("endless_head", scene.effects[0])):
                found[key] = np.array([swimmers.endless_sine(scene.medium, a, cap) for a in amplitudes])
        out[name] = found
    return out


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.6, 3.0, 2)
    left, right = axes[0]
    for name, found in numbers.items():
        style = {"color": SCENES[name], "label": name.replace("-", " ")}
        left.plot(found["relative_curvature"], found["arc_efficiency"], **style)
        a, top = found["best"]["arc_efficiency"]
        left.plot(Sine().relative_curvature(a), top, "o", color=SCENES[name], ms=5)
        right.plot(found["amplitude"], found["efficiency"], **style)
        for key, dashes in (("endless", "--"), ("endless_head", ":")):
            if key in found:
                arc = found[key] * Sine().wavelength(found["amplitude"])
                left.plot(found["relative_curvature"], arc, color=SCENES[name], ls=dashes, lw=1.0)
                right.plot(found["amplitude"], found[key], color=SCENES[name], ls=dashes, lw=1.0)
    left.set(
        xlabel=r"mean relative curvature $\overline{|\kappa|}\,\lambda_s$ (rad)",
        ylabel=r"progress per cycle / $\lambda_s$",
    )
    right.set(xlabel=r"$A/\lambda$", ylabel=r"undulation efficiency $\eta$", xlim=(0, 0.6))
    for ax in (left, right):
        ax.set_ylim(0, None)
    right.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="dashed: endless wave\ndotted: with head drag")
    return fig


if __name__ == "__main__":
    main("fig09c", compute, draw)
