"""What is asked of a scene: a frozen dataclass of all that its answer follows from."""

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
    """A request. Its members are in the order in which `geomech.commands.pipeline` asks for them.

    less: what to ask for instead where it costs too much. worth_saying: s of computing from which on a command says what is
    to come."""

    scene: Any
    less: ClassVar[str] = "ask for less"
    worth_saying: ClassVar[float] = WORTH_SAYING

    @property
    def title(self) -> str:
        """What is under way, while it is answered."""
        return f"{type(self).__name__.lower()} of {self.scene.name}"

    def inputs(self) -> list[Path]:
        """Return the files that it rests on, which no output may replace."""
        from geomech.scene import inputs

        return inputs(self.scene)

    def check(self) -> None:  # noqa: B027  most have nothing more to refuse
        """Refusal for what makes no sense, before anything is computed."""

    def cost(self) -> Cost | None:
        """Return what answering takes; None for what takes no time to speak of and is not worth storing."""
        return None

    @abstractmethod
    def answer(self, progress: Progress, allow: Allow) -> Result:
        """Return the answer.

        progress: called with the fraction done. allow: called with the cost of what nobody knew to be needed; it refuses
        what is too much."""

    def ask(self) -> Result:
        """Return the answer, as Python asks for it: whatever it costs."""
        self.check()
        return self.answer(lambda done: None, lambda cost: None)
