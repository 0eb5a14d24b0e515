"""A gait of sysplotter, by the numbers of a `shchf_` file: six coefficients, or a
MATLAB file of points or coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from geomech.io import shchf
from geomech.mathematics.gaits.fourier import Fourier
from geomech.mathematics.geometry.gait import GAITS, Gait, Scale, finite_array
from rft.core.checks import Number, unmasked
from rft.core.refusal import Refusal


@GAITS.register
@dataclass(frozen=True, kw_only=True)
class Shchf(Gait):
    """The gait of a shchf file of sysplotter, in numbers.

    XV (rad): coefficients a1, b1, a3, b3, a5, b5 ... as in the `shchf_LowRe_...` files,
    for the closed curve u = sum of a_k cos(k t), v = - sum of b_k sin(k t), alpha_1 =
    (u - v)/sqrt 2, alpha_2 = (u + v)/sqrt 2, in the same direction as there. file (-):
    name of a .mat file of points alpha1, alpha2, ... at t, of coefficients A1, B1, A2,
    B2, ..., or of the paths that sys_calcpath computed, relative to the folder of the
    scene file, or to the current folder if there is none. sha256 (-): checksum that the
    file must have; filled in if left out. centre (rad): shape angles; if left empty,
    the mean of the coefficients.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Shchf
    >>> Shchf(XV=(1.4, 1.2)).shape(0.0).round(3)  # rad
    array([0.99, 0.99])
    """

    kind = "shchf"
    _curve: ClassVar[Any]  # a Fourier series, or a spline through points

    XV: tuple[float, ...] = ()
    file: str | None = None
    number: Annotated[
        int,
        Number(
            1,
            10_000,
            "-",
            "number of the gait, where the file contains several",
            whole=True,
        ),
    ] = 1
    amplitude: Scale = 1.0
    sha256: str = ""

    def __post_init__(self):
        if not isinstance(self.file, (str, Path, type(None))):
            raise Refusal("file must be the name of a .mat file", value=self.file)
        if not isinstance(self.sha256, str):
            raise Refusal("sha256 must be text", value=self.sha256)
        if isinstance(self.XV, str) or not hasattr(self.XV, "__len__"):
            raise Refusal("XV must be numbers", value=self.XV)
        if (self.file is None) == (not len(self.XV)):
            raise Refusal(
                "a shchf gait takes either XV or a file", instead=("give one of them")
            )
        if self.sha256 and self.file is None:
            raise Refusal("sha256 belongs to a file", instead="leave it out")
        object.__setattr__(self, "file", self.file and str(self.file))
        if self.file:
            curve = self._read_file()
        else:
            curve = self._series()
        object.__setattr__(self, "_curve", curve)
        super().__post_init__()

    def _series(self) -> Fourier:
        """Return the curve of the coefficients."""
        values = finite_array("XV", self.XV, 1)
        if values.size % 2:
            raise Refusal("XV must be pairs a1, b1, a3, b3 ...", value=self.XV)
        object.__setattr__(self, "XV", tuple(values.tolist()))
        coefficients = np.zeros((2, values.size - 1))  # the even harmonics are 0
        coefficients[:, ::2] = values.reshape(-1, 2).T / np.sqrt(2)
        a, b = (tuple(row) for row in coefficients.tolist())
        minus_b = tuple((-coefficients[1]).tolist())
        return Fourier(cos=(a, a), sin=(b, minus_b))

    def _read_file(self) -> Any:
        """Return the curve in the file: a spline through points, or a Fourier
        series."""
        from scipy.interpolate import CubicSpline

        curve: Any = shchf.read(self.file or "", self.number)
        if self.sha256.lower() not in ("", curve.sha256):
            raise Refusal(
                f"the content of {self.file} does not match sha256",
                instead="restore the file, or leave sha256 out",
            )
        object.__setattr__(self, "sha256", curve.sha256)
        if curve.points is not None:
            return CubicSpline(curve.phase, curve.points, bc_type="periodic")
        if not len(self.centre):
            object.__setattr__(self, "centre", tuple(curve.cos[:, 0].tolist()))
        return Fourier(cos=curve.cos[:, 1:], sin=curve.sin[:, 1:])

    @property
    def joints(self) -> int:
        if isinstance(self._curve, Fourier):
            return self._curve.joints
        return self._curve.c.shape[-1]

    @property
    def harmonics(self) -> int:  # type: ignore[override]  # a number of most classes
        """The highest harmonic of the series; 1 for a spline, which has no highest."""
        if isinstance(self._curve, Fourier):
            return self._curve.harmonics
        return 1

    def unit(self, t: ArrayLike) -> np.ndarray:
        if isinstance(self._curve, Fourier):
            return self._curve.unit(t)
        return self._curve(unmasked("t", t))

    def unit_rate(self, t: ArrayLike) -> np.ndarray:
        if isinstance(self._curve, Fourier):
            return self._curve.unit_rate(t)
        return self._curve(unmasked("t", t), 1)

    @classmethod
    def examples(cls) -> dict[str, Shchf]:
        return {"shchf": cls(XV=(1.4, 1.2, 0.1, 0.09, -0.03, -0.04), amplitude=0.7)}
