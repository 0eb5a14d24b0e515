"""Gaits that are finite Fourier series, among them the circle, the ellipse and the
butterfly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.gait import GAITS, LARGEST, Gait, Scale, finite_array
from rft.core.checks import Number, unmasked
from rft.core.refusal import Refusal


@dataclass(frozen=True, kw_only=True)
class Series(Gait):
    """A finite Fourier series: unit_j(t) = sum_k cos_jk cos(k t) + sin_jk sin(k t), k =
    1, 2 ...; subclasses define `coefficients`."""

    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the coefficients (cos, sin), each (joints, K)."""
        raise TypeError(f"{type(self).__name__} has no coefficients")

    @property
    def joints(self) -> int:
        return self.coefficients()[0].shape[0]

    @property
    def harmonics(self) -> int:  # type: ignore[override]  # a number of most classes
        """The highest harmonic of the series."""
        return self.coefficients()[0].shape[1]

    def unit(self, t: ArrayLike) -> np.ndarray:
        cos, sin = self.coefficients()
        kt = unmasked("t", t)[..., None] * np.arange(1, cos.shape[1] + 1)
        return np.cos(kt) @ cos.T + np.sin(kt) @ sin.T

    def unit_rate(self, t: ArrayLike) -> np.ndarray:
        cos, sin = self.coefficients()
        k = np.arange(1, cos.shape[1] + 1)
        kt = unmasked("t", t)[..., None] * k
        return np.cos(kt) @ (k * sin).T - np.sin(kt) @ (k * cos).T


@GAITS.register
@dataclass(frozen=True)
class Circle(Series):
    """alpha = centre + amplitude (cos t, sin t): counter-clockwise.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Circle
    >>> gait = Circle(0.5, centre=(0.2, 0.0))
    >>> gait.shape(0.0)  # rad, at phase 0
    array([0.7, 0. ])
    >>> alpha, alphadot = gait.cycle(64)  # at 64 phases
    >>> alpha.shape
    (64, 2)
    """

    amplitude: Annotated[
        float, Number(-LARGEST, LARGEST, "rad", "radius of the circle")
    ] = 1.0

    kind = "circle"

    @property
    def amplitude_label(self) -> str:
        return "radius of the circle (rad)"

    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])

    @classmethod
    def examples(cls) -> dict[str, Circle]:
        return {"circle": cls(amplitude=0.9, centre=(0.2, -0.1))}


@GAITS.register
@dataclass(frozen=True)
class Ellipse(Series):
    """An ellipse, run counter-clockwise about its centre.

    semi_axes (rad): semi-axes at amplitude 1.

    Examples
    --------
    >>> import math
    >>> from geomech.mathematics.gaits import Ellipse
    >>> Ellipse(semi_axes=(1.0, 0.5), tilt=math.pi / 4).shape(0.0).round(3)
    array([0.707, 0.707])
    """

    kind = "ellipse"

    semi_axes: tuple[float, float] = (1.0, 0.5)
    tilt: Annotated[
        float,
        Number(
            -LARGEST,
            LARGEST,
            "rad",
            "angle by which the first semi-axis is rotated counter-clockwise from "
            "alpha_1",
        ),
    ] = 0.0

    def __post_init__(self):
        axes = finite_array("semi_axes", self.semi_axes, 1)
        if axes.size != 2:
            raise Refusal("an ellipse needs two semi_axes", value=self.semi_axes)
        object.__setattr__(self, "semi_axes", tuple(axes.tolist()))
        super().__post_init__()

    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        a, b = self.semi_axes
        c = math.cos(self.tilt)
        s = math.sin(self.tilt)
        return np.array([[a * c], [a * s]]), np.array([[-b * s], [b * c]])

    @classmethod
    def examples(cls) -> dict[str, Ellipse]:
        return {"ellipse": cls(semi_axes=(1.0, 0.4), tilt=0.7)}


@GAITS.register
@dataclass(frozen=True)
class Butterfly(Series):
    """The butterfly of Fig. 11(e), as distributed with sysplotter
    (OSU-LRAM/GeometricSystemPlotter). At amplitude 1:

        (alpha_1 + alpha_2)/2 = 1.0908 cos t - 0.2508 cos 3t - 0.18 cos 5t
        (alpha_1 - alpha_2)/2 = 1.052 sin t + 0.0859 sin 3t

    Examples
    --------
    >>> from geomech.mathematics.gaits import Butterfly
    >>> Butterfly(1.2).shape(0.0).round(3)
    array([0.792, 0.792])
    """

    kind = "butterfly"

    amplitude: Scale = 1.0

    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        sum_cos = np.array([1.0908, 0.0, -0.2508, 0.0, -0.18])
        difference_sin = np.array([1.052, 0.0, 0.0859, 0.0, 0.0])
        return np.array([sum_cos, sum_cos]), np.array([difference_sin, -difference_sin])

    @classmethod
    def examples(cls) -> dict[str, Butterfly]:
        return {"butterfly": cls(amplitude=0.8), "backwards": cls(reverse=True)}


@GAITS.register
@dataclass(frozen=True)
class Fourier(Series):
    """A custom Fourier series.

    cos, sin (rad): coefficients, a row for each joint, harmonics 1, 2 ... along the
    row.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Fourier
    >>> circle = Fourier(cos=((0.5,), (0.0,)), sin=((0.0,), (0.5,)))  # of 0.5 rad
    >>> circle.joints, circle.shape(0.0).tolist()
    (2, [0.5, 0.0])
    """

    kind = "fourier"

    cos: tuple[tuple[float, ...], ...]
    sin: tuple[tuple[float, ...], ...]

    def __post_init__(self):
        cos = finite_array("cos", self.cos, 2)
        sin = finite_array("sin", self.sin, 2)
        if cos.shape != sin.shape:
            raise Refusal(
                "cos and sin must have the same shape (joints, harmonics), got "
                f"{cos.shape} and {sin.shape}"
            )
        for name, x in (("cos", cos), ("sin", sin)):
            object.__setattr__(self, name, tuple(map(tuple, x.tolist())))
        super().__post_init__()

    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.cos), np.array(self.sin)

    @classmethod
    def examples(cls) -> dict[str, Fourier]:
        return {
            "fourier": cls(cos=((0.5, 0.1), (0.0, 0.2)), sin=((0.0, 0.3), (0.6, 0.0)))
        }
