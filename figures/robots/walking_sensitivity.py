"""The sensitivity of the speeds of walking robots: every size that the paper does not
give, one at a time, times 0.7 and 1.4, and two choices of the model: whether grains
pull on faces, as their map has it, and whether the belly is a closed box, whose bottom
and front feel grains where they lead, or an open sheet, its bottom alone, which feels
them on either side.

Above, the mean speed of Xplorer with c-legs, flat and reversed ones at 2 Hz; below,
that of SandBot at 4 rad/s in still grains and with air at 0.6 of fluidisation.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from geomech.studies.terradynamics import walking
from rft.terradynamics.ground import Aeration
from rft.terradynamics.plates import Polygon
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.walking import Rhex

FACTORS = (0.7, 1.0, 1.4)
NAMES = {
    "robot.legs.radius": "leg radius", "robot.legs.width": "leg width", "robot.height": "body height",
    "robot.width": "body width", "robot.hips": "hip spacing", "robot.inertia": "inertia", "medium.zeta": "ground strength",
    "gait.duty": "share of stance", "medium.tension": "faces that pull", "belly": "belly",
}  # fmt: skip
CHOICES = {
    "medium.tension": ("keep", "cut"),
    "belly": ("box", "sheet"),
}  # as the scenes have it, and else


class Sheet(Rhex):
    """A robot whose belly is an open sheet, the bottom of the box."""

    def belly(self, elements: int) -> Outline:
        x = self.length / 2
        z = -self.height / 2
        return Polygon(((-x, z), (x, z)), self.width, closed=False).outline(elements)


def varied(scene, name: str, factor: float | str):
    """Return the scene with one of its assumed sizes times a factor, or with another
    choice."""
    if name == "belly":
        return (
            scene
            if factor == "box"
            else dataclasses.replace(scene, robot=Sheet(**vars(scene.robot)))
        )
    if name == "robot.legs.radius" and scene.robot.axle:
        scene = changed(scene, "robot.axle", factor)
    return changed(scene, name, factor)


def changed(part, name: str, factor: float | str):
    """Return a dataclass with a field, or a field of a field, times a factor, or
    replaced by a choice."""
    first, _, rest = name.partition(".")
    value = getattr(part, first)
    if rest:
        value = changed(value, rest, factor)
    elif isinstance(factor, str):
        value = factor
    else:
        value = (
            tuple(np.multiply(value, factor))
            if isinstance(value, tuple)
            else value * factor
        )
    return dataclasses.replace(part, **{first: value})


def compute(factors=FACTORS, names=NAMES) -> dict:
    """Return {robot: {curve: {name: [(factor or choice, speed, estimate,
    status)]}}}."""
    xplorer = load("xplorer")
    sandbot = load("sandbot")
    legs = lambda c: dataclasses.replace(xplorer.robot.legs, relative_curvature=c)
    curves = {
        "Xplorer": {
            name: dataclasses.replace(
                xplorer, robot=dataclasses.replace(xplorer.robot, legs=legs(c))
            )
            for name, c in (("c-leg", 1.0), ("flat", 0.0), ("reversed", -1.0))
        },
        "SandBot": {
            name: dataclasses.replace(sandbot, effects=(Aeration(share * 0.25, 0.25),))
            for name, share in (("still", 0.0), ("0.6 of fluidisation", 0.6))
        },
    }
    out: dict = {}
    for robot, scenes_of in curves.items():
        jobs = [
            (curve, name, f)
            for curve in scenes_of
            for name in names
            for f in CHOICES.get(name, factors)
        ]
        scenes = [varied(scenes_of[curve], name, f) for curve, name, f in jobs]
        found = [
            w
            for k in range(0, len(scenes), 32)
            for w in walking.walked(scenes[k : k + 32], settling=True)
        ]
        for (curve, name, f), one in zip(jobs, found):
            row = (f, one.walk.speed, one.estimate, one.walk.status)
            out.setdefault(robot, {}).setdefault(curve, {}).setdefault(name, []).append(
                row
            )
    return out


def table(numbers: dict) -> str:
    """Return by how many per cent each assumption moves each speed: the smaller size
    and the larger, or the other choice."""
    curves = [found for by_curve in numbers.values() for found in by_curve.values()]
    rows = [
        "| assumed | "
        + " | ".join(
            f"{robot}: {curve}"
            for robot, by_curve in numbers.items()
            for curve in by_curve
        )
        + " |"
    ]
    rows.append("|---|" + "---|" * len(curves))
    for name in curves[0]:
        cells = []
        for found in curves:
            as_is = CHOICES.get(name, (1.0,))[0]
            (unchanged,) = [speed for value, speed, *_ in found[name] if value == as_is]
            others = [
                speed / unchanged - 1
                for value, speed, *_ in found[name]
                if value != as_is
            ]
            cells.append(", ".join(f"{100 * x:+.0f}" for x in others))
        rows.append(f"| {NAMES[name]} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


@plots.styled
def draw(numbers: dict):
    sizes = next(iter(next(iter(numbers.values())).values()))
    fig, axes = plots.figure(1.2 * len(sizes), 4.8, len(sizes), len(numbers))
    for row, (robot, curves) in zip(axes, numbers.items()):
        for ax, name in zip(row, sizes):
            for curve, colour, marker, dashes in zip(
                curves, style.SEQUENCE, style.MARKERS, ("-", "--", ":")
            ):
                f, speed, error, status = zip(*curves[curve][name])
                f = (1.0, 2.0) if name in CHOICES else f  # side by side
                ax.errorbar(
                    f,
                    speed,
                    yerr=error,
                    color=colour,
                    ls=dashes,
                    lw=1.0,
                    capsize=2,
                    label=curve,
                )
                for x, y, kind in zip(f, speed, status):
                    ax.plot(
                        x,
                        y,
                        marker,
                        ms=4,
                        color=colour,
                        mfc=colour if kind == "walking" else "white",
                    )
            ax.set(xscale="log", xlabel="", ylim=(min(0.0, ax.get_ylim()[0]), None))
            style.named_ticks(ax, f, CHOICES.get(name) or [f"{x:g}" for x in f])
            if name in CHOICES:
                ax.set_xlim(0.75, 2.7)
            ax.set_title(NAMES[name], fontsize=7.5)
            ax.sharey(row[0])
        for ax in row[1:]:
            ax.tick_params(labelleft=False)
        row[0].set_ylabel(f"{robot}: speed (m/s)")
        style.legend_right(row[-1])
    fig.supxlabel("times the size that is assumed; open: not walking", fontsize=9)
    return fig


if __name__ == "__main__":
    main("walking_sensitivity", compute, draw, table)
