"""Fig. 9(c): efficiency, slip and cost of a wave along the body against its curvature,
for the sandfish in loose and close-packed glass beads and the snake in loose glass
beads.

Rows from above: progress per cycle over the arc length lambda_s of a wave; progress per
cycle over its straight wavelength lambda; slip; mechanical cost of transport. Left:
against the mean relative curvature. Right: against A / lambda, which corresponds to it
one to one. Dots mark the best wave where there is one: efficiency and slip go on
improving with the amplitude. Solid: the whole body, ends and yaw included. Dashed and
dotted: the balance of force along an endless wave that slides along its curve, without
and with the head drag of the sandfish. Dash-dot-dotted: an endless wave whose points
move only sideways. Pale: the snake, with its skin friction compared with the friction
of an aluminium rod, 0.2, in place of the 0.15 in the caption of Fig. 5. Last row: the
body velocity of the sandfish through a cycle of its wave (dash-dotted above).

The paper defines undulation efficiency as progress "normalized by wavelength" and shows
its optimum near the animal, A / lambda = 0.22. The abscissa of the paper is curvature
times lambda_s, the arc length of a wave. With lambda_s as the wavelength, the
efficiency of an endless wave in loose glass has its optimum at A / lambda = 0.21; for
the whole sandfish, with ends and yaw, it is at 0.295, and at 0.343 in close-packed
glass. With the straight wavelength there is no optimum: the efficiency grows with the
amplitude. Maladen et al. (2011) found that speed, not wave efficiency, is largest near
0.2, and a wave efficiency of 0.5 for the animal; the whole sandfish has 0.503 here.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import NamedTuple

import numpy as np

from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Sine
from geomech.scenes import load
from geomech.studies.mechanics import undulation

SCENES = {
    "sandfish-loose": style.LOOSE,
    "sandfish-close": style.CLOSE,
    "shovel-nosed-snake": style.GREEN,
}
# the snake, if the law's rod had that friction, not the 0.15 of Fig. 5
ROUGHER = "shovel-nosed-snake, rod 0.2"
COLOURS = {**SCENES, ROUGHER: "#8FD3B6"}


class EndlessWave(NamedTuple):
    """An endless wave, with or without the head's drag, and how it is drawn."""

    has_head: bool
    kinematics: str
    dashes: str | tuple
    label: str


DASH_DOT_DOT = (0, (4, 1, 1, 1, 1, 1))
ENDLESS = {
    "endless": EndlessWave(False, "sliding", "--", "endless wave, sliding"),
    "endless_head": EndlessWave(True, "sliding", ":", "the same, head drag"),
    "endless_sideways": EndlessWave(
        False, "sideways", DASH_DOT_DOT, "endless wave, sideways"
    ),
}
# equal steps of relative curvature
AMPLITUDES = np.tan(np.linspace(0.7, 5.2, 46) / 4) / (2 * np.pi)


class Measure(NamedTuple):
    """A row of the figure. sign: 1 where the largest value is best, -1 where the least.
    top: of the axis."""

    sign: int
    label: str
    top: float | None = None


MEASURES = {
    "arc_efficiency": Measure(1, "efficiency, progress\nover arc length $\\lambda_s$"),
    "efficiency": Measure(1, "efficiency, progress\nover straight $\\lambda$"),
    "slip": Measure(-1, "mean slip angle\n(degrees)", 90),
    # A weak wave costs up to a hundred times its drag: cut off, to show the cheapest.
    "cost_of_transport": Measure(
        -1, "cost of transport, work\nover drag x distance", 8
    ),
}


def compute(amplitudes=AMPLITUDES, finer: int = 3) -> dict:
    """Return the performance of each scene and of ROUGHER over amplitudes A / lambda
    (B,), with ``finer`` times its elements.

    Each has the entries of `undulation.performance`, and "best": {measure: (amplitude,
    value)} of progress and MEASURES that have an optimum among the amplitudes. The
    sandfish also has efficiencies (B,) of ENDLESS waves, "animal", its own A / lambda
    (the snake's is assumed, and not marked), and "cycle" (N, 3), body velocity at that
    amplitude.

    finer: a snake's tight bends take some 120 elements per wave; with a third of them
    its efficiency seems to have an optimum near A / lambda = 0.4, which is false.
    """
    signs = {"progress": 1}
    signs |= {key: measure.sign for key, measure in MEASURES.items()}
    numbers = {}
    for name in COLOURS:
        scene = refined_scene(name, finer)
        performance = undulation.performance(scene, amplitudes)
        best = {}
        for key, sign in signs.items():
            optimum = undulation.optimum(amplitudes, performance[key], sign)
            if optimum is not None:
                best[key] = optimum
        numbers[name] = {**performance, "best": best}
        if name.startswith("sandfish"):
            numbers[name] |= endless_efficiencies(scene, amplitudes)
            numbers[name] |= animal_cycle(scene)
    return numbers


def refined_scene(name: str, finer: int):
    """Return a scene by its name in COLOURS, with ``finer`` times its elements."""
    scene = undulation.refined(load(name.partition(",")[0]), finer)
    if name == ROUGHER:
        skin, *others = scene.system.effects
        skin = dataclasses.replace(skin, reference=0.2)
        scene = scene.changed(effects=(skin, *others))
    return scene


def endless_efficiencies(scene, amplitudes) -> dict:
    """Return the efficiencies (B,) of ENDLESS waves in the scene's medium."""
    efficiencies = {}
    for key, wave in ENDLESS.items():
        head = scene.system.effects[0] if wave.has_head else None
        efficiency = functools.partial(
            undulation.endless_sine,
            scene.system.medium,
            cap=head,
            kinematics=wave.kinematics,
        )
        efficiencies[key] = np.array([efficiency(a) for a in amplitudes])
    return efficiencies


def animal_cycle(scene) -> dict:
    """Return "animal", the scene's own A / lambda, and "cycle" (N, 3), the body
    velocity at it."""
    amplitude = scene.gait.amplitude
    velocity = undulation.performance(scene, [amplitude])["velocity"]
    return {"animal": amplitude, "cycle": velocity[0]}


@plots.styled
def draw(numbers: dict):
    """Draw a row for each measure, and the sandfish's body velocity below."""
    fig, axes = plots.figure(6.7, 8.8, 2, len(MEASURES) + 1)
    for row, (key, measure) in zip(axes, MEASURES.items()):
        for ax, abscissa in zip(row, ("relative_curvature", "amplitude")):
            draw_measure(ax, numbers, key, abscissa)
            ax.set_ylim(0, measure.top)
        row[0].set_ylabel(measure.label)
    for ax in axes[:-2].flat:
        ax.tick_params(labelbottom=False)
    loose = numbers["sandfish-loose"]
    draw_notes(axes[:2, 1], loose)
    axes[-2, 0].set_xlabel(
        r"mean relative curvature $\overline{|\kappa|}\,\lambda_s$ (rad)"
    )
    axes[-2, 1].set_xlabel(r"$A/\lambda$")
    for ax, name in zip(axes[-1], ("sandfish-loose", "sandfish-close")):
        draw_cycle(ax, numbers[name]["cycle"], name)
        style.draw_legend_above(ax, 3, columnspacing=1.0, handlelength=1.6)
    axes[-1, 0].set_ylabel("body velocity")
    fig.align_ylabels(axes[:, 0])
    draw_legend(fig, axes[0, 0], loose["animal"])
    return fig


def arc_efficiency(scene_numbers: dict, key: str) -> np.ndarray:
    """Return progress over the arc length of a wave (B,) of the endless wave ``key``
    of ENDLESS."""
    return scene_numbers[key] * Sine().wavelength(scene_numbers["amplitude"])


def draw_notes(axes, loose: dict) -> None:
    """Write which endless wave is best into the panels of both efficiencies."""
    amplitude, _ = undulation.optimum(
        loose["amplitude"], arc_efficiency(loose, "endless")
    )
    notes = (
        f"read by arc length:\nendless wave best\nat {amplitude:.2f} in loose glass",
        "read by straight wavelength:\nno wave is best",
    )
    for ax, note in zip(axes, notes):
        ax.text(0.98, 0.05, note, transform=ax.transAxes, ha="right", fontsize=7)


def draw_measure(ax, numbers: dict, key: str, abscissa: str) -> None:
    """Draw a measure of all scenes against "relative_curvature" or "amplitude", with
    dots at the best waves."""

    def place(amplitude):
        """Return the abscissa of an amplitude."""
        if abscissa == "relative_curvature":
            return Sine().relative_curvature(amplitude)
        return amplitude

    for name, scene_numbers in numbers.items():
        x = scene_numbers[abscissa]
        colour = COLOURS[name]
        values = shown_values(scene_numbers[key], key)
        ax.plot(x, values, color=colour, label=name.replace("-", " "))
        if key in scene_numbers["best"]:
            amplitude, best = scene_numbers["best"][key]
            dot = {"color": colour, "ms": 5}
            ax.plot(place(amplitude), shown_values(best, key), "o", **dot)
        for wave, efficiency in endless_curves(scene_numbers, key).items():
            ax.plot(x, efficiency, color=colour, ls=ENDLESS[wave].dashes, lw=1.0)
            optimum = undulation.optimum(scene_numbers["amplitude"], efficiency)
            if optimum is not None:
                amplitude, best = optimum
                dot = {"mfc": "white", "color": colour, "ms": 4, "mew": 1.0}
                ax.plot(place(amplitude), best, "o", **dot)
    ax.axvline(place(numbers["sandfish-loose"]["animal"]), **style.GUIDE, ls="-.")
    ax.set_xlim(0, place(0.6))


def shown_values(values, key: str):
    """Return values of a measure in the unit of its axis."""
    if key == "slip":
        return np.degrees(values)
    return values


def endless_curves(scene_numbers: dict, key: str) -> dict:
    """Return an efficiency, "efficiency" or "arc_efficiency", of the ENDLESS waves that
    a scene has; nothing for other measures."""
    curves = {}
    for wave in ENDLESS:
        if wave not in scene_numbers:
            continue
        if key == "efficiency":
            curves[wave] = scene_numbers[wave]
        elif key == "arc_efficiency":
            curves[wave] = arc_efficiency(scene_numbers, wave)
    return curves


def draw_cycle(ax, velocity: np.ndarray, name: str) -> None:
    """Draw xi over a cycle, closed."""
    t = 2 * np.pi * np.arange(len(velocity) + 1) / len(velocity)
    closed = np.concatenate([velocity, velocity[:1]])
    looks = (
        ("-", r"$\xi_x$ (BL/rad)"),
        ("--", r"$\xi_y$ (BL/rad)"),
        ("-.", r"$\xi_\theta$ (rad/rad)"),
    )
    for values, (dashes, label) in zip(closed.T, looks):
        ax.plot(t, values, ls=dashes, color=SCENES[name], label=label)
    style.draw_zero_line(ax)
    medium = name.replace("-", " ")
    style.set_phase_axis(ax, label=f"phase of the cycle (rad), {medium}")


def draw_legend(fig, ax, animal: float) -> None:
    """Draw the legend of all panels but the last two, above them."""
    for wave in ENDLESS.values():
        style.add_entry(ax, wave.label, ls=wave.dashes, lw=1.0)
    style.add_entry(ax, "optimum (open: endless)", ls="", marker="o", ms=5)
    style.add_entry(ax, rf"sandfish, $A/\lambda = {animal:g}$", **style.GUIDE, ls="-.")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=3)


if __name__ == "__main__":
    main("fig09c", compute, draw)
