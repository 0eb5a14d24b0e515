"""Planes of shape space on which two joints of many move, the area tier of three joints, and what commands draw of them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from commands import geomech
from tabled import of_json, tabled, tabled_json

from geomech import Numerics, Scene, plots
from geomech.mathematics.gaits import Circle, Fourier, Wave
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations.plane import (
    Plane,
    ProjectedGait,
    interpolated_plane,
    plane,
)
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.geometry.two_form import spanned, spanned_by, two_form
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.tiers import TIERS
from geomech.mathematics.tiers.fitted import finest_grid, is_too_large
from geomech.scenes.frames import framed
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.maps.shape_space import plane_origin as _held
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE, Chain, Viscous
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
LOOP = Fourier(
    cos=((0.5, 0.0), (0.1, 0.1), (-0.3, 0.1)),
    sin=((0.1, 0.1), (0.6, 0.0), (0.2, -0.2)),
    centre=(0.1, -0.2, 0.15),
)
SCENE = """[medium]
law = "viscous"
ratio = 2.3
[body]
kind = "chain"
lengths = [0.7, 1.4, 0.9, 0.6]
length = 0.5
[gait]
kind = "fourier"
cos = [[0.5, 0.0], [0.1, 0.1], [-0.3, 0.1]]
sin = [[0.1, 0.1], [0.6, 0.0], [0.2, -0.2]]
centre = [0.1, -0.2, 0.15]
[numerics]
grid = 7
extent = 1.2
"""


@dataclass(frozen=True)
class Cubic:
    """A of three joints in closed form. turns (-): scales its row of headings."""

    turns: float = 1.0
    kind, joints, traits, length = "cubic", 3, Traits(linear=True), 0.5

    def A(self, alpha):
        a, b, c = np.moveaxis(np.asarray(alpha, float), -1, 0)
        rows = [
            [b * c, 0.3 * a**2, 0.4 * b],
            [0.2 * c, 0.1 * a, a * b],
            [0.7 * b, a * c, 0.5 * b**2],
        ]
        return np.moveaxis(
            np.array([np.broadcast_arrays(*row) for row in rows]), (0, 1), (-2, -1)
        ) * [
            [1],
            [1],
            [self.turns],
        ]

    def velocity(self, alpha, alphadot):
        return np.einsum("...ij,...j->...i", self.A(alpha), alphadot)

    def ccf(self, alpha, i, j):
        """By hand."""
        a, b, c = np.moveaxis(np.asarray(alpha, float), -1, 0)
        d = {
            (0, 1): [0.6 * a - c, 0.1 + 0 * a, self.turns * (c - 0.7)],
            (0, 2): [-b, b - 0.2, 0 * a],
            (1, 2): [0.4 + 0 * a, a, self.turns * (b - a)],
        }[i, j]
        A = self.A(alpha)
        x, y = A[..., i], A[..., j]
        bracket = [
            y[..., 2] * x[..., 1] - x[..., 2] * y[..., 1],
            x[..., 2] * y[..., 0] - y[..., 2] * x[..., 0],
            0 * a,
        ]
        return np.moveaxis(np.array(d) + np.array(bracket), 0, -1)


@pytest.mark.parametrize("pair", [(0, 1), (0, 2), (1, 2), (2, 0)])
def test_planes_have_the_curvature_of_the_pair(pair):
    system, at, (i, j) = Cubic(), [0.3, -0.2, 0.4], pair
    study = SceneTables(Scene(system, LOOP, Numerics(grid=7, extent=1.2)))
    cut = study.plane(pair, at)
    shapes = np.broadcast_to(at, (7, 7, 3)).copy()
    shapes[..., i], shapes[..., j] = np.meshgrid(*cut.ccf.axes, indexing="ij")
    right = system.ccf(shapes, i, j) if i < j else -system.ccf(shapes, j, i)
    np.testing.assert_allclose(np.moveaxis(cut.ccf.values, 0, -1), right, atol=1e-12)
    np.testing.assert_allclose(
        study.two_form.slice(i, j, at).values, cut.ccf.values, atol=1e-12
    )
    np.testing.assert_allclose(
        interpolated_plane(study.fitted, pair, at).connection.A,
        cut.connection.A,
        atol=1e-12,
    )
    assert study.plane(pair, at) is cut and cut.fixed == [
        k for k in range(3) if k not in pair
    ]


def test_a_plane_is_that_of_the_whole_field_in_sand():
    system, axes = (
        Swimmer(GLASS, Chain((0.7, 1.4, 0.9, 0.6))),
        connection.grid(3, 5, 1.2),
    )
    fitted = connection.fit(
        system.velocity, axes, 16, traits=system.traits, trusted=True
    )
    for at, half in (([0.6, 0.6, -1.2], False), ([0.0, 0.0, 0.0], True)):
        asked = []
        velocity = lambda a, u: asked.append(len(a)) or system.velocity(a, u)
        cut = plane(
            velocity, (axes[0], axes[2]), (0, 2), at, 16, traits=Traits(mirror=True)
        )
        k = np.abs(axes[1] - at[1]).argmin()
        for name in ("A", "residual", "speed"):
            whole = getattr(fitted, name)[..., k, :]
            for some in (cut, interpolated_plane(fitted, (0, 2), at)):
                np.testing.assert_allclose(
                    getattr(some.connection, name),
                    whole[:, [0, 2]] if name == "A" else whole,
                    atol=1e-9,
                )
        assert sum(asked) == (
            13 if half else 25
        )  # through the straight shape, left and right are alike


def test_the_area_of_three_joints_is_the_integral_over_a_surface():
    """Without brackets, the line integral of A on every surface (Stokes); with them positions hang on it, turning does not."""
    sizes = np.array([0.4, 1.0])
    flat = SceneTables(Scene(Cubic(turns=0.0), LOOP, Numerics(grid=7, extent=1.2)))
    along = (flat.scene.system.velocity(*LOOP.cycle(64, sizes))).mean(1) * 2 * np.pi
    table = tabled(flat.displacements(sizes, ["area", "direct"]))
    np.testing.assert_allclose(table["area"], along, atol=1e-12)
    assert (
        np.abs(along[:, :2]).min() > 1e-3
        and np.max(table["surface_spread"]["area"]) < 1e-12
    )
    study = SceneTables(Scene(Cubic(), LOOP, Numerics(grid=7, extent=1.2)))
    table = tabled(study.displacements(sizes, ["area", "direct"]))
    spread, turned = (
        np.array(table[key]["area"])
        for key in ("surface_spread", "surface_spread_heading")
    )
    assert (spread > 1e-4).all() and turned.max() < 1e-12
    assert (np.array(table["estimate"]["area"]) >= spread).all()
    off = np.array(table["area"]) - table["direct"]
    np.testing.assert_allclose(
        table["estimate"]["area"], np.hypot(*off[:, :2].T), rtol=1e-6
    )
    np.testing.assert_allclose(off[:, 2], 0.0, atol=1e-12)
    small = tabled(study.displacements([0.05, 0.1], ["area"]))["estimate"]["area"]
    assert np.log2(small[1] / small[0]) == pytest.approx(3.0, abs=0.15)


def test_the_spread_is_that_of_another_surface():
    """The cone over the first shape of the loop, by brute force."""
    system, sizes = Cubic(), [0.8]
    study = SceneTables(Scene(system, LOOP, Numerics(grid=7, extent=1.2, phases=256)))
    found = []
    for tip in (0, 64, 128, 192, None):
        alpha, alphadot = (x[0] for x in LOOP.cycle(256, sizes))
        at = alpha.mean(0) if tip is None else alpha[tip]
        total = 0.0
        for s in (np.arange(40) + 0.5) / 40:
            u, v, where = alpha - at, s * alphadot, at + s * (alpha - at)
            for i, j in ((0, 1), (0, 2), (1, 2)):
                total += (
                    system.ccf(where, i, j)
                    * (u[:, i] * v[:, j] - u[:, j] * v[:, i])[:, None]
                ).mean(0)
        found.append(se2.exp(2 * np.pi * total / 40))
    apart = max(np.hypot(*(x - found[-1])[:2]) for x in found)
    assert study.spread("area", amplitudes=sizes)[0, 0] == pytest.approx(
        apart, rel=0.02
    )
    np.testing.assert_allclose(
        study.poses("area", amplitudes=sizes)[0], found[-1], atol=3e-4
    )


def test_commands_tell_the_surface_and_draw_slices(tmp_path):
    (tmp_path / "s.toml").write_text(SCENE)
    args = ("displacement", "s.toml", "--amplitudes", "0.5,1", "--tiers")
    code, out, err = geomech(*args, "area,direct", "--json", cwd=tmp_path)
    table = tabled_json(out)
    assert (code, err) == (0, "") and of_json(out)["surface_spread"].unit == "m"
    spread = table["surface_spread"]["area"]
    assert 0 < spread[0] < spread[1] < table["estimate"]["area"][1]
    assert "surface spread (m)" in geomech(*args, "area", "--all", cwd=tmp_path)[1]
    code, _, err = geomech(
        "ccf",
        "s.toml",
        "--plot",
        "a.svg",
        "--pair",
        "3,1",
        "--slice",
        "20deg",
        cwd=tmp_path,
    )
    assert (code, err) == (0, "") and "0.349 rad" in (tmp_path / "a.svg").read_text()
    code, _, err = geomech(
        "connection",
        "s.toml",
        "-o",
        "a.nc",
        "--plot",
        "b.svg",
        "--pair",
        "2,3",
        cwd=tmp_path,
    )
    assert (code, err) == (0, "") and "0.1 rad" in (tmp_path / "b.svg").read_text()


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["--pair", "1,4"], "s.toml: --pair: '1,4' must be two different joints from 1 to 3"),
        (["--pair", "2,2"], "s.toml: --pair: '2,2' must be two different joints from 1 to 3"),
        (["--pair", "one"], "s.toml: --pair: 'one' is not two joints such as 1,3"),
        (["--slice", "0,1"], "s.toml: --slice takes one angle for all joints that are held, or 3 for a shape, got 2"),
        (["--slice", "1.3"], "s.toml: --slice: the angles must lie within the field's 1.2 rad: give others, or raise --extent"),
        (["--slice", "x"], "--slice: 'x' is not a list of numbers such as 0.5,0.3 or 30deg,20deg"),
        (["--metric"], "--metric and --stretch are those of two joints: drop them for slices"),
        (["--compare-frame", "link-1"], "--compare-frame draws one pair of joints: say which with --pair"),
    ],
)  # fmt: skip
def test_what_is_no_slice_is_refused(args, said, tmp_path):
    (tmp_path / "s.toml").write_text(SCENE)
    code, _, err = geomech("ccf", "s.toml", "--plot", "a.png", *args, cwd=tmp_path)
    assert (
        code == 2
        and said in err
        and len(err.splitlines()) == 1
        and not (tmp_path / "a.png").exists()
    )


def test_rows_of_planes_say_what_is_held_and_gaits_cast_shadows():
    system = Swimmer(Viscous(2.3), Chain((0.7, 1.4, 0.9, 0.6)))
    study = SceneTables(Scene(system, LOOP, Numerics(grid=6, extent=1.2)))
    fig = plots.planes_figure(
        [study.plane((0, 1)), study.plane((2, 0), [0.0, 0.3, 0.0])], LOOP
    )
    first, last = fig.axes[0], fig.axes[5]
    assert (first.get_xlabel(), last.get_xlabel(), last.get_ylabel()) == (
        r"$\alpha_{1}$ (rad)", r"$\alpha_{3}$ (rad)", r"$\alpha_{1}$ (rad)",
    )  # fmt: skip
    assert [t.get_text() for ax in (fig.axes[0], fig.axes[3]) for t in ax.texts if "=" in t.get_text()] == [
        r"$\alpha_{3}$ = 0.15 rad", r"$\alpha_{2}$ = 0.3 rad",
    ]  # fmt: skip
    dashed = [line for line in last.lines if line.get_linestyle() == "--"]
    assert len(dashed) == 1 and "dashed" in fig.get_supxlabel()
    curve = LOOP.shape(np.linspace(0, 2 * np.pi, 400))
    np.testing.assert_allclose(np.column_stack(dashed[0].get_data()), curve[:, [2, 0]])
    flat = Fourier(
        cos=((0.5,), (0.0,), (0.0,)),
        sin=((0.0,), (0.0,), (0.4,)),
        centre=(0.1, -0.2, 0.15),
    )
    for at, lies in ((-0.2, True), (-0.1, False)):
        cut = Plane((0, 2), (0.0, at, 0.0), study.plane((0, 2)).connection)
        assert ProjectedGait(flat, cut).lies_in_plane == lies
        fig = plots.planes_figure([cut], flat)
        assert bool(fig.get_supxlabel()) != lies


def test_many_joints_have_planes_and_no_field():
    study = SceneTables(
        Scene(
            Swimmer(Viscous(2.0), Chain((1,) * 9)),
            Wave(amplitude=0.5, joints=8),
            Numerics(grid=5, extent=1.0),
        )
    )
    assert study.plane((6, 2)).ccf.values.shape == (3, 5, 5)
    with pytest.raises(
        ValueError, match="a pair must be two of the joints 1 to 8, got 3, 9"
    ):
        study.plane((2, 8))
    with pytest.raises(ValueError, match="lies outside the field"):
        study.plane((0, 1), np.full(8, 1.1))
    assert len(two_form(study.plane((0, 1)).connection).pairs) == 1
    form = two_form(connection.fit(Cubic().velocity, connection.grid(3, 5, 1.0), 12))
    with pytest.raises(ValueError, match="moves 2 joints"):
        spanned(form, Circle())


@dataclass(frozen=True)
class Sandy:
    """Of four joints, not linear in alphadot."""

    kind, joints = "sandy", 4

    def velocity(self, alpha, alphadot):
        a, u = np.broadcast_arrays(alpha, alphadot)
        speed2 = (u**2).sum(-1) + 1e-300
        linear = [
            np.cos(a[..., 1]) * u[..., 0] + 0.3 * u[..., 3],
            np.sin(a[..., 0]) * u[..., 2],
            a[..., 3] * u[..., 1],
        ]
        return np.stack(
            [
                x + 0.4 * u[..., k] ** 3 * np.cos(a[..., k]) / speed2
                for k, x in enumerate(linear)
            ],
            -1,
        )


def test_beyond_the_field_tiers_solve_around_the_gait(monkeypatch):
    """As from a fine field, of A and of its two-form; the loop's integral of A and the brackets of a surface, for that."""
    gait = Fourier(
        cos=((0.5, 0.1), (0.1, 0.2), (-0.3, 0.1), (0.2, 0.0)),
        sin=((0.1, 0.2), (0.6, 0.0), (0.2, 0.1), (-0.4, 0.0)),
        centre=(0.1, 0.2, 0.0, -0.1),
    )
    scene = Scene(
        Sandy(), gait, Numerics(grid=10, extent=1.0, interpolation=5, directions=64)
    )
    tabulated, asked = SceneTables(scene), ([0.5, 0.9], ["area", "path", "direct"])
    found = tabled(tabulated.displacements(*asked))
    assert "field" in found["seconds"]
    monkeypatch.setattr("geomech.mathematics.tiers.fitted.LARGEST_FIELD", 9_999)
    study = SceneTables(scene)
    around = tabled(study.displacements(*asked))
    assert "field" not in around["seconds"] and not any(
        key[0] == "connection" for key in study.computed
    )
    for tier in ("area", "path"):
        np.testing.assert_allclose(around[tier], found[tier], atol=3e-5)
        assert np.abs(np.array(around[tier]) - found["direct"]).max() > 1e-3
    assert around["surface_spread"]["area"] == pytest.approx(
        found["surface_spread"]["area"], rel=0.3
    )  # fewer surfaces
    jobs = study.cost(*asked)
    assert jobs.balances >= study.plan("path").balances(2, 256) == 2 * 256 * 64
    assert study.poses("area").shape == study.poses("path").shape == (3,)


def test_the_integral_by_stokes_is_that_of_the_two_form():
    system = Cubic()
    form = two_form(connection.fit(system.velocity, connection.grid(3, 6, 1.2), 12, 5))
    here, there = (
        spanned(form, LOOP, [0.5, 1.0], 128, 2),
        spanned_by(system.A, LOOP, [0.5, 1.0], 128, 2, 128),
    )
    for a, b in zip(here, there):
        np.testing.assert_allclose(a, b, atol=1e-12)
    assert here.spread[:, 0].min() > 1e-4


def test_six_links_have_area_and_path_and_a_field_is_refused(tmp_path):
    chain = SCENE.partition("[gait]")[0].replace(
        "[0.7, 1.4, 0.9, 0.6]", "[0.7, 1.4, 0.9, 0.6, 1.1, 0.8]"
    )
    (tmp_path / "six.toml").write_text(
        chain + '[gait]\nkind = "wave"\namplitude = 0.8\njoints = 5\n'
    )
    code, out, err = geomech(
        "displacement", "six.toml", "--amplitudes", "0.2,0.4", "--json", cwd=tmp_path
    )
    table = tabled_json(out)
    assert (code, err) == (0, "") and {"area", "path", "direct"} < {*table}
    area, direct = np.array(table["area"]), np.array(table["direct"])
    off = np.hypot(*(area - direct)[:, :2].T)
    assert np.log2(off[1] / off[0]) == pytest.approx(3.0, abs=0.3) and off[
        1
    ] < 0.1 * np.hypot(*direct[1, :2])
    np.testing.assert_allclose(area[:, 2], direct[:, 2], atol=1e-5)
    code, _, err = geomech("connection", "six.toml", "-o", "a.nc", cwd=tmp_path)
    assert (
        code == 2
        and "a field of 31^5 shapes is too large (3.44 GB for A): lower [numerics] grid, to 7 or less"
        in err
    )
    four = chain.replace(", 0.8]", "]") + '[gait]\nkind = "wave"\njoints = 4\n'
    (tmp_path / "five.toml").write_text(
        four.replace('law = "viscous"\nratio = 2.3', 'name = "glass-0.3mm-loose"')
    )
    code, _, err = geomech(
        "connection", "five.toml", "--grid", "36", "-o", "a.nc", cwd=tmp_path
    )
    assert (
        code == 2
        and err.endswith("say --yes, or lower --grid, to 13 or less\n")
        and not (tmp_path / "a.nc").exists()
    )


def test_what_hangs_on_the_surface_is_part_of_every_estimate(monkeypatch):
    """Even where the force balance is near by chance."""
    spread = np.array([[0.3, 0.2], [1e-9, 0.4]])
    monkeypatch.setitem(
        TIERS._parts, "area", planned(TIERS["area"], spread=lambda *asked: spread)
    )
    scene = Scene(Cubic(), LOOP, Numerics(grid=7, extent=1.2))
    table = tabled(SceneTables(scene).displacements([0.4, 0.5], ["area"]))
    assert (
        table["estimate"]["area"][0] == 0.3
        and 1e-6 < table["estimate"]["area"][1] < 0.3
    )
    assert (
        table["estimate_heading"]["area"]
        == [0.2, 0.4]
        == table["surface_spread_heading"]["area"]
    )
    monkeypatch.setitem(
        TIERS._parts,
        "adapted",
        planned(TIERS["adapted"], balances=lambda *asked: 10**8),
    )
    monkeypatch.setattr(
        "geomech.studies.displacement.choose.solved_phases", lambda *asked: 10**9
    )
    assert tabled(cheapest_displacements(scene, [0.4, 0.5], 0.02))["tier"] != "area"
    monkeypatch.setitem(
        TIERS._parts,
        "area",
        planned(TIERS["area"], spread=lambda *asked: np.full((2, 2), 0.01)),
    )
    found = tabled(cheapest_displacements(scene, [0.4, 0.5], 0.02))
    assert found["tier"] == "area" and min(found["estimate"]["area"]) == 0.01


def planned(tier, **changes):
    """The tier with another plan."""
    return replace(tier, plan=lambda *asked: replace(tier.plan(*asked), **changes))


def test_three_joints_keep_their_field_and_more_have_one_that_fits():
    three, four = Cubic(), Sandy()
    assert not any(is_too_large(three, Numerics(grid=n)) for n in (31, 61))
    assert (
        [is_too_large(four, Numerics(grid=n)) for n in (13, 15)] == [False, True]
        and finest_grid(4) == 13
        and finest_grid(5) == 7
    )
    chain = Swimmer(Viscous(2.0), Chain((1,) * 5))
    with pytest.raises(
        ValueError,
        match=r"a frame on a grid of 15\^4 shapes is too large: lower \[numerics\] grid",
    ):
        framed(chain, Numerics(grid=15))
    scene = Scene(framed(chain, Numerics(grid=7)), Wave(joints=4), Numerics(grid=7))
    assert SceneTables(scene).cost([1.0], ["direct"]).balances > 7**4 * 16 / 2


def test_slices_hold_joints_in_their_order():
    scene = Scene(Sandy(), Wave(joints=4, offset=0.7))
    assert _held(scene, (3, 1), [0.3, -0.1], True).tolist() == [0.3, 0.7, -0.1, 0.7]
    assert _held(scene, (3, 1), [0.3], False).tolist() == [0.3, 0.7, 0.3, 0.7]
    assert _held(scene, (3, 1), [0.3, 0.1, 0.2, 0.4], False).tolist() == [
        0.3,
        0.1,
        0.2,
        0.4,
    ]
    assert _held(scene, (0, 2), None, True).tolist() == [0.7] * 4
    with pytest.raises(
        ValueError,
        match="one angle for all joints that are held, 2 one by one, or 4 for a shape, got 3",
    ):
        _held(scene, (3, 1), [0.3, 0.1, 0.2], True)


def test_a_surface_says_what_its_shades_mean():
    study = SceneTables(Scene(Cubic(), LOOP, Numerics(grid=6, extent=1.2)))
    flat = Fourier(
        cos=((0.5,), (0.0,), (0.0,)),
        sin=((0.0,), (0.0,), (0.4,)),
        centre=(0.1, -0.2, 0.15),
    )
    cut = study.plane((0, 2))
    drawn = plots.ccf_surface(cut.ccf, 1, [ProjectedGait(flat, cut)])
    signs = np.sign(
        cut.ccf(
            ProjectedGait(flat, cut).shape(np.linspace(0, 6, 50), np.linspace(0, 1, 9))
        )[..., 1]
    )
    found = [text.get_text() for text in drawn.get_legend().get_texts()]
    assert found == [
        way
        for sign, way in ((1, "to the left"), (-1, "to the right"))
        if (sign * signs > 0).any()
    ]


def test_a_run_of_three_joints_has_its_field_and_all_slices(tmp_path, monkeypatch):
    from geomech.questions.swimmers import run

    system = Swimmer(Viscous(2.3), Chain((0.7, 1.4, 0.9, 0.6)))
    drawn, scene = {}, Scene(system, LOOP, Numerics(grid=5, extent=1.2, phases=32))
    monkeypatch.setattr(
        run, "save_figure", lambda fig, stem: drawn.update({stem.name: fig})
    )
    for name in ("plane_connection_figure", "planes_figure"):
        monkeypatch.setattr(
            plots,
            name,
            lambda planes, *gait, **options: [one.pair for one in planes],
        )
    monkeypatch.setattr(
        plots, "displacement_figure", lambda tables, *told, **options: [*tables]
    )
    found = run.Run(scene).ask()
    run.Run.fill(found, tmp_path)
    pairs = [(0, 1), (0, 2), (1, 2)]
    assert drawn == {"connection": pairs, "ccf": pairs, "displacement": ["fourier"]}
    assert (tmp_path / "connection.nc").exists()
    assert {"area", "path", "direct"} <= {*found["tier"].values}
    assert run.Run(scene).cost().balances >= 5**3 // 2 * 12 + 3 * 5**2 * 12
