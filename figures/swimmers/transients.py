"""The loss of a sandfish by the transient response of the ground (paper Sec. IV A).

Resistive force theory takes the drag for steady at once. After a reversal the grains
need some travel, by the paper about a fifth of the amplitude of an oscillating rod, and
the theory exceeds discrete-element simulation by up to 30 %. Left: net displacement
over that without the effect, against the travel across over the wave's amplitude A,
with the shares of the drag that are there at once in beds of grains (`figures.grains.beds`);
there the travel is 2.8 diameters of a rod. Right: forward velocity through a cycle.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Sine
from geomech.scenes import load
from geomech.studies.displacement.batch import joined_scene
from rft import Backbone, Transient

AMPLITUDES = (0.1, 0.22, 0.4)  # A / lambda
PUBLISHED = {
    "travel": 0.2,
    "excess": 0.3,
}  # of A; of resistive force theory over discrete elements
GRAINS = (
    2.8 * 2 * 0.06
)  # body lengths: diameters of a rod, of an animal as thick as `sandfish-loose` assumes
VELOCITY = style.VERMILION  # of the animal's amplitude, whose velocity is shown
SHARES = (0.0, 0.1, 0.2, 0.4, 0.6, 0.9, 1.3, 1.7, GRAINS / 0.16)


def compute(shares=SHARES, elements: int = 40, phases: int = 64) -> dict:
    """Return displacements and velocities for each travel.

    shares: (T,), travel over A. net: (amplitudes, T), displacement over that at share
    0. t: (N,), phase. velocity: (T, N), xi_x at the animal's amplitude, body lengths
    per rad.
    """
    fish = load("sandfish-loose")
    scenes = [
        fish.changed(
            body=Backbone(elements),
            effects=(
                *fish.system.effects,  # the drag on its head
                Transient(travel=share * a * float(Sine().wavelength(a))),
            ),
            gait=Sine(amplitude=a, elements=elements),
        )
        for a in AMPLITUDES
        for share in shares
    ]
    run = joined_scene(scenes).cycle(phases=phases)
    net = np.hypot(run.net[:, 0], run.net[:, 1]).reshape(len(AMPLITUDES), -1)
    xi = run.xi.reshape(len(AMPLITUDES), len(shares), phases, 3)
    return {
        "shares": np.array(shares),
        "net": net / net[:, :1],
        "t": 2 * np.pi * np.arange(phases) / phases,
        "velocity": xi[AMPLITUDES.index(0.22), :, :, 0],
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.6, 3.0, 2)
    left, right = axes[0]
    for a, net, colour, marker in zip(
        AMPLITUDES, numbers["net"], (style.BLUE, VELOCITY, style.GREEN), "os^"
    ):
        left.plot(
            numbers["shares"],
            net,
            color=colour,
            marker=marker,
            label=rf"$A/\lambda$ = {a:g}",
        )
    left.axvline(PUBLISHED["travel"], **style.GUIDE, ls="--")
    left.axvline(GRAINS / 0.16, **style.GUIDE, ls=":")
    left.axhline(1 / (1 + PUBLISHED["excess"]), **style.GUIDE, ls="-.")
    left.text(
        1.0,
        1 / (1 + PUBLISHED["excess"]) + 0.012,
        "largest published excess",
        **style.NOTE,
    )
    left.text(PUBLISHED["travel"] + 0.03, 0.32, "published travel", **style.NOTE)
    left.text(
        GRAINS / 0.16 - 0.03,
        0.98,
        r"in grains ($A/\lambda$ = 0.22)",
        ha="right",
        **style.NOTE,
    )
    left.set(
        xlabel="travel to 95 % of the drag / $A$",
        ylabel="displacement per cycle /\nthat with steady drag",
    )
    left.set(xlim=(0, None), ylim=(0.28, 1.02))
    left.legend(loc="lower left", bbox_to_anchor=(0.1, 0.08))
    for share, dashes in ((0.0, "-"), (0.2, "--"), (GRAINS / 0.16, ":")):
        k = int(np.argmin(np.abs(numbers["shares"] - share)))
        label = "steady drag" if share == 0 else f"travel {share:.1f} $A$"
        right.plot(
            numbers["t"], numbers["velocity"][k], dashes, color=VELOCITY, label=label
        )
    style.phase_axis(right)
    right.set(ylabel=r"$\xi_x$ (BL/rad), $A/\lambda$ = 0.22", ylim=(0, None))
    style.legend_above(right, 3)
    return fig


if __name__ == "__main__":
    main("transients", compute, draw)
