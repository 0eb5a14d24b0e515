"""Files of connections whose shape variables have periods."""

from dataclasses import replace

import numpy as np
import pytest
from rolling import TURN, Lifted

import geomech
from geomech.core.variables import Result
from geomech.io.results import write_netcdf
from geomech.mathematics.gaits import Fourier, Wound
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.systems import Table
from geomech.results.fields import connection_of, field_of
from geomech.scenes import Numerics, Scene
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

GAIT = Fourier(cos=((0.0,),), sin=((1.0,),), amplitude=0.5)
PERIODS = (None, TURN)


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    path = tmp_path_factory.mktemp("periodic") / "lifted.nc"
    study = geomech.study(Lifted(0.5), GAIT, grid=21, extent=1.0)
    study.connection().save(path)
    return path, study.tables


def test_a_netcdf_file_keeps_periods(stored):
    path, tables = stored
    A = Connection.load(path)
    assert A.periods == PERIODS
    shapes = np.array([[0.3, 1.0], [0.3, 1.0 - 3 * TURN]])
    np.testing.assert_allclose(A(shapes), tables.fitted(shapes), atol=1e-14)


@pytest.mark.parametrize("tier", ["area", "path", "direct"])
def test_a_table_winds_as_its_system_does(stored, tier):
    path, tables = stored
    scene = Scene(Table(path), GAIT, Numerics(grid=21, extent=1.0))
    assert scene.system.traits.periods == PERIODS
    assert scene.gait == Wound(GAIT)
    expected = tables.poses("area" if tier == "area" else "path")
    np.testing.assert_allclose(SceneTables(scene).poses(tier), expected, atol=5e-4)


def test_a_scene_with_a_wound_gait_is_written_with_the_gait_inside(stored):
    path, _ = stored
    scene = Scene(Table(path), GAIT)
    text = geomech.toml(scene)
    assert 'kind = "fourier"' in text and "turns" not in text
    read = geomech.scenes.parse(text, scene.name)
    assert read.gait == scene.gait == Wound(GAIT)
    assert read.system == scene.system


@pytest.mark.parametrize("ending", [".json", ".nc"])
def test_results_keep_periods(tmp_path, ending):
    study = geomech.study(Lifted(0.5), GAIT, grid=11, extent=1.0)
    for question, name in ((study.connection(), "A"), (study.ccf(), "ccf")):
        path = tmp_path / f"{name}{ending}"
        question.save(path)
        read = geomech.load_result(path)
        found = connection_of(read) if name == "A" else field_of(read, "ccf")[0]
        assert found.periods == PERIODS


def test_a_matlab_file_is_refused(tmp_path):
    study = geomech.study(Lifted(0.5), GAIT, grid=11, extent=1.0)
    path = tmp_path / "lifted.mat"
    with pytest.raises(Refusal, match=r"periods.*\.nc"):
        study.connection().save(path)
    assert not path.exists()


@pytest.mark.parametrize("period", [3.0, -1.0, np.nan])
def test_a_period_that_does_not_fit_is_refused(stored, tmp_path, period):
    path, _ = stored
    whole = geomech.load_result(path)
    changed = []
    for variable in whole.variables:
        if variable.name == "period_alpha_2":
            variable = replace(variable, values=np.array(period))
        changed.append(variable)
    wrong = tmp_path / "wrong.nc"
    write_netcdf(wrong, Result(whole.kind, tuple(changed), whole.attributes))
    with pytest.raises(Refusal, match="period"):
        Connection.load(wrong)
