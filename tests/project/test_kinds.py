"""Laws, bodies, gaits, effects and systems of one's own: by a file, by `register`, by an installed package."""

import hashlib
import importlib.metadata
import inspect
import math
import pathlib
import re
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from commands import geomech
from registry import EFFECTS
from tabled import of_json, tabled, tabled_json

from geomech.core.entry_points import installed_entries
from geomech.mathematics.gaits import KINDS as GAITS
from geomech.mathematics.gaits import Circle, Gait, Sine
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems import Premise, Solver, Swimmer, capability
from geomech.mathematics.systems.capabilities import Recorded
from geomech.scenes import Numerics, Scene, kinds, load, parse, toml
from geomech.scenes.format.keys import text
from geomech.scenes.format.schema import schema
from geomech.scenes.kinds import load_file, register
from geomech.shell import cli
from geomech.shell.describe.scene import description
from geomech.shell.describe.system import notes
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables
from rft import Backbone, Chain, Coulomb, EndCaps, Granular, Viscous, body_velocity
from rft.core.refusal import Refusal
from rft.core.registry import REGISTRIES
from rft.effects import Effect
from rft.laws.base import TermLaw, is_rate_independent

PAGE = (
    pathlib.Path(__file__).parents[2] / ".docs" / "how-it-works" / "extending.md"
).read_text()
SMALL = Numerics(grid=7, phases=32)
pytestmark = pytest.mark.usefixtures("own_parts", "fastest")


class Bare:
    """A law that supplies its traction and nothing else."""

    def __init__(self, law):
        self.law = law

    def traction(self, v_t, v_n, eps=0.0):
        return self.law.traction(v_t, v_n, eps)


LAW = """
from dataclasses import dataclass
@dataclass(frozen=True)
class Thick:
    "thickness (-): drag over speed."
    thickness: float = 1.0
    law = "thick"
    def traction(self, v_t, v_n, eps=0.0):
        return self.thickness * v_t, 2.5 * self.thickness * v_n
"""
SCENE = """[medium]\nlaw = "thick"\nthickness = 3.0\n[body]\nkind = "chain"\nlengths = [1, 1.4, 0.8]\n
[gait]\nkind = "circle"\ncentre = [0.2, -0.1]\n[numerics]\ngrid = 7\nphases = 32\n"""


def test_the_law_of_the_page_runs_as_it_stands_there(tmp_path, monkeypatch):
    section = PAGE.partition("## Laws, bodies")[2].partition("\n## ")[0]
    (law, *_), scene = (
        re.findall(r"```python\n(.*?)```", section, re.S),
        re.search(r"```toml\n(.*?)```", section, re.S)[1],
    )
    assert len(law.splitlines()) < 20
    monkeypatch.chdir(tmp_path)
    (tmp_path / "power.py").write_text(law)
    (tmp_path / "power.toml").write_text(scene)
    command = re.search(r"`geomech (displacement power\.toml .*?)`", section)[1]
    code, out, err = geomech(*command.split(), "--json", "--tiers", "direct")
    assert code == 0
    assert err.count("\n") == 1
    assert (
        "power has no closed form" in err and "gauss:24" in err and "five times" in err
    )
    for amplitudes, wanted in (
        ("0.5", 0),
        ("2.6", 2),
    ):  # said once by a search that asks often, and beside an error
        args = (
            "displacement",
            "power.toml",
            "--plugin",
            "power.py",
            "--amplitudes",
            amplitudes,
        )
        code, out, err = (
            geomech(*args, "--tol", "1e-2")
            if wanted == 0
            else geomech(*args, "--tiers", "path")
        )
        assert (code, err.count("\n"), err.count("no closed form")) == (
            wanted,
            1,
            int(wanted == 0),
        )
    code, out, err = geomech(*command.split(), "--json", "--tiers", "direct")
    module = {}
    exec(law, module)
    shear = Swimmer(module["Power"](0.4), Chain())
    net = tabled_json(out)["direct"]
    np.testing.assert_allclose(
        net, shear.run(*Circle().cycle(256, [0.5, 1.0])).net, atol=1e-9
    )
    assert {p.name for p in tmp_path.iterdir()} == {
        "power.py",
        "power.toml",
    }  # no cache beside them
    # With the power 1 it is a viscous law of the same ratio, whose integrals are exact.
    alike = Swimmer(module["Power"](1.0), Chain()).run(*Circle().cycle(32)).net
    np.testing.assert_allclose(
        alike, Swimmer(Viscous(3.0), Chain()).run(*Circle().cycle(32)).net, atol=1e-9
    )


@pytest.mark.parametrize(
    "law", [Viscous(3.7), Granular(C=2.3, gamma0=0.4)], ids=["viscous", "granular"]
)
def test_a_law_of_traction_alone_gives_every_tier_within_its_error(law):
    gait, body, amplitudes = (
        Circle(amplitude=0.8, centre=(0.3, -0.2)),
        Chain((1, 1.4, 0.8)),
        np.array([0.5, 0.9]),
    )
    exact, bare = (
        SceneTables(Scene(Swimmer(x, body), gait, SMALL)) for x in (law, Bare(law))
    )
    finer = bare.with_numerics(loads="gauss:96")  # leaves a quarter
    for tier in ("area", "direct"):
        ours, theirs, better = (
            x.poses(tier, amplitudes=amplitudes) for x in (exact, bare, finer)
        )
        size, off = np.hypot(*ours[-1, :2]), estimate.distance(ours, theirs).max()
        assert off < 0.04 * size
        assert estimate.distance(ours, better).max() <= max(off / 2, 1e-9)
    poses, errors = estimate.direct(bare.scene, gait, amplitudes, 128)
    truth = estimate.direct(exact.scene, gait, amplitudes, 1024)[0]
    assert (estimate.pose_distance(poses, truth, 1.0) <= errors + 1e-9).all()
    assert exact.tiers == bare.tiers


def test_a_law_of_traction_alone_takes_backbones_and_says_its_rule():
    fine = Swimmer(Bare(Coulomb()), Backbone(8, length=0.4))
    exact = Swimmer(Coulomb(), Backbone(8, length=0.4))
    alpha, alphadot = (
        np.full((2, 7), 0.3) * [[1], [-2]],
        np.cos(np.arange(14.0)).reshape(2, 7),
    )
    np.testing.assert_allclose(
        fine.velocity(alpha, alphadot), exact.velocity(alpha, alphadot), atol=2e-3
    )
    assert fine.balance_size.evaluations == 24 * exact.balance_size.evaluations
    assert "gauss:24" in description(Scene(fine, Sine(elements=8), SMALL))
    assert fine.refined().solver.loads == "gauss:48"
    assert capability(fine, Recorded).about()["loads"] == "gauss:24"
    told_otherwise = fine.with_solver(Solver(loads="midpoint:10"))
    assert (notes(told_otherwise), told_otherwise.refined().solver.loads) == (
        (),
        "midpoint:20",
    )


@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "end-caps"])
def test_a_law_of_traction_alone_takes_every_effect_and_does_work(name):
    """On 16 phases of an uneven chain; end caps alone take the numbers of a granular law."""
    law, body, cycle = (
        Granular(C=1.8, gamma0=0.24),
        Chain((1, 1.4, 0.8)),
        Circle(amplitude=0.9).cycle(16, [0.9]),
    )
    effects, finer = (EFFECTS[name][0](0.3),), Solver(cycles=1, loads="gauss:96")
    both = (law, body, effects, Solver(cycles=1)), (Bare(law), body, effects, finer)
    exact, bare = (Swimmer(*parts).run(*cycle, work=True) for parts in both)
    np.testing.assert_allclose(
        bare.net, exact.net, atol=0.02 * np.abs(exact.net[0, :2]).max()
    )
    np.testing.assert_allclose(bare.work.power, exact.work.power, rtol=0.02)
    with pytest.raises(ValueError, match="end caps take a granular medium, got Bare"):
        Swimmer(Bare(law), body, (EndCaps(0.1),))


def test_the_speed_matters_under_a_law_of_no_one_power():
    class Mud(TermLaw):
        dry, viscous = ((1.0, 1.0, 1.5),), (1.0, 2.0)

    for mud in (Mud(), Bare(Mud())):
        assert not is_rate_independent(mud)
        swimmer = Swimmer(mud, Chain())
        assert swimmer.traits.lacks == Premise.RATE_INDEPENDENT
        with pytest.raises(
            ValueError,
            match="no connection or CCF with the law .*no one power of the speed: use the direct tier, or take another law",
        ):
            SceneTables(Scene(swimmer, Circle(), SMALL)).poses("path")
    for law in (
        Viscous(),
        Coulomb(),
        Bare(Viscous()),
        Bare(Granular(1.8, 0.24)),
        Bare(Coulomb()),
    ):
        assert is_rate_independent(law)


def test_tractions_that_cannot_be_asked_are_refused_with_one_line():
    class NoRounding:
        def traction(self, v_t, v_n):
            return v_t, v_n

    class Wrong:
        def __init__(self, f):
            self.traction = lambda v_t, v_n, eps=0.0: f(v_t, v_n)

    for law, said in (
        (NoRounding(), r"NoRounding.traction must take \(v_t, v_n, rounding=0.0\)"),
        (Wrong(lambda t, n: t), "must take|must return|fails"),
        (
            Wrong(lambda t, n: (t, np.ones(5))),
            r"must return arrays of the velocities' shape \(2, 3\), got \(2, 3\) and \(5,",
        ),
        (Wrong(lambda t, n: 1 / 0), "Wrong.traction fails: ZeroDivisionError"),
        (Wrong(lambda t, n: (-t, -n)), "no drag at any velocity"),
    ):
        with pytest.raises(ValueError, match=said) as caught:
            body_velocity(law, Chain(), np.zeros(2), np.ones(2))
        assert "\n" not in str(caught.value)


# One of each family, not of 1's and 0's, as a file would hold it.
@dataclass(frozen=True)
class Hinge:
    """Two plates. angle (rad): of one to the other at rest."""

    angle: float = 0.2
    length = 1.0
    joints = 2
    kind = "hinge"

    def motion(self, alpha, alphadot):
        return Chain((1, 2, 1)).motion(alpha + self.angle, alphadot)


@dataclass(frozen=True, kw_only=True)
class Peanut(Gait):
    """waist (-): how far it is drawn in."""

    waist: float = 0.3
    harmonics = 3
    kind = "peanut"

    def unit(self, t):
        t = np.asarray(t, float)
        return np.stack([np.cos(t), np.sin(t) * (1 - self.waist * np.sin(t) ** 2)], -1)

    def unit_rate(self, t):
        t = np.asarray(t, float)
        return np.stack(
            [-np.sin(t), np.cos(t) * (1 - 3 * self.waist * np.sin(t) ** 2)], -1
        )


@dataclass(frozen=True)
class Slick(Effect):
    """by (-): factor of the drag along."""

    by: float = 0.5
    kind = "slick"
    limit = "by = 1"
    cost = "one multiplication"

    def apply(self, problem, site=None, past=None):
        return problem._replace(sides=problem.sides.with_factors(self.by, self.by, 1.0))


@dataclass(frozen=True)
class Car:
    """base (m): between the axles."""

    base: float = 0.4
    kind = "car"
    joints = 2
    traits = Traits(linear=True)

    def velocity(self, alpha, alphadot):
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        v = alphadot[..., 0]
        return np.stack(
            [v, 0 * v, v * np.tan(0.3 * np.tanh(alpha[..., 1])) / self.base], -1
        )


OWN = {
    "hinge": '[medium]\nname = "coulomb"\n[body]\nkind = "hinge"\nangle = -0.1\n[gait]\nkind = "circle"\n',
    "peanut": '[medium]\nname = "viscous-2"\n[body]\nkind = "chain"\n[gait]\nkind = "peanut"\nwaist = 0.1\n',
    "slick": '[medium]\nname = "coulomb"\n[body]\nkind = "chain"\n[gait]\nkind = "circle"\n[[effects]]\nkind = "slick"\n',
    "car": '[system]\nkind = "car"\nbase = 0.3\n[gait]\nkind = "circle"\n',
}
PARTS = {"hinge": Hinge, "peanut": Peanut, "slick": Slick, "car": Car}


@pytest.mark.parametrize("name", OWN)
def test_one_of_each_family_runs_everywhere_and_round_trips(name):
    text = OWN[name] + "[numerics]\ngrid = 7\nphases = 32\n"
    with pytest.raises(Refusal, match=f"{name}' is unknown"):
        parse(text)
    assert register(PARTS[name]) is PARTS[name]
    scene = parse(text)
    assert parse(toml(scene)) == scene
    anew = toml(scene.changed(text="", numerics=Numerics(grid=8, phases=32)))
    assert f'"{name}"' in anew
    assert toml(parse(anew)) == anew
    assert name in description(scene)
    study = SceneTables(scene)
    table = tabled(study.displacements([0.4, 0.7]))
    assert np.isfinite(table["direct"]).all()
    with pytest.raises(ValueError, match="car|hinge|peanut|slick"):
        register(
            type("Other", (PARTS[name],), {"__module__": "elsewhere"})
        )  # two of one name


def test_a_file_registers_what_is_in_it_and_a_scene_alone_does_not(
    tmp_path, monkeypatch
):
    (tmp_path / "thick.py").write_text(LAW)
    (tmp_path / "thick.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    velocity = [
        "velocity",
        "thick.toml",
        "--alpha",
        "0.3,0.2",
        "--alphadot",
        "1,0",
        "--json",
    ]
    code, out, err = geomech(*velocity)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and "'thick' is unknown" in err and "--plugin" in err
    code, out, err = geomech(*velocity, "--plugin", "thick.py")
    assert code == 0
    xi = body_velocity(Viscous(2.5), Chain((1, 1.4, 0.8)), [0.3, 0.2], [1, 0]).xi
    np.testing.assert_allclose(of_json(out)["xi"].values, xi, atol=1e-9)
    assert geomech("--plugin", "thick.py", *velocity)[:2] == (0, out)
    (tmp_path / "more.py").write_text(
        LAW.replace("thick", "thin").replace("Thick", "Thin")
    )
    assert geomech(*velocity, "--plugin", "more.py", "--plugin", "thick.py")[:2] == (
        0,
        out,
    )
    (tmp_path / "thick.py").write_text(
        LAW.replace("2.5", "1.0")
    )  # mended: the new one counts
    assert geomech(*velocity, "--plugin", "thick.py")[1] != out


def test_every_command_that_takes_a_scene_takes_plugins():
    for command in cli.app.registered_commands:
        takes = set(inspect.signature(command.callback).parameters)
        assert ("plugin" in takes) == (
            "name" in takes or command.callback.__name__ == "reference"
        ), command.callback


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("law = ", "line 1: SyntaxError"),
        (
            "import nothing_of_that_name",
            "line 1: ModuleNotFoundError: No module named 'nothing_of_that_name'",
        ),
        ("x = 1\nraise SystemExit(3)", "line 2: SystemExit: 3"),
        ("x = 1", 'no class in it has a law = "..."'),
        (
            LAW.replace('"thick"', '"granular"'),
            "is named 'granular', as one that is built in: give it another name",
        ),
        (
            LAW.replace("(frozen=True)", ""),
            "must be a value: put @dataclass(frozen=True) above it",
        ),
        (
            LAW.replace("law =", "law: str ="),
            "has law as a parameter: write law = 'thick' without a type",
        ),
        (LAW.replace('"thick"', "3"), 'has no name: give the class law = "..."'),
        (
            LAW.replace("traction", "drag"),
            "is no part of a scene: a law is a class with `traction`",
        ),
        (LAW + LAW.replace("Thick", "Other"), "is named 'thick', as the Thick of"),
        (
            LAW + LAW.replace("Thick", "Other").replace('"thick"', '"viscous"'),
            "built in",
        ),
    ],
)
def test_files_that_cannot_be_registered_get_one_line_and_leave_nothing(
    text, said, tmp_path
):
    path = tmp_path / "own.py"
    path.write_text(text)
    with pytest.raises(Refusal, match=".") as caught:
        load_file(path)
    assert said in str(caught.value)
    assert str(caught.value).startswith(f"plugin {path}")
    assert kinds.code() == {}
    assert "thick" not in REGISTRIES["geomech.media"]
    assert not [name for name in sys.modules if name.startswith("geomech_plugin_own")]


def test_a_file_tells_its_own_parts_and_not_those_of_a_module_beside_it(
    tmp_path, monkeypatch
):
    monkeypatch.syspath_prepend(str(tmp_path))
    beside = LAW.replace("Thick", "Thin").replace('"thick"', '"thin"')
    (tmp_path / "thin_beside.py").write_text(
        f"from rft.laws.base import LAWS\n{beside}\nLAWS.register(Thin)"
    )
    (tmp_path / "own.py").write_text("import thin_beside" + LAW)
    assert (
        load_file(tmp_path / "own.py") == ["thick"]
        and "thin" in REGISTRIES["geomech.media"]
    )


@pytest.mark.parametrize("future", [False, True])
def test_a_file_is_run_as_python_would_with_types_as_it_writes_them(future, tmp_path):
    types = "{'thickness': 'float'}" if future else "{'thickness': float}"
    head = "from __future__ import annotations\n" * future
    (tmp_path / "own.py").write_text(
        f"{head}{LAW}assert Thick.__annotations__ == {types}, Thick.__annotations__\n"
    )
    assert load_file(tmp_path / "own.py") == ["thick"]
    assert parse(SCENE).system.medium.thickness == 3.0
    with pytest.raises(
        Refusal, match=r"\[medium\] Expected `float`, got `str` - at `.thickness`"
    ):
        parse(SCENE.replace("3.0", '"3"'))


def test_names_of_no_python_file_are_refused(tmp_path):
    for name, said in (
        ("own.toml", "ends in .py"),
        ("missing.py", "No such file"),
        ("", "ends in .py"),
    ):
        with pytest.raises(Refusal, match=said):
            load_file(tmp_path / name if name else "")
    for raw, said in (
        (b"\xff\xfe\x00", "it is not text"),
        (b"#" * 1_000_001, "it is larger than 1 MB"),
    ):
        (tmp_path / "own.py").write_bytes(raw)
        with pytest.raises(Refusal, match=f"plugin .*: {said}"):
            load_file(tmp_path / "own.py")


IMPORTS = {  # of a module beside that of a law
    "a function": "from thick_factor import times",
    "a constant": "from thick_factor import FACTOR",
    "the module": "import thick_factor",
    "by another": "from thick_many import MANY",
    "a package": "import thick_package.inner",
    "from a package": "from thick_package import inner",
    "when it is called": "def later():\n    import thick_factor",
}


@pytest.mark.parametrize("name", IMPORTS)
def test_digests_of_own_code_cover_its_sources(name, tmp_path, monkeypatch):
    """Of a file that is edited and loaded again, and of a module beside it from which it takes something."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "thick_package").mkdir()
    (tmp_path / "thick_package" / "__init__.py").write_text("")
    (tmp_path / "thick_package" / "inner.py").write_text(
        "def never():\n    from .. import none\nfrom . import leaf"
    )
    (tmp_path / "thick_package" / "leaf.py").write_text(
        "from thick_factor import FACTOR"
    )
    (tmp_path / "thick_many.py").write_text(
        "import functools, thick_factor\nMANY = [functools.partial(thick_factor.times)]"
    )
    found = []
    for law, factor in ((LAW, 1), (LAW.replace("2.5", "2.6"), 1), (LAW, 2), (LAW, 1)):
        (tmp_path / "thick.py").write_text(
            f"{law}{IMPORTS[name]}\n"
            if "def" in IMPORTS[name]
            else f"{IMPORTS[name]}\n{law}"
        )
        (tmp_path / "thick_factor.py").write_text(
            f"import rft.laws\nFACTOR = {factor}\ndef times(x):\n    return FACTOR * x\n"
        )
        for module in [module for module in sys.modules if module.startswith("thick_")]:
            monkeypatch.delitem(sys.modules, module)
        monkeypatch.setattr(kinds, "_sources", {})
        importlib.invalidate_caches()
        load_file(tmp_path / "thick.py")
        found.append(kinds.code())
    assert (
        all("thick_factor" in one for one in found)
        and len({len(one) for one in found}) == 1
    )
    assert not [
        module
        for one in found
        for module in one
        if module.partition(".")[0] in ("rft", "geomech", "numpy")
    ]
    assert found[0] == found[3] and len({tuple(one.items()) for one in found}) == 3


SCRIPT = """
import sys
import numpy as np
from geomech.mathematics.gaits import Circle
from geomech.scenes import Scene, kinds
from geomech.studies.displacement import cycles, sweep
from geomech.mathematics.systems import SYSTEMS

def drift(alpha, alphadot):
    a, rates = np.broadcast_arrays(alpha, alphadot)
    return 1.0 * np.stack([a[..., 0] * rates[..., 1], rates[..., 0], 0.0 * a[..., 0]], -1)

def interrupted(*batch):
    cycles._rows = interrupt
    return rows(*batch)

def interrupt(*batch):
    raise KeyboardInterrupt

kinds.register(drift, joints=2)
cycles.BATCH_SIZE = 1
if sys.argv[1:]:
    rows, cycles._rows = cycles._rows, interrupted
found = sweep.sweep(Scene(SYSTEMS["drift"](), Circle()), {"gait.amplitude": [0.5, 1.0]}, ".kept")
print(*found["x"].values.round(9))
"""


def test_an_edited_script_resumes_nothing(tmp_path):
    """Which is stopped half way, and computes by the function that it has then."""

    def run(text, *arguments):
        (tmp_path / "script.py").write_text(text)
        return subprocess.run(
            [sys.executable, "-B", "script.py", *arguments],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )

    assert (
        run(SCRIPT, "stop").stderr.endswith("the same command goes on from there\n")
        and (tmp_path / ".kept").exists()
    )
    small, large = map(
        float, run(SCRIPT.replace("1.0 * np", "2.0 * np")).stdout.split()
    )
    assert (small, large) == pytest.approx((2 * np.pi * 0.5**2, 2 * np.pi))


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Makes an installed package of this code that offers ``name`` in a group."""

    def install(
        code, name="thick", group="geomech.media", dist="sands", value="{}:Thick"
    ):
        module = f"{dist}_laws"
        (tmp_path / f"{module}.py").write_text(code)
        info = tmp_path / f"{dist}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {dist}\nVersion: 1.2\n"
        )
        (info / "entry_points.txt").write_text(
            f"[{group}]\n{name} = {value.format(module)}\n"
        )
        monkeypatch.syspath_prepend(str(tmp_path))
        importlib.invalidate_caches()
        monkeypatch.delitem(sys.modules, module, raising=False)

    return install


def test_a_package_offers_a_law_that_is_loaded_when_asked_for(package):
    package(LAW)
    package("raise RuntimeError('loaded unasked')", "other", dist="broken")
    assert load("three-link-viscous")
    assert "sands_laws" not in sys.modules
    assert "thick" in installed_entries(REGISTRIES["geomech.media"])
    scene = parse(SCENE)
    assert type(scene.system.medium).__module__ == "sands_laws"
    assert parse(toml(scene)) == scene
    assert kinds.code() == {"sands_laws": hashlib.sha256(LAW.encode()).hexdigest()}


def test_entry_points_of_all_families_are_read(package):
    for name, group in (
        ("hinge", "bodies"),
        ("peanut", "gaits"),
        ("slick", "effects"),
        ("car", "systems"),
    ):
        package(
            "from test_kinds import *",
            name,
            f"geomech.{group}",
            group,
            f"{{}}:{PARTS[name].__name__}",
        )
        assert parse(OWN[name])
        assert type(parse(OWN[name])) is Scene


@pytest.mark.parametrize(
    ("code", "more", "said"),
    [
        (
            "import no_such_thing",
            {},
            "'thick' of the package sands 1.2 cannot be loaded: ModuleNotFoundError",
        ),
        ("x = 1", {}, "of the package sands 1.2 cannot be loaded: AttributeError"),
        ("Thick = 3", {}, "of the package sands 1.2: 3 is not a law"),
        (
            LAW.replace('"thick"', '"thin"'),
            {},
            "of the package sands 1.2: its law is 'thin': give both one name",
        ),
        (
            LAW.replace("(frozen=True)", ""),
            {},
            "of the package sands 1.2: a law of one's own, Thick, must be a value",
        ),
        (
            "from test_kinds import Hinge as Thick",
            {},
            "of the package sands 1.2: Hinge is not a law",
        ),
    ],
)
def test_a_broken_package_is_named_in_one_line(code, more, said, package):
    package(code, **more)
    with pytest.raises(Refusal, match=".") as caught:
        parse(SCENE)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_two_packages_of_one_name_and_built_in_names(package):
    package(LAW)
    package(LAW, dist="muds")
    with pytest.raises(
        Refusal,
        match="is offered by the package .* 1.2 and the package .* 1.2: uninstall one",
    ):
        parse(SCENE)
    package("raise RuntimeError", "viscous", dist="clash")
    told = text("medium")
    assert 'law = "thick"\nOf the package' in told
    assert (
        'law = "viscous"\nNot that of the package clash 1.2, which is refused' in told
    )
    laws = [
        x["properties"].get("law")
        for x in schema()["$defs"]["gaits"]["medium"]["oneOf"]
    ]
    assert laws.count({"const": "thick"}) == laws.count({"const": "viscous"}) == 1
    assert (
        type(load("three-link-viscous").system.medium) is Viscous
    )  # the built-in one stands


def test_parts_are_values_and_need_not_be_registered_from_python():
    class Loose(Bare):
        __hash__ = None

    with pytest.raises(ValueError, match="frozen"):
        Scene(Swimmer(Loose(Viscous()), Chain()), Circle())
    scene = Scene(Swimmer(Bare(Viscous(math.e)), Chain()), Circle(), SMALL)
    assert SceneTables(scene).poses("area").shape == (3,)
    with pytest.raises(Refusal, match="Bare is of no kind that a scene file can name"):
        toml(scene)
    assert set(GAITS) == GAITS.built_in
