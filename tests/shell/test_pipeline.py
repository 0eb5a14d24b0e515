"""Every command checks, tells its cost, computes, writes and prints, in this order."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from geomech import scenes
from geomech.core.variables import Result, Variable
from geomech.io.results import write_csv
from geomech.questions.shared.base import Question
from geomech.runs.cost import Cost
from geomech.shell import pipeline
from geomech.studies.settings import measured_order
from rft.core.refusal import Refusal

PHASE = Variable("phase", ("phase",), np.array([0.0, 1.5, 3.0]), "rad", "of the gait")
RESULT = Result("made", (PHASE,))


@dataclasses.dataclass(frozen=True)
class Asked(Question):
    """Tells what is done to it, and fails where it is told to."""

    scene: object
    told: list = dataclasses.field(default_factory=list, compare=False)
    seconds: float = 1.0
    fails: str = ""

    name = "asked"
    subject = property(lambda self: self.scene)

    def note(self, what):
        self.told.append(what)
        if what == self.fails:
            raise Refusal(f"{what} refuses")

    def check(self):
        self.note("check")

    def cost(self):
        self.note("cost")
        return Cost(10, self.seconds, 1.0, self.seconds)

    def compute(self, run):
        self.note("compute")
        run.allow(Cost(1, 10 * self.seconds, 1.0, 10 * self.seconds))
        return RESULT


@pytest.fixture
def asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda **how: Asked(scenes.load("three-link-viscous"), **how)


def output(question, name="out.csv"):
    def write(result, path):
        question.note(f"write {name}")
        write_csv(path, result, ("phase",))

    return pipeline.Output(Path(name), write)


def test_every_command_has_one_order(asked, capsys):
    question = asked()
    pipeline.execute(question, [output(question), output(question, "more.csv")])
    steps = ["check", "cost", "compute", "write out.csv", "write more.csv"]
    assert question.told == steps
    assert Path("out.csv").read_text() == "phase\n0.0\n1.5\n3.0\n"
    printed = pipeline.printed(RESULT, as_json=False, everything=False)
    assert capsys.readouterr().out.splitlines() == "\n".join(printed).splitlines()


@pytest.mark.parametrize("fails", ["check", "cost", "compute", "write out.csv"])
def test_what_is_refused_ends_there_and_leaves_nothing(fails, asked):
    question = asked(fails=fails)
    with pytest.raises(Refusal, match=f"{fails} refuses"):
        pipeline.execute(question, [output(question)])
    assert question.told[-1] == fails and list(Path().iterdir()) == []


@pytest.mark.parametrize(("seconds", "last"), [(100.0, "cost"), (10.0, "compute")])
def test_too_much_takes_yes_beforehand_and_on_the_way(seconds, last, asked):
    question = asked(seconds=seconds)
    with pytest.raises(Refusal, match="use yes, or request less"):
        pipeline.execute(question, [output(question)])
    assert question.told[-1] == last
    pipeline.execute(question, [output(question)], yes=True)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["no/out.csv"], "cannot write no/out.csv"),
        (["s.toml"], "it is one of the inputs"),
        (["out.csv", "out.csv"], "twice"),
        (["out.csv", "link.csv"], "twice"),
    ],
)
def test_outputs_are_refused_before_computing(names, said, asked):
    Path("s.toml").write_text(scenes.load("three-link-viscous").text)
    Path("link.csv").symlink_to("out.csv")
    question = dataclasses.replace(asked(), scene=scenes.load("s.toml"))
    with pytest.raises(Refusal, match=said):
        pipeline.execute(question, [output(question, name) for name in names])
    assert "cost" not in question.told


@pytest.mark.parametrize(("values", "sign"), [((1, 2, 4, 8), -1), ((8, 4, 2, 1), 1)])
def test_an_order_is_that_of_the_error_in_the_coarseness(values, sign):
    values = np.array(values, float)
    errors = values ** (sign * 3)
    assert measured_order(values, errors) == pytest.approx(3.0)
    assert np.isnan(measured_order(values, np.array([*errors[:2], 1e-14, 1e-14])))
