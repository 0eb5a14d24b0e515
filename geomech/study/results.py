"""Results of a study and of a sweep: dicts, as JSON takes them, that a notebook shows and that xarray takes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geomech.core import summary
from geomech.core.errors import plain
from geomech.core.face import Faced
from geomech.gaits import Gait
from geomech.scene.model import Scene
from geomech.tiers import TIERS


class Displacements(Faced, dict):
    """Net displacement per cycle by amplitude and tier (`Study.study`, `choose.cheapest`) of a gait of a scene."""

    def __init__(self, values: Mapping, scene: Scene, gait: Gait):
        super().__init__(values)
        self.scene, self.gait = scene, gait

    @property
    def tiers(self) -> list[str]:
        """Those that it has."""
        return [name for name in self if name in TIERS]

    def errors(self, key: str) -> dict[str, list]:
        """Estimates by tier, of a table of all or of the cheapest. key: "estimate" or "estimate_heading"."""
        return self[key] if isinstance(self[key], dict) else {self.tiers[0]: self[key]}


class Swept(Faced, dict):
    """Net displacement per cycle over a grid of a scene's parameters (`sweep.sweep`)."""

    def __init__(self, values: Mapping, scene: Scene):
        super().__init__(values)
        self.scene = scene

    def __repr__(self) -> str:
        over = " x ".join(f"{name} ({len(v)}: {summary.span(v)})" for name, v in self["over"].items())
        unit = self["units"]["estimate"]
        worst = f"estimated error up to {np.max(self['estimate'], initial=0.0):.1e} {unit}"
        net = f"net {summary.poses(self['displacement'])} ({unit}, rad)"
        return f"Swept({plain(self.scene.name)} over {over}; {net}; {worst})"
