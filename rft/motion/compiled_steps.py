"""Steps of a chain whose joints give way by compiled code, many in one call: what the
steps of NumPy compute, to rounding."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rft.balance.chains import NO_MODES
from rft.balance.compiled import joint_kernel, law_numbers, plain
from rft.balance.compliant import (
    DESCENTS,
    WARM,
    WARM_MOVING,
    Gait,
    History,
    Links,
)
from rft.balance.listening import listener
from rft.balance.solver import begin
from rft.bodies.backbone import Backbone
from rft.bodies.base import Body
from rft.bodies.chain import Chain
from rft.effects.contact import force_scale
from rft.effects.springs import JointSprings
from rft.laws.batch import MediumBatch
from rft.motion.stepping import Row, State, integrated_pose

if TYPE_CHECKING:
    from rft.motion.compliance import CompliantStepping

# Links x unknowns x samples x steps in one call, some 0.1 s, for a call does not stop
# when it is interrupted.
MOST_TOGETHER = 300_000


def chain_of(body: Body) -> Chain | None:
    """Return the chain of a body whose joint angles are its shape variables, or sums of
    them; None for another body."""
    if type(body) is Chain:
        return body
    if isinstance(body, Backbone) and type(body).motion is Backbone.motion:
        return body.chain
    return None


def takes(stepping: CompliantStepping) -> bool:
    """Return whether compiled code takes these steps: those of a chain in one medium
    whose springs are the only effect."""
    assembly = stepping.assembly
    is_alone = len(stepping.effects) == 1 and not assembly.effects
    is_one_law = not isinstance(assembly.medium, MediumBatch)
    has_chain = chain_of(assembly.body) is not None
    return stepping.is_compiled and is_alone and is_one_law and has_chain


class StepsAhead:
    """Steps that are computed in advance from one state, up to the end of the cycle or
    to a step that compiled code leaves unsolved."""

    def __init__(self, stepping: CompliantStepping):
        assembly = stepping.assembly
        springs = stepping.springs
        limits = stepping.limits
        self._stepping = stepping
        self._kernel = joint_kernel(type(assembly.law))
        self._links = _links(chain_of(assembly.body), springs.rows)
        self._arguments = (
            law_numbers(assembly.law),
            self._links,
            _plain_springs(springs),
            float(assembly.axial_drag),
            stepping.dt,
        )
        self._accuracy = (
            begin(WARM_MOVING, assembly.linear, limits),
            tuple(begin(x, assembly.linear, limits) for x in (WARM, *DESCENTS)),
            limits,
        )
        scales = stepping.scales
        law_speed = np.ones_like(scales) if assembly.homogeneous else scales
        gait = (
            springs.rows @ stepping.alpha,
            stepping.alpha,
            stepping.alphadot,
            np.stack([stepping.lead(k, False) for k in range(stepping.phases)]),
            scales,
            np.broadcast_to(force_scale(assembly, scales), scales.shape),
            law_speed,
        )
        self._gait = Gait(*map(plain, gait))
        unknowns = 3 + len(springs.unknown)
        size = len(self._links.fractions) * unknowns * scales.shape[1]
        self._most = max(1, MOST_TOGETHER // size)
        self._coming: list[tuple[State, Row]] = []  # the next one is the last
        self._state: State | None = None  # from which they go on
        self._ends_unsolved = False

    def step(self, s: State) -> tuple[State, Row] | None:
        """Return the state after the next step, before anything that ends a cycle, and
        its row; None if compiled code leaves the step unsolved."""
        if s is not self._state:
            self._coming = []
            self._ends_unsolved = False
        if not self._coming and not self._ends_unsolved:
            self._compute(s)
        return self._coming.pop() if self._coming else None

    def goes_on(self, s: State) -> None:
        """Go on from a state, which follows from the one that was returned last."""
        self._state = s

    def _compute(self, s: State) -> None:
        """Compute the steps from a state."""
        stepping = self._stepping
        assembly = stepping.assembly
        count = int(s.count[0, 0])
        k = count % stepping.phases
        number = min(stepping.phases - k, self._most)
        (own,) = s.effect_states
        _, d, size = own.shape
        n = len(self._links.fractions)
        history = History(
            shape=np.zeros((number + 2, d, size)),
            rate=np.zeros((number + 1, d, size)),
            xi=np.zeros((number + 2, 3, size)),
            v=np.zeros((number, 3, n, size)),
            residual=np.zeros((number, size)),
            several=np.zeros((number, size)),
        )
        history.shape[0] = own[1]
        history.shape[1] = own[0]
        history.rate[0] = own[2]
        history.xi[0] = s.xi_before
        history.xi[1] = s.xi
        gait = Gait(*(x[k : k + number] for x in self._gait))
        if count == 0:
            change = gait.change.copy()
            change[0] = stepping.lead(k, True)
            gait = gait._replace(change=change)
        solved = self._kernel(*self._arguments, count, gait, *self._accuracy, history)
        self._ends_unsolved = solved < number
        if not solved:
            return
        listener()(solved * size, assembly.n_law_points, assembly.linear)
        shape = history.shape[: solved + 2]
        rate = history.rate[1 : solved + 1]
        xi = history.xi[1 : solved + 2]
        start = np.broadcast_to(own[3], rate.shape)
        own = np.stack([shape[2:], shape[1:-1], rate, start], 1)
        pose = _poses(s.pose, xi, stepping.dt, count == 0)
        motion = stepping.motion(k, shape[2:], rate, history.several[:solved])
        limit = np.array([stepping.limits.residual])
        rows = zip(*motion)
        velocities = zip(*history.v.swapaxes(0, 1))
        counts = s.count + np.arange(1, solved + 1)[:, None, None]
        each = zip(counts, pose, xi[1:], xi, velocities, own, history.residual, rows)
        for count, place, now, before, v, springs, residual, of_step in each:
            after = State(count, place, now, before, v, (springs,), s.cycles)
            row = Row(now, place, residual, limit, None, type(motion)(*of_step))
            self._coming.append((after, row))
        self._coming.reverse()


def _links(chain: Chain, rows: np.ndarray) -> Links:
    """Return a chain whose joint angles are ``rows`` (E, d) times the shape."""
    modes = NO_MODES
    if rows.shape[0] != rows.shape[1] or (rows != np.eye(len(rows))).any():
        modes = plain(rows.T)
    link = chain.frame_link
    return Links(plain(chain.fractions), modes, -1 if link is None else link)


def _plain_springs(springs: JointSprings) -> JointSprings:
    """Return springs as kernels take them, with stiffness 0 of prescribed joints."""
    return JointSprings(
        plain(springs.rows),
        springs.unknown.astype(np.int64),
        plain(springs.finite_stiffness),
        plain(springs.damping),
        plain(springs.rest),
        plain(springs.low),
        plain(springs.high),
        plain(springs.actuated),
    )


def _poses(pose: np.ndarray, xi: np.ndarray, dt: float, is_first: bool) -> np.ndarray:
    """Return the poses (N, 3, B) after N steps from a pose (3, B), at the velocities
    (N + 1, 3, B) before and after them; the first step of all does not move."""
    mean = (xi[:-1] + xi[1:]) / 2
    if is_first:
        mean[0] = 0.0
    heading = np.cumsum(np.concatenate([pose[None, 2], dt * mean[:, 2]]), 0)
    # From poses that have their heading already, for all steps at once.
    turned = np.zeros_like(mean)
    turned[:, 2] = heading[:-1]
    moved = integrated_pose(turned.swapaxes(0, 1), mean.swapaxes(0, 1), dt)
    places = np.concatenate([pose[None, :2], moved[:2].swapaxes(0, 1)]).cumsum(0)
    return np.concatenate([places[1:], heading[1:, None]], 1)
