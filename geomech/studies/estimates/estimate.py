"""Estimates of the error of displacements.

Every estimate is a refinement, never a constant: the direct tier against itself at
half, a quarter and an eighth of the phases and, on the quarter, with the regularisation
ten times smaller and exact link integrals, with pieces of half the length, or with half
and a quarter of the elements of a continuous body
(`geomech.studies.estimates.elements`); a table against half of its grid, and by the
residual of its fit (`System.table_error`); every other tier against the direct tier.
Errors come in pairs: the distance between net positions, in body lengths, and between
net headings, in rad."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.capabilities import (
    gaits_per_batch,
    is_closed,
    pieces_per_length,
    refined,
    table_error,
)
from geomech.runs.runner import runner
from geomech.scenes.model import Scene
from geomech.studies.estimates import elements
from rft.core.premise import Premise
from rft.core.refusal import located

# Amplitudes at which a look-up tier is compared with the direct one. Between two of
# them the larger error counts.
N_COMPARED = 33
REFERENCE_PHASES = 64  # of that comparison, without the direct tier in the request
MIN_STEPS = 64  # of time stepping: an eighth of them still resolves a gait
MAX_PIECES = 10_000  # per body length
# Covers the truth in more than 95 % of random scenes, while the median estimate stays
# below ten errors.
SAFETY = 2.5
# Factor by which twice the phases multiply the error of links that stick, by theory.
STICKING = 0.25
# The same factor of heavy bodies that stick and slip, each cycle of which begins with
# another slip: errors fall by a third on average, and scatter so that single changes
# are small by chance. It covers 180 headings and positions of random circles of 32
# masses in three dry media; with 0.25 headings were wrong by up to six times the
# estimate.
STICK_SLIP = 0.45
# Times the difference from a smaller regularisation and exact integrals, which is
# nearly all of the error.
FACTOR_TO_EXACT = 1.2
# Times the difference between two quadrature rules, of order 1 in dry media.
# Differences of position and heading scatter: at least half of the larger one counts
# for both.
FACTOR_BETWEEN_RULES = 3.5
ROUNDING = 2e-16  # of a velocity


def distance(a, b) -> np.ndarray:
    """Return the distance between the positions of poses (..., 3)."""
    return np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1])


def pose_distance(a, b, length: float) -> np.ndarray:
    """Return the distances (..., 2) between poses (..., 3): of positions over
    ``length``, and of headings, rad."""
    return np.stack([distance(a, b) / length, np.abs(a[..., 2] - b[..., 2])], -1)


def evenly_spaced(size: int, count: int) -> np.ndarray:
    """Return up to ``count`` indices of ``size`` items, evenly spaced from first to
    last."""
    return np.unique(np.linspace(0, size - 1, count).round().astype(int))


def every_nth_phase(
    step: int, shapes: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return alpha and alphadot (..., N, d) at every ``step``-th phase."""
    alpha, alphadot = shapes
    return alpha[..., ::step, :], alphadot[..., ::step, :]


def direct(
    scene: Scene, gait: Gait, amplitudes: np.ndarray, phases: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return poses (B, 3) and errors (B, 2), body lengths and rad, of the direct tier.

    phases: rounded up to a multiple of 8, at least 32. Many amplitudes are computed in
    groups, so that memory is bounded."""
    poses, *parts = direct_with_error_parts(scene, gait, amplitudes, phases)
    return poses, sum(parts)


def direct_with_error_parts(
    scene: Scene, gait: Gait, amplitudes: np.ndarray | None, phases: int
) -> tuple[np.ndarray, ...]:
    """Return what `direct` returns, with the error in three parts (B, 2): of phases and
    balances, of the pieces of the body, and of its elements.

    amplitudes: None for the gait's own."""
    groups: list[np.ndarray | None] = [None]
    if amplitudes is not None:
        size = gaits_per_batch(scene.system, phases)
        starts = range(0, max(1, len(amplitudes)), size)
        groups = [amplitudes[k : k + size] for k in starts]

    compute = partial(runner().call, _direct_group)
    if scene.system.traits.steps:  # time stepping stores its own checkpoints
        compute = _direct_group
    with located(scene.name):
        parts = [compute(scene, gait, group, phases) for group in groups]
    return tuple(np.concatenate(arrays) for arrays in zip(*parts))


def _direct_group(
    scene: Scene, gait: Gait, amplitudes: np.ndarray | None, phases: int
) -> tuple[np.ndarray, ...]:
    """Return what `direct_with_error_parts` does, for amplitudes that fit one batch."""
    system = scene.system
    phases = max(32, 8 * -(-phases // 8))
    if system.traits.steps:
        phases = max(MIN_STEPS, phases)
    shapes = gait.cycle(phases, amplitudes)
    quarter = every_nth_phase(4, shapes)

    run = system.run(*shapes)
    nets = [*_nets_with_fewer_phases(system, shapes, run), run.net]
    quarter_net = nets[1]
    length = body_size(system)
    changes = [
        pose_distance(finer, coarser, length) for coarser, finer in pairwise(nets)
    ]
    error = _remaining_error(*changes, _slowest_gain(system))
    roundoff = np.maximum(run.residual, ROUNDING) * run.speed
    error += 2 * np.pi * roundoff[:, None]
    error += _model_error(system, quarter, run.xi[..., ::4, :], quarter_net)
    still_to_come = np.asarray(run.to_come)[..., None]
    error += still_to_come + table_error(system, *every_nth_phase(2, shapes))
    if system.traits.jumps:
        error += jump_error(run.xi, length)

    by_pieces = pieces_error(scene, shapes, quarter, quarter_net)
    by_elements = elements_error(system, quarter, quarter_net)
    return run.net, error, by_pieces, by_elements


def jump_error(xi: np.ndarray, length: float) -> np.ndarray:
    """Return the error (..., 2), body lengths and rad, from jumps of the velocity xi
    (..., N, 3) that fall between two phases.

    A sum over phases places a jump by half a step at most from where it is. What a
    step changes beyond the two steps beside it counts as a jump: a smooth change does
    not."""
    step = 2 * np.pi / xi.shape[-2]
    changes = np.diff(xi, axis=-2, append=xi[..., :1, :])
    position = np.linalg.norm(changes[..., :2], axis=-1)
    heading = np.abs(changes[..., 2])

    def moved(change):
        beside = np.roll(change, 1, -1) + np.roll(change, -1, -1)
        return step / 2 * np.maximum(change - beside, 0.0).sum(-1)

    turned = moved(heading)
    # A heading that is off turns the rest of the path about the place of the jump.
    path = step * np.linalg.norm(xi[..., :2], axis=-1).sum(-1)
    distance = moved(position) + path * turned
    return np.stack([distance / length, turned], -1)


def _nets_with_fewer_phases(system, shapes, run) -> list[np.ndarray]:
    """Return the net poses at an eighth, a quarter and half of the phases of a run."""
    if system.traits.steps:
        # Each step depends on the one before: fewer phases are other steps.
        return [
            _coarse_poses(system, *every_nth_phase(step, shapes)) for step in (8, 4, 2)
        ]
    return [displacement(run.xi[..., ::step, :]) for step in (8, 4, 2)]


def _coarse_poses(system, alpha, alphadot) -> np.ndarray:
    """Return net poses by fewer time steps than the request has; a RuntimeError says
    so."""
    try:
        return system.run(alpha, alphadot).net
    except RuntimeError as error:
        raise RuntimeError(
            f"at {alpha.shape[-2]} phases, which the estimate of the error needs, "
            f"{error}, or raise [numerics] phases"
        ) from None


def _model_error(system, shapes, xi: np.ndarray, net: np.ndarray):
    """Return the error (B, 2) of the system's own approximations, from a finer model of
    it: 0 where there is none.

    shapes: phases at which both are compared, with the velocities ``xi`` and poses
    ``net`` there."""
    finer = refined(system)
    if not finer:
        return 0.0
    finer_net = finer.run(*shapes, start=xi).net
    difference = pose_distance(finer_net, net, body_size(system))
    if is_closed(system):
        return FACTOR_TO_EXACT * difference
    least = difference.max(-1, keepdims=True) / 2
    return FACTOR_BETWEEN_RULES * np.maximum(difference, least)


def elements_error(system, quarter, quarter_net: np.ndarray) -> np.ndarray:
    """Return the error (B, 2), body lengths and rad, from the finite number of elements
    of a continuous body; 0 for other systems.

    quarter: alpha and alphadot at a quarter of the phases, where bodies of fewer
    elements are compared with ``quarter_net``, the poses there."""
    if not elements.n_elements(system):
        return np.zeros((*quarter_net.shape[:-1], 2))
    alpha, alphadot = quarter

    def net(other, alpha, alphadot):
        if system.traits.steps:
            poses = _coarse_poses(other, alpha, alphadot)
        else:
            poses = other.run(alpha, alphadot).net
        return elements.mean_poses(other, poses, alpha[..., 0, :])

    return elements.error_by_elements(
        system,
        alpha,
        alphadot,
        elements.mean_poses(system, quarter_net, alpha[..., 0, :]),
        net,
        partial(pose_distance, length=body_size(system)),
    )


def pieces_error(scene: Scene, shapes, quarter, quarter_net: np.ndarray) -> np.ndarray:
    """Return the error (B, 2), body lengths and rad, from the finite length of the
    pieces into which effects cut elements; 0 where they cut none.

    quarter: a quarter of the phases of ``shapes``, where pieces of half the length are
    compared with ``quarter_net``, the poses there."""
    n_pieces = pieces_per_length(scene.system)
    if not n_pieces:
        return np.zeros((*quarter_net.shape[:-1], 2))
    length = body_size(scene.system)

    def net(count, cycle):
        count = min(max(1, count), MAX_PIECES)
        return scene.with_numerics(pieces=count).system.run(*cycle).net

    doubled = pose_distance(net(2 * n_pieces, quarter), quarter_net, length)
    # The error is of order 2 only on average, as it is chance in which pieces the
    # pivots lie. Half of the pieces against a quarter, at all phases, shows this
    # scatter.
    scatter = pose_distance(
        net(n_pieces // 2, shapes), net(n_pieces // 4, shapes), length
    )
    return 2.0 * np.maximum(doubled, scatter / 8)


def _slowest_gain(system) -> float:
    """Return the least factor by which twice the phases can be trusted to multiply the
    error."""
    if system.traits.smooth and not system.traits.steps:
        return 0.0
    is_heavy = system.traits.lacks & Premise.QUASI_STATIC
    if is_heavy and not system.traits.smooth:
        return STICK_SLIP
    return STICKING


def _remaining_error(d0, d1, d2, least: float) -> np.ndarray:
    """Return the error that remains after three doublings of the phases, which changed
    the answer by d0, d1 and d2.

    If each doubling multiplies the error by r, d2 r / (1 - r) remains after the last; r
    follows from the changes. Where links stick, theory gives r = 1/4 (order 2), but
    single changes scatter: r is then at least ``least``, and the largest of the three
    changes, each multiplied by the missing powers of r, stands for the last."""
    r = np.clip(np.sqrt(d2 / np.maximum(d0, 1e-300)), least, 0.5)
    change = d2
    if least:
        change = np.maximum.reduce([d2, d1 * r, d0 * r * r])
    return SAFETY * change * r / (1.0 - r)


def errors_from_direct(
    scene: Scene, poses, gait: Gait, amplitudes: np.ndarray, reference=None
) -> np.ndarray:
    """Return the errors (B, 2), as in `direct`, of poses (B, 3) by any other tier.

    reference: (poses, errors) of the direct tier at the same amplitudes. If None, these
    are computed at some amplitudes, and between two of them the larger error counts."""
    count = len(amplitudes)
    compared = np.arange(count)
    if reference is None:
        compared = evenly_spaced(count, N_COMPARED)
        phases = max(REFERENCE_PHASES, 8 * gait.harmonics)
        reference = direct(scene, gait, amplitudes[compared], phases)

    direct_poses, direct_errors = reference
    distances = pose_distance(poses[compared], direct_poses, body_size(scene.system))
    errors = distances + direct_errors
    lower = np.searchsorted(compared, np.arange(count), side="right") - 1
    is_between = compared[lower] < np.arange(count)
    upper = np.minimum(lower + is_between, len(compared) - 1)
    return np.maximum(errors[lower], errors[upper])
