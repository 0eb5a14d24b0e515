"""The planar engine: robots that are alike side by side, from rest and at their limit cycle, with the error of the speed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rft.checks import require
from rft.ground import Ground
from rft.plates.stress import PlateStress
from rft.walking.engines import Fineness, Walker
from rft.walking.limit import Found, Limit, foretold, limit_cycle
from rft.walking.march import march
from rft.walking.planar import Robots, State
from rft.walking.robot import Rhex, Roller
from rft.walking.stride import STUCK, Strides, Walk, advanced, cycles_to_settle, from_rest


def refuse(walker: Walker) -> None:
    """ValueError for a walker that this engine does not take."""
    planar = isinstance(walker.robot, Rhex | Roller)
    require(planar, f"the planar engine knows no {type(walker.robot).__name__} robot: use --engine mujoco")
    require(isinstance(walker.stress, PlateStress), "a law of three dimensions takes --engine mujoco")


def walk(
    walkers: Sequence[Walker],
    numerics: Fineness,
    settling: int | None = None,
    progress: Callable | None = None,
    advance: Callable = advanced,
) -> list[Walk]:
    """Each walker from rest for the duration, or so many cycles, or to its end; its speed at the limit cycle. progress:
    told the fraction done. advance: takes the strides, as `rft.walking.stride.advanced`."""
    found: list = [None] * len(walkers)
    for walker in walkers:
        refuse(walker)
    groups = _alike(walkers, numerics)
    for k, members in enumerate(groups):
        told = (lambda done, k=k: progress((k + done) / len(groups))) if progress else (lambda done: None)
        for j, one in zip(members, _walk([walkers[j] for j in members], numerics, settling, told, advance)):
            found[j] = one
    return found


def _alike(walkers: Sequence[Walker], numerics: Fineness) -> list[list[int]]:
    """Those that go into one batch."""
    groups: dict = {}
    for k, w in enumerate(walkers):
        outlines = [o for o in (w.robot.leg(numerics.elements), w.robot.belly(numerics.elements)) if o is not None]
        shapes = tuple((o.elements, o.closed, o.smooth_normals is None) for o in outlines)
        key = repr((type(w.robot), len(w.robot.hips), shapes, replace(w.stress, zeta=1.0), w.gait.kinks))
        groups.setdefault(key, []).append(k)
    return list(groups.values())


def _strides(walkers: Sequence[Walker], numerics: Fineness, advance: Callable = advanced) -> Strides:
    stress, grounds = replace(walkers[0].stress, zeta=1.0), [w.ground for w in walkers]
    strength = np.array([g.strength * w.stress.zeta for g, w in zip(grounds, walkers)])
    ground = Ground(strength, np.array([g.flux for g in grounds]), numerics.rounding, np.sin(stress.grazing))
    robots, gaits = [w.robot for w in walkers], [w.gait for w in walkers]
    return Strides(Robots(robots, gaits, stress, ground, numerics.elements), robots, gaits, numerics.steps, advance)


def _walk(
    walkers: Sequence[Walker], numerics: Fineness, settling: int | None, told: Callable, advance: Callable
) -> list[Walk]:
    strides = _strides(walkers, numerics, advance)
    durations = settling / strides.frequency if settling else np.full(len(walkers), numerics.duration)
    state, blocks, done, how, fold = from_rest(strides, durations, told)
    on = np.flatnonzero(np.isin(how, ("", "periodic")))
    limits = [Limit(state.take([k]), fold[k]) for k in on]
    at_limit = dict(zip(on, _at_limits([walkers[k] for k in on], numerics, limits, advance))) if on.size else {}
    walks = []
    for k in range(len(walkers)):
        rows = _rows(blocks[k], strides.cycle if how[k] == "periodic" else 0, durations[k])
        states = State(rows[:, 1:4], rows[:, 4:7], rows[:, 7], rows[:, 8], *np.zeros((3, len(rows))))
        energy, time = strides.robots.energy(states, k), rows[-1, 0]
        speed = rows[-1, 1] / time if time else 0.0
        own = float(speed), str(how[k]), 0.0, False, 0.0, None, int(state.unsolved[k]), float(state.residual[k])
        one = Walk(rows[:, 0], *states[:4], energy, *own)
        one = one._replace(**at_limit[k]) if k in at_limit else one
        if one.periodic and one.status == "walking":
            rest = state.take([k]) if how[k] == "" else None
            one = one._replace(settled=_settled(strides, k, [b[-1, 1] for b in blocks[k]], rest, one))
        walks.append(one._replace(cycles=one.cycles + done[k] * strides.period))
    return walks


def _settled(strides: Strides, k: int, x: list, rest: State | None, walk: Walk) -> float:
    """`Walk.settled` from the places x, m, of robot k at the ends of its strides from rest. rest: its state at the last one,
    from which the slopes at the limit foretell those to come; None where they repeat themselves."""
    cycle = 1.0 / strides.frequency[k]
    if rest is not None:
        x = np.append(x, x[-1] + foretold(strides, walk.limit, rest, k, walk.speed * cycle / strides.cycle).cumsum())
    return float(cycles_to_settle(np.diff(x[:: strides.cycle]), walk.speed * cycle) * cycle)


def _at_limits(walkers: Sequence[Walker], numerics: Fineness, limits: list[Limit], advance: Callable) -> list[dict]:
    """What a `Walk` has of its limit cycle, from near that."""
    strides = _strides(walkers, numerics, advance)
    found = limit_cycle(strides, limits)
    return [_speed(strides, found, k) for k in range(len(limits))]


def _speed(strides: Strides, found: Found, k: int) -> dict:
    per, limit = strides.frequency[k] / strides.period, found.limits[k]
    stuck = abs(found.progress[k]) < STUCK * strides.period * strides.reach[k]
    return {
        "speed": float(found.progress[k] * per),
        "status": str(found.ends[k]) or ("stuck" if stuck else "walking"),
        "cycles": float(found.strides[k] * strides.period),
        "periodic": bool(found.periodic[k]),
        "drift": float(found.drift[k] * per),
        "limit": limit,
        "unsolved": int(limit.state.unsolved[0]),
        "residual": float(limit.state.residual[0]),
        "off": float(found.off[k] * per),
    }


def _rows(blocks, cycle: int, duration: float) -> np.ndarray:
    """Rows (T, 9): t, pose, twist, work and loss; so many last strides, if any, again and again till the duration is over."""
    rows = np.concatenate(blocks)
    if cycle:
        last, before = np.concatenate(blocks[-cycle:]), blocks[-1 - cycle][-1]
        gain = np.zeros(9)
        gain[[0, 1, 7, 8]] = (last[-1] - before)[[0, 1, 7, 8]]
        more = int(np.ceil((duration - rows[-1, 0]) / gain[0]))
        rows = np.concatenate([rows, *(last + k * gain for k in range(1, more + 1))])
    return rows[rows[:, 0] <= duration + 1e-9]


def again(
    walkers: Sequence[Walker],
    numerics: Fineness,
    walks: Sequence[Walk],
    settling: int | None = None,
    advance: Callable = advanced,
) -> list[Walk]:
    """The same with other numerics; where there is a limit cycle, from there, and nothing but what is said of that is new."""
    found: list = [None] * len(walkers)
    ended = [k for k, w in enumerate(walks) if w.limit is None]
    for k, one in zip(ended, walk([walkers[k] for k in ended], numerics, settling, advance=advance)):
        found[k] = one
    rest = [k for k, w in enumerate(walks) if w.limit is not None]
    for members in _alike([walkers[k] for k in rest], numerics):
        here = [rest[m] for m in members]
        limits = [walks[k].limit for k in here]
        for k, one in zip(here, _at_limits([walkers[k] for k in here], numerics, limits, advance)):
            found[k] = walks[k]._replace(**one)
    return found


def pace(walker: Walker, numerics: Fineness, enough: float) -> tuple[float, float]:
    """(s of computing, times that forces are evaluated) of a time step: of the first ones from rest, till ``enough`` s are
    over or a stride is."""
    strides, alone = _strides([walker], numerics), np.zeros(1, int)
    ends, state, tries = (strides.top, strides.out_of_reach), strides.robots.placed(), 0
    on = lambda k, state: march(strides.robots, alone, state, strides.phases[k : k + 2], strides.of[k : k + 1], ends)
    on(0, state)  # compiled code is loaded
    begin = time.process_time()
    for k in range(len(strides.of)):
        states, more = on(k, state)
        state, tries = states.take(0), tries + int(more[0])
        if time.process_time() - begin >= enough or strides.ended(state, alone)[0]:
            break
    return (time.process_time() - begin) / (k + 1), tries / (k + 1)
