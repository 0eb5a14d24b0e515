"""What the transient response of the ground costs a sandfish (paper Sec. IV A).

Resistive force theory takes the drag for steady at once. After a reversal the grains need some travel, about a fifth of
the amplitude of an oscillating rod, and discrete-element simulation finds speeds up to 30 % lower. Left: net displacement
over that without the effect, against the travel over the wave's amplitude A. Right: forward velocity through a cycle.
"""

from __future__ import annotations

import numpy as np

from figures import main
from geomech.gaits import Sine
from geomech.output import plots
from geomech.scene import load
from geomech.study.batch import beside
from rft import Backbone, Transient

AMPLITUDES = (0.1, 0.22, 0.4)  # A / lambda
PUBLISHED = {"travel": 0.2, "loss": 0.3}
SHARES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8)


def compute(shares=SHARES, elements: int = 100, phases: int = 96) -> dict:
    """shares (T,): travel over A. net: (amplitudes, T), displacement over that at share 0. t (N,): phase, velocity (T, N):
    xi_x at the animal's amplitude, body lengths per rad."""
    fish = load("sandfish-loose")
    scenes = [
        fish.changed(
            body=Backbone(elements),
            effects=(Transient(travel=share * a * float(Sine().wavelength(a))),),
            gait=Sine(amplitude=a, elements=elements),
        )
        for a in AMPLITUDES
        for share in shares
    ]
    run = beside(scenes).cycle(phases=phases)
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
    for a, net, colour in zip(AMPLITUDES, numbers["net"], ("#0072B2", "#D55E00", "#009E73")):
        left.plot(numbers["shares"], net, "o-", ms=3, color=colour, label=rf"$A/\lambda$ = {a:g}")
    left.axvline(PUBLISHED["travel"], color="0.5", lw=0.8, ls="--")
    left.axhline(1 - PUBLISHED["loss"], color="0.5", lw=0.8, ls="-.")
    left.text(0.22, 1 - PUBLISHED["loss"] + 0.008, "largest published loss", color="0.35", fontsize=8)
    left.text(PUBLISHED["travel"] + 0.01, 0.57, "published travel", color="0.35", fontsize=8)
    left.set(
        xlabel="travel to 95 % of the drag / $A$",
        ylabel="displacement per cycle /\nthat with steady drag",
        xlim=(0, None),
        ylim=(0.55, 1.02),
    )
    left.legend(loc="upper right", fontsize=8)
    for share, dashes in ((0.0, "-"), (0.2, "--"), (0.65, ":")):
        k = int(np.argmin(np.abs(numbers["shares"] - share)))
        label = "steady drag" if share == 0 else f"travel {share:g} $A$"
        right.plot(numbers["t"], numbers["velocity"][k], dashes, color="#D55E00", label=label)
    right.set(
        xlabel="phase of the cycle (rad)",
        ylabel=r"$\xi_x$ (BL/rad), $A/\lambda$ = 0.22",
        xlim=(0, 2 * np.pi),
        ylim=(0, None),
        xticks=np.pi * np.arange(5) / 2,
        xticklabels=["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"],
    )
    right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8)
    return fig


if __name__ == "__main__":
    main("transients", compute, draw)
