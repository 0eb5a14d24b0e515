"""Truths that cost more than the test they serve, kept in tests/data under what they
are an answer to.

A question is any nest of values that says all the answer depends on: medium, body,
gait, effects, amplitudes, how fine. Its hash is the key, so a test that asks another
question finds nothing and has it computed. `pytest --renew-truths` computes all of them
and writes the files; what moved is then in the diff.
"""

import dataclasses
import hashlib
import json
import pathlib
import warnings
from collections.abc import Callable, Mapping

import numpy as np

DATA = pathlib.Path(__file__).parents[1] / "data"
DECIMALS = 13  # below are rounding and the machine
# Fields younger than some answers: where they are None the question is the old one.
LATER = {"covariance", "frequency", "modes", "slenderness", "waves"}


def spelled(value) -> str:
    """A question as text, alike on every machine: floats to 12 digits, dataclasses by
    their fields."""
    match value:
        case float() | np.floating():
            return f"{value:.12g}"
        case np.ndarray() | list() | tuple():
            return "[" + ", ".join(map(spelled, value)) + "]"
        case Mapping():
            return spelled(sorted(value.items()))
        case _ if dataclasses.is_dataclass(value):
            fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
            for name in LATER & fields.keys():
                if fields[name] is None:
                    del fields[name]
            return type(value).__name__ + spelled(fields)
        case str() | int() | None:
            return repr(value)
    raise TypeError(
        f"a question cannot hold {value!r}: its text must say all there is to it"
    )


class Truths:
    """What is kept. renew: compute every answer asked for, and let `write` replace the
    files by them."""

    def __init__(self, renew: bool = False, folder: pathlib.Path = DATA):
        self.renew = renew
        self.folder = folder
        self.kept = {}
        self.asked = {}

    def __call__(self, name: str, compute: Callable, *question) -> np.ndarray:
        """The answer kept in ``name``.json for the question; ``compute(*question)`` if
        there is none."""
        key = hashlib.sha256(spelled(question).encode()).hexdigest()[:16]
        asked = self.asked.setdefault(name, {})
        if key not in asked:
            kept = None if self.renew else self._read(name).get(key)
            if kept is None and not self.renew:
                said = f"{name}.json lacks an answer: pytest --renew-truths"
                warnings.warn(said, stacklevel=2)
            asked[key] = np.array(compute(*question) if kept is None else kept)
        return asked[key].copy()

    def _read(self, name: str) -> dict:
        if name not in self.kept:
            file = self.folder / f"{name}.json"
            self.kept[name] = json.loads(file.read_text()) if file.exists() else {}
        return self.kept[name]

    def write(self) -> None:
        """Files of the names asked for, one line an answer, where they are renewed."""
        if not self.renew:
            return
        for name, answers in self.asked.items():
            rows = [
                f'"{key}": {json.dumps(answer.round(DECIMALS).tolist())}'
                for key, answer in sorted(answers.items())
            ]
            (self.folder / f"{name}.json").write_text(
                "{\n" + ",\n".join(rows) + "\n}\n"
            )
