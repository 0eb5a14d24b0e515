"""Time stepping through a gait, cycle after cycle, for swimmers whose motion depends on
place, past or mass, or whose joints give way.

Without memory, slope, mass and springs the result is that of `rft.body_velocity` at
every phase, and with them it converges to that as they go to zero. Time stepping starts
from that result on undisturbed ground, and repeats the gait until the displacement per
cycle no longer changes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rft.balance.backend import check
from rft.balance.solver import Accuracy
from rft.balance.velocity import checked_input
from rft.bodies.base import Body, body_size, half_lengths
from rft.bodies.pieces import PIECES
from rft.core.checks import in_range, real_array
from rft.core.premise import Premise
from rft.core.refusal import Refusal, require
from rft.effects.base import Effect, broken_premises
from rft.effects.contact import assemble
from rft.laws.base import Medium
from rft.motion import limit_cycle
from rft.motion.compliance import CompliantStepping, SpringMotion, with_springs
from rft.motion.stepping import Row, State, Stepping, relative_pose, runs_away
from rft.motion.work import Work

MOST_CYCLES = 60
# of the change from cycle to cycle, below which displacements count as repeated
REPEATED = 0.01
PLAIN_CYCLES = 12  # before the memory of a body without mass is led to its limit


class SlidesDown(Refusal):
    """A body on a slope whose weight no slow motion balances."""


class TimeSteps(NamedTuple):
    """The last cycle of time stepping at N phases.

    xi: (..., N, 3), body velocity in the body frame, length/rad, length/rad, 1. pose:
    (..., N + 1, 3), of the body frame on the ground, whose origin and x axis are those
    of the frame at the first step. residual: (...), the largest, as in `rft.Solution`.
    status: (...), "periodic", "running" (the requested number of cycles, not yet
    periodic), "not periodic", "slides" (on a slope, at some phase no slow motion
    balances the weight) or "unconverged". drift: (...), largest component of the
    sum of all changes of displacement, body lengths and rad, in cycles to come. cycles:
    their number. work: (..., N) each, or None. path: (..., cycles N + 1, 3), all poses
    since the first step, or None. springs: `rft.motion.compliance.SpringMotion` of
    joints that give way, whose shape is not the command's, or None.

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Chain, Granular, time_steps
    >>> from rft.effects import Transient
    >>> t = 2 * np.pi * np.arange(32) / 32
    >>> alpha = np.stack([np.cos(t), np.sin(t)], -1)
    >>> alphadot = np.stack([-np.sin(t), np.cos(t)], -1)
    >>> motion = Granular(1.8, 0.24), Chain(), alpha, alphadot
    >>> steps = time_steps(*motion, effects=[Transient(travel=0.12)])
    >>> steps.xi.shape, steps.pose.shape, steps.cycles > 1
    ((32, 3), (33, 3), True)
    """

    xi: np.ndarray
    pose: np.ndarray
    residual: np.ndarray
    status: np.ndarray
    drift: np.ndarray
    cycles: int
    work: Work | None
    path: np.ndarray | None = None
    springs: Any = None

    def __repr__(self) -> str:
        kinds = ", ".join(
            f"{n} {kind}"
            for kind, n in zip(*np.unique(self.status, return_counts=True))
        )
        count = np.size(self.status)
        gaits = "1 gait" if count == 1 else f"{count} gaits"
        residual = np.max(self.residual, initial=0.0)
        return (
            f"TimeSteps({gaits} of {np.shape(self.xi)[-2]} phases, {self.cycles} "
            f"cycles: {kinds}; residual up to {residual:.1e})"
        )

    @property
    def displacement(self) -> np.ndarray:
        """Pose after the cycle in the frame at its start, (..., 3)."""
        start = np.moveaxis(self.pose[..., 0, :], -1, 0)
        end = np.moveaxis(self.pose[..., -1, :], -1, 0)
        return np.moveaxis(relative_pose(start, end), 0, -1)

    def checked(self) -> TimeSteps:
        """Return these steps; `SlidesDown` if a body slides down a slope, RuntimeError
        if any sample is unconverged or not periodic."""
        if (self.status == "slides").any():
            raise SlidesDown(
                "the body slides down the slope",
                because="at some phase no slow motion balances its weight",
                instead="lower the angle or the weight, or let more of the body touch",
            )
        if (self.status == "unconverged").any():
            raise RuntimeError(
                "a force balance did not converge in time stepping (residual "
                f"{np.max(self.residual):.1e}): "
                "raise 'regularisation', or report the scene"
            )
        for period in (2, 3):
            if (self.status == f"period {period}").any():
                raise RuntimeError(
                    f"the shape repeats every {period} cycles and not each one, with "
                    f"displacements that differ by {np.max(self.drift):.1e} body "
                    "lengths: give 'cycles' to compute some, or change the springs"
                )
        if (self.status == "not periodic").any():
            raise RuntimeError(
                f"after {self.cycles} cycles the displacement still differs by "
                f"{np.max(self.drift):.1e} body lengths from its limit: give 'cycles' "
                "to accept it, or lower the mass, the ground's weakening or the "
                "travel of a transient"
            )
        return self


def time_steps(
    medium: Medium,
    body: Body,
    alpha: ArrayLike,
    alphadot: ArrayLike,
    *,
    effects: Sequence[Effect] = (),
    cycles: int | None = None,
    loads: str = "exact",
    regularisation: float = 1e-6,
    tolerance: float = 1e-10,
    pieces: int = PIECES,
    with_work: bool = False,
    with_path: bool = False,
    backend: str = "auto",
    advance: Callable | None = None,
    start: ArrayLike | None = None,
) -> TimeSteps:
    """Return body velocities through a gait, of order 2 in 1/N.

    Parameters
    ----------
    alpha, alphadot : arrays (..., N, joints), one cycle at N >= 8 equally spaced
        phases, rad and per rad of phase.
    effects : effects of `rft.effects` of any engine.
    cycles : number of cycles; by default as many as it takes to reach the limit cycle,
        and one where effects break symmetry, since no two cycles are alike there.
    with_work, with_path : whether to compute `TimeSteps.work` and `TimeSteps.path`.
    advance : function that takes the steps of a cycle, by default `take_steps`; another
        function may store states and resume from them.
    start : array (..., joints), shape one step before the first phase of a body whose
        joints give way (`rft.effects.Springs`); by default that of the gait.

    Other parameters as in `rft.body_velocity`.

    Raises
    ------
    ValueError
        For arguments of another shape or out of bounds, and for a medium that pushes.

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Chain, Granular, time_steps
    >>> from rft.effects import Transient
    >>> t = 2 * np.pi * np.arange(32) / 32
    >>> alpha = np.stack([np.cos(t), np.sin(t)], -1)
    >>> alphadot = np.stack([-np.sin(t), np.cos(t)], -1)
    >>> motion = Granular(1.8, 0.24), Chain(), alpha, alphadot
    >>> steps = time_steps(*motion, effects=[Transient(travel=0.12)])
    >>> steps.pose[-1, :2].round(3)  # x, y after the cycle, body lengths
    array([-0.245, -0.033])
    """
    broken = broken_premises(effects)
    assembly = assemble(medium, body, effects, loads, pieces)
    alpha, alphadot = checked_input(body, alpha, alphadot, regularisation, tolerance)
    check(backend)
    require(
        alpha.ndim >= 2 and alpha.shape[-2] >= 8,
        f"time stepping needs 8 phases or more, got alpha {alpha.shape}",
    )
    if cycles is not None:
        in_range("cycles", cycles, 1, 10_000, whole=True)
    *batch, phases, joints = alpha.shape
    batch = tuple(batch)
    if 0 in batch:
        return _no_steps(batch, phases)
    if cycles is None and broken & Premise.SE2_SYMMETRIC:
        cycles = 1
    arguments = (
        assembly,
        np.moveaxis(alpha.reshape(-1, phases, joints), 0, -1),
        np.moveaxis(alphadot.reshape(-1, phases, joints), 0, -1),
        Accuracy(regularisation, tolerance),
        backend,
        cycles is None,
        half_lengths(body),
    )
    gives_way = with_springs(effects)
    if start is not None:
        require(gives_way, "start is for joints that give way", instead="leave it out")
        start = _checked_start(start, batch, joints)
    stepping = Stepping(*arguments)
    if gives_way:
        stepping = CompliantStepping(*arguments, start=start)
    steps = _cycles(stepping, cycles, with_work, with_path, advance or take_steps)
    return _with_batch_axes(steps, batch, body_size(body))


def _no_steps(batch: tuple, phases: int) -> TimeSteps:
    """Return the steps of an empty batch."""
    none = np.zeros(batch)
    return TimeSteps(
        xi=np.zeros((*batch, phases, 3)),
        pose=np.zeros((*batch, phases + 1, 3)),
        residual=none,
        status=none.astype(str),
        drift=none,
        cycles=0,
        work=None,
    )


def take_steps(
    stepping: Stepping, state: State, count: int, with_work: bool = False
) -> tuple[State, list[Row]]:
    """Return the state after ``count`` steps, and their rows."""
    rows = []
    for _ in range(count):
        state, row = stepping.step(state, with_work)
        rows.append(row)
    return state, rows


def _cycles(
    stepping: Stepping,
    cycles: int | None,
    with_work: bool,
    with_path: bool,
    advance: Callable,
) -> TimeSteps:
    """Return the last of ``cycles`` cycles, or by default the first one that repeats;
    samples on the last axis."""
    path = []
    state = stepping.begin()
    mixes = cycles is None and not stepping.heavy and stepping.memory(state).size > 0
    memories: list[limit_cycle.MemoryCycle] = []
    gain = np.zeros(0)
    for cycle in itertools.count(1):
        start = stepping.memory(state)
        state, rows = advance(stepping, state, stepping.phases, with_work)
        pose = np.stack([*(row.pose for row in rows), stepping.next_pose(state)])
        if with_path:
            path.append(pose[:-1])
        if mixes and cycle > 1:  # before the first step there is no memory
            displacement = relative_pose(pose[0], pose[-1])
            end = stepping.memory(state)
            memories = memories[1 - limit_cycle.MEMORY_HISTORY :]
            memories.append(limit_cycle.MemoryCycle(start, end, displacement))
        if mixes and cycle > PLAIN_CYCLES:
            memory, drift = limit_cycle.mixed_memory(memories, gain)
            state = state._replace(cycles=state.cycles._replace(drift=drift))
        if cycle == (cycles or MOST_CYCLES):
            break
        if cycles is None and stepping.is_periodic(state):
            break
        if mixes and cycle >= PLAIN_CYCLES:
            if cycle == PLAIN_CYCLES:
                gain = limit_cycle.memory_gain(memories)
                memory, _ = limit_cycle.mixed_memory(memories, gain)
            state = stepping.with_memory(state, memory)
    xi = np.stack([row.xi for row in rows])
    worst = np.max([row.residual for row in rows], 0)
    limit = np.max([row.limit for row in rows])
    work = None
    if with_work:
        work = Work(*map(np.stack, zip(*(row.work for row in rows))))
    springs = None
    if rows[0].springs is not None:
        springs = SpringMotion(*map(np.stack, zip(*(row.springs for row in rows))))
    drift = state.cycles.drift
    other = "not periodic" if cycles is None else "running"
    status = np.where(drift <= stepping.drift_tolerance, "periodic", other)
    if springs is not None and cycles is None:
        status = _with_periods(status, state.cycles.displacements)
    status = np.where(worst <= limit, status, "unconverged")
    if stepping.is_pulled:
        slid = [
            (row.residual > row.limit) & runs_away(row.xi, scale)
            for row, scale in zip(rows, stepping.scales)
        ]
        status = np.where(np.any(slid, 0), "slides", status)
    all_poses = None
    if with_path:
        all_poses = np.concatenate([*path, pose[-1:]])
    return TimeSteps(xi, pose, worst, status, drift, cycle, work, all_poses, springs)


def _with_periods(status: np.ndarray, displacements: np.ndarray) -> np.ndarray:
    """Return the status (B,) of samples, "period 2" or "period 3" where displacements
    (HISTORY, 3, B) of the last cycles repeat every so many cycles, and not each one."""
    for period in (3, 2):
        change = np.abs(displacements[-1] - displacements[-1 - period]).max(0)
        other = np.abs(displacements[-1] - displacements[-2]).max(0)
        repeats = (change < REPEATED * other) & (status == "not periodic")
        status = np.where(repeats, f"period {period}", status)
    return status


def _checked_start(start: ArrayLike, batch: tuple, joints: int) -> np.ndarray:
    """Return a start as shapes (joints, B); ValueError for another shape."""
    start = real_array("start", start)
    require(
        start.shape == (*batch, joints) and bool(np.isfinite(start).all()),
        f"start must be finite shapes {(*batch, joints)}",
        value=start.shape,
    )
    return np.ascontiguousarray(start.reshape(-1, joints).T)


def _with_batch_axes(steps: TimeSteps, batch: tuple, length: float) -> TimeSteps:
    """Return steps with their samples on leading axes, and lengths in the body's
    unit."""
    units = np.array([length, length, 1.0])

    def samples_first(x):
        return np.moveaxis(x, -1, 0).reshape(*batch, -1, 3) * units

    def by_sample(x):  # from (N, ..., B) to (..., N, ...)
        x = np.moveaxis(x, -1, 0)
        return x.reshape((*batch, *x.shape[1:]))

    xi, pose = map(samples_first, steps[:2])
    path = steps.path
    if path is not None:
        path = samples_first(path)
    work = steps.work
    if work is not None:
        # From (N, B, ...) to (..., N, ...).
        first = (np.moveaxis(x, 1, 0) for x in work)
        work = Work(*(x.reshape((*batch, *x.shape[1:])) for x in first))
        work = work._replace(power=work.power * length)
    springs = steps.springs
    if springs is not None:
        springs = SpringMotion(*map(by_sample, springs))
        springs = springs._replace(several=springs.several.sum(-1))
    residual, status, drift = (x.reshape(batch) for x in steps[2:5])
    return TimeSteps(
        xi, pose, residual, status, drift, steps.cycles, work, path, springs
    )
