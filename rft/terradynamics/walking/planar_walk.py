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
    Variation,
    Walker,
    with_more_elements,
)
from rft.terradynamics.walking.feet import Feet, planar_feet
from rft.terradynamics.walking.planar import printed
from rft.terradynamics.walking.planar.equations import Robots, State
from rft.terradynamics.walking.planar.limit import (
    Limit,
    LimitCycles,
    limit_cycles,
    predicted_progress,
)
from rft.terradynamics.walking.planar.march import march
from rft.terradynamics.walking.planar.stride import (
    AVERAGED_CYCLES,
    STUCK,
    Strides,
    Walk,
    WalksFromRest,
    compute_stride,
    cycles_to_settle,
    walk_from_rest,
)
from rft.terradynamics.walking.prints import Memory
from rft.terradynamics.walking.robot import Rhex, Roller

ORDER = 2  # of the time steps


def refuse(walker: Walker) -> None:
    """Raise ValueError for a walker that this engine cannot compute."""
    require(
        isinstance(walker.robot, Rhex | Roller),
        f"the planar engine does not support a {type(walker.robot).__name__} robot",
        instead="use ``engine`` mujoco",
    )
    require(
        isinstance(walker.stress, PlateStress),
        "a law of three dimensions needs ``engine`` mujoco",
    )


def variations(numerics: Fineness) -> list[Variation]:
    """Return half and three quarters of the steps, as one change alone may be small by
    chance, and twice the elements."""
    half = max(8, numerics.steps // 2)
    three_quarters = max(8, numerics.steps * 3 // 4)
    return [
        Variation(replace(numerics, steps=half), "steps", 1.0, 0.5),
        Variation(replace(numerics, steps=three_quarters), "steps", 1.0, 0.75),
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
    for walker in walkers:
        refuse(walker)
    walks: list = [None] * len(walkers)
    batches = _batches(walkers, numerics)
    for k, members in enumerate(batches):

        def report(fraction, k=k):
            if progress:
                progress((k + fraction) / len(batches))

        batch = [walkers[j] for j in members]
        if batch[0].prints:
            batch_walks = _walk_on_prints(batch, numerics, cycles, report, advance)
        else:
            batch_walks = _walk_batch(batch, numerics, cycles, report, advance)
        for j, one in zip(members, batch_walks):
            walks[j] = one
    return walks


def _batches(walkers: Sequence[Walker], numerics: Fineness) -> list[list[int]]:
    """Return the indices of walkers that can be computed as one batch, a list for each
    batch."""
    batches: dict = {}
    for k, walker in enumerate(walkers):
        key = _batch_key(walker, numerics.elements)
        batches.setdefault(key, []).append(k)
    return list(batches.values())


def _batch_key(walker: Walker, elements: int) -> str:
    """Return a text that is equal for walkers that can be computed as one batch."""
    robot = walker.robot
    shapes = []
    for outline in (robot.leg(elements), robot.belly(elements)):
        if outline is not None:
            is_plain = outline.smooth_normals is None
            shapes.append((outline.elements, outline.closed, is_plain))
    stress = replace(walker.stress, zeta=1.0)
    remembers = walker.prints is not None
    key = (
        type(robot),
        len(robot.hips),
        tuple(shapes),
        stress,
        walker.gait.kinks,
        remembers,
    )
    return repr(key)


def batch_strides(
    walkers: Sequence[Walker], numerics: Fineness, advance: Callable = compute_stride
) -> Strides:
    """Return the strides of a batch of walkers."""
    # One law for all: the factors zeta go into the strength of the ground.
    stress = replace(walkers[0].stress, zeta=1.0)
    grounds = [w.ground for w in walkers]
    strength = np.array([g.strength * w.stress.zeta for g, w in zip(grounds, walkers)])
    flux = np.array([g.flux for g in grounds])
    loss = np.array([g.downhill_loss for g in grounds])
    ground = Ground(strength, flux, numerics.rounding, np.sin(stress.grazing), loss)

    designs = [w.robot for w in walkers]
    gaits = [w.gait for w in walkers]
    slopes = [w.rise for w in walkers]
    robots = Robots(designs, gaits, stress, ground, numerics.elements, slopes)
    return Strides(robots, designs, gaits, numerics.steps, advance)


def _walk_batch(
    walkers: Sequence[Walker],
    numerics: Fineness,
    cycles: int | None,
    progress: Callable,
    advance: Callable,
) -> list[Walk]:
    """Return the walks of one batch of walkers."""
    strides = batch_strides(walkers, numerics, advance)
    if cycles:
        durations = cycles / strides.frequency
    else:
        durations = np.full(len(walkers), numerics.duration)
    from_rest = walk_from_rest(strides, durations, progress)

    # Robots that are at no end go on from where they are to their limit cycles.
    walking = np.flatnonzero(np.isin(from_rest.status, ("", "periodic")))
    limits = [Limit(from_rest.state.take([k]), from_rest.period[k]) for k in walking]
    limit_fields = {}
    if walking.size:
        members = [walkers[k] for k in walking]
        fields = _fields_at_limits(members, numerics, limits, advance)
        limit_fields = dict(zip(walking, fields))

    walks = []
    for k in range(len(walkers)):
        one = _walk_until(strides, from_rest, k, durations[k])
        one = one._replace(**(limit_fields.get(k) or _feet_at_end(strides, k, one)))
        if one.periodic and one.status == "walking":
            settling_time = _settling_time(strides, from_rest, k, one)
            one = one._replace(settling_time=settling_time)
        cycles_from_rest = from_rest.strides[k] * strides.period
        walks.append(one._replace(cycles=one.cycles + cycles_from_rest))
    return walks


def _walk_on_prints(
    walkers: Sequence[Walker],
    numerics: Fineness,
    cycles: int | None,
    progress: Callable,
    advance: Callable,
) -> list[Walk]:
    """Return the walks of walkers on ground that remembers, one after another."""
    walks = []
    for k, walker in enumerate(walkers):

        def report(fraction, k=k):
            progress((k + fraction) / len(walkers))

        strides = printed_strides(walker, numerics, advance)
        duration = numerics.duration
        if cycles:
            duration = cycles / walker.gait.frequency
        from_rest, fields = printed.walk_from_rest(strides, duration, report)
        own = strides.strides
        one = _walk_until(own, from_rest, 0, duration)
        count = from_rest.strides[0] * own.period
        walks.append(one._replace(**{"cycles": count, **fields}))
    return walks


def printed_strides(
    walker: Walker, numerics: Fineness, advance: Callable = compute_stride
) -> printed.PrintedStrides:
    """Return the strides of one walker on ground that remembers."""
    assert walker.prints is not None
    strides = batch_strides([walker], numerics, advance)
    return printed.PrintedStrides(strides, walker.prints, walker.robot)


def _walk_until(
    strides: Strides, from_rest: WalksFromRest, k: int, duration: float
) -> Walk:
    """Return the walk of robot k from rest until a duration, s, without its limit
    cycle."""
    repeated = strides.cycle if from_rest.status[k] == "periodic" else 0
    rows = _rows_until(from_rest.blocks[k], repeated, duration)
    t = rows[:, 0]
    zeros = np.zeros((3, len(rows)))
    states = State(rows[:, 1:4], rows[:, 4:7], rows[:, 7], rows[:, 8], *zeros)
    speed = 0.0
    if t[-1]:
        speed = float(rows[-1, 1] / t[-1])
    return Walk(
        t,
        states.pose,
        states.twist,
        states.work,
        states.loss,
        strides.robots.energy(states, k),
        speed=speed,
        status=str(from_rest.status[k]),
        cycles=0.0,
        periodic=False,
        drift=0.0,
        limit=None,
        unsolved=int(from_rest.state.unsolved[k]),
        residual=float(from_rest.state.residual[k]),
        speed_along=speed,
        reach=float(strides.reach[k]),
    )


def _feet_at_end(strides: Strides, k: int, walk: Walk) -> dict:
    """Return the fields of `Walk` that belong to the feet of robot k, which came to an
    end, over its last cycles."""
    per_stride = len(strides.rate_phases)
    most = AVERAGED_CYCLES * strides.cycle * per_stride
    count = len(walk.t) - 1
    step = np.arange(max(0, count - most), count)
    if not step.size:
        return {}
    zeros = np.zeros((5, step.size + 1))
    states = State(walk.pose[step[0] :], walk.twist[step[0] :], *zeros)
    first = step // per_stride * strides.period
    rate_phases = first + strides.rate_phases[step % per_stride]
    begins = first + strides.phases[step % per_stride]
    last = strides.phases[step[-1:] % per_stride + 1] + first[-1:]
    phases = np.concatenate([begins, last])
    feet = planar_feet(strides.robots, k, states, phases, rate_phases)
    return {"foot_speed": feet.speed, "sinkage": feet.sinkage}


def _settling_time(
    strides: Strides, from_rest: WalksFromRest, k: int, walk: Walk
) -> float:
    """Return `Walk.settling_time` of robot k, from the ends of its strides from
    rest."""
    cycle = 1.0 / strides.frequency[k]
    x = [block[-1, 1] for block in from_rest.blocks[k]]
    if from_rest.status[k] == "":
        # The strides do not repeat themselves yet: the slopes at the limit predict
        # further ones.
        moves = predicted_progress(
            strides,
            walk.limit,
            from_rest.state.take([k]),
            k,
            walk.speed * cycle / strides.cycle,
        )
        x = np.append(x, x[-1] + moves.cumsum())
    moves = np.diff(x[:: strides.cycle])
    return float(cycles_to_settle(moves, walk.speed * cycle) * cycle)


def _fields_at_limits(
    walkers: Sequence[Walker],
    numerics: Fineness,
    limits: list[Limit],
    advance: Callable,
) -> list[dict]:
    """Return the fields of `Walk` that belong to the limit cycles, from states near
    them."""
    strides = batch_strides(walkers, numerics, advance)
    cycles = limit_cycles(strides, limits)
    feet = _feet_at_limits(strides, cycles)
    return [_limit_fields(strides, cycles, feet, k) for k in range(len(limits))]


def _feet_at_limits(strides: Strides, cycles: LimitCycles) -> list[Feet]:
    """Return the feet of all robots in a cycle from their states at the limit."""
    robots = np.arange(len(cycles.limits))
    parts = zip(*(limit.state for limit in cycles.limits))
    state = State(*(np.concatenate(x) for x in parts))
    blocks = [State(*(x[None] for x in state))]
    phases = [strides.phases[:1]]
    rate_phases = []
    for stride in range(strides.cycle):
        ends, states = strides.run(state, stride, robots)
        state = states.take(-1)
        blocks.append(states)
        phases.append(ends)
        rate_phases.append(stride * strides.period + strides.rate_phases)
    all_states = State(*(np.concatenate(x) for x in zip(*blocks)))
    of_phases = np.concatenate(phases), np.concatenate(rate_phases)
    return [
        planar_feet(strides.robots, k, all_states.take(np.s_[:, k]), *of_phases)
        for k in robots
    ]


def _limit_fields(
    strides: Strides, cycles: LimitCycles, feet: list[Feet], k: int
) -> dict:
    """Return the fields of `Walk` that belong to the limit cycle of robot k."""
    strides_per_second = strides.frequency[k] / strides.period
    limit = cycles.limits[k]
    status = str(cycles.ends[k])
    if not status:
        least = STUCK * strides.period * strides.reach[k]
        is_stuck = abs(cycles.progress[k]) < least
        status = "stuck" if is_stuck else "walking"
    speed = float(cycles.progress[k] * strides_per_second)
    return {
        "speed": speed,
        "speed_along": speed,
        "foot_speed": feet[k].speed,
        "sinkage": feet[k].sinkage,
        "status": status,
        "cycles": float(cycles.strides[k] * strides.period),
        "periodic": bool(cycles.periodic[k]),
        "drift": float(cycles.drift[k] * strides_per_second),
        "limit": limit,
        "unsolved": int(limit.state.unsolved[0]),
        "residual": float(limit.state.residual[0]),
        "unsolved_error": float(cycles.unsolved_error[k] * strides_per_second),
    }


def _rows_until(blocks, repeated: int, duration: float) -> np.ndarray:
    """Return rows (T, 9) of t, pose, twist, work and loss until a duration, s; the last
    strides, ``repeated`` of them, are repeated until then."""
    rows = np.concatenate(blocks)
    if repeated:
        last = np.concatenate(blocks[-repeated:])
        before = blocks[-1 - repeated][-1]
        # Of time, x, work and loss; the others are the same in every cycle.
        gain = np.zeros(9)
        gain[[0, 1, 7, 8]] = (last[-1] - before)[[0, 1, 7, 8]]
        repetitions = int(np.ceil((duration - rows[-1, 0]) / gain[0]))
        copies = [last + k * gain for k in range(1, repetitions + 1)]
        rows = np.concatenate([rows, *copies])
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
    ended_walkers = [walkers[k] for k in ended]
    new_walks = walk(ended_walkers, numerics, cycles, advance=advance)
    for k, one in zip(ended, new_walks):
        others[k] = one

    with_limit = [k for k, w in enumerate(walks) if w.limit is not None]
    for batch in _batches([walkers[k] for k in with_limit], numerics):
        members = [with_limit[m] for m in batch]
        batch_walkers = [walkers[k] for k in members]
        limits = [walks[k].limit for k in members]
        new_fields = _fields_at_limits(batch_walkers, numerics, limits, advance)
        for k, fields in zip(members, new_fields):
            others[k] = walks[k]._replace(**fields)
    return others


def step_cost(
    walkers: Sequence[Walker], numerics: Fineness, seconds: float
) -> tuple[float, float]:
    """Return the cost of a time step; see
    `rft.terradynamics.walking.engines.Engine.step_cost`."""
    if walkers[0].prints:
        return _step_cost_on_prints(walkers, numerics)
    strides = batch_strides(walkers, numerics)
    robots = np.arange(len(walkers))
    end_heights = (strides.top, strides.airborne_height)
    state = strides.robots.start()

    def compute_steps(first, count):
        phases = strides.phases[first : first + count + 1]
        rate_phases = strides.rate_phases[first : first + count]
        return march(strides.robots, robots, state, phases, rate_phases, end_heights)

    compute_steps(0, 1)  # loads compiled code
    begin = time.process_time()
    n_steps = 0
    evaluations = 0
    while n_steps < len(strides.rate_phases):
        # Twice as many each time: one by one they take longer.
        states, new_evaluations = compute_steps(n_steps, max(1, n_steps))
        state = states.take(-1)
        evaluations += int(new_evaluations[0])
        n_steps += len(states.pose)
        has_ended = strides.end_status(state, robots)[0]
        if has_ended or time.process_time() - begin >= seconds:
            break
    elapsed = time.process_time() - begin
    return elapsed / n_steps, evaluations / n_steps


def _step_cost_on_prints(
    walkers: Sequence[Walker], numerics: Fineness
) -> tuple[float, float]:
    """Return the cost of a time step on ground that remembers, from a stride; the
    evaluations of forces are not counted."""
    strides = printed_strides(walkers[0], numerics)
    robots = strides.strides.robots
    memory = Memory.undisturbed(len(strides.y))
    # The first stride loads compiled code.
    state, memory = strides.states(0, robots.start(), memory)
    begin = time.process_time()
    strides.states(1, state.take(-1), memory)
    elapsed = time.process_time() - begin
    steps = len(strides.strides.rate_phases)
    return len(walkers) * elapsed / steps, 0.0
