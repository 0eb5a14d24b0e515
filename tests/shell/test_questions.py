"""What every question keeps: its declaration is its command and its method, and its result
is the same in every form."""

import ast
import dataclasses
import inspect
import json
import pickle
import re
import subprocess
import sys
import types
from pathlib import Path

import beds
import frozen
import numpy as np
import pytest
import xarray
from commands import geomech as run_geomech

import geomech
from geomech import Refusal, questions
from geomech.core.summary import wrapped
from geomech.core.variables import Result, Variable
from geomech.io import results as io
from geomech.questions.shared import base
from geomech.results import files, show
from geomech.run.digest import digest
from geomech.shell import cli
from geomech.shell.command import command, declaration, parameters

FIELD = {"grid": 9, "phases": 32}
FROZEN = frozen.FOLDER
# A small question of each kind, and of each of its forms: its subject, [numerics], its
# fields, other values of them.
ASKED = {
    "displacement": (
        "three-link-glass",
        FIELD,
        {"amplitudes": (0.5, 1.0)},
        {"amplitudes": (0.6,), "effort": True},
    ),
    "ccf": ("three-link-viscous", FIELD, {}, {"metric": True}),
    "connection": ("three-link-viscous", FIELD, {}, {"pair": "1,2"}),
    "velocity": (
        "three-link-glass",
        {},
        {"alpha": (0.5, 0.3), "alphadot": (1.0, 0.0)},
        {"alpha": (0.4, 0.3), "alphadot": (0.0, 1.0)},
    ),
    "sweep": (
        "three-link-viscous",
        FIELD,
        {"over": {"medium.ratio": [1.5, 2.0]}},
        {"over": {"medium.ratio": [1.5, 2.5]}},
    ),
    "run": ("three-link-ideal-fluid", FIELD, {}, {}),
    "forces": ("seven-link-wave", {"phases": 32}, {}, {"length": 0.1}),
    "optimize": (
        "three-link-viscous",
        FIELD,
        {"harmonics": 1, "starts": 1},
        {"harmonics": 2, "objective": "efficiency"},
    ),
    "trajectory": ("three-link-viscous", FIELD, {}, {"cycles": 2}),
    "walk": ("xplorer", {"duration": 0.5, "steps": 8}, {}, {"engine": "planar"}),
    "stress": ("generic", {}, {"beta": 45.0, "gamma": 45.0}, {"beta": 30.0}),
    "intrude": ("c-leg", {"elements": 10}, {}, {}),
    "grains": ("three-link-viscous", FIELD, {}, {"seed": 2}),
    "drag_grains": ("", {}, {"angles": (0.0, 30.0, 90.0)}, {"beds": 2, "depth": 0.02}),
    "fit_medium": ("short-rod-drag", {}, {}, {"law": "viscous", "end_caps": 1.0}),
    "fit_medium of plates": (str(FROZEN / "plates.csv"), {}, {}, {}),
    "fit_gait": (str(FROZEN / "log.csv"), {}, {"harmonics": 1}, {"level": 0.9}),
    "fit_gait of midlines": (
        str(FROZEN / "trial.csv"),
        {},
        {"medium": "glass-0.3mm-close", "y": "up"},
        {},
    ),
    "fit_medium of a plate": (str(FROZEN / "push.csv"), {}, {}, {"area": 1e-3}),
    "accuracy": ("three-link-viscous", FIELD, {"runs": 1}, {"runs": 2}),
}
# Differ from run to run: times, and which setting is the quickest.
ROUGH = {"kept", "evaluations", "seconds", "computed_before"}
ROUGH |= {"best_setting", "best_value", "best_error", "best_seconds"}


def subject_of(kind):
    name, numerics, *_ = ASKED[kind]
    if kind == "stress" or kind.startswith("fit_"):
        return name
    scene = geomech.load(name)
    if kind == "walk":
        coarse = dataclasses.replace(scene.numerics, **numerics)
        return dataclasses.replace(scene, numerics=coarse)
    if kind == "intrude":
        return scene.changed(**numerics)
    return scene.with_numerics(**numerics)


@pytest.fixture(scope="module", autouse=True)
def without_lammps():
    """Bodies in grains obey a law."""
    with pytest.MonkeyPatch.context() as patch:
        beds.obey(patch)
        yield


@pytest.fixture(scope="module", params=ASKED)
def asked(request):
    kind = questions.question(request.param.split()[0])
    about = []
    if ASKED[request.param][0]:
        about.append(subject_of(request.param))
    return kind(*about, **ASKED[request.param][2])


@pytest.fixture(scope="module")
def result(asked):
    return asked.ask()


def assert_same(a, b):
    """Whether two results have the same variables, to the last digit."""
    assert list(a) == list(b)
    for one in a.variables:
        other = b[one.name]
        for field in ("dims", "unit", "label", "zero", "error_label"):
            assert getattr(one, field) == getattr(other, field), (one.name, field)
        for field in ("values", "error", "spread"):
            x, y = getattr(one, field), getattr(other, field)
            assert (x is None) == (y is None), (one.name, field)
            if x is not None:
                np.testing.assert_array_equal(x, y, one.name)


def test_every_question_is_asked_here():
    assert {kind.split()[0] for kind in ASKED} == set(questions.SUMMARIES)


def test_a_declaration_is_a_command_a_schema_and_a_reference(asked):
    declared = declaration(type(asked))
    taken = [p.name for p in parameters(declared)]
    assert len(taken) == len({*taken})
    every = {**declared.fields, **declared.picture, **declared.all_files}
    assert {*every} <= {*taken}
    assert all(option.help for option, _, _ in every.values())
    line = questions.SUMMARIES[asked.name]
    assert " ".join(command(type(asked)).__doc__.split()).startswith(line)
    schema = base.schema(type(asked))
    assert json.loads(json.dumps(schema)) == schema
    assert len([*base.reference(type(asked))]) == len(declared.fields)


def test_defaults_are_those_of_the_command_line(asked):
    """A command that is given no option asks what Python asks without keywords."""
    declared = declaration(type(asked))
    given = dict.fromkeys(p.name for p in parameters(declared))
    assert base_defaults(type(asked)) == {
        name: default
        for name, (_, _, default) in declared.fields.items()
        if not base.is_required(default)
    }
    assert set(given) >= set(declared.fields)


def base_defaults(kind):
    signature = inspect.signature(kind).parameters
    named = base.options(kind)
    return {
        name: p.default
        for name, p in signature.items()
        if name in named and p.default is not p.empty
    }


def test_the_digest_is_of_the_fields(asked):
    assert digest(asked) == digest(dataclasses.replace(asked, progress=print))
    for name, value in ASKED[asked.name][3].items():
        assert digest(asked) != digest(dataclasses.replace(asked, **{name: value}))


def test_attributes_are_plain_and_values_read_only(result):
    for value in result.attributes.values():
        assert isinstance(value, str | int | float)
    for variable in result.variables:
        assert variable.values.dtype.kind in "fiUb", variable.name
        assert not variable.values.flags.writeable
    with pytest.raises(TypeError):
        result.attributes["name"] = 1


def test_numbers_have_units_and_errors_their_shape(result):
    for variable in result.variables:
        is_number = variable.values.dtype.kind == "f"
        named = variable.unit or variable.label or variable.is_coordinate
        assert not is_number or named, variable.name
        if variable.error is not None:
            assert variable.error.shape == variable.values.shape
            assert (np.nan_to_num(variable.error) >= 0).all()


@pytest.mark.parametrize("ending", [".nc", ".json", ".mat"])
def test_a_file_is_read_back(result, ending, tmp_path):
    if ending in type(result.question).files():
        pytest.skip("a layout of its own, which other programs read")
    path = tmp_path / f"result{ending}"
    result.save(path)
    back = geomech.load_result(path)
    assert (back.kind, dict(back.attributes)) == (result.kind, dict(result.attributes))
    assert_same(result, back)
    assert str(back) == str(result)


def test_all_forms_have_one_vocabulary(result, tmp_path):
    names = {v.name for v in io.flat(result)}
    data = result.to_dict()
    assert names == {*data["coords"], *data["data_vars"]}
    assert names == {*result.to_xarray().variables}
    assert json.loads(json.dumps(data)) == data
    assert xarray.Dataset.from_dict(data).attrs == dict(data["attrs"])
    if ".csv" in type(result.question).files():
        return  # a layout of its own, which another command reads
    result.save(tmp_path / "a.csv")
    heads = (tmp_path / "a.csv").read_text().partition("\n")[0].split(",")
    assert {*heads} <= names | {*result.sizes}


def test_text_fits_a_screen(result):
    lines = str(result).splitlines()
    assert max(map(len, lines)) <= show.WIDTH and len(lines) <= 30
    assert not any(" nan" in line for line in lines)
    assert wrapped(lines) == lines
    everything = show.text(result, everything=True)
    for variable in result.variables:
        assert show.title(variable.name) in everything


def test_a_notebook_shows_tables_and_a_picture(result):
    html = result._repr_html_()
    assert html.count("<div>") == html.count("</div>") == 1
    assert ("<img" in html) == (result.question.draw is not None)


def test_a_result_is_pickled(result):
    assert_same(result, pickle.loads(pickle.dumps(result)))


def test_a_picture_of_a_file_is_that_of_the_result(result, tmp_path):
    if result.question.draw is None:
        with pytest.raises(Refusal, match="no picture"):
            result.plot()
        return
    result.save(tmp_path / "a.nc")
    drawn, again = result.plot(), geomech.load_result(tmp_path / "a.nc").plot()
    assert len(drawn.axes) == len(again.axes)
    for one, other in zip(drawn.axes, again.axes):
        assert one.get_title() == other.get_title()
        for a, b in zip(one.lines, other.lines):
            np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())


def test_a_method_of_a_study_asks_the_same(asked, result):
    if asked.name == "stress":
        pytest.skip("a medium is no scene")
    if asked.subject is None:
        pytest.skip("there is no scene")
    if asked.name.startswith("fit_"):
        pytest.skip("measurements are no scene")
    study = geomech.study(asked.subject)
    again = getattr(study, asked.name)(**ASKED[asked.name][2])
    for variable in result.variables:
        if variable.name not in ROUGH:
            np.testing.assert_array_equal(
                variable.values, again[variable.name].values, variable.name
            )
    name = next(iter(inspect.signature(getattr(study, asked.name)).parameters), "")
    with pytest.raises(Refusal, match="has no"):
        getattr(study, asked.name)(**{f"{name or 'scene'}x": 1})


def test_a_misspelt_keyword_is_told_the_nearest():
    with pytest.raises(Refusal, match="no 'tolerence': did you mean 'tolerance'"):
        geomech.displacement("three-link-viscous", tolerence=1e-3)


def test_help_loads_nothing_that_computes_or_draws():
    """Of any command; the list of all commands loads no NumPy either."""
    heavy = {"scipy", "matplotlib", "geomech.scenes", "geomech.mathematics.systems"}
    code = (
        "import sys\nfrom geomech.shell import cli\n"
        "listed = 'numpy' in sys.modules\n"
        "for name in cli.Commands():\n    cli.Commands()[name]\n"
        f"sys.exit(listed or bool({heavy} & {{*sys.modules}}))"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


# Results made by hand


TIER = Variable("tier", ("tier",), ["area", "direct"])
PHASE = Variable("phase", ("phase",), [0.0, 1.5, 3.0], "rad", "of the gait")
SPEED = Variable(
    "speed",
    ("phase", "tier"),
    np.arange(6.0).reshape(3, 2),
    "m/s",
    "of the body",
    np.full((3, 2), 0.1),
    np.ones((3, 2)),
    "half width",
)
REACH = Variable("xi_spread", ("tier", "one"), [[1.0], [2.0]], "m")  # no spread of xi
XI = Variable("xi", ("component",), [0.5, 0.25, 0.0], ("m", "m", "rad"))
MADE = Result(
    "made", (PHASE, TIER, SPEED, XI, REACH), {"title": "t", "scale": 0.1, "n": 3}
)


@pytest.mark.parametrize("ending", [".nc", ".json", ".mat"])
def test_a_result_made_by_hand_is_read_back(ending, tmp_path):
    MADE.save(tmp_path / f"a{ending}")
    back = geomech.load_result(tmp_path / f"a{ending}")
    assert_same(MADE, back)
    assert dict(back.attributes) == dict(MADE.attributes)


def test_other_programs_read_a_netcdf_file(tmp_path):
    MADE.save(tmp_path / "a.nc")
    with xarray.open_dataset(tmp_path / "a.nc") as data:
        np.testing.assert_array_equal(data.speed_error, SPEED.error)
        np.testing.assert_array_equal(data.speed_spread, SPEED.spread)
        assert data.speed.dims == ("phase", "tier") and data.speed.units == "m/s"
        assert data.speed_error.long_name == "half width"
        assert data.attrs["scale"] == 0.1 and data.attrs["kind"] == "made"


def test_places_are_chosen_by_their_coordinates():
    assert float(MADE.at(tier="direct", phase=1.5)["speed"]) == 3.0
    assert MADE.at(tier="direct")["speed"].unit == "m/s"
    assert MADE["xi"].at("component", 2).unit == "rad"
    assert list(MADE.only("speed")) == ["phase", "tier", "speed"]
    with pytest.raises(KeyError, match="tier has no value 'path'"):
        MADE.at(tier="path")


def test_a_name_without_a_format_is_refused():
    with pytest.raises(Refusal, match=r"end the name in one of \.nc, \.json"):
        MADE.save("a.txr")
    with pytest.raises(Refusal, match="cannot read"):
        files.load("a.txt")


def test_files_of_former_versions_have_the_names_of_today(tmp_path):
    """A sweep, whose poses were one variable, with one error of the position."""
    poses = np.arange(6.0).reshape(2, 3)
    old = (
        Variable("gait_amplitude", ("gait_amplitude",), [0.5, 1.0]),
        Variable("component", ("component",), ["x", "y", "theta"]),
        Variable(
            "displacement",
            ("gait_amplitude", "component"),
            poses,
            "body length (x, y), rad (theta)",
        ),
        Variable("estimate", ("gait_amplitude",), [0.1, 0.2], "body length"),
        Variable("estimate_heading", ("gait_amplitude",), [0.3, 0.4], "rad"),
        Variable("length", ("gait_amplitude",), [1.0, 1.0], "body length"),
    )
    write_old(tmp_path / "old.nc", old)
    found = geomech.load_result(tmp_path / "old.nc")
    for name, values, error in (
        ("x", poses[:, 0], [0.1, 0.2]),
        ("heading", poses[:, 2], [0.3, 0.4]),
        ("net_distance", np.hypot(poses[:, 0], poses[:, 1]), [0.1, 0.2]),
    ):
        np.testing.assert_array_equal(found[name].values, values)
        np.testing.assert_array_equal(found[name].error, error)
    assert (found["y"].unit, found["body_length"].unit) == ("BL", "BL")
    walks = (
        Variable("f", ("f",), [1.0, 2.0]),
        Variable("speed", ("f",), [0.5, 0.0], "m/s"),
        Variable("estimate", ("f",), [0.1, 0.2], "m/s"),
        Variable("status", ("f",), [0.0, 1.0], "1", "0: walking, 1: stuck"),
    )
    write_old(tmp_path / "walks.nc", walks)
    found = geomech.load_result(tmp_path / "walks.nc")
    assert found["status"].values.tolist() == ["walking", "stuck"]
    np.testing.assert_array_equal(found["speed"].error, [0.1, 0.2])


def write_old(path, variables):
    """Write a file as versions before `geomech_format` did."""
    from scipy.io import netcdf_file

    io.write_netcdf(path, Result("", variables))
    with netcdf_file(path, "a", mmap=False) as file:
        for name in (io.FORMAT, io.ORDER, io.KIND):
            file._attributes.pop(name, None)
            vars(file).pop(name, None)


def test_a_connection_of_the_first_version_is_read():
    found = geomech.load_result(FROZEN / "field.nc")
    assert found["A"].unit == ("m/rad", "m/rad", "rad/rad")
    assert "xi_rms" in found and found["ccf"].error is not None


# The page about adding questions and formats

PAGE = Path(__file__).parents[2] / ".docs" / "how-it-works" / "extending.md"


@pytest.fixture
def added(monkeypatch):
    """The question of the page, added as it says."""
    section = PAGE.read_text().partition("## A question\n")[2]
    (code, line) = re.findall(r"```(?:python|text)\n(.*?)```", section, re.S)[:2]
    module = types.ModuleType("geomech.questions.swimmers.loop")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(code, vars(module))
    (path, words) = ast.literal_eval(f"{{{line}}}").popitem()
    monkeypatch.setitem(questions.GROUPS["Analyse"], path, words)
    monkeypatch.setitem(questions.SUMMARIES, "loop", words)
    monkeypatch.setitem(questions.MODULES, "loop", path)
    yield module.Loop
    cli.load_command.cache_clear()


def test_the_question_of_the_page_is_a_command(added, tmp_path):
    out = tmp_path / "a.nc"
    line = ["loop", "three-link-viscous", "--amplitude", "0.5", "-o", str(out)]
    code, told, err = run_geomech(*line)
    assert (code, err) == (0, "")
    assert told.startswith("loop area  0.785398 +- ")
    assert float(geomech.load_result(out)["loop_area"]) == pytest.approx(np.pi / 4)
    assert "--amplitude A" in run_geomech("loop", "--help")[1]
    assert added.__doc__.startswith(questions.SUMMARIES["loop"])


def test_the_format_of_the_page_is_one_of_every_result(monkeypatch, tmp_path):
    section = PAGE.read_text().partition("## A format\n")[2]
    made = {}
    monkeypatch.chdir(tmp_path)
    exec(re.search(r"```python\n(.*?)```", section, re.S)[1], made)
    monkeypatch.setitem(files.WRITERS, ".md", made["write_markdown"])
    MADE.save("a.md")
    assert (tmp_path / "a.md").read_text().count("\n") == 2 + 3 * 2
    assert (tmp_path / "moved.md").read_text().startswith("| tier | amplitude | x |")
