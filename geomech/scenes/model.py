"""A scene: what is simulated, and how finely. A scene is a value;
`geomech.studies.scene_tables.SceneTables` stores the tables computed for one."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

import rft
from geomech.core.errors import choose
from geomech.mathematics.gaits import KINDS as GAITS
from geomech.mathematics.gaits import Gait
from geomech.mathematics.gaits.wound import unwound, wound_for
from geomech.mathematics.geometry.gait import checked_gait
from geomech.mathematics.geometry.periods import checked_periods, winding
from geomech.mathematics.systems import KINDS as SYSTEMS
from geomech.mathematics.systems.base import (
    Cycle,
    System,
    as_system,
    kind_of,
    note_angles,
    unwrapped,
)
from geomech.mathematics.systems.capabilities import solver_of, with_solver
from geomech.mathematics.systems.swimmer import PARTS, Swimmer, note_radius
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes.format.key import text_key
from geomech.scenes.format.sections import Each, Keys, OneOf
from geomech.scenes.format.sizes import Physical
from geomech.scenes.frames import reframed
from geomech.scenes.medium import MEDIUM
from rft.core.refusal import Refusal, formatted, located, printable

FRAME = (
    "frame of all velocities and displacements, instead of the key in the body; "
    "'minimum-perturbation' selects the frame in which the connection is smallest"
)
SHORT = "swimmer"  # the kind of system whose sections may stand by themselves
SWIMMER = {
    "medium": MEDIUM,
    "body": OneOf(PARTS["body"], sized=True),
    "contact": OneOf(PARTS["contact"]),
    "effects": Each(PARTS["effects"], sized=True),
}
TABLE = {  # body and medium of a table whose file does not state them
    "body": OneOf({"chain": PARTS["body"]["chain"]}),
    "medium": MEDIUM,
}


class SceneRepr:
    """The `repr` of a scene: its name and its parts, in a line of readable length."""

    name: str
    system: System
    gait: Gait
    numerics: Numerics

    def __repr__(self) -> str:
        system = formatted(self.system, 160)
        gait = formatted(self.gait, 100)
        return f"Scene({printable(self.name)}: {system}, {gait}, {self.numerics!r})"


@dataclass(frozen=True, repr=False)
class Scene(SceneRepr):
    """A system and a gait.

    Where the last shape variables of the system have periods and the gait moves only
    the others, these advance with the phase (`geomech.mathematics.gaits.Wound`).

    numerics: of the tiers; the system has its own. name: of a built-in scene, or of the
    file. text: the TOML from which the scene was read, or "". `geomech.scenes.write`
    uses it only where it still describes the scene. files: further files from which it
    was read.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.scenes import Scene
    >>> from geomech.mathematics.systems import NoSlipSnake
    >>> scene = Scene(NoSlipSnake(), Circle(0.3, centre=(0.7, -0.7)))
    >>> scene.system.joints, scene.numerics.phases
    (2, 256)
    """

    system: Annotated[
        System,
        OneOf(SYSTEMS, inner={SHORT: SWIMMER, "table": TABLE}, sized=True, short=SHORT),
    ]
    gait: Annotated[Gait, OneOf(GAITS, sized=True)]
    numerics: Annotated[Numerics, Keys(Numerics)] = field(default_factory=Numerics)
    name: str = "scene"
    text: str = field(default="", compare=False)
    files: tuple[str, ...] = field(default=(), compare=False)
    example: ClassVar[str] = "NAME"
    once: ClassVar = {
        "physical": Keys(Physical),
        "frame": text_key("frame", FRAME)._replace(default="mean"),
    }

    def __post_init__(self):
        with located(self.name):
            _check_types(self)
            gait = checked_gait(self.gait)
            object.__setattr__(self, "system", as_system(self.system, gait.joints))
            periods = checked_periods(self.system.traits.periods, self.system.joints)
            gait = wound_for(gait, self.system.joints, periods)
            object.__setattr__(self, "gait", gait)
            _check_joints(self.system, gait)
            if hasattr(gait, "shape"):
                winding(gait, periods)  # refuses a gait that does not close
            frequency_of(self.system, self.gait)
            object.__setattr__(self, "system", reframed(self.system, self.numerics))
            self.note_turns(self.gait)
            if isinstance(self.system, Swimmer):
                note_radius(self.system)

    def note_turns(self, gait: Gait, amplitudes: ArrayLike | None = None) -> None:
        """Warn (`Note`) if a gait turns a joint by more than a full turn, or if its
        curve is far from its points."""
        if hasattr(gait, "largest"):
            note_angles(self.system, gait.largest(amplitudes))
        if hasattr(gait, "note"):
            gait.note()

    frame = property(
        lambda self: self.system.traits.frame,
        doc="The body frame of all velocities and displacements.",
    )
    frequency = property(
        lambda self: frequency_of(self.system, self.gait),
        doc="Hz; None where nothing says one.",
    )

    def with_numerics(self, **changes: Any) -> Scene:
        """Return the scene with other entries of [numerics], of the tiers or of its
        system's solver. An entry that is None stays as it is."""
        solver_keys = _field_names(solver_of(self.system))
        changes = {key: value for key, value in changes.items() if value is not None}
        of_solver = {key: x for key, x in changes.items() if key in solver_keys}
        of_tiers = {key: x for key, x in changes.items() if key not in solver_keys}
        with located(self.name):
            for key in of_tiers:
                choose("numerics", key, [*solver_keys, *_field_names(self.numerics)])
            system = with_solver(self.system, of_solver)
            numerics = dataclasses.replace(self.numerics, **of_tiers)
            return dataclasses.replace(self, system=system, numerics=numerics)

    def changed(self, **changes: Any) -> Scene:
        """Return the scene with other parts, or with other parts of its system."""
        own_names = ("system", "gait", "numerics", "name", "text", "files")
        parts = {key: value for key, value in changes.items() if key in own_names}
        of_system = {key: value for key, value in changes.items() if key not in parts}
        with located(self.name):
            system = unwrapped(parts.get("system", self.system))
            names = ["system", "gait", "numerics", "name", *_field_names(system)]
            for name in of_system:
                choose("part", name, names)
            if of_system:
                parts["system"] = dataclasses.replace(system, **of_system)
            return dataclasses.replace(self, **parts)

    def fitting_gait(self, gait: Gait) -> Gait:
        """Return a gait of all variables of the system: with variables that have a
        period advancing, where it moves only the others
        (`geomech.mathematics.gaits.Wound`)."""
        gait = checked_gait(gait)
        return wound_for(gait, self.system.joints, self.system.traits.periods)

    def in_medium(self, medium: rft.Medium) -> Scene:
        """Return the scene of a swimmer in another medium, which alone is checked: no
        other part of a scene depends on it."""
        swimmer = self.system
        assert isinstance(swimmer, Swimmer)
        new = object.__new__(type(self))
        new.__dict__.update(vars(self), system=swimmer.in_medium(medium))
        return new

    def cycle(
        self,
        gait: Gait | None = None,
        amplitudes: ArrayLike | None = None,
        phases: int | None = None,
        work: bool = False,
    ) -> Cycle:
        """Run a gait, by default the scene's, for amplitudes (...,), all at once."""
        gait = self.fitting_gait(self.gait if gait is None else gait)
        alpha, alphadot = gait.cycle(phases or self.numerics.phases, amplitudes)
        return self.system.run(alpha, alphadot, work)


def _check_types(scene: Scene) -> None:
    """Raise Refusal for fields of wrong types; not of system and gait."""
    types = {"name": str, "text": str, "files": tuple, "numerics": Numerics}
    for name, kind in types.items():
        value = getattr(scene, name)
        if not isinstance(value, kind):
            raise Refusal(f"{name} must be {kind.__name__}", value=value)


def _field_names(value: Any) -> list[str]:
    """Return the names of the fields of a dataclass; none for another object."""
    if not dataclasses.is_dataclass(value):
        return []
    return [field.name for field in dataclasses.fields(value)]


def _check_joints(system: System, gait: Gait) -> None:
    """Raise Refusal if a gait moves another number of joints than a system has, without
    those that advance by themselves."""
    if gait.joints == system.joints:
        return
    owner = f"the {kind_of(system)}"
    cure = "use another gait"
    if hasattr(system, "body"):
        owner = "[body]"
        cure = (
            "give the body one link more than the gait has joints, or as many modes, "
            "or use another gait"
        )
    kind = type(unwound(gait)).__name__.lower()
    raise Refusal(
        f"[gait] {kind} moves {gait.joints} joints, but {owner} has {system.joints}",
        instead=cure,
    )


def checked_scene(scene: Any) -> Scene:
    """Return the scene; Refusal if it is none."""
    if not isinstance(scene, Scene):
        raise Refusal(
            "scene must be a Scene, such as geomech.scenes.load returns", value=scene
        )
    return scene


def frequency_of(system: System, gait: Gait) -> float | None:
    """Return the frequency, Hz, of a system that runs a gait: that of the gait, or of
    the effects; None without either. Refusal if the two contradict each other."""
    gait_frequency = getattr(gait, "frequency", None)
    effect_frequency = system.traits.frequency
    if gait_frequency is None:
        return effect_frequency
    if effect_frequency is None:
        return gait_frequency
    if np.any(np.asarray(effect_frequency) != gait_frequency):
        raise Refusal(
            f"[gait] frequency = {gait_frequency:g}, but the effects of the "
            f"{kind_of(system)} have {formatted(effect_frequency)}",
            because="both describe one swimmer",
            instead="keep one of them",
        )
    return gait_frequency
