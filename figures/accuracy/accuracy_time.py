"""Accuracy against computing time: the displacement of the built-in swimmer by every
tier, by NumPy and compiled code, with and without its error estimate, compared with two
programs that do not use this package.

Each point is computed from five amplitudes. A few phases per cycle may happen to meet
the kinks of dry friction well or badly. The direct tier and the other programs
therefore begin the cycle at several first phases, and the bands show the range over
these phases.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable

import numpy as np

import geomech
from figures import main, peers, style
from figures.accuracy.cost_scaling import NAMES, backends
from geomech import plots
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.scenes import load
from geomech.studies.displacement.tiered import AMPLITUDE_FRACTIONS
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables
from rft import Granular
from rft.balance.backend import preferring
from rft.formulas import se2

SCENE = "three-link-glass"
PHASES = (8, 16, 32, 64, 128, 256, 512)
FEWEST = 32  # phases of an error estimate
FINE = 6144  # phases of the truth, a multiple of all counts of phases and first phases
PEERS = {
    "a loop of fsolve, 20 midpoints per link": (peers.by_fsolve, (8, 16, 32)),
    "a plain loop compiled by numba": (None, PHASES),
}
TIERS = {
    "adapted: curves": "adapted tier",
    "harmonic: grid": "harmonic tier",
    "path: grid": "path tier",
    "area: grid": "area tier",
}


def compute(
    phases: tuple[int, ...] = PHASES,
    starts: int = 12,
    runs: int = 12,
    tiers: bool = True,
) -> dict:
    """Return errors (body lengths, rms over amplitudes) and CPU seconds.

    direct: {back end: {"phases", "error" (P, starts), "seconds" (P,)}}. estimated:
    {back end: {"phases", "seconds"}}, with the error estimate. peers: {name: as of
    direct}. tiers: {back end: {label: {"value", "error", "seconds"}}}. Times are the
    shortest of ``runs``, in which all but the tiers take turns; those of starts other
    than the first are not taken."""
    scene = load(SCENE)
    scene = scene.changed(medium=Granular(peers.C, peers.GAMMA0))
    amplitudes = scene.gait.amplitude * AMPLITUDE_FRACTIONS
    with preferring(backends()[-1]):
        truth = Truth(scene.with_numerics(regularisation=1e-9), amplitudes)
    found: dict = {"direct": {}, "estimated": {}, "peers": {}, "tiers": {}}
    for name in backends():
        with preferring(name):
            found["direct"][name] = by_direct_tier(
                name, scene, amplitudes, truth, phases, starts
            )
            found["estimated"][name] = with_estimates(name, scene, amplitudes, phases)
            if tiers:
                found["tiers"][name] = by_tiers(scene, runs)
    for name, (solve, counts) in PEERS.items():
        if solve is None and "numba" not in backends():
            continue
        if solve is None:
            from figures.plain_loop import solve
        counts = [n for n in counts if n in phases]
        found["peers"][name] = by_peer(solve, scene, amplitudes, truth, counts, starts)
    rows = [*found["direct"].values(), *found["estimated"].values()]
    time_in_turn([*rows, *found["peers"].values()], runs)
    return found


class Truth:
    """Net poses of cycles that begin at any of FINE phases."""

    def __init__(self, scene, amplitudes):
        self.alpha, self.alphadot = scene.gait.cycle(FINE, amplitudes)
        self.xi = scene.system.velocity(self.alpha, self.alphadot)

    def net(self, first: int) -> np.ndarray:
        """Return the net poses (B, 3) of cycles that begin with the phase ``first``."""
        return displacement(np.roll(self.xi, -first, 1))

    def error(self, net: np.ndarray, first: int) -> float:
        """Return the rms distance over amplitudes of net poses from the true ones."""
        return float(np.sqrt(np.mean(estimate.distance(net, self.net(first)) ** 2)))


def time_in_turn(rows: list[dict], runs: int) -> None:
    """Replace the "calls" of each row by "seconds": CPU seconds of the quickest of
    several runs, in which all calls take turns, so that all meet the same moods of the
    machine."""
    for row in rows:
        row["seconds"] = [np.inf] * len(row["calls"])
    for _ in range(runs):
        for row in rows:
            for k, call in enumerate(row["calls"]):
                start = time.process_time()
                call()
                took = time.process_time() - start
                row["seconds"][k] = min(row["seconds"][k], took)
    for row in rows:
        del row["calls"]


def by_backend(name: str, call: Callable):
    """Return the result of a call by a back end."""
    with preferring(name):
        return call()


def first_phases(count: int, starts: int) -> list[int]:
    """Return numbers of first phases among FINE, evenly within the first of ``count``
    steps."""
    return [FINE * k // (count * starts) for k in range(starts)]


def by_direct_tier(name, scene, amplitudes, truth, phases, starts) -> dict:
    """Return errors and calls of the direct tier by a back end."""
    errors = []
    calls = []
    for count in phases:
        one = scene.with_numerics(phases=count)
        row = []
        for first in first_phases(count, starts):
            part = slice(first, None, FINE // count)
            run = one.system.run(truth.alpha[:, part], truth.alphadot[:, part])
            row.append(truth.error(run.net, first))
        errors.append(row)

        def answer(one=one):
            return SceneTables(one).poses("direct", None, amplitudes)

        calls.append(functools.partial(by_backend, name, answer))
    return {"phases": list(phases), "error": errors, "calls": calls}


def with_estimates(name, scene, amplitudes, phases) -> dict:
    """Return calls of the direct tier with its error estimate by a back end."""
    counts = [count for count in phases if count >= FEWEST]
    calls = []
    for count in counts:
        answer = functools.partial(
            estimate.direct, scene, scene.gait, amplitudes, count
        )
        calls.append(functools.partial(by_backend, name, answer))
    return {"phases": counts, "calls": calls}


def by_tiers(scene, runs) -> dict:
    """Return values, errors and seconds of the settings of other tiers."""
    result = geomech.accuracy(scene, runs=runs)
    found = {}
    for k, setting in enumerate(result["setting"].values):
        label = TIERS.get(str(setting))
        if label is None:
            continue
        is_run = np.isfinite(result["value"].values[k])
        found[label] = {
            name: result[name].values[k][is_run].tolist()
            for name in ("value", "error", "seconds")
        }
    return found


def by_peer(solve, scene, amplitudes, truth, counts, starts) -> dict:
    """Return errors and calls of another program, whose velocities are those of the
    middle link and are integrated as ours are."""

    def nets(count, first):
        part = slice(first, None, FINE // count)
        found = []
        for alpha, alphadot in zip(truth.alpha[:, part], truth.alphadot[:, part]):
            net = displacement(solve(alpha, alphadot))
            found.append(in_mean_frame(net, alpha[0]))
        return np.array(found)

    errors = []
    calls = []
    for count in counts:
        begun = first_phases(count, starts)
        errors.append([truth.error(nets(count, first), first) for first in begun])
        calls.append(functools.partial(nets, count, 0))
    return {"phases": counts, "error": errors, "calls": calls}


def in_mean_frame(net: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Return the net pose (3,) of the mean frame from that of the middle link, with the
    shape at the start of the cycle."""
    half = peers.HALF
    low = np.array([-half * (1 + np.cos(alpha[0])), half * np.sin(alpha[0])])
    high = np.array([half * (1 + np.cos(alpha[1])), half * np.sin(alpha[1])])
    place = (low + high) / 3
    mean = np.array([*place, (alpha[1] - alpha[0]) / 3])
    return se2.compose(se2.inverse(mean), se2.compose(net, mean))


# Looks by program: colour and marker.
LOOKS = {"numpy": (style.BLUE, "o"), "numba": (style.VERMILION, "s")}
PEER_LOOKS = (("0.5", "x"), (style.BLACK, "^"))
TIER_LOOKS = {
    "direct tier": (style.VERMILION, "s"),
    "adapted tier": (style.PINK, "D"),
    "harmonic tier": (style.GREEN, "^"),
    "path tier": (style.BLACK, "v"),
    "area tier": ("0.55", "<"),
}
MARKED = (8, 32, 128, 512)  # phases that are written beside a curve


@plots.styled
def draw(numbers: dict):
    """Draw the force balance by several programs at the left, tiers at the right."""
    fig, axes = plots.figure(8.6, 4.6, 2)
    left, right = axes[0]
    right.sharex(left)
    right.sharey(left)
    for name, found in numbers["direct"].items():
        label = f"direct tier, {NAMES[name]}"
        draw_band(left, found, label, *LOOKS[name])
        draw_estimated(left, found, numbers["estimated"][name], *LOOKS[name])
    for look, (name, found) in zip(PEER_LOOKS, numbers["peers"].items()):
        draw_band(left, found, name, *look)
    write_phases(left, [*numbers["direct"].values()][-1])
    style.add_entry(left, "with its error estimate", ls="--", marker="s", mfc="white")
    left.set(title="the force balance", ylabel="error of the displacement (BL)")

    draw_tiers(right, numbers)
    right.set_title("the tiers, with their tables")
    for ax in (left, right):
        ax.set_xlabel("CPU time for five amplitudes (s)")
        style.draw_grid(ax)
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16))
    low, high = left.get_xlim()
    left.set_xlim(0.4 * low, high)
    return fig


def draw_tiers(ax, numbers: dict) -> None:
    """Draw errors of the tiers against seconds, of NumPy with open markers."""
    names = [*numbers["direct"]]
    for name in names:
        direct = numbers["direct"][name]
        median = np.median(direct["error"], 1)
        lines = {"direct tier": {"error": median, "seconds": direct["seconds"]}}
        for label, found in (lines | numbers["tiers"].get(name, {})).items():
            colour, marker = TIER_LOOKS[label]
            look = {"color": colour, "marker": marker, "ms": 4}
            if name == names[-1]:
                look["label"] = label
            else:
                look |= {"mfc": "white", "ls": ":"}
            ax.loglog(found["seconds"], found["error"], **look)
    if len(names) > 1:
        style.add_entry(ax, "the same by NumPy", ls=":", marker="o", mfc="white")


def draw_band(ax, found: dict, label: str, colour: str, marker: str) -> None:
    """Draw the median error over first phases against seconds, and the band of all."""
    error = np.array(found["error"])
    seconds = np.array(found["seconds"])
    ax.fill_between(seconds, error.min(1), error.max(1), color=colour, alpha=0.18, lw=0)
    middle = np.median(error, 1)
    ax.loglog(seconds, middle, color=colour, marker=marker, ms=5, label=label)


def draw_estimated(ax, found: dict, estimated: dict, colour: str, marker: str) -> None:
    """Draw the same errors against the seconds that they take with their estimate."""
    middle = np.median(found["error"], 1)
    rows = [found["phases"].index(count) for count in estimated["phases"]]
    look = {"color": colour, "marker": marker, "mfc": "white", "ls": "--", "ms": 4}
    ax.loglog(estimated["seconds"], middle[rows], **look)


def write_phases(ax, found: dict) -> None:
    """Write numbers of phases beside the points of a curve."""
    middle = np.median(found["error"], 1)
    for count, seconds, error in zip(found["phases"], found["seconds"], middle):
        if count in MARKED:
            text = f"{count} phases" if count == MARKED[0] else f"{count}"
            place = {"xytext": (-6, -4), "textcoords": "offset points"}
            ax.annotate(text, (seconds, error), ha="right", **style.NOTE, **place)


if __name__ == "__main__":
    main("accuracy_time", compute, draw)
