"""Fig. 9(c): what a wave along the body achieves against its curvature: sandfish in
loose and close glass, snake in loose.

Rows: progress per cycle over the arc length lambda_s of a wave; the same over its
straight wavelength lambda; slip; mechanical cost of transport. Left against the mean
relative curvature, right against A / lambda, which are one to one. Dots mark the best
wave where there is one: efficiency and slip go on improving with the amplitude. Solid:
the whole body, ends and yaw included. Dashed and dotted: the balance of force along an
endless wave that slides along its curve, without and with the sandfish's head drag;
dash-dot-dotted: one whose points move only sideways. Pale: the snake, its skin friction
set against that of an aluminium rod, 0.2, in place of the 0.15 in the caption of Fig.
5. Last row: the sandfish's body velocity through a cycle of its own wave (dash-dotted
above).

The paper defines undulation efficiency as progress "normalized by wavelength" and shows
its optimum near the animal, A / lambda = 0.22. Its abscissa is curvature times
lambda_s, the arc length of a wave, and read with that wavelength the efficiency of an
endless wave in loose glass has its optimum at A / lambda = 0.21 (the whole sandfish's,
with ends and yaw, is at 0.295, 0.343 in close glass). Read with the straight wavelength
it has none: it grows with the amplitude. Maladen et al. (2011) found speed, not wave
efficiency, largest near 0.2, and a wave efficiency of 0.5 for the animal; the whole
sandfish has 0.503 here.
"""

from __future__ import annotations

import dataclasses
import functools

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
# how an endless wave is drawn: with the head's drag, kinematics, dashes, label
ENDLESS = {
    "endless": (False, "sliding", "--", "endless wave, sliding"),
    "endless_head": (True, "sliding", ":", "the same, head drag"),
    "endless_sideways": (
        False,
        "sideways",
        (0, (4, 1, 1, 1, 1, 1)),
        "endless wave, sideways",
    ),
}
AMPLITUDES = np.tan(np.linspace(0.7, 5.2, 46) / 4) / (
    2 * np.pi
)  # equal steps of relative curvature
MEASURES = {  # what is best: the largest (1) or the least (-1)
    "arc_efficiency": (1, "efficiency, progress\n" r"over arc length $\lambda_s$"),
    "efficiency": (
        1,
        "efficiency, progress\n" r"over straight $\lambda$",
    ),
    "slip": (-1, "mean slip angle\n(degrees)"),
    "cost_of_transport": (-1, "cost of transport, work\nover drag x distance"),
}


def compute(amplitudes=AMPLITUDES, finer: int = 3) -> dict:
    """Return for each scene and ROUGHER, with ``finer`` times its elements, its
    `undulation.performance` over amplitudes A / lambda (B,), and "best": {measure:
    (amplitude, value)} of progress and MEASURES that have an optimum among the
    amplitudes. For the sandfish efficiencies (B,) of ENDLESS waves, "animal", its own A
    / lambda (the snake's is assumed, and not marked), and "cycle" (N, 3), body velocity
    at that amplitude.

    finer: a snake's tight bends take some 120 elements a wave; with a third of them its
    efficiency seems to have an optimum near A / lambda = 0.4, which is none.
    """
    out = {}
    for name in COLOURS:
        scene = undulation.refined(load(name.partition(",")[0]), finer)
        if name == ROUGHER:
            skin, *others = scene.system.effects
            scene = scene.changed(
                effects=(dataclasses.replace(skin, reference=0.2), *others)
            )
        found = undulation.performance(scene, amplitudes)
        signs = {"progress": 1, **{key: sign for key, (sign, _) in MEASURES.items()}}
        best = {
            key: undulation.optimum(amplitudes, found[key], sign)
            for key, sign in signs.items()
        }
        found["best"] = {key: place for key, place in best.items() if place is not None}
        if name.startswith("sandfish"):
            for key, (capped, kinematics, _, _) in ENDLESS.items():
                cap = scene.system.effects[0] if capped else None
                wave = functools.partial(
                    undulation.endless_sine, scene.system.medium, kinematics=kinematics
                )
                found[key] = np.array([wave(a, cap) for a in amplitudes])
            found["animal"] = scene.gait.amplitude
            found["cycle"] = undulation.performance(scene, [scene.gait.amplitude])[
                "velocity"
            ][0]
        out[name] = found
    return out


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(6.7, 8.8, 2, len(MEASURES) + 1)
    for row, key in zip(axes, MEASURES):
        for ax, against in zip(row, ("relative_curvature", "amplitude")):
            draw_measure(ax, numbers, key, against)
            # A weak wave costs up to a hundred times its drag: cut off, to show the
            # cheapest.
            ax.set_ylim(
                0, 8 if key == "cost_of_transport" else 90 if key == "slip" else None
            )
            ax.tick_params(labelbottom=key == "cost_of_transport")
        row[0].set_ylabel(MEASURES[key][1])
    place, _ = undulation.optimum(
        numbers["sandfish-loose"]["amplitude"],
        arc_efficiency(numbers["sandfish-loose"], "endless"),
    )
    notes = (
        f"read by arc length:\nendless wave best\nat {place:.2f} in loose glass",
        "read by straight wavelength:\nno wave is best",
    )
    for ax, note in zip(axes[:2, 1], notes):
        ax.text(0.98, 0.05, note, transform=ax.transAxes, ha="right", fontsize=7)
    axes[-2, 0].set_xlabel(
        r"mean relative curvature $\overline{|\kappa|}\,\lambda_s$ (rad)"
    )
    axes[-2, 1].set_xlabel(r"$A/\lambda$")
    for ax, name in zip(axes[-1], ("sandfish-loose", "sandfish-close")):
        draw_cycle(ax, numbers[name]["cycle"], name)
        style.legend_above(ax, 3, columnspacing=1.0, handlelength=1.6)
    axes[-1, 0].set_ylabel("body velocity")
    fig.align_ylabels(axes[:, 0])
    legend(fig, axes[0, 0], numbers["sandfish-loose"]["animal"])
    return fig


def arc_efficiency(found: dict, endless: str) -> np.ndarray:
    """Return progress over the arc length of a wave (B,) of an endless wave."""
    return found[endless] * Sine().wavelength(found["amplitude"])


def draw_measure(ax, numbers: dict, key: str, against: str):
    place = Sine().relative_curvature if against == "relative_curvature" else np.asarray
    for name, found in numbers.items():
        x = found[against]
        colour = COLOURS[name]
        convert = np.degrees if key == "slip" else np.asarray
        ax.plot(x, convert(found[key]), color=colour, label=name.replace("-", " "))
        if key in found["best"]:
            a, top = found["best"][key]
            ax.plot(place(a), convert(top), "o", color=colour, ms=5)
        unit = {
            "efficiency": 1.0,
            "arc_efficiency": Sine().wavelength(found["amplitude"]),
        }.get(key)
        for endless, (_, _, dashes, _) in ENDLESS.items():
            if unit is not None and endless in found:
                values = found[endless] * unit
                ax.plot(x, values, color=colour, ls=dashes, lw=1.0)
                if best := undulation.optimum(found["amplitude"], values):
                    ax.plot(
                        place(best[0]),
                        best[1],
                        "o",
                        mfc="white",
                        color=colour,
                        ms=4,
                        mew=1.0,
                    )
    ax.axvline(place(numbers["sandfish-loose"]["animal"]), **style.GUIDE, ls="-.")
    ax.set_xlim(0, place(0.6))


def draw_cycle(ax, velocity: np.ndarray, name: str):
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
    style.zero_line(ax)
    style.phase_axis(ax, label=f"phase of the cycle (rad), {name.replace('-', ' ')}")


def legend(fig, ax, animal: float):
    """Draw that of all panels but the last two, above them."""
    for _, _, dashes, label in ENDLESS.values():
        style.entry(ax, label, ls=dashes, lw=1.0)
    style.entry(ax, "optimum (open: endless)", ls="", marker="o", ms=5)
    style.entry(ax, rf"sandfish, $A/\lambda = {animal:g}$", **style.GUIDE, ls="-.")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=3)


if __name__ == "__main__":
    main("fig09c", compute, draw)
