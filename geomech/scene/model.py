"""A scene: what is simulated and how finely. A value; what is computed for one, `geomech.study.bench.Study` remembers."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np

from geomech.core.errors import choose
from geomech.gaits import KINDS as GAITS
from geomech.gaits import Gait
from geomech.geometry.gait import checked_gait
from geomech.scene.frames import reframed
from geomech.scene.key import text_key
from geomech.scene.medium import MEDIUM
from geomech.scene.sections import Each, Keys, OneOf
from geomech.scene.sizes import Physical
from geomech.systems import KINDS as SYSTEMS
from geomech.systems.base import Cycle, System, as_system, kind_of, note_angles, unwrapped
from geomech.systems.capabilities import solver_of, with_solver
from geomech.systems.swimmer import PARTS
from geomech.tiers.base import Numerics
from rft.refusal import Refusal, formatted, located, printable

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


class Told:
    """How a scene shows itself: its name and its parts, in a line of readable length."""

    def __repr__(self) -> str:
        return f"Scene({printable(self.name)}: {formatted(self.system, 160)}, {formatted(self.gait, 100)}, {self.numerics!r})"


@dataclass(frozen=True, repr=False)
class Scene(Told):
    """A system and a gait. numerics: the tiers'; the system has its own. name: a built-in one's, or its file's. text: the
    TOML it was read from, if it was; `geomech.scene.write` says whether it still holds. files: others it was read from."""

    system: Annotated[System, OneOf(SYSTEMS, inner={SHORT: SWIMMER}, sized=True, short=SHORT)]
    gait: Annotated[Gait, OneOf(GAITS, sized=True)]
    numerics: Annotated[Numerics, Keys(Numerics)] = field(default_factory=Numerics)
    name: str = "scene"
    text: str = field(default="", compare=False)
    files: tuple[str, ...] = field(default=(), compare=False)
    example: ClassVar[str] = "NAME"
    once: ClassVar = {"physical": Keys(Physical), "frame": text_key("frame", FRAME)._replace(default="mean")}

    def __post_init__(self):
        with located(self.name):
            for what, kind in (("name", str), ("text", str), ("files", tuple), ("numerics", Numerics)):
                if not isinstance(getattr(self, what), kind):
                    raise Refusal(f"{what} must be {kind.__name__}", value=getattr(self, what))
            gait = checked_gait(self.gait)
            object.__setattr__(self, "system", as_system(self.system, gait.joints))
            _check_joints(self.system, gait)
            frequency_of(self.system, self.gait)
            object.__setattr__(self, "system", reframed(self.system, self.numerics))
            self.note_turns(self.gait)

    def note_turns(self, gait: Gait, amplitudes=None) -> None:
        """UnitWarning if a gait turns a joint by more than a full turn."""
        if hasattr(gait, "largest"):
            note_angles(self.system, gait.largest(amplitudes))

    frame = property(lambda self: self.system.traits.frame, doc="The body frame of all velocities and displacements.")
    frequency = property(lambda self: frequency_of(self.system, self.gait), doc="Hz; None where nothing says one.")

    def with_numerics(self, **changes) -> Scene:
        """This scene with some of its [numerics] changed, the system's own among them; None keeps a value."""
        own = {f.name for f in _fields(solver_of(self.system))}
        changes = {k: v for k, v in changes.items() if v is not None}
        with located(self.name):
            system = with_solver(self.system, {k: v for k, v in changes.items() if k in own})
            rest = {k: v for k, v in changes.items() if k not in own}
            for name in rest:
                choose("numerics", name, [*own, *self.numerics.__dataclass_fields__])
            return dataclasses.replace(self, system=system, numerics=dataclasses.replace(self.numerics, **rest))

    def changed(self, **changes) -> Scene:
        """This scene with some of its parts changed, or of its system's."""
        own = {k: v for k, v in changes.items() if k in ("system", "gait", "numerics", "name", "text", "files")}
        with located(self.name):
            of_system = {k: v for k, v in changes.items() if k not in own}
            system = unwrapped(own.get("system", self.system))
            for name in of_system:
                choose("part", name, ["system", "gait", "numerics", "name", *(f.name for f in _fields(system))])
            if of_system:
                own["system"] = dataclasses.replace(system, **of_system)
            return dataclasses.replace(self, **own)

    def cycle(self, gait: Gait | None = None, amplitudes=None, phases: int | None = None, work: bool = False) -> Cycle:
        """A gait, or the scene's own, run for amplitudes (...,), all at once."""
        gait = checked_gait(self.gait if gait is None else gait)
        return self.system.run(*gait.cycle(phases or self.numerics.phases, amplitudes), work)


def _fields(thing) -> tuple:
    return dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ()


def _check_joints(system: System, gait: Gait) -> None:
    if gait.joints != system.joints:
        whose, cure = (
            "[body]",
            "give the body one link more than the gait has joints, or as many modes, or another gait",
        )
        if not hasattr(system, "body"):
            whose, cure = f"the {kind_of(system)}", "give it another gait"
        told = f"[gait] {type(gait).__name__.lower()} moves {gait.joints} joints but {whose} has {system.joints}"
        raise Refusal(told, instead=cure)


def checked_scene(scene) -> Scene:
    """scene, or ValueError if it is none."""
    if not isinstance(scene, Scene):
        raise Refusal("scene must be a Scene, such as geomech.scene.load gives", value=scene)
    return scene


def frequency_of(system: System, gait: Gait) -> float | None:
    """Cycles per second of a system that runs a gait: the gait's, or that of effects which have one; None where neither says.
    ValueError if the two contradict each other."""
    own, others = getattr(gait, "frequency", None), system.traits.frequency
    if own is None or others is None:
        return others if own is None else own
    if np.any(np.asarray(others) != own):
        told = f"[gait] frequency = {own:g}, but the effects of the {kind_of(system)} have {formatted(others)}"
        raise Refusal(told, because="it is one swimmer, keep one")
    return own
