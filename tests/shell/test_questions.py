"""What every question keeps: its declaration is its command and its method, and its
result is the same in every form."""

import ast
import dataclasses
import html
import json
import pickle
import re
import sys
import types
from pathlib import Path

import beds
import frozen
import numpy as np
import pytest
import xarray
from commands import geomech as run_geomech
from scipy.io import netcdf_file

import geomech
from geomech import plots, questions
from geomech.core.variables import Result, Variable
from geomech.io import results as io
from geomech.questions.shared import base
from geomech.results import files
from geomech.runs.digest import digest
from geomech.shell import cli
from geomech.shell.command import declaration, figure, parameters
from rft.core.refusal import Refusal

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
    "accuracy of a walker": (str(FROZEN / "walk.toml"), {}, {"runs": 1}, {}),
    "accuracy of a leg": (str(FROZEN / "leg.toml"), {}, {"runs": 1}, {}),
    "displacement with effort": (
        "three-link-viscous",
        FIELD,
        {"amplitudes": (0.5, 1.0), "effort": True},
        {"tiers": ("path",)},
    ),
    "ccf of frames": ("three-link-viscous", FIELD, {"compare_frame": "link-1"}, {}),
    "ccf with a metric": ("three-link-viscous", FIELD, {"metric": True}, {}),
    "ccf of slices": (str(FROZEN / "four.toml"), {}, {"pair": "1,3"}, {}),
    "connection of slices": (
        str(FROZEN / "four.toml"),
        {},
        {"pair": "1,3"},
        {"slice": (0.1, 0.2, 0.3)},
    ),
    "connection of frames": (
        "three-link-viscous",
        FIELD,
        {"compare_frame": "link-1"},
        {},
    ),
    "optimize for speed": (
        "three-link-viscous",
        FIELD,
        {"objective": "speed", "harmonics": 1, "starts": 1, "rate": 3.0, "power": 2.0},
        {"power": 1.0},
    ),
    "run of slices": (str(FROZEN / "four.toml"), {}, {}, {}),
    "run of a table": (str(FROZEN / "table.toml"), {}, {}, {}),
    "trajectory of a table": (str(FROZEN / "table.toml"), {}, {}, {"cycles": 2}),
}
# Differ from run to run: times, and which setting is the quickest.
ROUGH = {"kept", "evaluations", "seconds", "computed_before"}
ROUGH |= {"best_setting", "best_value", "best_error", "best_seconds"}


def subject_of(kind):
    name, numerics, *_ = ASKED[kind]
    if kind == "stress" or kind.startswith("fit_"):
        return name
    scene = geomech.load(name)
    if not numerics:
        return scene
    if kind == "walk":
        numerics = dataclasses.replace(scene.numerics, **numerics)
        return dataclasses.replace(scene, numerics=numerics)
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
def form(request):
    return request.param


@pytest.fixture(scope="module")
def asked(form):
    kind = questions.question(form.split()[0])
    about = []
    if ASKED[form][0]:
        about.append(subject_of(form))
    return kind(*about, **ASKED[form][2])


@pytest.fixture(scope="module")
def result(asked):
    return asked.ask()


def assert_same(a, b):
    """Assert that two results have the same variables, to the last digit."""
    assert list(a) == list(b)
    for one, other in zip(a.variables, b.variables):
        for field in ("dims", "unit", "label", "zero", "error_label"):
            assert getattr(one, field) == getattr(other, field), (one.name, field)
        for field in ("values", "error", "spread"):
            values = [getattr(v, field) for v in (one, other)]
            np.testing.assert_array_equal(*values, one.name)


def test_every_question_is_asked_here():
    assert {kind.split()[0] for kind in ASKED} == set(questions.SUMMARIES)


def test_a_declaration_is_a_command_and_a_schema(asked):
    declared = declaration(type(asked))
    names = [parameter.name for parameter in parameters(declared)]
    assert len(names) == len({*names})
    options = {**declared.fields, **declared.picture, **declared.all_files}
    assert {*options} <= {*names}
    assert all(option.help for option, _, _ in options.values())
    schema = base.schema(type(asked))
    assert json.loads(json.dumps(schema)) == schema


def test_the_digest_is_of_the_fields(form, asked):
    assert digest(asked) == digest(dataclasses.replace(asked, progress=print))
    for name, value in ASKED[form][3].items():
        assert digest(asked) != digest(dataclasses.replace(asked, **{name: value}))


def test_attributes_are_plain_and_values_read_only(result):
    assert all(isinstance(x, str | int | float) for x in result.attributes.values())
    for variable in result.variables:
        assert variable.values.dtype.kind in "fiUb", variable.name
        assert not variable.values.flags.writeable


def test_numbers_have_units_and_errors_their_shape(result):
    for variable in result.variables:
        named = variable.unit or variable.label or variable.is_coordinate
        assert variable.values.dtype.kind != "f" or named, variable.name
        if variable.error is not None:
            assert variable.error.shape == variable.values.shape
            assert (np.nan_to_num(variable.error) >= 0).all()


@pytest.mark.parametrize("ending", [".nc", ".json", ".mat"])
def test_a_file_is_read_back(result, ending, tmp_path):
    if ending in type(result.question).files():
        pytest.skip("a layout of its own, which other programs read")
    result.save(tmp_path / f"result{ending}")
    back = geomech.load_result(tmp_path / f"result{ending}")
    assert (back.kind, dict(back.attributes)) == (result.kind, dict(result.attributes))
    assert_same(result, back)
    assert str(back) == str(result)


def test_all_forms_have_one_vocabulary(result):
    names = {v.name for v in io.flat(result)}
    data = result.to_dict()
    assert names == {*data["coords"], *data["data_vars"]}
    assert names == {*result.to_xarray().variables}
    assert json.loads(json.dumps(data)) == data
    assert xarray.Dataset.from_dict(data).attrs == dict(data["attrs"])


def test_a_data_frame_has_the_columns_of_a_table(result):
    frame = result.to_dataframe().reset_index()
    columns = io.columns(result, files.table_dims(result))
    assert {*columns} <= {*frame.columns}
    for name, values in columns.items():
        np.testing.assert_array_equal(frame[name], values, name)


def test_a_page_shows_the_words_and_numbers_of_the_text(result):
    page = re.sub("<[^>]*>", " ", html.unescape(result._repr_html_()))
    shown = {*page.split()}
    assert [word for word in str(result).split() if word not in shown] == []


def test_a_result_is_pickled(result):
    assert_same(result, pickle.loads(pickle.dumps(result)))


def test_a_picture_of_a_file_is_that_of_the_result(result, tmp_path):
    if result.question.draw is None:
        pytest.skip("there is none")
    result.save(tmp_path / "a.nc")
    again = geomech.load_result(tmp_path / "a.nc").plot()
    for one, other in zip(result.plot().axes, again.axes, strict=True):
        for a, b in zip(one.lines, other.lines, strict=True):
            np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())


# Of results without a stretched shape space, and of swimmers.
REFUSED_SWITCHES = {"stretch": "was not computed", "maps": "robots that walk"}


def test_every_switch_of_a_picture_draws_or_is_refused(result, tmp_path):
    """The command writes what it draws."""
    if result.question.draw is None:
        pytest.skip("there is none")
    for name, (_, kind, _) in declaration(type(result.question)).picture.items():
        if name in REFUSED_SWITCHES:
            with pytest.raises(Refusal, match=REFUSED_SWITCHES[name]):
                result.plot(**{name: True})
        elif kind is bool:
            drawn = result.plot(**{name: True})
            assert drawn.axes, name
            plots.save(drawn, tmp_path / "drawn.png")
            figure(tmp_path / "a.png", {name: True}).write(result, tmp_path / "a.png")
            pictures = [(tmp_path / f).read_bytes() for f in ("a.png", "drawn.png")]
            assert pictures[0] == pictures[1], name


NOT_DRAWN = {
    "displacement": [{"data": FROZEN / "gone.csv", "component": ("x",)}],
    "run": [
        {"data": FROZEN / "gone.csv", "component": ("x",)},
        {"clim": 0.1, "component": ("x", "theta")},
    ],
    "ccf": [
        {"style": "quiver"},
        {"clim": 0.1, "component": ("x", "theta")},
        {"stretch": True, "style": "slices"},
    ],
    "connection": [{"style": "map"}, {"clim": 0.1, "component": ("x", "theta")}],
}


@pytest.mark.parametrize(
    ("kind", "picture"),
    [(kind, picture) for kind, pictures in NOT_DRAWN.items() for picture in pictures],
)
def test_a_picture_that_cannot_be_is_refused_before_anything_is_computed(kind, picture):
    question = questions.question(kind)(subject_of(kind))
    with pytest.raises((Refusal, FileNotFoundError)):
        question.check_draw(**picture)
    question.check_draw()


def test_a_method_of_a_study_asks_the_same(form, asked, result):
    if not hasattr(geomech.Study, asked.name) or asked.subject is None:
        pytest.skip("it is not asked of a scene")
    study = geomech.study(asked.subject)
    again = getattr(study, asked.name)(**ASKED[form][2])
    for variable in result.variables:
        if variable.name not in ROUGH:
            values = variable.values, again[variable.name].values
            np.testing.assert_array_equal(*values, variable.name)


def test_a_run_from_python_fills_a_folder_as_the_command_does(tmp_path):
    scene = geomech.load("three-link-viscous").with_numerics(grid=7, phases=16)
    geomech.run(scene).save(tmp_path / "here")
    (tmp_path / "a.toml").write_text(geomech.toml(scene))
    run_geomech("run", "a.toml", "-o", "there", cwd=tmp_path)
    names = [{p.name for p in (tmp_path / x).iterdir()} for x in ("here", "there")]
    assert names[0] == names[1] and "displacement.json" in names[0]
    geomech.run(scene).save(tmp_path / "turning", component=("theta",))
    whole, part = (tmp_path / x / "ccf.png" for x in ("here", "turning"))
    assert whole.read_bytes() != part.read_bytes()
    other = scene.with_numerics(grid=9)
    (tmp_path / "here" / "displacement.json").unlink()
    with pytest.raises(Refusal, match="it holds the results of another scene"):
        geomech.run(other).save(tmp_path / "here")


def test_a_body_of_one_joint_has_no_map():
    scene = geomech.load("three-link-viscous").changed(
        body=geomech.bodies.Chain((1, 2)),
        gait=geomech.gaits.Fourier(cos=((0.5,),), sin=((0.0,),)),
    )
    with pytest.raises(Refusal, match="one joint has no map"):
        geomech.ccf(scene)


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


@pytest.mark.parametrize("name", ["a.png", "a", "a.toml"])
def test_a_name_whose_ending_is_no_format_is_refused_with_those_that_are(
    name, tmp_path
):
    (tmp_path / name).write_text("")
    for ask in (MADE.save, geomech.load_result):
        with pytest.raises(Refusal, match=r"\.json"):
            ask(tmp_path / name)


@pytest.mark.parametrize("ending", [".nc", ".json", ".mat", ".csv"])
def test_what_is_missing_is_missing_and_what_is_damaged_is_refused(ending, tmp_path):
    file = tmp_path / f"a{ending}"
    with pytest.raises(FileNotFoundError):
        geomech.load_result(file)
    MADE.only("xi").save(file)
    file.write_bytes(file.read_bytes()[:10] + b"\xff{")
    with pytest.raises(Refusal, match=re.escape(file.name)):
        geomech.load_result(file)


def test_a_data_frame_has_its_coordinates_as_index():
    frame = MADE.only("speed").to_dataframe()
    assert frame.index.names == ["phase", "tier"]
    assert frame["speed"].loc[1.5].tolist() == [2.0, 3.0]
    assert MADE.to_dataframe("component")["xi"].tolist() == [0.5, 0.25, 0.0]


def test_without_pandas_it_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        MADE.to_dataframe()


def test_places_are_chosen_by_their_coordinates():
    assert float(MADE.at(tier="direct", phase=1.5)["speed"]) == 3.0
    assert MADE["xi"].at("component", 2).unit == "rad"
    with pytest.raises(KeyError, match="tier has no value 'path'"):
        MADE.at(tier="path")


def test_poses_of_former_versions_have_the_names_of_today(tmp_path):
    """They were one variable, with one error of the position."""
    over = ("gait_amplitude",)
    poses = np.arange(6.0).reshape(2, 3)
    unit = "body length (x, y), rad (theta)"
    variables = (
        Variable("gait_amplitude", over, [0.5, 1.0]),
        Variable("component", ("component",), ["x", "y", "theta"]),
        Variable("displacement", (*over, "component"), poses, unit),
        Variable("estimate", over, [0.1, 0.2], "body length"),
        Variable("estimate_heading", over, [0.3, 0.4], "rad"),
        Variable("length", over, [1.0, 1.0], "body length"),
    )
    old = tmp_path / "old.nc"
    io.write_netcdf(old, Result("", variables))
    with netcdf_file(old, "a", mmap=False) as file:
        for name in (io.FORMAT, io.ORDER, io.KIND):
            file._attributes.pop(name, None)
            vars(file).pop(name, None)
    found = geomech.load_result(old)
    np.testing.assert_array_equal(found["x"].values, poses[:, 0])
    np.testing.assert_array_equal(found["heading"].values, poses[:, 2])
    np.testing.assert_array_equal(found["heading"].error, [0.3, 0.4])
    np.testing.assert_array_equal(found["net_distance"].error, [0.1, 0.2])
    assert (found["y"].unit, found["body_length"].unit) == ("BL", "BL")


# The page about adding questions and formats

PAGE = Path(__file__).parents[2] / ".docs" / "how-it-works" / "extending.md"


@pytest.fixture
def added(monkeypatch):
    """The question of the page, added as it says."""
    section = PAGE.read_text().partition("## A question\n")[2]
    code, line = re.findall(r"```(?:python|text)\n(.*?)```", section, re.S)[:2]
    module = types.ModuleType("geomech.questions.swimmers.loop")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(code, vars(module))
    ((path, words),) = ast.literal_eval(f"{{{line}}}").items()
    monkeypatch.setitem(questions.GROUPS["Analyse"], path, words)
    monkeypatch.setitem(questions.SUMMARIES, "loop", words)
    monkeypatch.setitem(questions.MODULES, "loop", path)
    yield module.Loop
    cli.load_command.cache_clear()


def test_the_question_of_the_page_is_a_command(added, tmp_path):
    line = "loop three-link-viscous --amplitude 0.5 -o a.nc"
    code, told, err = run_geomech(*line.split(), cwd=tmp_path)
    assert (code, err) == (0, "")
    assert told.startswith("loop area  0.785398 +- ")
    found = geomech.load_result(tmp_path / "a.nc")
    assert float(found["loop_area"]) == pytest.approx(np.pi / 4)
