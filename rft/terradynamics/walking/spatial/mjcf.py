"""Robots from MJCF files, with a list of the geoms that touch the ground.

They need MuJoCo, which is imported where it is first used."""

from __future__ import annotations

import difflib
import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from rft.core.checks import in_range, real_array
from rft.core.notes import warn
from rft.core.refusal import Refusal, formatted, located, require
from rft.terradynamics.walking.robot import Robot
from rft.terradynamics.walking.spatial.facets import Surface

LARGEST_FILE = 20_000_000  # bytes of XML
MOST_PARTS = 20_000  # geoms, or copies by <replicate>
MOST_NODES = 4_000_000  # of height fields
MOST_INCLUDES = 20  # files within files
MOST_NAMES = 200  # of geoms, and of actuators
MISSING = "an MJCF needs MuJoCo: pip install 'geomech[mujoco]'"


@dataclass(frozen=True)
class Mjcf(Robot):
    """A robot of an MJCF file, walking along x, the ground at z = 0.

    mjcf (-): name of the file, relative to the folder of a scene file. geoms (-): the
    geoms that touch the ground, and no others: names of geoms or of their bodies, and
    patterns such as "leg_*". actuators (-): names of the
    <position> or <velocity> actuators that the clock of the gait drives; by default all
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
        self._check_names("geoms")
        if self.actuators is not None:
            self._check_names("actuators")
        require(
            len(self.geoms) > 0,
            "a robot without legs",
            because="geoms must list the geoms that touch the ground",
        )
        model, digest = _compile_model(self.mjcf)
        object.__setattr__(self, "digest", digest)
        object.__setattr__(self, "model", model)
        for note in self._find_geoms():
            warn(f"{self.mjcf}: {note}")
        self._find_driven()

    def _check_names(self, field_name: str) -> None:
        """Make a field of names a tuple; ValueError unless it is a list of different
        names."""
        value = getattr(self, field_name)
        is_list = isinstance(value, tuple | list)
        require(
            is_list
            and all(isinstance(name, str) for name in value)
            and len(value) <= MOST_NAMES,
            f"{field_name} must be a list of names",
            value=value,
        )
        require(
            len(set(value)) == len(value),
            f"{field_name} lists a name twice",
            instead=formatted(value),
        )
        object.__setattr__(self, field_name, tuple(value))

    def __getstate__(self):
        return {k: v for k, v in self.__dict__.items() if k != "model"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        object.__setattr__(self, "model", _compile_model(self.mjcf)[0])
        self._find_geoms()

    @property
    def mass(self) -> float:
        """Mass of all bodies, kg."""
        return float(self.model.body_mass.sum())

    def _find_geoms(self) -> list[str]:
        """Set the numbers of the geoms, and return notes about those that are left out;
        ValueError for unknown ones, and those of the world."""
        model = self.model
        require(
            model.nv > 0,
            "nothing can move",
            where=self.mjcf,
            because="it has no joints",
        )
        from rft.mujoco.ground.selection import choose_geoms

        with located(self.mjcf):
            numbers, notes = choose_geoms(model, self.geoms)
        object.__setattr__(self, "geom_numbers", np.array(numbers))
        return notes

    def _number(self, kind: str, name: str, count: int) -> int:
        """Return the number of the model's geom or actuator of a name; a ValueError
        names the nearest, or the first few."""
        import mujoco

        kinds = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        number = mujoco.mj_name2id(self.model, kinds, name)
        if number >= 0:
            return number

        names = [mujoco.mj_id2name(self.model, kinds, k) for k in range(count)]
        names = [x for x in names if x]
        near = difflib.get_close_matches(name, names, 1, 0.5)
        if near:
            cure = f"did you mean {formatted(near[0])}?"
        elif names:
            cure = f"the names are {', '.join(names[:8])}"
            if len(names) > 8:
                cure += ", ..."
        else:
            cure = "it has none with a name"
        raise Refusal(f"{self.mjcf} has no {kind} {formatted(name)}", instead=cure)

    def _find_driven(self) -> None:
        """Set the numbers and phases of the actuators that the clock drives; ValueError
        for actuators that it cannot drive."""
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
            instead="remove their dyntype",
        )
        driven = self._driven_actuators()
        for k in driven:
            self._require_no_range(k)

        phases = np.zeros(len(driven))
        if self.phases is not None:
            phases = real_array("phases", self.phases)
        has_size = phases.shape == (len(driven),)
        require(
            has_size and bool((np.abs(phases) <= 100).all()),
            f"phases must be {len(driven)} numbers, one for each actuator",
            value=self.phases,
        )
        object.__setattr__(self, "phases", tuple(map(float, phases)))
        object.__setattr__(self, "driven", driven)

    def _driven_actuators(self) -> np.ndarray:
        """Return the numbers of the actuators that the clock drives; ValueError where
        one cannot follow it."""
        model = self.model
        can_follow = _can_follow_clock(model)
        cure = "use <position> or <velocity>"
        if self.actuators is None:
            driven = np.flatnonzero(can_follow)
            require(
                len(driven) > 0,
                "no actuator can follow the clock",
                where=self.mjcf,
                instead=(
                    f"{cure}, or actuators = [] to hold the controls of the first "
                    "keyframe"
                ),
            )
            return driven

        numbers = [self._number("actuator", name, model.nu) for name in self.actuators]
        for name, number in zip(self.actuators, numbers):
            require(
                bool(can_follow[number]),
                f"the actuator {formatted(name)} cannot follow the clock",
                where=self.mjcf,
                instead=cure,
            )
        return np.array(numbers, int)

    def _require_no_range(self, actuator: int) -> None:
        """Raise Refusal for an actuator whose controls are limited."""
        import mujoco

        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
        name = formatted(name or f"number {actuator + 1}")
        require(
            not self.model.actuator_ctrllimited[actuator],
            f"{self.mjcf}: the actuator {name} has a ctrlrange, which a leg that "
            "turns round does not need; remove it",
        )

    def surfaces(self, elements: int) -> list[Surface]:
        """Return the surfaces of the geoms, with ``elements`` edges around round
        ones."""
        from rft.terradynamics.meshes.geoms import geom_label
        from rft.terradynamics.walking.spatial import geoms

        in_range("elements", elements, 4, 1000, whole=True)
        out = []
        for geom in self.geom_numbers:
            try:
                mesh = geoms.geom_mesh(self.model, geom, elements)
                out.append(geoms.surface(self.model, geom, mesh))
            except ValueError as error:
                label = geom_label(self.model, geom)
                raise Refusal(
                    f"geom {label}", where=self.mjcf, because=str(error)
                ) from None
        return out

    def check(self, elements: int) -> None:
        self.surfaces(elements)


def _can_follow_clock(model) -> np.ndarray:
    """Return which actuators (nu,) of a model have a force that is linear in their
    control and in their length or velocity."""
    import mujoco

    is_affine = model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE
    is_affine &= model.actuator_gaintype == mujoco.mjtGain.mjGAIN_FIXED
    has_bias = (model.actuator_biasprm[:, 1:3] != 0.0).any(1)
    has_gain = model.actuator_gainprm[:, 0] != 0.0
    return is_affine & has_bias & has_gain


def require_bounded(path: Path) -> None:
    """Raise Refusal for an MJCF that would keep MuJoCo busy for long, or let it wait.

    Counted are copies by <replicate>, nodes of height fields, and included files, which
    must be ordinary ones. A file that is no XML is left to MuJoCo."""
    try:
        _count_parts(path, _PartCount(), [path.parent])
    except RecursionError:
        raise Refusal("its elements are nested too deeply") from None


@dataclass
class _PartCount:
    """Number of parts of an MJCF so far.

    copies: of a part, by the <replicate> around it. geoms: number of them. nodes: of
    height fields."""

    copies: int = 1
    geoms: int = 0
    nodes: int = 0


def _count_parts(path: Path, count: _PartCount, folders: list[Path]) -> None:
    """Add the parts of a file and of those that it includes. folders: those of the
    files around it."""
    name = path.name
    require(path.is_file(), f"{name} is not an ordinary file")
    require(
        path.stat().st_size <= LARGEST_FILE and len(folders) < MOST_INCLUDES,
        f"{name} is included too deeply, or larger than "
        f"{LARGEST_FILE / 1000000.0:.0f} MB",
    )
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, ValueError, LookupError, OSError):
        return
    _count_element(root, count, [*folders, path.parent])


def _count_element(element, count: _PartCount, folders: list[Path]) -> None:
    """Add the parts of an element and of those within it."""
    copies = count.copies
    if element.tag == "replicate":
        count.copies *= max(1, _whole_number(element.get("count")))
    elif element.tag == "geom":
        count.geoms += count.copies
    elif element.tag == "hfield":
        rows = _whole_number(element.get("nrow"))
        count.nodes += rows * _whole_number(element.get("ncol"))
    elif element.tag == "include":
        # From the folder of the main file, or of the one that includes it.
        for folder in dict.fromkeys((folders[0], folders[-1])):
            other = folder / (element.get("file") or "")
            if other.exists():
                _count_parts(other, count, folders)
    most = max(count.geoms, count.copies)
    require(
        most <= MOST_PARTS,
        f"the MJCF has {most:,} geoms or copies, more than {MOST_PARTS:,}",
        instead="give <replicate> a smaller count",
    )
    require(
        count.nodes <= MOST_NODES,
        f"its height fields have {count.nodes:,} nodes, more than {MOST_NODES:,}",
    )
    for child in element:
        _count_element(child, count, folders)
    count.copies = copies


def _whole_number(text: str | None) -> int:
    """Return the whole number in an attribute, 0 where there is none."""
    try:
        return int(text or 0)
    except ValueError:
        return 0


def _compile_model(file: str):
    """Return the model of a file and its digest; ValueError of one line if MuJoCo
    cannot read the file, or its model is no robot on the ground."""
    model = read_model(file)
    _require_sound(file, model)
    import mujoco

    # Included files and meshes are part of the content.
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return model, hashlib.sha256(content).hexdigest()[:16]


def read_model(file: str | Path):
    """Return the compiled model of an MJCF or URDF file; Refusal of one line where
    MuJoCo cannot read it, or where it would take long."""
    try:
        import mujoco
    except ImportError:
        raise Refusal(MISSING) from None
    # MuJoCo writes warnings to the screen and to a file; the checks below refuse what
    # matters.
    mujoco.set_mju_user_warning(lambda _: None)
    path = Path(file)
    _require_readable(file, path)
    with located(file):
        require_bounded(path)
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    # MuJoCo raises many kinds of errors for a file that is no MJCF.
    except Exception as error:
        message = " ".join(str(error).split())
        raise Refusal(
            f"{file} is not an MJCF file that MuJoCo can read", because=message[:300]
        ) from None


def _require_readable(file: str | Path, path: Path) -> None:
    """Raise Refusal unless a file exists, is an ordinary one of a usual size, and can
    be read."""
    cure = "" if path.is_absolute() else f"it is looked for in {Path.cwd()}"
    try:
        require(path.exists(), f"there is no MJCF file {file}", instead=cure)
        require(path.is_file(), f"{file} is not an ordinary file")
        require(
            path.stat().st_size <= LARGEST_FILE,
            f"{file} is larger than {LARGEST_FILE / 1e6:.0f} MB",
            because="no MJCF is",
        )
        path.open("rb").close()
    except OSError as error:
        raise Refusal(f"cannot read MJCF {file}", because=error.strerror) from None


def _require_sound(file: str, model) -> None:
    """Raise Refusal for a model with numbers that are not finite, or gravity in another
    direction than -z."""
    names = _not_finite(model)
    if names:
        raise Refusal(
            f"nan or inf in {names}",
            where=file,
            because="every number of an MJCF must be finite",
        )
    g_x, g_y, g_z = model.opt.gravity
    is_down = g_z < 0 and abs(g_x) + abs(g_y) <= 1e-9 * abs(g_z)
    require(
        bool(is_down),
        "gravity must be along -z, because the ground is at z = 0",
        where=file,
        instead='for a slope, use [[effects]] kind = "slope"',
    )


def _not_finite(model) -> str:
    """Return the names of arrays with nan or inf, as "keyframe qpos, body_pos", but for
    those that MuJoCo computes from others."""
    names = []
    for name in dir(model):
        if name.endswith(("0", "_spring")):
            continue
        value = getattr(model, name)
        is_floats = isinstance(value, np.ndarray) and value.dtype.kind == "f"
        if is_floats and not np.isfinite(value).all():
            names.append(name.replace("key_", "keyframe "))
    return ", ".join(names)
