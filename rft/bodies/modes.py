"""Modes of a chain: a few rows of joint angles that it moves in, as numbers or by name."""

from __future__ import annotations

import numpy as np

from rft.checks import in_range, real_array, require, shown

LARGEST = 1e3  # of an entry: angles of larger modes have few digits left
ROUNDING = 1e-12  # of the largest mode: one below it is nothing but rounding
DEPENDENT = 1e-9  # smallest singular value over the largest, of rows of unit length, that still tells modes apart


def checked(modes, waves, links: int) -> tuple[tuple[float, ...], ...] | str | None:
    """modes as tuples, a name or None as they are; ValueError if they are none of a chain of so many links."""
    if modes is None:
        require(waves is None, "waves are those of modes = 'serpenoid': add that, or drop waves")
        return None
    if isinstance(modes, str):
        require(modes == "serpenoid", f"modes must be rows of joint angles or 'serpenoid', got {shown(modes)}")
        if waves is not None:
            in_range("waves", waves, 1e-6, links / 2)
    else:
        require(waves is None, "waves are those of modes = 'serpenoid': drop waves, or the rows of modes")
        modes = tuple(map(tuple, _rows(modes, links - 1).tolist()))
    _independent(rows(modes, waves, links))
    return modes


def rows(modes, waves: float | None, links: int) -> np.ndarray:
    """(modes, joints): joint angles of each mode at amplitude 1. Those of a serpenoid of ``waves`` (1) on the body are the
    cosine and the sine of 2 pi waves k / links at joint k, from the tail."""
    if not isinstance(modes, str):
        return np.array(modes)
    phase = 2 * np.pi * (1.0 if waves is None else waves) * np.arange(1, links) / links
    return np.stack([np.cos(phase), np.sin(phase)])


def _rows(modes, joints: int) -> np.ndarray:
    array = real_array("modes", modes)
    good = array.ndim == 2 and len(array) > 0 and array.shape[1] == joints
    require(good, f"modes must be rows of {joints} joint angles, one row a mode, got {shown(modes)}")
    require(bool((np.abs(array) <= LARGEST).all()), f"modes must be finite and at most {LARGEST:g}, got {shown(modes)}")
    return array


def _independent(rows: np.ndarray) -> None:
    count, joints = rows.shape
    require(count <= joints, f"{count} modes of {joints} joints are linearly dependent: give at most {joints}")
    size = np.linalg.norm(rows, axis=1)
    if size.min() <= ROUNDING * size.max():
        raise ValueError(f"mode {size.argmin() + 1} is zero: it moves no joint, drop it")
    singular = np.linalg.svd(rows / size[:, None], compute_uv=False)
    require(
        singular[-1] > DEPENDENT * singular[0],
        f"the {count} modes are linearly dependent: one is made of the others, drop it or change waves",
    )
