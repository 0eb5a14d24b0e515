"""Questions about whatever `geomech.scenes.parts.as_scene` takes for a scene, with results that show themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geomech.scenes.parts import as_scene
from geomech.studies import accuracy as accuracies


def accuracy(
    scene: Any, *, runs: int | None = None, progress: Callable | None = None
) -> dict[str, Any]:
    """Return error and seconds at every setting of a scene as a table; see `geomech.studies.accuracy.study`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", phases=32, grid=7)
    >>> table = geomech.accuracy(study.scene, runs=1)
    >>> sorted(table)
    ['amplitudes', 'cheapest', 'lines', 'scene', 'units']
    """
    return accuracies.study(as_scene(scene), progress, runs)
