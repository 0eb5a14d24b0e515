"""Laws, bodies, gaits, effects and systems of one's own: by a file, by `register`, by
an installed package."""

import hashlib
import importlib.metadata
import math
import pathlib
import subprocess
import sys
import types

import numpy as np
import pytest
from refusals import refuses
from registry import EFFECTS

from geomech.mathematics.gaits import Circle
from geomech.mathematics.systems import Premise, Solver, Swimmer
from geomech.scenes import Numerics, Scene, kinds, load, parse, sources, toml
from geomech.scenes.kinds import load_file
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Coulomb, Granular, Viscous, body_velocity
from rft.core.refusal import Refusal
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


@pytest.mark.parametrize(
    "law", [Viscous(3.7), Granular(C=2.3, gamma0=0.4)], ids=["viscous", "granular"]
)
def test_a_law_of_traction_alone_gives_every_tier_within_its_error(law):
    gait = Circle(amplitude=0.8, centre=(0.3, -0.2))
    body = Chain((1, 1.4, 0.8))
    amplitudes = np.array([0.5, 0.9])
    exact = SceneTables(Scene(Swimmer(law, body), gait, SMALL))
    bare = SceneTables(Scene(Swimmer(Bare(law), body), gait, SMALL))
    finer = bare.with_numerics(loads="gauss:96")  # leaves a quarter
    ours, theirs, better = (
        study.poses("area", amplitudes=amplitudes) for study in (exact, bare, finer)
    )
    difference = estimate.distance(ours, theirs).max()
    assert difference < 0.04 * np.hypot(*ours[-1, :2])
    assert estimate.distance(ours, better).max() <= max(difference / 2, 1e-9)
    poses, errors = estimate.direct(bare.scene, gait, amplitudes, 64)
    truth = estimate.direct(exact.scene, gait, amplitudes, 256)[0]
    assert (estimate.pose_distance(poses, truth, 1.0) <= errors + 1e-9).all()


@pytest.mark.parametrize("name", [name for name in EFFECTS if name != "end-caps"])
def test_a_law_of_traction_alone_takes_every_effect_and_does_work(name):
    law = Granular(C=1.8, gamma0=0.24)
    body = Chain((1, 1.4, 0.8))
    cycle = Circle(amplitude=0.9).cycle(16, [0.9])
    effects = (EFFECTS[name][0](0.3),)
    exact = Swimmer(law, body, effects, Solver(cycles=1)).run(*cycle, work=True)
    finer = Solver(cycles=1, loads="gauss:96")
    bare = Swimmer(Bare(law), body, effects, finer).run(*cycle, work=True)
    size = np.abs(exact.net[0, :2]).max()
    np.testing.assert_allclose(bare.net, exact.net, atol=0.02 * size)
    np.testing.assert_allclose(bare.work.power, exact.work.power, rtol=0.02)


class Mud(TermLaw):
    """A law whose drag is no one power of the speed."""

    dry, viscous = ((1.0, 1.0, 1.5),), (1.0, 2.0)


@pytest.mark.parametrize("law", [Mud(), Bare(Mud())])
def test_the_speed_matters_under_a_law_of_no_one_power(law):
    assert not is_rate_independent(law)
    swimmer = Swimmer(law, Chain())
    assert swimmer.traits.lacks == Premise.RATE_INDEPENDENT
    with pytest.raises(ValueError, match="not a power of the speed: use the direct"):
        SceneTables(Scene(swimmer, Circle(), SMALL)).poses("path")


@pytest.mark.parametrize("future", [False, True])
def test_a_file_is_run_as_python_would_with_types_as_it_writes_them(future, tmp_path):
    head = "from __future__ import annotations\n"
    (tmp_path / "own.py").write_text(head * future + LAW)
    assert load_file(tmp_path / "own.py") == ["thick"]
    assert parse(SCENE).system.medium.thickness == 3.0
    with pytest.raises(Refusal, match="Expected `float`, got `str` - at `.thickness`"):
        parse(SCENE.replace("3.0", '"3"'))


IMPORTS = {  # of a module beside that of a law
    "a function": "from thick_factor import times",
    "a constant": "from thick_factor import FACTOR",
    "the module": "import thick_factor",
    "by another": "from thick_many import MANY",
    "a package": "import thick_package.inner",
    "from a package": "from thick_package import inner",
    "when it is called": "def later():\n    import thick_factor",
}


BESIDE = {
    "thick_package/__init__.py": "",
    "thick_package/inner.py": "def never():\n    from .. import none\nfrom . import leaf",
    "thick_package/leaf.py": "from thick_factor import FACTOR",
    "thick_many.py": "import functools, thick_factor\n"
    "MANY = [functools.partial(thick_factor.times)]",
}


FACTOR = "import rft.laws\nFACTOR = {}\ndef times(x):\n    return FACTOR * x\n"


@pytest.mark.parametrize("name", IMPORTS)
def test_digests_of_own_code_cover_its_sources(name, tmp_path, monkeypatch):
    """The file, which is edited and loaded again, and a module that it imports from."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "thick_package").mkdir()
    for file, code in BESIDE.items():
        (tmp_path / file).write_text(code)
    found = []
    for law, factor in ((LAW, 1), (LAW.replace("2.5", "2.6"), 1), (LAW, 2), (LAW, 1)):
        (tmp_path / "thick.py").write_text(law + IMPORTS[name])
        (tmp_path / "thick_factor.py").write_text(FACTOR.format(factor))
        for module in [module for module in sys.modules if module.startswith("thick_")]:
            monkeypatch.delitem(sys.modules, module)
        monkeypatch.setattr(kinds, "_sources", {})
        importlib.invalidate_caches()
        load_file(tmp_path / "thick.py")
        found.append(kinds.code())
    assert all("thick_factor" in sources for sources in found)
    tops = {module.partition(".")[0] for sources in found for module in sources}
    assert not tops & {"rft", "geomech", "numpy"}
    assert found[0] == found[3]
    assert found[0] != found[1] != found[2] != found[0]


def test_digests_leave_out_installed_packages(tmp_path, monkeypatch):
    installed = tmp_path / "lib" / "dist-packages"
    installed.mkdir(parents=True)
    (installed / "thick_installed.py").write_text("")
    (tmp_path / "thick_own.py").write_text("import thick_installed, thick_near")
    (tmp_path / "thick_near.py").write_text("")
    monkeypatch.syspath_prepend(str(installed))
    monkeypatch.syspath_prepend(str(tmp_path))
    assert {*sources.digests(["thick_own"], {})} == {"thick_own", "thick_near"}


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
    """It is stopped half way, and goes on with the function that it has then."""

    def run(text, *arguments):
        (tmp_path / "script.py").write_text(text)
        command = [sys.executable, "-B", "script.py", *arguments]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)

    stopped = run(SCRIPT, "stop").stderr
    assert stopped.endswith("repeat the command to continue from there\n")
    assert (tmp_path / ".kept").exists()
    doubled = run(SCRIPT.replace("1.0 * np", "2.0 * np")).stdout
    small, large = map(float, doubled.split())
    assert (small, large) == pytest.approx((2 * np.pi * 0.5**2, 2 * np.pi))


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Installs a package of this code that offers a law by a name."""

    def install(code, name="thick", dist="sands"):
        (tmp_path / f"{dist}_laws.py").write_text(code)
        info = tmp_path / f"{dist}-1.2.dist-info"
        info.mkdir()
        meta = f"Metadata-Version: 2.1\nName: {dist}\nVersion: 1.2\n"
        (info / "METADATA").write_text(meta)
        entry = f"[geomech.media]\n{name} = {dist}_laws:Thick\n"
        (info / "entry_points.txt").write_text(entry)
        monkeypatch.syspath_prepend(str(tmp_path))
        importlib.invalidate_caches()
        monkeypatch.delitem(sys.modules, f"{dist}_laws", raising=False)

    return install


def test_a_package_offers_a_law_that_is_loaded_when_asked_for(package):
    package(LAW)
    package("raise RuntimeError('loaded unasked')", "other", dist="broken")
    package("raise RuntimeError", "viscous", dist="clash")
    # What is built in stands against a package.
    assert type(load("three-link-viscous").system.medium) is Viscous
    scene = parse(SCENE)
    assert type(scene.system.medium).__module__ == "sands_laws"
    assert parse(toml(scene)) == scene
    assert kinds.code() == {"sands_laws": hashlib.sha256(LAW.encode()).hexdigest()}


BROKEN = [
    "import nothing",
    "x = 1",
    "Thick = 3",
    LAW.replace('"thick"', '"thin"'),
    LAW.replace("(frozen=True)", ""),
    "from rft import Chain as Thick",
]


@pytest.mark.parametrize("code", BROKEN)
def test_a_broken_package_is_named_in_one_line(code, package):
    package(code)
    with pytest.raises(Refusal, match="of the package sands 1.2") as caught:
        parse(SCENE)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("law", [Viscous(), Coulomb(), Granular(1.8, 0.24)])
def test_the_speed_does_not_matter_under_a_law_of_one_power(law):
    assert is_rate_independent(law)
    assert is_rate_independent(Bare(law))


@pytest.mark.parametrize(
    ("traction", "said"),
    [
        (lambda t, n: (t, n), "traction (v_t, v_n, rounding=0.0) | because"),
        (
            lambda t, n, eps=0.0: (t, np.ones(5)),
            "(2, 3) (2, 3) (5,",
        ),
        (lambda t, n, eps=0.0: 1 / 0, "traction ZeroDivisionError | because"),
        (lambda t, n, eps=0.0: (-t, -n), "drag velocity | instead"),
    ],
)
def test_a_traction_that_is_none_is_refused(traction, said):
    with refuses(said):
        body_velocity(
            types.SimpleNamespace(traction=traction), Chain(), np.zeros(2), np.ones(2)
        )


def test_a_part_need_not_be_registered_to_be_used_from_python():
    scene = Scene(Swimmer(Bare(Viscous(math.e)), Chain()), Circle(), SMALL)
    with pytest.raises(Refusal, match="Bare has no kind that a scene file can name"):
        toml(scene)
