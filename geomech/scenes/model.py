"""A scene: what is simulated and how finely. It is a value;
`geomech.studies.scene_tables.SceneTables` stores what is computed for one."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.errors import choose
from geomech.gaits import KINDS as GAITS
from geomech.gaits import Gait
from geomech.geometry.gait import checked_gait
from geomech.scenes.frames import reframed
from geomech.scenes.key import text_key
from geomech.scenes.medium import MEDIUM
from geomech.scenes.sections import Each, Keys, OneOf
from geomech.scenes.sizes import Physical
from geomech.systems import KINDS as SYSTEMS
from geomech.systems.base import (
    Cycle,
    System,
    as_system,
    kind_of,
    note_angles,
    unwrapped,
)
from geomech.systems.capabilities import solver_of, with_solver
from geomech.systems.swimmer import PARTS, Swimmer, note_radius
from geomech.tiers.base import Numerics
from rft.core.refusal import Refusal, formatted, located, printable

FRAME = (
    "of all velocities and displacements, in place of the body's own key; 'minimum-perturbation', here or there: the one in "
    "which the connection is smallest"
)
SHORT = "swimmer"  # the kind of system whose sections may stand by themselves
SWIMMER = {
    "medium": MEDIUM,
    "body": OneOf(PARTS["body"], sized=True),
    "effects": Each(PARTS["effects"], sized=True),
}
TABLE = {
    "body": OneOf({"chain": PARTS["body"]["chain"]}),
    "medium": MEDIUM,
}  # of a table whose file does not say them


class Displayed:
    """The `repr` of a scene: its name and its parts, in a line of readable length."""

    name: str
    system: System
    gait: Gait
    numerics: Numerics

    def __repr__(self) -> str:
        return f"Scene({printable(self.name)}: {formatted(self.system, 160)}, {formatted(self.gait, 100)}, {self.numerics!r})"


@dataclass(frozen=True, repr=False)
class Scene(Displayed):
    """A system and a gait. numerics: the tiers'; the system has its own. name: a built-in one's, or its file's. text: the
    TOML it was read from, if it was; `geomech.scenes.write` says whether it still holds. files: others it was read from.

    Examples
    --------
    >>> from geomech.gaits import Circle
    >>> from geomech.scenes import Scene
    >>> from geomech.systems import NoSlipSnake
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
            for name, kind in (
                ("name", str),
                ("text", str),
                ("files", tuple),
                ("numerics", Numerics),
            ):
                if not isinstance(getattr(self, name), kind):
                    raise Refusal(
                        f"{name} must be {kind.__name__}", value=getattr(self, name)
                    )
            gait = checked_gait(self.gait)
            object.__setattr__(self, "system", as_system(self.system, gait.joints))
            _check_joints(self.system, gait)
            frequency_of(self.system, self.gait)
            object.__setattr__(self, "system", reframed(self.system, self.numerics))
            self.note_turns(self.gait)
            if isinstance(self.system, Swimmer):
                note_radius(self.system)

    def note_turns(self, gait: Gait, amplitudes: ArrayLike | None = None) -> None:
        """Warn (`Note`) of a joint that a gait turns by more than a full turn, and of a curve far from its points."""
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
        """Return the scene with some of its [numerics], or of its system's, changed; None leaves an entry."""
        own_keys = {f.name for f in _fields(solver_of(self.system))}
        changes = {k: v for k, v in changes.items() if v is not None}
        with located(self.name):
            system = with_solver(
                self.system, {k: v for k, v in changes.items() if k in own_keys}
            )
            tier_changes = {k: v for k, v in changes.items() if k not in own_keys}
            for name in tier_changes:
                choose(
                    "numerics", name, [*own_keys, *self.numerics.__dataclass_fields__]
                )
            return dataclasses.replace(
                self,
                system=system,
                numerics=dataclasses.replace(self.numerics, **tier_changes),
            )

    def changed(self, **changes: Any) -> Scene:
        """Return the scene with some of its parts, or of its system's, changed."""
        parts = {
            k: v
            for k, v in changes.items()
            if k in ("system", "gait", "numerics", "name", "text", "files")
        }
        with located(self.name):
            system_changes = {k: v for k, v in changes.items() if k not in parts}
            system = unwrapped(parts.get("system", self.system))
            for name in system_changes:
                choose(
                    "part",
                    name,
                    [
                        "system",
                        "gait",
                        "numerics",
                        "name",
                        *(f.name for f in _fields(system)),
                    ],
                )
            if system_changes:
                parts["system"] = dataclasses.replace(system, **system_changes)
            return dataclasses.replace(self, **parts)

    def cycle(
        self, gait: Gait | None = None, amplitudes: ArrayLike | None = None, phases: int | None = None, work: bool = False
    ) -> Cycle:  # fmt: skip
        """Run a gait, or the scene's own, for amplitudes (...,), all at once."""
        gait = checked_gait(self.gait if gait is None else gait)
        return self.system.run(
            *gait.cycle(phases or self.numerics.phases, amplitudes), work
        )


def _fields(thing) -> tuple:
    return dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ()


def _check_joints(system: System, gait: Gait) -> None:
    if gait.joints != system.joints:
        owner, cure = (
            "[body]",
            "give the body one link more than the gait has joints, or as many modes, or another gait",
        )
        if not hasattr(system, "body"):
            owner, cure = f"the {kind_of(system)}", "give it another gait"
        message = f"[gait] {type(gait).__name__.lower()} moves {gait.joints} joints but {owner} has {system.joints}"
        raise Refusal(message, instead=cure)


def checked_scene(scene) -> Scene:
    """Return the scene; Refusal if it is none."""
    if not isinstance(scene, Scene):
        raise Refusal(
            "scene must be a Scene, such as geomech.scenes.load gives", value=scene
        )
    return scene


def frequency_of(system: System, gait: Gait) -> float | None:
    """Return the cycles per second of a system that runs a gait: the gait's, or that of effects which have one; None
    without either. Refusal if the two contradict each other."""
    gait_frequency, effect_frequency = (
        getattr(gait, "frequency", None),
        system.traits.frequency,
    )
    if gait_frequency is None or effect_frequency is None:
        return effect_frequency if gait_frequency is None else gait_frequency
    if np.any(np.asarray(effect_frequency) != gait_frequency):
        message = f"[gait] frequency = {gait_frequency:g}, but the effects of the {kind_of(system)} have "
        message += formatted(effect_frequency)
        raise Refusal(message, because="it is one swimmer", instead="keep one")
    return gait_frequency
