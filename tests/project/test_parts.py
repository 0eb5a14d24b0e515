"""Parts of one's own: one of each family in a folder, one file and one decorator each,
used by commands and from Python."""

import json
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pytest
from commands import geomech
from tabled import tabled_json

import geomech as library
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems.base import Cycle, integrated
from geomech.scenes import Numerics, Scene, kinds, parse
from geomech.studies.optimisation import optimise
from geomech.studies.scene_tables import SceneTables
from rft.core.registry import REGISTRIES

HEAD = "from dataclasses import dataclass\nimport numpy as np\nimport geomech\n"
FILES = {
    "law": """
@geomech.register
@dataclass(frozen=True)
class Treacle:
    thickness: float = 2.5
    law = "treacle"

    def traction(self, v_t, v_n, rounding=0.0):
        return v_t, self.thickness * v_n
""",
    "body": """
import rft

@geomech.register
@dataclass(frozen=True)
class Knee:
    angle: float = 0.2
    kind, length, joints = "knee", 1.0, 2

    def motion(self, alpha, alphadot):
        return rft.Chain((1, 2, 1)).motion(alpha + self.angle, alphadot)
""",
    "effect": """
from rft.effects import Effect

@geomech.register
@dataclass(frozen=True)
class Waxed(Effect):
    by: float = 0.5
    kind, limit, cost, odd = "waxed", "by = 1", "one multiplication", True

    def apply(self, problem, site=None, past=None):
        return problem._replace(sides=problem.sides.with_factors(self.by, self.by, 1.0))
""",
    "gait": """
from geomech.mathematics.gaits import Gait

@geomech.register
@dataclass(frozen=True, kw_only=True)
class Egg(Gait):
    waist: float = 0.1
    kind, harmonics = "egg", 2

    def unit(self, t):
        t = np.asarray(t, float)
        return np.stack([np.cos(t), np.sin(t) + self.waist * np.sin(2 * t)], -1)

    def unit_rate(self, t):
        t = np.asarray(t, float)
        return np.stack([-np.sin(t), np.cos(t) + 2 * self.waist * np.cos(2 * t)], -1)
""",
    "system": """
from geomech.mathematics.systems import Traits, integrated

@geomech.register
@dataclass(frozen=True)
class Trike:
    base: float = 0.4
    kind = "trike"
    joints = 2
    length = 1.0
    traits = Traits(linear=True)
    run = integrated

    def velocity(self, alpha, alphadot):
        v = alphadot[..., 0]
        return np.stack([v, 0 * v, v * np.tan(0.3 * np.tanh(alpha[..., 1])) / self.base], -1)
""",
    "function": """
@geomech.register(joints=2, kind="skate")
def skate(alpha, alphadot, grip=0.5):
    v = np.cos(alpha[..., 0]) * alphadot[..., 1]
    return np.stack([v, grip * alpha[..., 1] * alphadot[..., 0], alphadot[..., 0] - v], -1)
""",
    "tier": """
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.tiers import Plan, Tier, fitted
from rft.formulas import se2

def plan(system, numerics, gait, amplitudes):
    def predict(table, some):
        area = np.pi * np.asarray(gait.amplitude if some is None else some)[..., None] ** 2
        return se2.exp(area * ccf(table)(gait.middle))
    return Plan(predict, fitted.table(system, numerics))

geomech.register(Tier("leading", "area times the CCF in the middle", {"color": "C4"}, plan, joints=range(2, 3)))
""",
    "plot": """
@geomech.plots.CCF_STYLES.register(style="dots")
def dots(field, component=0, gaits=(), *, ax=None, error=None, labels=(), clim=None):
    x, y = np.meshgrid(*field.axes, indexing="ij")
    return ax.scatter(x, y, c=field.values[component])
""",
    "format": """
import json
from geomech.mathematics.geometry.connection import Connection
from geomech.io.tables import FORMATS, Stored

def write(path, result, sign="+"):
    A = (1 if sign == "+" else -1) * result["A"].values
    axes = [result[f"alpha_{k + 1}"].values.tolist() for k in range(A.shape[1])]
    with open(path, "w") as file:
        json.dump({"axes": axes, "A": A.tolist()}, file)

@FORMATS.register(suffix=".json", write=write, settings=("sign",), joints=2, whole=False)
def parse(raw, sign, order, sha256):
    told = json.loads(raw)
    axes, A = tuple(np.array(a) for a in told["axes"]), np.array(told["A"])
    left = np.zeros(A[:, 0].shape)
    return Stored(Connection(axes, A, left, left + 1.0, unit="m", length=0.5), length=0.5, unit="m", sha256=sha256)
""",
}
SWIMMER = (
    '[medium]\nlaw = "treacle"\n[body]\nkind = "knee"\n[[effects]]\nkind = "waxed"\n'
)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch, own_parts):
    """A folder with one part of each family, and scenes of them."""
    for name, text in FILES.items():
        (tmp_path / f"own_{name}.py").write_text(HEAD + text)
    for name, text in SCENES.items():
        (tmp_path / f"{name}.toml").write_text(text + END)
    axis = np.linspace(-2, 2, 9)
    A = np.zeros((3, 2, 9, 9))
    A[0, 1] = np.sin(axis)[:, None]
    field = {"axes": [axis.tolist()] * 2, "A": A.tolist()}
    (tmp_path / "own.json").write_text(json.dumps(field))
    monkeypatch.chdir(tmp_path)
    return tmp_path


SCENES = {
    "swims": SWIMMER,
    "trike": '[system]\nkind = "trike"\n',
    "skate": '[system]\nkind = "skate"\n',
    "table": '[system]\nkind = "table"\nfile = "own.json"\n',
}


END = '[gait]\nkind = "egg"\namplitude = 0.4\n'


END += "[numerics]\ngrid = 7\nextent = 1.5\nphases = 32\n"


TIERS = ["--amplitudes", "0.2,0.4", "--tiers", "leading,path,direct"]


PLUGINS = [word for name in FILES for word in ("--plugin", f"own_{name}.py")]


@pytest.mark.parametrize("name", SCENES)
def test_commands_use_one_of_each(name):
    ask = ["displacement", f"{name}.toml", *TIERS, "--json"]
    code, _, err = geomech(*ask)
    assert code == 2 and "unknown" in err  # a scene alone runs no code
    code, out, err = geomech(*ask, *PLUGINS)
    assert code == 0, err
    table = tabled_json(out)
    assert np.isfinite([table["leading"], table["direct"]]).all()
    ask = ["ccf", f"{name}.toml", "--style", "dots", "--plot", "ccf.png"]
    code, _, err = geomech(*ask, *PLUGINS)
    assert code == 0, err


def test_a_connection_is_written_in_a_format_of_ones_own(folder):
    ask = ["connection", "trike.toml", "-o", "made.json", "--sign", "-"]
    assert "--sign is for a .mat file" in geomech(*ask, *PLUGINS[:-2])[2]
    assert geomech(*ask, *PLUGINS)[0] == 0
    written = json.loads((folder / "made.json").read_text())
    fitted = SceneTables(library.load("trike.toml")).fitted
    np.testing.assert_array_equal(written["A"], -fitted.A)
    np.testing.assert_array_equal(written["axes"], fitted.axes)


class Cart:
    """Five members and nothing else."""

    joints = 2
    length = 0.5
    traits = Traits(linear=True, joint_angles=True)

    def velocity(self, alpha, alphadot):
        along = np.sin(alpha[..., 0]) * alphadot[..., 1]
        return np.stack([along, 0 * along, 0.2 * alphadot[..., 0]], -1)

    def run(self, alpha, alphadot, work=False) -> Cycle:
        return integrated(self, alpha, alphadot)


def sled(alpha, alphadot):
    """As the cart, in body lengths."""
    return Cart().velocity(alpha, alphadot)


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_of_parts_of_ones_own_is_written_and_read_again(name, folder):
    for part in FILES:
        kinds.load_file(folder / f"own_{part}.py")
    scene = library.load(folder / f"{name}.toml")
    numerics = Numerics(grid=8, phases=32)
    again = library.toml(scene.changed(text="", numerics=numerics))
    assert library.toml(parse(again)) == again


@pytest.mark.parametrize("system", [Cart(), sled])
def test_five_members_and_functions_go_through_everything(system):
    """No base class and no name are needed."""
    gait = Circle(amplitude=0.5, centre=(0.1, 0.2))
    scene = Scene(system, gait, Numerics(grid=7, extent=1.5, phases=32))
    study = SceneTables(scene)
    assert study.tiers[-1] == "direct" and {"area", "adapted", "path"} <= {*study.tiers}
    result = study.displacements([0.3, 0.5], study.tiers)
    error = result["net_distance"].error
    distance = np.hypot(result["x"].values, result["y"].values)
    assert distance[-1].min() > 0.01
    for name in ("x", "y"):
        values = result[name].values
        assert (np.abs(values - values[-1]) <= 1e-9 + error + error[-1]).all()
    framed = study.in_frame("minimum-perturbation")
    assert framed.poses("direct", None, [0.5]).shape == (1, 3)
    best = optimise(scene, harmonics=1, limits=1.2)
    assert best.value > distance[-1, -1]


GROUPS = [
    "media",
    "bodies",
    "effects",
    "ground_effects",
    "gaits",
    "systems",
    "tiers",
    "formats",
]


@pytest.mark.parametrize("group", [f"geomech.{group}" for group in GROUPS])
def test_every_file_of_a_folder_is_registered(group):
    """Each has examples, or needs no parameters."""
    registry = REGISTRIES[group]
    assert len(registry) == len(registry.built_in) > 1
    assert {*registry} == {getattr(part, registry.key) for part in registry.values()}
    assert all(registry.admits(part) for part in registry.values())


ADDED = {
    "laws/treacle.py": """
from rft.laws.base import LAWS

@LAWS.register
@dataclass(frozen=True)
class Treacle:
    thickness: float = 2.5
    law = "treacle"

    def traction(self, v_t, v_n, rounding=0.0):
        return v_t, self.thickness * v_n
""",
    "bodies/knee.py": """
from rft.bodies.base import BODIES
from rft.bodies.chain import Chain

@BODIES.register
@dataclass(frozen=True)
class Knee:
    angle: float = 0.2
    kind, length, joints = "knee", 1.0, 2

    def motion(self, alpha, alphadot):
        return Chain((1, 2, 1)).motion(alpha + self.angle, alphadot)
""",
    "effects/tired.py": """
from rft.effects.base import EFFECTS, Effect
from rft.core.premise import Premise

@EFFECTS.register
@dataclass(frozen=True)
class Tired(Effect):
    loss: float = 0.5
    kind, limit, breaks = "tired", "loss = 0", Premise.MEMORYLESS

    @classmethod
    def examples(cls, x=0.3):
        return {"tired": cls(loss=x)}

    def begin(self, problem, site):
        return np.zeros(problem.sides.elements.c.shape)  # of steps in the past

    def apply(self, problem, site, state):
        return problem._replace(sides=problem.sides.with_factors(1.0, 1.0 / (1.0 + self.loss * state), 1.0))

    def after(self, problem, site, state, v):
        return state + 0.1
""",
    "terradynamics/ground/frost.py": """
from rft.terradynamics.ground.base import GROUND_EFFECTS, GroundEffect

@GROUND_EFFECTS.register
@dataclass(frozen=True)
class Frost(GroundEffect):
    gain: float = 0.5
    kind, limit = "frost", "gain = 0"

    @classmethod
    def examples(cls, x=0.3):
        return {"frost": cls(gain=x)}

    def apply(self, ground):
        return ground._replace(strength=ground.strength * (1.0 + self.gain))
""",
}


def three_joints(alpha, alphadot):
    first, second, third = np.moveaxis(np.asarray(alphadot), -1, 0)
    return np.stack([first, second * third, 0 * third], -1)


def two_joints(alpha, alphadot):
    first, second = np.moveaxis(np.asarray(alphadot), -1, 0)
    return np.stack([first, second, 0 * first], -1)


def test_a_velocity_alone_is_one_of_two_joints():
    assert library.study(two_joints).scene.system.joints == 2
    assert library.study(three_joints, joints=3).scene.system.joints == 3
    with pytest.raises(ValueError, match="needs 3 joints.*give joints = 3"):
        library.study(three_joints)


LAWS_OF_FAMILIES = """
import sys
sys.path[:0] = [sys.argv[1], sys.argv[2]]
import numpy as np
import rft
from registry import BODIES, EFFECTS, GROUND_EFFECTS, MEDIA
from rft.terradynamics.ground import ground_of
from rft.laws.base import require_drag

assert rft.__file__.startswith(sys.argv[1])
require_drag(MEDIA["treacle"])
body = BODIES["knee"]
xi = rft.body_velocity(MEDIA["treacle"], body, [0.3, -0.5], [1.0, 0.4]).checked().xi
np.testing.assert_allclose(rft.body_velocity(rft.Viscous(2.5), body, [0.3, -0.5], [1.0, 0.4]).xi, xi, rtol=1e-7)
t = 2 * np.pi * np.arange(8) / 8
loop = np.stack([np.cos(t), np.sin(t)], -1), np.stack([-np.sin(t), np.cos(t)], -1)
net = lambda *effects: rft.time_steps(MEDIA["glass-0.3mm-loose"], body, *loop, effects=effects, cycles=2).displacement
make, order = EFFECTS["tired"]
far, near = (np.abs(net(make(x)) - net()).max() for x in (1e-2, 1e-3))
assert far > 1e-5 and abs(np.log10(far / near) - order) < 0.1, (far, near)
make, order = GROUND_EFFECTS["frost"]
far, near = (ground_of([make(x)]).strength - ground_of([]).strength for x in (1e-2, 1e-3))
assert far > 0 and abs(np.log10(far / near) - order) < 0.1
"""


def test_a_file_in_its_folder_is_found_and_held_to_the_laws_of_its_family(tmp_path):
    """A law, a body, an effect with a past and one on the ground; the registry of the
    tests has them without a line more."""
    root = pathlib.Path(__file__).parents[2]
    shutil.copytree(root / "rft", tmp_path / "rft")
    (tmp_path / "geomech").symlink_to(root / "geomech")
    for name, text in ADDED.items():
        (tmp_path / "rft" / name).write_text(
            "from dataclasses import dataclass\nimport numpy as np\n" + text
        )
    tools = root / "tests" / "tools"
    command = [sys.executable, "-c", LAWS_OF_FAMILIES, str(tmp_path), str(tools)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
