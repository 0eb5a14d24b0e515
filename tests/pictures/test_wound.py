"""Maps over a plane with a period: one period, and gaits that go on at its other
end."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from rolling import TURN, Lifted

import geomech
from geomech import plots
from geomech.mathematics.gaits import Circle, Fourier, Wound
from geomech.mathematics.geometry.gait import loop_area
from geomech.plots.styles import times_enclosed
from geomech.scenes import Numerics, Scene
from geomech.studies.maps import charts
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

PERIODS = (None, TURN)
UNEVEN = Fourier(cos=((0.3, 0.1),), sin=((1.0, 0.4),), centre=(0.1,), amplitude=0.5)
GAITS = {
    "once": Wound(UNEVEN),
    "twice back": Wound(UNEVEN, (-2,)),
    "reversed": Wound(Fourier(cos=UNEVEN.cos, sin=UNEVEN.sin, reverse=True)),
    "across the seam": Circle(0.5, centre=(0.1, 0.2)),
    "a turn later": Circle(0.5, centre=(0.1, 0.2 + TURN)),
}


@pytest.fixture(scope="module")
def field():
    numerics = Numerics(grid=15, extent=1.5)
    return SceneTables(Scene(Lifted(0.5), UNEVEN, numerics)).curvature


@pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))
@pytest.mark.parametrize("draw", [plots.ccf_map, plots.ccf_contours])
def test_a_gait_goes_on_at_the_other_end_of_a_period(field, gait, draw):
    ax = draw(field, gaits=[gait])
    curve = ax.lines[0].get_xydata()
    plt.close(ax.figure)
    assert ax.get_ylim() == (0.0, TURN)
    finite = curve[np.isfinite(curve).all(1)]
    assert finite[:, 1].min() >= 0 and finite[:, 1].max() <= TURN
    steps = np.abs(np.diff(curve, axis=0))
    assert np.nanmax(steps) < 0.1  # no line across the map
    # The pieces are as long as the whole.
    whole = gait.shape(np.linspace(0, TURN, 400))
    lengths = [np.linalg.norm(np.diff(x, axis=0), axis=1) for x in (curve, whole)]
    np.testing.assert_allclose(*map(np.nansum, lengths))


@pytest.mark.parametrize("gait", GAITS.values(), ids=list(GAITS))
def test_the_shaded_area_is_that_of_the_strip(gait):
    x = np.linspace(-1.5, 1.5, 500)
    y = TURN * (np.arange(500) + 0.5) / 500
    shaded = times_enclosed(gait, x, y, PERIODS).sum() * (x[1] - x[0]) * (y[1] - y[0])
    area, _ = loop_area(gait, 256)
    np.testing.assert_allclose(shaded, area, atol=0.06)


@pytest.mark.parametrize("style", ["map", "contours", "surface"])
def test_figures_of_a_table_with_a_period_are_drawn(tmp_path, style):
    source = geomech.study(Lifted(0.5), UNEVEN, grid=11, extent=1.5)
    source.connection().save(tmp_path / "lifted.nc")
    table = geomech.mathematics.systems.Table(tmp_path / "lifted.nc")
    study = geomech.study(table, UNEVEN)
    result = study.ccf()
    result.save(tmp_path / "ccf.json")
    for each in (result, geomech.load_result(tmp_path / "ccf.json")):
        figure = each.plot(style=style)
        assert len(figure.axes) >= 3
        plt.close(figure)


def test_a_chart_of_the_lab_is_refused():
    with pytest.raises(Refusal, match="geomech ccf"):
        charts.refuse(Scene(Lifted(), UNEVEN))
