"""Forces along a body that undulates: thrust and drag of each part of it at each phase, power, bending moment, activation.

The force of the medium on an element has a normal part, across it, and a tangential part, along it; points that effects add at
the ends have forces of their own. The component of a part in the direction of travel is thrust where it pushes the body
forwards and drag where it holds it back. The direction of travel is that of the net displacement; where the body turns in a
cycle, it turns evenly with the phase, as on a circle. Without mass and slope all forces balance at every phase."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry.reconstruct import poses
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.cost import direct_jobs, total_cost
from geomech.studies.elements import coarser_systems, gait_with_elements, n_elements
from geomech.studies.newtons import Newtons, Sizes, newtons
from geomech.studies.undulation import activation_of, bends, loaded
from geomech.systems.base import body_size, length_unit
from geomech.systems.capabilities import Stepped, capability, pieces_per_length, refined
from rft.core.premise import Premise
from rft.core.refusal import located

FLANK, PARTS = ("normal", "tangential"), ("normal", "tangential", "ends")
PLACES = (0.25, 0.5, 0.75)  # of the body, at which the lag of activation is shown
SEEN = 1.2  # times a change: that to a law computed more exactly is nearly all of the error (`geomech.studies.estimate`)
NEAR = 1 / 32  # cycle
LEAST_STEPS = 8  # of time stepping
STILL = 1e-6  # body lengths per cycle, below which there is no direction of travel
WHAT = "force along the body"
WORK = "drag x BL/rad"
UNKNOWN = Sizes()


def check(scene: Scene, sizes: Sizes) -> None:
    """Refuse sizes that contradict the scene, and a system without a body in a medium."""
    with located(scene.name):
        newtons(scene, loaded(scene, WHAT), sizes)


def cost(scene: Scene) -> Cost:
    """Return the cost of `answer`."""
    jobs = []
    for one in (scene, *_variants(scene)):
        phases = one.numerics.phases
        jobs += direct_jobs(_divided(one), one.gait, 1, phases, checked=False)
    return total_cost(jobs)


def answer(scene: Scene, sizes: Sizes) -> Result:
    """Return `forces` with errors, means over the cycle and largest values; the unit of
    force in words and whether the body travels as attributes."""
    with located(scene.name):
        found, run = forces(scene, sizes)
        found = with_errors(found, run)
    facts = {"travels": int(run.travels), "drag_is": unit_words(run.newtons)}
    more = [
        *travel(run),
        *means(found),
        *powers(found),
        *largest_moment(found),
        *activation(found),
    ]
    return Result("forces", (*more, *found.variables), facts)


def unit_words(unit: Newtons) -> str:
    """Return what the unit of force is."""
    if unit.drag is None:
        sizes = ", ".join(unit.lacks)
        return f"drag of the straight body along itself; give {sizes} for newtons"
    words = f"drag of the straight body along itself {unit.drag:.4g} N, {unit.how}"
    if unit.frequency:
        return words
    return f"{words}; give frequency for watts"


def travel(run: Run) -> list[Variable]:
    """Return the net distance of a cycle and its direction."""
    unit = length_unit(run.scene.system)
    distance = np.hypot(*run.net[:2])
    label = "of travel at mid-cycle, from the frame's heading at phase 0"
    return [
        Variable("net_distance", (), distance, unit, "net distance per cycle"),
        Variable("direction", (), run.direction, "rad", label),
    ]


def mean(variable: Variable) -> tuple[float, float]:
    """Return the mean of a variable and that of its error, 0 without one."""
    if variable.error is None:
        return float(variable.values.mean()), 0.0
    return float(variable.values.mean()), float(variable.error.mean())


def means(found: Result) -> list[Variable]:
    """Return the means over the cycle of thrust and drag, by part of the force and their
    sum."""
    variables = [Variable("part", ("part",), [*PARTS, "sum"])]
    for side in SIDES:
        of_parts = [found[f"{side}_{part}"] for part in PARTS]
        values, errors = zip(*map(mean, of_parts))
        values = (*values, sum(values))
        errors = (*errors, sum(errors))
        label = f"mean {side} over the cycle"
        unit = of_parts[0].unit
        variables.append(Variable(side, ("part",), values, unit, label, errors))
    return variables


def powers(found: Result) -> list[Variable]:
    """Return the mean and the largest power into the medium, and the mean at the
    joints."""
    power, joints = found["medium_power"], found["joint_power"]
    value, error = mean(power)
    largest = power.values.max()
    at_joints = joints.values.mean()
    unit = power.unit
    return [
        Variable("mean_power", (), value, unit, "into the medium", error),
        Variable("largest_power", (), largest, unit, "into the medium"),
        Variable("mean_joint_power", (), at_joints, unit, "of the joints"),
    ]


def largest_moment(found: Result) -> list[Variable]:
    """Return the largest bending moment, its place and its phase."""
    moment = found["bending_moment"]
    sizes = np.abs(moment.values)
    phase, point = np.unravel_index(sizes.argmax(), sizes.shape)
    s = found["point"].values[point]
    at = found["phase"].values[phase]
    return [
        Variable("largest_moment", (), sizes[phase, point], moment.unit, "bending"),
        Variable("largest_moment_s", (), s, "BL", "its place, from tail 0 to head 1"),
        Variable("largest_moment_phase", (), at, "rad", "its phase"),
    ]


def activation(found: Result) -> list[Variable]:
    """Return by how much activation is ahead of bending at some places of the body."""
    joint, lag = found["joint"].values, found["fundamental_lag"].values
    places = joint
    if joint.size > len(PLACES):
        places = np.array(PLACES)
    ahead = np.interp(places, joint, lag)
    label = "phase by which activation is ahead of curvature"
    return [
        Variable("place", ("place",), places, "BL", "from tail 0 to head 1"),
        Variable("lag_of_activation", ("place",), ahead, "rad", label),
    ]


class Run(NamedTuple):
    """A cycle in the direction of travel. net: (3,), pose after it. direction: rad, of travel at the middle of the cycle,
    from the frame's heading at its start; 0 where the body does not travel. newtons: the unit of force. activation: as
    `geomech.studies.undulation.activation`."""

    scene: Scene
    net: np.ndarray
    direction: float
    newtons: Newtons
    activation: dict[str, Any]

    @property
    def travels(self) -> bool:
        """Whether there is a direction of travel; else forwards is where the frame points to at phase 0."""
        return bool(np.hypot(*self.net[:2]) > STILL * body_size(self.scene.system))


def with_errors(result: Result, run: Run) -> Result:
    """Return forces with errors: the changes with half the elements of a backbone, with
    half the pieces into which effects cut a body, with a law computed more exactly, and in
    time stepping with half the phases; the largest of each within NEAR of a phase, as
    changes pass through zero. Errors of order 2 are a third of these changes; near stuck
    links they scatter."""
    others = []
    for other in _variants(run.scene):
        found, _ = forces(other, unit=run.newtons)
        others.append(found)
    variables = [_with_error(v, result, others) for v in result.variables]
    return replace(result, variables=tuple(variables))


def _with_error(v: Variable, result: Result, others: list[Result]) -> Variable:
    if (
        v.dims not in (("phase",), ("phase", "s"), ("phase", "point"))
        or v.is_coordinate
    ):
        return v
    from scipy.interpolate import make_interp_spline
    from scipy.ndimage import maximum_filter1d

    error = np.zeros_like(v.values)
    for other in others:
        values = other[v.name].values
        for place in v.dims[1:]:
            values = make_interp_spline(other[place].values, values, 1, axis=1)(
                result[place].values
            )
        change = SEEN * np.abs(v.values[:: len(error) // len(values)] - values)
        near = maximum_filter1d(
            change, 2 * round(NEAR * len(change)) + 1, axis=0, mode="wrap"
        )
        error += near if len(near) == len(error) else near.max(0)
    return replace(v, error=error)


def _variants(scene: Scene) -> list[Scene]:
    """Return other approximations of a scene, coarser ones and one with its law computed more exactly."""
    system, phases = loaded(scene, WHAT), scene.numerics.phases
    scene = scene.changed(system=system)
    variants = [scene.changed(system=finer) for finer in [refined(system)] if finer]
    variants += _with_fewer_elements(scene)
    if pieces := pieces_per_length(system):
        variants.append(scene.with_numerics(pieces=max(1, pieces // 2)))
    if system.traits.steps and phases % 2 == 0 and phases >= 2 * LEAST_STEPS:
        variants.append(scene.with_numerics(phases=phases // 2))
    return variants


def _with_fewer_elements(scene: Scene) -> list[Scene]:
    """Return the scene of about half as many elements, of a continuous body and its gait, where it allows it."""
    system = scene.system
    other = next(iter(coarser_systems(system)), None)
    if other is None or other.ratio < 1:
        return []
    gait = gait_with_elements(scene.gait, system, n_elements(other.system))
    return [scene.changed(system=other.system, gait=gait)]


def _divided(scene: Scene) -> Scene:
    """Return the scene with a body of short elements, so that forces are known along each link, too."""
    return scene.changed(system=loaded(scene, WHAT).subdivided())


def forces(
    scene: Scene, sizes: Sizes = UNKNOWN, unit: Newtons | None = None
) -> tuple[Result, Run]:
    """Return forces, power, bending moments and activation over a cycle of the scene's
    gait, at its N phases, and the cycle.

    Over the n elements, at least 40, or the n - 1 points between them, or the joints: positions s, 0 at the tail to 1 at the
    head. `forward` and its two parts are components in the direction of travel, `normal` and `tangential` components to the
    element's left and to its head. `thrust_*` and `drag_*` are sums over the body of what pushes and of what holds back,
    `mean_thrust_*` and `mean_drag_*` means over the cycle. power: work against the medium; joint_power: of the bending
    moments on the bends, which is the same but for the kinetic energy of a heavy body. Forces are in axial drags of the
    straight body, or in N where its sizes are known. unit: that of forces, in place of sizes. Refusal for a system without a
    body in a medium."""
    system, gait = _divided(scene).system, scene.gait.cycle(scene.numerics.phases)
    bent, elements = bends(loaded(scene, WHAT), *gait), system.elements(*gait)
    cycle = system.run(*gait, work=True)
    work = type(cycle.work)(*(x / system.axial_drag for x in cycle.work))
    length = 2 * elements.half[:, 0]
    points = np.cumsum(length)[:-1]
    moment = work.bending_moment[:, np.searchsorted(points, bent.s - 1e-9)]
    pose = _poses(system, gait, cycle.xi)
    unit = unit or newtons(scene, system, sizes)
    run = Run(scene, pose[-1], _direction(pose[-1]), unit, activation_of(bent, moment))
    ahead = (
        _ahead(run, pose)[:, None] * (elements.c + 1j * elements.s).T
    )  # elements, the real axis that of travel
    of_ends = (
        work.end_force[:, 0] * ahead[:, [0, -1]].real
        - work.end_force[:, 1] * ahead[:, [0, -1]].imag
    )
    along, across = work.element_force[:, 0], work.element_force[:, 1]
    parts = {
        "normal": -across * ahead.imag,
        "tangential": along * ahead.real,
        "ends": of_ends,
    }
    variables = [
        *_coordinates(len(pose) - 1, length, points, bent.s),
        *_maps(parts, along, across, work, length),
        *_by_phase(parts, work, (moment * bent.rate).sum(-1)),
        *_by_place(parts, length),
        *_of_joints(run.activation),
    ]
    converted = tuple(_converted(v, run.newtons) for v in variables)
    return Result("forces", converted), run


def _poses(
    system: Any, gait: tuple[np.ndarray, np.ndarray], xi: np.ndarray
) -> np.ndarray:
    """Return the poses (N + 1, 3) of the frame during a cycle of shapes and rates with body velocities (N, 3)."""
    stepped = capability(system, Stepped)
    if stepped is None or not system.traits.lacks & Premise.SE2_SYMMETRIC:
        return poses(xi)
    return stepped.path(*gait, 1)


def _direction(net: np.ndarray) -> float:
    x, y, _ = net
    return float(np.arctan2(y, x)) if np.hypot(x, y) > 0 else 0.0


def _ahead(run: Run, pose: np.ndarray) -> np.ndarray:
    """Return the frame's heading (N,) as complex numbers whose real axis is the direction of travel."""
    share = np.arange(len(pose) - 1) / (len(pose) - 1) - 0.5
    travel = run.direction + share * run.net[2] if run.travels else 0.0
    return np.exp(1j * (pose[:-1, 2] - travel))


def _coordinates(
    phases: int, length: np.ndarray, points: np.ndarray, joints: np.ndarray
) -> list[Variable]:
    place = "from tail 0 to head 1"
    return [
        Variable(
            "phase",
            ("phase",),
            2 * np.pi * np.arange(phases) / phases,
            "rad",
            "phase of the gait",
        ),
        Variable(
            "s",
            ("s",),
            np.cumsum(length) - length / 2,
            "BL",
            f"centres of elements, {place}",
        ),
        Variable(
            "point", ("point",), points, "BL", f"points between elements, {place}"
        ),
        Variable("joint", ("joint",), joints, "BL", f"joints, {place}"),
        Variable("length", ("s",), length, "BL", "length of each element"),
    ]


def _maps(
    parts: dict, along: np.ndarray, across: np.ndarray, work: Any, length: np.ndarray
) -> list[Variable]:
    dims, density = ("phase", "s"), "drag/BL"
    of = lambda name, values, label: Variable(
        name, dims, values / length, density, f"{label}, per length of body"
    )
    return [
        of(
            "forward",
            parts["normal"] + parts["tangential"],
            "force in the direction of travel",
        ),
        of("forward_normal", parts["normal"], "its part by forces across the body"),
        of(
            "forward_tangential",
            parts["tangential"],
            "its part by forces along the body",
        ),
        of("normal", across, "force across the body, to its left"),
        of("tangential", along, "force along the body, to its head"),
        replace(
            of("power", work.element_power, "work against the medium"), unit="drag/rad"
        ),
        Variable(
            "bending_moment",
            ("phase", "point"),
            work.bending_moment,
            "drag x BL",
            "positive where the left side works",
        ),
    ]


SIDES = {
    "thrust": (np.maximum, "forwards"),
    "drag": (np.minimum, "backwards"),
}  # what pushes, and what holds back


def _by_phase(parts: dict, work: Any, joint_power: np.ndarray) -> list[Variable]:
    dims, total = ("phase",), work.element_power.sum(-1) + work.end_power.sum(-1)
    sums = [
        Variable(
            f"{kind}_{name}",
            dims,
            side(x, 0.0).sum(-1),
            "drag",
            f"sum of {name} forces {words}",
        )
        for kind, (side, words) in SIDES.items()
        for name, x in parts.items()
    ]
    of_ends = [
        Variable(
            f"{end}_forward",
            dims,
            parts["ends"][:, k],
            "drag",
            f"force on the {end} in the direction of travel",
        )
        for k, end in enumerate(("tail", "head"))
    ]
    powers = [
        Variable("medium_power", dims, total, WORK, "work against the medium"),
        Variable(
            "joint_power",
            dims,
            joint_power,
            WORK,
            "work of the bending moments at the joints",
        ),
    ]
    return [*sums, *of_ends, *powers]


def _by_place(parts: dict, length: np.ndarray) -> list[Variable]:
    label = "mean over the cycle of {} forces {}, per length of body"
    return [
        Variable(
            f"mean_{kind}_{name}",
            ("s",),
            side(parts[name], 0.0).mean(0) / length,
            "drag/BL",
            label.format(name, words),
        )
        for kind, (side, words) in SIDES.items()
        for name in FLANK
    ]


def _of_joints(activation: dict[str, Any]) -> list[Variable]:
    labels = {
        "lag": "phase by which activation is ahead of curvature, by changes of sign",
        "fundamental_lag": "phase by which activation is ahead of curvature, by the first harmonic",
        "onset": "phase at which the right side begins to work",
        "offset": "phase at which the right side ends to work",
    }
    variables = [
        Variable(name, ("joint",), activation[name], "rad", label)
        for name, label in labels.items()
    ]
    variables += [
        Variable(
            name,
            (),
            activation[name],
            "1",
            "speed of the wave of activation over that of curvature",
        )
        for name in ("speed_ratio", "fundamental_speed_ratio")
    ]
    return [
        Variable(
            "bend",
            ("phase", "joint"),
            activation["bend"],
            "rad",
            "positive to the left",
        ),
        *variables,
    ]


def _converted(v: Variable, unit: Newtons) -> Variable:
    """Return a variable in SI units, where these are known."""
    factor, name = unit.convert(v.unit)
    return replace(v, values=v.values * factor, unit=name)
