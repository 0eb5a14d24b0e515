"""Ground that a robot disturbs as it walks: prints of its limbs, which its later steps
meet.

Both engines take the same law. Limbs are the legs of a robot, or all of its bodies but
the root; the root, which carries them, neither disturbs the ground nor meets prints
(assumed). The strength of the ground under each limb is set anew at the beginning of
every time step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers, real_array
from rft.core.premise import Premise
from rft.core.refusal import require
from rft.terradynamics.ground import Ground, GroundEffect

MOST_PLACES = 1000
# Of the radius: prints nearer to each other are one.
SPACING = 0.1
# Of the radius: where the disturbance around a print ends; it falls from half a radius.
END = 1.5
ROWS = 2**31  # of cells, more than any ground has


@dataclass(frozen=True)
class PrintedGround(GroundEffect):
    """Ground that the limbs of a walking robot disturb, where later steps find less
    hold.

    A limb leaves prints wherever its surface has been in the ground. A print counts
    once the limb is out of the ground, or farther than one and a half ``radius`` from
    it: the stresses of the laws were measured in ground that the limb itself disturbs.
    The disturbance is 1 up to half a radius along the ground from any print, and falls
    linearly to 0 at one and a half. All force on a limb is
    1 - weakening x disturbance times that of undisturbed ground, with the mean
    disturbance of the surface in the ground, weighted by area and depth.

    places (m): x of earlier intrusions, across the whole ground; by default none.

    Experiments show that drag and penetration forces fall substantially close to
    disturbed ground, which was posited to be the cause of locomotor failure (paper
    Sec. IV B). The form and its numbers are assumed, as is that
    disturbances neither add up nor heal, that the ground stays level, and that one
    factor stands for all directions.

    Examples
    --------
    >>> from rft.terradynamics.plates import CLeg, StressMap
    >>> from rft.terradynamics.walking import (
    ...     Fineness, PrintedGround, Rhex, Tripod, Walker, engine
    ... )
    >>> robot = Rhex(0.15, 0.13, 0.02, 0.03, CLeg(0.02, 0.01), hips=(-0.05, 0.0, 0.05))
    >>> ground = PrintedGround(radius=0.02, weakening=0.4)
    >>> walker = Walker(robot, Tripod(2.0), StressMap(zeta=0.6), (ground,))
    >>> (walk,) = engine("planar").walk([walker], Fineness(steps=16, duration=2.0))
    >>> walk.step_strength.round(2)  # of the ground under the legs, by cycles
    array([0.88, 0.9 , 0.91, 0.91])
    """

    radius: Annotated[
        float,
        Number(
            1e-4,
            10,
            "m",
            "approximate distance along the ground to which limbs disturb it",
        ),
    ]
    weakening: Annotated[
        float, Number(0, 1, "-", "share of the force lost in fully disturbed ground")
    ]
    places: tuple[float, ...] = ()

    kind = "disturbed-ground"
    breaks = Premise.SE2_SYMMETRIC
    limit = "weakening = 0"
    cost = "a search among the prints near each limb per time step, and no limit cycle"
    walks = True

    def __post_init__(self):
        places = real_array("places", self.places) if self.places else np.zeros(0)
        is_list = places.ndim == 1 and places.size <= MOST_PLACES
        require(
            is_list and bool((np.abs(places) <= 1e3).all()),
            f"places must be at most {MOST_PLACES} numbers in m, each within 1000 m",
            value=self.places,
        )
        object.__setattr__(self, "places", tuple(places.tolist()))
        check_numbers(self)

    def apply(self, ground: Ground) -> Ground:
        # The engines weaken the ground limb by limb.
        return ground

    @property
    def assumes(self) -> str:
        return "the form of the disturbance and its numbers, and level ground"

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, PrintedGround]:
        return {"disturbed-ground": cls(radius=0.02, weakening=x)}


class Limb(NamedTuple):
    """The surface of a limb, in the world.

    places: (n, 2), m, x and y of its elements. depths: (n,), m, negative above the
    surface. areas: (n,), m^2."""

    places: np.ndarray
    depths: np.ndarray
    areas: np.ndarray


class Memory(NamedTuple):
    """What the ground remembers of a walk.

    prints: (N, 2), m, x and y of places that count. visits: for each limb the places
    (n, 2), m, that will. met: sum of the strengths that limbs in the ground have met,
    and count: their number."""

    prints: np.ndarray
    visits: tuple[np.ndarray, ...]
    met: float
    count: int

    @classmethod
    def undisturbed(cls, limbs: int) -> Memory:
        """Return the memory at the start of a walk."""
        nowhere = np.zeros((0, 2))
        return cls(nowhere, (nowhere,) * limbs, 0.0, 0)

    @property
    def mean_strength(self) -> float:
        """Mean strength that limbs in the ground have met, 1 where none was."""
        return self.met / self.count if self.count else 1.0


def meet(
    ground: PrintedGround, memory: Memory, limbs: Sequence[Limb]
) -> tuple[np.ndarray, Memory]:
    """Return the shares (K,) of the force of undisturbed ground that act on limbs, and
    the memory with the places where they are now."""
    spacing = SPACING * ground.radius
    new_prints = []
    visits = []
    for limb, visit in zip(limbs, memory.visits):
        here = limb.places[limb.depths > 0.0]
        has_left = distances(visit, here) > END * ground.radius
        if has_left.any():
            new_prints.append(visit[has_left])
            visit = visit[~has_left]
        if len(here):
            visit = _thinned(np.concatenate([visit, here]), spacing)
        visits.append(visit)
    prints = memory.prints
    if new_prints:
        prints = _thinned(np.concatenate([prints, *new_prints]), spacing)

    shares = np.ones(len(limbs))
    met = memory.met
    count = memory.count
    for k, limb in enumerate(limbs):
        if limb.depths.max() < -ground.radius:
            continue  # far above the ground
        places, weights = _lowest_part(limb)
        disturbed = weights @ disturbance(ground, prints, places)
        shares[k] = 1.0 - ground.weakening * disturbed
        if limb.depths.max() > 0.0:
            met += float(shares[k])
            count += 1
    return shares, Memory(prints, tuple(visits), met, count)


def disturbance(
    ground: PrintedGround, prints: np.ndarray, places: np.ndarray
) -> np.ndarray:
    """Return the disturbance (n,), 0 to 1, at places (n, 2), m, by prints (N, 2), m."""
    nearest = distances(places, prints, END * ground.radius)
    if ground.places:
        across = np.abs(places[:, :1] - np.array(ground.places))
        nearest = np.minimum(nearest, across.min(1))
    return np.clip(END - nearest / ground.radius, 0.0, 1.0)


def distances(
    places: np.ndarray, others: np.ndarray, farthest: float = np.inf
) -> np.ndarray:
    """Return the distance (n,), m, from each of the places (n, 2) to the nearest of
    others (N, 2); inf where it is more than ``farthest``, or there are none."""
    if not len(places):
        return np.zeros(0)
    if np.isfinite(farthest) and len(others):
        low = places.min(0) - farthest
        high = places.max(0) + farthest
        others = others[((others >= low) & (others <= high)).all(1)]
    if not len(others):
        return np.full(len(places), np.inf)
    difference = places[:, None] - others
    return np.sqrt((difference**2).sum(-1).min(1))


def _lowest_part(limb: Limb) -> tuple[np.ndarray, np.ndarray]:
    """Return the places (n, 2), m, of a limb in the ground, and their weights (n,), in
    all 1; the lowest place of a limb above the ground, which is the first to enter."""
    weights = limb.areas * np.maximum(limb.depths, 0.0)
    total = weights.sum()
    if not total > 0.0:
        lowest = int(np.argmax(limb.depths))
        return limb.places[[lowest]], np.ones(1)
    is_in = weights > 0.0
    return limb.places[is_in], weights[is_in] / total


def _thinned(places: np.ndarray, spacing: float) -> np.ndarray:
    """Return the first of the places (n, 2) in each cell of a spacing, m."""
    cells = np.floor(places / spacing).astype(np.int64)
    # One number for each cell: sorting pairs takes ten times as long.
    _, first = np.unique(cells[:, 0] * ROWS + cells[:, 1], return_index=True)
    return places[np.sort(first)]
