"""Joints that give way: springs, dampers, free hinges, cables with slack (quasi-static,
after Eq. 5 with the joint rates among the unknowns)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from rft.bodies.base import Body, half_lengths, innermost
from rft.core.checks import Number, check_numbers, in_range, is_number
from rft.core.premise import Premise
from rft.core.refusal import Refusal, require
from rft.effects.base import EFFECTS, Effect, Site
from rft.effects.contact import Problem
from rft.laws.base import is_linear, speed_exponent

MOST = 1e9  # stiffness, damping or bending, in units of drag
MOST_ANGLE = 100.0  # rad
Numbers = float | tuple[float, ...]


class JointSprings(NamedTuple):
    """The springs of one body in one medium, for E joints and d shape variables.

    rows: (E, d), angles of the joints per unit of each shape variable. unknown: (m,),
    indices of the shape variables that give way. stiffness, damping: (E, B or 1), over
    the axial drag times the length of the body, per rad, and per rad per radian of
    phase; stiffness is infinite where a joint is prescribed. rest, low, high: (E, 1),
    rad. actuated: (E, 1), 1 where the gait commands the joint, 0 where it is
    passive."""

    rows: np.ndarray
    unknown: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    rest: np.ndarray
    low: np.ndarray
    high: np.ndarray
    actuated: np.ndarray

    @property
    def finite_stiffness(self) -> np.ndarray:
        """Stiffness with 0 at prescribed joints, whose torque is not computed."""
        return np.where(np.isinf(self.stiffness), 0.0, self.stiffness)

    def take(self, index: Any) -> JointSprings:
        """Return the springs of some samples."""
        taken = self
        for name in ("stiffness", "damping"):
            x = getattr(self, name)
            if x.shape[1] > 1:
                taken = taken._replace(**{name: x[:, index]})
        return taken


@EFFECTS.register
@dataclass(frozen=True)
class Springs(Effect):
    """Joints that a gait does not prescribe but drives through springs, or leaves free.

    The torque on joint k that drives it back is

        stiffness (alpha_k - rest - command_k) + damping d(alpha_k)/dt,

    where the first term counts only what exceeds the dead band, and command_k is the
    gait's angle, or 0 for a passive joint. It balances the drag's torque on the joint,
    while the force and the moment on the whole body vanish; the shape then follows by
    implicit steps of order 2 in time (BDF2).

    stiffness (axial drag x body length per rad): of all joints, or a list with one for
    each; inf prescribes a joint, 0 leaves it free. damping (axial drag x body length x
    s per rad): of all joints, or a list with one for each. rest (rad): angle at which
    a spring without a command is at rest, of all joints or a list. dead_band (rad):
    half width of the slack, of all joints, or a list with a number or a pair [low,
    high] for each. passive (-): list of the joints without an actuator, numbered from
    1. prescribed (-): list of the joints that the gait prescribes, whatever stiffness
    is, numbered from 1.

    Units: the axial drag is that of the straight body along itself, and with ``unit``,
    that drag times the body's length in N m, stiffness is in N m/rad and damping in N m
    s/rad. Dry drag does not depend on the speed, so that no frequency is needed, but
    damping has a meaning only with one. In a viscous medium the axial drag is that at
    one body length per second; there stiffness has a meaning only with the frequency,
    and damping needs none. Where drag grows with a power p of the speed, stiffness
    counts over (2 pi frequency)^p.

    A dead band [-0.3, 0.3] is a cable with 0.3 rad of slack to either side, and [0,
    inf] on a passive joint a fin that folds freely to the left and not to the right.

    With ``bending`` the body is a rod of that bending stiffness, and each joint has
    bending over the distance between the centres of its two elements.

    Examples
    --------
    >>> from rft.effects import Springs, engine
    >>> tail = Springs(stiffness=0.02, passive=1, prescribed=2)
    >>> tail.breaks, engine([tail])
    (<Premise.PRESCRIBED_SHAPE: 16>, 'time stepping')
    """

    stiffness: Numbers | None = None
    bending: Annotated[
        float | None,
        Number(
            0,
            MOST,
            "axial drag x body length^2",
            "bending stiffness of the body, in place of stiffness",
        ),
    ] = None
    damping: Numbers = 0.0
    rest: Numbers = 0.0
    dead_band: float | tuple[float | tuple[float, float], ...] = 0.0
    passive: tuple[int, ...] = ()
    prescribed: tuple[int, ...] = ()
    frequency: Annotated[
        float | None,
        Number(
            1e-9,
            1e9,
            "1/s",
            "cycles per second; required for stiffness in a medium whose drag depends "
            "on the speed, and for damping in others",
        ),
    ] = None
    unit: Annotated[
        float | None,
        Number(
            1e-30,
            1e30,
            "N m",
            "axial drag of the straight body times its length; with it stiffness is in "
            "N m/rad",
        ),
    ] = None

    kind = "springs"
    breaks = Premise.PRESCRIBED_SHAPE
    limit = "stiffness = inf"
    order = 1
    cost = (
        "phases solved one after another, cycle after cycle, with the rates of the "
        "joints among the unknowns: each phase takes 1.3 to 2.4 times the evaluations "
        "of force that it takes without springs"
    )
    batched = ("stiffness", "bending", "damping", "frequency")
    memory_bounds = (-MOST_ANGLE, MOST_ANGLE)
    reads_place = False
    mixes_media = False

    def __post_init__(self):
        check_numbers(self)
        require(
            (self.stiffness is None) != (self.bending is None),
            "springs need either stiffness or bending",
            instead="give one of them",
        )
        require(
            self.unit is None or self.bending is None,
            "unit does not go with bending",
            instead="give stiffness in N m/rad, or bending without unit",
        )
        if self.stiffness is not None:
            self._check_each("stiffness", 0.0)
        self._check_each("damping", 0.0)
        self._check_each("rest", -MOST)
        for name in ("passive", "prescribed"):
            object.__setattr__(self, name, _checked_joints(name, getattr(self, name)))
        object.__setattr__(self, "dead_band", _checked_band(self.dead_band))

    def _check_each(self, name: str, low: float) -> None:
        """Refuse values of a field that are no number from low to MOST, or of a
        stiffness infinite; store a list as a tuple."""
        value = getattr(self, name)
        values = [value] if is_number(value) else value
        require(
            isinstance(values, (list, tuple)) and len(values) > 0,
            f"{name} must be a number, or a list of one for each joint",
            value=value,
        )
        for x in values:
            if name != "stiffness" or x != math.inf:
                in_range(name, x, low, MOST)
        numbers = tuple(float(x) for x in values)
        object.__setattr__(self, name, numbers[0] if is_number(value) else numbers)

    def check(self, medium: Any) -> None:
        exponent = speed_exponent(medium)
        depends_on_speed = exponent is not None and exponent > 0
        has_stiffness = self.bending is not None or _is_finite_and_positive(
            self.stiffness
        )
        if depends_on_speed and has_stiffness and self.frequency is None:
            raise Refusal(
                "springs have no frequency",
                because="drag in this medium depends on the speed, and stiffness does "
                "not",
                instead="give frequency, in cycles per second",
            )
        if np.any(self.damping) and not is_linear(medium) and self.frequency is None:
            raise Refusal(
                "damping of springs has no frequency",
                because="drag in this medium is not proportional to the speed",
                instead="give frequency, in cycles per second, or remove damping",
            )

    def check_body(self, body: Body, medium: Any) -> None:
        self.of_body(body, medium)

    def apply(self, problem: Problem, site: Site | None, state: Any) -> Problem:
        return problem

    def of_body(self, body: Body, medium: Any) -> JointSprings:
        """Return the springs of a body in a medium.

        Raises ValueError for a body without joints, for numbers that are not one or one
        a joint, and where no joint is driven."""
        rows = joint_rows(body)
        count = len(rows)
        require(
            self.bending is not None or not hasattr(innermost(body), "elements"),
            "stiffness is of single joints",
            because="a backbone has as many joints as its number of elements asks for",
            instead="give bending, the stiffness of the body as a rod",
        )
        omega = 1.0
        if self.frequency is not None:
            omega = 2 * np.pi * np.asarray(self.frequency, float)
        exponent = speed_exponent(medium) or 0.0
        per_unit = 1.0 if self.unit is None else 1.0 / self.unit
        if self.bending is None:
            stiffness = _by_joint("stiffness", self.stiffness, count)
        else:
            half = half_lengths(innermost(body))
            distance = (half[:-1] + half[1:])[:, None]
            stiffness = np.asarray(self.bending, float) / distance
        stiffness = stiffness * per_unit / omega**exponent
        damping = _by_joint("damping", self.damping, count)
        damping = damping * per_unit * omega ** (1.0 - exponent)
        low, high = _band_by_joint(self.dead_band, count)
        actuated = np.ones((count, 1))
        actuated[_indices("passive", self.passive, count)] = 0.0
        stiffness = np.array(np.atleast_2d(stiffness))
        stiffness[_indices("prescribed", self.prescribed, count)] = math.inf
        is_rigid = np.isinf(stiffness).all(1)
        require(
            bool((is_rigid == np.isinf(stiffness).any(1)).all()),
            "stiffness is infinite in a part of a batch",
            instead="compute prescribed joints apart",
        )
        is_mode = rows.shape[1] != count or bool((rows != np.eye(count)).any())
        require(
            not np.isinf(stiffness).any() or not is_mode,
            "stiffness is infinite",
            because="this body's shape variables are not the angles of single joints",
            instead="give every joint a finite stiffness",
        )
        require(
            not (self.passive and is_mode),
            "passive names single joints",
            because="this body's shape variables are not the angles of single joints",
            instead="use a chain without modes",
        )
        require(
            not (is_rigid & (actuated[:, 0] == 0)).any(),
            "a passive joint has infinite stiffness",
            instead="give it a finite stiffness, or shorten the chain by this joint",
        )
        drives = is_rigid | ((actuated[:, 0] > 0) & (stiffness > 0).any(1))
        require(
            bool(drives.any()),
            "no joint is driven",
            because="all are free or passive",
            instead="give a joint that is not passive a stiffness",
        )
        unknown = np.arange(rows.shape[1])
        if not is_mode:
            unknown = np.flatnonzero(~is_rigid)
        return JointSprings(
            rows,
            unknown,
            np.atleast_2d(stiffness),
            np.atleast_2d(damping),
            _by_joint("rest", self.rest, count),
            low,
            high,
            actuated,
        )

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Springs]:
        stiffness = 0.05 / x if x > 0 else math.inf
        return {"springs": cls(stiffness=stiffness, frequency=0.4)}


def joint_rows(body: Body) -> np.ndarray:
    """Return the angles of the joints (E, d) per unit of each of a body's shape
    variables; Refusal for a body whose joints are not known."""
    body = innermost(body)
    if getattr(body, "modes", None) is not None:
        return body.mode_rows.T
    bends = getattr(body, "bends", None)
    if bends is not None:
        return bends
    has_joints = hasattr(body, "lengths") or hasattr(body, "elements")
    n_elements = len(half_lengths(body))
    require(
        has_joints and body.joints == n_elements - 1,
        "springs need a body of links with joints between them",
        instead="use a chain or a backbone",
    )
    return np.eye(body.joints)


def _checked_joints(name: str, joints: Any) -> tuple[int, ...]:
    """Return a list of joints, numbered from 1, as a tuple; Refusal for others."""
    if isinstance(joints, (int, np.integer)) and not isinstance(joints, bool):
        joints = (joints,)
    require(
        isinstance(joints, (list, tuple)),
        f"{name} must be a list of joints, numbered from 1",
        value=joints,
    )
    for joint in joints:
        in_range(name, joint, 1, 10_000, whole=True)
    return tuple(int(joint) for joint in joints)


def _indices(name: str, joints: tuple[int, ...], count: int) -> list[int]:
    """Return the indices of joints that are numbered from 1; Refusal for one that the
    body has not."""
    for joint in joints:
        require(
            joint <= count,
            f"{name} names joint {joint}",
            because=f"the body has {count} joints",
        )
    return [joint - 1 for joint in joints]


def _is_finite_and_positive(stiffness: Any) -> bool:
    """Return whether any spring is neither free nor rigid."""
    k = np.asarray(stiffness, float)
    return bool((np.isfinite(k) & (k > 0)).any())


def _by_joint(name: str, value: Any, count: int) -> np.ndarray:
    """Return one number for each joint, (E, 1), or (E, B) of a batch."""
    if isinstance(value, np.ndarray):
        if value.ndim == 1:
            return np.broadcast_to(value, (count, len(value)))
        number_given = len(value)
    elif is_number(value):
        return np.full((count, 1), float(value))
    else:
        number_given = len(value)
    require(
        number_given == count,
        f"{name} has {number_given} numbers",
        because=f"the body has {count} joints",
        instead="give one number, or one for each joint",
    )
    return np.asarray(value, float).reshape(count, -1)


def _checked_band(value: Any) -> Any:
    """Return a dead band as a number or a tuple of pairs; Refusal for anything else."""
    if is_number(value):
        in_range("dead_band", value, 0.0, MOST_ANGLE, unit="rad")
        return float(value)
    what = (
        "dead_band must be a number in rad, or for each joint a number or a pair "
        "(low, high) with low <= high"
    )
    require(isinstance(value, (list, tuple)) and len(value) > 0, what)
    pairs = []
    for band in value:
        if is_number(band):
            pair = (0.0 - float(band), float(band))
        else:
            require(
                isinstance(band, (list, tuple))
                and len(band) == 2
                and all(map(is_number, band)),
                what,
                value=band,
            )
            pair = (float(band[0]), float(band[1]))
        require(pair[0] <= pair[1] and not any(map(math.isnan, pair)), what, value=band)
        pairs.append(pair)
    return tuple(pairs)


def _band_by_joint(band: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper ends of the dead bands, (E, 1) each."""
    if isinstance(band, float):
        band = ((0.0 - band, band),) * count
    require(
        len(band) == count,
        f"dead_band has {len(band)} bands",
        because=f"the body has {count} joints",
        instead="give one number, or one band for each joint",
    )
    ends = np.array(band, float)
    return ends[:, :1], ends[:, 1:]
