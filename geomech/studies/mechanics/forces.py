"""Forces along a body that undulates: thrust and drag of each part at each phase,
power, bending moment, activation.

The force of the medium on an element has a normal part, across it, and a tangential
part, along it; points that effects add at the ends have forces of their own. The
component of a part in the direction of travel is thrust where it pushes the body
forwards and drag where it holds it back. The direction of travel is that of the net
displacement. Where the body turns in a cycle, this direction turns evenly with the
phase, as on a circle. Without mass and slope all forces balance at every phase."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from geomech.core.summary import first_place
from geomech.core.variables import Result, Variable
from geomech.mathematics.geometry.reconstruct import poses
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.mathematics.systems.capabilities import (
    Stepped,
    capability,
    pieces_per_length,
    refined,
)
from geomech.runs.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.estimates.cost import direct_jobs, total_cost
from geomech.studies.estimates.elements import (
    coarser_systems,
    gait_with_elements,
    n_elements,
)
from geomech.studies.mechanics.newtons import ForceUnit, Sizes, force_unit
from geomech.studies.mechanics.undulation import activation_of_bends, bends, loaded
from geomech.studies.realised import true_shape
from rft.core.premise import Premise
from rft.core.refusal import located

FLANK = ("normal", "tangential")
PARTS = (*FLANK, "ends")
# What pushes, and what holds back.
SIDES = {
    "thrust": (np.maximum, "forwards"),
    "drag": (np.minimum, "backwards"),
}
PLACES = (0.25, 0.5, 0.75)  # of the body, at which the lag of activation is shown
# Error over the change to a law computed more exactly, which is nearly all of the error
# (`geomech.studies.estimates.estimate`).
ERROR_OVER_CHANGE = 1.2
WINDOW = 1 / 32  # cycle
FEWEST_STEPS = 8  # of time stepping
# Body lengths per cycle, below which there is no direction of travel.
SMALLEST_TRAVEL = 1e-6
SUBJECT = "force along the body"
POWER = "drag x BL/rad"
PLACE = "from tail 0 to head 1"
NO_SIZES = Sizes()
FIELD_DIMS = (("phase",), ("phase", "s"), ("phase", "point"))


# The question `forces`.


def check(scene: Scene, sizes: Sizes) -> None:
    """Refuse sizes that contradict the scene, and a system without a body in a
    medium."""
    with located(scene.name):
        force_unit(scene, loaded(scene, SUBJECT), sizes)


def body_length(scene: Scene, sizes: Sizes) -> float | None:
    """Return the length of the body, m; None where neither the scene nor the sizes have
    it."""
    return force_unit(scene, loaded(scene, SUBJECT), sizes).length


def cost(scene: Scene) -> Cost:
    """Return the cost of `answer`."""
    jobs = []
    for one in (scene, *_variants(scene)):
        phases = one.numerics.phases
        jobs += direct_jobs(_subdivided(one), one.gait, 1, phases, with_error=False)
    return total_cost(jobs)


def answer(scene: Scene, sizes: Sizes) -> Result:
    """Return `forces` with errors, means over the cycle and largest values; the unit of
    force in words and whether the body travels as attributes."""
    with located(scene.name):
        found, cycle = forces(scene, sizes)
        found = with_errors(found, cycle)
    facts = {"travels": int(cycle.travels), "drag_is": unit_words(cycle.unit)}
    scalars = [
        *travel_variables(cycle),
        *mean_forces(found),
        *power_variables(found),
        *largest_moment(found),
        *activation_lags(found),
    ]
    return Result("forces", (*scalars, *found.variables), facts)


def unit_words(unit: ForceUnit) -> str:
    """Return what the unit of force is."""
    if unit.drag is None:
        sizes = ", ".join(unit.missing)
        return f"drag of the straight body along itself; add {sizes} to obtain newtons"
    words = f"drag of the straight body along itself {unit.drag:.4g} N, {unit.source}"
    if unit.frequency:
        return words
    return f"{words}; add frequency to obtain watts"


def travel_variables(cycle: Cycle) -> list[Variable]:
    """Return the net distance of a cycle and its direction."""
    unit = length_unit(cycle.scene.system)
    distance = np.hypot(*cycle.net[:2])
    label = "direction of travel at mid-cycle, from the heading of the frame at phase 0"
    return [
        Variable("net_distance", (), distance, unit, "net distance per cycle"),
        Variable("direction", (), cycle.direction, "rad", label),
    ]


def mean_and_error(variable: Variable) -> tuple[float, float]:
    """Return the mean of a variable and the mean of its error, 0 without one."""
    mean = float(variable.values.mean())
    if variable.error is None:
        return mean, 0.0
    return mean, float(variable.error.mean())


def mean_forces(found: Result) -> list[Variable]:
    """Return the means over the cycle of thrust and drag, by part of the force and
    their sum."""
    variables = [Variable("part", ("part",), [*PARTS, "sum"])]
    for side in SIDES:
        parts = [found[f"{side}_{part}"] for part in PARTS]
        values, errors = zip(*map(mean_and_error, parts))
        values = (*values, sum(values))
        errors = (*errors, sum(errors))
        label = f"mean {side} over the cycle"
        unit = parts[0].unit
        variables.append(Variable(side, ("part",), values, unit, label, errors))
    return variables


def power_variables(found: Result) -> list[Variable]:
    """Return the mean and the largest power into the medium, and the mean at the
    joints."""
    power = found["medium_power"]
    joint_power = found["joint_power"]
    mean, error = mean_and_error(power)
    largest = power.values.max()
    at_joints = joint_power.values.mean()
    unit = power.unit
    return [
        Variable("mean_power", (), mean, unit, "mean power into the medium", error),
        Variable("largest_power", (), largest, unit, "largest power into the medium"),
        Variable("mean_joint_power", (), at_joints, unit, "mean power of the joints"),
    ]


def largest_moment(found: Result) -> list[Variable]:
    """Return the largest bending moment, its place and its phase."""
    moment = found["bending_moment"]
    sizes = np.abs(moment.values)
    k, point = first_place(sizes, sizes.max())
    s = found["point"].values[point]
    phase = found["phase"].values[k]
    return [
        Variable("largest_moment", (), sizes[k, point], moment.unit, "bending"),
        Variable("largest_moment_s", (), s, "BL", "its place, from tail 0 to head 1"),
        Variable("largest_moment_phase", (), phase, "rad", "its phase"),
    ]


def activation_lags(found: Result) -> list[Variable]:
    """Return the phase by which activation is ahead of bending, at the joints or, of
    many joints, at PLACES."""
    joints = found["joint"].values
    places = joints
    if joints.size > len(PLACES):
        places = np.array(PLACES)
    lags = np.interp(places, joints, found["fundamental_lag"].values)
    label = "phase by which activation leads curvature"
    return [
        Variable("place", ("place",), places, "BL", PLACE),
        Variable("lag_of_activation", ("place",), lags, "rad", label),
    ]


# Errors.


class Cycle(NamedTuple):
    """A cycle of a scene's gait, with its direction of travel.

    net: (3,), pose after it. direction: rad, of travel at the middle of the cycle, from
    the frame's heading at its start; 0 where the body does not travel. unit: of force.
    activation: as `geomech.studies.mechanics.undulation.activation`."""

    scene: Scene
    net: np.ndarray
    direction: float
    unit: ForceUnit
    activation: dict[str, Any]

    @property
    def travels(self) -> bool:
        """Whether there is a direction of travel; else forwards is where the frame
        points to at phase 0."""
        smallest = SMALLEST_TRAVEL * body_size(self.scene.system)
        return bool(np.hypot(*self.net[:2]) > smallest)


def with_errors(result: Result, cycle: Cycle) -> Result:
    """Return forces with errors.

    An error is the sum of changes: with half the elements of a backbone, with half the
    pieces into which effects cut a body, with a law computed more exactly, and in time
    stepping with half the phases. Of each change the largest within WINDOW of a phase
    counts, as changes pass through zero. Errors of order 2 are a third of these
    changes; near stuck links they scatter."""
    others = []
    for variant in _variants(cycle.scene):
        found, _ = forces(variant, unit=cycle.unit)
        others.append(found)
    variables = []
    for variable in result.variables:
        if variable.dims in FIELD_DIMS and not variable.is_coordinate:
            error = _error(variable, result, others)
            variable = replace(variable, error=error)
        variables.append(variable)
    return replace(result, variables=tuple(variables))


def _error(variable: Variable, result: Result, others: list[Result]) -> np.ndarray:
    """Return the sum of the changes of a variable of a result in other results."""
    from scipy.ndimage import maximum_filter1d

    error = np.zeros_like(variable.values)
    phases = len(error)
    for other in others:
        values = _at_places(variable, result, other)
        same_phases = variable.values[:: phases // len(values)]
        change = ERROR_OVER_CHANGE * np.abs(same_phases - values)
        width = 2 * round(WINDOW * len(change)) + 1
        largest = maximum_filter1d(change, width, axis=0, mode="wrap")
        if len(largest) < phases:
            # With half the phases: the largest change of the whole cycle.
            largest = largest.max(0)
        error += largest
    return error


def _at_places(variable: Variable, result: Result, other: Result) -> np.ndarray:
    """Return a variable of another result, interpolated to the places of a result."""
    from scipy.interpolate import make_interp_spline

    values = other[variable.name].values
    for dim in variable.dims[1:]:
        spline = make_interp_spline(other[dim].values, values, 1, axis=1)
        values = spline(result[dim].values)
    return values


def _variants(scene: Scene) -> list[Scene]:
    """Return other approximations of a scene: coarser ones, and one with its law
    computed more exactly."""
    system = loaded(scene, SUBJECT)
    phases = scene.numerics.phases
    scene = scene.changed(system=system)
    variants = []
    finer = refined(system)
    if finer:
        variants.append(scene.changed(system=finer))
    variants += _with_fewer_elements(scene)
    pieces = pieces_per_length(system)
    if pieces:
        variants.append(scene.with_numerics(pieces=max(1, pieces // 2)))
    if system.traits.steps and phases % 2 == 0 and phases >= 2 * FEWEST_STEPS:
        variants.append(scene.with_numerics(phases=phases // 2))
    return variants


def _with_fewer_elements(scene: Scene) -> list[Scene]:
    """Return the scene of a continuous body, and of its gait, with about half as many
    elements; none for other bodies, or where it has too few."""
    system = scene.system
    other = next(iter(coarser_systems(system)), None)
    if other is None or other.ratio < 1:
        return []
    gait = gait_with_elements(scene.gait, system, n_elements(other.system))
    return [scene.changed(system=other.system, gait=gait)]


def _subdivided(scene: Scene) -> Scene:
    """Return the scene with a body of short elements, so that the forces along each
    link are known as well."""
    return scene.changed(system=loaded(scene, SUBJECT).subdivided())


# Forces over a cycle.


def forces(
    scene: Scene, sizes: Sizes = NO_SIZES, unit: ForceUnit | None = None
) -> tuple[Result, Cycle]:
    """Return forces, power, bending moments and activation over a cycle of the scene's
    gait, at its N phases, and the cycle.

    Variables have values over the n elements, at least 40, or the n - 1 points between
    them, or the joints, at positions s: 0 at the tail to 1 at the head. `forward` and
    its two parts are components in the direction of travel, `normal` and `tangential`
    components to the element's left and to its head. `thrust_*` and `drag_*` are sums
    over the body of the forces that push and of those that hold back; `mean_thrust_*`
    and `mean_drag_*` are means over the cycle. power: work against the medium.
    joint_power: work of the bending moments on the bends, which is the same but for the
    kinetic energy of a heavy body. Forces are in axial drags of the straight body, or
    in N where its sizes are known. unit: of force, in place of sizes. Refusal for a
    system without a body in a medium."""
    system = _subdivided(scene).system
    alpha, alphadot = scene.gait.cycle(scene.numerics.phases)
    if system.traits.compliant:
        # Of the true shape, which is that of the body as it is, cut or not.
        alpha, alphadot = true_shape(scene.system.run(alpha, alphadot), alpha, alphadot)
        system = system.prescribed
    run = system.run(alpha, alphadot, work=True)
    elements = system.elements(alpha, alphadot)
    work = _in_axial_drags(run.work, system.axial_drag)
    length = 2 * elements.half[:, 0]
    points = np.cumsum(length)[:-1]

    # The joints of the scene's own body are some of the points of the subdivided one.
    bent = bends(loaded(scene, SUBJECT), alpha, alphadot)
    joints = np.searchsorted(points, bent.s - 1e-9)
    moment = work.bending_moment[:, joints]
    joint_power = (moment * bent.rate).sum(-1)

    pose = _cycle_poses(system, alpha, alphadot, run.xi)
    net = pose[-1]
    if unit is None:
        unit = force_unit(scene, system, sizes)
    activation = activation_of_bends(bent, moment)
    cycle = Cycle(scene, net, _direction(net), unit, activation)

    headings = elements.c + 1j * elements.s
    headings = _from_travel(cycle, pose)[:, None] * headings.T
    forward = _forward_parts(work, headings)
    variables = [
        *_coordinates(len(pose) - 1, length, points, bent.s),
        *_maps(forward, work, length),
        *_phase_variables(forward, work, joint_power),
        *_place_variables(forward, length),
        *_joint_variables(activation),
    ]
    return Result("forces", tuple(_in_si(v, unit) for v in variables)), cycle


def _in_axial_drags(work: Any, axial_drag: float) -> Any:
    """Return the forces, moments and powers of a cycle over the body's axial drag."""
    return type(work)(*(values / axial_drag for values in work))


def _cycle_poses(
    system: Any, alpha: np.ndarray, alphadot: np.ndarray, xi: np.ndarray
) -> np.ndarray:
    """Return the poses (N + 1, 3) of the frame during a cycle with body velocities
    (N, 3)."""
    stepped = capability(system, Stepped)
    if stepped is None or not system.traits.lacks & Premise.SE2_SYMMETRIC:
        return poses(xi)
    return stepped.path(alpha, alphadot, 1)


def _direction(net: np.ndarray) -> float:
    """Return the direction of a net displacement, rad; 0 without one."""
    x, y, _ = net
    if np.hypot(x, y) > 0:
        return float(np.arctan2(y, x))
    return 0.0


def _from_travel(cycle: Cycle, pose: np.ndarray) -> np.ndarray:
    """Return the frame's heading (N,) from the direction of travel, as complex numbers
    whose real axis is that direction."""
    phases = len(pose) - 1
    direction = 0.0
    if cycle.travels:
        from_middle = np.arange(phases) / phases - 0.5  # cycles
        direction = cycle.direction + from_middle * cycle.net[2]
    return np.exp(1j * (pose[:-1, 2] - direction))


def _forward_parts(work: Any, headings: np.ndarray) -> dict[str, np.ndarray]:
    """Return the components in the direction of travel of the parts of the force: on
    the elements (N, n), and on tail and head (N, 2).

    headings: (N, n), of the elements, complex, from the direction of travel."""
    along = work.element_force[:, 0]
    across = work.element_force[:, 1]
    end_along = work.end_force[:, 0]
    end_across = work.end_force[:, 1]
    ends = headings[:, [0, -1]]
    return {
        "normal": -across * headings.imag,
        "tangential": along * headings.real,
        "ends": end_along * ends.real - end_across * ends.imag,
    }


# Variables.


def _coordinates(
    phases: int, length: np.ndarray, points: np.ndarray, joints: np.ndarray
) -> list[Variable]:
    phase = 2 * np.pi * np.arange(phases) / phases
    centres = np.cumsum(length) - length / 2
    between = f"points between elements, {PLACE}"
    return [
        Variable("phase", ("phase",), phase, "rad", "phase of the gait"),
        Variable("s", ("s",), centres, "BL", f"centres of elements, {PLACE}"),
        Variable("point", ("point",), points, "BL", between),
        Variable("joint", ("joint",), joints, "BL", f"joints, {PLACE}"),
        Variable("length", ("s",), length, "BL", "length of each element"),
    ]


def _maps(forward: dict, work: Any, length: np.ndarray) -> list[Variable]:
    """Return the forces, power and moments over phase and place."""

    def density(name, values, label, unit="drag/BL"):
        label = f"{label}, per length of body"
        return Variable(name, ("phase", "s"), values / length, unit, label)

    normal = forward["normal"]
    tangential = forward["tangential"]
    along = work.element_force[:, 0]
    across = work.element_force[:, 1]
    power = work.element_power
    return [
        density("forward", normal + tangential, "force in the direction of travel"),
        density("forward_normal", normal, "contribution of forces across the body"),
        density(
            "forward_tangential", tangential,
            "contribution of forces along the body",
        ),
        density("normal", across, "force across the body, to its left"),
        density("tangential", along, "force along the body, to its head"),
        density("power", power, "work against the medium", "drag/rad"),
        Variable(
            "bending_moment", ("phase", "point"), work.bending_moment, "drag x BL",
            "bending moment, positive where the left side works",
        ),
    ]  # fmt: skip


def _phase_variables(
    forward: dict, work: Any, joint_power: np.ndarray
) -> list[Variable]:
    """Return the forces and powers of the whole body over phase."""
    over = ("phase",)
    found = []
    for kind, (side, words) in SIDES.items():
        for part, values in forward.items():
            total = side(values, 0.0).sum(-1)
            label = f"sum of {part} forces {words}"
            found.append(Variable(f"{kind}_{part}", over, total, "drag", label))
    for end, values in zip(("tail", "head"), forward["ends"].T):
        label = f"force on the {end} in the direction of travel"
        found.append(Variable(f"{end}_forward", over, values, "drag", label))
    power = work.element_power.sum(-1) + work.end_power.sum(-1)
    of_moments = "work of the bending moments at the joints"
    found += [
        Variable("medium_power", over, power, POWER, "work against the medium"),
        Variable("joint_power", over, joint_power, POWER, of_moments),
    ]
    return found


def _place_variables(forward: dict, length: np.ndarray) -> list[Variable]:
    """Return the means over the cycle of thrust and drag along the body."""
    found = []
    for kind, (side, words) in SIDES.items():
        for part in FLANK:
            mean = side(forward[part], 0.0).mean(0) / length
            label = f"mean over the cycle of {part} forces {words}, per length of body"
            found.append(
                Variable(f"mean_{kind}_{part}", ("s",), mean, "drag/BL", label)
            )
    return found


def _joint_variables(activation: dict[str, Any]) -> list[Variable]:
    """Return bends and activation at the joints."""
    ahead = "phase by which activation leads curvature"
    labels = {
        "lag": f"{ahead}, from changes of sign",
        "fundamental_lag": f"{ahead}, from the first harmonic",
        "onset": "phase at which the right side starts to work",
        "offset": "phase at which the right side stops working",
    }
    bend = activation["bend"]
    found = [
        Variable("bend", ("phase", "joint"), bend, "rad", "bend, positive to the left")
    ]
    for name, label in labels.items():
        found.append(Variable(name, ("joint",), activation[name], "rad", label))
    label = "speed of the wave of activation over the speed of the wave of curvature"
    for name in ("speed_ratio", "fundamental_speed_ratio"):
        found.append(Variable(name, (), activation[name], "1", label))
    return found


def _in_si(variable: Variable, unit: ForceUnit) -> Variable:
    """Return a variable in SI units, where these are known."""
    factor, name = unit.convert(variable.unit)
    return replace(variable, values=variable.values * factor, unit=name)
