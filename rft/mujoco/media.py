"""Media for sand in MuJoCo: by name, drawn within their uncertainty, and one for each simulation of a batch."""

from __future__ import annotations

import copy
import difflib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from rft.checks import in_range
from rft.laws import CATALOGUE
from rft.meshes.extruded import Extruded
from rft.meshes.law import Spatial
from rft.mujoco import installed
from rft.mujoco.bed import Bed
from rft.plates import VERTICAL, PlateStress, StressMap
from rft.plates.calibrate import StressFit, ZetaFit
from rft.plates.stress import COEFFICIENTS
from rft.refusal import Refusal, formatted, require

MOST_DRAWS = 100  # times n; draws that do not bear a plate pushed straight down are drawn again


def law_of(medium: object) -> Extruded | Spatial:
    """Return the law of three dimensions of a medium; Refusal for one without a vertical law."""
    if isinstance(medium, str):
        if medium in CATALOGUE and medium not in VERTICAL:
            raise Refusal(f"{medium} has no vertical law", instead=f"take one of {', '.join(VERTICAL)}")
        near = difflib.get_close_matches(medium, VERTICAL, 1, 0.5)
        cure = f"did you mean {near[0]}?" if near else f"take one of {', '.join(VERTICAL)}"
        require(medium in VERTICAL, f"there is no medium {formatted(medium)}", instead=cure)
        return Extruded(VERTICAL[medium].stress)
    if isinstance(medium, Spatial | Extruded):
        return medium
    if isinstance(medium, PlateStress):
        return Extruded(medium)  # refuses all but nine coefficients
    cure = "give a name of rft.plates.VERTICAL, a StressMap or a Spatial"
    raise Refusal("the medium has no vertical law in three dimensions", value=medium, instead=cure)


def sample(
    medium: str | StressMap | Spatial | StressFit | ZetaFit, n: int, seed: int = 0, spread: float | None = None
) -> list[StressMap | Spatial]:
    """Return n media within the uncertainty of one, the same for the same seed.

    medium: a fit of `rft.plates.calibrate`, whose coefficients are drawn from its covariance, or whose strength from its
    error; or any other medium, the logarithm of whose strength then has the standard deviation ``spread``. A drawn map that
    does not bear a plate pushed straight down is drawn again."""
    in_range("n", n, 1, 1_000_000, whole=True)
    rng = np.random.default_rng(seed)
    if isinstance(medium, StressFit):
        require(spread is None, "a fit has its own covariance", instead="drop ``spread``")
        return _maps(lambda count: rng.multivariate_normal(medium.values, medium.covariance, count), n)
    if isinstance(medium, ZetaFit):
        require(spread is None, "a fit has its own error", instead="drop ``spread``")
        medium, spread = StressMap(zeta=medium.zeta), medium.error / medium.zeta
    medium = VERTICAL[medium].stress if isinstance(medium, str) and medium in VERTICAL else medium
    require(isinstance(medium, StressMap | Spatial), "the medium has no strength to draw", value=medium)
    cure = "give ``spread``, the standard deviation of the logarithm of its strength, or a fit with its covariance"
    require(spread is not None, "the uncertainty of the medium is unknown", instead=cure)
    in_range("spread", spread, 0, 2)
    strength = "zeta" if isinstance(medium, StressMap) else "xi_n"
    factors = np.exp(spread * rng.standard_normal(int(n)))
    return [replace(medium, **{strength: getattr(medium, strength) * float(factor)}) for factor in factors]


def _maps(draw: Callable[[int], np.ndarray], n: int) -> list[StressMap]:
    """Return n maps of drawn coefficients (count, 9) that bear a plate pushed straight down."""
    maps: list[StressMap] = []
    for _ in range(MOST_DRAWS):
        drawn = [StressMap(**dict(zip(COEFFICIENTS, map(float, row)))) for row in draw(int(n))]
        maps += [one for one in drawn if one.alpha((0.0, -1.0), (0.0, -1.0))[1] > 0.0]
        if len(maps) >= n:
            return maps[: int(n)]
    raise Refusal("hardly any drawn map bears a plate", because="the covariance is larger than the coefficients")


class Media(Sequence):
    """Media of the simulations of a batch, one each; ``media[i] = medium`` changes one between steps.

    models: those of the simulations, copies of one model, with a bed of sand each."""

    def __init__(self, model: mujoco.MjModel, bed: Bed, laws: Sequence[Extruded | Spatial]):
        kinds = {type(law) for law in laws}
        require(len(kinds) == 1, "media of one batch must have one form", instead="give stress maps, or laws, alone")
        self.models = [copy.copy(model) for _ in laws]
        self._beds = [_with_law(bed, law) for law in laws]
        self._rows = [installed.install(*pair) for pair in zip(self.models, self._beds)]

    def __len__(self) -> int:
        return len(self.models)

    def __getitem__(self, i: Any) -> Any:
        laws = [bed.law for bed in self._beds][i]
        return laws if isinstance(laws, list) else laws.stress if isinstance(laws, Extruded) else laws

    def __iter__(self) -> Iterator[StressMap | Spatial]:
        return (self[i] for i in range(len(self)))

    def __setitem__(self, i: int, medium: Any) -> None:
        law = law_of(medium)
        require(isinstance(i, int) and -len(self) <= i < len(self), f"there is no simulation {formatted(i)}")
        same = type(law) is type(self._beds[i].law)
        require(same, "media of one batch must have one form", instead="make another batch")
        self._beds[i] = _with_law(self._beds[i], law)
        installed.change(self._rows[i], self._beds[i])

    def detach(self) -> None:
        """Take the beds away."""
        for row in self._rows:
            installed.remove(row)


def _with_law(bed: Bed, law: Extruded | Spatial) -> Bed:
    """Return a bed of another medium."""
    return replace(bed, law=law, ground=bed.ground._replace(grazing_sine=law.grazing_sine))
