"""What commands are asked for: a scene, its field, and whether what it costs is wanted."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from geomech import terminal
from geomech.commands.options import check_outputs
from geomech.core.errors import Note, SceneError, check_angle, named

if TYPE_CHECKING:
    from geomech.scene import Scene

WORTH_SAYING = 1.0  # s that a field takes
NO_MAP = "a body of one joint has no map, a loop of it encloses no area: give it one joint more, or drop the figure"


def allow(scene, cost, yes: bool, worth_saying: float | None = None, less: str = "ask for less") -> None:
    """Say what is to come if it takes long, or so many seconds, or otherwise than expected; SceneError, which says what to do
    else, if it takes too long to be begun without --yes: here, or in its first second (`geomech.run.cost.decide`). From here
    on "auto" is the back end for that many balances."""
    from geomech.output.system import notes
    from geomech.run.backend import prefer_for
    from geomech.run.cost import decide

    prefer_for(cost.as_balances)
    for line in notes(scene.system) if hasattr(scene, "system") else ():  # an intruder scene has no system
        warnings.warn(f"{scene.name}: {line}", Note, stacklevel=2)  # once a command, however often it asks

    def judge(cost) -> None:
        cost.check(scene.name, yes, less)
        if not cost.small or (worth_saying is not None and cost.seconds >= worth_saying):
            terminal.tell(f"{scene.name}: {cost}")

    decide(cost, judge)


def scene_with_gait(name: str | Scene) -> Scene:
    """The scene of that name, or one that is loaded; SceneError for one without a gait."""
    from geomech.scene import Scene, load

    scene = load(name) if isinstance(name, str) else name
    name = name if isinstance(name, str) else scene.name
    if isinstance(scene, Scene):
        return scene
    if hasattr(scene, "robot"):
        raise SceneError(
            f"{name}: a robot that walks has no shape space: give it to 'geomech walk', 'sweep' or 'accuracy'"
        )
    raise SceneError(f"{name}: an intruder scene has no gait: give it to 'geomech intrude' or 'geomech accuracy'")


def loaded(name: str | Scene, grid: int | None = None, extent: float | None = None, medium: Path | None = None):
    """The scene of that name, or one that is loaded, with the options of its field, in the medium of a file if one is given."""
    from geomech.scene import in_medium
    from geomech.systems.capabilities import stored

    scene = scene_with_gait(name)
    own = stored(scene.system, "connection")
    if (grid, extent) != (None, None) and own:
        raise SceneError(f"{scene.name}: the field of a table has its file's own grid: drop --grid and --extent")
    if scene.system.traits.joint_angles and not own:
        check_angle("an extent", scene.numerics.extent if extent is None else extent)
    scene = scene.with_numerics(grid=grid, extent=extent)
    return in_medium(scene, medium) if medium else scene


def loaded_intruder(name: str):
    """The intruder scene of that name; SceneError for one with a gait."""
    from geomech.scene import Scene, WalkerScene, load

    scene = load(name)
    if isinstance(scene, (Scene, WalkerScene)):
        raise SceneError(f"{name}: a scene with a gait has no [intruder]: see 'geomech scenes' for those that have")
    return scene


def loaded_walker(name: str):
    """The scene of that name; SceneError for one without a robot."""
    from geomech.scene import WalkerScene, load

    scene = load(name)
    if not isinstance(scene, WalkerScene):
        raise SceneError(f"{name}: a scene without a [robot] does not walk: see 'geomech scenes' for those that do")
    return scene


@contextlib.contextmanager
def storing(scene, output: Path | None, **request) -> Iterator[None]:
    """Store what is computed in the body of the statement beside the output, a file or a folder, or, of what is only printed
    (None), in the user's cache folder; the same command resumes from there. At the end nothing is stored any more. request:
    the command with its options, but for where its results go. SceneError while another computation to the output is under
    way."""
    from geomech.io.files import refuse_inputs
    from geomech.run import jobs, store
    from geomech.run.digest import digest
    from geomech.scene import inputs

    files = inputs(scene)
    context = jobs.context_of([x for x in files if x != Path(scene.name)])
    path = store.in_cache(digest(context, scene, request)) if output is None else store.beside(output)
    refuse_inputs([path] if path else [], files)
    with jobs.storing(path, context, output):
        yield


def field(
    name, grid, extent, output: Path, plot: Path | None, maps: bool, yes: bool, with_gait: bool = False,
    harmonics: bool = False, metric: bool = False,
):  # fmt: skip
    """The scene's study with its field computed, once its outputs are known to be writable. maps: they show shape space.
    with_gait: and the gait, which is refused if it leaves the field. harmonics: with those of the velocity, where it has
    any beside the connection, and the metric, if it has one. metric: it must."""
    from geomech.study.bench import Study
    from geomech.study.cost import connection, of_even_part, of_metric, price
    from geomech.study.cost import harmonics as of_harmonics
    from geomech.study.effort import shared, why_none
    from geomech.tiers.fitted import fits

    scene = loaded(name, grid, extent)
    study, joints = Study(scene), scene.system.joints
    with named(scene.name):
        study.refuse_connection()
        if maps and joints == 1:
            raise SceneError(NO_MAP)
        if with_gait:
            study.refuse_outside()
        check_outputs(scene, output, plot)
        parts, jobs = [study.compute_field], connection(scene)
        if metric and (reason := why_none(scene.system)):
            raise SceneError(f"{scene.name}: {reason}")
        costed = metric or (harmonics and not why_none(scene.system))
        if costed:
            parts, jobs = [*parts, study.compute_metric], [*jobs, *of_metric(scene)]
        jobs += of_even_part(scene) if harmonics else []
        if harmonics and study.has_harmonics:
            parts.append(study.compute_harmonics)
            jobs += [] if costed and shared(scene.system) else of_harmonics(scene)
        less = f"lower --grid, to {fits(joints)} or less" if joints > 2 else "ask for less"
        allow(scene, price(jobs), yes, WORTH_SAYING, less)
    with terminal.progress(f"field of {scene.name}") as bar:
        for k, part in enumerate(parts):
            part(progress=lambda done: bar((k + done) / len(parts)))
    return study


MOST_PAIRS = 10  # of joints in a figure: those of five


def planes(study, pair: str | None, slice_: str | None, yes: bool) -> list:
    """The planes of shape space that ``--pair`` and ``--slice`` ask for, of all pairs of joints or one; other joints are where
    the middle of the scene's gait is, unless they are told."""
    from itertools import combinations

    from geomech.commands.options import numbers
    from geomech.study.cost import frame, of_planes, price

    scene, joints = study.scene, study.scene.system.joints
    with named(scene.name):
        study.refuse_connection()
        if joints == 1:
            raise SceneError(NO_MAP)
        pairs = [_pair(pair, joints)] if pair is not None else list(combinations(range(joints), 2))
        if len(pairs) > MOST_PAIRS:
            raise SceneError(
                f"{joints} joints have {len(pairs)} pairs: say which, such as --pair 1,{joints}, or give a chain [body] modes"
            )
        angles = numbers("--slice", slice_, angle=None) if slice_ is not None else None
        at = [_held(scene, one, angles, pair is not None) for one in pairs]
        allow(scene, price([*of_planes(scene, pairs, at), *frame(scene)]), yes, WORTH_SAYING)
    with terminal.progress(f"planes of {scene.name}") as bar:
        return [
            study.plane(one, shape, progress=lambda done, k=k: bar((k + done) / len(pairs)))
            for k, (one, shape) in enumerate(zip(pairs, at))
        ]


def _pair(text: str, joints: int) -> tuple[int, int]:
    """Joints from 0 of 1,3."""
    found = text.split(",")
    if len(found) != 2 or not all(x.strip().isdecimal() for x in found):
        raise SceneError(f"--pair: {text!r} is not two joints such as 1,{joints}")
    i, j = (int(x) - 1 for x in found)
    if i == j or not all(0 <= k < joints for k in (i, j)):
        raise SceneError(f"--pair: {text!r} must be two different joints from 1 to {joints}")
    return i, j


def _held(scene, pair: tuple[int, int], angles: list[float] | None, alone: bool):
    """The shape through which the plane of a pair of joints goes. alone: angles may be those of the joints that it holds."""
    import numpy as np

    from geomech.systems.capabilities import stored

    at, held = scene.gait.middle.copy(), [k for k in range(scene.system.joints) if k not in pair]
    if angles is not None and not held:
        raise SceneError("--slice says where other joints are held, and this body has but two: drop it")
    if angles is None:
        return at
    extent = scene.numerics.extent
    if not (stored(scene.system, "connection") or all(abs(a) <= extent for a in angles)):
        raise SceneError(
            f"--slice: the angles must lie within the field's {extent:g} rad: give others, or raise --extent"
        )
    if len(angles) == len(at) > 1:
        return np.array(angles)
    if len(angles) != 1 and not (alone and len(angles) == len(held)):
        ways = f"{len(held)} one by one, " * (alone and len(held) > 1) + "or "
        raise SceneError(
            f"--slice takes one angle for all joints that are held, {ways}{len(at)} for a shape, got {len(angles)}"
        )
    at[held] = angles
    return at


def beside_field(study, frame: str, yes: bool):
    """The study of the same scene in another body frame, with its field computed."""
    from geomech.study.cost import connection, price

    other = study.in_frame(frame)
    allow(other.scene, price(connection(other.scene)), yes, WORTH_SAYING)
    with terminal.progress(f"field of {other.scene.name}, frame {frame}") as bar:
        other.compute_field(bar)
    return other
