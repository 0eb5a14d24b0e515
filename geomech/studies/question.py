"""Questions about a scene: frozen dataclasses of all data that their answers depend on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from geomech.core.variables import Result
from geomech.run.cost import WORTH_SAYING, Cost

Progress = Callable[[float], None]
Allow = Callable[[Cost], None]


class Question(ABC):
    """A request. `geomech.commands.pipeline` uses its members in this order.

    less: advice where it costs too much. worth_saying: seconds of computing from which on a command prints the cost."""

    scene: Any
    less: ClassVar[str] = "ask for less"
    worth_saying: ClassVar[float] = WORTH_SAYING

    @property
    def title(self) -> str:
        """Name of the computation, shown during it."""
        return f"{type(self).__name__.lower()} of {self.scene.name}"

    def inputs(self) -> list[Path]:
        """Return the files that it reads, which no output may replace."""
        from geomech.scenes import inputs

        return inputs(self.scene)

    def check(self) -> None:  # noqa: B027  most have nothing more to refuse
        """Refuse a question that makes no sense, before anything is computed."""

    def cost(self) -> Cost | None:
        """Return the cost of the answer; None where it takes almost no time and is not worth storing."""
        return None

    @abstractmethod
    def answer(self, progress: Progress, allow: Allow) -> Result:
        """Return the answer.

        progress: called with the fraction done. allow: called with a cost that was not known beforehand; raises where
        it is too much."""

    def ask(self) -> Result:
        """Return the answer without limits of cost, as from Python."""
        self.check()
        return self.answer(lambda done: None, lambda cost: None)
