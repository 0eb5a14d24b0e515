"""What the speeds of walking robots hang on: every size that the paper does not give, one at a time, times 0.7 and
1.4, and two choices of the model: whether grains pull on faces, as their map has it, and whether the belly is a closed box,
whose bottom and front feel grains where they lead, or an open sheet, its bottom alone, which feels them on either side.

Above, the mean speed of Xplorer with c-legs, flat and reversed ones at 2 Hz; below, that of SandBot at 4 rad/s in still grains
and with air at 0.6 of fluidisation.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main
from geomech.output import plots
from geomech.scene import load
from geomech.study import walking
from rft.vertical import Polygon
from rft.vertical.effects import Aeration
from rft.vertical.outline import Outline
from rft.walking import Rhex

FACTORS = (0.7, 1.0, 1.4)
NAMES = {
    "legs.radius": "leg radius", "legs.width": "leg width", "height": "body height", "width": "body width",
    "hips": "hip spacing", "inertia": "inertia", "zeta": "ground strength", "duty": "share of stance",
    "tension": "faces that pull", "belly": "belly",
}  # fmt: skip
CHOICES = {"tension": ("keep", "cut"), "belly": ("box", "sheet")}  # as the scenes have it, and else


class Sheet(Rhex):
    """A robot whose belly is an open sheet, the bottom of the box."""

    def belly(self, elements: int) -> Outline:
        x, z = self.length / 2, -self.height / 2
        return Polygon(((-x, z), (x, z)), self.width, closed=False).outline(elements)


def varied(scene, name: str, factor: float | str):
    """The scene with one of its assumed sizes times a factor, or with another choice."""
    robot, medium, gait = scene.robot, scene.medium, scene.gait
    if name == "tension":
        return dataclasses.replace(scene, medium=dataclasses.replace(medium, tension=factor))
    if name == "belly":
        own = {f.name: getattr(robot, f.name) for f in dataclasses.fields(robot)}
        return scene if factor == "box" else dataclasses.replace(scene, robot=Sheet(**own))
    if name == "zeta":
        return dataclasses.replace(scene, medium=dataclasses.replace(medium, zeta=medium.zeta * factor))
    if name == "duty":
        return dataclasses.replace(scene, gait=dataclasses.replace(gait, duty=gait.duty * factor))
    part, _, key = name.rpartition(".")
    owner = robot.legs if part else robot
    value = getattr(owner, key)
    changed = dataclasses.replace(
        owner, **{key: tuple(np.multiply(value, factor)) if key == "hips" else value * factor}
    )
    if part and key == "radius" and robot.axle:
        robot = dataclasses.replace(robot, axle=robot.axle * factor)
    return dataclasses.replace(scene, robot=dataclasses.replace(robot, legs=changed) if part else changed)


def compute(factors=FACTORS, names=NAMES) -> dict:
    """{robot: {curve: {name: [(factor or choice, speed, estimate, status)]}}}."""
    xplorer, sandbot = load("xplorer"), load("sandbot")
    legs = lambda c: dataclasses.replace(xplorer.robot.legs, relative_curvature=c)
    curves = {
        "Xplorer": {
            name: dataclasses.replace(xplorer, robot=dataclasses.replace(xplorer.robot, legs=legs(c)))
            for name, c in (("c-leg", 1.0), ("flat", 0.0), ("reversed", -1.0))
        },
        "SandBot": {
            name: dataclasses.replace(sandbot, effects=(Aeration(share * 0.25, 0.25),))
            for name, share in (("still", 0.0), ("0.6 of fluidisation", 0.6))
        },
    }
    out: dict = {}
    for robot, some in curves.items():
        jobs = [(curve, name, f) for curve in some for name in names for f in CHOICES.get(name, factors)]
        scenes = [varied(some[curve], name, f) for curve, name, f in jobs]
        found = [w for k in range(0, len(scenes), 32) for w in walking.walked(scenes[k : k + 32], settling=True)]
        for (curve, name, f), one in zip(jobs, found):
            row = (f, one.walk.speed, one.estimate, one.walk.status)
            out.setdefault(robot, {}).setdefault(curve, {}).setdefault(name, []).append(row)
    return out


def table(numbers: dict) -> str:
    """By how many per cent each assumption moves each speed: the smaller size and the larger, or the other choice."""
    curves = [found for some in numbers.values() for found in some.values()]
    rows = [
        "| assumed | " + " | ".join(f"{robot}: {curve}" for robot, some in numbers.items() for curve in some) + " |"
    ]
    rows.append("|---|" + "---|" * len(curves))
    for name in curves[0]:
        cells = []
        for found in curves:
            as_is = CHOICES.get(name, (1.0,))[0]
            (own,) = [speed for value, speed, *_ in found[name] if value == as_is]
            others = [speed / own - 1 for value, speed, *_ in found[name] if value != as_is]
            cells.append(", ".join(f"{100 * x:+.0f}" for x in others))
        rows.append(f"| {NAMES[name]} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


@plots.styled
def draw(numbers: dict):
    some = next(iter(next(iter(numbers.values())).values()))
    fig, axes = plots.figure(1.2 * len(some), 4.8, len(some), len(numbers))
    for row, (robot, curves) in zip(axes, numbers.items()):
        for ax, name in zip(row, some):
            for k, (curve, found) in enumerate(curves.items()):
                f, speed, error, status = zip(*found[name])
                f = (1.0, 2.0) if name in CHOICES else f  # one place beside the other
                ax.errorbar(f, speed, yerr=error, color=f"C{k}", lw=1.0, capsize=2, label=curve)
                for x, y, kind in zip(f, speed, status):
                    ax.plot(x, y, "o", ms=4, color=f"C{k}", mfc=f"C{k}" if kind == "walking" else "white")
            ax.set(xscale="log", xlabel="", ylim=(min(0.0, ax.get_ylim()[0]), None))
            ax.set_xticks(f, CHOICES.get(name) or [f"{x:g}" for x in f])
            if name in CHOICES:
                ax.set_xlim(0.75, 2.7)
            ax.minorticks_off()
            ax.set_title(NAMES[name], fontsize=7.5)
            ax.sharey(row[0])
        for ax in row[1:]:
            ax.tick_params(labelleft=False)
        row[0].set_ylabel(f"{robot}: speed (m/s)")
        row[-1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    fig.supxlabel("times the size that is assumed; open: not walking", fontsize=9)
    return fig


if __name__ == "__main__":
    main("walking_sensitivity", compute, draw, table)
