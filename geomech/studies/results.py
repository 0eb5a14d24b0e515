"""Results of a study as tables that users index: dicts, ready for JSON."""

from __future__ import annotations

from geomech.core.variables import Result
from geomech.gaits import Gait
from geomech.scenes.model import Scene
from geomech.studies import tables


class Displacements(dict):
    """Net displacement per cycle by amplitude and tier (`tables.table`) of a gait of a scene. result: the numbers with
    their units and errors (`tables.result`), which this dict renders."""

    def __init__(self, result: Result):
        super().__init__(tables.table(result))
        self.result = result

    @property
    def scene(self) -> Scene:
        return self.result.subject[0]

    @property
    def gait(self) -> Gait:
        return self.result.subject[1]

    @property
    def tiers(self) -> list[str]:
        """Names of the tiers, in the order given."""
        return self.result["tier"].values.tolist()
