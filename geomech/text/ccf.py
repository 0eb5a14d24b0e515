"""The CCF of a scene in lines: its extremes and where they are, its zero line, and its integral over the scene's gait."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geomech.core.summary import POSE, grid, spans, zero_words
from geomech.core.variables import Result
from geomech.geometry.field import Field
from geomech.studies.shape_space import Space
from rft.refusal import in_line

ROUNDING = 1e-12  # largest size of a component that is nothing but roundoff
RAYS, STEPS = (
    72,
    200,
)  # directions from the gait's middle in which the zero line is looked for, and places along each


def text(result: Result) -> str:
    """Return the extremes of each component with their places and errors, or of slices their ranges."""
    space: Space = result.subject
    scene = space.study.scene
    lines = [
        f"{in_line(scene.name)}: CCF in the frame {scene.frame}, positive for counter-clockwise loops"
    ]
    if space.planes:
        axes = space.planes[0].ccf.axes
        unit = f"x and y in {space.planes[0].ccf.unit}/rad2, theta in rad/rad2"
        lines += [f"slices: {grid(axes, ('the first', 'the second joint'))}", unit]
        return "\n".join(
            [
                *lines,
                *(
                    f"{v.label.removeprefix('CCF of ')}: {spans(v.values)}"
                    for v in result.variables
                ),
            ]
        )
    ccf, error = space.study.curvature, space.study.curvature_error
    lines += [
        f"grid: {grid(ccf.axes)}",
        *_extremes(ccf, error),
        *_zero_line(ccf, scene.gait.middle),
    ]
    return "\n".join([*lines, *_integral(space)])


def _extremes(ccf: Field, error: Field) -> Iterator[str]:
    """Yield a row a component: least and largest value with their shapes, and the larger error there."""
    yield f"{'component':16}{'least':>10}  {'at (rad)':>14}{'largest':>12}  {'at (rad)':>14}  {'+- error':>8}"
    for row, values, errors in zip(("x", "y", "theta"), ccf.values, error.values):
        name = f"{row} ({'rad' if row == 'theta' else ccf.unit}/rad2)"
        if np.nanmax(np.abs(values), initial=0.0) < ROUNDING:
            yield f"{name:16}{'zero':>10}"
            continue
        places = [
            np.unravel_index(find(values), values.shape)
            for find in (np.nanargmin, np.nanargmax)
        ]
        cells = (f"{values[at]:10.4g}  {_shape(ccf, at):>14}" for at in places)
        yield f"{name:16}{'  '.join(cells)}  {max(errors[at] for at in places):8.1e}"


def _shape(field: Field, at: tuple) -> str:
    return ", ".join(f"{axis[k] + 0.0:.2f}" for axis, k in zip(field.axes, at))


def _zero_line(ccf: Field, middle: np.ndarray) -> list[str]:
    """Return how far from the gait's middle the x component changes sign."""
    x = Field(ccf.axes, ccf.values[0], ccf.degree)
    if x.masked or np.abs(x.values).max() < ROUNDING:
        return []
    if not x.values.min() < 0 < x.values.max():
        return ["zero line of x: none, x has one sign"]
    room = min(min(a[-1] - m, m - a[0]) for a, m in zip(x.axes, middle))
    angles, steps = (
        2 * np.pi * np.arange(RAYS) / RAYS,
        np.linspace(0.02, 1, STEPS) * room,
    )
    rays = np.stack([np.cos(angles), np.sin(angles)], -1)[:, None] * steps[:, None]
    changed = np.diff(np.sign(x(middle + rays)), axis=1) != 0
    if not changed.any():
        return [f"zero line of x: further than {room:.3g} rad from the gait's middle"]
    first = steps[changed.argmax(1)[changed.any(1)]]
    some = (
        ""
        if changed.any(1).all()
        else f", in {100 * changed.any(1).mean():.0f} % of directions"
    )
    return [
        f"zero line of x: {first.min():.2g} to {first.max():.2g} rad from the gait's middle{some}"
    ]


def _integral(space: Space) -> Iterator[str]:
    """Yield the displacement of the scene's gait by the area that it encloses, with its error against the direct tier."""
    table = space.enclosed
    if table is None:
        return
    zero = table.attributes["zero_by_symmetry"]
    moved = [
        f"{v.name} {round(v.values[0, 0], 9) + 0.0:.4g} +- {v.error[0, 0]:.1g} {v.unit}"
        for v in (table[name] for name in POSE if name not in zero)
    ]
    yield f"integral over the scene's gait, of amplitude {table['amplitude'].values[0]:g} (the area tier):"
    yield "  " + "; ".join([*([", ".join(moved)] if moved else []), *zero_words(zero)])
