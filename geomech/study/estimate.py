"""How far a displacement can be trusted, and the cheapest way to one that can be trusted far enough.

Every estimate is a refinement, never a constant: the direct tier against itself at half, a quarter and an eighth of the phases
and, on the quarter, with the regularisation ten times smaller and exact link integrals, or with pieces of half the
length; every other tier against the direct tier. Errors come in pairs: the distance between net positions, in body lengths,
and between net headings, in rad.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.errors import SceneError, is_number, short
from geomech.gaits import Gait
from geomech.reconstruct import displacement

if TYPE_CHECKING:
    from geomech.scene.model import Scene

CHECKED = (
    33  # amplitudes at which a look-up tier is compared with the direct one; between them the worse neighbour counts
)
FEWEST_STEPS = 64  # of a march that is refined: an eighth of them still makes one
REFERENCE_PHASES = 64  # of that comparison where no direct tier is asked for
MOST_PHASES = 1 << 16
MOST_PIECES = 10_000  # to a body length
FINEST_PIECES = 640  # that a tolerance asks for
SAFETY = 2.5  # covers the truth in more than 95 % of random scenes while the median estimate stays below ten errors


def distance(a, b) -> np.ndarray:
    """Between the positions of poses (..., 3)."""
    return np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1])


def apart(a, b, length: float) -> np.ndarray:
    """(..., 2): between the positions of poses (..., 3), over ``length``, and between their headings, rad."""
    return np.stack([distance(a, b) / length, np.abs(a[..., 2] - b[..., 2])], -1)


def direct(scene: Scene, gait: Gait, amplitudes: np.ndarray, phases: int) -> tuple[np.ndarray, np.ndarray]:
    """(poses (B, 3), errors (B, 2), body lengths and rad) of the direct tier; phases is rounded up to a multiple of 8,
    >= 32. Many amplitudes go in groups, so that memory is bounded."""
    poses, *errors = _in_groups(scene, gait, amplitudes, phases)
    return poses, sum(errors)


def _in_groups(scene: Scene, gait: Gait, amplitudes: np.ndarray | None, phases: int):
    if amplitudes is None:
        return _direct(scene, gait, None, phases)
    size = scene.at_once(phases)
    groups = [amplitudes[k : k + size] for k in range(0, max(1, len(amplitudes)), size)]
    return tuple(np.concatenate(x) for x in zip(*(_direct(scene, gait, some, phases) for some in groups)))


def _direct(scene: Scene, gait: Gait, amplitudes: np.ndarray | None, phases: int):
    """(poses, errors of all but the pieces of body, errors of these) of the direct tier."""
    phases = max(32, 8 * -(-phases // 8))
    marching = scene.engine != "algebraic"
    shapes = gait.cycle(max(FEWEST_STEPS, phases) if marching else phases, amplitudes)
    every = [tuple(x[..., ::step, :] for x in shapes) for step in (8, 4, 2, 1)]
    run = scene.run(*shapes)
    if marching:  # a step rests on the one before: fewer phases are another march
        eighth, coarse, half, full = *(scene.run(*fewer).net for fewer in every[:3]), run.net
    else:
        eighth, coarse, half, full = (displacement(run.xi[..., ::step, :]) for step in (8, 4, 2, 1))
    error = _left(
        *(apart(*pair, scene.body.length) for pair in ((coarse, eighth), (half, coarse), (full, half))),
        marching or scene.medium.dry != (),
    )
    error += 2 * np.pi * (run.residual * run.speed)[:, None]
    if finer := finer_model(scene):
        error += 1.2 * apart(finer.run(*every[1]).net, coarse, scene.body.length)
    error += np.asarray(run.to_come)[..., None]
    return full, error, pieces_error(scene, shapes, every[1], coarse)


def pieces_error(scene: Scene, shapes, fewer, coarse: np.ndarray) -> np.ndarray:
    """(B, 2), body lengths and rad: what pieces that are no shorter leave of the effects that vary along an element.

    fewer: a quarter of the phases of ``shapes``, where pieces of half the length are compared with ``coarse``, the poses
    there. Which pieces the pivots lie in is chance, so the error is of order 2 in the mean only: half of the pieces against a
    quarter, at all phases, shows what that may hide.
    """
    pieces = scene.pieces
    if not pieces:
        return np.zeros((*coarse.shape[:-1], 2))
    net = lambda n, cycle: scene.with_numerics(pieces=min(max(1, n), MOST_PIECES)).run(*cycle).net
    length = scene.body.length
    doubled = apart(net(2 * pieces, fewer), coarse, length)
    chance = apart(net(pieces // 2, shapes), net(pieces // 4, shapes), length) / 8
    return 2.0 * np.maximum(doubled, chance)


def settling(scene: Scene) -> float:
    """Change of displacement still to come, body lengths and rad, at which its march ends; 0 where it need not settle."""
    return max(e.settles for e in scene.effects) if scene.settles else 0.0


def _left(d0, d1, d2, kinks: bool) -> np.ndarray:
    """Error left after three doublings that moved the answer by d0, d1, d2.

    If each shrinks the error by r, the last leaves d2 r / (1 - r). With kinks theory gives r = 1/4 (order 2) and the
    moves scatter, so r is not taken for less, nor a small last move at its word. SAFETY is set by the coverage test.
    """
    r = np.clip(np.sqrt(d2 / np.maximum(d0, 1e-300)), 0.25 if kinks else 0.0, 0.5)
    move = np.maximum.reduce([d2, d1 * r, d0 * r * r]) if kinks else d2
    return SAFETY * move * r / (1.0 - r)


def finer_model(scene: Scene) -> Scene | None:
    """The scene with its forces computed more exactly, None where they are exact already."""
    kind, _, count = scene.numerics.loads.partition(":")
    closed = scene.medium.dry is not None
    finer = {"loads": "exact" if closed else f"{kind}:{2 * int(count)}"} if kind != "exact" else {}
    if not scene.linear:
        finer["regularisation"] = max(scene.numerics.regularisation / 10, 1e-12)
    return scene.with_numerics(**finer) if finer else None


def against_direct(scene: Scene, poses, gait: Gait, amplitudes: np.ndarray, reference=None) -> np.ndarray:
    """Errors (B, 2), as in `direct`, of poses (B, 3) by any other tier. reference: (poses, errors) of the direct tier at
    the same amplitudes; computed at some of them if not given."""
    if reference is None:
        some = np.unique(np.linspace(0, len(amplitudes) - 1, CHECKED).round().astype(int))
        reference = direct(scene, gait, amplitudes[some], max(REFERENCE_PHASES, 8 * gait.harmonics))
    else:
        some = np.arange(len(amplitudes))
    at_some = apart(poses[some], reference[0], scene.body.length) + reference[1]
    left = np.searchsorted(some, np.arange(len(amplitudes)), side="right") - 1
    right = np.minimum(left + (some[left] < np.arange(len(amplitudes))), len(some) - 1)
    return np.maximum(at_some[left], at_some[right])


def solves(scene: Scene, method: str, count: int, phases: int) -> int:
    """Force balances that a tier needs for ``count`` amplitudes: its cost, look-ups being cheap beside it."""
    n = scene.numerics
    shapes = n.grid**scene.body.joints // (2 if scene.medium.mirror else 1)
    return {
        "area": shapes * scene.direction_count,
        "path": shapes * scene.direction_count,
        "adapted": n.curves * (n.phases // 2),
        "harmonic": shapes * scene.harmonic_directions,
        "direct": count * phases,
    }[method]


def cheapest(
    scene: Scene, amplitudes: Sequence[float], tol: float, gait: Gait | None = None, ask: Callable = lambda jobs: None
) -> dict:
    """{"amplitude", tier: [[x, y, theta], ...], "estimate": [...], "estimate_heading": [...], "tier", "settings",
    "seconds"}: the cheapest tier, and for the direct tier the fewest phases, with every estimated error of position at
    most ``tol`` body lengths.

    Look-up tiers are tried in the order of their cost as long as that is below the direct tier's. ask: told the jobs to
    come (`geomech.study.cost`) before each is done. SceneError if no tier gets there.
    """
    from geomech.study import cost

    if not (is_number(tol) and 0 < tol <= 1e300):
        raise SceneError(f"--tol must be a number > 0 in body lengths, got {short(tol)}")
    gait, amplitudes, start = gait or scene.gait, np.asarray(amplitudes, float), time.perf_counter()
    if tol <= settling(scene):
        raise SceneError(f"{scene.name}: a march with these effects repeats to {settling(scene):g} only: raise --tol")
    some = np.unique(np.linspace(0, len(amplitudes) - 1, min(CHECKED, 9)).round().astype(int))
    phases = max(32 if scene.engine == "algebraic" else FEWEST_STEPS, 8 * gait.harmonics)
    if scene.lookups:
        pilot, settings = _refined(scene, gait, amplitudes[some], tol / 4, phases, ask)
        phases = settings["phases"]
    for method in sorted(scene.lookups, key=lambda m: solves(scene, m, len(amplitudes), phases)):
        if solves(scene, method, len(amplitudes), phases) >= solves(scene, "direct", len(amplitudes), phases):
            break
        ask([cost.built(scene, method, gait)])
        try:
            checked = scene.displacement(method, gait, amplitudes[some])
        except ValueError:  # the gait leaves the field or the family: this tier cannot say
            continue
        if (apart(checked, pilot[0], scene.body.length) + pilot[1])[:, 0].max() <= tol:
            poses = scene.displacement(method, gait, amplitudes)
            error = against_direct(scene, poses, gait, amplitudes)
            if error[:, 0].max() <= tol:
                return _answer(method, amplitudes, poses, error, {"grid": scene.numerics.grid}, start)
    (poses, error), settings = _refined(scene, gait, amplitudes, tol, phases, ask)
    if error[:, 0].max() > tol:
        found = " and ".join(f"{n} {name}" for name, n in settings.items())
        raise SceneError(
            f"{scene.name}: no tier gets to {tol:g} body lengths (best estimate {error[:, 0].max():.1e} with {found}): "
            "raise --tol, or lower [numerics] regularisation and tolerance"
        )
    return _answer("direct", amplitudes, poses, error, settings, start)


def _refined(scene: Scene, gait: Gait, amplitudes, tol: float, phases: int, ask: Callable):
    """The direct tier at twice the phases, or the pieces of body where these leave more, again and again, for the
    amplitudes that need it, until all positions are within ``tol`` or doubling stops helping. Returns (poses, errors) and
    {"phases": ..., "pieces": ... where there are any}."""
    from geomech.study import cost

    ask(cost.direct(scene, gait, len(amplitudes), phases))
    poses, error, of_pieces = _in_groups(scene, gait, amplitudes, phases)
    error, open_, pieces = error + of_pieces, np.arange(len(amplitudes)), scene.numerics.pieces
    while (worse := open_[error[open_, 0] > tol]).size:
        coarse_pieces = of_pieces[worse, 0].max() > 0.5 * error[worse, 0].max()
        if (2 * pieces > FINEST_PIECES) if coarse_pieces else (2 * phases > MOST_PHASES):
            break
        pieces, phases = (2 * pieces, phases) if coarse_pieces else (pieces, 2 * phases)
        finer_scene = scene.with_numerics(pieces=pieces)
        ask(cost.direct(finer_scene, gait, len(worse), phases))
        finer, now, left = _in_groups(finer_scene, gait, amplitudes[worse], phases)
        stalled = (now + left > 0.9 * error[worse])[:, 0].all() and phases > 1024
        poses[worse], error[worse], of_pieces[worse], open_ = finer, now + left, left, worse
        if stalled:
            break
    return (poses, error), {"phases": phases, **({"pieces": pieces} if scene.pieces else {})}


def _answer(method, amplitudes, poses, error, settings, start) -> dict:
    return {
        "amplitude": amplitudes.tolist(),
        method: poses.tolist(),
        "estimate": error[:, 0].tolist(),
        "estimate_heading": error[:, 1].tolist(),
        "tier": method,
        "settings": settings,
        "seconds": {method: time.perf_counter() - start},
    }
