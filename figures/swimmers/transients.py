"""Transient response of the ground: displacement and forward velocity of a sandfish
with and without it (paper Sec. IV A).

Resistive force theory assumes that drag is steady at once. After a reversal the grains
need some travel, according to the paper about a fifth of the amplitude of an
oscillating rod, and the theory exceeds discrete-element simulation by up to 30 %. Left:
ratio of the net displacement with the effect to the displacement without it, against
the travel across over the amplitude A of the wave. The shares of the drag that act at
once are those of beds of grains (`figures.grains.beds`), where the travel is 2.8
diameters of a rod. Right: forward velocity through a cycle.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Sine
from geomech.scenes import load
from geomech.studies.displacement.batch import joined_scene
from rft import Backbone, Transient

ANIMAL = 0.22  # A / lambda of the animal, whose velocity is drawn
ANIMAL_AMPLITUDE = 0.16  # its A, body lengths
AMPLITUDES = {  # A / lambda: colour, marker
    0.1: (style.BLUE, "o"),
    ANIMAL: (style.VERMILION, "s"),
    0.4: (style.GREEN, "^"),
}
PUBLISHED_TRAVEL = 0.2  # of A
PUBLISHED_EXCESS = 0.3  # of resistive force theory over discrete elements
# Travel in grains, body lengths: in diameters of a rod, of an animal as thick as
# `sandfish-loose` assumes.
GRAINS = 2.8 * 2 * 0.06
GRAINS_SHARE = GRAINS / ANIMAL_AMPLITUDE
SHARES = (0.0, 0.1, 0.2, 0.4, 0.6, 0.9, 1.3, 1.7, GRAINS_SHARE)


def compute(shares=SHARES, elements: int = 40, phases: int = 64) -> dict:
    """Return displacements and velocities for each travel.

    shares: (T,), travel over A. net: (amplitudes, T), displacement over that at share
    0. t: (N,), phase. velocity: (T, N), xi_x at the animal's amplitude, body lengths
    per rad.
    """
    fish = load("sandfish-loose")
    head_drag = fish.system.effects
    scenes = []
    for amplitude in AMPLITUDES:
        wavelength = float(Sine().wavelength(amplitude))
        gait = Sine(amplitude=amplitude, elements=elements)
        for share in shares:
            transient = Transient(travel=share * amplitude * wavelength)
            effects = (*head_drag, transient)
            scene = fish.changed(body=Backbone(elements), effects=effects, gait=gait)
            scenes.append(scene)
    run = joined_scene(scenes).cycle(phases=phases)
    net = np.hypot(run.net[:, 0], run.net[:, 1]).reshape(len(AMPLITUDES), -1)
    xi = run.xi.reshape(len(AMPLITUDES), len(shares), phases, 3)
    return {
        "shares": np.array(shares),
        "net": net / net[:, :1],
        "t": 2 * np.pi * np.arange(phases) / phases,
        "velocity": xi[list(AMPLITUDES).index(ANIMAL), :, :, 0],
    }


@plots.styled
def draw(numbers: dict):
    """Draw displacement against the travel, and velocity through a cycle."""
    fig, axes = plots.figure(7.6, 3.0, 2)
    left, right = axes[0]
    draw_displacement(left, numbers)
    draw_velocity(right, numbers)
    return fig


def draw_displacement(ax, numbers: dict) -> None:
    """Draw displacement over that with steady drag, and the published numbers."""
    for (amplitude, look), net in zip(AMPLITUDES.items(), numbers["net"]):
        colour, marker = look
        label = rf"$A/\lambda$ = {amplitude:g}"
        ax.plot(numbers["shares"], net, color=colour, marker=marker, label=label)
    with_excess = 1 / (1 + PUBLISHED_EXCESS)
    ax.axvline(PUBLISHED_TRAVEL, **style.GUIDE, ls="--")
    ax.axvline(GRAINS_SHARE, **style.GUIDE, ls=":")
    ax.axhline(with_excess, **style.GUIDE, ls="-.")
    ax.text(1.0, with_excess + 0.012, "largest published excess", **style.NOTE)
    ax.text(PUBLISHED_TRAVEL + 0.03, 0.32, "published travel", **style.NOTE)
    note = rf"in grains ($A/\lambda$ = {ANIMAL:g})"
    ax.text(GRAINS_SHARE - 0.03, 0.98, note, ha="right", **style.NOTE)
    ax.set(
        xlabel="travel to 95 % of the drag / $A$",
        ylabel="displacement per cycle /\nthat with steady drag",
        xlim=(0, None),
        ylim=(0.28, 1.02),
    )
    ax.legend(loc="lower left", bbox_to_anchor=(0.1, 0.08))


def draw_velocity(ax, numbers: dict) -> None:
    """Draw forward velocity with steady drag, the published travel and grains'."""
    colour, _ = AMPLITUDES[ANIMAL]
    for share, dashes in ((0.0, "-"), (PUBLISHED_TRAVEL, "--"), (GRAINS_SHARE, ":")):
        k = int(np.argmin(np.abs(numbers["shares"] - share)))
        label = "steady drag" if share == 0 else f"travel {share:.1f} $A$"
        ax.plot(numbers["t"], numbers["velocity"][k], dashes, color=colour, label=label)
    style.set_phase_axis(ax)
    ax.set(ylabel=rf"$\xi_x$ (BL/rad), $A/\lambda$ = {ANIMAL:g}", ylim=(0, None))
    style.draw_legend_above(ax, 3)


if __name__ == "__main__":
    main("transients", compute, draw)
