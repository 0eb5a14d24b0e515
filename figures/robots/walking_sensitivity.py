"""Sensitivity of walking robots to assumptions: speed of the robots when each size that
the paper does not give is multiplied by 0.7 and by 1.4, one at a time, and for two
choices of the model.

The first choice is whether grains pull on faces, as in their map. The second is whether
the belly is a closed box, on whose bottom and front grains push where these lead, or an
open sheet, its bottom alone, on either side of which grains push.

Above: mean speed of Xplorer with c-legs, flat legs and reversed legs at 2 Hz. Below:
mean speed of SandBot at 4 rad/s in still grains and with air at 0.6 of fluidisation.
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
    "robot.legs.radius": "leg radius",
    "robot.legs.width": "leg width",
    "robot.height": "body height",
    "robot.width": "body width",
    "robot.hips": "hip spacing",
    "robot.inertia": "inertia",
    "medium.zeta": "ground strength",
    "gait.duty": "share of stance",
    "medium.tension": "faces that pull",
    "belly": "belly",
}
# of the built-in scenes, and the other
CHOICES = {"medium.tension": ("keep", "cut"), "belly": ("box", "sheet")}
CURVATURES = {"c-leg": 1.0, "flat": 0.0, "reversed": -1.0}  # of Xplorer's legs
AIR_SPEEDS = {"still": 0.0, "0.6 of fluidisation": 0.6}  # over that of fluidisation
FLUIDISATION = 0.25  # m/s
BATCH = 32  # robots


class Sheet(Rhex):
    """A robot whose belly is an open sheet, the bottom of the box."""

    def belly(self, elements: int) -> Outline:
        x = self.length / 2
        z = -self.height / 2
        return Polygon(((-x, z), (x, z)), self.width, closed=False).outline(elements)


def with_change(scene, name: str, value: float | str):
    """Return the scene with one of its assumed sizes times a factor, or with another
    choice."""
    if name == "belly":
        if value == "box":
            return scene
        return dataclasses.replace(scene, robot=Sheet(**vars(scene.robot)))
    if name == "robot.legs.radius" and scene.robot.axle:
        scene = with_field(scene, "robot.axle", value)
    return with_field(scene, name, value)


def with_field(part, name: str, value: float | str):
    """Return a dataclass with a field, or a field of a field, times a factor, or
    replaced by a choice."""
    first, _, rest = name.partition(".")
    current = getattr(part, first)
    if rest:
        changed = with_field(current, rest, value)
    elif isinstance(value, str):
        changed = value
    elif isinstance(current, tuple):
        changed = tuple(np.multiply(current, value))
    else:
        changed = current * value
    return dataclasses.replace(part, **{first: changed})


def compute(factors=FACTORS, names=NAMES) -> dict:
    """Return {robot: {curve: {name: [(factor or choice, speed, estimate,
    status)]}}}."""
    numbers: dict = {}
    for robot, scenes in curve_scenes().items():
        cases = []
        for curve in scenes:
            for name in names:
                for value in CHOICES.get(name, factors):
                    cases.append((curve, name, value))
        changed = [with_change(scenes[curve], name, x) for curve, name, x in cases]

        numbers[robot] = {curve: {name: [] for name in names} for curve in scenes}
        for (curve, name, value), result in zip(cases, walks(changed)):
            row = (value, result.walk.speed, result.estimate, result.walk.status)
            numbers[robot][curve][name].append(row)
    return numbers


def curve_scenes() -> dict:
    """Return {robot: {curve: scene}}: Xplorer by its legs, SandBot by the air."""
    xplorer = load("xplorer")
    xplorers = {}
    for name, curvature in CURVATURES.items():
        legs = dataclasses.replace(xplorer.robot.legs, relative_curvature=curvature)
        robot = dataclasses.replace(xplorer.robot, legs=legs)
        xplorers[name] = dataclasses.replace(xplorer, robot=robot)
    sandbot = load("sandbot")
    sandbots = {}
    for name, share in AIR_SPEEDS.items():
        air = Aeration(share * FLUIDISATION, FLUIDISATION)
        sandbots[name] = dataclasses.replace(sandbot, effects=(air,))
    return {"Xplorer": xplorers, "SandBot": sandbots}


def walks(scenes: list) -> list:
    """Return the walks of scenes with their estimates, batch by batch."""
    results = []
    for k in range(0, len(scenes), BATCH):
        results += walking.walked(scenes[k : k + BATCH], settling=True)
    return results


def table(numbers: dict) -> str:
    """Return by how many per cent each assumption changes each speed, as Markdown: the
    smaller size and the larger, or the other choice."""
    heads = ["assumed"]
    columns = []
    for robot, curves in numbers.items():
        for curve, by_name in curves.items():
            heads.append(f"{robot}: {curve}")
            columns.append(by_name)
    lines = [markdown_row(heads), "|" + "---|" * len(heads)]
    for name in columns[0]:
        changes = [percent_changes(name, by_name[name]) for by_name in columns]
        lines.append(markdown_row([NAMES[name], *changes]))
    return "\n".join(lines)


def markdown_row(cells: list[str]) -> str:
    """Return a row of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def percent_changes(name: str, rows: list[tuple]) -> str:
    """Return the changes of the speed by an assumption from the built-in scene."""
    built_in = 1.0
    if name in CHOICES:
        built_in = CHOICES[name][0]
    speeds = {value: speed for value, speed, *_ in rows}
    reference = speeds.pop(built_in)
    changes = [speed / reference - 1 for speed in speeds.values()]
    return ", ".join(f"{100 * change:+.0f}" for change in changes)


@plots.styled
def draw(numbers: dict):
    """Draw a row for each robot and a column for each assumption."""
    first_robot = next(iter(numbers.values()))
    names = list(next(iter(first_robot.values())))
    fig, axes = plots.figure(1.2 * len(names), 4.8, len(names), len(numbers))
    for row, (robot, curves) in zip(axes, numbers.items()):
        for ax, name in zip(row, names):
            draw_assumption(ax, name, curves)
            ax.sharey(row[0])
        for ax in row[1:]:
            ax.tick_params(labelleft=False)
        row[0].set_ylabel(f"{robot}: speed (m/s)")
        style.draw_legend_right(row[-1])
    fig.supxlabel("times the size that is assumed; open: not walking", fontsize=9)
    return fig


def draw_assumption(ax, name: str, curves: dict) -> None:
    """Draw speeds against the values of one assumption."""
    looks = zip(style.SEQUENCE, style.MARKERS, ("-", "--", ":"))
    for (curve, by_name), (colour, marker, dashes) in zip(curves.items(), looks):
        values, speeds, errors, statuses = zip(*by_name[name])
        if name in CHOICES:
            x = (1.0, 2.0)
            labels = values
        else:
            x = values
            labels = [f"{factor:g}" for factor in values]
        look = {"color": colour, "ls": dashes, "lw": 1.0, "capsize": 2}
        ax.errorbar(x, speeds, yerr=errors, label=curve, **look)
        for place, speed, status in zip(x, speeds, statuses):
            face = colour if status == "walking" else "white"
            ax.plot(place, speed, marker, ms=4, color=colour, mfc=face)
    ax.set(xscale="log", xlabel="", ylim=(min(0.0, ax.get_ylim()[0]), None))
    style.set_named_ticks(ax, x, labels)
    if name in CHOICES:
        ax.set_xlim(0.75, 2.7)
    ax.set_title(NAMES[name], fontsize=7.5)


if __name__ == "__main__":
    main("walking_sensitivity", compute, draw, table)
