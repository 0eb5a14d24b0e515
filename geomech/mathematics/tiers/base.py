"""A tier predicts the net pose (..., 3) of a gait's cycle from phase t = 0, in the
frame at the start.

A tier is one expression, `Tier(...)`. Its plan for one system and gait has the table
that is computed once, the number of balances besides, and the function that returns the
displacement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.setting import Setting
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.representations.images import solved_count
from geomech.mathematics.systems.base import System, kind_of
from geomech.mathematics.systems.capabilities import Costed, capability, near_gait
from geomech.mathematics.systems.premises import refuse
from rft.core.checks import Number, check_numbers, real_array
from rft.core.premise import ALL, Premise
from rft.core.refusal import Refusal
from rft.core.registry import Registry


@dataclass(frozen=True)
class Numerics:
    """Numerical settings of the tiers, all optional: the part of [numerics] beside the
    system's own.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15, phases=64)
    >>> study.scene.numerics.grid
    15
    """

    directions: Annotated[
        int | None,
        Number(
            2,
            4096,
            "-",
            "number of directions of alphadot in the least-squares fit; if left out, "
            "8 for up to two joints, 16 per joint for more, or 4 where xi is linear "
            "in alphadot",
            whole=True,
        ),
    ] = None
    grid: Annotated[
        int, Number(4, 4096, "-", "points of the grid per joint", whole=True)
    ] = 31
    extent: Annotated[
        float, Number(1e-6, 100, "rad", "half width of the grid, on either side of 0")
    ] = 2.5
    interpolation: Annotated[
        int,
        Number(
            1, 5, "-", "degree of the splines that interpolate the field", whole=True
        ),
    ] = 3
    phases: Annotated[
        int, Number(8, 1_000_000, "-", "number of phases per cycle", whole=True)
    ] = 256
    harmonics: Annotated[
        int | None,
        Number(
            1,
            999,
            "-",
            "highest harmonic kept, odd; if left out, 15 for two joint rates, 9 for "
            "three, 5 for more",
            whole=True,
        ),
    ] = None
    curves: Annotated[
        int,
        Number(
            4,
            4096,
            "-",
            "number of curves in the table of a family of gaits",
            whole=True,
        ),
    ] = 24

    def __post_init__(self):
        check_numbers(self)
        if self.harmonics is not None and self.harmonics % 2 == 0:
            raise Refusal(
                "harmonics must be an odd number from 1 to 999", value=self.harmonics
            )
        if self.interpolation >= self.grid:
            raise Refusal(
                "interpolation must be from 1 to 5 and less than grid",
                value=self.interpolation,
            )


@dataclass(frozen=True, eq=False)
class Table:
    """Data that are computed once for a system and interpolated from then on.

    name: of its kind. key: all that it depends on besides the system. balances: number
    of velocities that building it takes. numbers: number of values in it. build:
    build(progress) returns the data, and calls progress with the fraction done. axes:
    function that returns the axes of a field of shapes, which gaits must not leave, and
    refuses a field too large; None for no field. amplitudes: of the gait from whose
    cycles it is built; None where it is built from no gait."""

    name: str
    key: tuple
    balances: int
    numbers: int
    build: Callable[[Callable | None], Any]
    axes: Callable[[], tuple[np.ndarray, ...]] | None = None
    amplitudes: np.ndarray | None = None


def no_balances(count: int, phases: int) -> int:
    """Return 0, the balances of a prediction that only interpolates."""
    return 0


def no_spread(table: Any, amplitudes: ArrayLike) -> None:
    """Return None, the spread of a prediction without a choice."""


@dataclass(frozen=True, eq=False)
class Plan:
    """The prediction of displacements of one gait of one system by a tier.

    predict: predict(table, amplitudes) returns net poses (..., 3), by the table or
    None, for amplitudes (...,), or None for the gait's own. table: None where nothing
    is interpolated. balances: balances(count, phases) returns the number of velocities
    of a prediction at ``count`` amplitudes, beside the table's. exact: the system runs
    the gait itself, so that its refinement measures the error. spread: spread(table,
    amplitudes) returns (B, 2), in the system's unit and rad, for amplitudes (B,): how
    far positions and headings depend on a choice that is no part of the question, such
    as a spanning surface; None for no such choice. numbers: number of values held
    beside the table's. read: number of values that an interpolation sums for each
    phase."""

    predict: Callable[[Any, Any], np.ndarray]
    table: Table | None = None
    balances: Callable[[int, int], int] = no_balances
    exact: bool = False
    spread: Callable[[Any, Any], np.ndarray | None] = no_spread
    numbers: int = 0
    read: int = 0


@dataclass(frozen=True, eq=False)
class Tier:
    """A method to predict displacements.

    name: in scenes, options and tables. label: for legends. style: of its line. plan:
    plan(system, numerics, gait, amplitudes) returns the `Plan`. rests_on: premises
    without which no ``result`` exists. joints: numbers of shape variables that it
    takes, in words ``takes``, with ``instead`` for other bodies; offered: the numbers
    for which it is chosen unless tiers are named. prescribed: joints must not give way.
    regular: there must be no singular shapes. common: a plain study takes it. markers:
    their colour; if left out the line's. settings: those that an error study sweeps.

    Examples
    --------
    >>> from geomech.mathematics.tiers import TIERS
    >>> list(TIERS)
    ['area', 'adapted', 'path', 'harmonic', 'direct']
    >>> TIERS["path"].label
    'path integral of A'
    """

    name: str
    label: str
    style: Mapping[str, Any]
    plan: Callable[[System, Numerics, Gait, Any], Plan]
    rests_on: Premise = ALL
    result: str = "connection or CCF"
    joints: range = range(1, 10_001)
    offered: range = range(1, 10_001)
    takes: str = "needs a body with joints"
    instead: str = "use direct"
    regular: bool = False
    prescribed: bool = False
    common: bool = True
    markers: str = ""
    settings: tuple[Setting, ...] = ()

    @property
    def colour(self) -> str:
        """Colour of its markers and of the band of its error."""
        return self.markers or self.style["color"]

    @property
    def home(self) -> str:
        """Module of its plan."""
        return self.plan.__module__

    def refuse(self, system: System) -> None:
        """Refuse a system to which the tier does not apply."""
        refuse(system, self.result, self.rests_on, "use the direct tier")
        if self.prescribed and system.traits.compliant:
            raise Refusal(
                f"the {self.name} tier has a table of gaits that prescribe the shape",
                because="with springs a gait is only a command",
                instead="use path, harmonic or direct",
            )
        if system.joints not in self.joints:
            raise Refusal(
                f"the {self.name} tier {self.takes}; this body has {system.joints}",
                instead=self.instead,
            )
        if self.meets_singular_shapes(system):
            gait = near_gait(system)
            reason = f"the {kind_of(system)} has singular shapes"
            if gait:
                reason = f"A is known only near {gait}"
            raise Refusal(
                f"the {self.name} tier integrates a field, and {reason}",
                instead="use path or direct",
            )

    def meets_singular_shapes(self, system: System) -> bool:
        """Return whether singular shapes keep the tier from applying to this system."""
        return self.regular and system.traits.singularity is not None

    def is_possible(self, system: System) -> bool:
        """Return whether the tier applies to this system."""
        if system.joints not in self.joints or system.traits.lacks & self.rests_on:
            return False
        if self.prescribed and system.traits.compliant:
            return False
        return not self.meets_singular_shapes(system)

    def is_offered(self, system: System) -> bool:
        """Return whether the tier applies to this system and takes no longer than more
        accurate ones."""
        return system.joints in self.offered and self.is_possible(system)


# In the order of the cost of an interpolation, cheapest first.
TIERS = Registry("geomech.tiers", "name", "a tier", lambda part: isinstance(part, Tier))


def solved_phases(system: System, gait: Gait, phases: int) -> int:
    """Return at how many phases of a gait the system's velocity is solved; the others
    are images of these."""
    least = max(4, 2 * gait.harmonics + 1)  # that represent the gait
    costed = capability(system, Costed)
    if system.traits.steps or phases < least or costed is None:
        return phases
    return solved_count(gait, phases, costed.traits)


def in_groups(f: Callable, amplitudes, size: int) -> np.ndarray:
    """Return f(batch) -> (b, n) for amplitudes (...,), at most ``size`` (or one) at a
    time, so that memory is bounded: (..., n)."""
    amplitudes = real_array("amplitudes", amplitudes)
    flat = amplitudes.reshape(-1)
    if not flat.size:
        return np.zeros((*amplitudes.shape, 3))
    size = max(1, size)
    results = [f(flat[k : k + size]) for k in range(0, flat.size, size)]
    return np.concatenate(results).reshape(*amplitudes.shape, -1)
