"""The table of a study: net poses by tier with their errors, every number under a name and with a unit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geomech.gaits import Gait
from geomech.geometry.field import UNTOLD
from geomech.scene.model import Scene, frequency_of
from geomech.systems.base import length_unit

ERRORS = ("estimate", "estimate_heading")
QUANTITIES = ("x", "y", "heading", "net_distance")  # of a pose


def of_pose(poses) -> dict[str, np.ndarray]:
    """QUANTITIES (...,) of net poses (..., 3); the net distance is the length of (x, y)."""
    x, y, heading = np.moveaxis(np.asarray(poses, float), -1, 0)
    return {"x": x, "y": y, "heading": heading, "net_distance": np.hypot(x, y)}


def table(scene: Scene, gait: Gait, amplitudes, poses: Mapping, errors: Mapping, medium=None, **more) -> dict:
    """{"amplitude": [...], tier: [[x, y, theta], ...], "estimate": {tier: [...]}, "estimate_heading": {tier: [...]}, "x",
    "y", "heading" and "net_distance": {tier: [...]}, "body_length", "units": {key: unit}, and ``more``}. All lengths of the
    table are in the system's unit, as its "units" say, the body's and those of errors too.

    poses: (B, 3) by tier. errors: (B, 2) by tier, as `geomech.study.estimate` gives them, in body lengths and rad: of the
    position, which bounds those of x, y and the net distance, and of the heading. Where the swimmer has a frequency (Hz),
    also "frequency", and by tier "speed", the net distance times it, "speed_body_lengths", the same in body lengths a
    second, and "turning_rate" (rad/s).

    medium: None, or what the uncertainty of the medium does to the true displacement, and so to every tier's
    (`geomech.study.uncertainty.of_medium`): "medium_error" {tier: [...]}, of the position,
    "medium_error_heading" {tier: [...]}, rad, "medium_error_of" {one of QUANTITIES: [...]}, each in its own unit,
    "medium_shift_of", alike, by how much it shifts the mean, and "medium_error_rule" [...].
    Of a measured gait "estimate_is" says in words what the estimates leave out.
    """
    unit, length, frequency = length_unit(scene.system), scene.system.length, frequency_of(scene.system, gait)
    found = {m: of_pose(p) for m, p in poses.items()}
    units = {"amplitude": gait.amplitude_label, **dict.fromkeys(("x", "y", "net_distance"), unit), "heading": "rad"}
    units |= {"estimate": unit, "estimate_heading": "rad", "body_length": unit, "seconds": "s"}
    units |= {"surface_spread": unit, "surface_spread_heading": "rad"} if "surface_spread" in more else {}
    if frequency is not None:
        units |= {"frequency": "Hz", "speed": f"{unit}/s", "speed_body_lengths": "BL/s", "turning_rate": "rad/s"}
        more = {"frequency": frequency, **_speeds(found, frequency, length), **more}
    if said := getattr(gait, "estimate_is", ""):
        more = {"estimate_is": said, **more}
    if medium is not None:
        units |= {"medium_error": unit, "medium_error_heading": "rad", "medium_error_of": "that of the quantity"}
        units["medium_shift_of"] = units["medium_error_of"]
        more = {**_of_medium(medium, tuple(poses)), **more}
    return {
        "amplitude": np.asarray(amplitudes, float).tolist(),
        **{m: np.asarray(p).tolist() for m, p in poses.items()},
        **{
            key: {m: (e[:, k] * by).tolist() for m, e in errors.items()}
            for key, k, by in zip(ERRORS, (0, 1), (length, 1.0))
        },
        **{key: {m: x[key].tolist() for m, x in found.items()} for key in QUANTITIES},
        "body_length": float(length),
        "units": units,
        **more,
    }


def of_choices(choices: Mapping) -> dict:
    """{"surface_spread": {tier: [...]}, "surface_spread_heading": {tier: [...]}}, the system's unit and rad, of tiers whose
    answer hangs on the surface that a loop of three and more joints spans (B, 2); nothing for none."""
    keys = ("surface_spread", "surface_spread_heading") if choices else ()
    return {key: {m: c[:, k].tolist() for m, c in choices.items()} for k, key in enumerate(keys)}


def _speeds(found: Mapping, frequency: float, length: float) -> dict:
    times = lambda key, by: {m: (x[key] * by).tolist() for m, x in found.items()}
    return {
        "speed": times("net_distance", frequency),
        "speed_body_lengths": times("net_distance", frequency / length),
        "turning_rate": times("heading", frequency),
    }


def _of_medium(medium: Mapping, methods: tuple[str, ...]) -> dict:
    return {
        "medium_error": dict.fromkeys(methods, medium["position"].tolist()),
        "medium_error_heading": dict.fromkeys(methods, medium["heading"].tolist()),
        "medium_error_of": {q: medium[q].tolist() for q in QUANTITIES},
        "medium_shift_of": {q: medium["shift"][q].tolist() for q in QUANTITIES},
        "medium_error_rule": medium["rule"],
    }


def error_of(table: Mapping, quantity: str, tier: str) -> np.ndarray:
    """The estimated error (B,) of one of QUANTITIES, in its own unit."""
    return np.array(table[ERRORS[quantity == "heading"]][tier], float)


def unit_of(table: Mapping, quantity: str) -> str:
    """The unit of one of QUANTITIES, of a table that may be a user's own."""
    return "rad" if quantity == "heading" else table.get("units", {}).get(quantity, UNTOLD)
