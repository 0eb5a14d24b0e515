"""Modes of a chain: rows of joint angles whose amplitudes are its shape variables, as
numbers or by name."""

from __future__ import annotations

import numpy as np

from rft.core.checks import in_range, real_array
from rft.core.refusal import Refusal, require

LARGEST = 1e3  # of an entry: angles of larger modes have few digits left
ROUNDOFF = 1e-12  # of the largest mode: a smaller mode is roundoff
# smallest singular value over the largest, of rows of unit length, at which modes are
# dependent
DEPENDENT = 1e-9


def checked_modes(
    modes, waves, links: int
) -> tuple[tuple[float, ...], ...] | str | None:
    """Return modes as tuples, a name or None as they are; ValueError unless they are
    modes of a chain of ``links`` links."""
    if modes is None:
        require(
            waves is None,
            "waves apply only to modes = 'serpenoid'",
            instead="add modes = 'serpenoid', or remove waves",
        )
        return None
    if isinstance(modes, str):
        require(
            modes == "serpenoid",
            "modes must be rows of joint angles or 'serpenoid'",
            value=modes,
        )
        if waves is not None:
            in_range("waves", waves, 1e-6, links / 2)
    else:
        require(
            waves is None,
            "waves apply only to modes = 'serpenoid'",
            instead="remove waves, or replace the rows of modes",
        )
        modes = tuple(map(tuple, _checked_rows(modes, links - 1).tolist()))
    _require_independent(mode_rows(modes, waves, links))
    return modes


def mode_rows(modes, waves: float | None, links: int) -> np.ndarray:
    """Return the joint angles of each mode at amplitude 1, (modes, joints).

    The modes of a serpenoid are the cosine and the sine of 2 pi waves k / links at
    joint k, counted from the tail, with one wave on the body by default."""
    if not isinstance(modes, str):
        return np.array(modes)
    if waves is None:
        waves = 1.0
    phase = 2 * np.pi * waves * np.arange(1, links) / links
    return np.stack([np.cos(phase), np.sin(phase)])


def _checked_rows(modes, joints: int) -> np.ndarray:
    array = real_array("modes", modes)
    has_shape = array.ndim == 2 and len(array) > 0 and array.shape[1] == joints
    require(
        has_shape,
        f"modes must be rows of {joints} joint angles, with one row per mode",
        value=modes,
    )
    require(
        bool((np.abs(array) <= LARGEST).all()),
        f"modes must be finite and at most {LARGEST:g}",
        value=modes,
    )
    return array


def _require_independent(rows: np.ndarray) -> None:
    count, joints = rows.shape
    require(
        count <= joints,
        f"{count} modes of {joints} joints are linearly dependent",
        instead=f"give at most {joints}",
    )
    size = np.linalg.norm(rows, axis=1)
    if size.min() <= ROUNDOFF * size.max():
        raise Refusal(
            f"mode {size.argmin() + 1} is zero",
            because="it moves no joint",
            instead="remove it",
        )
    singular = np.linalg.svd(rows / size[:, None], compute_uv=False)
    require(
        singular[-1] > DEPENDENT * singular[0],
        f"the {count} modes are linearly dependent",
        because="one is a combination of the others",
        instead="remove it, or change waves",
    )
