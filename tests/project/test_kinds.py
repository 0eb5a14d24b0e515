"""Laws, bodies, gaits, effects and systems of one's own: by a file, by `register`, by
an installed package."""

import hashlib
import importlib.metadata
import math
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest
from commands import geomech
from registry import EFFECTS
from tabled import of_json, tabled_json

from geomech.core.entry_points import installed_entries
from geomech.mathematics.gaits import Circle, Sine
from geomech.mathematics.systems import Premise, Solver, Swimmer, capability
from geomech.mathematics.systems.capabilities import Recorded
from geomech.scenes import Numerics, Scene, kinds, load, parse, sources, toml
from geomech.scenes.format.keys import text
from geomech.scenes.format.schema import schema
from geomech.scenes.kinds import load_file
from geomech.shell.describe.scene import description
from geomech.shell.describe.system import notes
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables
from rft import Backbone, Chain, Coulomb, EndCaps, Granular, Viscous, body_velocity
from rft.core.refusal import Refusal
from rft.core.registry import REGISTRIES
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
    law = re.search(r"```python\n(.*?)```", section, re.S)[1]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "power.py").write_text(law)
    scene = re.search(r"```toml\n(.*?)```", section, re.S)[1]
    (tmp_path / "power.toml").write_text(scene)
    command = re.search(r"`geomech (displacement power\.toml .*?)`", section)[1]
    code, out, err = geomech(*command.split(), "--json", "--tiers", "direct")
    assert (code, err.count("\n")) == (0, 1)
    assert "power has no closed form" in err and "gauss:24" in err
    module = {}
    exec(law, module)
    shear = Swimmer(module["Power"](0.4), Chain())
    expected = shear.run(*Circle().cycle(256, [0.5, 1.0])).net
    np.testing.assert_allclose(tabled_json(out)["direct"], expected, atol=1e-9)
    written = {p.name for p in tmp_path.iterdir()}
    assert written == {"power.py", "power.toml"}  # no cache beside them


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
    for tier in ("area", "direct"):
        ours = exact.poses(tier, amplitudes=amplitudes)
        theirs = bare.poses(tier, amplitudes=amplitudes)
        better = finer.poses(tier, amplitudes=amplitudes)
        difference = estimate.distance(ours, theirs).max()
        assert difference < 0.04 * np.hypot(*ours[-1, :2])
        assert estimate.distance(ours, better).max() <= max(difference / 2, 1e-9)
    poses, errors = estimate.direct(bare.scene, gait, amplitudes, 128)
    truth = estimate.direct(exact.scene, gait, amplitudes, 1024)[0]
    assert (estimate.pose_distance(poses, truth, 1.0) <= errors + 1e-9).all()
    assert exact.tiers == bare.tiers


def test_a_law_of_traction_alone_takes_backbones_and_says_its_rule():
    fine = Swimmer(Bare(Coulomb()), Backbone(8, length=0.4))
    exact = Swimmer(Coulomb(), Backbone(8, length=0.4))
    alpha = np.full((2, 7), 0.3) * [[1], [-2]]
    alphadot = np.cos(np.arange(14.0)).reshape(2, 7)
    velocities = [s.velocity(alpha, alphadot) for s in (fine, exact)]
    np.testing.assert_allclose(*velocities, atol=2e-3)
    assert fine.balance_size.evaluations == 24 * exact.balance_size.evaluations
    assert "gauss:24" in description(Scene(fine, Sine(elements=8), SMALL))
    assert fine.refined().solver.loads == "gauss:48"
    assert capability(fine, Recorded).about()["loads"] == "gauss:24"
    ruled = fine.with_solver(Solver(loads="midpoint:10"))
    assert notes(ruled) == ()
    assert ruled.refined().solver.loads == "midpoint:20"


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
    with pytest.raises(ValueError, match="no one power of the speed: use the direct"):
        SceneTables(Scene(swimmer, Circle(), SMALL)).poses("path")


def test_a_file_registers_what_is_in_it_and_a_scene_alone_does_not(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thick.py").write_text(LAW)
    (tmp_path / "thick.toml").write_text(SCENE)
    ask = [
        "velocity",
        "thick.toml",
        "--alpha",
        "0.3,0.2",
        "--alphadot",
        "1,0",
        "--json",
    ]
    code, out, err = geomech(*ask)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "'thick' is unknown" in err and "--plugin" in err
    code, out, err = geomech(*ask, "--plugin", "thick.py")
    assert code == 0
    xi = body_velocity(Viscous(2.5), Chain((1, 1.4, 0.8)), [0.3, 0.2], [1, 0]).xi
    np.testing.assert_allclose(of_json(out)["xi"].values, xi, atol=1e-9)
    other = LAW.replace("thick", "thin").replace("Thick", "Thin")
    (tmp_path / "more.py").write_text(other)
    again = geomech("--plugin", "more.py", *ask, "--plugin", "thick.py")
    assert again[:2] == (0, out)
    (tmp_path / "thick.py").write_text(LAW.replace("2.5", "1.0"))  # the new one counts
    assert geomech(*ask, "--plugin", "thick.py")[1] != out


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


@pytest.mark.parametrize("folder", ["site-packages", "dist-packages"])
def test_digests_leave_out_installed_packages_of_any_environment(
    folder, tmp_path, monkeypatch
):
    """Those of the user or of the system, below which an environment may stand."""
    installed = tmp_path / "lib" / folder
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
    assert stopped.endswith("the same command goes on from there\n")
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
    assert load("three-link-viscous")
    assert "sands_laws" not in sys.modules
    assert "thick" in installed_entries(REGISTRIES["geomech.media"])
    scene = parse(SCENE)
    assert type(scene.system.medium).__module__ == "sands_laws"
    assert parse(toml(scene)) == scene
    assert kinds.code() == {"sands_laws": hashlib.sha256(LAW.encode()).hexdigest()}


BROKEN = {
    "import nothing": " cannot be loaded: ModuleNotFoundError",
    "x = 1": " cannot be loaded: AttributeError",
    "Thick = 3": ": 3 is not a law",
    LAW.replace('"thick"', '"thin"'): ": its law is 'thin': give both one name",
    LAW.replace("(frozen=True)", ""): ": a law of one's own, Thick, must be a value",
    "from rft import Chain as Thick": ": Chain is not a law",
}


@pytest.mark.parametrize("code", BROKEN)
def test_a_broken_package_is_named_in_one_line(code, package):
    package(code)
    with pytest.raises(Refusal, match="of the package sands 1.2") as caught:
        parse(SCENE)
    assert f"of the package sands 1.2{BROKEN[code]}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_end_caps_take_the_numbers_of_a_granular_law():
    bare = Bare(Granular(C=1.8, gamma0=0.24))
    with pytest.raises(ValueError, match="end caps take a granular medium, got Bare"):
        Swimmer(bare, Chain(), (EndCaps(0.1),))


@pytest.mark.parametrize("law", [Viscous(), Coulomb(), Granular(1.8, 0.24)])
def test_the_speed_does_not_matter_under_a_law_of_one_power(law):
    assert is_rate_independent(law)
    assert is_rate_independent(Bare(law))


class Wrong:
    def __init__(self, traction):
        self.answer = traction

    def traction(self, v_t, v_n, eps=0.0):
        return self.answer(v_t, v_n)


class NoRounding:
    def traction(self, v_t, v_n):
        return v_t, v_n


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (NoRounding(), r"NoRounding.traction must take \(v_t, v_n, rounding=0.0\)"),
        (Wrong(lambda t, n: (t, np.ones(5))), r"shape \(2, 3\), got \(2, 3\) and \(5,"),
        (Wrong(lambda t, n: 1 / 0), "Wrong.traction fails: ZeroDivisionError"),
        (Wrong(lambda t, n: (-t, -n)), "no drag at any velocity"),
    ],
)
def test_a_traction_that_is_none_is_refused_in_one_line(law, said):
    with pytest.raises(ValueError, match=said) as caught:
        body_velocity(law, Chain(), np.zeros(2), np.ones(2))
    assert "\n" not in str(caught.value)


BAD_FILES = {
    "law = ": "line 1: SyntaxError",
    "import nothing": "line 1: ModuleNotFoundError: No module named 'nothing'",
    "x = 1\nraise SystemExit(3)": "line 2: SystemExit: 3",
    "x = 1": 'no class in it has a law = "..."',
    LAW.replace(
        '"thick"', '"granular"'
    ): "is named 'granular', as one that is built in",
    LAW.replace("(frozen=True)", ""): "must be a value: put @dataclass(frozen=True)",
    LAW.replace("law =", "law: str ="): "has law as a parameter: write law = 'thick'",
    LAW.replace('"thick"', "3"): 'has no name: give the class law = "..."',
    LAW.replace("traction", "drag"): "is no part of a scene: a law is a class with",
    LAW + LAW.replace("Thick", "Other"): "is named 'thick', as the Thick of",
    "\udcff": "it is not text",
    "#" * 1_000_001: "it is larger than 1 MB",
}


@pytest.mark.parametrize("text", BAD_FILES, ids=range(len(BAD_FILES)))
def test_a_file_that_cannot_be_registered_gets_one_line_and_leaves_nothing(
    text, tmp_path
):
    path = tmp_path / "own.py"
    path.write_text(text, errors="surrogateescape")
    with pytest.raises(Refusal, match="^plugin .*own.py") as caught:
        load_file(path)
    assert BAD_FILES[text] in str(caught.value)
    assert kinds.code() == {}
    assert "thick" not in REGISTRIES["geomech.media"]
    assert not [name for name in sys.modules if name.startswith("geomech_plugin_own")]


def test_a_plug_in_ends_in_py(tmp_path):
    with pytest.raises(Refusal, match="ends in .py"):
        load_file(tmp_path / "own.toml")


def test_a_name_that_two_packages_offer_is_refused(package):
    package(LAW)
    package(LAW, dist="muds")
    with pytest.raises(Refusal, match="is offered by the package .* and the package"):
        parse(SCENE)


def test_a_built_in_name_stands_against_a_package(package):
    package(LAW)
    package("raise RuntimeError", "viscous", dist="clash")
    told = text("medium")
    assert 'law = "thick"\nOf the package' in told
    assert (
        'law = "viscous"\nNot that of the package clash 1.2, which is refused' in told
    )
    media = schema()["$defs"]["gaits"]["medium"]["oneOf"]
    laws = [medium["properties"].get("law") for medium in media]
    assert laws.count({"const": "thick"}) == laws.count({"const": "viscous"}) == 1
    assert type(load("three-link-viscous").system.medium) is Viscous


class Loose(Bare):
    __hash__ = None


def test_parts_are_values():
    with pytest.raises(ValueError, match="frozen"):
        Scene(Swimmer(Loose(Viscous()), Chain()), Circle())


def test_a_part_need_not_be_registered_to_be_used_from_python():
    scene = Scene(Swimmer(Bare(Viscous(math.e)), Chain()), Circle(), SMALL)
    assert SceneTables(scene).poses("area").shape == (3,)
    with pytest.raises(Refusal, match="Bare is of no kind that a scene file can name"):
        toml(scene)
