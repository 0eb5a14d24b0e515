"""Custom robots: any MJCF, with a list of the geoms that touch the ground. Needs
MuJoCo."""

from __future__ import annotations

import difflib
import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from rft.core.checks import in_range, real_array
from rft.core.refusal import Refusal, formatted, located, require
from rft.terradynamics.walking.facets import Surface
from rft.terradynamics.walking.robot import Robot

LARGEST_FILE = 20_000_000  # bytes of XML
MOST_PARTS = 20_000  # geoms, or copies by <replicate>
MOST_NODES = 4_000_000  # of height fields
MOST_INCLUDES = 20  # files within files
MOST_NAMES = 200  # of geoms, and of actuators
MISSING = "an MJCF needs MuJoCo: pip install 'geomech[mujoco]'"


@dataclass(frozen=True)
class Mjcf(Robot):
    """A robot of an MJCF file, walking along x, the ground at z = 0.

    mjcf (-): name of the file; in a scene file, from the scene's folder. geoms (-):
    names of the geoms that touch the ground, and nothing else. actuators (-): names of
    the <position> or <velocity> actuators that the gait's clock drives; by default all
    of them. phases (-): phase of each of these actuators, in cycles; by default 0.

    Other actuators keep the controls of the first keyframe, or 0. The robot starts as
    in the first keyframe, if there is one, at the height where the lowest of its geoms
    is on the ground.
    """

    mjcf: str
    geoms: tuple[str, ...]
    actuators: tuple[str, ...] | None = None
    phases: tuple[float, ...] | None = None
    digest: str = field(init=False, default="")
    hip_phases = ()
    period = 1.0

    def __post_init__(self):
        require(
            isinstance(self.mjcf, str),
            "mjcf must be the name of an MJCF file",
            value=self.mjcf,
        )
        for name in ("geoms", "actuators"):
            value = getattr(self, name)
            if value is None and name == "actuators":
                continue
            valid = isinstance(value, tuple | list) and all(
                isinstance(x, str) for x in value
            )
            require(
                valid and len(value) <= MOST_NAMES,
                f"{name} must be a list of names",
                value=value,
            )
            require(
                len({*value}) == len(value),
                f"{name} names one twice",
                instead=formatted(value),
            )
            object.__setattr__(self, name, tuple(value))
        require(
            len(self.geoms) > 0,
            "a robot without legs",
            because="geoms must name those that touch the ground",
        )
        model, digest = _compiled(self.mjcf)
        object.__setattr__(self, "digest", digest)
        object.__setattr__(self, "model", model)
        self._find_geoms()
        self._find_driven()

    def __getstate__(self):
        return {k: v for k, v in self.__dict__.items() if k != "model"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        object.__setattr__(self, "model", _compiled(self.mjcf)[0])
        self._find_geoms()

    @property
    def mass(self) -> float:
        """Mass of all bodies, kg."""
        return float(self.model.body_mass.sum())

    def _find_geoms(self) -> None:
        """Set the numbers of the geoms; ValueError for unknown ones and for those of
        the world."""
        model = self.model
        require(
            model.nv > 0,
            "nothing can move",
            where=self.mjcf,
            because="it has no joints",
        )
        numbers = []
        for name in self.geoms:
            geom = self._number("geom", name, model.ngeom)
            fixed = model.body_weldid[model.geom_bodyid[geom]] == 0
            require(
                not fixed,
                f"the geom {formatted(name)} is fixed to the world",
                where=self.mjcf,
                instead="name those of the robot",
            )
            numbers.append(geom)
        object.__setattr__(self, "geom_numbers", np.array(numbers))

    def _number(self, kind: str, name: str, count: int) -> int:
        """Return the number of the model's geom or actuator of a name; a ValueError
        names the nearest, or the first few."""
        import mujoco

        kinds = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        number = mujoco.mj_name2id(self.model, kinds, name)
        if number < 0:
            names = [
                x
                for x in (mujoco.mj_id2name(self.model, kinds, k) for k in range(count))
                if x
            ]
            near = difflib.get_close_matches(name, names, 1, 0.5)
            few = (
                ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
                or "none with a name"
            )
            cure = f"did you mean {formatted(near[0])}?" if near else f"it has {few}"
            raise Refusal(f"{self.mjcf} has no {kind} {formatted(name)}", instead=cure)
        return number

    def _find_driven(self) -> None:
        """Set the numbers and phases of the actuators that the clock drives; ValueError
        for actuators that it cannot drive."""
        import mujoco

        model = self.model
        require(
            model.nu > 0,
            f"{self.mjcf} has no actuators",
            because="nothing turns its legs",
            instead="add <position> or <velocity> ones",
        )
        require(
            model.na == 0,
            f"{self.mjcf} has actuators with a state of their own",
            instead="drop their dyntype",
        )
        affine = (model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE) & (
            model.actuator_gaintype == mujoco.mjtGain.mjGAIN_FIXED
        )
        able = (
            affine
            & (model.actuator_biasprm[:, 1:3] != 0.0).any(1)
            & (model.actuator_gainprm[:, 0] != 0.0)
        )
        cure = "make it <position> or <velocity>"
        if self.actuators is None:
            driven = np.flatnonzero(able)
            cure = f"{cure}, or actuators = [] for the first keyframe's controls"
            require(
                len(driven) > 0,
                "no actuator can follow the clock",
                where=self.mjcf,
                instead=cure,
            )
        else:
            ids = [self._number("actuator", name, model.nu) for name in self.actuators]
            for name, k in zip(self.actuators, ids):
                require(
                    bool(able[k]),
                    f"the actuator {formatted(name)} cannot follow the clock",
                    where=self.mjcf,
                    instead=cure,
                )
            driven = np.array(ids, int)
        for k in driven:
            name = formatted(
                mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, k)
                or f"number {k + 1}"
            )
            message = f"{self.mjcf}: the actuator {name} has a ctrlrange: a leg that turns round needs none; drop it"
            require(not model.actuator_ctrllimited[k], message)
        phases = (
            np.zeros(len(driven))
            if self.phases is None
            else real_array("phases", self.phases)
        )
        valid = phases.shape == (len(driven),) and bool((np.abs(phases) <= 100).all())
        require(
            valid,
            f"phases must be {len(driven)} numbers, one for each actuator",
            value=self.phases,
        )
        object.__setattr__(self, "phases", tuple(map(float, phases)))
        object.__setattr__(self, "driven", driven)

    def surfaces(self, elements: int) -> list[Surface]:
        """Return the surfaces of the geoms, with ``elements`` edges around round
        ones."""
        from rft.terradynamics.walking import geoms

        in_range("elements", elements, 4, 1000, whole=True)
        out = []
        for name, geom in zip(self.geoms, self.geom_numbers):
            try:
                out.append(
                    geoms.surface(
                        self.model, geom, geoms.geom_mesh(self.model, geom, elements)
                    )
                )
            except ValueError as error:
                raise Refusal(
                    f"geom {formatted(name)}", where=self.mjcf, because=str(error)
                ) from None
        return out

    def check(self, elements: int) -> None:
        self.surfaces(elements)


def require_bounded(path: Path) -> None:
    """Raise Refusal for an MJCF that would keep MuJoCo busy for long, or wait: copies
    by <replicate>, nodes of height fields, and files that are included but no ordinary
    ones. What is no XML is left to MuJoCo."""
    try:
        _count_parts(path, _Counted(1, 0, 0), [path.parent])
    except RecursionError:
        raise Refusal("its elements are nested too deep") from None


@dataclass
class _Counted:
    """Parts of an MJCF so far. copies: of a part, by the <replicate> around it. geoms,
    nodes: of height fields."""

    copies: int
    geoms: int
    nodes: int


def _count_parts(path: Path, counted: _Counted, within: list[Path]) -> None:
    """Add the parts of a file and of those that it includes. within: folders of the
    files around it."""
    name = path.name
    require(path.is_file(), f"{name} is no ordinary file")
    require(
        path.stat().st_size <= LARGEST_FILE and len(within) < MOST_INCLUDES,
        f"{name} is included too deep, or larger than {LARGEST_FILE / 1e6:.0f} MB",
    )
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, ValueError, LookupError, OSError):
        return
    _count_element(root, counted, [*within, path.parent])


def _count_element(element, counted: _Counted, within: list[Path]) -> None:
    """Add the parts of an element and of those within it."""
    copies = counted.copies
    if element.tag == "replicate":
        counted.copies *= max(1, _whole(element.get("count")))
    elif element.tag == "geom":
        counted.geoms += counted.copies
    elif element.tag == "hfield":
        counted.nodes += _whole(element.get("nrow")) * _whole(element.get("ncol"))
    elif element.tag == "include":
        for folder in dict.fromkeys((within[0], within[-1])):
            other = folder / (element.get("file") or "")
            if other.exists():
                _count_parts(other, counted, within)
    most = max(counted.geoms, counted.copies)
    require(
        most <= MOST_PARTS,
        f"the MJCF has {most:,} geoms or copies, more than {MOST_PARTS:,}",
        instead="give <replicate> a smaller count",
    )
    require(
        counted.nodes <= MOST_NODES,
        f"its height fields have {counted.nodes:,} nodes, more than {MOST_NODES:,}",
    )
    for child in element:
        _count_element(child, counted, within)
    counted.copies = copies


def _whole(text: str | None) -> int:
    """Return the whole number in an attribute, 0 where there is none."""
    try:
        return int(text or 0)
    except ValueError:
        return 0


def _compiled(file: str):
    """Return the model of a file and its digest; ValueError of one line if MuJoCo
    cannot read the file."""
    try:
        import mujoco
    except ImportError:
        raise Refusal(MISSING) from None
    # MuJoCo writes warnings to the screen and to a file; the checks below refuse what
    # matters.
    mujoco.set_mju_user_warning(lambda _: None)
    path = Path(file)
    try:
        require(
            path.is_file(),
            f"{file} is no ordinary file"
            if path.exists()
            else f"there is no MJCF file {file}",
        )
        require(
            path.stat().st_size <= LARGEST_FILE,
            f"{file} is larger than {LARGEST_FILE / 1000000.0:.0f} MB",
            because="no MJCF is",
        )
        path.open("rb").close()
    except OSError as error:
        raise Refusal(f"cannot read MJCF {file}", because=error.strerror) from None
    with located(file):
        require_bounded(path)
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except (
        Exception
    ) as error:  # MuJoCo raises many kinds of errors for a file that is no MJCF
        message = " ".join(str(error).split())
        raise Refusal(
            f"{file} is no MJCF that MuJoCo reads", because=message[:300]
        ) from None
    if names := _not_finite(model):
        raise Refusal(
            f"nan or inf in {names}",
            where=file,
            because="every number of an MJCF must be finite",
        )
    down = model.opt.gravity
    upright = down[2] < 0 and abs(down[0]) + abs(down[1]) <= 1e-9 * abs(down[2])
    require(
        bool(upright), "gravity must be along -z, the ground is at z = 0", where=file
    )
    content = np.empty(
        mujoco.mj_sizeModel(model), np.uint8
    )  # with that of included files and meshes
    mujoco.mj_saveModel(model, None, content)
    return model, hashlib.sha256(content).hexdigest()[:16]


def _not_finite(model) -> str:
    """Return the names of arrays with nan or inf, as "keyframe qpos, body_pos", but for
    those that MuJoCo computes from others."""
    arrays = {
        name: getattr(model, name)
        for name in dir(model)
        if not name.endswith(("0", "_spring"))
    }
    floats = {
        name: x
        for name, x in arrays.items()
        if isinstance(x, np.ndarray) and x.dtype.kind == "f"
    }
    return ", ".join(
        name.replace("key_", "keyframe ")
        for name, x in floats.items()
        if not np.isfinite(x).all()
    )
