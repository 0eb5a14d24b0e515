"""Travelling waves of the joint angles of a chain, and of an inextensible body, which
is the sandfish's gait (paper Sec. III B)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.gaits.fourier import Series
from geomech.mathematics.geometry.gait import GAITS, LARGEST, Gait
from rft.core.checks import Number, in_range, real_array
from rft.core.refusal import Refusal


@GAITS.register
@dataclass(frozen=True)
class Wave(Series):
    """A travelling wave of joint angles alpha_k, k = 1, 2, ... from the tail: alpha_k =
    offset + amplitude cos(t + 2 pi waves k / (joints + 1)).

    It runs from head to tail, which drives the body head first where drag across
    exceeds drag along; with waves < 0, or reverse, from tail to head; with waves = 0
    all joints move alike. In the two modes of a serpenoid chain with the same number of
    waves (`rft.bodies.modes`) it is the circle of that amplitude, run in reverse.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Wave
    >>> Wave(0.4, joints=6).shape(0.0).round(3)  # of a chain of seven links
    array([ 0.249, -0.089, -0.36 , -0.36 , -0.089,  0.249])
    """

    kind = "wave"

    amplitude: Annotated[
        float, Number(-LARGEST, LARGEST, "rad", "amplitude of each joint")
    ] = 0.5
    waves: Annotated[
        float,
        Number(
            -5000.5,
            5000.5,
            "-",
            "number of waves on the body, at most half the number of links",
        ),
    ] = 1.0
    offset: Annotated[
        float,
        Number(
            -LARGEST,
            LARGEST,
            "rad",
            "angle added to all joints, which makes the body turn",
        ),
    ] = 0.0
    joints: Annotated[
        int,
        Number(1, 10_000, "-", "number of joints, one fewer than links", whole=True),
    ] = 6

    def __post_init__(self):
        super().__post_init__()
        half = (self.joints + 1) / 2  # more look like fewer that run the other way
        in_range("waves", self.waves, -half, half)

    @property
    def middle(self) -> np.ndarray:
        return super().middle + self.offset

    @property
    def amplitude_label(self) -> str:
        return "amplitude of the joint angles (rad)"

    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        k = np.arange(1, self.joints + 1)
        phase = 2 * np.pi * self.waves * k / (self.joints + 1)
        return np.cos(phase)[:, None], -np.sin(phase)[:, None]

    def wavelength(self, amplitudes: ArrayLike | None = None) -> np.ndarray:
        """Return lambda over the body's length (...,), for an endless chain of equal
        links without offset.

        It is the arc length of a wave, 1 / waves, times the mean cosine of headings,
        which oscillate as a sine: J_0 of their amplitude."""
        from scipy.special import j0

        links = self.joints + 1
        swing = self._sizes(amplitudes) / (2 * np.sin(np.pi * abs(self.waves) / links))
        return np.abs(j0(swing)) / abs(self.waves)

    def relative_curvature(self, amplitudes: ArrayLike | None = None) -> np.ndarray:
        """Return the mean of |joint angle| over a wave and a link's length, times the
        wave's arc length (...,); without offset."""
        return 2 / np.pi * self._sizes(amplitudes) * (self.joints + 1) / abs(self.waves)

    def _sizes(self, amplitudes) -> np.ndarray:
        """Return |amplitudes| (...,), of the gait itself for None."""
        return np.abs(self._amplitudes(amplitudes))

    @classmethod
    def examples(cls) -> dict[str, Wave]:
        return {"wave": cls(amplitude=0.8, waves=0.6, offset=0.2, joints=2)}


def arc_to_phase(u: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Return the phase p at which a sine of largest slope ``slope`` has covered the
    share u / 2 pi of its length per wave.

    The length up to p is proportional to E(p | m), m = slope^2 / (1 + slope^2), which
    is monotone with a slope D between sqrt(1 - m) and 1. Halley's steps start from u;
    the error after a step is about the cube of its size."""
    from scipy.special import ellipe, ellipeinc

    m = slope**2 / (1 + slope**2)
    length = u / (2 * np.pi) * (4 * ellipe(m))
    shape = np.broadcast_shapes(u.shape, np.shape(slope))
    p = np.array(np.broadcast_to(u, shape), float)
    for _ in range(50):
        sin = np.sin(p)
        D2 = 1 - m * sin * sin
        newton = (ellipeinc(p, m) - length) / np.sqrt(D2)
        halley = newton / (1 + 0.5 * newton * m * sin * np.cos(p) / D2)
        step = np.clip(halley, -0.5, 0.5)
        p -= step
        if np.abs(step).max(initial=0.0) < 1e-6:
            break
    return p


def _arc_length(slope: np.ndarray) -> np.ndarray:
    """Return the arc length of a sine with the largest slope ``slope`` over its
    wavelength."""
    from scipy.special import ellipe

    m = slope**2 / (1 + slope**2)
    return np.sqrt(1 + slope**2) * 4 * ellipe(m) / (2 * np.pi)


@GAITS.register
@dataclass(frozen=True)
class Sine(Gait):
    """A body of ``elements`` that lies along an endless sine and moves along it.

    With t the wave travels from head to tail. Its arc length is fixed, whatever the
    amplitude. The bends are angles between neighbouring elements, so the gait is of
    order 2 in 1/elements. centre (rad): not allowed, because a sine wave has no centre.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Sine
    >>> Sine(0.2, elements=50).shape(0.0).shape  # bends of a backbone of 50 elements
    (49,)
    """

    kind = "sine"

    amplitude: Annotated[
        float,
        Number(
            -10,
            10,
            "-",
            "A / lambda, the amplitude of the sine over its wavelength, 0 to 10",
        ),
    ] = 0.2
    waves: Annotated[
        float,
        Number(
            0,
            500,
            "-",
            "number of wavelengths along the body, > 0 and at most elements / 4",
        ),
    ] = 1.0
    elements: Annotated[
        int,
        Number(3, 2000, "-", "number of elements, the same as in the body", whole=True),
    ] = 100

    def __post_init__(self):
        super().__post_init__()
        if self.centre:
            raise Refusal(
                "a sine wave takes no centre",
                because="the gait undulates about the straight body",
                instead="leave centre out",
            )
        in_range("waves", self.waves, 0, self.elements / 4)
        if not self.waves > 0:
            raise Refusal(
                "waves must be > 0 and at most elements / 4", value=self.waves
            )

    @property
    def joints(self) -> int:
        return self.elements - 1

    def with_elements(self, count: int) -> Sine:
        """Return the gait of a body of ``count`` elements."""
        return replace(self, elements=count)

    @property
    def amplitude_label(self) -> str:
        return r"amplitude over wavelength $A/\lambda$"

    def _slopes(self, amplitudes) -> np.ndarray:
        """Return the largest slopes (...,) of sines with these amplitudes."""
        a = self._amplitudes(amplitudes)
        if not (np.abs(a) <= 10).all():
            raise Refusal(
                f"amplitudes (A / lambda) must lie from -10 to 10, got {a.ravel()[:4]}"
            )
        return 2 * np.pi * a

    def _headings(self, t, amplitudes):
        """Return headings of the elements and their rates of change with the wave's
        phase, (B..., T..., elements)."""
        t = self._direction * real_array("t", t)
        slope = self._slopes(amplitudes)
        slope = slope.reshape(*slope.shape, *[1] * (t.ndim + 1))
        s = (np.arange(self.elements) + 0.5) / self.elements
        p = arc_to_phase(2 * np.pi * self.waves * s + t[..., None], slope)
        rise = slope * np.cos(p)
        p_by_u = _arc_length(slope) / np.sqrt(1 + rise**2)
        return np.arctan(rise), -slope * np.sin(p) / (1 + rise**2) * p_by_u

    def headings(self, t: ArrayLike, amplitudes: ArrayLike | None = None) -> np.ndarray:
        """Return headings of the elements against the wave's axis, (B..., T...,
        elements), rad."""
        return self._headings(t, amplitudes)[0]

    def shape(self, t: ArrayLike, amplitudes: ArrayLike | None = None) -> np.ndarray:
        return np.diff(self._headings(t, amplitudes)[0], axis=-1)

    def rate(self, t: ArrayLike, amplitudes: ArrayLike | None = None) -> np.ndarray:
        return self._shape_and_rate(t, amplitudes)[1]

    def _shape_and_rate(self, t, amplitudes) -> tuple[np.ndarray, np.ndarray]:
        # Headings are computed once for both: they take as long as the balance of
        # forces.
        headings, rates = self._headings(t, amplitudes)
        bends = np.diff(headings, axis=-1)
        return bends, np.diff(rates, axis=-1) * self._direction

    def largest(self, amplitudes: ArrayLike | None = None) -> float:
        """Return an upper bound of the joint angles, rad: headings stay between -pi/2
        and pi/2."""
        return np.pi

    def unit(self, t: ArrayLike) -> np.ndarray:
        return self.shape(t)

    def unit_rate(self, t: ArrayLike) -> np.ndarray:
        return self.rate(t)

    def wavelength(self, amplitudes: ArrayLike | None = None) -> np.ndarray:
        """Return lambda over the body's length (...,): 1 / waves is the arc length of a
        wave."""
        return 1 / (self.waves * _arc_length(self._slopes(amplitudes)))

    def relative_curvature(self, amplitudes: ArrayLike | None = None) -> np.ndarray:
        """Return the mean of |curvature| over a wave, times the wave's arc length
        (...,): 4 atan(2 pi A / lambda)."""
        return 4 * np.arctan(np.abs(self._slopes(amplitudes)))

    @classmethod
    def examples(cls) -> dict[str, Sine]:
        return {}  # of as many joints as elements, of which there are many
