"""The loop that a body with springs really makes in shape space, as a gait: so that
tiers which integrate a connection integrate it along that loop and not along the
command."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import irfft, rfft

from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.periods import winding
from geomech.mathematics.systems.base import Cycle, System
from geomech.mathematics.systems.capabilities import Compliant, capability
from rft.motion.compliance import SpringMotion

SAME_SHAPE = 1e-3  # rad, largest difference of two cycles that count as one


@dataclass(frozen=True, eq=False)
class RealisedGait:
    """The limit cycle of the shape of a system whose joints give way, under a command.

    Attributes
    ----------
    system : with springs.
    command : the gait that drives them.
    phases : number at which the cycle is run.

    It has the members of a `Gait` that tiers read. Between the phases at which the
    cycle was run, shapes follow by trigonometric interpolation."""

    system: System
    command: Gait
    phases: int
    _known: dict = field(default_factory=dict, repr=False)

    @property
    def joints(self) -> int:
        return self.command.joints

    @property
    def amplitude(self) -> float:
        return self.command.amplitude

    @property
    def harmonics(self) -> int:
        return self.command.harmonics

    @property
    def middle(self) -> np.ndarray:
        """Shape (joints,) about which the command moves."""
        return self.command.middle

    @property
    def frequency(self) -> float | None:
        return getattr(self.command, "frequency", None)

    @property
    def amplitude_label(self) -> str:
        return self.command.amplitude_label

    def motion(self, amplitudes: ArrayLike | None = None) -> SpringMotion:
        """Return the `rft.motion.compliance.SpringMotion` (..., phases) of the limit
        cycle; RuntimeError if there is none."""
        key = None if amplitudes is None else np.asarray(amplitudes, float).tobytes()
        if key not in self._known:
            cycle = self.command.cycle(self.phases, amplitudes)
            self._known[key] = self.system.run(*cycle).springs
        return self._known[key]

    def cycle(
        self, phases: int, amplitudes: ArrayLike | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (..., phases, joints) at equally spaced phases from
        0, rad and rad per radian of phase."""
        motion = self.motion(amplitudes)
        if phases == self.phases:
            return motion.alpha, motion.alphadot
        alphadot = _resampled(motion.alphadot, phases)
        turns = np.array(winding(self.command, self.system.traits.periods))
        if not turns.size:
            return _resampled(motion.alpha, phases), alphadot
        # Only what returns is a Fourier series.
        lengths = [period or 0.0 for period in self.system.traits.periods]
        advance = turns * np.array(lengths)
        share = np.arange(self.phases)[:, None] / self.phases
        returning = _resampled(motion.alpha - share * advance, phases)
        return returning + np.arange(phases)[:, None] / phases * advance, alphadot


class LimitCycles(NamedTuple):
    """Cycles that a body with springs settles into from several starts.

    nets: (K, 3), displacement in each of the different ones, that from the command's
    shape first. unsettled: number of starts from which no cycle was reached."""

    nets: np.ndarray
    unsettled: int


def limit_cycles(system: System, gait: Gait, phases: int) -> LimitCycles:
    """Return the different limit cycles that are reached from the command's shape, its
    mirror image, its shape half a cycle later, and the straight shape.

    Raises RuntimeError if the start at the command's shape reaches none."""
    alpha, alphadot = gait.cycle(phases)
    command = alpha[-1]
    later = alpha[phases // 2 - 1]
    starts = np.stack([command, -command, later, 0.0 * command])
    size = len(starts)
    steps = capability(system, Compliant).time_steps(
        np.repeat(alpha[None], size, 0),
        np.repeat(alphadot[None], size, 0),
        None,
        start=starts,
    )
    settled = steps.status == "periodic"
    if not settled[0]:
        steps.checked()
    nets = steps.displacement
    shapes = steps.springs.alpha
    different = [0]
    for k in np.flatnonzero(settled):
        distances = [np.abs(shapes[k] - shapes[j]).max() for j in different]
        if min(distances) > SAME_SHAPE:
            different.append(int(k))
    return LimitCycles(nets[different], int(np.count_nonzero(~settled)))


def _resampled(values: np.ndarray, count: int) -> np.ndarray:
    """Return periodic values (..., N, d) at ``count`` phases in place of N."""
    spectrum = rfft(values, axis=-2)
    highest = min(spectrum.shape[-2], count // 2 + 1)
    factor = count / values.shape[-2]
    return irfft(spectrum[..., :highest, :], count, axis=-2) * factor


def commanded(system: System, alpha: np.ndarray) -> np.ndarray:
    """Return the shapes (..., d) of a gait with the angles of passive joints, which no
    actuator moves, at rest."""
    if not is_compliant(system):
        return alpha
    return capability(system, Compliant).commanded(alpha)


def true_shape(
    run: Cycle, alpha: np.ndarray, alphadot: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the shape and its rate (..., N, d) in a run of a gait: those of the gait
    unless joints give way."""
    if run.springs is None:
        return alpha, alphadot
    return run.springs.alpha, run.springs.alphadot


def is_compliant(system: System) -> bool:
    """Return whether joints of a system give way."""
    return capability(system, Compliant) is not None


def realised(system: System, gait: Gait, phases: int) -> Gait | RealisedGait:
    """Return the loop that a system really makes under a gait; the gait itself where it
    prescribes the shape."""
    if not is_compliant(system):
        return gait
    return RealisedGait(system, gait, phases)
