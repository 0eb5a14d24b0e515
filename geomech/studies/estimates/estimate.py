"""Estimates of the error of displacements.

Every estimate is a refinement, never a constant: the direct tier against itself at half, a
quarter and an eighth of the phases and, on the quarter, with the regularisation ten times
smaller and exact link integrals, with pieces of half the length, or with half and a quarter
of the elements of a continuous body (`geomech.studies.estimates.elements`); a table against half of
its grid, and by the residual of its fit (`System.table_error`); every other tier against the
direct tier. Errors come in pairs: the distance between net positions, in body lengths, and
between net headings, in rad."""

from __future__ import annotations

from functools import partial

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
from geomech.run.runner import runner
from geomech.scenes.model import Scene
from geomech.studies.estimates import elements
from rft.core.premise import Premise
from rft.core.refusal import located

N_COMPARED = 33  # amplitudes at which a look-up tier is compared with the direct one; between them the worse neighbour counts
MIN_STEPS = (
    64  # of time stepping that is refined: an eighth of them still resolves a gait
)
REFERENCE_PHASES = 64  # of that comparison without the direct tier in the request
MAX_PIECES = 10_000  # per body length
SAFETY = 2.5  # covers the truth in more than 95 % of random scenes while the median estimate stays below ten errors
STICKING = (
    0.25  # factor of the error of links that stick from twice the phases, by theory
)
# Likewise of heavy bodies that stick and slip, whose cycles begin each with another slip: errors fall by a third on average
# and scatter so that single changes are small by chance. 180 headings and positions of random circles of 32 masses, in three
# dry media, are covered with it; with 0.25 headings were wrong by up to six times the estimate.
STICK_SLIP = 0.45
FACTOR_TO_EXACT = 1.2  # times the difference from smaller regularisation and exact integrals, which is nearly all of the error
# likewise between two rules, of order 1 in dry media; at least half of the larger of
# both, as they scatter
FACTOR_BETWEEN_RULES = 3.5
ROUNDING = 2e-16  # of a velocity


def distance(a, b) -> np.ndarray:
    """Return the distance between the positions of poses (..., 3)."""
    return np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1])


def pose_distance(a, b, length: float) -> np.ndarray:
    """Return (..., 2): distance of positions of poses (..., 3), over ``length``, and of headings, rad."""
    return np.stack([distance(a, b) / length, np.abs(a[..., 2] - b[..., 2])], -1)


def direct(
    scene: Scene, gait: Gait, amplitudes: np.ndarray, phases: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return poses (B, 3) and errors (B, 2), body lengths and rad, of the direct tier.

    phases is rounded up to a multiple of 8, >= 32. Many amplitudes are computed in groups, so that memory is bounded.
    """
    poses, *errors = direct_with_error_parts(scene, gait, amplitudes, phases)
    return poses, sum(errors)


def direct_with_error_parts(
    scene: Scene, gait: Gait, amplitudes: np.ndarray | None, phases: int
) -> tuple[np.ndarray, ...]:
    """Return poses, errors without those of the pieces and the elements of the body, and errors of either, of the direct
    tier. amplitudes: None for the gait's own."""
    size = gaits_per_batch(scene.system, phases)
    groups = (
        [None]
        if amplitudes is None
        else [amplitudes[k : k + size] for k in range(0, max(1, len(amplitudes)), size)]
    )
    compute = (
        _direct_group
        if scene.system.traits.steps
        else partial(runner().call, _direct_group)
    )  # time stepping stores its own checkpoints
    with located(scene.name):
        return tuple(
            np.concatenate(x)
            for x in zip(*(compute(scene, gait, group, phases) for group in groups))
        )


def _direct_group(
    scene: Scene, gait: Gait, amplitudes: np.ndarray | None, phases: int
) -> tuple[np.ndarray, ...]:
    """Return what `direct_with_error_parts` does, of one group."""
    phases = max(32, 8 * -(-phases // 8))
    system, stepping = scene.system, scene.system.traits.steps
    shapes = gait.cycle(max(MIN_STEPS, phases) if stepping else phases, amplitudes)
    strided = [tuple(x[..., ::step, :] for x in shapes) for step in (8, 4, 2, 1)]
    run = system.run(*shapes)
    if stepping:  # each step depends on the one before: fewer phases are other steps
        eighth, coarse, half, full = (
            *(_coarse_poses(system, *fewer) for fewer in strided[:3]),
            run.net,
        )
    else:
        eighth, coarse, half = (
            displacement(run.xi[..., ::step, :]) for step in (8, 4, 2)
        )
        full = run.net
    error = _remaining_error(
        *(
            pose_distance(*pair, body_size(scene.system))
            for pair in ((coarse, eighth), (half, coarse), (full, half))
        ),
        _slowest_gain(system),
    )
    error += 2 * np.pi * (np.maximum(run.residual, ROUNDING) * run.speed)[:, None]
    if finer := refined(system):
        difference = pose_distance(
            finer.run(*strided[1], start=run.xi[..., ::4, :]).net,
            coarse,
            body_size(scene.system),
        )
        error += (
            FACTOR_TO_EXACT * difference
            if is_closed(system)
            else FACTOR_BETWEEN_RULES
            * np.maximum(difference, difference.max(-1, keepdims=True) / 2)
        )
    error += np.asarray(run.to_come)[..., None] + table_error(system, *strided[2])
    pieces = pieces_error(scene, shapes, strided[1], coarse)
    return full, error, pieces, elements_error(system, strided[1], coarse)


def _coarse_poses(system, alpha, alphadot) -> np.ndarray:
    """Return poses by fewer time steps than the request has; a RuntimeError says so."""
    try:
        return system.run(alpha, alphadot).net
    except RuntimeError as error:
        raise RuntimeError(
            f"at {alpha.shape[-2]} phases, for the estimate of the error, {error}, or raise [numerics] phases"
        ) from None


def elements_error(system, fewer, coarse: np.ndarray) -> np.ndarray:
    """Return (B, 2), body lengths and rad: error from the finite number of elements of a continuous body; 0 of others.

    fewer: a quarter of the phases, where bodies of fewer elements are compared with ``coarse``, the poses there."""
    alpha, alphadot = fewer

    def net(other, *shapes):
        poses = (
            _coarse_poses(other, *shapes)
            if system.traits.steps
            else other.run(*shapes).net
        )
        return elements.mean_poses(other, poses, shapes[0][..., 0, :])

    if not elements.n_elements(system):
        return np.zeros((*coarse.shape[:-1], 2))
    return elements.error_by_elements(
        system,
        alpha,
        alphadot,
        elements.mean_poses(system, coarse, alpha[..., 0, :]),
        net,
        partial(pose_distance, length=body_size(system)),
    )


def pieces_error(scene: Scene, shapes, fewer, coarse: np.ndarray) -> np.ndarray:
    """Return (B, 2), body lengths and rad: error of effects that vary along an element, from the finite length of its
    pieces.

    fewer: a quarter of the phases of ``shapes``, where pieces of half the length are compared with ``coarse``, the
    poses there. Which pieces the pivots lie in is chance, so the error is of order 2 on average only: half of the
    pieces against a quarter, at all phases, shows how large this scatter is."""
    cut = pieces_per_length(scene.system)
    if not cut:
        return np.zeros((*coarse.shape[:-1], 2))
    net = lambda n, cycle: (
        scene.with_numerics(pieces=min(max(1, n), MAX_PIECES)).system.run(*cycle).net
    )
    length = body_size(scene.system)
    doubled = pose_distance(net(2 * cut, fewer), coarse, length)
    chance = pose_distance(net(cut // 2, shapes), net(cut // 4, shapes), length) / 8
    return 2.0 * np.maximum(doubled, chance)


def _slowest_gain(system) -> float:
    """Return the least factor by which twice the phases can be trusted to multiply the error."""
    if not (system.traits.steps or not system.traits.smooth):
        return 0.0
    heavy = system.traits.lacks & Premise.QUASI_STATIC
    return STICK_SLIP if heavy and not system.traits.smooth else STICKING


def _remaining_error(d0, d1, d2, least: float) -> np.ndarray:
    """Return the error after the last of three doublings of the phases, which changed the answer by d0, d1 and d2.

    If each doubling multiplies the error by r, the error after the last is d2 r / (1 - r), and r is estimated from the
    changes. Where links stick, theory gives r = 1/4 (order 2) but single changes scatter: r is then at least ``least``, and
    the largest of the three changes, each multiplied by the missing powers of r, stands for the last. SAFETY is set by
    the coverage test."""
    r = np.clip(np.sqrt(d2 / np.maximum(d0, 1e-300)), least, 0.5)
    move = np.maximum.reduce([d2, d1 * r, d0 * r * r]) if least else d2
    return SAFETY * move * r / (1.0 - r)


def errors_from_direct(
    scene: Scene, poses, gait: Gait, amplitudes: np.ndarray, reference=None
) -> np.ndarray:
    """Return errors (B, 2), as in `direct`, of poses (B, 3) by any other tier. reference: (poses, errors) of the direct
    tier at the same amplitudes; computed at some of them if None."""
    if reference is None:
        checked = np.unique(
            np.linspace(0, len(amplitudes) - 1, N_COMPARED).round().astype(int)
        )
        reference = direct(
            scene, gait, amplitudes[checked], max(REFERENCE_PHASES, 8 * gait.harmonics)
        )
    else:
        checked = np.arange(len(amplitudes))
    checked_errors = (
        pose_distance(poses[checked], reference[0], body_size(scene.system))
        + reference[1]
    )
    lower = np.searchsorted(checked, np.arange(len(amplitudes)), side="right") - 1
    upper = np.minimum(
        lower + (checked[lower] < np.arange(len(amplitudes))), len(checked) - 1
    )
    return np.maximum(checked_errors[lower], checked_errors[upper])
