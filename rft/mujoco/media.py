"""Media for sand in MuJoCo: by name, drawn within their uncertainty, and one for each
simulation of a batch."""

from __future__ import annotations

import copy
import difflib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from rft.core.checks import in_range
from rft.core.refusal import Refusal, formatted, require
from rft.fits.plates import StressFit, ZetaFit
from rft.laws import CATALOGUE
from rft.mujoco import installed
from rft.mujoco.bed import Bed
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.plates import VERTICAL, PlateStress, StressMap
from rft.terradynamics.plates.stress import COEFFICIENTS

# Times n: draws of maps, of which those that do not bear a plate pushed straight down
# are drawn again.
MAX_DRAWS = 100


def law_of(medium: object) -> Extruded | Spatial:
    """Return the law of three dimensions of a medium; Refusal for one without a
    vertical law."""
    if isinstance(medium, str):
        _require_vertical(medium)
        return Extruded(VERTICAL[medium].stress)
    if isinstance(medium, Spatial | Extruded):
        return medium
    if isinstance(medium, PlateStress):
        return Extruded(medium)  # refuses all but nine coefficients
    raise Refusal(
        "the medium has no vertical law in three dimensions",
        value=medium,
        instead="use a name from rft.terradynamics.plates.VERTICAL, a StressMap or a "
        "Spatial",
    )


def _require_vertical(name: str) -> None:
    """Raise Refusal for a name that is not in `VERTICAL`."""
    if name in VERTICAL:
        return
    choices = f"use one of {', '.join(VERTICAL)}"
    if name in CATALOGUE:
        raise Refusal(f"{name} has no vertical law", instead=choices)
    near = difflib.get_close_matches(name, VERTICAL, 1, 0.5)
    if near:
        choices = f"did you mean {near[0]}?"
    raise Refusal(f"there is no medium {formatted(name)}", instead=choices)


def sample(
    medium: str | StressMap | Spatial | StressFit | ZetaFit,
    n: int,
    seed: int = 0,
    spread: float | None = None,
) -> list[StressMap | Spatial]:
    """Return n media within the uncertainty of one, the same for the same seed.

    medium: a fit of `rft.fits.plates`, whose coefficients are drawn from its
    covariance, or whose strength from its error; or any other medium, the logarithm of
    whose strength then has the standard deviation ``spread``. A drawn map that does not
    bear a plate pushed straight down is drawn again."""
    in_range("n", n, 1, 1_000_000, whole=True)
    n = int(n)
    rng = np.random.default_rng(seed)
    if isinstance(medium, StressFit):
        require(
            spread is None, "a fit has its own covariance", instead="remove ``spread``"
        )

        def draw(count: int) -> np.ndarray:
            return rng.multivariate_normal(medium.values, medium.covariance, count)

        return _draw_maps(draw, n)

    if isinstance(medium, ZetaFit):
        require(spread is None, "a fit has its own error", instead="remove ``spread``")
        spread = medium.error / medium.zeta
        medium = StressMap(zeta=medium.zeta)
    if isinstance(medium, str) and medium in VERTICAL:
        medium = VERTICAL[medium].stress
    require(
        isinstance(medium, StressMap | Spatial),
        "the medium has no strength that could vary",
        value=medium,
    )
    require(
        spread is not None,
        "the uncertainty of the medium is unknown",
        instead="give ``spread``, the standard deviation of the logarithm of the "
        "strength, or a fit with its covariance",
    )
    in_range("spread", spread, 0, 2)
    strength = "zeta" if isinstance(medium, StressMap) else "xi_n"
    value = getattr(medium, strength)
    factors = np.exp(spread * rng.standard_normal(n))
    return [replace(medium, **{strength: value * float(factor)}) for factor in factors]


def _draw_maps(draw: Callable[[int], np.ndarray], n: int) -> list[StressMap]:
    """Return n maps that bear a plate pushed straight down. draw: function of a count,
    returns coefficients (count, 9)."""
    maps: list[StressMap] = []
    for _ in range(MAX_DRAWS):
        for row in draw(n).tolist():
            drawn = StressMap(**dict(zip(COEFFICIENTS, row)))
            if drawn.alpha((0.0, -1.0), (0.0, -1.0))[1] > 0.0:
                maps.append(drawn)
        if len(maps) >= n:
            return maps[:n]
    raise Refusal(
        "hardly any sampled map supports a plate",
        because="the covariance is larger than the coefficients",
    )


class Media(Sequence):
    """Media of the simulations of a batch, one each; ``media[i] = medium`` changes one
    between steps.

    Where the ground has regions, each is a tuple of the medium and those of the
    regions, in order; a single medium that is set is the one beyond the regions.
    models: those of the simulations, copies of one model, with a bed of sand each."""

    def __init__(self, model: mujoco.MjModel, bed: Bed, media: Sequence[Any]):
        self._beds = [with_medium(bed, medium) for medium in media]
        require_one_form(tuple(one.laws[0] for one in self._beds), "in one batch")
        self.models = [copy.copy(model) for _ in media]
        self._rows = [
            installed.install(own, bed) for own, bed in zip(self.models, self._beds)
        ]

    def __len__(self) -> int:
        return len(self.models)

    def __getitem__(self, i: Any) -> Any:
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        laws = self._beds[i].laws
        *regions, medium = [
            law.stress if isinstance(law, Extruded) else law for law in laws
        ]
        return (medium, *regions) if regions else medium

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))

    def __setitem__(self, i: int, medium: Any) -> None:
        require(
            isinstance(i, int) and -len(self) <= i < len(self),
            f"there is no simulation {formatted(i)}",
        )
        bed = with_medium(self._beds[i], medium)
        require(
            type(bed.laws[0]) is type(self._beds[i].laws[0]),
            "all media of a batch must have the same form",
            instead="create another batch",
        )
        self._beds[i] = bed
        installed.replace_bed(self._rows[i], bed)

    def detach(self) -> None:
        """Take the beds away."""
        for row, bed in zip(self._rows, self._beds):
            installed.remove(row, bed)


def with_medium(bed: Bed, medium: Any) -> Bed:
    """Return a bed of another medium, or of a list of the medium and those of all
    regions."""
    if isinstance(medium, tuple | list):
        count = len(bed.laws)
        require(
            len(medium) == count,
            f"media of a simulation must be {count}, the medium and one for each"
            " region",
        )
        base, *regions = map(law_of, medium)
    else:
        base = law_of(medium)
        regions = bed.laws[:-1]
    laws = (*regions, base)
    require_one_form(laws)
    return replace(bed, laws=laws)


def require_one_form(
    laws: tuple[Extruded | Spatial, ...], owner: str = "of all regions"
) -> None:
    """Raise Refusal unless all laws are stress maps or all are laws of three
    dimensions."""
    require(
        len({type(law) for law in laws}) == 1,
        f"media {owner} must have the same form",
        instead="use only stress maps, or only laws",
    )
