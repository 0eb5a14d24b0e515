"""The planar engine: batches of robots from rest and at their limit cycles."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rft.core.refusal import require
from rft.terradynamics.ground import Ground
from rft.terradynamics.plates.stress import PlateStress
from rft.terradynamics.walking.engines import (
    Fineness,
    Refined,
    Walker,
    with_more_elements,
)
from rft.terradynamics.walking.limit import (
    Limit,
    LimitCycles,
    limit_cycles,
    predicted_progress,
)
from rft.terradynamics.walking.march import march
from rft.terradynamics.walking.planar import Robots, State
from rft.terradynamics.walking.robot import Rhex, Roller
from rft.terradynamics.walking.stride import (
    STUCK,
    Strides,
    Walk,
    compute_stride,
    cycles_to_settle,
    from_rest,
)

ORDER = 2  # of the time steps


def refuse(walker: Walker) -> None:
    """Raise ValueError for a walker that this engine cannot compute."""
    planar = isinstance(walker.robot, Rhex | Roller)
    require(
        planar,
        f"the planar engine knows no {type(walker.robot).__name__} robot",
        instead="use ``engine`` mujoco",
    )
    require(
        isinstance(walker.stress, PlateStress),
        "a law of three dimensions takes ``engine`` mujoco",
    )


def refined(numerics: Fineness) -> list[Refined]:
    """Return half and three quarters of the steps, as one change alone may be small by
    chance, and twice the elements."""
    few = [max(8, numerics.steps * quarters // 4) for quarters in (2, 3)]
    return [
        Refined(replace(numerics, steps=few[0]), "steps", 1.0, 0.5),
        Refined(replace(numerics, steps=few[1]), "steps", 1.0, 0.75),
        with_more_elements(numerics, 1.5),
    ]


def walk(
    walkers: Sequence[Walker],
    numerics: Fineness,
    cycles: int | None = None,
    progress: Callable | None = None,
    advance: Callable = compute_stride,
) -> list[Walk]:
    """Return the walks of walkers; see
    `rft.terradynamics.walking.engines.Engine.walk`."""
    walks: list = [None] * len(walkers)
    for walker in walkers:
        refuse(walker)
    batches = _batches(walkers, numerics)
    for k, members in enumerate(batches):

        def report(fraction, k=k):
            if progress:
                progress((k + fraction) / len(batches))

        for j, one in zip(
            members,
            _walk([walkers[j] for j in members], numerics, cycles, report, advance),
        ):
            walks[j] = one
    return walks


def _batches(walkers: Sequence[Walker], numerics: Fineness) -> list[list[int]]:
    """Return the indices of walkers that can be computed as one batch, a list for each
    batch."""
    batches: dict = {}
    for k, w in enumerate(walkers):
        outlines = [
            o
            for o in (w.robot.leg(numerics.elements), w.robot.belly(numerics.elements))
            if o is not None
        ]
        shapes = tuple(
            (o.elements, o.closed, o.smooth_normals is None) for o in outlines
        )
        key = repr(
            (
                type(w.robot),
                len(w.robot.hips),
                shapes,
                replace(w.stress, zeta=1.0),
                w.gait.kinks,
            )
        )
        batches.setdefault(key, []).append(k)
    return list(batches.values())


def _strides(
    walkers: Sequence[Walker], numerics: Fineness, advance: Callable = compute_stride
) -> Strides:
    """Return the strides of a batch of walkers."""
    stress = replace(walkers[0].stress, zeta=1.0)
    grounds = [w.ground for w in walkers]
    strength = np.array([g.strength * w.stress.zeta for g, w in zip(grounds, walkers)])
    ground = Ground(
        strength,
        np.array([g.flux for g in grounds]),
        numerics.rounding,
        np.sin(stress.grazing),
    )
    robots = [w.robot for w in walkers]
    gaits = [w.gait for w in walkers]
    return Strides(
        Robots(robots, gaits, stress, ground, numerics.elements),
        robots,
        gaits,
        numerics.steps,
        advance,
    )


def _walk(
    walkers: Sequence[Walker],
    numerics: Fineness,
    cycles: int | None,
    progress: Callable,
    advance: Callable,
) -> list[Walk]:
    """Return the walks of one batch of walkers."""
    strides = _strides(walkers, numerics, advance)
    durations = (
        cycles / strides.frequency
        if cycles
        else np.full(len(walkers), numerics.duration)
    )
    state, blocks, computed, status, period = from_rest(strides, durations, progress)
    on = np.flatnonzero(np.isin(status, ("", "periodic")))
    limits = [Limit(state.take([k]), period[k]) for k in on]
    at_limit = (
        dict(zip(on, _at_limits([walkers[k] for k in on], numerics, limits, advance)))
        if on.size
        else {}
    )
    walks = []
    for k in range(len(walkers)):
        rows = _rows(
            blocks[k], strides.cycle if status[k] == "periodic" else 0, durations[k]
        )
        states = State(
            rows[:, 1:4],
            rows[:, 4:7],
            rows[:, 7],
            rows[:, 8],
            *np.zeros((3, len(rows))),
        )
        energy = strides.robots.energy(states, k)
        time = rows[-1, 0]
        speed = rows[-1, 1] / time if time else 0.0
        own = (
            float(speed),
            str(status[k]),
            0.0,
            False,
            0.0,
            None,
            int(state.unsolved[k]),
            float(state.residual[k]),
        )
        one = Walk(rows[:, 0], *states[:4], energy, *own)
        one = one._replace(**at_limit[k]) if k in at_limit else one
        if one.periodic and one.status == "walking":
            last = state.take([k]) if status[k] == "" else None
            one = one._replace(
                settling_time=_settling_time(
                    strides, k, [b[-1, 1] for b in blocks[k]], last, one
                )
            )
        walks.append(one._replace(cycles=one.cycles + computed[k] * strides.period))
    return walks


def _settling_time(
    strides: Strides, k: int, x: list, last: State | None, walk: Walk
) -> float:
    """Return `Walk.settling_time` from the places x, m, of robot k at the ends of its
    strides from rest.

    last: its state at the last one, from which the slopes at the limit predict further
    strides; None where the strides repeat themselves."""
    cycle = 1.0 / strides.frequency[k]
    if last is not None:
        moves = predicted_progress(
            strides, walk.limit, last, k, walk.speed * cycle / strides.cycle
        )
        x = np.append(x, x[-1] + moves.cumsum())
    return float(
        cycles_to_settle(np.diff(x[:: strides.cycle]), walk.speed * cycle) * cycle
    )


def _at_limits(
    walkers: Sequence[Walker],
    numerics: Fineness,
    limits: list[Limit],
    advance: Callable,
) -> list[dict]:
    """Return the fields of `Walk` that belong to the limit cycles, from states near
    them."""
    strides = _strides(walkers, numerics, advance)
    cycles = limit_cycles(strides, limits)
    return [_limit_fields(strides, cycles, k) for k in range(len(limits))]


def _limit_fields(strides: Strides, cycles: LimitCycles, k: int) -> dict:
    """Return the fields of `Walk` that belong to the limit cycle of robot k."""
    per_second = strides.frequency[k] / strides.period
    limit = cycles.limits[k]
    stuck = abs(cycles.progress[k]) < STUCK * strides.period * strides.reach[k]
    return {
        "speed": float(cycles.progress[k] * per_second),
        "status": str(cycles.ends[k]) or ("stuck" if stuck else "walking"),
        "cycles": float(cycles.strides[k] * strides.period),
        "periodic": bool(cycles.periodic[k]),
        "drift": float(cycles.drift[k] * per_second),
        "limit": limit,
        "unsolved": int(limit.state.unsolved[0]),
        "residual": float(limit.state.residual[0]),
        "unsolved_error": float(cycles.unsolved_error[k] * per_second),
    }


def _rows(blocks, cycle: int, duration: float) -> np.ndarray:
    """Return rows (T, 9) of t, pose, twist, work and loss until the duration, s, is
    over; the last ``cycle`` strides, if not 0, are repeated until then."""
    rows = np.concatenate(blocks)
    if cycle:
        last = np.concatenate(blocks[-cycle:])
        before = blocks[-1 - cycle][-1]
        gain = np.zeros(9)
        gain[[0, 1, 7, 8]] = (last[-1] - before)[[0, 1, 7, 8]]
        repetitions = int(np.ceil((duration - rows[-1, 0]) / gain[0]))
        rows = np.concatenate(
            [rows, *(last + k * gain for k in range(1, repetitions + 1))]
        )
    return rows[rows[:, 0] <= duration + 1e-9]


def rerun(
    walkers: Sequence[Walker],
    numerics: Fineness,
    walks: Sequence[Walk],
    cycles: int | None = None,
    advance: Callable = compute_stride,
) -> list[Walk]:
    """Return walks with other numerics; see
    `rft.terradynamics.walking.engines.Engine.rerun`."""
    others: list = [None] * len(walkers)
    ended = [k for k, w in enumerate(walks) if w.limit is None]
    for k, one in zip(
        ended, walk([walkers[k] for k in ended], numerics, cycles, advance=advance)
    ):
        others[k] = one
    rest = [k for k, w in enumerate(walks) if w.limit is not None]
    for batch in _batches([walkers[k] for k in rest], numerics):
        members = [rest[m] for m in batch]
        limits = [walks[k].limit for k in members]
        for k, fields in zip(
            members,
            _at_limits([walkers[k] for k in members], numerics, limits, advance),
        ):
            others[k] = walks[k]._replace(**fields)
    return others


def step_cost(
    walkers: Sequence[Walker], numerics: Fineness, seconds: float
) -> tuple[float, float]:
    """Return the cost of a time step; see
    `rft.terradynamics.walking.engines.Engine.step_cost`."""
    strides = _strides(walkers, numerics)
    robots = np.arange(len(walkers))
    ends = (strides.top, strides.out_of_reach)
    state = strides.robots.start()
    done = 0
    tries = 0

    def steps(begin, count):
        phases = strides.phases[begin : begin + count + 1]
        rate_phases = strides.rate_phases[begin : begin + count]
        return march(strides.robots, robots, state, phases, rate_phases, ends)

    steps(0, 1)  # compiled code is loaded
    begin = time.process_time()
    while done < len(strides.rate_phases):
        states, evaluations = steps(done, max(1, done))  # one by one they take longer
        state = states.take(-1)
        tries = tries + int(evaluations[0])
        done = done + len(states.pose)
        if (
            time.process_time() - begin >= seconds
            or strides.end_status(state, robots)[0]
        ):
            break
    return (time.process_time() - begin) / done, tries / done
