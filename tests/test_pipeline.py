"""What every command does, in one order: check, cost, store, compute, write, print. Results as values, files and data sets."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray

from geomech import scenes
from geomech.commands import pipeline
from geomech.core.variables import Result, Variable
from geomech.io.results import to_xarray, write_csv, write_netcdf
from geomech.run import jobs
from geomech.run.cost import Cost
from geomech.studies.accuracy import slope
from geomech.studies.question import Question
from rft.refusal import Refusal

PHASE = Variable("phase", ("phase",), np.array([0.0, 1.5, 3.0]), "rad", "of the gait")
SPEED = Variable(
    "speed",
    ("phase", "tier"),
    np.arange(6.0).reshape(3, 2),
    "m/s",
    "of the body",
    np.full((3, 2), 0.1),
    np.ones((3, 2)),
)
TIER = Variable("tier", ("tier",), np.array(["area", "direct"]))
RESULT = Result(
    "velocity", (PHASE, TIER, SPEED), {"title": "t", "scale": 0.1}, "subject"
)


@dataclasses.dataclass(frozen=True)
class Asked(Question):
    """Tells what is done to it, and fails where it is told to."""

    scene: object
    told: list = dataclasses.field(default_factory=list, compare=False)
    seconds: float = 1.0
    fails: str = ""

    def note(self, what):
        self.told.append(what)
        if what == self.fails:
            raise Refusal(f"{what} refuses")

    def check(self):
        self.note("check")

    def cost(self):
        self.note("cost")
        return Cost(10, self.seconds, 1.0, self.seconds)

    def answer(self, progress, allow):
        self.note("answer")
        assert jobs.runner().store.path is not None  # what is done is stored
        allow(Cost(1, 10 * self.seconds, 1.0, 10 * self.seconds))
        progress(1.0)
        return RESULT


@pytest.fixture
def asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("geomech.text.text", lambda result: "the result")
    return lambda **how: Asked(scenes.load("three-link-viscous"), **how)


def output(question, name="out.csv", **how):
    def write(result, path):
        question.note(f"write {name}")
        write_csv(path, Result("velocity", (PHASE,)))

    return pipeline.Output(
        Path(name), write, lambda path: question.note(f"name {path}"), **how
    )


def test_every_command_has_one_order(asked, capsys):
    question = asked()
    said = lambda result, path: f"{result.kind} in {path}"
    wanted = (
        output(question, message=said),
        pipeline.Output(None, None),
        output(question, "more.csv"),
    )
    pipeline.execute(question, *wanted)
    assert question.told == [
        "name out.csv", "name more.csv", "check", "cost", "answer", "write out.csv", "write more.csv"
    ]  # fmt: skip
    assert capsys.readouterr().out == "the result\nvelocity in out.csv\n"
    assert sorted(p.name for p in Path().iterdir()) == ["more.csv", "out.csv"]
    assert Path("out.csv").read_text() == "phase\n0.0\n1.5\n3.0\n"


@pytest.mark.parametrize(
    "fails", ["name out.csv", "check", "cost", "answer", "write out.csv"]
)
def test_what_is_refused_ends_there_and_leaves_nothing(fails, asked):
    question = asked(fails=fails)
    with pytest.raises(Refusal, match=f"{fails} refuses"):
        pipeline.execute(question, output(question))
    assert question.told[-1] == fails and list(Path().iterdir()) == []


def test_too_much_takes_yes_beforehand_and_on_the_way(asked):
    for seconds, last in ((100.0, "cost"), (10.0, "answer")):
        question = asked(seconds=seconds)
        with pytest.raises(Refusal, match="say yes, or ask for less"):
            pipeline.execute(question, output(question))
        assert question.told[-1] == last
        pipeline.execute(question, output(question), yes=True)


def test_outputs_are_refused_before_computing(asked):
    Path("s.toml").write_text(scenes.load("three-link-viscous").text)
    for names, said in (
        (("no/out.csv",), "cannot write no/out.csv"),
        (("s.toml",), "it is an input"),
        (("out.csv", "out.csv"), "twice"),
    ):
        question = asked()
        question = dataclasses.replace(question, scene=scenes.load("s.toml"))
        with pytest.raises(Refusal, match=said):
            pipeline.execute(question, *(output(question, name) for name in names))
        assert "cost" not in question.told


def test_a_result_is_a_mapping_of_variables():
    assert (
        list(RESULT) == ["phase", "tier", "speed"]
        and len(RESULT) == 3
        and RESULT["speed"] is SPEED
    )
    assert RESULT.sizes == {"phase": 3, "tier": 2} and "pace" not in RESULT
    assert (
        repr(RESULT)
        == "Result(velocity: phase (phase), tier (tier), speed (phase, tier))"
    )
    assert (PHASE.is_coordinate, SPEED.is_coordinate, TIER.is_text, PHASE.is_text) == (
        True,
        False,
        True,
        False,
    )


def test_files_and_data_sets_have_values_errors_spreads_units_and_labels(tmp_path):
    write_netcdf(tmp_path / "a.nc", RESULT)
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        xarray.testing.assert_identical(data.load(), to_xarray(RESULT))
    assert set(data.data_vars) == {
        "speed",
        "speed_error",
        "speed_spread",
    } and data.attrs == {
        "title": "t",
        "scale": 0.1,
    }
    for name, values, label in (
        ("speed", SPEED.values, "of the body"),
        ("speed_error", SPEED.error, "estimated error of speed"),
        ("speed_spread", SPEED.spread, "standard deviation of speed"),
    ):
        np.testing.assert_array_equal(data[name], values)
        assert (data[name].units, data[name].long_name) == ("m/s", label)
    assert data.tier.values.tolist() == ["area", "direct"] and data.phase.units == "rad"
    own = dataclasses.replace(SPEED, error_label="half width")
    assert to_xarray(Result("velocity", (own,))).speed_error.long_name == "half width"


@pytest.mark.parametrize(("values", "sign"), [((1, 2, 4, 8), -1), ((8, 4, 2, 1), 1)])
def test_an_order_is_that_of_the_error_in_the_coarseness(values, sign):
    errors = [float(v) ** (sign * 3) for v in values]
    assert slope(values, errors) == pytest.approx(3.0)
    assert slope(values, [*errors[:2], 1e-14, 1e-14]) is None
